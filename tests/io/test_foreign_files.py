"""Files of other programs: orientation, colours, damage."""

from __future__ import annotations

import io
import os
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.io import foreign
from tests.io.parts import store_ultra_hdr, write
from tests.io.profiles import (
    DISPLAY_P3,
    REC_709,
    png_chunk,
    profile,
    profile_chunk,
    store_png,
    to_xyz,
)
from tests.srgb import decode_srgb, encode_srgb
from vkbloom._io.formats.tiff import is_raw, reduced_parts
from vkbloom._io.image_file import ImageFile

oiio = pytest.importorskip("OpenImageIO")
image = pytest.importorskip("PIL.Image")
ops = pytest.importorskip("PIL.ImageOps")
tifffile = pytest.importorskip("tifffile")

RNG = np.random.default_rng(3)
PIXELS = np.kron(RNG.integers(0, 256, (2, 3, 3), dtype=np.uint8), np.ones((16, 16, 1), np.uint8))
REC_2020 = ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046))
# To linear Rec. 709.
MATRICES = {
    9: np.linalg.inv(to_xyz(REC_709)) @ to_xyz(REC_2020),
    12: np.linalg.inv(to_xyz(REC_709)) @ to_xyz(DISPLAY_P3),
}


def turn(orientation: int) -> NDArray[Any]:
    """Return the pixels that Pillow shows of PIXELS with an orientation."""
    picture = image.fromarray(PIXELS)
    picture.getexif()[274] = orientation
    return np.asarray(ops.exif_transpose(picture))


def store_exif(path: Path, orientation: int) -> None:
    exif = image.Exif()
    exif[274] = orientation
    more = {"lossless": True} if path.suffix == ".webp" else {}
    image.fromarray(PIXELS).save(path, exif=exif, **more)


def store_late_exif(path: Path, orientation: int) -> None:
    entry = struct.pack(">HHHIHHI", 1, 274, 3, 1, orientation, 0, 0)
    chunk = png_chunk(b"eXIf", b"MM\0*\0\0\0\x08" + entry)
    content = store_png(path, PIXELS).read_bytes()
    path.write_bytes(content[:-12] + chunk + content[-12:])


def store_dpx(path: Path, orientation: int) -> None:
    vkbloom.write(path, PIXELS)
    content = bytearray(path.read_bytes())
    # SMPTE ST 268, field 20: the direction of pixels, then that of lines.
    code = {1: 0, 2: 1, 3: 3, 4: 2, 5: 4, 6: 5, 7: 7, 8: 6}[orientation]
    content[768:770] = struct.pack(">H" if content[:4] == b"SDPX" else "<H", code)
    path.write_bytes(content)


def store_xmp(path: Path, orientation: int) -> None:
    packet = foreign.xmp(orientation, is_element=orientation % 2 == 0)
    picture = image.fromarray(PIXELS)
    match path.suffix:
        case ".png":
            content = b"XML:com.adobe.xmp\0\0\0\0\0" + packet.encode()
            store_png(path, PIXELS, png_chunk(b"iTXt", content))
        case ".tif":
            picture.save(path, tiffinfo={700: packet.encode()})
        case ".webp":
            picture.save(path, xmp=packet.encode(), lossless=True)
        case _:
            picture.save(path, xmp=packet.encode(), quality=95, subsampling=0)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize(
    ("name", "store"),
    [
        *((f"exif.{suffix}", store_exif) for suffix in ("jpg", "png", "tif", "webp")),
        ("late.png", store_late_exif),
        ("a.dpx", store_dpx),
        *((f"xmp.{suffix}", store_xmp) for suffix in ("jpg", "png", "tif", "webp")),
    ],
)
def test_orientation(tmp_path: Path, name: str, store: Any, orientation: int) -> None:
    path = tmp_path / name
    store(path, orientation)
    if name == "a.dpx" and orientation > 4:
        with pytest.raises(ValueError, match=r"a\.dpx: lines along the columns"):
            vkbloom.read(path)
        return
    made = vkbloom.read(path)
    off = np.abs(encode_srgb(made) * 255 - turn(orientation))
    assert (np.median(off) if name.endswith("jpg") else off.max()) < (3 if "jpg" in name else 0.01)


