"""Pyramids whose levels have weights."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from vkbloom import Pyramid, Renderer, reference


@pytest.mark.parametrize("seed", range(3))
def test_8_bits_are_off_by_the_rounding_of_each_level(renderer: Renderer, seed: int) -> None:
    """Every stored value is rounded by half a level, and counts as often as its weight says.

    down_k adds the rounding of k + 1 images. up_k is stored divided by the sum of the sizes of the
    weights from k on.
    """
    random = np.random.default_rng(seed)
    weights = tuple(random.uniform(-0.8, 1.0, 5).tolist())
    sizes = np.abs(weights)
    settings = Pyramid(levels=5, level_weights=weights, radius=random.uniform(0.0, 2.0))
    picture = random.integers(0, 256, (75, 131, 3), np.uint8)
    allowed = 0.5 + 0.5 * (sizes * np.arange(1, 6)).sum() + 0.5 * np.cumsum(sizes[::-1])[1:].sum()
    bloom = renderer.apply(picture, settings)["bloom"]
    expected = 255 * reference.apply(picture, settings)["bloom"]
    assert_allclose(bloom, expected, rtol=0, atol=allowed)


@pytest.mark.parametrize("size", [(64, 48), (4, 3), (1, 1)])
def test_the_gain_is_the_sum_of_the_weights_that_count(
    renderer: Renderer, size: tuple[int, int]
) -> None:
    settings = Pyramid(levels=4, level_weights=(1.0, 0.5, -0.25, 4.0))
    flat = np.ones((size[1], size[0], 3), np.float32)
    bloom = renderer.apply(flat, settings)["bloom"][..., :3]
    assert_allclose(bloom, reference.gain(settings, size), rtol=1e-5)


def test_a_list_is_kept_as_a_tuple() -> None:
    settings = Pyramid(levels=2, level_weights=[1, 2])  # type: ignore[arg-type]
    assert settings.level_weights == (1.0, 2.0)
    assert hash(settings) == hash(Pyramid(levels=2, level_weights=(1.0, 2.0)))
