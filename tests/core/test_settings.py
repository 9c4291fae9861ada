"""Settings: defaults, ranges, stored values, kernels and presets."""

from __future__ import annotations

import dataclasses
import enum
import inspect
import json
import math
import pickle
import re
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.kinds import METHODS, fields_of
from tests.processes import output
from vkbloom import Separable, Settings, _core, gaussian_weights, presets
from vkbloom._methods.separable import TUTORIAL
from vkbloom._settings.fields import number_field, value_field

DEFAULTS = {
    "bloom": True,
    "threshold": None,
    "knee": 0.0,
    "composite": "add",
    "alpha": "keep",
    "intensity": 1.0,
    "tonemap": "none",
    "exposure": 0.0,
    "encoding": "none",
    "reference_white": 203.0,
    "dither": False,
    "dither_seed": 0,
    "bloom_size": None,
    "bloom_scale": 1.0,
    "format": None,
    "glare": (),
    "blur_scale": 1.0,
    "blur_strength": 1.5,
    "weights": (0.227027, 0.1945946, 0.1216216, 0.054054, 0.016216),
    "loops": 1,
    "layers": ((1.0, 1.0),),
    "first_tap": 1,
    "texel": "own",
    "direct": False,
}


def make(**fields: Any) -> Separable:
    """Make settings of fields that may have wrong types."""
    return Separable(**fields)


def test_defaults() -> None:
    settings = Separable()
    fields = {field.name: getattr(settings, field.name) for field in dataclasses.fields(settings)}
    assert fields == DEFAULTS
    # 1 == True and 1 == 1.0, so the types are a matter of their own.
    assert {n: type(v) for n, v in fields.items()} == {n: type(v) for n, v in DEFAULTS.items()}
    assert DEFAULTS["weights"] == TUTORIAL


def test_values_that_are_equal_and_hashable() -> None:
    settings = Separable(blur_scale=2.0)
    same = Separable(blur_scale=2)
    assert settings == same
    assert hash(settings) == hash(same)
    assert settings != Separable()
    assert len({settings, same, Separable()}) == 2
    assert eval(repr(settings), {"Separable": Separable}) == settings
    assert pickle.loads(pickle.dumps(settings)) == settings


def test_what_is_sent_is_the_fields_alone() -> None:
    """Not the block of the core, which settings keep once they have been planned."""
    settings = Separable(threshold=0.5)
    stored = pickle.dumps(settings)
    block = settings._core_block()
    assert settings._core_block() is block
    assert pickle.dumps(settings) == stored
    assert pickle.loads(stored)._core_block() == block
    assert settings.replace(threshold=0.6)._core_block() != block


def test_as_dict_is_plain() -> None:
    settings = make(
        blur_scale=np.float32(0.5),
        loops=np.int64(2),
        bloom=np.True_,
        bloom_size=np.array([4, 5]),
        weights=np.array([0.5, 0.25], np.float32),
        layers=np.array([[1.0, 0.5], [2.0, 0.25]]),
    )
    values = settings.to_dict()
    assert values["method"] == "separable"
    again = json.loads(json.dumps(values))
    assert again.pop("method") == "separable"
    again["layers"] = tuple(map(tuple, again["layers"]))
    assert make(**again) == settings
    assert settings == Separable(
        blur_scale=0.5,
        loops=2,
        bloom_size=(4, 5),
        weights=(0.5, 0.25),
        layers=((1.0, 0.5), (2.0, 0.25)),
    )
    assert type(settings.loops) is int
    assert type(settings.bloom) is bool
    assert hash(settings) == hash(make(**again))


@pytest.mark.parametrize(
    "value", [Fraction(1, 3), Decimal("0.1"), np.longdouble("0.1"), np.array(0.5), np.float16(0.1)]
)
def test_every_kind_of_real_number_is_stored_as_a_float(value: Any) -> None:
    settings = make(intensity=value, weights=(value,))
    assert type(settings.intensity) is float
    assert settings.intensity == settings.weights[0] == float(value)


class Curve(str, enum.Enum):  # noqa: UP042 (a StrEnum's str() is its value, this one's is not)
    ACES = "aces"


@pytest.mark.parametrize("curve", [np.array(["aces"])[0], Curve.ACES])
def test_names_of_other_classes_are_stored_as_plain_ones(curve: str) -> None:
    settings = make(tonemap=curve, format=np.str_("rgba16float"))
    assert [type(name) for name in (settings.tonemap, settings.format)] == [str, str]
    assert eval(repr(settings), {"Separable": Separable}) == settings


# Ranges

EDGES: list[tuple[str, Any, Any]] = [
    ("knee", 0.0, 1.0),
    ("threshold", 0.0, 65504.0),
    ("intensity", 0.0, 65504.0),
    ("exposure", -32.0, 32.0),
    ("bloom_scale", 0.001, 4.0),
    ("blur_scale", 0.0, 16.0),
    ("blur_strength", 0.0, 16.0),
    ("loops", 1, 16),
    ("dither_seed", 0, 65535),
    ("first_tap", 0, 1),
]


@pytest.mark.parametrize(("name", "low", "high"), EDGES)
def test_the_edges_of_a_range_are_in_it(name: str, low: Any, high: Any) -> None:
    for value in (low, high):
        assert getattr(make(**{name: value}), name) == value
    below = low - 1 if isinstance(low, int) else math.nextafter(low, -math.inf)
    above = high + 1 if isinstance(high, int) else math.nextafter(high, math.inf)
    for value in (below, above, math.nan, math.inf, -math.inf, 10**400):
        with pytest.raises(ValueError, match=rf"^{name}: .* {low:g} to {high:g}$") as caught:
            make(**{name: value})
        assert repr(value) in str(caught.value)


