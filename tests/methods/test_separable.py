"""The separable blur: against the reference, against itself done directly, and its parameters."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.exhaustive import by_turns
from tests.screens import noise, screen
from tests.tolerance import colours
from vkbloom import Frames, Renderer, Scene, Separable, gaussian_weights, reference

Format = Literal["rgba8unorm", "rgba16float", "rgba32float"]
FORMATS: tuple[Format, ...] = ("rgba8unorm", "rgba16float", "rgba32float")
FLOATS = FORMATS[1:]
LEVEL = 1 / 255

# How far a framebuffer may be from the reference, which rounds nothing. In 8 bits a level for each
# of the images that are stored on the way to it: half a level is rounding, as much is left to
# samplers that filter in 8 bits.
LEVELS = {"blur_vertical": 1, "bloom": 2}
# In float formats as a fraction of the largest value; a device may round half floats towards zero,
# which is 2^-10 of a value.
FRACTION = {"rgba16float": 1e-3, "rgba32float": 1e-4}

Size = tuple[int, int]


def render(
    renderer: Renderer, image: NDArray[Any], settings: Separable, frame: Size | None = None
) -> Frames:
    """Render with the image as the glow; the frame has its size unless another is given."""
    buffers = (image.shape[1], image.shape[0])
    frame = frame or buffers
    return renderer.render(
        screen(image, frame), settings.replace(bloom_size=buffers), frame, time=0.0
    )


def brightest(format: Format) -> float:
    """Return how bright a test's glow may be: more than 1 where the format holds it."""
    return 1.0 if format == "rgba8unorm" else 8.0


def assert_is_the_references(frames: Frames, settings: Separable, format: Format) -> None:
    """Compare the blur with the reference's blur of the glow that came with it."""
    height, width, _ = frames["bloom"].shape
    expected = reference.passes(frames["glow"], settings, (width, height), format)
    compared = [name for name in ("blur_vertical", "bloom") if name in frames]
    assert compared == list(expected)
    for name in compared:
        right = expected[name][..., :3]
        highest = float(right.max())
        assert highest > 0.04
        if format == "rgba8unorm":
            apart = np.abs(frames[name][..., :3] - np.round(right / LEVEL)).max()
            assert apart <= LEVELS[name], name
        else:
            apart = np.abs(colours(frames[name]) - right).max()
            assert apart <= FRACTION[format] * highest, name
        assert (frames[name][..., 3] == (255 if format == "rgba8unorm" else 1)).all()


# Against the reference

NORMALIZED = Separable(weights=gaussian_weights(2.0), blur_strength=1.0)

SETTINGS = [
    Separable(),
    Separable(blur_scale=0.0),
    Separable(blur_scale=0.1),
    Separable(blur_scale=0.73),
    Separable(blur_scale=1.37),
    Separable(blur_scale=2.0),
    Separable(blur_scale=16.0, blur_strength=0.5),
    Separable(blur_strength=0.0),
    Separable(blur_strength=16.0),
    Separable(texel="x"),
    Separable(first_tap=0),
    Separable(first_tap=0, texel="x", blur_scale=1.2),
    Separable(weights=(0.7,)),
    Separable(weights=(0.7,), first_tap=0),
    Separable(weights=(0.0, 0.5), blur_strength=1.0),
    Separable(weights=gaussian_weights(20.0, 64), blur_strength=1.0),
    Separable(weights=gaussian_weights(20.0, 64), blur_strength=1.0, blur_scale=0.4),
    Separable(weights=(0.8, -0.2, 0.1)),
    NORMALIZED.replace(loops=3),
    NORMALIZED.replace(loops=3, blur_scale=1.1, texel="x"),
    NORMALIZED.replace(layers=((1.0, 0.4), (2.0, 0.3), (4.0, 0.2))),
    NORMALIZED.replace(layers=((0.5, 0.4), (1.3, 0.5)), loops=2),
    Separable(direct=True),
    Separable(direct=True, blur_scale=1.37, texel="x", first_tap=0),
    NORMALIZED.replace(direct=True, loops=2, layers=((1.0, 0.5), (2.0, 0.4))),
]


