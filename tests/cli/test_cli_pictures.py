"""``vkbloom apply`` with the files that people have: sequences, pipes, layers, quality, notes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

import vkbloom
from tests.cli import calls
from tests.framebuffers import names_in
from tests.io.profiles import store_png
from tests.processes import python

pytestmark = pytest.mark.usefixtures("kept_renderers")


IMAGE = np.random.default_rng(3).integers(0, 200, (12, 16, 3), dtype=np.uint8)


def run(*words: object) -> Result:
    return calls.apply(*words, "--composite", "add")


@pytest.fixture
def frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with frames 8 to 11, all different."""
    monkeypatch.chdir(tmp_path)
    for number in range(8, 12):
        store_png(tmp_path / f"f.{number:04d}.png", IMAGE + np.uint8(number))
    return tmp_path


class TestSequences:
    @pytest.mark.parametrize(
        ("words", "written"),
        [
            (["f.%04d.png", "g.%04d.png"], [f"g.{n:04d}.png" for n in range(8, 12)]),
            (["f.*.png", "g.%02d.jpg"], [f"g.{n:02d}.jpg" for n in range(4)]),
            (["f.%04d.png", "-o", "out"], [f"out/f.{n:04d}.png" for n in range(8, 12)]),
            ([".", "out/"], [f"out/f.{n:04d}.png" for n in range(8, 12)]),
            (["f.0008.png", "f.0010.png", "out"], ["out/f.0008.png", "out/f.0010.png"]),
        ],
    )
    def test_names(self, frames: Path, words: list[str], written: list[str]) -> None:
        result = run(*words)
        assert result.exit_code == 0, result.stderr
        found = [str(path.relative_to(frames)) for path in frames.rglob("*") if path.is_file()]
        assert sorted(found) == sorted([*written, *(f"f.{n:04d}.png" for n in range(8, 12))])

    def test_other_files_of_a_folder_are_told(self, frames: Path) -> None:
        (frames / "notes.txt").write_text("dear")
        result = run(".", "out/")
        assert result.exit_code == 0
        assert result.stderr == "vkbloom: note: .: left out what is no image: notes.txt\n"
        assert names_in(frames / "out") == [f"f.{n:04d}.png" for n in range(8, 12)]

    @pytest.mark.parametrize("which", [(8,), (9, 10), (11,), (8, 9, 10, 11)])
    def test_the_other_images_are_done(self, frames: Path, which: tuple[int, ...]) -> None:
        for number in which:
            (frames / f"f.{number:04d}.png").write_bytes(b"nothing of the kind")
        result = run("f.%04d.png", "g.%04d.png")
        assert result.exit_code == 1
        *errors, last = result.stderr.splitlines()
        assert [line.partition(" (")[0].partition(": is not")[0] for line in errors] == [
            f"vkbloom: f.{number:04d}.png" for number in which
        ]
        assert last == f"vkbloom: {len(which)} of 4 images failed"
        done = [f"g.{number:04d}.png" for number in range(8, 12) if number not in which]
        assert [name for name in names_in(frames) if name[0] == "g"] == done

    @pytest.mark.parametrize("words", [("--mask", "m.png"), ("--alpha", "max")])
    def test_an_image_that_options_do_not_fit(self, frames: Path, words: tuple[str, ...]) -> None:
        """The others are done, also those that were read before the error came."""
        other = np.ones((5, 7, 3) if words[0] == "--mask" else (12, 16, 4), np.float32)
        if words[0] == "--mask":
            wrong, right = ["b.exr"], ["f.0008.png", "f.0009.png"]
        else:
            wrong, right = ["f.0008.png", "f.0009.png"], ["b.exr"]
        vkbloom.write(frames / "b.exr", other)
        vkbloom.write(frames / "m.png", np.ones((12, 16), np.float32))
        result = run("f.0008.png", "b.exr", "f.0009.png", "out", *words)
        assert result.exit_code == 1
        assert result.stderr.endswith(f"vkbloom: {len(wrong)} of 3 images failed\n")
        assert names_in(frames / "out") == sorted(right)

    def test_a_target_that_cannot_be_written(self, frames: Path) -> None:
        (frames / "g.0009.png").mkdir()
        result = run("f.%04d.png", "g.%04d.png")
        assert (result.exit_code, result.stderr.count("\n")) == (1, 2)
        assert result.stderr.endswith("g.0009.png: Is a directory\nvkbloom: 1 of 4 images failed\n")
        assert (frames / "g.0011.png").is_file()

    def test_existing_images_are_skipped(
        self, frames: Path, capfd: pytest.CaptureFixture[str]
    ) -> None:
        assert run("f.%04d.png", "g.%04d.png").exit_code == 0
        whole = (frames / "g.0009.png").read_bytes()
        # One is cut, one is empty, one is missing, and one is no image.
        (frames / "g.0008.png").write_bytes(whole[:100])
        (frames / "g.0009.png").write_bytes(b"")
        (frames / "g.0010.png").unlink()
        (frames / "g.0011.png").write_bytes(b"before")
        result = run("f.%04d.png", "g.%04d.png", "--skip-existing")
        assert result.exit_code == 0, result.stderr
        assert "skipped 1 of 4 images" in result.stdout
        # libpng prints of its own.
        assert "libpng" not in capfd.readouterr().err
        assert "g.0011.png: is left as it is, though it is no image" in result.stderr
        assert (frames / "g.0011.png").read_bytes() == b"before"
        for number in (8, 9, 10):
            assert vkbloom.read(frames / f"g.{number:04d}.png").shape == IMAGE.shape
        result = run("f.%04d.png", "g.%04d.png", "--skip-existing")
        assert (result.exit_code, "skipped 4 of 4" in result.stdout) == (0, True)

    @pytest.mark.parametrize("names", ["bloom,glow", "all"])
    def test_an_image_without_its_framebuffers_is_made_again(
        self, frames: Path, names: str
    ) -> None:
        words = ("f.%04d.png", "out", "--skip-existing", "--framebuffers", names)
        assert "skipped 0 of 4" in run(*words).stdout
        (frames / "out" / "f.0009_bloom.exr").unlink()
        assert "skipped 3 of 4" in run(*words).stdout
        assert (frames / "out" / "f.0009_bloom.exr").exists()

    @pytest.mark.parametrize("order", ["exr first", "png first", "between"])
    def test_each_file_starts_from_its_own_preset(self, frames: Path, order: str) -> None:
        values = np.random.default_rng(0).random((5, 7, 3)).astype(np.float32) ** 8 * 3
        vkbloom.write("x.exr", values)
        store_png(frames / "y.png", IMAGE)
        kinds = {"exr first": "eepp", "png first": "ppee", "between": "epep"}[order]
        (frames / "in").mkdir()
        for place, kind in enumerate(kinds):
            source = Path("x.exr" if kind == "e" else "y.png")
            (frames / f"in/{place}{source.suffix}").write_bytes(source.read_bytes())
        for words in (("in", "out"), ("x.exr", "alone.exr"), ("y.png", "alone.png")):
            assert calls.run("apply", *words).exit_code == 0
        for file in (frames / "out").iterdir():
            alone = vkbloom.read(f"alone{file.suffix}")
            np.testing.assert_array_equal(vkbloom.read(file), alone)

    def test_libraries_are_silenced_and_notes_are_not(self, frames: Path) -> None:
        """libpng prints of its own while the notes of other images are printed."""
        content = (frames / "f.0011.png").read_bytes()
        (frames / "f.0011.png").write_bytes(content[: len(content) // 2])
        words = ("f.*.png", "out", "--method", "pyramid", "--threshold", "1")
        ended = python("-m", "vkbloom._cli", "apply", *words)
        assert ended.returncode == 1
        lines = ended.stderr.splitlines()
        assert len(lines) == 5
        assert all(line.startswith("vkbloom: ") for line in lines)
        assert "f.0008.png: the bloom is zero everywhere" in ended.stderr
        assert "f.0011.png: " in lines[-2]


@pytest.mark.parametrize(
    ("source", "out", "words", "told"),
    [
        *(
            ("a.exr", out, (), "values above 1 are clipped; --tonemap")
            for out in ("b.png", "b.jpg")
        ),
        ("a.exr", "b.png", ("--tonemap", "aces"), ""),
        ("a.exr", "b.png", ("--view", "ACES 2.0 - SDR 100 nits (Rec.709)"), ""),
        ("a.exr", "b.png", ("--output-colour", "pq"), ""),
        ("a.exr", "b.exr", (), ""),
        ("a.png", "b.png", (), "alpha hides it; --alpha max"),
        ("a.png", "b.tga", (), "alpha hides it; --alpha max"),
        ("a.png", "b.png", ("--alpha", "max"), ""),
        ("a.png", "b.png", ("--no-bloom",), ""),
        *(("a.png", out, (), "") for out in ("b.jpg", "b.exr")),
    ],
)
def test_notes(tmp_path: Path, source: str, out: str, words: tuple[str, ...], told: str) -> None:
    """Of values above 1 in files of integers, and of alpha 0 around a light."""
    image = np.full((24, 32, 3), 3, np.float32)
    if source == "a.png":
        image = np.zeros((24, 32, 4), np.float32)
        image[8:16, 8:16] = 1
    result = run(vkbloom.write(tmp_path / source, image), tmp_path / out, *words)
    assert result.exit_code == 0, result.stderr
    assert told in result.stderr
    note = "values above 1 are clipped" if source == "a.exr" else "alpha hides it"
    assert (note in result.stderr) is bool(told)


@pytest.mark.parametrize(
    ("source", "out", "bits", "numbers"),
    [
        ("a.exr", "b.png", "16", "uint16"),
        ("a.exr", "b.tif", "16", "uint16"),
        ("a.png", "b.exr", "16", "half"),
        ("a.png", "b.exr", "32", "float"),
        ("a.png", "b.png", "16", "uint16"),
        ("a.exr", "b.tif", "8", "uint8"),
    ],
)
def test_bits(tmp_path: Path, source: str, out: str, bits: str, numbers: str) -> None:
    vkbloom.write(tmp_path / source, np.linspace(0, 1, 24 * 3, dtype=np.float32).reshape(6, 4, 3))
    result = run(tmp_path / source, tmp_path / out, "--bits", bits)
    assert result.exit_code == 0, result.stderr
    _, facts = vkbloom.read(tmp_path / out, metadata=True)
    assert facts["numbers"] == numbers


class TestJpeg:
    """What Pillow, another reader, finds in the files that ``apply`` writes."""

    @pytest.mark.parametrize("quality", [30, 95])
    def test_quality(self, tmp_path: Path, quality: int) -> None:
        image = pytest.importorskip("PIL.Image")
        path = store_png(tmp_path / "a.png", IMAGE)
        image.fromarray(IMAGE).save(tmp_path / "expected.jpg", quality=quality)
        assert run(path, tmp_path / "b.jpg", "--quality", quality).exit_code == 0
        with image.open(tmp_path / "b.jpg") as made, image.open(tmp_path / "expected.jpg") as same:
            # libjpeg derives the tables from the quality alone.
            assert made.quantization == same.quantization

    @pytest.mark.parametrize(("stored", "named"), [(0, "4:4:4"), (1, "4:2:2"), (2, "4:2:0")])
    def test_subsampling_is_kept(self, tmp_path: Path, stored: int, named: str) -> None:
        image = pytest.importorskip("PIL.Image")
        plugin = pytest.importorskip("PIL.JpegImagePlugin")
        image.fromarray(IMAGE).save(tmp_path / "a.jpg", subsampling=stored)
        assert run(tmp_path / "a.jpg", tmp_path / "b.jpg").exit_code == 0
        with image.open(tmp_path / "b.jpg") as made:
            assert plugin.get_sampling(made) == stored
        # Without an attribute, colours are not subsampled.
        store_png(tmp_path / "c.png", IMAGE)
        assert run(tmp_path / "c.png", tmp_path / "c.jpg").exit_code == 0
        with image.open(tmp_path / "c.jpg") as made:
            assert plugin.get_sampling(made) == 0, named

    @pytest.mark.parametrize("way", ["command", "python"])
    def test_exif_and_dpi_are_kept(self, tmp_path: Path, way: str) -> None:
        image = pytest.importorskip("PIL.Image")
        rational = pytest.importorskip("PIL.TiffImagePlugin").IFDRational
        picture = image.fromarray(IMAGE)
        exif = picture.getexif()
        maker, orientation, inner, taken, iso, seconds = 271, 274, 0x8769, 0x9003, 0x8827, 0x829A
        exif[maker], exif[orientation] = "Maker", 6
        exif.get_ifd(inner)[taken] = "2020:01:02 03:04:05"
        exif.get_ifd(inner)[iso] = 400
        exif.get_ifd(inner)[seconds] = rational(1, 2)
        source, target = tmp_path / "a.jpg", tmp_path / "b.jpg"
        picture.save(source, exif=exif, dpi=(240, 240))
        if way == "command":
            assert run(source, target, "--quality", 90).exit_code == 0
        else:
            pixels, facts = vkbloom.read(source, metadata=True)
            vkbloom.write(target, pixels, metadata=facts)
        with image.open(target) as made:
            assert made.info["dpi"] == (240, 240)
            # The pixels are rotated, so the orientation must be removed.
            assert made.size == picture.size[::-1]
            found = made.getexif()
            assert (found[maker], found.get(orientation, 1)) == ("Maker", 1)
            assert found.get_ifd(inner)[taken] == "2020:01:02 03:04:05"
            assert found.get_ifd(inner)[iso] == 400
            assert float(found.get_ifd(inner)[seconds]) == 0.5


def test_input_colour_is_a_space(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).random((4, 5, 3), dtype=np.float32)
    path = vkbloom.write(tmp_path / "a.exr", pixels)
    words = ("--input-colour", "ACEScg", "--no-bloom")
    assert run(path, tmp_path / "b.exr", *words).exit_code == 0
    made = vkbloom.read(tmp_path / "b.exr")
    # White stays white, and red goes outside of Rec. 709 (ACEScg's primaries, S-2014-004).
    assert np.allclose(made.sum() / pixels.sum(), 1, atol=0.1)
    assert not np.allclose(made, pixels, atol=0.01)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--method", "pyramid", "--threshold", "1"], "no value is above the threshold 1; "),
        (["--blur-strength", "0", "--method", "separable"], None),
        (["--no-bloom"], None),
        ([], None),
    ],
)
def test_no_bloom_is_noted(tmp_path: Path, words: list[str], said: str | None) -> None:
    path = store_png(tmp_path / "a.png", IMAGE)
    result = run(path, tmp_path / "b.png", *words)
    assert result.exit_code == 0
    if said is None:
        assert result.stderr == ""
    else:
        brightest = float(vkbloom.read(path).max())
        assert f"{said}the brightest value is {brightest:.3g}" in result.stderr
