"""Convolution with a kernel, by numpy.fft."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vkbloom._psf.varying import Varying

from ._image import BlurInput
from ._sampling import Array, sample, size_of
from ._tape import contiguous, join_curves, operation, value_of
from ._threshold import luminance
from ._varying import channel_kernels, spread_field

if TYPE_CHECKING:
    from vkbloom._methods.convolution import Convolution


def passes(source: BlurInput, settings: Convolution) -> dict[str, Array]:
    """Return "kernel" and "bloom"; a kernel that depends on the place is no framebuffer.

    Three channels are convolved with the channels of the kernel. A fourth channel is convolved with
    the mean of these, and so is every channel of an image with another number of channels.
    """
    if isinstance(getattr(settings, "psf", None), Varying):
        spread = spread_field(source.image, settings, source.size, convolve)
        return {"bloom": source.store(sample(spread, source.size))}
    kernel = settings.kernel(source.size, size_of(source.image))
    used = channel_kernels(kernel, source.image.shape[2])
    spread = convolve(filter_bright(source.image, settings.prefilter), used, settings.boundary)
    return {"kernel": kernel, "bloom": source.store(sample(spread, source.size))}


def gain(settings: Convolution, size: tuple[int, int]) -> Array:
    """Return the bloom of a flat image of 1 far from a boundary of zeros: the kernel's sums.

    Of a kernel that depends on the place: the mean.
    """
    psf = getattr(settings, "psf", None)
    if isinstance(psf, Varying):
        return psf.energy()
    flat = filter_bright(np.ones((1, 1, 3)), settings.prefilter)[0, 0]
    sums: Array = flat * settings.kernel(size).sum(axis=(0, 1))
    return sums


def filter_bright(glow: Array, prefilter: tuple[float, float, float]) -> Array:
    """Return the glow past Unreal Engine's filter of bright colours.

    A colour whose luminance L is above min gets the luminance min(mult (L - min) + min, max).
    """
    low, high, factor = prefilter
    if high < low or glow.shape[2] not in (3, 4):
        return glow
    light = luminance(glow[..., :3])
    wanted = np.minimum(factor * (light - low) + low, high)
    scale = np.where(light > 0, wanted / np.maximum(light, 1e-30), factor)
    rgb = join_curves(light, low, glow[..., :3], glow[..., :3] * scale)
    return np.concatenate([rgb, glow[..., 3:]], axis=2)


def convolve(glow: Array, kernel: Array, boundary: str) -> Array:
    """Return sum over j, i of K[j, i] glow[y - (j - h // 2), x - (i - w // 2)].

    The glow is extended by as much as the kernel reaches, so that the Fourier transform's own
    wrapping falls outside.
    """
    rows, columns = kernel.shape[:2]
    modes: dict[str, tuple[Any, Any]] = {
        "zero": ("constant", "constant"),
        "edge": ("edge", "edge"),
        "wrap": ("wrap", "wrap"),
        "mirror": ("symmetric", "symmetric"),
        "wrap_x": ("edge", "wrap"),
    }
    down, across = modes[boundary]
    # A pixel takes from the right what the kernel has left of its point, and the other way round.
    extended = np.pad(glow, ((rows - 1 - rows // 2, rows // 2), (0, 0), (0, 0)), down)
    extended = np.pad(
        extended, ((0, 0), (columns - 1 - columns // 2, columns // 2), (0, 0)), across
    )
    return _valid(extended, kernel)


def _valid(image: Array, kernel: Array) -> Array:
    """Return the convolution where the kernel lies inside of the image."""
    shape = image.shape[:2]
    values = [np.fft.rfft2(value_of(part), shape, axes=(0, 1)) for part in (image, kernel)]
    rows, columns = (image.shape[i] - kernel.shape[i] + 1 for i in (0, 1))

    def spread(product: Any) -> Array:
        whole: Array = np.fft.irfft2(product, shape, axes=(0, 1))
        return whole

    def spectrum(derivative: Array) -> Any:
        placed = np.zeros(image.shape)
        placed[kernel.shape[0] - 1 :, kernel.shape[1] - 1 :] = derivative
        return np.fft.rfft2(placed, axes=(0, 1))

    # From the first pixel on whose sum is complete.
    result = spread(values[0] * values[1])[-rows:, -columns:]
    valid: Array = operation(
        contiguous(result),
        (image, lambda d: spread(spectrum(d) * values[1].conj())),
        (
            kernel,
            lambda d: spread(spectrum(d) * values[0].conj())[: kernel.shape[0], : kernel.shape[1]],
        ),
    )
    return valid
