"""Chains of levels: their halvings, filters that enlarge, and the combination of the levels."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ._image import BlurInput
from ._sampling import Array, halve_size, read_rows, sample, size_of
from ._tape import contiguous

# (image, size of the result) -> the image in this size
Filter = Callable[[Array, tuple[int, int]], Array]
# Of level k and of level k + 1 in up_k.
Shares = tuple[Sequence[float], Sequence[float]]


def linear(image: Array, size: tuple[int, int]) -> Array:
    """Read one bilinear tap."""
    return sample(image, size)


def tent(image: Array, size: tuple[int, int], x_step: float = 1.0, y_step: float = 1.0) -> Array:
    """Read 3 x 3 bilinear taps with the weights (1 2 1)^2 / 16; steps in texels of the image."""
    x_taps, y_taps = (((-step, 0.25), (0.0, 0.5), (step, 0.25)) for step in (x_step, y_step))
    return sample(image, size, x_taps, y_taps)


def tent_of_target(image: Array, size: tuple[int, int]) -> Array:
    """Read the tent with taps one pixel of the result apart."""
    return tent(image, size, image.shape[1] / size[0], image.shape[0] / size[1])


def cubic(image: Array, size: tuple[int, int]) -> Array:
    """Read the cubic B-spline with the texels as its control points.

    At the fraction f of the way between two texels, the four nearest weigh (1 - f)^3,
    4 - 6 f^2 + 3 f^3, 1 + 3 f + 3 f^2 - 3 f^3 and f^3, each divided by 6.
    """
    for count in size[::-1]:
        length = image.shape[0]
        image = cubic_rows(image, (np.arange(count) + 0.5) * length / count - 0.5).swapaxes(0, 1)
    return contiguous(image)


def cubic_rows(image: Array, positions: Array, furthest: float = np.inf) -> Array:
    """Read the cubic B-spline along the first axis, as two bilinear taps up to a position.

    The four texels around a position weigh w_0 to w_3. A bilinear tap between the first two, at
    w_1 / (w_0 + w_1) of the way, has both their shares (Sigg and Hadwiger, "Fast Third-Order
    Texture Filtering", GPU Gems 2, chapter 20); likewise the other two.
    """
    lower = np.floor(positions)
    f = positions - lower
    w = ((1 - f) ** 3 / 6, (4 - 6 * f**2 + 3 * f**3) / 6, (1 + 3 * f + 3 * f**2 - 3 * f**3) / 6)
    left, right = w[0] + w[1], w[2] + f**3 / 6
    total = np.zeros((len(positions), *image.shape[1:]))
    for tap, weight in ((lower - 1 + w[1] / left, left), (lower + 1 + f**3 / 6 / right, right)):
        rows = read_rows(image, np.minimum(tap, furthest))
        total += weight[:, np.newaxis, np.newaxis] * rows
    return total


def halvings(
    first: Array, count: int, store: Callable[[Array], Array], shrink: Filter
) -> list[Array]:
    """Return an image, and smaller ones that have half the size of the one before."""
    downs = [first]
    while len(downs) < count:
        downs.append(store(shrink(downs[-1], halve_size(size_of(downs[-1])))))
    return downs


def combine(
    downs: Sequence[Array],
    source: BlurInput,
    shares: Shares | None = None,
    *,
    upsample: Filter,
    last: Filter,
    smallest: float = 1.0,
    gain: float = 1.0,
    end: Callable[[Array], Array] | None = None,
) -> dict[str, Array]:
    """Return the framebuffers of a chain of levels.

    up_N-1 = smallest * down_N-1, up_k = fine[k] down_k + coarse[k] upsample(up_k+1), and the bloom
    is gain * last(up_0). Buffers of rgba8unorm hold values up to 1: there up_k is divided by the
    value that it has if all levels are 1 (with the sizes of the shares instead of the shares), and
    the bloom is multiplied by that of up_0.
    """
    size, store = source.size, source.store
    framebuffers = {f"down_{k}": down for k, down in enumerate(downs)}
    fine, coarse = shares or ([1.0] * len(downs),) * 2
    # up_k is the stored image times the factor. The smallest level is stored without its factor.
    up, factor = downs[-1], smallest
    for k in range(len(downs) - 2, -1, -1):
        below = coarse[k] * factor
        total = fine[k] * downs[k] + below * upsample(up, size_of(downs[k]))
        factor = (abs(fine[k]) + abs(below) or 1.0) if store.holds_means else 1.0
        up = store(total / factor)
        framebuffers[f"up_{k}"] = up
    framebuffers["bloom"] = (end or store.end)(gain * factor * last(up, size))
    return framebuffers


def mix(share: float, count: int) -> Shares:
    """Return the shares of a chain in which each level is mixed with the smaller one."""
    return [1 - share] * count, [share] * count


def flat_gain(shares: Shares, levels: Sequence[float]) -> float:
    """Return the bloom that `combine` computes from flat levels, for a gain of 1."""
    (fine, coarse), value = shares, levels[-1]
    for k in range(len(levels) - 2, -1, -1):
        value = fine[k] * levels[k] + coarse[k] * value
    return value
