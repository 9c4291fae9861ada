"""The controls of the page for the parameters of point-spread functions."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Mapping
from typing import Any, Final, Literal

from vkbloom import psf
from vkbloom.explorer.steps import slider_step
from vkbloom.views.descriptions import described_parameters

__all__ = ["functions"]

#: The functions to choose from, each with its parameters that have sliders: their ends, which are
#: also the range of the number beside it. Parameters of a choice need none.
_SLIDERS: Final[Mapping[str, tuple[psf.PSF, Mapping[str, tuple[float, float]]]]] = {
    "spencer": (psf.spencer(), {}),
    "cie_general": (psf.cie_general(), {"age": (0, 120), "pigment": (0, 1.2)}),
    "cie_total": (psf.cie_total(), {"age": (0, 120), "pigment": (0, 1.2)}),
    "harvey_shack": (
        psf.harvey_shack(),
        {"s": (-4, 0), "b": (0.01, 2), "l": (0.0005, 0.02), "surfaces": (1, 50)},
    ),
    "airy": (
        psf.airy(),
        {"f_number": (1, 64), "wavelength": (380, 780), "pixel_pitch": (1, 20)},
    ),
    "aperture": (
        psf.aperture(psf.iris()),
        {
            "f_number": (2, 64),
            "pixel_pitch": (1, 20),
            "mask.blades": (3, 16),
            "mask.rotation": (0, 180),
            "mask.roundness": (0, 1),
            "mask.dust": (0, 100),
            "mask.scratches": (0, 100),
            "mask.seed": (0, 100),
        },
    ),
    "fog_glow": (psf.fog_glow(256), {"size": (2, 1024)}),
    "gaussian": (psf.gaussian(8.0), {"sigma": (0.1, 64)}),
}


def functions() -> dict[str, Any]:
    """Describe the point-spread functions of a convolution.

    Returns
    -------
    dict
        For each function's name its "defaults", as from `PSF.to_dict`, and its "fields", as of
        `controls`. The name of a field of the mask begins with "mask.".
    """
    return {
        name: {"defaults": one.to_dict(), "fields": _fields(one, sliders)}
        for name, (one, sliders) in _SLIDERS.items()
    }


def _fields(one: psf.PSF, sliders: Mapping[str, tuple[float, float]]) -> list[dict[str, Any]]:
    texts = described_parameters(type(one)) | described_parameters(psf.iris)
    found: list[dict[str, Any]] = []
    for name, annotation in typing.get_type_hints(type(one)).items():
        if typing.get_origin(annotation) is Literal:
            choices = list(typing.get_args(annotation))
            found.append({"name": name, "kind": "choice", "choices": choices, "optional": False})
    for path, (low, high) in sliders.items():
        owner: Any = getattr(one, "mask") if path.startswith("mask.") else one  # noqa: B009
        name = path.removeprefix("mask.")
        (field,) = (each for each in dataclasses.fields(owner) if each.name == name)
        integer = typing.get_type_hints(type(owner))[field.name] is int
        ends = {"low": low, "high": high, "from": low, "to": high}
        step = 1 if integer else slider_step(low, high)
        found.append(
            {"name": path, "kind": "number", "optional": False, "integer": integer, "step": step}
            | ends
        )
    return [each | {"help": texts.get(each["name"].split(".")[-1], "")} for each in found]
