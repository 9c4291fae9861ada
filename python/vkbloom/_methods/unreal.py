"""Unreal Engine's standard bloom."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import MAX_HALF
from vkbloom._methods.gaussian_sum import GaussianSum, gaussian
from vkbloom._public import public
from vkbloom._settings.fields import number_field, numbers_field


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class UnrealBloom(GaussianSum):
    """Unreal Engine's standard bloom, by its documentation. Nothing of the engine ran.

    Parameters
    ----------
    sizes : tuple of 6 floats
        Diameters of the Gaussians in percent of the frame's width.
    tints : tuple of 6 floats
        Factor of each Gaussian.
    size_scale : float
        Factor of all sizes, 0 to 64.
    threshold : float or None
        Luminance, -1 to 65504, at which a colour begins to contribute; from 1 above it is complete.
        -1: every colour contributes, as without a threshold.
    composite : {"add"}
    intensity : float
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    ``bloom`` is the convolution of the frame, times clamp(luminance - threshold, 0, 1), with what
    `kernel` returns, the sum of the tints times Gaussians whose sums are 1. The standard deviation
    is a sixth of the diameter, which is this project's reading of it, and each is cut off at three
    standard deviations, rounded up to pixels. Outside of the frame are its outermost pixels. The
    engine limits its kernels; this is the formula that it documents.

    As in the engine, large Gaussians are blurs of reduced images, which are no framebuffers.
    ``bloom`` differs from the formula by at most 6e-5 of its largest value for pictures, and by up
    to 1.4e-4 for a frame with one lit pixel. A Gaussian whose cut is higher than 4.5e-4 of the
    kernel's largest value is a blur at the size of the bloom buffers. If its standard deviation is
    more than 19 pixels there, as with a single large tint, ``bloom`` is a convolution by Fourier
    transforms.

    Source: Epic Games, "Bloom" (Unreal Engine 4.27), GaussianSumBloomSettings (Python API 5.0).
    """

    method: ClassVar[str] = "unreal"
    _knobs: ClassVar[tuple[str, ...]] = ("size_scale",)
    boundary: ClassVar[str] = "edge"
    shaping: ClassVar[tuple[str, ...]] = ("sizes", "tints", "size_scale")
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold",)

    threshold: float | None = number_field(default=-1.0, range=(-1, MAX_HALF), slider=(-1, 4))
    intensity: float = number_field(default=0.675)
    sizes: tuple[float, ...] = numbers_field(
        (0.3, 1.0, 2.0, 10.0, 30.0, 64.0), differentiable=False
    )
    tints: tuple[float, ...] = numbers_field(
        (0.3465, 0.138, 0.1176, 0.066, 0.066, 0.061), low=-MAX_HALF, differentiable=False
    )
    size_scale: float = number_field(differentiable=False)

    @property
    def _bloom_error(self) -> float:
        return 1.5e-4

    def core_kernel_size(self, frame: tuple[int, int], buffers: tuple[int, int]) -> tuple[int, int]:
        """Return the kernel's width and height, without the kernel."""
        return 2 * buffers[0] - 1, 2 * buffers[1] - 1

    def _kernel(self, frame: tuple[int, int], buffers: tuple[int, int]) -> NDArray[np.float64]:
        lines = []
        for axis in (1, 0):
            scale = self.size_scale * frame[0] / 600 * buffers[axis] / frame[axis]
            lines.append(np.stack([_line(size * scale, buffers[axis]) for size in self.sizes]))
        plane = (lines[0] * np.array(self.tints)[:, np.newaxis]).T @ lines[1]
        return np.repeat(plane[..., np.newaxis], 3, axis=2)

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        threshold = None if self.threshold in {None, -1.0} else self.threshold + 1
        return {
            "threshold": threshold,
            "boundary": self.boundary,
            "gaussian_sizes": self.sizes,
            "gaussian_tints": self.tints,
        }

    def _threshold_slopes(self) -> dict[str, float]:
        # -1 stands for none.
        return {"threshold": float(self.threshold != -1)}


def _line(deviation: float, length: int) -> NDArray[np.float64]:
    """Return a Gaussian over 2 length - 1 pixels.

    Whatever is further away reads the same outermost pixel as the first and the last of them.
    """
    radius = math.ceil(3 * deviation)
    line = np.zeros(2 * length - 1)
    indices = np.clip(np.arange(-radius, radius + 1), 1 - length, length - 1) + length - 1
    np.add.at(line, indices, gaussian(deviation, radius))
    return line
