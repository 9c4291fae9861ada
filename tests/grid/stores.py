"""A grid of images in a store, and the content of the store."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import vkbloom
from tests.images import noise
from vkbloom import Frames, Separable
from vkbloom._grid.keys import Keys, open_keys


class Stop(Exception):
    """The end of a process, as far as a test can imitate it."""


class Reduced:
    """The points that `mean` was given, and after how many it ends the process; None: never."""

    count = 0
    last: int | None = None


def mean(frames: Frames) -> float:
    if Reduced.count == Reduced.last:
        raise Stop
    Reduced.count += 1
    return float(frames["final"].mean())


def colour(frames: Frames) -> Any:
    return frames["bloom"].mean(axis=(0, 1))[:2]


AXES: dict[str, list[Any]] = {
    "exposure": [0.0, 1.0, 2.0],
    "threshold": [None, 0.5],
    "blur_scale": [0.5, 1.0, 1.5, 2.0],
}
CHUNKS = {"exposure": 3, "blur_scale": 2}
REDUCE = {"mean": mean, "colour": colour}
POINTS = 3 * 2 * 4


def source() -> Any:
    return noise(16, 21, 3, dtype="float32")


def make(store: Any, **changes: Any) -> Any:
    arguments: dict[str, Any] = {
        "chunks": CHUNKS,
        "reduce": REDUCE,
        "framebuffers": ("final", "bloom"),
        **changes,
    }
    settings = arguments.pop("settings", Separable())
    axes = arguments.pop("axes", AXES)
    return vkbloom.grid(arguments.pop("source", source()), settings, axes, store=store, **arguments)


def keys_of(store: Any) -> Keys:
    return open_keys(store)


def contents(store: Any) -> dict[str, bytes | None]:
    """Return the bytes of each key; of a folder, of each file below it by its path in it."""
    if not isinstance(store, Path):
        keys = keys_of(store)
        return {key: keys.read(key) for key in keys.list_keys()}
    return {
        str(path.relative_to(store)): path.read_bytes()
        for path in store.rglob("*")
        if path.is_file()
    }
