"""The NumPy reference: numbers by hand, names, composites, curves and encodings.

test_matrix.py compares the rest of it with the shaders.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from tests.images import random_image
from vkbloom import DualKawase, Pyramid, Separable, reference

TUTORIAL_SUM = 0.227027 + 3 * (0.1945946 + 0.1216216 + 0.054054 + 0.016216)
DEFERRED = (0.175713, 0.121703, 0.065984, 0.028002, 0.0093)


def assert_close(actual: Any, expected: Any) -> None:
    """Equal except for the rounding of doubles in sums of a few hundred products."""
    assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)


def flat(value: float, height: int = 12, width: int = 16) -> NDArray[np.float64]:
    return np.full((height, width, 3), value)


@pytest.mark.parametrize(
    ("settings", "gain"),
    [
        (Separable(), 1.3864856**2),
        # The nine weights as printed sum to 0.625691; the published sum, 0.6264, is 0.0007 more.
        (Separable(weights=DEFERRED, blur_strength=1.0), 0.625691**2),
        # 0.175713 + 1.5 * (0.625691 - 0.175713) in each of six passes.
        (Separable(weights=DEFERRED, loops=3, blur_scale=1.1), 0.85068**6),
        # The centre counts four times.
        (Separable(first_tap=0), (TUTORIAL_SUM + 3 * 0.227027) ** 2),
        (
            Separable(layers=((1.0, 1.0), (2.0, 0.5), (4.0, 0.25)), loops=2),
            1.75 * TUTORIAL_SUM**4,
        ),
        (Pyramid(threshold=2.0), 0.0),
        # b = 1: max(q, b - 0.25) / b with q = min(0.75 + 0.125, 0.25)^2 / (0.5 + 1e-5).
        (Pyramid(threshold=0.25, knee=0.5), 0.75),
        (Pyramid(levels=3, level_weights=(1.0, 0.5, -0.25)), 1.25),
    ],
)
def test_gain(settings: Any, gain: float) -> None:
    assert reference.gain(settings) == pytest.approx(gain, rel=1e-7)


# --- Names, sizes and the way from image to bloom buffers ---


@pytest.mark.parametrize(
    ("settings", "names"),
    [
        (Separable(), "glow blur_vertical bloom final"),
        (Separable(loops=2, layers=((1.0, 1.0), (2.0, 1.0))), "glow blur_vertical bloom final"),
        (Separable(direct=True), "glow bloom final"),
        (Pyramid(levels=3), "glow down_0 down_1 down_2 up_1 up_0 bloom final"),
        (Pyramid(levels=1), "glow down_0 bloom final"),
        (DualKawase(levels=2), "glow down_0 down_1 up_0 bloom final"),
    ],
)
def test_names_in_the_order_of_the_data_flow(settings: Any, names: str) -> None:
    image = random_image(20, 24)
    framebuffers = reference.apply(image, settings)
    assert list(framebuffers) == names.split()
    assert list(reference.passes(image, settings)) == names.split()[1:-1]
    assert all(framebuffer.dtype == np.float64 for framebuffer in framebuffers.values())


def test_reduction_samples_at_pixel_centres() -> None:
    image = random_image(8, 8)
    half = reference.apply(image, Separable(bloom_scale=0.5))["glow"][..., :3]
    assert_close(half, image.reshape(4, 2, 4, 2, 3).mean(axis=(1, 3)))
    # At a quarter, the centre of a bloom pixel lies among the inner four of its sixteen.
    quarter = reference.apply(image, Separable(bloom_scale=0.25))["glow"][..., :3]
    inner = image.reshape(2, 4, 2, 4, 3)[:, 1:3, :, 1:3]
    assert_close(quarter, inner.mean(axis=(1, 3)))


@pytest.mark.parametrize(
    ("brightness", "scale"),
    [
        (0.5, 0.0),  # below threshold - k
        (1.0, 0.5**2 / (2 + 1e-5)),  # in the middle of the knee
        (1.25, 0.75**2 / (2 + 1e-5) / 1.25),
        (2.0, 0.5),  # beyond it: (2 - 1) / 2
        (-1.0, 0.0),
    ],
)
def test_soft_knee(brightness: float, scale: float) -> None:
    colour = np.array([brightness, min(brightness, 0.25), min(brightness, 0.5)])
    glow = reference.apply(np.tile(colour, (3, 3, 1)), Separable(threshold=1.0, knee=0.5))["glow"]
    assert_close(glow[..., :3], np.tile(colour * scale, (3, 3, 1)))


# --- Storage ---


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


def test_a_negative_luminance_counts_as_0_in_the_firefly_filter() -> None:
    # 1 / (1 - 1) would be infinite.
    passes = reference.passes(np.full((8, 8, 3), -1.0), Pyramid(firefly_filter=True))
    assert_array_equal(passes["down_0"], np.full((4, 4, 3), -1.0))


def final_of(colour: Any, **settings: Any) -> NDArray[np.float64]:
    """Final of one colour without bloom, as float32 has it (unclamped)."""
    image = np.asarray(colour, float) * np.ones((1, 1, 3))
    pixel: NDArray[np.float64] = reference.composite(
        image, None, Separable(bloom=False, **settings)
    )[0, 0]
    return pixel


@pytest.mark.parametrize(
    ("mode", "intensity", "expected"),
    [
        ("add", 0.5, 0.4 + 0.5 * 1.6),
        ("mix", 0.25, 0.4 + 1.2 * 0.25),
        ("screen", 0.5, 1 - 0.6 * 0.2),
        ("screen", 1.0, 1.0),  # 1.6 counts as 1
    ],
)
def test_composites(mode: Any, intensity: float, expected: float) -> None:
    settings = Separable(composite=mode, intensity=intensity)
    final = reference.composite(flat(0.4), flat(1.6), settings)
    assert_close(final, expected)


def test_exposure_comes_after_the_composite_and_before_the_curve() -> None:
    settings = Separable(exposure=2.0, tonemap="reinhard", encoding="gamma22")
    final = reference.composite(flat(0.25), flat(0.5), settings)
    assert_close(final, (3 / 4) ** (1 / 2.2))


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
    ("tonemap", "colour", "expected"),
    [
        ("none", 3.0, 3.0),
        ("reinhard", 1.0, 0.5),
        ("reinhard", 3.0, 0.75),
        ("aces", 0.0, 0.0),
        ("aces", 1.0, 2.54 / 3.16),  # about 0.8
        ("aces", 0.18, 0.18 * 0.4818 / (0.18 * 1.0274 + 0.14)),
        ("aces", 100.0, 1.0),
        ("exponential", math.log(2), 0.5),
        ("khronos_neutral", 0.5, 0.46),  # the toe's 0.04 and nothing else
        ("khronos_neutral", 0.8, 0.76),  # where the compression starts
        ("khronos_neutral", 0.04, 0.01),  # x - (x - x^2 / 0.16)
        ("khronos_neutral", 1.0, 1 - 0.24**2 / (0.96 + 1 - 1.52)),
        ("khronos_neutral", 1e9, 1.0),
        ("agx", 0.0, 0.0),
        ("agx", 1e3, (15.5 - 40.14 + 31.96 - 6.868 + 0.4298 + 0.1191 - 0.00232) ** 2.2),
    ],
)
def test_tone_map_of_grey(tonemap: Any, colour: float, expected: float) -> None:
    # AgX's matrices keep grey to their four printed digits only.
    tolerance = 2e-4 if tonemap == "agx" else 1e-8
    assert_allclose(final_of(colour, tonemap=tonemap), expected, atol=tolerance, rtol=0)


@pytest.mark.parametrize(
    ("encoding", "value", "expected"),
    [
        ("none", 0.3, 0.3),
        ("none", -0.3, -0.3),
        ("gamma22", 0.5, 0.7297400528407231),
        ("gamma22", -0.5, 0.0),
        ("srgb", 0.002, 0.02584),
        ("srgb", 0.5, 0.7353569830524495),
        ("srgb", 1.0, 1.0),
        ("srgb", -0.5, 0.0),
    ],
)
def test_encodings(encoding: Any, value: float, expected: float) -> None:
    assert_close(final_of(value, encoding=encoding), expected)


# Report ITU-R BT.2408: reference white and a grey card of 18 %, in % of the signal.
@pytest.mark.parametrize(
    ("encoding", "value", "percent"),
    [("pq", 1.0, 58), ("pq", 26 / 203, 38), ("hlg", 1.0, 75), ("hlg", 0.18, 38)],
)
def test_hdr_encodings_have_the_signals_of_bt_2408(
    encoding: Any, value: float, percent: int
) -> None:
    assert round(100 * final_of(value, encoding=encoding)[0]) == percent
