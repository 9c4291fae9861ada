"""Sequences of frames, and the state of each engine's own shaders after each of them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import vkbloom

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "exposure"

#: The formula sheet's largest difference of a float64 model: in stops, Godot's relative.
MODEL_ERRORS = {
    "bevy": 2.9e-5,
    "hdrp": 2.8e-5,
    "ppv2": 6.5e-6,
    "godot": 2e-7,
    "o3de": 1.8e-6,
    "granite": 3e-7,
}

_CLASSES: dict[str, Any] = {
    "bevy": vkbloom.BevyExposure,
    "hdrp": vkbloom.HdrpExposure,
    "ppv2": vkbloom.PostProcessingExposure,
    "godot": vkbloom.GodotExposure,
    "o3de": vkbloom.O3deExposure,
    "granite": vkbloom.GraniteExposure,
}
# The engines' names of fields, as ours; two names for the two numbers of one field.
_FIELDS: dict[str, tuple[str, ...]] = {
    "range": ("range_min", "range_max"),
    "filter": ("filter_min", "filter_max"),
    "exponential_transition_distance": ("transition",),
    "curve": ("compensation",),
    "meteringMode": ("metering",),
    "proceduralCenter": ("centre_x", "centre_y"),
    "maskMinIntensity": ("mask_min",),
    "maskMaxIntensity": ("mask_max",),
    "limitMin": ("limit_min",),
    "limitMax": ("limit_max",),
    "histogramPercentages": ("percent_min", "percent_max"),
    "filtering": ("percent_min", "percent_max"),
    "midGray": ("grey",),
    "adaptationSpeedDarkToLight": ("speed_dark_to_light",),
    "adaptationSpeedLightToDark": ("speed_light_to_dark",),
    "minLuminance": ("minimum",),
    "maxLuminance": ("maximum",),
    "keyValue": ("key_value",),
    "speedUp": ("speed_up",),
    "speedDown": ("speed_down",),
    "ExposureMin": ("minimum",),
    "ExposureMax": ("maximum",),
    "SpeedUp": ("speed_up",),
    "SpeedDown": ("speed_down",),
}
_METERINGS = {
    "Average": "average",
    "Spot": "spot",
    "MaskWeighted": "mask",
    "ProceduralMask": "procedural",
}


class Sequence(NamedTuple):
    """A sequence, and what the engine made of it: numbers that `compare` reads."""

    key: str
    engine: str
    exposure: vkbloom.Exposure
    scene: dict[str, Any]
    states: NDArray[Any]
    histogram: NDArray[Any] | None

    def frames(self) -> Iterator[tuple[NDArray[np.float32], float]]:
        """Yield each frame and its seconds."""
        inputs = _arrays("inputs.npz")
        for index, gain, dt in zip(
            self.scene["index"], self.scene["gain"], self.scene["dt"], strict=True
        ):
            yield inputs[f"base_{index}"].astype(np.float32) * np.float32(gain), dt

    def deviation(self, values: NDArray[Any]) -> float:
        """Return how far adapted values are from the engine's; `values`: one a frame."""
        wanted = self.states.astype(np.float64)
        if self.engine == "hdrp":
            wanted = wanted[:, 1]
        elif self.engine == "godot":
            values, wanted = values / wanted, np.ones(len(wanted))
        elif self.engine == "ppv2":
            values, wanted = np.log2(values), np.log2(wanted)
        elif self.engine == "o3de":
            wanted = -np.log2(wanted)
        return float(np.abs(values - wanted).max())


@cache
def _arrays(name: str) -> dict[str, NDArray[Any]]:
    with np.load(FOLDER / name) as file:
        return dict(file)


def _exposure(engine: str, settings: dict[str, Any], curve: Any) -> vkbloom.Exposure:
    fields: dict[str, Any] = {}
    for name, value in settings.items():
        if name == "mask":
            fields["mask"] = _arrays("inputs.npz")["mask8"]
        elif name == "curve":
            fields["compensation"] = curve["points"]
        elif name == "meteringMode":
            fields["metering"] = _METERINGS[value]
        elif name == "mode":
            fields["mode"] = value.lower()
        else:
            names = _FIELDS.get(name, (name,))
            fields |= zip(names, value if len(names) > 1 else [value], strict=True)
    return _CLASSES[engine](**fields)  # type: ignore[no-any-return]


@cache
def read_sequences() -> tuple[Sequence, ...]:
    """Return all sequences; none where the data is absent."""
    if not FOLDER.is_dir():
        return ()
    described = json.loads((FOLDER / "settings.json").read_text())
    frames = _arrays("frames.npz")
    return tuple(
        Sequence(
            case["key"],
            case["engine"],
            _exposure(case["engine"], case["settings"], described["curve"]),
            described["scenes"][case["scene"]],
            frames[case["key"]],
            frames.get(f"{case['key']}_histogram"),
        )
        for case in described["cases"]
    )
