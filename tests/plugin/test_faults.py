"""Each fault of the library breaks the law that names it, and no correct bloom breaks a law."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plugin.faults import FAULTS, Image
from vkbloom import presets, reference, testing
from vkbloom.testing._laws.table import LAWS

#: Laws of these faults: linear blurs of a width in pixels break others on purpose.
NEW = ("border", "views", "sizes", "round", "alpha", "jitter", "history")
SIZE = (64, 64)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_breaks_its_law(name: str) -> None:
    fault, correct, law, words, _, field = FAULTS[name]
    # The bloom of a field is not the same at the border and in the middle.
    laws = sorted({*NEW, law}) if field is None else [law]
    right = testing.report(correct(), size=SIZE, laws=laws, field=field)
    assert not [row.name for row in right.rows if row.applies and not row.held], right
    found = testing.report(fault(), size=SIZE, laws=laws, field=field)
    broken = {row.name: row.message for row in found.rows if row.held is False}
    assert words in broken[law], found
    for row in found.rows:
        declared = {*LAWS[row.name].figures}
        # A name in upper case stands for several.
        assert {*row.figures} <= declared or any(name.isupper() for name in declared)


def test_laws_that_need_more_than_an_image_say_so() -> None:
    found = testing.report(lambda image: image[..., :3] * np.ones(3), size=SIZE, laws=["views"])
    assert found.rows[0].held is None
    assert "takes no keyword region" in found.rows[0].message
    testing.report(lambda image: image, size=SIZE).assert_held()


def test_laws_share_images_and_render_few() -> None:
    """For border 11, sizes 8, round and flat images 4, alpha 2, jitter 15, history 16."""
    images = []

    def bloom(image: Image) -> Image:
        images.append(image)
        return FAULTS["wraps around"].correct()(image)

    testing.report(bloom, size=SIZE, laws=NEW)
    assert len(images) <= 60


def test_each_law_has_a_limit_and_a_fault() -> None:
    """Without a reference beside it, no bloom breaks the law `reference` (custom/test_check)."""
    assert [name for name, law in LAWS.items() if not law.limits] == []
    assert {*LAWS} - {fault.law for fault in FAULTS.values()} == {"reference"}


@pytest.mark.parametrize("law", ["border", "sizes"])
def test_light_that_leaves_a_small_image_is_not_judged(law: str) -> None:
    settings = presets["dual_kawase"]
    found = testing.report(
        lambda image: reference.apply(image, settings)["bloom"][..., :3], size=(64, 64), laws=[law]
    )
    (row,) = found.rows
    if law == "border":  # its corners swell by formula
        assert "swells" in row.message
        assert "opposite" not in row.message
    else:
        assert (row.held, "a larger size is needed" in row.message) == (None, True)


def test_a_threshold_of_an_average_is_no_fault_of_alpha() -> None:
    """Half of the size is averaged before the threshold, so that light and backdrop add up."""
    settings = presets["unity_ppv2"]
    testing.assert_laws(
        lambda image: reference.apply(image, settings)["final"],
        "alpha",
        probe=testing.Probe(size=(64, 64), value=16.0),
    )
