"""Comparisons of images in Python."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest

from tests.images import change, noise_image
from tests.refusals import assert_refused, rows
from tests.srgb import decode_srgb
from vkbloom._cli.compare import tolerances_of
from vkbloom._views.comparison import Comparison, compare, difference, flip_map
from vkbloom._views.tolerances import Tolerances, failures
from vkbloom.testing import diagnose

oiio = pytest.importorskip("OpenImageIO")
metrics = pytest.importorskip("skimage.metrics")


def reasons(found: Comparison, tolerances: Tolerances | None = None) -> tuple[str, ...]:
    tolerances = tolerances or tolerances_of()
    return tuple(reason for _, reason in failures(found, tolerances, tolerances.metrics))


FIGURES = ("max_error", "mean_error", "percent_over", "ssim", "psnr", "flip")


class TestFigures:
    @pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32", "float64"])
    @pytest.mark.parametrize("shape", [(16, 16), (16, 16, 1), (16, 16, 2), (16, 16, 3), (9, 8, 5)])
    def test_identical(self, dtype: str, shape: tuple[int, ...]) -> None:
        a = noise_image(*shape, dtype=dtype)
        found = compare(a, a.copy())
        assert found.identical
        assert reasons(found) == ()
        assert (found.max_error, found.mean_error, found.percent_over) == (0, 0, 0)
        assert (found.max_error_at, found.max_error_values) == (None, None)
        assert (found.psnr, found.flip) == (math.inf, 0)
        assert found.ssim == pytest.approx(1, abs=1e-12)
        assert not found.not_computed

    def test_place_and_values(self) -> None:
        a = np.full((12, 20, 4), 0.25, np.float32)
        b = change(change(a, (7, 3, 2), 0.75), (1, 2, 0), 0.5)
        found = compare(a, b)
        assert found.max_error == 0.5
        assert found.max_error_at == (3, 7, 2)
        assert found.max_error_values == (0.25, 0.75)
        assert found.mean_error == pytest.approx(0.75 / a.size, rel=1e-12)
        assert found.percent_over == pytest.approx(100 * 2 / 240, rel=1e-12)
        assert not found.identical
        (reason,) = reasons(found)
        assert " % of the pixels differ; largest difference " in reason

    @pytest.mark.parametrize(("dtype", "largest"), [("uint8", 255), ("uint16", 65535)])
    def test_steps_of_integers_are_exact(self, dtype: str, largest: int) -> None:
        a = np.repeat(np.arange(largest, dtype=dtype)[:, None], 8, axis=1)
        found = compare(a, a + np.ones_like(a))
        assert found.max_error == 1 / largest
        assert reasons(found, tolerances_of(max_error=1 / largest)) == ()

    def test_8_bits_against_16(self) -> None:
        a = noise_image(16, 16, 3, dtype="uint8")
        b = a.astype(np.uint16) * np.uint16(257)
        assert compare(a, b).identical
        assert compare(a, change(b, (0, 0, 0), b[0, 0, 0] ^ 1)).max_error == 1 / 65535

    @pytest.mark.parametrize("dtype", ["uint8", "float32"])
    def test_ssim_and_psnr_are_those_of_scikit_image(self, dtype: str) -> None:
        a = noise_image(40, 50, 4, dtype=dtype)
        b = np.roll(a, 1, axis=1)
        scale = 255 if dtype == "uint8" else 1
        found = compare(a, b)
        assert found.ssim == pytest.approx(
            metrics.structural_similarity(a, b, data_range=scale, channel_axis=-1), rel=1e-5
        )
        mean_square = ((a.astype(np.float64) - b) ** 2).mean() / scale**2
        assert found.psnr == pytest.approx(-10 * math.log10(mean_square), rel=1e-9)
        assert found.data_range == 1

    def test_the_range_of_floats_covers_them(self) -> None:
        a = noise_image(16, 16, 3) * np.float32(4) - np.float32(2)
        a[0, 0, 0], a[0, 0, 1] = 6, -3
        b = a + np.float32(0.5)
        found = compare(a, b)
        assert found.data_range == 9.5
        assert found.psnr == pytest.approx(20 * math.log10(9.5 / 0.5), rel=1e-9)
        assert found.ssim == pytest.approx(
            metrics.structural_similarity(a, b, data_range=9.5, channel_axis=-1), rel=1e-5
        )

    @pytest.mark.parametrize("channels", [1, 2, 3, 4])
    @pytest.mark.parametrize("dtype", ["uint8", "float32"])
    def test_flip_is_that_of_openimageio(self, dtype: str, channels: int) -> None:
        a, b = (noise_image(20, 24, channels, dtype=dtype, seed=seed) for seed in (1, 2))
        buffers = []
        for values in (a, b):
            linear = decode_srgb(values / 255) if dtype == "uint8" else values
            colours = linear[:, :, :3] if channels > 2 else linear[:, :, [0, 0, 0]]
            buffers.append(oiio.ImageBuf(np.ascontiguousarray(colours, np.float32)))
        hdr = 0 if dtype == "uint8" else 1
        expected = oiio.ImageBufAlgo.FLIP_diff(*buffers, hdr=hdr).get_pixels().mean()
        assert expected > 0.1
        assert compare(a, b).flip == pytest.approx(expected, rel=1e-5)

    def test_alpha_counts_but_for_flip(self) -> None:
        a = noise_image(16, 16, 4)
        found = compare(a, change(a, (3, 4, 3), a[3, 4, 3] + 1))
        assert found.max_error_at == (4, 3, 3)
        assert found.flip == 0
        (reason,) = reasons(found)
        assert " % of the pixels differ; largest difference " in reason

    @pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
    def test_flip_of_equals_where_openimageio_rounds(
        self, dtype: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        # As its build for aarch64 does.
        exact = oiio.ImageBufAlgo.FLIP_diff
        monkeypatch.setattr(
            oiio.ImageBufAlgo,
            "FLIP_diff",
            lambda *images, **options: oiio.ImageBufAlgo.add(exact(*images, **options), 1e-6),
        )
        a = noise_image(16, 16, 3, dtype=dtype)
        assert compare(a, a.copy()).flip == 0
        assert not flip_map(a, a.copy()).any()
        assert compare(a, change(a, (3, 4, 1), 0)).flip > 1e-6  # type: ignore[operator]

    @pytest.mark.parametrize("shape", [(1, 1, 3), (6, 100, 3), (100, 6, 1)])
    def test_ssim_needs_7_pixels(self, shape: tuple[int, ...]) -> None:
        a, b = noise_image(*shape), noise_image(*shape, seed=6)
        found = compare(a, b)
        assert found.ssim is None
        assert found.not_computed == {"ssim": "a side is under the window's 7 pixels"}
        assert found.psnr is not None
        assert found.flip is not None
        assert reasons(found, tolerances_of(max_error=1)) == ()
        (reason,) = reasons(found, tolerances_of(min_ssim=-1))
        assert reason.startswith("SSIM is not computed: a side is under")

    def test_extreme_values(self) -> None:
        a = np.full((8, 8, 3), 1.7e308)
        found = compare(a, -a)
        assert found.max_error == math.inf
        assert found.ssim is None
        assert found.psnr is None
        assert reasons(found, tolerances_of(max_error=1e308, min_ssim=-1))
        picture, scale = difference(a, -a)
        assert (picture == 1).all()
        assert 0 < scale < 1
        tiny = np.full((8, 8, 3), 5e-324)
        assert compare(tiny, np.zeros_like(tiny)).max_error == 5e-324

    def test_relative_threshold(self) -> None:
        a = np.array([[0.0, 1.0, 10.0, -10.0]])
        b = a + np.array([[0.05, 0.15, 1.0, 1.2]])
        # 0.1 + 0.1 |a| allows 0.1, 0.2, 1.1 and 1.1.
        assert compare(a, b, threshold=0.1, relative=0.1).percent_over == 25.0
        assert compare(a, b, relative=0.1).percent_over == 75.0
        assert compare(a, b, threshold=0.1).percent_over == 75.0
        assert compare(a, b, threshold=math.inf).percent_over == 0.0
        # Relative to the first image, the reference: 1 by 1.5, and 1.5 by 1.5 the other way round.
        one, other = np.array([[1.0]]), np.array([[2.5]])
        assert compare(one, other, relative=1.0).percent_over == 100.0
        assert compare(other, one, relative=1.0).percent_over == 0.0

    @pytest.mark.parametrize("wanted", [(), ("ssim",), ("psnr",), ("flip",), ("ssim", "flip")])
    def test_metrics_that_are_asked_for(self, wanted: tuple[Any, ...]) -> None:
        a, b = noise_image(16, 16, 3), noise_image(16, 16, 3, seed=6)
        whole, found = compare(a, b), compare(a, b, metrics=wanted)
        for name in ("ssim", "psnr", "flip"):
            asked = name in wanted
            assert getattr(found, name) == (getattr(whole, name) if asked else None)
            assert found.not_computed.get(name) == (None if asked else "not asked for")

    def test_metrics_that_are_not_needed_are_not_imported(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        for package in ("skimage.metrics", "OpenImageIO"):
            monkeypatch.setitem(sys.modules, package, None)
        a = noise_image(8, 8, 3)
        assert compare(a, a, metrics=()).identical
        for name in ("ssim", "psnr", "flip"):
            with pytest.raises(ModuleNotFoundError, match=r"pip install vkbloom\["):
                compare(a, a, metrics=(name,))

    @pytest.mark.parametrize("dtype", ["uint8", "float32"])
    def test_flip_map(self, dtype: str) -> None:
        a = noise_image(24, 32, 3, dtype=dtype)
        b = a.copy()
        b[:, 16:] = b[::-1, 16:]
        found = flip_map(a, b)
        assert found.shape == (24, 32)
        assert found.dtype == np.float32
        assert found.mean(dtype=np.float64) == compare(a, b).flip
        assert found[:, 24:].mean() > 10 * found[:, :8].mean()
        with pytest.raises(ValueError, match="a, b: not comparable: the sizes differ"):
            flip_map(a, b[1:])

    def test_half_against_float(self) -> None:
        a = noise_image(16, 16, 3, dtype="float16")
        assert compare(a, a.astype(np.float32)).identical


class TestMismatches:
    @pytest.mark.parametrize(
        ("shapes", "dtypes", "reason"),
        [
            ([(9, 8, 3), (8, 9, 3)], ["f4", "f4"], "the sizes differ, 8 x 9 against 9 x 8"),
            ([(9, 8, 3), (9, 8, 4)], ["f4", "f4"], "the numbers of channels differ, 3 against 4"),
            ([(9, 8), (9, 8, 3)], ["f4", "f4"], "the numbers of channels differ, 1 against 3"),
            ([(9, 8), (9, 8)], ["u1", "f4"], "integers against floats, uint8 against float32"),
        ],
    )
    def test_no_limit_lets_them_pass(self, shapes: Any, dtypes: Any, reason: str) -> None:
        a, b = map(np.ones, shapes, dtypes)
        found = compare(a, b, allow_nan=True)
        assert found.mismatches == (reason,)
        assert not found.identical
        generous = tolerances_of(max_error=math.inf, min_ssim=-1, max_flip=1)
        assert reasons(found, tolerances_of(max_error=1e9)) == (reason,)
        assert reasons(found) == (reason,)
        assert reason in reasons(compare(a, b, threshold=math.inf), generous)
        assert all(getattr(found, name) is None for name in FIGURES)
        with pytest.raises(ValueError, match=f"a, b: not comparable: {reason}"):
            difference(a, b)

    @pytest.mark.parametrize("one", [math.nan, math.inf, -math.inf])
    @pytest.mark.parametrize("swapped", [False, True])
    @pytest.mark.parametrize("allow_nan", [False, True])
    def test_in_one_image_only(self, one: float, swapped: bool, allow_nan: bool) -> None:
        a = noise_image(10, 12, 3)
        pair = (a, change(a, (4, 5, 1), one))
        found = compare(*(pair[::-1] if swapped else pair), allow_nan=allow_nan)
        reason = "NaN or infinity in one image only, 1 values, the first at x 5, y 4, channel 1"
        assert found.mismatches == (reason,)
        assert reasons(found, tolerances_of(max_error=math.inf)) == (reason,)
        assert not found.identical
        assert found.percent_over == pytest.approx(100 / 120, rel=1e-12)
        # The figures are of all the others.
        assert (found.max_error, found.mean_error) == (0, 0)

    def test_other_kinds_of_not_finite(self) -> None:
        a = noise_image(10, 12, 3)
        for one, other in ((math.inf, -math.inf), (math.nan, math.inf)):
            found = compare(change(a, (0, 0, 0), one), change(a, (0, 0, 0), other), allow_nan=True)
            assert "in one image only" in reasons(found)[0]

    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
    def test_in_both_images(self, value: float) -> None:
        a = change(noise_image(10, 12, 3), (4, 5, 1), value)
        b = change(a, (0, 0, 0), a[0, 0, 0] + 0.5)
        reason = "NaN or infinity in both images, 1 values, the first at x 5, y 4, channel 1"
        assert reasons(compare(a, a), tolerances_of(max_error=1)) == (reason,)
        assert reasons(compare(a, a)) == (reason,)
        assert compare(a, a, allow_nan=True).identical
        found = compare(a, b, allow_nan=True)
        assert found.mismatches == ()
        assert found.max_error == pytest.approx(0.5, abs=1e-7)
        assert found.mean_error == pytest.approx(0.5 / (a.size - 1), rel=1e-6)
        for name in FIGURES:
            assert math.isfinite(getattr(found, name))
        assert reasons(found, tolerances_of(max_error=0.6)) == ()

    def test_nothing_but_nan(self) -> None:
        a = np.full((8, 8, 3), np.nan, np.float32)
        assert reasons(compare(a, a, allow_nan=True)) == ()
        found = compare(a, a, allow_nan=True)
        assert (found.max_error, found.mean_error, found.psnr) == (None, None, None)


class TestTolerances:
    A = np.full((20, 20, 3), 0.5, np.float32)

    @pytest.mark.parametrize(
        ("figure", "limit", "towards"),
        [("max_error", "max_error", -1), ("ssim", "min_ssim", 1), ("flip", "max_flip", -1)],
    )
    def test_each_to_both_sides(self, figure: str, limit: str, towards: int) -> None:
        a, b = noise_image(20, 20, 3), np.clip(noise_image(20, 20, 3) * np.float32(0.9), 0, 1)
        found = compare(a, b)
        value = getattr(found, figure)
        assert reasons(found, tolerances_of(**{limit: value})) == ()
        assert reasons(found, tolerances_of(**{limit: value - 1e-6 * towards})) == ()
        (reason,) = reasons(found, tolerances_of(**{limit: value + 1e-6 * towards}))
        name = "largest difference" if figure == "max_error" else figure.upper()
        assert reason.startswith(f"{name} {value:.6g} ")

    def test_percentages(self) -> None:
        b = self.A.copy()
        b[:2, :, 0] += np.float32(0.25)
        b[0, :, 1] = 0
        found = compare(self.A, b)
        assert reasons(found, Tolerances(atol=0, fail_percent=10)) == ()
        (reason,) = reasons(found, Tolerances(atol=0, fail_percent=9.9))
        assert reason.startswith(
            "10 % of the pixels differ, 9.9 % allowed; largest difference 0.5 "
        )
        # With it, max_error says from which difference on pixels count.
        some = compare(self.A, b, threshold=0.25)
        assert reasons(some, Tolerances(atol=0.25, fail_percent=5)) == ()
        assert len(reasons(some, Tolerances(atol=0.25, fail_percent=4))) == 1

    def test_all_that_fail_are_told(self) -> None:
        found = compare(self.A, noise_image(20, 20, 3))
        limits = tolerances_of(max_error=0, min_ssim=1, max_flip=0)
        assert len(reasons(found, limits)) == 3


@pytest.mark.parametrize(("call", "error"), rows(__file__, "comparisons"))
def test_a_wrong_value_is_refused(call: str, error: str) -> None:
    assert_refused(call, error, {**globals(), "diagnose": diagnose})


class TestDifference:
    def test_is_scaled_to_the_largest(self) -> None:
        a = np.zeros((2, 3, 3), np.uint8)
        b = change(change(a, (0, 1, 0), 51), (1, 2, 2), 102)
        picture, scale = difference(a, b)
        assert scale == pytest.approx(2.5, rel=1e-12)
        assert picture.dtype == np.float32
        assert picture[0, 1].tolist() == pytest.approx([0.5, 0, 0])
        assert picture[1, 2].tolist() == pytest.approx([0, 0, 1])
        assert np.count_nonzero(picture) == 2
        assert np.array_equal(difference(b, a)[0], picture)

    def test_grey_and_alpha(self) -> None:
        a = np.zeros((1, 2, 2), np.float32)
        picture, _ = difference(a, change(change(a, (0, 0, 0), 1), (0, 1, 1), 0.5))
        assert picture.tolist() == [[[1, 1, 1], [0.5, 0.5, 0.5]]]
        a = np.zeros((1, 1, 4), np.float32)
        picture, _ = difference(a, np.array([[[1, 0, 0, 0.5]]], np.float32))
        assert picture.tolist() == [[[1, 0.5, 0.5]]]

    def test_nan_in_one_image_is_magenta(self) -> None:
        a = np.zeros((1, 2, 3), np.float32)
        picture, _ = difference(a, change(a, (0, 1, 2), math.nan))
        assert picture.tolist() == [[[0, 0, 0], [1, 0, 1]]]

    def test_nothing_is_black(self) -> None:
        a = change(noise_image(4, 4, 3), (0, 0, 0), math.nan)
        picture, scale = difference(a, a)
        assert scale == 1
        assert not picture.any()
