"""Files of other programs: where their pixels lie, and what their numbers mean."""

from __future__ import annotations

import base64
import shutil
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.io import foreign
from tests.io.parts import write
from tests.io.profiles import png_chunk, store_png
from tests.srgb import decode_srgb, encode_srgb
from vkbloom._io.formats.jpeg_xl import read_header
from vkbloom._io.image_file import read_picture, read_stored
from vkbloom._io.image_writing import save

oiio = pytest.importorskip("OpenImageIO")
image = pytest.importorskip("PIL.Image")
tifffile = pytest.importorskip("tifffile")

RNG = np.random.default_rng(16)
PIXELS = RNG.integers(1, 256, (32, 48, 3), dtype=np.uint8)
LEVELS = np.tile(np.array([255, 191, 127, 0], np.uint8), (16, 8))
ALPHA = np.tile(np.array([255, 128, 64, 200], np.uint8), (16, 8))
# 33 x 33 pixels of 4:2:0, by FFmpeg's encoder: Y 120, Cb 60 + 4 x, Cr 60 + 4 y, of half resolution.
YCC_OF_ODD_SIZE = base64.b64decode(
    "AAAADGpQICANCocKAAAAFGZ0eXBqcDIgAAAAAGpwMiAAAAAtanAyaAAAABZpaGRyAAAAIQAAACEAAwgHAAAAAAAPY29scgEA"
    "AAAAABIAAACoanAyY/9P/1EALwAAAAAAIQAAACEAAAAAAAAAAAAAAQAAAAEAAAAAAAAAAAAAAwcBAQcCAgcCAv9SAAwAAAAB"
    "AAYCAgAB/1wAFiBASEhQSEhQSEhQSEhQSEhQSEhQ/2QAEQABTGF2YzU5LjM3LjEwMP+QAAoAAAAAADIAAf+Tw+QCB8+oBAbP"
    "qAQGAAAAAM+0BASn2gIEAAAAAAAAAAAAAAAA/9k="
)
# 16 bits of 0.5, 0.25, 0, 0.5, straight, by libjxl.
STRAIGHT = base64.b64decode(
    "AAAADEpYTCANCocKAAAAFGZ0eXBqeGwgAAAAAGp4bCAAAAAJanhsbAoAAAA0anhsY/8KQ/Aj+AESCAgQAHgASxiLFQDcGWPw"
    "wMgLSAAwiDEE4HgMAPD//0SArkBR"
)
# Levels 0 to 63 of a profile of the exponent 1.8, in columns of 8 pixels, by cjxl -d 1.
DARK = base64.b64decode(
    "/wo4AP6DFG4SBiTMAyBTRUMAfL9nlUWatDynJFR4tEsUkoacsksJuaFYpSe1RepJzaWPpijcCbgZyBNn0QTBX2TLre5zUFx3"
    "JxLNez71/W4t0LzuvutuCdq13m6cToN9BcFg65CFwIpewJsHaDQLQ/xAXQJoc8i1gUybPJ4BABKIAgD0gAkIAAAAAGW5FgAA"
    "FSqjjBu8nOv58kOHxbSN6wxttW1hCQW2jfYT+RgAgISSY54xX54BAUfEGBkbwxhjjAzKxsYwhhGMBQAcQFeIdnf/RVCTzaHH"
    "CID4NwBgAQAAAQABAwGMHwdjSrnAyCkB"
)
# Where the codestream begins, and the bit that says that colours are multiplied by alpha.
CODESTREAM, MULTIPLIED = 49, (55, 0x80)


# Positions


def store_png_offset(path: Path) -> None:
    store_png(path, PIXELS, png_chunk(b"oFFs", struct.pack(">iiB", 8, 4, 0)))


def store_negative_offset(path: Path) -> None:
    store_png(path, PIXELS, png_chunk(b"oFFs", struct.pack(">iiB", -8, -4, 0)))


def store_tiff_position(path: Path) -> None:
    tags = [(tag, 5, 1, (value, 1), True) for tag, value in ((286, 8), (287, 4))]
    tifffile.imwrite(path, PIXELS, photometric="rgb", extratags=tags)


