"""Bloom of an image at 4K on a GPU: times on the device, and until Python has the array."""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.image import ALLOWED, SETTINGS, full_kernel
from benchmarks.inputs import COUNT, THRESHOLD, pictures
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, Table, agreement, side_by_side
from benchmarks.timing import Contender, Times, alternate, alternate_seconds, device_clock

__all__ = ["run"]

SIZE: Final = (3840, 2160)
ROUNDS: Final = 25
OURS: Final = "vkbloom"
FRAGMENT: Final = "vkbloom, the source's fragment variant"
FUSED: Final = "a CUDA kernel of our own"
COPY: Final = "plain copy on the device"
TRANSFER: Final = "bare transfer into pinned memory"
IN_HANDS: Final = "vkbloom, an unchanged half-float frame as an array"

#: Peer, wanted ratio, whether at most. At least: theirs / ours; at most: ours / theirs. The two
#: peers with several steps count with the blur alone, against our complete bloom.
_GOALS: Final = (
    (FRAGMENT, 50.0, False),
    ("cupyx correlate1d twice, blur alone", 4.0, False),
    ("PyTorch conv2d, blur alone", 9.0, False),
    (FUSED, 1.6, True),
)


def run(plan: Plan) -> Section:
    """Time the bloom of a half-float image on the device, and the transfer back."""
    size = plan.size(*SIZE)
    section = Section("image-gpu", f"On the GPU: {size[0]} x {size[1]}, float16 RGBA")
    with ExitStack() as stack:
        ours = stack.enter_context(plan.renderer())
        if device_clock(ours.info) is None:
            section.missing.append(f"all of it: {ours.info.name} is no GPU")
            return section
        source = stack.enter_context(plan.renderer("fragment"))
        section.about += [
            "Times on the device: for vkbloom the sum of the timestamps of its passes, for the "
            "others CUDA events. All do the complete bloom (hard threshold, nine taps in both "
            "directions, sum), except rows with `blur alone`. vkbloom gets another image in "
            "each round. The images of the others stay on the device.",
            "The array in Python's hands: a half-float frame (`scene` of deferred shading) that "
            "has not changed, so that the call consists of submission, transfer and the array. "
            "Calls of `apply` first upload another image or, for the same image, compare it "
            "with the image on the device.",
        ]
        images = pictures(size, np.float16)
        _on_device(plan, section, ours, source, images)
        _in_hands(plan, section, ours, images)
    return section


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

    theirs = peers.gather(("CuPy", "PyTorch"), make, section.missing)
    picture = _bloom(ours, images[0])["final"]
    allowed, reason = ALLOWED["float16"]
    blurred = {FRAGMENT: _bloom(source, images[0])["final"]}
    for name, (call, _, fetch) in theirs.items():
        if not name.endswith("alone") and name != COPY:
            blurred[name] = fetch(call(0))
    for name, other in blurred.items():
        section.agreements.append(agreement(name, picture, other, allowed, reason))
    wrong = {found.what for found in section.agreements if not found.agrees}
    contenders = [
        Contender(
            name,
            lambda turn, renderer=renderer: _bloom(renderer, images[turn % COUNT]),  # type: ignore[misc]
            device_clock(ours.info),
        )
        for name, renderer in ((OURS, ours), (FRAGMENT, source))
    ]
    contenders += [Contender(name, call, seconds) for name, (call, seconds, _) in theirs.items()]
    contenders = [each for each in contenders if each.name not in wrong]
    times = alternate(contenders, plan.times(ROUNDS), warm_up=5)
    section.times["on the device"] = times
    section.tables.append(side_by_side("On the device", times, OURS))
    for name, wanted, at_most in _GOALS:
        if name in times:
            pair = (OURS, name) if at_most else (name, OURS)
            ratio = times[pair[0]].over(times[pair[1]]).value
            section.goals.append(
                Goal(f"4K on the GPU: {pair[0]} / {pair[1]}", ratio, wanted, at_most)
            )
    if COPY in times:
        # The bloom reads and writes as many bytes as the copy.
        share = times[COPY].over(times[OURS]).value
        section.goals.append(Goal("4K on the GPU: share of the copy's bandwidth", share, 0.3))
        rows = tuple(
            (name, f"{2 * images[0].nbytes / measured.median / 1e9:.0f}")
            for name, measured in times.items()
            if name in (COPY, OURS, FUSED)
        )
        section.tables.append(Table("Image read once and written once", ("", "GB/s"), rows))


def _bloom(renderer: vkbloom.Renderer, image: NDArray[Any]) -> vkbloom.Frames:
    return renderer.apply(image, SETTINGS, attachments=("final",))


def _in_hands(
    plan: Plan, section: Section, ours: vkbloom.Renderer, images: list[NDArray[Any]]
) -> None:
    """Time the readback into an array, against the bare transfer of as many bytes."""
    height, width = images[0].shape[:2]
    theirs = peers.gather(("CuPy",), lambda peer: peer.transfer_to_host(images[0]), section.missing)
    scene = vkbloom.Scene.ufo()

    def wall(work: Any) -> Any:
        def once(turn: int) -> float:
            start = time.perf_counter()
            result = work(turn)
            duration = time.perf_counter() - start
            del result
            return duration

        return once

    def frame(_: int) -> vkbloom.Frames:
        return ours.render(
            scene, SETTINGS, (width, height), shading="deferred", attachments=("scene",)
        )

    def other_strength(turn: int) -> vkbloom.Frames:
        settings = SETTINGS.replace(blur_strength=1.0 + 0.01 * turn)
        return ours.apply(images[0], settings, attachments=("final",))

    rounds = plan.times(ROUNDS)
    frame(0)
    times: dict[str, Times] = alternate_seconds(
        {IN_HANDS: wall(frame), **{name: call for name, (call, _, _) in theirs.items()}},
        rounds,
        warm_up=3,
    )
    for name, work in (
        ("apply, same image, other strength", other_strength),
        ("apply, another image", lambda turn: _bloom(ours, images[turn % COUNT])),
    ):
        times |= alternate_seconds({name: wall(work)}, rounds, warm_up=3)
    section.times["in Python's hands"] = times
    caption = f"In Python's hands, {images[0].nbytes / 1e6:.0f} MB, by the wall clock"
    section.tables.append(side_by_side(caption, times, IN_HANDS))
    if TRANSFER in times:
        ratio = times[IN_HANDS].over(times[TRANSFER]).value
        section.goals.append(
            Goal("the array in Python's hands / bare transfer", ratio, 1.4, at_most=True)
        )
