"""Derivatives by fields that set the shares of levels in their sums, from sums on the device."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._settings.settings import Settings
from vkbloom.reference import _bevy
from vkbloom.reference._upsampling import mix

# Of a central difference. The truncated terms are 1e-10 of the slope, and so is the rounding.
_STEP: Final = 1e-5


class _Shares(NamedTuple):
    """The shares of a method, and the fields that only they and the composite read.

    - `of`: Returns the shares of the levels and of the smaller ones, of all levels or of each.
    """

    of: Callable[[Any], Any]
    fields: tuple[str, ...]


def _scattered(settings: Any) -> Any:
    return mix(0.05 + 0.9 * settings.scatter, 1)


# The core has these sums of methods with `learns_shares`.
_METHODS: Final = {
    "bevy": _Shares(
        _bevy.shares,
        (
            "intensity",
            "low_frequency_boost",
            "low_frequency_boost_curvature",
            "high_pass_frequency",
        ),
    ),
    "hdrp": _Shares(_scattered, ("scatter",)),
    "pmndrs": _Shares(lambda settings: mix(settings.radius, 1), ("radius",)),
    "urp": _Shares(_scattered, ("scatter",)),
}


def share_fields(settings: Settings) -> tuple[str, ...]:
    """Return the fields that only the shares of levels and the composite read."""
    method = _METHODS.get(settings.method)
    # The other filters of URP are no chains of levels.
    is_chain = getattr(settings, "filter", "gaussian") == "gaussian"
    return method.fields if method and is_chain else ()


def factors_by_shares(settings: Settings) -> dict[str, NDArray[np.float64]]:
    """Return what sums are multiplied by for the derivatives by these fields.

    Each array has two factors for each of up_0, up_1, ..., or for all of them: of the sum of its
    cotangents times the level of its size, and of that of its cotangents times itself.
    """
    method = _METHODS[settings.method]
    fine, coarse = _shares(method, settings, {})
    results = {}
    for name in method.fields:
        value = getattr(settings, name)
        ends = [_shares(method, settings, {name: value + step}) for step in (_STEP, -_STEP)]
        of_fine, of_coarse = (ends[0] - ends[1]) / (2 * _STEP)
        # The sum without the level is the smaller one times its share. A share of 0 that changes
        # leaves nothing to divide: then the factor is not finite.
        with np.errstate(divide="ignore", invalid="ignore"):
            of_sum = np.where(of_coarse != 0.0, of_coarse / coarse, 0.0)
            results[name] = np.stack([of_fine - of_sum * fine, of_sum], axis=1)
    return results


def _shares(method: _Shares, settings: Settings, changes: dict[str, float]) -> NDArray[np.float64]:
    """Return the shares of the levels and of the smaller ones, with changed fields."""
    return np.array(method.of(SimpleNamespace(**vars(settings) | changes)), np.float64)
