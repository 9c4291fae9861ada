"""Notes for settings with which the bloom is zero."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom.frames import Frames
from vkbloom.settings import Settings

__all__ = ["brightest_of", "is_without", "only", "reason", "with_bloom"]


def with_bloom(names: str | Sequence[str], settings: Settings) -> str | list[str]:
    """Return the framebuffers to request: also the bloom, unless it is turned off."""
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


def reason(settings: Settings, brightest: float | None = None) -> str:
    """Return a text that the bloom is zero, with the reason if it is known."""
    text = "the bloom is zero everywhere"
    if settings.threshold is not None:
        text += f": no value is above the threshold {settings.threshold:g}"
    return text if brightest is None else f"{text}; the brightest value is {brightest:.3g}"
