"""The presets: each against its own NumPy reference, and the reference against its formulas."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tests.methods.cases import presets_of_low_levels
from tests.tolerance import assert_matches_reference, real
from vkbloom import (
    BevyBloom,
    BlenderGlare,
    Convolution,
    DualKawase,
    FilamentBloom,
    Ghosts,
    Glare,
    GodotBloom,
    HdrpBloom,
    KinoBloom,
    PygfxBloom,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    Streaks,
    ThreeBloom,
    UrpBloom,
    presets,
    psf,
    reference,
)
from vkbloom.reference import _bevy as bevy
from vkbloom.reference import _kino as kino
from vkbloom.reference import _three as three
from vkbloom.reference import _urp as urp

Array = NDArray[Any]

CONVOLUTIONS = [name for name in presets if isinstance(presets[name], Convolution)]
LOW = presets_of_low_levels(64)
PUBLISHED = sorted(set(presets) - {*CONVOLUTIONS})


def lights(size: tuple[int, int], dtype: str, seed: int = 3) -> Array:
    """Make dim noise with a few bright points; in float formats they go up to 40."""
    width, height = size
    generator = np.random.default_rng(seed)
    image = 0.8 * generator.random((height, width, 3)) ** 2
    points = generator.random((height, width)) < 0.01
    points[height // 2, width // 3] = True
    image[points] = generator.random((int(points.sum()), 3)) * (1 if dtype == "uint8" else 40)
    return np.round(image * 255).astype(np.uint8) if dtype == "uint8" else image.astype(dtype)


def tolerance(name: str, expected: Array, format: str, settings: Settings, downs: int) -> float:
    """Largest difference that the rounding of the buffers explains."""
    if format == "rgba8unorm":
        # 2 for a chain of 8-bit stages. three.js' kernels sum to less than 1: rounding undoes that
        # in flat areas, each of ten times in the same direction.
        levels = 3.0 if isinstance(settings, ThreeBloom) else 2.0
        # A bloom that is a sum multiplies the error of the means it is made from.
        sums: dict[type[Settings], int] = {KinoBloom: downs, PygfxBloom: downs, ThreeBloom: 3}
        if name in ("bloom", "final"):
            levels *= sums.get(type(settings), 1)
        if name == "final":
            levels = max(2.0, levels * settings.intensity)
        return levels / 255
    largest = max(1.0, float(np.abs(expected).max()))
    return (1e-4 if format == "rgba32float" else 2e-3) * largest


def test_the_share_of_a_lens() -> None:
    assert_allclose(psf.harvey_shack().energy(), presets["camera_lens"].intensity, rtol=0.01)


# These read beyond the border, where there is nothing.
DARK_BORDERS = {f"blender_{type}" for type in ("ghosts", "streaks", "simple_star", "fog_glow")}


@pytest.mark.parametrize("name", sorted({*PUBLISHED} - DARK_BORDERS))
def test_a_flat_image_gets_the_gain(renderer: Renderer, name: str) -> None:
    settings = LOW[name].replace(format="rgba32float")
    gain = reference.gain(settings, (71, 45))
    bloom = renderer.apply(np.ones((45, 71, 3), np.float32), settings)["bloom"]
    # Absolute too: a subtractive threshold of 1 leaves of 1 what its sums were rounded by.
    assert_allclose(bloom[..., :3], gain, rtol=1e-5, atol=1e-6)
    assert_allclose(reference.blur(np.ones((45, 71, 3)), settings), gain, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("name", PUBLISHED)
def test_nan_and_infinity_are_not_spread(renderer: Renderer, name: str) -> None:
    image = lights((33, 21), "float32")
    image[4, 5, 0], image[10, 20, 1], image[20, 0, 2] = np.nan, np.inf, -np.inf
    frames = renderer.apply(image, LOW[name])
    clean = np.where(np.isfinite(image), image, 0).astype(np.float32)
    expected = renderer.apply(clean, LOW[name])
    for framebuffer in set(frames) - {"final"}:
        assert np.array_equal(frames[framebuffer], expected[framebuffer]), framebuffer
    assert np.array_equal(np.isfinite(frames["final"]), np.isfinite(image))


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_scene_is_blurred_as_an_image_is(renderer: Renderer, name: str) -> None:
    settings = LOW[name]
    frames = renderer.render(Scene.ufo(), settings, (80, 45))
    format = settings.format or "rgba8unorm"
    if type(settings) not in (Separable, Pyramid, DualKawase):
        assert frames["glow"].shape == (45, 80, 4)
    if isinstance(settings, BlenderGlare):
        # Its glow are the highlights.
        settings = settings.replace(threshold=None)
    expected = reference.passes(frames["glow"], settings, (80, 45), format)
    for framebuffer, values in expected.items():
        largest = tolerance(framebuffer, values, format, settings, 1)
        assert_allclose(real(frames[framebuffer]), values, rtol=0, atol=largest)
    final = reference.composite(frames["scene"], real(frames["bloom"]), settings)
    assert_allclose(real(frames["final"]), final, rtol=0, atol=1.01 / 255)


@pytest.mark.parametrize(
    ("settings", "inside"),
    [
        # 3 * (1 + 4) pixels are reached, in the middle half of a side the ghosts are.
        (BlenderGlare(type="streaks", iterations=2), (slice(20, 60), slice(20, 70))),
        (
            BlenderGlare(type="streaks", streaks=1, fade=0.8, iterations=2),
            (slice(20, 60), slice(20, 60)),
        ),
        (BlenderGlare(type="simple_star", fade=0.75), (slice(36, 44), slice(41, 49))),
        (BlenderGlare(type="ghosts", quality="low"), (slice(40, 41), slice(45, 46))),
        (BlenderGlare(type="fog_glow", size=0.0), (slice(40, 41), slice(45, 46))),
        (BlenderGlare(type="kernel", kernel=np.ones((3, 3))), (slice(8, -8), slice(8, -8))),
    ],
)
def test_blenders_gain(settings: BlenderGlare, inside: tuple[slice, ...]) -> None:
    """In the middle of a flat image."""
    settings = settings.replace(threshold=None, tint=(1.0, 0.5, 2.0))
    gain = reference.gain(settings, (91, 81))
    bloom = reference.blur(np.ones((81, 91, 3)), settings)[inside]
    assert_allclose(bloom, np.broadcast_to(gain, bloom.shape), rtol=2e-3)


# --- Bevy ---


def test_bevys_shares_are_the_published_ones() -> None:
    """f_0..f_7 and each level's share, worked out from the formula in settings.rs."""
    factors = [0.15, 0.717737, 0.744289, 0.744992, 0.745, 0.745, 0.745, 0.745]
    shares = [0.28226, 0.18353, 0.13623, 0.10148, 0.07561, 0.05633, 0.04196, 0.12260]
    rest = 1.0
    for factor, share in zip([*factors[1:], 0.0], shares, strict=True):
        assert rest * (1 - factor) == pytest.approx(share, abs=1e-5)
        rest *= factor
    own, coarse = bevy._shares(BevyBloom())
    assert_allclose(coarse, factors[1:], atol=1e-6)
    assert_allclose(np.add(own, coarse), 1, rtol=1e-12)


