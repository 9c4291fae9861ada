"""The NumPy reference: numbers worked out by hand, slow loops beside it, and properties."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from vkbloom import DualKawase, Pyramid, Separable, reference

Array = NDArray[np.float64]

TUTORIAL_SUM = 0.227027 + 3 * (0.1945946 + 0.1216216 + 0.054054 + 0.016216)
DEFERRED = (0.175713, 0.121703, 0.065984, 0.028002, 0.0093)

METHODS = [
    pytest.param(Separable(), id="separable"),
    pytest.param(Separable(blur_scale=1.7, texel="x", first_tap=0), id="outline"),
    pytest.param(Separable(loops=2, layers=((1.0, 1.0), (2.0, 0.5))), id="loops-layers"),
    pytest.param(Separable(direct=True), id="direct"),
    pytest.param(Pyramid(), id="pyramid"),
    pytest.param(Pyramid(levels=3, radius=1.4), id="pyramid-radius"),
    pytest.param(DualKawase(), id="dual-kawase"),
    pytest.param(DualKawase(levels=2, offset=1.6), id="dual-kawase-offset"),
]
FIREFLY = pytest.param(Pyramid(levels=3, firefly_filter=True), id="firefly")


def assert_close(actual: Any, expected: Any) -> None:
    """Equal except for the rounding of doubles in sums of a few hundred products."""
    assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)


def random_image(height: int, width: int, channels: int = 3, seed: int = 1) -> Array:
    return np.random.default_rng(seed).random((height, width, channels))


def flat(value: float, height: int = 12, width: int = 16, channels: int = 3) -> Array:
    return np.full((height, width, channels), value)


def impulse(height: int, width: int, y: int, x: int) -> Array:
    image = np.zeros((height, width, 1))
    image[y, x] = 1
    return image


# --- Slow loops: one pixel, one tap, one texel at a time, in normalized coordinates ---


def texture(image: Array, u: float, v: float) -> Array:
    """Bilinear value at (u, v), 0..1 from edge to edge, clamped to the edge."""
    height, width, _ = image.shape
    x, y = u * width - 0.5, v * height - 0.5
    left, top = math.floor(x), math.floor(y)
    value = np.zeros(image.shape[2])
    for row, row_weight in ((top, top + 1 - y), (top + 1, y - top)):
        for column, column_weight in ((left, left + 1 - x), (left + 1, x - left)):
            texel = image[min(max(row, 0), height - 1), min(max(column, 0), width - 1)]
            value += row_weight * column_weight * texel
    return value


def draw(size: tuple[int, int], shader: Callable[[float, float], Array]) -> Array:
    """Call the shader at each pixel's centre."""
    width, height = size
    return np.array(
        [
            [shader((i + 0.5) / width, (j + 0.5) / height) for i in range(width)]
            for j in range(height)
        ]
    )


def slow_blur(
    image: Array, size: tuple[int, int], step: tuple[float, float], settings: Any
) -> Array:
    """One pass of the tutorial's shader; `step` in normalized coordinates."""

    def shader(u: float, v: float) -> Array:
        value: Array = settings.weights[0] * texture(image, u, v)
        for i in range(settings.first_tap, len(settings.weights)):
            for side in (i, -i):
                tap = texture(image, u + side * step[0], v + side * step[1])
                value = value + settings.blur_strength * settings.weights[i] * tap
        return value

    return draw(size, shader)


def slow_separable(glow: Array, settings: Any, size: tuple[int, int]) -> Array:
    height, width, _ = glow.shape
    bloom = np.zeros((size[1], size[0], glow.shape[2]))
    for scale, strength in settings.layers:
        step = settings.blur_scale * scale
        step_y = step / (width if settings.texel == "x" else height)
        image = glow
        for loop in range(settings.loops):
            vertical = slow_blur(image, (width, height), (0, step_y), settings)
            target = size if loop == settings.loops - 1 else (width, height)
            image = slow_blur(vertical, target, (step / width, 0), settings)
        bloom = bloom + strength * image
    return bloom


def slow_direct(glow: Array, settings: Any, size: tuple[int, int]) -> Array:
    height, width, _ = glow.shape
    n = len(settings.weights) - 1
    weights = [
        settings.weights[abs(i)] * (settings.blur_strength if i else 1) for i in range(-n, n + 1)
    ]

    def shader(u: float, v: float) -> Array:
        value = np.zeros(glow.shape[2])
        for j, row_weight in enumerate(weights, start=-n):
            for i, column_weight in enumerate(weights, start=-n):
                step = settings.blur_scale
                tap = texture(glow, u + i * step / width, v + j * step / height)
                value += row_weight * column_weight * tap
        return value

    return draw(size, shader)


