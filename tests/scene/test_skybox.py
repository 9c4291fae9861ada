"""Skies: KTX 1, face images, panoramas, arrays, and their mip levels."""

from __future__ import annotations

import math
import pickle
import struct
import sys
import warnings
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from numpy.typing import NDArray

from tests.framebuffers import write_image
from tests.refusals import assert_refused, rows
from tests.scene.gltf_documents import CHANGES, many
from tests.scene.parts import Cubemap, load_sky

# name -> (glInternalFormat, glFormat, glType, channels, dtype)
FORMATS = {
    "RGBA8": (0x8058, 0x1908, 0x1401, 4, "u1"),
    "RGB8": (0x8051, 0x1907, 0x1401, 3, "u1"),
    "RGBA16F": (0x881A, 0x1908, 0x140B, 4, "f2"),
    "RGB16F": (0x881B, 0x1907, 0x140B, 3, "f2"),
    "RGBA32F": (0x8814, 0x1908, 0x1406, 4, "f4"),
    "RGB32F": (0x8815, 0x1907, 0x1406, 3, "f4"),
}


def faces_of(side: int, channels: int = 4, dtype: str = "u1") -> NDArray[Any]:
    """Texels that all differ from their neighbours."""
    values = np.arange(6 * side * side * channels).reshape(6, side, side, channels)
    return (values * 37 % 251).astype(dtype)


def ktx_bytes(
    levels: list[NDArray[Any]], name: str = "RGBA8", order: Literal["<", ">"] = "<", **header: int
) -> bytes:
    internal, gl_format, gl_type, channels, kind = FORMATS[name]
    dtype = np.dtype(kind).newbyteorder(order)
    side = levels[0].shape[1]
    fields = {
        "endianness": 0x04030201,
        "gl_type": gl_type,
        "type_size": dtype.itemsize,
        "gl_format": gl_format,
        "internal": internal,
        "base": gl_format,
        "width": side,
        "height": side,
        "depth": 0,
        "elements": 0,
        "faces": 6,
        "level_count": len(levels),
        "key_values": 12,
    }
    assert set(header) <= set(fields)
    data = b"\xabKTX 11\xbb\r\n\x1a\n" + struct.pack(f"{order}13I", *{**fields, **header}.values())
    data += struct.pack(f"{order}I", 5) + b"a\0b\0\0" + bytes(3)
    for level in levels:
        assert level.shape[3] == channels
        row = level.shape[2] * channels * dtype.itemsize
        padding = bytes(-row % 4)
        data += struct.pack(f"{order}I", (row + len(padding)) * level.shape[1])
        for face in level.astype(dtype):
            data += b"".join(line.tobytes() + padding for line in face)
    return data


def look_up(faces: NDArray[Any], direction: tuple[float, float, float]) -> NDArray[Any]:
    """Return the nearest texel, by the face table of the Vulkan specification, written out."""
    x, y, z = direction
    face, s, t, major = max(
        (0 if x > 0 else 1, -z if x > 0 else z, -y, abs(x)),
        (2 if y > 0 else 3, x, z if y > 0 else -z, abs(y)),
        (4 if z > 0 else 5, x if z > 0 else -x, -y, abs(z)),
        key=lambda row: row[3],
    )
    side = faces.shape[1]
    column = min(int((s / major + 1) / 2 * side), side - 1)
    row = min(int((t / major + 1) / 2 * side), side - 1)
    texel: NDArray[Any] = faces[face, row, column]
    return texel


def refusal(path: Path) -> str | None:
    """Return the message with which a file is refused as it should be, None if it is loaded."""
    try:
        load_sky(path)
    except ValueError as error:
        return str(error)
    return None


# Cubemap and arrays


@pytest.mark.parametrize("dtype", ["u1", "f2", "f4"])
def test_rgb_arrays_get_full_alpha(dtype: str) -> None:
    faces = faces_of(4, 3, dtype)
    cube = load_sky(faces)
    assert (cube.size, cube.dtype, len(cube.levels)) == (4, np.dtype(dtype), 3)
    np.testing.assert_array_equal(cube.levels[0][..., :3], faces)
    for level in cube.levels:
        assert (level[..., 3] == (255 if dtype == "u1" else 1)).all()


