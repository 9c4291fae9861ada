"""Derivatives of the reference: exact transposes where it is linear, elsewhere differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import vkbloom
from tests.exhaustive import by_turns
from tests.images import random_image
from tests.kinds import fields_of
from tests.methods.cases import METHODS, presets_of_low_levels
from vkbloom import reference
from vkbloom.reference._derivatives import differentiable

# Odd sides, and sides of one pixel.
SIZES = ((17, 11), (8, 6), (1, 9), (13, 1), (1, 1))
KERNEL = np.random.default_rng(5).random((5, 4, 3))
GLARE = (vkbloom.Streaks(angle=10, threshold=0.1), vkbloom.Ghosts(), vkbloom.Halo())
BOUNDARIES: tuple[Any, ...] = ("zero", "edge", "wrap", "wrap_x")

LINEAR: dict[str, Any] = {
    **{name: each for name, each in METHODS.items() if each.threshold is None},
    **{f"convolution-{b}": vkbloom.Convolution(KERNEL, boundary=b) for b in BOUNDARIES},
    "level-weights": vkbloom.Pyramid(levels=3, level_weights=(0.5, -0.25, 1)),
    "mix": vkbloom.DualKawase(composite="mix", intensity=0.3),
    "small-convolution": vkbloom.Convolution(KERNEL, bloom_scale=0.5),
    "hdrp": vkbloom.presets["threejs_unreal"].replace(threshold=None),
}
CHOICES: tuple[Any, ...] = (
    ("reinhard", "gamma22", "add"),
    ("aces", "srgb", "screen"),
    ("exponential", "none", "mix"),
    ("khronos_neutral", "srgb", "add"),
    ("agx", "gamma22", "mix"),
    ("none", "pq", "add"),
    ("none", "hlg", "mix"),
)
CURVES = {
    f"{tonemap}-{encoding}": vkbloom.Pyramid(
        levels=2, tonemap=tonemap, encoding=encoding, exposure=0.3, composite=composite
    )
    for tonemap, encoding, composite in CHOICES
}
CURVED: dict[str, Any] = {
    **presets_of_low_levels(32),
    **CURVES,
    "knee": vkbloom.Separable(threshold=0.5, knee=0.5),
    "glare": vkbloom.Pyramid(levels=2, threshold=0.5, knee=0.3, glare=GLARE),
    "engine-glare": vkbloom.presets["unity_urp"].replace(format=None, glare=GLARE[2:]),
    "firefly": vkbloom.Pyramid(firefly_filter=True, level_weights=(1, 2, 3, 4, 5, 6)),
    "soft-light": vkbloom.presets["godot_4_5"].replace(format=None, composite="soft_light"),
    "alpha": vkbloom.Pyramid(levels=2, threshold=0.5, knee=0.5, alpha="blur"),
    "largest-alpha": vkbloom.presets["kino"].replace(format=None, alpha="max"),
}


def product(one: Any, other: Any) -> float:
    return float((np.asarray(one) * np.asarray(other)).sum())


@pytest.mark.parametrize(("name", "size"), by_turns(LINEAR, turns=SIZES))
def test_image_derivative_is_the_exact_transpose_of_a_linear_bloom(
    name: str, size: tuple[int, int]
) -> None:
    settings = LINEAR[name]
    x, y = random_image(*size, seed=1), random_image(*size, seed=2) - 0.5
    frames, pullback = reference.vjp(x, settings)
    transposed = pullback({"final": y})["image"]
    forward, back = product(frames["final"], y), product(x, transposed)
    assert abs(forward - back) <= 1e-12 * np.abs(frames["final"] * y).sum()


def slope(function: Any, at: Any, direction: Any, step: float) -> float:
    """Return the derivative along a direction, by a difference."""
    ends = [function(np.asarray(at) + sign * step * direction) for sign in (-1, 1)]
    return float(ends[1] - ends[0]) / (2 * step)


def as_field(value: Any) -> Any:
    return tuple(map(as_field, value)) if np.ndim(value) else float(value)


@pytest.mark.parametrize("name", CURVED)
def test_derivatives_are_those_of_central_differences(name: str) -> None:
    settings = CURVED[name].replace(format="rgba32float")
    random = np.random.default_rng(1)
    shape = (11, 14, 3 if settings.alpha == "keep" else 4)
    image, emission = random.random(shape) * 2, random.random(shape) * 2
    mask = random.random((11, 14)) * 0.8 + 0.1
    given = {"mask": mask, "emission": emission} if name != "knee" else {}
    frames, pullback = reference.vjp(image, settings, **given)
    cotangents: dict[str, Any] = {
        key: random.standard_normal(frames[key].shape)
        for key in ("glow", "bloom", "final")
        if key in frames
    }
    derivatives = pullback(cotangents)
    fields = fields_of(type(settings))
    derived = fields.keys() & derivatives.keys()
    assert {"exposure", "intensity"} & derived
    assert all(fields[key].differentiable for key in derived)
    assert "bloom_scale" not in derivatives
    # The differences of sums of this size are rounded.
    least = 1e-3 * sum(np.abs(one).sum() for one in cotangents.values())

    def total(image: Any = image, settings: Any = settings, **arrays: Any) -> float:
        found = reference.apply(image, settings, **(given | arrays))
        return sum(product(found[key], part) for key, part in cotangents.items())

    def check(name: str, function: Any, at: Any) -> None:
        direction = random.standard_normal(np.shape(at))
        actual = product(derivatives[name], direction)
        # A step may meet a corner of a curve, another may drown in rounding.
        for step in (1e-6, 1e-5, 1e-7):
            expected = slope(function, at, direction, step)
            if abs(actual - expected) <= 1e-6 * max(abs(expected), least):
                return
        pytest.fail(f"{name}: {actual}, not {expected}")

    check("image", lambda moved: total(image=moved), image)
    for key, array in given.items():
        check(key, lambda moved, key=key: total(**{key: moved}), array)
    # Not at the ends of the ranges.
    inside = {
        field: as_field(np.asarray(value) * 0.99 + 0.001)
        for field, value in differentiable(settings).items()
    }
    settings = settings.replace(**inside)
    derivatives = reference.vjp(image, settings, **given)[1](cotangents)
    for field, value in inside.items():
        check(
            field,
            lambda at, field=field: total(settings=settings.replace(**{field: as_field(at)})),
            value,
        )


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_kernel_has_a_derivative(boundary: Any) -> None:
    settings = vkbloom.Convolution(KERNEL, boundary=boundary, normalize=False)
    image = random_image(9, 7, seed=3)
    frames, pullback = reference.vjp(image, settings)
    cotangent = random_image(9, 7, seed=4)
    derivative = pullback({"final": cotangent})["kernel"]
    # The bloom is linear in the kernel.
    kernel = settings.kernel((9, 7))
    bloom = product(frames["bloom"][..., :3], cotangent)
    assert_allclose(product(derivative, kernel), bloom, rtol=1e-12)


def test_hard_threshold_has_no_derivative_of_its_own() -> None:
    image = np.full((3, 3, 3), 0.5)
    image[1, 1] = 2.0
    _, pullback = reference.vjp(image, vkbloom.Separable(threshold=0.5))
    derivatives = pullback({"glow": np.ones((3, 3, 4))})
    assert derivatives["threshold"] == 0
    # A colour at the threshold counts as below it.
    assert_allclose(derivatives["image"][..., 0], np.outer([0, 1, 0], [0, 1, 0]))


def test_nan_and_infinity_of_the_image_have_the_derivative_0() -> None:
    image = random_image(5, 5, seed=1)
    image[2, 2] = (np.nan, np.inf, 0.5)
    frames, pullback = reference.vjp(image, vkbloom.Pyramid(levels=1))
    assert np.isnan(frames["final"][2, 2, 0])
    derivative = pullback({"bloom": np.ones((5, 5, 4))})["image"]
    assert np.isfinite(derivative).all()
    assert (derivative[2, 2] == [0, 0, derivative[2, 2, 2]]).all()
    assert derivative[2, 2, 2] > 0
