"""The forward system's graph: its passes, what they share, and their subpass dependencies."""

from __future__ import annotations

import itertools

import pytest

from tests.core.dependencies import (
    COLOR_OUTPUT,
    COLOR_READ,
    COLOR_WRITE,
    DEPTH_BEFORE_DEPTH,
    EXTERNAL,
    FRAGMENT_SHADER,
    READ_BEFORE_WRITE,
    SHADER_READ,
    TRANSFER,
    TRANSFER_READ,
    WRITE_BEFORE_READ,
)
from tests.planned import dependencies, rows, scene_plan
from vkbloom import Separable, _core


def describe(settings: Separable, has_sky: bool = True) -> _core.Plan:
    return scene_plan(settings, has_sky=has_sky)


@pytest.mark.parametrize(
    ("name", "before"),
    [
        # The order of the forward system's source. The second and third are not by region: a blur
        # reads neighbouring pixels, so it must wait for the complete image.
        ("glow", [DEPTH_BEFORE_DEPTH]),
        ("scene", [DEPTH_BEFORE_DEPTH]),
        ("blur_vertical", []),
        ("bloom", []),
    ],
)
def test_dependencies_of_a_render_pass(name: str, before: list[tuple[int, ...]]) -> None:
    expected = [*before, READ_BEFORE_WRITE, WRITE_BEFORE_READ]
    assert dependencies(describe(Separable()), name) == expected


def test_the_last_pass_is_followed_by_the_readback() -> None:
    copied = [
        (EXTERNAL, 0, TRANSFER, COLOR_OUTPUT, TRANSFER_READ, COLOR_WRITE, 0),
        (0, EXTERNAL, COLOR_OUTPUT, TRANSFER, COLOR_WRITE, TRANSFER_READ, 0),
    ]
    graph = describe(Separable())
    assert dependencies(graph, rows(graph)[-1].name) == copied


def test_layers_blend_in_one_render_pass() -> None:
    graph = describe(Separable(layers=((1.0, 1.0), (2.0, 0.5), (4.0, 0.25))))
    layers = [row for row in rows(graph) if row.writes == ("bloom",)]
    assert len(layers) == 3
    assert len({row.render_pass for row in layers}) == 1
    blended = COLOR_READ | COLOR_WRITE
    assert dependencies(graph, layers[0].name) == [
        (EXTERNAL, 0, FRAGMENT_SHADER, COLOR_OUTPUT, SHADER_READ, blended, 0),
        WRITE_BEFORE_READ,
    ]


def test_the_passes_of_the_forward_system() -> None:
    passes = rows(describe(Separable()))
    assert [row[:4] for row in passes] == [
        ("glow", "glow_frag", (), ("glow", "glow_depth")),
        ("blur_vertical", "blur_frag", ("glow",), ("blur_vertical",)),
        ("bloom", "blur_frag", ("blur_vertical",), ("bloom",)),
        ("scene", "skybox_frag", (), ("scene", "depth")),
        ("scene", "phong_frag", (), ("scene", "depth")),
        ("final", "composite_frag", ("scene", "bloom"), ("final",)),
    ]
    # The sky and the body are drawn into the same targets, all others have their own.
    assert [row.render_pass for row in passes] == [0, 1, 2, 3, 3, 4]
    assert len(describe(Separable()).dependencies) == 5
    assert {row.variant for row in passes} == {"fragment"}


def test_without_a_sky() -> None:
    shaders = [row.shader for row in rows(describe(Separable(), has_sky=False))]
    assert shaders[3] == "phong_frag"
    assert "skybox_frag" not in shaders


def test_without_bloom() -> None:
    passes = rows(describe(Separable(bloom=False)))
    assert [(row.reads, row.writes) for row in passes] == [
        ((), ("scene", "depth")),
        ((), ("scene", "depth")),
        (("scene",), ("final",)),
    ]


def test_loops_follow_each_other() -> None:
    passes = rows(describe(Separable(loops=3)))[:7]
    # Each blur reads what the one before it wrote; only the last vertical one has a public name.
    for before, after in itertools.pairwise(passes):
        assert after.reads == before.writes[:1]
    assert [row.writes[0] for row in passes].index("blur_vertical") == 5
    assert passes[-1].writes == ("bloom",)


def test_direct_is_one_pass_a_loop() -> None:
    passes = rows(describe(Separable(direct=True, loops=2)))[:3]
    assert [row.reads for row in passes[1:]] == [("glow",), passes[1].writes]
    assert passes[-1].writes == ("bloom",)


def test_no_image_is_written_by_two_render_passes() -> None:
    layers = ((1.0, 1.0), (2.0, 0.5))
    for settings in (Separable(), Separable(loops=4, layers=layers), Separable(direct=True)):
        writers: dict[str, int] = {}
        for row in rows(describe(settings)):
            for target in row.writes:
                assert writers.setdefault(target, row.render_pass) == row.render_pass
            assert set(row.reads) <= writers.keys()
            assert not set(row.reads) & set(row.writes)
