"""Settings and frames are read back from files as they were written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.framebuffers import make

IMAGE = np.random.default_rng(2).random((5, 7, 4), dtype=np.float32)


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

    def test_files_of_two_calls(self, tmp_path: Path) -> None:
        image = np.full((5, 7, 3), 9, np.uint8)
        make({"glow": image, "final": image}).save(tmp_path / "a.png")
        make({"glow": image.astype(np.float16), "final": image}).save(tmp_path / "a.png")
        with pytest.raises(ValueError, match=r"a_glow\.\w+: glow is in .*a_glow\.\w+ as well"):
            vkbloom.Frames.load(tmp_path / "a.png")

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
