"""The NumPy reference: what it takes, and published values of its curves.

test_matrix.py compares the rest of it with the shaders.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

import vkbloom
from tests.images import random_image
from tests.methods.cases import presets_of_low_levels
from vkbloom import Pyramid, Renderer, Separable, presets, psf, reference

IMAGE = random_image(12, 16, 3)


def assert_close(actual: Any, expected: Any) -> None:
    """Equal except for the rounding of doubles in sums of a few hundred products."""
    assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)


def flat(value: float, height: int = 12, width: int = 16) -> NDArray[np.float64]:
    return np.full((height, width, 3), value)


def test_format_of_the_settings_decides_over_the_dtype() -> None:
    image = flat(4.0).astype(np.float32)
    framebuffers = reference.apply(image, Pyramid(format="rgba8unorm"))
    assert_close(framebuffers["glow"][..., :3], 1)
    assert_close(framebuffers["final"], 5)  # the image's own 4 is not clamped
    assert_close(reference.apply(image, Pyramid())["bloom"][..., :3], 4)
    assert_close(reference.blur(image, Separable(), format="rgba8unorm"), 1)
    assert reference.blur(image.astype(np.uint8) * 60, Separable(), format="rgba32float").max() > 1


def test_grey_can_take_the_firefly_filter() -> None:
    grey = random_image(12, 12, 1) * 9
    bloom = reference.blur(grey, Pyramid(firefly_filter=True))
    rgb = reference.blur(np.repeat(grey, 3, axis=2), Pyramid(firefly_filter=True))
    assert_close(np.repeat(bloom, 3, axis=2), rgb)


def test_the_image_is_not_changed() -> None:
    image = random_image(8, 8, 4)
    image[1, 1, 1] = np.nan
    before = image.copy()
    for settings in (Separable(threshold=0.2, knee=0.5), Pyramid(firefly_filter=True)):
        reference.apply(image, settings)
        reference.passes(image, settings)
    assert_array_equal(image, before)


def test_final_of_uint8_is_clamped_at_the_end_only() -> None:
    scene = np.full((2, 2, 3), 255, np.uint8)
    settings = Separable(tonemap="reinhard")
    # The composite of 4 is not clamped before the curve.
    assert_close(reference.composite(scene, flat(3.0, 2, 2), settings), 0.8)
    assert_close(reference.composite(scene, flat(3.0, 2, 2), Separable()), 1)
    in_float = reference.composite(scene, flat(3.0, 2, 2), Separable(), dtype=np.float16)
    assert_close(in_float, 4)
    to_uint8 = reference.composite(flat(2.0, 2, 2), flat(0.0, 2, 2), Separable(), dtype=np.uint8)
    assert_close(to_uint8, 1)


@pytest.mark.parametrize(
    ("curve", "colour", "expected"),
    [
        ({"tonemap": "reinhard"}, 3.0, 0.75),
        ({"tonemap": "aces"}, 1.0, 2.54 / 3.16),
        ({"tonemap": "exponential"}, math.log(2), 0.5),
        # Of the toe 0.04, and the compression of what is above 0.76.
        ({"tonemap": "khronos_neutral"}, 1.0, 1 - 0.24**2 / (0.96 + 1 - 1.52)),
        ({"encoding": "gamma22"}, 0.5, 0.7297400528407231),
        ({"encoding": "gamma22"}, -0.5, 0.0),
        ({"encoding": "srgb"}, 0.002, 0.02584),
        ({"encoding": "srgb"}, 0.5, 0.7353569830524495),
        # Report ITU-R BT.2408: reference white and a grey card of 18 %.
        ({"encoding": "pq"}, 1.0, 0.58),
        ({"encoding": "pq"}, 26 / 203, 0.38),
        ({"encoding": "hlg"}, 1.0, 0.75),
        ({"encoding": "hlg"}, 0.18, 0.38),
    ],
)
def test_curves_have_published_values(curve: Any, colour: float, expected: float) -> None:
    final = reference.composite(flat(colour, 1, 1), None, Separable(bloom=False, **curve))
    atol = 0.005 if curve.get("encoding") in ("pq", "hlg") else 1e-12
    assert_allclose(final, expected, rtol=0, atol=atol)


#: Calls of functions that take settings and have no renderer.
OF_SETTINGS: dict[str, Callable[[Any], Any]] = {
    "apply": lambda settings: reference.apply(IMAGE, settings),
    "passes": lambda settings: reference.passes(IMAGE, settings),
    "blur": lambda settings: reference.blur(IMAGE, settings),
    "gain": lambda settings: reference.gain(settings, (16, 12)),
    "composite": lambda settings: reference.composite(IMAGE, IMAGE, settings),
    "vjp": lambda settings: reference.vjp(IMAGE, settings)[1]({"final": IMAGE})["intensity"],
    "measured": lambda settings: psf.measured(settings, (16, 12)).array((16, 12)),
}


@pytest.mark.parametrize("call", OF_SETTINGS)
def test_the_name_of_a_preset_is_settings(call: str) -> None:
    given, named = OF_SETTINGS[call](presets["deferred"]), OF_SETTINGS[call]("deferred")
    np.testing.assert_equal(named, given)


def test_names_where_a_renderer_searches(renderer: Renderer) -> None:
    search: Any = {"renderer": renderer, "max_calls": 3}
    found = vkbloom.fit(IMAGE, IMAGE, "kino", "intensity", **search)
    assert found.settings.method == "kino"
    found = vkbloom.translate("deferred", "kino", size=(32, 24), **search)
    assert found.settings.method == "kino"
    axes = {"settings": ["kino", "deferred"]}
    by_name = vkbloom.grid(IMAGE, axes=axes, renderer=renderer)
    assert by_name.identical(
        vkbloom.grid(
            IMAGE,
            axes={"settings": [presets[name] for name in axes["settings"]]},
            renderer=renderer,
        )
    )


@pytest.mark.parametrize("value", [1e5, 1e10])
def test_no_method_limits_what_buffers_of_single_floats_hold(
    renderer: Renderer, value: float
) -> None:
    """Unless the reference does so; a transform's error is relative to its largest value."""
    image = np.zeros((15, 22, 4), np.float32)
    image[6:8, 9:12] = value
    for name, preset in presets_of_low_levels(22).items():
        settings = preset.replace(format="rgba32float", dither=False, tonemap="none")
        got, expected = renderer.apply(image, settings)["bloom"], reference.apply(image, settings)
        limit = 1e-5 * max(np.abs(expected["bloom"]).max(), 1)
        assert np.abs(got - expected["bloom"]).max() < limit, name
