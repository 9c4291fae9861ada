"""The controls of the page, made from the fields of the settings; settings as Python code."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping
from typing import Any, Final, Literal

from vkbloom import _core
from vkbloom.explorer.functions import functions
from vkbloom.explorer.stages import glare_controls
from vkbloom.explorer.steps import slider_step
from vkbloom.fields import field_range
from vkbloom.glare.base import Glare
from vkbloom.named_glares import glares
from vkbloom.named_settings import presets
from vkbloom.psf.base import PSF
from vkbloom.settings import Settings, methods
from vkbloom.views.descriptions import described_parameters

__all__ = ["METHODS", "as_code", "controls", "settings_from"]

#: Settings class of each method, by the method's name.
METHODS: Final = methods()

# Ends of the sliders of fields with a very wide range. The number beside the slider takes the
# complete range. If a method narrows a range, its slider has this range.
_SLIDERS: Final[Mapping[str, tuple[float, float]]] = {
    "threshold": (0, 4),
    "intensity": (0, 4),
    "exposure": (-8, 8),
    "bloom_scale": (0.05, 1),
    "blur_scale": (0.1, 2),
    "blur_strength": (0, 4),
    "radius": (0, 4),
    "offset": (0, 8),
    "highlight": (10, 5000),
    "clamp_max": (0, 100),
    "smooth_width": (0.01, 1),
    "threshold_scale": (0, 8),
    "luminance_cap": (0, 48),
    "strength": (0, 2),
    "white": (1, 16),
    "maximum": (0, 20),
    "filter_radius": (0, 0.05),
    "max_mip_dimension": (16, 1024),
    "scale_x": (0, 8),
    "scale_y": (0, 8),
    "resolution": (16, 1024),
    "levels": (1, 10),
    "loops": (1, 8),
    "dither_seed": (0, 100),
}
# Fields that come first, in addition to the numbers that only this method has.
_FIRST: Final = ("bloom", "threshold", "intensity", "exposure", "tonemap")
# Fields that keep their values on the page when another preset or method is selected.
_LOOK: Final = ("bloom", "exposure", "tonemap", "encoding", "dither", "dither_seed")


def controls() -> dict[str, Any]:
    """Describe methods and presets.

    Returns
    -------
    dict
        "methods": for each method its "defaults", and for each field with a control its "name",
        "kind" ("bool", "number", "choice"), "help", whether it comes "first", and whether it is
        "optional" (may be None). Numbers have "from", "to" and "step" of their slider, the accepted
        range from "low" to "high", and "integer"; choices have "choices", and may have a name for
        "none" of them. "functions": the point-spread functions of a convolution, as from
        `functions`. "glare": as from `glare_controls`. "presets": settings by name, as from
        `Settings.to_dict`. "look": the fields that keep their values when another preset or method
        is selected.
    """
    return {
        "methods": {
            name: {"defaults": kind().to_dict(), "fields": _fields(kind)}
            for name, kind in METHODS.items()
        },
        "functions": functions(),
        "glare": glare_controls(),
        "presets": {name: settings.to_dict() for name, settings in presets.items()},
        "look": _LOOK,
    }


def _fields(kind: type[Settings]) -> list[dict[str, Any]]:
    annotations = typing.get_type_hints(kind)
    texts = described_parameters(Settings) | described_parameters(kind)
    shared = {field.name for field in dataclasses.fields(Settings)}
    found = []
    for field in dataclasses.fields(kind):
        control = _control(kind, field, annotations[field.name])
        if control is not None:
            own = field.name not in shared
            # An integer with two values is more like a switch than a slider.
            slides = (
                control["kind"] == "number" and control["from"] + control["step"] < control["to"]
            )
            control |= {
                "name": field.name,
                "help": texts.get(field.name, ""),
                "first": field.name in _FIRST or (own and slides),
            }
            found.append((field.name != "bloom", not own, control))
    # The fields of the method come first, after `bloom`: they are the reason to select it.
    return [control for _, _, control in sorted(found, key=lambda entry: entry[:2])]


def _control(
    kind: type[Settings], field: dataclasses.Field[Any], annotation: Any
) -> dict[str, Any] | None:
    """Return the control of a field; None for tuples, sizes, and fields that a method rejects."""
    if field.name == "glare":
        return {"kind": "choice", "choices": list(glares), "optional": True, "none": "none"}
    parts = typing.get_args(annotation)
    optional = type(None) in parts
    if optional:
        (annotation,) = (part for part in parts if part is not type(None))
    if annotation is bool:
        return {"kind": "bool"}
    if typing.get_origin(annotation) is Literal:
        choices = [
            choice for choice in typing.get_args(annotation) if _takes(kind, field.name, choice)
        ]
        return {"kind": "choice", "choices": choices, "optional": optional}
    if field.name not in _core.VALUES:
        return None
    low, high = field_range(field)
    is_narrowed = field.metadata.get("range") is not None
    start, end = (low, high) if is_narrowed else _SLIDERS.get(field.name, (low, high))
    if not (_takes(kind, field.name, start) and _takes(kind, field.name, end)):
        return None
    integer = annotation is int
    return {
        "kind": "number",
        "optional": optional,
        "integer": integer,
        "low": low,
        "high": high,
        "from": start,
        "to": end,
        "step": 1 if integer else slider_step(start, end),
    }


def _takes(kind: type[Settings], name: str, value: Any) -> bool:
    """Return whether a method accepts a value, with all other fields at their defaults."""
    try:
        kind(**{name: value})
    except ValueError:
        return False
    return True


def settings_from(fields: object) -> Settings:
    """Return the settings that a page sent.

    Parameters
    ----------
    fields : mapping of str to object
        As from `Settings.to_dict`, after JSON. Missing fields have their defaults.

    Raises
    ------
    TypeError, ValueError
        There is no such method or field, or a value has another type or is out of range.
    """
    made: Settings = Settings.from_dict(fields)  # type: ignore[arg-type]
    return made


def as_code(settings: Settings) -> str:
    """Return Python code that makes the settings, after ``import vkbloom``.

    Parameters
    ----------
    settings : Settings

    Returns
    -------
    str
        A preset by its name, with changed fields if needed; otherwise the method with the fields
        that are not the default.
    """
    look = {name: getattr(settings, name) for name in _LOOK}
    for name, preset in presets.items():
        if preset != type(preset)() and type(preset) is type(settings):
            if settings == preset:
                return f'vkbloom.presets["{name}"]'
            if settings == preset.replace(**look):
                return f'vkbloom.presets["{name}"].replace({_arguments(settings, preset)})'
    return f"vkbloom.{type(settings).__name__}({_arguments(settings, type(settings)())})"


def _arguments(settings: Settings, begun: Settings) -> str:
    """Return the fields in which settings differ from others, as keywords."""
    return ", ".join(
        f"{field.name}={_literal(getattr(settings, field.name))}"
        for field in dataclasses.fields(settings)
        if getattr(settings, field.name) != getattr(begun, field.name)
    )


def _literal(value: object) -> str:
    if isinstance(value, tuple) and value and all(isinstance(one, Glare) for one in value):
        return f"({', '.join(f'vkbloom.{one!r}' for one in value)},)"
    if isinstance(value, PSF):
        return f"vkbloom.psf.{value!r}"
    # Names of choices need no escapes.
    return f'"{value}"' if isinstance(value, str) else repr(value)
