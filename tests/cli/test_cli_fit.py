"""``vkbloom fit``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run
from vkbloom._fit import fitting

pytestmark = pytest.mark.usefixtures("kept_renderers")


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str]:
    """Return an image, and itself with a bloom."""
    image = (np.random.default_rng(0).random((32, 40, 3)) ** 8 * 10).astype(np.float32)
    truth = vkbloom.Separable(threshold=1.3, knee=0.5, intensity=0.4)
    names = [str(tmp_path / name) for name in ("image.exr", "target.exr")]
    vkbloom.write(names[0], image)
    target = vkbloom.reference.apply(image, truth)["final"]
    vkbloom.write(names[1], target.astype(np.float32))
    return names[0], names[1]


def test_best_first(files: tuple[str, str]) -> None:
    words = ["--method", "dual_kawase", "--method", "separable", "--vary", "threshold,intensity"]
    # Without a knee, as in the defaults, the fit is near and not exact.
    done = run("fit", *files, *words, "--max-calls", 60)
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    assert lines[0].startswith("separable: relative loss 0.")
    assert lines[1].startswith("  vkbloom.Separable(threshold=")
    assert lines[2].strip().partition(":")[0] in ("good", "fair")
    assert lines[3].startswith("  95 %: threshold ")
    assert lines[4].startswith("dual_kawase: ")


def test_a_poor_fit_says_so(files: tuple[str, str]) -> None:
    words = ["--preset", "tutorial", "--vary", "intensity", "--max-calls", "4"]
    done = run("fit", *reversed(files), *words)
    assert done.exit_code == 0
    assert done.stdout.splitlines()[2] == "  poor: no bloom was found"


def test_screenshots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every preset is ranked, the preset photo with and without an expanded image.

    All there are take seconds (tests/fits/test_fit.py).
    """
    few = {name: vkbloom.presets[name] for name in ("unity_urp", "photo", "unity_hdrp", "tutorial")}
    monkeypatch.setattr(fitting, "presets", few)
    names = [str(tmp_path / name) for name in ("image.png", "target.png")]
    image = (np.random.default_rng(0).random((24, 32, 3)) ** 4).astype(np.float32)
    vkbloom.write(names[0], image)
    words = ["--preset", "unity_urp", "--threshold", "0.4", "--intensity", "0.5"]
    assert run("apply", *names, *words).exit_code == 0
    done = run("fit", *names, "--preset", "all", "--max-calls", 3)
    assert done.exit_code == 0, done.output
    methods = [line.split(":")[0] for line in done.stdout.splitlines() if " loss " in line]
    searched = [preset.method for preset in few.values()]
    assert sorted(methods) == sorted([*searched, vkbloom.presets["photo"].method])
    (found,) = json.loads(run("fit", *names, "--preset", "unity_urp", "--json").stdout)
    assert found["verdict"] == "good"
    assert found["loss"] <= found["start_loss"]
    assert found["varied"] == pytest.approx({"threshold": 0.4, "intensity": 0.5}, rel=0.1)


def test_translate(renderer: vkbloom.Renderer) -> None:
    words = ("--preset", "Kino", "--intensity", "0.5", "--size", "64x48", "--max-calls", "12")
    result = run("translate", *words, "--to", "Pyramid", "--json")
    assert result.exit_code == 0, result.stderr
    (found,) = json.loads(result.stdout)
    settings = vkbloom.presets["kino"].replace(intensity=0.5)
    size, most = (64, 48), 12
    expected = vkbloom.translate(
        settings, vkbloom.Pyramid(), size=size, max_calls=most, renderer=renderer
    )
    assert vkbloom.Settings.from_dict(found["settings"]) == expected.settings
    assert found["loss"] == expected.loss < expected.start_loss
    assert (found["loss_name"], found["verdict"]) == ("log", expected.verdict)
