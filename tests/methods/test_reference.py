"""The NumPy reference: slow loops, numbers by hand, properties, special values and errors."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.methods.reference_cases import (
    DEFERRED,
    DOWN_13,
    TUTORIAL_SUM,
    assert_close,
    draw,
    flat,
    random_image,
    slow_direct,
    slow_dual_kawase,
    slow_pyramid,
    slow_separable,
    slow_taps,
    texture,
)
from vkbloom import DualKawase, Pyramid, Separable, reference


def test_gain_of_the_tutorial() -> None:
    assert round(TUTORIAL_SUM, 4) == 1.3865
    assert reference.gain(Separable()) == pytest.approx(1.922, abs=5e-4)
    assert reference.gain(Separable()) == pytest.approx(TUTORIAL_SUM**2, rel=1e-12)


def test_gain_of_the_deferred_weights() -> None:
    # The nine weights as printed sum to 0.625691; the published sum, 0.6264, is 0.0007 more.
    settings = Separable(weights=DEFERRED, blur_strength=1.0)
    assert reference.gain(settings) == pytest.approx(0.625691**2, rel=1e-12)
    # 0.175713 + 1.5 * (0.625691 - 0.175713) in each of six passes.
    recommended = Separable(weights=DEFERRED, loops=3, blur_scale=1.1)
    assert reference.gain(recommended) == pytest.approx(0.85068**6, rel=1e-12)


def test_gain_of_the_outline_counts_the_centre_four_times() -> None:
    expected = TUTORIAL_SUM + 3 * 0.227027
    assert reference.gain(Separable(first_tap=0)) == pytest.approx(expected**2, rel=1e-12)


def test_gain_of_layers_and_loops() -> None:
    settings = Separable(layers=((1.0, 1.0), (2.0, 0.5), (4.0, 0.25)), loops=2)
    assert reference.gain(settings) == pytest.approx(1.75 * TUTORIAL_SUM**4, rel=1e-12)


def test_gain_includes_the_threshold() -> None:
    assert reference.gain(Pyramid(threshold=2.0)) == 0
    # b = 1: max(q, b - 0.25) / b with q = min(0.75 + 0.125, 0.25)^2 / (0.5 + 1e-5).
    assert reference.gain(Pyramid(threshold=0.25, knee=0.5)) == pytest.approx(0.75, rel=1e-12)


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
    # Between sizes of no simple ratio, and upwards.
    odd = reference.apply(image, Separable(bloom_size=(11, 5)))["glow"][..., :3]
    assert_close(odd, draw((11, 5), lambda u, v: texture(image, u, v)))


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


# --- Alpha, NaN, infinity ---


# --- Errors ---


@pytest.mark.parametrize(
    ("image", "error", "words"),
    [
        (np.zeros((4, 4, 3), np.int32), TypeError, "image: int32 is not uint8"),
        (np.zeros((4, 4)), ValueError, r"image: shape \(4, 4\) is not \(H, W, C\)"),
        (np.zeros((0, 4, 3)), ValueError, r"image: shape \(0, 4, 3\) is not"),
        (np.zeros((4, 4, 2)), ValueError, "image: 2 channels are not 3 or 4"),
    ],
)
def test_wrong_images(image: Any, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        reference.apply(image, Separable())


def test_wrong_arguments() -> None:
    with pytest.raises(ValueError, match=r"size: \(0, 4\) is not"):
        reference.blur(flat(1.0), Separable(), (0, 4))
    with pytest.raises(ValueError, match="format: 'rgb565' is not"):
        reference.blur(flat(1.0), Separable(), format="rgb565")
    with pytest.raises(ValueError, match=r"firefly_filter needs .*not 2"):
        reference.blur(flat(1.0, channels=2), Pyramid(firefly_filter=True))
    with pytest.raises(ValueError, match="bloom: height and width"):
        reference.composite(flat(1.0), flat(1.0, 3, 3), Separable())
    with pytest.raises(TypeError, match="bloom: None is not an array"):
        reference.composite(flat(1.0), None, Separable())


@pytest.mark.parametrize("settings", [None, "kino", {"threshold": 1.0}], ids=repr)
def test_wrong_settings(settings: Any) -> None:
    calls: list[Callable[[], object]] = [
        *(partial(call, flat(1.0), settings) for call in (reference.apply, reference.blur)),
        *(partial(call, flat(1.0), settings) for call in (reference.passes, reference.vjp)),
        partial(reference.gain, settings),
        partial(reference.composite, flat(1.0), flat(1.0), settings),
    ]
    for call in calls:
        with pytest.raises(TypeError, match=r"^settings: .* is not a Settings"):
            call()


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


@pytest.mark.parametrize(
    "settings",
    [
        Separable(),
        Separable(blur_scale=1.3, texel="x", first_tap=0),
        Separable(loops=2, blur_strength=0.7, layers=((1.0, 1.0), (2.5, 0.5))),
    ],
)
def test_separable_is_what_the_shader_computes(settings: Any) -> None:
    glow = random_image(5, 7)
    expected = slow_separable(glow, settings, (10, 9))
    assert_close(reference.blur(glow, settings, (10, 9)), expected)


def test_direct_is_what_a_loop_over_all_taps_computes() -> None:
    glow = random_image(5, 6)
    settings = Separable(direct=True, blur_scale=1.2, weights=(0.4, 0.2, 0.1))
    expected = slow_direct(glow, settings, (8, 7))
    assert_close(reference.blur(glow, settings, (8, 7)), expected)


def test_pyramid_is_what_loops_over_its_taps_compute() -> None:
    glow = random_image(9, 13)
    expected = slow_pyramid(glow, [(6, 4), (3, 2)], 1.3, (11, 10))
    settings = Pyramid(levels=2, radius=1.3)
    assert_close(reference.blur(glow, settings, (11, 10)), expected)


def test_pyramid_of_three_levels_is_their_sum_divided_by_three() -> None:
    glow = random_image(16, 16, 1)
    expected = slow_pyramid(glow, [(8, 8), (4, 4), (2, 2)], 1.0, (16, 16))
    assert_close(reference.blur(glow, Pyramid(levels=3)), expected)


def test_firefly_filter_weights_the_groups_of_the_first_downsample_alone() -> None:
    glow = random_image(12, 12) ** 4 * 30
    shares = []
    corners = [(x, y) for x in (-1, 1) for y in (-1, 1)]
    means = [slow_taps(glow, (6, 6), [(x, y, 0.25) for x, y in corners])]
    shares.append(0.5)
    for corner_x, corner_y in corners:
        group = [(x + corner_x, y + corner_y, 0.25) for x, y in corners]
        means.append(slow_taps(glow, (6, 6), group))
        shares.append(0.125)
    weights = [
        share / (1 + mean @ np.array([0.2126, 0.7152, 0.0722]))
        for share, mean in zip(shares, means, strict=True)
    ]
    expected = sum(w[..., None] * m for w, m in zip(weights, means, strict=True))
    expected = expected / sum(weights)[..., None]
    passes = reference.passes(glow, Pyramid(levels=2, firefly_filter=True))
    assert_close(passes["down_0"], expected)
    assert_close(passes["down_1"], slow_taps(expected, (3, 3), DOWN_13))


def test_a_negative_luminance_counts_as_0_in_the_firefly_filter() -> None:
    # 1 / (1 - 1) would be infinite.
    passes = reference.passes(np.full((8, 8, 3), -1.0), Pyramid(firefly_filter=True))
    assert_array_equal(passes["down_0"], np.full((4, 4, 3), -1.0))


def test_dual_kawase_is_what_loops_over_its_taps_compute() -> None:
    glow = random_image(9, 13)
    expected = slow_dual_kawase(glow, [(6, 4), (3, 2)], 1.3, (11, 10))
    settings = DualKawase(levels=2, offset=1.3)
    assert_close(reference.blur(glow, settings, (11, 10)), expected)


SIZES = st.tuples(st.integers(1, 24), st.integers(1, 24))


@given(size=SIZES, scale=st.floats(0, 16), strength=st.floats(0, 4))
def test_direct_equals_separable(size: tuple[int, int], scale: float, strength: float) -> None:
    glow = random_image(*size)
    two, one = (
        reference.blur(glow, Separable(direct=direct, blur_scale=scale, blur_strength=strength))
        for direct in (False, True)
    )
    assert_allclose(one, two, rtol=1e-11, atol=1e-12)


@given(size=SIZES, value=st.floats(0, 60000))
def test_large_images_are_read_in_blocks_like_small_ones(
    size: tuple[int, int], value: float
) -> None:
    # More rows and columns than a block has, against the same rows and columns one by one.
    glow = np.zeros((size[0] + 140, size[1] + 70, 1))
    glow[-size[0] :, -size[1] :] = value
    bloom = reference.blur(glow, Separable())[..., 0]
    corner = reference.blur(glow[-size[0] - 20 :, -size[1] - 20 :], Separable())[..., 0]
    assert_allclose(bloom[-size[0] - 10 :, -size[1] - 10 :], corner[10:, 10:], rtol=1e-12)
    assert_array_equal(bloom[: -size[0] - 10], 0)