def store_tiff_in_a_larger_one(path: Path) -> None:
    # PIXAR_IMAGEFULLWIDTH and its length.
    tags = [(33300, 4, 1, 96, True), (33301, 4, 1, 64, True)]
    tifffile.imwrite(path, PIXELS, photometric="rgb", extratags=tags)


def store_windows(path: Path) -> None:
    spec = oiio.ImageSpec(48, 32, 3, "uint8")
    spec.x, spec.y, spec.full_width, spec.full_height = 8, 4, 96, 64
    write(path, spec, PIXELS)


def store_jpeg_2000(path: Path) -> None:
    # XOsiz and YOsiz.
    image.fromarray(PIXELS).save(path, offset=(8, 4), tile_size=(64, 64), irreversible=False)


POSITIONS: list[tuple[str, Callable[[Path], None]]] = [
    ("a.png", store_png_offset),
    ("negative.png", store_negative_offset),
    ("a.tif", store_tiff_position),
    ("full.tif", store_tiff_in_a_larger_one),
    *((f"a.{suffix}", store_windows) for suffix in ("dpx", "rla", "iff")),
    ("a.jp2", store_jpeg_2000),
    ("a.j2k", store_jpeg_2000),
]


@pytest.mark.parametrize(("name", "store"), POSITIONS, ids=[name for name, _ in POSITIONS])
def test_a_position_moves_nothing(tmp_path: Path, name: str, store: Callable[[Path], None]) -> None:
    store(tmp_path / name)
    stored = read_stored(tmp_path / name)
    assert np.array_equal(stored.pixels, PIXELS)
    assert (stored.header.origin, stored.header.display) == ((0, 0), (0, 0, 48, 32))


def test_layers_of_photoshop_are_their_pixels(tmp_path: Path) -> None:
    grey = np.stack([LEVELS, ALPHA], -1)
    foreign.grey_psd(tmp_path / "a.psd", grey, grey[:5, :7])
    stored = read_stored(tmp_path / "a.psd", 1)
    assert np.array_equal(stored.pixels, grey[:5, :7])
    assert stored.header.channels == ("Y", "A")


@pytest.mark.parametrize("suffix", ["dpx", "rla"])
def test_only_openexr_gets_windows(tmp_path: Path, suffix: str) -> None:
    spec = oiio.ImageSpec(48, 32, 3, "half")
    spec.x, spec.y = -8, -4
    spec.full_width, spec.full_height = 32, 24
    write(tmp_path / "a.exr", spec, (PIXELS / 255).astype(np.float16))
    picture = read_picture(tmp_path / "a.exr")
    save(picture, tmp_path / f"a.{suffix}")
    assert read_stored(tmp_path / f"a.{suffix}").pixels.shape == (24, 32, 3)


# JPEG 2000


@pytest.mark.parametrize("is_named", [True, False])
def test_subsampled_jpeg_2000_of_odd_size(tmp_path: Path, is_named: bool) -> None:
    content = YCC_OF_ODD_SIZE
    path = tmp_path / ("a.jp2" if is_named else "a.j2k")
    # A codestream alone does not name its colours.
    path.write_bytes(content if is_named else content[content.index(b"\xff\x4f\xff\x51") :])
    made = vkbloom.read(path)
    half = np.arange(33) // 2
    blue, red = np.meshgrid(60 + 4.0 * half - 128, 60 + 4.0 * half - 128)
    # Rec. ITU-R BT.601.
    codes = [120 + 1.402 * red, 120 - 0.344136 * blue - 0.714136 * red, 120 + 1.772 * blue]
    assert made.shape == (33, 33, 3)
    off = encode_srgb(made) * 255 - np.clip(np.stack(codes, -1), 0, 255)
    assert np.abs(off).max() < 2


