"""Calls on a GPU until Python has the array, against the bare transfers of as many bytes.

Half-float RGBA, by the wall clock. An unchanged frame is the `scene` of deferred shading at the
same time, so that the call consists of submission, transfer and the array. A resident image is one
of `Renderer.upload`; calls with another strength run the blur again. Calls with another image
upload it. The bare transfers, by CUDA, have pinned memory that is allocated once. Each kind of call
takes turns with them alone, as in a program that makes such calls.
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
ROUNDS: Final = 40
#: A GPU that was idle raises its clocks meanwhile.
WARM_UP: Final = 100
READBACK: Final = "bare readback into pinned memory"
BOTH: Final = "both bare transfers"
FRAME: Final = "an unchanged frame"
RESIDENT: Final = "a resident image, another strength"
SAME: Final = "the same array, another strength"
NEW: Final = "another array"
#: The most times as long as the bare transfers.
GOALS: Final = {FRAME: 1.4, RESIDENT: 1.25, NEW: 1.5}


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

    kinds = {
        FRAME: (READBACK, frame),
        RESIDENT: (READBACK, lambda turn: change(resident, turn)),
        SAME: (READBACK, lambda turn: change(images[0], turn)),
        NEW: (BOTH, prepare_call(renderer, images, SETTINGS)),
    }
    for kind, (least, call) in kinds.items():
        transfer = [one for name, one in bare.items() if name == least]
        times = contest(
            plan,
            section,
            f"{group}: {kind}",
            [*transfer, Contender(kind, call)],
            ROUNDS,
            pictures=[(kind, change(images[0], 1)["final"], change(resident, 1)["final"])]
            if kind == RESIDENT
            else (),
            caption=group,
            ours=least,
            warm_up=WARM_UP,
        )
        if kind in GOALS:
            ratios(section, group, times, (kind, least, GOALS[kind], True))
