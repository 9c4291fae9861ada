"""Bloom of an image at 4K on a GPU: times on the device.

Times on the device: for vkbloom the sum of the timestamps of its passes, for the others CUDA
events. All do the complete bloom (hard threshold, nine taps in both directions, sum), except rows
with `blur alone`. vkbloom gets another image in each round. The images of the others stay on the
device.
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
from benchmarks.results import Section
from benchmarks.timing import Contender, device_clock

__all__ = ["run"]

SIZE: Final = (3840, 2160)
ROUNDS: Final = 25
FUSED: Final = "a CUDA kernel of our own"

#: Peer, wanted ratio, whether at most. At least: theirs / ours; at most: ours / theirs. The two
#: peers with several steps count with the blur alone, against our complete bloom.
_GOALS: Final = (
    (FRAGMENT, 50.0, False),
    ("cupyx correlate1d twice, blur alone", 4.0, False),
    ("PyTorch conv2d, blur alone", 9.0, False),
    (FUSED, 1.6, True),
)


def run(plan: Plan, section: Section) -> None:
    """Time the bloom of a half-float image on the device."""
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

    theirs: dict[str, peers.GpuWork] = peers.gather(
        ("CuPy", "PyTorch", "CV-CUDA"), make, section.missing
    )
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
