"""Metrics that need to know what the numbers are: luminance, and pixels a degree."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vkbloom._views.comparison import compare, flip_map

A = np.random.default_rng(0).random((24, 32, 3), np.float32)
B = A + np.float32(0.1) * np.random.default_rng(1).random(A.shape, np.float32)


def test_flip_sees_less_from_far_away() -> None:
    near, usual, far = (
        compare(A, B, metrics=["flip"], pixels_per_degree=degree).flip for degree in (20, None, 200)
    )
    assert near is not None
    assert usual is not None
    assert far is not None
    assert near > usual > far > 0
    # What the metric's authors and OpenImageIO have as default.
    assert compare(A, B, metrics=["flip"], pixels_per_degree=67.0206).flip == pytest.approx(
        usual, rel=1e-3
    )
    assert flip_map(A, B, pixels_per_degree=20).mean(dtype=np.float64) == pytest.approx(near)


@pytest.mark.parametrize("name", ["nits_per_unit", "pixels_per_degree"])
@pytest.mark.parametrize("value", [0, -1, np.inf, np.nan])
def test_out_of_range(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name}: .* is out of range, finite and above 0"):
        compare(A, B, metrics=(), **{name: value})  # type: ignore[arg-type]


def test_vdp_needs_both() -> None:
    with pytest.raises(ValueError, match="nits_per_unit: None is not a number; the metric cvvdp"):
        compare(A, B, metrics=["cvvdp"], pixels_per_degree=60)


def test_vdp_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pycvvdp", None)
    found = compare(A, B, metrics=["cvvdp"], nits_per_unit=100, pixels_per_degree=60)
    assert found.cvvdp is None
    assert found.not_computed["cvvdp"].endswith("needs pycvvdp: pip install vkbloom[cvvdp]")


class Package:
    """In place of ColorVideoVDP: keeps what it is given."""

    def __init__(self) -> None:
        self.given: dict[str, Any] = {}

    def vvdp_display_photo_eotf(self, **options: Any) -> str:
        self.given |= options
        return "photometry"

    def vvdp_display_geometry(self, size: tuple[int, int], *, ppd: float) -> str:
        self.given |= {"size": size, "ppd": ppd}
        return "geometry"

    def cvvdp(self, **options: Any) -> SimpleNamespace:
        assert options["display_photometry"] == "photometry"
        assert options["display_geometry"] == "geometry"
        return SimpleNamespace(predict=self.predict)

    def predict(
        self, test: NDArray[Any], reference: NDArray[Any], *, dim_order: str
    ) -> tuple[float, None]:
        self.given |= {"test": test, "reference": reference, "order": dim_order}
        return 9.5, None


@pytest.mark.parametrize("dtype", ["float32", "uint8"])
def test_vdp_gets_luminances(monkeypatch: pytest.MonkeyPatch, dtype: str) -> None:
    package = Package()
    monkeypatch.setitem(sys.modules, "pycvvdp", package)
    a, b = A.copy(), B.copy()
    a[0, 0] = 4.0
    if dtype == "uint8":
        a, b = (np.rint(255 * image.clip(0, 1)).astype(np.uint8) for image in (a, b))
    found = compare(a, b, metrics=["cvvdp"], nits_per_unit=200, pixels_per_degree=60)
    assert found.cvvdp == 9.5
    given = package.given
    assert (given["size"], given["ppd"], given["order"]) == ((32, 24), 60, "HWC")
    assert given["source_colorspace"] == "BT.709-linear"
    if dtype == "float32":
        np.testing.assert_allclose(given["reference"], 200 * a, rtol=1e-6)
        np.testing.assert_allclose(given["test"], 200 * b, rtol=1e-6)
        assert given["Y_peak"] == 800
    else:
        # White is 255; 188 is half of it, decoded from sRGB.
        assert given["reference"].max() == pytest.approx(200)
        assert given["Y_peak"] == pytest.approx(200)
