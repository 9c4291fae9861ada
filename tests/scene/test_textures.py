"""Textures: sampled values against NumPy; mip levels; draws; errors."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.planned import change, contents_arguments, frame_block, new_arrays
from tests.refusals import assert_refused, rows
from tests.scene.parts import Mesh, Texture, mip_levels
from tests.screens import CAMERA, NOTHING, panel, rgb
from vkbloom import Frames, Renderer, Scene, Separable, _core, reference

Array = NDArray[Any]

HALF = 2.0**-11  # half of the last bit of a half float, relative
# A filter's weights have 8 bits (Vulkan asks for 4, lavapipe and GPUs have 8), on each of two axes;
# places in a texture are exact to far less than that here.
FILTERED = 2 / 256 + HALF
MODES = ("repeat", "mirror-repeat", "clamp-to-edge")


def half_colours(width: int, height: int, *, highest: float = 1.0) -> NDArray[np.float16]:
    """Return random linear colours (height, width, 4) that half floats hold, with alpha 1."""
    colours = np.ones((height, width, 4), np.float16)
    generator = np.random.default_rng((width, height))
    colours[..., :3] = generator.random((height, width, 3)) * highest
    return colours


def texture(colours: NDArray[np.float16], filter: Any = "nearest", **more: Any) -> Texture:
    return Texture((colours,), mag_filter=filter, min_filter=filter, **more)


def render_deferred(renderer: Renderer, body: Mesh, size: tuple[int, int], **more: Any) -> Frames:
    scene = Scene(body=body, camera=CAMERA, **more)
    return renderer.render(scene, None, size, shading="deferred")


def wrap(texel: Array, side: int, mode: str) -> Array:
    """Return the texels in 0..side-1 for any integer coordinates."""
    if mode == "repeat":
        return texel % side
    if mode == "clamp-to-edge":
        return np.clip(texel, 0, side - 1)
    there = texel % (2 * side)
    return np.where(there < side, there, 2 * side - 1 - there)


def sample(
    colours: Array,
    size: tuple[int, int],
    places: tuple[float, float, float, float],
    modes: tuple[str, str],
    filter: str,
) -> NDArray[np.float64]:
    """Return what a panel of that size shows of colours, by the formulas of Vulkan's sampling."""
    weights = []
    for axis in range(2):
        start, end, pixels = places[axis], places[axis + 2], size[axis]
        side = colours.shape[1 - axis]
        centres = (start + (end - start) * (np.arange(pixels) + 0.5) / pixels) * side
        matrix = np.zeros((pixels, side))
        if filter == "nearest":
            parts = [(np.floor(centres), np.ones(pixels))]
        else:
            first = np.floor(centres - 0.5)
            part = centres - 0.5 - first
            parts = [(first, 1 - part), (first + 1, part)]
        for texel, share in parts:
            at = wrap(texel.astype(int), side, modes[axis])
            np.add.at(matrix, (np.arange(pixels), at), share)
        weights.append(matrix)
    shown: NDArray[np.float64] = np.einsum("yh,xw,hwc->yxc", *weights[::-1], rgb(colours))
    return shown


# What a fragment gets


@pytest.mark.parametrize("scale", [(1, 1), (3, 2)])
@pytest.mark.parametrize("side", [(16, 9), (7, 5), (1, 4)])
def test_texels_are_exact_at_whole_scales(
    renderer: Renderer, side: tuple[int, int], scale: tuple[int, int]
) -> None:
    colours, lights = half_colours(*side), half_colours(*side[::-1], highest=9)
    size = (side[0] * scale[0], side[1] * scale[1])
    shown = render_deferred(renderer, panel(size, texture(colours)), size)
    expected = np.repeat(np.repeat(colours, scale[1], axis=0), scale[0], axis=1)
    np.testing.assert_array_equal(shown["albedo"], expected)
    assert not rgb(shown["brightness"]).any()

    size = size[::-1]
    emits = panel(size, emission=texture(lights), radiance=(1.0, 1.0, 1.0))
    shown = render_deferred(renderer, emits, size)
    expected = np.repeat(np.repeat(lights, scale[0], axis=0), scale[1], axis=1)
    np.testing.assert_array_equal(shown["brightness"], expected)
    assert (rgb(shown["albedo"]) == 1).all()


