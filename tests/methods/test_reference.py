"""The NumPy reference: numbers worked out by hand, sizes, storage, special values and errors."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.methods.reference_cases import (
    DEFERRED,
    FIREFLY,
    METHODS,
    TUTORIAL_SUM,
    assert_close,
    draw,
    flat,
    impulse,
    random_image,
    slow_taps,
    tent,
    texture,
)
from vkbloom import DualKawase, Pyramid, Separable, reference

# --- Numbers by hand ---


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


def test_impulse_response_of_the_tutorial() -> None:
    bloom = reference.blur(impulse(11, 11, 5, 5), Separable())[..., 0]
    profile = [0.227027, *(1.5 * w for w in (0.1945946, 0.1216216, 0.054054, 0.016216)), 0]
    for y in range(11):
        for x in range(11):
            assert bloom[y, x] == pytest.approx(
                profile[abs(y - 5)] * profile[abs(x - 5)], abs=1e-15
            )


def test_taps_between_texels_are_interpolated() -> None:
    settings = Separable(weights=(0.5, 0.25), blur_strength=1.0, blur_scale=0.5)
    bloom = reference.blur(impulse(5, 5, 2, 2), settings)[..., 0]
    # Half a texel to each side finds half of the impulse: 0.5 + 2 * 0.25 / 2 at the centre.
    profile = np.array([0, 0.125, 0.75, 0.125, 0])
    assert_close(bloom, np.outer(profile, profile))


@pytest.mark.parametrize(
    ("height", "width", "profile"),
    [
        (4, 8, [0.125, 0.75, 0.125, 0]),  # half a texel of the height
        (8, 4, [0, 0, 0.25, 0, 0.5, 0, 0.25, 0]),  # two texels of it
    ],
)
def test_texel_x_steps_by_the_width_in_both_directions(
    height: int, width: int, profile: list[float]
) -> None:
    settings = Separable(weights=(0.5, 0.25), blur_strength=1.0, texel="x")
    glow = impulse(height, width, height // 2 if height > width else 1, 2)
    framebuffers = reference.passes(glow, settings)
    assert_close(framebuffers["blur_vertical"][:, 2, 0], profile)
    row = framebuffers["bloom"][profile.index(max(profile)), :, 0] / max(profile)
    assert_close(row[1:4], [0.25, 0.5, 0.25])


def test_the_edge_repeats() -> None:
    settings = Separable(weights=(0.5, 0.25), blur_strength=1.0)
    bloom = reference.blur(impulse(1, 4, 0, 0), settings)[0, :, 0]
    # The column is one texel high, so the vertical pass keeps it; to the left of the first
    # texel the second tap finds that texel again.
    assert_close(bloom, [0.75, 0.25, 0, 0])


def test_loops_repeat_the_blur() -> None:
    glow = impulse(15, 15, 7, 7)
    settings = Separable(weights=(0.5, 0.25), blur_strength=1.0)
    twice = reference.blur(reference.blur(glow, settings), settings)
    looped = reference.passes(glow, Separable(weights=(0.5, 0.25), blur_strength=1.0, loops=2))
    assert_close(looped["bloom"], twice)
    # (1 2 1) / 4 with itself is (1 4 6 4 1) / 16.
    assert_close(looped["bloom"][7, 5:10, 0], np.array([1, 4, 6, 4, 1]) * 6 / 256)
    last = reference.passes(reference.blur(glow, settings), settings)["blur_vertical"]
    assert_close(looped["blur_vertical"], last)


def test_layers_are_whole_blurs_that_add_up() -> None:
    glow = random_image(10, 12)
    layers = ((1.0, 1.0), (2.0, 0.5), (4.0, 0.25))
    expected = sum(s * reference.blur(glow, Separable(blur_scale=0.9 * k)) for k, s in layers)
    framebuffers = reference.passes(glow, Separable(blur_scale=0.9, layers=layers))
    assert_close(framebuffers["bloom"], expected)
    last = reference.passes(glow, Separable(blur_scale=0.9 * 4))["blur_vertical"]
    assert_close(framebuffers["blur_vertical"], last)


def test_direct_equals_separable_at_the_size_of_the_bloom_buffers() -> None:
    glow = random_image(9, 11)
    cases: list[dict[str, Any]] = [
        {},
        {"loops": 2, "blur_scale": 1.37},
        {"layers": ((1.0, 0.5), (3.0, 2.0))},
    ]
    for extra in cases:
        separable = reference.blur(glow, Separable(**extra))
        assert_close(reference.blur(glow, Separable(direct=True, **extra)), separable)


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


@pytest.mark.parametrize("make", [Separable, Pyramid, DualKawase])
def test_bloom_off_leaves_final_alone(make: Callable[..., Any]) -> None:
    image = random_image(20, 24)
    framebuffers = reference.apply(image, make(bloom=False))
    assert list(framebuffers) == ["final"]
    assert_array_equal(framebuffers["final"], image)


@pytest.mark.parametrize(
    ("extra", "expected"),
    [
        ({}, (13, 17)),
        ({"bloom_scale": 0.6}, (7, 10)),
        ({"bloom_scale": 0.01}, (1, 1)),
        ({"bloom_size": (5, 3)}, (3, 5)),
    ],
)
def test_size_of_the_bloom_buffers(extra: dict[str, Any], expected: tuple[int, int]) -> None:
    framebuffers = reference.apply(random_image(13, 17), Separable(**extra))
    assert framebuffers["glow"].shape == (*expected, 4)
    assert framebuffers["blur_vertical"].shape == (*expected, 4)
    assert framebuffers["bloom"].shape == (13, 17, 4)
    assert framebuffers["final"].shape == (13, 17, 3)


@pytest.mark.parametrize("make", [Pyramid, DualKawase])
@pytest.mark.parametrize(
    ("size", "levels", "expected"),
    [
        ((17, 13), 6, [(8, 6), (4, 3), (2, 1)]),
        ((64, 5), 3, [(32, 2), (16, 1), (8, 1)]),
        ((1, 1), 4, [(1, 1)]),
        ((3, 2), 4, [(1, 1)]),
        ((16, 16), 2, [(8, 8), (4, 4)]),
    ],
)
def test_sizes_of_the_levels(
    make: Callable[..., Any], size: tuple[int, int], levels: int, expected: list[tuple[int, int]]
) -> None:
    glow = random_image(size[1], size[0])
    framebuffers = reference.passes(glow, make(levels=levels), (9, 7))
    downs = [a.shape for name, a in framebuffers.items() if name.startswith("down_")]
    assert downs == [(height, width, 3) for width, height in expected]
    for k in range(len(expected) - 1):
        assert framebuffers[f"up_{k}"].shape == framebuffers[f"down_{k}"].shape
    assert f"up_{len(expected) - 1}" not in framebuffers
    assert framebuffers["bloom"].shape == (7, 9, 3)


def test_stored_levels_of_the_pyramid_are_sums() -> None:
    glow = random_image(24, 24)
    framebuffers = reference.passes(glow, Pyramid(levels=3))
    up_1 = slow_taps(framebuffers["down_2"], (6, 6), tent(1.0)) + framebuffers["down_1"]
    assert_close(framebuffers["up_1"], up_1)
    up_0 = slow_taps(framebuffers["up_1"], (12, 12), tent(1.0)) + framebuffers["down_0"]
    assert_close(framebuffers["up_0"], up_0)
    assert_close(framebuffers["bloom"], slow_taps(up_0, (24, 24), tent(1.0)) / 3)


def test_stored_levels_of_the_pyramid_are_means_in_eight_bits() -> None:
    glow = random_image(24, 24)
    sums = reference.passes(glow, Pyramid(levels=3))
    means = reference.passes(glow, Pyramid(levels=3), format="rgba8unorm")
    assert_close(means["up_1"], sums["up_1"] / 2)
    assert_close(means["up_0"], sums["up_0"] / 3)
    assert_close(means["bloom"], sums["bloom"])


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


def test_threshold_follows_the_reduction() -> None:
    image = flat(0.0, 2, 2)
    image[0, 0] = 1.0
    glow = reference.apply(image, Separable(bloom_scale=0.5, threshold=0.5))["glow"]
    assert_array_equal(glow[..., :3], 0)
    glow = reference.apply(image, Separable(bloom_scale=0.5, threshold=0.2))["glow"]
    assert_close(glow[..., :3], 0.25)


def test_hard_threshold_is_of_the_luminance() -> None:
    image = np.array([[[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0.5], [0.3, 0.25, 9]]], float)
    glow = reference.apply(image, Separable(threshold=0.5))["glow"][0, :, :3]
    # 0.5 grey has the luminance 0.5, which is not above 0.5.
    assert_array_equal(glow, image[0] * np.array([[0], [1], [0], [0], [1]]))


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


def test_uint8_reads_as_fractions_of_255() -> None:
    image = np.full((4, 4, 3), 51, np.uint8)
    framebuffers = reference.apply(image, Separable())
    assert_close(framebuffers["glow"][..., :3], 0.2)
    assert_close(framebuffers["final"], 0.2 * (1 + TUTORIAL_SUM**2))


def test_unorm_buffers_and_final_are_clamped_where_they_are_stored() -> None:
    # A line as bright as can be: the vertical pass makes 1.5 of it, which is stored as 1.
    image = np.zeros((7, 7, 3), np.uint8)
    image[:, 3] = 255
    kernel: dict[str, Any] = {"weights": (0.5, 0.5), "blur_strength": 1.0}
    framebuffers = reference.apply(image, Separable(**kernel))
    assert_close(framebuffers["blur_vertical"][:, 3, :3], 1)
    assert_close(framebuffers["bloom"][3, :, 0], [0, 0, 0.5, 0.5, 0.5, 0, 0])
    assert_close(framebuffers["final"][3, :, 0], [0, 0, 0.5, 1, 0.5, 0, 0])
    direct = reference.apply(image, Separable(direct=True, **kernel))
    assert_close(direct["bloom"][3, :, 0], [0, 0, 0.75, 0.75, 0.75, 0, 0])
    in_float = reference.apply(image, Separable(format="rgba16float", **kernel))
    assert_close(in_float["blur_vertical"][:, 3, :3], 1.5)
    assert in_float["final"].max() == 1


def test_unorm_buffers_are_clamped_between_loops_and_layers() -> None:
    image = (impulse(9, 9, 4, 4) * 255).astype(np.uint8)
    kernel: dict[str, Any] = {"weights": (1.5, 0.1), "blur_strength": 1.0}
    once, twice = Separable(**kernel), Separable(loops=2, **kernel)
    clamped = reference.blur(image, twice)
    first = reference.blur(image, once)
    assert_close(clamped, reference.blur(first, once, format="rgba8unorm"))
    # Clamping the end alone is not the same.
    at_the_end = np.clip(reference.blur(image / 255, twice), 0, 1)
    assert np.abs(clamped - at_the_end).max() > 0.01
    layers = Separable(weights=(1.0,), layers=((1.0, 0.75), (2.0, 0.75)))
    flat_255 = np.full((4, 4, 3), 255, np.uint8)
    assert_close(reference.blur(flat_255, layers), 1)
    assert_close(reference.blur(flat_255, layers, format="rgba16float"), 1.5)


def test_format_of_the_settings_decides_over_the_dtype() -> None:
    image = flat(4.0).astype(np.float32)
    framebuffers = reference.apply(image, Pyramid(format="rgba8unorm"))
    assert_close(framebuffers["glow"][..., :3], 1)
    assert_close(framebuffers["final"], 5)  # the image's own 4 is not clamped
    assert_close(reference.apply(image, Pyramid())["bloom"][..., :3], 4)
    assert_close(reference.blur(image, Separable(), format="rgba8unorm"), 1)
    assert reference.blur(image.astype(np.uint8) * 60, Separable(), format="rgba32float").max() > 1


def test_float16_is_not_rounded() -> None:
    image = flat(1 / 3).astype(np.float16)
    value = float(np.float16(1 / 3))
    assert_close(reference.apply(image, Pyramid())["final"], 2 * value)


# --- Alpha, NaN, infinity ---


@pytest.mark.parametrize("settings", [*METHODS, FIREFLY])
def test_alpha_is_the_images_and_1_in_the_bloom_buffers(settings: Any) -> None:
    image = random_image(16, 20, 4)
    framebuffers = reference.apply(image, settings)
    assert_array_equal(framebuffers["final"][..., 3], image[..., 3])
    for name, framebuffer in framebuffers.items():
        assert framebuffer.shape[2] == 4
        if name != "final":
            assert_array_equal(framebuffer[..., 3], 1)
    without = reference.apply(image[..., :3], settings)
    assert_array_equal(without["final"], framebuffers["final"][..., :3])
    assert_array_equal(without["bloom"], framebuffers["bloom"])
    bloom = reference.blur(image, settings)
    assert_array_equal(bloom[..., 3], 1)
    assert_array_equal(bloom[..., :3], reference.blur(image[..., :3], settings))


@pytest.mark.parametrize("settings", [*METHODS, FIREFLY])
def test_nan_and_infinity_are_not_spread(settings: Any) -> None:
    image = random_image(16, 20)
    image[3, 4, 0], image[8, 9, 1], image[0, 0, 2] = np.nan, np.inf, -np.inf
    cleaned = np.where(np.isfinite(image), image, 0)
    spoiled, clean = reference.apply(image, settings), reference.apply(cleaned, settings)
    for name in clean:
        if name != "final":
            assert_array_equal(spoiled[name], clean[name])
    bad = ~np.isfinite(image)
    assert_array_equal(spoiled["final"][bad], image[bad])
    assert_array_equal(spoiled["final"][~bad], clean["final"][~bad])
    assert_array_equal(reference.blur(image, settings), reference.blur(cleaned, settings))


@pytest.mark.parametrize(
    "tonemap", ["none", "reinhard", "aces", "exponential", "khronos_neutral", "agx"]
)
def test_nan_and_infinity_stay_at_their_own_components(tonemap: Any) -> None:
    image = random_image(4, 4, 4)
    image[1, 1, 0], image[2, 2, 1], image[3, 3, 3] = np.nan, -np.inf, np.nan
    settings = Separable(tonemap=tonemap, encoding="srgb", composite="screen")
    final = reference.apply(image, settings)["final"]
    assert_array_equal(np.isnan(final), np.isnan(image))
    assert final[2, 2, 1] == -np.inf
    assert np.isinf(final).sum() == 1


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
