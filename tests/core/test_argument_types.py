"""Arguments of a wrong type raise TypeError or ValueError that names the argument."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import vkbloom
from tests.exhaustive import EXHAUSTIVE
from vkbloom import psf, reference, testing

#: Values by their type, each with the ones that are most likely taken for something else.
VALUES: dict[str, tuple[Any, ...]] = {
    "none": (None,),
    "bool": (True, False),
    "int": (0, 1, -1, 3, 255, 2**31, -(2**63), 10**30),
    "float": (0.0, 0.5, -1.0, math.nan, math.inf, -math.inf, 2.0, 1e-300, 1e12, 1e300),
    "complex": (1j, 0j, 2 + 0j, complex(math.inf, -1)),
    "str": ("", "a", "0", "1.5", "nan", "none", "\0", "é{}%s", "../.."),
    "bytes": (b"", b"a", b"\0\xff"),
    "list": ([object()], [object(), object()], [object()] * 3),
    "dict": ({0: None}, {1: None, -1: None}, {2: None, 0: None, 1: None}),
    "set": (frozenset({0}), frozenset({1, 2}), frozenset({-1, 0, 5})),
    "object": (object(),),
    "function": (lambda: None,),
    "class": (int, dict, object),
    "array": tuple(np.zeros(shape, complex) for shape in ((1, 1), (3, 1), (2, 3), (3, 3))),
}
#: The types that a part of an annotation accepts, of those above. Classes accept none of them.
NUMBERS = {"bool", "int", "float"}
ACCEPTED: dict[str, set[str]] = {
    "None": {"none"},
    "bool": {"bool"},
    "int": {"bool", "int"},
    "float": NUMBERS,
    "str": {"str"},
    "Callable": {"function", "class"},
    "Bloom": {"function", "class"},
    "MovingBloom": {"function", "class"},
    "Loss": {"str", "function", "class"},
    "Any": set(VALUES),
    "DTypeLike": {"none", "str", "class", "list", "dict"},
}
TEXTS = (
    r"Literal|Shading|\w*Colour|\w*Encoding|PyramidLoss|Composite|Alpha|ToneMap|\w*Mode|\w*Format"
)
CONTAINERS = r"Sequence|Iterable|Mapping|tuple|NDArray|type|Bounds|os\.PathLike|Path|ArrayLike"
#: Sequences of any items.
SEQUENCES = {"list", "array"}
CLASSES = r"Settings|Renderer|Scene|Camera|Image|PSF|PSFLike|Probe|(xarray\.)?Dataset"

IMAGE = np.zeros((8, 8, 3), np.float32)
SEPARABLE = vkbloom.Separable()
GAUSSIAN = psf.gaussian(1.0)


def blur(image: Any) -> Any:
    return image


#: Valid arguments of the public functions that need some.
NEEDED: dict[str, Any] = {
    "array": IMAGE,
    "image": IMAGE,
    "images": [IMAGE],
    "frames": [IMAGE, IMAGE],
    "fps": 60.0,
    "degrees": 40.0,
    "source": IMAGE,
    "target": IMAGE,
    "glow": IMAGE,
    "glared": IMAGE,
    "scene": IMAGE,
    "a": IMAGE,
    "b": IMAGE,
    "settings": SEPARABLE,
    "exposure": "bevy",
    "to": SEPARABLE,
    "vary": ["intensity"],
    "psf": GAUSSIAN,
    "bloom": blur,
    "argv": ["true", "{input}", "{output}"],
    "path": "a.png",
    "base": "a.gltf",
    "store": "a.zarr",
    "size": (8, 8),
    "axes": {"intensity": [1.0]},
    "sigma": 1.0,
    "gain": 1.0,
    "parameter": "intensity",
    "values": [1.0],
    "radii": [1.0],
    "frequencies": [0.1],
    "mask": np.ones((8, 8)),
    "dataset": xarray.Dataset(
        {"final": (("intensity", "y", "x", "channel"), np.zeros((1, 8, 8, 3)))},
        {"intensity": [1.0]},
        {"axes": ["intensity"]},
    ),
}
OTHERS: dict[str, dict[str, Any]] = {
    "flash": {"degrees": 40.0},
    "flare": {"source": blur, "chart": testing.FlareChart(size=(36, 24))},
    "load_method": {"source": "//!HOOK MAIN\n//!BIND HOOKED\nvec4 hook() { return vec4(1); }\n"},
    "unreal": {"image": np.ones((3, 3))},
    "shade": dict.fromkeys(("albedo", "normal", "position", "brightness"), IMAGE),
    "response": {"bloom": lambda image, intensity: image},
    "Gathered": {"kernels": np.ones((1, 1, 3, 3))},
    "Varying": {"kernels": np.ones((1, 1, 3, 3))},
    "samples": {"values": np.ones((3, 3))},
    "sweep": {"settings": [SEPARABLE]},
}
PUBLIC: list[Any] = [getattr(vkbloom, name) for name in vkbloom.__all__]
FUNCTIONS: tuple[Callable[..., Any], ...] = (
    *(one for one in PUBLIC if inspect.isfunction(one) and one is not vkbloom.explore),
    vkbloom.Camera,
    vkbloom.Renderer,
    vkbloom.Scene.from_gltf,
    GAUSSIAN.array,
    GAUSSIAN.encircled_energy,
    GAUSSIAN.mtf,
    GAUSSIAN.save,
    *(getattr(reference, name) for name in reference.__all__),
    *(getattr(psf, name) for name in psf.__all__ if name != "PSF"),
    *(
        getattr(testing, name)
        for name in testing.__all__
        if name.islower() or name in ("Probe", "Tolerances")
    ),
    *(
        one
        for one in PUBLIC
        if inspect.isclass(one)
        and issubclass(one, vkbloom.Settings | vkbloom.Glare)
        and one not in (vkbloom.Settings, vkbloom.Glare)
    ),
)
METHODS = ("apply", "map", "plan", "render", "sweep", "upload")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files of accepted arguments go into a temporary folder."""
    monkeypatch.chdir(tmp_path)


