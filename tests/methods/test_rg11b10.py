"""Bloom buffers of the format "rg11b10ufloat"."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from tests.exhaustive import by_turns
from tests.images import DTYPES, lights
from tests.methods.cases import presets_of_low_levels
from vkbloom import (
    Convolution,
    DualKawase,
    GodotBloom,
    PygfxBloom,
    Pyramid,
    Renderer,
    Separable,
    Settings,
    reference,
)
from vkbloom.reference._image import storage

Array = NDArray[Any]

#: A blur that leaves the image as it is.
NONE = Separable(weights=(1.0,), format="rg11b10ufloat")
# What is stored, and what of it comes back: in red and green, in blue.
STORED = [
    (0.0, 0.0, 0.0),
    (1.0, 1.0, 1.0),
    (-1.0, 0.0, 0.0),
    (-3e38, 0.0, 0.0),
    (np.nan, 0.0, 0.0),
    # Half way between two steps to the even one, else to the nearer one.
    (1 + 1 / 128, 1.0, 1.0),
    (1 + 3 / 128, 1 + 2 / 64, 1 + 1 / 32),
    (1 + 1.1 / 128, 1 + 1 / 64, 1.0),
    (1 + 1 / 64, 1 + 1 / 64, 1.0),
    (1 + 3 / 64, 1 + 3 / 64, 1 + 2 / 32),
    (1.999, 2.0, 2.0),
    # The least normal value, the least one, half of it and less, one and a half of it.
    (2.0**-14, 2.0**-14, 2.0**-14),
    (2.0**-20, 2.0**-20, 0.0),
    (2.0**-19, 2.0**-19, 2.0**-19),
    (2.0**-21, 0.0, 0.0),
    (1.5 * 2.0**-19, 1.5 * 2.0**-19, 2.0**-18),
    (1e-30, 0.0, 0.0),
    # Beyond the largest ones.
    (64512.0, 64512.0, 64512.0),
    (65024.0, 65024.0, 64512.0),
    (65500.0, 65024.0, 64512.0),
    (3e38, 65024.0, 64512.0),
]


def test_values_are_rounded_to_the_nearest(renderer: Renderer) -> None:
    """Of an image of one row."""
    values = np.array(STORED)[np.newaxis]
    image, expected = values[..., [0, 0, 0]].astype(np.float32), values[..., [1, 1, 2]]
    frames = renderer.apply(image, NONE)
    for name in ("glow", "blur_vertical", "bloom"):
        assert frames[name].dtype == np.float32
        assert_array_equal(frames[name][..., :3], expected, err_msg=name)
        assert (frames[name][..., 3] == 1).all()
    assert_array_equal(storage("rg11b10ufloat")(image.astype(np.float64)), expected)


LOW = presets_of_low_levels(64)
METHODS: list[Settings] = [
    *(
        settings.replace(format="rg11b10ufloat")
        for name, settings in LOW.items()
        # Of the convolutions one: they have the same passes.
        if name == "camera_lens" or not isinstance(settings, Convolution)
    ),
    Separable(layers=((1.0, 1.0), (2.0, 0.5)), format="rg11b10ufloat"),
    Separable(direct=True, loops=2, blur_scale=0.5, format="rg11b10ufloat"),
    Pyramid(threshold=0.5, knee=0.3, bloom_scale=0.5, format="rg11b10ufloat"),
    Pyramid(levels=3, level_weights=(0.5, -0.25, 2.0), format="rg11b10ufloat"),
    DualKawase(bloom_size=(31, 17), format="rg11b10ufloat"),
    GodotBloom(composite="add", bicubic=False, format="rg11b10ufloat"),
]


@pytest.mark.parametrize(("settings", "dtype"), by_turns(METHODS, turns=DTYPES))
def test_every_method_has_the_format(renderer: Renderer, settings: Settings, dtype: str) -> None:
    """A value may fall on the other side of a step than the reference's: 1/64, of blue 1/32.

    Where sums go on, some such steps add up, and where weights are negative they count against
    less, so that the mean says more than the largest difference.
    """
    image = (0.6 * lights(67, 45, dtype=dtype, highest=20.0)).astype(dtype)
    frames = renderer.apply(image, settings)
    expected = reference.apply(image, settings)
    assert list(frames) == list(expected)
    for name in set(frames) - {"final"}:
        values = expected[name][..., :3]
        assert frames[name].dtype == np.float32, name
        difference = np.abs(frames[name][..., :3] - values)
        largest = np.maximum(values, 1e-3 * max(1.0, values.max()))
        assert (difference <= 4 / 32 * largest).all(), name
        # Near 0 the steps are 2^-20. (In a level of a few pixels, one step is a large mean.)
        if values.size > 3 * 16:
            assert difference.mean() <= 2e-3 * values.mean() + 2.0**-20, name
    final = frames["final"].astype(np.float64) / (255 if dtype == "uint8" else 1)
    allowed = 2 / 255 + 0.02 * np.abs(expected["final"])
    assert (np.abs(final - expected["final"]) <= allowed).all()


@pytest.mark.parametrize("name", ["bevy_natural", "filament", "unity_urp", "unity_hdrp"])
def test_engines_round_their_levels_alone(renderer: Renderer, name: str) -> None:
    image = lights(40, 30)
    frames = renderer.apply(image, LOW[name].replace(format="rg11b10ufloat"))
    assert_array_equal(frames["glow"][..., :3], image)
    rounded = storage("rg11b10ufloat")
    for level in (one for one in frames if one.startswith(("down", "up"))):
        values = frames[level][..., :3].astype(np.float64)
        assert_array_equal(rounded(values), values, err_msg=level)
    bloom = frames["bloom"][..., :3].astype(np.float64)
    assert not np.array_equal(rounded(bloom), bloom)


# Bloom buffers of the format "rgba8unorm-srgb".


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
