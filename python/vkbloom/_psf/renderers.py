"""Point-spread functions of renderers."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vkbloom._array_cache import keep
from vkbloom._formats import LUMINANCE, MAX_FLOAT
from vkbloom._psf.base import PSF, Array, crop_or_pad, in_grey
from vkbloom._psf.resampling import box_resample
from vkbloom._psf.sampled import SampledPSF, check_values, rgb
from vkbloom._public import public
from vkbloom._settings.fields import number_field, numbers_field, value_field

if TYPE_CHECKING:
    from vkbloom._psf.values import ArrayValue


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class fog_glow(SampledPSF):
    """The kernel of Blender's Fog Glow before version 4.4, defined in pixels.

    Parameters
    ----------
    size : int
        Side of the square kernel in pixels, 2 to 4096. Blender has powers of 2, 64 to 512.

    Notes
    -----
    With the size s, u = 2 x / s - 1, v = 2 y / s - 1 and r = (u^2 + v^2) s / 4, the value of a
    pixel is exp(-9 r^(1/8)) (1/2 + cos(pi u) / 2) (1/2 + cos(pi v) / 2). As in Blender, it is not
    integrated over the pixel. The sum is not 1; Blender divides by it.

    Source: Blender 4.3, source/blender/compositor/operations/COM_GlareFogGlowOperation.cc.
    """

    size: int = number_field(default=256, range=(2, 4096), unit="pixel", slider=(2, 1024))

    def native_array(self) -> Array:
        u = 2 * np.arange(self.size) / self.size - 1
        # Puts the point of an odd side at its centre.
        u = u - u[self.size // 2]
        radius = (u**2 + u[:, np.newaxis] ** 2) * self.size / 4
        window = (1 + np.cos(np.pi * u)) / 2
        values = np.exp(-9 * radius**0.125) * window * window[:, np.newaxis]
        return in_grey(values)


def _check_image(image: Any) -> SampledPSF | ArrayValue:
    if isinstance(image, Mapping) and "psf" in image:
        image = PSF.from_dict(image)
    if isinstance(image, PSF):
        if not isinstance(image, SampledPSF):
            raise ValueError(f"image: {image!r} is not defined in pixels; use its array(size)")
        return image
    held = check_values("image", image)
    if (held.array < 0).any() or not held.array.any():
        raise ValueError("image: some values are below 0, or all of them are 0")
    return held


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class unreal(SampledPSF):
    """The kernel that Unreal Engine's convolution bloom makes from an image, defined in pixels.

    Parameters
    ----------
    image : array-like, shape (h, w) or (h, w, 3), or PSF
        The kernel image K, finite and at least 0. An array is copied to float32. A function must be
        defined in pixels; its negative values become 0.
    center : (float, float) or None
        Position of the point in the image, as shares of its width and height, 0 to 1. None: the
        brightest texel.
    size : float
        Longer side of the kernel as a share of the frame's longer side, 0.001 to 4.
    prefilter : (float, float, float)
        min, max and mult, each at least 0. Before the convolution, a luminance L (Rec. 709) above
        min becomes min(mult (L - min) + min, max). There is no prefilter if max < min.
    scatter : float
        The s of the formulas, which multiplies the share of light that leaves its pixel, 0 to 1000.

    Notes
    -----
    M is the largest value of the texels around the 3 x 3 texels of the point. C is the sum of
    max(K - M, 0) over the 3 x 3 texels. S is the sum of K' = min(K, M) over the image, and
    T = C + S. A pixel keeps the share clamp((T - s S) / T, 0, 1) of its light. K' / S distributes
    the share clamp(s S / T, 0, 1). All this is done for each channel. Then each channel is
    multiplied by its T, divided by the largest T. K' is resampled by area.

    Source: Unreal Engine 5, Engine/Shaders/Private/Bloom/ and
    Engine/Source/Runtime/Renderer/Private/PostProcess/PostProcessFFTBloom.cpp.
    """

    image: Any = value_field(read=_check_image)
    center: tuple[float, float] | None = numbers_field(None, 0, 1, count=(2, 2))
    size: float = number_field(default=1.0, range=(0.001, 4))
    prefilter: tuple[float, float, float] = numbers_field((7.0, 15000.0, 15.0), high=MAX_FLOAT)
    scatter: float = number_field(default=1.0, range=(0, 1000))

    def native_array(self) -> Array:
        height, width = _image_of(self).shape[:2]
        return _scatter(self, max(width, height) / self.size)

    def array(self, size: tuple[int, int], pixels_per_degree: float | None = None) -> Array:
        return self.kernel(size, size)

    def kernel(
        self,
        frame: tuple[int, int],
        size: tuple[int, int] | None = None,
        pixels_per_degree: float | None = None,
    ) -> Array:
        width, height = size or (2 * frame[0] - 1, 2 * frame[1] - 1)
        return crop_or_pad(_scatter(self, max(frame), (height, width)), (width, height))


@keep
def _scatter(psf: unreal, longer_side: float, room: tuple[int, int] | None = None) -> Array:
    """Return the kernel for a frame with this longer side, of at most this height and width.

    The kernel of a frame of 16384 x 1 would have 16384 rows, of which one counts.
    """
    image = _image_of(psf)
    row, column = _point(image, psf.center)
    centre = (slice(max(row - 1, 0), row + 2), slice(max(column - 1, 0), column + 2))
    around = image[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3].copy()
    top, left = row - max(row - 2, 0), column - max(column - 2, 0)
    around[max(top - 1, 0) : top + 2, max(left - 1, 0) : left + 2] = 0
    most = around.max(axis=(0, 1))
    kept = np.maximum(image[centre] - most, 0).sum(axis=(0, 1))
    spread = np.minimum(image, most)
    spread_sum = spread.sum(axis=(0, 1))
    total = kept + spread_sum
    if not (total > 0).any():
        raise ValueError("image: it is black except for one texel")
    share = np.clip(psf.scatter * spread_sum / np.maximum(total, 1e-30), 0, 1)
    tint = total / total.max()
    pixels = longer_side * psf.size / max(image.shape[:2])
    spread = spread * np.divide(tint * share, spread_sum, where=spread_sum > 0, out=np.zeros(3))
    kernel = box_resample(spread, (row, column), (pixels, pixels), room)
    kernel[kernel.shape[0] // 2, kernel.shape[1] // 2] += tint * (1 - share)
    kernel.flags.writeable = False
    return kernel


def _image_of(psf: unreal) -> Array:
    """Return the kernel image, (h, w, 3)."""
    if isinstance(psf.image, SampledPSF):
        return np.maximum(psf.image.native_array(), 0)
    return rgb(psf.image)


def _point(image: Array, center: tuple[float, float] | None) -> tuple[int, int]:
    """Return the row and the column of the point."""
    height, width = image.shape[:2]
    if center is not None:
        return (
            min(height - 1, math.floor(center[1] * height)),
            min(width - 1, math.floor(center[0] * width)),
        )
    brightness = image @ np.array(LUMINANCE)
    row, column = np.unravel_index(int(np.argmax(brightness)), (height, width))
    return int(row), int(column)
