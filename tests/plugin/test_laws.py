"""The laws of `vkbloom.testing`, on blurs that obey all of them and on blurs that violate one."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from tests.exhaustive import by_turns
from tests.plugin.broken_laws import fails
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, Separable, reference, testing
from vkbloom.testing import Probe

Image = NDArray[Any]
Bloom = Callable[[Image], Image]

SMALL = Probe(size=(41, 33))
DTYPES = ["uint8", "uint16", "float16", "float32", "float64"]


def in_floats(blur: Bloom) -> Bloom:
    """Let a blur work in doubles, and round its result to the image's dtype as an engine does."""

    def apply(image: Image) -> Image:
        scale = 1 if image.dtype.kind == "f" else np.iinfo(image.dtype).max
        result = blur(image.astype(np.float64) / scale) * scale
        if image.dtype.kind == "u":
            result = np.rint(np.clip(result, 0, scale))
        return result.astype(image.dtype)

    return apply


def over_the_plane(blur: Callable[[Image], Image]) -> Bloom:
    """Make a blur of planes one of images of any number of channels."""

    def apply(image: Image) -> Image:
        if image.ndim == 2:
            return blur(image)
        return np.stack([blur(image[..., c]) for c in range(image.shape[2])], axis=-1)

    return in_floats(apply)


def kernel(weights: list[list[float]], **options: Any) -> Bloom:
    """Return the correlation with a kernel, continued by the edge."""
    taps = np.array(weights)
    return over_the_plane(
        lambda plane: ndimage.correlate(plane, taps, **{"mode": "nearest", **options})
    )


GAUSSIAN = over_the_plane(lambda plane: ndimage.gaussian_filter(plane, 1.5, mode="nearest"))
BOX = kernel([[1 / 9] * 3] * 3)
IDENTITY = kernel([[1.0]])
# 1 2 1 down and across, a quarter each, with one weight moved, and its sum kept.
SHARPENED = kernel([[0, -0.25, 0], [-0.25, 2, -0.25], [0, -0.25, 0]])
LEANING = kernel([[0, 0, 0], [0.2, 0.5, 0.3], [0, 0, 0]])
SHIFTED = kernel([[0.5, 0.5]])
PLUS = kernel([[0, 0.125, 0], [0.125, 0.5, 0.125], [0, 0.125, 0]])
SEEING_BLACK = kernel([[1 / 9] * 3] * 3, mode="constant")


BLURS = {"gaussian": GAUSSIAN, "box": BOX, "identity": IDENTITY}


@pytest.mark.parametrize(
    ("name", "dtype", "channels"), by_turns(BLURS, DTYPES, turns=[None, 1, 2, 3, 4])
)
def test_blurs_that_keep_all_laws(name: str, dtype: str, channels: int | None) -> None:
    blur = BLURS[name]
    probe = Probe(size=(41, 33), channels=channels, dtype=dtype)
    testing.assert_superposition(blur, probe)
    testing.assert_gain(blur, 1.0, probe)
    testing.assert_symmetric(blur, probe, axes=("x", "y", "xy"))
    testing.assert_centroid_kept(blur, probe)
    testing.assert_separable(blur, probe)
    testing.assert_no_ringing(blur, probe)


def bloom_of(renderer: Renderer, settings: Any, name: str = "bloom") -> Bloom:
    return lambda image: renderer.apply(image, settings, framebuffers=(name,))[name]


def test_the_picture_with_its_bloom(renderer: Renderer) -> None:
    settings = Separable(intensity=0.5)
    picture, glow = (bloom_of(renderer, settings, name) for name in ("final", "bloom"))
    testing.assert_additive(picture, probe=SMALL)
    testing.assert_additive(picture, glow, 0.5, SMALL)
    fails(testing.assert_additive, picture, glow, 0.49, SMALL)
    testing.assert_gain(picture, 1 + 0.5 * reference.gain(settings), SMALL)
    mixed = Separable(composite="mix", intensity=0.5, blur_strength=0.1)
    message = fails(testing.assert_additive, bloom_of(renderer, mixed, "final"), probe=SMALL)
    assert "light is added, and none is removed" in message


def off_by(*amounts: float) -> Bloom:
    """Return a bloom of 1 whose results are off, each call's by the next amount."""
    left = iter(amounts)
    return lambda image: image.astype(np.float64) + next(left)


def test_every_result_may_be_off() -> None:
    probe = Probe(size=(5, 5), dtype="float64", atol=0.01)
    # The mixture of the two images in one direction, both in the other: by 0.01 each, 0.0175.
    testing.assert_superposition(off_by(0.0099, -0.0099, -0.0099), probe)
    fails(testing.assert_superposition, off_by(0.0101, -0.0101, -0.0101), probe)
    # The picture, and half of the bloom that is added: 0.015.
    picture, glow = off_by(0.0099, 0.0101), off_by(-0.0099, -0.0101)

    def lit(image: NDArray[Any]) -> NDArray[Any]:
        return picture(image) + 0.5 * image

    testing.assert_additive(lit, glow, 0.5, probe)
    fails(testing.assert_additive, lit, glow, 0.5, probe)