@pytest.mark.parametrize(
    "exif",
    [
        b"",
        b"no Exif",
        b"II+\0\x08\0\0\0" + b"\xff" * 8,
        b"II*\0\xff\xff\xff\xff",
        b"MM\0*\0\0\0\x08\0\1\1\x12\0\3\xff\xff\xff\xff\0\6\0\0",
    ],
)
def test_damaged_exif_after_the_pixels(tmp_path: Path, exif: bytes) -> None:
    content = store_png(tmp_path / "a.png", PIXELS).read_bytes()
    plain = vkbloom.read(tmp_path / "a.png")
    (tmp_path / "a.png").write_bytes(content[:-12] + png_chunk(b"eXIf", exif) + content[-12:])
    assert np.array_equal(vkbloom.read(tmp_path / "a.png"), plain)


def test_orientation_of_exif_goes_before_xmp(tmp_path: Path) -> None:
    exif = image.Exif()
    exif[274] = 3
    path = tmp_path / "a.jpg"
    image.fromarray(PIXELS).save(path, exif=exif, xmp=foreign.xmp(6).encode())
    assert vkbloom.read(path).shape == PIXELS.shape


@pytest.mark.parametrize("axes", ["-Y+X", "-Y-X", "+Y-X", "+Y+X", "+X-Y", "-X-Y", "-X+Y", "+X+Y"])
def test_orientation_of_radiance(tmp_path: Path, axes: str) -> None:
    # Mantissas of the exponent 128, for 1.
    upright = np.concatenate([PIXELS | 128, np.full((*PIXELS.shape[:2], 1), 129, np.uint8)], -1)
    foreign.radiance(tmp_path / "a.hdr", upright, axes)
    made = vkbloom.read(tmp_path / "a.hdr")
    assert np.allclose(made, upright[..., :3] / 128, atol=0.5 / 128)


@pytest.mark.parametrize("primaries", [1, 9, 12])
@pytest.mark.parametrize("curve", [1, 6, 13, 14, 15])
@pytest.mark.parametrize("is_narrow", [False, True])
def test_code_points_of_sdr(tmp_path: Path, primaries: int, curve: int, is_narrow: bool) -> None:
    chunk = png_chunk(b"cICP", bytes([primaries, curve, 0, not is_narrow]))
    # They have precedence over a profile.
    chunk += profile_chunk(profile("Linear", REC_709, 1.0))
    made, facts = vkbloom.read(store_png(tmp_path / "a.png", PIXELS, chunk), metadata=True)
    signal = np.clip((PIXELS - 16.0) / 219, 0, 1) if is_narrow else PIXELS / 255
    light = decode_srgb(signal)
    if curve != 13:
        # Rec. ITU-R BT.709-6, item 1.2.
        light = np.where(signal < 0.081, signal / 4.5, ((signal + 0.099) / 1.099) ** (1 / 0.45))
    if primaries in MATRICES:
        light = light @ MATRICES[primaries].T
    assert np.allclose(made, light, rtol=1e-3, atol=3e-4)
    assert bool(facts["notes"]) is not (primaries == 1 and curve == 13)


@pytest.mark.parametrize("points", [(2, 2, 0, 1), (99, 13, 0, 1), (1, 99, 0, 1), (2, 13, 0, 1)])
def test_unknown_code_points_hide_nothing(tmp_path: Path, points: tuple[int, ...]) -> None:
    chunk = png_chunk(b"cICP", bytes(points))
    p3 = profile_chunk(profile("Display P3", DISPLAY_P3))
    gamma = png_chunk(b"gAMA", struct.pack(">I", 50000))
    for more in (p3, gamma, b""):
        plain = vkbloom.read(store_png(tmp_path / "a.png", PIXELS, more))
        path = store_png(tmp_path / "b.png", PIXELS, chunk + more)
        made, facts = vkbloom.read(path, metadata=True)
        assert np.array_equal(made, plain)
        is_told = any("code points" in note for note in facts["notes"])
        assert is_told is (points[1] != 2)


