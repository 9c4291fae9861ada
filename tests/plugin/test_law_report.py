"""`vkbloom.testing.report`: all laws at once, and the words on the broken ones."""

from __future__ import annotations

import functools
import re
import runpy
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from tests.plugin.faults import FAULTS, at_finite, gaussian
from vkbloom import Renderer, Separable, testing
from vkbloom._views import markup
from vkbloom._views.markup import Markup
from vkbloom.testing import LawReport, Probe
from vkbloom.testing._law_report import LawRow
from vkbloom.testing._laws.table import LAWS

Image = NDArray[Any]
Bloom = Callable[[Image], Image]
#: Without a reference there is nothing to compare with.
ALL = [name for name in LAWS if name not in {"field", "reference"}]
#: What every linear bloom of a width in pixels breaks, where it does not replace NaN.
OF_A_BLUR = {"bounded_fireflies", "additive", "resolution", "finite"}


def box_chain(image: Image) -> Image:
    """Average boxes of 8 x 8 pixels: a correct chain of three halvings."""
    height, width, channels = image.shape
    small = image.reshape(height // 8, 8, width // 8, 8, channels).mean((1, 3))
    return np.repeat(np.repeat(small, 8, axis=0), 8, axis=1)


def row(report: LawReport, name: str) -> LawRow:
    return next(each for each in report.rows if each.name == name)


def list_broken(report: LawReport) -> list[str]:
    return [each.name for each in report.rows if each.applies and not each.held]


def test_a_gaussian() -> None:
    found = testing.report(gaussian, size=(64, 48))
    assert [each.name for each in found.rows] == ALL
    assert set(list_broken(found)) == OF_A_BLUR
    assert found.gain == pytest.approx(1)
    found.assert_held("superposition", "gain", "symmetric", "centroid_kept", "separable")
    for each in found.rows:
        if not each.applies:
            continue
        assert each.held == (each.off <= each.limit)
        assert bool(each.message) == (not each.held)
        assert each.figures[max(each.figures, key=lambda name: each.figures[name] == each.off)] >= 0


#: Faults whose broken laws are all told.
TOLD = {name: fault for name, fault in FAULTS.items() if fault.others is not None}


@functools.cache
def broken_by(bloom: Bloom) -> set[str]:
    return set(list_broken(testing.report(bloom, size=(64, 64))))


@pytest.mark.parametrize("name", TOLD)
def test_a_fault_is_named(name: str) -> None:
    fault, correct, law, _, others, _ = FAULTS[name]
    found = testing.report(fault(), size=(64, 64))
    new = set(list_broken(found)) - broken_by(correct())
    # Some of these functions mix alpha with colours, too.
    assert new - ({"bounded_fireflies", "alpha"} - {law}) == {law, *(others or ())}, found


@pytest.mark.parametrize("sigma", [0.5, 1.0, 2.0, 3.0])
def test_right_blurs_are_not_blamed(sigma: float) -> None:
    found = testing.report(lambda image: gaussian(image, sigma), size=(64, 64))
    assert set(list_broken(found)) <= OF_A_BLUR


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (
            lambda a: np.roll(box_chain(a), -1, 1),
            "shifted by -1 pixels along x, on average over all positions.",
        ),
        (
            lambda a: np.roll(box_chain(a), (2, 2), (0, 1)),
            "+2 pixels along x and +2 pixels along y, on average",
        ),
        (lambda a: np.roll(box_chain(a), -3, 0), "-3 pixels along y, on average"),
        (
            lambda a: ndimage.uniform_filter(a, (2, 1, 1), mode="nearest"),
            "+0.5 pixels along y, on average",
        ),
        (
            lambda a: np.asarray(ndimage.shift(a, (0, 0.3, 0), order=1)),
            "+0.3 pixels along x, on average over all positions.",
        ),
    ],
)
def test_a_constant_shift_is_told_as_such(fault: Bloom, words: str) -> None:
    found = row(testing.report(fault, size=(64, 64), laws=["centroid_kept"]), "centroid_kept")
    assert words in found.why
    assert "back on average" not in found.why


def test_a_correct_chain_of_boxes_says_why_it_moves_light() -> None:
    found = testing.report(box_chain, size=(64, 64))
    centroid = row(found, "centroid_kept")
    assert centroid.held is False
    assert centroid.off == pytest.approx(3.5)
    assert centroid.limit == pytest.approx(0.01, abs=1e-3)
    assert "averages boxes of 2 x 2 pixels" in centroid.why
    assert centroid.why.endswith("back on average over all positions.")
    assert str(found).splitlines()[6].split() == ["centroid_kept", "no", "3.5", "0.0102"]


