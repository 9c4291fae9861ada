"""Eight threads and one renderer: rendering, reading, closing, in random order, exact pictures.

Two rounds; with VKBLOOM_THREAD_SECONDS as many as begin in so many seconds.
"""

from __future__ import annotations

import os
import random
import threading
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from tests.images import picture
from vkbloom import DualKawase, Pyramid, Renderer, Scene, Separable, Settings

THREADS = 8
ROUNDS = 2
SECONDS = float(os.environ.get("VKBLOOM_THREAD_SECONDS", "0"))
CALLS = 6  # of each thread in each round
# The arrays of the last one are in the renderer's pages.
SIZES = ((24, 16), (17, 31), (300, 290))
Key = tuple[str, int, tuple[int, int]]
SETTINGS: tuple[Settings, ...] = (
    Separable(),
    Separable(blur_strength=0.4, bloom_size=(9, 5)),
    Pyramid(levels=3, exposure=0.5),
    DualKawase(levels=2),
)


def one(renderer: Renderer, scene: Scene, kind: str, which: int, size: tuple[int, int]) -> Any:
    """Return what a call of that kind gives: arrays in the order of the call."""
    settings = SETTINGS[which]
    if kind == "render":
        return list(renderer.render(scene, settings, size).values())
    if kind == "apply":
        return list(renderer.apply(picture(*size), settings).values())
    if kind == "out":
        out = np.zeros((size[1], size[0], 4), np.float32)
        renderer.apply(picture(*size), settings, framebuffers="final", out={"final": out})
        return [out]
    if kind == "left":
        # A sequence that is dropped half way: some of its submissions are still pending.
        return [next(iter(renderer.sweep(picture(*size), [settings] * 5)))["final"]]
    return [
        frames["final"]
        for frames in renderer.sweep(picture(*size), [settings, *SETTINGS], framebuffers="final")
    ]


KINDS = ("render", "apply", "out", "left", "many")


def play(right: Mapping[Key, Any], scene: Scene, seed: int, *, closing: bool) -> int:
    """Play one round; return the calls that were made.

    In a closing round one thread closes the renderer that the others use.
    """
    renderer = Renderer(validation=True)
    start = threading.Barrier(THREADS)

    def work(thread: int) -> int:
        dice = random.Random(seed * THREADS + thread)
        start.wait()
        for done in range(CALLS):
            key = (dice.choice(KINDS), dice.randrange(len(SETTINGS)), dice.choice(SIZES))
            if closing and thread == 0 and done == CALLS // 2:
                renderer.close()
            try:
                arrays = one(renderer, scene, *key)
            except ValueError:
                if not renderer.closed:
                    raise
                return done
            for array, expected in zip(arrays, right[key], strict=True):
                np.testing.assert_array_equal(array, expected)
        return CALLS

    with ThreadPoolExecutor(THREADS) as pool:
        calls = list(pool.map(work, range(THREADS)))
    renderer.close()
    if not closing:
        assert calls == [CALLS] * THREADS
    return sum(calls)


def test_eight_threads_in_random_order(scene: Scene, capsys: pytest.CaptureFixture[str]) -> None:
    with Renderer() as single:
        right = {
            (kind, which, size): one(single, scene, kind, which, size)
            for kind in KINDS
            for which in range(len(SETTINGS))
            for size in SIZES
        }
    begin = time.monotonic()
    calls = rounds = 0
    while rounds < ROUNDS or time.monotonic() - begin < SECONDS:
        calls += play(right, scene, rounds, closing=rounds % ROUNDS == ROUNDS - 1)
        rounds += 1
    if SECONDS:
        with capsys.disabled():
            print(f"\n{calls} calls in {rounds} rounds of {THREADS} threads, all exact")
