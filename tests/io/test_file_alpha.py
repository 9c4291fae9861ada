"""Alpha of image files of other programs, and what `write` and `read` make of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.io import foreign
from tests.io.parts import write
from tests.srgb import decode_srgb

oiio = pytest.importorskip("OpenImageIO")
image = pytest.importorskip("PIL.Image")
tifffile = pytest.importorskip("tifffile")

# Some are darker than what alpha lets through, as they are in files of straight colours.
STRAIGHT = np.array(
    [[[255, 128, 0, 32], [10, 200, 90, 255]], [[255, 255, 255, 64], [40, 60, 80, 129]]], np.uint8
)
# 32 x 32 pixels, which is the least of JPEG 2000.
STRAIGHT = np.kron(STRAIGHT, np.ones((16, 16, 1), np.uint8))
MULTIPLIED = STRAIGHT.copy()
MULTIPLIED[..., :3] = np.rint(STRAIGHT[..., :3] / 255.0 * STRAIGHT[..., 3:])
CLEAR = STRAIGHT * np.array([1, 1, 1, 0], np.uint8)
WORDS = STRAIGHT[..., [2, 1, 0, 3]].copy().view("<u4")[..., 0]
CLEAR_WORDS = WORDS & np.uint32(0xFFFFFF)
RGBA_WORDS = STRAIGHT.copy().view("<u4")[..., 0]
# Ten bits of each colour, two of alpha.
DEEP_MASKS = (0x3FF, 0xFFC00, 0x3FF00000, 0xC0000000)
_DEEP = STRAIGHT.astype(np.uint32) * np.array([1023, 1023, 1023, 3]) // 255
DEEP_WORDS = (_DEEP << np.array([0, 10, 20, 30])).sum(axis=-1).astype(np.uint32)


def meant(codes: NDArray[Any], *, is_multiplied: bool = False) -> NDArray[np.float64]:
    """Return linear light and alpha of codes in a file."""
    values = codes / np.iinfo(codes.dtype).max
    if is_multiplied:
        values[..., :3] = np.minimum(values[..., :3] / values[..., 3:], 1)
    values[..., :3] = decode_srgb(values[..., :3])
    return values


def pillow(pixels: NDArray[Any], **options: Any) -> Callable[[Path], None]:
    return lambda path: image.fromarray(pixels).save(path, **options)


def tiff(pixels: NDArray[Any], *extra: str, photometric: str = "rgb") -> Callable[[Path], None]:
    more = {"extrasamples": extra} if extra else {}
    return lambda path: tifffile.imwrite(path, pixels, photometric=photometric, **more)


def tiff_without_tag(path: Path) -> None:
    tiff(STRAIGHT, "unassalpha")(path)
    content = bytearray(path.read_bytes())
    # ExtraSamples, one number of 16 bits: another tag that readers do not know.
    at = content.index(b"\x52\x01\x03\0\x01\0\0\0")
    content[at : at + 2] = b"\x50\x01"
    path.write_bytes(content)


def jpeg_2000(path: Path) -> None:
    pillow(MULTIPLIED, irreversible=False)(path)
    content = bytearray(path.read_bytes())
    at = content.index(b"cdef") + 4
    entries = range(at + 2, at + 26, 6)
    alpha = next(entry for entry in entries if content[entry + 2 : entry + 4] == b"\0\1")
    content[alpha + 3] = 2
    path.write_bytes(content)


def deep(pixels: NDArray[Any]) -> NDArray[np.uint16]:
    return pixels.astype(np.uint16) * np.uint16(257)


def beside(pixels: NDArray[Any], *channels: int) -> NDArray[Any]:
    """Return pixels with further channels, numbers of those of STRAIGHT or 4 for another."""
    more = np.concatenate([STRAIGHT, np.full((*STRAIGHT.shape[:2], 1), 77, np.uint8)], axis=-1)
    return np.concatenate([pixels, more[..., channels]], axis=-1)


GREY = STRAIGHT[..., [1, 1, 1, 3]]
OPAQUE = (STRAIGHT[..., :3], False)
EXTRA_SAMPLES = ("unspecified", "assocalpha", "unassalpha")
#: What is stored and what is meant, by the numbers of the extra samples; whether it is multiplied.
TIFFS: dict[str, tuple[NDArray[Any], NDArray[Any], bool]] = {
    "0": (STRAIGHT, *OPAQUE),
    "1": (MULTIPLIED, MULTIPLIED, True),
    "1 deep": (deep(MULTIPLIED), deep(MULTIPLIED), True),
    "2": (STRAIGHT, STRAIGHT, False),
    "2 deep": (deep(STRAIGHT), deep(STRAIGHT), False),
    "0 2": (beside(STRAIGHT[..., :3], 4, 3), STRAIGHT, False),
    "1 0": (beside(MULTIPLIED[..., :3], 3, 4), MULTIPLIED, True),
    "1 2": (beside(MULTIPLIED[..., :3], 3, 4), MULTIPLIED, True),
    "grey 1": (MULTIPLIED[..., [1, 3]], MULTIPLIED[..., [1, 1, 1, 3]], True),
    "grey 2": (STRAIGHT[..., [1, 3]], GREY, False),
    "grey 0 2": (beside(STRAIGHT[..., [1]], 4, 3), GREY, False),
}


def of_tiff(name: str, pixels: NDArray[Any]) -> Callable[[Path], None]:
    extra = [EXTRA_SAMPLES[int(word)] for word in name.split() if word.isdigit()]
    return tiff(pixels, *extra, photometric="minisblack" if "grey" in name else "rgb")


# A name, what writes the file, what is in it, and whether its colours are multiplied.
ROWS: list[tuple[str, Callable[[Path], Any], NDArray[Any], bool]] = [
    ("a.png", pillow(STRAIGHT), STRAIGHT, False),
    ("grey.png", pillow(STRAIGHT[..., [1, 3]]), GREY, False),
    ("a.webp", pillow(STRAIGHT, lossless=True, exact=True), STRAIGHT, False),
    ("a.sgi", pillow(STRAIGHT), STRAIGHT, False),
    ("a.dds", pillow(STRAIGHT), STRAIGHT, False),
    # Pillow's mask of alpha lies outside of the pixels' 16 bits.
    ("grey.dds", pillow(STRAIGHT[..., [1, 3]]), GREY[..., :3], False),
    ("a.jp2", pillow(STRAIGHT, irreversible=False), STRAIGHT, False),
    ("multiplied.jp2", jpeg_2000, MULTIPLIED, True),
    ("a.ico", pillow(STRAIGHT, sizes=[(32, 32)], bitmap_format="bmp"), STRAIGHT, False),
    ("png.ico", pillow(STRAIGHT, sizes=[(32, 32)]), STRAIGHT, False),
    ("clear.ico", pillow(CLEAR, sizes=[(32, 32)], bitmap_format="bmp"), *OPAQUE),
    *(
        (f"mode {mode}.dds", lambda path, mode=mode: foreign.dds(path, STRAIGHT, mode), *what)
        for mode, what in enumerate(((STRAIGHT, False), (STRAIGHT, False), (STRAIGHT, True)))
    ),
    ("mode 3.dds", lambda path: foreign.dds(path, STRAIGHT, 3), *OPAQUE),
    ("a.tga", pillow(STRAIGHT), STRAIGHT, False),
    ("grey.tga", pillow(STRAIGHT[..., [1, 3]]), GREY, False),
    ("type 0.tga", lambda path: foreign.tga(path, STRAIGHT, 0, 0), *OPAQUE),
    ("type 1.tga", lambda path: foreign.tga(path, STRAIGHT, 1), *OPAQUE),
    ("type 2.tga", lambda path: foreign.tga(path, STRAIGHT, 2), STRAIGHT, False),
    ("type 3.tga", lambda path: foreign.tga(path, STRAIGHT, 3), STRAIGHT, False),
    ("type 4.tga", lambda path: foreign.tga(path, MULTIPLIED, 4), MULTIPLIED, True),
    ("stated clear.tga", lambda path: foreign.tga(path, CLEAR, 3), CLEAR, False),
    ("old.tga", lambda path: foreign.tga(path, STRAIGHT, None), STRAIGHT, False),
    ("old clear.tga", lambda path: foreign.tga(path, CLEAR, None), *OPAQUE),
    ("a.bmp", pillow(STRAIGHT), STRAIGHT, False),
    *(
        (f"clear {size}.bmp", lambda path, size=size: foreign.bmp(path, CLEAR_WORDS, size), *OPAQUE)
        for size in (40, 108, 124)
    ),
    *(
        (
            f"{name} {size}.bmp",
            lambda path, words=words, size=size, masks=masks: foreign.bmp(path, words, size, masks),
            *what,
        )
        for size in (56, 108, 124)
        for name, words, masks, what in (
            ("bgra", WORDS, foreign.BGRA, (STRAIGHT, False)),
            ("rgba", RGBA_WORDS, (0xFF, 0xFF00, 0xFF0000, 0xFF000000), (STRAIGHT, False)),
            ("bgrx", WORDS, (*foreign.BGRA[:3], 0), OPAQUE),
            ("stated clear", CLEAR_WORDS, foreign.BGRA, (CLEAR, False)),
        )
    ),
    ("bgrx 40.bmp", lambda path: foreign.bmp(path, WORDS, 40, foreign.BGRA[:3]), *OPAQUE),
    ("a.tif", pillow(STRAIGHT), STRAIGHT, False),
    ("none.tif", tiff_without_tag, STRAIGHT, False),
    *((f"{name}.tif", of_tiff(name, one[0]), one[1], one[2]) for name, one in TIFFS.items()),
]


@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_files_of_others(
    tmp_path: Path, row: tuple[str, Callable[[Path], Any], NDArray[Any], bool]
) -> None:
    name, store, codes, is_multiplied = row
    path = tmp_path / name
    store(path)
    made, facts = vkbloom.read(path, metadata=True)
    expected = meant(codes, is_multiplied=is_multiplied)
    assert made.shape == expected.shape
    # A step of 16 bits, of colours that are divided.
    assert np.allclose(made, expected, rtol=1e-6, atol=4e-5 if is_multiplied else 1e-7)
    assert facts["alpha"] == ("straight" if codes.shape[2] == 4 else None)


def test_masks_of_ten_bits(tmp_path: Path) -> None:
    foreign.bmp(tmp_path / "a.bmp", DEEP_WORDS, 108, DEEP_MASKS)
    made = vkbloom.read(tmp_path / "a.bmp")
    expected = _DEEP / np.array([1023, 1023, 1023, 3])
    assert np.abs(made[..., 3] - expected[..., 3]).max() < 1e-6
    assert np.abs(made[..., :3] - decode_srgb(expected[..., :3])).max() < 0.5 / 255 * 2.3


@pytest.mark.parametrize("is_straight", [False, True])
def test_floats(tmp_path: Path, is_straight: bool) -> None:
    values = (STRAIGHT / 16).astype(np.float32)
    values[..., 3] /= 16
    light = np.concatenate([values[..., :3] * values[..., 3:], values[..., 3:]], axis=-1)
    stored = values if is_straight else light
    tiff(stored, "unassalpha" if is_straight else "assocalpha")(tmp_path / "a.tif")
    spec = oiio.ImageSpec(32, 32, 4, "float")
    if is_straight:
        # OpenImageIO keeps its own name to itself.
        spec.attribute("xxxx:UnassociatedAlpha", 1)
    write(tmp_path / "a.exr", spec, stored)
    content = (tmp_path / "a.exr").read_bytes()
    (tmp_path / "a.exr").write_bytes(content.replace(b"xxxx:", b"oiio:"))
    for name in ("a.tif", "a.exr"):
        assert np.allclose(vkbloom.read(tmp_path / name), values, rtol=1e-6)
        assert np.allclose(vkbloom.read(tmp_path / name, premultiplied=True), light, rtol=1e-6)


# Every format that OpenImageIO writes with alpha, with the sizes of its numbers.
WRITTEN = [
    *((name, 8) for name in ("bmp", "ico", "jp2", "jxl", "png", "sgi", "tga", "tif")),
    *((name, 8) for name in ("dpx", "fits", "iff", "rla", "webp")),
    *((name, 16) for name in ("dpx", "exr", "iff", "jp2", "jxl", "png", "rla", "sgi", "tif")),
    *((name, 32) for name in ("dpx", "exr", "fits", "jxl", "rla", "tif")),
]


@pytest.mark.parametrize("channels", [2, 4])
@pytest.mark.parametrize("premultiplied", [False, True])
@pytest.mark.parametrize(("suffix", "bits"), WRITTEN)
def test_read_gives_what_write_got(
    tmp_path: Path, suffix: str, bits: int, premultiplied: bool, channels: int
) -> None:
    straight = meant(STRAIGHT).astype(np.float32)
    wanted = straight[..., [1, 3]] if channels == 2 else straight
    given = wanted.copy()
    if premultiplied:
        given[..., :-1] *= given[..., -1:]
    path = tmp_path / f"a.{suffix}"
    if channels == 2 and suffix in ("bmp", "dpx", "iff", "jp2", "jxl", "webp"):
        with pytest.raises(ValueError, match="cannot hold 2 channels"):
            vkbloom.write(path, given, bits=bits, premultiplied=premultiplied)
        return
    vkbloom.write(path, given, bits=bits, premultiplied=premultiplied)
    made = vkbloom.read(path)
    expected = straight[..., [1, 1, 1, 3]] if channels == 2 else straight
    is_seen = expected[..., 3] > 0
    off = np.abs(made - expected)[is_seen]
    # WebP is lossy at edges.
    assert (np.median(off) if suffix == "webp" else off.max()) < {8: 0.005, 16: 1e-3, 32: 1e-6}[
        bits
    ]
    assert np.abs(made[..., 3] - expected[..., 3]).max() < 0.005
