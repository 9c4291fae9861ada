"""What a law is: a test, the figures that it gives, their limits, and the reason to break it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from vkbloom.testing._subject import Subject

#: Limits of a law, by figure.
Limits: TypeAlias = Mapping[str, float]


@dataclass(frozen=True)
class Figure:
    """A number that a law gives.

    - `words`: What it is, for the docs.
    - `limit`: The largest that is allowed beyond the errors of values. Infinity: it is only shown.
    """

    words: str
    limit: float = math.inf


@dataclass(frozen=True, kw_only=True)
class Law:
    """A law of a bloom or an exposure, which the reports and the docs read.

    - `subject`: The class of what is tested: `Subject`, a bloom, or `Adaptation`, an exposure.
    - `test`: Takes the subject and the limits by figure; a limit of infinity leaves its figure out.
      Raises AssertionError if the law does not hold, and ValueError or TypeError if it cannot be
      tested.
    - `formula`: The law in words or as a formula.
    - `figures`: What the test gives, by name. A name in upper case stands for several figures.
    - `why`: Why a bloom that is no fault may break the law.
    - `explain`: Measures which reason it is, and returns words in place of `why`.
    - `applies`: Whether the law is tested where no laws are named.
    """

    name: str
    test: Callable[[Any, Limits], None]
    formula: str
    figures: Mapping[str, Figure]
    why: str
    explain: Callable[[Subject, str], str] | None = None
    applies: Callable[[Any], bool] = lambda _: True
    subject: type = Subject

    @property
    def sentence(self) -> str:
        """The formula as a sentence; a function keeps its letter."""
        first = self.formula[0] if self.formula[1] == "(" else self.formula[0].upper()
        return f"{first}{self.formula[1:]}."

    @property
    def limits(self) -> dict[str, float]:
        """The limits of the figures that have one."""
        return {
            name: figure.limit
            for name, figure in self.figures.items()
            if not math.isinf(figure.limit)
        }
