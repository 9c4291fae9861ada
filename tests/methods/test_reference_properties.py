"""Properties of the NumPy reference alone; test_properties has those of the device too."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.methods.reference_cases import impulse, random_image
from vkbloom import DualKawase, Pyramid, Separable, reference

SIZES = st.tuples(st.integers(1, 24), st.integers(1, 24))


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