def accepted_types(annotation: str) -> set[str] | None:
    """Return the types of values that an annotation accepts; None for one that is unknown."""
    found: set[str] = set()
    for part in re.split(r"\s*\|\s*(?![^\[]*\])", annotation.strip("\"'")):
        name = part.partition("[")[0]
        if re.fullmatch(TEXTS, name):
            found.add("str")
        elif re.fullmatch(CONTAINERS, name):
            found |= {"class"} if name == "type" else set()
            found |= SEQUENCES if part == "Sequence[Any]" else set()
        elif name in ACCEPTED:
            found |= ACCEPTED[name]
        elif not re.fullmatch(CLASSES, name):
            return None
    return found


def wrong_arguments(function: Callable[..., Any]) -> Iterator[tuple[str, Any]]:
    """Yield pairs of a parameter and a value of a wrong type: one of each type, with another value
    of the type for the next parameter."""
    for place, (name, parameter) in enumerate(inspect.signature(function).parameters.items()):
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            continue
        types = accepted_types(str(parameter.annotation))
        if types is not None:
            for kind in sorted(set(VALUES) - types):
                values = VALUES[kind]
                for value in values if EXHAUSTIVE else (values[place % len(values)],):
                    yield name, value


def check(function: Callable[..., Any], arguments: dict[str, Any], name: str, value: Any) -> None:
    """Call a function with one argument of a wrong type, which it must refuse.

    A class may convert a value to an equal one of the field's type, such as 1 to True.
    """
    try:
        result = function(**arguments | {name: value})
        if isinstance(result, Iterator):
            list(result)
    except (TypeError, ValueError) as error:
        if not re.search(rf"\b{name}\b", str(error)):
            pytest.fail(f"{name}: {value!r}: {error}")
    else:
        kept = getattr(result, name, object())
        if not (isinstance(function, type) and type(kept) is not type(value) and kept == value):
            pytest.fail(f"{name}: {value!r} is accepted")


def required_arguments(function: Callable[..., Any]) -> dict[str, Any]:
    """Return valid values of the parameters without a default, and those of OTHERS."""
    parameters = inspect.signature(function).parameters.items()
    others = OTHERS.get(function.__name__, {})
    values: dict[str, Any] = NEEDED | others
    return {
        name: values[name]
        for name, parameter in parameters
        if (parameter.default is parameter.empty or name in others)
        and parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
    }


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda one: f"{one.__module__}.{one.__name__}")
def test_a_wrong_type_is_an_error_that_names_the_argument(function: Callable[..., Any]) -> None:
    wrong = list(wrong_arguments(function))
    if not wrong:
        pytest.skip("the function's parameters accept every type")
    for argument in wrong:
        check(function, required_arguments(function), *argument)


@pytest.mark.parametrize("method", METHODS)
def test_a_wrong_type_is_an_error_of_the_renderers_methods(
    renderer: vkbloom.Renderer, method: str
) -> None:
    function = getattr(renderer, method)
    for argument in wrong_arguments(function):
        check(function, required_arguments(function), *argument)


def test_an_object_of_another_class_of_the_same_name_is_refused() -> None:
    values = {name: type(name, (), {})() for name in ("Camera", "PSF", "Probe", "Renderer")}
    for call in (
        lambda: testing.point_spread(blur, values["Probe"]),
        lambda: vkbloom.capture("a.rdc", renderer=values["Renderer"]),
        lambda: vkbloom.fit_pyramid(values["PSF"]),
        lambda: vkbloom.Scene.from_gltf("a.gltf", camera=values["Camera"]),
    ):
        with pytest.raises(TypeError, match=r"^(camera|probe|psf|renderer): .* is not a "):
            call()
