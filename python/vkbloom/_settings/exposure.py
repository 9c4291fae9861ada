"""The base classes of exposures, and the mapping of their presets."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

from vkbloom._numbers import check_number
from vkbloom._public import public
from vkbloom._settings.named import Named, check_named
from vkbloom._settings.records import Record
from vkbloom._settings.registry import EXPOSURES, NAMED_EXPOSURES


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Exposure(Record):
    """Base class of exposures; use an engine's class, such as `BevyExposure`.

    Exposures are frozen and hashable. One that adapts meters the frame, and moves what it has
    adapted to towards the goal, by the seconds since the frame before. `vkbloom.exposures` has
    those of engines by name.
    """

    _class_key: ClassVar[str] = "engine"
    _subject: ClassVar[str] = "exposure"
    _example: ClassVar[str] = "an exposure of an engine, such as BevyExposure"
    engine: ClassVar[str]
    #: Whether a frame depends on those before.
    _adapts: ClassVar[bool] = True
    #: Whether the light that the bloom reads is exposed; whether the picture with its bloom is;
    #: whether that is what is metered; whether the stage comes before temporal anti-aliasing.
    _exposes_bloom: ClassVar[bool] = False
    _exposes_picture: ClassVar[bool] = False
    _meters_bloom: ClassVar[bool] = False
    _is_before_taa: ClassVar[bool] = False

    @property
    def _core_engine(self) -> str:
        """The name of the engine in `_core.EXPOSURES`."""
        return self.engine

    def _numbers_of_step(self, dt: float) -> dict[str, float]:
        """Return the numbers of `_core.EXPOSURE_NUMBERS` for a step of time; others are 0."""
        raise NotImplementedError

    def _core_table(self) -> Sequence[float]:
        """Return the table that the core reads, if there is one."""
        return ()

    @classmethod
    def _classes(cls) -> Mapping[str, type[Exposure]]:
        return EXPOSURES


def half_lives(dt: float, rate: float) -> float:
    """Return the share of a distance that is left behind if half is left after 1 / rate seconds."""
    return 1.0 - math.exp2(-dt * rate)


def check_ends(settings: Any, low: str, high: str, *, apart: bool = False) -> None:
    """Raise ValueError if a field is above another one; with `apart` if it is not below."""
    least, most = getattr(settings, low), getattr(settings, high)
    if least > most or (apart and least == most):
        raise ValueError(f"{low}: {least!r} is not below {high}, {most!r}")


#: The longest step of time, and that of a call that gives none.
MAX_SECONDS: Final = 86400.0
DEFAULT_SECONDS: Final = 1 / 60

#: Name to exposure, for ``exposure=vkbloom.exposures[name]``, or ``exposure=name``.
#: ``docs/exposure.md`` lists what they are, with their sources.
exposures: Final[Named[Exposure]] = NAMED_EXPOSURES


def check_exposure(exposure: object) -> Exposure:
    """Return the exposure, or that of a preset; raise TypeError or ValueError for what is none."""
    return check_named("exposure", exposure, Exposure, exposures)


def check_seconds(name: str, seconds: float | None) -> float:
    """Return a step of time; raise TypeError or ValueError. None: `DEFAULT_SECONDS`."""
    return DEFAULT_SECONDS if seconds is None else check_number(name, seconds, 0, MAX_SECONDS)