def test_rgba_arrays_are_used_as_they_are_and_not_shared() -> None:
    faces = faces_of(4)
    cube = load_sky(faces)
    np.testing.assert_array_equal(cube.levels[0], faces)
    faces[...] = 0
    assert cube.levels[0].any()
    for level in cube.levels:
        assert level.flags.c_contiguous
        assert not level.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            level[0, 0, 0, 0] = 1


def test_other_layouts_and_byte_orders_are_converted() -> None:
    faces = faces_of(3, 4, "f4")
    for given_faces in (np.asfortranarray(faces), faces.astype(">f4"), faces[:, ::-1][:, ::-1]):
        level = load_sky(given_faces).levels[0]
        assert level.dtype == np.dtype(np.float32)
        assert level.flags.c_contiguous
        np.testing.assert_array_equal(level, faces)


def test_a_cubemap_is_returned_itself() -> None:
    cube = load_sky(faces_of(2))
    assert load_sky(cube) is cube


def test_a_pickled_cubemap_stays_read_only() -> None:
    cube = pickle.loads(pickle.dumps(load_sky(faces_of(2))))
    np.testing.assert_array_equal(cube.levels[0], faces_of(2))
    assert not cube.levels[1].flags.writeable


# Mip levels


def test_a_mip_level_is_the_mean_of_four() -> None:
    faces = np.zeros((6, 2, 2, 4), np.uint8)
    faces[0, :, :, 0] = [[1, 2], [3, 4]]
    faces[5, :, :, 1] = [[255, 255], [255, 254]]
    faces[3, :, :, 2] = [[0, 0], [0, 1]]
    top = load_sky(faces).levels[1]
    # 2.5 rounds to even, 254.75 up, 0.25 down.
    assert (top[0, 0, 0, 0], top[5, 0, 0, 1], top[3, 0, 0, 2]) == (2, 255, 0)
    assert top.dtype == np.uint8


def test_rounding_does_not_add_up() -> None:
    # Rounded level by level, the mean of 3/4 would become 1 at once and never come back.
    faces = np.zeros((6, 4, 4, 4), np.uint8)
    faces[:, :2, :2] = [[[1], [1]], [[1], [0]]]
    assert [int(level.max()) for level in load_sky(faces).levels] == [1, 1, 0]


@pytest.mark.parametrize("dtype", ["f2", "f4"])
def test_mip_levels_of_floats_neither_overflow_nor_spread_nan(dtype: str) -> None:
    largest = np.finfo(dtype).max
    faces = np.full((6, 2, 2, 4), largest, dtype)
    faces[1, 0, 0] = math.nan
    faces[2, 0, 0] = math.inf
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        levels = load_sky(faces).levels
    np.testing.assert_array_equal(levels[0], faces)
    assert (levels[1][0] == largest).all()
    np.testing.assert_allclose(levels[1][1:3].astype("f8"), float(largest) * 0.75, rtol=1e-3)


# KTX 1


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("name", list(FORMATS))
@pytest.mark.parametrize("side", [1, 3, 4])
def test_ktx_formats(tmp_path: Path, name: str, order: Literal["<", ">"], side: int) -> None:
    channels, kind = FORMATS[name][3:]
    # Single-channel rows of 3 texels are padded in RGB8 and RGB16F.
    levels = [faces_of(max(1, side >> i), channels, kind) + i for i in range(side.bit_length())]
    path = tmp_path / "sky.ktx"
    path.write_bytes(ktx_bytes(levels, name, order))
    cube = load_sky(str(path))
    for read, written in zip(cube.levels, levels, strict=True):
        assert read.dtype == np.dtype(kind)
        np.testing.assert_array_equal(read[..., :channels], written)
    assert cube.levels[-1].shape == (6, 1, 1, 4)


def test_a_ktx_with_one_level_gets_the_others(tmp_path: Path) -> None:
    path = tmp_path / "sky.ktx"
    for count in (0, 1):
        path.write_bytes(ktx_bytes([faces_of(4)], level_count=count))
        cube = load_sky(path)
        assert [level.shape[1] for level in cube.levels] == [4, 2, 1]
        np.testing.assert_array_equal(cube.levels[1], load_sky(faces_of(4)).levels[1])


