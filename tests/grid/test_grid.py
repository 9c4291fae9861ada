"""Grids in memory: values, number of passes, names of dimensions, errors."""

from __future__ import annotations

import functools
import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vkbloom
from tests.images import noise
from tests.refusals import assert_refused, rows
from vkbloom import Frames, Pyramid, Renderer, Scene, Separable, Settings
from vkbloom._grid.filling import progress_bar
from vkbloom._grid.layout import Grid, ask, lay_out
from vkbloom._grid.order import blocks, default_chunk, points, read_part

AXES: dict[str, list[Any]] = {
    "exposure": [0.0, 1.0],
    "threshold": [None, 0.2, 0.6],
    "tonemap": ["none", "aces"],
    "blur_scale": [0.5, 1.0, 2.0],
}
# Rows of the forward graph and what they depend on, as csrc/README.md has it.
DEPENDS = {
    "glow": ["threshold"],
    "blur_vertical": ["threshold", "blur_scale"],
    "bloom": ["threshold", "blur_scale"],
    "final": ["threshold", "blur_scale", "exposure", "tonemap"],
}


Call = Callable[..., Any]


@pytest.fixture
def filled(renderer: Renderer) -> Call:
    """Fill grids with the shared renderer."""
    return functools.partial(vkbloom.grid, progress=False, renderer=renderer)


@pytest.fixture(scope="module")
def image() -> Any:
    return noise(23, 37, 3, dtype="float32")


class Ran:
    """A reduction that counts the passes of the points, and of the one that tells its shape."""

    def __init__(self, *framebuffers: str) -> None:
        self.framebuffers = framebuffers
        self.passes = 0

    def __call__(self, frames: Frames) -> int:
        self.passes += len(frames.timings)
        return 0


def fewest(depends: dict[str, list[str]], axes: dict[str, list[Any]]) -> int:
    """Return the sum over passes of the points that differ in what the pass depends on."""
    return sum(math.prod(len(axes[name]) for name in names) for names in depends.values())


class TestValues:
    def test_every_point_is_that_of_a_single_call(self, filled: Call, image: Any) -> None:
        dataset = filled(image, Separable(intensity=0.7), AXES, framebuffers=("final", "bloom"))
        assert dataset["final"].dims == (*AXES, "y", "x", "channel")
        assert dataset["bloom"].dims == (*AXES, "y", "x", "bloom_channel")
        with Renderer() as single:
            for place in np.ndindex(2, 3, 2, 3):
                values = {name: AXES[name][i] for (name, i) in zip(AXES, place, strict=True)}
                expected = single.apply(image, Separable(intensity=0.7).replace(**values))
                for name in ("final", "bloom"):
                    np.testing.assert_array_equal(dataset[name].values[place], expected[name])

    def test_scenes_and_time(self, renderer: Renderer, filled: Call, scene: Scene) -> None:
        axes = {"intensity": [0.5, 1.0], "time": [0.0, 0.25], "blur_scale": [1.0, 3.0]}
        dataset = filled(scene, Separable(), axes, size=(48, 27), framebuffers=("final", "depth"))
        assert dataset["final"].shape == (2, 2, 2, 27, 48, 4)
        assert dataset["depth"].dims == (*axes, "y", "x")
        for place in np.ndindex(2, 2, 2):
            intensity, time, scale = (axes[n][i] for n, i in zip(axes, place, strict=True))
            settings = Separable(intensity=intensity, blur_scale=scale)
            expected = renderer.render(scene, settings, (48, 27), time=time)
            for name in ("final", "depth"):
                np.testing.assert_array_equal(dataset[name].values[place], expected[name])

    def test_no_axes(self, renderer: Renderer, filled: Call, image: Any) -> None:
        dataset = filled(image)
        assert dataset["final"].dims == ("y", "x", "channel")
        np.testing.assert_array_equal(dataset["final"].values, renderer.apply(image)["final"])