def slow_taps(
    image: Array, size: tuple[int, int], taps: Sequence[tuple[float, float, float]]
) -> Array:
    """Sum of taps (x, y, weight), x and y in texels of the image."""
    height, width, _ = image.shape

    def shader(u: float, v: float) -> Array:
        value = np.zeros(image.shape[2])
        for x, y, weight in taps:
            value += weight * texture(image, u + x / width, v + y / height)
        return value

    return draw(size, shader)


DOWN_13 = (
    [(0, 0, 0.125)]
    + [(x, y, 0.125) for x in (-1, 1) for y in (-1, 1)]
    + [(x, y, 0.0625) for x, y in ((-2, 0), (2, 0), (0, -2), (0, 2))]
    + [(x, y, 0.03125) for x in (-2, 2) for y in (-2, 2)]
)


def tent(radius: float) -> list[tuple[float, float, float]]:
    weights = {-1: 1, 0: 2, 1: 1}
    return [
        (x * radius, y * radius, weights[x] * weights[y] / 16) for x in weights for y in weights
    ]


def slow_pyramid(
    glow: Array, sizes: list[tuple[int, int]], radius: float, size: tuple[int, int]
) -> Array:
    """Sum of the levels, added on the way up, then divided by their number."""
    downs = [glow]
    for level in sizes:
        downs.append(slow_taps(downs[-1], level, DOWN_13))
    total = downs[-1]
    for down, level in zip(downs[-2:0:-1], sizes[-2::-1], strict=True):
        total = down + slow_taps(total, level, tent(radius))
    return slow_taps(total, size, tent(radius)) / len(sizes)


def slow_dual_kawase(
    glow: Array, sizes: list[tuple[int, int]], offset: float, size: tuple[int, int]
) -> Array:
    half = offset / 2
    diagonals = [(x, y) for x in (-half, half) for y in (-half, half)]
    down = [(0, 0, 0.5)] + [(x, y, 1 / 8) for x, y in diagonals]
    axials = [(-offset, 0), (offset, 0), (0, -offset), (0, offset)]
    up = [(x, y, 1 / 12) for x, y in axials] + [(x, y, 1 / 6) for x, y in diagonals]
    image = glow
    for level in sizes:
        image = slow_taps(image, level, down)
    for level in sizes[-2::-1]:
        image = slow_taps(image, level, up)
    return slow_taps(image, size, up)


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


@pytest.mark.parametrize("settings", [*METHODS, FIREFLY])
def test_a_flat_image_is_multiplied_by_the_gain(settings: Any) -> None:
    expected = 0.3 * reference.gain(settings)
    for framebuffer in (
        reference.blur(flat(0.3), settings),
        reference.blur(flat(0.3), settings, (23, 9)),
        reference.apply(flat(0.3), settings)["bloom"][..., :3],
    ):
        assert_close(framebuffer, expected)


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


# --- Composite, exposure, tone maps, encodings ---


def final_of(colour: Any, **settings: Any) -> Array:
    """Final of one colour without bloom, as float32 has it (unclamped)."""
    image = np.asarray(colour, float) * np.ones((1, 1, 3))
    pixel: Array = reference.composite(image, None, Separable(bloom=False, **settings))[0, 0]
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


def test_screen_clamps_the_scene_too() -> None:
    final = reference.composite(flat(3.0), flat(0.5), Separable(composite="screen"))
    assert_close(final, 1)


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


def test_khronos_neutral_of_a_bright_colour() -> None:
    # f = 0.1 - ... = 0.04, p = 2.96, p_n = 1 - 0.0576 / 2.44, g = 1 / (0.15 (p - p_n) + 1)
    peak = 1 - 0.0576 / 2.44
    kept = 1 / (0.15 * (2.96 - peak) + 1)
    expected = [c * peak / 2.96 * kept + peak * (1 - kept) for c in (2.96, 0.96, 0.06)]
    assert_close(final_of([3.0, 1.0, 0.1], tonemap="khronos_neutral"), expected)