def test_a_ktx_with_a_part_of_the_chain_keeps_it(tmp_path: Path) -> None:
    path = tmp_path / "any.name"
    path.write_bytes(ktx_bytes([faces_of(8), faces_of(4)]))
    assert [level.shape[1] for level in load_sky(path).levels] == [8, 4]


@pytest.mark.parametrize(("call", "error"), rows(__file__, "skyboxes"))
def test_a_wrong_value_is_refused(tmp_path: Path, call: str, error: str) -> None:
    def ktx_with(**header: int) -> Cubemap:
        path = tmp_path / "sky.ktx"
        path.write_bytes(ktx_bytes([faces_of(4), faces_of(2)], "RGBA8", "<", **header) + bytes(8))
        return load_sky(path)

    levels = dict(zip(("four", "two", "one"), load_sky(faces_of(4)).levels, strict=True))
    assert_refused(call, error, {**globals(), **levels, "ktx_with": ktx_with})


def test_a_ktx_cut_anywhere_is_refused(tmp_path: Path) -> None:
    whole = ktx_bytes([faces_of(2), faces_of(1)])
    path = tmp_path / "sky.ktx"
    path.write_bytes(whole)
    assert len(load_sky(path).levels) == 2
    for size in range(len(whole)):
        path.write_bytes(whole[:size])
        with pytest.raises(ValueError, match=r"sky\.ktx: "):
            load_sky(path)


@many
@given(changes=CHANGES)
def test_changed_bytes_load_or_are_refused(tmp_path: Path, changes: list[tuple[int, int]]) -> None:
    content = bytearray(ktx_bytes([faces_of(2, 3, "f2"), faces_of(1, 3, "f2")], "RGB16F"))
    for place, value in changes:
        # Three in four changes go to the header.
        content[place % (len(content) if place % 4 == 0 else 64)] = value
    path = tmp_path / "sky.ktx"
    path.write_bytes(bytes(content))
    assert "sky.ktx" in (refusal(path) or "sky.ktx")


def test_missing_files_are_os_errors_that_name_them(tmp_path: Path) -> None:
    for source in (tmp_path / "gone.ktx", tmp_path / "gone.png", [tmp_path / "gone.png"] * 6):
        with pytest.raises(FileNotFoundError, match="gone"):
            load_sky(source)


# Images


@pytest.mark.parametrize(
    ("suffix", "kind", "dtype", "channels"),
    [
        ("png", "uint8", "u1", 3),
        ("png", "uint8", "u1", 4),
        ("exr", "half", "f2", 3),
        ("exr", "float", "f4", 4),
        ("tif", "float", "f4", 3),
    ],
)
def test_six_face_images(tmp_path: Path, suffix: str, kind: str, dtype: str, channels: int) -> None:
    # With alphas of all sizes, so that a multiplication by it would show.
    faces = faces_of(4, channels, dtype)
    paths = [write_image(tmp_path / f"{i}.{suffix}", faces[i], kind) for i in range(6)]
    cube = load_sky(paths)
    assert cube.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(cube.levels[0][..., :channels], faces)
    assert len(cube.levels) == 3


def test_16_bit_images_become_floats(tmp_path: Path) -> None:
    face = np.full((2, 2, 3), 65535, np.uint16)
    face[0, 0, 0] = 13107
    cube = load_sky([write_image(tmp_path / "a.png", face, "uint16")] * 6)
    assert cube.dtype == np.dtype(np.float32)
    np.testing.assert_allclose(cube.levels[0][3, 0, 0], [0.2, 1, 1, 1], rtol=1e-6)