@pytest.mark.parametrize("filter", ["nearest", "linear"])
@pytest.mark.parametrize("modes", list(itertools.product(MODES, MODES)), ids="-".join)
def test_wrapping_and_filters(renderer: Renderer, modes: tuple[str, str], filter: str) -> None:
    colours, size = half_colours(5, 4), (96, 72)
    # Over two repetitions to both sides; no pixel's centre is at an edge between two texels.
    places = (-2.137, -1.713, 3.271, 2.609)
    base = texture(colours, filter, address_mode=modes)
    shown = render_deferred(renderer, panel(size, base, places=places), size)
    expected = sample(colours, size, places, modes, filter)
    error = np.abs(rgb(shown["albedo"]) - expected)
    assert error.max() <= (FILTERED if filter == "linear" else 0), error.max()


def test_without_a_texture_it_is_white(renderer: Renderer) -> None:
    size = (8, 6)
    plain = dataclasses.replace(panel(size, colour=(0.3, 0.2, 0.1)), surfaces=())
    white = panel(size, colour=(0.3, 0.2, 0.1))
    expected = render_deferred(renderer, plain, size)
    for name, array in render_deferred(renderer, white, size).items():
        np.testing.assert_array_equal(array, expected[name], err_msg=name)


def test_both_shadings_show_the_same(renderer: Renderer) -> None:
    size = (64, 48)
    body = panel(size, texture(half_colours(5, 7), "linear"), places=(0, 0, 2, 2))
    forward = renderer.render(Scene(body=body, camera=CAMERA), Separable(bloom=False), size)
    shown = render_deferred(renderer, body, size)
    difference = np.abs(np.clip(rgb(shown["scene"]), 0, 1) * 255 - forward["scene"][..., :3])
    # Half a level of rounding, and the G-buffer's half floats.
    assert difference.max() <= 0.5 + 255 * 4 * HALF
    gbuffer = (shown[name] for name in ("albedo", "normal", "position", "brightness"))
    expected = reference.shade(*gbuffer)
    assert (np.abs(shown["scene"] - expected) <= HALF * np.abs(expected) + 1e-5).all()


# The glow mesh


def test_a_glow_mesh_with_a_texture(renderer: Renderer) -> None:
    colours, size = half_colours(16, 9), (16, 9)
    scene = Scene(body=NOTHING, glow=panel(size, texture(colours)), camera=CAMERA)
    settings = Separable(bloom_size=size, format="rgba16float")
    np.testing.assert_array_equal(renderer.render(scene, settings, size)["glow"], colours)
    strong = dataclasses.replace(scene, glow_intensity=4.0)
    shown = renderer.render(strong, settings, size, shading="deferred")
    np.testing.assert_array_equal(rgb(shown["brightness"]), 4 * rgb(colours))


# The emission of a body


@pytest.mark.parametrize("format", ["rgba8unorm", "rgba16float"])
@pytest.mark.parametrize("threshold", [None, 0.75])
@pytest.mark.parametrize("textured", [True, False])
def test_a_body_that_emits_glows_in_both_systems(
    renderer: Renderer, textured: bool, threshold: float | None, format: Any
) -> None:
    size = (16, 9)
    body = panel(size, emission=texture(half_colours(*size)), radiance=(3.0, 0.5, 0.0))
    if not textured:
        body = dataclasses.replace(body, surfaces=())
    settings = Separable(bloom_size=size, format=format, threshold=threshold)
    scene = Scene(body=body, camera=CAMERA)
    shown = renderer.render(scene, settings, size)
    other = renderer.render(scene, settings, size, shading="deferred")
    brightness = rgb(other["brightness"]).astype(float)
    kept = brightness @ (0.2126, 0.7152, 0.0722) > (threshold or 0)
    light = brightness * kept[..., np.newaxis]
    if format == "rgba8unorm":
        light = np.round(255 * np.clip(light, 0, 1))
    # Half a level may be rounded either way from the half floats.
    assert np.abs(rgb(shown["glow"]) - light).max() <= (format == "rgba8unorm")
    np.testing.assert_array_equal(shown["glow_depth"], shown["depth"])
    lit = np.clip(rgb(other["scene"]), 0, 1) * 255
    assert np.abs(rgb(shown["scene"]) - lit).max() <= 0.5 + 255 * 4 * HALF
    off = renderer.render(scene, settings.replace(bloom=False), size)
    np.testing.assert_array_equal(off["scene"], shown["scene"])


