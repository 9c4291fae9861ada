"""The controls of the page, made from the fields of the settings; settings as Python code."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any, Final

from vkbloom import psf
from vkbloom._custom.method import CustomType, identifier_of
from vkbloom._psf.base import PSF, functions
from vkbloom._settings.fields import FieldInfo, fields_of
from vkbloom._settings.glare import Glare, glares
from vkbloom._settings.registry import METHODS, STAGES
from vkbloom._settings.settings import Settings, presets

# Fields that keep their values on the page when another preset or method is selected.
_LOOK: Final = ("bloom", "exposure", "tonemap", "encoding", "dither", "dither_seed")


# Examples of point-spread functions that have parameters without a default.
_EXAMPLES: Final[tuple[PSF, ...]] = (psf.aperture(psf.iris()), psf.gaussian(8.0))

_STEPS: Final = 200


def controls() -> dict[str, Any]:
    """Describe methods, point-spread functions, stages of glare and presets.

    Of each field with a control: its "name", "kind" ("bool", "number", "choice"), "help", whether
    it comes "first" and may be None ("optional"). Numbers have "from", "to" and "step" of their
    slider, and the accepted range "low" to "high". "descriptions": what each preset looks like.
    "look": the fields that keep their values when another preset or method is selected.
    """
    return {
        "methods": {name: describe(kind) for name, kind in METHODS.items()},
        "functions": {
            type(function).__name__: {
                "defaults": function.to_dict(),
                "fields": _fields_of_function(function),
            }
            for function in _functions()
        },
        "glare": {
            "stages": {
                name: {"defaults": kind().to_dict(), "fields": _controls(kind)}
                for name, kind in STAGES.items()
            },
            "presets": {name: [item.to_dict() for item in some] for name, some in glares.items()},
        },
        "presets": {name: settings.to_dict() for name, settings in presets.items()},
        "descriptions": presets.descriptions(),
        "look": _LOOK,
    }


def describe(kind: type[Settings]) -> dict[str, Any]:
    """Describe a method: its defaults and its fields."""
    return {"defaults": as_fields(kind()), "fields": _fields_of_method(kind)}


def as_fields(settings: Settings) -> dict[str, Any]:
    """Return settings as `settings_from` reads them, also after a custom method's file changed."""
    fields = settings.to_dict()
    fields.pop("sha256", None)
    return fields


def _functions() -> list[PSF]:
    """Return the functions that can be made without arguments, and the examples of others."""
    # (A field of kernels needs an array or a function of Python's.)
    made = [
        kind()
        for kind in functions().values()
        if not issubclass(kind, psf.Varying)
        and all(info.default is not dataclasses.MISSING for info in fields_of(kind).values())
    ]
    return [*made, *_EXAMPLES]


def _fields_of_method(kind: type[Settings]) -> list[dict[str, Any]]:
    infos, shared = fields_of(kind), fields_of(Settings)
    result = _controls(kind)
    for control in result:
        place = infos[control["name"]].everyday
        # An integer with two values is more like a switch than a slider.
        slides = control["kind"] == "number" and control["from"] + control["step"] < control["to"]
        control["first"] = slides if place is None else place != 0

    def rank(control: dict[str, Any]) -> tuple[int, ...]:
        if place := infos[control["name"]].everyday:
            return 0 if place < 0 else 2, place
        return 1 + 2 * (control["name"] in shared), 0

    return sorted(result, key=rank)


def _fields_of_function(function: PSF) -> list[dict[str, Any]]:
    result = _controls(type(function))
    mask = getattr(function, "mask", None)
    if dataclasses.is_dataclass(mask):
        result += [
            control | {"name": f"mask.{control['name']}"} for control in _controls(type(mask))
        ]
    return result


def _controls(kind: type[Any]) -> list[dict[str, Any]]:
    result = ((info, _control(info)) for info in fields_of(kind).values())
    return [
        {"name": info.name, "help": info.help, "optional": info.optional} | control
        for info, control in result
        if control is not None
    ]


def _control(info: FieldInfo) -> dict[str, Any] | None:
    """Return the control of a field; None for arrays, sizes, and fields with one value."""
    if info.kind == "glare":
        return {"kind": "choice", "choices": list(glares), "optional": True, "none": "none"}
    if info.kind == "flag":
        return {"kind": "bool"}
    if info.kind == "choice":
        return {"kind": "choice", "choices": list(info.choices)}
    if info.ends is None or info.range is None:
        return None
    start, end = info.ends
    low, high = info.range if info.is_bounded else info.ends
    integer = info.kind == "integer"
    return {
        "kind": "number",
        "integer": integer,
        "low": low,
        "high": high,
        "from": start,
        "to": end,
        "step": 1 if integer else _step(start, end),
    }


def _step(start: float, end: float) -> float:
    """Return the largest step of 1, 2 or 5 times a power of ten that gives at least 200 steps."""
    step = (end - start) / _STEPS
    for power in range(3, -9, -1):
        for digit in (5, 2, 1):
            # Parsed from text, since a product may not be the nearest float.
            if (round_one := float(f"{digit}e{power}")) <= step * (1 + 1e-9):
                return round_one
    raise ValueError(f"step: {step!r} is too small")


def settings_from(fields: object) -> Settings:
    """Return the settings that a page sent."""
    made: Settings = Settings.from_dict(fields)  # type: ignore[arg-type]
    return made


def code_with_image(settings: Settings, file: str, expand: float | None) -> str:
    """Return Python code of the settings, and of the image if its highlights are expanded."""
    if not file or expand is None:
        return as_code(settings)
    # Quotes and separators of paths as in Python.
    read = f"image = vkbloom.read({json.dumps(file)}, expand={expand:g})"
    return f"{read}\nsettings = {as_code(settings)}"


def as_code(settings: Settings) -> str:
    """Return Python code that makes the settings, after ``import vkbloom``."""
    look = {name: getattr(settings, name) for name in _LOOK}
    for name, preset in presets.items():
        if preset != type(preset)() and type(preset) is type(settings):
            if settings == preset:
                return f'vkbloom.presets["{name}"]'
            if settings == preset.replace(**look):
                return f'vkbloom.presets["{name}"].replace({_arguments(settings, preset)})'
    return f"{_maker(type(settings))}({_arguments(settings, type(settings)())})"


def _maker(kind: Any) -> str:
    """Return Python code of the class."""
    if not isinstance(kind, CustomType):
        return f"vkbloom.{kind.__name__}"
    path = kind.file.source.name
    source = "text" if path == "<text>" else json.dumps(path)
    name = "" if identifier_of(Path(path).stem) == kind.method else f', name="{kind.method}"'
    return f"vkbloom.load_method({source}{name})"


def _arguments(settings: Settings, begun: Settings) -> str:
    """Return the fields in which settings differ from others, as keywords."""
    return ", ".join(
        f"{field.name}={_literal(getattr(settings, field.name))}"
        for field in dataclasses.fields(settings)
        if getattr(settings, field.name) != getattr(begun, field.name)
    )


def _literal(value: object) -> str:
    if isinstance(value, tuple) and value and all(isinstance(item, Glare) for item in value):
        return f"({', '.join(f'vkbloom.{item!r}' for item in value)},)"
    if isinstance(value, PSF):
        return f"vkbloom.psf.{value!r}"
    # Names of choices need no escapes.
    return f'"{value}"' if isinstance(value, str) else repr(value)
