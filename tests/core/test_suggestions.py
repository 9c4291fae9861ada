"""Names that are not known: the message says what was meant."""

from __future__ import annotations

import copy
import inspect
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import vkbloom
from vkbloom import psf
from vkbloom._settings.registry import METHODS, STAGES
from vkbloom._suggestions import nearest

IMAGE = np.zeros((8, 8, 3), np.float32)


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (
            lambda: vkbloom.Pyramid(treshold=1),  # type: ignore[call-arg]
            TypeError,
            "Pyramid has no 'treshold'; did you mean 'threshold'?",
        ),
        (
            lambda: vkbloom.Pyramid().replace(scatter=0.3),
            TypeError,
            "Pyramid has no 'scatter', which urp, hdrp have",
        ),
        (
            lambda: vkbloom.UrpBloom().replace(Scater=0.3),
            TypeError,
            "UrpBloom has no 'Scater'; did you mean 'scatter'?",
        ),
        (
            lambda: vkbloom.Streaks(direction=4),  # type: ignore[call-arg]
            TypeError,
            "Streaks has no 'direction'; did you mean 'directions'?",
        ),
        (
            lambda: psf.gaussian(sgma=2),  # type: ignore[call-arg]
            TypeError,
            "gaussian has no 'sgma'; did you mean 'sigma'?",
        ),
        (
            lambda: vkbloom.Settings.from_dict({"method": "pyramid", "treshold": 1}),
            ValueError,
            "fields: pyramid has no 'treshold'; did you mean 'threshold'?",
        ),
        (
            lambda: vkbloom.Settings.from_dict({"method": "piramid"}),
            ValueError,
            "; did you mean 'pyramid'?",
        ),
        (
            lambda: psf.PSF.from_dict({"psf": "gausian", "sigma": 1}),
            ValueError,
            "; did you mean 'gaussian'?",
        ),
        (
            lambda: vkbloom.Pyramid(composite="scren"),  # type: ignore[arg-type]
            ValueError,
            "; did you mean 'screen'?",
        ),
        (
            lambda: vkbloom.Pyramid(glare="anamorfic"),  # type: ignore[arg-type]
            ValueError,
            "; did you mean 'anamorphic'?",
        ),
        (
            lambda: vkbloom.presets["urp"],
            KeyError,
            "unknown preset 'urp'; did you mean 'unity_urp'? available: tutorial, ",
        ),
        (
            lambda: vkbloom.glares["Anamorphic"],
            KeyError,
            "unknown glare 'Anamorphic'; did you mean 'anamorphic'? available: ",
        ),
    ],
)
def test_names_of_python(call: Callable[[], Any], kind: type[Exception], message: str) -> None:
    with pytest.raises(kind) as error:
        call()
    assert message in str(error.value.args[0])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("Kno", "settings: unknown preset 'Kno'; did you mean 'kino'?"),
        ("pyramid", "settings: 'pyramid' is a method; give vkbloom.Pyramid()"),
        (vkbloom.Pyramid, "; give Pyramid(), an object of the class"),
        ({"levels": 3}, "; give vkbloom.Settings.from_dict(...) of it"),
        ("?", "settings: unknown preset '?'; available: tutorial, "),
    ],
)
def test_settings_by_name(renderer: vkbloom.Renderer, given: Any, message: str) -> None:
    calls: list[Callable[[], Any]] = [
        lambda: renderer.apply(IMAGE, given),
        lambda: renderer.plan(IMAGE, given),
        lambda: vkbloom.grid(IMAGE, given, {"intensity": [1]}, renderer=renderer),
        lambda: renderer.render(vkbloom.Scene.ufo(), given),
        lambda: renderer.map([IMAGE], given),
    ]
    for call in calls:
        with pytest.raises(ValueError if isinstance(given, str) else TypeError) as error:
            call()
        assert message in str(error.value)


def test_framebuffers(renderer: vkbloom.Renderer) -> None:
    message = "unknown framebuffer 'blom'; did you mean 'bloom'\\? available: "
    with pytest.raises(ValueError, match=f"framebuffers: {message}glow, "):
        renderer.apply(IMAGE, framebuffers=["blom"])
    with pytest.raises(ValueError, match=f"framebuffers: {message}"):
        renderer.map([IMAGE], framebuffers=["blom"])
    with pytest.raises(KeyError) as error:
        renderer.apply(IMAGE, framebuffers=["bloom", "final"])["blom"]
    assert str(error.value.args[0]) == (
        "unknown framebuffer 'blom'; did you mean 'bloom'? available: bloom, final"
    )


def test_axes_and_fits(renderer: vkbloom.Renderer) -> None:
    with pytest.raises(ValueError, match="; did you mean 'intensity'\\? "):
        vkbloom.grid(IMAGE, vkbloom.Pyramid(), {"intensty": [1]}, renderer=renderer)
    lit = IMAGE + 1
    with pytest.raises(ValueError, match="no field 'intensty'; did you mean 'intensity'\\? "):
        vkbloom.fit(lit, lit, vkbloom.Pyramid(), ["intensty"], renderer=renderer)


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
    assert "pyramid      vkbloom._methods.mip_chain:Pyramid\n" in repr(METHODS)
    assert "<td>streaks</td>" in STAGES._repr_html_()


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
