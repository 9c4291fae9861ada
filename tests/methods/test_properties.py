"""Laws of all methods, on the device and in the reference, with generated pictures."""

from __future__ import annotations

from typing import Any

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from tests.exhaustive import by_turns, examples
from tests.tolerance import tolerance
from vkbloom import DualKawase, Pyramid, Renderer, Separable, Settings, reference, testing
from vkbloom.testing import Probe
from vkbloom.testing._probe import Bloom

Image = NDArray[Any]
Array = NDArray[np.float64]

LINEAR: dict[str, Settings] = {
    "separable": Separable(),
    "fractional": Separable(blur_scale=1.7, loops=2, blur_strength=1.0),
    "layers": Separable(layers=((1.0, 1.0), (2.5, 0.5))),
    "outline": Separable(first_tap=0, texel="x"),
    "direct": Separable(direct=True, blur_scale=1.3),
    "half-size": Separable(bloom_scale=0.5),
    "direct-half-size": Separable(direct=True, bloom_scale=0.5),
    "pyramid": Pyramid(),
    "pyramid-radius": Pyramid(levels=3, radius=1.7),
    "dual-kawase": DualKawase(),
    "dual-kawase-offset": DualKawase(levels=2, offset=1.7),
}
NOT_LINEAR: dict[str, Settings] = {
    "knee": Separable(threshold=0.4, knee=0.5),
    "pyramid-knee": Pyramid(threshold=0.3, knee=0.5),
    "firefly": Pyramid(firefly_filter=True, threshold=0.2, knee=1.0),
    "firefly-scaled": Pyramid(firefly_filter=True, bloom_scale=0.7),
}
ALL = {**LINEAR, **NOT_LINEAR}
# Kernels that are the same at every pixel.
UNIFORM = ("separable", "fractional", "layers", "direct")
SEPARABLE = ("separable", "fractional", "direct", "outline", "half-size")
# Of a smaller bloom buffer, the last horizontal blur is evaluated between its texels and the
# vertical one is not; texel="x" stretches one of them.
UNEQUAL_AXES = ("outline", "half-size")
FLOATS = ("float16", "float32")
#: Allowed error of one value, relative to the largest. Half: four roundings of 2**-11.
ERRORS = {"float16": 2e-3, "float32": 1e-5, "float64": 1e-12}
BOTH = pytest.mark.parametrize("dtype", ["float32", "float64"], ids=["device", "reference"])

few = hypothesis.settings(max_examples=examples(2), deadline=None)


def bloom_of(renderer: Renderer, image: Image, settings: Settings) -> Array:
    """Return the bloom of the device, or, of an image of doubles, that of the reference."""
    if image.dtype == np.float64:
        bloom: Array = reference.apply(image, settings)["bloom"]
    else:
        bloom = renderer.apply(image, settings, framebuffers="bloom")["bloom"].astype(np.float64)
    return bloom[..., :3]


def law_of(renderer: Renderer, settings: Settings) -> Bloom:
    return lambda image: bloom_of(renderer, image, settings)


def noise(height: int, width: int, seed: int) -> Image:
    """Multiples of 1/256 from 1/4 to 1: sums of two are exact in all floats."""
    levels = np.random.default_rng(seed).integers(64, 257, (height, width, 3))
    return (levels / 256).astype(np.float32)


sides = st.integers(1, 24)
seeds = st.integers(0, 2**32 - 1)
pictures = st.builds(noise, sides, sides, seeds)


def in_dtype(image: Image, dtype: str) -> Image:
    """Return what `noise` made, nothing of which is lost in another float."""
    return (image * 255).astype(dtype) if dtype == "uint8" else image.astype(dtype)


# --- The laws of vkbloom.testing ---


@pytest.mark.parametrize("dtype", ERRORS)
@pytest.mark.parametrize("method", LINEAR)
@few
@hypothesis.given(size=st.tuples(sides, sides), seed=seeds)
def test_linear_blurs_obey_the_laws_of_filters(
    renderer: Renderer, method: str, dtype: str, size: tuple[int, int], seed: int
) -> None:
    bloom = law_of(renderer, LINEAR[method])
    probe = Probe(size=size, dtype=dtype, seed=seed, rtol=ERRORS[dtype])
    testing.assert_superposition(bloom, probe)
    testing.assert_gain(bloom, reference.gain(LINEAR[method]), probe)
    testing.assert_no_ringing(bloom, probe)