class TestPasses:
    @pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1)], ids=str)
    def test_order_of_axes_does_not_change_the_number_of_passes(
        self, new_renderer: Callable[[], Renderer], image: Any, order: tuple[int, ...]
    ) -> None:
        axes: dict[str, list[Any]] = {
            list(AXES)[number]: list(AXES.values())[number] for number in order
        }
        ran = Ran("all")
        how: dict[str, Any] = {"framebuffers": "all", "reduce": {"ran": ran}}
        dataset = vkbloom.grid(image, Separable(), axes, renderer=new_renderer(), **how)
        assert list(dataset["final"].dims[:4]) == list(axes)
        assert ran.passes == fewest(DEPENDS, axes)

    def test_one_requested_framebuffer_runs_no_further_pass(
        self, new_renderer: Callable[[], Renderer], image: Any
    ) -> None:
        ran = Ran("final")
        vkbloom.grid(image, Separable(), AXES, reduce={"ran": ran}, renderer=new_renderer())
        points = math.prod(map(len, AXES.values()))
        # Several passes may run as one.
        assert points <= ran.passes <= fewest(DEPENDS, AXES)

    def test_a_scene_is_drawn_once_a_time(
        self, new_renderer: Callable[[], Renderer], scene: Scene
    ) -> None:
        axes = {"exposure": [0.0, 1.0], "time": [0.0, 0.1, 0.2], "blur_scale": [1.0, 2.0]}
        # All but the depths, which their passes share.
        names = ("glow", "blur_vertical", "bloom", "scene", "final")
        ran = Ran(*names)
        how: dict[str, Any] = {"framebuffers": names, "reduce": {"ran": ran}, "size": (32, 18)}
        vkbloom.grid(scene, None, axes, renderer=new_renderer(), **how)
        depends = {
            "scene": ["time"],
            "glow": ["time"],
            "blur_vertical": ["time", "blur_scale"],
            "bloom": ["time", "blur_scale"],
            "final": list(axes),
        }
        assert ran.passes == fewest(depends, axes)

    def test_the_order_does_not_trust_the_first_corner(
        self, new_renderer: Callable[[], Renderer], image: Any
    ) -> None:
        # Where the bloom is off, a blur costs nothing.
        axes = {"intensity": [0.5, 1.0], "blur_scale": [1, 2], "bloom": [False, True]}
        grid = ask_for(image, axes, Separable())
        layout = lay_out(grid, new_renderer())
        assert layout.ranking.index(0) > layout.ranking.index(1)


def ask_for(source: Any, axes: Any, settings: Settings | None = None, **more: Any) -> Grid:
    defaults: dict[str, Any] = {
        "size": None,
        "shading": "forward",
        "time": 0.0,
        "framebuffers": ("final",),
        "reduce": None,
    }
    return ask(source, settings, axes, **{**defaults, **more})


class TestWholeSettings:
    """The axes "preset" and "settings": settings of any methods."""

    @pytest.mark.parametrize("first", [True, False])
    def test_presets(self, renderer: Renderer, filled: Call, image: Any, first: bool) -> None:
        names, exposures = ["kino", "tutorial", "filament"], [0.0, 1.0]
        axes: dict[str, Any] = {"preset": names, "exposure": exposures}
        if not first:
            axes = dict(reversed(axes.items()))
        grid = filled(image, axes=axes)
        assert list(grid["final"].dims[:2]) == list(axes)
        assert list(grid["preset"].values) == names
        for name in names:
            for exposure in exposures:
                settings = vkbloom.presets[name].replace(exposure=exposure)
                expected = renderer.apply(image, settings)["final"]
                found = grid["final"].sel(preset=name, exposure=exposure).values
                np.testing.assert_array_equal(found, expected)
        assert json.loads(grid.attrs["settings"]) == {}
        message = json.loads(grid["preset"].attrs["settings"])
        assert vkbloom.Settings.from_dict(message["kino"]) == vkbloom.presets["kino"]

    def test_settings(self, renderer: Renderer, filled: Call, image: Any) -> None:
        many = [Separable(threshold=0.5), Pyramid(levels=2, format="rgba32float")]
        grid = filled(
            image, axes={"settings": many, "intensity": [0.5, 1.0]}, framebuffers=("final", "bloom")
        )
        for place, one in enumerate(many):
            frames = renderer.apply(image, one.replace(intensity=0.5))
            assert vkbloom.Settings.from_json(grid["settings"].values[place].item()) == one
            for name in ("final", "bloom"):
                found = grid[name].isel(settings=place, intensity=0).values
                np.testing.assert_array_equal(found, frames[name])

    def test_floats_become_the_largest_of_their_dtypes(
        self, renderer: Renderer, filled: Call
    ) -> None:
        half = np.random.default_rng(4).random((8, 12, 3)).astype(np.float16)
        formats: Any = ["rgba16float", "rgba32float"]
        grid = filled(half, Separable(), {"format": formats}, framebuffers=("bloom",))
        assert grid["bloom"].dtype == np.float32
        for name in formats:
            expected = renderer.apply(half, Separable(format=name))["bloom"]
            np.testing.assert_array_equal(grid["bloom"].sel(format=name).values, expected)


