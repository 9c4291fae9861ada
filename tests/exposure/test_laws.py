"""Laws of exposures: the faults of engines and planted ones are named, what is right passes."""

from __future__ import annotations

import dataclasses
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import vkbloom
from tests.cli.calls import one_line, run
from tests.exhaustive import some
from vkbloom import testing
from vkbloom.testing._laws.table import EXPOSURE_LAWS

from .meters import FAULTS, Meter

NAMES = [name for name in EXPOSURE_LAWS if name != "shimmer"]
COPY = vkbloom.Pyramid(bloom=False)
OPEN = vkbloom.PostProcessingExposure(minimum=-9, maximum=9)
#: What an exposure holds that does nothing.
HELD_BY_ALL = {"monotone", "mirror", "finite_state"}
#: The laws that engines break, by the formula sheet, and what they measure: least and most.
ENGINES: dict[Any, dict[str, dict[str, tuple[float, float]]]] = {
    "bevy": {
        "frame_rate": {"up": (0.035, 0.045)},
        "no_overshoot": {"from_dt": (0.5, 0.75)},
        "monotone": {"shadows": (1, 4)},
        "scale": {"off": (0.02, 0.04)},
    },
    "hdrp": {"mirror": {"across": (0.01, 0.03)}, "dark_pixels": {"rise": (2, 3)}},
    "hdrp_automatic": {"dark_pixels": {"rise": (1, 2)}},
    OPEN: {"scale": {"off": (0.01, 0.03)}},
    "godot": {
        "frame_rate": {"up": (0.015, 0.025)},
        "no_overshoot": {"from_dt": (2, 3)},
        "mirror": {"across": (2, 5), "down": (0, 1e-5)},
        "finite_state": {"nan": (np.inf, np.inf), "black": (np.inf, np.inf)},
    },
    "o3de": {
        "frame_rate": {"up": (0.075, 0.085)},
        "no_overshoot": {"from_dt": (1 / 3, 0.5)},
        "finite_state": {"nan": (1, 2), "black": (0, 16)},
    },
    "granite": {"finite_state": {"nan": (1, 2), "black": (0, 3)}},
    "fixed": {},
}


def broken(found: testing.LawReport) -> set[str]:
    return {row.name for row in found.rows if row.held is False}


@pytest.mark.parametrize("exposure", ENGINES, ids=str)
def test_engines(renderer: vkbloom.Renderer, exposure: Any) -> None:
    # (The grid of one takes ten times as long as the others.)
    laws = ["dark_pixels", "finite_state"] if exposure == "hdrp_automatic" else NAMES

    def step(image: Any, *, dt: float, state: Any) -> vkbloom.Frames:
        how: Any = {"exposure": exposure, "framebuffers": ()}
        return renderer.apply(image, COPY, dt=dt, state=state, **how)

    found = testing.report(step, laws=laws)
    expected = ENGINES[exposure]
    assert broken(found) == {*expected}, found
    rows = {row.name: row for row in found.rows}
    for law, figures in expected.items():
        for name, (least, most) in figures.items():
            assert least <= rows[law].figures[name] <= most, (law, name)
    untested = {row.name for row in found.rows if row.held is None}
    assert untested == ({*NAMES} - HELD_BY_ALL if exposure == "fixed" else set())


def test_the_table_of_the_docs() -> None:
    """It is what the laws found (tools/tables/write.py exposures)."""
    table = Path(__file__).parents[2] / "docs" / "evidence" / "exposures_table.md"
    rows = re.findall(r"^\| `(\w+)` \| (.*) \| (.*) \|$", table.read_text(), re.MULTILINE)
    assert [law for law, _, _ in rows] == NAMES
    for law, _, broken in rows:
        expected = {
            exposure if isinstance(exposure, str) else "ppv2"
            for exposure, laws in ENGINES.items()
            if law in laws
        }
        assert {*re.findall("`(\\w+)`", broken)} == expected


