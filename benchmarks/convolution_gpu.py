"""Convolution with large kernels on a GPU, half-float RGBA, against torch.fft and VkFFT.

Times on the device: for vkbloom the timestamps of its passes, for the others CUDA events. The
complete bloom is a hard threshold, the convolution in single floats and the sum; alone are the
transforms and the product, from half floats to half floats. All keep the kernel's spectrum. The
images of the others stay on the device.
"""

from __future__ import annotations

import itertools
from contextlib import ExitStack
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.convolution import ALLOWED, kernel_sizes, place, settings_of
from benchmarks.inputs import THRESHOLD, pictures
from benchmarks.ours import OURS, contender, contest, ratios
from benchmarks.plan import Plan
from benchmarks.results import Section, Table
from benchmarks.timing import Contender, device_clock

__all__ = ["run"]

ROUNDS: Final = 25
OURS_ALONE: Final = "vkbloom, convolution alone"
STAGES: Final = "vkbloom, stage by stage"
TORCH: Final = "torch.fft"
VKFFT: Final = "VkFFT"
TORCH_ALONE: Final = "torch.fft, convolution alone"
#: The passes of the convolution itself, by the names of their times.
PASSES: Final = ("spectrum", "bloom")


def run(plan: Plan, section: Section) -> None:
    """Time 4K with a kernel of 1024 x 1024 and of full size, and 1080p of full size."""
    section.title = "Convolution on the GPU, float16 RGBA"
    with ExitStack() as stack:
        ours = stack.enter_context(plan.renderer())
        if device_clock(ours.info) is None:
            section.missing.append(f"all of it: {ours.info.name} is no GPU")
            return
        stages = stack.enter_context(plan.renderer("fragment"))
        for size in (plan.size(3840, 2160), plan.size(1920, 1080)):
            images = pictures(size, np.float16)
            kernels = kernel_sizes(size, 1024 if size[0] > 1920 else 256)
            for name, kernel_size in kernels.items():
                group = f"{size[0]} x {size[1]}, {name}"
                plan.tell(f"convolution-gpu: {group}")
                settings = settings_of(kernel_size)
                _time_one(plan, section, (group, settings), images, (ours, stages))


def _time_one(
    plan: Plan,
    section: Section,
    work: tuple[str, vkbloom.Convolution],
    images: list[NDArray[Any]],
    renderers: tuple[vkbloom.Renderer, vkbloom.Renderer],
) -> None:
    (group, settings), (height, width) = work, images[0].shape[:2]
    theirs: dict[str, peers.GpuWork] = peers.gather(
        ("PyTorch", "VkFFT"),
        lambda peer: peer.gpu_convolution(images[0], *place(settings, (width, height)), THRESHOLD),
        section.missing,
    )
    ours, stages = renderers
    feed = itertools.cycle(images)
    contenders = [
        contender(OURS, ours, feed, settings),
        Contender(
            OURS_ALONE,
            lambda _: ours.apply(next(feed), settings, framebuffers=("bloom",)),
            lambda frames: sum(frames.timings.get(name, 0.0) for name in PASSES),
        ),
        contender(STAGES, stages, itertools.cycle(images), settings),
    ]
    contenders += [Contender(name, call, seconds) for name, (call, seconds, _) in theirs.items()]
    expected = ours.apply(images[0], settings, framebuffers=("bloom", "final"))
    staged = stages.apply(images[0], settings, framebuffers=("final",))
    made = [(STAGES, expected["final"], staged["final"])]
    made += [
        (name, expected["bloom" if name == TORCH_ALONE else "final"], fetch(call(0)))
        for name, (call, _, fetch) in theirs.items()
        if name != peers.COPY
    ]
    times = contest(
        plan,
        section,
        group,
        contenders,
        ROUNDS,
        pictures=made,
        allowed=ALLOWED["float16"],
        warm_up=5,
    )
    ours.apply(images[1], settings, framebuffers=("final",))
    frames = ours.apply(images[0], settings, framebuffers=("final",))
    rows = [(name, f"{1e3 * seconds:.3f}") for name, seconds in frames.timings.items()]
    section.tables.append(Table(f"{group}: passes", ("", "ms"), tuple(rows)))
    ratios(
        section,
        group,
        times,
        (OURS, TORCH, 1.0, True),
        (OURS, VKFFT, 1.0, True),
        (OURS_ALONE, TORCH_ALONE, 1.0, True),
    )
    names = (peers.COPY, OURS, OURS_ALONE, TORCH, TORCH_ALONE, VKFFT)
    section.tables += peers.bandwidths(group, times, images[0].nbytes, names)
