"""What sums of the device are multiplied by for derivatives by fields of what is between passes.

Such a field sets shares of levels in their sum, factors of their channels or of the stages of
glare, distances of the taps of passes, or weights of blurs. The sums have kinds:

- "shares": Of up_0, up_1, ...: of its cotangents times the level of its size, and of its cotangents
  times itself.
- "levels", "stages", "colour": Of each channel of the levels that one pass adds up, of the bloom
  and the stages of glare, and of the first level: times its cotangents.
- "enlarging_x", "reducing_y", ...: Of each pass that enlarges a level or does not: the derivative
  by a factor of the distances of its taps along an axis.
- "weight": Of each blur along an axis: the derivatives by four of its weights.
- "taps": The same by three of them, and by a factor of the distances of the taps with these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import LUMINANCE_7_DIGITS
from vkbloom.reference import _bevy, _godot, _kino, _three
from vkbloom.reference._post_processing import linear_light
from vkbloom.reference._sampling import level_sizes
from vkbloom.reference._upsampling import mix

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

_Array = NDArray[np.float64]
#: By kind, after the dimensions of the field: for each sum, or for all of them, the factors of its
#: channels, or one of them all.
Factors = Mapping[str, _Array]
_Size = tuple[int, int]

# Of a central difference. The truncated terms are 1e-10 of the slope, and so is the rounding.
_STEP: Final = 1e-5

_SHARES: Final = ("shares",)
_LEVELS: Final = ("levels",)
_COLOUR: Final = ("colour",)
_WEIGHT: Final = ("weight", "taps")
_UP: Final = ("enlarging_x", "enlarging_y")
_EVERYWHERE: Final = (*_UP, "reducing_x", "reducing_y")
#: By method: the fields that only these sums have, beside the composite, with the kinds of each.
_KINDS: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    "bevy": {
        "intensity": _SHARES,
        "low_frequency_boost": _SHARES,
        "low_frequency_boost_curvature": _SHARES,
        "high_pass_frequency": _SHARES,
    },
    "dual_kawase": {"offset": _EVERYWHERE},
    "godot": {"level_weights": _LEVELS},
    "hdrp": {"scatter": _SHARES},
    "kino": {"radius": _UP},
    "pmndrs": {"radius": _SHARES},
    "post_processing": {"color": _COLOUR},
    "pygfx": {"filter_radius": _UP},
    "pyramid": {
        "level_weights": _SHARES,
        "radius": _UP,
        "scale_x": ("enlarging_x", "reducing_x"),
        "scale_y": ("enlarging_y", "reducing_y"),
    },
    "separable": {
        "blur_scale": (*_EVERYWHERE, "taps"),
        "weights": _WEIGHT,
        "blur_strength": _WEIGHT,
    },
    "three": {"radius": _LEVELS, "tints": _LEVELS},
    "urp": {"scatter": _SHARES, "tint": _COLOUR},
}


def level_fields(settings: Settings) -> dict[str, tuple[str, ...]]:
    """Return the fields that only these sums have, beside the composite, with the kinds of each."""
    fields = dict(_KINDS.get(settings.method, {}))
    if settings.method == "urp" and settings.value_of("filter") != "gaussian":
        # One of the other filters has distances of taps in place of shares.
        del fields["scatter"]
        if settings.value_of("filter") == "dual":
            fields["scatter"] = _UP
    if settings.method == "pyramid" and settings.value_of("firefly_filter"):
        # The weights against fireflies depend on the places of the taps.
        del fields["scale_x"], fields["scale_y"]
    if settings.glare:
        # Stages have taps, too.
        tapped = {*_EVERYWHERE, *_WEIGHT}
        fields = {name: kinds for name, kinds in fields.items() if tapped.isdisjoint(kinds)}
        for name in _stages(settings):
            fields[name] = (*fields.get(name, ()), "stages")
        # A mix takes the intensity of the scene, too.
        if settings.composite == "mix" or "intensity" in settings._fields_before_composite:
            fields.pop("intensity", None)
    return fields


def level_factors(settings: Settings, size: _Size) -> dict[str, Factors]:
    """Return what the sums are multiplied by, for each of `level_fields`.

    It is not finite where a factor, a share or a distance is 0, which leaves nothing of what it
    multiplies. `size`: of the bloom buffers.
    """
    stages = _stages(settings) if settings.glare else []
    with np.errstate(divide="ignore", invalid="ignore"):
        made = _FACTORS[settings.method](settings, size) if settings.method in _FACTORS else {}
        for number, name in enumerate(stages):
            alone = np.zeros((len(stages), 1))
            alone[number] = np.divide(1.0, settings.value_of(name))
            made[name] = {**made.get(name, {}), "stages": alone}
    return {
        name: {kind: made[name][kind] for kind in kinds}
        for name, kinds in level_fields(settings).items()
        if name in made
    }


def _stages(settings: Settings) -> list[str]:
    """Return the factors in the sum of the bloom and the stages of glare."""
    lights = [number for number, stage in enumerate(settings.glare) if stage.stage != "dirt"]
    return ["intensity", *(f"glare.{number}.intensity" for number in lights)]


def _by_slopes(of: Callable[[Any], Any], *names: str) -> Callable[[Any, _Size], dict[str, Factors]]:
    """Return a function for fields that set shares: of levels, and of the smaller ones."""

    def shares(settings: Any, name: str = "", step: float = 0.0) -> _Array:
        values = dict(vars(settings))
        if name:
            values[name] += step
        return np.array(of(SimpleNamespace(**values)), np.float64)

    def factors(settings: Any, size: _Size) -> dict[str, Factors]:
        fine, coarse = shares(settings)
        found: dict[str, Factors] = {}
        for name in names:
            ends = [shares(settings, name, step) for step in (_STEP, -_STEP)]
            of_fine, of_coarse = (ends[0] - ends[1]) / (2 * _STEP)
            # The sum without the level is the smaller one times its share.
            of_sum = np.where(of_coarse != 0.0, of_coarse / coarse, 0.0)
            found[name] = {"shares": np.stack([of_fine - of_sum * fine, of_sum], axis=-1)}
        return found

    return factors


_by_scatter = _by_slopes(lambda settings: mix(0.05 + 0.9 * settings.scatter, 1), "scatter")


def _distances(name: str) -> Callable[[Any, _Size], dict[str, Factors]]:
    """Return a function for a field that multiplies distances."""
    return lambda settings, size: {name: _by_distance(getattr(settings, name))}


def _by_distance(distance: float) -> Factors:
    """Return the factors for a field that is this distance, or less by a constant."""
    return dict.fromkeys(_EVERYWHERE, np.divide(np.ones((1, 1)), distance))


def _kino_factors(settings: Any, size: _Size) -> dict[str, Factors]:
    return {"radius": _by_distance(_kino._count_and_step(settings, size[1])[1])}


def _pyramid_factors(settings: Any, size: _Size) -> dict[str, Factors]:
    names = ("radius", "scale_x", "scale_y")
    found = {name: _by_distance(getattr(settings, name)) for name in names}
    if settings.level_weights is None:
        return found
    weights, last = np.array(settings.level_weights), len(level_sizes(size, settings.levels)) - 1
    of_level, of_sum = np.zeros((2, len(weights), last))
    each = np.arange(last)
    of_level[each, each] = 1.0
    # The last sum less its level is the smallest level, enlarged, times its weight.
    if last:
        of_level[last, -1], of_sum[last, -1] = np.array([-weights[last - 1], 1.0]) / weights[last]
    by_weights = np.stack([of_level, of_sum], axis=-1)
    return found | {"level_weights": {"shares": by_weights}}


def _three_factors(settings: Any, size: _Size) -> dict[str, Factors]:
    shares, slopes = np.array(_three._factors(settings.radius)), 1.2 - 2 * np.array(_three._FACTORS)
    by_tints = np.zeros((5, 3, 5, 4))
    level, channel = np.indices((5, 3))
    by_tints[level, channel, level, channel] = 1 / np.array(settings.tints)
    return {"radius": {"levels": (slopes / shares)[:, None]}, "tints": {"levels": by_tints}}


def _godot_factors(settings: Any, size: _Size) -> dict[str, Factors]:
    weights = np.array(settings.level_weights, np.float32)
    # Others are left out.
    taken = np.flatnonzero(weights > np.float32(_godot._MIN_WEIGHT))
    by_weights = np.zeros((len(weights), max(len(taken), 1), 1))
    by_weights[taken, np.arange(len(taken)), 0] = 1 / weights[taken]
    return {"level_weights": {"levels": by_weights}}


def _urp_factors(settings: Any, size: _Size) -> dict[str, Factors]:
    tint, luminance = np.array(settings.tint), np.array(LUMINANCE_7_DIGITS)
    light, *ends = (np.array(list(map(linear_light, tint + step))) for step in (0.0, _STEP, -_STEP))
    slopes, grey = (ends[0] - ends[1]) / (2 * _STEP), luminance @ light
    by_tint = np.zeros((3, 1, 4))
    # Black counts as white.
    if grey:
        by_tint[:, 0, :3] = slopes[:, None] * (np.diag(1 / light) - luminance[:, None] / grey)
    by_shares = _by_scatter(settings, size)["scatter"]
    by_scatter = {**by_shares, **_by_distance(settings.scatter + 0.3)}
    return {"tint": {"colour": by_tint}, "scatter": by_scatter}


def _post_processing_factors(settings: Any, size: _Size) -> dict[str, Factors]:
    return {"color": {"colour": np.diag(1 / np.array(settings.color))[:, None] @ np.eye(3, 4)}}


def _separable_factors(settings: Any, size: _Size) -> dict[str, Factors]:
    weights, strength = np.array(settings.weights), settings.blur_strength
    by_weights, by_strength = np.full(len(weights), strength), weights.copy()
    # The centre is added twice more, with the strength, or has none.
    twice = settings.first_tap == 0
    by_weights[0], by_strength[0] = (1 + 2 * strength, 2 * weights[0]) if twice else (1.0, 0.0)
    of_taps = np.zeros((-(-len(weights) // 3), 4))
    of_taps[:, 3] = np.divide(1.0, settings.blur_scale)
    return {
        "blur_scale": {**_by_distance(settings.blur_scale), "taps": of_taps},
        "weights": _by_weights(np.diag(by_weights)),
        "blur_strength": _by_weights(by_strength),
    }


def _by_weights(factors: _Array) -> Factors:
    """Return the factors of a field by those of the weights, the last dimension."""
    fours, threes = (_in_parts(factors, size) for size in (4, 3))
    return {"weight": fours, "taps": np.concatenate([threes, 0 * threes[..., :1]], axis=-1)}


def _in_parts(factors: _Array, size: int) -> _Array:
    """Return the last dimension as two, of which the second one has so many."""
    padding = [(0, 0)] * (factors.ndim - 1) + [(0, -factors.shape[-1] % size)]
    return np.pad(factors, padding).reshape(*factors.shape[:-1], -1, size)


_FACTORS: Final[dict[str, Callable[[Any, _Size], dict[str, Factors]]]] = {
    "bevy": _by_slopes(_bevy.shares, *_KINDS["bevy"]),
    "dual_kawase": _distances("offset"),
    "godot": _godot_factors,
    "hdrp": _by_scatter,
    "kino": _kino_factors,
    "pmndrs": _by_slopes(lambda settings: mix(settings.radius, 1), "radius"),
    "post_processing": _post_processing_factors,
    "pygfx": _distances("filter_radius"),
    "pyramid": _pyramid_factors,
    "separable": _separable_factors,
    "three": _three_factors,
    "urp": _urp_factors,
}
