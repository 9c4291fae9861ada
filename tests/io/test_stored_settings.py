"""Settings and frames come back from what they were written to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom

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

    @pytest.mark.parametrize(
        ("kind", "fields", "error", "message"),
        [
            (vkbloom.Settings, {}, ValueError, "method: None is not one of separable, pyramid"),
            (vkbloom.Settings, {"method": "x"}, ValueError, "method: 'x' is not one of separable"),
            (vkbloom.Pyramid, {"method": "separable"}, ValueError, "is not the 'pyramid' of Pyr"),
            (vkbloom.Pyramid, {"offset": 1}, ValueError, "pyramid has no 'offset'; it has bloom"),
            (vkbloom.Pyramid, {"levels": 99}, ValueError, "levels: 99 is out of range"),
            (vkbloom.Pyramid, [1], TypeError, "fields: a mapping is needed, not list"),
        ],
    )
    def test_wrong_ones(self, kind: Any, fields: Any, error: type[Exception], message: str) -> None:
        with pytest.raises(error, match=message):
            kind.from_dict(fields)
        with pytest.raises(error, match=message):
            kind.from_json(json.dumps(fields))

    @pytest.mark.parametrize("text", ["", "{", "[" * 100000])
    def test_no_json(self, text: str) -> None:
        with pytest.raises(ValueError, match=r"."):
            vkbloom.Settings.from_json(text)


class TestFrames:
    @pytest.mark.parametrize("name", ["a.exr", "a.png", "folder"])
    @pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
    def test_come_back(
        self, renderer: vkbloom.Renderer, tmp_path: Path, name: str, dtype: str
    ) -> None:
        pytest.importorskip("OpenImageIO")
        image = (IMAGE * 255).astype(dtype) if dtype == "uint8" else IMAGE.astype(dtype)
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

    def test_a_scene_with_depth(self, renderer: vkbloom.Renderer, tmp_path: Path) -> None:
        pytest.importorskip("OpenImageIO")
        frames = renderer.render(vkbloom.Scene.ufo(), size=(16, 9))
        frames.save(tmp_path / "a.exr")
        again = vkbloom.Frames.load(tmp_path / "a.exr")
        assert {key: (a.dtype, a.shape) for key, a in again.items()} == {
            key: (a.dtype, a.shape) for key, a in frames.items()
        }
        assert all(np.array_equal(again[key], frames[key]) for key in frames)

    def test_other_files(self, tmp_path: Path) -> None:
        pytest.importorskip("OpenImageIO")
        with pytest.raises(FileNotFoundError):
            vkbloom.Frames.load(tmp_path / "no.exr")
        path = vkbloom.write(tmp_path / "a.png", IMAGE)
        with pytest.raises(ValueError, match=r"a\.png: not written by Frames\.save"):
            vkbloom.Frames.load(path)
