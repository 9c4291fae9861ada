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
from vkbloom.testing._laws.table import LAWS

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
    names = ("superposition", "gain", "symmetric", "transposed", "centroid_kept", "separable")
    testing.assert_laws(blur, *names, "no_ringing", gain=1.0, probe=probe)


def bloom_of(renderer: Renderer, settings: Any, name: str = "bloom") -> Bloom:
    return lambda image: renderer.apply(image, settings, framebuffers=(name,))[name]


def test_the_picture_with_its_bloom(renderer: Renderer) -> None:
    settings = Separable(intensity=0.5)
    picture, glow = (bloom_of(renderer, settings, name) for name in ("final", "bloom"))
    testing.assert_laws(picture, "additive", probe=SMALL)
    both: dict[str, Any] = {"picture": picture, "probe": SMALL}
    testing.assert_laws(glow, "additive", intensity=0.5, **both)
    assert "F(a) = a + 0.49 G(a)" in fails(glow, "additive", intensity=0.49, **both)
    # Without the factor, the picture is only held to F(a) >= a.
    testing.assert_laws(glow, "additive", **both)
    fails(glow, "additive", picture=glow, probe=SMALL)
    testing.assert_laws(picture, "gain", gain=1 + 0.5 * reference.gain(settings), probe=SMALL)
    mixed = Separable(composite="mix", intensity=0.5, blur_strength=0.1)
    message = fails(bloom_of(renderer, mixed, "final"), "additive", probe=SMALL)
    assert "light is added, and none is removed" in message


def off_by(*amounts: float) -> Bloom:
    """Return a bloom of 1 whose results are off, each call's but the first by the next amount."""
    left = iter((0.0, *amounts))
    return lambda image: image.astype(np.float64) + next(left)


def test_every_result_may_be_off() -> None:
    probe = Probe(size=(5, 5), dtype="float64", atol=0.01)
    # The mixture of the two images in one direction, both in the other: by 0.01 each, 0.0175.
    testing.assert_laws(off_by(0.0099, -0.0099, -0.0099), "superposition", probe=probe)
    fails(off_by(0.0101, -0.0101, -0.0101), "superposition", probe=probe)
    # A limit is allowed beyond that.
    wide = {"superposition": {"off": 0.001}}
    testing.assert_laws(off_by(0.0104, -0.0104, -0.0104), "superposition", limits=wide, probe=probe)
    # The picture, and half of the bloom that is added: 0.015.
    for amount, check in ((0.0099, testing.assert_laws), (0.0101, fails)):

        def lit(image: Image, amount: float = amount) -> Image:
            return 1.5 * image + amount

        check(off_by(-amount), "additive", picture=lit, intensity=0.5, probe=probe)


