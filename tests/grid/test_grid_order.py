"""The order in which a grid's points are visited."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vkbloom._grid.order import blocks, default_chunk, points


@st.composite
def lattices(draw: st.DrawFn) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
    """Shapes, chunks and rankings; chunks need not divide the shape."""
    shape = tuple(draw(st.lists(st.integers(1, 5), max_size=4)))
    chunk = tuple(draw(st.integers(1, count)) for count in shape)
    return shape, chunk, tuple(draw(st.permutations(range(len(shape)))))


def visited(
    shape: tuple[int, ...], chunk: tuple[int, ...], ranking: tuple[int, ...]
) -> list[tuple[int, ...]]:
    return [index for block in blocks(shape, chunk, ranking) for index in points(block, ranking)]


@given(lattices())
def test_every_point_once(
    lattice: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]],
) -> None:
    assert sorted(visited(*lattice)) == list(np.ndindex(lattice[0]))


@given(lattices(), st.integers(1, 40))
def test_default_chunks_keep_the_order_of_nested_loops(
    lattice: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]], most: int
) -> None:
    shape, _, ranking = lattice
    chunk = default_chunk(shape, ranking, most)
    assert math.prod(chunk) <= most
    found = visited(shape, chunk, ranking)
    assert found == sorted(found, key=lambda index: [index[axis] for axis in ranking])


@pytest.mark.parametrize("ranking", [(0, 1), (1, 0)])
def test_blocks_cover_the_grid(ranking: tuple[int, int]) -> None:
    count = np.zeros((5, 4), int)
    for block in blocks((5, 4), (2, 3), ranking):
        assert block.count == count[block.slices].size
        count[block.slices] += 1
    assert (count == 1).all()
