"""What stages in time hand on between the image files of a call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from vkbloom._io.numbered_files import as_frames
from vkbloom._renderer.frames import Frames

#: A file to read, and the file to write.
Pair: TypeAlias = tuple[str, str]


def order_in_time(work: Sequence[Pair]) -> tuple[list[Pair], list[int]]:
    """Return the pairs in the order of the numbers in their names, and the number of each.

    Files without numbers stay in their order, and are counted.
    """
    ordered = as_frames([(source, None) for source, _ in work])
    numbers = [number for _, number in ordered if number is not None]
    if len(numbers) < len(work):
        return [*work], [*range(len(work))]
    targets = dict(work)
    return [(source, targets[source]) for source, _ in ordered], numbers


class TimeSteps:
    """The stages in time of images one after the other.

    Each continues the one before that did not fail. Numbers that are missing are time.

    - `stages`: Keywords of a call; `dt` and `state` are those of the first image.
    - `numbers`: When each file that is written is, in frames.
    - `rate`: Frames per second.
    """

    def __init__(self, stages: Mapping[str, Any], numbers: Mapping[str, int], rate: float) -> None:
        self._stages, self._numbers, self._rate = dict(stages), numbers, rate
        self._last: int | None = None

    def of(self, target: str) -> dict[str, Any]:
        """Return the keywords of the call for a file that is written."""
        if not self._stages:
            return {}
        if self._last is None:
            return {"dt": 1 / self._rate, **self._stages}
        return {**self._stages, "dt": (self._numbers[target] - self._last) / self._rate}

    def advance(self, target: str, frames: Frames) -> None:
        """Continue from the frames of a file."""
        if self._stages:
            self._stages["state"] = frames.state
            self._last = self._numbers[target]
