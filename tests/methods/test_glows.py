"""Godot's glow, Blender's bloom and pygfx' bloom: formulas worked out by hand, and errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tests.images import hdr_picture, lights
from tests.tolerance import assert_matches_reference
from vkbloom import (
    BlenderGlare,
    GodotBloom,
    Renderer,
    Scene,
    presets,
    reference,
)

Array = NDArray[Any]

COMPOSITES = ("screen", "soft_light", "add", "replace", "mix")


def real(array: Array) -> Array:
    return array / 255 if array.dtype == np.uint8 else array.astype(np.float64)


# --- Godot ---


@pytest.mark.parametrize("shading", ["forward", "deferred"])
@pytest.mark.parametrize("composite", COMPOSITES)
def test_godots_composites_in_scenes(renderer: Renderer, composite: Any, shading: Any) -> None:
    settings = GodotBloom(composite=composite, threshold=0.2, exposure=-0.5, tonemap="reinhard")
    frames = renderer.render(Scene.ufo(), settings, (96, 64), shading=shading)
    final = reference.composite(frames["scene"], frames["bloom"], settings, np.uint8)
    assert_allclose(real(frames["final"]), final, rtol=0, atol=1.01 / 255)


@pytest.mark.parametrize("changes", [{"threshold": None}, {"white": 8.0, "intensity": 1.0}])
def test_screen_multiplies_the_rounding_of_the_bloom(
    renderer: Renderer, changes: dict[str, Any]
) -> None:
    """By 1 - s / white, for a scene s that reaches 30."""
    settings = presets["godot_4_6"].replace(format="rgba8unorm", glow_bloom=1.0, **changes)
    image = 4 * hdr_picture(136, 144, 4, "float32", 1)
    assert_matches_reference(renderer.apply(image, settings), image, settings)


def test_soft_light_comes_after_the_curve() -> None:
    """By hand: s = 1/5 and g = 1/2 past Reinhard, then 1/5 + 1/2 (((16/5 - 12)/5 + 4)/5 - 1/5)."""
    settings = GodotBloom(composite="soft_light", tonemap="reinhard", intensity=1.0)
    scene, glow = np.full((1, 1, 3), 0.25), np.full((1, 1, 3), 1.0)
    final = reference.composite(scene, glow, settings)
    assert_allclose(final, 0.2 + 0.5 * (((16 * 0.2 - 12) * 0.2 + 4) * 0.2 - 0.2), rtol=1e-12)
    bright = reference.composite(np.full((1, 1, 3), 4.0), glow, settings.replace(tonemap="none"))
    assert_allclose(bright, 4.0)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (2, 2), (3, 3), (9, 1), (13, 7)])
@pytest.mark.parametrize("bicubic", [True, False])
def test_godot_at_sides_of_1(renderer: Renderer, size: tuple[int, int], bicubic: bool) -> None:
    image = lights(*size) * 5
    settings = GodotBloom(bicubic=bicubic, level_weights=(0.5,) * 7, format="rgba32float")
    frames, expected = renderer.apply(image, settings), reference.apply(image, settings)
    assert list(frames) == list(expected)
    for name, values in expected.items():
        assert_allclose(frames[name], values, atol=1e-4 * max(1.0, float(values.max())))


def test_levels_after_the_last_weight_are_not_made(renderer: Renderer) -> None:
    image = lights(64, 64)
    frames = renderer.apply(image, GodotBloom(level_weights=(0, 1, 0, 1e-4, 0, 0, 0)))
    assert [name for name in frames if name.startswith("down")] == ["down_0", "down_1"]
    none = renderer.apply(image, GodotBloom(level_weights=(0,) * 7))
    assert [name for name in none if name.startswith("down")] == ["down_0"]
    assert (none["bloom"][..., :3] == 0).all()


# --- Blender ---


@pytest.mark.parametrize(
    ("value", "settings", "kept"),
    [
        (3.0, {"threshold": 1.0, "smoothness": 0.0}, 2.0),
        (0.5, {"threshold": 1.0, "smoothness": 0.0}, 0.0),
        (3.0, {"threshold": 1.0, "smoothness": 0.1}, 2.0),
        # smooth_max(1, 1) = 1 + k / 4.
        (1.0, {"threshold": 1.0, "smoothness": 0.1}, 0.025),
        # k is no more than the threshold.
        (0.2, {"threshold": 0.2, "smoothness": 1.0}, 0.05),
        (0.0, {"threshold": 0.2, "smoothness": 1.0}, 0.0),
        (9.0, {"threshold": 1.0, "smoothness": 0.0, "maximum": 2.0}, 2.0),
        # smooth_min(3, 3) = 3 - k / 4.
        (3.0, {"threshold": 1.0, "smoothness": 0.4, "maximum": 2.0}, 1.9),
        (3.0, {"threshold": 1.0, "smoothness": 0.4, "maximum": 0.0}, 0.0),
        (3.0, {"threshold": None}, 3.0),
    ],
)
def test_blenders_threshold_by_hand(
    renderer: Renderer, value: float, settings: dict[str, Any], kept: float
) -> None:
    """The brightest channel is changed, the others in proportion."""
    image = np.full((4, 5, 3), value, np.float32) * np.array([0.5, 1.0, 0.25], np.float32)
    glare = BlenderGlare(format="rgba32float", **settings)
    down = renderer.apply(image, glare)["glow"][..., :3]
    expected = kept * np.array([0.5, 1.0, 0.25])
    assert_allclose(down, np.broadcast_to(expected, down.shape), rtol=1e-5, atol=1e-6)
    of_reference = reference.apply(image, glare)["glow"][..., :3]
    assert_allclose(of_reference, np.broadcast_to(expected, down.shape), rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(
    ("frame", "size", "levels"),
    [
        ((96, 64), 0.5, 5),
        ((96, 64), 1.0, 6),
        ((64, 96), 0.51, 5),
        ((96, 64), 0.0, 1),
        ((1, 1), 1, 1),
    ],
)
def test_blenders_levels(
    renderer: Renderer, frame: tuple[int, int], size: float, levels: int
) -> None:
    frames = renderer.apply(lights(*frame), BlenderGlare(size=size))
    # The glow is the first.
    assert 1 + sum(name.startswith("down") for name in frames) == levels
    assert frames["glow"].shape[:2] == frame[::-1]


# --- pygfx ---


# --- three.js' node ---