def test_subsampled_jpeg_2000_that_begins_elsewhere_is_refused(tmp_path: Path) -> None:
    content = bytearray(YCC_OF_ODD_SIZE)
    at = content.index(b"\xff\x4f\xff\x51") + 8
    content[at : at + 16] = struct.pack(">IIII", 34, 34, 1, 1)
    (tmp_path / "a.jp2").write_bytes(content)
    with pytest.raises(ValueError, match=r"a\.jp2: JPEG 2000 with subsampled colours .* at 1 1"):
        vkbloom.read(tmp_path / "a.jp2")


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_signed_jpeg_2000(tmp_path: Path, bits: int) -> None:
    dtype = np.uint8 if bits == 8 else np.uint16
    values = np.linspace(0, (1 << bits) - 1, 32 * 32).reshape(32, 32).astype(dtype)
    path = tmp_path / "a.j2k"
    image.fromarray(values).save(path, irreversible=False)
    content = bytearray(path.read_bytes())
    at = content.index(b"\xff\x4f\xff\x51") + 42
    assert content[at] == 8 * values.itemsize - 1
    # The decoder adds the half of the range to unsigned numbers only.
    content[at] = 128 | bits - 1
    path.write_bytes(content)
    if bits == 12:
        with pytest.raises(ValueError, match=r"a\.j2k: JPEG 2000 with signed numbers of 12 bits"):
            read_stored(path)
    else:
        assert np.array_equal(read_stored(path).pixels[..., 0], values)


# TIFF whose 0 is white


@pytest.mark.parametrize("byte_order", ["<", ">"])
@pytest.mark.parametrize("tile", [None, (16, 16)])
@pytest.mark.parametrize("dtype", ["u1", "u2", "f2", "f4"])
@pytest.mark.parametrize("planes", ["grey", "contig", "separate"])
def test_white_is_0(
    tmp_path: Path, byte_order: str, tile: tuple[int, int] | None, dtype: str, planes: str
) -> None:
    is_float = dtype[0] == "f"
    unit = 1 if is_float else np.iinfo(dtype).max
    light, alpha = decode_srgb(LEVELS / 255), ALPHA / 255
    white, shown = ((1 - light), alpha) if is_float else (unit - LEVELS / 255 * unit, alpha * unit)
    values = {
        "grey": white,
        "contig": np.stack([white, shown], -1),
        "separate": np.stack([white, shown]),
    }[planes]
    more = {} if planes == "grey" else {"planarconfig": planes, "extrasamples": ["unassalpha"]}
    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path,
        (values if is_float else np.rint(values)).astype(dtype),
        photometric="miniswhite",
        byteorder=byte_order,
        tile=tile,
        **more,
    )
    made, facts = vkbloom.read(path, metadata=True)
    assert np.allclose(made[..., 0], light, atol=1e-3)
    assert facts["alpha"] == (None if planes == "grey" else "straight")
    assert planes == "grey" or np.allclose(made[..., 3], alpha, atol=1e-3)
    assert bool(facts["notes"]) is is_float


@pytest.mark.parametrize("bits", [1, 4, 12])
@pytest.mark.parametrize("is_white", [False, True])
def test_white_is_0_in_few_bits(tmp_path: Path, bits: int, is_white: bool) -> None:
    values = np.arange(16 * 16).reshape(16, 16) % (1 << bits)
    rows = ((values[..., None] >> np.arange(bits)[::-1]) & 1).astype(np.uint8).reshape(16, -1)
    body = np.packbits(rows, axis=1).tobytes()
    fields = [(256, 16), (257, 16), (258, bits), (259, 1), (262, 1 - is_white), (273, 8)]
    fields += [(277, 1), (278, 16), (279, len(body))]
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in fields)
    directory = struct.pack("<H", len(fields)) + entries + bytes(4)
    content = b"II*\0" + struct.pack("<I", 8 + len(body)) + body + directory
    (tmp_path / "a.tif").write_bytes(content)
    codes = values / ((1 << bits) - 1)
    expected = decode_srgb(1 - codes if is_white else codes)
    assert np.allclose(vkbloom.read(tmp_path / "a.tif")[..., 0], expected, atol=1e-3)


