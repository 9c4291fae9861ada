"""Parts of a grid, for job arrays: each process renders one, and none waits for another."""

from __future__ import annotations

from typing import Any, Final, TypeAlias

#: The number of a part, from 1, and the number of parts.
Part: TypeAlias = tuple[int, int]

WHOLE: Final[Part] = (1, 1)


def read_part(part: Any) -> Part:
    """Check a part: (i, n), or text such as "3/16"; None is the whole.

    i is 1 to n. 0 is the same as n, so that arrays that count from 0 have all parts, too.
    """
    if part is None:
        return WHOLE
    given = part
    if isinstance(part, str):
        words = part.split("/")
        if len(words) != 2 or not all(word.isascii() and word.isdecimal() for word in words):
            raise ValueError(f"part: {given!r} is not I/N, such as 3/16")
        part = tuple(map(int, words))
    if not isinstance(part, tuple | list) or len(part) != 2:
        raise TypeError(f"part: {given!r} is not a pair (i, n), such as (3, 16)")
    if any(isinstance(number, bool) or not hasattr(number, "__index__") for number in part):
        raise TypeError(f"part: {given!r} is not a pair of integers")
    number, count = (value.__index__() for value in part)
    if not 0 <= number <= count or count < 1:
        raise ValueError(f"part: {number} of {count} is not 1 to {max(count, 1)}")
    return number or count, count