def test_a_missing_half_texel_is_no_chain() -> None:
    found = testing.report(
        lambda image: ndimage.uniform_filter(image, (4, 4, 0), mode="nearest"), size=(64, 64)
    )
    assert {"symmetric", "centroid_kept"} <= set(list_broken(found))
    assert "a shift of half a texel" in row(found, "centroid_kept").why


def test_a_threshold_is_tested_above_it() -> None:
    found = testing.report(lambda image: np.maximum(image - 1, 0), size=(32, 32))
    assert found.probe.value == 16
    assert "superposition" in list_broken(found)
    assert row(found, "superposition").why.startswith("A threshold, a clamp, a firefly filter")


def test_a_bloom_that_reaches_the_border_is_not_tested() -> None:
    found = testing.report(lambda image: gaussian(image, 9.0), size=(24, 24))
    centroid = row(found, "centroid_kept")
    assert (centroid.held, centroid.words) == (None, "not tested")
    assert centroid.message.endswith("a larger size is needed")
    with pytest.raises(AssertionError, match="centroid_kept: probe: of the light"):
        found.assert_held("centroid_kept")


def test_assert_held() -> None:
    found = testing.report(box_chain, size=(32, 32))
    with pytest.raises(AssertionError) as caught:
        found.assert_held()
    lines = str(caught.value).splitlines()
    assert [line for line in lines if line.startswith("additive: ")]
    assert sum(line.startswith("  why: ") for line in lines) == len(list_broken(found))
    with pytest.raises(ValueError, match="names: 'gian' is not one of superposition, gain"):
        found.assert_held("gian")


def test_html() -> None:
    page = testing.report(box_chain, size=(32, 32))._repr_html_()
    assert page.count('<th scope="row"') == len(ALL)
    assert "averages boxes" in page
    assert "<b>no</b>" in page
    assert "F(a) &gt;= a" in page
    # A broken law that is promised, and one that is not.
    colours = [
        testing.report(box_chain, size=(32, 32), laws=laws)._repr_html_().count("color:#c33")
        for laws in ("all", ["symmetric"], ["symmetric", "centroid_kept"])
    ]
    assert colours == [0, 0, 2]


def test_laws_are_chosen_by_name() -> None:
    found = testing.report(gaussian, size=(32, 32), laws=["stability", "gain", "reference"])
    assert [(each.name, each.held) for each in found.rows] == [
        ("gain", True),
        ("stability", True),
        ("reference", None),
    ]
    assert found.required == ("stability", "gain", "reference")
    with pytest.raises(ValueError, match="laws: 'gian' is not one of superposition, gain"):
        testing.report(gaussian, laws=["gian"])


def test_a_gain_that_is_promised() -> None:
    def half(image: Image) -> Image:
        return 0.5 * at_finite(image)

    testing.report(half, size=(32, 32), gain=0.5).assert_held("gain", "energy")
    assert {"gain", "energy"} <= set(list_broken(testing.report(half, size=(32, 32), gain=1.0)))
    # A picture with its bloom, or a sum of levels, has one gain, which nobody promised.
    assert list_broken(testing.report(half, size=(32, 32), laws=("gain", "energy"))) == ["energy"]


def test_a_light_below_the_rounding_is_not_judged() -> None:
    probe = Probe(size=(64, 64), atol=0.018)
    found = testing.report(lambda image: gaussian(image, 3.0), probe=probe)
    assert {row(found, name).held for name in ("centroid_kept", "separable", "energy")} == {None}


@pytest.mark.parametrize("dtype", ["uint8", "float16"])
def test_another_probe(renderer: Renderer, dtype: str) -> None:
    probe = testing.Probe(size=(64, 48), channels=4, dtype=dtype, value=0.5)
    found = testing.report(
        lambda image: renderer.apply(image, Separable(blur_strength=1.0))["bloom"], probe=probe
    )
    assert found.probe == probe
    found.assert_held("superposition", "gain", "symmetric", "separable", "no_ringing")
    assert (row(found, "bounded_fireflies").held is None) == (dtype == "uint8")


