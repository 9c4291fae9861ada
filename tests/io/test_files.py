"""Image files of framebuffers: their content, their paths, and the state after failures."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import random
import re
import resource
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from tests.exhaustive import by_turns
from tests.framebuffers import INFO, TIMINGS, make, make_mixed, names_in, read
from tests.images import noise
from vkbloom import Frames, Separable
from vkbloom._io import safe_writing


@pytest.fixture
def frames() -> Frames:
    return make_mixed()


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

    def test_parts_share_the_display_window_of_final(self, frames: Frames, tmp_path: Path) -> None:
        frames.save(tmp_path / "out.exr")
        reader = oiio.ImageInput.open(str(tmp_path / "out.exr"))
        assert reader is not None
        for index in range(len(frames)):
            assert reader.seek_subimage(index, 0)
            assert (reader.spec().full_width, reader.spec().full_height) == (13, 11)


@pytest.mark.parametrize(
    ("extension", "dtype", "size", "channels"),
    by_turns(
        ["exr", "png", "tif"],
        ["uint8", "float16", "float32"],
        [(1, 1), (1, 9), (17, 1), (13, 31)],
        turns=[3, 4],
    ),
)
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
        # Of floats the largest alpha is 1, not 255.
        for alpha, name in ((1, "c.hdr"), (255, "c.exr")):
            frames = make({"final": np.full((8, 8, 4), (0.5, 0.5, 0.5, alpha), np.float32)})
            assert frames.save(tmp_path / "c.hdr") == [tmp_path / name]

    def test_no_name(self, frames: Frames, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        with pytest.raises(ValueError, match=r"^path: '' is not the name of a file"):
            frames.save("")
        assert names_in(tmp_path) == []
        frames.save(".")
        assert "final.png" in names_in(tmp_path)

    def test_nothing_to_save(self, tmp_path: Path) -> None:
        with pytest.raises(ValueError, match="no framebuffer"):
            make({}).save(tmp_path / "out.png")

    @pytest.mark.parametrize("path", [3, None, b"out.png"])
    def test_path_of_a_wrong_type(self, frames: Frames, path: Any) -> None:
        with pytest.raises(TypeError):
            frames.save(path)


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


class TestWhatIsThere:
    @pytest.mark.parametrize("name", ["out.exr", "out.png"])
    def test_links_are_written_through(self, name: str, tmp_path: Path) -> None:
        (tmp_path / "elsewhere").mkdir()
        target, link = tmp_path / "elsewhere" / f"target-{name}", tmp_path / name
        link.symlink_to(target)
        frames = make({"final": noise(4, 5, 3, dtype="uint8")})
        # The first time there is nothing behind the link.
        for _ in range(2):
            assert frames.save(link) == [link]
            assert link.is_symlink()
            assert names_in(target.parent) == [target.name]
            assert len(read(target)) == 1

    def test_a_link_to_nowhere(self, tmp_path: Path) -> None:
        link = tmp_path / "out.exr"
        link.symlink_to(tmp_path / "no" / "out.exr")
        with pytest.raises(FileNotFoundError) as caught:
            make({"final": noise(4, 5, 3, dtype="uint8")}).save(link)
        assert caught.value.filename == str(link)
        assert names_in(tmp_path) == ["out.exr"]

    def test_a_current_folder_that_is_gone(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        gone = tmp_path / "gone"
        gone.mkdir()
        monkeypatch.chdir(gone)
        gone.rmdir()
        with pytest.raises(FileNotFoundError) as caught:
            make({"final": noise(4, 5, 3, dtype="uint8")}).save("out.exr")
        assert caught.value.filename == "out.exr"

    def test_permissions_stay(self, tmp_path: Path) -> None:
        file = tmp_path / "out.exr"
        frames = make({"final": noise(4, 5, 3, dtype="uint8")})
        frames.save(file)
        file.chmod(0o600)
        frames.save(file)
        assert stat.S_IMODE(file.stat().st_mode) == 0o600


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

    # While JPEG and WebP are written, their writers would end the process or never return.
    @pytest.mark.parametrize(
        ("extension", "before"),
        [
            *((one, True) for one in ("exr", "png", "tif", "tga", "bmp", "jpg", "webp")),
            *((one, False) for one in ("exr", "png", "tif", "tga", "bmp")),
        ],
    )
    def test_disk_is_full(
        self, extension: str, before: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Before the space is reserved, or during the writing."""
        frames = make({"final": noise(256, 256, 3, dtype="uint8")})
        file = tmp_path / f"out.{extension}"
        file.write_text("the one before")
        with contextlib.ExitStack() as stack:

            def reserve(*arguments: Any) -> Path:
                reserved: Path = original(*arguments)
                stack.enter_context(small_files_only())
                return reserved

            original = safe_writing.reserve
            if before:
                stack.enter_context(small_files_only())
            else:
                monkeypatch.setattr(safe_writing, "reserve", reserve)
            with pytest.raises(OSError, match=re.escape(str(file))) as caught:
                frames.save(file)
        assert caught.value.filename == str(file)
        assert not before or caught.value.errno == errno.EFBIG
        assert ".vkbloom-" not in str(caught.value)
        assert names_in(tmp_path) == [file.name]
        assert file.read_text() == "the one before"

    def test_an_interrupt_leaves_nothing(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def interrupt(*_: Any) -> None:
            raise KeyboardInterrupt

        monkeypatch.setattr("vkbloom._io.safe_writing.os.posix_fallocate", interrupt)
        with pytest.raises(KeyboardInterrupt):
            safe_writing.reserve(tmp_path / "a.png", 9)
        assert names_in(tmp_path) == []
        monkeypatch.setattr(Path, "replace", interrupt)
        with pytest.raises(KeyboardInterrupt):
            safe_writing.write_file(tmp_path / "a.png", b"bytes")
        assert names_in(tmp_path) == []

    @pytest.mark.parametrize("name", ["a.png", "a.txt"])
    def test_a_kill_leaves_the_old_file_or_the_new_one(self, name: str, tmp_path: Path) -> None:
        file, old, new = tmp_path / name, b"o" * 300_000, b"n" * 200_000
        code = (
            "from pathlib import Path\n"
            "from vkbloom._io.safe_writing import write_file\n"
            f"file = Path({str(file)!r})\n"
            "while True:\n"
            "    write_file(file, b'n' * 200_000)\n"
            "    write_file(file, b'o' * 300_000)\n"
        )
        for _ in range(5):
            with subprocess.Popen([sys.executable, "-c", code]) as child:
                while not file.exists():
                    assert child.poll() is None
                time.sleep(0.02 * random.random())
                child.kill()
            assert file.read_bytes() in (old, new)

    @pytest.mark.parametrize("reason", [errno.EOPNOTSUPP, errno.EINVAL, None])
    def test_space_without_the_systems_help(
        self, reason: int | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def refuse(*_: Any) -> None:
            assert reason is not None
            raise OSError(reason, "not here")

        if reason is None:
            monkeypatch.delattr(os, "posix_fallocate")
        else:
            monkeypatch.setattr(os, "posix_fallocate", refuse)
        size = 3 << 20
        assert safe_writing.reserve(tmp_path / "a.png", size).stat().st_size > size
        file = tmp_path / "b.png"
        with small_files_only(), pytest.raises(OSError, match=r"b\.png") as caught:
            safe_writing.reserve(file, size)
        assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(file))
        assert len(names_in(tmp_path)) == 1

    def test_of_several_files_none_is_written(self, tmp_path: Path) -> None:
        frames = make(
            {"glow": noise(2, 2, 4, dtype="uint8"), "final": noise(9, 9, 3, dtype="uint8")}
        )
        (tmp_path / "out_glow.png").write_text("the one before")
        original = safe_writing.check_complete

        def check(oiio: Any, temporary: Path, file: Path) -> None:
            if file.name == "out_final.png":
                raise OSError(errno.ENOSPC, "full", str(file))
            original(oiio, temporary, file)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(safe_writing, "check_complete", check)
            with pytest.raises(OSError, match=r"out_final\.png"):
                frames.save(tmp_path / "out.png")
        assert names_in(tmp_path) == ["out_glow.png"]
        assert (tmp_path / "out_glow.png").read_text() == "the one before"
