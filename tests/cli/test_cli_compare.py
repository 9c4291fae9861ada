"""``vkbloom compare``: comparisons of image files on the command line."""

from __future__ import annotations

import functools
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli import calls
from tests.framebuffers import make, write_image
from tests.images import change, noise_image
from vkbloom._views.comparison import Comparison

oiio = pytest.importorskip("OpenImageIO")
metrics = pytest.importorskip("skimage.metrics")


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """Return files by name: two that differ by one level, and some that are no match."""
    a = noise_image(16, 24, 3, dtype="uint8")
    b = change(a, (3, 7, 2), int(a[3, 7, 2]) ^ 1)
    arrays: dict[str, NDArray[Any]] = {
        "a.png": a,
        "b.png": b,
        "small.png": a[:6],
        "alpha.png": np.dstack([a, np.full((16, 24, 1), 255, np.uint8)]),
        "float.exr": noise_image(16, 24, 3),
        "nan.exr": change(noise_image(16, 24, 3), (1, 2, 0), math.nan),
    }
    for name, array in arrays.items():
        vkbloom.write(tmp_path / name, array)
    return {name: tmp_path / name for name in arrays}


run = functools.partial(calls.run, "compare")


class TestCommand:
    def test_identical_files(self, files: dict[str, Path]) -> None:
        result = run(files["a.png"], files["a.png"])
        assert (result.exit_code, result.stderr) == (0, "")
        assert result.stdout.endswith("\nidentical\n")
        assert "PSNR       inf dB\n" in result.stdout

    def test_any_difference_fails_without_limits(self, files: dict[str, Path]) -> None:
        result = run(files["a.png"], files["b.png"])
        assert (result.exit_code, result.stderr) == (1, "")
        assert "\nFAILED: 0.2604 % of the pixels differ; largest difference 0.003" in result.stdout
        assert re.search(r"max error  0\.00392157 at x 7, y 3, channel B: ", result.stdout)
        assert "pixels     0.260417 % differ\n" in result.stdout
        assert all(re.search(rf"^  {name} +\d", result.stdout, re.M) for name in ("SSIM", "FLIP"))

    @pytest.mark.parametrize(
        ("limits", "status"),
        [
            ("--max-error 0.004 --min-ssim 0.99 --max-flip 0.001", 0),
            ("--max-error 0.0039", 1),
            ("--max-error 0.004 --min-ssim 1", 1),
            ("--max-flip 0", 1),
            ("--max-error none", 1),
        ],
    )
    def test_limits(self, files: dict[str, Path], limits: str, status: int) -> None:
        result = run(files["a.png"], files["b.png"], *limits.split())
        assert result.exit_code == status
        assert ("\nFAILED: " in result.stdout) is bool(status)
        assert result.stdout.endswith("\npassed\n") is not bool(status)

    def test_nan_can_be_allowed(self, files: dict[str, Path]) -> None:
        assert run(files["nan.exr"], files["nan.exr"], "--allow-nan").exit_code == 0
        assert run(files["nan.exr"], files["float.exr"], "--allow-nan").exit_code == 1

    def test_windows_differ(self, files: dict[str, Path], tmp_path: Path) -> None:
        moved = write_image(tmp_path / "moved.exr", noise_image(16, 24, 3), x=5, full_x=5)
        result = run(files["float.exr"], moved)
        assert result.exit_code == 1
        assert (
            "FAILED: the windows differ, data at 0,0 and display 24 x 16 at 0,0 against data at "
            "5,0 and display 24 x 16 at 5,0\n"
        ) in result.stdout
        assert run(moved, moved).exit_code == 0

    def test_ssim_of_small_images(self, files: dict[str, Path]) -> None:
        small = files["small.png"]
        result = run(small, small)
        assert result.exit_code == 0
        assert "SSIM       not computed: a side is under the window's 7 pixels\n" in result.stdout
        assert run(small, small, "--min-ssim", "0").exit_code == 1

    def test_one_of_several_parts_is_named(self, tmp_path: Path) -> None:
        """Files whose first parts are equal are not thereby equal."""
        values = np.random.default_rng(0).random((8, 9, 3)).astype(np.float32)
        for name, final in (("a.exr", values), ("b.exr", values / 2)):
            make({"glow": values, "final": final}).save(tmp_path / name)
        paths = (tmp_path / "a.exr", tmp_path / "b.exr")
        result = run(*paths)
        assert (result.exit_code, result.stdout) == (2, "")
        assert "choose one with --subimage: parts 0 glow, 1 final" in result.stderr
        assert run(*paths, "--subimage", "0").exit_code == 0
        assert run(*paths, "--subimage", "1").exit_code == 1

    def test_json(self, files: dict[str, Path]) -> None:
        result = run(files["a.png"], files["b.png"], "--json", "--max-error", "0.001")
        found = json.loads(result.stdout, parse_constant=pytest.fail)
        assert (result.exit_code, result.stderr) == (1, "")
        assert (found["a"], found["b"]) == (str(files["a.png"]), str(files["b.png"]))
        assert (found["passed"], found["identical"]) == (False, False)
        (reason,) = found["failures"]
        assert reason.startswith("largest difference 0.00392157 at x 7, y 3, channel 2: ")
        assert reason.endswith(", over 0.001, the most allowed")
        assert found["max_error"] == 1 / 255
        assert found["max_error_at"] == [7, 3, 2]
        assert len(found["max_error_values"]) == 2
        more = {"a", "b", "passed", "failures", "identical", "diff_scale", "diagnosis"}
        assert found.keys() == {*Comparison.__dataclass_fields__} | more

    def test_json_has_no_infinity(self, files: dict[str, Path]) -> None:
        found = json.loads(
            run(files["a.png"], files["a.png"], "--json").stdout, parse_constant=pytest.fail
        )
        assert (found["psnr"], found["identical"], found["passed"]) == (None, True, True)

    @pytest.mark.parametrize("name", ["d.png", "d.exr"])
    def test_difference_picture(self, files: dict[str, Path], tmp_path: Path, name: str) -> None:
        out = tmp_path / name
        result = run(files["a.png"], files["b.png"], "--diff", out)
        assert result.exit_code == 1
        assert result.stdout.endswith(f"\nwrote {out}, differences times 255\n")
        pixels = oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT)
        assert pixels.shape == (16, 24, 3)
        assert np.count_nonzero(pixels) == 1
        assert pixels[3, 7, 2] == 1

    def test_no_difference_picture(self, files: dict[str, Path], tmp_path: Path) -> None:
        out = tmp_path / "d.png"
        result = run(files["a.png"], files["small.png"], "--diff", out)
        assert result.exit_code == 1
        assert result.stderr == (
            f"vkbloom: note: {out} is not written: the images have no values to compare\n"
        )
        assert not out.exists()