@pytest.mark.parametrize(("settings", "format"), by_turns(SETTINGS, turns=FORMATS))
def test_device_equals_the_reference(
    renderer: Renderer, settings: Separable, format: Format
) -> None:
    settings = settings.replace(format=format)
    image = noise((61, 47), brightest(format))
    assert_is_the_references(render(renderer, image, settings), settings, format)


@pytest.mark.parametrize(
    ("size", "blur_scale", "format"),
    by_turns([(1, 1), (7, 1), (1, 9), (333, 517)], [1.0, 1.37], turns=FORMATS),
)
def test_sizes(renderer: Renderer, size: Size, blur_scale: float, format: Format) -> None:
    settings = Separable(blur_scale=blur_scale, format=format)
    image = noise(size, brightest(format))
    assert_is_the_references(render(renderer, image, settings), settings, format)


@pytest.mark.parametrize(("blur_scale", "format"), by_turns([1.0, 0.77], turns=FORMATS))
def test_bloom_buffers_of_1280_x_720(renderer: Renderer, blur_scale: float, format: Format) -> None:
    size = (1280, 720)
    settings = Separable(blur_scale=blur_scale, format=format, bloom_size=size)
    squares = screen(noise((160, 90), brightest(format)), size)
    frames = renderer.render(squares, settings, size)
    assert frames["glow"].shape == (720, 1280, 4)
    assert_is_the_references(frames, settings, format)


@pytest.mark.parametrize(
    ("sizes", "direct", "format"),
    by_turns(
        [
            ((64, 64), (128, 72)),
            ((64, 64), (32, 32)),
            ((31, 17), (100, 50)),
            ((120, 40), (50, 61)),
            ((1, 1), (20, 10)),
            ((20, 10), (1, 1)),
        ],
        [False, True],
        turns=FORMATS,
    ),
)
def test_buffers_of_another_size_than_the_frame(
    renderer: Renderer, sizes: tuple[Size, Size], direct: bool, format: Format
) -> None:
    buffers, frame = sizes
    settings = Separable(blur_scale=1.2, texel="x", direct=direct, format=format)
    image = noise(buffers, brightest(format))
    assert_is_the_references(render(renderer, image, settings, frame), settings, format)


@pytest.mark.parametrize("format", FORMATS)
def test_the_longest_kernel_directly(renderer: Renderer, format: Format) -> None:
    settings = Separable(
        weights=gaussian_weights(20.0, 64), blur_strength=1.0, direct=True, format=format
    )
    image = noise((40, 30), brightest(format))
    assert_is_the_references(render(renderer, image, settings), settings, format)


@pytest.mark.parametrize("blur_scale", [1.0, 0.6])
@pytest.mark.parametrize("time", [0.0, 0.4])
def test_the_saucers_glow(renderer: Renderer, scene: Scene, blur_scale: float, time: float) -> None:
    settings = Separable(blur_scale=blur_scale)
    frames = renderer.render(scene, settings, (640, 360), time=time)
    assert_is_the_references(frames, settings, "rgba8unorm")


# Separability: the same kernel in two passes of N taps and in one of N x N


def similarity(one: NDArray[np.float64], other: NDArray[np.float64], highest: float) -> float:
    metrics = pytest.importorskip("skimage.metrics", reason="scikit-image is not installed")
    return float(metrics.structural_similarity(one, other, data_range=highest, channel_axis=2))


@pytest.mark.parametrize("blur_scale", [1.0, 1.37])
@pytest.mark.parametrize("format", FORMATS)
def test_separable_is_direct(renderer: Renderer, format: Format, blur_scale: float) -> None:
    # The gain is 1, so that nothing is clamped in 8 bits.
    settings = NORMALIZED.replace(blur_scale=blur_scale, format=format)
    assert reference.gain(settings) <= 1 + 1e-9
    # Squares, of which the blur leaves a structure that rounding to 8 bits does not rule.
    image = np.kron(noise((37, 31), brightest(format)), np.ones((7, 9, 1)))
    passes = colours(render(renderer, image, settings)["bloom"])
    direct = colours(render(renderer, image, settings.replace(direct=True))["bloom"])
    highest = direct.max()
    assert highest > 0.3
    likeness = similarity(passes, direct, highest)
    assert likeness > (0.999 if format == "rgba8unorm" else 0.99999)
    # Two images are stored on the one way and one on the other. In 8 bits at whole texels each
    # of the three adds half a level, which cannot make two levels.
    if format == "rgba8unorm":
        allowed = LEVEL if blur_scale == 1.0 else 2 * LEVEL
    else:
        allowed = 2 * FRACTION[format] * highest
    assert np.abs(passes - direct).max() <= allowed + 1e-6