def test_agx_of_a_colour() -> None:
    """The chain of three.js' shader, with its matrices as columns, a component at a time."""

    def times(columns: list[list[float]], vector: list[float]) -> list[float]:
        return [sum(c[row] * v for c, v in zip(columns, vector, strict=True)) for row in range(3)]

    def contrast(x: float) -> float:
        value = 15.5 * x**6 - 40.14 * x**5 + 31.96 * x**4
        return value - 6.868 * x**3 + 0.4298 * x**2 + 0.1191 * x - 0.00232

    to_2020 = [[0.6274, 0.0691, 0.0164], [0.3293, 0.9195, 0.0880], [0.0433, 0.0113, 0.8956]]
    from_2020 = [[1.6605, -0.1246, -0.0182], [-0.5876, 1.1329, -0.1006], [-0.0728, -0.0083, 1.1187]]
    inset = [
        [0.856627153315983, 0.137318972929847, 0.11189821299995],
        [0.0951212405381588, 0.761241990602591, 0.0767994186031903],
        [0.0482516061458583, 0.101439036467562, 0.811302368396859],
    ]
    outset = [
        [1.1271005818144368, -0.1413297634984383, -0.14132976349843826],
        [-0.11060664309660323, 1.157823702216272, -0.11060664309660294],
        [-0.016493938717834573, -0.016493938717834257, 1.2519364065950405],
    ]
    for colour in ([0.8, 0.3, 0.05], [0.02, 0.5, 4.0], [9.0, 8.0, 0.0]):
        stops = [math.log2(c) for c in times(inset, times(to_2020, colour))]
        scaled = [min(max((s + 12.47393) / (4.026069 + 12.47393), 0), 1) for s in stops]
        display = times(outset, [contrast(s) for s in scaled])
        linear = times(from_2020, [max(d, 0) ** 2.2 for d in display])
        expected = [min(max(c, 0), 1) for c in linear]
        assert_close(final_of(colour, tonemap="agx"), expected)


def test_agx_is_linear_out() -> None:
    # Middle grey comes out near middle grey, not near its display value of about 0.46.
    assert 0.15 < final_of(0.18, tonemap="agx")[0] < 0.25


@pytest.mark.parametrize("tonemap", ["reinhard", "aces", "exponential", "khronos_neutral", "agx"])
def test_tone_maps_rise_and_stay_in_range(tonemap: Any) -> None:
    ramp = np.concatenate([np.linspace(0, 2, 400), np.geomspace(2.1, 1e3, 60)])
    image = ramp[None, :, None] * np.ones(3)
    final = reference.composite(image, None, Separable(bloom=False, tonemap=tonemap))
    # AgX's polynomial has no strict slope in the blacks, where it is clamped at 0.
    assert (np.diff(final[0], axis=0) >= -1e-12).all()
    assert final.min() >= 0
    assert final.max() <= 1
    assert final[0, 0, 0] < 1e-6
    assert final[0, -1, 0] > 0.95


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


@given(value=st.floats(0, 4))
def test_encodings_can_be_undone(value: float) -> None:
    gamma = final_of(value, encoding="gamma22")[0]
    assert gamma**2.2 == pytest.approx(value, rel=1e-12, abs=1e-300)
    encoded = final_of(value, encoding="srgb")[0]
    decoded = encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4
    # The two parts of the standard's curve miss each other by 1e-8 where they join.
    assert decoded == pytest.approx(value, rel=1e-7, abs=1e-9)


def test_encoding_and_tone_map_leave_alpha_alone() -> None:
    image = random_image(3, 3, 4)
    settings = Separable(bloom=False, exposure=1.0, tonemap="reinhard", encoding="srgb")
    assert_array_equal(reference.apply(image, settings)["final"][..., 3], image[..., 3])


def test_bloom_off_still_maps_and_encodes() -> None:
    settings = Separable(bloom=False, tonemap="reinhard", encoding="gamma22", composite="mix")
    assert_close(reference.apply(flat(1.0), settings)["final"], 0.5 ** (1 / 2.2))


# --- Properties ---

SIZES = st.tuples(st.integers(1, 24), st.integers(1, 24))


@pytest.mark.parametrize("settings", METHODS)
@given(size=SIZES, target=SIZES, factors=st.tuples(st.floats(-3, 3), st.floats(-3, 3)))
def test_blur_is_linear(
    settings: Any, size: tuple[int, int], target: tuple[int, int], factors: tuple[float, float]
) -> None:
    a, b = random_image(*size, seed=2), random_image(*size, seed=3)
    mixed = reference.blur(factors[0] * a + factors[1] * b, settings, target)
    blurred_a, blurred_b = (reference.blur(image, settings, target) for image in (a, b))
    # The gain of loops and layers makes values of up to about 60 out of 0..1.
    assert_allclose(mixed, factors[0] * blurred_a + factors[1] * blurred_b, rtol=0, atol=1e-11)


@pytest.mark.parametrize("settings", [*METHODS, FIREFLY])
@given(size=SIZES, target=SIZES)
def test_blur_has_no_favourite_side(
    settings: Any, size: tuple[int, int], target: tuple[int, int]
) -> None:
    glow = random_image(*size)
    bloom = reference.blur(glow, settings, target)
    for flip in (np.fliplr, np.flipud):
        # A flip reverses the order of the sums, and positions round differently.
        flipped = reference.blur(flip(glow), settings, target)
        assert_allclose(flipped, flip(bloom), rtol=0, atol=1e-11)


