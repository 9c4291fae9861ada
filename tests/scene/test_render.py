"""Frames of the forward system: against the original's, and what holds between framebuffers."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.scene.parts import Cubemap, Mesh
from tests.screens import GBUFFER, noise, rgb, screen
from tests.tolerance import real
from vkbloom import Camera, Renderer, Scene, Separable, reference

SIZE = (320, 180)
FORWARD = ["glow", "glow_depth", "blur_vertical", "bloom", "scene", "depth", "final"]


def levels_apart(image: NDArray[Any], expected: NDArray[Any]) -> int:
    """Return the largest difference, in levels, of an 8-bit image from another."""
    return int(np.abs(image.astype(int) - expected.astype(int)).max())


# The original's frames


@pytest.fixture(scope="module")
def originals(renderer: Renderer, shared_data: Path) -> vkbloom.Frames:
    """What the original program drew, drawn here."""
    case = json.loads((shared_data / "seed_frames" / "case.json").read_text())
    meshes = shared_data / "retroufo"
    scene = Scene.from_gltf(
        meshes / "retroufo.gltf",
        glow=meshes / "retroufo_glow.gltf",
        skybox=meshes / "cubemap_space.ktx",
    )
    settings = Separable(
        bloom=case["bloom"], blur_scale=case["blur_scale"], blur_strength=case["blur_strength"]
    )
    return renderer.render(scene, settings, tuple(case["size"]), time=case["time"])


@pytest.mark.parametrize("name", ["glow", "blur_vertical", "final"])
def test_the_originals_frames(originals: vkbloom.Frames, shared_data: Path, name: str) -> None:
    stored = oiio.ImageBuf(str(shared_data / "seed_frames" / f"{name}.png"))
    expected = np.asarray(stored.get_pixels(oiio.UINT8))[..., :3]
    image = rgb(originals[name])
    assert image.shape == expected.shape
    assert expected.max() > 200
    metrics = pytest.importorskip("skimage.metrics", reason="scikit-image is not installed")
    similarity = metrics.structural_similarity(image, expected, data_range=255, channel_axis=2)
    assert similarity >= 0.999
    apart = np.abs(image.astype(int) - expected).max(axis=2)
    assert (apart <= 2).mean() >= 0.995


# Framebuffers


@pytest.mark.parametrize("shading", ["forward", "deferred"])
@pytest.mark.parametrize(
    ("format", "dtype"),
    [(None, None), ("rgba8unorm", "uint8"), ("rgba16float", "float16"), ("rgba32float", "float32")],
)
def test_names_shapes_and_dtypes(
    renderer: Renderer, scene: Scene, format: Any, dtype: Any, shading: Any
) -> None:
    settings = Separable(format=format, bloom_size=(40, 24))
    frames = renderer.render(scene, settings, (64, 36), shading=shading)
    dtype = dtype or {"forward": "uint8", "deferred": "float16"}[shading]
    blurred = [("blur_vertical", (24, 40, 4), dtype), ("bloom", (36, 64, 4), dtype)]
    expected = {
        "forward": [
            ("glow", (24, 40, 4), dtype),
            ("glow_depth", (24, 40), "float32"),
            *blurred,
            ("scene", (36, 64, 4), "uint8"),
            ("depth", (36, 64), "float32"),
        ],
        "deferred": [
            *((name, (36, 64, 4), "float16") for name in GBUFFER[:4]),
            ("depth", (36, 64), "float32"),
            *blurred,
            ("scene", (36, 64, 4), "float16"),
        ],
    }[shading]
    shown = [(name, array.shape, array.dtype.name) for name, array in frames.items()]
    assert shown == [*expected, ("final", (36, 64, 4), "uint8")]
    for name, array in frames.items():
        assert type(array) is np.ndarray
        assert array.flags.c_contiguous
        assert array.flags.owndata
        assert array.flags.writeable
        if array.ndim == 3:
            assert (real(array[..., 3]) == 1).all(), name


@pytest.mark.parametrize(
    ("settings", "bloom_size"),
    [
        (Separable(), (256, 256)),
        (Separable(bloom_scale=0.5), (160, 90)),
        (Separable(bloom_scale=0.333), (106, 59)),
        (Separable(bloom_scale=0.001), (1, 1)),
        (Separable(bloom_size=(31, 7)), (31, 7)),
        (Separable(bloom_size=(31, 7), bloom_scale=0.5), (31, 7)),
    ],
)
def test_the_size_of_the_bloom_buffers(
    renderer: Renderer, scene: Scene, settings: Separable, bloom_size: tuple[int, int]
) -> None:
    frames = renderer.render(scene, settings, SIZE)
    for name in ("glow", "glow_depth", "blur_vertical"):
        assert frames[name].shape[1::-1] == bloom_size
    assert frames["bloom"].shape[1::-1] == SIZE


def test_without_bloom(renderer: Renderer, scene: Scene) -> None:
    with_bloom = renderer.render(scene, None, SIZE)
    frames = renderer.render(scene, Separable(bloom=False), SIZE)
    assert list(frames) == ["scene", "depth", "final"]
    np.testing.assert_array_equal(frames["scene"], with_bloom["scene"])
    np.testing.assert_array_equal(frames["final"], frames["scene"])


def test_whole_turns_change_nothing(renderer: Renderer, scene: Scene) -> None:
    # Of the last one 32 bits do not hold the quarter.
    first, second, third, other, late = (
        renderer.render(scene, None, SIZE, time=turns)
        for turns in (0.0, 1.0, -12345.0, 0.25, 2.0**40 + 0.25)
    )
    for name in FORWARD:
        np.testing.assert_array_equal(first[name], second[name])
        np.testing.assert_array_equal(first[name], third[name])
        assert not np.array_equal(first[name], other[name])
        np.testing.assert_array_equal(other[name], late[name])


@pytest.mark.parametrize(("near", "far"), [(6.0, 256.0), (50.0, 1e5), (1e-4, 3.0)])
@pytest.mark.parametrize("shading", ["forward", "deferred"])
def test_no_clip_plane_cuts_the_sky(
    renderer: Renderer, scene: Scene, shading: Any, near: float, far: float
) -> None:
    # Moved far behind the camera: nothing but sky.
    behind = Camera(position=(0.0, 0.0, 1e4))
    cut = dataclasses.replace(behind, near=near, far=far)
    settings = Separable(bloom=False)
    whole, other = (
        renderer.render(dataclasses.replace(scene, camera=camera), settings, SIZE, shading=shading)[
            "scene"
        ]
        for camera in (behind, cut)
    )
    assert rgb(whole).any()
    np.testing.assert_array_equal(other, whole)


@pytest.mark.parametrize(
    ("side", "level"), [(200, 0.0), (128, 0.0), (48, math.log2(64 / 48)), (23, math.log2(64 / 23))]
)
def test_a_small_frame_sees_the_skys_mip_levels(
    renderer: Renderer, scene: Scene, side: int, level: float
) -> None:
    # Each level has its number as its colour, and one face of 64 texels fills the frame.
    levels = [
        np.full((6, 64 >> number, 64 >> number, 4), number, np.float32) for number in range(3)
    ]
    camera = Camera(position=(0.0, 0.0, 1e4), rotation=(0.0, 0.0, 0.0), fov=90.0)
    sky = dataclasses.replace(scene, skybox=Cubemap(tuple(levels)), camera=camera)
    seen = renderer.render(sky, Separable(bloom=False), (side, side), shading="deferred")["albedo"]
    # Linear between levels; devices approximate which, lavapipe to 0.04 here. The last column and
    # row of an odd side share their quads with fragments beyond the face, which have other
    # derivatives.
    inner = rgb(seen)[: side // 2 * 2, : side // 2 * 2]
    np.testing.assert_allclose(inner, level, atol=0.1)


def test_no_sky_is_black(renderer: Renderer, scene: Scene) -> None:
    bare = Scene(body=scene.body, glow=scene.glow)
    frames = renderer.render(bare, None, SIZE)
    sky = frames["depth"] == 1.0
    assert sky.any()
    assert not rgb(frames["scene"])[sky].any()
    assert rgb(renderer.render(scene, None, SIZE)["scene"])[sky].any()


def test_no_glow_is_no_bloom(renderer: Renderer, scene: Scene) -> None:
    frames = renderer.render(Scene(body=scene.body, skybox=scene.skybox), None, SIZE)
    assert list(frames) == FORWARD
    assert not rgb(frames["glow"]).any()
    assert not rgb(frames["bloom"]).any()
    assert (frames["glow_depth"] == 1.0).all()
    np.testing.assert_array_equal(frames["final"], frames["scene"])


@pytest.mark.parametrize(("shading", "name"), [("forward", "glow"), ("deferred", "brightness")])
def test_the_body_does_not_hide_the_glow(
    renderer: Renderer, scene: Scene, shading: Any, name: str
) -> None:
    # A body over all of the screen, nearer than the glow.
    wall = screen(np.ones((1, 1, 3)), SIZE)
    assert wall.glow is not None
    near = Camera(position=(0, 1, -10.25), rotation=(0, 0, 0))
    hidden, shown = (
        renderer.render(Scene(body, scene.glow, camera=near), None, SIZE, shading=shading)[name]
        for body in (wall.glow, scene.body)
    )
    assert rgb(hidden).any()
    np.testing.assert_array_equal(hidden, shown)


def test_of_two_surfaces_in_one_place_the_later_is_seen(renderer: Renderer) -> None:
    # The depth test is LESS_OR_EQUAL in the forward system.
    first, second = (screen(colour * np.ones((1, 1, 3)), SIZE).glow for colour in (0.25, 0.5))
    assert first is not None
    assert second is not None
    both = Mesh(
        np.concatenate((first.vertices, second.vertices)),
        np.concatenate((first.indices, second.indices + np.uint32(len(first.vertices)))),
    )
    camera = screen(np.ones((1, 1, 3)), SIZE).camera
    seen, alone = (
        renderer.render(Scene(body=mesh, glow=mesh, camera=camera), None, SIZE)
        for mesh in (both, second)
    )
    for name in ("glow", "scene"):
        assert rgb(alone[name]).any()
        np.testing.assert_array_equal(seen[name], alone[name], err_msg=name)


def test_depth_is_what_the_projection_says(renderer: Renderer) -> None:
    # A wall 10 units away, near 0.1, far 256: far (d - near) / (d (far - near)), depth 0..1.
    expected = 256 * (10 - 0.1) / (10 * (256 - 0.1))
    frames = renderer.render(screen(np.ones((1, 1, 3)), SIZE), None, SIZE)
    np.testing.assert_allclose(frames["glow_depth"], expected, rtol=1e-6)


@pytest.mark.parametrize("format", ["rgba8unorm", "rgba32float"])
def test_a_screen_is_the_glow_that_it_is_made_from(renderer: Renderer, format: Any) -> None:
    image = noise((37, 23))
    settings = Separable(format=format, bloom_size=(37, 23))
    glow = renderer.render(screen(image, (64, 36)), settings, (64, 36))["glow"]
    if format == "rgba8unorm":
        assert levels_apart(rgb(glow), np.round(image * 255)) == 0
    else:
        np.testing.assert_allclose(rgb(glow), image, atol=1e-6)


@pytest.mark.parametrize("threshold", [{"threshold": 1.0}, {"threshold": 1.5, "knee": 0.5}])
def test_the_threshold_is_that_of_images(renderer: Renderer, threshold: dict[str, Any]) -> None:
    image = noise((37, 23), 4.0)
    settings = Separable(**threshold, format="rgba32float", bloom_size=(37, 23))
    glow = rgb(renderer.render(screen(image, (64, 36)), settings, (64, 36))["glow"])
    expected = rgb(reference.apply(image, settings)["glow"])
    assert 0.1 < expected.any(axis=2).mean() < 0.9
    np.testing.assert_allclose(glow, expected, rtol=1e-5, atol=1e-5)


# The composite


@pytest.mark.parametrize(
    ("settings", "turns"),
    [
        (Separable(blur_scale=0.6, blur_strength=8.0), 0.37),
        (Separable(layers=((1.0, 1.0), (2.0, 0.5), (4.0, 0.25))), 0.81),
        (Separable(format="rgba16float", direct=True, bloom_scale=0.5), 0.0),
        (Separable(bloom=False, tonemap="reinhard", encoding="gamma22", exposure=1.0), 0.0),
    ],
)
def test_final_is_the_composite(
    renderer: Renderer, scene: Scene, settings: Separable, turns: float
) -> None:
    frames = renderer.render(scene, settings, SIZE, time=turns)
    bloom = real(frames["bloom"]) if settings.bloom else None
    expected = reference.composite(frames["scene"], bloom, settings)
    assert levels_apart(frames["final"], np.round(255 * expected)) <= 1


# Framebuffers, arrays to fill, what else comes back


def test_arrays_that_are_not_given_are_allocated(renderer: Renderer, scene: Scene) -> None:
    # A part of a larger array, as long as it is contiguous.
    large = np.zeros((3, SIZE[1], SIZE[0], 4), np.uint8)
    frames = renderer.render(scene, None, SIZE, out={"final": large[1]})
    assert list(frames) == FORWARD
    assert np.shares_memory(frames["final"], large)
    np.testing.assert_array_equal(large[1], renderer.render(scene, None, SIZE)["final"])
    assert not large[0].any()
    assert not large[2].any()


def test_the_time_of_a_pass_follows_its_work(renderer: Renderer, scene: Scene) -> None:
    # 4,096 times the pixels and 33 times the taps: a time that is of the same order is another's.
    small = Separable(weights=(1.0,), bloom_size=(16, 16), format="rgba32float")
    large = small.replace(weights=(0.02,) * 33, bloom_size=(1024, 1024), blur_scale=1.5)
    quick, slow = (
        min(
            renderer.render(scene, settings, SIZE, time=turns).timings["blur_vertical"]
            for turns in (0.1, 0.2, 0.3)
        )
        for settings in (small, large)
    )
    assert slow > 5 * quick


def test_info(renderer: Renderer, scene: Scene) -> None:
    frames = renderer.render(scene, None, (8, 8))
    hashed = {key: value for key, value in frames.info.items() if key == "driver_sha256"}
    assert bool(hashed) <= renderer.info.bundled
    assert frames.info == hashed | {
        "adapter": renderer.info.name,
        "driver": renderer.info.driver_info or renderer.info.driver,
        "version": vkbloom.__version__,
        "nan": 0,
        "inf": 0,
    }