def test_another_kernel_differs(renderer: Renderer) -> None:
    # What the bounds above are worth: they tell a kernel that is wider by a hundredth apart.
    image = np.kron(noise((37, 31), 8.0), np.ones((7, 9, 1)))
    settings = NORMALIZED.replace(format="rgba32float")
    wider = settings.replace(weights=gaussian_weights(2.02))
    passes, other = (colours(render(renderer, image, s)["bloom"]) for s in (settings, wider))
    likeness = similarity(passes, other, passes.max())
    assert likeness < 0.99999
    assert np.abs(passes - other).max() > 2 * FRACTION["rgba16float"] * passes.max()


# What the parameters do


def flat(value: float, size: Size = (24, 16)) -> NDArray[np.float64]:
    return np.full((size[1], size[0], 3), value)


GAINS = [
    Separable(),
    Separable(blur_scale=3.7),
    Separable(blur_strength=0.25),
    Separable(first_tap=0),
    Separable(texel="x"),
    Separable(loops=3),
    Separable(layers=((1.0, 1.0), (2.0, 0.5), (4.0, 0.25))),
    Separable(weights=(0.5,), blur_strength=7.0),
    Separable(weights=(0.1,) * 65),
    NORMALIZED,
    Separable(direct=True, loops=2),
]


@pytest.mark.parametrize("settings", GAINS)
def test_the_gain_in_8_bits_is_clamped(renderer: Renderer, settings: Separable) -> None:
    gain = reference.gain(settings)
    bloom = colours(render(renderer, flat(128 * LEVEL), settings)["bloom"])
    # Layers are clamped as they add up, and loops on the way, but all of these only grow or
    # only shrink, so that the end is the same.
    right = min(1.0, 128 * LEVEL * gain)
    assert np.abs(bloom - right).max() <= LEVELS["bloom"] * LEVEL


def spread(line: NDArray[np.float64]) -> tuple[float, float]:
    """Return the mean and the variance of where a line's light is, in pixels."""
    places = np.arange(len(line)) + 0.5
    mean = float(places @ line / line.sum())
    return mean, float((places - mean) ** 2 @ line / line.sum())


def kernel_variance(settings: Separable, texel: float) -> float:
    """Return the variance of the blur of a point in one direction, in pixels squared.

    Tap i is i * step texels away. Between two texels it takes (1 - f) of one and f of the
    other, which adds f (1 - f) to the variance.
    """
    step = settings.blur_scale * texel
    centre, *sides = settings.weights
    total, moment = centre, 0.0
    for tap, weight in enumerate(sides, start=1):
        fraction = math.modf(tap * step)[0]
        both = 2 * settings.blur_strength * weight
        total += both
        moment += both * ((tap * step) ** 2 + fraction * (1 - fraction))
    return moment / total


@pytest.mark.parametrize(
    ("blur_scale", "texel", "format"),
    by_turns([0.0, 0.35, 0.5, 1.0, 1.37, 2.0, 3.0, 4.0], ["own", "x"], turns=FLOATS),
)
def test_the_spread_of_a_point(
    renderer: Renderer, blur_scale: float, texel: Literal["own", "x"], format: Format
) -> None:
    width, height = 81, 63
    point = np.zeros((height, width, 3))
    point[height // 2, width // 2] = 1.0
    settings = Separable(blur_scale=blur_scale, texel=texel, format=format)
    bloom = colours(render(renderer, point, settings)["bloom"])[..., 0]
    # A texel of the width is height / width texels of the height.
    texels = {"x": 1.0, "y": height / width if texel == "x" else 1.0}
    for axis, line in (("x", bloom.sum(axis=0)), ("y", bloom.sum(axis=1))):
        mean, variance = spread(line)
        assert mean == pytest.approx(len(line) / 2, abs=1e-3)
        right = kernel_variance(settings, texels[axis])
        assert variance == pytest.approx(right, rel=2e-3, abs=1e-6)
    assert bloom.sum() == pytest.approx(reference.gain(settings), rel=1e-3)
