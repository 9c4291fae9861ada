"""A pass runs only when it is out of date, and the pictures are the same as if all had run."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest

from tests.device.abilities import max_side
from tests.framebuffers import assert_same
from tests.screens import noise, screen
from vkbloom import Camera, Frames, Renderer, Scene, Separable

SIZE = (160, 90)
ALL = ["glow", "blur_vertical", "bloom", "scene", "final"]
BLUR = ["blur_vertical", "bloom", "final"]


@pytest.fixture
def opened(new_renderer: Callable[[], Renderer], scene: Scene) -> Renderer:
    """A renderer that has just rendered the default frame.

    On a CPU, the passes of a direct blur sample images that others load: these are made once more.
    """
    renderer = new_renderer()
    renderer.render(scene, Separable(direct=True, threshold=0.1), SIZE, time=0.5)
    assert list(renderer.render(scene, None, SIZE).timings) == ALL
    return renderer


def fresh(*arguments: Any, **more: Any) -> Frames:
    """Return the frames of a renderer that renders nothing else."""
    with Renderer() as renderer:
        return renderer.render(*arguments, **more)


@pytest.fixture(scope="module")
def default(scene: Scene) -> Frames:
    return fresh(scene, None, SIZE)


Alone = Callable[..., Frames]


@pytest.fixture(scope="module")
def alone() -> Iterator[Alone]:
    """Renders a frame after one of another scene and size, of which nothing is up to date."""
    before = screen(noise((8, 8)), (33, 17))
    with Renderer() as renderer:

        def render(*arguments: Any, **more: Any) -> Frames:
            renderer.render(before, Separable(blur_strength=0.9), (33, 17))
            return renderer.render(*arguments, **more)

        yield render


# What runs after one change

CHANGES: list[tuple[dict[str, Any], list[str]]] = [
    ({}, []),
    ({"blur_strength": 0.7}, BLUR),
    ({"blur_scale": 2.0}, BLUR),
    ({"weights": (0.4, 0.3)}, BLUR),
    ({"first_tap": 0}, BLUR),
    ({"loops": 2}, ["blur_vertical_0_0", "blur_horizontal_0_0", *BLUR]),
    ({"layers": ((1.0, 1.0), (2.0, 0.5))}, ["blur_vertical_0_0", *BLUR]),
    ({"direct": True}, ["bloom", "final"]),
    # Texels of square buffers are as wide as they are high.
    ({"texel": "x"}, []),
    ({"intensity": 0.5}, ["final"]),
    ({"exposure": 1.0}, ["final"]),
    ({"composite": "screen"}, ["final"]),
    ({"tonemap": "aces"}, ["final"]),
    ({"encoding": "srgb"}, ["final"]),
    # Passes that read the scene in another way give its image another usage: it is drawn again.
    ({"bloom": False}, ["scene", "final"]),
    ({"threshold": 0.5}, ["glow", *BLUR]),
    ({"bloom_size": (64, 64)}, ["glow", *BLUR]),
    ({"format": "rgba16float"}, ["scene", "glow", *BLUR]),
    # The same picture by another name.
    ({"bloom_size": (256, 256)}, []),
    ({"format": "rgba8unorm"}, []),
    # A knee has no threshold to soften.
    ({"knee": 0.5}, []),
]


@pytest.mark.parametrize("change", CHANGES, ids=str)
def test_change_of_settings_runs_only_dependent_passes(
    opened: Renderer,
    scene: Scene,
    default: Frames,
    change: tuple[dict[str, Any], list[str]],
    alone: Alone,
) -> None:
    changes, ran = change
    settings = Separable(**changes)
    frames = opened.render(scene, settings, SIZE)
    assert sorted(frames.timings) == sorted(ran)
    assert_same(frames, alone(scene, settings, SIZE))
    # And back again, to what other frames have written over.
    assert_same(opened.render(scene, None, SIZE), default)


def test_a_size_of_the_same_aspect_leaves_the_bloom_buffers(
    opened: Renderer, scene: Scene, alone: Alone
) -> None:
    size = (2 * SIZE[0], 2 * SIZE[1])
    frames = opened.render(scene, None, size)
    assert list(frames.timings) == ["bloom", "scene", "final"]
    assert_same(frames, alone(scene, None, size))


@pytest.mark.parametrize(
    ("change", "shading"),
    [
        *itertools.product(("time", "aspect", "camera", "scene"), ("forward", "deferred")),
        ("intensity", "deferred"),
    ],
)
def test_what_changes_all(scene: Scene, alone: Alone, change: str, shading: Any) -> None:
    other, size, time = scene, SIZE, 0.0
    if change == "time":
        time = 0.3
    elif change == "aspect":
        size = (90, 160)
    elif change == "camera":
        other = dataclasses.replace(scene, camera=Camera(position=(0.5, 0, -8)))
    elif change == "intensity":
        other = dataclasses.replace(scene, glow_intensity=2.5)
    else:
        other = screen(noise((8, 8)), SIZE)
    with Renderer() as renderer:
        first = renderer.render(scene, None, SIZE, shading=shading)
        # And back again.
        for drawn, of, at in ((other, size, time), (scene, SIZE, 0.0)):
            frames = renderer.render(drawn, None, of, time=at, shading=shading)
            # The meshes stay on the device; what draws them runs.
            assert frames.timings.keys() == first.timings.keys()
            assert_same(frames, alone(drawn, None, of, time=at, shading=shading))


def test_scenes_of_the_same_camera_are_told_apart(opened: Renderer, scene: Scene) -> None:
    # Nothing but the meshes, the glow or the sky differs, not even a matrix.
    before = opened.render(scene, None, SIZE)
    for changes in ({"glow": None}, {"skybox": None}, {"body": scene.glow}):
        frames = opened.render(dataclasses.replace(scene, **changes), None, SIZE)
        assert not np.array_equal(frames["final"], before["final"])
        assert_same(opened.render(scene, None, SIZE), before)


# Framebuffers


@pytest.mark.parametrize(
    ("wanted", "ran"),
    [
        (["glow"], ["glow"]),
        (["glow_depth"], ["glow"]),
        (["blur_vertical"], ["glow", "blur_vertical"]),
        (["bloom"], ["glow", "blur_vertical", "bloom"]),
        (["scene"], ["scene"]),
        (["depth"], ["scene"]),
        (["final"], ALL),
        (["glow", "depth"], ["glow", "scene"]),
        ([], []),
    ],
    ids=str,
)
def test_passes_of_unrequested_framebuffers_do_not_run(
    new_renderer: Callable[[], Renderer],
    scene: Scene,
    default: Frames,
    wanted: list[str],
    ran: list[str],
) -> None:
    renderer = new_renderer()
    part = renderer.render(scene, None, SIZE, framebuffers=wanted)
    assert list(part.timings) == ran
    whole = renderer.render(scene, None, SIZE)
    left = [name for name in ALL if name not in ran]
    assert list(whole.timings) == left
    assert_same(whole, default)
    for name in wanted:
        np.testing.assert_array_equal(part[name], whole[name])


def test_unrequested_framebuffers_keep_their_content(
    opened: Renderer, scene: Scene, alone: Alone
) -> None:
    # The scene of another time is rendered, the glow's is not: each is as old as it is.
    opened.render(scene, None, SIZE, time=0.5, framebuffers="scene")
    frames = opened.render(scene, None, SIZE)
    assert list(frames.timings) == ["scene", "final"]
    assert_same(frames, alone(scene, None, SIZE))


def test_unrequested_framebuffers_are_not_allocated(opened: Renderer, scene: Scene) -> None:
    # Bloom buffers beyond any memory are no trouble where nothing of them is wanted.
    side = max_side(opened)
    huge = Separable(bloom_size=(side, side), format="rgba32float")
    frames = opened.render(scene, huge, SIZE, framebuffers=["scene", "depth"])
    assert list(frames) == ["scene", "depth"]
    assert list(frames.timings) == ["scene"]  # whose image gets usages of that plan


# Many changes


def test_bloom_off_and_on(opened: Renderer, scene: Scene, alone: Alone) -> None:
    right = alone(scene, None, SIZE)
    opened.render(scene, Separable(bloom=False), SIZE)
    for settings in (Separable(), Separable(bloom=False)) * 2:
        frames = opened.render(scene, settings, SIZE)
        assert list(frames.timings) == ["final"]
    frames = opened.render(scene, None, SIZE)
    assert_same(frames, right)


def test_a_walk_through_many_settings(opened: Renderer, scene: Scene) -> None:
    """Random changes of everything at once, each picture against a renderer that saw only it."""
    generator = np.random.default_rng(5)

    def pick(values: Sequence[Any]) -> Any:
        return values[int(generator.integers(len(values)))]

    for step in range(61):
        settings = Separable(
            blur_strength=pick([0.5, 1.5]),
            loops=pick([1, 2]),
            layers=pick([((1.0, 1.0),), ((1.0, 0.5), (2.0, 0.5))]),
            bloom_size=pick([None, (40, 30)]),
            format=pick([None, "rgba16float"]),
            bloom=pick([True, True, False]),
            tonemap=pick(["none", "aces"]),
        )
        size, time = pick([SIZE, (50, 50)]), pick([0.0, 0.6])
        wanted = pick(["all", "all", "final", "scene", "depth"])
        frames = opened.render(scene, settings, size, time=time, framebuffers=wanted)
        if step % 8 == 0:
            assert_same(frames, fresh(scene, settings, size, time=time, framebuffers=wanted))
