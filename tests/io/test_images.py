"""Image files: what is read of them, and what is written back."""

from __future__ import annotations

import dataclasses
import errno
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests import images
from tests.framebuffers import names_in
from tests.framebuffers import write_image as store
from tests.io.parts import reread, write
from tests.srgb import decode_srgb, encode_srgb
from vkbloom._io import safe_writing
from vkbloom._io.decoding import decode
from vkbloom._io.displayed import Saved
from vkbloom._io.image_file import read_stored
from vkbloom._io.image_writing import save
from vkbloom._io.picture import Picture, Window

oiio = pytest.importorskip("OpenImageIO")

DTYPES = {"uint8": "uint8", "uint16": "uint16", "half": "float16", "float": "float32"}


def noise(*shape: int, numbers: str, seed: int = 3) -> NDArray[Any]:
    """Return values that each type holds; floats also under 0 and far above 1."""
    return images.noise(*shape, dtype=DTYPES[numbers], seed=seed, spread=20)


def linear_picture(pixels: NDArray[Any], numbers: str, **changes: Any) -> Picture:
    made = Picture.of_values(pixels, numbers)
    return dataclasses.replace(made, **{"encoding": "linear", **changes})


class TestCurve:
    # From the definition in IEC 61966-2-1, worked out with 30 digits.
    POINTS = (
        (0.0, 0.0),
        (0.04045, 0.0031308049535603713),
        (0.5, 0.21404114048223255),
        (0.735356983052449, 0.5),
        (1.0, 1.0),
    )

    @pytest.mark.parametrize(("encoded", "linear"), POINTS)
    def test_known_points(self, encoded: float, linear: float) -> None:
        # Of the two pieces, which do not quite meet, and of a standard of four digits.
        assert decode_srgb(np.array([encoded]))[0] == pytest.approx(linear, abs=2e-8)
        assert encode_srgb(np.array([linear]))[0] == pytest.approx(encoded, abs=2e-7)


