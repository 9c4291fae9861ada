"""Animations: many frames in one GIF."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._checks import import_extra
from vkbloom._io import safe_writing

__all__ = ["animation"]


@contextmanager
def animation(file: Path, rate: int) -> Iterator[Callable[[NDArray[Any]], None]]:
    """Yield a function that adds a frame to a GIF."""
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    shape: tuple[int, ...] | None = None

    def add(array: NDArray[Any]) -> None:
        nonlocal shape
        if array.dtype != np.uint8 or array.ndim != 3 or array.shape != (shape or array.shape):
            raise ValueError(
                f"{file}: {array.dtype} of shape {array.shape} is not a frame of an animation; "
                "name a framebuffer of uint8"
            )
        height, width, channels = array.shape
        spec = oiio.ImageSpec(width, height, channels, "uint8")
        spec.attribute("FramesPerSecond", oiio.TypeRational, (rate, 1))
        name = str(temporary)
        check(writer.open(name, spec, "AppendSubimage") if shape else writer.open(name, spec))
        check(writer.write_image(np.ascontiguousarray(array)))
        shape = array.shape

    with safe_writing.writing(oiio, file) as (writer, temporary, check):
        yield add
