"""Custom methods are accepted wherever settings are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import run
from tests.explorer.pages import as_code
from tests.images import picture
from vkbloom import Renderer, load_method, psf, testing
from vkbloom._cli.live import Live

pytestmark = pytest.mark.usefixtures("glslang")

xarray = pytest.importorskip("xarray")

Array = NDArray[Any]

BLUR = """\
//!PARAM spread
//!DESC standard deviation in pixels
//!TYPE float
//!MINIMUM 0.5
//!MAXIMUM 6
2
//!PARAM shape
//!TYPE ENUM int
gauss
box
"""
PASS = """\
//!HOOK MAIN
//!BIND {source}
//!SAVE {target}
vec4 hook() {{
    vec4 sum = vec4(0.0), total = vec4(0.0);
    for (int i = -8; i <= 8; i++) {{
        float w = shape == box ? 1.0 : exp(-0.5 * float(i * i) / (spread * spread));
        sum += w * {source}_texOff(vec2({along})), total += w;
    }}
    return sum / total;
}}
"""
BLUR += PASS.format(source="GLOW", target="ROWS", along="i, 0")
BLUR += PASS.format(source="ROWS", target="BLOOM", along="0, i")


@pytest.fixture
def kind() -> Any:
    return load_method(BLUR, name="of_consumers")


def photo() -> Array:
    return picture(40, 32, 3, power=8, highest=9)


def test_plans(renderer: Renderer, kind: Any) -> None:
    plan = renderer.plan(photo(), kind(threshold=1.0))
    assert list(plan.framebuffers) == ["glow", "rows", "bloom", "final"]
    assert [one.name for one in plan.passes] == ["glow", "rows", "bloom", "final"]
    assert "rows" in plan.to_mermaid()
    assert plan == renderer.plan(photo(), kind(threshold=1.0))
    assert plan != renderer.plan(photo(), kind(threshold=1.0, spread=3))
    only = renderer.plan(photo(), kind(), framebuffers="rows")
    assert [one.name for one in only.passes][-1] == "rows"


def test_sequences_and_batches(renderer: Renderer, kind: Any) -> None:
    images = [photo(), 2 * photo()]
    several = [kind(spread=1), kind(spread=4)]
    one_by_one = [renderer.apply(i, s)["final"] for i, s in zip(images, several, strict=True)]
    for frames, wanted in zip(renderer.map(images, several), one_by_one, strict=True):
        assert np.array_equal(frames["final"], wanted)
    for frames, settings in zip(renderer.sweep(photo(), several), several, strict=True):
        assert np.array_equal(frames["bloom"], renderer.apply(photo(), settings)["bloom"])
    glows: dict[str, Any] = {"mask": np.ones((32, 40), np.float32), "emission": photo()}
    with_glows = renderer.apply(photo(), kind(), **glows)
    assert np.array_equal(with_glows["final"], renderer.apply(photo(), kind())["final"])


def test_grids(renderer: Renderer, kind: Any) -> None:
    axes: dict[str, Any] = {"spread": [1.0, 3.0], "shape": ["gauss", "box"]}
    grid = vkbloom.grid(
        photo(), kind(), axes, framebuffers=("bloom", "rows"), progress=False, renderer=renderer
    )
    assert grid["rows"].dims[:2] == ("spread", "shape")
    for spread in axes["spread"]:
        wanted = renderer.apply(photo(), kind(spread=spread, shape="box"))["bloom"]
        assert np.array_equal(grid["bloom"].sel(spread=spread, shape="box"), wanted)
    mixed = vkbloom.grid(
        photo(), axes={"settings": [kind(), vkbloom.Pyramid()]}, progress=False, renderer=renderer
    )
    assert mixed.sizes["settings"] == 2


# Of sockets and event loops that Dask leaves to the garbage collector.
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_workers_get_the_text(renderer: Renderer, kind: Any, tmp_path: Path) -> None:
    """The workers' processes have no file and have not loaded the method."""
    distributed = pytest.importorskip("distributed")
    axes: dict[str, Any] = {"spread": [1.0, 2.0, 3.0]}
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        found = vkbloom.grid(
            photo(), kind(), axes, store=tmp_path / "grid.zarr", client=client, progress=False
        )
    wanted = vkbloom.grid(photo(), kind(), axes, progress=False, renderer=renderer)
    assert np.array_equal(found["final"], wanted["final"])
    again = xarray.open_zarr(tmp_path / "grid.zarr", consolidated=False)
    assert np.array_equal(again["final"], wanted["final"])


