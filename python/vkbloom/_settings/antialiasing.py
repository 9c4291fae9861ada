"""The base class of temporal anti-aliasing, and the mapping of its presets."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final, Literal

from vkbloom._numbers import check_floats, check_number
from vkbloom._public import public
from vkbloom._settings.fields import value_field
from vkbloom._settings.named import Named, check_named
from vkbloom._settings.records import Record
from vkbloom._settings.registry import ANTIALIASINGS, NAMED_ANTIALIASINGS

#: Whether frames are resolved before the bloom is made of them, or with their bloom.
Order = Literal["before", "after"]
#: The offsets of a pixel and its neighbours, by rows.
NEIGHBOURS: Final = tuple((x, y) for y in (-1, 0, 1) for x in (-1, 0, 1))


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Antialiasing(Record):
    """Base class of temporal anti-aliasing; use an engine's class, such as `BevyAntialiasing`.

    They are frozen and hashable. Each frame is mixed with the history, which is where the frame's
    light was in the frame before. `vkbloom.antialiasing` has those of engines by name.

    Parameters
    ----------
    order : {"before", "after"}
        The bloom is made of resolved frames, as all engines do; or frames are resolved with their
        bloom.
    """

    _class_key: ClassVar[str] = "engine"
    _subject: ClassVar[str] = "antialiasing"
    _example: ClassVar[str] = "that of an engine, such as BevyAntialiasing"
    engine: ClassVar[str]
    #: How many frames the offsets of the engine's camera repeat after.
    phases: ClassVar[int] = 8

    order: Order = value_field("before", kind="choice")

    def offset(self, frame: int) -> tuple[float, float]:
        """Return the offset of the engine's camera in a frame.

        Parameters
        ----------
        frame : int
            Number of the frame, from 0 on.

        Returns
        -------
        (float, float)
            Pixels to the right and down, -0.5 to 0.5: the Halton sequence of 2 and 3, from its
            first member on, minus 1/2.
        """
        number = frame % self.phases + 1
        return radical_inverse(2, number) - 0.5, radical_inverse(3, number) - 0.5

    @property
    def _core_engine(self) -> str:
        """The name of the engine in `_core.ANTIALIASINGS`."""
        return self.engine

    def _core_numbers_of_frame(self) -> dict[str, float]:
        """Return the numbers of `_core.ANTIALIASING_NUMBERS`; others are 0."""
        raise NotImplementedError

    def filter_weights(self) -> Sequence[Sequence[float]]:
        """Return the weights of `NEIGHBOURS` for each phase, if the engine filters the frame."""
        return ()

    @classmethod
    def _classes(cls) -> Mapping[str, type[Antialiasing]]:
        return ANTIALIASINGS


def radical_inverse(base: int, number: int) -> float:
    """Return the digits of a number, mirrored at the point: a member of a Halton sequence."""
    value, digit = 0.0, 1.0
    while number:
        digit /= base
        number, rest = divmod(number, base)
        value += rest * digit
    return value


def read_jitter(value: Any) -> tuple[float, float]:
    """Return the offset of a camera in pixels, two numbers of -1 to 1."""
    numbers = check_floats("jitter", value)
    if len(numbers) != 2:
        raise ValueError(f"jitter: {numbers!r} is not (x, y)")
    for number in numbers:
        check_number("jitter", number, -1.0, 1.0)
    return numbers[0], numbers[1]


def gaussian_weights(
    offsets: Sequence[tuple[float, float]], falloff: float, scale: float
) -> list[list[float]]:
    """Return each neighbour's share of exp(-falloff d^2); d begins at `scale` times an offset."""
    rows = []
    for x, y in offsets:
        row = [
            math.exp(-falloff * ((dx - scale * x) ** 2 + (dy - scale * y) ** 2))
            for dx, dy in NEIGHBOURS
        ]
        rows.append([weight / math.fsum(row) for weight in row])
    return rows


#: Name to temporal anti-aliasing, for ``taa=vkbloom.antialiasing[name]``, or ``taa=name``.
#: ``docs/exposure.md`` lists what they are, with their sources.
antialiasing: Final[Named[Antialiasing]] = NAMED_ANTIALIASINGS


def check_antialiasing(taa: object) -> Antialiasing:
    """Return the anti-aliasing, or that of a preset; raise TypeError or ValueError for others."""
    return check_named("taa", taa, Antialiasing, antialiasing)


def check_use(taa: object, **geometry: object) -> None:
    """Raise ValueError for a motion or a depth that nothing reads."""
    for name, given in geometry.items():
        if taa is None and given is not None:
            raise ValueError(f"{name}: only temporal anti-aliasing reads it; give taa=, too")