@BOTH
@pytest.mark.parametrize("method", ALL)
@few
@hypothesis.given(size=st.tuples(sides, sides), seed=seeds)
def test_mirrored_and_transposed_images_have_mirrored_and_transposed_blooms(
    renderer: Renderer, method: str, dtype: str, size: tuple[int, int], seed: int
) -> None:
    probe = Probe(size=size, dtype=dtype, seed=seed, rtol=ERRORS[dtype])
    bloom = law_of(renderer, ALL[method])
    testing.assert_symmetric(bloom, probe)
    if method not in UNEQUAL_AXES:
        testing.assert_symmetric(bloom, probe, axes=["xy"])


@BOTH
@pytest.mark.parametrize("method", SEPARABLE)
@few
# A smaller bloom buffer leaves the last row or column of odd sides out.
@hypothesis.given(size=st.tuples(sides, sides).map(lambda size: (2 * size[0], 2 * size[1])))
def test_point_spread_of_separable_blurs_is_separable(
    renderer: Renderer, method: str, dtype: str, size: tuple[int, int]
) -> None:
    probe = Probe(size=size, dtype=dtype, rtol=ERRORS[dtype])
    testing.assert_separable(law_of(renderer, LINEAR[method]), probe)


@BOTH
@pytest.mark.parametrize("method", UNIFORM)
@few
@hypothesis.given(size=st.tuples(st.integers(79, 82), st.integers(79, 82)))
def test_point_stays_in_place_and_keeps_its_energy(
    renderer: Renderer, method: str, dtype: str, size: tuple[int, int]
) -> None:
    bloom, probe = law_of(renderer, LINEAR[method]), Probe(size=size, dtype=dtype)
    testing.assert_centroid_kept(bloom, probe, within=1e-4)
    energy = testing.point_spread(bloom, probe).sum(axis=(0, 1))
    assert_allclose(energy, reference.gain(LINEAR[method]), rtol=1e-5)


# --- Exact laws ---


@pytest.mark.parametrize(("method", "dtype"), by_turns([*LINEAR, "threshold"], turns=FLOATS))
@few
@hypothesis.given(picture=pictures, power=st.integers(-3, 8))
def test_powers_of_two_scale_the_bloom_exactly(
    renderer: Renderer, method: str, dtype: str, picture: Image, power: int
) -> None:
    image, factor = in_dtype(picture, dtype), 2.0**power
    plain = scaled = LINEAR.get(method, Separable(threshold=0.5))
    if plain.threshold is not None:
        scaled = plain.replace(threshold=plain.threshold * factor)
    # A power of two moves the exponent alone, so that every rounding stays what it was.
    assert_array_equal(
        bloom_of(renderer, image * np.asarray(factor, dtype), scaled),
        bloom_of(renderer, image, plain) * factor,
    )


@few
@hypothesis.given(image=pictures, channel=st.integers(0, 2))
def test_channels_do_not_mix(renderer: Renderer, image: Image, channel: int) -> None:
    alone = np.zeros_like(image)
    alone[..., channel] = image[..., channel]
    for settings in LINEAR.values():
        whole = bloom_of(renderer, image, settings)
        part = bloom_of(renderer, alone, settings)
        assert_array_equal(part[..., channel], whole[..., channel])
        assert not np.delete(part, channel, axis=-1).any()


# --- Destination and energy ---


def centroid(bloom: Array) -> Array:
    """Return (y, x) in pixels."""
    weights = bloom.sum(axis=-1)
    y, x = np.indices(weights.shape)
    place: Array = np.array([(weights * y).sum(), (weights * x).sum()]) / weights.sum()
    return place


def spread(bloom: Array) -> float:
    """Return the variance around the centroid, of y and x together, in square pixels."""
    weights = bloom.sum(axis=-1)
    y, x = np.indices(weights.shape)
    centre_y, centre_x = centroid(bloom)
    squares = (y - centre_y) ** 2 + (x - centre_x) ** 2
    return float((weights * squares).sum() / weights.sum())


