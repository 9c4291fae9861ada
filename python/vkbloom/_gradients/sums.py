"""The fields by which the device has derivatives, and the sums that these are made of."""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vkbloom._gradients.levels import Factors, level_factors, level_fields
from vkbloom.reference._derivatives import differentiable
from vkbloom.reference._sampling import scale_size

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

#: The fields that the composite reads.
_OF_COMPOSITE: Final = ("intensity", "exposure", "reference_white")


class Sums(NamedTuple):
    """Sums of the device, and the fields whose derivatives are combinations of them.

    - `factors`: By field, of its shape, and with a factor for each channel of each array.
    - `arrays`: Of shape (2, 1, channels): the sums, and those of the squares of their terms.
    """

    factors: Mapping[str, NDArray[np.float64]]
    arrays: tuple[NDArray[Any], ...]


def device_fields(settings: Settings) -> frozenset[str]:
    """Return the fields by which the device has the derivatives.

    These are what only the composite, the threshold, or `level_fields` read. Stages of glare read
    the threshold of a published method, too.
    """
    return _device_fields(settings._origin)


# Each step of a training loop asks several times, with other numbers.
@functools.lru_cache(16)
def _device_fields(settings: Settings) -> frozenset[str]:
    known = {*_OF_COMPOSITE} - settings._fields_before_composite
    if not settings.published:
        known |= {"threshold", "knee"}
    elif not settings.glare:
        known |= settings._threshold_slopes().keys()
    if settings.glare:
        known -= {"intensity"}
    known |= level_fields(settings).keys()
    return frozenset(known & differentiable(settings).keys())


def wanted_sums(settings: Settings, wanted: Iterable[str]) -> tuple[str, ...]:
    """Return what the core calls the sums that some of `device_fields` need."""
    of_levels, channels = level_fields(settings), _channels(settings)
    zeros = {name for factors in channels.values() for name, one in factors.items() if one == 0}
    sums = set()
    for name in {*wanted} - zeros:
        # Such as "enlarging_x". The core has "taps" where it can, in place of "weight".
        sums |= {kind.partition("_")[0] for kind in of_levels.get(name, ())} - {"taps"}
        if name == "intensity" and not settings.glare:
            sums.add("composite" if settings.value_of(name) == 0 else name)
        elif name in _OF_COMPOSITE and name != "intensity":
            sums.add("composite")
        elif name not in of_levels:
            sums.add("threshold")
    return tuple(sorted(sums))


def _channels(settings: Settings) -> dict[str, dict[str, float | None]]:
    """Return for each sum the fields whose derivatives its channels are, times a factor.

    0: the derivative is 0, also without the sum. None: it is not that of the field.
    """
    is_set, intensity = settings.threshold is not None, settings.value_of("intensity")
    threshold: dict[str, float | None] = {}
    if not settings.published:
        # Without a knee it is a step.
        threshold = dict.fromkeys(("threshold", "knee"), float(is_set and settings.knee != 0))
    own = settings._threshold_slopes()
    composite: dict[str, float | None] = dict.fromkeys(_OF_COMPOSITE, 1.0)
    if settings.glare:
        # It is that of the sum of the bloom and the stages.
        composite["intensity"] = None
    return {
        ".by_composite": composite,
        ".by_threshold": threshold,
        ".by_own_threshold": {name: slope * is_set for name, slope in own.items()},
        # The intensity's derivative, times the intensity.
        ".by_light": threshold | {"intensity": 1.0 / intensity if intensity != 0 else None},
    }


def sums_of(
    settings: Settings,
    size: tuple[int, int],
    totals: Mapping[str, NDArray[Any]],
    fields: Collection[str],
) -> Sums:
    """Return the sums of the device with what they are multiplied by for each of the fields.

    `size`: of the image.
    """
    starts, width = {}, 0
    for name, array in totals.items():
        starts[name] = width
        width += array.shape[-1]
    found: dict[str, NDArray[np.float64]] = {}
    for kind, factors in _channels(settings).items():
        for channel, (name, factor) in enumerate(factors.items()):
            if factor == 0 or (kind in starts and factor is not None and name not in found):
                found[name] = np.zeros(width)
                if factor != 0:
                    found[name][starts[kind] + channel] = factor
    if not level_fields(settings).keys().isdisjoint(fields):
        size = settings.bloom_size or scale_size(size, settings.bloom_scale)
        for name, given in level_factors(settings, size).items():
            # The composite may read the field, too.
            found[name] = _rows(given, starts, width) + found.get(name, 0.0)
    # Other derivatives are left to the reference.
    known = {name: found[name] for name in fields if name in found}
    known = {name: factors for name, factors in known.items() if np.isfinite(factors).all()}
    return Sums(known, tuple(totals.values()))


def _rows(given: Factors, starts: Mapping[str, int], width: int) -> NDArray[np.float64]:
    """Return the factors of all channels; they are NaN if sums are missing."""
    shape = next(iter(given.values())).shape[:-2]
    rows = np.zeros((*shape, width))
    for kind, factors in given.items():
        places = _places(kind, factors.shape[-2], starts)
        if places is None:
            return np.full(rows.shape, np.nan)
        # Of all channels, or of these.
        channels = factors.shape[-1] if factors.shape[-1] > 1 else 4
        for number, start in places:
            rows[..., start : start + channels] += factors[..., number, :]
    return rows


def _places(kind: str, count: int, starts: Mapping[str, int]) -> list[tuple[int, int]] | None:
    """Return which factors the sums of a kind have, and their first channels; None: some miss."""
    prefix = f".by_{kind}_"
    numbered = [
        (int(name.removeprefix(prefix).partition("_")[0]), start)
        for name, start in starts.items()
        if name.startswith(prefix)
    ]
    if kind == "shares":
        # Without cotangents the largest levels have none.
        first = count - len(numbered)
        each = [(first + number if count > 1 else 0, start) for number, start in numbered]
        return each or None
    if kind in ("levels", "stages"):
        # One that has cotangents of its own has none.
        return numbered if len(numbered) == count else None
    if kind == "colour":
        return [(0, starts[".by_colour"])] if ".by_colour" in starts else None
    return numbered if kind in ("weight", "taps") else [(0, start) for _, start in numbered]
