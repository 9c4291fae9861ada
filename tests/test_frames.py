"""Frames: the mapping, its files, its Dataset and its pictures."""

from __future__ import annotations

import base64
import contextlib
import copy
import dataclasses
import errno
import json
import pickle
import re
import resource
import signal
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

import vkbloom.frames
from vkbloom import Separable, Settings
from vkbloom.frames import Frames, contact_sheet_png, dimensions

INFO = {
    "adapter": "Some <GPU> & co",
    "driver": "driver 1.2",
    "version": "0.1.0",
    "nan": 3,
    "inf": 0,
}
TIMINGS = {"glow": 0.001, "blur_vertical": 0.004, "composite": 0.002}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Noted(Separable):
    """Settings whose text a page must escape."""

    note: str = '</code><script>"&'


def make(
    arrays: Mapping[str, NDArray[Any]],
    *,
    timings: Mapping[str, float] = TIMINGS,
    settings: Settings | None = None,
) -> Frames:
    return Frames(
        arrays, timings=timings, settings=settings or Separable(blur_scale=2.0), info=INFO
    )


def noise(*shape: int, dtype: str, seed: int = 1) -> NDArray[Any]:
    generator = np.random.default_rng(seed)
    if dtype == "uint8":
        return generator.integers(0, 256, shape, dtype=np.uint8)
    return (generator.standard_normal(shape) * 100).astype(dtype)


@pytest.fixture
def frames() -> Frames:
    return make(
        {
            "glow": noise(5, 7, 4, dtype="float16"),
            "glow_depth": noise(5, 7, dtype="float32"),
            "blur_vertical": noise(5, 7, 4, dtype="float16"),
            "scene": noise(11, 13, 3, dtype="float32"),
            "depth": noise(11, 13, dtype="float32"),
            "final": noise(11, 13, 4, dtype="uint8"),
        }
    )


@dataclasses.dataclass
class Part:
    pixels: NDArray[Any]
    channels: tuple[str, ...]
    attributes: dict[str, Any]


def read(file: Path) -> dict[str, Part]:
    """Read every part of a file with its stored values, alpha not multiplied in."""
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    reader = oiio.ImageInput.open(str(file), config)
    assert reader is not None, oiio.geterror()
    parts = {}
    index = 0
    while reader.seek_subimage(index, 0):
        spec = reader.spec()
        pixels = reader.read_image(index, 0, 0, spec.nchannels, spec.format)
        assert pixels is not None, reader.geterror()
        parts[spec.getattribute("oiio:subimagename") or ""] = Part(
            pixels,
            tuple(spec.channelnames),
            {attribute.name: attribute.value for attribute in spec.extra_attribs},
        )
        index += 1
    reader.close()
    return parts


def decode(data: bytes | None, folder: Path) -> NDArray[np.uint8]:
    assert data is not None
    (folder / "decoded.png").write_bytes(data)
    return read(folder / "decoded.png")[""].pixels


