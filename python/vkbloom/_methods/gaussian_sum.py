"""What blooms by a sum of Gaussians share: the convolution with their sum."""

from __future__ import annotations

import dataclasses
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vkbloom._psf.core_kernels import WithKernel
from vkbloom._settings.settings import BloomFormat, PublishedSettings

Size = tuple[int, int]


@dataclasses.dataclass(frozen=True, kw_only=True)
class GaussianSum(WithKernel, PublishedSettings):
    """Settings of a bloom that is a convolution with a sum of Gaussians.

    - `boundary`: What lies outside of the frame, a name of the core.
    """

    boundary: ClassVar[str]

    format: BloomFormat | None = None

    @property
    def _is_transform(self) -> bool:
        return True

    def kernel(self, frame: Size, buffers: Size | None = None) -> NDArray[np.float64]:
        """Return the kernel for a frame in pixels of the bloom buffers, shape (h, w, 3)."""
        return self._kernel(frame, buffers or frame)


def gaussian(deviation: float, radius: int) -> NDArray[np.float64]:
    """Return a Gaussian of 2 radius + 1 pixels whose sum is 1."""
    offsets = np.arange(-radius, radius + 1)
    weights = np.exp(-0.5 * (offsets / deviation) ** 2) if radius else np.ones(1)
    line: NDArray[np.float64] = weights / math.fsum(weights)
    return line