def test_the_table_of_anti_aliasing() -> None:
    """Of each preset: TAA before bloom is held, the order turned round is not."""
    table = Path(__file__).parents[2] / "docs" / "evidence" / "antialiasing_table.md"
    rows = re.findall(r"^\| `(\w+)` .* \| (\w+) \|.* \| (\w+) \|$", table.read_text(), re.MULTILINE)
    assert rows == [(name, "held", "broken") for name in vkbloom.antialiasing]


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults(fault: str) -> None:
    found = testing.report(Meter(fault))
    assert broken(found) == {*FAULTS[fault]}, found
    assert FAULTS[fault][0] in NAMES


def test_a_right_exposure() -> None:
    """With stops, with the picture, and with a state of its own."""
    testing.assert_laws(Meter())
    testing.assert_laws(Meter(gives_picture=True))
    meter, kept = Meter(), {"state": None}

    def keeps_its_state(image: Any, *, dt: float) -> float:
        stops, kept["state"] = meter(image, dt=dt, state=kept["state"])
        return float(stops)

    found = testing.report(keeps_its_state)
    found.assert_held()
    assert [row.name for row in found.rows] == NAMES
    assert found.untaken == ("state",)
    assert "the exposure takes no state" in str(found)
    assert found._repr_html_().startswith("<table")


def test_each_law_of_an_exposure_names_a_fault() -> None:
    assert {laws[0] for laws in FAULTS.values()} == {*NAMES}


def taa_and_bloom(order: str) -> Any:
    """Return a bloom with a TAA that limits its history by the range of 3 x 3 pixels."""
    side = (3, 3, 1)

    def bloom(image: Any) -> Any:
        return image + 0.2 * ndimage.gaussian_filter(image, (6, 6, 0))

    def resolve(image: Any, before: Any) -> Any:
        least, most = ndimage.minimum_filter(image, side), ndimage.maximum_filter(image, side)
        return image if before is None else 0.9 * np.clip(before, least, most) + 0.1 * image

    def step(image: Any, *, dt: float, state: Any) -> tuple[Any, Any]:
        if order == "bloom first":
            resolved = resolve(bloom(image), state)
            return resolved, resolved
        resolved = resolve(image, state)
        return bloom(resolved), resolved

    return step


#: Of presets: the order, this frame's share, and whether the state is handed on.
ORDERS: dict[str, tuple[Any, float | None, bool]] = {
    "TAA first": ("before", None, True),
    "bloom first": ("after", None, True),
    "nothing of the history": ("before", 1.0, True),
    "each frame begins anew": ("before", None, False),
}


@pytest.mark.parametrize("fault", ORDERS)
@pytest.mark.parametrize("name", some(vkbloom.antialiasing, 3))
def test_the_order_of_presets(renderer: vkbloom.Renderer, name: str, fault: str) -> None:
    order, weight, continues = ORDERS[fault]
    taa: Any = dataclasses.replace(vkbloom.antialiasing[name], order=order)
    if weight is not None:
        taa = vkbloom.BevyAntialiasing(weight=weight, min_weight=weight)

    def step(image: Any, *, dt: float, state: Any) -> tuple[Any, Any]:
        bloom = vkbloom.Pyramid(levels=4)
        frames = renderer.apply(image, bloom, taa=taa, state=state, framebuffers="final")
        return frames["final"], frames.state if continues else None

    (row,) = testing.report(step, laws=["shimmer"]).rows
    assert row.held == (fault == "TAA first"), row.message
    assert (row.figures["kept"] > 0.5) == (not row.held)


def test_the_order_of_bloom_and_taa() -> None:
    testing.assert_laws(taa_and_bloom("TAA first"), "shimmer")
    assert broken(testing.report(taa_and_bloom("bloom first"), laws=["shimmer"])) == {"shimmer"}
    for meter, text in ((Meter(), "no pictures"), (Meter(gives_picture=True), "has no bloom")):
        (row,) = testing.report(meter, laws=["shimmer"]).rows
        assert (row.held, row.applies, text in row.message) == (None, False, True)


def test_a_bloom_with_an_exposure(renderer: vkbloom.Renderer) -> None:
    """O3DE's meter sees the bloom, which is no fault; the state may change in place."""

    def step(image: Any, *, dt: float, state: Any) -> tuple[Any, Any]:
        frames = renderer.apply(
            image, vkbloom.Pyramid(levels=2), exposure="o3de", dt=dt, state=state or {}
        )
        return frames["final"], frames.state

    testing.assert_laws(step, "still", "scale", "mirror", "monotone", "dark_pixels")


