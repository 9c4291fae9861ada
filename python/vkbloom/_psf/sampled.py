"""Point-spread functions that are arrays, defined in pixels."""

from __future__ import annotations

import abc
import dataclasses
import functools
import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from vkbloom._psf.base import PSF, Array, check_radii, crop_or_pad, in_grey
from vkbloom._psf.values import ArrayValue
from vkbloom._public import public
from vkbloom._settings.fields import value_field


class SampledPSF(PSF):
    """A point-spread function that is an array of energies per pixel, of a fixed size."""

    unit = "pixel"

    @abc.abstractmethod
    def native_array(self) -> Array:
        """Return the energy per pixel in the function's own size, (h, w, 3). Outside it is 0."""

    def array(self, size: tuple[int, int], pixels_per_degree: float | None = None) -> Array:
        return crop_or_pad(self.native_array(), size)

    def energy(self) -> Array:
        return np.asarray(self.native_array().sum(axis=(0, 1)))

    def encircled_energy(self, radii: ArrayLike) -> Array:
        """Return the energy of the pixels whose centres are inside circles around the point.

        Parameters
        ----------
        radii : array-like of float, shape (N,)
            In pixels, at least 0.

        Returns
        -------
        ndarray of float64, shape (N, 3)
        """
        values = self.native_array()
        y, x = (np.arange(side) - side // 2 for side in values.shape[:2])
        distance = np.hypot(y[:, np.newaxis], x).ravel()
        order = np.argsort(distance, kind="stable")
        sums = np.concatenate([np.zeros((1, 3)), values.reshape(-1, 3)[order].cumsum(axis=0)])
        inside = np.searchsorted(distance[order], check_radii("radii", radii), side="right")
        return np.asarray(sums[inside])

    def mtf(self, frequencies: ArrayLike) -> Array:
        lines = self.native_array().sum(axis=0)
        positions = np.arange(len(lines)) - len(lines) // 2
        cycles = check_radii("frequencies", frequencies)
        waves = np.exp(-2j * np.pi * np.outer(cycles, positions))
        return np.asarray(np.abs(waves @ lines) / lines.sum(axis=0))


def check_values(name: str, values: Any) -> ArrayValue:
    """Return an array (h, w) or (h, w, 3) of finite numbers, or raise TypeError or ValueError."""
    if isinstance(values, str | bytes | os.PathLike):
        raise TypeError(
            f"{name}: an array is needed, not {values!r}; read a file first: vkbloom.read(...)"
        )
    held = ArrayValue(values, name)
    array = held.array
    if array.ndim not in (2, 3) or array.shape[2:] not in ((), (3,)) or 0 in array.shape:
        raise ValueError(
            f"{name}: shape {array.shape} is not (h, w) or (h, w, 3) with sides of at least 1"
        )
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: some numbers are not finite as float32")
    return held


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class samples(SampledPSF):
    """An array as a point-spread function.

    Parameters
    ----------
    values : array-like, shape (h, w) or (h, w, 3)
        Energies per pixel, which must be finite. The point is at [h // 2, w // 2]. The array is
        copied to float32.
    """

    values: Any = value_field(read=functools.partial(check_values, "values"))

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.values.array, dtype=dtype, copy=copy)

    def native_array(self) -> Array:
        return rgb(self.values)

    def default_size(self, frame: tuple[int, int]) -> tuple[int, int]:
        height, width = self.values.array.shape[:2]
        return width, height

    def kernel(
        self,
        frame: tuple[int, int],
        size: tuple[int, int] | None = None,
        pixels_per_degree: float | None = None,
    ) -> Array:
        return self.native_array() if size is None else crop_or_pad(self.native_array(), size)


def rgb(values: ArrayValue) -> Array:
    """Return an array (h, w) or (h, w, 3) as float64 (h, w, 3)."""
    array = values.array.astype(np.float64)
    return in_grey(array) if array.ndim == 2 else array