NARROWER: list[tuple[Any, str, float, float]] = [
    (BevyBloom, "intensity", 0.0, 1.0),
    (KinoBloom, "radius", 1.0, 7.0),
    (FilamentBloom, "intensity", 0.0, 1.0),
    (FilamentBloom, "levels", 1, 12),
    (HdrpBloom, "intensity", 0.0, 1.0),
    (ThreeBloom, "radius", 0.0, 1.0),
]


@pytest.mark.parametrize(("kind", "name", "low", "high"), NARROWER)
def test_a_range_is_that_of_the_source(kind: Any, name: str, low: float, high: float) -> None:
    for value in (low, high):
        assert getattr(kind(**{name: value}), name) == value
    step = 1 if isinstance(low, int) else 1e-9
    for value in (low - step, high + step):
        with pytest.raises(ValueError, match=rf"^{name}: .* out of range"):
            kind(**{name: value})


# --- KinoBloom ---


@pytest.mark.parametrize(
    ("height", "radius", "levels", "step"),
    [(720, 2.5, 3, 1.49185), (1080, 2.5, 4, 1.07682), (45, 1.0, 1, 0.5 + 5.49185 - 7 + 1)],
)
def test_kinos_levels_and_step(height: int, radius: float, levels: int, step: float) -> None:
    actual = kino._count_and_step(KinoBloom(radius=radius), height)
    assert actual[0] == levels
    assert actual[1] == pytest.approx(step, abs=1e-5)


