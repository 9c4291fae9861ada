"""Tensors in and out by the wall clock: `vkbloom.torch.bloom` and training steps beside PyTorch.

RGB in single floats, another image in each round, on the GPU of the adapter or on the CPU at a
smaller size; each call is waited for. A step is the bloom and the derivatives by the image from
given cotangents. One that learns has `vkbloom.torch.Bloom`, and the derivatives by parameters, too:
threshold, knee and intensity where the device has them, or all fields that it has. Parameters are
on the tensors' device, and have other values in each step, as an optimizer makes them. PyTorch's
pyramid is the same `Pyramid` in convolutions, by autograd, and compiled by `torch.compile`. Tensors
of vkbloom have their channels last, those of PyTorch first. On a GPU the passes of both directions
are timed, too, by its timestamps.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks.inputs import pictures
from benchmarks.ours import ratios
from benchmarks.peers import pytorch
from benchmarks.plan import Plan
from benchmarks.results import Goal, Section, agreement, side_by_side
from benchmarks.timing import PASSES, WALL, Times, alternate_seconds, wall_clock
from vkbloom._gradients.passes import Passes, in_floats
from vkbloom._gradients.sums import device_fields
from vkbloom._renderer.device_arrays import take
from vkbloom._renderer.sources import Inputs
from vkbloom.psf import gaussian

__all__ = ["run"]

SIZE: Final = (3840, 2160)
SIZE_ON_CPU: Final = (960, 544)
ROUNDS: Final = 15
LEVELS: Final = 4
FORWARD: Final = "forward"
STEP: Final = "a step"
LEARNS: Final = "a step that learns"
LEARNS_ALL: Final = "a step that learns all fields"
AUTOGRAD: Final = "PyTorch with autograd"
COMPILED: Final = "PyTorch, compiled"
BOTH: Final = "passes of both directions"
#: What a step may take more than its passes: the host, and the changes of the GPU between CUDA and
#: Vulkan.
MAX_OVERHEAD: Final = 2e-3
FIELDS: Final = ("threshold", "knee", "intensity")
#: More than settings and plans that are kept.
MODULES: Final = 40
#: What a step of `METHODS` may take more if it learns these on a GPU; else how many steps it takes.
MAX_LEARNING: Final = 0.5e-3
MAX_RATIO: Final = 3.0
PYRAMID: Final = "Pyramid(levels=4)"
METHODS: Final[dict[str, vkbloom.Settings]] = {
    PYRAMID: vkbloom.Pyramid(levels=LEVELS),
    "Separable": vkbloom.Separable(threshold=0.5, knee=0.5),
    "Pyramid(levels=5)": vkbloom.Pyramid(levels=5),
    "DualKawase": vkbloom.DualKawase(levels=LEVELS, threshold=0.5, knee=0.5),
    "Convolution, a Gaussian of 40": vkbloom.Convolution(gaussian(40)),
    "Pyramid(levels=4), a knee": vkbloom.Pyramid(levels=LEVELS, threshold=0.5, knee=0.5),
    "Convolution, a knee": vkbloom.Convolution(gaussian(40), threshold=0.5, knee=0.5),
}


def run(plan: Plan, section: Section) -> None:
    """Time the operator and steps of each method, on a GPU of each preset, too."""
    section.title = "Training steps by the wall clock"
    try:
        torch = importlib.import_module("torch")
        operator = importlib.import_module("vkbloom.torch")
    except (ImportError, OSError):
        section.missing.append("PyTorch is not installed")
        return
    with plan.renderer() as renderer:
        on_cpu = renderer.info.type == "cpu"
        if not on_cpu and not torch.cuda.is_available():
            section.missing.append("PyTorch finds no CUDA device")
            return
        device = "cpu" if on_cpu else "cuda"
        torch.set_num_threads(plan.threads)
        size = plan.size(*(SIZE_ON_CPU if on_cpu else SIZE))
        # Both sides are multiples of the smallest level's texel.
        width, height = (side - side % 2**LEVELS for side in size)
        images = [np.ascontiguousarray(one[..., :3]) for one in pictures((width, height), "f4")]
        random = np.random.default_rng(0)
        cotangents = [random.standard_normal(one.shape, np.float32) for one in images]
        last = tuple([torch.from_numpy(one).to(device) for one in k] for k in (images, cotangents))
        first = tuple([one.movedim(-1, 0)[None].contiguous() for one in kind] for kind in last)
        for name, settings in (METHODS if on_cpu else METHODS | dict(vkbloom.presets)).items():
            plan.tell(f"training: {name}")

            def bloom(image: Any, settings: vkbloom.Settings = settings) -> Any:
                return operator.bloom(image, settings, renderer=renderer)

            step = _step(torch, bloom, last, device)
            clocks = {FORWARD: wall_clock(_waiting(bloom, last, device)), STEP: wall_clock(step)}
            peers = _peers(torch, first, device) if name == PYRAMID else {}
            clocks |= _that_agree(section, name, step(0), peers)
            if not on_cpu:
                clocks[BOTH] = _passes(renderer, settings, last)
            _time_steps(plan, section, name, clocks)
            known = device_fields(in_floats(settings))
            learned = {LEARNS: [one for one in FIELDS if one in known], LEARNS_ALL: sorted(known)}
            clocks = {STEP: clocks[STEP]}
            for place, (kind, fields) in enumerate(learned.items(), start=2):
                modules = [
                    operator.Bloom(settings, learn=fields, renderer=renderer).to(device)
                    for _ in range(MODULES if fields else 0)
                ]
                if modules:
                    clocks[kind] = wall_clock(_learning_step(torch, modules, last, device, place))
            limit = MAX_LEARNING if name in METHODS and not on_cpu else None
            _time_learning(plan, section, name, clocks, limit)


def _waiting(call: Callable[[Any], Any], inputs: Any, device: str) -> Callable[[int], Any]:
    return pytorch.synchronized(lambda turn: call(inputs[0][turn % 3]), device)


def _step(torch: Any, call: Callable[[Any], Any], inputs: Any, device: str) -> Callable[[int], Any]:
    """Return a call that waits for the derivatives by the image of its round."""

    def step(turn: int) -> Any:
        # Not the image of the call before in its round, or in the last one.
        number = (turn + 1) % 3
        image = inputs[0][number].detach().requires_grad_()
        return torch.autograd.grad(call(image), image, inputs[1][number])[0]

    return pytorch.synchronized(step, device)


def _learning_step(
    torch: Any, modules: list[Any], inputs: Any, device: str, place: int
) -> Callable[[int], Any]:
    """Return a call that waits for such a step, with a module of other values in each round.

    `place`: Of the call in its round. The call before has another image.
    """
    parameters = [list(module.parameters()) for module in modules]
    with torch.no_grad():
        for number, each in enumerate(parameters):
            for parameter in each:
                parameter.mul_(1 - 1e-4 * number)

    def step(turn: int) -> Any:
        number = (turn + place) % 3
        image = inputs[0][number].detach().requires_grad_()
        wanted = [image, *parameters[turn % len(modules)]]
        final = modules[turn % len(modules)](image)
        return torch.autograd.grad(final, wanted, inputs[1][number])[0]

    return pytorch.synchronized(step, device)


def _passes(
    renderer: vkbloom.Renderer, settings: vkbloom.Settings, inputs: Any
) -> Callable[[int], float]:
    """Return a call that returns the seconds of all passes of a step on the device."""
    floats = in_floats(settings)

    def seconds(turn: int) -> float:
        image, cotangent = (kind[turn % 3] for kind in inputs)
        forward = renderer.apply(image, floats, framebuffers="final").timings
        given, back = (take(one, "image", renderer._core) for one in (image, cotangent))
        running = Passes(renderer, Inputs(given), floats, {"final": back}, "cuda").submit()
        assert running is not None
        assert running.submission is not None
        (backward,), _ = running.submission.wait()
        return sum(forward.values()) + sum(backward.values())

    return seconds


def _peers(torch: Any, inputs: Any, device: str) -> dict[str, Callable[[int], Any]]:
    def bloom(image: Any) -> Any:
        return image + pytorch.pyramid(image, LEVELS)

    return {
        AUTOGRAD: _step(torch, bloom, inputs, device),
        COMPILED: _step(torch, torch.compile(bloom), inputs, device),
    }


def _that_agree(
    section: Section, name: str, derivatives: Any, peers: dict[str, Callable[[int], Any]]
) -> dict[str, Callable[[int], float]]:
    """Return the clocks of the peers' steps with these derivatives."""
    expected = _array(derivatives)
    most = 1e-5 * float(np.abs(expected).max())
    clocks = {}
    for peer, step in peers.items():
        try:
            made = np.moveaxis(_array(step(0))[0], 0, -1)
        except Exception as error:
            section.missing.append(
                f"{peer} does not run here: {' '.join(str(error).split())[:200]}"
            )
            continue
        reason = "a hundred-thousandth of the largest derivative"
        section.agreements.append(agreement(f"{name}: {peer}", expected, made, most, reason))
        if section.agreements[-1].agrees:
            clocks[peer] = wall_clock(step)
    return clocks


