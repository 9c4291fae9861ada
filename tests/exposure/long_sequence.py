"""A sequence with exposure, TAA and bloom; prints its memory and digests of its frames as JSON.

Arguments: "whole", a folder, width, height, how many frames there are, after how many the memory is
read, and the numbers of frames before which the state is written to the folder. Or "rest", the
folder, width, height and one of these numbers, from which another process continues.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import pickle
import resource
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom

#: Frames whose bits are compared after a cut.
COMPARED: Final = 20


def resident_bytes() -> int:
    """Return the memory of this process that is in use now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


class Moving(Sequence[NDArray[Any]]):
    """Light that moves and changes, with its motion and depth; images are made when read."""

    def __init__(self, width: int, height: int, count: int) -> None:
        self._length = count
        random = np.random.default_rng(0)
        noise = random.random((height, width, 3)) ** 8 * 8
        self.picture = noise.astype(np.float16)
        self.motion = np.full((height, width, 2), 3 / width, np.float32)
        self.motion[..., 1] = 0
        self.depth = random.random((height, width)).astype(np.float32)

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, number: Any) -> Any:
        if number >= self._length:
            raise IndexError(number)
        return np.roll(self.picture, 3 * number, axis=1) * np.float16(2.0 ** (number % 37 / 9 - 2))

    def depths(self, first: int) -> Iterator[NDArray[Any]]:
        for number in range(first, self._length):
            yield np.roll(self.depth, 3 * number, axis=1)


def run(source: Moving, first: int = 0, state: Any = None) -> vkbloom.Sequence:
    stages: Any = {"exposure": "hdrp", "taa": "hdrp_high"}
    stages |= {"motion": itertools.repeat(source.motion), "depth": source.depths(first)}
    how: Any = {"fps": 60, "framebuffers": "final", "start": first, "state": state}
    return vkbloom.sequence(source, "bevy_natural", **how, **stages)


def digest(frames: vkbloom.Frames) -> str:
    return hashlib.sha256(np.ascontiguousarray(frames["final"]).data).hexdigest()


def whole(source: Moving, every: int, cuts: list[int], folder: Path) -> dict[str, Any]:
    """Run all; keep the state before each cut, and the digests of some frames after it."""
    wanted = {cut + number for cut in cuts for number in range(COMPARED)}
    memory: dict[int, int] = {}
    digests: dict[int, str] = {}
    begun = time.process_time()
    for number, frames in enumerate(run(source)):
        if number in wanted:
            digests[number] = digest(frames)
        if number + 1 in cuts:
            (folder / f"{number + 1}.state").write_bytes(pickle.dumps(frames.state))
        if (number + 1) % every == 0:
            memory[number + 1] = resident_bytes()
            print(number + 1, memory[number + 1], file=sys.stderr, flush=True)
    seconds = time.process_time() - begun
    return {"memory": memory, "digests": digests, "seconds": seconds}


def rest(source: Moving, folder: Path) -> dict[str, Any]:
    """Continue at a cut, and return the digests of some frames after it."""
    first = len(source) - COMPARED
    state = pickle.loads((folder / f"{first}.state").read_bytes())
    frames = run(source, first, state)
    return {"digests": {number: digest(one) for number, one in enumerate(frames, first)}}


def main() -> None:
    kind, folder, *numbers = sys.argv[1:]
    width, height, count, *more = map(int, numbers)
    if kind == "whole":
        every, *cuts = more
        result = whole(Moving(width, height, count), every, cuts, Path(folder))
    else:
        result = rest(Moving(width, height, count + COMPARED), Path(folder))
    print(json.dumps(result))


if __name__ == "__main__":
    main()
