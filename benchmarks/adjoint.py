"""Derivatives by the image on the device, beside the framebuffer that they are of.

Forward are the passes of "final", backward those from its cotangents to the image's. They take
turns with three images and cotangents, all RGB in single floats. Without a curve the backward
passes need nothing of the forward ones. On a GPU the times are those of the passes on the device;
on a CPU they are the processor time of the complete calls, which other work on the machine does
not change much, at a smaller size. The derivatives of a small image are compared with those of the
fragment variant first. PyTorch's is the same `Pyramid` in convolutions, with autograd;
its memory is the most that it had allocated, without the images that wait for their turn, that of
vkbloom all of its images.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks.inputs import pictures
from benchmarks.ours import OURS
from benchmarks.peers import pytorch
from benchmarks.plan import Plan
from benchmarks.results import Agreement, Goal, Section, agreement, side_by_side
from benchmarks.timing import (
    PASSES,
    PROCESSOR,
    WALL,
    alternate_seconds,
    estimate,
    processor_clock,
    wall_clock,
)
from vkbloom import _core
from vkbloom._renderer import requests
from vkbloom._renderer.new_arrays import new_arrays

__all__ = ["run"]

SIZE: Final = (3840, 2160)
SIZE_ON_CPU: Final = (960, 544)
ROUNDS: Final = 15
LEVELS: Final = 4
PYRAMID: Final = vkbloom.Pyramid(levels=LEVELS, format="rgba32float")
SETTINGS: Final[dict[str, vkbloom.Settings]] = {
    "Separable": vkbloom.Separable(threshold=0.5, knee=0.5),
    "Separable, Reinhard": vkbloom.Separable(threshold=0.5, knee=0.5, tonemap="reinhard"),
    "Convolution": vkbloom.Convolution(),
    "Pyramid": PYRAMID,
    "Pyramid, threshold, ACES": PYRAMID.replace(threshold=0.5, tonemap="aces"),
    "DualKawase": vkbloom.DualKawase(levels=LEVELS, threshold=0.5),
    "KinoBloom": vkbloom.KinoBloom(),
} | dict(vkbloom.presets)
#: The most that a pullback may cost, times the framebuffer.
MAX_RATIO: Final = 2.5
PYTORCH: Final = "PyTorch"
#: How much faster than PyTorch, and in which part of its memory.
FASTER, PART_OF_MEMORY = 5.0, 0.25


def run(plan: Plan, section: Section) -> None:
    """Time methods alone, then the pyramid beside PyTorch's."""
    section.title = "Derivatives by the image"
    with plan.renderer() as renderer:
        on_cpu = renderer.info.type == "cpu"
    size = plan.size(*(SIZE_ON_CPU if on_cpu else SIZE))
    images = [np.ascontiguousarray(one[..., :3]) for one in pictures(size, np.float32)]
    random = np.random.default_rng(0)
    cotangents = [random.standard_normal(one.shape, np.float32) for one in images]
    small = size[0] // 4, size[1] // 4
    for name, chosen in SETTINGS.items():
        plan.tell(f"adjoint: {name}")
        settings = chosen.replace(format="rgba32float")
        with plan.renderer() as renderer:
            ours = _calls(renderer, settings, images, cotangents)
            if ours is None:
                section.missing.append(f"{name}: the reference computes its derivatives")
                continue
            section.agreements.append(_beside_fragment(plan, name, settings, small))
            if not section.agreements[-1].agrees:
                continue
            clocks = {one: processor_clock(call) for one, call in ours.items()} if on_cpu else ours
            warm_up = 1 if on_cpu else 3
            times = alternate_seconds(clocks, plan.times(ROUNDS), warm_up=warm_up)
            if name == "Pyramid":
                memory = renderer._core.cached[1]
                _beside_torch(plan, section, (images, cotangents), clocks, memory)
        if not on_cpu:
            backward = times["backward"].over(times["forward"])
            section.goals.append(Goal(f"{name}: backward / forward", backward, MAX_RATIO, True))
        section.add_times(name, times, PROCESSOR if on_cpu else PASSES, "forward")
        section.tables.append(side_by_side(name, times, "forward"))


def _beside_fragment(
    plan: Plan, name: str, settings: vkbloom.Settings, size: tuple[int, int]
) -> Agreement:
    """Compare the derivatives of a small image with those of the fragment variant."""
    image = np.ascontiguousarray(pictures(size, np.float32)[0][..., :3])
    cotangent = np.random.default_rng(1).standard_normal(image.shape, np.float32)
    found = []
    for variant in ("fragment", "auto"):
        with plan.renderer(variant) as renderer:
            found.append(_pull(renderer, settings, image, cotangent)[0])
    expected, made = found
    most = 1e-5 * float(np.abs(expected).max())
    reason = "a hundred-thousandth of the largest derivative"
    return agreement(f"{name}: derivatives of fragment", expected, made, most, reason)


