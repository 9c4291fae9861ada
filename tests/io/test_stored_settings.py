"""Settings and frames are read back from files as they were written."""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import os
import random
import re
import shutil
import subprocess
import sys
import time
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.framebuffers import make
from vkbloom._io import safe_writing
from vkbloom._renderer import frame_files

IMAGE = np.random.default_rng(2).random((5, 7, 4), dtype=np.float32)


def interrupt_after(count: int, patch: pytest.MonkeyPatch) -> None:
    """Let the renaming of a save's files be interrupted."""
    original, done = safe_writing.put_in_place, itertools.count()

    def put(temporary: Path, file: Path) -> None:
        if next(done) == count:
            raise KeyboardInterrupt
        original(temporary, file)

    patch.setattr(safe_writing, "put_in_place", put)


class TestSettings:
    @pytest.mark.parametrize("name", vkbloom.presets)
    def test_come_back(self, name: str) -> None:
        settings = vkbloom.presets[name].replace(bloom_size=(9, 4), intensity=0.25)
        assert vkbloom.Settings.from_dict(settings.to_dict()) == settings
        assert vkbloom.Settings.from_json(settings.to_json()) == settings
        assert type(settings).from_json(settings.to_json()) == settings

    def test_missing_keys_are_defaults(self) -> None:
        assert vkbloom.Settings.from_dict({"method": "pyramid"}) == vkbloom.Pyramid()
        assert vkbloom.Pyramid.from_dict({"levels": 3}) == vkbloom.Pyramid(levels=3)


def pack(shape: list[Any], count: int) -> str:
    """Return settings with an array that has `count` zeros, and says that it has a shape."""
    data = base64.b64encode(zlib.compress(bytes(4 * count))).decode()
    values = {"shape": shape, "zlib": data}
    return json.dumps({"method": "convolution", "psf": {"psf": "samples", "values": values}})


class TestPackedArrays:
    @pytest.mark.parametrize(
        ("shape", "count"),
        [
            ([1 << 13, 1 << 13], 1 << 26),
            ([1 << 13, 1 << 13], 4),
            ([1 << 40, 1 << 40], 4),
            ([2, 2], 1 << 26),
            ([2, 2], 5),
            ([2, 2], 3),
            ([-2, -2], 4),
            ([2.5, 2], 5),
            (["9" * 100_000], 4),
        ],
    )
    def test_a_short_text_cannot_claim_the_memory(self, shape: list[Any], count: int) -> None:
        text = pack(shape, count)
        tracemalloc.start()
        try:
            with pytest.raises((ValueError, TypeError), match="array") as caught:
                vkbloom.Settings.from_json(text)
            assert tracemalloc.get_traced_memory()[1] < 8 << 20
        finally:
            tracemalloc.stop()
        assert len(str(caught.value)) < 300

    def test_sparse_kernels_come_back(self) -> None:
        kernel = np.zeros((1500, 2000), np.float32)
        kernel[750, 1000] = 1
        settings = vkbloom.Convolution(kernel)
        assert vkbloom.Settings.from_json(settings.to_json()) == settings


