"""Wrong values: each is refused by what checks it, with the message of the table (refused.txt).

Wrong types of all arguments: test_argument_types.py. The core's own: test_core_arguments.py.
"""

from __future__ import annotations

import copy
import functools
import inspect
import math
import pickle
from collections.abc import Iterator
from decimal import Decimal
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.framebuffers import make, make_mixed
from tests.refusals import assert_refused, rows
from vkbloom import FilamentBloom, Frames, Renderer, Scene, Separable, Settings, _core, presets, psf
from vkbloom._renderer.surface import Surface
from vkbloom._settings.registry import METHODS, STAGES

SIZE = (16, 9)


@pytest.fixture(scope="module")
def names(renderer: Renderer, scene: Scene) -> Iterator[dict[str, Any]]:
    """The names that the tables use."""
    image = np.zeros((9, 16, 4), np.float32)
    closed = Renderer()
    of_closed = closed.upload(image)
    closed.close()
    public = {name: getattr(vkbloom, name) for name in vkbloom.__all__}
    on_renderer = {
        name: functools.partial(public[name], renderer=renderer) for name in ("fit", "grid", "vjp")
    }
    render = functools.partial(renderer.render, scene)
    with Renderer() as other:
        yield {
            **public,
            **on_renderer,
            **{"vkbloom": vkbloom, "np": np, "math": math, "copy": copy, "pickle": pickle},
            **{"Decimal": Decimal, "psf": psf, "_core": _core, "Surface": Surface},
            **{"renderer": renderer, "other": other, "closed": closed, "of_closed": of_closed},
            **{"frames": make_mixed(), "image": image, "scene": scene},
            "handle": renderer.upload(image),
            "render": render,
            "filled": lambda array: render(size=SIZE, out={"final": array}),
            "frames_of": functools.partial(Frames, timings={}, settings=Separable(), info={}),
            "u8": lambda *shape: np.zeros(shape, np.uint8),
        }


@pytest.mark.parametrize(
    ("call", "error"),
    [
        *rows(__file__, "values of settings"),
        *rows(__file__, "unknown names"),
        *rows(__file__, "calls that leave no renderer"),
    ],
)
def test_a_wrong_value_is_refused(names: dict[str, Any], call: str, error: str) -> None:
    assert_refused(call, error, names)


@pytest.fixture(scope="module")
def right(scene: Scene) -> Frames:
    with Renderer() as renderer:
        return renderer.render(scene, None, SIZE)


@pytest.mark.parametrize(("call", "error"), rows(__file__, "calls of a renderer"))
def test_a_refused_call_leaves_the_renderer_usable(
    names: dict[str, Any], right: Frames, call: str, error: str
) -> None:
    assert_refused(call, error, names)
    for name, array in names["render"](None, SIZE).items():
        np.testing.assert_array_equal(array, right[name])


@pytest.mark.parametrize("settings", [*presets.values(), FilamentBloom(resolution=2048)])
def test_sizes_whose_levels_would_overflow(
    renderer: Renderer, scene: Scene, settings: Settings
) -> None:
    """Once a loop without an end: a level of 2^31 pixels, twice as wide, is not 0 pixels wide."""
    for size in ((2**20, 1), (2**31 - 1, 1), (1, 2**31 - 1)):
        with pytest.raises(ValueError, match=rf"^size: a size of {size[0]} x {size[1]} "):
            renderer.render(scene, settings, size)
        with pytest.raises(ValueError, match=rf"bloom_size: a size of {size[0]} x {size[1]} "):
            renderer.render(scene, settings.replace(bloom_size=size), SIZE)


def test_a_mistake_before_the_first_frame(scene: Scene, right: Frames) -> None:
    with Renderer(validation=True) as renderer:
        with pytest.raises(ValueError, match="framebuffers"):
            renderer.render(scene, None, SIZE, framebuffers="nope")
        np.testing.assert_array_equal(renderer.render(scene, None, SIZE)["final"], right["final"])


@pytest.mark.parametrize(
    ("name", "base"),
    [
        ("AdapterNotFoundError", RuntimeError),
        ("DeviceLostError", Exception),
        ("OutOfMemoryError", MemoryError),
        ("ValidationError", Exception),
        ("ShaderError", Exception),
    ],
)
def test_the_tree_of_exceptions(name: str, base: type[Exception]) -> None:
    error = getattr(vkbloom, name)
    assert issubclass(error, vkbloom.Error)
    assert issubclass(error, base)
    assert not issubclass(error, ValueError)
    assert (error.__name__, error("text").vk_call, error("text").vk_result) == (name, None, None)
    assert error.__doc__


# Names that are not known: the message says what was meant.


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
    custom: Any = vkbloom.load_method(text, name="soft_one")
    with pytest.raises(TypeError, match="did you mean 'softness'\\?"):
        custom(softnes=1)
    with pytest.raises(TypeError, match="did you mean 'softness'\\?"):
        custom().replace(softnes=1)
    with pytest.raises(ValueError, match=f"give {custom.__name__}\\(\\)"):
        renderer.apply(IMAGE, "soft_one")
    assert custom().replace(softness=1) == pickle.loads(pickle.dumps(custom(softness=1)))


def test_the_signature_is_that_of_the_fields() -> None:
    assert str(inspect.signature(psf.gaussian)).startswith("(sigma: 'float')")
    assert list(inspect.signature(vkbloom.Pyramid).parameters)[:2] == ["bloom", "threshold"]


@pytest.mark.parametrize(
    ("asked", "known", "meant"),
    [
        ("zzz", ["final", "bloom"], None),
        ("of", ["roof_garden"], None),
        ("gpu", ["psf"], None),
        ("blade", ["balance"], None),
        ("strength", ["threshold"], None),
        ("saturate", ["scatter"], None),
        ("roof", ["proof_reader"], None),
        ("unity", ["unity_urp", "kino"], "unity_urp"),
        ("kion", ["unity_urp", "kino"], "kino"),
        ("--Tresh-olds", ["thresh_old"], "thresh_old"),
    ],
)
def test_only_what_is_near_is_suggested(asked: str, known: list[str], meant: str | None) -> None:
    frames = make({name: np.zeros((1, 1, 4), np.float32) for name in known})
    with pytest.raises(KeyError) as caught:
        frames[asked]
    assert (f"did you mean '{meant}'?" if meant else ";") in str(caught.value)
    assert ("did you mean" in str(caught.value)) == (meant is not None)


def test_registries_are_tables() -> None:
    lines = [line.split() for line in repr(METHODS).splitlines()]
    assert ["pyramid", "vkbloom._methods.mip_chain:Pyramid"] in lines
    assert ">streaks</th>" in STAGES._repr_html_()


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
