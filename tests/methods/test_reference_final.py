"""The last step of the NumPy reference: composites, exposure, tone maps, encodings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.methods.reference_cases import (
    Array,
    assert_close,
    flat,
)
from vkbloom import Separable, reference


def final_of(colour: Any, **settings: Any) -> Array:
    """Final of one colour without bloom, as float32 has it (unclamped)."""
    image = np.asarray(colour, float) * np.ones((1, 1, 3))
    pixel: Array = reference.composite(image, None, Separable(bloom=False, **settings))[0, 0]
    return pixel


@pytest.mark.parametrize(
    ("mode", "intensity", "expected"),
    [
        ("add", 0.5, 0.4 + 0.5 * 1.6),
        ("mix", 0.25, 0.4 + 1.2 * 0.25),
        ("screen", 0.5, 1 - 0.6 * 0.2),
        ("screen", 1.0, 1.0),  # 1.6 counts as 1
    ],
)
def test_composites(mode: Any, intensity: float, expected: float) -> None:
    settings = Separable(composite=mode, intensity=intensity)
    final = reference.composite(flat(0.4), flat(1.6), settings)
    assert_close(final, expected)


def test_exposure_comes_after_the_composite_and_before_the_curve() -> None:
    settings = Separable(exposure=2.0, tonemap="reinhard", encoding="gamma22")
    final = reference.composite(flat(0.25), flat(0.5), settings)
    assert_close(final, (3 / 4) ** (1 / 2.2))


def test_final_of_uint8_is_clamped_at_the_end_only() -> None:
    scene = np.full((2, 2, 3), 255, np.uint8)
    settings = Separable(tonemap="reinhard")
    # The composite of 4 is not clamped before the curve.
    assert_close(reference.composite(scene, flat(3.0, 2, 2), settings), 0.8)
    assert_close(reference.composite(scene, flat(3.0, 2, 2), Separable()), 1)
    in_float = reference.composite(scene, flat(3.0, 2, 2), Separable(), dtype=np.float16)
    assert_close(in_float, 4)
    to_uint8 = reference.composite(flat(2.0, 2, 2), flat(0.0, 2, 2), Separable(), dtype=np.uint8)
    assert_close(to_uint8, 1)


@pytest.mark.parametrize(
    ("tonemap", "colour", "expected"),
    [
        ("none", 3.0, 3.0),
        ("reinhard", 1.0, 0.5),
        ("reinhard", 3.0, 0.75),
        ("aces", 0.0, 0.0),
        ("aces", 1.0, 2.54 / 3.16),  # about 0.8
        ("aces", 0.18, 0.18 * 0.4818 / (0.18 * 1.0274 + 0.14)),
        ("aces", 100.0, 1.0),
        ("exponential", math.log(2), 0.5),
        ("khronos_neutral", 0.5, 0.46),  # the toe's 0.04 and nothing else
        ("khronos_neutral", 0.8, 0.76),  # where the compression starts
        ("khronos_neutral", 0.04, 0.01),  # x - (x - x^2 / 0.16)
        ("khronos_neutral", 1.0, 1 - 0.24**2 / (0.96 + 1 - 1.52)),
        ("khronos_neutral", 1e9, 1.0),
        ("agx", 0.0, 0.0),
        ("agx", 1e3, (15.5 - 40.14 + 31.96 - 6.868 + 0.4298 + 0.1191 - 0.00232) ** 2.2),
    ],
)
def test_tone_map_of_grey(tonemap: Any, colour: float, expected: float) -> None:
    # AgX's matrices keep grey to their four printed digits only.
    tolerance = 2e-4 if tonemap == "agx" else 1e-8
    assert_allclose(final_of(colour, tonemap=tonemap), expected, atol=tolerance, rtol=0)


@pytest.mark.parametrize(
    ("encoding", "value", "expected"),
    [
        ("none", 0.3, 0.3),
        ("none", -0.3, -0.3),
        ("gamma22", 0.5, 0.7297400528407231),
        ("gamma22", -0.5, 0.0),
        ("srgb", 0.002, 0.02584),
        ("srgb", 0.5, 0.7353569830524495),
        ("srgb", 1.0, 1.0),
        ("srgb", -0.5, 0.0),
    ],
)
def test_encodings(encoding: Any, value: float, expected: float) -> None:
    assert_close(final_of(value, encoding=encoding), expected)


# Report ITU-R BT.2408: reference white and a grey card of 18 %, in % of the signal.
@pytest.mark.parametrize(
    ("encoding", "value", "percent"),
    [("pq", 1.0, 58), ("pq", 26 / 203, 38), ("hlg", 1.0, 75), ("hlg", 0.18, 38)],
)
def test_hdr_encodings_have_the_signals_of_bt_2408(
    encoding: Any, value: float, percent: int
) -> None:
    assert round(100 * final_of(value, encoding=encoding)[0]) == percent