def _calls(
    renderer: vkbloom.Renderer,
    settings: vkbloom.Settings,
    images: list[NDArray[Any]],
    cotangents: list[NDArray[Any]],
) -> dict[str, Callable[[int], float]] | None:
    """Return both directions; None: not all passes have adjoints."""

    def forward(turn: int) -> float:
        image = images[turn % len(images)]
        return sum(renderer.apply(image, settings, framebuffers="final").timings.values())

    def backward(turn: int) -> float:
        return _pull(renderer, settings, images[turn % 3], cotangents[turn % 3])[1]

    source = _core.image_source(images[0], None, None, (cotangents[0],))
    if renderer._core.plan(source, settings, None, ("final",), "images") is None:
        return None
    return {"forward": forward, "backward": backward}


def _pull(
    renderer: vkbloom.Renderer,
    settings: vkbloom.Settings,
    image: NDArray[Any],
    cotangent: NDArray[Any],
) -> tuple[NDArray[Any], float]:
    """Return the derivatives by the image, and the seconds of the passes."""
    core = renderer._core
    source = _core.image_source(image, None, None, (cotangent,))
    plan = core.plan(source, settings, None, ("final",), "images")
    assert plan is not None
    arrays = new_arrays(core, plan)
    (timings,), _ = core.run(source, (plan,), (arrays,)).wait()
    return requests.name_outputs(plan, arrays)[".by_image"], sum(timings.values())


def _beside_torch(
    plan: Plan,
    section: Section,
    inputs: tuple[list[NDArray[Any]], list[NDArray[Any]]],
    ours: dict[str, Callable[[int], float]],
    memory: int,
) -> None:
    try:
        torch = importlib.import_module("torch")
    except ImportError:
        section.missing.append("PyTorch: it is not installed")
        return
    images, cotangents = inputs
    if any(side % 2**LEVELS for side in images[0].shape[:2]):
        section.missing.append(f"PyTorch: sides are no multiples of {2**LEVELS}")
        return
    device = "cuda" if torch.cuda.is_available() else "cpu"
    given = [
        [torch.from_numpy(one).movedim(-1, 0)[None].contiguous().to(device) for one in kind]
        for kind in inputs
    ]

    def pull(turn: int) -> Any:
        image = given[0][turn % 3].detach().requires_grad_()
        final = image + pytorch.pyramid(image, LEVELS)
        return torch.autograd.grad(final, image, given[1][turn % 3])[0]

    with plan.renderer() as renderer:
        expected, _ = _pull(renderer, PYRAMID, images[0], cotangents[0])
    found = pull(0)[0].movedim(0, -1).cpu().numpy()
    most = 1e-5 * float(np.abs(expected).max())
    reason = "a hundred-thousandth of the largest derivative"
    what = "Pyramid: derivatives of PyTorch"
    section.agreements.append(agreement(what, expected, found, most, reason))
    on_device = device == "cuda"
    calls = {
        OURS: lambda turn: ours["forward"](turn) + ours["backward"](turn),
        PYTORCH: _time(torch, device, pull),
    }
    clocks = {OURS: PASSES, PYTORCH: PASSES} if on_device else {OURS: PROCESSOR, PYTORCH: PROCESSOR}
    if on_device:
        wait = pytorch.synchronized(pull, device)
        calls[f"{PYTORCH}, its wall clock"] = wall_clock(wait)
        clocks[f"{PYTORCH}, its wall clock"] = WALL
    both = alternate_seconds(calls, plan.times(ROUNDS), warm_up=3)
    group = "Pyramid, both directions"
    section.add_times(group, both, clocks, OURS)
    section.tables.append(side_by_side(group, both, OURS))
    section.add_memory(group, f"{OURS}, memory", [memory / 2**20])
    if on_device:
        faster = both[OURS].over(both[PYTORCH])
        section.goals.append(Goal(f"{group}: {OURS} / {PYTORCH}", faster, 1 / FASTER, True))
        torch.cuda.reset_peak_memory_stats()
        pull(1)
        # One image and its cotangents belong to the work, the others wait for their turn.
        waiting = 2 * sum(kind[0].nbytes for kind in given)
        most = torch.cuda.max_memory_allocated() - waiting
        section.add_memory(group, f"{PYTORCH}, memory", [most / 2**20])
        part = estimate([memory / most])
        section.goals.append(
            Goal("Pyramid: memory of vkbloom / PyTorch", part, PART_OF_MEMORY, at_most=True)
        )


def _time(torch: Any, device: str, call: Callable[[int], Any]) -> Callable[[int], float]:
    """Return a call that returns its seconds on the device."""
    if device == "cpu":
        return processor_clock(call)

    def on_device(turn: int) -> float:
        start, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
        start.record()
        call(turn)
        end.record()
        end.synchronize()
        return 1e-3 * float(start.elapsed_time(end))

    return on_device
