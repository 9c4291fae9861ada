"""The deferred system: each framebuffer from those before it, and against the forward system."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.scene.parts import Mesh
from tests.screens import (
    BLURRED,
    DISTANCE,
    GBUFFER,
    NOTHING,
    SIZE,
    noise,
    render_deferred,
    rgb,
    screen,
)
from tests.tolerance import assert_close, tolerance
from vkbloom import (
    Camera,
    DualKawase,
    Frames,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    presets,
    reference,
)

Array = NDArray[Any]

HALF = 2.0**-11  # half of the last bit of a half float, relative
WHITE = np.ones((1, 1, 3))


def lamps(scene: Scene) -> Scene:
    """Return the scene with a body that emits, each vertex another colour, up to 5."""
    count = len(scene.body.vertices)
    emission = np.random.default_rng(2).random((count, 3), dtype=np.float32) * 5
    body = dataclasses.replace(scene.body, emission=emission)
    return dataclasses.replace(scene, body=body, glow_intensity=3.0)


@pytest.fixture(scope="module")
def frames(renderer: Renderer, scene: Scene) -> Frames:
    return render_deferred(renderer, scene)


# The G-buffer


def test_positions_are_what_depth_and_projection_say(frames: Frames) -> None:
    camera = Camera()
    depth = frames["depth"].astype(np.float64)
    body = depth < 1
    z = camera.near * camera.far / (depth * (camera.far - camera.near) - camera.far)
    x, y = (
        (2 * (np.arange(side) + 0.5) / side - 1) * math.tan(math.radians(camera.fov / 2))
        for side in SIZE
    )
    across, down = np.meshgrid(x * SIZE[0] / SIZE[1], y)
    expected = np.stack((-across * z, -down * z, z), axis=-1)
    error = np.abs(rgb(frames["position"]) - expected)[body]
    assert body.mean() > 0.1
    # Rounded to half; depth in float32 resolves 1 / 100000 of the distance here.
    assert (error <= HALF * np.abs(expected[body]) + 2e-4 * 13).all()


def rotation(axis: int, angle: float) -> NDArray[np.float64]:
    """Return the 3x3 matrix that turns by `angle` radians around x, y or z."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[[a, b], [a, b]] = math.cos(angle)
    matrix[b, a] = math.sin(angle)
    matrix[a, b] = -math.sin(angle)
    return matrix


@pytest.mark.parametrize("turns", [0.0, 0.1, 0.25, 0.5, 0.8, -0.35, 1.15])
def test_camera_and_animation_place_every_point(renderer: Renderer, turns: float) -> None:
    # Body and glow are a triangle, in both windings, whose colours are where its points lie.
    corners = np.eye(3, dtype=np.float32)
    vertices = np.concatenate((corners, np.tile(corners[2], (3, 1)), corners), axis=1)
    mesh = Mesh(vertices, np.array([0, 1, 2, 2, 1, 0], np.uint32))
    camera = Camera(position=(0.3, 0.2, -4.0), rotation=(20.0, -40.0, 30.0), fov=60.0)
    scene = Scene(body=mesh, glow=mesh, camera=camera)
    seen = render_deferred(renderer, scene, time=turns)
    body = seen["depth"] < 1
    assert body.mean() > 0.005
    points, normals = rgb(seen["albedo"])[body], rgb(seen["normal"])[body]
    np.testing.assert_array_equal(rgb(seen["brightness"])[body], points)

    # The forward system's formulas: model = translate * rotate x * rotate y, view = translate *
    # rotate x * rotate y * rotate z.
    angle = 2 * math.pi * turns
    turned = rotation(0, -0.15 * math.sin(angle)) @ rotation(1, angle)
    moved = (0.25 * math.sin(angle), -1.0, 0.25 * math.cos(angle))
    x, y, z = (rotation(axis, math.radians(camera.rotation[axis])) for axis in range(3))
    view = x @ y @ z
    positions = (points @ turned.T + moved) @ view.T + camera.position
    # Points and positions are rounded to half; positions are up to 6 away.
    assert np.abs(rgb(seen["position"])[body] - positions).max() <= HALF * (2 + 6)
    expected = view @ turned @ (0.0, 0.0, 1.0)
    np.testing.assert_allclose(normals, np.tile(expected, (len(normals), 1)), atol=2 * HALF)

    settings = Separable(bloom_size=SIZE, format="rgba16float")
    forward = renderer.render(scene, settings, SIZE, time=turns)
    for name in ("depth", "glow_depth"):
        np.testing.assert_array_equal(forward[name], seen["depth"], err_msg=name)
    np.testing.assert_array_equal(forward["glow"], seen["brightness"])


