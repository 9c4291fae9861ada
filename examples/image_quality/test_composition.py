"""Bloom adds light: the picture with bloom is the picture plus the bloom."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from vkbloom import testing

ADDITIVE: dict[str, vkbloom.Settings] = {
    "separable": vkbloom.Separable(intensity=0.5),
    "pyramid": vkbloom.Pyramid(threshold=0.5, intensity=2.0),
    # In half floats, its own format, the returned bloom is rounded and the added one is not.
    "kino": vkbloom.presets["kino"].replace(format="rgba32float"),
}


@pytest.mark.parametrize("name", ADDITIVE)
def test_final_is_picture_plus_bloom(
    bloom_renderer: vkbloom.Renderer, picture: NDArray[np.float32], name: str
) -> None:
    """Hold all pixels to the sum of two framebuffers."""
    settings = ADDITIVE[name]
    frames = bloom_renderer.apply(picture, settings)
    expected = picture + settings.intensity * frames["bloom"][..., :3]
    np.testing.assert_allclose(frames["final"], expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", ADDITIVE)
def test_no_pixel_becomes_darker(bloom_renderer: vkbloom.Renderer, name: str) -> None:
    """The law behind it, on noise of up to 8 times white."""
    testing.assert_laws(
        lambda image: bloom_renderer.apply(image, ADDITIVE[name])["final"],
        "additive",
        probe=testing.Probe(value=8.0),
    )


@pytest.mark.parametrize("changes", [{"intensity": 0.0}, {"bloom": False}])
def test_without_bloom_the_picture_stays(
    bloom_renderer: vkbloom.Renderer, picture: NDArray[np.float32], changes: dict[str, Any]
) -> None:
    """All bits stay as they are."""
    settings = vkbloom.Pyramid().replace(**changes)
    assert np.array_equal(bloom_renderer.apply(picture, settings)["final"], picture)


def test_the_light_of_two_lamps_adds_up(bloom_renderer: vkbloom.Renderer) -> None:
    """Without a threshold, the bloom of a sum is the sum of the blooms."""
    testing.assert_laws(
        lambda image: bloom_renderer.apply(image, vkbloom.Pyramid())["bloom"], "superposition"
    )


def test_a_mix_is_not_additive(bloom_renderer: vkbloom.Renderer) -> None:
    """It takes from bright pixels what it gives to others: an average, not added light."""
    mix = vkbloom.Pyramid(composite="mix", intensity=0.3)
    with pytest.raises(AssertionError, match="light is added, and none is removed"):
        testing.assert_laws(lambda image: bloom_renderer.apply(image, mix)["final"], "additive")
