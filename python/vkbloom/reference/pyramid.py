"""The mip pyramid: 13-tap downsampling, tent upsampling, a mean over the levels."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np

from .image import Storage
from .levels import level_sizes
from .sampling import Array, sample
from .threshold import luminance

__all__ = ["downsample", "gain", "groups", "passes"]

# The 13 taps are five 2 x 2 groups: (share of the group, x offsets, y offsets), offsets in
# texels of the image read. The four outer groups overlap: they share the tap in the centre,
# and two of them each axial one. From Jimenez, "Next Generation Post Processing in Call of
# Duty: Advanced Warfare", SIGGRAPH 2014.
_GROUPS = (
    (0.5, (-1.0, 1.0), (-1.0, 1.0)),
    (0.125, (-2.0, 0.0), (-2.0, 0.0)),
    (0.125, (0.0, 2.0), (-2.0, 0.0)),
    (0.125, (-2.0, 0.0), (0.0, 2.0)),
    (0.125, (0.0, 2.0), (0.0, 2.0)),
)


class PyramidSettings(Protocol):
    """What this blur reads of `vkbloom.Pyramid`."""

    @property
    def levels(self) -> int: ...
    @property
    def radius(self) -> float: ...
    @property
    def firefly_filter(self) -> bool: ...


def passes(
    glow: Array,
    settings: PyramidSettings,
    size: tuple[int, int],
    store: Storage,
) -> dict[str, Array]:
    """Return the pyramid's framebuffers.

    The bloom is the sum of all levels, each brought up through those above it by the tent, and
    divided by their number N: up_N-1 = down_N-1, up_k = down_k + tent(up_k+1), and the bloom is
    tent(up_0) / N. In buffers that end at 1, up_k is divided by the number of
    levels in it, up_k = (down_k + (N - 1 - k) tent(up_k+1)) / (N - k), and the bloom, tent(up_0),
    is the same.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
        1 or 3 channels (grey or rgb) for the firefly filter, any number without it.
    settings : vkbloom.Pyramid
    size : (int, int)
        Width and height of the bloom, in pixels.
    store : callable
        What storing in a bloom buffer does to the values.

    Returns
    -------
    dict of str to ndarray
        "down_0" to "down_N-1", "up_N-2" to "up_0" and "bloom", (height, width, C).

    Raises
    ------
    ValueError
        Firefly filter of an image with neither 1 nor 3 channels.
    """
    height, width, _ = glow.shape
    sizes = level_sizes((width, height), settings.levels)
    framebuffers: dict[str, Array] = {}
    downs: list[Array] = []
    source = glow
    for k, level_size in enumerate(sizes):
        source = store(downsample(source, level_size, settings.firefly_filter and k == 0))
        downs.append(source)
        framebuffers[f"down_{k}"] = source

    means = store.high == 1
    up = downs[-1]
    for k in range(len(sizes) - 2, -1, -1):
        upsampled = _tent(up, sizes[k], settings.radius)
        below = len(sizes) - 1 - k
        up = (downs[k] + below * upsampled) / (below + 1) if means else downs[k] + upsampled
        up = store(up)
        framebuffers[f"up_{k}"] = up
    total = _tent(up, size, settings.radius)
    framebuffers["bloom"] = store(total if means else total / len(sizes))
    return framebuffers


def gain(settings: PyramidSettings) -> float:
    """Return what a flat image of 1 becomes: 1, as the weights of every filter sum to 1."""
    return 1.0


def groups(image: Array, size: tuple[int, int]) -> Iterator[tuple[float, Array]]:
    """Yield the share and the mean of each of the five groups of taps, (height, width, C)."""
    for share, x_offsets, y_offsets in _GROUPS:
        x_taps, y_taps = ([(x, 0.5) for x in offsets] for offsets in (x_offsets, y_offsets))
        yield share, sample(image, size, x_taps, y_taps)


def downsample(image: Array, size: tuple[int, int], firefly_filter: bool) -> Array:
    """Read the 13 taps around each pixel of a smaller image.

    With `firefly_filter` the share of each group is multiplied by 1 / (1 + luminance of the
    group's mean), and the shares are divided by their sum. A negative luminance counts as 0.
    """
    if firefly_filter and image.shape[2] not in (1, 3):
        raise ValueError(
            f"firefly_filter needs an image of 1, 3 or 4 channels, not {image.shape[2]}"
        )
    total = np.zeros((size[1], size[0], image.shape[2]))
    shares = np.zeros((size[1], size[0], 1))
    for group_share, mean in groups(image, size):
        share = np.full((size[1], size[0], 1), group_share)
        if firefly_filter:
            grey = mean if image.shape[2] == 1 else luminance(mean)
            share /= 1 + np.maximum(grey, 0.0)
        total += share * mean
        shares += share
    return total / shares


def _tent(image: Array, size: tuple[int, int], radius: float) -> Array:
    """Read 3 x 3 taps, `radius` texels apart, with weights (1 2 1)^2 / 16."""
    taps = ((-radius, 0.25), (0.0, 0.5), (radius, 0.25))
    return sample(image, size, taps, taps)