def test_a_body_is_drawn_as_it_is(renderer: Renderer) -> None:
    colours = noise((8, 4))
    wall = screen(colours, (8, 4))
    assert wall.glow is not None
    scene = Scene(body=wall.glow, camera=wall.camera)
    shown = render_deferred(renderer, scene, None, (8, 4))
    seen = colours.any(axis=2)
    np.testing.assert_allclose(rgb(shown["albedo"]), colours, rtol=HALF, atol=1e-7)
    np.testing.assert_allclose(rgb(shown["position"])[seen][:, 2], -DISTANCE, rtol=1e-3)
    # Both windings of a square have the normal (0, 0, 1).
    np.testing.assert_array_equal(rgb(shown["normal"])[seen], np.tile((0, 0, 1), (seen.sum(), 1)))
    for name in ("normal", "position", "brightness"):
        assert not rgb(shown[name])[~seen].any(), name


def test_the_sky_is_neither_lit_nor_bright(renderer: Renderer, scene: Scene) -> None:
    shown = render_deferred(renderer, Scene(body=NOTHING, skybox=scene.skybox))
    forward = renderer.render(Scene(body=NOTHING, skybox=scene.skybox), None, SIZE)
    assert forward["scene"][..., :3].std() > 1
    np.testing.assert_allclose(
        rgb(shown["albedo"]) * 255, rgb(forward["scene"]), atol=0.5 + 255 * HALF
    )
    np.testing.assert_array_equal(shown["scene"], shown["albedo"])
    for name in ("normal", "position", "brightness", "bloom"):
        assert not rgb(shown[name]).any(), name


def test_nothing_at_all_is_black(renderer: Renderer) -> None:
    shown = render_deferred(renderer, Scene(body=NOTHING))
    for name in set(shown) - {"depth"}:
        assert not rgb(shown[name]).any(), name
    assert (shown["depth"] == 1).all()


# Brightness


def test_brightness_is_rounded_to_the_nearest(renderer: Renderer) -> None:
    colours = noise((16, 9))
    shown = render_deferred(
        renderer, dataclasses.replace(screen(colours, (16, 9)), glow_intensity=5), size=(16, 9)
    )
    np.testing.assert_allclose(rgb(shown["brightness"]), 5 * colours, rtol=1.01 * HALF, atol=1e-7)


def test_the_glow_mesh_changes_nothing_but_the_brightness(
    renderer: Renderer, scene: Scene, frames: Frames
) -> None:
    bare = render_deferred(renderer, dataclasses.replace(scene, glow=None))
    for name in ("albedo", "normal", "position", "depth"):
        np.testing.assert_array_equal(bare[name], frames[name])
    assert not rgb(bare["brightness"]).any()
    assert not rgb(bare["bloom"]).any()