class TestMemory:
    def test_grid_larger_than_memory_is_refused(self, filled: Call) -> None:
        image = np.zeros((1000, 1000, 4), np.float32)
        axes = {"exposure": np.linspace(-1, 1, 1000), "intensity": np.linspace(0, 1, 1000)}
        message = r"1000000 points with final needs 16,000.0 GB .* grid, .* framebuffers=\(\)"
        with pytest.raises(MemoryError, match=message):
            filled(image, None, axes)


class TestDataset:
    def test_coordinates_say_what_they_are(self, filled: Call, image: Any) -> None:
        axes: dict[str, Any] = {
            "threshold": [None, 0.5],
            "tonemap": ["none", "agx"],
            "bloom_size": [None, (8, 4)],
            "blur_scale": np.array([1, 2], np.float32),
            "loops": [1, 2],
            "direct": [False, True],
            "weights": [(0.5, 0.25), (1.0,)],
        }
        dataset = filled(image, Separable(), axes)
        assert np.isnan(dataset["threshold"].values[0])
        assert list(dataset["tonemap"].values) == ["none", "agx"]
        assert list(dataset["bloom_size"].values) == ["none", "[8, 4]"]
        assert list(dataset["weights"].values) == ["[0.5, 0.25]", "[1.0]"]
        assert dataset["loops"].dtype.kind == "i"
        assert dataset["direct"].dtype == bool
        assert dataset["blur_scale"].attrs["units"] == "texel"
        assert "texels" in dataset["blur_scale"].attrs["description"]
        assert dataset["bloom_size"].attrs["units"] == "pixel"
        assert list(dataset["channel"].values) == ["r", "g", "b"]
        assert dataset["final"].attrs["units"] == "1"

    def test_attributes_hold_the_rest(self, renderer: Renderer, filled: Call, image: Any) -> None:
        dataset = filled(image, Separable(intensity=0.3), {"blur_scale": [1.0]})
        settings = json.loads(dataset.attrs["settings"])
        assert settings["intensity"] == 0.3
        assert settings["method"] == "separable"
        assert "blur_scale" not in settings
        assert dataset.attrs["adapter"] == renderer.info.name
        assert dataset.attrs["version"] == vkbloom.__version__
        assert json.loads(dataset.attrs["axes"]) == ["blur_scale"]


class TestRefusals:
    @pytest.mark.parametrize(
        ("call", "error"), [*rows(__file__, "grids"), *rows(__file__, "parts")]
    )
    def test_a_wrong_value_is_refused(self, filled: Call, call: str, error: str) -> None:
        public = {name: getattr(vkbloom, name) for name in vkbloom.__all__}
        image = np.zeros((23, 37, 3), np.float32)
        own = {"vkbloom": vkbloom, "np": np, "image": image, "grid": filled, "read_part": read_part}
        assert_refused(call, error, {**public, **own})

    def test_shapes_are_compared_before_anything_is_rendered(
        self, filled: Call, image: Any
    ) -> None:
        def reached(frames: Frames) -> float:
            pytest.fail("frames were rendered")

        with pytest.raises(ValueError, match="bloom changes its shape or dtype along format"):
            filled(
                image,
                Separable(),
                {"format": ["rgba8unorm", None]},
                framebuffers=["bloom"],
                reduce={"mean": reached},
            )

    def test_an_error_on_the_way_leaves_the_renderer_usable(
        self, renderer: Renderer, filled: Call, image: Any
    ) -> None:
        def failing(frames: Frames) -> float:
            return 1 / (1 - frames.settings.exposure)

        with pytest.raises(ZeroDivisionError):
            filled(image, Separable(), {"exposure": [0, 1, 2]}, reduce={"n": failing})
        assert renderer.apply(image)["final"].shape == image.shape


