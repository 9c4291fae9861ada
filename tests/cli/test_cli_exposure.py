"""Exposures of the commands: images and videos in time, and what files say of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import NATURAL, apply, run, succeed

pytest.importorskip("OpenImageIO")

pytestmark = pytest.mark.usefixtures("kept_renderers")

NUMBERS = (1, 2, 5, 10)


def picture(seed: int) -> NDArray[np.float32]:
    random = np.random.default_rng(seed)
    return (2 ** random.uniform(-6, 3 + seed % 3, (12, 18, 3))).astype(np.float32)


@pytest.fixture
def frames(tmp_path: Path) -> list[Path]:
    """Files whose numbers, by name, are in another order."""
    paths = [tmp_path / f"f.{number}.exr" for number in NUMBERS]
    for number, path in zip(NUMBERS, paths, strict=True):
        vkbloom.write(path, picture(number))
    return paths


def follow(**given: Any) -> list[NDArray[Any]]:
    images = [picture(number) for number in NUMBERS]
    times = [(number - 1) / 10 for number in NUMBERS]
    sequence = vkbloom.sequence(images, NATURAL, times=times, exposure="hdrp", **given)
    return [made["final"] for made in sequence]


def test_images_have_temporal_anti_aliasing(tmp_path: Path, frames: list[Path]) -> None:
    words = ("--taa", "godot:frames=8", "--exposure", "hdrp", "--fps", "10")
    result = apply(tmp_path / "f.%d.exr", tmp_path / "g.%d.exr", *words)
    assert result.exit_code == 0, result.stderr
    expected = follow(taa=vkbloom.GodotAntialiasing(frames=8))
    for number, wanted in zip(NUMBERS, expected, strict=True):
        np.testing.assert_allclose(vkbloom.read(tmp_path / f"g.{number}.exr"), wanted, rtol=1e-6)
    # Such a file starts anew, since its history is not in it.
    result = run("apply", frames[0], tmp_path / "again.exr", "--settings", tmp_path / "g.10.exr")
    assert result.exit_code == 0, result.stderr
    assert run("render", "-o", tmp_path / "a.png", "--taa", "bevi").exit_code == 2
    assert "did you mean 'bevy'" in run("render", "-o", tmp_path / "a.png", "--taa", "bevi").stderr


@pytest.mark.parametrize("how", ["files", "folder", "glob", "pattern"])
def test_images_are_frames_in_time(tmp_path: Path, frames: list[Path], how: str) -> None:
    """Their numbers are their times, however they are named."""
    out = tmp_path / "out"
    words: dict[str, list[Any]] = {
        "files": [*frames[::-1], out],
        "folder": [tmp_path, out],
        "glob": [tmp_path / "f.*.exr", out],
        "pattern": [tmp_path / "f.%d.exr", out / "f.%d.exr"],
    }
    out.mkdir()
    result = apply(*words[how], "--exposure", "hdrp", "--fps", "10")
    assert result.exit_code == 0, result.stderr
    for path, expected in zip(frames, follow(), strict=True):
        np.testing.assert_allclose(vkbloom.read(out / path.name), expected, rtol=1e-6)


def test_a_picture_can_be_made_again(tmp_path: Path, frames: list[Path]) -> None:
    """A file holds the exposure, its step, and what it continued."""
    out = tmp_path / "out"
    exposure = "hdrp:speed_dark_to_light=2,metering=spot"
    succeed("apply", *frames, out, "-q", "--exposure", exposure, "--fps", 10)
    again = tmp_path / "again.exr"
    succeed("apply", frames[2], "-o", again, "-q", "--settings", out / frames[2].name)
    assert again.read_bytes() == (out / frames[2].name).read_bytes()
    # Another exposure begins anew.
    succeed("apply", frames[2], "-o", again, "-q", "--settings", again, "--exposure", "godot")
    expected = vkbloom.apply(picture(5), NATURAL, exposure="godot", dt=1 / 24)
    np.testing.assert_array_equal(vkbloom.read(again), expected["final"])


def test_frames_say_what_they_continued(tmp_path: Path, renderer: vkbloom.Renderer) -> None:
    first = renderer.apply(picture(0), NATURAL, exposure="bevy", dt=0.5)
    second = renderer.apply(picture(1), NATURAL, exposure="bevy", dt=0.1, state=first.state)
    second.save(tmp_path / "all.exr")
    loaded = vkbloom.Frames.load(tmp_path / "all.exr")
    loaded.save(tmp_path / "copied.exr")
    stages = json.loads(vkbloom.Frames.load(tmp_path / "copied.exr").info["stages"])
    assert stages == {
        "exposure": vkbloom.exposures["bevy"].to_dict(),
        "dt": 0.1,
        "state": {"exposure": first["exposure"].tolist()},
    }
    assert loaded.exposure == pytest.approx(second.exposure)


def test_one_picture(tmp_path: Path, frames: list[Path]) -> None:
    """It adapts from the start, for as long as a frame takes; again and again if it is repeated."""
    succeed("apply", frames[0], "-o", tmp_path / "a.exr", "-q", "--exposure", "bevy", "--fps", 4)
    image = picture(1)
    one = vkbloom.apply(image, NATURAL, exposure="bevy", dt=0.25)
    np.testing.assert_array_equal(vkbloom.read(tmp_path / "a.exr"), one["final"])
    held = ["apply", *[frames[0]] * 3, tmp_path / "h.%d.exr", "-q", "--exposure", "bevy"]
    succeed(*held, "--fps", "4")
    for number, made in enumerate(vkbloom.sequence([image] * 3, NATURAL, fps=4, exposure="bevy")):
        np.testing.assert_array_equal(vkbloom.read(tmp_path / f"h.{number}.exr"), made["final"])
    # A number is the field of the settings.
    succeed("apply", frames[0], "-o", tmp_path / "b.exr", "-q", "--exposure", "1.5")
    plain = vkbloom.apply(image, NATURAL, exposure=1.5)["final"]
    np.testing.assert_array_equal(vkbloom.read(tmp_path / "b.exr"), plain)


def test_a_frame_that_fails_is_time(tmp_path: Path, frames: list[Path]) -> None:
    (tmp_path / "f.3.exr").write_bytes(b"no picture")
    result = apply(tmp_path / "f.*.exr", tmp_path / "out", "--exposure", "hdrp", "--fps", "10")
    assert result.exit_code == 1
    made = vkbloom.read(tmp_path / "out" / "f.10.exr")
    np.testing.assert_allclose(made, follow()[-1], rtol=1e-6)


def test_videos_are_sequences(tmp_path: Path, frames: list[Path]) -> None:
    """The command of a video, in and out, makes what `vkbloom.sequence` makes."""
    pytest.importorskip("av")
    clip, back = tmp_path / "clip.mkv", tmp_path / "g.%02d.exr"
    succeed("apply", tmp_path / "f.%d.exr", "-o", clip, "-q", "--no-bloom", "--bits", 16)
    options = ["--exposure", "granite", "--preset", "bevy_natural"]
    succeed("apply", clip, "-o", back, "-q", *options)
    sequence = vkbloom.sequence(clip, NATURAL, exposure="granite")
    times = [made.info["time"] for made in sequence]
    np.testing.assert_allclose(times, [0, 1 / 24, 4 / 24, 9 / 24], atol=1e-3)
    for number, made in enumerate(sequence):
        file = tmp_path / f"g.{number:02d}.exr"
        np.testing.assert_allclose(vkbloom.read(file), made["final"], rtol=1e-3, atol=1e-6)
    # Any frame can be made again.
    assert len(sequence) == len(frames)
    pattern = vkbloom.sequence(
        str(tmp_path / "f.%d.exr"), NATURAL, fps=12, gaps="time", exposure="bevy"
    )
    out = tmp_path / "h.%02d.exr"
    words = ["--exposure", "bevy", "--fps", 12, "--preset", "bevy_natural"]
    succeed("apply", tmp_path / "f.%d.exr", "-o", out, "-q", *words)
    for number, made in zip(NUMBERS, pattern, strict=True):
        file = tmp_path / f"h.{number:02d}.exr"
        np.testing.assert_allclose(vkbloom.read(file), made["final"], rtol=1e-6)


def test_render(tmp_path: Path) -> None:
    words = ["render", "-o", tmp_path / "r.exr", "--size", "32x24", "--shading", "deferred", "-q"]
    succeed(*words, "--exposure", "godot", "--dt", "0.5")
    scene = vkbloom.Scene.ufo()
    given: Any = {"size": (32, 24), "shading": "deferred", "exposure": "godot", "dt": 0.5}
    expected = vkbloom.render(scene, **given)
    loaded = vkbloom.Frames.load(tmp_path / "r.exr")
    np.testing.assert_array_equal(loaded["final"], expected["final"])
    assert json.loads(loaded.info["stages"])["dt"] == 0.5


def test_help_names_the_list() -> None:
    for command in ("apply", "render"):
        text = " ".join(run(command, "--help").stdout.split())
        assert "--exposure STOPS|NAME[:A=1,...]" in text
        assert "vkbloom exposures lists them" in text
