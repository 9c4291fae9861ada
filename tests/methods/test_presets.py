"""The presets: each against its own NumPy reference, and the reference against its formulas."""

from __future__ import annotations

from typing import Any
from unittest import mock

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.device.abilities import max_side
from tests.images import hdr_picture, lights
from tests.kinds import fields_of
from tests.methods.cases import METHODS, presets_of_low_levels
from tests.tolerance import assert_close, assert_matches_reference, real, tolerance
from vkbloom import (
    BevyBloom,
    BlenderGlare,
    Convolution,
    DualKawase,
    FilamentBloom,
    Ghosts,
    GodotBloom,
    Halo,
    HdrpBloom,
    KinoBloom,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    Streaks,
    UrpBloom,
    presets,
    psf,
    reference,
)

CONVOLUTIONS = [name for name in presets if isinstance(presets[name], Convolution)]
LOW = presets_of_low_levels(64)
PUBLISHED = sorted(set(presets) - {*CONVOLUTIONS})


def test_the_share_of_a_lens() -> None:
    assert_allclose(psf.harvey_shack().energy(), presets["camera_lens"].intensity, rtol=0.01)


# These read beyond the border, where there is nothing.
DARK_BORDERS = {f"blender_{type}" for type in ("ghosts", "streaks", "simple_star", "fog_glow")}


WEIGHTED = Pyramid(levels=4, level_weights=(1.0, 0.5, -0.25, 4.0))
FLAT: dict[str, tuple[Settings, tuple[int, int]]] = {
    **{name: (LOW[name], (71, 45)) for name in sorted({*PUBLISHED} - DARK_BORDERS)},
    **{name: (settings.replace(threshold=None), (71, 45)) for name, settings in METHODS.items()},
    **{f"weights of {size}": (WEIGHTED, size) for size in ((64, 48), (4, 3), (1, 1))},
}


@pytest.mark.parametrize("name", FLAT)
def test_a_flat_image_gets_the_gain(renderer: Renderer, name: str) -> None:
    settings, size = FLAT[name]
    settings = settings.replace(format="rgba32float")
    image = np.ones((*size[::-1], 3), np.float32)
    gain = reference.gain(settings, size)
    bloom = renderer.apply(image, settings)["bloom"]
    # Absolute too: a subtractive threshold of 1 leaves of 1 what its sums were rounded by.
    assert_allclose(bloom[..., :3], gain, rtol=1e-5, atol=1e-6)
    assert_allclose(reference.blur(image, settings), gain, rtol=1e-9, atol=1e-15)


STAGES = (Streaks(directions=3, iterations=2), Ghosts(), Halo())


@pytest.mark.parametrize(
    "settings",
    [*(LOW[name] for name in PUBLISHED), *(Pyramid(glare=(stage,)) for stage in STAGES)],
    ids=[*PUBLISHED, *(stage.stage for stage in STAGES)],
)
def test_nan_and_infinity_are_not_spread(renderer: Renderer, settings: Settings) -> None:
    image = lights(33, 21)
    image[4, 5, 0], image[10, 20, 1], image[20, 0, 2] = np.nan, np.inf, -np.inf
    frames = renderer.apply(image, settings)
    clean = np.where(np.isfinite(image), image, 0).astype(np.float32)
    expected = renderer.apply(clean, settings)
    for framebuffer in set(frames) - {"final"}:
        assert np.array_equal(frames[framebuffer], expected[framebuffer]), framebuffer
    assert np.array_equal(np.isfinite(frames["final"]), np.isfinite(image))


GODOTS = {
    composite: GodotBloom(composite=composite, threshold=0.2, exposure=-0.5, tonemap="reinhard")
    for composite in fields_of(GodotBloom)["composite"].choices
}
IN_SCENES = {name: LOW[name] for name in PUBLISHED} | GODOTS