def test_what_a_body_hides_of_its_own_emission_does_not_glow(renderer: Renderer) -> None:
    size = (16, 9)
    near, behind = panel(size, across=(0.5, 1.0)), panel(size, across=(0.0, 0.9))
    far = behind.vertices - np.array([0, 0, 1, *[0] * 6], np.float32)
    body = Mesh(
        np.concatenate((near.vertices, far)),
        np.concatenate((near.indices, behind.indices + np.uint32(4))),
        np.repeat(np.array([[0, 0, 0], [1, 1, 1]], np.float32), 4, axis=0),
    )
    scene = Scene(body=body, camera=CAMERA)
    glow = rgb(renderer.render(scene, Separable(bloom_size=size), size)["glow"])
    assert not glow[:, 8:].any()
    assert glow[2:-2, 2:7].all()


# Several textures


def join(parts: list[Mesh]) -> Mesh:
    """Return panels as one mesh; those without a surface come first."""
    return Mesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.indices + np.uint32(4 * i) for i, part in enumerate(parts)]),
        None,
        np.concatenate([part.texcoords for part in parts if part.texcoords is not None]),
        tuple(surface for part in parts for surface in part.surfaces),
    )


def test_surfaces_with_textures_of_several_sizes_beside_plain_triangles(renderer: Renderer) -> None:
    size = (30, 8)
    sides = [(10, 8), (5, 4)]
    pictures = [half_colours(*side) for side in sides]
    parts = [
        dataclasses.replace(panel(size, across=(2 / 3, 1), colour=(0.5, 0.5, 0.5)), surfaces=()),
        panel(size, texture(pictures[0]), across=(0, 1 / 3)),
        panel(size, texture(pictures[1]), across=(1 / 3, 2 / 3)),
    ]
    shown = rgb(render_deferred(renderer, join(parts), size)["albedo"])
    np.testing.assert_array_equal(shown[:, :10], rgb(pictures[0]))
    np.testing.assert_array_equal(shown[:, 10:20], rgb(pictures[1]).repeat(2, 0).repeat(2, 1))
    np.testing.assert_array_equal(shown[:, 20:], 0.5)


def test_hundreds_of_textures(renderer: Renderer) -> None:
    count = 300
    size = (count, 2)
    shades = np.linspace(0, 1, count).astype(np.float16)
    parts = [
        panel(size, texture(np.full((1, 1, 4), shade)), across=(i / count, (i + 1) / count))
        for i, shade in enumerate(shades)
    ]
    shown = render_deferred(renderer, join(parts), size)["albedo"]
    np.testing.assert_array_equal(shown[..., 0], np.tile(shades, (2, 1)))


def test_scenes_with_and_without_textures_take_turns(new_renderer: Callable[[], Renderer]) -> None:
    renderer, size = new_renderer(), (8, 8)
    scenes = [
        Scene(body=body, camera=CAMERA)
        for body in (
            panel(size, texture(half_colours(8, 8))),
            dataclasses.replace(panel(size), surfaces=()),
            panel(size, texture(half_colours(4, 4))),
        )
    ]
    first = [renderer.render(scene, None, size, shading="deferred") for scene in scenes]
    for scene, expected in zip(scenes, first, strict=True):
        again = renderer.render(scene, None, size, shading="deferred")
        for name, array in expected.items():
            np.testing.assert_array_equal(again[name], array, err_msg=name)
    # The same scene again draws nothing again.
    assert not renderer.render(scenes[-1], None, size, shading="deferred").timings


# Mip levels


def covered_means(line: Array, count: int) -> NDArray[np.float64]:
    """Return the means of a line of texels over `count` equal parts of it, by its integral."""
    edges = np.arange(len(line) + 1)
    integral = np.concatenate(([0], np.cumsum(line.astype(np.float64))))
    ends = np.interp(np.linspace(0, len(line), count + 1), edges, integral)
    return np.diff(ends) * count / len(line)


