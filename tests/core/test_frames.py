"""Frames: the mapping and its Dataset."""

from __future__ import annotations

import copy
import json
import pickle
import sys
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pytest

from tests.framebuffers import INFO, TIMINGS, make, make_mixed
from tests.images import noise
from vkbloom import Frames, Separable


@pytest.fixture
def frames() -> Frames:
    return make_mixed()


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


def dimensions(arrays: Mapping[str, np.ndarray[Any, Any]]) -> dict[str, tuple[Hashable, ...]]:
    """Return those of each framebuffer in a Dataset."""
    dataset = make(arrays, timings={}).to_xarray()
    return {name: dataset[name].dims for name in arrays}


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
        with pytest.raises(ModuleNotFoundError, match=r"pip install vkbloom\[grid\]") as caught:
            frames.to_xarray()
        assert caught.value.name == "xarray"
