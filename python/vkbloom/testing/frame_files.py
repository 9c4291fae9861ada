"""Frames that an engine has written to files."""

from __future__ import annotations

import os
from typing import Any

from numpy.typing import NDArray

from vkbloom.io import image_reading

__all__ = ["read_frame"]


def read_frame(path: str | os.PathLike[str]) -> NDArray[Any]:
    """Read an image file with the values that it stores.

    Parameters
    ----------
    path : str or path-like
        OpenEXR, PNG or another format that OpenImageIO reads, with the channels RGB, RGBA, grey or
        grey with alpha; of OpenEXR files with several parts, the first.

    Returns
    -------
    ndarray, shape (H, W, 3) or (H, W, 4)
        float16 of half, float32 of float, uint8 of 8 bits; of 16 bits float32, decoded to linear
        values as `vkbloom.io.image_reading.decode` does. Top row first.

    Raises
    ------
    OSError
        The file is not there, or cannot be opened; it names the file.
    ValueError
        The file is damaged or no such image; it names the file.
    ModuleNotFoundError
        OpenImageIO is missing: ``pip install vkbloom[images]``.

    See Also
    --------
    FrameRegression.check : Compares frames with references.

    Examples
    --------
    >>> import tempfile
    >>> from vkbloom import testing
    >>> frames = vkbloom.Frames(
    ...     {"final": np.full((8, 8, 3), 0.5, np.float16)},
    ...     timings={},
    ...     settings=vkbloom.Separable(),
    ...     info={},
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     (path,) = frames.save(f"{folder}/frame.exr")
    ...     frame = testing.read_frame(path)
    >>> frame.shape, frame.dtype
    ((8, 8, 3), dtype('float16'))
    """
    stored = image_reading.load(path)
    try:
        return image_reading.decode(stored, raw=set(stored.numbers) == {"uint8"}).pixels
    except ValueError as error:
        raise ValueError(f"{os.fspath(path)}: {error}") from error
