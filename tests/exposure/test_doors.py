"""Exposures beside `apply` and `map`: sequences, scenes, sweeps, plans."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.core.builds import ROOT
from tests.exhaustive import witness
from tests.variants import VARIANTS, open_variant
from vkbloom import Renderer

from .test_device import COPY, picture

SETTINGS = vkbloom.Pyramid(levels=2, threshold=0.5)
#: Light that rises and falls by two stops.
IMAGES = [picture(seed) * np.float32(4 ** (seed % 3 - 1)) for seed in range(6)]
SCENE = vkbloom.Scene.ufo()
DEFERRED: dict[str, Any] = {"size": (64, 48), "shading": "deferred"}


def bits(frames: vkbloom.Frames) -> dict[str, bytes]:
    return {name: np.asarray(array).tobytes() for name, array in frames.items()}


def test_a_sequence_takes_its_steps_from_frames_per_second(renderer: Renderer) -> None:
    given: Any = {"exposure": "bevy", "renderer": renderer}
    sequence = vkbloom.sequence(IMAGES, SETTINGS, fps=24, **given)
    expected = list(renderer.map(IMAGES, SETTINGS, exposure="bevy", dt=1 / 24))
    for _ in range(2):
        made = list(sequence)
        assert [bits(one) for one in made] == [bits(one) for one in expected]
    assert sequence.state == expected[-1].state
    assert len({one.exposure for one in made}) == len(made)


@pytest.mark.parametrize("cut", [1, 3, 5])
@pytest.mark.parametrize("clock", [{"fps": 30}, {"times": [0, 0.1, 0.15, 0.4, 0.41, 3]}])
def test_a_sequence_is_cut(renderer: Renderer, cut: int, clock: dict[str, Any]) -> None:
    given: Any = {"exposure": "hdrp", "renderer": renderer, **clock}
    whole = list(vkbloom.sequence(IMAGES, SETTINGS, **given))
    begun = vkbloom.sequence(IMAGES, SETTINGS, **given)
    for number, _ in enumerate(begun, 1):
        if number == cut:
            break
    state = pickle.loads(pickle.dumps(begun.state))
    rest = vkbloom.sequence(IMAGES, SETTINGS, start=cut, state=state, **given)
    assert len(rest) == len(IMAGES) - cut
    made = list(rest)
    assert [bits(one) for one in made] == [bits(one) for one in whole[cut:]]
    assert [one.info["time"] for one in made] == [one.info["time"] for one in whole[cut:]]


def test_gaps_are_time(tmp_path: Path, renderer: Renderer) -> None:
    for number, image in zip((3, 4, 8), IMAGES, strict=False):
        vkbloom.write(tmp_path / f"f.{number:04d}.exr", image)
    given: Any = {"exposure": "bevy", "renderer": renderer}
    sequence = vkbloom.sequence(str(tmp_path / "f.%04d.exr"), COPY, fps=10, gaps="time", **given)
    stops = [frames.exposure for frames in sequence]
    expected = renderer.map(IMAGES[:3], COPY, exposure="bevy", dt=[0.1, 0.1, 0.4])
    assert stops == [frames.exposure for frames in expected]


def test_steps_of_map(renderer: Renderer) -> None:
    """An iterable of steps is read in step with the images."""
    taken = []

    def images() -> Iterator[Any]:
        for number, image in enumerate(IMAGES):
            taken.append(("image", number))
            yield image

    def steps() -> Iterator[float]:
        for number in range(len(IMAGES)):
            taken.append(("step", number))
            yield 0.1 * number

    made = list(renderer.map(images(), COPY, exposure="bevy", dt=steps()))
    assert taken == [(kind, n) for n in range(len(IMAGES)) for kind in ("image", "step")]
    state: Any = {}
    for number, (frames, image) in enumerate(zip(made, IMAGES, strict=True)):
        one = renderer.apply(image, COPY, exposure="bevy", dt=0.1 * number, state=state)
        state = one.state
        assert one.exposure == frames.exposure
    for wrong, said in (([0.1], "dt: 1 steps of time are fewer"), ([0.1, -1], r"dt\[1\]: -1")):
        with pytest.raises(ValueError, match=said):
            list(renderer.map(IMAGES, COPY, exposure="bevy", dt=wrong))


def test_a_frame_alone(renderer: Renderer) -> None:
    given: Any = {"fps": 24, "renderer": renderer}
    with pytest.raises(TypeError, match="frames with exposure= depend on those before"):
        vkbloom.sequence(IMAGES, COPY, exposure="bevy", **given)[1]
    fixed = vkbloom.FixedExposure(value=2)
    assert vkbloom.sequence(IMAGES, COPY, exposure=fixed, **given)[1].exposure == 2
    # A number is the settings' own.
    sequence = vkbloom.sequence(IMAGES, COPY, exposure=1.5, **given)
    assert (sequence[1].exposure, sequence.settings.exposure) == (1.5, 1.5)


def test_wrong_sequences(renderer: Renderer) -> None:
    with pytest.raises(ValueError, match="fps: an exposure needs frames per second, or times"):
        vkbloom.sequence(IMAGES, exposure="bevy")
    with pytest.raises(ValueError, match="unknown preset 'bevi'; did you mean 'bevy'"):
        vkbloom.sequence(IMAGES, exposure="bevi", fps=24)
    with pytest.raises(ValueError, match="start: -1 is outside"):
        vkbloom.sequence(IMAGES, start=-1)
    assert list(vkbloom.sequence(IMAGES, start=9, renderer=renderer)) == []


@pytest.mark.parametrize("name", vkbloom.exposures)
def test_a_scene(renderer: Renderer, name: str) -> None:
    """A deferred scene is metered as the image of its light is."""
    frames = renderer.render(SCENE, SETTINGS, exposure=name, dt=0.5, **DEFERRED)
    adapted = frames["exposure"]
    scene = np.asarray(frames["scene"])
    if name == "o3de":  # It meters the picture with its bloom.
        scene = scene.astype(np.float32)
        scene[..., :3] += SETTINGS.intensity * np.asarray(frames["bloom"])[..., :3]
    wanted = vkbloom.reference.expose(scene, name, dt=0.5)["exposure"]
    np.testing.assert_allclose(adapted, wanted, rtol=2e-4, atol=2e-5)
    again = renderer.render(SCENE, SETTINGS, exposure=name, dt=0, state=frames.state, **DEFERRED)
    assert again["exposure"][0, 0, 0] == adapted[0, 0, 0]


@pytest.mark.parametrize("name", VARIANTS)
def test_a_scene_in_each_variant(renderer: Renderer, name: str) -> None:
    with open_variant(name) as opened:
        for exposure in ("hdrp", "o3de", "granite"):
            given: Any = {"exposure": exposure, "dt": 0.5, **DEFERRED}
            made, expected = (one.render(SCENE, SETTINGS, **given) for one in (opened, renderer))
            assert list(made) == list(expected)
            np.testing.assert_allclose(made["exposure"], expected["exposure"], rtol=1e-3)
            np.testing.assert_allclose(made["bloom"], expected["bloom"], rtol=1e-2, atol=1e-3)


def test_a_scene_is_exposed_before_or_after_its_bloom(renderer: Renderer) -> None:
    linear = vkbloom.Pyramid(levels=2, format="rgba32float")
    plain = renderer.render(SCENE, linear, **DEFERRED)
    fixed = renderer.render(SCENE, linear, exposure=vkbloom.FixedExposure(value=1), **DEFERRED)
    np.testing.assert_allclose(fixed["bloom"][..., :3], 2 * plain["bloom"][..., :3], rtol=1e-6)
    np.testing.assert_allclose(fixed["exposed"][..., :3], 2 * plain["scene"][..., :3], rtol=1e-6)
    after = renderer.render(SCENE, linear, exposure="bevy", dt=0.5, **DEFERRED)
    np.testing.assert_array_equal(after["bloom"], plain["bloom"])
    light = plain["scene"].astype(np.float32)[..., :3] + plain["bloom"][..., :3]
    expected = np.clip(light * after["exposure"][0, 0, 2], 0, 1)
    np.testing.assert_allclose(after["final"][..., :3] / 255, expected, atol=0.6 / 255)


def test_a_forward_scene_has_no_exposure(renderer: Renderer) -> None:
    for call in (
        lambda: renderer.render(SCENE, exposure="bevy"),
        lambda: renderer.plan(SCENE, exposure="bevy"),
        lambda: list(vkbloom.sequence(SCENE, fps=2, exposure="bevy", renderer=renderer)),
    ):
        with pytest.raises(ValueError, match="exposure: a forward scene has 8 bits"):
            call()
    # A number is the field of the settings.
    frames = vkbloom.render(SCENE, size=(32, 24), exposure=1, renderer=renderer)
    assert frames.settings.exposure == frames.exposure == 1


def test_a_sequence_of_a_scene(renderer: Renderer) -> None:
    given: Any = {"exposure": "o3de", "renderer": renderer, **DEFERRED}
    sequence = vkbloom.sequence(SCENE, SETTINGS, times=[0, 0.5, 2], **given)
    state: Any = {}
    for frames, time, dt in zip(sequence, (0, 0.5, 2), (0.5, 0.5, 1.5), strict=True):
        expected = vkbloom.render(SCENE, SETTINGS, time=time / 8, dt=dt, state=state, **given)
        assert bits(frames) == bits(expected)
        state = expected.state
    assert sequence.state == state


def test_a_sweep_continues_one_state(renderer: Renderer) -> None:
    state = renderer.apply(IMAGES[0], COPY, exposure="bevy", dt=1).state
    settings = [COPY, SETTINGS, vkbloom.Pyramid(levels=1)]
    given: Any = {"exposure": "bevy", "dt": 0.2, "state": state}
    swept = list(renderer.sweep(IMAGES[1], settings, **given))
    for frames, one in zip(swept, settings, strict=True):
        expected = renderer.apply(IMAGES[1], one, **given)
        assert bits(frames) == bits(expected)
        assert frames.state == expected.state
    scene = renderer.sweep(SCENE, [SETTINGS], framebuffers="exposed", exposure="hdrp", **DEFERRED)
    assert list(next(scene)) == ["exposed"]
    with pytest.raises(
        ValueError, match="state: only a stage in time continues one; give exposure or taa, too"
    ):
        renderer.sweep(IMAGES[0], [COPY], state=state)


def test_a_plan_has_the_stage(renderer: Renderer) -> None:
    plan = renderer.plan(IMAGES[0], SETTINGS, exposure="hdrp")
    frames = renderer.apply(IMAGES[0], SETTINGS, exposure="hdrp")
    assert list(plan.framebuffers) == list(frames)
    assert plan.settings is SETTINGS


#: Width, height, frames, after how many the memory is read, and where the sequence is cut.
LENGTHS = {
    "short": (160, 90, 240, 60, 7, 61, 128),
    "long": (640, 360, 10_000, 1_000, 1_234, 5_000, 9_876),
}


@pytest.mark.parametrize(
    "length", ["short", pytest.param("long", marks=witness("the short one shows the same"))]
)
def test_memory_does_not_grow_and_processes_continue(tmp_path: Path, length: str) -> None:
    """With an exposure, TAA, motion, depth and bloom."""
    width, height, *more = LENGTHS[length]

    def run(kind: str, *numbers: int) -> Any:
        words = map(str, (kind, tmp_path, width, height, *numbers))
        program = [sys.executable, "-m", "tests.exposure.long_sequence", *words]
        done = subprocess.run(program, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
        return json.loads(done.stdout)

    whole = run("whole", *more)
    for cut in more[2:]:
        digests = run("rest", cut)["digests"]
        assert digests == {number: whole["digests"][number] for number in digests}
    # The history of each frame takes 16 bytes a pixel: those of 120 small ones would be 28 MB.
    memory = list(whole["memory"].values())
    assert memory[-1] - memory[1] < 8e6, whole["memory"]
