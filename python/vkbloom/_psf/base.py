"""The base class of the point-spread functions."""

from __future__ import annotations

import abc
import dataclasses
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._arrays import plain_array
from vkbloom._numbers import check_floats, check_number, check_size
from vkbloom._public import public
from vkbloom._settings.records import Record
from vkbloom._settings.registry import FUNCTIONS

if TYPE_CHECKING:
    from pathlib import Path

Array = NDArray[np.float64]

#: Degrees that the longer side of a frame spans where `pixels_per_degree` is None.
FRAME_DEGREES = 50.0


@public("vkbloom.psf")
class PSF(Record, abc.ABC):
    """Base class of the point-spread functions of `vkbloom.psf`.

    A point-spread function describes how the light of one point is distributed over a picture. If
    its `unit` is "degree", it is a density per steradian, and `pixels_per_degree` converts it to
    pixels. Otherwise it is defined in pixels. Two functions are equal, and have the same hash, if
    their classes and parameters are equal.

    Attributes
    ----------
    unit : {"degree", "pixel"}
    """

    _class_key: ClassVar[str] = "psf"
    _subject: ClassVar[str] = "psf"
    unit: ClassVar[Literal["degree", "pixel"]]

    def __init_subclass__(cls) -> None:
        # A class that is defined in pixels has no other use for `pixels_per_degree`.
        if "array" in vars(cls):
            cls.array = check_arguments(cls.array)  # type: ignore[method-assign]

    @abc.abstractmethod
    def array(self, size: tuple[int, int], pixels_per_degree: float | None = None) -> Array:
        """Return the energy of each pixel.

        Parameters
        ----------
        size : (int, int)
            Width and height in pixels.
        pixels_per_degree : float, optional
            Default: the longer side spans 50 degrees. Ignored if `unit` is "pixel".

        Returns
        -------
        ndarray of float64, shape (height, width, 3)
            Linear RGB. The point is at [height // 2, width // 2]. The values are integrals over
            the pixels, not samples at their centres.
        """

    @abc.abstractmethod
    def energy(self) -> Array:
        """Return the total energy of the function.

        Returns
        -------
        ndarray of float64, shape (3,)
            Linear RGB. The integral over the hemisphere if `unit` is "degree", the sum over the
            plane if it is "pixel".
        """

    @abc.abstractmethod
    def encircled_energy(self, radii: ArrayLike) -> Array:
        """Return the energy inside circles around the point.

        Parameters
        ----------
        radii : array-like of float, shape (N,)
            In degrees or pixels, at least 0.

        Returns
        -------
        ndarray of float64, shape (N, 3)
            Linear RGB. It rises to `energy` with the radius.
        """

    @abc.abstractmethod
    def mtf(self, frequencies: ArrayLike) -> Array:
        """Return the modulation transfer function along the horizontal.

        Parameters
        ----------
        frequencies : array-like of float, shape (N,)
            In cycles per degree, or per pixel, at least 0.

        Returns
        -------
        ndarray of float64, shape (N, 3)
            Absolute value of the Fourier transform, divided by `energy`: 1 at 0.
        """

    def kernel(
        self,
        frame: tuple[int, int],
        size: tuple[int, int] | None = None,
        pixels_per_degree: float | None = None,
    ) -> Array:
        """Return the kernel for the convolution of a frame.

        Parameters
        ----------
        frame : (int, int)
            Width and height of the frame in pixels.
        size : (int, int), optional
            Width and height of the kernel. Default: (2 width - 1, 2 height - 1) of the frame, so
            that the light of every pixel reaches every other pixel.
        pixels_per_degree : float, optional
            Default: the frame's longer side spans 50 degrees.

        Returns
        -------
        ndarray of float64, shape (height, width, 3)
        """
        scale = max(frame) / FRAME_DEGREES if pixels_per_degree is None else pixels_per_degree
        return self.array(size or self.default_size(frame), scale)

    def default_size(self, frame: tuple[int, int]) -> tuple[int, int]:
        """Return the width and height that `kernel` has by default, without the kernel.

        Parameters
        ----------
        frame : (int, int)
            Width and height of the frame in pixels.

        Returns
        -------
        (int, int)
        """
        width, height = frame
        return 2 * width - 1, 2 * height - 1

    def _in_larger_pixels(self, factor: float) -> PSF:
        """Return the function for pixels that are so many times as large, if it is known."""
        return self

    def save(
        self,
        path: str | os.PathLike[str],
        size: tuple[int, int] = (512, 512),
        pixels_per_degree: float | None = None,
    ) -> Path:
        """Write `array` to an image file.

        Parameters
        ----------
        path : str or path-like
            An OpenEXR file, which renderers can load as a kernel, or another file of floats.
        size, pixels_per_degree
            The arguments of `array`.

        Returns
        -------
        Path
            The file, which has float32 RGB.

        Raises
        ------
        ValueError, OSError, ModuleNotFoundError
            The errors of `vkbloom.write`.
        """
        from vkbloom._io import array_files  # noqa: PLC0415  costs start-up time

        return array_files.write(path, self.array(size, pixels_per_degree).astype(np.float32))

    @classmethod
    def _class_name(cls) -> str | None:
        return cls.__name__ if dataclasses.is_dataclass(cls) else None

    @classmethod
    def _classes(cls) -> Mapping[str, type[PSF]]:
        return functions()

    def _repr_png_(self) -> bytes:
        """Return a picture of 256 x 256, logarithmic, with six decades below the peak."""
        from vkbloom._views import pictures  # noqa: PLC0415  costs start-up time

        values = self.array((256, 256))
        scaled = 1 + np.log10(np.maximum(values / values.max(), 1e-6)) / 6
        return pictures.png(np.round(255 * scaled).astype(np.uint8))


