"""Mutated copies of valid files, deterministic for a seed; used without atheris."""

from __future__ import annotations

import random
from collections.abc import Iterator

#: Values that break lengths, counts and offsets.
NUMBERS = (0, 1, 3, 127, 255, 256, 32767, 65535, 2**24, 2**31 - 1, 2**31, 2**32 - 1)
WORDS = (
    *(b"-1", b"1e400", b"null", b"[]", b"{}", b'"../x"', b"true", b"99999999999", b"NaN", b""),
    # Deeper than a recursive reader can handle.
    b"[" * 5000,
)


def mutate(data: bytes, dice: random.Random) -> bytes:
    """Return the bytes with a few mutations."""
    changed = bytearray(data)
    for _ in range(dice.choice((1, 1, 2, 4))):
        place = dice.randrange(len(changed) + 1)
        match dice.randrange(7):
            case 0 if place < len(changed):
                changed[place] ^= 1 << dice.randrange(8)
            case 1:
                width = dice.choice((1, 2, 4))
                number = dice.choice(NUMBERS) % 256**width
                changed[place : place + width] = number.to_bytes(
                    width, dice.choice(("little", "big"))
                )
            case 2:
                del changed[place:]
            case 3:
                del changed[place : place + dice.randrange(1, 9)]
            case 4:
                changed[place:place] = bytes(
                    dice.randrange(256) for _ in range(dice.randrange(1, 9))
                )
            case 5:
                # A number or word in a text.
                end = place
                while end < len(changed) and chr(changed[end]).isalnum():
                    end += 1
                changed[place:end] = dice.choice(WORDS)
            case _:
                start = dice.randrange(len(changed) + 1)
                changed[place:place] = changed[start : start + dice.randrange(1, 33)]
    return bytes(changed)


def inputs(seeds: list[bytes], number: int) -> Iterator[bytes]:
    """Yield mutated copies of the seeds, and of these copies, without end."""
    dice = random.Random(number)
    pool = list(seeds)
    while True:
        data = mutate(dice.choice(pool), dice)
        if len(data) < 1 << 16 and dice.random() < 0.05:
            pool[len(seeds) :] = [*pool[len(seeds) :], data][-64:]
        yield data
