"""The built-in reductions, on frames whose figures are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.framebuffers import make
from tests.images import noise
from vkbloom import reductions
from vkbloom._views.comparison import compare

# Of one pair of doubles.
EXACT = 1e-12


def frames(**arrays: NDArray[Any]) -> Any:
    return make(arrays)


class TestMeanAndMax:
    def test_8_bits_count_as_0_to_1_without_alpha(self) -> None:
        final = np.zeros((2, 2, 4), np.uint8)
        final[0, 0] = (255, 51, 0, 255)
        assert reductions.Mean()(frames(final=final)) == pytest.approx((1 + 0.2) / 12)
        assert reductions.Max()(frames(final=final)) == 1.0

    def test_values_that_are_not_finite_are_ignored(self) -> None:
        bloom = np.full((3, 3, 3), 2.0, np.float32)
        bloom[0, 0] = np.nan
        bloom[1, 1] = np.inf
        found = frames(bloom=bloom)
        assert reductions.Mean(framebuffer="bloom")(found) == 2.0
        assert reductions.Max(framebuffer="bloom")(found) == 2.0
        nothing = frames(final=np.full((1, 1, 3), np.nan, np.float32))
        assert np.isnan(reductions.Mean()(nothing))
        assert np.isnan(reductions.Max()(nothing))

    def test_depth(self) -> None:
        depth = np.array([[0.25, 0.75]], np.float32)
        assert reductions.Mean(framebuffer="depth")(frames(depth=depth)) == 0.5


class TestEncircledEnergy:
    def test_of_a_point_all_light_is_within_any_radius(self) -> None:
        bloom = np.zeros((9, 9, 4), np.float32)
        bloom[3, 5] = 7
        found = reductions.EncircledEnergy(radii=(0.5, 3))(frames(bloom=bloom))
        np.testing.assert_allclose(found, [1, 1], rtol=EXACT)

    def test_of_a_flat_disc_the_share_is_that_of_the_pixels(self) -> None:
        bloom = np.ones((41, 41, 3), np.float32)
        y, x = np.mgrid[-20:21, -20:21]
        radii = (20.0, 1.0, 5.0, 100.0)
        found = reductions.EncircledEnergy(radii=radii)(frames(bloom=bloom))
        shares = [(x**2 + y**2 <= radius**2).mean() for radius in radii]
        np.testing.assert_allclose(found, shares, rtol=EXACT)

    def test_the_centre_can_be_given_and_colours_weigh_as_luminance(self) -> None:
        bloom = np.zeros((5, 9, 3), np.float32)
        bloom[2, 1] = (1, 0, 0)
        bloom[2, 7] = (0, 1, 0)
        found = reductions.EncircledEnergy(radii=(1,), centre=(1, 2))(frames(bloom=bloom))
        np.testing.assert_allclose(found, [0.2126 / (0.2126 + 0.7152)], rtol=EXACT)

    def test_negative_and_infinite_light_counts_as_0(self) -> None:
        bloom = np.ones((3, 3, 3), np.float32)
        bloom[0, 0], bloom[0, 1], bloom[2, 2] = -5, np.nan, np.inf
        found = reductions.EncircledEnergy(radii=(1,), centre=(1, 1))(frames(bloom=bloom))
        np.testing.assert_allclose(found, [4 / 6], rtol=EXACT)

    def test_without_light_there_is_no_share(self) -> None:
        dark = frames(bloom=np.zeros((3, 3, 3), np.float32))
        assert np.isnan(reductions.EncircledEnergy()(dark)).all()

    @pytest.mark.parametrize("radii", [(), (0.0,), (np.inf,), (-1.0,)])
    def test_radii_out_of_range(self, radii: Any) -> None:
        with pytest.raises(ValueError, match="radii"):
            reductions.EncircledEnergy(radii=radii)


class TestComparing:
    @pytest.mark.parametrize("name", ["SSIM", "PSNR", "FLIP"])
    @pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
    def test_figures_are_those_of_compare(self, name: str, dtype: str) -> None:
        first, second = (noise(16, 19, 3, dtype=dtype, seed=seed) for seed in (1, 2))
        found = getattr(reductions, name)(against=first)(frames(final=second))
        assert found == getattr(compare(first, second), name.lower())

    def test_the_same_frame(self) -> None:
        final = noise(16, 19, 3, dtype="uint8")
        same = frames(final=final)
        assert reductions.SSIM(against=final)(same) == 1
        assert reductions.PSNR(against=final)(same) == np.inf
        assert reductions.FLIP(against=final)(same) == 0

    def test_another_size_is_refused(self) -> None:
        with pytest.raises(ValueError, match="sizes differ"):
            reductions.PSNR(against=noise(3, 3, 3, dtype="uint8"))(
                frames(final=noise(3, 4, 3, dtype="uint8"))
            )

    def test_impossible_figure_is_nan(self) -> None:
        small = noise(3, 3, 3, dtype="uint8")
        assert np.isnan(reductions.SSIM(against=small)(frames(final=small)))

    def test_references_of_other_kinds(self) -> None:
        with pytest.raises(TypeError, match="against"):
            reductions.SSIM(against=1.0)  # type: ignore[arg-type]
        with pytest.raises(TypeError, match="only a grid"):
            reductions.SSIM(against={"blur_scale": 1})(frames(final=noise(9, 9, 3, dtype="uint8")))
