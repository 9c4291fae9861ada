"""Animations: the frames of a scene in one GIF."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.io import safe_writing

__all__ = ["animation"]


@contextmanager
def animation(file: Path, rate: int) -> Iterator[Callable[[NDArray[Any]], None]]:
    """Give a function that adds a frame to a GIF, which is there when all are.

    Parameters
    ----------
    file : Path
        Its extension is .gif. An existing file is replaced when the new one is complete.
    rate : int
        Frames a second. A GIF has whole hundredths of a second for each frame.

    Raises
    ------
    OSError
        The file cannot be written; the error names it, and no partial file is left.
    ValueError
        A frame is not of uint8, or has another size than the first.
    ModuleNotFoundError
        OpenImageIO is missing.
    """
    oiio = import_extra("OpenImageIO", "images", "Writing images")
    temporary = safe_writing.reserve(file, 0)
    writer = oiio.ImageOutput.create(str(temporary))
    first: tuple[int, ...] | None = None

    def check(done: bool) -> None:
        if not done:
            raise safe_writing.write_error(writer, temporary, file)

    def add(array: NDArray[Any]) -> None:
        nonlocal first
        if array.dtype != np.uint8 or array.ndim != 3 or array.shape != (first or array.shape):
            raise ValueError(
                f"{file}: {array.dtype} of shape {array.shape} is no frame of an animation; name "
                "a framebuffer of uint8"
            )
        height, width, channels = array.shape
        spec = oiio.ImageSpec(width, height, channels, "uint8")
        spec.attribute("FramesPerSecond", oiio.TypeRational, (rate, 1))
        name = str(temporary)
        check(writer.open(name, spec, "AppendSubimage") if first else writer.open(name, spec))
        check(writer.write_image(np.ascontiguousarray(array)))
        first = array.shape

    try:
        yield add
        check(writer.close())
        safe_writing.check_complete(oiio, temporary, file)
        safe_writing.put_in_place(temporary, file)
    finally:
        # Read, so that OpenImageIO does not print it.
        writer.geterror()
        temporary.unlink(missing_ok=True)