def names_in(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


class TestMapping:
    def test_keeps_the_order_and_the_arrays(self) -> None:
        arrays = {name: noise(2, 2, 4, dtype="uint8") for name in ("z", "final", "a", "down_0")}
        frames = make(arrays)
        assert list(frames) == ["z", "final", "a", "down_0"]
        assert len(frames) == 4
        assert "a" in frames
        assert "b" not in frames
        assert all(frames[name] is arrays[name] for name in arrays)
        assert all(type(array) is np.ndarray for array in frames.values())

    def test_subclasses_of_ndarray_become_plain(self) -> None:
        class Special(np.ndarray[Any, Any]):
            pass

        assert type(make({"final": noise(1, 1, 3, dtype="uint8").view(Special)})["final"]) is (
            np.ndarray
        )

    def test_is_read_only(self, frames: Frames) -> None:
        with pytest.raises(TypeError):
            frames["final"] = frames["scene"]  # type: ignore[index]
        with pytest.raises(TypeError):
            del frames["final"]  # type: ignore[attr-defined]
        with pytest.raises(TypeError):
            frames.timings["glow"] = 0.0  # type: ignore[index]
        for attribute in ("timings", "settings", "info"):
            with pytest.raises(AttributeError):
                setattr(frames, attribute, None)

    def test_later_changes_of_the_arguments_do_not_show(self) -> None:
        arrays, timings, info = {"final": noise(1, 1, 3, dtype="uint8")}, {"a": 1.0}, {"nan": 1}
        frames = Frames(arrays, timings=timings, settings=Separable(), info=info)
        arrays.clear()
        timings.clear()
        info.clear()
        assert (list(frames), dict(frames.timings), frames.info) == (
            ["final"],
            {"a": 1.0},
            {"nan": 1},
        )

    def test_missing_name_tells_what_there_is(self, frames: Frames) -> None:
        with pytest.raises(KeyError, match=r"'bloom'.*glow, glow_depth, blur_vertical, scene"):
            frames["bloom"]
        assert frames.get("bloom") is None

    def test_equality_is_identity(self, frames: Frames) -> None:
        same = frames
        assert frames == same
        assert frames != copy.copy(frames)
        assert len({frames, frames}) == 1

    def test_repr_lists_every_framebuffer(self, frames: Frames) -> None:
        lines = repr(frames).splitlines()
        assert "Some <GPU> & co" in lines[0]
        assert [line.split()[0] for line in lines[1:]] == list(frames)
        assert lines[1].split(maxsplit=2)[1:] == ["float16", "(5, 7, 4)"]

    @pytest.mark.parametrize(
        "duplicate",
        [copy.copy, copy.deepcopy, lambda frames: pickle.loads(pickle.dumps(frames))],
        ids=["copy", "deepcopy", "pickle"],
    )
    def test_copies_and_pickles(self, frames: Frames, duplicate: Any) -> None:
        other = duplicate(frames)
        assert list(other) == list(frames)
        for name, array in frames.items():
            assert other[name].dtype == array.dtype
            assert other[name].tobytes() == array.tobytes()
        assert other.timings == frames.timings
        assert (other.settings, other.info) == (frames.settings, frames.info)

    @pytest.mark.parametrize(
        ("name", "array", "error"),
        [
            ("final", [[1.0]], TypeError),
            (3, np.zeros((1, 1, 3), np.uint8), TypeError),
            ("../final", np.zeros((1, 1, 3), np.uint8), ValueError),
            ("final", np.zeros((2, 2, 3)), ValueError),
            ("final", np.zeros((2, 2, 2), np.uint8), ValueError),
            ("final", np.zeros((2, 2, 1), np.float32), ValueError),
            ("final", np.zeros((0, 2, 3), np.uint8), ValueError),
            ("depth", np.zeros((2, 2), np.uint8), ValueError),
            ("depth", np.zeros((2, 2), np.float16), ValueError),
        ],
    )
    def test_refuses_what_is_no_framebuffer(
        self, name: Any, array: Any, error: type[Exception]
    ) -> None:
        with pytest.raises(error, match="arrays"):
            make({name: array})


class TestExr:
    def test_round_trip(self, frames: Frames, tmp_path: Path) -> None:
        assert frames.save(tmp_path / "out.exr") == [tmp_path / "out.exr"]
        assert names_in(tmp_path) == ["out.exr"]
        parts = read(tmp_path / "out.exr")
        assert list(parts) == list(frames)
        for name, array in frames.items():
            part = parts[name]
            depth = array.ndim == 2
            assert part.channels == (("Z",) if depth else tuple("RGBA"[: array.shape[2]]))
            assert part.pixels.shape == (*array.shape[:2], 1 if depth else array.shape[2])
            assert part.attributes["vkbloom:dtype"] == str(array.dtype)
            if name == "final":
                assert part.pixels.dtype == np.float16
            else:
                assert part.pixels.dtype == array.dtype
                assert part.pixels.tobytes() == array.tobytes()
        levels = np.rint(parts["final"].pixels.astype(np.float64) * 255)
        assert np.array_equal(levels, frames["final"])

    def test_attributes(self, frames: Frames, tmp_path: Path) -> None:
        frames.save(tmp_path / "out.exr")
        for part in read(tmp_path / "out.exr").values():
            stored = part.attributes
            for key, value in INFO.items():
                assert stored[f"vkbloom:{key}"] == str(value)
            settings = json.loads(stored["vkbloom:settings"])
            assert settings.pop("method") == "separable"
            assert Separable(**settings) == frames.settings
            assert json.loads(stored["vkbloom:timings"]) == TIMINGS
            assert stored["Software"] == "vkbloom 0.1.0"
            assert "Some <GPU> & co" in stored["ImageDescription"]

    def test_half_holds_every_8_bit_level(self, tmp_path: Path) -> None:
        levels = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(3, axis=2)
        make({"final": levels}).save(tmp_path / "out.exr")
        stored = read(tmp_path / "out.exr")["final"].pixels
        assert stored.dtype == np.float16
        assert stored.max() == 1
        assert np.array_equal(np.rint(255 * stored.astype(np.float64)), levels)

    @pytest.mark.parametrize("dtype", ["float16", "float32"])
    def test_keeps_nan_infinity_and_extremes(self, dtype: str, tmp_path: Path) -> None:
        limits = np.finfo(dtype)
        values = [np.nan, np.inf, -np.inf, -0.0, limits.max, limits.smallest_subnormal]
        image = np.array(values * 2, dtype).reshape(2, 2, 3)
        make({"final": image}).save(tmp_path / "out.exr")
        stored = read(tmp_path / "out.exr")["final"].pixels
        assert stored.dtype == image.dtype
        assert stored.tobytes() == image.tobytes()

    def test_parts_share_the_display_window_of_final(self, frames: Frames, tmp_path: Path) -> None:
        frames.save(tmp_path / "out.exr")
        reader = oiio.ImageInput.open(str(tmp_path / "out.exr"))
        assert reader is not None
        for index in range(len(frames)):
            assert reader.seek_subimage(index, 0)
            assert (reader.spec().full_width, reader.spec().full_height) == (13, 11)

    def test_upper_case_extension_is_one_file_too(self, frames: Frames, tmp_path: Path) -> None:
        assert frames.save(tmp_path / "out.EXR") == [tmp_path / "out.EXR"]
        assert list(read(tmp_path / "out.EXR")) == list(frames)


@pytest.mark.parametrize("extension", ["exr", "png", "tif"])
@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("size", [(1, 1), (1, 9), (17, 1), (13, 31)])
@pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
def test_every_size_and_dtype_comes_back(
    extension: str, channels: int, size: tuple[int, int], dtype: str, tmp_path: Path
) -> None:
    image = noise(*size, channels, dtype=dtype)
    (file,) = make({"final": image}).save(tmp_path / f"out.{extension}")
    (part,) = read(file).values()
    if dtype == "uint8" and extension == "exr":
        assert np.array_equal(np.rint(part.pixels.astype(np.float64) * 255), image)
    else:
        assert part.pixels.dtype == image.dtype
        assert part.pixels.tobytes() == image.tobytes()


@pytest.mark.parametrize("extension", ["exr", "png"])
@pytest.mark.parametrize(
    "view",
    [
        lambda a: a[::-1],
        lambda a: a[:, ::-2],
        lambda a: a.transpose(1, 0, 2),
        lambda a: a[..., ::-1],
        lambda a: np.broadcast_to(a[:1, :1], a.shape),
        lambda a: a[..., :3],
    ],
    ids=["flipped", "strided", "transposed", "channels", "broadcast", "rgb"],
)
@pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
def test_arrays_need_not_be_contiguous(
    extension: str, view: Any, dtype: str, tmp_path: Path
) -> None:
    image = view(noise(6, 8, 4, dtype=dtype))
    assert not image.flags.c_contiguous
    (file,) = make({"final": image}).save(tmp_path / f"out.{extension}")
    stored = next(iter(read(file).values())).pixels
    if dtype == "uint8" and extension == "exr":
        stored = np.rint(stored.astype(np.float64) * 255)
    assert np.array_equal(stored, image)


class TestFiles:
    def test_png_is_a_file_for_each_framebuffer(self, frames: Frames, tmp_path: Path) -> None:
        files = frames.save(str(tmp_path / "out.png"))
        assert [file.name for file in files] == [
            "out_glow.exr",
            "out_glow_depth.exr",
            "out_blur_vertical.exr",
            "out_scene.exr",
            "out_depth.exr",
            "out_final.png",
        ]
        assert names_in(tmp_path) == sorted(file.name for file in files)
        for (name, array), file in zip(frames.items(), files, strict=True):
            (part,) = read(file).values()
            assert part.pixels.dtype == array.dtype, name
            assert part.pixels.tobytes() == array.tobytes(), name

    def test_one_framebuffer_takes_the_path_itself(self, tmp_path: Path) -> None:
        frames = make({"bloom": noise(2, 3, 4, dtype="uint8")})
        assert frames.save(tmp_path / "a.b.png") == [tmp_path / "a.b.png"]
        assert names_in(tmp_path) == ["a.b.png"]

    def test_one_float_framebuffer_becomes_an_exr(self, tmp_path: Path) -> None:
        frames = make({"bloom": noise(2, 3, 4, dtype="float16")})
        assert frames.save(tmp_path / "a.png") == [tmp_path / "a.exr"]
        assert names_in(tmp_path) == ["a.exr"]

    @pytest.mark.parametrize("folder", ["new", "there", "with.dot", "slash.png/", "deep/er"])
    def test_folder(self, frames: Frames, folder: str, tmp_path: Path) -> None:
        (tmp_path / "there").mkdir()
        (tmp_path / "with.dot").mkdir()
        files = frames.save(f"{tmp_path}/{folder}")
        assert [file.name for file in files] == [
            f"{name}.png" if array.dtype == np.uint8 else f"{name}.exr"
            for name, array in frames.items()
        ]
        assert names_in(tmp_path / folder) == sorted(file.name for file in files)

    def test_png_tells_where_it_comes_from(self, tmp_path: Path) -> None:
        make({"final": noise(2, 3, 4, dtype="uint8")}).save(tmp_path / "a.png")
        stored = read(tmp_path / "a.png")[""].attributes
        assert stored["Software"] == "vkbloom 0.1.0"
        assert "Some <GPU> & co" in stored["ImageDescription"]
        assert '"blur_scale": 2.0' in stored["ImageDescription"]
        assert stored["vkbloom:driver"] == "driver 1.2"

    def test_transparent_colours_are_not_touched(self, tmp_path: Path) -> None:
        image = np.array([[[200, 100, 50, 0], [255, 1, 2, 1], [9, 8, 7, 128]]], np.uint8)
        for extension in ("png", "tif", "tga"):
            (file,) = make({"final": image}).save(tmp_path / f"a.{extension}")
            assert np.array_equal(read(file)[""].pixels, image), extension

    def test_other_formats_hold_what_they_can(self, tmp_path: Path) -> None:
        frames = make(
            {
                "glow": noise(2, 3, 4, dtype="float16"),
                "depth": noise(2, 3, dtype="float32"),
                "final": noise(2, 3, 3, dtype="uint8"),
            }
        )
        names = [file.name for file in frames.save(tmp_path / "a.tif")]
        assert names == ["a_glow.exr", "a_depth.tif", "a_final.tif"]
        stored = read(tmp_path / "a_depth.tif")[""].pixels
        assert stored.tobytes() == frames["depth"].tobytes()

    def test_alpha_is_left_out_only_where_it_is_opaque(self, tmp_path: Path) -> None:
        image = noise(8, 8, 4, dtype="uint8")
        image[..., 3] = 255
        (file,) = make({"final": image}).save(tmp_path / "a.ppm")
        assert file.name == "a.ppm"
        assert np.array_equal(read(file)[""].pixels, image[..., :3])
        image[3, 4, 3] = 254
        (file,) = make({"final": image}).save(tmp_path / "b.ppm")
        assert file.name == "b.exr"
        assert np.array_equal(np.rint(255.0 * read(file)["final"].pixels), image)

    def test_jpeg(self, tmp_path: Path) -> None:
        image = np.full((8, 8, 4), 255, np.uint8)
        assert make({"final": image}).save(tmp_path / "a.jpg") == [tmp_path / "a.jpg"]
        assert np.array_equal(read(tmp_path / "a.jpg")[""].pixels, image[..., :3])

    def test_stays_silent(
        self, frames: Frames, tmp_path: Path, capfd: pytest.CaptureFixture[str]
    ) -> None:
        for path in ("a.png", "a.jpg", "a.tif", "a.exr", "folder"):
            frames.save(tmp_path / path)
        assert capfd.readouterr() == ("", "")

    @pytest.mark.parametrize("extension", [".xyz", ".txt", ".null", ".term"])
    def test_unknown_extension(self, frames: Frames, extension: str, tmp_path: Path) -> None:
        with pytest.raises(ValueError, match=re.escape(repr(extension))):
            frames.save(tmp_path / f"out{extension}")
        assert names_in(tmp_path) == []

    def test_nothing_to_save(self, tmp_path: Path) -> None:
        with pytest.raises(ValueError, match="no framebuffer"):
            make({}).save(tmp_path / "out.png")

    @pytest.mark.parametrize("path", [3, None, b"out.png"])
    def test_path_of_a_wrong_type(self, frames: Frames, path: Any) -> None:
        with pytest.raises(TypeError):
            frames.save(path)

    def test_openimageio_missing(
        self, frames: Frames, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setitem(sys.modules, "OpenImageIO", None)
        with pytest.raises(ModuleNotFoundError, match=r"pip install vkbloom\[images\]"):
            frames.save(tmp_path / "out.png")


@contextlib.contextmanager
def small_files_only() -> Iterator[None]:
    """Let every write beyond 80,000 bytes of a file fail, as on a full disk."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (80_000, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)


class TestWriteErrors:
    @pytest.mark.parametrize("name", ["out.exr", "out.png", "out.tif"])
    def test_folder_is_not_there(self, frames: Frames, name: str, tmp_path: Path) -> None:
        with pytest.raises(FileNotFoundError) as caught:
            frames.save(tmp_path / "missing" / name)
        assert str(caught.value.filename).startswith(str(tmp_path / "missing" / "out"))

    @pytest.mark.parametrize("below", ["out.exr", "out.png", "folder"])
    def test_folder_is_a_file(self, frames: Frames, below: str, tmp_path: Path) -> None:
        (tmp_path / "file").write_text("kept")
        with pytest.raises(NotADirectoryError, match="file"):
            frames.save(tmp_path / "file" / below)
        assert (tmp_path / "file").read_text() == "kept"

    def test_file_is_a_folder(self, frames: Frames, tmp_path: Path) -> None:
        (tmp_path / "out_final.png").mkdir()
        with pytest.raises(IsADirectoryError) as caught:
            frames.save(tmp_path / "out.png")
        assert caught.value.filename == str(tmp_path / "out_final.png")
        assert not [name for name in names_in(tmp_path) if name.startswith(".")]

    def test_name_is_too_long(self, frames: Frames, tmp_path: Path) -> None:
        with pytest.raises(OSError, match=r"xxxx\.exr"):
            frames.save(tmp_path / ("x" * 300 + ".exr"))
        assert names_in(tmp_path) == []

    @pytest.mark.parametrize("extension", ["exr", "png", "tif", "tga", "bmp", "jpg", "webp"])
    def test_disk_is_full(self, extension: str, tmp_path: Path) -> None:
        frames = make({"final": noise(256, 256, 3, dtype="uint8")})
        file = tmp_path / f"out.{extension}"
        file.write_text("the one before")
        with small_files_only(), pytest.raises(OSError, match=re.escape(str(file))) as caught:
            frames.save(file)
        assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(file))
        assert names_in(tmp_path) == [file.name]
        assert file.read_text() == "the one before"

    # Without JPEG and WebP, whose writers would end the process or never return.
    @pytest.mark.parametrize("extension", ["exr", "png", "tif", "tga", "bmp"])
    def test_disk_fills_up_during_the_writing(
        self, extension: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        frames = make({"final": noise(256, 256, 3, dtype="uint8")})
        file = tmp_path / f"out.{extension}"
        file.write_text("the one before")
        with contextlib.ExitStack() as stack:

            def reserve(*arguments: Any) -> Path:
                reserved: Path = original(*arguments)
                stack.enter_context(small_files_only())
                return reserved

            original = vkbloom.frames._reserve
            monkeypatch.setattr(vkbloom.frames, "_reserve", reserve)
            with pytest.raises(OSError, match=re.escape(str(file))) as caught:
                frames.save(file)
        assert caught.value.filename == str(file)
        assert ".vkbloom-" not in str(caught.value)
        assert names_in(tmp_path) == [file.name]
        assert file.read_text() == "the one before"

    def test_of_several_files_none_is_written(self, tmp_path: Path) -> None:
        frames = make(
            {"glow": noise(2, 2, 4, dtype="uint8"), "final": noise(9, 9, 3, dtype="uint8")}
        )
        (tmp_path / "out_glow.png").write_text("the one before")
        original = Frames._write_image

        def write_image(self: Frames, oiio: Any, name: str, *files: Path) -> bool:
            if name == "final":
                raise OSError(errno.ENOSPC, "full", str(files[1]))
            return original(self, oiio, name, *files)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Frames, "_write_image", write_image)
            with pytest.raises(OSError, match=r"out_final\.png"):
                frames.save(tmp_path / "out.png")
        assert names_in(tmp_path) == ["out_glow.png"]
        assert (tmp_path / "out_glow.png").read_text() == "the one before"


class TestXarray:
    def test_variables_dimensions_and_coordinates(self, frames: Frames) -> None:
        dataset = frames.to_xarray()
        assert list(dataset.data_vars) == list(frames)
        assert dataset["final"].dims == ("y", "x", "channel")
        assert dataset["depth"].dims == ("y", "x")
        assert dataset["glow"].dims == ("glow_y", "glow_x", "channel")
        assert dataset["glow_depth"].dims == ("glow_y", "glow_x")
        assert dataset["blur_vertical"].dims == dataset["glow"].dims
        assert dataset["scene"].dims == ("y", "x", "scene_channel")
        assert dataset["channel"].values.tolist() == ["r", "g", "b", "a"]
        assert dataset["scene_channel"].values.tolist() == ["r", "g", "b"]
        for name, array in frames.items():
            assert dataset[name].dtype == array.dtype
            assert np.array_equal(dataset[name].values, array)
            assert np.shares_memory(dataset[name].values, array)

    def test_attributes_can_be_stored_by_netcdf(self, frames: Frames) -> None:
        attributes = frames.to_xarray().attrs
        assert {key: attributes[key] for key in INFO} == INFO
        assert json.loads(attributes["settings"])["method"] == "separable"
        assert json.loads(attributes["timings"]) == TIMINGS
        assert all(isinstance(value, str | int | float) for value in attributes.values())

    def test_levels_of_one_size_share_dimensions(self) -> None:
        sizes = {"down_0": 8, "down_1": 4, "up_0": 8, "bloom": 16, "final": 16}
        arrays = {name: np.zeros((n, n, 4), np.float32) for name, n in sizes.items()}
        named = dimensions(arrays)
        assert named["down_0"] == named["up_0"] == ("down_0_y", "down_0_x", "channel")
        assert named["down_1"] == ("down_1_y", "down_1_x", "channel")
        assert named["bloom"] == named["final"] == ("y", "x", "channel")

    def test_without_final_the_last_image_leads(self) -> None:
        arrays = {"glow": noise(2, 3, 4, dtype="uint8"), "depth": noise(4, 5, dtype="float32")}
        assert dimensions(arrays) == {
            "glow": ("y", "x", "channel"),
            "depth": ("depth_y", "depth_x"),
        }
        assert dimensions({"depth": arrays["depth"]}) == {"depth": ("y", "x")}

    def test_xarray_missing(self, frames: Frames, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "xarray", None)
        with pytest.raises(ModuleNotFoundError, match=r"pip install vkbloom\[grid\]"):
            frames.to_xarray()


class TestPng:
    @pytest.mark.parametrize("channels", [3, 4])
    @pytest.mark.parametrize("size", [(1, 1), (3, 5), (40, 33)])
    def test_shows_8_bit_as_stored(
        self, channels: int, size: tuple[int, int], tmp_path: Path
    ) -> None:
        image = noise(*size, channels, dtype="uint8")
        shown = make({"final": image, "glow": noise(2, 2, 3, dtype="uint8")})._repr_png_()
        assert np.array_equal(decode(shown, tmp_path), image)

    @pytest.mark.parametrize("dtype", ["float16", "float32"])
    def test_shows_linear_floats_by_the_srgb_curve(self, dtype: str, tmp_path: Path) -> None:
        # 188 is the 8-bit sRGB level of 0.5, 99 that of 0.125, 3 that of 0.001 (12.92 * 0.001).
        values = [-1.0, 0.0, 0.001, 0.125, 0.5, 1.0, 7.0, np.inf, -np.inf, np.nan]
        levels = [0, 0, 3, 99, 188, 255, 255, 255, 0, 0]
        image = np.array(values, dtype).reshape(1, -1, 1).repeat(4, axis=2)
        shown = decode(make({"final": image})._repr_png_(), tmp_path)
        assert shown[0, :, 0].tolist() == levels
        # Alpha has no transfer curve: 0.125 * 255 and 0.5 * 255, rounded to even.
        assert shown[0, 3:5, 3].tolist() == [32, 128]

    def test_does_not_encode_twice(self, tmp_path: Path) -> None:
        image = np.full((1, 1, 3), 0.2, np.float32)
        frames = make({"bloom": image, "final": image}, settings=Separable(encoding="srgb"))
        assert decode(frames._repr_png_(), tmp_path)[0, 0, 0] == 51
        # `bloom` comes before the encoding.
        frames = make({"bloom": image}, settings=Separable(encoding="srgb"))
        assert decode(frames._repr_png_(), tmp_path)[0, 0, 0] == 124

    def test_shows_depth_from_white_to_black(self, tmp_path: Path) -> None:
        depth = np.array([[0.5, 0.75, 1.0, np.inf]], np.float32)
        shown = decode(make({"depth": depth})._repr_png_(), tmp_path)
        assert shown[0, :, 0].tolist() == [255, 128, 0, 0]

    @pytest.mark.parametrize("value", [0.0, 1.0, np.nan, np.inf, -np.inf])
    @pytest.mark.filterwarnings("error")
    def test_shows_flat_depth_and_position(self, value: float, tmp_path: Path) -> None:
        flat = np.full((2, 3), value, np.float32)
        assert (decode(make({"depth": flat})._repr_png_(), tmp_path) == 255).all()
        position = np.stack([flat] * 3, axis=2)
        assert (decode(make({"position": position})._repr_png_(), tmp_path) == 0).all()

    def test_shows_g_buffers(self, tmp_path: Path) -> None:
        normal = np.array([[[-1, 0, 1, 1]]], np.float16)
        shown = decode(make({"normal": normal})._repr_png_(), tmp_path)
        assert shown[0, 0, :3].tolist() == [0, 128, 255]
        position = np.array([[[-4, 3, 9, 1], [4, 3, 1, 1], [0, 3, 5, 1]]], np.float16)
        shown = decode(make({"position": position})._repr_png_(), tmp_path)
        assert shown[0, :, 0].tolist() == [0, 255, 128]
        assert shown[0, :, 1].tolist() == [0, 0, 0]
        assert shown[0, :, 2].tolist() == [255, 0, 128]

    def test_without_final_the_last_image_is_shown(self, tmp_path: Path) -> None:
        glow, bloom = noise(2, 3, 4, dtype="uint8"), noise(4, 5, 4, dtype="uint8")
        frames = make({"glow": glow, "bloom": bloom, "depth": noise(2, 2, dtype="float32")})
        assert np.array_equal(decode(frames._repr_png_(), tmp_path), bloom)

    def test_leaves_the_framebuffers_as_they_are(self, frames: Frames) -> None:
        before = {name: array.tobytes() for name, array in frames.items()}
        frames._repr_png_(), frames._repr_html_(), contact_sheet_png(frames)
        assert {name: array.tobytes() for name, array in frames.items()} == before

    def test_empty(self) -> None:
        assert make({})._repr_png_() is None

    def test_needs_only_numpy(self, frames: Frames, monkeypatch: pytest.MonkeyPatch) -> None:
        with_everything = (frames._repr_png_(), frames._repr_html_())
        monkeypatch.setitem(sys.modules, "OpenImageIO", None)
        monkeypatch.setitem(sys.modules, "xarray", None)
        assert (frames._repr_png_(), frames._repr_html_()) == with_everything


class TestHtml:
    def pictures(self, page: str, folder: Path) -> list[NDArray[np.uint8]]:
        found = re.findall(r'src="data:image/png;base64,([^"]+)"', page)
        return [decode(base64.b64decode(data, validate=True), folder) for data in found]

    def test_shows_every_framebuffer_with_its_name_size_and_dtype(
        self, frames: Frames, tmp_path: Path
    ) -> None:
        page = frames._repr_html_()
        pictures = self.pictures(page, tmp_path)
        assert [picture.shape[:2] for picture in pictures] == [a.shape[:2] for a in frames.values()]
        assert re.findall(r'alt="(\w+),', page) == list(frames)
        assert page.count("13 x 11, uint8") == page.count("13 x 11, uint8</span>") + 1 == 2

    def test_pictures_are_averaged_down(self, tmp_path: Path) -> None:
        image = np.zeros((200, 960, 3), np.uint8)
        image[:, ::3] = 90
        image[::2] += 40
        wide, odd = make({"final": image}), make({"final": image[:199, :641]})
        (picture,) = self.pictures(wide._repr_html_(), tmp_path)
        assert picture.shape == (67, 320, 3)
        # Groups of 3 x 3 pixels (some 3 x 2): a third of the columns at 90, 1 to 2 rows at 40.
        assert set(np.unique(picture).tolist()) <= {43, 50, 57}
        # The average of all groups is that of the image, within the uneven groups' weights.
        assert abs(picture.mean() - image.mean()) < 0.5
        (picture,) = self.pictures(odd._repr_html_(), tmp_path)
        assert picture.shape == (99, 320, 3)

    def test_alpha_hides_nothing(self, tmp_path: Path) -> None:
        image = np.full((2, 2, 4), (10, 20, 30, 0), np.uint8)
        (picture,) = self.pictures(make({"final": image})._repr_html_(), tmp_path)
        assert picture[0, 0].tolist() == [10, 20, 30]

    def test_everything_is_escaped_and_nothing_runs(self) -> None:
        frames = make(
            {"final": noise(1, 1, 3, dtype="uint8")}, timings={"<i>pass": 1.0}, settings=Noted()
        )
        page = frames._repr_html_()
        assert "<script" not in page
        assert "&lt;/code&gt;&lt;script&gt;" in page
        assert "Some &lt;GPU&gt; &amp; co" in page
        assert "&lt;i&gt;pass" in page
        assert not {"<GPU>", "<i>", " & "} & set(re.findall(r"<GPU>|<i>| & ", page))
        assert not re.search(r"\son\w+=", page)

    def test_takes_the_colours_of_the_page(self, frames: Frames) -> None:
        page = frames._repr_html_()
        assert "color-scheme:light dark" in page
        assert set(re.findall(r"[^-]color:([^;\"]+)", page)) == {"inherit"}

    def test_pass_times_are_bars(self, frames: Frames) -> None:
        page = frames._repr_html_()
        assert re.findall(r'<div style="width:([\d.]+)%;', page) == ["25.0", "100.0", "50.0"]
        assert re.findall(r"([\d.]+) ms", page) == ["1.000", "4.000", "2.000"]

    @pytest.mark.parametrize("timings", [{}, {"glow": 0.0}, {"glow": float("nan")}])
    def test_pass_times_that_tell_nothing(self, timings: dict[str, float]) -> None:
        page = make({"final": noise(1, 1, 3, dtype="uint8")}, timings=timings)._repr_html_()
        assert ("Time of each pass" in page) == bool(timings)
        assert "nan%" not in page

    def test_tags_are_closed(self, frames: Frames) -> None:
        for page in (frames._repr_html_(), make({}, timings={})._repr_html_()):
            for tag in ("div", "figure", "figcaption", "code", "span", "b"):
                assert len(re.findall(f"<{tag}[ >]", page)) == page.count(f"</{tag}>"), tag

    def test_page_of_large_framebuffers_is_small(self) -> None:
        ramp = np.linspace(0, 255, 1920).astype(np.uint8)
        image = np.broadcast_to(ramp[np.newaxis, :, np.newaxis], (1080, 1920, 4))
        page = make({f"down_{level}": image for level in range(9)})._repr_html_()
        assert len(page) < 100_000


class TestContactSheet:
    def test_holds_every_picture_in_rows(self, tmp_path: Path) -> None:
        colours = {"glow": (250, 0, 0), "bloom": (0, 250, 0), "final": (0, 0, 250)}
        heights = {"glow": 90, "bloom": 45, "final": 90}
        frames = make(
            {name: np.full((heights[name], 160, 3), colours[name], np.uint8) for name in colours}
        )
        sheet = decode(contact_sheet_png(frames, columns=2, width=160), tmp_path)
        # Margins of 11 pixels, two lines of title, three of labels; "bloom" is half as high.
        boxes = {"glow": (33, 11), "bloom": (33 + 22, 182), "final": (33 + 90 + 44, 11)}
        for name, colour in colours.items():
            rows, columns = np.nonzero((sheet == colour).all(axis=2))
            assert len(rows) == heights[name] * 160
            assert (rows.min(), columns.min()) == boxes[name]
            assert (rows.max(), columns.max()) == (
                boxes[name][0] + heights[name] - 1,
                boxes[name][1] + 159,
            )

    def test_labels_are_drawn(
        self, frames: Frames, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        labelled = decode(contact_sheet_png(frames), tmp_path)
        monkeypatch.setitem(sys.modules, "OpenImageIO", None)
        with pytest.warns(UserWarning, match=r"no labels.*vkbloom\[images\]"):
            data = contact_sheet_png(frames)
        monkeypatch.undo()
        bare = decode(data, tmp_path)
        changed = np.nonzero((labelled != bare).any(axis=(1, 2)))[0]
        assert labelled.shape == bare.shape
        # A title, then two lines below each of the two rows of pictures.
        assert np.count_nonzero(np.diff(changed) > 50) == 2
        assert labelled[changed].max() > 200

    def test_missing_fonts_are_a_warning(
        self, frames: Frames, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(oiio.ImageBufAlgo, "render_text", lambda *arguments: False)
        with pytest.warns(UserWarning, match="no labels"):
            assert contact_sheet_png(frames).startswith(b"\x89PNG")

    @pytest.mark.parametrize("size", [(1, 1), (1, 3000), (3000, 1)])
    def test_strips_stay_within_bounds(self, size: tuple[int, int], tmp_path: Path) -> None:
        frames = make(
            {"glow": noise(4, 4, 4, dtype="uint8"), "final": noise(*size, 3, dtype="uint8")}
        )
        sheet = decode(contact_sheet_png(frames), tmp_path)
        assert max(sheet.shape) < 1000

    @pytest.mark.parametrize(
        ("arguments", "error", "message"),
        [
            ({"columns": 0}, ValueError, "columns: 0 is outside 1 to 32"),
            ({"width": 127}, ValueError, "width: 127 is outside 128 to 4096"),
            ({"width": 320.0}, TypeError, "width: an int"),
        ],
    )
    def test_arguments_out_of_range(
        self, frames: Frames, arguments: dict[str, Any], error: type[Exception], message: str
    ) -> None:
        with pytest.raises(error, match=message):
            contact_sheet_png(frames, **arguments)

    def test_empty(self) -> None:
        with pytest.raises(ValueError, match="frames"):
            contact_sheet_png(make({}))
