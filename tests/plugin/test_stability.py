"""Stability and resolution: figures of blurs that are known, and assertions on planted faults."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from tests.plugin.broken_laws import fails
from tests.refusals import assert_refused, rows
from vkbloom import testing
from vkbloom.testing import Probe

Image = NDArray[Any]
SMALL = Probe(size=(48, 48), channels=1)
PICTURE = np.zeros((4, 4, 3), np.uint8)
TAPS = (1 / 8, 3 / 8, 3 / 8, 1 / 8)


def gaussian(image: Image, sigma: float = 3.0) -> Image:
    return np.asarray(ndimage.gaussian_filter(image, (sigma, sigma, 0), mode="nearest"))


def halve(image: Image) -> Image:
    """Reduce by 1 3 3 1, which keeps energy and centroid wherever the light is."""
    for axis in (0, 1):
        image = np.asarray(ndimage.correlate1d(image, TAPS, axis, origin=-1))
    return image[::2, ::2]


def double(image: Image, off: float = 0.0) -> Image:
    """Enlarge by 2, bilinearly, the samples `off` texels from where they belong."""
    height, width = image.shape[:2]
    places = [(np.arange(2 * side) + 0.5) / 2 - 0.5 + off for side in (height, width)]
    rows, columns = np.meshgrid(*places, indexing="ij")
    planes = [
        ndimage.map_coordinates(image[..., channel], (rows, columns), order=1, mode="nearest")
        for channel in range(image.shape[2])
    ]
    return np.stack(planes, axis=-1)


def chain(image: Image, reduce: Callable[[Image], Image] = halve, off: float = 0.0) -> Image:
    """Two levels down and up."""
    return gaussian(double(double(reduce(reduce(image)), off)), 3.0)


class TestStability:
    def test_a_convolution_is_stable(self) -> None:
        found = testing.stability(gaussian, texel=3, steps=4, probe=SMALL)
        assert found.positions.shape == (3, 12, 2)
        # Over three pixels around the middle, at the middle of each step.
        np.testing.assert_allclose(found.positions[0, :, 0], 23.5 + (np.arange(12) - 5.5) / 4)
        np.testing.assert_allclose(found.positions[0, :, 1], 23.5)
        np.testing.assert_allclose(found.positions[2, :, 0], found.positions[2, :, 1])
        np.testing.assert_allclose(found.energy, 1, rtol=1e-5)
        np.testing.assert_allclose(found.shift, 0, atol=1e-5)
        # Two axes of the kernel, and a light of half a pixel.
        np.testing.assert_allclose(found.radius, math.sqrt(2 * 9 + 0.25 / 6), rtol=1e-3)
        assert found.ripple < 1e-5
        assert found.jitter < 1e-5
        assert found.growth < 1e-5
        # Between four pixels the light is spread over them, and no pixel is at its middle.
        assert 0.02 < found.flicker < 0.06

    def test_the_identity_has_the_radius_of_the_light(self) -> None:
        found = testing.stability(lambda image: image, texel=1, probe=SMALL)
        np.testing.assert_allclose(found.radius, math.sqrt(0.25 / 6), rtol=1e-6)
        # A quarter of it on each of four pixels, or all of it on one.
        np.testing.assert_allclose(found.peak.max() / found.peak.min(), 1 / 0.25, rtol=0.4)

    @pytest.mark.parametrize("sigma", [0.0, 0.5, 1.0, 2.0, 3.0])
    def test_what_pixels_do_is_no_flicker_of_a_convolution(self, sigma: float) -> None:
        def bloom(image: Image) -> Image:
            return gaussian(image, sigma) if sigma else image

        found = testing.stability(bloom, texel=1, probe=SMALL)
        assert (found.flicker > 0.1) == (sigma < 3)
        assert found.shimmer < 1e-5

    def test_a_chain_is_stable(self) -> None:
        testing.assert_laws(chain, "stability", probe=SMALL)

    def test_an_upsample_half_a_texel_off(self) -> None:
        message = fails(lambda image: chain(image, off=0.5), "stability", probe=SMALL)
        # Half a texel of the smaller level, two pixels, down and across.
        assert "the centroid of the bloom is 2.83 pixels from that of the image" in message

    def test_a_nearest_neighbour_reduction(self) -> None:
        def nearest(image: Image) -> Image:
            return chain(image, lambda larger: larger[::2, ::2])

        message = fails(nearest, "stability", probe=SMALL)
        assert "the energy of the bloom changes by" in message
        assert testing.stability(nearest, texel=4, steps=2, probe=SMALL).ripple > 2

    def test_a_box_moves_in_jumps(self) -> None:
        def boxes(image: Image) -> Image:
            small = image.reshape(24, 2, 24, 2, 1).mean(axis=(1, 3))
            return gaussian(small.repeat(2, axis=0).repeat(2, axis=1), 4.0)

        found = testing.stability(boxes, texel=2, steps=4, probe=SMALL)
        assert found.ripple < 1e-5
        assert 0.4 < found.jitter < 0.75
        for jitter, check in ((0.75, testing.assert_laws), (0.4, fails)):
            check(boxes, "stability", limits={"stability": {"jitter": jitter}}, probe=SMALL)

    def test_a_pulse(self) -> None:
        """Of each limit: the radius and the peak with it, at constant energy and place."""

        def pulsing(image: Image) -> Image:
            x = float(image.sum(axis=(0, 2)) @ np.arange(48)) / max(float(image.sum()), 1e-9)
            return gaussian(image, 2.0 if x < 23.5 else 2.2)

        def within(**limits: float) -> dict[str, Any]:
            return {"limits": {"stability": limits}, "probe": SMALL}

        # (A radius of 2.2 in place of 2, and the peak by the square of that.)
        message = fails(pulsing, "stability", **within())
        assert "the peak of the bloom changes by" in message
        message = fails(pulsing, "stability", **within(shimmer=1.0))
        assert "the radius of the bloom changes by 0.09" in message
        testing.assert_laws(pulsing, "stability", **within(shimmer=1.0, growth=0.1))
        # A limit of infinity leaves a figure out.
        testing.assert_laws(pulsing, "stability", **within(shimmer=math.inf, growth=math.inf))

    @pytest.mark.parametrize("dtype", ["uint8", "float16"])
    @pytest.mark.parametrize("channels", [None, 4])
    def test_images(self, dtype: str, channels: int | None) -> None:
        probe = Probe(size=(32, 24), dtype=dtype, channels=channels)

        def bloom(image: Image) -> Image:
            assert image.dtype == dtype
            assert image.shape[2:] == (() if channels is None else (channels,))
            return image

        found = testing.stability(bloom, texel=2, steps=2, probe=probe)
        np.testing.assert_allclose(found.energy, 1, atol=0.01)
        np.testing.assert_allclose(found.shift, 0, atol=1e-12)

    def test_light_that_is_always_there_counts_for_nothing(self) -> None:
        found = testing.stability(lambda image: gaussian(image) + 0.1, texel=1, probe=SMALL)
        np.testing.assert_allclose(found.energy, 1, rtol=1e-4)
        assert found.jitter < 1e-3


class TestResolution:
    def test_a_radius_in_shares_of_the_height(self) -> None:
        def bloom(image: Image) -> Image:
            return gaussian(image, image.shape[0] / 16)

        found = testing.resolution_response(bloom, (1, 1.5, 2), probe=SMALL)
        assert found.sizes == ((48, 48), (72, 72), (96, 96))
        # Of a Gaussian and a square of 1/32: sqrt(-2 ln(1/2)) and sqrt(-2 ln(1/10)) sigma.
        # A pixel is a third of sigma at the smallest size, and adds its own variance.
        sigma = math.hypot(1 / 16, 1 / 32 / math.sqrt(12))
        np.testing.assert_allclose(found.r50, 1.1774 * sigma, rtol=0.04)
        np.testing.assert_allclose(found.r90, 2.1460 * sigma, rtol=0.04)
        np.testing.assert_allclose(found.peak, (1 / 32) ** 2 / (2 * np.pi * sigma**2), rtol=0.04)
        testing.assert_laws(bloom, "resolution")

    def test_scenes_are_box_reductions_of_one_another(self) -> None:
        seen = []

        def bloom(image: Image) -> Image:
            seen.append(image.astype(np.float64))
            return image

        testing.resolution_response(bloom, (1, 2), light=0.13, probe=SMALL)
        small, large = seen[0], seen[2]
        reduced = large.reshape(48, 2, 48, 2, 1).mean(axis=(1, 3))
        np.testing.assert_allclose(small, reduced, atol=1e-6)
        np.testing.assert_allclose(small.sum(), (0.13 * 48) ** 2, rtol=1e-5)

    def test_a_radius_in_pixels(self) -> None:
        message = fails(gaussian, "resolution")
        assert "the radius of 50 % of the light" in message
        assert "at 512 x 512" in message

    def test_a_peak_that_changes(self) -> None:
        def bloom(image: Image) -> Image:
            return np.asarray(gaussian(image, image.shape[0] / 16) * image.shape[0] / 48)

        assert "the peak of the bloom" in fails(bloom, "resolution")
        testing.assert_laws(bloom, "resolution", limits={"resolution": {"peak": 2.0}})


@pytest.mark.parametrize(("call", "error"), rows(__file__, "figures"))
def test_a_wrong_value_is_refused(call: str, error: str) -> None:
    assert_refused(call, error, globals())