def _time_steps(
    plan: Plan, section: Section, name: str, clocks: dict[str, Callable[[int], float]]
) -> None:
    times = alternate_seconds(clocks, plan.times(ROUNDS), warm_up=3)
    section.add_times(name, times, {one: PASSES if one == BOTH else WALL for one in times}, STEP)
    section.tables.append(side_by_side(name, times, STEP))
    ratios(section, name, times, (STEP, AUTOGRAD, 0.6, True), (STEP, COMPILED, 0.75, True))
    if BOTH in times:
        _at_most_more(section, name, times, (STEP, BOTH, MAX_OVERHEAD))


# Not beside peers: settings of forty modules take the place of others in the host's caches.
def _time_learning(
    plan: Plan,
    section: Section,
    name: str,
    clocks: dict[str, Callable[[int], float]],
    limit: float | None,
) -> None:
    """Time steps that learn. `limit`: What those of few fields take more; None: a multiple is."""
    times = alternate_seconds(clocks, plan.times(ROUNDS), warm_up=3)
    group = f"{name}, fields"
    section.add_times(group, times, dict.fromkeys(times, WALL), STEP)
    section.tables.append(side_by_side(group, times, STEP))
    multiples = [kind for kind in (LEARNS, LEARNS_ALL) if kind in times]
    if limit is not None and LEARNS in times:
        multiples.remove(LEARNS)
        _at_most_more(section, name, times, (LEARNS, STEP, limit))
    ratios(section, name, times, *((kind, STEP, MAX_RATIO, True) for kind in multiples))


def _at_most_more(
    section: Section, name: str, times: dict[str, Times], wanted: tuple[str, str, float]
) -> None:
    """Add the goal that one takes at most so many seconds longer than the other."""
    one, other, seconds = wanted
    most = Times(tuple(each + seconds for each in times[other].seconds))
    what = f"{name}: {one} / {other} and {1e3 * seconds:g} ms"
    section.goals.append(Goal(what, times[one].over(most), 1.0, at_most=True))


def _array(tensor: Any) -> NDArray[np.float32]:
    array: NDArray[np.float32] = tensor.cpu().numpy()
    return array
