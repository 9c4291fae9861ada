"""Names that are not known: the message says what was meant."""

from __future__ import annotations

import copy
import inspect
import pickle
from typing import Any

import numpy as np
import pytest

import vkbloom
from vkbloom import psf
from vkbloom._settings.registry import METHODS, STAGES
from vkbloom._suggestions import nearest

IMAGE = np.zeros((8, 8, 3), np.float32)


def test_own_methods(renderer: vkbloom.Renderer) -> None:
    text = """//!PARAM softness
//!TYPE float
//!MINIMUM 0
//!MAXIMUM 1
0.5

//!HOOK MAIN
//!BIND GLOW
//!SAVE BLOOM
vec4 hook() { return GLOW_tex(GLOW_pos) * softness; }
"""
    own: Any = vkbloom.load_method(text, name="soft_one")
    try:
        with pytest.raises(TypeError, match="did you mean 'softness'\\?"):
            own(softnes=1)
        with pytest.raises(TypeError, match="did you mean 'softness'\\?"):
            own().replace(softnes=1)
        with pytest.raises(ValueError, match=f"give {own.__name__}\\(\\)"):
            renderer.apply(IMAGE, "soft_one")
        assert own().replace(softness=1) == pickle.loads(pickle.dumps(own(softness=1)))
    finally:
        METHODS.unregister("soft_one")


def test_the_signature_is_that_of_the_fields() -> None:
    assert str(inspect.signature(psf.gaussian)).startswith("(sigma: 'float')")
    assert list(inspect.signature(vkbloom.Pyramid).parameters)[:2] == ["bloom", "threshold"]


def test_nothing_is_near() -> None:
    assert nearest("zzz", ["final", "bloom"]) is None
    assert nearest("of", ["roof_garden"]) is None
    for asked, known in (
        ("--gpu", "--psf"),
        ("blade", "balance"),
        ("strength", "threshold"),
        ("saturate", "scatter"),
        ("roof", "proof_reader"),
    ):
        assert nearest(asked, [known]) is None
    assert nearest("unity", ["unity_urp", "kino"]) == "unity_urp"
    assert nearest("kion", ["unity_urp", "kino"]) == "kino"
    assert nearest("--tresholds", ["--threshold"]) == "--threshold"


def test_registries_are_tables() -> None:
    lines = [line.split() for line in repr(METHODS).splitlines()]
    assert ["pyramid", "vkbloom._methods.mip_chain:Pyramid"] in lines
    assert ">streaks</td>" in STAGES._repr_html_()


@pytest.mark.parametrize(
    ("named", "kind"), [(vkbloom.presets, "preset"), (vkbloom.glares, "glare")]
)
def test_published_names_are_a_table(named: Any, kind: str) -> None:
    lines = repr(named).splitlines()
    assert [line.split()[0] for line in lines] == list(named)
    assert max(map(len, lines)) <= 110
    assert repr(named).count("\n") + 1 == named._repr_html_().count("<tr>") - 1 == len(named)
    assert {*named} <= {*dir(named)}
    for name in named:
        assert getattr(named, name) == named[name]
    first = next(iter(named))
    with pytest.raises(AttributeError, match=f"unknown {kind} '{first}x'; did you mean '{first}'"):
        getattr(named, f"{first}x")
    assert dict(copy.copy(named)) == dict(pickle.loads(pickle.dumps(dict(named))))
