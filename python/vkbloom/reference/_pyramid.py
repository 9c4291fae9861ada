"""The mip pyramid: downsampling by 13 taps, upsampling by a tent, the mean of the levels."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

from ._image import BlurInput
from ._sampling import Array, level_sizes, sample, size_of, weighted_mean
from ._threshold import firefly_weight, luminance
from ._upsampling import combine, halvings, tent

if TYPE_CHECKING:
    from vkbloom._methods.mip_chain import Pyramid

#: The 13 taps are five 2 x 2 groups: (share of the group, x offsets, y offsets), in texels of the
#: source. The four outer groups overlap: all have the centre tap, and each tap on an axis belongs
#: to two of them. From Jimenez, "Next Generation Post Processing in Call of
#: Duty: Advanced Warfare", SIGGRAPH 2014.
GROUPS = (
    (0.5, (-1.0, 1.0), (-1.0, 1.0)),
    (0.125, (-2.0, 0.0), (-2.0, 0.0)),
    (0.125, (0.0, 2.0), (-2.0, 0.0)),
    (0.125, (-2.0, 0.0), (0.0, 2.0)),
    (0.125, (0.0, 2.0), (0.0, 2.0)),
)


def passes(source: BlurInput, settings: Pyramid) -> dict[str, Array]:
    """Return the framebuffers.

    The bloom is the sum of all levels, each enlarged through those above it by the tent, divided
    by their number N: up_N-1 = down_N-1, up_k = down_k + tent(up_k+1), and the bloom is
    tent(up_0) / N. With level weights, up_N-1 = w_N-1 down_N-1, up_k = w_k down_k + tent(up_k+1),
    and the bloom is tent(up_0). The scale multiplies the distances of all taps.
    """
    scale = (settings.scale_x, settings.scale_y)
    levels = level_sizes(size_of(source.image), settings.levels)
    reduce = downsample_fireflies if settings.firefly_filter else downsample
    first = source.store(reduce(source.image, levels[0], scale))
    count, weights = len(levels), settings.level_weights
    downs = halvings(first, count, source.store, partial(downsample, scale=scale))
    up = partial(tent, x_step=settings.radius * scale[0], y_step=settings.radius * scale[1])
    shares = [1.0] * count if weights is None else list(weights[:count])
    return combine(
        downs,
        source,
        (shares, [1.0] * count),
        upsample=up,
        last=up,
        smallest=shares[-1],
        gain=1 / count if weights is None else 1.0,
        end=source.store,
    )


def gain(settings: Pyramid, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: 1, since the weights of every filter sum to 1.

    With level weights, it is the sum of the weights of the existing levels.
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
    for share, x_offsets, y_offsets in GROUPS:
        x_taps = [(scale[0] * x, 0.5) for x in x_offsets]
        y_taps = [(scale[1] * y, 0.5) for y in y_offsets]
        yield share, sample(image, size, x_taps, y_taps)


def downsample(
    image: Array, size: tuple[int, int], scale: tuple[float, float] = (1.0, 1.0)
) -> Array:
    """Return an image reduced by 13 taps around each pixel, at `scale` times their distances."""
    return weighted_mean(groups(image, size, scale))


def downsample_fireflies(
    image: Array, size: tuple[int, int], scale: tuple[float, float] = (1.0, 1.0)
) -> Array:
    """Return an image reduced by 13 taps around each pixel, with less weight of bright groups.

    The share of each group is multiplied by 1 / (1 + luminance of the group's mean), and the shares
    are divided by their sum. A negative luminance counts as 0.
    """
    if image.shape[2] not in (1, 3, 4):
        raise ValueError(
            f"firefly_filter needs an image of 1, 3 or 4 channels, not {image.shape[2]}"
        )
    return weighted_mean(
        (share * firefly_weight(luminance(mean)), mean)
        for share, mean in groups(image, size, scale)
    )