@pytest.mark.parametrize("settings", [p for p in [*METHODS, FIREFLY] if p.id != "outline"])
@given(size=SIZES)
def test_blur_has_no_favourite_axis(settings: Any, size: tuple[int, int]) -> None:
    glow = random_image(*size)
    transposed = reference.blur(glow.swapaxes(0, 1), settings)
    assert_allclose(transposed, reference.blur(glow, settings).swapaxes(0, 1), rtol=0, atol=1e-11)


@pytest.mark.parametrize("settings", [*METHODS, FIREFLY])
@given(size=SIZES, target=SIZES)
def test_bloom_lies_between_the_extremes_times_the_gain(
    settings: Any, size: tuple[int, int], target: tuple[int, int]
) -> None:
    glow = random_image(*size)
    bloom = reference.blur(glow, settings, target) / reference.gain(settings)
    assert bloom.min() >= glow.min() - 1e-12
    assert bloom.max() <= glow.max() + 1e-12


@pytest.mark.parametrize("settings", METHODS)
@given(x=st.integers(56, 72), y=st.integers(56, 72))
def test_energy_of_an_impulse_is_the_gain(settings: Any, x: int, y: int) -> None:
    if settings.method == "pyramid" and settings.levels > 3:
        settings = Pyramid(levels=3)  # deeper levels reach the edge of this image
    if getattr(settings, "radius", 1.0) != 1.0 or getattr(settings, "offset", 1.0) != 1.0:
        # Taps off the grid of half texels weigh the texels of a level unequally: only the
        # energy of a whole block of pixels that share a place in the levels is kept.
        glow = np.zeros((128, 128, 1))
        glow[y - y % 8 : y - y % 8 + 8, x - x % 8 : x - x % 8 + 8] = 1 / 64
    else:
        glow = impulse(128, 128, y, x)
    assert reference.blur(glow, settings).sum() == pytest.approx(
        reference.gain(settings), rel=1e-12
    )


@given(size=SIZES, scale=st.floats(0, 16), strength=st.floats(0, 4))
def test_direct_equals_separable(size: tuple[int, int], scale: float, strength: float) -> None:
    glow = random_image(*size)
    two, one = (
        reference.blur(glow, Separable(direct=direct, blur_scale=scale, blur_strength=strength))
        for direct in (False, True)
    )
    assert_allclose(one, two, rtol=1e-11, atol=1e-12)


@given(size=SIZES, target=SIZES, seed=st.integers(0, 99))
def test_unorm_stays_in_range(size: tuple[int, int], target: tuple[int, int], seed: int) -> None:
    image = (random_image(*size, seed=seed) * 255).astype(np.uint8)
    for settings in (Separable(blur_strength=4.0), Pyramid(), DualKawase()):
        framebuffers = reference.passes(image, settings, target)
        framebuffers |= reference.apply(image, settings)
        for framebuffer in framebuffers.values():
            assert framebuffer.min() >= 0
            assert framebuffer.max() <= 1


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


# --- Errors ---


@pytest.mark.parametrize(
    ("image", "error", "words"),
    [
        (np.zeros((4, 4, 3), np.int32), TypeError, "image must be uint8.*not int32"),
        (np.zeros((4, 4)), ValueError, r"image must have the shape \(H, W, C\), not \(4, 4\)"),
        (np.zeros((0, 4, 3)), ValueError, r"not \(0, 4, 3\)"),
        (np.zeros((4, 4, 2)), ValueError, "image must have 3 or 4 channels, not 2"),
    ],
)
def test_wrong_images(image: Any, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        reference.apply(image, Separable())


def test_wrong_arguments() -> None:
    with pytest.raises(ValueError, match=r"size must be .*not \(0, 4\)"):
        reference.blur(flat(1.0), Separable(), (0, 4))
    with pytest.raises(ValueError, match=r"format must be .*not 'rgb565'"):
        reference.blur(flat(1.0), Separable(), format="rgb565")
    with pytest.raises(ValueError, match=r"firefly_filter needs .*not 2"):
        reference.blur(flat(1.0, channels=2), Pyramid(firefly_filter=True))
    with pytest.raises(ValueError, match="bloom must have the scene's height and width"):
        reference.composite(flat(1.0), flat(1.0, 3, 3), Separable())
    with pytest.raises(TypeError, match="bloom must be an array"):
        reference.composite(flat(1.0), None, Separable())


@pytest.mark.parametrize("settings", [None, "kino", {"threshold": 1.0}], ids=repr)
def test_wrong_settings(settings: Any) -> None:
    for call in (reference.apply, reference.passes, reference.blur):
        with pytest.raises(TypeError, match=r"^settings must be vkbloom\.Settings, not "):
            call(flat(1.0), settings)
    with pytest.raises(TypeError, match=r"^settings must be "):
        reference.gain(settings)
    with pytest.raises(TypeError, match=r"^settings must be "):
        reference.composite(flat(1.0), flat(1.0), settings)


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