def test_the_page_lists_all_laws(tmp_path: Path) -> None:
    docs = Path(__file__).parents[2] / "docs"
    page = tmp_path / "laws.md"
    runpy.run_path(str(docs / "law_table.py"))["write"](page)
    says, figures = page.read_text().split("\n\n")
    assert re.findall(r"^\| `(\w+)` \| [^|]+\. \| [^|]{20,}\. \|$", says, re.MULTILINE) == [*LAWS]
    listed = re.findall(r"^\| `(\w+)` \| `(.+)` \| [^|]+ \| (.*) \|$", figures, re.MULTILINE)
    limits = [(law.name, *limit) for law in LAWS.values() for limit in law.limits.items()]
    assert [(law, name, float(limit)) for law, name, limit in listed if limit] == limits
    assert "{include} examples/laws.md" in (docs / "check.md").read_text()
    assert '"examples" / "laws.md"' in (docs / "conf.py").read_text()


class Broken(Exception):
    """An error that no law knows."""


@pytest.mark.parametrize("error", [Broken, OSError, ValueError, TypeError, IndexError])
def test_an_error_of_the_bloom_fails_its_law(error: type[Exception]) -> None:
    """As of a program that ends with status 1 where it is given NaN."""

    def bloom(image: Image) -> Image:
        if not np.isfinite(image).all():
            raise error("no finite light")
        return gaussian(image)

    found = testing.report(bloom, size=(32, 32))
    finite = row(found, "finite")
    assert (finite.held, finite.applies) == (False, True)
    assert finite.message == f"the bloom raised {error.__name__}: no finite light"
    right = testing.report(gaussian, size=(32, 32))
    assert list_broken(found) == list_broken(right)


def test_a_result_of_another_shape_fails_its_law() -> None:
    def bloom(image: Image) -> Image:
        return gaussian(image)[: len(image) // 48 * 48 or None]

    found = row(testing.report(bloom, size=(48, 48), laws=["sizes"]), "sizes")
    assert found.held is False
    assert "the bloom raised ValueError: bloom: it returns shape (48, " in found.message


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit])
def test_an_interrupt_ends_the_report(error: type[BaseException]) -> None:
    def bloom(image: Image) -> Image:
        if not np.isfinite(image).all():
            raise error
        return gaussian(image)

    with pytest.raises(error):
        testing.report(bloom, size=(32, 32), laws=["finite"])


def test_the_first_error_is_that_of_the_bloom() -> None:
    def bloom(image: Image) -> Image:
        raise Broken("always")

    with pytest.raises(Broken, match="always"):
        testing.report(bloom, size=(32, 32))
    with pytest.raises(Broken, match="always"):
        testing.report(bloom, probe=Probe())


def test_an_error_with_four_channels_is_not_tested() -> None:
    def bloom(image: Image) -> Image:
        if image.shape[2] == 4:
            raise Broken("three channels")
        return gaussian(image)

    alpha = row(testing.report(bloom, size=(32, 32), laws=["alpha"]), "alpha")
    assert (alpha.held, alpha.applies) == (None, False)


def test_a_bloom_may_work_in_place() -> None:
    def in_place(image: Image) -> Image:
        image[...] = gaussian(image)
        return image

    found, right = (testing.report(bloom, size=(48, 48)) for bloom in (in_place, gaussian))
    assert [(each.name, each.held) for each in found.rows] == [
        (each.name, each.held) for each in right.rows
    ]


#: Writes the texts of all cells but the last of a row that stand on several lines.
BROKEN_WORDS = """\
<script>
const lines = cell => {
    const range = document.createRange();
    range.selectNodeContents(cell);
    return new Set([...range.getClientRects()].map(one => Math.round(one.top))).size;
};
const cells = [...document.querySelectorAll("tbody th, tbody td:not(:last-child), thead th")];
document.body.dataset.broken = cells.filter(one => lines(one) > 1).map(one => one.textContent);
document.body.dataset.cells = cells.length;
</script>
"""


def test_a_page_of_1280_pixels_breaks_no_word(tmp_path: Path) -> None:
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("Chromium is not installed")
    page = tmp_path / "page.html"
    found = testing.report(box_chain, size=(32, 32))
    text = markup.page("laws", Markup(found._repr_html_()))
    page.write_text(text.replace("</body>", f"{BROKEN_WORDS}</body>"))
    words = ["--headless", "--no-sandbox", "--disable-gpu", "--window-size=1280,1200", "--dump-dom"]
    dumped = subprocess.run(
        [chromium, *words, f"--user-data-dir={tmp_path}/profile", str(page)],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    ).stdout
    assert int(re.findall(r'data-cells="(\d+)"', dumped)[0]) > 100
    assert re.findall(r'data-broken="(.*?)"', dumped) == [""]
