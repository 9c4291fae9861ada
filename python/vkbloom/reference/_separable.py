"""The blur of the tutorial, outline and deferred systems: a row kernel and a column kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._image import BlurInput
from ._sampling import Array, sample, size_of

if TYPE_CHECKING:
    from vkbloom._methods.separable import Separable


def passes(source: BlurInput, settings: Separable) -> dict[str, Array]:
    """Return the framebuffers.

    One direction is w0 tap(0) + strength * sum over i >= 1 of w_i (tap(+i step) +
    tap(-i step)); the step is one texel times the scale. A loop is one vertical and one horizontal
    pass at the size of the glow. The last horizontal pass is evaluated at every pixel of the
    bloom's size.
    Each layer is such a blur of the glow with its own scale. It is multiplied by its own strength
    and added, and the sum is clamped after each layer.

    With ``settings.direct``, a loop is one pass that reads N x N taps, weighted by the products of
    the kernel with itself, and there is no "blur_vertical".
    """
    size = width, height = size_of(source.image)
    kernel = _kernel(settings)
    # With texel="x", the step along both axes is 1 / width in normalized coordinates.
    texel_y = height / width if settings.texel == "x" else 1.0
    bloom = np.zeros((source.size[1], source.size[0], source.image.shape[2]))
    framebuffers: dict[str, Array] = {}
    for scale, strength in settings.layers:
        step = settings.blur_scale * scale
        x_taps = [(i * step, weight) for i, weight in kernel]
        y_taps = [(i * step * texel_y, weight) for i, weight in kernel]
        blurred = source.image
        for loop in range(settings.loops):
            is_last = loop == settings.loops - 1
            target = source.size if is_last else size
            if settings.direct:
                blurred = sample(blurred, target, x_taps=x_taps, y_taps=y_taps)
            else:
                vertical = source.store(sample(blurred, size, y_taps=y_taps))
                framebuffers["blur_vertical"] = vertical
                blurred = sample(vertical, target, x_taps=x_taps)
            if not is_last:
                blurred = source.store(blurred)
        bloom = source.store.end(bloom + strength * blurred)
    return {**framebuffers, "bloom": source.store(bloom)}


def gain(settings: Separable, size: tuple[int, int]) -> float:
    """Return the bloom of a flat image of 1: the sum over the layers of s * g^(2 loops).

    g is the sum of the effective kernel: 1.3865 with the default weights, so that the result is
    1.922.
    """
    one_direction = sum(weight for _, weight in _kernel(settings))
    all_loops: float = one_direction ** (2 * settings.loops)
    return all_loops * sum(strength for _, strength in settings.layers)


def _kernel(settings: Separable) -> list[tuple[int, float]]:
    """Return the offsets (in steps) and the effective weights of all taps of one direction."""
    centre, *sides = settings.weights
    strength = settings.blur_strength
    if settings.first_tap == 0:
        # The loop over the sides starts at the centre, so that it adds the centre twice more.
        centre *= 1 + 2 * strength
    taps = [(0, centre)]
    for i, weight in enumerate(sides, start=1):
        taps += [(i, strength * weight), (-i, strength * weight)]
    return taps
