"""Contenders of vkbloom's own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from numpy.typing import NDArray

import vkbloom
from benchmarks.timing import Contender, device_clock

__all__ = ["contender"]


def contender(
    name: str,
    renderer: vkbloom.Renderer,
    images: Iterator[NDArray[Any]],
    settings: vkbloom.Settings,
) -> Contender:
    """Return the bloom of the next of `images`, on a GPU by the device's clock.

    All contenders of a renderer take their images from one iterator, of which none is the one
    before: a call with the image of the call before it would not run all of its passes.
    """
    return Contender(
        name,
        lambda _: renderer.apply(next(images), settings, attachments=("final",)),
        device_clock(renderer.info),
    )