class TestBrokenLaws:
    def test_superposition(self) -> None:
        message = fails(testing.assert_superposition, in_floats(lambda image: image**1.1), SMALL)
        assert "B(a / 2 + b / 4) = B(a) / 2 + B(b) / 4" in message
        # Additive, not homogeneous: nothing else would notice a constant.
        fails(testing.assert_superposition, in_floats(lambda image: image + 0.01), SMALL)
        fails(
            testing.assert_superposition,
            in_floats(lambda image: np.where(image > 0.5, image, 0.0)),
            SMALL,
        )

    @pytest.mark.parametrize("gain", [0.0, 0.98, 1.02])
    def test_gain(self, gain: float) -> None:
        assert f"{gain:g} v" in fails(testing.assert_gain, BOX, gain, SMALL)

    def test_gain_at_the_border(self) -> None:
        assert "x 0, y 0" in fails(testing.assert_gain, SEEING_BLACK, 1.0, SMALL)
        spot = Probe(size=(41, 33))

        def dark_spot(image: Image) -> Image:
            image = image.copy()
            image[7, 9, 1] = 0
            return image

        assert "at x 9, y 7, channel 1" in fails(testing.assert_gain, dark_spot, 1.0, spot)

    def test_symmetry(self) -> None:
        message = fails(testing.assert_symmetric, LEANING, SMALL)
        assert "left and right" in message
        testing.assert_symmetric(LEANING, SMALL, axes=("y",))
        fails(testing.assert_symmetric, LEANING, SMALL, axes=("xy",))
        fails(testing.assert_symmetric, SHIFTED, SMALL)

    def test_centroid(self) -> None:
        message = fails(testing.assert_centroid_kept, SHIFTED, SMALL)
        assert "+0.5 pixels from x 20, channel 0" in message
        testing.assert_centroid_kept(SHIFTED, SMALL, within=0.51)
        fails(testing.assert_centroid_kept, LEANING, SMALL, within=0.09)

    def test_separability(self) -> None:
        message = fails(testing.assert_separable, PLUS, SMALL)
        assert "second singular value" in message
        # Two separable layers.
        wide = over_the_plane(lambda plane: ndimage.gaussian_filter(plane, 3.0, mode="nearest"))
        fails(testing.assert_separable, lambda image: GAUSSIAN(image) / 2 + wide(image) / 2, SMALL)

    def test_ringing(self) -> None:
        message = fails(testing.assert_no_ringing, SHARPENED, SMALL)
        assert "between the bloom of black and of the flat image" in message
        # Within those bounds, but there is a second edge.
        echo = kernel([[0.0, 0.0, 0.3, 0.7, 0.0, 0.0, -0.1, 0.0, 0.1]])
        assert "only rise" in fails(testing.assert_no_ringing, echo, SMALL)

    def test_ringing_at_the_border(self) -> None:
        fails(testing.assert_no_ringing, SEEING_BLACK, SMALL)

    def test_fireflies(self) -> None:
        message = fails(testing.assert_bounded_fireflies, BOX, 2.0, SMALL)
        assert "brightens others by 2 at most" in message
        clamped = in_floats(lambda image: BOX(np.minimum(image, 9.0)))
        testing.assert_bounded_fireflies(clamped, 1.0, SMALL, brightness=(1, 1e4, math.inf))
        fails(testing.assert_bounded_fireflies, clamped, 0.9, SMALL)
        # The lit pixel itself may be as bright as it was.
        testing.assert_bounded_fireflies(IDENTITY, 0.0, SMALL)

    def test_infinity_that_spreads(self) -> None:
        with pytest.raises(AssertionError, match="the bloom of finite values is finite"):
            testing.assert_bounded_fireflies(BOX, 1.0, SMALL, brightness=(math.inf,))

    @pytest.mark.parametrize(
        "assertion",
        [
            testing.assert_superposition,
            testing.assert_additive,
            testing.assert_symmetric,
            testing.assert_centroid_kept,
            testing.assert_separable,
            testing.assert_no_ringing,
        ],
    )
    def test_results_that_are_not_finite(self, assertion: Callable[..., None]) -> None:
        def broken(image: Image) -> Image:
            image = image.copy()
            image[3, 5, 2] = np.nan
            return image

        with pytest.raises(AssertionError, match="nan at x 5, y 3, channel 2"):
            assertion(broken)


class TestMeasurements:
    def test_point_spread(self) -> None:
        spread = testing.point_spread(LEANING, SMALL, at=(10, 12))
        assert spread.shape == (33, 41, 3)
        np.testing.assert_allclose(spread[12, 9:12, 0], [0.3, 0.5, 0.2], atol=1e-6)
        assert np.count_nonzero(spread[..., 0]) == 3

    def test_point_spread_of_a_picture_over_a_constant(self) -> None:
        spread = testing.point_spread(lambda image: 2 * image + 5, Probe(size=(3, 3), value=4))
        np.testing.assert_allclose(spread[..., 0], [[0, 0, 0], [0, 2, 0], [0, 0, 0]])


@pytest.mark.parametrize(("call", "error"), rows(__file__, "laws"))
def test_a_wrong_value_is_refused(call: str, error: str) -> None:
    assert_refused(call, error, globals())


class TestProbe:
    def test_own_tolerance(self) -> None:
        def off(image: Image) -> Image:
            return image * np.float32(1.001)

        fails(testing.assert_gain, off, 1.0, SMALL)
        testing.assert_gain(off, 1.0, Probe(atol=0.002))
        testing.assert_gain(off, 1.0, Probe(rtol=0.002))
        fails(testing.assert_gain, off, 1.0, Probe(atol=0.0005))

    def test_a_bloom_may_change_what_it_is_given(self) -> None:
        def in_place(image: Image) -> Image:
            image *= 0.5
            return image

        testing.assert_superposition(in_place, SMALL)
        testing.assert_symmetric(in_place, SMALL)

    def test_alpha_is_1_and_is_not_looked_at(self) -> None:
        def bloom(image: Image) -> Image:
            assert (image[..., 3] == 1).all()
            return np.dstack([image[..., :3], np.full(image.shape[:2], 7.0, image.dtype)])

        testing.assert_gain(bloom, 1.0, Probe(channels=4))
        # And of a result with alpha for an image without it.
        testing.assert_gain(lambda image: np.dstack([image, image[..., 0] * 9]), 1.0, SMALL)
