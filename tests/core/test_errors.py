"""Errors of a renderer: what is wrong is named, and the renderer can be used afterwards."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import vkbloom
from vkbloom import FilamentBloom, Frames, Renderer, Scene, Separable, Settings, presets

SIZE = (32, 24)


@pytest.fixture(scope="module")
def right(scene: Scene) -> Frames:
    with Renderer() as renderer:
        return renderer.render(scene, None, SIZE)


@pytest.fixture(autouse=True)
def usable_afterwards(renderer: Renderer, scene: Scene, right: Frames) -> Iterator[None]:
    yield
    frames = renderer.render(scene, None, SIZE)
    assert list(frames) == list(right)
    for name, array in right.items():
        np.testing.assert_array_equal(frames[name], array)


# What is rendered


@pytest.mark.parametrize("given", [None, "ufo", 5, Scene])
def test_a_scene_is_needed(renderer: Renderer, given: Any) -> None:
    with pytest.raises(TypeError, match=r"^scene: "):
        renderer.render(given, None, SIZE)


@pytest.mark.parametrize("settings", [5, {}, Separable])
def test_settings_are_needed(renderer: Renderer, scene: Scene, settings: Any) -> None:
    with pytest.raises(TypeError, match=r"^settings: "):
        renderer.render(scene, settings, SIZE)


@pytest.mark.parametrize(
    "size",
    [
        (0, 1),
        (1, 0),
        (-1, 5),
        (1.5, 2),
        (2**31, 1),
        (2**64, 1),
        pytest.param((10**400, 1), id="huge"),
        (math.inf, 1),
        (math.nan, 1),
    ],
    ids=str,
)
def test_sizes_out_of_range(renderer: Renderer, scene: Scene, size: Any) -> None:
    with pytest.raises((TypeError, ValueError), match=r"^size: "):
        renderer.render(scene, None, size)


@pytest.mark.parametrize("size", [5, None, (1,), (1, 2, 3), ("a", 1), "ab"], ids=str)
def test_sizes_of_the_wrong_type(renderer: Renderer, scene: Scene, size: Any) -> None:
    with pytest.raises(TypeError, match=r"^size: "):
        renderer.render(scene, None, size)


@pytest.mark.parametrize("size", [(100_000, 1), (1, 100_000), (100_000, 100_000)], ids=str)
def test_sizes_beyond_the_adapter(renderer: Renderer, scene: Scene, size: Any) -> None:
    with pytest.raises(ValueError, match=rf"size of {size[0]} x {size[1]} .* 1 to \d+ a side"):
        renderer.render(scene, None, size)
    for settings in (Separable(bloom_size=size), Separable(bloom_size=size, direct=True)):
        with pytest.raises(ValueError, match=rf"bloom_size: a size of {size[0]} x {size[1]} "):
            renderer.render(scene, settings, SIZE)


@pytest.mark.parametrize("settings", [*presets.values(), FilamentBloom(resolution=2048)])
def test_sizes_that_sizes_of_levels_would_overflow_from(
    renderer: Renderer, scene: Scene, settings: Settings
) -> None:
    """Once a loop without an end: a level of 2^31 pixels, twice as wide, is not 0 pixels wide."""
    for size in ((2**20, 1), (2**31 - 1, 1), (1, 2**31 - 1)):
        with pytest.raises(ValueError, match=rf"^size: a size of {size[0]} x {size[1]} "):
            renderer.render(scene, settings, size)
        with pytest.raises(ValueError, match=rf"bloom_size: a size of {size[0]} x {size[1]} "):
            renderer.render(scene, settings.replace(bloom_size=size), SIZE)


def test_a_scale_beyond_the_adapter(renderer: Renderer, scene: Scene) -> None:
    with pytest.raises(ValueError, match="glow: a size of 40000 x 4 "):
        renderer.render(scene, Separable(bloom_scale=4.0), (10_000, 1))


@pytest.mark.parametrize(
    ("time", "error"),
    [
        (math.nan, ValueError),
        (math.inf, ValueError),
        (-math.inf, ValueError),
        pytest.param(10**400, ValueError, id="huge"),
        ("1", TypeError),
        (None, TypeError),
        (1j, TypeError),
        ([1.0], TypeError),
        (np.array([1.0]), TypeError),
    ],
    ids=str,
)
def test_times(
    renderer: Renderer, scene: Scene, time: Any, error: type[ValueError] | type[TypeError]
) -> None:
    with pytest.raises(error, match=r"^time: "):
        renderer.render(scene, None, SIZE, time=time)
    with pytest.raises(error, match=r"^time: "):
        vkbloom.grid(scene, None, {"exposure": [0.0]}, size=SIZE, time=time, renderer=renderer)
    with pytest.raises(error, match=r"^time: "):
        vkbloom.grid(scene, None, {"time": [0.0, time]}, size=SIZE, renderer=renderer)


@pytest.mark.parametrize("shading", ["", "Forward", 5, None])
def test_shadings(renderer: Renderer, scene: Scene, shading: Any) -> None:
    with pytest.raises((TypeError, ValueError), match=r"^shading: .*forward"):
        renderer.render(scene, None, SIZE, shading=shading)


def test_positions_and_names_of_arguments(renderer: Renderer, scene: Scene) -> None:
    render: Any = renderer.render
    with pytest.raises(TypeError):
        render(scene, None, SIZE, "forward")
    with pytest.raises(TypeError, match="colour"):
        render(scene, None, SIZE, colour="red")


# Framebuffers


@pytest.mark.parametrize("name", ["", "nope", "Final", "blur_horizontal_0_0", "skybox"])
def test_unknown_framebuffers(renderer: Renderer, scene: Scene, name: str) -> None:
    with pytest.raises(ValueError, match="framebuffers") as caught:
        renderer.render(scene, None, SIZE, framebuffers=("final", name))
    assert repr(name) in str(caught.value)
    for known in ("glow", "glow_depth", "blur_vertical", "bloom", "scene", "depth", "final"):
        assert known in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        (Separable(bloom=False), "bloom"),
        (Separable(bloom=False), "glow"),
        (Separable(direct=True), "blur_vertical"),
        (Separable(loops=2), "blur_horizontal_0_0"),
    ],
)
def test_framebuffers_that_these_settings_do_not_have(
    renderer: Renderer, scene: Scene, settings: Separable, name: str
) -> None:
    with pytest.raises(ValueError, match=f"framebuffers: .*'{name}'"):
        renderer.render(scene, settings, SIZE, framebuffers=name)


@pytest.mark.parametrize("framebuffers", [5, None, [5], [None], [b"final"]], ids=str)
def test_framebuffers_are_names(renderer: Renderer, scene: Scene, framebuffers: Any) -> None:
    with pytest.raises(TypeError, match="framebuffers"):
        renderer.render(scene, None, SIZE, framebuffers=framebuffers)


def test_framebuffers_that_are_no_text(renderer: Renderer, scene: Scene) -> None:
    with pytest.raises(ValueError):  # noqa: PT011  a UnicodeEncodeError is one, in Python's words
        renderer.render(scene, None, SIZE, framebuffers=["\ud800"])
    with pytest.raises(ValueError, match="framebuffers"):
        renderer.render(scene, None, SIZE, framebuffers=["x" * 100_000])


# Arrays to fill


def wrong_arrays() -> dict[str, np.ndarray[Any, Any]]:
    width, height = SIZE
    shape = (height, width, 4)
    read_only = np.zeros(shape, np.uint8)
    read_only.flags.writeable = False
    return {
        "transposed": np.zeros((width, height, 4), np.uint8),
        "three channels": np.zeros((height, width, 3), np.uint8),
        "flat": np.zeros(width * height * 4, np.uint8),
        "empty": np.zeros((0, 0, 4), np.uint8),
        "larger": np.zeros((height + 1, width, 4), np.uint8),
        "signed": np.zeros(shape, np.int8),
        "float32": np.zeros(shape, np.float32),
        "object": np.zeros(shape, object),
        "columns first": np.zeros(shape, np.uint8, order="F"),
        "every other row": np.zeros((2 * height, width, 4), np.uint8)[::2],
        "bottom row first": np.zeros(shape, np.uint8)[::-1],
        "read-only": read_only,
        "broadcast": np.broadcast_to(np.uint8(0), shape),
    }


@pytest.mark.parametrize("kind", wrong_arrays())
def test_arrays_that_do_not_fit(renderer: Renderer, scene: Scene, kind: str) -> None:
    array = wrong_arrays()[kind]
    with pytest.raises(ValueError, match=r"^out: final "):
        renderer.render(scene, None, SIZE, out={"final": array})
    assert not array.any()


def test_the_wrong_byte_order(renderer: Renderer, scene: Scene) -> None:
    foreign = np.dtype(np.float32).newbyteorder("S")
    with pytest.raises(ValueError, match=r"^out: depth "):
        renderer.render(scene, None, SIZE, out={"depth": np.zeros(SIZE[::-1], foreign)})


@pytest.mark.parametrize("array", [None, [1], b"\0", bytearray(10), memoryview(b"1")], ids=type)
def test_arrays_are_arrays(renderer: Renderer, scene: Scene, array: Any) -> None:
    with pytest.raises(TypeError, match=r"^out: final "):
        renderer.render(scene, None, SIZE, out={"final": array})


@pytest.mark.parametrize("out", [5, [1], np.zeros((SIZE[1], SIZE[0], 4), np.uint8)], ids=type)
def test_out_is_a_mapping(renderer: Renderer, scene: Scene, out: Any) -> None:
    with pytest.raises(TypeError, match=r"\bout\b"):
        renderer.render(scene, None, SIZE, out=out)


# Renderers


def test_use_after_close(scene: Scene) -> None:
    renderer = Renderer(validation=True)
    renderer.close()
    for _ in range(2):
        with pytest.raises(ValueError, match="closed"):
            renderer.render(scene, None, SIZE)
    with pytest.raises(ValueError, match="closed"):
        renderer.render(scene, None, SIZE, framebuffers=())
    assert renderer.closed


def test_a_mistake_before_the_first_frame(scene: Scene) -> None:
    with Renderer(validation=True) as renderer:
        with pytest.raises(ValueError, match="framebuffers"):
            renderer.render(scene, None, SIZE, framebuffers="nope")
        assert renderer.render(scene, None, SIZE)["final"].any()


# Exceptions


def test_the_tree_of_exceptions() -> None:
    for name, also in {
        "AdapterNotFoundError": RuntimeError,
        "DeviceLostError": Exception,
        "OutOfMemoryError": MemoryError,
        "ValidationError": Exception,
        "ShaderError": Exception,
    }.items():
        error = getattr(vkbloom, name)
        assert issubclass(error, vkbloom.Error)
        assert issubclass(error, also)
        assert not issubclass(error, ValueError)
        assert error.__name__ == name
        assert error.__doc__
        assert error("text").vk_call is None
        assert error("text").vk_result is None
    assert issubclass(vkbloom.Error, Exception)


@pytest.mark.parametrize("name", ["nothing", "depth"])
def test_out_names_what_is_wanted(renderer: Renderer, scene: Scene, name: str) -> None:
    spare = np.zeros((9, 16), np.float32)
    with pytest.raises(ValueError, match=rf"^out: '{name}' is not among the framebuffers: final$"):
        renderer.render(scene, size=(16, 9), framebuffers="final", out={name: spare})
