"""Bloom buffers of the format "rgba8unorm-srgb"."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tests.images import lights
from vkbloom import DualKawase, PygfxBloom, Pyramid, Renderer, Scene, Separable, Settings, reference
from vkbloom.reference._image import storage

Array = NDArray[Any]
FORMAT: Final = "rgba8unorm-srgb"
#: Half the distance of two levels at 1, where it is largest.
STEP = 0.5 * 2.3 / 255


def levels() -> Array:
    """Return the light of the 256 levels of 8-bit sRGB."""
    share = np.arange(256) / 255
    light: Array = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return light


def test_levels_stay_and_others_are_rounded(renderer: Renderer) -> None:
    """The first texel is below 0, the last above 1; between are levels and what lies between."""
    between = np.sort(np.concatenate([levels(), 0.7 * levels()[1:] + 0.3 * levels()[:-1]]))
    values = np.concatenate([[-1.0], between, [7.0]])
    image = np.repeat(values[np.newaxis, :, np.newaxis], 3, axis=2).astype(np.float32)
    nearest = levels()[np.abs(levels() - values[:, np.newaxis]).argmin(axis=1)]
    glow = renderer.apply(image, Separable(weights=(1.0,), format=FORMAT))["glow"]
    assert glow.dtype == np.float32
    # Encoded levels are not evenly spaced, so that the nearest one may be the next.
    assert np.abs(glow[0, :, 0] - values.clip(0, 1)).max() <= STEP
    assert_allclose(glow[0, [0, -1], 0], [0, 1])
    assert np.isclose(glow[0, :, :1], levels(), atol=1e-6).any(axis=1).all()
    assert (np.abs(glow[0, :, 0] - nearest) <= 2 * STEP).all()
    assert_allclose(glow[..., :3], storage(FORMAT)(image.astype(np.float64)), atol=1e-6)


def test_alpha_is_linear(renderer: Renderer) -> None:
    image = np.full((3, 4, 4), 0.5, np.float32)
    frames = renderer.apply(image, Separable(weights=(1.0,), format=FORMAT, alpha="blur"))
    assert_allclose(frames["glow"][..., 3], 128 / 255, atol=1e-6)
    assert_allclose(frames["glow"][0, 0, 0], levels()[188], atol=1e-6)


@pytest.mark.parametrize(
    "settings",
    [
        PygfxBloom(),
        PygfxBloom(levels=3, intensity=0.5, karis_average=True),
        Pyramid(levels=4, threshold=0.2),
        DualKawase(levels=2),
        Separable(layers=((1.0, 1.0), (2.0, 0.5)), blur_strength=0.4),
    ],
)
def test_a_value_is_a_level_off_at_most(renderer: Renderer, settings: Settings) -> None:
    """A sum falls on the other side of a step than the reference's, and later sums have it, too."""
    image = lights(67, 45, highest=2.0)
    settings = settings.replace(format=FORMAT)
    frames, expected = renderer.apply(image, settings), reference.apply(image, settings)
    assert list(frames) == list(expected)
    for name in set(frames) - {"final"}:
        difference = np.abs(frames[name][..., :3] - expected[name][..., :3])
        assert difference.max() <= 4 * STEP, name
        assert difference.mean() <= 0.02 * STEP, name


def test_of_a_published_method_the_bloom_is_not_rounded(renderer: Renderer) -> None:
    frames = renderer.apply(0.1 * lights(67, 45, highest=2.0), PygfxBloom(format=FORMAT))
    is_level = {
        name: np.isclose(frames[name][..., :1], levels(), atol=1e-6).any(axis=2).mean()
        for name in ("glow", "down_0", "up_0", "bloom")
    }
    assert is_level["glow"] == is_level["down_0"] == is_level["up_0"] == 1
    assert is_level["bloom"] < 0.5


@pytest.mark.parametrize("shading", ["forward", "deferred"])
def test_scenes(renderer: Renderer, shading: Any) -> None:
    settings = PygfxBloom(format=FORMAT)
    frames = renderer.render(Scene.ufo(), settings, (96, 64), shading=shading)
    assert frames["up_0"].dtype == np.float32
    assert 0 < frames["up_0"].max() <= 1


def test_all_variants_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    results = []
    for variant in ("fragment", "cpu", "gpu"):
        monkeypatch.setenv("VKBLOOM_VARIANT", variant)
        with Renderer(validation=True) as renderer:
            results.append(renderer.apply(lights(75, 46, highest=2.0), PygfxBloom(format=FORMAT)))
    for name, values in results[0].items():
        for other in results[1:]:
            np.testing.assert_array_equal(other[name], values, err_msg=name)
