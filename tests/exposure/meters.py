"""A small exposure with a switch for each fault, and the law that names the fault."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

GREY = 0.18

#: Faults by name: all laws that they break, first the one that names them.
FAULTS: dict[str, tuple[str, ...]] = {
    "steps are not multiplied by dt": ("still", "frame_rate"),
    "dt is at least 1/60": ("still", "frame_rate"),
    "dt is at most 1/30": ("frame_rate",),
    "the state has 8 bits": ("frame_rate", "speeds", "scale"),
    "a share speed * dt": ("no_overshoot", "frame_rate"),
    "the exponent has the wrong sign": ("speeds", "finite_state"),
    "up and down change places": ("speeds",),
    "the logarithm of 0": ("finite_state",),
    "NaN makes the mean grey": ("finite_state",),
    "NaN stays": ("finite_state",),
    "weights are off the centre": ("mirror",),
    "the border fills no block": ("mirror",),
    "bins end early": ("scale",),
    "stops are added twice": ("scale", "dark_pixels"),
    "the exposed picture is metered": ("scale", "frame_rate", "no_overshoot"),
    "every second row is read": ("dark_pixels", "mirror"),
    "the mean of logarithms": ("dark_pixels",),
    "black is left out": ("monotone",),
}


@dataclass(frozen=True)
class Meter:
    """The weighted mean becomes grey; the distance in stops halves in 1/3 s and 1 s.

    - `fault`: What is wrong; "": nothing.
    """

    fault: str = ""
    gives_picture: bool = False

    def __call__(self, image: NDArray[Any], *, dt: float, state: Any) -> tuple[Any, Any]:
        light = image[..., 0].astype(np.float64)
        if self.fault == "the exposed picture is metered" and state is not None:
            light = light * 2.0**state
        goal = self.goal(light)
        if math.isnan(goal) and self.fault == "NaN makes the mean grey":
            goal = 0.0
        stops = goal if state is None else state + (goal - state) * self.share(dt, goal < state)
        if self.fault == "the state has 8 bits":
            stops = round(stops * 16) / 16
        return (image * 2.0**stops if self.gives_picture else stops), stops

    def goal(self, light: NDArray[np.float64]) -> float:
        rows, columns = (np.linspace(-1, 1, side) for side in light.shape)
        if self.fault == "weights are off the centre":
            columns = columns - 0.2
        weights = 1 - np.minimum(1, np.hypot(rows[:, np.newaxis], columns) / 2)
        if self.fault not in ("NaN makes the mean grey", "NaN stays"):
            light, weights = np.nan_to_num(light), weights * np.isfinite(light)
        if self.fault == "the border fills no block":
            light, weights = light[:, :-32], weights[:, :-32]
        if self.fault == "every second row is read":
            light, weights = light[::2], weights[::2]
        if self.fault == "black is left out":
            weights = weights * (light > 0)
        if self.fault == "bins end early":
            light = np.clip(light, 0.3, 0.6)
        least = 0.0 if self.fault == "the logarithm of 0" else 1e-4
        if self.fault == "the mean of logarithms":
            mean = 2.0 ** np.average(np.log2(np.maximum(light, least)), weights=weights)
        else:
            mean = np.average(light, weights=weights) if weights.any() else 0.0
        # (maximum spreads NaN.)
        stops = float(-np.log2(np.maximum(mean, least) / GREY))
        return 2 * stops if self.fault == "stops are added twice" else stops

    def share(self, dt: float, is_up: bool) -> float:
        """Return the share of the distance that passes; `is_up`: the scene is brighter."""
        if self.fault == "steps are not multiplied by dt":
            dt = 1 / 60
        if self.fault == "dt is at least 1/60":
            dt = max(dt, 1 / 60)
        if self.fault == "dt is at most 1/30":
            dt = min(dt, 1 / 30)
        speed = 3.0 if is_up != (self.fault == "up and down change places") else 1.0
        if self.fault == "a share speed * dt":
            return speed * dt
        sign = 1 if self.fault == "the exponent has the wrong sign" else -1
        return 1 - math.exp2(sign * min(speed * dt, 500.0))