def test_face_images_that_do_not_fit(tmp_path: Path) -> None:
    good = write_image(tmp_path / "good.png", np.zeros((4, 4, 3), np.uint8), "uint8")
    wide = write_image(tmp_path / "wide.png", np.zeros((4, 8, 3), np.uint8), "uint8")
    large = write_image(tmp_path / "large.png", np.zeros((8, 8, 3), np.uint8), "uint8")
    float_face = write_image(tmp_path / "float.exr", np.zeros((4, 4, 3), np.float32), "float")
    grey = write_image(tmp_path / "grey.png", np.zeros((4, 4, 1), np.uint8), "uint8")
    damaged = tmp_path / "damaged.png"
    damaged.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(40))
    with pytest.raises(ValueError, match="5 face images"):
        load_sky([good] * 5)
    for bad, message in (
        (wide, "the -z face is 8 x 4"),
        (large, "the -z face is 8 x 8"),
        (float_face, "float32"),
        (grey, "1 channels"),
        (damaged, "damaged.png"),
    ):
        with pytest.raises(ValueError, match=rf"{bad.name}.*{message}|{message}"):
            load_sky([good] * 5 + [bad])


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_a_panorama_cut_anywhere_is_refused_or_read(tmp_path: Path, suffix: str) -> None:
    values = np.random.default_rng(1).integers(0, 256, (16, 32, 3), np.uint8)
    whole = write_image(tmp_path / f"whole.{suffix}", values, "uint8").read_bytes()
    path = tmp_path / f"sky.{suffix}"
    refused = 0
    for size in range(0, len(whole), 7):
        path.write_bytes(whole[:size])
        # A cut after the texels is no damage.
        message = refusal(path)
        if message is not None:
            assert path.name in message
            refused += 1
    assert refused > len(whole) // 7 // 2


def test_without_openimageio_the_message_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_image(tmp_path / "a.png", np.zeros((2, 4, 3), np.uint8), "uint8")
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install vkbloom\[images\]"):
        load_sky(path)


# Panoramas


def panorama_of_directions(height: int) -> NDArray[np.float32]:
    """Return a panorama whose colour at every pixel is the direction that it stands for."""
    longitude = ((np.arange(2 * height) + 0.5) / (2 * height) - 0.5) * 2 * np.pi
    latitude = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    down, around = np.meshgrid(latitude, longitude, indexing="ij")
    x, y, z = np.cos(down) * np.sin(around), np.sin(down), -np.cos(down) * np.cos(around)
    return np.stack((x, y, z), axis=-1).astype(np.float32)


def shown(folder: Path, panorama: NDArray[Any]) -> NDArray[Any]:
    """Return the faces of a panorama, whose sides are a quarter of its width."""
    suffix, kind = ("png", "uint8") if panorama.dtype == np.uint8 else ("exr", "float")
    return load_sky(write_image(folder / f"sky.{suffix}", panorama, kind)).levels[0][..., :3]


def test_a_panorama_ends_up_in_the_directions_it_shows(tmp_path: Path) -> None:
    faces = shown(tmp_path, panorama_of_directions(128))
    rng = np.random.default_rng(3)
    for direction in rng.normal(size=(500, 3)):
        unit = direction / np.linalg.norm(direction)
        # A texel of a face spans up to 2/64, of which its centre is at most 0.7 away.
        found = look_up(faces, tuple(unit))
        assert np.linalg.norm(found - unit) < 0.7 * 2 / 64 + 0.01


def test_a_panorama_wraps_around(tmp_path: Path) -> None:
    panorama = np.full((6, 12, 3), 100, np.uint8)
    panorama[:, 0] = 200
    # The seam lies behind the camera, at +z: the middle of face 4 blends first and last column.
    assert shown(tmp_path, panorama)[4][1, 1].tolist() == [150, 150, 150]


def test_values_that_are_not_finite_do_not_spread_from_a_panorama(tmp_path: Path) -> None:
    panorama = np.ones((16, 32, 3), np.float32)
    panorama[7:9, 10:12] = math.nan
    panorama[7:9, 18:20] = math.inf
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        faces = shown(tmp_path, panorama)
    assert np.isfinite(faces).all()
    assert faces.min() < 1.0


@pytest.mark.parametrize(
    ("suffix", "kind", "dtype"),
    [("png", "uint8", "u1"), ("exr", "half", "f2"), ("hdr", "float", "f4")],
)
def test_panorama_files(tmp_path: Path, suffix: str, kind: str, dtype: str) -> None:
    path = write_image(tmp_path / f"sky.{suffix}", np.ones((8, 16, 3), dtype), kind)
    cube = load_sky(path)
    assert (cube.size, cube.dtype) == (4, np.dtype(dtype))
    assert (cube.levels[0][..., :3] == 1).all()


def test_a_panorama_must_be_twice_as_wide_as_high(tmp_path: Path) -> None:
    path = write_image(tmp_path / "sky.png", np.zeros((8, 17, 3), np.uint8), "uint8")
    with pytest.raises(ValueError, match=r"sky\.png: 17 x 8; .*twice as wide"):
        load_sky(path)
