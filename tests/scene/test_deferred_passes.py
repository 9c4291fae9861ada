"""The passes of the deferred system: which exist, which run, and their dependencies."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.screens import BLURRED, LIT, SIZE, deferred, rgb
from vkbloom import Renderer, Scene, Separable, presets

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