def test_ultra_hdr(tmp_path: Path) -> None:
    light = np.full((64, 64, 3), (0.6, 0.1, 0.05), np.float16)
    light[:16] = 3
    store_ultra_hdr(tmp_path / "a.jpg", light)
    made, facts = vkbloom.read(tmp_path / "a.jpg", metadata=True)
    assert made.dtype == np.float16
    assert facts["alpha"] is None
    expected = light.astype(float) @ MATRICES[12].T
    assert np.allclose(made[[4, 50], 5], expected[[4, 50], 5], rtol=0.03, atol=0.005)
    assert facts["notes"][0].startswith("converted to linear Rec. 709 from the primaries of its")


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
@pytest.mark.parametrize("photometric", ["cielab", "icclab"])
def test_lab(tmp_path: Path, photometric: str, dtype: str) -> None:
    bits = 8 if dtype == "uint8" else 16
    largest, step = (1 << bits) - 1, 1 << (bits - 8)
    light = np.array([100, 75, 50, 25, 5, 50, 50]) / 100
    ab = np.zeros((7, 2), int)
    ab[5:] = ((40, 30), (-30, -60))
    if photometric == "cielab":
        values = np.column_stack([light * largest, ab * step % (1 << bits)])
    else:
        values = np.column_stack([light * 255 * step, (ab + 128) * step])
    pixels = np.rint(values).astype(dtype)[None].repeat(3, 0)
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, pixels, photometric=photometric)
    made, facts = vkbloom.read(path, metadata=True)
    assert facts["colour"] == photometric.upper()
    # CIE 15:2018: luminance of greys; a step of 8 bits of lightness.
    grey = np.where(light > 0.08, ((light * 100 + 16) / 116) ** 3, light * 100 / 903.3)
    assert np.allclose(made[0, :5], np.repeat(grey[:5, None], 3, 1), rtol=0.03, atol=2e-3)
    # Orange and blue: signs of a* and b*.
    assert made[0, 5, 0] > 1.5 * made[0, 5, 2]
    assert made[0, 6, 2] > 1.5 * made[0, 6, 0]


# Primaries

ADOBE_RGB = ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06))
GREEN = np.full((16, 16, 3), (0, 200, 0), np.uint8)
# The Exif of a camera's file, what it means: primaries, and a curve's exponent if it is not sRGB's.
EXIFS: dict[str, tuple[dict[int, Any], Any, float | None]] = {
    "R03": ({40961: 65535, 40965: {1: "R03", 2: b"0100"}}, ADOBE_RGB, 563 / 256),
    "2": ({40961: 2}, ADOBE_RGB, 563 / 256),
    "R98": ({40961: 65535, 40965: {1: "R98"}}, REC_709, None),
    "sRGB": ({40961: 1, 42240: 2.2, 318: ADOBE_RGB}, REC_709, None),
    "primaries": ({40961: 65535, 318: DISPLAY_P3}, DISPLAY_P3, None),
    "primaries, gamma": ({42240: 1.8, 318: DISPLAY_P3}, DISPLAY_P3, 1.8),
    "primaries of sRGB": ({318: REC_709}, REC_709, None),
    "no primaries": ({318: ((0, 0), (0, 0), (0, 0))}, REC_709, None),
    "nothing": ({}, REC_709, None),
}