@pytest.mark.skipif(not shutil.which("tiffcp"), reason="needs libtiff's tools")
def test_white_is_0_in_a_jpeg_of_libtiff(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", 255 - LEVELS, photometric="miniswhite")
    command = ["tiffcp", "-c", "jpeg:100", "a.tif", "b.tif"]
    subprocess.run(command, check=True, cwd=tmp_path)
    made = encode_srgb(vkbloom.read(tmp_path / "b.tif")[..., 0]) * 255
    assert np.abs(made - LEVELS).max() < 8


def test_tiles_of_doubles_are_refused(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "a.tif", LEVELS / 255, photometric="minisblack", tile=(16, 16))
    with pytest.raises(ValueError, match=r"a\.tif: tiles of doubles are not supported"):
        vkbloom.read(tmp_path / "a.tif")


# JPEG XL


def multiply() -> bytes:
    at, bit = MULTIPLIED
    content = bytearray(STRAIGHT)
    content[at] |= bit
    return bytes(content)


@pytest.mark.parametrize("container", ["jxlc", "jxlp", "none", "to the end", "large"])
@pytest.mark.parametrize("is_multiplied", [False, True])
def test_alpha_of_jpeg_xl(tmp_path: Path, container: str, is_multiplied: bool) -> None:
    content = multiply() if is_multiplied else STRAIGHT
    # Without the box of the level, as other programs write it.
    boxes, codestream = content[:32] + foreign.jpeg_xl_box(b"xml ", b"<a/>"), content[CODESTREAM:]
    parts = [b"\0\0\0\0" + codestream[:20], b"\x80\0\0\1" + codestream[20:]]
    path = tmp_path / "a.jxl"
    path.write_bytes(
        {
            "jxlc": content,
            "jxlp": boxes + b"".join(foreign.jpeg_xl_box(b"jxlp", part) for part in parts),
            "none": codestream,
            "to the end": boxes + b"\0\0\0\0jxlc" + codestream,
            "large": boxes + struct.pack(">I4sQ", 1, b"jxlc", 16 + len(codestream)) + codestream,
        }[container]
    )
    made, facts = vkbloom.read(path, metadata=True)
    expected = [1, 0.214, 0, 0.5] if is_multiplied else [0.214, 0.0508, 0, 0.5]
    assert np.allclose(made[0, 0], expected, atol=1e-3)
    assert facts["alpha"] == "straight"


@pytest.mark.parametrize("cut", range(0, len(STRAIGHT), 3))
def test_headers_of_jpeg_xl_that_end_early(tmp_path: Path, cut: int) -> None:
    (tmp_path / "a.jxl").write_bytes(STRAIGHT[:cut])
    with open(tmp_path / "a.jxl", "rb") as stream:
        assert isinstance(read_header(stream).is_multiplied, bool)


def test_dark_levels_of_lossy_jpeg_xl_with_a_profile(tmp_path: Path) -> None:
    (tmp_path / "a.jxl").write_bytes(DARK)
    made, facts = vkbloom.read(tmp_path / "a.jxl", metadata=True)
    expected = encode_srgb((np.arange(512) // 8 / 255) ** 1.8) * 255
    # Lossy, but not with the steps of 8 bits of light, of which there are 20 here.
    assert np.abs(encode_srgb(made) * 255 - expected[None, :, None]).max() < 1.2
    assert "decoded to linear Rec. 709; colours outside of it are clipped" in facts["notes"][0]


@pytest.mark.parametrize("curve", ["srgb", "linear", "pq", "hlg"])
@pytest.mark.parametrize("kind", ["half", "float"])
def test_floats_of_jpeg_xl_are_on_their_curve(tmp_path: Path, curve: str, kind: str) -> None:
    code = {"srgb": 13, "linear": 8, "pq": 16, "hlg": 18}[curve]
    spec = oiio.ImageSpec(32, 32, 3, kind)
    spec.attribute("CICP", oiio.TypeDesc("int[4]"), (1, code, 0, 1))
    # The format needs as much as 100 for no loss.
    spec.attribute("compression", "jpegxl:100")
    signal = np.linspace(0, 1, 32 * 32 * 3, dtype=np.float32).reshape(32, 32, 3)
    write(tmp_path / "a.jxl", spec, signal)
    png = vkbloom.read(
        store_png(
            tmp_path / "a.png",
            np.rint(signal * 65535).astype(np.uint16),
            png_chunk(b"cICP", bytes([1, code, 0, 1])),
        )
    )
    made, facts = vkbloom.read(tmp_path / "a.jxl", metadata=True)
    assert np.allclose(made, png, rtol=5e-3 if kind == "half" else 2e-3, atol=1e-3)
    assert not any("taken as" in note for note in facts["notes"])


@pytest.mark.skipif(not shutil.which("cjxl"), reason="needs libjxl's tools")
@pytest.mark.parametrize("distance", ["0", "0.3"])
def test_jpeg_xl_of_cjxl(tmp_path: Path, distance: str) -> None:
    codes = np.concatenate([PIXELS[:1, :1], [[[128]]]], -1).astype(np.uint8).repeat(64, 0)
    store_png(tmp_path / "a.png", codes.repeat(64, 1))
    command = ["cjxl", "--quiet", "a.png", "a.jxl", "-d", distance]
    subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)
    expected = encode_srgb(vkbloom.read(tmp_path / "a.png"))
    made = encode_srgb(vkbloom.read(tmp_path / "a.jxl"))
    assert np.abs(made - expected).max() < (1e-6 if distance == "0" else 0.03)


# FITS

COUNTS = np.arange(6).reshape(2, 3) * 50


@pytest.mark.parametrize(
    ("stored", "cards", "expected"),
    [
        (COUNTS.astype("u1"), {"BSCALE": 0.01, "BZERO": 1}, 1 + 0.01 * COUNTS),
        (COUNTS.astype("f4"), {"BSCALE": "2.0E+00", "BZERO": -10.5}, 2.0 * COUNTS - 10.5),
        (COUNTS.astype("f4"), {"BSCALE": "5.0D-1"}, 0.5 * COUNTS),
        (COUNTS.astype("i2"), {"BSCALE": 0.001, "BZERO": 0}, 0.001 * COUNTS),
        (COUNTS.astype("i4"), {"BSCALE": 0.001}, 0.001 * COUNTS),
        (COUNTS.astype("u1"), {"BSCALE": 1.0, "BZERO": "0.0"}, decode_srgb(COUNTS / 255)),
        (COUNTS.astype("u1"), {"BSCALE": "NaN", "BZERO": "'x'"}, decode_srgb(COUNTS / 255)),
        *(
            (
                (COUNTS * 257 - 32768).astype("i2"),
                {"BSCALE": 1, "BZERO": offset},
                decode_srgb(COUNTS / 255),
            )
            for offset in (32768, "3.2768E4")
        ),
    ],
)
def test_scale_of_fits(
    tmp_path: Path, stored: NDArray[Any], cards: dict[str, Any], expected: NDArray[Any]
) -> None:
    foreign.fits(tmp_path / "a.fits", stored, **cards)
    made, facts = vkbloom.read(tmp_path / "a.fits", metadata=True)
    # The bottom row is first.
    assert np.allclose(made[::-1, :, 0], expected, rtol=1e-6, atol=1e-6)
    is_scaled = facts["numbers"] == "float" and not np.array_equal(expected, stored)
    assert any("BSCALE" in note for note in facts["notes"]) is is_scaled


def test_fits_of_signed_numbers_is_refused(tmp_path: Path) -> None:
    foreign.fits(tmp_path / "a.fits", COUNTS.astype("i2"))
    with pytest.raises(ValueError, match=r"a\.fits: numbers of int16 are not supported"):
        vkbloom.read(tmp_path / "a.fits")


# Photoshop


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("is_over_white", [True, False])
def test_grey_of_photoshop(tmp_path: Path, dtype: Any, is_over_white: bool) -> None:
    unit = np.iinfo(dtype).max
    alpha = np.tile(np.array([0, 64, 128, 255]), (8, 4)) / 255
    straight = np.stack([np.full(alpha.shape, 0.4), alpha], -1)
    merged = straight.copy()
    if is_over_white:
        merged[..., 0] = straight[..., 0] * alpha + 1 - alpha
    codes = [np.rint(values * unit).astype(dtype) for values in (merged, straight)]
    foreign.grey_psd(tmp_path / "a.psd", *codes)
    made = vkbloom.read(tmp_path / "a.psd")
    assert np.allclose(made[..., 3], alpha, atol=2e-3)
    seen = encode_srgb(made[..., 0])[alpha > 0]
    # A level of 8 bits, divided by alpha.
    assert np.abs(seen - 0.4).max() < (1 / 64 if dtype == np.uint8 else 1e-4)
