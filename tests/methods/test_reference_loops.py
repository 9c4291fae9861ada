"""The NumPy reference against slow loops: one pixel, one tap and one texel at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.methods.reference_cases import (
    DOWN_13,
    assert_close,
    random_image,
    slow_direct,
    slow_dual_kawase,
    slow_pyramid,
    slow_separable,
    slow_taps,
)
from vkbloom import DualKawase, Pyramid, Separable, reference


@pytest.mark.parametrize(
    "settings",
    [
        Separable(),
        Separable(blur_scale=1.3, texel="x", first_tap=0),
        Separable(loops=2, blur_strength=0.7, layers=((1.0, 1.0), (2.5, 0.5))),
    ],
)
def test_separable_is_what_the_shader_computes(settings: Any) -> None:
    glow = random_image(5, 7)
    expected = slow_separable(glow, settings, (10, 9))
    assert_close(reference.blur(glow, settings, (10, 9)), expected)


def test_direct_is_what_a_loop_over_all_taps_computes() -> None:
    glow = random_image(5, 6)
    settings = Separable(direct=True, blur_scale=1.2, weights=(0.4, 0.2, 0.1))
    expected = slow_direct(glow, settings, (8, 7))
    assert_close(reference.blur(glow, settings, (8, 7)), expected)


def test_pyramid_is_what_loops_over_its_taps_compute() -> None:
    glow = random_image(9, 13)
    expected = slow_pyramid(glow, [(6, 4), (3, 2)], 1.3, (11, 10))
    settings = Pyramid(levels=2, radius=1.3)
    assert_close(reference.blur(glow, settings, (11, 10)), expected)


def test_pyramid_of_three_levels_is_their_sum_divided_by_three() -> None:
    glow = random_image(16, 16, 1)
    expected = slow_pyramid(glow, [(8, 8), (4, 4), (2, 2)], 1.0, (16, 16))
    assert_close(reference.blur(glow, Pyramid(levels=3)), expected)


def test_firefly_filter_weights_the_groups_of_the_first_downsample_alone() -> None:
    glow = random_image(12, 12) ** 4 * 30
    shares = []
    corners = [(x, y) for x in (-1, 1) for y in (-1, 1)]
    means = [slow_taps(glow, (6, 6), [(x, y, 0.25) for x, y in corners])]
    shares.append(0.5)
    for corner_x, corner_y in corners:
        group = [(x + corner_x, y + corner_y, 0.25) for x, y in corners]
        means.append(slow_taps(glow, (6, 6), group))
        shares.append(0.125)
    weights = [
        share / (1 + mean @ np.array([0.2126, 0.7152, 0.0722]))
        for share, mean in zip(shares, means, strict=True)
    ]
    expected = sum(w[..., None] * m for w, m in zip(weights, means, strict=True))
    expected = expected / sum(weights)[..., None]
    passes = reference.passes(glow, Pyramid(levels=2, firefly_filter=True))
    assert_close(passes["down_0"], expected)
    assert_close(passes["down_1"], slow_taps(expected, (3, 3), DOWN_13))


def test_a_negative_luminance_counts_as_0_in_the_firefly_filter() -> None:
    # 1 / (1 - 1) would be infinite.
    passes = reference.passes(np.full((8, 8, 3), -1.0), Pyramid(firefly_filter=True))
    assert_array_equal(passes["down_0"], np.full((4, 4, 3), -1.0))


def test_dual_kawase_is_what_loops_over_its_taps_compute() -> None:
    glow = random_image(9, 13)
    expected = slow_dual_kawase(glow, [(6, 4), (3, 2)], 1.3, (11, 10))
    settings = DualKawase(levels=2, offset=1.3)
    assert_close(reference.blur(glow, settings, (11, 10)), expected)