def exif_of(tags: dict[int, Any]) -> Any:
    exif = image.Exif()
    # Without one of its own fields, Pillow leaves out the others.
    exif[305] = "camera"
    for tag, value in tags.items():
        if tag == 318:
            exif[319] = tuple(number for pair in value for number in pair)
            exif[318] = (0.3127, 0.3290)
        else:
            exif.get_ifd(34665)[tag] = value
    return exif


def light_of(codes: NDArray[Any], primaries: Any, gamma: float | None) -> NDArray[Any]:
    light = decode_srgb(codes / 255) if gamma is None else (codes / 255) ** gamma
    return np.asarray(light @ (np.linalg.inv(to_xyz(REC_709)) @ to_xyz(primaries)).T)


@pytest.mark.parametrize("name", EXIFS)
@pytest.mark.parametrize("suffix", ["jpg", "png", "webp"])
def test_colours_of_exif(tmp_path: Path, suffix: str, name: str) -> None:
    tags, primaries, gamma = EXIFS[name]
    path = tmp_path / f"a.{suffix}"
    more = {"quality": 100, "subsampling": 0} if suffix == "jpg" else {"lossless": True}
    image.fromarray(GREEN).save(path, exif=exif_of(tags), **more)
    made, facts = vkbloom.read(path, metadata=True)
    assert np.allclose(made, light_of(GREEN, primaries, gamma), atol=2e-4)
    assert (facts["notes"] == ()) is (primaries == REC_709)
    assert "Exif:Gamma" not in facts
    assert (facts["colour"] == "Adobe RGB") is (primaries == ADOBE_RGB)


def test_a_profile_goes_before_exif(tmp_path: Path) -> None:
    p3 = profile("Display P3", DISPLAY_P3)
    exif = exif_of(EXIFS["R03"][0])
    image.fromarray(GREEN).save(tmp_path / "a.png", exif=exif, icc_profile=p3)
    assert vkbloom.read(tmp_path / "a.png", metadata=True)[1]["colour"] == "Display P3"


@pytest.mark.parametrize("kind", ["exif", "fields"])
@pytest.mark.parametrize("byte_order", ["<", ">"])
def test_colours_of_tiff(tmp_path: Path, kind: str, byte_order: Any) -> None:
    path = tmp_path / "a.tif"
    numbers = [round(1000 * number) for pair in DISPLAY_P3 for number in pair]
    fields = [(319, 5, 6, [part for number in numbers for part in (number, 1000)], True)]
    # tifffile writes no directory of Exif: another field becomes its pointer.
    tags = fields if kind == "fields" else [(60000, 4, 1, 77, True)]
    tifffile.imwrite(path, GREEN, photometric="rgb", byteorder=byte_order, extratags=tags)
    if kind == "exif":
        content = path.read_bytes()
        start, form = len(content), byte_order
        index = struct.pack(f"{form}HHHI4s", 1, 1, 2, 4, b"R03\0")
        exif = struct.pack(f"{form}HHHIHH", 2, 40961, 3, 1, 65535, 0)
        exif += struct.pack(f"{form}HHII", 40965, 4, 1, start + 30) + bytes(4)
        entry = struct.pack(f"{form}HHII", 60000, 4, 1, 77)
        content = content.replace(entry, struct.pack(f"{form}HHII", 34665, 4, 1, start))
        path.write_bytes(content + exif + index + bytes(4))
    expected = light_of(GREEN, *((DISPLAY_P3, None) if kind == "fields" else EXIFS["R03"][1:]))
    assert np.allclose(vkbloom.read(path), expected, atol=3e-3)


