"""The blur of the tutorial, outline and deferred systems: a row kernel and a column kernel."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from .image import Storage
from .sampling import Array, sample

__all__ = ["gain", "passes"]


class SeparableSettings(Protocol):
    """What this blur reads of `vkbloom.Separable`."""

    @property
    def blur_scale(self) -> float: ...
    @property
    def blur_strength(self) -> float: ...
    @property
    def weights(self) -> tuple[float, ...]: ...
    @property
    def loops(self) -> int: ...
    @property
    def layers(self) -> tuple[tuple[float, float], ...]: ...
    @property
    def first_tap(self) -> int: ...
    @property
    def texel(self) -> str: ...
    @property
    def direct(self) -> bool: ...


def passes(
    glow: Array,
    settings: SeparableSettings,
    size: tuple[int, int],
    store: Storage,
) -> dict[str, Array]:
    """Return the blur's framebuffers.

    One direction is w0 tap(0) + strength * sum over i >= 1 of w_i (tap(+i step) +
    tap(-i step)), the step being one texel times the scale. A loop is one vertical and one
    horizontal pass at the size of the glow; the last horizontal pass is evaluated at every
    pixel of `size`. Each layer is such a blur of the glow at its own scale, added with its own
    strength, and the sum is clamped after each layer.

    With ``settings.direct`` a loop is a single pass that reads a grid of N x N taps, weighted
    by the products of the kernel with itself, and no vertical framebuffer exists.

    Parameters
    ----------
    glow : ndarray of float64, shape (H, W, C)
    settings : vkbloom.Separable
    size : (int, int)
        Width and height of the bloom, in pixels.
    store : callable
        What storing in a bloom buffer does to the values.

    Returns
    -------
    dict of str to ndarray
        "blur_vertical", (H, W, C), of the last loop of the last layer, not with
        ``settings.direct``; "bloom", (height, width, C).
    """
    height, width, _ = glow.shape
    kernel = _kernel(settings)
    # Both axes step by 1 / width in normalized coordinates for texel="x".
    texel_y = height / width if settings.texel == "x" else 1.0
    bloom = np.zeros((size[1], size[0], glow.shape[2]))
    framebuffers: dict[str, Array] = {}
    for scale, strength in settings.layers:
        step = settings.blur_scale * scale
        x_taps = [(i * step, weight) for i, weight in kernel]
        y_taps = [(i * step * texel_y, weight) for i, weight in kernel]
        blurred = glow
        for loop in range(settings.loops):
            is_last = loop == settings.loops - 1
            target = size if is_last else (width, height)
            if settings.direct:
                blurred = sample(blurred, target, x_taps=x_taps, y_taps=y_taps)
            else:
                vertical = store(sample(blurred, (width, height), y_taps=y_taps))
                framebuffers["blur_vertical"] = vertical
                blurred = sample(vertical, target, x_taps=x_taps)
            if not is_last:
                blurred = store(blurred)
        bloom = store.end(bloom + strength * blurred)
    return {**framebuffers, "bloom": store(bloom)}


def gain(settings: SeparableSettings) -> float:
    """Return what a flat image of 1 becomes: the sum over the layers of s * g^(2 loops).

    g is the sum of the effective kernel, for the tutorial's 1.3865 and so 1.922 in all.
    """
    one_direction = sum(weight for _, weight in _kernel(settings))
    whole: float = one_direction ** (2 * settings.loops)
    return whole * sum(strength for _, strength in settings.layers)


def _kernel(settings: SeparableSettings) -> list[tuple[int, float]]:
    """Return the offsets, in steps, and the effective weights of all taps of a direction."""
    centre, *sides = settings.weights
    strength = settings.blur_strength
    if settings.first_tap == 0:
        # The loop over the sides begins at the centre, and so takes it twice more.
        centre *= 1 + 2 * strength
    taps = [(0, centre)]
    for i, weight in enumerate(sides, start=1):
        taps += [(i, strength * weight), (-i, strength * weight)]
    return taps
