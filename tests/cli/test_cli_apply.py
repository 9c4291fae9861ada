"""``vkbloom apply``: files, colours, framebuffers beside them, and errors of one line."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import NATURAL, apply_settings
from tests.cli.calls import apply as run
from tests.images import lights
from tests.io.parts import reread
from tests.io.profiles import store_png as png
from tests.srgb import decode_srgb, encode_srgb

oiio = pytest.importorskip("OpenImageIO")

pytestmark = pytest.mark.usefixtures("kept_renderers")


def succeed(*arguments: str | Path) -> Result:
    """Run a command that must succeed without output on standard error."""
    result = run(*arguments)
    # Notes with tests of their own: files of integers clip, alpha hides.
    usual = ("values above 1 are clipped", "alpha hides it")
    lines = [line for line in result.stderr.splitlines() if not any(one in line for one in usual)]
    assert (result.exit_code, lines) == (0, [])
    return result


def pixels(path: Path) -> NDArray[Any]:
    return reread(path)[1]


def linear(levels: NDArray[Any]) -> NDArray[np.float32]:
    """Return sRGB integers as linear floats, alpha only scaled."""
    values = levels / np.iinfo(levels.dtype).max
    values[:, :, :3] = decode_srgb(values[:, :, :3])
    return values.astype(np.float32)


def levels(values: NDArray[Any], largest: int = 255) -> NDArray[np.float64]:
    """Return linear floats as sRGB integers before rounding."""
    encoded = np.clip(values.astype(np.float64), 0, 1)
    encoded[:, :, :3] = encode_srgb(encoded[:, :, :3])
    return encoded * largest


# Half a step of rounding, and what the decoding in float32 adds to it.
ROUNDING = 0.501


class TestFormats:
    @pytest.mark.parametrize("dtype", ["float16", "float32"])
    @pytest.mark.parametrize("channels", [3, 4])
    def test_exr_stays_as_it_is(self, tmp_path: Path, dtype: str, channels: int) -> None:
        image = lights(30, 20, channels, dtype=dtype)
        image[:, :, 3:] = 1
        path = vkbloom.write(tmp_path / "a.exr", image)
        result = succeed(path, tmp_path / "b.exr")
        assert pixels(tmp_path / "b.exr").dtype == dtype
        assert np.array_equal(pixels(tmp_path / "b.exr"), apply_settings(image))
        assert result.stdout.startswith("Rendering on ")
        assert result.stdout.endswith(f"\nwrote {tmp_path / 'b.exr'}\n")

    @pytest.mark.parametrize(
        ("suffix", "channels"), [*((one, 3) for one in ("png", "tif", "bmp", "tga")), ("png", 1)]
    )
    def test_8_bits_bloom_as_linear_floats(
        self, tmp_path: Path, suffix: str, channels: int
    ) -> None:
        image = lights(30, 20, channels, dtype="uint8")
        succeed(png(tmp_path / "a.png", image), tmp_path / f"b.{suffix}")
        written = pixels(tmp_path / f"b.{suffix}")
        assert written.dtype == np.uint8
        assert written.shape == image.shape
        rgb = linear(np.repeat(image, 3 // channels, axis=2))
        expected = levels(apply_settings(rgb))[:, :, :channels]
        assert np.abs(written - expected).max() <= ROUNDING
        assert np.abs(expected - image).max() > 10

    @pytest.mark.parametrize(
        ("dtype", "channels"), [(dtype, n) for dtype in ("uint8", "uint16") for n in (1, 2, 3, 4)]
    )
    def test_without_bloom_integers_come_back(
        self, tmp_path: Path, dtype: str, channels: int
    ) -> None:
        image = np.random.default_rng(0).integers(0, np.iinfo(dtype).max + 1, (20, 30, channels))
        path = png(tmp_path / "a.png", image.astype(dtype))
        succeed(path, tmp_path / "b.png", "--no-bloom")
        assert np.array_equal(pixels(tmp_path / "b.png"), image)


class TestColours:
    @pytest.mark.parametrize("encoding", ["srgb", "gamma22"])
    def test_an_encoding_is_the_only_one(self, tmp_path: Path, encoding: Any) -> None:
        image = lights(30, 20, 3)
        path = vkbloom.write(tmp_path / "a.exr", image)
        options = ("--tonemap", "reinhard", "--encoding", encoding)
        for name in ("b.exr", "b.png"):
            succeed(path, tmp_path / name, *options)
        expected = apply_settings(image, NATURAL.replace(tonemap="reinhard", encoding=encoding))
        assert np.array_equal(pixels(tmp_path / "b.exr"), expected)
        assert np.abs(pixels(tmp_path / "b.png") - expected * 255.0).max() <= ROUNDING

    def test_settings_are_those_of_render(self, tmp_path: Path) -> None:
        image = lights(30, 40, 3)
        path = vkbloom.write(tmp_path / "a.exr", image)
        words = "--method pyramid --levels 3 --threshold 0.5 --knee 0.2 --intensity 0.5"
        succeed(path, tmp_path / "b.exr", *words.split())
        settings = vkbloom.Pyramid(levels=3, threshold=0.5, knee=0.2, intensity=0.5)
        assert np.array_equal(pixels(tmp_path / "b.exr"), apply_settings(image, settings))
        kept = oiio.ImageBuf(str(tmp_path / "b.exr")).spec()["vkbloom:settings"]
        assert json.loads(kept) == json.loads(json.dumps(settings.to_dict()))
        succeed(path, tmp_path / "c.exr", "--preset", "outline")
        outline = vkbloom.presets["outline"]
        assert np.array_equal(pixels(tmp_path / "c.exr"), apply_settings(image, outline))

    def test_nan_and_infinity_are_told(self, tmp_path: Path) -> None:
        image = lights(30, 20, 3)
        image[0, 0], image[1, 1, 0] = np.nan, -np.inf
        path = vkbloom.write(tmp_path / "a.exr", image)
        result = run(path, tmp_path / "b.exr")
        assert result.exit_code == 0
        assert result.stderr == (
            f"vkbloom: note: {path} has 3 NaN and 1 infinite values; they count as 0 in the bloom, "
            "and stay in the picture\n"
        )
        written = pixels(tmp_path / "b.exr")
        assert np.isnan(written[0, 0]).all()
        assert np.isneginf(written[1, 1, 0])
        assert np.isfinite(written).sum() == image.size - 4
        result = run(path, tmp_path / "b.png")
        assert result.exit_code == 0
        assert "b.png has integers: NaN is written as 0, infinity as 1" in result.stderr
        assert (pixels(tmp_path / "b.png")[0, 0] == 0).all()


def picture(path: Path) -> Path:
    return png(path, lights(24, 16, 3, dtype="uint8"))


def test_a_file_that_is_read_needs_overwrite(tmp_path: Path) -> None:
    file = picture(tmp_path / "a.png")
    before = file.read_bytes()
    link = tmp_path / "link.png"
    link.symlink_to(file)
    for target in (file, link, f"{tmp_path}/"):
        refused = run(file, target)
        assert refused.exit_code == 2
        assert "use --overwrite" in refused.stderr
    assert file.read_bytes() == before
    succeed(file, file, "--overwrite")
    assert file.read_bytes() != before


def test_no_picture_is_written_to_a_terminal(tmp_path: Path) -> None:
    pty = pytest.importorskip("pty")
    screen, terminal = pty.openpty()
    words = [sys.executable, "-m", "vkbloom", "apply", str(picture(tmp_path / "a.png")), "-"]
    refused = subprocess.run(words, stdout=terminal, stderr=subprocess.PIPE, check=False)
    os.close(terminal)
    with os.fdopen(screen, "rb") as shown, contextlib.suppress(OSError):
        assert shown.read() == b""
    assert refused.returncode == 2
    assert b"standard output is a terminal" in refused.stderr


def test_folders_are_made_for_one_picture_and_checked_before(tmp_path: Path) -> None:
    file = picture(tmp_path / "a.png")
    succeed(file, f"{tmp_path}/new/")
    assert (tmp_path / "new/a.png").is_file()
    for target in ("no/b.png", "no/folder/", "a.png/"):
        failed = run(file, f"{tmp_path}/{target}")
        assert failed.exit_code == 1
        # Nothing was rendered.
        assert failed.stdout == ""
        assert (
            "directory" if target == "a.png/" else f"no folder {tmp_path}/no\n"
        ) in failed.stderr
    assert not (tmp_path / "no").exists()


class TestFramebuffers:
    def test_all_are_beside_the_output(self, tmp_path: Path) -> None:
        image = lights(20, 30, 3, dtype="float16")
        path = vkbloom.write(tmp_path / "a.exr", image)
        result = succeed(path, tmp_path / "b.exr", "--framebuffers", "all")
        with vkbloom.Renderer() as renderer:
            frames = renderer.apply(image, NATURAL)
        others = [name for name in frames if name != "final"]
        assert sorted(file.name for file in tmp_path.iterdir()) == sorted(
            ["a.exr", "b.exr", *(f"b_{name}.exr" for name in others)]
        )
        for name in others:
            assert np.array_equal(pixels(tmp_path / f"b_{name}.exr"), frames[name])
        written = [line for line in result.stdout.splitlines() if line.startswith("wrote ")]
        assert len(written) == len(frames)

    @pytest.mark.parametrize(
        ("words", "more"),
        [
            ("--framebuffers bloom,final", {"b_bloom.exr"}),
            ("--framebuffers glow", {"b_glow.exr"}),
            ("--framebuffers final", set()),
            ("", set()),
        ],
    )
    def test_files_beside_a_png(self, tmp_path: Path, words: str, more: set[str]) -> None:
        path = png(tmp_path / "a.png", lights(20, 30, 3, dtype="uint8"))
        succeed(path, tmp_path / "b.png", *words.split())
        assert {file.name for file in tmp_path.iterdir()} == {"a.png", "b.png", *more}

    @pytest.mark.parametrize("names", ["bloom", "all"])
    def test_no_image_of_the_call_is_replaced(self, tmp_path: Path, names: str) -> None:
        image = lights(20, 30, 3, dtype="float16")
        path = vkbloom.write(tmp_path / "a_bloom.exr", image)
        failed = run(path, tmp_path / "a.exr", "--framebuffers", names)
        assert failed.exit_code
        assert f"{path}: bloom would replace this file, which IN or OUT names" in failed.stderr
        assert np.array_equal(pixels(path), image)
        # The framebuffer of a.exr would be the picture of a_bloom.exr.
        out = tmp_path / "out"
        vkbloom.write(tmp_path / "a.exr", image)
        failed = run(tmp_path, out, "--framebuffers", names)
        assert failed.exit_code == 1
        assert "1 of 2 images failed" in failed.stderr
        assert pixels(out / "a_bloom.exr").shape[2] == 3
        # Two images with one stem.
        png(tmp_path / "a.png", lights(20, 30, 3, dtype="uint8"))
        refused = run(tmp_path, tmp_path / "new", "--framebuffers", names)
        assert refused.exit_code == 2
        assert f"a.png: its framebuffers would replace those of {tmp_path}/new/a.exr" in (
            refused.stderr
        )

    def test_a_picture_of_another_program_stays(self, tmp_path: Path) -> None:
        path = png(tmp_path / "a.png", lights(20, 30, 3, dtype="uint8"))
        image = lights(20, 30, 3, dtype="float16")
        other = vkbloom.write(tmp_path / "b_glow.exr", image, metadata={"Software": "a camera"})
        failed = run(path, tmp_path / "b.png", "--framebuffers", "glow")
        assert failed.exit_code
        assert "give --overwrite" in failed.stderr
        assert np.array_equal(pixels(other), image)
        for words in (["--overwrite"], []):
            succeed(path, tmp_path / "b.png", "--framebuffers", "glow", *words)
        assert not np.array_equal(pixels(other), image)


class TestPicturesOfOthers:
    """OUT as the last word replaces only what vkbloom wrote: it may be the second of two INs."""

    @pytest.mark.parametrize("suffix", ["png", "jpg", "tif", "exr", "tga"])
    def test_a_result_is_replaced_and_a_photograph_is_not(
        self, tmp_path: Path, suffix: str
    ) -> None:
        image = lights(20, 30, 3, dtype="uint8").astype(np.float32) / 255
        files = [tmp_path / f"{name}.{suffix}" for name in "abc"]
        for file in files[:2]:
            vkbloom.write(file, image, metadata={"Software": "a camera"})
        before = files[1].read_bytes()
        refused = run(files[0], files[1])
        assert refused.exit_code == 2
        assert f"give it as -o {files[1]}, or --overwrite" in refused.stderr
        assert files[1].read_bytes() == before
        for _ in range(2):
            succeed(files[0], files[2])
        succeed(files[0], files[1], "--overwrite")
        vkbloom.write(files[1], image, metadata={"Software": "a camera"})
        succeed(files[0], "-o", files[1])
        assert files[1].read_bytes() != before
        # It is a result now.
        succeed(files[0], files[1])

    def test_what_python_wrote_is_replaced(self, tmp_path: Path) -> None:
        image = lights(20, 30, 3, dtype="uint8")
        path = png(tmp_path / "a.png", image)
        vkbloom.write(tmp_path / "b.png", image)
        succeed(path, tmp_path / "b.png")
        # A format that does not hold a name of a program cannot tell.
        vkbloom.write(tmp_path / "b.bmp", image)
        succeed(path, tmp_path / "b.bmp")
