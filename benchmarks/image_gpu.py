"""Bloom of an image at 4K on a GPU: times on the device, and until Python has the array.

Times on the device: for vkbloom the sum of the timestamps of its passes, for the others CUDA
events. All do the complete bloom (hard threshold, nine taps in both directions, sum), except rows
with `blur alone`. vkbloom gets another image in each round. The images of the others stay on the
device.

The array in Python's hands: a half-float frame (`scene` of deferred shading) that has not changed,
so that the call consists of submission, transfer and the array. Calls of `apply` first upload
another image or, for the same image, compare it with the image on the device.
"""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.image import ALLOWED, SETTINGS, full_kernel
from benchmarks.inputs import THRESHOLD, pictures
from benchmarks.ours import FRAGMENT, OURS, contest, prepare_call, ratios
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, side_by_side
from benchmarks.timing import Contender, Times, alternate_seconds, device_clock, wall_clock

__all__ = ["run"]

SIZE: Final = (3840, 2160)
SMALLER: Final = (1920, 1080)
ROUNDS: Final = 25
WARM_UP: Final = 3
FUSED: Final = "a CUDA kernel of our own"
UPLOAD: Final = "bare upload from pinned memory"
READBACK: Final = "bare readback into pinned memory"
IN_HANDS: Final = "vkbloom, an unchanged half-float frame as an array"
RESIDENT: Final = "apply, resident image, other strength"
NEW: Final = "apply, another image"

#: Peer, wanted ratio, whether at most. At least: theirs / ours; at most: ours / theirs. The two
#: peers with several steps count with the blur alone, against our complete bloom.
_GOALS: Final = (
    (FRAGMENT, 50.0, False),
    ("cupyx correlate1d twice, blur alone", 4.0, False),
    ("PyTorch conv2d, blur alone", 9.0, False),
    (FUSED, 1.6, True),
)


def run(plan: Plan, section: Section) -> None:
    """Time the bloom of a half-float image on the device, and the transfer back."""
    size = plan.size(*SIZE)
    section.title = f"On the GPU: {size[0]} x {size[1]}, float16 RGBA"
    with ExitStack() as stack:
        ours = stack.enter_context(plan.renderer())
        if device_clock(ours.info) is None:
            section.missing.append(f"all of it: {ours.info.name} is no GPU")
            return
        source = stack.enter_context(plan.renderer("fragment"))
        images = pictures(size, np.float16)
        _on_device(plan, section, ours, source, images)
        for each in (images, pictures(plan.size(*SMALLER), np.float16)):
            _in_hands(plan, section, ours, each)


def _on_device(
    plan: Plan,
    section: Section,
    ours: vkbloom.Renderer,
    source: vkbloom.Renderer,
    images: list[NDArray[Any]],
) -> None:
    def make(peer: Any) -> dict[str, Any]:
        found: dict[str, Any] = peer.gpu_bloom(images[0], full_kernel(SETTINGS), THRESHOLD)
        if hasattr(peer, "gpu_copy"):
            found |= peer.gpu_copy(images[0])
        return found

    theirs: dict[str, peers.GpuWork] = peers.gather(("CuPy", "PyTorch"), make, section.missing)
    calls = {
        name: prepare_call(renderer, images, SETTINGS)
        for name, renderer in ((OURS, ours), (FRAGMENT, source))
    }
    picture = calls[OURS](0)["final"]
    made = [(FRAGMENT, picture, calls[FRAGMENT](0)["final"])]
    made += [
        (name, picture, fetch(call(0)))
        for name, (call, _, fetch) in theirs.items()
        if not name.endswith("alone") and name != peers.COPY
    ]
    clock = device_clock(ours.info)
    contenders = [Contender(name, call, clock) for name, call in calls.items()]
    contenders += [Contender(name, call, seconds) for name, (call, seconds, _) in theirs.items()]
    times = contest(
        plan,
        section,
        "4K on the GPU",
        contenders,
        ROUNDS,
        pictures=made,
        allowed=ALLOWED["float16"],
        warm_up=5,
    )
    goals = [
        (OURS, name, wanted, True) if at_most else (name, OURS, wanted, False)
        for name, wanted, at_most in _GOALS
    ]
    # The bloom reads and writes as many bytes as the copy.
    ratios(section, "4K on the GPU", times, *goals, (peers.COPY, OURS, 0.3, False))
    names = (peers.COPY, OURS, FUSED)
    section.tables += peers.bandwidths("4K on the GPU", times, images[0].nbytes, names)


def _in_hands(
    plan: Plan, section: Section, ours: vkbloom.Renderer, images: list[NDArray[Any]]
) -> None:
    """Time calls until Python has the array, against the bare transfers of as many bytes."""
    height, width = images[0].shape[:2]
    theirs = peers.gather(("CuPy",), lambda peer: peer.transfers(images[0]), section.missing)
    scene = vkbloom.Scene.ufo()
    handle = ours.upload(images[0])

    # Made before the calls, so that only these are timed.
    strengths = [
        SETTINGS.replace(blur_strength=1.0 + 0.01 * turn)
        for turn in range(plan.times(ROUNDS) + WARM_UP)
    ]

    def strength(source: Any, turn: int) -> vkbloom.Frames:
        return ours.apply(source, strengths[turn], framebuffers=("final",))

    def frame(_: int) -> vkbloom.Frames:
        return ours.render(
            scene, SETTINGS, (width, height), shading="deferred", framebuffers=("scene",)
        )

    calls = {
        IN_HANDS: wall_clock(frame),
        RESIDENT: wall_clock(lambda turn: strength(handle, turn)),
        "apply, the same array, other strength": wall_clock(lambda turn: strength(images[0], turn)),
    }
    # Its own loop: a call with the same array would otherwise find another image on the device.
    times = alternate_seconds(
        calls | {name: call for name, (call, _, _) in theirs.items()},
        plan.times(ROUNDS),
        warm_up=WARM_UP,
    )
    times |= alternate_seconds(
        {NEW: wall_clock(prepare_call(ours, images, SETTINGS))},
        plan.times(ROUNDS),
        warm_up=WARM_UP,
    )
    size = f"{width} x {height}"
    section.times[f"in Python's hands, {size}"] = times
    caption = f"In Python's hands, {size}, {images[0].nbytes / 1e6:.0f} MB, by the wall clock"
    section.tables.append(side_by_side(caption, times, IN_HANDS))
    if UPLOAD not in times:
        return
    both = Times(
        tuple(
            up + down
            for up, down in zip(times[UPLOAD].seconds, times[READBACK].seconds, strict=True)
        )
    )
    for name, limit, wanted in (
        (IN_HANDS, times[READBACK], 1.4),
        (RESIDENT, times[READBACK], 1.15),
        (NEW, both, 1.5),
    ):
        bare = "both bare transfers" if limit is both else "bare readback"
        section.goals.append(
            Goal(f"{size}: {name} / {bare}", times[name].over(limit).value, wanted, at_most=True)
        )
