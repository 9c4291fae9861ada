"""Flashes by the thresholds of WCAG 2.2, and flicker by its contrast."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import run
from tests.custom.test_check import check
from tests.exhaustive import EXHAUSTIVE
from tests.srgb import encode_srgb
from vkbloom import Pyramid, Renderer, Settings, write
from vkbloom.testing import flash, flicker

FPS = 240
Image = NDArray[Any]


def flashing(
    hertz: float, change: float, shape: str = "square", base: float = 0.3, seconds: float = 1.2
) -> NDArray[np.float64]:
    wave = np.sin(2 * np.pi * hertz * np.arange(round(FPS * seconds)) / FPS + 1e-6)
    return base + change / 2 * (wave if shape == "sine" else np.sign(wave))


def frames(light: NDArray[np.float64], colour: tuple[float, float, float] = (1, 1, 1)) -> Image:
    picture = light[:, np.newaxis, np.newaxis, np.newaxis] * np.array(colour)
    return np.broadcast_to(picture, (len(light), 6, 8, 3)).astype(np.float32)


@pytest.mark.parametrize("shape", ["sine", "square"])
@pytest.mark.parametrize("hertz", range(4, 16) if EXHAUSTIVE else (4, 9, 15))
def test_the_general_threshold_is_a_tenth(hertz: float, shape: str) -> None:
    def fails(change: float) -> bool:
        return flash(frames(flashing(hertz, change, shape)), FPS, degrees=40).general

    # Of the threshold, a hundredth.
    assert (fails(0.099), fails(0.101)) == (False, True)


@pytest.mark.parametrize("shape", ["sine", "square"])
@pytest.mark.parametrize("hertz", [1, 2, 3])
def test_three_flashes_a_second_pass(hertz: float, shape: str) -> None:
    """Of any amplitude: the rule begins with more than three flashes within a second."""
    found = flash(frames(flashing(hertz, 0.5, shape)), FPS, degrees=40)
    assert (found.general, found.flashes) == (False, hertz)


@pytest.mark.parametrize(("base", "failed"), [(0.9, False), (0.8, True)])
def test_the_darker_picture_is_below_0_8(base: float, failed: bool) -> None:
    found = flash(frames(flashing(6, 0.05 + 0.051 * 2, base=base)), FPS, degrees=40)
    assert found.general is failed


def test_red_flashes() -> None:
    dim = frames(flashing(5, 0.08, base=0.2), (1, 0, 0))
    found = flash(dim, FPS, degrees=40)
    assert (found.general, found.red) == (False, True)
    assert "red flashes: fails, up to 5 a second" in str(found)
    levels = np.rint(255 * encode_srgb(np.concatenate([dim, dim[..., :1]], axis=3))).astype(
        np.uint8
    )
    assert flash([*levels], FPS, degrees=40).red
    pink = frames(flashing(5, 0.08, base=0.2), (1, 0.4, 0.4))
    assert not flash(pink, FPS, degrees=40).red


def test_the_threshold_of_red_flashes() -> None:
    """20 / 320 of the largest change of max(0, R - G - B)."""
    for share in (0.99, 1.01):
        light = flashing(7, share * 20 / 320)
        assert flash(frames(light, (1, 0, 0)), FPS, degrees=40).red == (share > 1)


@pytest.mark.parametrize(("share", "failed"), [(0.2, False), (0.3, True)])
def test_a_quarter_of_a_field_counts(share: float, failed: bool) -> None:
    light = flashing(5, 0.4)
    still = np.full((len(light), 64, 64, 3), 0.3, np.float32)
    side = round(64 * np.sqrt(share * np.pi / 4))
    start = (64 - side) // 2
    still[:, start : start + side, start : start + side] = light[:, None, None, None]
    assert flash(still, FPS, degrees=10).general is failed


@pytest.mark.parametrize("kind", [list, iter])
def test_contrast_at_each_frequency(kind: Any) -> None:
    found = flicker(kind(frames(flashing(6, 0.06, "sine", seconds=1))), FPS)
    peak = int(found.contrast.argmax())
    assert found.frequencies[peak] == pytest.approx(6)
    assert found.contrast[peak] == pytest.approx(0.1, rel=1e-4)
    assert np.delete(found.contrast, peak).max() < 1e-4


def test_colour_video_vdp() -> None:
    """10 JOD where nothing flickers, less the more it does."""
    pytest.importorskip("pycvvdp", exc_type=ImportError)
    found = [flicker(frames(flashing(6, x, "sine", seconds=0.25)), 60) for x in (0, 0.02, 0.2)]
    still, faint, strong = (one.jod or 0.0 for one in found)
    assert still == pytest.approx(10)
    assert still > faint > strong


def test_check_judges_files(tmp_path: Path) -> None:
    for number, light in enumerate(flashing(10, 0.4, seconds=0.5)):
        write(tmp_path / f"f.{number:04d}.exr", np.full((4, 6, 3), light, np.float32))
    words = ["check", "--sequence", str(tmp_path / "f.%04d.exr"), "--fps", str(FPS)]
    done, found = check(*words[1:])
    assert done.exit_code == 1
    assert (found["frames"], found["flash"]["general"], found["flash"]["red"]) == (120, True, False)
    assert "general flashes: fails" in run(*words).stdout
    refused = run(*words, "--against", "kino")
    assert (refused.exit_code, "leave --against out" in refused.stderr) == (2, True)


#: Options, and what they stand for: settings, and keywords of a call for stages in time.
MADE: dict[str, tuple[Settings, dict[str, Any]]] = {
    "--exposure -1": (Pyramid(bloom=False, exposure=-1), {}),
    "--preset kino --intensity 0.5 --encoding srgb": (
        vkbloom.presets["kino"].replace(intensity=0.5),
        {},
    ),
    "--exposure hdrp --taa godot:frames=4": (
        Pyramid(bloom=False),
        {"exposure": "hdrp", "taa": vkbloom.GodotAntialiasing(frames=4)},
    ),
}


@pytest.mark.usefixtures("kept_renderers")
def test_check_judges_what_is_made_of_files(tmp_path: Path, renderer: Renderer) -> None:
    """In linear light; the frames between two numbers are time."""
    random = np.random.default_rng(0)
    pictures = random.uniform(0, 2, (6, 4, 6, 3)).astype(np.float32)
    for number, picture in enumerate(pictures):
        write(tmp_path / f"f.{2 * number:02d}.exr", picture)
    words = ["--sequence", str(tmp_path / "f.%02d.exr"), "--fps", "48"]
    for options, (settings, stages) in MADE.items():
        _, found = check(*words, *options.split())
        made = renderer.map(pictures, settings, dt=1 / 24, framebuffers="final", **stages)
        shown = np.repeat([frames["final"] for frames in made], 2, axis=0)[:-1]
        expected = flicker(shown, 48).contrast
        np.testing.assert_allclose(found["flicker"]["contrast"], expected, rtol=1e-6)
        assert found["missing"] == 5
    refused = run("check", *words, "--taa", "bevi")
    assert (refused.exit_code, "did you mean 'bevy'" in refused.stderr) == (2, True)
    refused = run("check", "--preset", "kino", "--taa", "bevy")
    assert (refused.exit_code, "--taa needs --sequence" in refused.stderr) == (2, True)


def test_gaps_are_time(tmp_path: Path) -> None:
    """A light of 2.5 Hz whose frames are twice as far apart by their numbers flashes slower."""
    light = flashing(10, 0.4, seconds=0.5)
    for number, value in enumerate(light):
        write(tmp_path / f"f.{number:04d}.png", np.full((4, 6, 3), value, np.float32))
        write(tmp_path / f"slow.{3 * number - 60:04d}.png", np.full((4, 6, 3), value, np.float32))
    words = ["--sequence", str(tmp_path / "f.%04d.png"), "--fps", str(FPS)]
    done, found = check(*words)
    assert (done.exit_code, found["missing"], found["gaps"]) == (1, 0, [])
    # Three times as long, beginning with negative numbers: 3.3 Hz.
    words[1] = str(tmp_path / "slow.%04d.png")
    done, found = check(*words)
    assert (found["frames"], found["missing"]) == (120, 238)
    assert found["gaps"][:2] == [[-59, -58], [-56, -55]]
    assert found["flash"]["flashes"] <= 4
    assert "238 of 358 frames are missing" in done.stderr
    assert "238 of 358 frames are missing" in run("check", *words).stdout


def test_missing_dark_frames_are_named(tmp_path: Path) -> None:
    for number in (*range(1, 6), *range(11, 16)):
        write(tmp_path / f"f.{number:04d}.png", np.full((4, 6, 3), 0.8, np.float32))
    done = run("check", "--sequence", tmp_path / "f.####.png", "--fps", 60)
    assert "5 of 15 frames are missing: 6 to 10; the frame before each is shown" in done.stdout
    write(tmp_path / "f.9999999.png", np.full((4, 6, 3), 0.8, np.float32))
    done = run("check", "--sequence", tmp_path / "f.####.png")
    assert (done.exit_code, "are not of one sequence" in done.stderr) == (1, True)
