"""What the device's sums are multiplied by for derivatives by fields of a chain of levels.

Such a field sets shares of the levels in their sum, factors of their channels or of the stages of
glare, or distances of the taps of passes between them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import LUMINANCE_7_DIGITS
from vkbloom._settings.settings import Settings
from vkbloom.reference import _bevy, _kino
from vkbloom.reference._post_processing import linear_light
from vkbloom.reference._sampling import level_sizes
from vkbloom.reference._upsampling import mix

if TYPE_CHECKING:
    from vkbloom._methods.kino import KinoBloom
    from vkbloom._methods.mip_chain import Pyramid

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
    if settings.method == "pyramid":
        return ("level_weights",)
    method = _METHODS.get(settings.method)
    # The other filters of URP are no chains of levels.
    is_chain = getattr(settings, "filter", "gaussian") == "gaussian"
    return method.fields if method and is_chain else ()


def factors_by_shares(settings: Settings, size: tuple[int, int]) -> dict[str, NDArray[np.float64]]:
    """Return what sums are multiplied by for the derivatives by these fields.

    Each array, after the dimensions of the field, has two factors for each of up_0, up_1, ..., or
    for all of them: of the sum of its cotangents times the level of its size, and of that of its
    cotangents times itself. `size`: of the bloom buffers.
    """
    if settings.method == "pyramid":
        return {"level_weights": _by_level_weights(cast("Pyramid", settings), size)}
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


def _by_level_weights(settings: Pyramid, size: tuple[int, int]) -> NDArray[np.float64]:
    weights = np.array(settings.level_weights)
    last = len(level_sizes(size, settings.levels)) - 1
    factors = np.zeros((len(weights), last, 2))
    each = np.arange(last)
    factors[each, each, 0] = 1.0
    # up_N-2 less its level is the enlarged last level, times its weight.
    if last:
        with np.errstate(divide="ignore"):
            factors[last, last - 1] = np.array([-weights[last - 1], 1.0]) / weights[last]
    return factors


def _shares(method: _Shares, settings: Settings, changes: dict[str, float]) -> NDArray[np.float64]:
    """Return the shares of the levels and of the smaller ones, with changed fields."""
    return np.array(method.of(SimpleNamespace(**vars(settings) | changes)), np.float64)


#: By field: what the sums of the levels' channels are multiplied by. The last dimensions are levels
#: and channels, those before are of the field.
Factors = Mapping[str, NDArray[np.float64]]


def _three(settings: Any) -> Factors:
    tints, radius = np.array(settings.tints), settings.radius
    slopes = 1.2 - 2 * np.array([1.0, 0.8, 0.6, 0.4, 0.2])
    shares = (1.2 - slopes) / 2 + slopes * radius
    by_tints = np.zeros((5, 3, 5, 4))
    level, channel = np.indices((5, 3))
    by_tints[level, channel, level, channel] = 1 / tints
    return {"radius": np.repeat((slopes / shares)[:, None], 4, axis=1), "tints": by_tints}


def _godot(settings: Any) -> Factors:
    weights = np.array(settings.level_weights, np.float32)
    # Others are left out.
    taken = np.flatnonzero(weights > np.float32(1e-4))
    by_weights = np.zeros((len(weights), len(taken), 4))
    by_weights[taken, np.arange(len(taken))] = 1 / weights[taken, None]
    return {"level_weights": by_weights}


def _urp(settings: Any) -> Factors:
    tint, luminance = np.array(settings.tint), np.array(LUMINANCE_7_DIGITS)
    light = np.array(list(map(linear_light, tint)))
    grey = luminance @ light
    by_tint = np.zeros((3, 1, 4))
    if grey:
        ends = [np.array(list(map(linear_light, tint + step))) for step in (_STEP, -_STEP)]
        slopes = (ends[0] - ends[1]) / (2 * _STEP)
        by_tint[:, 0, :3] = slopes[:, None] * (np.diag(1 / light) - luminance[:, None] / grey)
    return {"tint": by_tint}


def _post_processing(settings: Any) -> Factors:
    return {"color": np.diag(1 / np.array(settings.color))[:, None] @ np.eye(3, 4)}


#: By method: which sums the core has ("levels": those of a pass that adds up levels; "colour": that
#: of the first level), and what returns their factors.
_FACTORS: Final[dict[str, tuple[str, Callable[[Any], Factors], tuple[str, ...]]]] = {
    "godot": ("levels", _godot, ("level_weights",)),
    "post_processing": ("colour", _post_processing, ("color",)),
    "three": ("levels", _three, ("radius", "tints")),
    "urp": ("colour", _urp, ("tint",)),
}


def factor_fields(settings: Settings) -> dict[str, str]:
    """Return the fields that only multiply channels of levels, each with the sums that it needs."""
    kind, _, fields = _FACTORS.get(settings.method, ("", None, ()))
    return dict.fromkeys(fields, kind)


def factors_of_levels(settings: Settings) -> Factors:
    """Return what the sums of levels are multiplied by for the derivatives by `factor_fields`.

    It is not finite where a factor is 0, which leaves nothing of the channel.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return _FACTORS[settings.method][1](settings)


def stage_fields(settings: Settings) -> dict[str, int]:
    """Return the factors in the sum of the bloom and the stages of glare, with their places in it.

    Without glare there is no such sum.
    """
    lights = [f"glare.{i}" for i, stage in enumerate(settings.glare) if stage.stage != "dirt"]
    names = ["intensity", *(f"{light}.intensity" for light in lights)] if settings.glare else []
    places = {name: place for place, name in enumerate(names)}
    # A mix takes the intensity of the scene, too.
    if settings.composite == "mix" or "intensity" in settings._fields_before_composite:
        places.pop("intensity", None)
    return places


_UP: Final = ("enlarging_x", "enlarging_y")
_ALL: Final = (*_UP, "reducing_x", "reducing_y")
#: By method: the fields that only set distances of taps, with the sums of these.
_DISTANCES: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    "dual_kawase": {"offset": _ALL},
    "kino": {"radius": _UP},
    "pygfx": {"filter_radius": _UP},
    "pyramid": {
        "radius": _UP,
        "scale_x": ("enlarging_x", "reducing_x"),
        "scale_y": ("enlarging_y", "reducing_y"),
    },
    "separable": {"blur_scale": _ALL},
    "urp": {"scatter": _UP},
}


def distance_fields(settings: Settings) -> dict[str, tuple[str, ...]]:
    """Return the fields that only set distances of taps, with the kinds of these.

    These are distances along x or y, in passes that enlarge an image or in others.
    """
    fields = _DISTANCES.get(settings.method, {})
    # Stages of glare have taps of their own.
    if settings.glare or (settings.method == "urp" and settings.value_of("filter") != "dual"):
        return {}
    # The weights against fireflies depend on the places of the taps.
    if settings.method == "pyramid" and settings.value_of("firefly_filter"):
        return {"radius": fields["radius"]}
    return fields


def distance_by(settings: Settings, name: str, size: tuple[int, int]) -> float:
    """Return what the distances are proportional to: the field, but for a number added to it.

    The sums are derivatives by a factor of the distances. `size`: of the bloom buffers.
    """
    value: float = settings.value_of(name)
    if settings.method == "kino":
        return _kino._count_and_step(cast("KinoBloom", settings), size[1])[1]
    return value + 0.3 if settings.method == "urp" else value
