"""A kernel that depends on the place, NumPy in and out, against optiland and photutils.

NumPy array in, new NumPy array out; wall-clock time, float32 RGB. optiland convolves with a mean
kernel and four others, in doubles. photutils draws each pixel as a source, which is exact for
any field. Each round has another image than the round before.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.inputs import COUNT, pictures
from benchmarks.ours import OURS, contest, prepare_call, ratios
from benchmarks.plan import Plan
from benchmarks.results import Section
from benchmarks.timing import Contender
from vkbloom import psf

__all__ = ["run"]

SIZE: Final = (1920, 1080)
#: photutils draws 1,728 sources, three times.
SMALL: Final = (48, 36)
ROUNDS: Final = 5
ALLOWED: Final = (1e-5, "transforms in single floats")


def kernels_of(rows: int, columns: int, side: int) -> NDArray[np.float64]:
    """Return round spots that grow from the first to the last, (rows, columns, side, side)."""
    x = np.arange(side) - side // 2
    square = np.asarray(x**2 + x[:, None] ** 2, np.float64)
    widths = np.linspace(1.2, 4.8, rows * columns).reshape(rows, columns, 1, 1)
    spots = np.exp(-square / (2 * widths**2))
    return np.asarray(spots / spots.sum(axis=(2, 3), keepdims=True), np.float64)


def run(plan: Plan, section: Section) -> None:
    """Time five kernels over a large picture, and 3 x 4 over a small one."""
    size = plan.size(*SIZE)
    section.title = "A kernel that depends on the place, float32 RGB"
    _time_one(plan, section, size, kernels_of(1, 5, 33), "optiland")
    _time_one(plan, section, SMALL, kernels_of(3, 4, 17), "photutils")


def _time_one(
    plan: Plan, section: Section, size: tuple[int, int], kernels: NDArray[np.float64], name: str
) -> None:
    rows, columns, side = kernels.shape[:3]
    group = f"{size[0]} x {size[1]}, {rows} x {columns} kernels of {side} x {side}"
    plan.tell(f"field: {group}")
    lens = psf.Varying(kernels)
    xs, ys = lens.grid_of(size)
    hats = np.stack([np.interp(np.arange(size[0]), xs, line) for line in np.eye(columns)])
    weights = np.broadcast_to(hats[:, None], (columns, size[1], size[0]))
    theirs: dict[str, peers.ImageBloom] = peers.gather(
        (name,),
        lambda peer: (
            peer.field(kernels[0], weights) if name == "optiland" else peer.field(kernels, xs, ys)
        ),
        section.missing,
    )
    settings = vkbloom.Convolution(lens, composite="mix", intensity=1.0, format="rgba32float")
    images = pictures(size, np.float32, 3)
    with plan.renderer() as renderer:
        bloom = prepare_call(renderer, images, settings)
        picture = bloom(0)["final"]
        contenders = [Contender(OURS, bloom)]
        contenders += [
            Contender(peer, lambda turn, each=each: each(images[turn % COUNT]))  # type: ignore[misc]
            for peer, each in theirs.items()
        ]
        made = [(peer, picture, each(images[0])) for peer, each in theirs.items()]
        times = contest(plan, section, group, contenders, ROUNDS, pictures=made, allowed=ALLOWED)
    ratios(section, group, times, (OURS, name, 0.25, True))
