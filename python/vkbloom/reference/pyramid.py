"""The mip pyramid: 13-tap downsampling, tent upsampling, a mean over the levels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    @property
    def level_weights(self) -> Sequence[float] | None: ...


def passes(
    glow: Array,
    settings: PyramidSettings,
    size: tuple[int, int],
    store: Storage,
) -> dict[str, Array]:
    """Return the pyramid's framebuffers.

    The bloom is the sum of all levels, each brought up through those above it by the tent, and
    divided by their number N: up_N-1 = down_N-1, up_k = down_k + tent(up_k+1), and the bloom is
    tent(up_0) / N. With level weights up_N-1 = w_N-1 down_N-1, up_k = w_k down_k + tent(up_k+1),
    and the bloom is tent(up_0).

    In buffers that end at 1, up_k is divided by the number of levels in it, or by the sum of the
    sizes of their weights, and the bloom is the same.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
        1, 3 or 4 channels (grey, rgb or with alpha) for the firefly filter, any number without
        it.
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
        Firefly filter of an image with another number of channels.
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

    count = len(sizes)
    weights = settings.level_weights
    shares = [1.0] * count if weights is None else [float(w) for w in weights[:count]]
    gain = 1 / count if weights is None else 1.0
    # The sum is what is stored, times the factor; the smallest level is stored without its weight.
    up, factor = downs[-1], shares[-1]
    for k in range(count - 2, -1, -1):
        total = shares[k] * downs[k] + factor * _tent(up, sizes[k], settings.radius)
        factor = (abs(shares[k]) + abs(factor) or 1.0) if store.high == 1 else 1.0
        up = store(total / factor)
        framebuffers[f"up_{k}"] = up
    framebuffers["bloom"] = store(gain * factor * _tent(up, size, settings.radius))
    return framebuffers


def gain(settings: PyramidSettings, size: tuple[int, int]) -> float:
    """Return what a flat image of 1 becomes: 1, as the weights of every filter sum to 1.

    With level weights it is the sum of those that count, fewer where the chain ends early.
    """
    if settings.level_weights is None:
        return 1.0
    return sum(settings.level_weights[: len(level_sizes(size, settings.levels))])


def groups(
    image: Array, size: tuple[int, int], scale: tuple[float, float] = (1.0, 1.0)
) -> Iterator[tuple[float, Array]]:
    """Yield the share and the mean of each of the five groups of taps, (height, width, C).

    `scale` multiplies the taps' distances along x and y.
    """
    for share, x_offsets, y_offsets in _GROUPS:
        x_taps = [(scale[0] * x, 0.5) for x in x_offsets]
        y_taps = [(scale[1] * y, 0.5) for y in y_offsets]
        yield share, sample(image, size, x_taps, y_taps)


def downsample(
    image: Array,
    size: tuple[int, int],
    firefly_filter: bool,
    scale: tuple[float, float] = (1.0, 1.0),
) -> Array:
    """Read the 13 taps around each pixel of a smaller image, at `scale` times their distances.

    With `firefly_filter` the share of each group is multiplied by 1 / (1 + luminance of the
    group's mean), and the shares are divided by their sum. A negative luminance counts as 0.
    """
    if firefly_filter and image.shape[2] not in (1, 3, 4):
        raise ValueError(
            f"firefly_filter needs an image of 1, 3 or 4 channels, not {image.shape[2]}"
        )
    total = np.zeros((size[1], size[0], image.shape[2]))
    shares = np.zeros((size[1], size[0], 1))
    for group_share, mean in groups(image, size, scale):
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
