"""Notes for a bloom that is zero, that darkens, or that alpha hides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._renderer.frames import Frames
from vkbloom._settings.settings import Settings

# Highlights that keep this share are as bright as before: a level of 8 bits near white is 0.9 %.
_DARKER = 0.985
# No pixel of an image whose values are below it is a highlight.
_BLACK = 1e-6
# The smallest alpha and the smallest light that 8 bits can hold.
_MIN_VISIBLE = 1 / 255


def with_bloom(names: str | Sequence[str], settings: Settings) -> str | list[str]:
    """Return the framebuffers to request: also bloom, unless it is off."""
    if isinstance(names, str):
        return names
    return [*names, *["bloom"] * (settings.bloom and "bloom" not in names)]


def only(frames: Frames, names: str | Sequence[str]) -> Frames:
    """Return frames with only these framebuffers; "all": with all."""
    if isinstance(names, str) or set(frames) == set(names):
        return frames
    return Frames(
        {name: array for name, array in frames.items() if name in names},
        timings=frames.timings,
        settings=frames.settings,
        info=frames.info,
    )


def is_without(frames: Frames) -> bool:
    """Whether the frames have a bloom that is zero everywhere."""
    return "bloom" in frames and not frames["bloom"][:, :, :3].any()


def brightest_of(pixels: NDArray[Any]) -> float:
    """Return the largest finite value of an image; uint8 is scaled to 0..1."""
    colours = pixels[:, :, :3]
    scale = np.float32(255 if pixels.dtype == np.uint8 else 1)
    return float(np.max(colours, initial=0, where=np.isfinite(colours)) / scale)


def darkening(pixels: NDArray[Any], frames: Frames) -> str:
    """Return a text if the bloom darkens the highlights that a display shows; "" if not.

    Highlights are the pixels of at least 0.9 of the brightest value, or of white. Curves are left
    out: what they darken is asked for.
    """
    settings = frames.settings
    if not settings.bloom or (settings.tonemap, settings.exposure) != ("none", 0):
        return ""
    before, after = (
        np.clip(np.nan_to_num(image[:, :, :3].astype(np.float32)) / scale, 0, 1).max(axis=2)
        for image, scale in (
            (item, 255 if item.dtype == np.uint8 else 1) for item in (pixels, frames["final"])
        )
    )
    brightest = float(before.max(initial=0))
    if brightest < _BLACK:
        return ""
    lit = before >= 0.9 * brightest
    change = float(after[lit].mean()) / float(before[lit].mean())
    if settings.encoding != "none" or change > _DARKER:
        return ""
    return (
        f"the bloom darkens the highlights to {100 * change:.0f} % of their light: the composite "
        f"{settings.composite} takes light from them; add it with --composite add or --preset photo"
    )


def hidden(final: NDArray[Any], settings: Settings) -> str:
    """Return a text if light lies on transparent pixels of a file with straight alpha; else ""."""
    if not settings.bloom or settings.alpha != "keep" or final.shape[2] != 4:
        return ""
    least = _MIN_VISIBLE * (255 if final.dtype == np.uint8 else 1)
    is_clear = final[:, :, 3] < least
    if not (final[:, :, :3].max(axis=2, where=is_clear[:, :, None], initial=0) >= least).any():
        return ""
    return (
        "the bloom on transparent pixels is not visible, because alpha hides it; --alpha max or "
        "--alpha blur gives the bloom its own alpha"
    )


def reason(settings: Settings, brightest: float | None = None) -> str:
    """Return a text that the bloom is zero, with the reason if it is known."""
    text = "the bloom is zero everywhere"
    if settings.threshold is not None:
        text += f": no value is above the threshold {settings.threshold:g}"
    return text if brightest is None else f"{text}; the brightest value is {brightest:.3g}"


def notes(frames: Frames, image: NDArray[Any]) -> Iterator[str]:
    """Yield that the bloom is zero everywhere, or that it darkens."""
    if is_without(frames):
        yield reason(frames.settings, brightest_of(image))
    elif text := darkening(image, frames):
        yield text
