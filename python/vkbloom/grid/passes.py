"""Passes counted: which axes are cheap to step along, and what every point alone would cost.

Neither is a list kept by hand. The cost of an axis is found by stepping along it on a few pixels
and counting the passes that ran; the passes of a point alone are those of the core's own graph.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vkbloom import _core
from vkbloom.grid.axes import Axis
from vkbloom.grid.order import Index
from vkbloom.grid.sources import FrameRenderer, Point, Source, visit
from vkbloom.settings import Settings

__all__ = ["passes_alone", "point_at", "ranking", "ranking_of"]


def point_at(source: Source, settings: Settings, axes: Sequence[Axis], index: Index) -> Point:
    """Return the point of a grid at an index."""
    place = source.place
    changes = {}
    for axis, number in zip(axes, index, strict=True):
        if axis.kind == "settings":
            changes[axis.name] = axis.values[number]
        else:
            place = number if axis.kind == "image" else axis.values[number]
    return Point(index, settings.replace(**changes) if changes else settings, place)


def _walk(axes: Sequence[Axis], *, backwards: bool) -> Iterator[tuple[int | None, Index]]:
    """Yield a corner of the grid, then a step along each axis in turn."""
    index = [len(axis) - 1 if backwards else 0 for axis in axes]
    yield None, tuple(index)
    for number, axis in enumerate(axes):
        if len(axis) > 1:
            index[number] += -1 if backwards else 1
            yield number, tuple(index)


def ranking(
    renderer: FrameRenderer,
    source: Source,
    settings: Settings,
    axes: Sequence[Axis],
) -> tuple[int, ...]:
    """Return the axes from the one whose steps run the most passes to the one with the fewest.

    Visiting one step at a time, the sum of all passes is least when the axis with the more passes
    a step is always the slower one, whatever the numbers of values: of two neighbours a, b with
    n_a, n_b values and c_a, c_b passes a step, a outside costs c_a (n_a - 1) + n_a c_b (n_b - 1),
    and that is less than the other way round just where c_a > c_b.

    Parameters
    ----------
    renderer : FrameRenderer
    source : Source
    settings : Settings
    axes : sequence of Axis

    Returns
    -------
    tuple of int
        Of axes that cost the same, images and times come first, then the order given.
    """
    costs = [0] * len(axes)
    if sum(len(axis) > 1 for axis in axes) > 1:
        small = source.small()
        # From both corners: from one of them an axis may be without effect, such as a blur's while
        # the bloom is off.
        for backwards in (False, True):
            steps = list(_walk(axes, backwards=backwards))
            path = (point_at(small, settings, axes, index) for _, index in steps)
            # Of all framebuffers, so that each pass runs by itself: where `final` alone is wanted,
            # one form may stand for several passes, at some points and not at others.
            frames = visit(renderer, small, path, "all")
            for (stepped, _), (_, seen) in zip(steps, frames, strict=True):
                if stepped is not None:
                    costs[stepped] += len(seen.timings)
    return ranking_of(axes, costs)


def ranking_of(axes: Sequence[Axis], costs: Sequence[int]) -> tuple[int, ...]:
    """Return the axes from the one with the highest costs a step to the one with the lowest."""
    return tuple(
        sorted(
            range(len(axes)), key=lambda number: (-costs[number], axes[number].kind == "settings")
        )
    )


def passes_alone(
    source: Source,
    settings: Settings,
    place: float,
    bloom_size: tuple[int, int] | None,
    attachments: str | Sequence[str],
) -> int:
    """Count the passes of a point that nothing was rendered before.

    Parameters
    ----------
    source : Source
    settings : Settings
    place : float
        Number of the image, or time.
    bloom_size : (int, int) or None
        Size of the bloom buffers; None where there are none.
    attachments : "all" or sequence of str

    Returns
    -------
    int
        As `Frames.timings` counts them where no form stands for several passes.
    """
    is_image = source.shading == "image"
    if bloom_size is not None and is_image:
        # The core describes the graphs of scenes. An image's is the forward one with the image in
        # place of the scene: the same bloom passes on buffers of the same size.
        settings = settings.replace(bloom_size=bloom_size)
    shading = "forward" if is_image else source.shading
    graph = _core.describe(settings, source.size_at(place), True, shading)["passes"]
    made = {name for row in graph for name in row["targets"]}
    wanted = made if attachments == "all" else set(attachments) & made
    needed: set[int] = set()
    for row in reversed(graph):
        if wanted & set(row["targets"]):
            wanted = wanted | set(row["reads"]) | set(row["targets"])
            is_source = is_image and "scene" in row["targets"]
            needed |= set() if is_source else {row["render_pass"]}
    return len(needed)