def test_what_the_body_emits_is_bright(renderer: Renderer) -> None:
    colours = noise((16, 9))
    wall = screen(colours, (16, 9))
    assert wall.glow is not None
    emission = np.ascontiguousarray(wall.glow.vertices[:, 6:] * np.float32(7))
    body = dataclasses.replace(wall.glow, emission=emission)
    shown = render_deferred(renderer, Scene(body=body, camera=wall.camera), None, (16, 9))
    np.testing.assert_allclose(rgb(shown["brightness"]), 7 * colours, rtol=2 * HALF, atol=1e-6)
    # With a glow mesh the two are added, with the bloom off the body's own light stays.
    lit = Scene(body=body, glow=wall.glow, camera=wall.camera, glow_intensity=2)
    both = render_deferred(renderer, lit, None, (16, 9))
    np.testing.assert_allclose(rgb(both["brightness"]), 9 * colours, rtol=4 * HALF, atol=1e-6)
    off = render_deferred(renderer, lit, Separable(bloom=False), (16, 9))
    np.testing.assert_array_equal(off["brightness"], shown["brightness"])


def test_with_a_glow_mesh_emission_is_the_deferred_systems(
    renderer: Renderer, scene: Scene
) -> None:
    forward = renderer.render(scene, None, SIZE)
    with_lamps = renderer.render(lamps(scene), None, SIZE)
    for name, array in forward.items():
        np.testing.assert_array_equal(array, with_lamps[name])


@pytest.mark.parametrize("intensity", [7e4, 1e30, 1.7e308])
def test_no_intensity_is_infinite(renderer: Renderer, scene: Scene, intensity: float) -> None:
    shown = render_deferred(renderer, dataclasses.replace(scene, glow_intensity=intensity))
    for name, array in shown.items():
        assert np.isfinite(array).all(), name
    assert shown["brightness"].max() == 65504


def test_two_lights_are_no_infinite_one(renderer: Renderer) -> None:
    wall = screen(WHITE, (16, 9))
    assert wall.glow is not None
    emission = np.full((len(wall.glow.vertices), 3), 3e38, np.float32)
    body = dataclasses.replace(wall.glow, emission=emission)
    scene = Scene(body=body, glow=wall.glow, camera=wall.camera, glow_intensity=1e9)
    shown = render_deferred(renderer, scene, presets["deferred"], (16, 9))
    for name, array in shown.items():
        assert np.isfinite(array).all(), name
    np.testing.assert_array_equal(rgb(shown["brightness"]), 65504)


# What is made from the G-buffer


@pytest.mark.parametrize("turns", [0.0, 0.37, 0.81])
def test_the_scene_is_the_references(renderer: Renderer, scene: Scene, turns: float) -> None:
    for shown in (render_deferred(renderer, made, time=turns) for made in (scene, lamps(scene))):
        gbuffer = (shown[name] for name in ("albedo", "normal", "position", "brightness"))
        expected = reference.shade(*gbuffer)
        error = np.abs(shown["scene"] - expected)
        # Half of the last bit, and what the pow() of a highlight is off by on some devices.
        assert (error <= HALF * np.abs(expected) + 1e-5).all(), error.max()
        assert len(np.unique(np.round(expected, 2))) > 100


@pytest.mark.parametrize(
    "settings",
    [
        Separable(),
        presets["deferred"],
        presets["deferred"].replace(bloom_scale=0.5),
        Separable(threshold=1.2, bloom_size=(91, 57)),
        Separable(threshold=1.2, knee=0.5),
        Separable(format="rgba32float"),
        Separable(format="rgba8unorm"),
        Separable(direct=True, bloom_scale=0.25),
        Separable(layers=((1.0, 1.0), (2.0, 0.5), (4.0, 0.25))),
        Pyramid(levels=5, firefly_filter=True),
        DualKawase(threshold=0.5),
        presets["bevy_natural"],
        presets["unity_urp"],
    ],
)
def test_bloom_and_final_are_the_references(
    renderer: Renderer, scene: Scene, settings: Settings
) -> None:
    settings = settings.replace(tonemap="aces", encoding="srgb", exposure=-1.0)
    shown = render_deferred(renderer, lamps(scene), settings, (160, 90))
    expected = reference.apply(shown["brightness"], settings)
    for name in set(expected) - {"glow", "final"}:
        limit = tolerance(shown[name].dtype, expected[name], stages_of_8_bits=2)
        assert_close(name, shown[name], expected[name], limit)
    final = reference.composite(shown["scene"], shown["bloom"], settings, np.uint8)
    assert np.abs(shown["final"] - np.round(255 * final)).max() <= 1