class TestReduce:
    def test_next_to_and_instead_of_framebuffers(
        self, renderer: Renderer, filled: Call, image: Any
    ) -> None:
        seen: list[list[str]] = []

        def spread(frames: Frames) -> Any:
            seen.append(list(frames))
            return frames["bloom"].std(axis=(0, 1))[:3]

        axes = {"blur_scale": [1.0, 2.0]}
        beside = filled(image, Separable(), axes, reduce={"spread": spread})
        alone = filled(image, Separable(), axes, framebuffers=(), reduce={"spread": spread})
        assert set(beside) == {"final", "spread"}
        assert set(alone) == {"spread"}
        assert alone["spread"].dims == ("blur_scale", "spread_dim_0")
        expected = renderer.apply(image, Separable(blur_scale=2.0))["bloom"].std(axis=(0, 1))[:3]
        np.testing.assert_allclose(alone["spread"].values[1], expected)
        # Without a word about what it needs it gets all.
        assert "glow" in seen[0]


class TestExtras:
    @pytest.mark.parametrize("missing", ["xarray", "zarr", "dask.array"])
    def test_missing_package_is_named_with_its_installation(
        self, image: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: str
    ) -> None:
        monkeypatch.setitem(sys.modules, missing, None)
        with pytest.raises(ModuleNotFoundError, match=rf"{missing}: pip install vkbloom\[grid\]"):
            vkbloom.grid(image, Separable(), {"exposure": [0]}, store=tmp_path / "a.zarr")
        assert not (tmp_path / "a.zarr").exists()


class TestExposures:
    """Points are no frames in time: each continues the grid's state."""

    def test_axes(self, filled: Call, image: Any, renderer: Renderer) -> None:
        state = renderer.apply(image, exposure="bevy", dt=1).state
        exposures: list[Any] = ["bevy", "o3de", vkbloom.FixedExposure(value=1)]
        axes = {"exposure": exposures, "dt": [0.0, 0.5], "intensity": [0.1, 0.4]}

        def stops(frames: Frames) -> float:
            return frames.exposure

        grid = filled(image, "kino", axes, state=state, reduce={"stops": stops})
        assert json.loads(grid.attrs["stages"]) == {
            "state": {"exposure": np.asarray(state["exposure"]).tolist()}
        }
        assert "exposure" in json.loads(grid.attrs["settings"])
        for index, exposure in enumerate(exposures):
            for dt in axes["dt"]:
                for intensity in axes["intensity"]:
                    settings = vkbloom.presets["kino"].replace(intensity=intensity)
                    given: Any = {"exposure": exposure, "dt": dt, "state": state}
                    frames = renderer.apply(image, settings, **given)
                    point = grid.isel(exposure=index).sel(dt=dt, intensity=intensity)
                    np.testing.assert_array_equal(point["final"], frames["final"])
                    assert float(point["stops"]) == frames.exposure

    def test_stops_beside_an_exposure(self, filled: Call, tmp_path: Path, image: Any) -> None:
        """Numbers are the settings' own; a store of another exposure is another grid."""
        axes = {"exposure": [-1.0, 1.0]}
        given: Any = {"store": tmp_path / "a.zarr", "dt": 0.5}
        grid = filled(image, None, axes, exposure="hdrp", **given)
        alone = vkbloom.apply(image, exposure=1.0)["final"]
        one = filled(image, None, axes, exposure=vkbloom.FixedExposure())["final"]
        np.testing.assert_allclose(one.sel(exposure=1.0), alone, rtol=1e-6)
        np.testing.assert_allclose(
            4 * grid["final"].sel(exposure=-1.0), grid["final"].sel(exposure=1.0), rtol=1e-6
        )
        with pytest.raises(ValueError, match=r"stages.exposure.engine: .hdrp. in the store"):
            filled(image, None, axes, exposure="godot", **given)

    def test_a_scene(self, filled: Call, renderer: Renderer) -> None:
        given: Any = {"size": (32, 24), "shading": "deferred"}
        axes = {"time": [0.0, 0.25], "exposure": ["godot"]}
        grid = filled(Scene.ufo(), Separable(), axes, **given)
        expected = renderer.render(Scene.ufo(), Separable(), time=0.25, exposure="godot", **given)
        np.testing.assert_array_equal(
            grid["final"].sel(time=0.25, exposure="godot"), expected["final"]
        )


