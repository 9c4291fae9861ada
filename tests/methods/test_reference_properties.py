"""Properties of the NumPy reference, with generated images and settings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.methods.reference_cases import (
    FIREFLY,
    METHODS,
    impulse,
    random_image,
)
from vkbloom import DualKawase, Pyramid, Separable, reference

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


@pytest.mark.parametrize(
    ("settings", "size"), [(Pyramid(levels=3), (34, 32)), (DualKawase(levels=3), (40, 32))]
)
def test_a_pixel_keeps_its_light_if_the_sides_halve_evenly(
    settings: Pyramid | DualKawase, size: tuple[int, int]
) -> None:
    """In buffers with odd sides the taps skip texels, as the notes of both methods say."""

    def energies(settings: Pyramid | DualKawase) -> list[float]:
        blooms = [
            reference.apply(np.repeat(impulse(31, 33, y, x), 3, axis=2), settings)["bloom"]
            for x in range(14, 19)
            for y in range(13, 18)
        ]
        return [float(bloom[..., 0].sum()) for bloom in blooms]

    assert_allclose(energies(settings.replace(bloom_size=size)), 1, atol=0.1)
    assert min(energies(settings)) < 0.3
