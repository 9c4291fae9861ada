"""Bloom of an image, NumPy in and out: threshold, nine taps of the forward system, sum.

Hard luminance threshold, the nine taps of the forward system (strength 1.5) in both directions,
sum. NumPy array in, new NumPy array out; wall-clock time. Each round gives every contender another
image than the round before. Contenders that can keep intermediate buffers between calls do so.
Peers need not keep alpha.

The contender with the same image has another `blur_strength` in each round. So the image is not
uploaded again, and the threshold pass does not run again. Another one fills an array that is kept
(`out=`). The memory copy, of the image by NumPy, is what no contender can be faster than.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.inputs import COUNT, THRESHOLD, pictures
from benchmarks.ours import FRAGMENT, OURS, contest, prepare_call, ratios
from benchmarks.plan import Plan
from benchmarks.results import Section
from benchmarks.timing import Contender

__all__ = ["ALLOWED", "SETTINGS", "full_kernel", "run"]

SETTINGS: Final = vkbloom.Separable(threshold=THRESHOLD)
SIZE: Final = (1920, 1080)
ROUNDS: Final = 15
UNCHANGED: Final = "vkbloom, same image, other strength"
INTO: Final = "vkbloom, out="
COPY: Final = "memory copy"

#: The allowed difference of pictures by dtype, and the reason.
ALLOWED: Final[dict[str, tuple[float, str]]] = {
    "uint8": (2.0, "levels: one side rounds vertical pass, bloom and sum, the other only the sum"),
    "float16": (4e-3, "three roundings to half, each of at most 1e-3 for values up to 2"),
    "float32": (1e-4, "accuracy of lavapipe's linear filter of rgba32float"),
}

_PEERS: Final = ("OpenCV", "SciPy", "scikit-image", "PyTorch")

#: The most that ours may take as a multiple of OpenCV's time: RGBA, RGBA with `out=`, RGB.
_OF_OPENCV: Final = {
    "float16": (0.8, 0.8, 1.2),
    "float32": (1.0, 0.9, 1.2),
    "uint8": (0.85, 0.85, 1.2),
}

#: The least that others take as a multiple of our time, RGBA.
_OF_OURS: Final = {
    "float16": ((FRAGMENT, 3.0), ("SciPy", 6.0), ("scikit-image", 6.0)),
    "float32": (("SciPy", 6.0), ("scikit-image", 6.0)),
    "uint8": (("SciPy", 6.0), ("scikit-image", 6.0)),
}


def full_kernel(settings: vkbloom.Separable) -> NDArray[np.float32]:
    """Return all taps of one pass, with the strength, for a blur with integer texel offsets."""
    one_side = np.array(settings.weights[1:], np.float32) * settings.blur_strength
    return np.concatenate([one_side[::-1], settings.weights[:1], one_side]).astype(np.float32)


def run(plan: Plan, section: Section) -> None:
    """Time the bloom of RGBA and RGB images of each dtype."""
    size = plan.size(*SIZE)
    section.title = f"An image's bloom at {size[0]} x {size[1]}"
    for dtype in _OF_OPENCV:
        for channels in (4, 3):
            _time_one(plan, section, size, np.dtype(dtype), channels)


def _time_one(
    plan: Plan, section: Section, size: tuple[int, int], dtype: np.dtype[Any], channels: int
) -> None:
    images = pictures(size, dtype, channels)
    group = f"{dtype.name}, {'RGBA' if channels == 4 else 'RGB'}"
    plan.tell(f"image: {group}")
    kernel = full_kernel(SETTINGS)
    theirs: dict[str, peers.ImageBloom] = peers.gather(
        _PEERS,
        lambda peer: peer.image_bloom(images[0], kernel, THRESHOLD, plan.threads),
        section.missing,
    )
    with ExitStack() as stack:
        ours, source, unchanged, filling = (
            stack.enter_context(plan.renderer(variant))
            for variant in ("auto", "fragment", "auto", "auto")
        )
        calls = {
            name: prepare_call(renderer, images, SETTINGS)
            for name, renderer in ((OURS, ours), (FRAGMENT, source))
        }
        picture = calls[OURS](0)["final"]
        made = [(FRAGMENT, picture, calls[FRAGMENT](0)["final"])]
        made += [(name, picture, bloom(images[0])) for name, bloom in theirs.items()]
        contenders = [Contender(name, call) for name, call in calls.items()]
        contenders += [
            Contender(name, lambda turn, bloom=bloom: bloom(images[turn % COUNT]))  # type: ignore[misc]
            for name, bloom in theirs.items()
        ]
        # Ours follow work of one thread. Directly after another renderer, the system often leaves
        # both threads of a driver on one core for a complete call.
        contenders.insert(len(contenders) - 1, Contender(INTO, _into(filling, images)))
        contenders.append(Contender(UNCHANGED, _other_strength(unchanged, images[0])))
        contenders.append(Contender(COPY, _copy(images)))
        times = contest(
            plan, section, group, contenders, ROUNDS, pictures=made, allowed=ALLOWED[dtype.name]
        )
    new, into, rgb = _OF_OPENCV[dtype.name]
    ratios(section, group, times, (OURS, "OpenCV", new if channels == 4 else rgb, True))
    if channels == 4:
        least = [(name, OURS, least, False) for name, least in _OF_OURS[dtype.name]]
        ratios(section, group, times, (INTO, "OpenCV", into, True), *least)


def _other_strength(
    renderer: vkbloom.Renderer, image: NDArray[Any]
) -> Callable[[int], vkbloom.Frames]:
    def call(turn: int) -> vkbloom.Frames:
        settings = SETTINGS.replace(blur_strength=1.0 + 0.01 * (turn % 50))
        return renderer.apply(image, settings, framebuffers=("final",))

    return call


def _into(
    renderer: vkbloom.Renderer, images: list[NDArray[Any]]
) -> Callable[[int], vkbloom.Frames]:
    out = {"final": np.zeros_like(images[0])}
    return lambda turn: renderer.apply(
        images[turn % COUNT], SETTINGS, framebuffers=("final",), out=out
    )


def _copy(images: list[NDArray[Any]]) -> Callable[[int], None]:
    target = np.zeros_like(images[0])
    return lambda turn: np.copyto(target, images[turn % COUNT])