class TestFrames:
    @pytest.mark.parametrize("name", ["a.exr", "a.png", "a.tif", "folder"])
    @pytest.mark.parametrize("source", ["uint8", "float16", "float32", "scene"])
    def test_come_back(
        self, renderer: vkbloom.Renderer, tmp_path: Path, name: str, source: str
    ) -> None:
        if source == "scene":  # with depth
            frames = renderer.render(vkbloom.Scene.ufo(), size=(16, 9))
        else:
            image = (IMAGE * (255 if source == "uint8" else 1)).astype(source)
            frames = renderer.apply(image, vkbloom.Pyramid(levels=2, threshold=0.3))
        frames.save(tmp_path / name)
        again = vkbloom.Frames.load(tmp_path / name)
        assert list(again) == list(frames)
        for key, array in frames.items():
            assert again[key].dtype == array.dtype
            assert np.array_equal(again[key], array)
        assert again.settings == frames.settings
        assert again.timings == pytest.approx(dict(frames.timings), nan_ok=True)
        assert again.info == frames.info

    def test_jpeg_has_the_settings(self, tmp_path: Path) -> None:
        frames = make({"final": np.full((16, 16, 3), 90, np.uint8)})
        frames.save(tmp_path / "a.jpg")
        again = vkbloom.Frames.load(tmp_path / "a.jpg")
        assert (again.settings, again.info) == (frames.settings, frames.info)
        assert np.abs(again["final"].astype(int) - 90).max() <= 1

    @pytest.mark.parametrize("name", ["a.png", "a.tif", "."])
    def test_files_beside_them_are_left_out(self, tmp_path: Path, name: str) -> None:
        image = np.random.default_rng(1).integers(0, 256, (5, 7, 3), dtype=np.uint8)
        frames = make({"glow": image, "final": image[::-1]})
        frames.save(tmp_path / name)
        # Of a name that begins alike, of no name of a framebuffer, of another program.
        make({"glow": image, "bloom": image}).save(tmp_path / f"a_2{Path(name).suffix or '.png'}")
        vkbloom.write(tmp_path / f"a_photo{Path(name).suffix or '.png'}", image)
        (tmp_path / "words.txt").write_text("words")
        again = vkbloom.Frames.load(tmp_path / name)
        assert list(again) == ["glow", "final"]
        assert np.array_equal(again["final"], image[::-1])

    @pytest.mark.parametrize("name", ["a.png", "a.tif", "a.exr", "folder"])
    def test_the_last_save_counts(self, tmp_path: Path, name: str) -> None:
        """More framebuffers, fewer, one, in another dtype: nothing of an earlier save is left."""
        image = np.full((5, 7, 3), 9, np.uint8)
        (tmp_path / "folder").mkdir()
        vkbloom.write(tmp_path / "folder" / "photo.png", image)
        make({"final": image}).save(tmp_path / "folder" / "a.png")
        vkbloom.write(tmp_path / "a_photo.png", image)
        others = {path for path in tmp_path.rglob("*") if path.is_file()}
        saves: list[dict[str, Any]] = [
            {"glow": image, "bloom": image, "final": image},
            {"glow": image.astype(np.float16), "final": image + 1},
            {"final": image + 2},
            {"final": image.astype(np.float16)},
            {"glow": image, "bloom": image, "final": image + 3},
        ]
        for number, arrays in enumerate(saves):
            settings = vkbloom.Separable(blur_scale=number + 1)
            files = make(arrays, settings=settings).save(tmp_path / name)
            again = vkbloom.Frames.load(tmp_path / name)
            assert list(again) == list(arrays)
            assert all(np.array_equal(again[key], array) for key, array in arrays.items())
            assert again.settings == settings
            assert {path for path in tmp_path.rglob("*") if path.is_file()} == {*files, *others}

    @pytest.mark.parametrize("name", ["a.png", "folder"])
    @pytest.mark.parametrize("has_identity", [True, False])
    def test_a_mixture_of_two_saves(self, tmp_path: Path, name: str, has_identity: bool) -> None:
        image = np.full((5, 7, 3), 9, np.uint8)
        kept = {}
        for number in range(2):
            settings = vkbloom.Separable(blur_scale=number + 1)
            made = make({"glow": image, "bloom": image, "final": image}, settings=settings)
            with pytest.MonkeyPatch.context() as patch:
                if not has_identity:
                    patch.setattr(frame_files, "fact_of", lambda *_: "")
                files = made.save(tmp_path / name)
            kept[number] = files[0].read_bytes()
        files[0].write_bytes(kept[0])
        names = [file.name for file in files]
        os.utime(files[0], (0, 0))
        said = f"holds files of 2 saves; the newest: {names[1]}, {names[2]}; older: {names[0]}; "
        with pytest.raises(ValueError, match=re.escape(f"{tmp_path / name}: {said}")):
            vkbloom.Frames.load(tmp_path / name)
        assert list(vkbloom.Frames.load(files[0])) == ["glow"]

    def test_an_old_file_beside_newer_ones(self, tmp_path: Path) -> None:
        image = np.full((5, 7, 3), 9, np.uint8)
        make({"final": image}).save(tmp_path / "a.png")
        old = (tmp_path / "a.png").read_bytes()
        # This one is of no save to a.png.
        make({"bloom": image}).save(tmp_path / "a_bloom.png")
        assert list(vkbloom.Frames.load(tmp_path / "a.png")) == ["final"]
        make({"glow": image, "final": image}).save(tmp_path / "a.png")
        (tmp_path / "a.png").write_bytes(old)
        with pytest.raises(ValueError, match=r"a\.png: holds files of 2 saves.*a_final\.png"):
            vkbloom.Frames.load(tmp_path / "a.png")

    @pytest.mark.parametrize("count", [0, 1, 2, 3])
    @pytest.mark.parametrize("is_killed", [True, False])
    def test_an_interrupted_save(self, tmp_path: Path, count: int, is_killed: bool) -> None:
        """A save ends after `count` of three files were renamed, over an earlier one or nothing."""
        image = np.full((5, 7, 3), 9, np.uint8)
        old = make({"glow": image, "bloom": image, "final": image})
        new = make({"glow": image, "bloom": image + 1, "final": image + 2}, timings={"glow": 1.0})
        for folder in (tmp_path / "new", tmp_path / "over"):
            if folder.name == "over":
                old.save(folder)
            with pytest.MonkeyPatch.context() as patch:
                interrupt_after(count, patch)
                if is_killed:
                    # Nothing is put back.
                    patch.setattr(safe_writing, "_backup_of", lambda _: None)
                with contextlib.suppress(KeyboardInterrupt):
                    new.save(folder)
            expected = new if count == 3 else old if folder.name == "over" else None
            if expected is not None and (count in (0, 3) or not is_killed):
                again = vkbloom.Frames.load(folder)
                assert np.array_equal(again["final"], expected["final"])
                assert again.timings == dict(expected.timings)
            else:
                with pytest.raises((ValueError, FileNotFoundError)):
                    vkbloom.Frames.load(folder)
            assert not [file for file in folder.iterdir() if safe_writing.is_temporary(file)]

    def test_a_killed_process(self, tmp_path: Path) -> None:
        """Saves of five and of nine framebuffers over each other, ended at any time."""
        code = (
            "import sys, itertools, numpy as np\n"
            "from tests.framebuffers import make\n"
            "for n in itertools.count():\n"
            "    image = np.full((32, 32, 3), n % 256, np.uint8)\n"
            "    names = 'abcdefghi'[: 9 if n % 2 else 5]\n"
            "    make({name: image for name in names}, timings={'a': n}).save(sys.argv[1])\n"
            "    print(n, flush=True)\n"
        )
        words = [sys.executable, "-c", code, str(tmp_path / "folder")]
        for _ in range(3):
            with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as child:
                assert child.stdout is not None
                assert child.stdout.readline() == "0\n"
                time.sleep(0.1 * random.random())
                child.kill()
            frames, refused = None, ""
            try:
                frames = vkbloom.Frames.load(tmp_path / "folder")
            except ValueError as error:
                refused = str(error)
            if frames is None:
                assert "holds files of 2 saves" in refused or "is missing, which a" in refused
                shutil.rmtree(tmp_path / "folder")
                continue
            number = int(frames.timings["a"])
            assert len(frames) == (9 if number % 2 else 5)
            assert all((image == number % 256).all() for image in frames.values())

    def test_settings_come_back_from_zarr(self, tmp_path: Path) -> None:
        """What `to_xarray` gives has them as JSON in its attributes, for any method."""
        xarray = pytest.importorskip("xarray")
        settings = vkbloom.presets["godot_4_5"]
        dataset = make({"final": np.zeros((5, 7, 3), np.uint8)}, settings=settings).to_xarray()
        # Version 2, since version 3 has no text yet, which the names of channels are.
        dataset.to_zarr(tmp_path / "a.zarr", zarr_format=2)
        with xarray.open_zarr(tmp_path / "a.zarr") as stored:
            assert vkbloom.Settings.from_json(stored.attrs["settings"]) == settings

    def test_a_format_without_a_place_for_settings(self, tmp_path: Path) -> None:
        (path,) = make({"final": np.zeros((5, 7, 3), np.uint8)}).save(tmp_path / "a.bmp")
        with pytest.raises(ValueError, match=r"a\.bmp: not written by Frames\.save"):
            vkbloom.Frames.load(path)
