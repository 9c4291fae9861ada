"""Simulated fits: how often the intervals have the true values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom
from vkbloom import (
    Convolution,
    DualKawase,
    KinoBloom,
    Pyramid,
    Renderer,
    Separable,
    Settings,
    UrpBloom,
)


@dataclass(frozen=True)
class Study:
    """Settings, and the range from which the true value of each varied field is drawn."""

    start: Settings
    fields: Mapping[str, tuple[float, float]]


#: Two to five fields of six methods, one of a point-spread function.
STUDIES = {
    "separable": Study(
        Separable(threshold=1.0, knee=0.5), {"blur_scale": (1.5, 2.5), "intensity": (0.3, 1.0)}
    ),
    "pyramid": Study(
        Pyramid(levels=3, threshold=1.0, knee=0.5),
        {
            "threshold": (0.6, 1.4),
            "radius": (0.8, 1.8),
            "scale_x": (0.7, 1.3),
            "intensity": (0.3, 0.8),
            "exposure": (-0.5, 0.5),
        },
    ),
    "dual_kawase": Study(
        DualKawase(levels=3, threshold=1.0, knee=0.5),
        {
            "threshold": (0.6, 1.4),
            "offset": (0.6, 1.5),
            "intensity": (0.3, 0.8),
            "exposure": (-0.5, 0.5),
        },
    ),
    "urp": Study(
        UrpBloom(),
        {"threshold": (0.5, 1.2), "scatter": (0.3, 0.7), "intensity": (0.3, 0.9)},
    ),
    "convolution": Study(
        Convolution(vkbloom.psf.gaussian(2.0), threshold=1.0, knee=0.5),
        {"psf.sigma": (1.5, 3.0), "threshold": (0.6, 1.2), "intensity": (0.3, 0.9)},
    ),
    "kino": Study(KinoBloom(), {"threshold": (0.6, 1.2), "intensity": (0.3, 0.8)}),
}


def simulate(
    renderer: Renderer,
    image: NDArray[Any],
    study: Study,
    seed: int,
    *,
    noise: float = 0.01,
    max_calls: int = 60,
    level: float = 0.95,
    spoil: Callable[[NDArray[Any], float, np.random.Generator], NDArray[Any]] | None = None,
    **options: Any,
) -> dict[str, tuple[float, tuple[float, float]]]:
    """Return the true value and the interval of each field of one simulated picture."""
    generator = np.random.default_rng([seed, *map(ord, study.start.method)])
    truth = {name: generator.uniform(*ends) for name, ends in study.fields.items()}
    clean = vkbloom.reference.apply(image, study.start.replace(**truth))["final"]
    deviation = noise * float(clean.max())
    target = clean + deviation * generator.standard_normal(clean.shape)
    if spoil is not None:
        target = spoil(clean, deviation, generator)
    middle = {name: (low + high) / 2 for name, (low, high) in study.fields.items()}
    found = vkbloom.fit(
        image,
        target,
        study.start.replace(**middle),
        list(truth),
        renderer=renderer,
        max_calls=max_calls,
        **options,
    )
    return {name: (value, found.interval(name, level)) for name, value in truth.items()}
