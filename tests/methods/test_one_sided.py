"""Derivatives at random points, among them kinks, beside differences to both sides.

Where the differences to the left and to the right agree, they are the derivative. Elsewhere the
derivative is any that the documentation names.
"""

from __future__ import annotations

import functools
import itertools
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.exhaustive import EXHAUSTIVE, some
from tests.methods.adjoints import CASES as METHODS
from tests.methods.test_derivatives import BOUNDARIES, CURVED, KERNEL
from vkbloom import BlenderGlare, GodotBloom, Pyramid, Renderer, Separable, reference
from vkbloom._doctor.cases import COMPOSITES, ENCODINGS, TONEMAPS

Array = NDArray[np.float64]

GLARES = (
    vkbloom.Streaks(threshold=0.25, iterations=2),
    vkbloom.Ghosts(threshold=0.25),
    vkbloom.Halo(),
    vkbloom.Dirt(seed=1),
)
GODOTS: tuple[Any, ...] = (*COMPOSITES, "soft_light", "replace")
GODOT_TONEMAPS: tuple[Any, ...] = ("none", "reinhard", "agx")
ALPHAS: tuple[Any, ...] = ("keep", "max", "blur")
BLENDER_TYPES: tuple[Any, ...] = (
    *("bloom", "fog_glow", "streaks", "ghosts", "simple_star", "sun_beams"),
)
SETTINGS: tuple[Any, ...] = (
    *METHODS.values(),
    *(each.replace(format=None) for each in CURVED.values()),
    *(
        Separable(tonemap=tonemap, encoding=encoding, composite=composite, threshold=0.25, knee=1.0)
        for tonemap, encoding, composite in zip(
            TONEMAPS * 5, [e for e in ENCODINGS for _ in TONEMAPS], COMPOSITES * 10, strict=True
        )
    ),
    *(
        GodotBloom(composite=composite, tonemap=tonemap, threshold=0.5, threshold_scale=0.5)
        for composite, tonemap in itertools.product(GODOTS, GODOT_TONEMAPS)
    ),
    *(
        BlenderGlare(type=type, saturation=saturation, threshold=threshold, quality="high")
        for type, saturation, threshold in itertools.product(
            BLENDER_TYPES, (0.25, 1.0, 1.5), (None, 0.5)
        )
    ),
    *(
        Pyramid(levels=2, alpha=alpha, composite=composite, threshold=0.5, glare=glare)
        for alpha, composite, glare in zip(
            ALPHAS * 4, COMPOSITES * 4, [(one,) for one in GLARES] * 3, strict=True
        )
    ),
    *(
        vkbloom.Convolution(psf=KERNEL, boundary=each, threshold=0.5, knee=0.5)
        for each in BOUNDARIES
    ),
)
#: Of each of the settings: 10,000 directions in all when exhaustive.
POINTS: Final = 8
DIRECTIONS: Final = 8
STEP: Final = 2.0**-20
#: Where curves and thresholds have kinks.
LEVELS: Final = (0.0, 1.0, 0.25, 0.5, 0.75, 0.0031308, 1 / 12 / 0.26496, 1 / 0.26496, 0.08, 0.8)


def point(random: np.random.Generator, channels: int) -> Array:
    """Return a small image of float32 with colours, greys, black, white and kinks."""
    height, width = (int(random.integers(1, 8)) for _ in range(2))
    image = random.random((height, width, channels)) * 1.5
    grey = random.random((height, width, 1)) * 1.5
    level = random.choice(LEVELS, (height, width, 1))
    primary = level * (random.random((height, width, channels)) < 0.5)
    kind = random.choice(6, (height, width, 1), p=random.dirichlet(np.ones(6)))
    none = np.zeros_like(image)
    chosen = np.choose(kind, [image, grey + none, level + none, primary, -image, none])
    if channels == 4:
        chosen[..., 3] = random.choice([0.0, 0.5, 1.0], (height, width))
    return chosen.astype(np.float32).astype(np.float64)


