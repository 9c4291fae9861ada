"""Exposures that do not meter: a fixed one, and one that changes at given times."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import ClassVar, Literal

from vkbloom._public import public
from vkbloom._settings.exposure import Exposure
from vkbloom._settings.fields import number_field, numbers_field

#: Numbers of stops by which light is multiplied, or values of EV100, each of which darkens.
Unit = Literal["stop", "ev100"]


def _stops(value: float, unit: Unit) -> float:
    return value if unit == "stop" else -value - math.log2(1.2)


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class FixedExposure(Exposure):
    """An exposure that stays as it is.

    Parameters
    ----------
    value : float
        In stops or in EV100, -32 to 32.
    unit : {"stop", "ev100"}
        The light is multiplied by 2^value, or by 1 / (1.2 * 2^value).

    Notes
    -----
    The bloom reads exposed light.

    Source of the factor 1.2: Lagarde and de Rousiers, "Moving Frostbite to Physically Based
    Rendering", SIGGRAPH 2014.
    """

    engine: ClassVar[str] = "fixed"
    _adapts: ClassVar[bool] = False
    _exposes_bloom: ClassVar[bool] = True

    value: float = number_field(default=0.0, range=(-32.0, 32.0), unit="stop", slider=(-8, 8))
    unit: Unit = "stop"

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        return {"minimum": self.value, "scale": 2.0 ** _stops(self.value, self.unit)}


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class KeyframedExposure(Exposure):
    """An exposure that changes at given times.

    Parameters
    ----------
    keys : sequence of (float, float)
        Seconds and value, in stops or in EV100, up to 16. The seconds increase. Between two keys
        the value is interpolated linearly; before the first and after the last key it stays.
    unit : {"stop", "ev100"}
        As of `FixedExposure`.

    Notes
    -----
    The first frame is at 0 seconds, and each further one `dt` seconds after the one before. The
    bloom reads exposed light.
    """

    engine: ClassVar[str] = "keyframed"
    _exposes_bloom: ClassVar[bool] = True

    keys: tuple[tuple[float, float], ...] = numbers_field(
        ((0.0, 0.0),), -65504.0, count=(1, 16), unit="stop"
    )
    unit: Unit = "stop"

    def __post_init__(self) -> None:
        super().__post_init__()
        seconds = [time for time, _ in self.keys]
        if any(later <= time for time, later in itertools.pairwise(seconds)):
            raise ValueError(f"keys: the seconds {seconds} do not increase")
        for _, value in self.keys:
            if not -32 <= value <= 32:
                raise ValueError(f"keys: {value!r} is out of range, -32 to 32")

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        return {"step_up": dt}

    def _core_table(self) -> Sequence[float]:
        return [part for time, value in self.keys for part in (time, _stops(value, self.unit))]