# Against the forward system


@pytest.mark.parametrize("size", [(320, 180), (1280, 720)])
def test_without_bloom_both_systems_show_the_same(
    renderer: Renderer, scene: Scene, size: tuple[int, int]
) -> None:
    forward = renderer.render(scene, Separable(bloom=False), size)
    shown = render_deferred(renderer, scene, Separable(bloom=False), size)
    metrics = pytest.importorskip("skimage.metrics", reason="scikit-image is not installed")
    similarity = metrics.structural_similarity(
        rgb(forward["scene"]) / 255,
        np.clip(rgb(shown["scene"]), 0, 1),
        data_range=1,
        channel_axis=2,
    )
    assert similarity >= 0.999
    assert np.abs(rgb(forward["final"]) - rgb(shown["final"])).max() <= 1
    np.testing.assert_array_equal(forward["depth"], shown["depth"])


def test_a_lamp_is_one_in_both_systems(renderer: Renderer) -> None:
    # 0.9 itself is a lamp, though the G-buffer's half floats hold 0.8999 for it.
    colours = np.full((3, 3, 3), 0.2)
    for channel in range(3):
        colours[channel, :, channel] = (0.89, 0.9, 0.91)
    wall = screen(colours, (3, 3))
    assert wall.glow is not None
    scene = Scene(body=wall.glow, camera=wall.camera)
    shown = render_deferred(renderer, scene, None, (3, 3))
    expected = reference.shade(*(shown[name] for name in GBUFFER[:4]))
    np.testing.assert_allclose(rgb(shown["scene"]), expected[..., :3], rtol=HALF, atol=1e-5)
    forward = rgb(renderer.render(scene, None, (3, 3))["scene"]) / 255
    # Half a level, and what half floats round.
    np.testing.assert_allclose(np.clip(rgb(shown["scene"]), 0, 1), forward, atol=1 / 255)


# Passes


def test_weights_change_without_a_new_pipeline(
    new_renderer: Callable[[], Renderer], scene: Scene
) -> None:
    renderer = new_renderer()
    settings = presets["deferred"]
    assert isinstance(settings, Separable)
    before = render_deferred(renderer, scene, settings)
    count = renderer._core.pipeline_count
    weights = tuple(reversed(settings.weights))
    after = render_deferred(renderer, scene, settings.replace(weights=weights))
    assert renderer._core.pipeline_count == count > 0
    assert np.abs(rgb(after["bloom"]) - rgb(before["bloom"])).max() > 0.01
    blurs = [f"blur_{way}_0_{loop}" for loop in range(2) for way in ("vertical", "horizontal")]
    assert list(after.timings) == [*blurs, *BLURRED, "final"]


CHANGES: list[tuple[dict[str, Any], list[str]]] = [
    ({"exposure": 1.0}, ["final"]),
    ({"tonemap": "aces"}, ["final"]),
    ({"blur_strength": 0.7}, [*BLURRED, "final"]),
    ({"threshold": 0.5}, ["extracted", *BLURRED, "final"]),
    ({"bloom": False}, ["albedo", "scene", "final"]),
]


@pytest.mark.parametrize(("changes", "ran"), CHANGES)
def test_change_runs_only_dependent_passes(
    renderer: Renderer, scene: Scene, changes: dict[str, Any], ran: list[str]
) -> None:
    render_deferred(renderer, scene)
    assert list(render_deferred(renderer, scene, Separable(**changes)).timings) == ran