# Kernels and layers


def test_gaussian_weights() -> None:
    weights = gaussian_weights(1.5)
    # ceil(3 sigma) taps to each side, and the whole kernel sums to 1.
    assert len(weights) == 6
    assert weights[0] + 2 * sum(weights[1:]) == pytest.approx(1, abs=1e-12)
    ratios = [weight / weights[0] for weight in weights]
    assert ratios == pytest.approx([math.exp(-(i**2) / (2 * 1.5**2)) for i in range(6)])


@pytest.mark.parametrize(
    ("sigma", "radius", "count"),
    [
        (0.1, None, 2),
        (1e-300, None, 2),
        (1.0, None, 4),
        (21.3, None, 65),
        (1000.0, None, 65),
        (5.0, 0, 1),
        (2, 64, 65),
        # Their squares and multiples are beyond all floats.
        (1e-200, None, 2),
        (5e-324, 3, 4),
        (1.7e308, None, 65),
        (Fraction(1, 2), None, 3),
    ],
)
def test_the_radius_of_gaussian_weights(sigma: float, radius: int | None, count: int) -> None:
    weights = gaussian_weights(sigma, radius)
    assert len(weights) == count
    assert weights[0] + 2 * sum(weights[1:]) == pytest.approx(1, abs=1e-12)
    Separable(weights=weights)


# Presets


def test_a_preset_imports_its_method_alone() -> None:
    code = (
        "import sys, vkbloom; vkbloom.Separable, 'kino' in vkbloom.presets; {}; print(*sys.modules)"
    )
    uses = "pass", "vkbloom.presets['kino']"
    names, kino = (output("-c", code.format(use)).split() for use in uses)
    assert {*kino} - {*names} == {"vkbloom._methods.kino"}


def test_presets() -> None:
    assert presets["tutorial"] == Separable()
    assert presets["outline"] == Separable(first_tap=0, texel="x")
    with pytest.raises(TypeError):
        presets["tutorial"] = Separable()  # type: ignore[operator]
    for settings in presets.values():
        assert isinstance(settings, Settings)


def documented_range(kind: type[Settings], name: str) -> tuple[float, float] | None:
    """Return the range that a class's docstring gives a parameter, if it does."""
    lines = inspect.getdoc(kind).splitlines()  # type: ignore[union-attr]
    text = ""
    described = False
    for line in lines[lines.index("Parameters") + 2 :]:
        if not line:
            break
        if line.startswith(" "):
            text += f" {line.strip()}" if described else ""
        else:
            described = name in line.partition(" : ")[0].split(", ")
    found = re.search(r"(-?\d[\d.]*) (?:to|or) (-?\d+(?:\.\d+)?)", text)
    return (float(found[1]), float(found[2])) if found else None


def test_methods_have_the_order_of_the_core() -> None:
    """Importing one method's module first does not change it."""
    header = Path(__file__).parents[2] / "csrc/passes/settings.h"
    rows = re.findall(r"^    METHOD\(\w+, (\w+), ", header.read_text(), re.MULTILINE)
    assert rows.pop() == "custom", "the method whose passes are given at run time has no class here"
    registry = "from vkbloom._settings.registry import METHODS"
    code = f"import vkbloom._methods.pygfx; {registry}; print(*METHODS)"
    assert output("-c", code).split() == rows
    assert sorted(METHODS) == sorted(rows)


@pytest.mark.parametrize("kind", METHODS.values())
def test_the_ranges_in_docstrings(kind: type[Settings]) -> None:
    for name, info in fields_of(kind).items():
        if name not in _core.VALUES or info.kind == "flag" or info.range is None:
            continue
        documented = documented_range(kind, name)
        narrowed = info.range != tuple(_core.VALUES[name][1:])
        assert documented is not None or not narrowed, f"{name}: {kind.__name__} says no range"
        assert (documented or documented_range(Settings, name)) == info.range, name


@pytest.mark.parametrize("kind", METHODS.values())
def test_choices_are_names_of_the_core(kind: type[Settings]) -> None:
    for name, info in fields_of(kind).items():
        if name in vkbloom._core.CHOICES:
            assert set(info.choices) <= set(vkbloom._core.CHOICES[name])


@pytest.mark.parametrize(
    ("declare", "message"),
    [
        (
            lambda: number_field(silder=(0, 1)),  # type: ignore[call-arg]
            "Planted.radius: 'silder' is not a keyword; did you mean 'slider'?",
        ),
        (
            lambda: value_field(0.0, help="x"),  # type: ignore[call-arg]
            "Planted.radius: 'help' is not a keyword; these are kind, ",
        ),
        (lambda: number_field(core="raduis"), "Planted.radius: the core has no 'raduis'; build"),
    ],
)
def test_a_wrong_declaration_fails_where_the_class_is_declared(
    declare: Callable[[], Any], message: str
) -> None:
    """The error names the class and the field."""

    def plant() -> None:
        type("Planted", (Settings,), {"radius": declare()})

    # (Python 3.11 makes a RuntimeError of it.)
    with pytest.raises((TypeError, RuntimeError)) as caught:
        plant()
    assert str(caught.value.__cause__ or caught.value).startswith(message)
