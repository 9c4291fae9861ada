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


def test_khronos_neutral_of_a_bright_colour() -> None:
    # f = 0.1 - ... = 0.04, p = 2.96, p_n = 1 - 0.0576 / 2.44, g = 1 / (0.15 (p - p_n) + 1)
    peak = 1 - 0.0576 / 2.44
    kept = 1 / (0.15 * (2.96 - peak) + 1)
    expected = [c * peak / 2.96 * kept + peak * (1 - kept) for c in (2.96, 0.96, 0.06)]
    assert_close(final_of([3.0, 1.0, 0.1], tonemap="khronos_neutral"), expected)


def test_agx_of_a_colour() -> None:
    """The chain of three.js' shader, with its matrices as columns, a component at a time."""

    def times(columns: list[list[float]], vector: list[float]) -> list[float]:
        return [sum(c[row] * v for c, v in zip(columns, vector, strict=True)) for row in range(3)]

    def contrast(x: float) -> float:
        value = 15.5 * x**6 - 40.14 * x**5 + 31.96 * x**4
        return value - 6.868 * x**3 + 0.4298 * x**2 + 0.1191 * x - 0.00232

    to_2020 = [[0.6274, 0.0691, 0.0164], [0.3293, 0.9195, 0.0880], [0.0433, 0.0113, 0.8956]]
    from_2020 = [[1.6605, -0.1246, -0.0182], [-0.5876, 1.1329, -0.1006], [-0.0728, -0.0083, 1.1187]]
    inset = [
        [0.856627153315983, 0.137318972929847, 0.11189821299995],
        [0.0951212405381588, 0.761241990602591, 0.0767994186031903],
        [0.0482516061458583, 0.101439036467562, 0.811302368396859],
    ]
    outset = [
        [1.1271005818144368, -0.1413297634984383, -0.14132976349843826],
        [-0.11060664309660323, 1.157823702216272, -0.11060664309660294],
        [-0.016493938717834573, -0.016493938717834257, 1.2519364065950405],
    ]
    for colour in ([0.8, 0.3, 0.05], [0.02, 0.5, 4.0], [9.0, 8.0, 0.0]):
        stops = [math.log2(c) for c in times(inset, times(to_2020, colour))]
        scaled = [min(max((s + 12.47393) / (4.026069 + 12.47393), 0), 1) for s in stops]
        display = times(outset, [contrast(s) for s in scaled])
        linear = times(from_2020, [max(d, 0) ** 2.2 for d in display])
        expected = [min(max(c, 0), 1) for c in linear]
        assert_close(final_of(colour, tonemap="agx"), expected)


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


@pytest.mark.parametrize("white", [100.0, 203.0])
def test_pq_is_that_of_opencolorio(white: float) -> None:
    oiio = pytest.importorskip("OpenImageIO")
    values = np.geomspace(1e-4, 9000 / white, 64)[np.newaxis, :, np.newaxis] * np.ones(3)
    settings = Separable(bloom=False, encoding="pq", reference_white=white)
    # There, 1 is 100 cd/m2, and the grey axis is that of D65.
    xyz = (values * white / 100 * (0.9504559, 1.0, 1.0890578)).astype(np.float32)
    expected = oiio.ImageBufAlgo.colorconvert(
        oiio.ImageBuf(xyz),
        "CIE XYZ-D65 - Display-referred",
        "Rec.2100-PQ - Display",
        colorconfig="ocio://default",
    ).get_pixels()
    assert_allclose(reference.composite(values, None, settings), expected, rtol=0, atol=1e-5)
