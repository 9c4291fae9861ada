"""What the usual run takes a part of. VKBLOOM_EXHAUSTIVE=1 (make exhaustive) takes all of it."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final, TypeVar

if TYPE_CHECKING:
    import pytest

#: Whether this run takes everything.
EXHAUSTIVE: Final = os.environ.get("VKBLOOM_EXHAUSTIVE", "0") not in ("", "0")

T = TypeVar("T")


def witness(reason: str) -> pytest.MarkDecorator:
    """Mark a test that only an exhaustive run takes; the reason names what states its main fact."""
    # Programs of tests import this module, without pytest, which takes as long as NumPy.
    import pytest

    return pytest.mark.skipif(not EXHAUSTIVE, reason=f"left to make exhaustive: {reason}")


def some(cases: Iterable[T], count: int) -> list[T]:
    """Return `count` cases, the first, the last and evenly between; all in an exhaustive run."""
    every = list(cases)
    if EXHAUSTIVE or count >= len(every):
        return every
    if count == 1:
        return every[:1]
    return [every[round(i * (len(every) - 1) / (count - 1))] for i in range(count)]


def examples(usual: int) -> int:
    """Return the number of examples of a hypothesis test; eight times as many when exhaustive."""
    return 8 * usual if EXHAUSTIVE else usual


def by_turns(*columns: Iterable[Any], turns: Iterable[Any]) -> list[tuple[Any, ...]]:
    """Return the product of the columns; each row ends with one of `turns`.

    Every two values of two columns, or of a column and of `turns`, meet in some row. The product
    with all turns finds little more, and takes as many times as long as there are turns: an
    exhaustive run has it.
    """
    last = list(turns)
    if EXHAUSTIVE:
        return list(itertools.product(*columns, last))
    rows = itertools.product(*(enumerate(column) for column in columns))
    return [
        (*(value for _, value in row), last[sum(index for index, _ in row) % len(last)])
        for row in rows
    ]
