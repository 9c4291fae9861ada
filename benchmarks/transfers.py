"""Calls on a GPU until Python has the array, against the bare transfers of as many bytes.

Half-float RGBA, by the wall clock. An unchanged frame is the `scene` of deferred shading at the
same time, so that the call consists of submission, transfer and the array. A resident image is one
of `Renderer.upload`; calls with another strength run the blur again. Calls with another image
upload it. The bare transfers, by CUDA, have pinned memory that is allocated once.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.image import SETTINGS
from benchmarks.inputs import pictures
from benchmarks.ours import contest, prepare_call, ratios
from benchmarks.plan import Plan
from benchmarks.results import Section
from benchmarks.timing import Contender, device_clock

__all__ = ["run"]

SIZES: Final = ((3840, 2160), (1920, 1080))
ROUNDS: Final = 25
READBACK: Final = "bare readback into pinned memory"
BOTH: Final = "both bare transfers"
FRAME: Final = "an unchanged frame"
RESIDENT: Final = "a resident image, another strength"
SAME: Final = "the same array, another strength"
NEW: Final = "another array"


def run(plan: Plan, section: Section) -> None:
    """Time calls that need a readback alone, then those that need both directions."""
    section.title = "Transfers, float16 RGBA"
    with plan.renderer() as renderer:
        if device_clock(renderer.info) is None:
            section.missing.append(f"all of it: {renderer.info.name} is no GPU")
            return
        for size in SIZES:
            _time_one(plan, section, renderer, pictures(plan.size(*size), np.float16))


def _time_one(
    plan: Plan, section: Section, renderer: vkbloom.Renderer, images: list[NDArray[Any]]
) -> None:
    height, width = images[0].shape[:2]
    group = f"{width} x {height}, {images[0].nbytes / 1e6:.0f} MB"
    plan.tell(f"transfers: {group}")
    theirs = peers.gather(("CuPy",), lambda peer: peer.transfers(images[0]), section.missing)
    bare = {name: Contender(name, call) for name, (call, _, _) in theirs.items()}
    scene = vkbloom.Scene.ufo()
    resident = renderer.upload(images[0])
    # Made before the calls, so that only these are timed.
    strengths = [SETTINGS.replace(blur_strength=1.0 + 0.01 * turn) for turn in range(7)]

    def change(source: Any, turn: int) -> vkbloom.Frames:
        return renderer.apply(source, strengths[turn % 7], framebuffers=("final",))

    def frame(_: int) -> vkbloom.Frames:
        return renderer.render(
            scene, SETTINGS, (width, height), shading="deferred", framebuffers=("scene",)
        )

    times = contest(
        plan,
        section,
        group,
        [
            *(one for name, one in bare.items() if name == READBACK),
            Contender(FRAME, frame),
            Contender(RESIDENT, lambda turn: change(resident, turn)),
            Contender(SAME, lambda turn: change(images[0], turn)),
        ],
        ROUNDS,
        pictures=[(RESIDENT, change(images[0], 1)["final"], change(resident, 1)["final"])],
        ours=READBACK,
        warm_up=3,
    )
    # Its own turns: a call with the same array would otherwise find another image on the device.
    both = contest(
        plan,
        section,
        f"{group}, another image",
        [
            *(one for name, one in bare.items() if name == BOTH),
            Contender(NEW, prepare_call(renderer, images, SETTINGS)),
        ],
        ROUNDS,
        ours=BOTH,
        warm_up=3,
    )
    ratios(section, group, times, (FRAME, READBACK, 1.4, True), (RESIDENT, READBACK, 1.25, True))
    ratios(section, group, both, (NEW, BOTH, 1.5, True))
