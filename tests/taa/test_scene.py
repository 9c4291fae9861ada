"""Temporal anti-aliasing of scenes, which have a motion, a depth and an offset of their own."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.refusals import assert_refused, rows
from vkbloom import Renderer

from .moving import moving_frame
from .test_device import COPY, ENGINES, share_of_close

SCENE = vkbloom.Scene.ufo()
SIZE = (96, 64)
DEFERRED: dict[str, Any] = {"size": SIZE, "shading": "deferred"}
BLOOM = vkbloom.Pyramid(levels=2)
STEP = 0.004


def model_view(turns: float) -> NDArray[np.float64]:
    """Return the matrix of the body in the view of a camera, from the formulas of the animation."""
    angle = 2 * math.pi * turns
    sine, cosine = math.sin(angle), math.cos(angle)
    tilt = -0.15 * sine
    about_y = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    about_x = np.array(
        [[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]]
    )
    model = np.eye(4)
    model[:3, :3] = about_x @ about_y
    model[:3, 3] = 0.25 * sine, -1.0, 0.25 * cosine
    return model


def test_the_motion_is_that_of_the_body(renderer: Renderer) -> None:
    camera = vkbloom.Camera(position=(0, 0, -7), rotation=(0, 0, 0))
    scene = dataclasses.replace(SCENE, camera=camera)
    first = renderer.render(scene, BLOOM, taa="o3de", time=0.2, **DEFERRED)
    assert not first["motion"][..., :2].any()
    second = renderer.render(
        scene, BLOOM, taa="o3de", time=0.2 + STEP, state=first.state, **DEFERRED
    )
    surface = second["normal"][..., :3].any(axis=-1)
    position = second["position"][surface][:, :3].astype(np.float64)
    assert 0.02 < surface.mean() < 0.98
    view = np.eye(4)
    view[:3, 3] = camera.position
    now, before = (view @ model_view(turns) for turns in (0.2 + STEP, float(np.float32(0.2))))
    back = before @ np.linalg.inv(now)
    moved = position @ back[:3, :3].T + back[:3, 3]
    focal = 1 / math.tan(math.radians(camera.fov) / 2)
    scale = np.array([focal * SIZE[1] / SIZE[0], focal])

    def project(at: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(at[..., :2] * scale / -at[..., 2:])

    wanted = (project(position) - project(moved)) / 2
    found = second["motion"]
    np.testing.assert_allclose(found[surface][:, :2], wanted, atol=1e-6)
    assert np.abs(wanted * SIZE).max() > 0.1
    # The background is still and far.
    np.testing.assert_array_equal(found[~surface], [[0, 0, 1, 1]] * (~surface).sum())
    assert (found[surface][:, 2] < 1).all()
    assert (found[..., 3] == 1).all()


@pytest.mark.parametrize("name", ENGINES)
def test_the_reference(renderer: Renderer, name: str) -> None:
    taa = vkbloom.antialiasing[name]
    state: Any = {}
    for number in range(4):
        before = dict(state)
        frames = renderer.render(
            SCENE, BLOOM, taa=name, time=number * STEP, state=state, **DEFERRED
        )
        state = frames.state
        motion, depth = frames["motion"][..., :2], frames["motion"][..., 2]
        if taa.engine == "hdrp" and taa.filter_weights():
            # Nothing but the number of the frame is read of the first history.
            assert state["history"][0, 0, 3] == number + 1
        for what, source in (("", "scene"), ("_glow", "brightness")):
            given = {
                other.removesuffix("_glow") if what else other: before[other]
                for other in before
                if other in (f"history{what}", "history_motion")
            }
            expected = vkbloom.reference.apply(
                frames[source], COPY, taa=taa, motion=motion, depth=depth, state=given
            )
            wanted, kept = expected["resolved"], expected
            # Surfaces of one light have boxes without extent (see the module of moving frames).
            assert share_of_close(frames[f"resolved{what}"], wanted, 2e-3) >= 0.99
            assert frames[f"history{what}"].shape == kept["history"].shape
    assert set(state) >= {"history", "history_glow", "animation"}
    np.testing.assert_allclose(state["animation"][0, 0], [3 * STEP, 4, 0, 1], rtol=1e-6)


def test_the_picture_is_moved_by_the_engine(renderer: Renderer) -> None:
    """The mean of the frames of all phases is the picture, with smoother edges."""
    plain = renderer.render(SCENE, BLOOM, **DEFERRED)["scene"].astype(float)
    state: Any = {}
    moved = []
    for _ in range(8):
        frames = renderer.render(SCENE, BLOOM, taa="bevy", state=state, **DEFERRED)
        moved.append(frames["scene"].astype(float))
        state = frames.state
    # The first offset has no part along x, and both are less than a pixel.
    assert not np.array_equal(moved[0], plain)
    assert all(not np.array_equal(one, moved[0]) for one in moved[1:])
    assert np.abs(np.mean(moved, axis=0) - plain).mean() < 0.2 * plain.mean()
    still = vkbloom.O3deAntialiasing(jitter=(0, 0))
    frames = renderer.render(SCENE, BLOOM, taa=still, **DEFERRED)
    np.testing.assert_array_equal(frames["scene"], plain)
    across = vkbloom.O3deAntialiasing(jitter=(1, 0))
    frames = renderer.render(SCENE, BLOOM, taa=across, **DEFERRED)
    # By a whole pixel to the right.
    close = np.abs(frames["scene"][:, 1:].astype(float) - plain[:, :-1]).max(axis=-1) < 0.02
    assert close.mean() > 0.97


@pytest.mark.parametrize("name", ["godot", "hdrp_high"])
def test_a_sequence_that_is_cut(renderer: Renderer, name: str) -> None:
    given: dict[str, Any] = {**DEFERRED, "fps": 30, "taa": name, "renderer": renderer}
    settings = vkbloom.presets["kino"]
    times = {"times": [number / 30 for number in range(5)], "fps": None}
    whole = list(vkbloom.sequence(SCENE, settings, exposure="hdrp", **{**given, **times}))
    rest = list(
        vkbloom.sequence(
            SCENE,
            settings,
            exposure="hdrp",
            start=2,
            state=whole[1].state,
            **{**given, **times},
        )
    )
    assert rest[-1].state == whole[-1].state
    np.testing.assert_array_equal(rest[-1]["final"], whole[-1]["final"])


def test_sequences_of_images(renderer: Renderer) -> None:
    random = np.random.default_rng(0)
    images = random.random((4, 12, 16, 3)).astype(np.float32)
    motion = random.normal(0, 0.02, (4, 12, 16, 2)).astype(np.float32)
    depth = random.random((4, 12, 16)).astype(np.float32)
    given: dict[str, Any] = {"taa": "bevy", "motion": motion, "depth": depth}
    frames = list(vkbloom.sequence(images, BLOOM, renderer=renderer, **given))
    mapped = list(renderer.map(images, BLOOM, **given))
    assert frames[-1].state == mapped[-1].state


def test_a_sweep_continues_one_state(renderer: Renderer) -> None:
    """Of an image with motion and depth, and of a scene, which has its own."""
    first, second = (moving_frame(number, 12, 16, nearest=0.0) for number in (0, 1))
    begun = renderer.apply(first.image, COPY, taa="godot", **first.keywords()).state
    settings = [COPY, BLOOM, vkbloom.Pyramid(levels=1)]
    # Arrays of the host are uploaded once for all settings.
    for state in (begun, dict(begun)):
        given: Any = {"taa": "godot", "exposure": "bevy", "dt": 0.2, "state": state}
        given |= second.keywords()
        swept = renderer.sweep(second.image, settings, **given)
        for frames, one in zip(swept, settings, strict=True):
            assert frames.state == renderer.apply(second.image, one, **given).state
            assert ("bloom" in frames) == one.bloom
    begun = renderer.render(SCENE, BLOOM, taa="hdrp_high", **DEFERRED).state
    given = {"taa": "hdrp_high", "time": STEP, "state": begun, **DEFERRED}
    expected = renderer.render(SCENE, BLOOM, **given)
    for frames in renderer.sweep(SCENE, [BLOOM, BLOOM.replace(intensity=0.1)], **given):
        assert frames.state == expected.state
        np.testing.assert_array_equal(frames["resolved"], expected["resolved"])


def test_a_plan_has_the_stage(renderer: Renderer) -> None:
    image = np.zeros((8, 12, 3), np.float32)
    plan = renderer.plan(image, BLOOM, taa="godot")
    assert list(plan.framebuffers) == list(renderer.apply(image, BLOOM, taa="godot"))
    plan = renderer.plan(SCENE, BLOOM, taa="godot", **DEFERRED)
    assert list(plan.framebuffers) == list(renderer.render(SCENE, BLOOM, taa="godot", **DEFERRED))


@pytest.mark.parametrize(("call", "error"), rows(__file__, "scenes"))
def test_refused(renderer: Renderer, call: str, error: str) -> None:
    names = {"vkbloom": vkbloom, "renderer": renderer, "np": np, "SCENE": SCENE}
    assert_refused(call, error, names)
