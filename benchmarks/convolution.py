"""Convolution with large kernels, NumPy in and out, against the Fourier transforms of the host.

Hard luminance threshold, convolution by Fourier transforms, sum. NumPy array in, new NumPy array
out; wall-clock time. All keep the kernel's spectrum between calls and pad no more than they need.
Each round has another image than the round before.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.inputs import COUNT, THRESHOLD, pictures
from benchmarks.ours import OURS, contest, prepare_call, ratios
from benchmarks.plan import Plan
from benchmarks.results import Section
from benchmarks.timing import Contender

__all__ = ["ALLOWED", "kernel_sizes", "place", "run", "settings_of"]

SIZE: Final = (1920, 1080)
ROUNDS: Final = 9
SCIPY: Final = "SciPy's transforms"
DUCC: Final = "ducc0's transforms"

#: The allowed difference of pictures by dtype, and the reason.
ALLOWED: Final[dict[str, tuple[float, str]]] = {
    "float16": (4e-3, "two roundings to half, each of at most 1e-3 for values up to 2"),
    "float32": (1e-4, "transforms in single floats"),
}


def kernel_sizes(size: tuple[int, int], small: int) -> dict[str, tuple[int, int]]:
    """Return the kernels' widths and heights: a square, and what every pixel reaches all with."""
    full = 2 * size[0] - 1, 2 * size[1] - 1
    return {f"kernel {w} x {h}": (w, h) for w, h in ((small, small), full)}


def settings_of(size: tuple[int, int]) -> vkbloom.Convolution:
    """Return a convolution with a glare whose colours differ in width; its sum is 1."""
    width, height = size
    x, y = np.arange(width) - width // 2, np.arange(height) - height // 2
    square = np.asarray(x**2, np.float32) + np.asarray(y**2, np.float32)[:, None]
    kernel = np.stack([(1 + square / scale**2) ** -1.5 for scale in (3.0, 2.5, 2.0)], axis=-1)
    return vkbloom.Convolution(kernel, threshold=THRESHOLD)


def place(
    settings: vkbloom.Convolution, size: tuple[int, int]
) -> tuple[NDArray[np.float32], tuple[int, int]]:
    """Return the kernel as a transform needs it.

    Parameters
    ----------
    settings : Convolution
        With the boundary "zero".
    size : (int, int)
        Width and height of the image.

    Returns
    -------
    kernel : ndarray of float32, shape (3, h, w)
        Its centre is at [0, 0], what lies before it at the ends. Padded to the next lengths that
        transforms are fast for; the zeros on both sides of the image are the same.
    padded : (int, int)
        h and w.
    """
    from scipy.fft import next_fast_len  # noqa: PLC0415

    kernel = settings.kernel(size).astype(np.float32)
    reach: list[tuple[int, int]] = []
    padded: list[int] = []
    for count, extent in zip(kernel.shape[:2], size[::-1], strict=True):
        before, after = min(count // 2, extent - 1), min(count - 1 - count // 2, extent - 1)
        reach.append((before, after))
        padded.append(next_fast_len(extent + max(before, after), real=True))
    centre = kernel.shape[0] // 2, kernel.shape[1] // 2
    (up, down), (left, right) = reach
    kept = kernel[centre[0] - up : centre[0] + down + 1, centre[1] - left : centre[1] + right + 1]
    result = np.zeros((3, *padded), np.float32)
    result[:, : kept.shape[0], : kept.shape[1]] = kept.transpose(2, 0, 1)
    return np.roll(result, (-up, -left), (1, 2)), (padded[0], padded[1])


def run(plan: Plan, section: Section) -> None:
    """Time the bloom of an RGB image with a small kernel and with one of full size."""
    size = plan.size(*SIZE)
    section.title = f"Convolution at {size[0]} x {size[1]}, float32 RGB"
    images = pictures(size, np.float32, 3)
    for name, kernel_size in kernel_sizes(size, 256).items():
        plan.tell(f"convolution: {name}")
        _time_one(plan, section, name, settings_of(kernel_size), images)


def _time_one(
    plan: Plan,
    section: Section,
    group: str,
    settings: vkbloom.Convolution,
    images: list[NDArray[Any]],
) -> None:
    height, width = images[0].shape[:2]
    theirs: dict[str, peers.ImageBloom] = peers.gather(
        ("SciPy", "ducc0"),
        lambda peer: peer.convolution(*place(settings, (width, height)), THRESHOLD, plan.threads),
        section.missing,
    )
    with plan.renderer() as renderer:
        bloom = prepare_call(renderer, images, settings)
        picture = bloom(0)["final"]
        contenders = [Contender(OURS, bloom)]
        contenders += [
            Contender(name, lambda turn, each=each: each(images[turn % COUNT]))  # type: ignore[misc]
            for name, each in theirs.items()
        ]
        made = [(name, picture, each(images[0])) for name, each in theirs.items()]
        times = contest(
            plan, section, group, contenders, ROUNDS, pictures=made, allowed=ALLOWED["float32"]
        )
    ratios(section, group, times, (OURS, SCIPY, 1.0, True), (OURS, DUCC, 1.0, True))
