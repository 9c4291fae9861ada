"""Each fault of the library breaks the law that names it, and no correct twin breaks a law."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plugin.faults import FAULTS
from vkbloom import Renderer, presets, reference, testing
from vkbloom.testing._law_table import LAWS

#: Laws of these faults: linear blurs of a width in pixels break others on purpose.
NEW = ("border", "views", "sizes", "round", "alpha", "jitter", "history")
SIZE = (64, 64)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_breaks_its_law(name: str) -> None:
    fault, twin, law, words = FAULTS[name]
    laws = sorted({*NEW, law})
    right = testing.report(twin(), size=SIZE, laws=laws)
    assert not [row.name for row in right.rows if row.applies and not row.held], right
    found = testing.report(fault(), size=SIZE, laws=laws)
    broken = {row.name: row.message for row in found.rows if row.held is False}
    assert words in broken[law], found


def test_laws_that_need_more_than_an_image_say_so() -> None:
    found = testing.report(lambda image: image[..., :3] * np.ones(3), size=SIZE, laws=["views"])
    assert found.rows[0].held is None
    assert "takes no keyword region" in found.rows[0].message
    testing.report(lambda image: image, size=SIZE).assert_held()


def test_each_law_has_a_limit() -> None:
    assert {name for name in NEW if not LAWS[name].limit} == set()


@pytest.mark.parametrize("name", ["bevy_natural", "unity_urp", "threejs_unreal", "pygfx"])
def test_energies_at_the_border_are_those_of_the_reference(renderer: Renderer, name: str) -> None:
    settings = presets[name].replace(format="rgba32float")
    probe = testing.Probe(size=(96, 64), value=16.0)
    device = testing.border_energy(
        lambda image: renderer.apply(image, settings)["bloom"][..., :3], probe
    )
    expected = testing.border_energy(
        lambda image: reference.apply(image, settings)["bloom"][..., :3], probe
    )
    assert device == pytest.approx(expected, rel=1e-3)