def random_direction(random: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Return a direction: of all pixels or of one, of all channels, of one, grey or of two."""
    direction = random.standard_normal(shape)
    kind = random.integers(5)
    if kind == 1:
        direction[:] = direction[..., :1]
    if kind == 2:
        direction[..., 0] = -direction[..., 1]
        direction[..., 2:] = 0
    if kind == 3:
        direction[..., np.arange(shape[2]) != random.integers(shape[2])] = 0
    if kind == 4:
        direction[..., 0] = -direction[..., 1:3].sum(axis=-1)
    if random.random() < 0.5:
        kept = np.zeros(shape)
        kept[random.integers(shape[0]), random.integers(shape[1])] = 1
        direction *= kept
    return direction


def cotangents(random: np.random.Generator, frames: Any) -> dict[str, Array]:
    """Return cotangents of the last framebuffer, or of three."""
    names = [name for name in ("glow", "bloom", "final") if name in frames]
    names = names[-1:] if random.random() < 0.6 else names
    given = {name: random_direction(random, frames[name].shape) for name in names}
    return {name: part.astype(np.float32).astype(np.float64) for name, part in given.items()}


def slope(
    image: Array, settings: Any, given: dict[str, Array], direction: Array
) -> tuple[float | None, float]:
    """Return the derivative along a direction, and the size of its terms.

    None: the differences to both sides, or those of two steps, do not agree.
    """
    middle = reference.apply(image, settings)
    found, sizes = [], [1e-3]
    for step in (STEP, -STEP, STEP / 2, -STEP / 2):
        frames = reference.apply(image + step * direction, settings)
        terms = [(frames[name] - middle[name]) * part / step for name, part in given.items()]
        found.append(float(sum(term.sum() for term in terms)))
        sizes.append(float(sum(np.abs(term).sum() for term in terms)))
    size = max(sizes)
    return (found[0] if np.ptp(found) <= 1e-5 * size else None), size


def check_points(number: int, count: int) -> int:
    """Check derivatives at points of some settings; return how many there were."""
    random = np.random.default_rng(number)
    settings = SETTINGS[number].replace(format="rgba32float")
    seen = 0
    for _ in range(count):
        image = point(random, 3 if settings.alpha == "keep" else 4)
        # Equal pixels have no derivative: that of a median is the median of the changes.
        if getattr(settings, "anti_flicker", False):
            image = image + random.random(image.shape) / 8
        image = image.astype(np.float32).astype(np.float64)
        frames, pullback = reference.vjp(image, settings)
        for _ in range(DIRECTIONS):
            given, direction = cotangents(random, frames), random_direction(random, image.shape)
            derivative = pullback(given)["image"]
            assert np.isfinite(derivative).all()
            expected, size = slope(image, settings, given, direction)
            if expected is not None:
                # After transforms, values count as 0 up to the rounding of the largest one.
                rounding = 2.0**-23 * np.abs(derivative).max() * np.abs(direction).sum()
                off = abs((derivative * direction).sum() - expected)
                assert off <= 3e-5 * size + rounding, settings
            seen += expected is not None
    return seen


@pytest.mark.parametrize("number", some(range(len(SETTINGS)), 24))
def test_reference_has_the_differences_to_both_sides(number: int) -> None:
    assert check_points(number, POINTS if EXHAUSTIVE else 1)


CHAINS: tuple[Any, ...] = (
    Separable(tonemap="aces", encoding="srgb"),
    Separable(composite="screen", tonemap="aces", encoding="srgb"),
    Pyramid(levels=2, composite="screen", tonemap="agx", encoding="srgb"),
    GodotBloom(composite="screen", encoding="srgb"),
    BlenderGlare(type="bloom", threshold=0.5, encoding="srgb"),
    vkbloom.UrpBloom(threshold=None, encoding="srgb"),
    vkbloom.PygfxBloom(encoding="srgb"),
)


@pytest.mark.parametrize("settings", CHAINS)
@pytest.mark.parametrize("level", [0.0, 0.5, 1.0])
def test_kinks_behind_one_another_are_halved_once(
    renderer: Renderer, settings: Any, level: float
) -> None:
    """Opposite changes of two channels have equal differences to both sides."""
    image = np.full((2, 3, 3), level)
    direction, given = np.zeros(image.shape), {"final": np.zeros(image.shape, np.float32)}
    direction[0, 1] = given["final"][:] = (1, -1, 0)
    before, right, left = (
        float((reference.apply(image + step * direction, settings)["final"] * given["final"]).sum())
        for step in (0, STEP, -STEP)
    )
    expected = (right - before) / STEP
    assert expected == pytest.approx((before - left) / STEP, rel=1e-3, abs=1e-3)
    of_device: Any = functools.partial(vkbloom.vjp, renderer=renderer)
    for vjp in (reference.vjp, of_device):
        found = vjp(image.astype(np.float32), settings)[1](given)["image"]
        assert (found * direction).sum() == pytest.approx(expected, rel=1e-3, abs=1e-3)


#: Settings at a kink behind another one: the image's colour, and the channels that change.
MEANS: tuple[tuple[Any, tuple[float, ...], slice], ...] = (
    (
        vkbloom.FilamentBloom(resolution=16, levels=2, threshold=0.5, alpha="blur"),
        (0.5, 0, 0, 0.5),
        slice(1),
    ),
    (vkbloom.UnrealBloom(threshold=0.5, alpha="blur"), (0.5, 0.5, 0.5, 0.5), slice(1)),
    (vkbloom.PlayCanvasBloom(alpha="blur", intensity=0.5), (0.25, 0.25, 0.25, 0), slice(3, 4)),
    (vkbloom.PlayCanvasBloom(alpha="blur", intensity=0.5), (0, 0, 0, 1), slice(1)),
    (vkbloom.UrpBloom(threshold=None, alpha="blur"), (0.25, 0.25, 0.25, 0), slice(3, 4)),
    (Separable(alpha="max"), (0, 0, 0, 0), slice(3)),
    (Pyramid(levels=2, alpha="blur", glare=GLARES[:1]), (0, 0, 0, 0), slice(3, 4)),
)


@pytest.mark.parametrize(("settings", "colour", "changed"), MEANS)
def test_kinks_of_a_chain_have_the_mean_of_both_sides(
    renderer: Renderer, settings: Any, colour: tuple[float, ...], changed: slice
) -> None:
    # Filament's first level has a side of 16. Only where this is a power of two times the image's
    # are the sums of its taps exact, and at the kink on every device.
    image = np.broadcast_to(colour, (8, 8, 4)).astype(np.float64)
    settings = settings.replace(format="rgba32float")
    direction, given = np.zeros(image.shape), {"final": np.ones(image.shape, np.float32)}
    direction[1, 2, changed] = 1
    left, before, right = (
        float(reference.apply(image + step * direction, settings)["final"].sum())
        for step in (-STEP, 0, STEP)
    )
    # A kink indeed.
    assert abs(right + left - 2 * before) > 1e-3 * STEP
    expected = (right - left) / (2 * STEP)
    for vjp in (reference.vjp, functools.partial(vkbloom.vjp, renderer=renderer)):
        found = vjp(image.astype(np.float32), settings)[1](given)["image"]
        assert (found * direction).sum() == pytest.approx(expected, rel=1e-4)


#: Fields at a kink, and values of them.
KINKED: tuple[tuple[Any, str, Any], ...] = (
    (vkbloom.UrpBloom(), "tint", (1.0, 0.5, 0.3)),
    (vkbloom.PostProcessingBloom(knee=0.5), "threshold", 1.0),
    (vkbloom.PostProcessingBloom(), "clamp", 1.0),
    (BlenderGlare(threshold=0.25), "smoothness", 0.25),
    (BlenderGlare(smoothness=0.25), "threshold", 0.25),
)


@pytest.mark.parametrize(("settings", "name", "value"), KINKED)
def test_fields_at_a_kink_have_the_mean_of_both_sides(
    settings: Any, name: str, value: float | tuple[float, ...]
) -> None:
    image = np.random.default_rng(1).random((8, 9, 3)) ** 2 * 4
    settings = settings.replace(format="rgba32float")

    def total(step: float) -> float:
        first, *rest = np.atleast_1d(value)
        changed = (first + step, *rest) if isinstance(value, tuple) else first + step
        return float(reference.apply(image, settings.replace(**{name: changed}))["bloom"].sum())

    left, before, right = (total(step) for step in (-STEP, 0, STEP))
    assert abs(right + left - 2 * before) > 1e-3 * STEP
    frames, pullback = reference.vjp(image, settings.replace(**{name: value}))
    found = pullback({"bloom": np.ones(frames["bloom"].shape)})[name]
    assert found.ravel()[0] == pytest.approx((right - left) / (2 * STEP), rel=1e-4)


CURVES = [
    (tonemap, encoding, composite, alpha)
    for tonemap, encoding in itertools.product(TONEMAPS, ENCODINGS)
    for composite, alpha in zip(COMPOSITES, ALPHAS, strict=True)
]


@pytest.mark.parametrize(("tonemap", "encoding", "composite", "alpha"), some(CURVES, 12))
def test_every_curve_is_finite(
    renderer: Renderer, tonemap: Any, encoding: Any, composite: Any, alpha: Any
) -> None:
    """At black, white, the largest half float and negative values, with fields."""
    values = (0.0, 1.0, 65504.0, -0.25, -1.0, -65504.0)
    image = np.array(values, np.float32).repeat(4).reshape(2, 3, 4)
    image[..., 3] = (0, 0.5, 1)
    given = {"tonemap": tonemap, "encoding": encoding, "composite": composite, "alpha": alpha}
    for settings in (Separable(**given, threshold=0.5, knee=0.5), Separable(**given)):
        cotangent = {"final": np.ones(image.shape, np.float32)}
        found = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangent)
        expected = reference.vjp(image, settings)[1](cotangent)
        for name, part in expected.items():
            assert np.isfinite(part).all(), name
            assert np.isfinite(found[name]).all(), name
        limit = 1e-5 * np.abs(expected["image"]).max()
        assert np.abs(found["image"] - expected["image"]).max() <= limit


@pytest.mark.parametrize("type", BLENDER_TYPES)
def test_a_grey_keeps_the_derivative_of_its_chroma(renderer: Renderer, type: Any) -> None:
    random = np.random.default_rng(1)
    image = (random.random((4, 5, 1), np.float32) * 2).repeat(3, axis=2)
    image[2, 3] = 0
    settings = BlenderGlare(type=type, threshold=0.25, saturation=1.5, color_modulation=0.0)
    cotangent: Any = {"bloom": np.zeros((4, 5, 4), np.float32)}
    cotangent["bloom"][..., 0], cotangent["bloom"][..., 1] = 1, -1
    for sums in (0, 1):
        cotangent["bloom"][..., 2] = sums
        found = vkbloom.vjp(image, settings, renderer=renderer)[1](cotangent)["image"]
        expected = reference.vjp(image, settings)[1](cotangent)["image"]
        assert np.abs(found - expected).max() <= 1e-5 * np.abs(expected).max()
        if sums == 0:
            direction = np.zeros(image.shape)
            direction[1, 1] = (1, -1, 0)
            one, size = slope(image.astype(np.float64), settings, cotangent, direction)
            assert one is not None
            assert abs((expected * direction).sum() - one) <= 3e-5 * size