class TestAntialiasing:
    """Each point is the frame after the grid's state."""

    def test_axes(self, filled: Call, tmp_path: Path, image: Any, renderer: Renderer) -> None:
        random = np.random.default_rng(0)
        depth = random.random(image.shape[:2], np.float32)
        given: Any = {"motion": np.full((*depth.shape, 2), 0.02, np.float32), "depth": depth}
        state = renderer.apply(image[::-1], "kino", taa="bevy", **given).state
        given |= {"state": state, "store": tmp_path / "a.zarr"}
        taa: list[Any] = ["bevy", "hdrp_low", vkbloom.O3deAntialiasing(weight=0.5)]
        axes = {"taa": taa, "intensity": [0.1, 0.4]}
        grid = filled(image, "kino", axes, **given)
        given.pop("store")
        for index, one in enumerate(taa):
            settings = vkbloom.presets["kino"].replace(intensity=0.4)
            frames = renderer.apply(image, settings, taa=one, **given)
            point = grid.isel(taa=index).sel(intensity=0.4)
            np.testing.assert_array_equal(point["final"], frames["final"])
        # Another history or motion is another grid.
        stages = json.loads(grid.attrs["stages"])
        assert [len(text) for text in stages["state"].values()] == [64]
        given["store"] = tmp_path / "a.zarr"
        with pytest.raises(ValueError, match=r"stages.state.history: "):
            filled(image, "kino", axes, **given | {"state": {"history": 2 * state["history"]}})
        with pytest.raises(ValueError, match=r"source.images: "):
            filled(image, "kino", axes, **given | {"depth": depth / 2})

    def test_a_scene(self, filled: Call, renderer: Renderer) -> None:
        """It is seen from the engine's camera, and has moved since the state."""
        given: Any = {"size": (32, 24), "shading": "deferred"}
        state = renderer.render(Scene.ufo(), Separable(), taa="o3de", **given).state
        given["state"] = state
        seen = []

        def number(frames: Frames) -> float:
            seen.append(frames.state)
            return float(frames.state["animation"][0, 0, 1])

        times = [0.01, 0.02]
        axes = {"time": times, "taa": ["o3de", "godot"]}
        grid = filled(Scene.ufo(), Separable(), axes, reduce={"number": number}, **given)
        assert (grid["number"] == 2).all()
        for time in times:
            expected = renderer.render(Scene.ufo(), Separable(), taa="o3de", time=time, **given)
            point = grid.sel(time=time, taa="o3de")
            np.testing.assert_array_equal(point["final"], expected["final"])
            assert expected.state in seen


class TestProgress:
    def test_a_terminal_sees_points(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        monkeypatch.setattr("vkbloom._grid.filling._is_watched", lambda: True)
        with progress_bar(4, 1, shown=True) as count:
            count(3)
        assert "4/4" in capsys.readouterr().err


@st.composite
def lattices(draw: st.DrawFn) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
    """Shapes, chunks and rankings; chunks need not divide the shape."""
    shape = tuple(draw(st.lists(st.integers(1, 5), max_size=4)))
    chunk = tuple(draw(st.integers(1, count)) for count in shape)
    return shape, chunk, tuple(draw(st.permutations(range(len(shape)))))


def visit(
    shape: tuple[int, ...], chunk: tuple[int, ...], ranking: tuple[int, ...]
) -> list[tuple[int, ...]]:
    return [index for block in blocks(shape, chunk, ranking) for index in points(block, ranking)]


@given(lattices())
def test_every_point_once(
    lattice: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]],
) -> None:
    assert sorted(visit(*lattice)) == list(np.ndindex(lattice[0]))


@given(lattices(), st.integers(1, 40))
def test_default_chunks_keep_the_order_of_nested_loops(
    lattice: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]], most: int
) -> None:
    shape, _, ranking = lattice
    chunk = default_chunk(shape, ranking, most)
    assert math.prod(chunk) <= most
    found = visit(shape, chunk, ranking)
    assert found == sorted(found, key=lambda index: [index[axis] for axis in ranking])
