"""Read frames that an engine has written to files."""

from __future__ import annotations

import os
from typing import Any

from numpy.typing import NDArray

from vkbloom._argument_types import checked
from vkbloom._io import image_reading


@checked
def read_frame(path: str | os.PathLike[str]) -> NDArray[Any]:
    """Read an image file with its stored values.

    Parameters
    ----------
    path : str or path-like
        A file of a format that OpenImageIO reads, such as OpenEXR or PNG, with the channels RGB,
        RGBA, grey or grey with alpha. The first part is read.

    Returns
    -------
    ndarray, shape (H, W, 3) or (H, W, 4)
        float16 for half, float32 for float, uint8 for 8 bits. 16-bit integers become float32,
        decoded to linear values. Top row first.

    Raises
    ------
    OSError
        The file does not exist or cannot be opened; the error names it.
    ValueError
        The file is damaged or not such an image; the error names it.
    """
    stored = image_reading.load(path)
    try:
        return image_reading.decode(stored, raw=set(stored.numbers) == {"uint8"}).pixels
    except ValueError as error:
        raise ValueError(f"{os.fspath(path)}: {error}") from error
