"""The controls of the page for the stages of glare."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping
from typing import Any, Final, Literal

from vkbloom import _core
from vkbloom.explorer.steps import slider_step
from vkbloom.glare.base import Glare, GlareLight, stages
from vkbloom.named_glares import glares
from vkbloom.views.descriptions import described_parameters

__all__ = ["glare_controls"]

# Ends of the sliders of fields with a very wide range. The number beside the slider takes the
# complete range.
_SLIDERS: Final[Mapping[str, tuple[float, float]]] = {
    "intensity": (0, 4),
    "threshold": (0, 16),
    "angle": (-180, 180),
    "length": (0, 4),
    "maximum": (0, 100),
    "aberration": (0, 0.05),
    "radius": (0.001, 1.5),
    "falloff": (0, 32),
    "width": (0.001, 1),
    "strength": (0, 1),
    "seed": (0, 100),
}


def glare_controls() -> dict[str, Any]:
    """Describe the stages of glare.

    Returns
    -------
    dict
        "stages": for each stage's name its "defaults", as from `Glare.to_dict`, and its "fields",
        as of `controls`. "presets": for each name of `glares` its stages, as from `Glare.to_dict`.
    """
    return {
        "stages": {
            name: {"defaults": kind().to_dict(), "fields": _fields(kind)}
            for name, kind in stages().items()
        },
        "presets": {name: [one.to_dict() for one in some] for name, some in glares.items()},
    }


def _fields(kind: type[Glare]) -> list[dict[str, Any]]:
    """Return the controls of numbers and choices; there are none for scales, tints and images."""
    texts = described_parameters(GlareLight) | described_parameters(kind)
    found = []
    for field in dataclasses.fields(kind):
        annotation = typing.get_type_hints(kind)[field.name]
        control: dict[str, Any] = {
            "name": field.name,
            "optional": False,
            "help": texts.get(field.name, ""),
        }
        if typing.get_origin(annotation) is Literal:
            found.append(control | {"kind": "choice", "choices": list(typing.get_args(annotation))})
        elif field.name in _core.GLARE_VALUES:
            _, low, high = _core.GLARE_VALUES[field.name]
            start, end = _SLIDERS.get(field.name, (low, high))
            integer = annotation is int
            step = 1 if integer else slider_step(start, end)
            ends = {"low": low, "high": high, "from": start, "to": end}
            found.append(control | {"kind": "number", "integer": integer, "step": step} | ends)
    return found
