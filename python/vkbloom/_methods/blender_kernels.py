"""The kernels of Blender's Glare node: those of Fog Glow, and an image."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom.psf._eye import spencer

if TYPE_CHECKING:
    from vkbloom._methods.blender import BlenderGlare
    from vkbloom.psf._base import PSF


#: What the sides are divided by.
FACTORS: Final = {"high": 1, "medium": 2, "low": 4}


def glare_size(buffers: tuple[int, int], quality: str) -> tuple[int, int]:
    """Return the size in which the glare is computed."""
    width, height = (-(-side // FACTORS[quality]) for side in buffers)
    return width, height


def kernel_of(settings: BlenderGlare, buffers: tuple[int, int]) -> NDArray[np.float64]:
    """Return the kernel in pixels of the glare, (h, w, 3), with its point at [h // 2, w // 2]."""
    size = glare_size(buffers, settings.quality)
    if settings.type == "kernel":
        psf = cast("PSF | None", settings.kernel)
        image = np.ones((1, 1, 3)) if psf is None else psf.kernel(size)
        if settings.version == "5.2" and settings.quality != "high":
            image = _reduced(image, FACTORS[settings.quality])
        return _turned(_normalized(image))
    values = (_fog_glow_of_4_3 if settings.version == "4.3" else _fog_glow)(size, settings.size)
    return np.repeat(values[..., np.newaxis], 3, axis=2)


def kernel_sides(settings: BlenderGlare, buffers: tuple[int, int]) -> tuple[int, int]:
    """Return the kernel's width and height."""
    if settings.type == "kernel":
        height, width = kernel_of(settings, buffers).shape[:2]
        return width, height
    width, height = glare_size(buffers, settings.quality)
    if settings.version == "4.3":
        side = _side_of_4_3((width, height), settings.size)
        return side, side
    return 2 * width - 1, 2 * height - 1


def _even_length(least: int) -> int:
    """Return the next even number without a prime factor above 7."""
    length = least + least % 2
    while True:
        rest = length
        for factor in (2, 3, 5, 7):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return length
        length += 2


def _fog_glow(size: tuple[int, int], share: float) -> NDArray[np.float64]:
    """Return Spencer's function at the pixels' centres, over its sum in Blender's transform."""
    longer = max(size)
    degrees = (180 + share ** (1 / 3) * (10 - 180)) / longer
    # Blender's transform has room for an image and a kernel of the longer side.
    lengths = [_even_length(side + longer - 1) for side in size]
    around = [np.minimum(np.arange(n), n - np.arange(n)) for n in lengths]
    offsets = [np.arange(1 - side, side) for side in size]
    density = spencer().density

    def at(columns: Any, rows: Any) -> NDArray[np.float64]:
        values: NDArray[np.float64] = density(degrees * np.hypot(columns, rows[:, np.newaxis]))
        return values[..., 0]

    kernel: NDArray[np.float64] = at(*offsets) / at(*around).sum()
    return kernel


def _side_of_4_3(size: tuple[int, int], share: float) -> int:
    return int(max(size) * share) // 2 * 2 + 1


def _fog_glow_of_4_3(size: tuple[int, int], share: float) -> NDArray[np.float64]:
    """Return the kernel of `vkbloom.psf.fog_glow` with an odd side, over its sum."""
    side = _side_of_4_3(size, share)
    u = np.arange(-(side // 2), side // 2 + 1) / max(side // 2, 1)
    radius = (u**2 + u[:, np.newaxis] ** 2) * side / 4
    window = (1 + np.cos(np.pi * u)) / 2
    values = np.exp(-9 * radius**0.125) * window * window[:, np.newaxis]
    return _normalized(values)


def _normalized(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Divide each channel by its sum, if that is not 0."""
    sums = values.sum(axis=(0, 1))
    result: NDArray[np.float64] = values / np.where(sums == 0, 1, sums)
    return result


def _reduced(image: NDArray[np.float64], factor: int) -> NDArray[np.float64]:
    """Return the image bilinearly at the centres of fewer pixels; black, if there are none."""
    for length in image.shape[:2]:
        count = length // factor
        if count == 0:
            return np.zeros((1, 1, image.shape[2]))
        position = (np.arange(count) + 0.5) / count * length - 0.5
        low = position.astype(int)
        part = (position - low)[:, np.newaxis, np.newaxis]
        image = (1 - part) * image[low] + part * image[np.minimum(low + 1, length - 1)]
        image = image.swapaxes(0, 1)
    return image


def _turned(kernel: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the image turned by 180 degrees.

    Blender counts rows from the bottom and takes the pixel [h // 2, w // 2] for the point. Turned,
    this is the pixel after the middle of an even width, for which a column of zeros makes room.
    """
    turned = kernel[::-1, ::-1]
    room = 1 - kernel.shape[1] % 2
    return np.pad(turned, ((0, 0), (room, 0), (0, 0)))
