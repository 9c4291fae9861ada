"""Properties of the NumPy reference alone; test_properties has those of the device too."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from tests.methods.reference_cases import random_image
from vkbloom import Separable, reference

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
