"""The contenders of vkbloom, and their names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from numpy.typing import NDArray

import vkbloom
from benchmarks.timing import Contender, device_clock

__all__ = ["FRAGMENT", "OURS", "contender"]

OURS: Final = "vkbloom"
FRAGMENT: Final = "vkbloom, the source's fragment variant"


def contender(
    name: str,
    renderer: vkbloom.Renderer,
    images: Iterator[NDArray[Any]],
    settings: vkbloom.Settings,
) -> Contender:
    """Return a contender that renders the bloom of the next image, with the device's clock on GPUs.

    All contenders of a renderer share one iterator, whose images all differ from the one before. A
    call with the image of the previous call would not run all passes.
    """
    return Contender(
        name,
        lambda _: renderer.apply(next(images), settings, framebuffers=("final",)),
        device_clock(renderer.info),
    )
