"""Convolution with large kernels on a GPU, half-float RGBA in and out, against torch.fft.

Times on the device: for vkbloom the timestamps of its passes, for torch CUDA events. The complete
bloom is a hard threshold, the convolution in single floats and the sum; alone are the transforms
and the product, from half floats to half floats. All keep the kernel's spectrum. The images of
torch stay on the device.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.convolution import ALLOWED, kernel_sizes, placed, settings_of
from benchmarks.inputs import COUNT, THRESHOLD, pictures
from benchmarks.ours import OURS
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, Table, agreement, side_by_side
from benchmarks.timing import Contender, alternate, device_clock

__all__ = ["run"]

ROUNDS: Final = 25
OURS_ALONE: Final = "vkbloom, convolution alone"
STAGES: Final = "vkbloom, stage by stage"
TORCH: Final = "torch.fft"
TORCH_ALONE: Final = "torch.fft, convolution alone"
#: The passes of the convolution itself, by the names of their times.
PASSES: Final = ("spectrum", "bloom")


def run(plan: Plan, section: Section) -> None:
    """Time 4K with a kernel of 1024 x 1024 and of full size, and 1080p of full size."""
    section.title = "Convolution on the GPU, float16 RGBA"
    with ExitStack() as stack:
        ours = stack.enter_context(plan.renderer())
        clock = device_clock(ours.info)
        if clock is None:
            section.missing.append(f"all of it: {ours.info.name} is no GPU")
            return
        stages = stack.enter_context(plan.renderer("fragment"))
        for size in (plan.size(3840, 2160), plan.size(1920, 1080)):
            images = pictures(size, np.float16)
            kernels = kernel_sizes(size, 1024 if size[0] > 1920 else 256)
            for name, kernel_size in kernels.items():
                group = f"{size[0]} x {size[1]}, {name}"
                plan.tell(f"convolution-gpu: {group}")
                work = _Work(group, settings_of(kernel_size), images)
                _time_one(plan, section, work, (ours, stages))


class _Work(NamedTuple):
    """What all do."""

    group: str
    settings: vkbloom.Convolution
    images: list[NDArray[Any]]


def _time_one(
    plan: Plan,
    section: Section,
    work: _Work,
    renderers: tuple[vkbloom.Renderer, vkbloom.Renderer],
) -> None:
    group, settings, images = work
    height, width = images[0].shape[:2]

    def make(peer: Any) -> dict[str, Any]:
        found: dict[str, Any] = peer.gpu_convolution(
            images[0], *placed(settings, (width, height)), THRESHOLD
        )
        return found

    theirs = peers.gather(("PyTorch",), make, section.missing)

    # Each call of a renderer has another image than the call before, or no pass would run.
    def apply(
        renderer: vkbloom.Renderer, name: str, first: int = 0
    ) -> Callable[[int], vkbloom.Frames]:
        return lambda turn: renderer.apply(
            images[(2 * turn + first) % COUNT], settings, framebuffers=(name,)
        )

    ours, stages = renderers
    calls = {
        OURS: (apply(ours, "final"), device_clock(ours.info)),
        OURS_ALONE: (
            apply(ours, "bloom", 1),
            lambda frames: sum(frames.timings.get(name, 0.0) for name in PASSES),
        ),
        STAGES: (apply(stages, "final"), device_clock(stages.info)),
    }
    pictures_made = {STAGES: (apply(ours, "final")(0)["final"], apply(stages, "final")(0)["final"])}
    alone = apply(ours, "bloom")(0)["bloom"]
    for name, (call, seconds, fetch) in theirs.items():
        calls[name] = call, seconds
        if name != peers.COPY:
            expected = alone if name == TORCH_ALONE else pictures_made[STAGES][0]
            pictures_made[name] = expected, fetch(call(0))
    for name, (expected, made) in pictures_made.items():
        found = agreement(f"{group}: {name}", expected, made, *ALLOWED["float16"])
        section.agreements.append(found)
        if not found.agrees:
            del calls[name]
    times = alternate(
        [Contender(name, call, seconds) for name, (call, seconds) in calls.items()],
        plan.times(ROUNDS),
        warm_up=5,
    )
    section.times[group] = times
    section.tables.append(side_by_side(group, times, OURS))
    ours.apply(images[1], settings, framebuffers=("final",))
    passes = apply(ours, "final")(0).timings
    section.tables.append(
        Table(
            f"{group}: passes",
            ("", "ms"),
            tuple((name, f"{1e3 * seconds:.3f}") for name, seconds in passes.items()),
        )
    )
    for mine, other in ((OURS, TORCH), (OURS_ALONE, TORCH_ALONE)):
        if other in times:
            ratio = times[mine].over(times[other]).value
            section.goals.append(Goal(f"{group}: {mine} / {other}", ratio, 1.0, at_most=True))
    if peers.COPY in times:
        section.tables.append(
            Table(
                f"{group}: image read once and written once",
                ("", "GB/s", "share of the copy"),
                tuple(
                    (
                        name,
                        f"{2 * images[0].nbytes / times[name].median / 1e9:.0f}",
                        f"{times[peers.COPY].median / times[name].median:.3f}",
                    )
                    for name in (peers.COPY, OURS, OURS_ALONE, TORCH, TORCH_ALONE)
                    if name in times
                ),
            )
        )
