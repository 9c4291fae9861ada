"""Arrays whose dtype names its byte order, as those of Zarr stores and ctypes do, in every call."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

import vkbloom
from tests.images import picture
from vkbloom import Convolution, Renderer, Separable, reference, testing

Image = NDArray[Any]
Call = Callable[[Any, Any, Any], Any]

SETTINGS = Separable(threshold=0.2)
PLAIN = picture(7, 6, 3, "float32")


def _mask(array: Image) -> Image:
    return array[..., 0] if array.dtype.name == "uint8" else array[..., 0].clip(0, 1)


def _filled(renderer: Renderer, array: Image, given: Image) -> Image:
    out = np.zeros_like(given)
    assert renderer.apply(array, SETTINGS, out={"final": out})["final"] is out
    return out


def _written(array: Image) -> Image:
    file = Path("image.png" if array.dtype.kind == "u" else "image.exr")
    vkbloom.write(file, array)
    return vkbloom.read(file)


def _saved(renderer: Renderer, array: Image, given: Image) -> Image:
    file = Path("final.png" if array.dtype.kind == "u" else "final.exr")
    out = np.zeros_like(given)
    renderer.apply(array, SETTINGS, framebuffers="final", out={"final": out}).save(file)
    return vkbloom.read(file)


#: What calls make of an array `given`, which equals the native `array`.
CALLS: dict[str, Call] = {
    "apply": lambda r, array, given: r.apply(given, SETTINGS)["final"],
    "map": lambda r, array, given: next(r.map(given[None], SETTINGS))["final"],
    "sweep": lambda r, array, given: next(r.sweep(given, [SETTINGS]))["final"],
    "upload": lambda r, array, given: r.apply(r.upload(given), SETTINGS)["final"],
    "plan": lambda r, array, given: len(r.plan(given, SETTINGS).passes),
    "vjp": lambda r, array, given: vkbloom.vjp(given, SETTINGS, renderer=r)[1]({"final": PLAIN})[
        "intensity"
    ],
    "cotangents": lambda r, array, given: vkbloom.vjp(PLAIN, SETTINGS, renderer=r)[1](
        {"final": given}
    )["image"],
    "emission": lambda r, array, given: r.apply(array, SETTINGS, emission=given)["final"],
    "mask": lambda r, array, given: r.apply(PLAIN, SETTINGS, mask=_mask(given))["final"],
    "out": _filled,
    "psf": lambda r, array, given: r.apply(PLAIN, Convolution(psf=given))["final"],
    "fit": lambda r, array, given: (
        vkbloom.fit(given, given, SETTINGS, "intensity", renderer=r, max_calls=3).loss
    ),
    "grid": lambda r, array, given: vkbloom.grid(given, SETTINGS, {"intensity": [0.5]}, renderer=r)[
        "final"
    ].to_numpy(),
    "write": lambda r, array, given: _written(given),
    "save": _saved,
    "reference": lambda r, array, given: reference.apply(given, SETTINGS)["final"],
    "diagnose": lambda r, array, given: str(testing.diagnose(given, array)),
    "probe": lambda r, array, given: testing.assert_superposition(
        lambda image: image.view(image.dtype.newbyteorder(given.dtype.byteorder))
    ),
    "memoryview": lambda r, array, given: r.apply(memoryview(given), SETTINGS)["final"],
}


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


#: The device writes framebuffers, so that they have its order and precision.
WRITTEN = ("out", "save")
CASES = [
    (call, dtype)
    for call in CALLS
    for dtype in ("uint8", "float16", "float32", "float64")
    if not (call in WRITTEN and dtype == "float64")
]


@pytest.mark.parametrize(("call", "dtype"), CASES)
def test_an_order_that_is_named(renderer: Renderer, in_folder: None, call: str, dtype: str) -> None:
    array: Any = picture(7, 6, 3, dtype) if dtype == "uint8" else PLAIN.astype(dtype)
    named = [array.view(array.dtype.newbyteorder(order)) for order in "<="]
    if call not in (*WRITTEN, "probe"):
        named.append(array.astype(array.dtype.newbyteorder(">")))
    expected = CALLS[call](renderer, array, array)
    for given in named:
        assert_array_equal(CALLS[call](renderer, array, given), expected)


@pytest.mark.parametrize("order", ["__ctype_le__", "__ctype_be__"])
def test_arrays_of_ctypes(renderer: Renderer, order: str) -> None:
    given: Any = (getattr(ctypes.c_float, order) * 3 * 7 * 6)()
    np.asarray(memoryview(given))[...] = PLAIN
    expected = renderer.apply(PLAIN, SETTINGS)["final"]
    assert_array_equal(renderer.apply(given, SETTINGS)["final"], expected)


@pytest.mark.parametrize("kind", ["<u2", ">u2", ">i4", "<c8", ">f16"])
def test_an_error_names_the_dtype_that_was_given(renderer: Renderer, kind: str) -> None:
    given = PLAIN.astype(kind)
    hint = "convert it: (image / 65535).astype(np.float32)" if kind.endswith("u2") else ""
    for call in (renderer.apply, reference.apply):
        with pytest.raises(TypeError) as caught:
            call(given, SETTINGS)
        assert f" {given.dtype}" in str(caught.value)
        assert hint in str(caught.value)
    with pytest.raises(TypeError, match=f"mask: dtype {given.dtype} is not one of"):
        renderer.apply(PLAIN, SETTINGS, mask=given[..., 0])
    with pytest.raises(ValueError, match=f"dtype {given.dtype}, it must have"):
        renderer.apply(PLAIN, SETTINGS, out={"final": given})
