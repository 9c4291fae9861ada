"""Contact sheets and curves of grids."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

import vkbloom
from tests.images import noise
from vkbloom import Renderer, Separable, contact_sheet, reductions, response_curves
from vkbloom._grid.selection import select

xr = pytest.importorskip("xarray")
pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def dataset(renderer: Renderer) -> Any:
    image = noise(10, 20, 3, dtype="uint8")
    axes: dict[str, Any] = {
        "tonemap": ["none", "aces"],
        "blur_scale": np.linspace(0.5, 2, 4),
        "intensity": [0.0, 0.5, 1.0],
    }
    reduce = {
        "mean": reductions.Mean(),
        "energy": reductions.EncircledEnergy(radii=(2, 4)),
    }
    return vkbloom.grid(
        image, Separable(), axes, framebuffers=("final", "bloom"), reduce=reduce, renderer=renderer
    )


def pixels(png: bytes, tmp_path: Path) -> Any:
    path = tmp_path / "sheet.png"
    path.write_bytes(png)
    return oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8)


class TestContactSheet:
    def test_every_cell_is_its_picture(self, dataset: Any, tmp_path: Path) -> None:
        sheet = pixels(contact_sheet(dataset, width=80, at={"tonemap": "aces"}), tmp_path)
        found = 0
        for row in range(4):
            for column in range(3):
                cell = dataset["final"].values[1, row, column]
                large = cell.repeat(4, axis=0).repeat(4, axis=1)
                height, width, _ = large.shape
                # Its corner may be in many places, all of it in one.
                corners = np.argwhere((sheet == large[0, 0]).all(axis=2))
                found += any(
                    np.array_equal(sheet[y : y + height, x : x + width], large) for y, x in corners
                )
        assert found == 12

    def test_the_axes_can_be_chosen(self, dataset: Any, tmp_path: Path) -> None:
        wide = pixels(contact_sheet(dataset, "tonemap", "blur_scale", width=48), tmp_path)
        high = pixels(contact_sheet(dataset, "blur_scale", "tonemap", width=48), tmp_path)
        assert wide.shape[1] > high.shape[1]
        assert wide.shape[0] < high.shape[0]

    def test_long_axes_are_thinned(self, dataset: Any, tmp_path: Path) -> None:
        two = pixels(contact_sheet(dataset, width=48, most=2), tmp_path)
        assert two.shape[1] < pixels(contact_sheet(dataset, width=48), tmp_path).shape[1]

    def test_parts_and_single_points(self, dataset: Any, tmp_path: Path) -> None:
        part = dataset.isel(tonemap=1, blur_scale=0)
        assert pixels(contact_sheet(part), tmp_path).shape[2] == 3
        assert pixels(contact_sheet(part.isel(intensity=0)), tmp_path).shape[2] == 3

    def test_points_that_are_not_done_stay_empty(self, dataset: Any, tmp_path: Path) -> None:
        done = xr.zeros_like(dataset["mean"], dtype=bool)
        sheet = pixels(contact_sheet(dataset.assign(done=done), width=80), tmp_path)
        assert (sheet[-20, -40] == 40).all()

    def test_other_framebuffers(self, dataset: Any) -> None:
        assert contact_sheet(dataset, framebuffer="bloom") != contact_sheet(dataset)

    @pytest.mark.parametrize(
        ("arguments", "told"),
        [
            ({"rows": "knee"}, "rows: 'knee'"),
            ({"rows": "tonemap", "columns": "tonemap"}, "is already the horizontal axis"),
            ({"framebuffer": "glow"}, "framebuffer: 'glow'"),
            ({"at": {"knee": 0}}, "at: 'knee'"),
            ({"at": {"intensity": 0}}, "is a shown axis"),
            ({"at": {"tonemap": "agx"}}, "has no value 'agx'"),
            ({"width": 1}, "width"),
            ({"most": 0}, "most"),
        ],
    )
    def test_wrong_arguments(self, dataset: Any, arguments: Any, told: str) -> None:
        with pytest.raises(ValueError, match=told):
            contact_sheet(dataset, **arguments)

    def test_no_grid(self, dataset: Any) -> None:
        with pytest.raises(TypeError, match="Dataset"):
            contact_sheet(3)  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="not a grid"):
            contact_sheet(xr.Dataset())
        with pytest.raises(ValueError, match="no framebuffers"):
            contact_sheet(dataset[["mean"]])


class TestSelect:
    @pytest.mark.parametrize(
        ("axis", "values", "at", "place"),
        [
            # In whatever order the values are, with None among them or not.
            ("exposure", [1.0, 0.0, 2.0], 0.0, 1),
            ("exposure", [1.0, 0.0, 2.0], 1.7, 2),
            ("exposure", [1.0, 0.0, 2.0], np.float32(-30), 1),
            ("loops", [3, 1, 2], 2, 2),
            ("threshold", [None, 0.7, 0.3], 0.4, 2),
            ("threshold", [0.7, None, 0.3], None, 1),
            ("threshold", [0.7, None, 0.3], np.nan, 1),
            ("direct", [False, True], True, 1),
            ("tonemap", ["aces", "none"], "none", 1),
            ("format", ["rgba16float", None], None, 1),
            ("format", ["rgba16float", None], "none", 1),
        ],
    )
    def test_the_nearest_number_or_that_text(
        self, renderer: Renderer, axis: str, values: Any, at: Any, place: int
    ) -> None:
        image = noise(6, 8, 3, dtype="uint8")
        grid = vkbloom.grid(
            image,
            Separable(),
            {"blur_scale": [0.5, 1.0], axis: values},
            framebuffers=["final"],
            renderer=renderer,
        )
        found = select(grid, {axis: at}, ("blur_scale",))
        assert found.identical(grid.isel({axis: place}))

    @pytest.mark.parametrize(
        ("axis", "values", "at"),
        [
            ("exposure", [1.0, 0.0], "one"),
            ("exposure", [1.0, 0.0], None),
            ("exposure", [1.0, 0.0], np.inf),
            ("exposure", [1.0, 0.0], [0.0, 1.0]),
            ("exposure", [1.0, 0.0], [0.0, 1.0, 2.0]),
            ("tonemap", ["aces", "none"], 1),
            ("tonemap", ["aces", "none"], ["aces", "none"]),
            ("direct", [False, True], "on"),
        ],
    )
    def test_values_that_are_not_there(
        self, renderer: Renderer, axis: str, values: Any, at: Any
    ) -> None:
        grid = vkbloom.grid(
            noise(6, 8, 3, dtype="uint8"), Separable(), {axis: values}, renderer=renderer
        )
        with pytest.raises(ValueError, match=f"at: {axis} has no value {re.escape(repr(at))}"):
            select(grid, {axis: at}, ())


class TestResponseCurves:
    def test_lines_are_the_figures(self, dataset: Any) -> None:
        figure: Any = response_curves(dataset, at={"tonemap": "aces"})
        mean, energy = figure.axes
        lines = {line.get_label(): line.get_ydata() for line in mean.get_lines()}
        assert list(lines) == ["intensity=0", "intensity=0.5", "intensity=1"]
        np.testing.assert_array_equal(lines["intensity=0.5"], dataset["mean"].values[1, :, 1])
        assert mean.get_xlabel() == "blur_scale (texel)"
        assert mean.get_title() == "tonemap=aces"
        # A figure that is an array has a line for each of its own values.
        np.testing.assert_array_equal(
            energy.get_lines()[1].get_ydata(), dataset["energy"].values[1, :, 0, 1]
        )

    def test_framebuffers_are_drawn_by_their_mean(self, dataset: Any) -> None:
        drawn: Any = response_curves(dataset, "intensity", variables=["final"])
        (diagram,) = drawn.axes
        expected = dataset["final"].values[0, 1].mean(axis=(1, 2, 3)) / 255
        np.testing.assert_allclose(diagram.get_lines()[1].get_ydata(), expected, rtol=1e-12)

    def test_text_goes_across_and_points_not_done_are_left_out(self, dataset: Any) -> None:
        done = xr.ones_like(dataset["mean"], dtype=bool)
        done[1] = False
        part = dataset.assign(done=done)
        drawn: Any = response_curves(part, "tonemap", variables=["mean"])
        (diagram,) = drawn.axes
        assert np.isnan(diagram.get_lines()[0].get_ydata()[1])

    def test_is_saved(self, dataset: Any, tmp_path: Path) -> None:
        response_curves(dataset).savefig(tmp_path / "curves.svg")
        assert (tmp_path / "curves.svg").stat().st_size > 1000

    @pytest.mark.parametrize(
        ("arguments", "told"),
        [
            ({"axis": "knee"}, "axis: 'knee'"),
            ({"axis": "tonemap", "lines": "tonemap"}, "is already the horizontal axis"),
            ({"variables": ["glow"]}, "variables: 'glow'"),
        ],
    )
    def test_wrong_arguments(self, dataset: Any, arguments: Any, told: str) -> None:
        with pytest.raises(ValueError, match=told):
            response_curves(dataset, **arguments)

    def test_one_point(self, dataset: Any) -> None:
        with pytest.raises(ValueError, match="more than one value"):
            response_curves(dataset.isel(tonemap=0, blur_scale=0, intensity=0))