@pytest.mark.parametrize("name", IN_SCENES)
def test_a_scene_is_blurred_as_an_image_is(renderer: Renderer, name: str) -> None:
    settings = IN_SCENES[name]
    frames = renderer.render(Scene.ufo(), settings, (80, 45))
    format = settings.format or "rgba8unorm"
    if type(settings) not in (Separable, Pyramid, DualKawase):
        assert frames["glow"].shape == (45, 80, 4)
    if isinstance(settings, BlenderGlare):
        # Its glow are the highlights.
        settings = settings.replace(threshold=None)
    expected = reference.passes(frames["glow"], settings, (80, 45), format)
    for framebuffer, values in expected.items():
        largest = np.abs(values).max()
        limit = tolerance(frames[framebuffer].dtype, values, stages_of_8_bits=2, magnitude=largest)
        assert_close(framebuffer, frames[framebuffer], values, limit)
    final = reference.composite(frames["scene"], real(frames["bloom"]), settings)
    assert_allclose(real(frames["final"]), final, rtol=0, atol=1.01 / 255)


@pytest.mark.parametrize("changes", [{"threshold": None}, {"white": 8.0, "intensity": 1.0}])
def test_screen_multiplies_the_rounding_of_the_bloom(
    renderer: Renderer, changes: dict[str, Any]
) -> None:
    """By 1 - s / white, for a scene s that reaches 30."""
    settings = presets["godot_4_6"].replace(format="rgba8unorm", glow_bloom=1.0, **changes)
    image = 4 * hdr_picture(136, 144, 4, "float32", 1)
    assert_matches_reference(renderer.apply(image, settings), image, settings)


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


@pytest.mark.parametrize("sun", [(0.5, 0.5), (-0.25, 1.1)], ids=["inside", "outside"])
@pytest.mark.parametrize("alpha", ["keep", "blur"])
def test_beams_of_single_lamps(renderer: Renderer, sun: Any, alpha: Any) -> None:
    """Runs of samples in the dark are passed over, but none that sees a lamp."""
    settings = BlenderGlare(type="sun_beams", sun_position=sun, alpha=alpha, format="rgba32float")
    for row, column in ((1, 2), (31, 47), (32, 48), (47, 80), (79, 110), (40, 63)):
        image = np.zeros((81, 113, 4), np.float32)
        image[..., 3] = 1.0
        image[row, column] = (5.0, 3.0, 9.0, 0.5)
        assert_matches_reference(renderer.apply(image, settings), image, settings)


@pytest.mark.parametrize("size", [(61, 93), (97, 40), (3, 70), (1, 1)])
@pytest.mark.parametrize("sun", [(0.5, 0.5), (0.13, 0.91), (0.99, 0.3), (1.3, -0.4)])
def test_beams_of_dense_light(renderer: Renderer, size: tuple[int, int], sun: Any) -> None:
    """Which the host makes on CPUs: around suns near and at edges, and of those that leave the
    image, also where rays are short, and with samples between steps.
    """
    image = np.random.default_rng(1).random((*size, 3), np.float32)
    for share, jitter in ((0.5, 0.0), (0.1, 0.0), (0.6, 0.4)):
        settings = BlenderGlare(
            type="sun_beams",
            sun_position=sun,
            size=share,
            jitter=jitter,
            threshold=None,
            format="rgba32float",
        )
        assert_matches_reference(renderer.apply(image, settings), image, settings)


def test_kinos_threshold_is_0_8_in_srgb() -> None:
    assert KinoBloom().threshold == pytest.approx(0.6038273, abs=1e-7)


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
    name = settings.method
    with mock.patch(f"vkbloom.reference._{name}.WIDEST_LEVEL", width):
        assert_matches_reference(frames, row, settings)


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


@pytest.mark.parametrize("seed", range(3))
def test_8_bits_are_off_by_the_rounding_of_each_level(renderer: Renderer, seed: int) -> None:
    """Every stored value is rounded by half a level, and counts as often as its weight says.

    down_k adds the rounding of k + 1 images. up_k is stored divided by the sum of the sizes of the
    weights from k on.
    """
    random = np.random.default_rng(seed)
    weights = tuple(random.uniform(-0.8, 1.0, 5).tolist())
    sizes = np.abs(weights)
    settings = Pyramid(levels=5, level_weights=weights, radius=random.uniform(0.0, 2.0))
    image = random.integers(0, 256, (75, 131, 3), np.uint8)
    allowed = 0.5 + 0.5 * (sizes * np.arange(1, 6)).sum() + 0.5 * np.cumsum(sizes[::-1])[1:].sum()
    bloom = renderer.apply(image, settings)["bloom"]
    expected = 255 * reference.apply(image, settings)["bloom"]
    assert_allclose(bloom, expected, rtol=0, atol=allowed)
