"""The passes of the deferred system: which exist, which run, and their dependencies."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.core.dependencies import (
    COLOR_OUTPUT,
    FRAGMENT_SHADER,
    READ_BEFORE_WRITE,
    WRITE_BEFORE_READ,
)
from tests.planned import dependencies, rows, scene_plan
from tests.scene.deferred_frames import BLURRED, GBUFFER, LIT, SIZE, deferred, rgb
from vkbloom import Renderer, Scene, Separable, Settings, _core, presets

# Passes


def test_weights_change_without_a_new_pipeline(
    new_renderer: Callable[[], Renderer], scene: Scene
) -> None:
    renderer = new_renderer()
    settings = presets["deferred"]
    assert isinstance(settings, Separable)
    before = deferred(renderer, scene, settings)
    count = renderer._core.pipeline_count
    weights = tuple(reversed(settings.weights))
    after = deferred(renderer, scene, settings.replace(weights=weights))
    assert renderer._core.pipeline_count == count > 0
    assert np.abs(rgb(after["bloom"]) - rgb(before["bloom"])).max() > 0.01
    blurs = [f"blur_{way}_0_{loop}" for loop in range(2) for way in ("vertical", "horizontal")]
    assert list(after.timings) == [*blurs, *BLURRED, "final"]


def test_timings_of_each_pass(renderer: Renderer, scene: Scene) -> None:
    shown = deferred(renderer, scene, time=0.1234)
    assert list(shown.timings) == ["glow", "albedo", *BLURRED, *LIT]
    assert all(math.isfinite(seconds) and seconds > 0 for seconds in shown.timings.values())


CHANGES: list[tuple[dict[str, Any], list[str]]] = [
    ({"exposure": 1.0}, ["final"]),
    ({"tonemap": "aces"}, ["final"]),
    ({"blur_strength": 0.7}, [*BLURRED, "final"]),
    ({"threshold": 0.5}, ["extracted", *BLURRED, "final"]),
    ({"bloom": False}, ["albedo", *LIT]),
]


@pytest.mark.parametrize(("changes", "ran"), CHANGES)
def test_change_runs_only_dependent_passes(
    renderer: Renderer, scene: Scene, changes: dict[str, Any], ran: list[str]
) -> None:
    deferred(renderer, scene)
    assert list(deferred(renderer, scene, Separable(**changes)).timings) == ran


def test_passes_of_unrequested_framebuffers_do_not_run(
    new_renderer: Callable[[], Renderer], scene: Scene
) -> None:
    renderer = new_renderer()
    some = deferred(renderer, scene, framebuffers=("brightness",))
    assert list(some) == ["brightness"]
    assert list(some.timings) == ["glow", "albedo"]


def test_shadings_take_turns(renderer: Renderer, scene: Scene) -> None:
    frames = deferred(renderer, scene)
    forward = renderer.render(scene, None, SIZE)
    again = deferred(renderer, scene)
    for name, array in frames.items():
        np.testing.assert_array_equal(array, again[name], err_msg=name)
    for name, array in renderer.render(scene, None, SIZE).items():
        np.testing.assert_array_equal(array, forward[name], err_msg=name)


# The graph


def describe(settings: Settings) -> _core.Plan:
    return scene_plan(settings, shading="deferred")


def test_the_passes() -> None:
    passes = rows(describe(Separable()))
    # A render pass is timed under the name of the first image that it writes.
    assert [row[:4] for row in passes] == [
        ("glow", "glow_frag", (), ("glow", "glow_depth")),
        ("albedo", "gbuffer_sky_frag", (), tuple(GBUFFER)),
        ("albedo", "gbuffer_body_frag", (), tuple(GBUFFER)),
        ("albedo", "gbuffer_glow_frag", ("glow",), tuple(GBUFFER)),
        ("blur_vertical", "blur_frag", ("brightness",), ("blur_vertical",)),
        ("bloom", "blur_frag", ("blur_vertical",), ("bloom",)),
        ("scene", "lighting_frag", tuple(GBUFFER[:4]), ("scene",)),
        ("final", "composite_frag", ("scene", "bloom"), ("final",)),
    ]
    # One render pass for all of the G-buffer.
    assert [row.render_pass for row in passes] == [0, 1, 1, 1, 2, 3, 4, 5]


def test_the_last_pass_waits_for_the_second_blur() -> None:
    assert dependencies(describe(presets["deferred"]), "bloom") == [
        READ_BEFORE_WRITE,
        WRITE_BEFORE_READ,
    ]


def test_the_blurs_and_the_light_wait_for_the_gbuffer() -> None:
    after = [row for row in dependencies(describe(Separable()), "albedo") if row[0] == 0]
    assert len(after) == 1
    assert after[0][2:4] == (COLOR_OUTPUT, FRAGMENT_SHADER)
