"""Images in real units, formats, and the effect of storing values in a format."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import view_image
from vkbloom._formats import FORMATS_BY_DTYPE, MAX_HALF

from ._sampling import Array

_FORMATS = {
    **FORMATS_BY_DTYPE,
    # There are no bloom buffers of doubles. Only the reference uses them, without clamps.
    "float64": "rgba32float",
}


def as_float(image: NDArray[Any], name: str, channels: Collection[int] | None = None) -> Array:
    """Return an image in real units."""
    array = view_image(image, name)
    if array.dtype.name not in _FORMATS:
        raise TypeError(
            f"{name}: {array.dtype} is not uint8, float16, float32 or float64"
            + f"; convert it: ({name} / 65535).astype(np.float32)" * (array.dtype.name == "uint16")
        )
    if array.ndim != 3 or 0 in array.shape:
        raise ValueError(f"{name}: shape {array.shape} is not (H, W, C)")
    if channels is not None and array.shape[2] not in channels:
        wanted = " or ".join(map(str, channels))
        raise ValueError(f"{name}: {array.shape[2]} channels are not {wanted}")
    real = array.astype(np.float64)
    return real / 255 if array.dtype == np.uint8 else real


def finite(image: Array) -> Array:
    """Return the image with 0 instead of NaN and infinity."""
    return np.where(np.isfinite(image), image, 0.0)


def format_of(image: NDArray[Any], format: str | None) -> str:
    """Return the format of the bloom buffers: `format`, or by default that of the image's dtype."""
    if format is not None:
        return format
    dtype = view_image(image, "image").dtype
    if dtype.name not in _FORMATS:
        raise TypeError(f"dtype: {dtype} is not one of {', '.join(_FORMATS)}")
    return _FORMATS[dtype.name]


@dataclasses.dataclass(frozen=True)
class Storage:
    """The effect of storing in a format: values are clamped to its range.

    - `low`, `high`: The range.
    - `rounding`: Rounds to the steps of a format where these are coarse. The tolerance of a
      comparison allows for the rounding of other formats.
    - `has_alpha`: Whether alpha can be blurred.
    - `is_of_frames`: Whether a published method reads the frame from this format, too.
    """

    low: float
    high: float
    rounding: Callable[[Array], Array] | None = None
    has_alpha: bool = True
    is_of_frames: bool = False

    @property
    def holds_means(self) -> bool:
        """Whether sums of levels are stored as means, since they would be clamped."""
        return self.high == 1 and self.rounding is None

    def __call__(self, image: Array) -> Array:
        """Return the image as stored."""
        if self.rounding is not None:
            return self.rounding(image)
        return np.clip(image, self.low, self.high)

    def first(self, image: Array) -> Array:
        """Return the first image of a published method as stored."""
        return self(image) if self.is_of_frames else self.end(image)

    def end(self, image: Array) -> Array:
        """Return the last image of a published method as stored.

        Engines use "rg11b10ufloat" for the levels only: the frame and the bloom have other
        formats, so that this format does not change them. The one with "rgba8unorm-srgb" reads the
        frame from it, too.
        """
        return image if self.rounding is not None else self(image)


@dataclasses.dataclass(frozen=True)
class BlurInput:
    """What the passes of a method read.

    - `image`: ndarray of float64, shape (H, W, C); The content of the first bloom buffer. Methods
      that read a luminance accept 1, 3 or, with alpha, 4 channels.
    - `size`: Width and height of the bloom.
    - `store`: The effect of storing values in a bloom buffer.
    - `mask`: ndarray of float64, shape (height, width, 1), optional; Multiplies the result of a
      published method's threshold. Other methods do not read it.
    """

    image: Array
    size: tuple[int, int]
    store: Storage
    mask: Array | None = None


def _as_rg11b10(image: Array) -> Array:
    """Round to the nearest values with 5 bits of exponent and 6 of mantissa, of blue 5.

    Ties go to the even value, as in IEEE 754. The smallest step is 2^-20, for blue 2^-19.
    """
    bits = np.array([6, 6, 5]) if image.shape[-1] == 3 else np.array(6)
    kept = np.clip(np.nan_to_num(image, nan=0.0, posinf=np.inf), 0, 2.0**16 - 2.0 ** (15 - bits))
    _, exponent = np.frexp(kept)
    step = np.exp2(np.maximum(exponent - 1, -14) - bits)
    rounded: Array = np.round(kept / step) * step
    return rounded


def _as_srgb8(image: Array) -> Array:
    """Round to the light of the nearest 8-bit level of sRGB; of alpha to the nearest level."""
    light = np.clip(np.nan_to_num(image, nan=0.0, posinf=np.inf), 0, 1)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    share = np.round(255 * encoded) / 255
    result = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    if image.shape[-1] == 4:
        result[..., 3] = np.round(255 * light[..., 3]) / 255
    return result


_STORAGES = {
    "rgba8unorm": Storage(0, 1),
    # Clamped, since a blur would spread an infinity over the picture.
    "rgba16float": Storage(-MAX_HALF, MAX_HALF),
    "rgba32float": Storage(-math.inf, math.inf),
    "rg11b10ufloat": Storage(0, 65024, _as_rg11b10, has_alpha=False),
    "rgba8unorm-srgb": Storage(0, 1, _as_srgb8, is_of_frames=True),
}


def storage(format: str) -> Storage:
    """Return the effect of storing values in a bloom buffer of a format."""
    if format not in _STORAGES:
        names = ", ".join(map(repr, _STORAGES))
        raise ValueError(f"format: {format!r} is not one of {names}")
    return _STORAGES[format]