def test_laws_of_the_other_kind_are_not_tested() -> None:
    found = testing.report(Meter(), laws=["gain", "still"])
    gain, still = found.rows
    assert (gain.held, gain.message) == (
        None,
        "this is a law of a bloom, and not of an exposure, which takes dt",
    )
    assert still.held
    found = testing.report(lambda image: image, laws=["still"], size=(16, 16))
    assert found.rows[0].held is None
    assert found.untaken == ("region", "time")
    assert "without dt, the laws of exposures are not tested" in str(found)
    assert not {row.name for row in testing.report(lambda x: x, size=(16, 16)).rows} & {*NAMES}


def test_limits() -> None:
    found = testing.report(
        Meter("the border fills no block"), laws=["mirror"], limits={"mirror": {"across": np.inf}}
    )
    assert found.rows[0].held


PROGRAM = """\
import json, os, sys
import numpy as np, OpenImageIO as oiio
from tests.exposure.meters import Meter
source, target, dt, file = sys.argv[1:]
state = json.load(open(file)) if os.path.exists(file) else None
image = oiio.ImageBuf(source).get_pixels(oiio.FLOAT)
picture, state = Meter(FAULT, True)(image, dt=float(dt), state=state)
json.dump(state, open(file, "w"))
oiio.ImageBuf(np.asarray(picture, np.float32)).write(target)
"""


def command(folder: Path, words: str = "{input} {output} {dt} {state}", fault: str = "") -> str:
    file = folder / "engine.py"
    file.write_text(PROGRAM.replace("FAULT", repr(fault)))
    return f"{sys.executable} {file} {words}"


def test_programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    fault = "the border fills no block"
    meter = testing.command(command(tmp_path, fault=fault).split())
    found = testing.report(meter, laws=["mirror"])
    assert broken(found) == {"mirror"}
    meter = testing.command([sys.executable, "-c", "pass", "{input}", "{output}", "{dt}"])
    with pytest.raises(FileNotFoundError, match=r"wrote no file for \{output\}"):
        testing.report(meter, laws=["still"])
    copy = "import sys, shutil; shutil.copy(*sys.argv[1:3])"
    words = [sys.executable, "-c", copy, "{input}", "{output}", "{dt}", "{state}"]
    with pytest.raises(FileNotFoundError, match=r"wrote no file for \{state\}"):
        testing.report(testing.command(words), laws=["still"])
    with pytest.raises(ValueError, match="it writes integers"):
        testing.report(testing.command(words, suffix=".png"), laws=["still"])


@pytest.mark.usefixtures("kept_renderers")
def test_the_command(tmp_path: Path) -> None:
    words = ["check", "--exposure", "godot", "--size", "64x36", "--json"]
    done = run(*words, "--require", "still,mirror", "--html", tmp_path / "page.html")
    assert done.exit_code == 1
    assert "required law mirror: no" in done.stderr
    values = json.loads(done.stdout)
    assert values["exposure"]["engine"] == "godot"
    assert list(values["laws"]) == NAMES
    schema = json.loads((Path(testing.__file__).parent / "check.schema.json").read_text())
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate(values, schema)
    assert "point spread" not in (tmp_path / "page.html").read_text()

    words += ["--preset", "bevy_natural", "--measure-size", "32x24"]
    done = run(*words, "--against", "hdrp", "--require", "mirror,scale")
    assert done.exit_code == 0
    values = json.loads(done.stdout)
    jsonschema.validate(values, schema)
    assert values["bloom"]["settings"]["method"] == "bevy"
    assert "broken: frame_rate" in values["summary"]


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["--exposure", "gdot"], "did you mean 'godot'?"),
        (["--exposure", "bevy", "--gain", "1"], "--gain is of a bloom, not an exposure"),
        (["--exposure", "bevy", "--command", "a {input} {output}"], "cannot be combined"),
        (["--exposure", "bevy", "--against", "a {input} {output}"], "cannot be compared"),
        (["--exposure", "bevy", "--against", "hdr"], "--against: exposure 'hdr'"),
    ],
)
def test_wrong_use(words: list[str], error: str) -> None:
    done = run("check", *words)
    assert done.exit_code == 2
    assert error in one_line(done.stderr)
