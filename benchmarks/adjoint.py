"""Derivatives by the image on the device, beside the framebuffer that they are of.

Forward are the passes of "final", backward those from its cotangents to the image's. They take
turns with three images and cotangents, all RGB in single floats. Without a curve the backward
passes need nothing of the forward ones. On a GPU the times are those of the passes on the device;
on a CPU they are the processor time of the complete calls, which other work on the machine does
not change much, at a smaller size. PyTorch's is the same `Pyramid` in convolutions, with autograd;
its memory is the most that it had allocated, without the images that wait for their turn, that of
vkbloom all of its images.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks.inputs import pictures
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, Table, agreement, side_by_side
from benchmarks.timing import alternate_seconds, wall_clock
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
    "BevyBloom": vkbloom.presets["bevy_natural"],
    "KinoBloom": vkbloom.KinoBloom(),
    "UrpBloom": vkbloom.presets["unity_urp"],
    "ThreeBloom": vkbloom.presets["threejs_unreal"],
    "HdrpBloom": vkbloom.presets["unity_hdrp"],
    "GodotBloom": vkbloom.presets["godot_4_6"],
    "BlenderGlare": vkbloom.presets["blender_bloom"],
}
#: The most that a pullback may cost, times the framebuffer.
MAX_RATIO: Final = 2.5
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
    times: dict[str, Any] = {}
    for name, chosen in SETTINGS.items():
        plan.tell(f"adjoint: {name}")
        # The levels of Bevy have a size of their own.
        small = {"max_mip_dimension": 16} if plan.quick and name == "BevyBloom" else {}
        settings = chosen.replace(format="rgba32float", **small)
        with plan.renderer() as renderer:
            ours = _calls(renderer, settings, images, cotangents)
            if ours is None:
                section.missing.append(f"{name}: the reference computes its derivatives")
                continue
            if on_cpu:
                ours = {name: _processor_time(call) for name, call in ours.items()}
            times[name] = alternate_seconds(ours, plan.times(ROUNDS), warm_up=3)
            memory = renderer._core.cached[1]
        backward = times[name]["backward"].over(times[name]["forward"]).value
        section.goals.append(Goal(f"{name}: backward / forward", backward, MAX_RATIO, at_most=True))
        section.times[name] = times[name]
        section.tables.append(side_by_side(name, times[name], "forward"))
        if name == "Pyramid":
            _beside_torch(plan, section, (images, cotangents), times[name], memory)


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


def _processor_time(call: Callable[[int], float]) -> Callable[[int], float]:
    def time_turn(turn: int) -> float:
        start = time.process_time()
        call(turn)
        return time.process_time() - start

    return time_turn


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
    ours: dict[str, Any],
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
        final = image + _pyramid(torch, image)
        return torch.autograd.grad(final, image, given[1][turn % 3])[0]

    with plan.renderer() as renderer:
        expected, _ = _pull(renderer, PYRAMID, images[0], cotangents[0])
    found = pull(0)[0].movedim(0, -1).cpu().numpy()
    most = 1e-5 * float(np.abs(expected).max())
    reason = "a hundred-thousandth of the largest derivative"
    what = "Pyramid: derivatives of PyTorch"
    section.agreements.append(agreement(what, expected, found, most, reason))
    both = alternate_seconds({"PyTorch": _time(torch, device, pull)}, plan.times(ROUNDS))
    seconds = ours["forward"].median + ours["backward"].median
    theirs = both["PyTorch"].median
    rows = [
        ("vkbloom", f"{1e3 * seconds:.3f}", f"{memory / 2**20:.0f}"),
        (f"PyTorch on {device}", f"{1e3 * theirs:.3f}", ""),
    ]
    goals = [
        Goal("Pyramid, both directions: vkbloom / PyTorch", seconds / theirs, 1 / FASTER, True)
    ]
    if device == "cuda":
        torch.cuda.reset_peak_memory_stats()
        pull(1)
        # One image and its cotangents belong to the work, the others wait for their turn.
        waiting = 2 * sum(kind[0].nbytes for kind in given)
        most = torch.cuda.max_memory_allocated() - waiting
        rows[1] = (*rows[1][:2], f"{most / 2**20:.0f}")
        goals.append(
            Goal("Pyramid: memory of vkbloom / PyTorch", memory / most, PART_OF_MEMORY, True)
        )
        section.goals += goals
    section.times["Pyramid, PyTorch"] = both
    section.tables.append(
        Table("Pyramid, forward and backward", ("", "median, ms", "MiB"), tuple(rows))
    )


def _time(torch: Any, device: str, call: Callable[[int], Any]) -> Callable[[int], float]:
    """Return a call that returns its seconds on the device."""
    if device == "cpu":
        return wall_clock(call)

    def on_device(turn: int) -> float:
        start, end = (torch.cuda.Event(enable_timing=True) for _ in range(2))
        start.record()
        call(turn)
        end.record()
        end.synchronize()
        return 1e-3 * float(start.elapsed_time(end))

    return on_device


def _pyramid(torch: Any, image: Any) -> Any:
    """Return the bloom of `PYRAMID`: sides are halved without a rest."""
    functional = torch.nn.functional
    outer, inner = (
        torch.tensor(one, device=image.device) for one in (_line(2.0, 0.25, 0.5), _line(1.0, 0.5))
    )
    down = 0.5 * (torch.outer(outer, outer) + torch.outer(inner, inner))
    tent = torch.tensor([0.25, 0.5, 0.25], device=image.device)
    kernels = [one.expand(3, 1, *one.shape).contiguous() for one in (down, torch.outer(tent, tent))]
    levels = [image]
    for _ in range(LEVELS):
        padded = functional.pad(levels[-1], (2, 2, 2, 2), mode="replicate")
        levels.append(functional.conv2d(padded, kernels[0], stride=2, groups=3))

    def enlarge(level: Any) -> Any:
        padded = functional.pad(level, (2, 2, 2, 2), mode="replicate")
        filtered = functional.conv2d(padded, kernels[1], groups=3)
        double = functional.interpolate(filtered, scale_factor=2, mode="bilinear")
        return double[..., 2:-2, 2:-2]

    up = levels[-1]
    for level in levels[-2:0:-1]:
        up = level + enlarge(up)
    return enlarge(up) / LEVELS


def _line(distance: float, side: float, middle: float = 0.0) -> list[float]:
    """Return the weights of six texels for taps between the middle two and beside them."""
    weights = [0.0] * 6
    for offset, share in ((-distance, side), (0.0, middle), (distance, side)):
        for texel in (2, 3):
            weights[texel + int(offset)] += share / 2
    return weights