@pytest.mark.parametrize("side", [(8, 8), (7, 5), (1, 9), (13, 1), (1, 1), (6, 31)])
def test_a_mip_level_is_the_mean_of_what_it_covers(side: tuple[int, int]) -> None:
    levels = mip_levels(half_colours(*side))
    for index, level in enumerate(levels):
        height, width = (max(1, length >> index) for length in side[::-1])
        assert level.shape == (height, width, 4)
        assert level.dtype == np.float16
    assert levels[-1].shape == (1, 1, 4)
    for above, level in itertools.pairwise(levels):
        expected = np.apply_along_axis(covered_means, 0, above, level.shape[0])
        expected = np.apply_along_axis(covered_means, 1, expected, level.shape[1])
        # Each is rounded to half, and so was what it was made of.
        np.testing.assert_allclose(level, expected, atol=2 * HALF)
    # No level moves the picture's brightness.
    assert np.ptp([level.astype(np.float64).mean() for level in levels]) < 2 * HALF


@pytest.mark.parametrize("scale", [2, 8])
def test_a_pixel_is_the_mean_of_its_texels(renderer: Renderer, scale: int) -> None:
    colours, size = half_colours(64, 64), (64 // scale, 64 // scale)
    body = panel(size, Texture(mip_levels(colours)))
    shown = rgb(render_deferred(renderer, body, size)["albedo"])
    blocks = rgb(colours).reshape(size[1], scale, size[0], scale, 3)
    # The level is chosen by a logarithm that devices round, so a little of the next ones may come.
    np.testing.assert_allclose(shown, blocks.mean(axis=(1, 3)), atol=0.02)


def test_filters_between_levels(renderer: Renderer) -> None:
    # Levels of one colour each, so that the colour says which was read.
    levels = tuple(np.full((64 >> i, 64 >> i, 4), i, np.float16) for i in range(7))
    # 64 / 23 texels a pixel: level log2(2.78) = 1.48.
    size = (23, 23)
    shown = {
        filter: rgb(
            render_deferred(renderer, panel(size, Texture(levels, mipmap_filter=filter)), size)[
                "albedo"
            ]
        )
        for filter in ("nearest", "linear")
    }
    np.testing.assert_array_equal(shown["nearest"], 1)
    # A device's logarithm may be a rough one.
    np.testing.assert_allclose(shown["linear"], np.log2(64 / 23), atol=0.1)


# Values


def test_a_texture_keeps_its_own_read_only_levels() -> None:
    colours = half_colours(4, 3)
    made = Texture((colours,))
    colours[...] = 0
    assert made.levels[0].any()
    assert not made.levels[0].flags.writeable
    assert repr(made) == "Texture(4 x 3, levels: 1)"


def test_meshes_with_textures_can_be_pickled(renderer: Renderer) -> None:
    size = (8, 8)
    base = texture(half_colours(8, 8), address_mode=("clamp-to-edge", "repeat"))
    body = panel(size, base, base, radiance=(1.0, 1.0, 1.0))
    again = pickle.loads(pickle.dumps(body))
    (surface,) = again.surfaces
    assert surface.base is surface.emission
    assert surface.base.address_mode == ("clamp-to-edge", "repeat")
    shown, expected = (render_deferred(renderer, mesh, size) for mesh in (again, body))
    np.testing.assert_array_equal(shown["brightness"], expected["brightness"])
    assert body.summary == "4 triangles, 4 vertices, textures: 1"


BODY = panel((4, 4))


PANEL = Scene(body=BODY, camera=CAMERA)


def draw(renderer: Renderer, surfaces: Any = None, **places: int) -> None:
    """Draw a mesh with a texture; the core gets other surfaces and numbers of its pictures."""
    block, pictures, arrays = contents_arguments(PANEL)
    if surfaces is not None:
        arrays = (*arrays[:3], np.array(surfaces, np.uint32), *arrays[4:])
    contents = _core.scene_contents(block, change(pictures, **places), arrays)
    source = _core.scene_source(contents, frame_block(PANEL, (4, 4), "forward", 0.0))
    plan = renderer._core.plan(source, Separable(), None)
    renderer._core.run(source, (plan,), (new_arrays(renderer._core, plan),))


@pytest.mark.parametrize(("call", "error"), rows(__file__, "textures"))
def test_a_wrong_value_is_refused(renderer: Renderer, call: str, error: str) -> None:
    assert_refused(call, error, globals() | {"draw": functools.partial(draw, renderer)})
    draw(renderer)
