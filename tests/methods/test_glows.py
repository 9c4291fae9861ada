"""Godot's glow, Blender's bloom and pygfx' bloom: formulas worked out by hand, and errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tests.exhaustive import by_turns
from tests.images import hdr_picture
from tests.tolerance import assert_matches_reference
from vkbloom import (
    BlenderGlare,
    GodotBloom,
    PygfxBloom,
    Renderer,
    Scene,
    Separable,
    UnrealBloom,
    presets,
    reference,
)

Array = NDArray[Any]

COMPOSITES = ("screen", "soft_light", "add", "replace", "mix")
CURVES = ("none", "reinhard", "aces")


def lights(size: tuple[int, int], dtype: str = "float32", channels: int = 3) -> Array:
    width, height = size
    generator = np.random.default_rng(11)
    image = 0.6 * generator.random((height, width, channels))
    image[generator.random((height, width)) < 0.02, :3] *= 1.6 if dtype == "uint8" else 30
    if dtype == "uint8":
        return np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
    return image.astype(dtype)


def real(array: Array) -> Array:
    return array / 255 if array.dtype == np.uint8 else array.astype(np.float64)


# --- Godot ---


@pytest.mark.parametrize(
    ("tonemap", "composite", "stored"),
    by_turns(CURVES, COMPOSITES, turns=[("float32", 3), ("float16", 4), ("uint8", 4)]),
)
def test_godots_composites(
    renderer: Renderer, composite: Any, tonemap: Any, stored: tuple[str, int]
) -> None:
    dtype, channels = stored
    settings = GodotBloom(
        composite=composite,
        tonemap=tonemap,
        exposure=0.5,
        intensity=0.8,
        threshold=0.3,
        white=2.0,
        encoding="srgb",
        format="rgba32float",
    )
    image = lights((61, 43), dtype, channels)
    image[:4, :4, 0] = 0 if dtype == "uint8" else -0.5
    frames = renderer.apply(image, settings)
    expected = reference.apply(image, settings)
    limits = {"float32": 1e-4, "float16": 2e-3, "uint8": 1.01 / 255}
    limit = limits[dtype] * max(1.0, float(np.abs(expected["final"]).max()))
    assert_allclose(real(frames["final"]), expected["final"], rtol=0, atol=limit)
    assert_allclose(frames["bloom"], expected["bloom"], rtol=0, atol=1e-4 * expected["bloom"].max())


@pytest.mark.parametrize("shading", ["forward", "deferred"])
@pytest.mark.parametrize("composite", COMPOSITES)
def test_godots_composites_in_scenes(renderer: Renderer, composite: Any, shading: Any) -> None:
    settings = GodotBloom(composite=composite, threshold=0.2, exposure=-0.5, tonemap="reinhard")
    frames = renderer.render(Scene.ufo(), settings, (96, 64), shading=shading)
    final = reference.composite(frames["scene"], frames["bloom"], settings, np.uint8)
    assert_allclose(real(frames["final"]), final, rtol=0, atol=1.01 / 255)


def test_screen_lets_the_scene_be_bright(renderer: Renderer) -> None:
    """s + g - s g / white with g up to white alone: s goes on above 1."""
    image = np.full((8, 8, 3), 3.0, np.float32)
    settings = GodotBloom(glow_bloom=1.0, intensity=1.0, format="rgba32float")
    frames = renderer.apply(image, settings)
    assert frames["bloom"][..., :3].min() > 1
    assert_allclose(frames["final"], 3.0 + 1.0 - 3.0, rtol=1e-5)


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


def test_the_threshold_sees_the_exposure(renderer: Renderer) -> None:
    """0.9 is under the threshold of 1; one stop more makes it 1.8."""
    image = np.full((16, 16, 3), 0.9, np.float32)
    assert renderer.apply(image, GodotBloom())["bloom"][..., :3].max() == 0
    settings = GodotBloom(exposure=1.0)
    exposed = renderer.apply(image, settings)["bloom"][..., :3]
    assert exposed.min() > 0.1
    assert_allclose(exposed, reference.apply(image, settings)["bloom"][..., :3], rtol=2e-3)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (2, 2), (3, 3), (9, 1), (13, 7)])
@pytest.mark.parametrize("bicubic", [True, False])
def test_godot_at_sides_of_1(renderer: Renderer, size: tuple[int, int], bicubic: bool) -> None:
    image = lights(size) * 5
    settings = GodotBloom(bicubic=bicubic, level_weights=(0.5,) * 7, format="rgba32float")
    frames, expected = renderer.apply(image, settings), reference.apply(image, settings)
    assert list(frames) == list(expected)
    for name, values in expected.items():
        assert_allclose(frames[name], values, atol=1e-4 * max(1.0, float(values.max())))


def test_levels_after_the_last_weight_are_not_made(renderer: Renderer) -> None:
    image = lights((64, 64))
    frames = renderer.apply(image, GodotBloom(level_weights=(0, 1, 0, 1e-4, 0, 0, 0)))
    assert [name for name in frames if name.startswith("down")] == ["down_0", "down_1"]
    none = renderer.apply(image, GodotBloom(level_weights=(0,) * 7))
    assert [name for name in none if name.startswith("down")] == ["down_0"]
    assert (none["bloom"][..., :3] == 0).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"level_weights": (1.0,)}, "level_weights: 1 weights are out of range, 7"),
        ({"level_weights": (0, 0, 0, 0, 0, 0, -1)}, "level_weights: -1.0 is out of range, 0 to"),
        ({"knee": 0.5}, "knee: 0.5 is not 0"),
        ({"white": 0.0}, "white: 0.0 is out of range, 0.01"),
        ({"composite": "under"}, "composite: 'under' is not one of screen, soft_light"),
    ],
)
def test_godot_refuses_wrong_fields(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        GodotBloom(**changes)


@pytest.mark.parametrize("composite", ["soft_light", "replace", "under"])
def test_other_methods_refuse_godots_composites(composite: Any) -> None:
    with pytest.raises(ValueError, match=r"composite: .* is not one of add, mix, screen, which"):
        Separable(composite=composite)


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
    frames = renderer.apply(lights(frame), BlenderGlare(size=size))
    # The glow is the first.
    assert 1 + sum(name.startswith("down") for name in frames) == levels
    assert frames["glow"].shape[:2] == frame[::-1]


def test_blenders_bloom_in_buffers_of_another_size(renderer: Renderer) -> None:
    image = lights((90, 70))
    settings = BlenderGlare(bloom_scale=0.5, maximum=3.0, format="rgba32float")
    frames, expected = renderer.apply(image, settings), reference.apply(image, settings)
    for name, values in expected.items():
        assert_allclose(frames[name], values, atol=1e-4 * max(1.0, float(values.max())))


# --- pygfx ---


@pytest.mark.parametrize(
    ("size", "radius", "karis_average"),
    by_turns([(1, 1), (2, 9), (97, 61), (128, 64)], [0.0, 0.005, 0.2], turns=[True, False]),
)
def test_pygfx_is_its_reference(
    renderer: Renderer, size: tuple[int, int], karis_average: bool, radius: float
) -> None:
    image = lights(size)
    image[0, 0] = -1
    settings = PygfxBloom(
        karis_average=karis_average, filter_radius=radius, levels=4, format="rgba32float"
    )
    frames, expected = renderer.apply(image, settings), reference.apply(image, settings)
    assert list(frames) == list(expected)
    for name, values in expected.items():
        assert_allclose(frames[name], values, atol=1e-4 * max(1.0, float(values.max())))


def test_pygfx_has_no_threshold() -> None:
    with pytest.raises(ValueError, match=r"threshold: 1\.0 is not None"):
        PygfxBloom(threshold=1.0)
    with pytest.raises(ValueError, match=r"composite: .add. is not one of mix, which"):
        PygfxBloom(composite="add")


# --- three.js' node ---


@pytest.mark.parametrize("size", [(1, 1), (97, 61), (64, 33)])
def test_the_node_is_its_reference(renderer: Renderer, size: tuple[int, int]) -> None:
    image = lights(size)
    settings = UnrealBloom(node=True, intensity=1.0, threshold=0.4, format="rgba32float")
    frames, expected = renderer.apply(image, settings), reference.apply(image, settings)
    half = tuple(max(1, side // 2) for side in size)
    assert frames["bright"].shape[1::-1] == half
    for name, values in expected.items():
        assert_allclose(frames[name], values, atol=1e-4 * max(1.0, float(values.max())))