class TestLoad:
    @pytest.mark.parametrize(
        ("name", "numbers", "channels"),
        [
            *((f"a.{suffix}", "uint8", 3) for suffix in ("png", "tif", "bmp", "tga", "ppm")),
            *((f"a.{suffix}", "uint8", 4) for suffix in ("png", "tif", "tga")),
            *((f"a.{suffix}", "uint8", 1) for suffix in ("png", "tif", "pgm")),
            *((f"a.{suffix}", "uint16", 4) for suffix in ("png", "tif")),
            *(("a.exr", numbers, 4) for numbers in ("half", "float")),
            ("a.exr", "float", 1),
            ("a.tif", "float", 3),
        ],
    )
    def test_values_are_those_stored(
        self, tmp_path: Path, name: str, numbers: str, channels: int
    ) -> None:
        pixels = noise(5, 7, channels, numbers=numbers)
        stored = read_stored(store(tmp_path / name, pixels, numbers))
        assert stored.pixels.dtype == pixels.dtype
        assert stored.pixels.flags.c_contiguous
        assert np.array_equal(stored.pixels, pixels)
        assert stored.header.numbers == (numbers,) * channels
        assert stored.header.display == (0, 0, 7, 5)

    def test_doubles_become_floats(self, tmp_path: Path) -> None:
        pixels = noise(2, 3, 3, numbers="float")
        stored = read_stored(store(tmp_path / "a.tif", pixels.astype(np.float64), "double"))
        assert stored.pixels.dtype == np.float32
        assert np.array_equal(stored.pixels, pixels)

    # (data window, display window) as x, y, width, height.
    @pytest.mark.parametrize(
        ("data", "display", "origin", "size"),
        [
            ((2, 1, 3, 2), (0, 0, 8, 6), (0, 0), (8, 6)),
            ((-2, -1, 12, 8), (0, 0, 8, 6), (-2, -1), (12, 8)),
            ((6, 4, 4, 4), (0, 0, 8, 6), (0, 0), (10, 8)),
            ((10, 20, 4, 3), (10, 20, 4, 3), (10, 20), (4, 3)),
            ((20, 0, 2, 2), (0, 0, 4, 4), (0, 0), (22, 4)),
        ],
    )
    def test_windows(
        self,
        tmp_path: Path,
        data: Window,
        display: Window,
        origin: tuple[int, int],
        size: tuple[int, int],
    ) -> None:
        x, y, width, height = data
        pixels = noise(height, width, 3, numbers="half")
        fields = dict(zip(("full_x", "full_y", "full_width", "full_height"), display, strict=True))
        stored = read_stored(store(tmp_path / "a.exr", pixels, "half", x=x, y=y, **fields))
        assert (stored.header.origin, stored.header.display) == (origin, display)
        assert stored.pixels.shape == (*size[::-1], 3)
        row, column = y - origin[1], x - origin[0]
        inside = stored.pixels[row : row + height, column : column + width]
        assert np.array_equal(inside, pixels)
        assert np.count_nonzero(stored.pixels) == np.count_nonzero(pixels)

    @pytest.mark.parametrize("content", [b"", b"hello\n", b"\x89PNG\r\n\x1a\n", bytes(300)])
    @pytest.mark.parametrize("suffix", ["png", "exr", "jpg", "unknown"])
    def test_file_that_is_not_an_image_is_refused(
        self, tmp_path: Path, content: bytes, suffix: str
    ) -> None:
        path = tmp_path / f"a.{suffix}"
        path.write_bytes(content)
        with pytest.raises(ValueError, match=f"a.{suffix}: "):
            read_stored(path)

    @pytest.mark.parametrize(
        "suffix", ["png", "jpg", "exr", "hdr", "tif", "bmp", "tga", "webp", "gif"]
    )
    def test_truncated_file_is_refused(self, tmp_path: Path, suffix: str) -> None:
        numbers = {"exr": "half", "hdr": "float"}.get(suffix, "uint8")
        pixels = np.abs(noise(60, 80, 3, numbers=numbers))
        path = store(tmp_path / f"a.{suffix}", pixels, numbers)
        read_stored(path)
        content = path.read_bytes()
        path.write_bytes(content[: len(content) * 2 // 3])
        with pytest.raises(ValueError, match=f"a.{suffix}: "):
            read_stored(path)

    def test_size_larger_than_the_file_allows_is_refused(self, tmp_path: Path) -> None:
        path = tmp_path / "a.exr"
        for width, height in ((100_000, 1), (20_000, 20_000)):
            fields = {"full_width": width, "full_height": height}
            store(path, noise(1, 2, 3, numbers="half"), "half", **fields)
            with pytest.raises(ValueError, match=f"a.exr: {width} x {height} is larger than"):
                read_stored(path)

    def test_numbers_of_other_types(self, tmp_path: Path) -> None:
        path = store(tmp_path / "a.tif", np.zeros((2, 2, 3), np.int16), "int16")
        with pytest.raises(ValueError, match=r"a\.tif: numbers of int16 are not supported"):
            read_stored(path)

    @pytest.mark.parametrize("folder", ["", "caf\udce9/"], ids=["file", "folder"])
    def test_names_that_are_not_utf8(self, tmp_path: Path, folder: str) -> None:
        path = store(tmp_path / "a.png", noise(2, 3, 3, numbers="uint8"), "uint8")
        other = tmp_path / f"{folder}b\udce9.png"
        other.parent.mkdir(exist_ok=True)
        other.write_bytes(path.read_bytes())
        for call in (lambda: read_stored(other), lambda: save(decode(read_stored(path)), other)):
            with pytest.raises(ValueError, match=r"b\\udce9\.png' is not UTF-8"):
                call()
        assert other.read_bytes() == path.read_bytes()

    def test_damage_with_an_undecodable_message_is_an_error(self, tmp_path: Path) -> None:
        path = store(tmp_path / "a.exr", noise(4, 4, 3, numbers="half"), "half")
        # OpenEXR's message holds the type of the attribute.
        content = path.read_bytes()
        assert content.count(b"compression\0compression\0") == 1
        path.write_bytes(
            content.replace(b"compression\0compression\0", b"compression\0c\xe9mpression\0")
        )
        with pytest.raises(ValueError, match=r"a\.exr: .*c\ufffdmpression"):
            read_stored(path)

    def test_deep_images(self, tmp_path: Path) -> None:
        path = tmp_path / "a.exr"
        spec = oiio.ImageSpec(2, 2, 1, "float")
        spec.channelnames = ("Z",)
        spec.deep = True
        writer = oiio.ImageOutput.create(str(path))
        assert writer.open(str(path), spec)
        deep = oiio.DeepData()
        deep.init(spec)
        assert writer.write_deep_image(deep)
        assert writer.close()
        with pytest.raises(ValueError, match=r"a\.exr: a deep image or a volume is not supported"):
            read_stored(path)

    def test_openimageio_missing(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "OpenImageIO", None)
        with pytest.raises(ModuleNotFoundError, match=r"pip install vkbloom\[images\]"):
            read_stored("a.png")


class TestDecode:
    def test_integers_that_the_file_calls_linear(self, tmp_path: Path) -> None:
        pixels = noise(4, 6, 3, numbers="uint8")
        linear = {"oiio__ColorSpace": "lin_rec709_scene"}
        stored = read_stored(store(tmp_path / "a.png", pixels, "uint8", **linear))
        assert np.allclose(decode(stored).pixels, pixels / 255, rtol=1e-6, atol=0)
        forced = decode(stored, "srgb").pixels
        assert np.allclose(forced, decode_srgb(pixels / 255), rtol=1e-6, atol=0)

    def test_other_colour_spaces_are_noted(self, tmp_path: Path) -> None:
        space = {"oiio__ColorSpace": "g22_rec709_scene"}
        path = store(tmp_path / "a.png", noise(4, 6, 3, numbers="uint8"), "uint8", **space)
        (note,) = decode(read_stored(path)).notes
        assert note == "the file says g22_rec709_scene of its colours; converted to linear Rec. 709"

    @pytest.mark.parametrize("numbers", ["half", "float"])
    def test_floats_can_be_srgb(self, tmp_path: Path, numbers: str) -> None:
        pixels = np.abs(noise(4, 6, 4, numbers=numbers))
        made = decode(read_stored(store(tmp_path / "a.exr", pixels, numbers)), "srgb")
        expected = decode_srgb(pixels[:, :, :3].astype(np.float64))
        step = np.finfo(pixels.dtype).eps
        assert made.pixels.dtype == pixels.dtype
        # The power multiplies the rounding of its argument by 2.4, and adds its own.
        assert np.allclose(made.pixels[:, :, :3], expected, rtol=8 * step, atol=1e-7)
        assert np.array_equal(made.pixels[:, :, 3], pixels[:, :, 3])

    @pytest.mark.parametrize("names", [("Y",), ("Z",), ("Y", "A"), ("left.Y", "left.A")])
    def test_grey_becomes_rgb(self, tmp_path: Path, names: tuple[str, ...]) -> None:
        pixels = noise(3, 4, len(names), numbers="half")
        made = decode(read_stored(store(tmp_path / "a.exr", pixels, "half", channelnames=names)))
        assert made.grey
        assert made.pixels.shape == (3, 4, 2 + len(names))
        assert made.pixels.flags.c_contiguous
        for channel in range(3):
            assert np.array_equal(made.pixels[:, :, channel], pixels[:, :, 0])
        assert np.array_equal(made.values, pixels)

    def test_channels_by_name(self, tmp_path: Path) -> None:
        # As OpenEXR sorts them: A, B, G, R, Z, light.R. Half stays half beside the floats.
        names = ("A", "B", "G", "R", "Z", "light.R")
        pixels = noise(3, 4, 6, numbers="half")
        kinds = tuple(oiio.TypeDesc(kind) for kind in ("half",) * 4 + ("float",) * 2)
        fields = {"channelnames": names, "channelformats": kinds, "alpha_channel": 0}
        made = decode(
            read_stored(store(tmp_path / "a.exr", pixels.astype(np.float32), "float", **fields))
        )
        assert made.pixels.dtype == np.float16
        assert np.array_equal(made.pixels, pixels[:, :, [3, 2, 1, 0]])
        (note,) = made.notes
        assert set(note.removeprefix("left out the channels ").split(", ")) == {"Z", "light.R"}

    @pytest.mark.parametrize("names", [("X", "Y", "Z"), ("U", "V"), ("R", "G")])
    def test_other_channels_are_refused(self, tmp_path: Path, names: tuple[str, ...]) -> None:
        pixels = noise(3, 4, len(names), numbers="half")
        path = store(tmp_path / "a.exr", pixels, "half", channelnames=names)
        with pytest.raises(ValueError, match=f"the channels {', '.join(names)} are not R, G, B"):
            decode(read_stored(path))


class TestSave:
    # The numbers that a picture came with, a file, and the numbers and channels in it.
    @pytest.mark.parametrize(
        ("numbers", "name", "stored_as", "channels"),
        [
            ("half", "b.tif", "float", 4),
            ("half", "b.png", "uint8", 4),
            ("half", "b.hdr", "float", 3),
            ("half", "b.jpg", "uint8", 3),
            ("float", "b.png", "uint8", 4),
            ("float", "b.tga", "uint8", 4),
            ("float", "b.pfm", "float", 3),
            ("float", "b.jp2", "uint8", 4),
            ("uint16", "b.exr", "float", 4),
            ("uint16", "b.jpg", "uint8", 3),
            ("uint16", "b.tif", "uint16", 4),
            ("uint8", "b.exr", "float", 4),
            ("uint8", "b.hdr", "float", 3),
            ("uint8", "b.tif", "uint8", 4),
        ],
    )
    def test_numbers_follow_the_file_read_and_the_format(
        self, tmp_path: Path, numbers: str, name: str, stored_as: str, channels: int
    ) -> None:
        dtype = np.float16 if numbers == "half" else np.float32
        # Large enough for formats that halve a picture five times.
        pixels = np.random.default_rng(0).random((64, 64, 4)).astype(dtype)
        pixels[:, :, 3] = 1
        assert save(linear_picture(pixels, numbers), tmp_path / name) == ()
        spec, written = reread(tmp_path / name)
        assert (str(spec.format), spec.nchannels) == (stored_as, channels)
        if stored_as.startswith("uint"):
            assert abs(written[..., :3].mean() / np.iinfo(stored_as).max - 0.68) < 0.02
        else:
            assert abs(written[..., :3].mean() - 0.5) < 0.02

    @pytest.mark.parametrize("encoding", ["srgb", "gamma22", None])
    def test_encoded_values_are_left_alone(self, tmp_path: Path, encoding: Any) -> None:
        pixels = np.full((4, 4, 3), 0.5, np.float32)
        made = linear_picture(pixels, "uint8", encoding=encoding)
        save(made, tmp_path / "b.png")
        save(made, tmp_path / "b.exr")
        assert (reread(tmp_path / "b.png")[1] == 128).all()
        assert (reread(tmp_path / "b.exr")[1] == 0.5).all()
        with pytest.raises(
            ValueError, match=f"colour: 'srgb' needs a linear picture; this one is {encoding}"
        ):
            save(made, tmp_path / "b.png", Saved("srgb"))

    def test_integers_clip(self, tmp_path: Path) -> None:
        row = np.array([-5, -0.0, 1, 1.001, 1e30, np.nan, np.inf, -np.inf], np.float32)
        pixels = np.repeat(row[None, :, None], 3, axis=2)
        note, clipped = save(linear_picture(pixels, "float"), tmp_path / "b.png")
        assert note.endswith("b.png has integers: NaN is written as 0, infinity as 1")
        assert "--tonemap" in clipped
        levels = reread(tmp_path / "b.png")[1][0, :, 0].tolist()
        assert levels == [0, 0, 255, 255, 255, 0, 255, 0]

    @pytest.mark.parametrize(
        ("numbers", "name", "channels"),
        [("uint8", "b.png", 1), ("half", "b.exr", 1), ("uint8", "b.jpg", 1), ("float", "b.hdr", 3)],
    )
    def test_grey_stays_where_it_can(
        self, tmp_path: Path, numbers: str, name: str, channels: int
    ) -> None:
        dtype = np.float16 if numbers == "half" else np.float32
        pixels = np.full((8, 8, 3), 0.5, dtype)
        assert save(linear_picture(pixels, numbers, grey=True), tmp_path / name) == ()
        spec, _ = reread(tmp_path / name)
        assert spec.nchannels == channels
        if channels == 1:
            assert spec.channelnames == ("Y",)

    def test_lost_alpha_is_noted(self, tmp_path: Path) -> None:
        pixels = np.full((8, 8, 4), 0.5, np.float32)
        for name in ("b.jpg", "b.hdr"):
            (note,) = save(linear_picture(pixels, "float"), tmp_path / name)
            assert note.endswith(f"{name} cannot hold alpha, which is not 1 everywhere")
        pixels[:, :, 3] = 1
        assert save(linear_picture(pixels, "float"), tmp_path / "b.hdr") == ()

    def test_alpha_that_is_read_otherwise_is_noted(self, tmp_path: Path) -> None:
        pixels = np.full((4, 4, 4), 0.5, np.float16)
        plain = decode(
            read_stored(store(tmp_path / "a.png", (pixels * 255).astype("uint8"), "uint8"))
        )
        multiplied = decode(read_stored(store(tmp_path / "a.exr", pixels, "half")))
        (note,) = save(plain, tmp_path / "b.exr")
        assert note.endswith("its readers expect colours multiplied by alpha")
        assert save(plain, tmp_path / "b.tif") == save(plain, tmp_path / "b.png") == ()
        assert not read_stored(tmp_path / "b.tif").is_multiplied
        assert save(multiplied, tmp_path / "b.exr") == save(multiplied, tmp_path / "b.tif") == ()
        assert read_stored(tmp_path / "b.tif").is_multiplied
        assert np.array_equal(read_stored(tmp_path / "b.tif").pixels, pixels)

    @pytest.mark.parametrize("name", ["b.exr", "b.png"])
    def test_windows(self, tmp_path: Path, name: str) -> None:
        pixels = np.random.default_rng(0).random((6, 8, 3)).astype(np.float16)
        window = {"full_x": 12, "full_y": 21, "full_width": 4, "full_height": 3}
        path = store(tmp_path / "a.exr", pixels, "half", x=10, y=20, **window)
        save(decode(read_stored(path)), tmp_path / name)
        spec, written = reread(tmp_path / name)
        if name == "b.exr":
            assert (spec.x, spec.y) == (10, 20)
            assert {field: getattr(spec, field) for field in window} == window
            assert np.array_equal(written, pixels)
        else:
            assert written.shape == (3, 4, 3)
            inside = encode_srgb(pixels[1:4, 2:6].astype(np.float32)) * 255
            assert np.abs(written - inside).max() <= 0.501

    def test_colour_attributes_are_kept(self, tmp_path: Path) -> None:
        chromaticities = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.322, 0.338)
        spec = oiio.ImageSpec(2, 2, 3, "half")
        spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), chromaticities)
        spec.attribute("PixelAspectRatio", 2.0)
        write(tmp_path / "a.exr", spec, noise(2, 2, 3, numbers="half"))
        save(decode(read_stored(tmp_path / "a.exr")), tmp_path / "b.exr")
        kept, _ = reread(tmp_path / "b.exr")
        assert np.allclose(kept["chromaticities"], chromaticities)
        assert kept["PixelAspectRatio"] == 2.0

    @pytest.mark.parametrize(
        ("read_as", "written_as", "is_kept"),
        [(None, None, True), ("linear", None, False), (None, "linear", False)],
    )
    def test_profiles_of_encoded_colours_are_kept(
        self, tmp_path: Path, read_as: Any, written_as: Any, is_kept: bool
    ) -> None:
        # Any JPEG XL has one.
        store(tmp_path / "a.jxl", noise(64, 64, 3, numbers="uint8"), "uint8")
        save(
            decode(read_stored(tmp_path / "a.jxl"), read_as), tmp_path / "b.png", Saved(written_as)
        )
        kept, _ = reread(tmp_path / "b.png")
        original, _ = reread(tmp_path / "a.jxl")
        profile = kept.getattribute("ICCProfile")
        assert (profile is not None) is is_kept
        if is_kept:
            assert np.array_equal(profile, original.getattribute("ICCProfile"))

    @pytest.mark.parametrize(
        ("space", "channels", "is_kept"),
        [(b"RGB ", 3, True), (b"GRAY", 1, True), (b"CMYK", 3, False), (b"GRAY", 3, False)],
    )
    def test_a_profile_of_other_channels_is_not_kept(
        self, space: bytes, channels: int, is_kept: bool
    ) -> None:
        """OpenImageIO reads CMYK as RGB, and gives its profile, which other programs refuse."""
        content = (bytes(16) + space + b"Lab ").ljust(128, b"\0")
        kind = (oiio.TypeDesc("uint8[128]"), np.frombuffer(content, np.uint8))
        stored = Picture.of_values(
            noise(2, 2, channels, numbers="uint8"), attributes={"ICCProfile": kind}
        )
        colours = stored.header.colours._replace(profile=content)
        names = ("Y",) if channels == 1 else ("R", "G", "B")
        header = dataclasses.replace(stored.header, colours=colours, channels=names)
        made = decode(dataclasses.replace(stored, header=header))
        assert ("ICCProfile" in made.header.attributes) is is_kept

    @pytest.mark.parametrize("name", ["b.png", "b.exr"])
    def test_old_file_stays_until_the_new_one_is_complete(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
    ) -> None:
        target = tmp_path / name
        target.write_bytes(b"before")
        seen: list[Iterable[str]] = []

        def unreadable(oiio: Any, file: Path) -> str:
            seen.append(names_in(tmp_path))
            assert read_stored(file).pixels.shape == (2, 2, 3)
            assert target.read_bytes() == b"before"
            return f"{file}: no pixels"

        monkeypatch.setattr(safe_writing, "_unreadable", unreadable)
        with pytest.raises(OSError, match=rf"cannot be read after writing: {name}: no") as caught:
            save(linear_picture(np.ones((2, 2, 3), np.float32), "uint8"), target)
        assert (caught.value.errno, caught.value.filename) == (errno.EIO, str(target))
        assert len(seen) == 1
        assert target.read_bytes() == b"before"
        assert names_in(tmp_path) == [name]

    def test_readers_keep_what_they_opened(self, tmp_path: Path) -> None:
        # A file that is renamed into place leaves the old one to those who are reading it.
        target = tmp_path / "b.png"
        target.write_bytes(b"before")
        with target.open("rb") as opened:
            save(linear_picture(np.ones((2, 2, 3), np.float32), "uint8"), target)
            assert opened.read() == b"before"
        assert read_stored(target).pixels.shape == (2, 2, 3)
