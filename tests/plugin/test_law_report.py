"""`vkbloom.testing.report`: all laws at once, and the words on the broken ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from vkbloom import DualKawase, Renderer, Separable, reference, testing
from vkbloom.testing import LawReport, LawRow

Image = NDArray[Any]
ALL = [
    "superposition",
    "gain",
    "symmetric",
    "transposed",
    "centroid_kept",
    "separable",
    "no_ringing",
    "bounded_fireflies",
    "additive",
]


def box_chain(image: Image) -> Image:
    """Average boxes of 8 x 8 pixels: a correct chain of three halvings."""
    height, width, channels = image.shape
    small = image.reshape(height // 8, 8, width // 8, 8, channels).mean((1, 3))
    return np.repeat(np.repeat(small, 8, axis=0), 8, axis=1)


def row(report: LawReport, name: str) -> LawRow:
    return next(each for each in report.rows if each.name == name)


def broken(report: LawReport) -> list[str]:
    return [each.name for each in report.rows if not each.held]


def test_a_gaussian() -> None:
    found = testing.report(
        lambda image: ndimage.gaussian_filter(image, (2, 2, 0), mode="nearest"), size=(64, 48)
    )
    assert [each.name for each in found.rows] == ALL
    assert broken(found) == ["bounded_fireflies", "additive"]
    assert found.gain == pytest.approx(1)
    found.assert_held("superposition", "gain", "symmetric", "centroid_kept", "separable")
    for each in found.rows:
        assert each.held == (each.off <= each.limit)
        assert bool(each.message) == (not each.held)


def test_a_correct_chain_of_boxes_says_why_it_moves_light() -> None:
    found = testing.report(box_chain, size=(64, 64))
    centroid = row(found, "centroid_kept")
    assert centroid.held is False
    assert centroid.off == pytest.approx(3.5)
    assert centroid.limit == pytest.approx(0.01, abs=1e-3)
    assert "averages boxes of 2 x 2 pixels" in centroid.why
    assert centroid.why.endswith("over 16 positions: -3.5 to +3.5 pixels, +0 on average.")
    assert str(found).splitlines()[6].split() == ["centroid_kept", "no", "3.5", "0.0102"]


def test_a_missing_half_texel_is_no_chain() -> None:
    found = testing.report(
        lambda image: ndimage.uniform_filter(image, (4, 4, 0), mode="nearest"), size=(64, 64)
    )
    assert {"symmetric", "centroid_kept"} <= set(broken(found))
    why = row(found, "centroid_kept").why
    assert why.endswith("all positions move alike, as with a missing half texel.")


def test_a_threshold_is_tested_above_it() -> None:
    found = testing.report(lambda image: np.maximum(image - 1, 0), size=(32, 32))
    assert found.probe.value == 16
    assert "superposition" in broken(found)
    assert row(found, "superposition").why.startswith("A threshold, a clamp, a firefly filter")


def test_a_bloom_that_reaches_the_border_is_not_tested() -> None:
    found = testing.report(
        lambda image: ndimage.gaussian_filter(image, (9, 9, 0), mode="nearest"), size=(24, 24)
    )
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
    assert sum(line.startswith("  why: ") for line in lines) == len(broken(found))
    with pytest.raises(ValueError, match="names: 'gian' is not one of superposition, gain"):
        found.assert_held("gian")


def test_html() -> None:
    page = testing.report(box_chain, size=(32, 32))._repr_html_()
    assert page.count('<th scope="row"') == len(ALL)
    assert "averages boxes" in page
    assert "<b>no</b>" in page
    assert "F(a) &gt;= a" in page


@pytest.mark.parametrize("dtype", ["uint8", "float16"])
def test_another_probe(renderer: Renderer, dtype: str) -> None:
    probe = testing.Probe(size=(64, 48), channels=4, dtype=dtype, value=0.5)
    found = testing.report(
        lambda image: renderer.apply(image, Separable(blur_strength=1.0))["bloom"], probe=probe
    )
    assert found.probe == probe
    found.assert_held("superposition", "gain", "symmetric", "separable", "no_ringing")
    assert (row(found, "bounded_fireflies").held is None) == (dtype == "uint8")


def test_a_picture_with_its_bloom_is_additive(renderer: Renderer) -> None:
    found = testing.report(
        lambda image: renderer.apply(image, DualKawase(levels=2))["final"], size=(64, 64)
    )
    found.assert_held("additive", "superposition", "gain")


def test_what_is_no_bloom() -> None:
    with pytest.raises(TypeError, match="bloom: 3 is not callable"):
        testing.report(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="name the framebuffer"):
        testing.report(lambda image: reference.apply(image, Separable()))  # type: ignore[arg-type,return-value]


def test_results_that_are_not_finite() -> None:
    with pytest.raises(AssertionError, match="the bloom of finite values is finite"):
        testing.report(lambda image: image * np.nan, size=(16, 16))
