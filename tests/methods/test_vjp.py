"""Derivatives from a renderer: those of the reference, in float32."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.methods.reference_cases import random_image
from tests.methods.test_derivatives import CURVED, channels_of
from vkbloom import Renderer, reference


def check_against_reference(renderer: Renderer, settings: Any, image: Any, **given: Any) -> None:
    frames, pullback = renderer.vjp(image, settings, **given)
    expected_frames, expected_pullback = reference.vjp(image, settings, **given)
    random = np.random.default_rng(7)
    cotangents = {
        name: random.standard_normal(frames[name].shape, np.float32)
        for name in ("glow", "bloom", "final")
        if name in frames
    }
    found, expected = pullback(cotangents), expected_pullback(cotangents)
    assert found.keys() == expected.keys()
    for name, part in expected.items():
        assert found[name].dtype == np.float32, name
        limit = 1e-5 * max(np.abs(part).max(), 1e-3)
        assert np.abs(found[name] - part).max() <= limit, name
    repeated = pullback(cotangents)
    assert all(np.array_equal(part, repeated[name]) for name, part in found.items())
    for name in cotangents:
        assert np.abs(frames[name] - expected_frames[name]).max() <= 1e-4 * max(
            1, np.abs(expected_frames[name]).max()
        ), name


CHOSEN = (
    *("tutorial", "jimenez2014", "dual_kawase", "bevy_natural", "kino", "filament", "unity_urp"),
    *("threejs_unreal", "godot_4_5", "blender_bloom", "camera_lens", "knee", "glare", "alpha"),
    *("aces-srgb", "exponential-none", "agx-gamma22", "none-pq", "firefly"),
)


@pytest.mark.parametrize("name", CHOSEN)
def test_derivatives_are_those_of_the_reference(renderer: Renderer, name: str) -> None:
    settings = CURVED[name].replace(format=None)
    channels = channels_of(settings)
    image = random_image(11, 14, channels=channels, seed=1)
    check_against_reference(renderer, settings, image)


def test_mask_and_emission_have_derivatives(renderer: Renderer) -> None:
    image, emission = (random_image(7, 9, seed=seed).astype(np.float32) for seed in (1, 2))
    mask = np.random.default_rng(3).random((7, 9), np.float32)
    settings = vkbloom.Pyramid(levels=2, threshold=0.3, knee=0.5)
    check_against_reference(renderer, settings, image, mask=mask, emission=emission)


def test_arrays_may_change_before_the_pullback(renderer: Renderer) -> None:
    image = random_image(6, 8, seed=1).astype(np.float32)
    settings = vkbloom.Separable(threshold=0.5)
    cotangents = {"bloom": np.ones((6, 8, 4), np.float32)}
    expected = renderer.vjp(image.copy(), settings)[1](cotangents)["image"]
    _, pullback = renderer.vjp(image, settings)
    image[:] = 0
    assert np.array_equal(pullback(cotangents)["image"], expected)


def test_what_has_no_derivative_is_named(renderer: Renderer) -> None:
    image = np.ones((4, 4, 3), np.float32)
    _, pullback = renderer.vjp(image, vkbloom.Pyramid(levels=2))
    with pytest.raises(ValueError, match="gradients: 'levels' has no derivative; available: image"):
        pullback({"final": image})["levels"]
    with pytest.raises(ValueError, match="image: derivatives need the pixels"):
        renderer.vjp(renderer.upload(image), vkbloom.Pyramid())  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("cotangents", "message"),
    [
        ({"blom": np.ones((4, 4, 3))}, "cotangents: unknown framebuffer 'blom'; available: glow"),
        ({"final": np.ones((4, 3, 3))}, r"cotangents: the shape of 'final' is \(4, 3, 3\)"),
        ({"final": np.full((4, 4, 3), np.nan)}, "cotangents: 'final' has NaN or infinity"),
        ({"final": np.ones((4, 4, 3), complex)}, "'final' is of dtype complex128, not of real"),
        (np.ones((4, 4, 3)), r"ndarray is not a mapping of framebuffer to array; give \{"),
    ],
)
def test_wrong_cotangent_is_refused_by_name(
    renderer: Renderer, cotangents: Any, message: str
) -> None:
    image = np.ones((4, 4, 3), np.float32)
    for vjp in (renderer.vjp, reference.vjp):
        pullback: Any = vjp(image, vkbloom.Separable())[1]
        with pytest.raises((TypeError, ValueError), match=message):
            pullback(cotangents)