def test_kinos_threshold_is_0_8_in_srgb() -> None:
    assert KinoBloom().threshold == pytest.approx(0.6038273, abs=1e-7)


def test_kinos_median_removes_a_single_bright_pixel_and_keeps_a_large_light() -> None:
    image = np.zeros((64, 64, 3))
    image[20, 20] = 100
    assert not reference.blur(image, KinoBloom()).any()
    image[30:33, 30:33] = 100
    bright = reference.passes(image, KinoBloom())["bright"]
    assert (bright[..., 0] > 0).sum() == 9
    assert reference.blur(image, KinoBloom(anti_flicker=False))[20, 20].min() > 1


# --- Filament ---


@pytest.mark.parametrize(
    "settings",
    [BevyBloom(max_mip_dimension=16), FilamentBloom(resolution=16)],
    ids=["bevy", "filament"],
)
def test_levels_of_very_wide_frames(renderer: Renderer, settings: Settings) -> None:
    """Of a row of pixels, the first level would be wider than an image of a device can be."""
    row = lights((1200, 2), "float32")[:1]
    frames = renderer.apply(row, settings, framebuffers=("down_0",))
    assert frames["down_0"].shape[:2] == (16, 16384)
    assert_matches_reference(renderer.apply(row, settings), row, settings)


# --- Unity ---


def test_urps_levels_and_shares(renderer: Renderer) -> None:
    frames = renderer.apply(lights((1280, 720), "uint8"), presets["unity_urp"])
    sizes = [frames[name].shape[1::-1] for name in frames if name.startswith("down")]
    assert sizes == [(640, 360), (320, 180), (160, 90), (80, 45), (40, 22), (20, 11)]
    own, coarse = urp._shares(UrpBloom(), 6)
    shares = np.cumprod([1, *coarse[:5]]) * [*own[:5], 1]
    assert_allclose(shares, [0.32, 0.2176, 0.14797, 0.10062, 0.06842, 0.14539], atol=1e-5)


def test_urps_threshold_is_0_9_in_srgb() -> None:
    assert UrpBloom().threshold == pytest.approx(0.787412, abs=1e-6)


@pytest.mark.parametrize("size", [(800, 450), (800, 449), (799, 450)])
def test_hdrps_cubic_filter_is_for_larger_frames(renderer: Renderer, size: tuple[int, int]) -> None:
    settings = HdrpBloom(format="rgba32float")
    # The reference of one channel takes a third of the time.
    image = lights(size, "float32")[..., :1]
    last = renderer.apply(image.repeat(3, axis=2), settings, framebuffers="up_0")["up_0"][..., :1]
    smooth, linear = (
        reference.passes(image, settings.replace(high_quality_filtering=high))["up_0"]
        for high in (True, False)
    )
    assert_allclose(last, smooth, rtol=0, atol=1e-4 * smooth.max())
    assert np.array_equal(smooth, linear) == (min(size[0] - 800, size[1] - 450) < 0)


def test_hdrps_sizes_are_rounded_halves_to_even() -> None:
    image = np.zeros((10, 9, 1))
    sizes = [a.shape[:2] for a in reference.passes(np.zeros((70, 75, 1)), HdrpBloom()).values()]
    assert sizes[:4] == [(35, 38), (18, 19), (9, 9), (4, 5)]
    assert reference.passes(image, HdrpBloom())["down_0"].shape == (5, 4, 1)


def test_the_cubic_filter_is_the_b_spline() -> None:
    """The spline as a function of the distance: 2/3 - t^2 + t^3 / 2, beyond 1 (2 - t)^3 / 6."""
    image = np.zeros((9, 1, 1))
    image[4] = 1
    t = np.abs((np.arange(27) + 0.5) / 3 - 4.5)
    expected = np.where(t < 1, 2 / 3 - t**2 + t**3 / 2, np.maximum(2 - t, 0) ** 3 / 6)
    enlarged = reference._upsampling.cubic(image, (1, 27))[:, 0, 0]
    assert_allclose(enlarged, expected, atol=1e-12)


# --- three.js ---


