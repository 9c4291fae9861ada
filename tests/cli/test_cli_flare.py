"""`vkbloom flare`: reports of pictures and blooms, the charts, and wrong use."""

from __future__ import annotations

import importlib.resources
import json
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import one_line, run, succeed
from vkbloom import testing

pytestmark = pytest.mark.usefixtures("kept_renderers")

SIZE = (120, 80)


def veil(image: Any, share: float = 0.04) -> Any:
    return (1 - share) * image + share * image.mean(axis=(0, 1))


def checked(text: str) -> Any:
    """Return a report that fits the published schema."""
    found = json.loads(text)
    schema = importlib.resources.files("vkbloom.testing").joinpath("flare.schema.json")
    pytest.importorskip("jsonschema").validate(found, json.loads(schema.read_text()))
    return found


@pytest.fixture
def charts(tmp_path: Path) -> Path:
    """The charts that the command draws, and pictures of them with a uniform veil."""
    folder = tmp_path / "charts"
    done = succeed("flare", "--draw", folder, "--size", "120x80", "--suffix", ".exr")
    assert f"wrote {folder / 'layout.json'}" in done.stdout
    for file in [*folder.glob("*.exr")]:
        # White at a level of 225: what a photograph of the chart has.
        picture = 0.7529 * veil(vkbloom.read(file))
        vkbloom.write(folder / f"{file.stem}.png", picture, bits=16)
        vkbloom.write(folder / f"{file.stem}_8.png", picture)
    return folder


def test_pictures_of_the_drawn_charts(charts: Path, tmp_path: Path) -> None:
    files = ["--chart", charts / "chart.png", "--layout", charts / "layout.json"]
    for index in range(9):
        files += ["--spots", charts / f"spot_{index}.png"]
        files += ["--lights", charts / f"light_{index}.png"]
    page, table = tmp_path / "a.html", tmp_path / "a.md"
    done = run("flare", *files, "--json", "--html", page, "--markdown", table)
    assert done.exit_code == 0, done.output
    found = checked(done.stdout)
    chart = testing.FlareChart.from_json((charts / "layout.json").read_text())
    assert chart == testing.FlareChart(size=SIZE)
    mean = float(chart.draw("chart").mean())
    wanted = 100 * 0.04 * mean / (0.96 + 0.04 * mean)
    assert found["figures"]["iso18844.type_c"]["positions"] == pytest.approx([wanted] * 9, rel=0.01)
    assert found["missing"] == {
        "iso18844.type_a": "it needs the pictures chart_long and black",
        "iso18844.type_b": "it needs the picture black",
        "ieee2020.flare_intensity": "it needs the picture diffuser with diffuser_luminance and "
        "illuminance, or pixels_per_degree",
    }
    assert found["conditions"]["pictures"]["chart"]["saturation"] == 1
    assert found["conditions"]["pictures"]["lights"]["saturated_pixels"] == [0] * 9
    assert "<h2>Conditions</h2>" in page.read_text()
    assert "over the field" in page.read_text()
    assert "| iso18844.type_c | " in table.read_text()


def test_eight_bits_are_decoded(charts: Path) -> None:
    """Type B is within a level of sRGB near black, 0.04 % of the white; raw files are linear."""
    files = ["--chart", charts / "chart_8.png", "--black", charts / "black_8.png"]
    words = ["flare", *files, "--exposed", "black=1", "--standard", "iso18844", "--json"]
    figures = [
        checked(run(*words, *more).stdout)["figures"]["iso18844.type_b"] for more in ([], ["--raw"])
    ]
    mean = float(testing.FlareChart(size=SIZE).draw("chart").mean())
    wanted = 100 * 0.04 * mean / (0.96 + 0.04 * mean)
    assert figures[0]["value"] == pytest.approx(wanted, abs=0.04)
    # The curve of sRGB lifts dark values.
    assert figures[1]["value"] > 4 * wanted


def test_a_bloom() -> None:
    done = run("flare", "--preset", "dual_kawase", "--size", "120x80", "--json")
    assert done.exit_code == 0, done.output
    found = checked(done.stdout)
    assert found["name"] == "dual_kawase"
    assert found["missing"] == {}
    given = testing.flare("dual_kawase", chart=testing.FlareChart(size=SIZE))
    assert found == given.to_dict()
    assert "veiling glare" not in str(given.figures)
    assert given._repr_html_() in given.to_html()
    for name, figure in found["figures"].items():
        assert 0 < figure["value"] < 100, name


WRONG = {
    "": "give pictures, such as --chart FILE, or --preset or --method, or --draw FOLDER",
    "--chart a.png --preset kino": "give pictures",
    "--preset kino --standard iso": "'iso' is not one of all, iso18844, iso9358, ieee2020",
    "--preset kino --exposed chart": "'chart' is not PICTURE=FACTOR; PICTURE is one of chart",
    "--preset kino --size 300x3": "positions: that of 0",
}


@pytest.mark.parametrize("words", WRONG)
def test_wrong_use(words: str) -> None:
    done = run("flare", *words.split())
    assert done.exit_code == 2
    assert WRONG[words] in one_line(done.stderr)


def test_files_that_fail(charts: Path) -> None:
    for words, told in (
        (["--chart", charts / "no.png"], "No such file"),
        (["--spots", charts / "spot_0.png"], "spots has 1 pictures, not 9"),
        (["--preset", "kino", "--html", charts], "Is a directory"),
        (["--chart", charts / "chart.png", "--layout", charts / "chart.png"], ""),
    ):
        done = run("flare", *words)
        assert done.exit_code == 1, words
        assert told in one_line(done.stderr)


def test_charts_have_the_values_that_they_say() -> None:
    chart = testing.FlareChart(size=SIZE, contrast=40, radius=3.0, light_radius=2.0)
    images = {name: chart.draw(name)[..., 0] for name in chart.names}
    assert len(images) == 21
    dark = {"chart": 9, "spot_3": 1}
    for name, count in dark.items():
        lost = (1 - images[name]).sum(dtype=np.float64)
        assert lost == pytest.approx(count * np.pi * 9 * (1 - 1 / 40), rel=0.01)
    assert images["light_3"].sum(dtype=np.float64) == pytest.approx(np.pi * 4, rel=0.01)
    np.testing.assert_allclose(images["black"], 1 / 40, rtol=1e-6)
    assert testing.FlareChart.from_json(chart.to_json()) == chart
    grown = chart.scaled((240, 160))
    assert (grown.radius, grown.contrast) == (6.0, 40)
    assert grown.positions[4] == (120.5, 80.5)


def test_the_picture_of_the_docs(tmp_path: Path) -> None:
    """docs/conf.py runs it, for docs/flare.md."""
    docs = Path(__file__).parents[2] / "docs"
    runpy.run_path(str(docs / "flare_pictures.py"))["write"](tmp_path / "examples" / "flare")
    text = (tmp_path / "examples" / "flare.md").read_text()
    assert "| iso9358.veiling_glare_index | 7.6" in text
    assert vkbloom.read(tmp_path / "examples" / "flare" / "report.png").shape == (240, 1096, 3)
    assert "(examples/flare/report.png)" in text
