"""Pyramids whose levels have weights."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tests.exhaustive import by_turns
from tests.tolerance import assert_matches_reference
from vkbloom import Pyramid, Renderer, Separable, reference

WEIGHTS = [(1.0, 0.5, 0.25, 2.0), (0.0, 0.0, 1.0, 0.0), (1.0, -0.5, 0.0, 0.25), (0.0,) * 4]


def image(size: tuple[int, int], dtype: str) -> NDArray[Any]:
    width, height = size
    values = np.random.default_rng(5).random((height, width, 3)) ** 4
    return (values * 255).astype(np.uint8) if dtype == "uint8" else values.astype(dtype)


@pytest.mark.parametrize(
    ("weights", "size", "dtype"),
    by_turns(WEIGHTS, [(1, 1), (3, 2), (64, 48), (101, 67)], turns=["uint8", "float16", "float32"]),
)
def test_the_device_is_the_reference(
    renderer: Renderer, size: tuple[int, int], dtype: str, weights: tuple[float, ...]
) -> None:
    # Differences of halves are off by more than a share of themselves.
    format: Any = "rgba32float" if dtype == "float16" and min(weights) < 0 else None
    settings = Pyramid(levels=4, level_weights=weights, intensity=0.5, format=format)
    picture = image(size, dtype)
    assert_matches_reference(renderer.apply(picture, settings), picture, settings)


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


def test_a_sum_of_the_levels_by_themselves(renderer: Renderer) -> None:
    """The bloom is linear in the weights: that of each level alone, times its weight."""
    picture, weights = image((96, 64), "float32"), (0.5, -1.0, 0.25)
    alone = np.eye(3)
    blooms = [
        renderer.apply(picture, Pyramid(levels=3, level_weights=tuple(one)))["bloom"]
        for one in alone
    ]
    expected = sum(weight * bloom for weight, bloom in zip(weights, blooms, strict=True))
    actual = renderer.apply(picture, Pyramid(levels=3, level_weights=weights))["bloom"]
    assert_allclose(actual[..., :3], np.asarray(expected)[..., :3], atol=1e-5)


def test_equal_weights_are_the_mean(renderer: Renderer) -> None:
    picture = image((64, 64), "float32")
    weighted = renderer.apply(picture, Pyramid(levels=4, level_weights=(0.25,) * 4))["bloom"]
    mean = renderer.apply(picture, Pyramid(levels=4))["bloom"]
    assert_allclose(weighted, mean, atol=1e-6)


@pytest.mark.parametrize("size", [(64, 48), (4, 3), (1, 1)])
def test_the_gain_is_the_sum_of_the_weights_that_count(
    renderer: Renderer, size: tuple[int, int]
) -> None:
    settings = Pyramid(levels=4, level_weights=(1.0, 0.5, -0.25, 4.0))
    flat = np.ones((size[1], size[0], 3), np.float32)
    bloom = renderer.apply(flat, settings)["bloom"][..., :3]
    assert_allclose(bloom, reference.gain(settings, size), rtol=1e-5)


def test_the_gain_of_a_whole_chain() -> None:
    assert reference.gain(Pyramid(levels=3, level_weights=(1.0, 0.5, -0.25))) == 1.25


@pytest.mark.parametrize(
    ("weights", "error", "message"),
    [
        ((1.0, 2.0), ValueError, "level_weights: 2 weights are out of range, 6, one for each"),
        ((), ValueError, "level_weights: 0 weights"),
        ((1, 1, 1, 1, 1, float("nan")), ValueError, "level_weights: nan is out of range"),
        ((1, 1, 1, 1, 1, float("inf")), ValueError, "level_weights: inf is out of range"),
        ("111111", TypeError, "is not a sequence of numbers"),
        (3.0, TypeError, "is not a sequence of numbers"),
    ],
)
def test_wrong_level_weights_are_refused(
    weights: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        Pyramid(level_weights=weights)


def test_a_list_is_kept_as_a_tuple() -> None:
    settings = Pyramid(levels=2, level_weights=[1, 2])  # type: ignore[arg-type]
    assert settings.level_weights == (1.0, 2.0)
    assert hash(settings) == hash(Pyramid(levels=2, level_weights=(1.0, 2.0)))
    with pytest.raises(TypeError):
        Separable(level_weights=(1.0,))  # type: ignore[call-arg]