def test_threes_sizes_are_rounded() -> None:
    framebuffers = reference.passes(np.zeros((90, 77, 1)), ThreeBloom())
    sizes = [a.shape[:2] for name, a in framebuffers.items() if name.startswith("down")]
    assert sizes == [(45, 39), (23, 20), (12, 10), (6, 5), (3, 3)]
    assert framebuffers["up_0"].shape == framebuffers["bright"].shape == (45, 39, 1)


def test_threes_kernels_are_the_published_ones() -> None:
    """Their sums, worked out from the formula in UnrealBloomPass.js; samples of two taps add up."""
    for settings in (ThreeBloom(), ThreeBloom(variant="r187")):
        sums = [sum(weight for _, weight in three._taps(k, settings)) for k in range(5)]
        assert_allclose(sums, [0.99454, 0.99577, 0.99624, 0.99649, 0.99665], atol=1e-5)


@pytest.mark.parametrize(
    ("make", "fields", "message"),
    [
        (BevyBloom, {"composite": "screen"}, "composite: 'screen' is not one of mix, add"),
        (Separable, {"composite": "soft_light"}, "is not one of add, mix, screen, which"),
        (GodotBloom, {"composite": "under"}, "composite: 'under' is not one of screen, soft_light"),
        (PygfxBloom, {"composite": "add"}, "composite: 'add' is not one of mix, which"),
        (FilamentBloom, {"knee": 0.5}, "knee: 0.5 is not 0"),
        (GodotBloom, {"knee": 0.5}, "knee: 0.5 is not 0"),
        (HdrpBloom, {"threshold": 1.0}, "threshold: 1.0 is not None"),
        (PygfxBloom, {"threshold": 1.0}, "threshold: 1.0 is not None"),
        (GodotBloom, {"white": 0.0}, "white: 0.0 is out of range, 0.01"),
        (GodotBloom, {"level_weights": (1.0,)}, "level_weights: 1 weights are out of range, 7"),
        (GodotBloom, {"level_weights": (0,) * 6 + (-1,)}, "level_weights: -1.0 is out of range, 0"),
        (Pyramid, {"level_weights": ()}, "level_weights: 0 weights"),
        (Pyramid, {"level_weights": (1, 2)}, "2 weights are out of range, 6, one for each"),
        (Pyramid, {"level_weights": (1,) * 5 + (np.nan,)}, "level_weights: nan is out of range"),
        (Pyramid, {"level_weights": "111111"}, "is not a sequence of numbers"),
        (Pyramid, {"level_weights": 3.0}, "is not a sequence of numbers"),
        (Convolution, {"psf": np.ones((2, 2, 4))}, "psf: shape (2, 2, 4) is not (h, w)"),
        (Convolution, {"psf": [[np.nan]]}, "psf: some numbers are not finite"),
        (Convolution, {"psf": {"psf": "lens"}}, "psf: 'lens' is not one of"),
        (Convolution, {"boundary": "mirror"}, "boundary: 'mirror' is not one of"),
        (Convolution, {"normalize": 2}, "normalize: 2 is out of range, 0 to 1"),
        (Convolution, {"pixels_per_degree": 0}, "pixels_per_degree: 0 is out of range"),
        (Convolution, {"kernel_size": (0, 3)}, "kernel_size: "),
        (Streaks, {"directions": 17}, "directions: 17 is out of range, 1 to 16"),
        (Streaks, {"directions": 1.5}, "directions: 1.5 is not an integer"),
        (Streaks, {"fade": np.nan}, "fade: nan is out of range, 0 to 1"),
        (Ghosts, {"tints": (1.0,)}, "is not a sequence"),
        (Glare, {}, "Glare is abstract"),
        (Pyramid, {"glare": (Streaks(),) * 6}, "glare: 6 stages are out of range, 0 to 5"),
        (Pyramid, {"glare": {"stage": "rain"}}, "stage: 'rain' is not one of streaks"),
        (Pyramid, {"glare": [{"stage": "streaks", "size": 1}]}, "glare: streaks has no 'size'"),
        (Pyramid, {"glare": 5}, "5 is not a sequence of stages"),
        (Pyramid, {"glare": [1]}, "1 is not a stage"),
    ],
)
def test_wrong_fields_are_refused(make: Any, fields: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=re.escape(message)):
        make(**fields)
