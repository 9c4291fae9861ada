"""``vkbloom apply``: files, colours, framebuffers beside them, and errors of one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from numpy.typing import NDArray

import vkbloom
from tests.exhaustive import some
from tests.processes import python
from vkbloom._cli.program import program
from vkbloom._io.image_reading import load
from vkbloom._io.image_writing import save
from vkbloom._io.images import Picture
from vkbloom._io.srgb import decode_srgb, encode_srgb
from vkbloom._methods.mip_chain import Pyramid
from vkbloom._methods.separable import Separable
from vkbloom._renderer import renderer

oiio = pytest.importorskip("OpenImageIO")

pytestmark = pytest.mark.usefixtures("kept_renderers")

NATURAL = vkbloom.presets["bevy_natural"]


def light(*shape: int, dtype: str = "float32") -> NDArray[Any]:
    """Return a dark image with a few lights, which go above 1 in floats."""
    generator = np.random.default_rng(11)
    values = generator.random(shape) * 0.2
    values[4:7, 6:9] = generator.random((3, 3, shape[2])) * (1 if dtype.startswith("u") else 6)
    if dtype.startswith("u"):
        return np.rint(values * np.iinfo(dtype).max).astype(dtype)
    return values.astype(dtype)


def stored(path: Path, pixels: NDArray[Any]) -> Path:
    """Write values as they are."""
    save(Picture.of_values(pixels, "half" if pixels.dtype == np.float16 else "float"), path)
    return path


def png(path: Path, pixels: NDArray[Any]) -> Path:
    """Write integers of 8 or 16 bits with 1 to 4 channels."""
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, str(pixels.dtype))
    spec.attribute("oiio:UnassociatedAlpha", 1)
    if channels == 2:
        spec.channelnames = ("Y", "A")
    writer = oiio.ImageOutput.create(str(path))
    assert writer.open(str(path), spec)
    assert writer.write_image(pixels)
    assert writer.close()
    return path


def run(*arguments: str | Path, adapter: str = "auto") -> Result:
    words = ["apply", *(str(argument) for argument in arguments), "--adapter", adapter]
    if not {"--preset", "--method", "--help"} & set(words):
        # Files of integers start from the preset photo: see test_cli_photo.py.
        words += ["--preset", "bevy_natural"]
    return CliRunner().invoke(program, words)


def done(*arguments: str | Path) -> Result:
    """Run a command that must succeed without output on standard error."""
    result = run(*arguments)
    # Notes with tests of their own: bevy_natural mixes, files of integers clip, alpha hides.
    usual = ("darkens the highlights", "values above 1 are clipped", "alpha hides it")
    lines = [line for line in result.stderr.splitlines() if not any(one in line for one in usual)]
    assert (result.exit_code, lines) == (0, [])
    return result


def pixels(path: Path) -> NDArray[Any]:
    return load(path).pixels


def applied(image: NDArray[Any], settings: vkbloom.Settings | None = None) -> NDArray[Any]:
    with vkbloom.Renderer() as renderer:
        chosen = settings or NATURAL
        return renderer.apply(image, chosen, framebuffers="final")["final"]


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
        image = light(20, 30, channels, dtype=dtype)
        image[:, :, 3:] = 1
        path = stored(tmp_path / "a.exr", image)
        result = done(path, tmp_path / "b.exr")
        assert pixels(tmp_path / "b.exr").dtype == dtype
        assert np.array_equal(pixels(tmp_path / "b.exr"), applied(image))
        assert result.stdout.startswith("Rendering on ")
        assert result.stdout.endswith(f"\nwrote {tmp_path / 'b.exr'}\n")

    @pytest.mark.parametrize("suffix", ["png", "tif", "bmp", "tga"])
    def test_8_bits_bloom_as_linear_floats(self, tmp_path: Path, suffix: str) -> None:
        image = light(20, 30, 3, dtype="uint8")
        done(png(tmp_path / "a.png", image), tmp_path / f"b.{suffix}")
        written = pixels(tmp_path / f"b.{suffix}")
        assert written.dtype == np.uint8
        expected = levels(applied(linear(image)))
        assert np.abs(written - expected).max() <= ROUNDING
        assert np.abs(expected - image).max() > 20

    @pytest.mark.parametrize(
        ("dtype", "channels"), [(dtype, n) for dtype in ("uint8", "uint16") for n in (1, 2, 3, 4)]
    )
    def test_without_bloom_integers_come_back(
        self, tmp_path: Path, dtype: str, channels: int
    ) -> None:
        image = np.random.default_rng(0).integers(0, np.iinfo(dtype).max + 1, (20, 30, channels))
        path = png(tmp_path / "a.png", image.astype(dtype))
        done(path, tmp_path / "b.png", "--no-bloom")
        assert np.array_equal(pixels(tmp_path / "b.png"), image)

    def test_float_to_png(self, tmp_path: Path) -> None:
        image = light(20, 30, 3, dtype="float16")
        done(stored(tmp_path / "a.exr", image), tmp_path / "b.png")
        final = applied(image)
        # Colours above 1 keep their hue.
        final /= np.maximum(final.max(axis=2, keepdims=True), 1)
        assert np.abs(pixels(tmp_path / "b.png") - levels(final)).max() <= ROUNDING

    def test_radiance(self, tmp_path: Path) -> None:
        image = light(20, 30, 3)
        # Rounded to what the format holds.
        image = pixels(stored(tmp_path / "a.hdr", image))
        done(tmp_path / "a.hdr", tmp_path / "b.hdr")
        written, expected = pixels(tmp_path / "b.hdr"), applied(image)
        assert (np.abs(written - expected).max(axis=2) <= expected.max(axis=2) / 128).all()

    @pytest.mark.parametrize("with_alpha", [False, True])
    def test_grey_stays_grey(self, tmp_path: Path, with_alpha: bool) -> None:
        image = light(20, 30, 1 + with_alpha, dtype="uint8")
        done(png(tmp_path / "a.png", image), tmp_path / "b.png", "--tonemap", "aces")
        written = pixels(tmp_path / "b.png")
        assert written.shape == image.shape
        rgb = linear(np.repeat(image[:, :, :1], 3, axis=2))
        expected = levels(applied(rgb, NATURAL.replace(tonemap="aces")))
        assert np.abs(written[:, :, 0] - expected[:, :, 0]).max() <= ROUNDING
        if with_alpha:
            assert np.array_equal(written[:, :, 1], image[:, :, 1])

    def test_raw(self, tmp_path: Path) -> None:
        image = light(20, 30, 4, dtype="uint8")
        done(png(tmp_path / "a.png", image), tmp_path / "b.png", "--raw", "--threshold", "0.3")
        assert np.array_equal(
            pixels(tmp_path / "b.png"), applied(image, NATURAL.replace(threshold=0.3))
        )

    def test_windows(self, tmp_path: Path) -> None:
        image = light(10, 12, 3, dtype="float16")
        path = tmp_path / "a.exr"
        spec = oiio.ImageSpec(12, 10, 3, "half")
        spec.x, spec.y = 4, 3
        spec.full_width, spec.full_height = 24, 20
        writer = oiio.ImageOutput.create(str(path))
        assert writer.open(str(path), spec)
        assert writer.write_image(image)
        assert writer.close()
        done(path, tmp_path / "b.exr")
        whole = np.zeros((20, 24, 3), np.float16)
        whole[3:13, 4:16] = image
        assert np.array_equal(pixels(tmp_path / "b.exr"), applied(whole))
        # The light reaches beyond the original data window.
        assert pixels(tmp_path / "b.exr")[3:13, 3].any()

    def test_parts(self, tmp_path: Path) -> None:
        image = light(20, 30, 3)
        with vkbloom.Renderer() as renderer:
            frames = renderer.apply(image, Separable(threshold=0.5))
        frames.save(tmp_path / "a.exr")
        names = list(frames)
        last = names.index("final")
        chosen = ("--subimage", str(last))
        done(tmp_path / "a.exr", tmp_path / "b.exr", "--no-bloom", *chosen)
        assert np.array_equal(pixels(tmp_path / "b.exr"), frames["final"])
        result = run(tmp_path / "a.exr", tmp_path / "b.exr", "--no-bloom")
        assert "a.exr: read the first of its parts 0 glow, 1 blur_vertical, " in result.stderr
        assert np.array_equal(pixels(tmp_path / "b.exr"), frames[names[0]])

    def test_in_place(self, tmp_path: Path) -> None:
        image = light(20, 30, 3)
        path = stored(tmp_path / "a.exr", image)
        done(path, path, "--overwrite")
        assert np.array_equal(pixels(path), applied(image))


class TestColours:
    def test_linear_integers(self, tmp_path: Path) -> None:
        image = light(20, 30, 3, dtype="uint8")
        path = png(tmp_path / "a.png", image)
        colours = ("--input-colour", "linear", "--output-colour", "linear")
        done(path, tmp_path / "b.png", *colours)
        expected = np.clip(applied((image / 255).astype(np.float32)), 0, 1) * 255
        assert np.abs(pixels(tmp_path / "b.png") - expected).max() <= ROUNDING
        # The file says so, and is taken as what it says.
        done(tmp_path / "b.png", tmp_path / "c.png", "--no-bloom", "--output-colour", "linear")
        assert np.array_equal(pixels(tmp_path / "c.png"), pixels(tmp_path / "b.png"))

    @pytest.mark.parametrize("encoding", ["srgb", "gamma22"])
    def test_an_encoding_is_the_only_one(self, tmp_path: Path, encoding: Any) -> None:
        image = light(20, 30, 3)
        path = stored(tmp_path / "a.exr", image)
        options = ("--tonemap", "reinhard", "--encoding", encoding)
        for name in ("b.exr", "b.png"):
            done(path, tmp_path / name, *options)
        expected = applied(image, NATURAL.replace(tonemap="reinhard", encoding=encoding))
        assert np.array_equal(pixels(tmp_path / "b.exr"), expected)
        assert np.abs(pixels(tmp_path / "b.png") - expected * 255.0).max() <= ROUNDING

    def test_settings_are_those_of_render(self, tmp_path: Path) -> None:
        image = light(40, 30, 3)
        path = stored(tmp_path / "a.exr", image)
        words = "--method pyramid --levels 3 --threshold 0.5 --knee 0.2 --intensity 0.5"
        done(path, tmp_path / "b.exr", *words.split())
        settings = Pyramid(levels=3, threshold=0.5, knee=0.2, intensity=0.5)
        assert np.array_equal(pixels(tmp_path / "b.exr"), applied(image, settings))
        kept = oiio.ImageBuf(str(tmp_path / "b.exr")).spec()["vkbloom:settings"]
        assert json.loads(kept) == json.loads(json.dumps(settings.to_dict()))
        done(path, tmp_path / "c.exr", "--preset", "outline")
        outline = vkbloom.presets["outline"]
        assert np.array_equal(pixels(tmp_path / "c.exr"), applied(image, outline))

    def test_nan_and_infinity_are_told(self, tmp_path: Path) -> None:
        image = light(20, 30, 3)
        image[0, 0], image[1, 1, 0] = np.nan, -np.inf
        path = stored(tmp_path / "a.exr", image)
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

    def test_lost_information_is_noted(self, tmp_path: Path) -> None:
        image = light(20, 30, 4)
        path = stored(tmp_path / "a.exr", image)
        line, clipped = run(path, tmp_path / "b.jpg").stderr.splitlines()
        assert line.startswith("vkbloom: note: ")
        assert line.endswith("b.jpg cannot hold alpha, which is not 1 everywhere")
        assert "values above 1 are clipped" in clipped


class TestFramebuffers:
    def test_all_are_beside_the_output(self, tmp_path: Path) -> None:
        image = light(20, 30, 3, dtype="float16")
        path = stored(tmp_path / "a.exr", image)
        result = done(path, tmp_path / "b.exr", "--framebuffers", "all")
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


class TestErrors:
    @pytest.mark.parametrize(
        ("arguments", "status", "message"),
        [
            ("no.png b.png", 1, "no.png: No such file or directory"),
            (". b.png", 2, "images; name a folder or a pattern"),
            ("f.%04d.exr b.png", 1, "f.%04d.exr: no file was found"),
            ("bad.png b.png", 1, "bad.png: is not a readable image"),
            ("bad.exr b.png", 1, "bad.exr: is not a readable image"),
            ("cut.exr b.png", 1, "cut.exr: damaged"),
            ("a.exr b.png --dirt cut.png", 1, "cut.png: damaged"),
            ("a.exr b.png --method convolution --psf cut.exr", 1, "cut.exr: damaged"),
            ("xyz.exr b.png", 1, "xyz.exr: the channels X, Y, Z are not R, G, B or a single one"),
            ("a.exr none/b.png", 1, "none/b.png: there is no folder none"),
            ("a.exr b.zfile", 1, "b.zfile: zfile cannot hold this picture"),
            ("a.exr b.png --subimage 1", 1, "a.exr: subimage 1 is not in 0..0"),
            ("a.exr b.unknown", 2, "b.unknown: '.unknown' is not the extension of a writable"),
            ("a.exr b", 2, "'' is not the extension of a writable"),
            ("a.exr", 2, "Missing argument 'OUT'"),
            ("a.exr b.png c.png", 2, "c.png: one file cannot hold 2 images"),
            (
                "a.exr b.png --method separable --blur-scale 17",
                2,
                "blur_scale: 17.0 is out of range, 0 to 16",
            ),
            (
                "a.exr b.png --levels 3",
                2,
                "the method bevy has no --levels; give --method pyramid or",
            ),
            ("a.exr b.png --framebuffers glare", 2, "framebuffers: unknown framebuffer 'glare'"),
            ("a.exr b.png --input-colour red", 2, "--input-colour: colour: 'red' is not linear"),
            ("a.exr b.png --subimage -1", 2, "--subimage"),
            ("a.exr b.png --raw", 2, "a.exr has float, not 8-bit integers"),
            ("a.exr b.png --raw --input-colour srgb", 2, "--raw does not convert colours"),
            ("a.exr b.png --encoding srgb --output-colour srgb", 2, "already encodes the output"),
            ("a.exr b.png --framebuffers bloom --no-bloom", 2, "framebuffers"),
        ],
    )
    def test_are_one_line_and_leave_nothing(
        self,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        arguments: str,
        status: int,
        message: str,
    ) -> None:
        monkeypatch.chdir(tmp_path)
        content = stored(Path("a.exr"), light(20, 30, 3)).read_bytes()
        Path("cut.exr").write_bytes(content[: len(content) // 2])
        content = png(Path("cut.png"), light(20, 30, 3, dtype="uint8")).read_bytes()
        Path("cut.png").write_bytes(content[: len(content) // 2])
        for name in ("bad.png", "bad.exr"):
            Path(name).write_bytes(b"nothing of the kind")
        spec = oiio.ImageSpec(2, 2, 3, "float")
        spec.channelnames = ("X", "Y", "Z")
        writer = oiio.ImageOutput.create("xyz.exr")
        assert writer.open("xyz.exr", spec)
        assert writer.write_image(light(20, 30, 3)[:2, :2])
        assert writer.close()
        Path("b.png").write_bytes(b"before")
        result = run(*arguments.split())
        assert result.exit_code == status
        assert result.stderr.startswith("vkbloom: ")
        assert result.stderr.count("\n") == 1
        assert message in result.stderr
        assert Path("b.png").read_bytes() == b"before"
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
            ["a.exr", "b.png", "bad.exr", "bad.png", "cut.exr", "cut.png", "xyz.exr"]
        )

    def test_an_array_of_numpy_says_how_to_convert_it(self, tmp_path: Path) -> None:
        file = tmp_path / "a.npy"
        np.save(file, light(20, 30, 3))
        result = run(file, tmp_path / "b.png")
        assert result.exit_code == 1
        assert f"vkbloom.write('image.exr', numpy.load('{file}'))" in result.stderr

    @pytest.mark.parametrize("suffix", some(["png", "exr", "tif", "jpg"], 2))
    def test_libraries_are_silenced(self, tmp_path: Path, suffix: str) -> None:
        path = tmp_path / f"a.{suffix}"
        values = np.random.default_rng(0).random((60, 80, 3)).astype(np.float32)
        save(Picture.of_values(values), path)
        content = path.read_bytes()
        path.write_bytes(content[: len(content) // 2])
        # As a process, because libpng writes to the descriptor.
        ended = python("-m", "vkbloom._cli", "apply", path, tmp_path / "b.png")
        assert (ended.returncode, ended.stdout) == (1, "")
        assert ended.stderr.startswith(f"vkbloom: {path}: ")
        assert ended.stderr.count("\n") == 1
        assert not (tmp_path / "b.png").exists()

    def test_a_failure_on_the_device_leaves_the_output(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def fail(*_: Any, **__: Any) -> None:
            raise vkbloom.DeviceLostError("the device is lost")

        path = stored(tmp_path / "a.exr", light(20, 30, 3))
        before = path.read_bytes()
        monkeypatch.setattr(renderer.Renderer, "map", fail)
        result = run(path, path, "--overwrite")
        assert (result.exit_code, result.stderr) == (1, "vkbloom: the device is lost\n")
        assert path.read_bytes() == before


def picture(path: Path) -> Path:
    return png(path, light(16, 24, 3, dtype="uint8"))


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
    done(file, file, "--overwrite")
    assert file.read_bytes() != before


def test_no_picture_is_written_to_a_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vkbloom._cli.sequences.is_terminal", lambda: True)
    refused = run(picture(tmp_path / "a.png"), "-")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "standard output is a terminal" in refused.stderr


def test_folders_are_made_for_one_picture_and_checked_before(tmp_path: Path) -> None:
    file = picture(tmp_path / "a.png")
    done(file, f"{tmp_path}/new/")
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


def test_hashes_are_digits(tmp_path: Path) -> None:
    for number in (3, 12):
        picture(tmp_path / f"f.{number:04d}.png")
    done(tmp_path / "f.####.png", tmp_path / "g.##.png")
    assert sorted(file.name for file in tmp_path.glob("g*")) == ["g.03.png", "g.12.png"]
    # A file with this name is meant.
    picture(tmp_path / "f.####.png")
    done(tmp_path / "f.####.png", tmp_path / "one.png")
    assert (tmp_path / "one.png").is_file()
