"""The presets: each against its own NumPy reference, and the reference against its formulas."""

from __future__ import annotations

from typing import Any
from unittest import mock

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tests.device.abilities import max_side
from tests.images import lights
from tests.methods.cases import presets_of_low_levels
from tests.tolerance import assert_matches_reference, real
from vkbloom import (
    BevyBloom,
    BlenderGlare,
    Convolution,
    DualKawase,
    FilamentBloom,
    HdrpBloom,
    KinoBloom,
    PygfxBloom,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    ThreeBloom,
    UrpBloom,
    presets,
    psf,
    reference,
)

Array = NDArray[Any]

CONVOLUTIONS = [name for name in presets if isinstance(presets[name], Convolution)]
LOW = presets_of_low_levels(64)
PUBLISHED = sorted(set(presets) - {*CONVOLUTIONS})


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
    image = lights(33, 21)
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


# --- KinoBloom ---


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
    row = lights(1200, 2)[:1]
    frames = renderer.apply(row, settings)
    width = min(16384, max_side(renderer))
    assert frames["down_0"].shape[:2] == (16, width)
    name = type(settings).__module__.rpartition(".")[2]
    with mock.patch(f"vkbloom.reference._{name}.WIDEST_LEVEL", width):
        assert_matches_reference(frames, row, settings)


# --- Unity ---


def test_urps_threshold_is_0_9_in_srgb() -> None:
    assert UrpBloom().threshold == pytest.approx(0.787412, abs=1e-6)


@pytest.mark.parametrize("size", [(800, 450), (800, 449), (799, 450)])
def test_hdrps_cubic_filter_is_for_larger_frames(renderer: Renderer, size: tuple[int, int]) -> None:
    settings = HdrpBloom(format="rgba32float")
    # The reference of one channel takes a third of the time.
    image = lights(*size)[..., :1]
    last = renderer.apply(image.repeat(3, axis=2), settings, framebuffers="up_0")["up_0"][..., :1]
    smooth, linear = (
        reference.passes(image, settings.replace(high_quality_filtering=high))["up_0"]
        for high in (True, False)
    )
    assert_allclose(last, smooth, rtol=0, atol=1e-4 * smooth.max())
    assert np.array_equal(smooth, linear) == (min(size[0] - 800, size[1] - 450) < 0)


# --- three.js ---
