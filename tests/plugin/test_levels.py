"""Blooms of 8 bits: faults are named or cannot be tested, right ones are not blamed."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from tests.exhaustive import EXHAUSTIVE
from tests.plugin.faults import FAULTS, gaussian, in_halves, thresholded
from tests.plugin.test_law_report import OF_A_BLUR, TOLD, Image, row
from tests.srgb import decode_srgb, encode_srgb
from vkbloom import testing
from vkbloom._cli.check import measuring
from vkbloom.testing import LawReport
from vkbloom.testing._law_report import law_report
from vkbloom.testing._laws.table import LAWS, merge_limits
from vkbloom.testing._levels import Levels
from vkbloom.testing._programs import CommandBloom

SIZE = (64, 64)
#: Without those of a file with NaN, and of what no program takes.
TESTED = [name for name in LAWS if name not in {"field", "views", "reference"}]


def in_bits(image: NDArray[Any], bits: int, rounded: Callable[..., Any] = np.rint) -> Image:
    """Return what a file of integers holds of linear light."""
    most = 2**bits - 1
    encoded = encode_srgb(np.clip(np.nan_to_num(image.astype(np.float64)), 0, 1)) * most
    return decode_srgb(rounded(encoded + 1e-9) / most).astype(np.float32)


class Quantized(CommandBloom):
    """A program without a process: its files are arrays."""

    def __init__(
        self,
        bloom: Callable[[Image], Image],
        *,
        adds: bool = False,
        suffix: str = ".png",
        rounded: Callable[..., Any] = np.rint,
    ) -> None:
        super().__init__(["engine", "{input}", "{output}"], suffix, 1.0)
        self._bloom, self._adds, self._rounded = bloom, adds, rounded

    def __call__(self, image: NDArray[Any]) -> Image:
        bits = self.bits or 8
        given = in_bits(image, bits)
        result = self._bloom(given)
        return in_bits(result + given if self._adds else result, bits, self._rounded)


def judge(
    bloom: Callable[[Image], Image],
    *,
    less_input: bool,
    size: tuple[int, int] = SIZE,
    gain: float | None = None,
    **options: Any,
) -> LawReport:
    program = Quantized(bloom, adds=less_input, **options)
    subject = measuring.of_program(program, size, gain, less_input=less_input)
    return law_report(subject, merge_limits({}, TESTED))


def blame(report: LawReport) -> set[str]:
    return {each.name for each in report.rows if each.held is False} - OF_A_BLUR


LESS = pytest.mark.parametrize("less_input", [False, True], ids=["bloom", "less input"])
#: Files of integers hold no negative values, and what a program adds to its input is no picture.
OF_FLOATS = {"rings beside an edge", "takes light from bright pixels"}


@LESS
@pytest.mark.parametrize("name", [name for name in TOLD if name not in OF_FLOATS])
def test_a_fault_is_named_or_cannot_be_tested(name: str, less_input: bool) -> None:
    fault, correct, law, _, others, _ = FAULTS[name]
    laws = {law, *(others or ())}
    found = judge(fault(), less_input=less_input)
    assert not [law for law in laws if row(found, law).held], found
    for each in found.rows:
        if each.name in laws and each.held is None:
            assert "cannot be tested" in each.message
    assert not blame_correct(correct(), less_input)


@functools.cache
def blame_correct(correct: Callable[[Image], Image], less_input: bool) -> set[str]:
    return blame(judge(correct, less_input=less_input))


@LESS
@pytest.mark.parametrize("along", ["x", "y"])
def test_half_a_texel_is_seen(along: str, less_input: bool) -> None:
    shift = (0, 0.5, 0) if along == "x" else (0.5, 0, 0)

    def off(image: Image) -> Image:
        return np.asarray(ndimage.shift(gaussian(image, 3.0), shift, order=1, mode="nearest"))

    found = judge(off, less_input=less_input)
    assert {"symmetric", "centroid_kept"} <= blame(found)
    assert f"+0.5 pixels from {along}" in row(found, "centroid_kept").message


@LESS
@pytest.mark.parametrize("rounded", [np.rint, np.floor], ids=["rounds", "truncates"])
@pytest.mark.parametrize("sigma", [0.5, 8.0, 16.0] if EXHAUSTIVE else [8.0])
def test_right_blurs_are_not_blamed(
    sigma: float, rounded: Callable[..., Any], less_input: bool
) -> None:
    found = judge(lambda a: gaussian(a, sigma), less_input=less_input, rounded=rounded)
    assert not blame(found), found
    held = {"superposition", "gain", "symmetric", "no_ringing", "colour", "grey", "channels"}
    assert all(row(found, name).held for name in held)


def test_what_is_too_dim_cannot_be_tested() -> None:
    """A thirtieth of the light beside a picture is two levels."""
    found = judge(lambda a: gaussian(a) / 30, less_input=True, gain=1 / 30)
    assert not blame(found)
    for name in ("superposition", "gain", "symmetric", "colour", "grey"):
        each = row(found, name)
        assert (each.held, each.message[:27]) == (None, "cannot be tested in 8 bits:")


def test_a_threshold_above_every_value_cannot_be_tested() -> None:
    found = judge(thresholded, less_input=False)
    assert {each.held for each in found.rows} == {None}
    assert "the bloom of values up to 1 is black" in found.rows[0].message
    # With one below, a value above it is found.
    found = judge(lambda a: thresholded(a, 0.7), less_input=False)
    assert found.probe.value == 1
    assert {"superposition", "gain"} <= blame(found)


@LESS
def test_lossy_files_hold_flat_images(less_input: bool) -> None:
    right, wrong = (
        judge(bloom, less_input=less_input, suffix=".jpg")
        for bloom in (gaussian, lambda a: gaussian(a)[..., ::-1])
    )
    assert {each.name for each in right.rows if each.held} <= {"gain", "colour"}
    assert not blame(right)
    assert row(wrong, "colour").held is False
    assert "in lossy files" in row(right, "symmetric").message


def test_16_bits_are_nearly_floats() -> None:
    program = Quantized(in_halves)
    program.bits = 16
    subject = measuring.of_program(program, SIZE, None, less_input=False)
    found = law_report(subject, merge_limits({}, TESTED))
    assert row(found, "stability").held is not None
    assert row(found, "energy").held
    assert row(found, "unclamped").held is None


def test_a_report_knows_the_levels_of_a_command() -> None:
    found = testing.report(Quantized(gaussian), size=SIZE)
    assert (found.probe.levels, found.probe.value < 0.5) == (Levels(bits=8), True)
    assert not blame(found)


def test_images_have_values_that_files_hold() -> None:
    probe = testing.Probe(size=SIZE, value=0.49, levels=Levels())
    image = probe.noise(0, probe.value)
    np.testing.assert_allclose(probe.as_input(image), in_bits(image, 8), atol=1e-7)
    assert len(np.unique(image)) == 2