@pytest.mark.parametrize("is_srgb", [False, True])
@pytest.mark.parametrize("primaries", [DISPLAY_P3, REC_709, ((0, 0), (0, 0), (0, 0))])
def test_primaries_of_png(tmp_path: Path, primaries: Any, is_srgb: bool) -> None:
    numbers = [0.3127, 0.3290, *(number for pair in primaries for number in pair)]
    chunks = png_chunk(b"cHRM", struct.pack(">8I", *(round(1e5 * number) for number in numbers)))
    chunks += png_chunk(b"gAMA", struct.pack(">I", 50000))
    chunks += png_chunk(b"sRGB", b"\0") if is_srgb else b""
    made = vkbloom.read(store_png(tmp_path / "a.png", GREEN, chunks))
    meant = (REC_709, None) if is_srgb else (primaries if primaries[0][0] else REC_709, 2.0)
    assert np.allclose(made, light_of(GREEN, *meant), atol=2e-4)


@pytest.mark.parametrize(
    ("line", "is_converted", "note"),
    [
        ("PRIMARIES= .680 .320 .265 .690 .150 .060 .3127 .3290", True, "converted to linear"),
        ("PRIMARIES= .640 .330 .300 .600 .150 .060 .3127 .3290", False, None),
        ("PRIMARIES= nan 0 x", False, None),
        ("PRIMARIES= 0 0 0 0 0 0 0 0", False, None),
        ("EXPOSURE=2.5", False, "says EXPOSURE=2.5 of its values, which are taken as they are"),
        ("COLORCORR= 1 1.5 1", False, "says COLORCORR=1 1.5 1 of its values"),
        ("EXPOSURE=1", False, None),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_lines_of_radiance(
    tmp_path: Path, line: str, is_converted: bool, note: str | None, end: str
) -> None:
    pixels = np.full((16, 16, 4), (20, 200, 40, 129), np.uint8)
    foreign.radiance(tmp_path / "a.hdr", pixels, "-Y+X", line + end)
    made, facts = vkbloom.read(tmp_path / "a.hdr", metadata=True)
    light = pixels[..., :3] / 128
    assert np.allclose(made, light @ MATRICES[12].T if is_converted else light, atol=1e-4)
    assert [note is not None and note in one for one in facts["notes"]] == [True] * bool(note)


# Raw and reduced pictures

LARGE, SMALL = (np.full((*size, 3), 90, np.uint8) for size in ((64, 96), (16, 24)))
DNG = [(50706, 1, 4, b"\1\4\0\0", True)]
# How a TIFF file's directories are written: the pixels, what they are, and more of tifffile's
# options; whether the second one is a directory of the first one.
RAWS: dict[str, tuple[list[tuple[NDArray[Any], int, dict[str, Any]]], bool]] = {
    "mosaic": ([(LARGE[..., 0], 32803, {})], False),
    "linear": ([(LARGE, 34892, {})], False),
    "preview, mosaic": ([(SMALL, 2, {"subfiletype": 1}), (LARGE[..., 0], 32803, {})], True),
    "preview, linear": ([(SMALL, 2, {}), (LARGE, 34892, {})], True),
    "preview, next": ([(SMALL, 2, {}), (LARGE[..., 0], 32803, {})], False),
    "version": ([(SMALL, 2, {"extratags": DNG})], False),
}
# How other raw files begin.
HEADS = {
    "cr2": b"II*\0\x10\0\0\0CR\x02\0",
    "cr3": b"\0\0\0\x18ftypcrx ",
    "orf": b"IIRO\x08\0\0\0",
    "raf": b"FUJIFILMCCD-RAW 0201",
    "rw2": b"IIU\0\x18\0\0\0",
}


@pytest.mark.parametrize("name", [*RAWS, *HEADS])
@pytest.mark.parametrize("is_big", [False, True])
def test_raw_files_are_refused(tmp_path: Path, name: str, is_big: bool) -> None:
    path = tmp_path / (f"a.{name}" if name in HEADS else "a.dng")
    if name in HEADS:
        path.write_bytes(HEADS[name] + bytes(200))
    else:
        directories, is_below = RAWS[name]
        with tifffile.TiffWriter(path, bigtiff=is_big, byteorder=">" if is_big else "<") as file:
            for index, (pixels, photometric, more) in enumerate(directories):
                below = {"subifds": 1} if is_below and not index else {}
                file.write(pixels, photometric=photometric, **more, **below)
    with pytest.raises(ValueError, match=r"is a camera's raw file; develop it first, .*darktable"):
        vkbloom.read(path)


@pytest.mark.parametrize(
    ("reduced", "is_below", "shape", "note"),
    [
        ((1, 0), False, (64, 96, 3), "part 0 is a reduced picture, as the file says; read part 1"),
        ((1, 0), True, (16, 24, 3), "the picture is a reduced one, as the file says"),
        ((1, 1), False, (16, 24, 3), "the picture is a reduced one, as the file says"),
        ((0, 1), True, (16, 24, 3), None),
        ((0, 0), False, (16, 24, 3), None),
    ],
)
def test_reduced_pictures(
    tmp_path: Path,
    reduced: tuple[int, int],
    is_below: bool,
    shape: tuple[int, ...],
    note: str | None,
) -> None:
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        below = {"subifds": 1} if is_below else {}
        file.write(SMALL, photometric="rgb", subfiletype=reduced[0], **below)
        file.write(LARGE, photometric="rgb", subfiletype=reduced[1])
    made, facts = vkbloom.read(tmp_path / "a.tif", metadata=True)
    assert made.shape == shape
    assert [note is not None and note in one for one in facts["notes"]] == [True] * bool(note)
    if not is_below:
        assert vkbloom.read(tmp_path / "a.tif", subimage=1).shape == (64, 96, 3)


def test_directories_in_a_circle(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, SMALL, photometric="rgb", extratags=[(330, 4, 1, 8, True)])
    content = bytearray(path.read_bytes())
    (start,) = struct.unpack_from("<I", content, 4)
    (count,) = struct.unpack_from("<H", content, start)
    struct.pack_into("<I", content, start + 2 + 12 * count, start)
    path.write_bytes(content)
    assert not is_raw(path)
    assert len(reduced_parts(path)) <= 100


@pytest.mark.parametrize("is_progressive", [False, True])
def test_jpeg_with_more_bytes(tmp_path: Path, is_progressive: bool) -> None:
    stream = io.BytesIO()
    image.fromarray(PIXELS).save(stream, "JPEG", quality=90, progressive=is_progressive)
    plain = stream.getvalue()
    (tmp_path / "a.jpg").write_bytes(plain)
    (tmp_path / "b.jpg").write_bytes(plain[:-2] + b"SEFT" * 4 + plain[-2:])
    (tmp_path / "cut.jpg").write_bytes(plain[: len(plain) // 2])
    made, facts = vkbloom.read(tmp_path / "b.jpg", metadata=True)
    assert np.array_equal(made, vkbloom.read(tmp_path / "a.jpg"))
    if is_progressive:
        assert "bytes of the file belong to no pixel" in facts["notes"][0]
    with pytest.raises(ValueError, match=r"cut\.jpg: (damaged|is not a readable image): JPEG"):
        vkbloom.read(tmp_path / "cut.jpg")


@pytest.mark.parametrize("brand", [b"avif", b"heic", b"mif1"])
def test_heif_is_told(tmp_path: Path, brand: bytes) -> None:
    (tmp_path / "a.avif").write_bytes(b"\0\0\0\x18ftyp" + brand + bytes(12))
    with pytest.raises(
        ValueError, match=r"a\.avif: .* without libheif, .*; convert the file to PNG"
    ):
        vkbloom.read(tmp_path / "a.avif")


def test_a_file_without_pixels(tmp_path: Path) -> None:
    cards = [
        "SIMPLE  =                    T",
        "BITPIX  =                    8",
        f"NAXIS   = {0:20}",
    ]
    head = "".join(card.ljust(80) for card in (*cards, "END")).ljust(2880)
    (tmp_path / "a.fits").write_bytes(head.encode() + bytes(2880))
    with pytest.raises(ValueError, match=r"a\.fits: there are no pixels in this part"):
        vkbloom.read(tmp_path / "a.fits")


@pytest.mark.parametrize("name", ["a.ppm", "a.pgm", "a.pfm"])
def test_pnm_has_no_notes(tmp_path: Path, name: str) -> None:
    pixels = np.full((2, 3, 3), 0.5, np.float32)[..., : 1 if name == "a.pgm" else 3]
    path = vkbloom.write(tmp_path / name, pixels)
    made, facts = vkbloom.read(path, metadata=True)
    assert facts["notes"] == ()
    assert np.abs(made - 0.5).max() < 0.005


@pytest.mark.parametrize(
    "content",
    [
        b"P1\n4 2\n0 1 1 0\n1 0 0 1\n",
        # As GIMP and Netpbm write it, with comments where they are allowed, in several lines.
        b"P1\n# comment\n4 2\n0110\n1001\n",
        b"P1\n# 1 1\n4 # wide\n2\n01101001",
        b"P1 4 2 0110#1\n10 01\n# the end",
        b"P1\r\n4 2\r\n01\r\n101001\r\n1",
    ],
)
def test_plain_bitmaps(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.pbm").write_bytes(content)
    found = vkbloom.read(tmp_path / "a.pbm")
    np.testing.assert_array_equal(found[..., 0], [[1, 0, 0, 1], [0, 1, 1, 0]])
    frames = vkbloom.apply(tmp_path / "a.pbm", "kino", framebuffers="final")
    assert frames["final"].shape == (2, 4, 3)


@pytest.mark.parametrize(
    "content",
    [
        b"P1\n4 2\n0110100",
        b"P1\n4 2\n01101002",
        b"P1\n4 2",
        b"P1\n99999999 99999999\n0",
        b"P1 0 0 ",
    ],
)
def test_damaged_plain_bitmaps(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.pbm").write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.pbm: "):
        vkbloom.read(tmp_path / "a.pbm")


@pytest.mark.parametrize(("name", "size"), [("a.jp2", 16), ("a.iff", 5)])
def test_too_small_for_the_format(tmp_path: Path, name: str, size: int) -> None:
    pixels = RNG.random((size, size, 3), np.float32)
    with pytest.raises(OSError, match=f"(after writing|resolutions).*{name}") as caught:
        vkbloom.write(tmp_path / name, pixels)
    assert "disk" not in str(caught.value)
    assert os.listdir(tmp_path) == []


def test_grey_has_no_primaries(tmp_path: Path) -> None:
    # As libjxl writes it.
    chunk = png_chunk(b"cICP", bytes([0, 13, 0, 1]))
    path = store_png(tmp_path / "a.png", PIXELS[..., :1], chunk)
    made, facts = vkbloom.read(path, metadata=True)
    assert np.allclose(made[..., :1], decode_srgb(PIXELS[..., :1] / 255), rtol=1e-6)
    assert facts["notes"] == ()


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("size", [1, 2, 3, 9])
def test_small_jpeg_xl(tmp_path: Path, size: int, channels: int) -> None:
    pixels = np.full((size, size, channels), 0.5, np.float32)
    path = vkbloom.write(tmp_path / "a.jxl", pixels, bits=16)
    assert np.allclose(vkbloom.read(path), pixels, atol=1e-4)


@pytest.mark.parametrize("stated", [None, "6", (6, 6), 0, 9, -1, 6.0])
def test_an_orientation_that_is_none(tmp_path: Path, stated: Any) -> None:
    spec = oiio.ImageSpec(4, 3, 3, "half")
    if stated is not None:
        kind = {int: "int", float: "float", str: "string"}.get(type(stated), "int[2]")
        spec.attribute("Orientation", oiio.TypeDesc(kind), stated)
    write(tmp_path / "a.exr", spec, np.ones((3, 4, 3), np.float16))
    with ImageFile(tmp_path / "a.exr") as file:
        assert file.header.orientation == 1