def test_fits(renderer: Renderer, kind: Any) -> None:
    target = renderer.apply(photo(), kind(spread=3.0, intensity=0.5))["final"]
    found = vkbloom.fit(
        photo(), target, kind(), ("spread", "intensity"), renderer=renderer, max_calls=120
    )
    assert found.settings.spread == pytest.approx(3, rel=0.02)
    assert found.settings.intensity == pytest.approx(0.5, rel=0.02)
    assert "of_consumers" in as_code(found.settings) or "OfConsumers" in as_code(found.settings)


def test_translations(renderer: Renderer, kind: Any) -> None:
    found: Any
    gaussian = vkbloom.Separable(weights=vkbloom.gaussian_weights(3.0), blur_strength=1.0)
    found = vkbloom.translate(
        gaussian, kind(), size=(96, 64), vary=("spread",), renderer=renderer, max_calls=40
    )
    assert found.settings.spread == pytest.approx(3, rel=0.05)
    # Every number and choice of the file is varied if nothing is named.
    every = vkbloom.translate(gaussian, kind, size=(96, 64), renderer=renderer, max_calls=30)
    assert set(every.vary) >= {"spread", "intensity"}


def test_point_spreads(kind: Any) -> None:
    measured = psf.measured(kind(spread=2.0), size=(33, 33))
    assert measured.energy() == pytest.approx([1, 1, 1], rel=1e-3)
    around = measured.array((33, 33))
    distance = np.arange(33) - 16
    assert (around[16, :, 0] / around[16, :, 0].sum()) @ distance**2 == pytest.approx(4, rel=0.02)
    assert vkbloom.Convolution(psf=measured).psf == measured


def test_laws_and_figures(renderer: Renderer, kind: Any) -> None:
    settings = kind(format="rgba32float")

    def bloom(image: Array) -> Array:
        return renderer.apply(image, settings)["bloom"]

    testing.report(bloom, size=(48, 48)).assert_held("superposition", "gain", "symmetric")
    testing.assert_laws(bloom, "stability", size=(48, 48))
    assert testing.diagnose(bloom(photo()), bloom(2 * photo())).cause == "gain"


def test_the_plugin_compares_all_framebuffers(
    renderer: Renderer, kind: Any, tmp_path: Path
) -> None:
    def regression(*, update: bool = False) -> testing.FrameRegression:
        return testing.FrameRegression(
            folder=tmp_path, name="own", update=update, save=None, written=[]
        )

    regression(update=True).check(renderer.apply(photo(), kind()))
    regression().check(renderer.apply(photo(), kind()))
    with pytest.raises(AssertionError, match="rows"):
        regression().check(renderer.apply(photo(), kind(spread=2.5)))


def test_the_keys_of_the_window(renderer: Renderer, kind: Any) -> None:
    live = Live(kind(), photo())
    names = list(renderer.plan(photo(), live.settings).framebuffers)
    live.press("2", names)
    assert live.framebuffer == "rows"
    assert live.title(0.02).startswith("rows: of_consumers | ")


def test_stored_frames(renderer: Renderer, kind: Any, tmp_path: Path) -> None:
    frames = renderer.apply(photo(), kind(spread=3))
    frames.save(path := tmp_path / "frames.exr")
    loaded = vkbloom.Frames.load(path)
    assert loaded.settings == kind(spread=3)
    assert frames.to_xarray()["rows"].attrs or frames.to_xarray().attrs
    assert "rows" in frames._repr_html_()


@pytest.mark.parametrize(
    ("words", "result"),
    [
        (["render", "--size", "32x24", "-o", "{out}.exr"], "{out}.exr"),
        (["apply", "{image}", "{out}.exr"], "{out}.exr"),
        (["warm", "--size", "40x32"], "{image}"),
        (["grid", "{image}", "--axis", "spread=1:3:2", "--out", "{out}.zarr"], "{out}.zarr"),
    ],
)
def test_commands(tmp_path: Path, words: list[str], result: str) -> None:
    (tmp_path / "soft.hook").write_text(BLUR)
    places = {"image": str(tmp_path / "in.exr"), "out": str(tmp_path / "out")}
    vkbloom.write(places["image"], photo())
    words = [word.format(**places) for word in words]
    method = ["--method", str(tmp_path / "soft.hook"), "--spread", "2.5", "--shape", "box"]
    given = method[:2] if words[0] in ("grid", "warm") else method
    done = run(*words, *given)
    assert done.exit_code == 0, done.output
    assert Path(result.format(**places)).exists()