def check_radii(name: str, values: ArrayLike) -> Array:
    """Return the values as a float64 array (N,), or raise TypeError or ValueError."""
    try:
        if np.iscomplexobj(values):
            raise TypeError
        numbers = plain_array(values, name).astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name}: {values!r} is not a sequence of numbers") from None
    if numbers.ndim != 1 or not (numbers >= 0).all():
        raise ValueError(f"{name}: {values!r} is not a sequence of numbers of at least 0")
    return numbers


def check_wavelengths(wavelengths: Any) -> tuple[float, ...]:
    """Return wavelengths in nm as floats, or raise TypeError or ValueError."""
    lengths = check_floats("wavelengths", wavelengths)
    for length in lengths:
        check_number("wavelengths", length, 380, 780)
    return lengths


def in_grey(values: Array) -> Array:
    """Return values with three equal channels as the last axis."""
    return np.repeat(values[..., np.newaxis], 3, axis=-1)


def seen_in_grey(values: Array) -> Array:
    """Return a read-only view of values, with three equal channels as the last axis."""
    return np.broadcast_to(values[..., np.newaxis], (*values.shape, 3))


def crop_or_pad(array: Array, size: tuple[int, int]) -> Array:
    """Return the array cropped, or extended by zeros, around its centre [h // 2, w // 2]."""
    width, height = check_size("size", size)
    result = np.zeros((height, width, *array.shape[2:]))
    windows: list[tuple[slice, slice]] = []
    for length, wanted in zip(array.shape[:2], (height, width), strict=True):
        first = max(0, length // 2 - wanted // 2)
        start = max(0, wanted // 2 - length // 2)
        count = min(length - first, wanted - start)
        windows.append((slice(first, first + count), slice(start, start + count)))
    (rows, to_rows), (columns, to_columns) = windows
    result[to_rows, to_columns] = array[rows, columns]
    return result


def functions() -> dict[str, type[PSF]]:
    """Return the point-spread functions that there are now, by name."""
    # Classes of users are known when they are defined; those of the package are imported here.
    kinds = [*_leaves(PSF), *FUNCTIONS.values()]
    return dict(sorted({kind.__name__: kind for kind in kinds}.items()))


def _leaves(kind: type[Any]) -> list[type[Any]]:
    """Return the classes below `kind` that have parameters."""
    kinds: list[type[Any]] = []
    for below in kind.__subclasses__():
        kinds += [below] if dataclasses.is_dataclass(below) else _leaves(below)
    return kinds