class TestBrokenLaws:
    def test_superposition(self) -> None:
        message = fails(in_floats(lambda image: image**1.1), "superposition", probe=SMALL)
        assert "B(a / 2 + b / 4) = B(a) / 2 + B(b) / 4" in message
        # Additive, not homogeneous: nothing else would notice a constant.
        fails(in_floats(lambda image: image + 0.01), "superposition", probe=SMALL)
        step = in_floats(lambda image: np.where(image > 0.5, image, 0.0))
        fails(step, "superposition", probe=SMALL)

    @pytest.mark.parametrize("gain", [0.0, 0.98, 1.02])
    def test_gain(self, gain: float) -> None:
        assert f"{gain:g} v" in fails(BOX, "gain", gain=gain, probe=SMALL)
        assert f"{gain:g} v" in fails(BOX, "gain", gain=gain, size=(41, 33))

    def test_gain_at_the_border(self) -> None:
        assert "x 0, y 0" in fails(SEEING_BLACK, "gain", gain=1.0, probe=SMALL)

        def dark_spot(image: Image) -> Image:
            image = image.copy()
            image[7, 9, 1] = 0
            return image

        assert "at x 9, y 7, channel 1" in fails(dark_spot, "gain", gain=1.0, probe=SMALL)

    def test_symmetry(self) -> None:
        assert "left and right" in fails(LEANING, "symmetric", probe=SMALL)
        alone = {"symmetric": {"x": math.inf}}
        testing.assert_laws(LEANING, "symmetric", limits=alone, probe=SMALL)
        assert "rows and columns" in fails(LEANING, "transposed", probe=SMALL)
        fails(SHIFTED, "symmetric", probe=SMALL)

    def test_centroid(self) -> None:
        message = fails(SHIFTED, "centroid_kept", probe=SMALL)
        assert "+0.5 pixels from x 20, channel 0" in message
        for bloom, off, check in ((SHIFTED, 0.51, testing.assert_laws), (LEANING, 0.09, fails)):
            check(bloom, "centroid_kept", limits={"centroid_kept": {"off": off}}, probe=SMALL)

    def test_separability(self) -> None:
        assert "second singular value" in fails(PLUS, "separable", probe=SMALL)
        # Two separable layers.
        wide = over_the_plane(lambda plane: ndimage.gaussian_filter(plane, 3.0, mode="nearest"))
        fails(lambda image: GAUSSIAN(image) / 2 + wide(image) / 2, "separable", probe=SMALL)

    def test_ringing(self) -> None:
        message = fails(SHARPENED, "no_ringing", probe=SMALL)
        assert "between the bloom of black and of the flat image" in message
        # Within those bounds, but there is a second edge.
        echo = kernel([[0.0, 0.0, 0.3, 0.7, 0.0, 0.0, -0.1, 0.0, 0.1]])
        assert "only rise" in fails(echo, "no_ringing", probe=SMALL)

    def test_ringing_at_the_border(self) -> None:
        fails(SEEING_BLACK, "no_ringing", probe=SMALL)

    def test_fireflies(self) -> None:
        def within(limit: float) -> dict[str, Any]:
            return {"limits": {"bounded_fireflies": {"off": limit}}, "probe": SMALL}

        message = fails(BOX, "bounded_fireflies", **within(2.0))
        assert "brightens others by 2 at most" in message
        clamped = in_floats(lambda image: BOX(np.minimum(image, 9.0)))
        testing.assert_laws(clamped, "bounded_fireflies", **within(1.0))
        fails(clamped, "bounded_fireflies", **within(0.9))
        # The lit pixel itself may be as bright as it was.
        testing.assert_laws(IDENTITY, "bounded_fireflies", **within(0.0))

    @pytest.mark.parametrize("name", LAWS)
    def test_results_that_are_not_finite(self, name: str) -> None:
        def broken(image: Image) -> Image:
            image = image.copy()
            image[3, 5, 2] = np.nan
            return image

        with pytest.raises(AssertionError, match="nan at x 5, y 3, channel 2"):
            testing.assert_laws(broken, name, size=(32, 32))


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

        fails(off, "gain", gain=1.0, probe=SMALL)
        testing.assert_laws(off, "gain", gain=1.0, probe=Probe(atol=0.002))
        testing.assert_laws(off, "gain", gain=1.0, probe=Probe(rtol=0.002))
        fails(off, "gain", gain=1.0, probe=Probe(atol=0.0005))

    def test_a_bloom_may_change_what_it_is_given(self) -> None:
        def in_place(image: Image) -> Image:
            image *= 0.5
            return image

        testing.assert_laws(in_place, "superposition", "symmetric", probe=SMALL)

    def test_alpha_is_1_and_is_not_looked_at(self) -> None:
        def bloom(image: Image) -> Image:
            assert (image[..., 3] == 1).all()
            return np.dstack([image[..., :3], np.full(image.shape[:2], 7.0, image.dtype)])

        testing.assert_laws(bloom, "gain", gain=1.0, probe=Probe(channels=4))
        # And of a result with alpha for an image without it.
        testing.assert_laws(
            lambda image: np.dstack([image, image[..., 0] * 9]), "gain", gain=1.0, probe=SMALL
        )
