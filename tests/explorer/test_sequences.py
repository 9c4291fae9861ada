"""The explorer plays a sequence: any frame is that of `vkbloom.sequence`, whatever came before."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run
from tests.custom import COUNTER, TRAIL
from tests.explorer.pages import Chain, NotReached, Viewer, open_clip
from tests.framebuffers import decode
from vkbloom import Pyramid, Renderer, Scene, Settings, presets

BEGUN = presets["bevy_natural"]
OTHER = Pyramid(threshold=0.5, intensity=0.7)


def ask(viewer: Viewer, **message: Any) -> tuple[dict[str, Any], list[bytes]]:
    """Send a message as a page does, and again until its frame is reached."""
    while True:
        answer, buffers = viewer.answer(json.loads(json.dumps(message, allow_nan=False)))
        answer = json.loads(json.dumps(answer, allow_nan=False))
        sides = answer.get("sides", {}).values()
        if not any("reached" in side for side in sides):
            return answer, buffers


def frame(viewer: Viewer, number: int, settings: Settings = BEGUN, **rest: Any) -> dict[str, Any]:
    """Ask for a frame of A, and return what is said of it."""
    sides = {"a": settings.to_dict()}
    answer, _ = ask(viewer, kind="frame", sides=sides, number=number, **rest)
    assert answer["kind"] == "frame", answer
    side: dict[str, Any] = answer["sides"]["a"]
    assert "error" not in side, side
    return side


def play(source: Any, renderer: Renderer, settings: Any = BEGUN, **how: Any) -> Viewer:
    clip = open_clip(source, **how)
    assert clip is not None
    first = source if isinstance(source, Scene) else clip.decoded(0)
    file = source if isinstance(source, str) else ""
    return Viewer(first, settings, renderer=renderer, clip=clip, size=(48, 27), file=file)


@pytest.fixture(scope="module")
def images() -> list[np.ndarray[Any, Any]]:
    """A picture whose light rises and falls."""
    picture = np.random.default_rng(1).random((18, 32, 3)) ** 6 * 4
    stops = [0, 0, 0, 3, 3, 3, 3, -2, -2, -2, -2, -2]
    return [(picture * 2.0**stop).astype(np.float32) for stop in stops]


STAGES: tuple[dict[str, Any], ...] = (
    {},
    {"exposure": "bevy"},
    {"exposure": "o3de"},  # meters the bloom
    {"exposure": vkbloom.FixedExposure(value=1)},
    {"exposure": vkbloom.KeyframedExposure(keys=((0, 1), (0.3, -2)))},
    {"taa": "godot"},
    {"taa": vkbloom.BevyAntialiasing(order="after")},
    {"exposure": "hdrp", "taa": "hdrp"},
)


@pytest.mark.parametrize("stages", STAGES)
def test_any_frame_is_that_of_the_sequence(
    stages: dict[str, Any], images: Any, renderer: Renderer
) -> None:
    """Also after other frames and other settings: a state is that of its own settings."""
    viewer = play(images, renderer, fps=24, **stages)
    frames = {
        settings.method: list(
            vkbloom.sequence(images, settings, fps=24, renderer=renderer, **stages)
        )
        for settings in (BEGUN, OTHER)
    }
    for number, settings in (
        (8, BEGUN),
        (8, OTHER),
        (3, OTHER),
        (4, BEGUN),
        (11, BEGUN),
        (0, OTHER),
    ):
        frame(viewer, number, settings)
        expected = frames[settings.method][number]
        assert np.array_equal(viewer.frames["a"]["final"], expected["final"])
        assert viewer.frames["a"].state == expected.state
        assert viewer.frames["a"].exposure == expected.exposure
    # What another framebuffer shows is also of its own time.
    frame(viewer, 5, OTHER, framebuffer="bloom")
    assert np.array_equal(viewer.frames["a"]["bloom"], frames["pyramid"][5]["bloom"])


def test_custom_methods(images: Any, renderer: Renderer) -> None:
    """One that reads its frame before, and how many there were."""
    last = "return TRAIL_tex(TRAIL_pos)"
    text = TRAIL.replace(last, f"{last} * float(frame)")
    trail = vkbloom.load_method(text, name="trail_of_clips")()
    viewer = play(images, renderer, trail, fps=24)
    frames = list(vkbloom.sequence(images, trail, fps=24, renderer=renderer))
    for number in (8, 4):
        frame(viewer, number, trail)
        assert np.array_equal(viewer.frames["a"]["final"], frames[number]["final"])
    # A storage is no value.
    counter = vkbloom.load_method(COUNTER, name="counter_of_clips")()
    answer, _ = ask(viewer, kind="frame", sides={"a": counter.to_dict()}, number=1)
    assert "has a storage" in answer["sides"]["a"]["error"]


def test_the_curve(images: Any, renderer: Renderer) -> None:
    """A page gets the exposures that it does not know, first those up to its frame."""
    viewer = play(images, renderer, fps=24, exposure="godot")
    exposed = vkbloom.sequence(images, BEGUN, fps=24, renderer=renderer, exposure="godot")
    expected = [made.exposure for made in exposed]
    curve = frame(viewer, 4, BEGUN.replace(exposure=2))["curve"]
    assert (curve["from"], curve["stops"], curve["is_done"]) == (0, expected[:5], False)
    sides = {"a": BEGUN.to_dict()}
    while not curve["is_done"]:
        known = [curve["chain"], 5]
        answer, _ = ask(viewer, kind="curve", sides=sides, curve={"a": known})
        curve = answer["sides"]["a"]["curve"]
    # The field of the settings is no part of it.
    assert (curve["from"], curve["stops"]) == (5, expected[5:])
    # Those of another exposure begin anew.
    other = frame(viewer, 2, exposure="granite", curve={"a": known})["curve"]
    assert other["from"] == 0
    assert other["chain"] != curve["chain"]
    assert other["stops"] != expected[:3]
    assert "curve" not in frame(viewer, 2, exposure=None)
    # An infinite multiplier is none of JSON's numbers.
    black = play([np.zeros((9, 16, 3), np.float32)] * 2, renderer, exposure="godot")
    assert frame(black, 1)["curve"]["stops"] == [None, None]


def test_states_that_are_kept_are_bounded(images: Any, renderer: Renderer) -> None:
    frames = list(vkbloom.sequence(images, BEGUN, taa="bevy", renderer=renderer))
    computed: list[int] = []

    def compute(number: int, state: Mapping[str, Any]) -> Any:
        computed.append(number)
        return renderer.apply(images[number], BEGUN, taa="bevy", state=state)

    (one,) = {made.state.nbytes for made in frames}  # type: ignore[attr-defined]
    chain = Chain(compute, len(images), has_exposure=False, most=5 * one)
    for number in (11, 10, 3, 7, 11, 6):
        assert chain.state(number, 60) == frames[number - 1].state
        assert chain.kept <= 5 + 2
    # From states before, not each time from the first frame.
    assert len(computed) < 11 + 6 * 4
    # In no time at all a call computes one frame, so that repeated ones arrive.
    chain, computed[:] = Chain(compute, len(images), has_exposure=False), []
    for reached in (1, 2, 3):
        with pytest.raises(NotReached) as caught:
            chain.state(4, 0)
        assert caught.value.number == reached
    assert chain.state(4, 0) == frames[3].state
    assert computed == [0, 1, 2, 3]


def test_files_are_reduced_and_gaps_are_time(
    images: Any, renderer: Renderer, tmp_path: Path
) -> None:
    for number, image in zip((1, 2, 5), images[2:], strict=False):
        vkbloom.write(tmp_path / f"f.{number:02d}.exr", image)
    pattern = str(tmp_path / "f.%02d.exr")
    viewer = play(pattern, renderer, fps=10, exposure="bevy")
    answer, _ = ask(viewer, kind="setup")
    assert answer["clip"]["times"] == [0, 0.1, 0.4]
    assert answer["clip"]["stages"]["exposure"]["begun"] == "bevy"
    assert answer["clip"]["stages"]["taa"]["begun"] is None
    assert (answer["animated"], answer["source_size"]) == (False, [32, 18])
    facts = frame(viewer, 2)
    made = vkbloom.sequence(pattern, fps=10, gaps="time", exposure="bevy", renderer=renderer)
    assert np.array_equal(viewer.frames["a"]["final"], [*made][2]["final"])
    assert facts["code"].endswith('.exr", settings, fps=10, exposure="bevy")')
    assert frame(viewer, 2, size=[16, 9])["size"] == [16, 9]
    # The picture in its own size holds what its frame continued.
    asked = {"settings": BEGUN.to_dict(), "number": 2, "framebuffer": "final"}
    answer, (picture,) = viewer.answer({"kind": "save", **asked})
    (tmp_path / "a.png").write_bytes(picture)
    assert decode(picture, tmp_path).shape == (18, 32, 3)
    run("apply", tmp_path / "f.05.exr", tmp_path / "b.png", "--settings", tmp_path / "a.png")
    assert np.array_equal(
        vkbloom.read(tmp_path / "a.png"), vkbloom.read(tmp_path / "b.png")[..., :3]
    )
    # An image that is opened is a still.
    answer, _ = viewer.answer({"kind": "open", "name": "a.png"}, [picture])
    assert answer["clip"] is None


def test_a_video(renderer: Renderer, tmp_path: Path) -> None:
    """Its frames have their own times; a later one is sought, not decoded from the first on."""
    pytest.importorskip("av")
    for number in range(32):
        vkbloom.write(tmp_path / f"f.{number:02d}.png", np.full((8, 16, 3), number * 8, np.uint8))
    clip = str(tmp_path / "clip.mkv")
    words = ["apply", tmp_path / "f.%02d.png", clip, "--fps", "25", "--preset", "kino"]
    assert run(*words).exit_code == 0
    viewer = play(clip, renderer, presets["kino"], exposure="bevy")
    frames = vkbloom.sequence(clip, "kino", exposure="bevy", renderer=renderer)
    expected = [made["final"] for made in frames]
    times = ask(viewer, kind="setup")[0]["clip"]["times"]
    assert np.allclose(np.diff(times), 0.04)
    for number in (31, 7, 27, 0):
        frame(viewer, number, presets["kino"])
        assert np.array_equal(viewer.frames["a"]["final"], expected[number])
    source = open_clip(clip)
    assert source is not None
    levels = [source.decoded(number).pixels[4, 8, 0] for number in (*range(32), 5, 6, 31, 0)]
    assert levels[32:] == [levels[number] for number in (5, 6, 31, 0)]
    every = list(vkbloom.sequence(clip, "kino", renderer=renderer))
    later = list(vkbloom.sequence(clip, "kino", start=29, renderer=renderer))
    assert [made.info["time"] for made in later] == [made.info["time"] for made in every[29:]]
    for one, other in zip(later, every[29:], strict=True):
        assert np.array_equal(one["final"], other["final"])


def test_a_scene(scene: Scene, renderer: Renderer) -> None:
    """One turn of its animation."""
    viewer = play(scene, renderer, presets["tutorial"], fps=2, taa="bevy", exposure="godot")
    answer, _ = ask(viewer, kind="setup")
    assert len(answer["clip"]["times"]) == 16
    code = frame(viewer, 3, presets["tutorial"])["code"]
    assert code.endswith(
        '(scene, settings, fps=2, exposure="godot", taa="bevy", shading="deferred")'
    )
    how: dict[str, Any] = {"size": (48, 27), "shading": "deferred", "renderer": renderer}
    stages: dict[str, Any] = {"taa": "bevy", "exposure": "godot"}
    frames = vkbloom.sequence(scene, "tutorial", fps=2, **stages, **how)
    expected = next(made for number, made in enumerate(frames) if number == 3)
    assert np.array_equal(viewer.frames["a"]["final"], expected["final"])
    assert open_clip(scene) is None


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ({"number": 12}, "number: 12 is outside 0 to 11"),
        ({"number": 1.5}, "number: 1.5"),
        ({"exposure": "bevi"}, "exposure: unknown preset 'bevi'; did you mean 'bevy'?"),
        ({"taa": 3}, "taa: 3 is not an Antialiasing"),
    ],
)
def test_what_is_wrong_is_said(
    message: dict[str, Any], error: str, images: Any, renderer: Renderer
) -> None:
    viewer = play(images, renderer)
    answer, _ = ask(viewer, kind="frame", sides={"a": BEGUN.to_dict()}, **message)
    assert error in (answer.get("error") or answer["sides"]["a"]["error"])


def test_in_a_notebook(images: Any, renderer: Renderer) -> None:
    pytest.importorskip("anywidget")
    explorer = vkbloom.explore(np.stack(images), BEGUN, exposure="bevy", renderer=renderer)
    message = {"kind": "frame", "sides": {"a": BEGUN.to_dict()}, "number": 4}
    explorer._handle_custom_msg(message, [])
    made = vkbloom.sequence(images, BEGUN, fps=24, exposure="bevy", renderer=renderer)
    assert explorer.frames is not None
    assert np.array_equal(explorer.frames["final"], [*made][4]["final"])


def test_only_sequences_have_stages(images: Any, tmp_path: Path) -> None:
    pytest.importorskip("anywidget")
    with pytest.raises(ValueError, match=r"exposure: only a sequence has it"):
        vkbloom.explore(images[0], exposure="bevy")
    with pytest.raises(TypeError, match="an iterator cannot be played"):
        vkbloom.explore(iter(images), fps=24)
    still = vkbloom.write(tmp_path / "a.exr", images[0])
    done = run("explore", still, "--taa", "bevy", "--no-open")
    assert done.exit_code == 2
    assert "--taa: only a sequence has it" in done.stderr
    done = run("explore", tmp_path / "*.exr", "--static", tmp_path / "out", "--fps", "24")
    assert done.exit_code == 2
    assert "--static" in done.stderr