def point(size: tuple[int, int], place: tuple[int, int], side: int = 1) -> Image:
    width, height = size
    x, y = place
    image = np.zeros((height, width, 3), np.float32)
    image[y : y + side, x : x + side] = 1
    return image


@BOTH
@pytest.mark.parametrize(
    ("settings", "side"),
    [
        pytest.param(Pyramid(levels=3), 1, id="pyramid"),
        pytest.param(Pyramid(levels=2, radius=1.5), 1, id="pyramid-radius"),
        # Its way down is a mean of 2 x 2, so that a point goes to the centre of its square.
        pytest.param(DualKawase(levels=2), 4, id="dual-kawase-2"),
        pytest.param(DualKawase(levels=3), 8, id="dual-kawase-3"),
    ],
)
@few
@hypothesis.given(
    drawn=st.tuples(*[st.integers(16, 19)] * 2, *[st.integers(56, 79)] * 2),
)
def test_point_in_a_chain_that_halves_evenly_stays_in_place_and_keeps_its_energy(
    renderer: Renderer, settings: Settings, side: int, dtype: str, drawn: tuple[int, ...]
) -> None:
    size = (8 * drawn[0], 8 * drawn[1])
    x, y = (offset // side * side for offset in drawn[2:])
    bloom = bloom_of(renderer, point(size, (x, y), side).astype(dtype), settings)
    middle = (side - 1) / 2
    assert_allclose(centroid(bloom), (y + middle, x + middle), rtol=0, atol=2e-3)
    assert_allclose(bloom.sum(axis=(0, 1)), side**2, rtol=1e-4)


@pytest.mark.parametrize(
    "settings",
    [
        pytest.param(Separable(), id="separable"),
        pytest.param(Separable(blur_scale=1.7), id="fractional"),
        pytest.param(Separable(direct=True), id="direct"),
        pytest.param(Separable(bloom_scale=0.5), id="half-size"),
        pytest.param(Pyramid(levels=3), id="pyramid"),
        pytest.param(Pyramid(levels=2, radius=2.3), id="pyramid-radius"),
        pytest.param(DualKawase(levels=3), id="dual-kawase"),
        pytest.param(DualKawase(levels=2, offset=1.7), id="dual-kawase-offset"),
    ],
)
@few
@hypothesis.given(
    size=st.tuples(st.integers(140, 147), st.integers(140, 147)),
    slope=st.tuples(st.integers(-4, 4), st.integers(-4, 4)),
)
def test_ramp_stays_in_place(
    renderer: Renderer, settings: Settings, size: tuple[int, int], slope: tuple[int, int]
) -> None:
    """A shift by any part of a pixel lifts or lowers a ramp."""
    width, height = size
    y, x = np.indices((height, width))
    ramp = 600.0 + slope[0] * (x - width / 2) + slope[1] * (y - height / 2)
    image = np.repeat(ramp[..., np.newaxis], 3, axis=-1).astype(np.float32)
    bloom = bloom_of(renderer, image, settings) / reference.gain(settings)
    # Away from the edges, where there is no ramp. 5e-3 is a shift by a 200th of a pixel.
    inner = (slice(60, -60), slice(60, -60))
    assert_allclose(bloom[inner], image[inner], rtol=0, atol=5e-3)


# --- Bounds ---


@pytest.mark.parametrize(("method", "dtype"), by_turns(ALL, turns=["uint8", *FLOATS]))
@few
@hypothesis.given(picture=pictures, seed=seeds)
def test_nothing_is_negative(
    renderer: Renderer, method: str, dtype: str, picture: Image, seed: int
) -> None:
    """Sparse bright points on black."""
    lit = np.random.default_rng(seed).random((*picture.shape[:2], 1)) < 0.1
    image = in_dtype(lit * picture, dtype)
    for name, array in renderer.apply(image, ALL[method]).items():
        assert (array >= 0).all(), name


# --- Spread ---


@pytest.mark.parametrize(
    ("settings", "field", "largest"),
    [
        pytest.param(Separable(), "blur_scale", 8.0, id="scale"),
        pytest.param(Separable(direct=True), "blur_scale", 4.0, id="direct-scale"),
        pytest.param(Separable(), "blur_strength", 16.0, id="strength"),
        pytest.param(Pyramid(levels=2), "radius", 4.0, id="radius"),
        pytest.param(DualKawase(levels=2), "offset", 4.0, id="offset"),
    ],
)
@few
@hypothesis.given(data=st.data())
def test_spread_grows(
    renderer: Renderer, settings: Settings, field: str, largest: float, data: Any
) -> None:
    # Half a texel apart: pairs of taps that move between the same two texels of a smaller level
    # take from one what they give the other.
    low = data.draw(st.floats(0, largest - 0.5))
    high = data.draw(st.floats(low + 0.5, largest))
    # A whole cell of the smallest level, so that its place in the cell does not count.
    image = point((128, 128), (64, 64), side=4)
    narrow = spread(bloom_of(renderer, image, settings.replace(**{field: low})))
    wide = spread(bloom_of(renderer, image, settings.replace(**{field: high})))
    assert wide > narrow


@pytest.mark.parametrize("method", [Pyramid, DualKawase])
def test_spread_grows_with_the_levels(renderer: Renderer, method: Any) -> None:
    image = point((256, 256), (128, 128), side=32)
    spreads = [spread(bloom_of(renderer, image, method(levels=n))) for n in range(1, 6)]
    assert (np.diff(spreads) > 0).all()


# --- Separability ---


@few
@hypothesis.given(
    image=pictures,
    settings=st.builds(
        Separable,
        blur_scale=st.floats(0, 4),
        blur_strength=st.floats(0, 3),
        loops=st.integers(1, 3),
        first_tap=st.integers(0, 1),
        texel=st.sampled_from(("own", "x")),
        weights=st.lists(st.floats(0.01, 0.2), min_size=1, max_size=6),
    ),
)
def test_direct_is_the_same_blur(renderer: Renderer, image: Image, settings: Separable) -> None:
    two_passes = bloom_of(renderer, image, settings)
    one_pass = bloom_of(renderer, image, settings.replace(direct=True))
    assert_allclose(one_pass, two_passes, rtol=0, atol=1e-5 * two_passes.max())


# --- Fireflies ---


@few
@hypothesis.given(
    size=st.tuples(st.integers(30, 40), st.integers(30, 40)),
    place=st.tuples(st.integers(12, 18), st.integers(12, 18)),
    brightness=st.floats(100, 60000),
)
def test_firefly_is_bound(
    renderer: Renderer, size: tuple[int, int], place: tuple[int, int], brightness: float
) -> None:
    """One bright pixel on black lights one pixel of the first level, whatever its brightness.

    A group of share s and luminance m counts s / (1 + m). Where the groups that see the pixel
    have the share a < 1 of all, they add less than their shares, sum of s m / (1 + m) < a, and
    the others keep 1 - a of the divisor: the value stays under a / (1 - a). The largest a below
    1 is 3/4 (the inner group and two outer ones), so that the bound is 3. Groups that all see
    the pixel have nothing to be weighed against; this is so in no more than one pixel of the
    level, for its taps would have to be less than 1 texel away on both axes, and it keeps what
    it had without the filter at most.
    """
    image = point(size, place) * np.float32(brightness)
    filtered = renderer.apply(image, Pyramid(firefly_filter=True))
    plain = renderer.apply(image, Pyramid())
    by_size = np.sort(filtered["down_0"][..., 0], axis=None)
    assert by_size[-2] <= 3.0
    assert by_size[-1] <= plain["down_0"][..., 0].max() * (1 + 1e-5)


@few
@hypothesis.given(
    cells=st.tuples(st.integers(15, 20), st.integers(15, 20)),
    place=st.tuples(st.integers(12, 18), st.integers(12, 18)),
    brightness=st.floats(1000, 60000),
)
def test_firefly_loses_its_energy(
    renderer: Renderer, cells: tuple[int, int], place: tuple[int, int], brightness: float
) -> None:
    """Of even sides: a sixteenth of the brightness stays in one pixel, 3 in its 8 neighbours.

    Without the filter a quarter of the brightness stays in the level, for it has a quarter of
    the pixels.
    """
    size = (2 * cells[0], 2 * cells[1])
    image = point(size, place) * np.float32(brightness)
    filtered = renderer.apply(image, Pyramid(firefly_filter=True), framebuffers="down_0")
    plain = renderer.apply(image, Pyramid(), framebuffers="down_0")
    assert_allclose(plain["down_0"][..., 0].sum(dtype=np.float64), brightness / 4, rtol=1e-5)
    total = filtered["down_0"][..., 0].sum(dtype=np.float64)
    assert brightness / 16 <= total * (1 + 1e-5)
    assert total <= brightness / 16 * (1 + 1e-5) + 8 * 3


@few
@hypothesis.given(height=sides, width=sides, value=st.floats(1e-6, 100))
def test_firefly_filter_leaves_flat_images(
    renderer: Renderer, height: int, width: int, value: float
) -> None:
    image = np.full((height, width, 3), value, np.float32)
    bloom = bloom_of(renderer, image, Pyramid(firefly_filter=True))
    assert_allclose(bloom, image, rtol=1e-5)


# --- Thresholds ---

bright_parts = st.floats(0, 1)


@pytest.mark.parametrize("dtype", ["uint8", *FLOATS])
@few
@hypothesis.given(
    picture=pictures,
    thresholds=st.tuples(bright_parts, bright_parts),
    knee=st.one_of(st.just(0.0), bright_parts),
)
def test_higher_threshold_lets_less_through(
    renderer: Renderer,
    dtype: str,
    picture: Image,
    thresholds: tuple[float, float],
    knee: float,
) -> None:
    image = in_dtype(picture, dtype)
    low, high = sorted(thresholds)
    names = ("glow", "bloom")
    more = renderer.apply(image, Separable(threshold=low, knee=knee), framebuffers=names)
    less = renderer.apply(image, Separable(threshold=high, knee=knee), framebuffers=names)
    whole = renderer.apply(image, Separable(), framebuffers=names)
    for name in names:
        # Rounding to 8 bits and to half keeps the order; only the formula's own rounding counts.
        slack = 0 if dtype == "uint8" else 1e-5
        for a, b in ((less, more), (more, whole)):
            assert (a[name].astype(np.float64) <= b[name].astype(np.float64) + slack).all(), name


@few
@hypothesis.given(image=pictures, threshold=st.floats(0.26, 0.99))
def test_hard_threshold_keeps_or_drops(renderer: Renderer, image: Image, threshold: float) -> None:
    luminance = image.astype(np.float64) @ (0.2126, 0.7152, 0.0722)
    # Which side of the threshold rounding puts a pixel on is open within a rounding of it.
    hypothesis.assume(np.abs(luminance - threshold).min() > 1e-6)
    settings = Separable(threshold=threshold)
    glow = renderer.apply(image, settings, framebuffers="glow")["glow"][..., :3]
    passes = (luminance > threshold)[..., np.newaxis]
    assert_array_equal(glow, np.where(passes, image, np.float32(0)))


@few
@hypothesis.given(image=pictures, threshold=st.floats(0, 1), knee=st.floats(0.01, 1))
def test_knee_keeps_the_hue(
    renderer: Renderer, image: Image, threshold: float, knee: float
) -> None:
    settings = Separable(threshold=threshold, knee=knee)
    glow = renderer.apply(image, settings, framebuffers="glow")["glow"][..., :3]
    scale = glow.max(axis=-1, keepdims=True) / image.max(axis=-1, keepdims=True)
    assert (scale <= 1 + 1e-5).all()
    assert_allclose(glow, image * scale, rtol=0, atol=1e-6)


# --- One picture, whatever came before it ---


@few
@hypothesis.given(
    steps=st.lists(
        st.tuples(
            st.integers(0, 5),
            st.sampled_from(sorted(ALL)),
            st.sampled_from(("final", "bloom", "all")),
        ),
        min_size=2,
        max_size=8,
    )
)
def test_order_of_calls_does_not_matter(
    renderer: Renderer, steps: list[tuple[int, str, Any]]
) -> None:
    for index, method, framebuffers in steps:
        # Four sizes, two pictures of the first one, two dtypes.
        image = in_dtype(noise(9 + index % 4, 12 - index % 4, index), FLOATS[index % 2])
        frames = renderer.apply(image, ALL[method], framebuffers=framebuffers)
        expected = reference.apply(image, ALL[method])
        for name, array in frames.items():
            limit = tolerance(array.dtype, expected[name])
            assert (np.abs(array - expected[name]) <= limit).all(), name
