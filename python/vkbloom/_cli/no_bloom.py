"""Notes for a bloom that is zero, or that alpha hides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from numpy.typing import NDArray

from vkbloom._renderer.frames import Frames
from vkbloom._settings.settings import Settings

# The smallest alpha and the smallest light that 8 bits can hold.
_MIN_VISIBLE: Final = 1 / 255


def with_bloom(names: str | Sequence[str], settings: Settings) -> str | list[str]:
    """Return the framebuffers to request: also bloom, unless it is off."""
    if isinstance(names, str):
        return names
    return [*names, *["bloom"] * (settings.bloom and "bloom" not in names)]


def only(frames: Frames, names: str | Sequence[str]) -> Frames:
    """Return frames with only these framebuffers; "all": with all."""
    if isinstance(names, str) or set(frames) == set(names):
        return frames
    return frames._with({name: array for name, array in frames.items() if name in names})


def is_without(frames: Frames) -> bool:
    """Whether the frames have a bloom that is zero everywhere."""
    return "bloom" in frames and not frames["bloom"][:, :, :3].any()


def describe_hidden(final: NDArray[Any], settings: Settings) -> str:
    """Return a text if light lies on transparent pixels of a file with straight alpha; else ""."""
    if not settings.bloom or settings.alpha != "keep" or final.shape[2] != 4:
        return ""
    is_clear = final[:, :, 3] < _MIN_VISIBLE
    if not (
        final[:, :, :3].max(axis=2, where=is_clear[:, :, None], initial=0) >= _MIN_VISIBLE
    ).any():
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
