"""Every call takes arrays of any byte order, layout and subclass, and refuses values under masks.

Arrays of Zarr stores and ctypes name their byte order.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

import vkbloom
from tests.exhaustive import by_turns
from tests.images import picture
from tests.scene.parts import load_sky
from vkbloom import Convolution, Renderer, Separable, psf, reference, testing

Image = NDArray[Any]
Call = Callable[[Any, Any, Any], Any]

SETTINGS = Separable(threshold=0.2)
PLAIN = picture(7, 6, 3, "float32")


def _mask(array: Image) -> Image:
    return array[..., 0] if array.dtype.name == "uint8" else array[..., 0].clip(0, 1)


def _cube(array: Image) -> Image:
    return array[np.newaxis, :5, :5].repeat(6, axis=0)


def _fill(renderer: Renderer, array: Image, given: Image) -> Image:
    out = np.zeros_like(given)
    assert renderer.apply(array, SETTINGS, out={"final": out})["final"] is out
    return out


def _write(array: Image) -> Image:
    file = Path("image.png" if array.dtype.kind == "u" else "image.exr")
    vkbloom.write(file, array)
    return vkbloom.read(file)


def _save(renderer: Renderer, array: Image, given: Image) -> Image:
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
    "out": _fill,
    "psf": lambda r, array, given: r.apply(PLAIN, Convolution(psf=given))["final"],
    # (The order of a sum follows the layout.)
    "fit": lambda r, array, given: np.float32(
        vkbloom.fit(given, given, SETTINGS, "intensity", renderer=r, max_calls=3).loss
    ),
    "grid": lambda r, array, given: vkbloom.grid(given, SETTINGS, {"intensity": [0.5]}, renderer=r)[
        "final"
    ].to_numpy(),
    "write": lambda r, array, given: _write(given),
    "save": _save,
    "reference": lambda r, array, given: reference.apply(given, SETTINGS)["final"],
    "emission of the reference": lambda r, array, given: reference.apply(
        array, SETTINGS, emission=given
    )["final"],
    "mask of the reference": lambda r, array, given: reference.apply(
        PLAIN, SETTINGS, mask=_mask(given)
    )["final"],
    "vjp of the reference": lambda r, array, given: reference.vjp(given, SETTINGS)[1](
        {"final": PLAIN}
    )["intensity"],
    "cotangents of the reference": lambda r, array, given: reference.vjp(PLAIN, SETTINGS)[1](
        {"final": given}
    )["image"],
    "shade": lambda r, array, given: reference.shade(given, given, given, given),
    "samples": lambda r, array, given: psf.samples(given).array((5, 5)),
    "unreal": lambda r, array, given: psf.unreal(given).array((5, 5)),
    "aperture": lambda r, array, given: psf.aperture(_mask(given)[:6, :6] > 0).array((5, 5)),
    "dirt": lambda r, array, given: r.apply(
        PLAIN, SETTINGS.replace(glare=(vkbloom.Streaks(), vkbloom.Dirt(image=given)))
    )["final"],
    "deglare": lambda r, array, given: vkbloom.deglare(
        given, psf.gaussian(1), iterations=2, renderer=r
    ),
    "skybox": lambda r, array, given: load_sky(_cube(given)).levels[0],
    "flash": lambda r, array, given: testing.flash([array, given, array], 3, degrees=20).general,
    "diagnose": lambda r, array, given: str(testing.diagnose(given, array)),
    "probe": lambda r, array, given: testing.assert_laws(
        lambda image: image.view(image.dtype.newbyteorder(given.dtype.byteorder)),
        "superposition",
        size=(16, 16),
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
    if not (call in (*WRITTEN, "skybox") and dtype == "float64")
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


class Subclass(np.ndarray[Any, Any]):
    """A subclass of which the package knows nothing."""


def _on_disk(array: Image) -> Image:
    mapped = np.memmap("array", array.dtype, "w+", shape=array.shape)
    mapped[...] = array
    return mapped


LAYOUTS: dict[str, Callable[[Image], Image]] = {
    "masked, without masked values": np.ma.array,
    "subclass": lambda array: array.view(Subclass),
    "memmap": _on_disk,
    "Fortran": np.asfortranarray,
    "reversed": lambda array: array[::-1, ::-1].copy()[::-1, ::-1],
    "read-only": lambda array: np.frombuffer(array.tobytes(), array.dtype).reshape(array.shape),
}
#: Arrays of the caller that are filled or passed on, and not read.
NOT_READ = (*WRITTEN, "probe", "memoryview")
READ = [call for call in CALLS if call not in NOT_READ]


@pytest.mark.parametrize(("call", "dtype"), by_turns(READ, turns=["uint8", "float32"]))
def test_layouts_and_subclasses(renderer: Renderer, in_folder: None, call: str, dtype: str) -> None:
    array: Any = picture(7, 6, 3, dtype) if dtype == "uint8" else PLAIN
    expected = CALLS[call](renderer, array, array)
    for name, made in LAYOUTS.items():
        assert_array_equal(CALLS[call](renderer, array, made(array)), expected, name)


@pytest.mark.parametrize("dtype", ["uint8", "bool", "float16", "float32", "float64"])
@pytest.mark.parametrize("kind", [np.ma.array, np.matrix])
@pytest.mark.filterwarnings("ignore:the matrix subclass")
def test_masks_of_subclasses(renderer: Renderer, kind: Any, dtype: str) -> None:
    """The division of a masked uint8 gives float64, whose bytes were read as float32."""
    mask = picture(7, 6, 3, "uint8")[..., 0]
    mask = mask if dtype == "uint8" else (mask / 255).astype(dtype)
    for call in (renderer.apply, reference.apply):
        expected = call(PLAIN, SETTINGS, mask=mask)["final"]
        assert_array_equal(call(PLAIN, SETTINGS, mask=kind(mask))["final"], expected)


@pytest.mark.parametrize("call", READ)
def test_values_under_a_mask_are_refused(renderer: Renderer, in_folder: None, call: str) -> None:
    array: Any = PLAIN
    hidden = np.ma.array(array, mask=np.indices(array.shape)[0] == 1)
    with pytest.raises(ValueError, match=r"some values are masked; fill them first"):
        CALLS[call](renderer, array, hidden)


def test_doubles_beyond_floats_are_the_largest_float(renderer: Renderer) -> None:
    """NumPy's conversion makes infinity, which does not glow, and prints a warning."""
    largest = float(np.finfo(np.float32).max)
    image = np.where(np.indices(PLAIN.shape)[0] == 1, 1e39, PLAIN.astype(np.float64))
    image[0, 0, 0] = -np.inf
    expected = np.where(np.isinf(image), -np.inf, np.minimum(image, largest)).astype(np.float32)
    plain = replace(SETTINGS, bloom=False)
    made = renderer.apply(image, plain)["final"]
    assert_array_equal(made, renderer.apply(expected, plain)["final"])
    assert made[1, 1, 1] == np.float32(largest)


#: What is no image and no mask, whatever NumPy makes of it.
ODD: dict[str, Any] = {
    "0-d": np.float32(1),
    "objects": PLAIN.astype(object),
    "complex": PLAIN.astype(np.complex64),
    "structured": np.zeros((7, 6, 3), [("r", np.float32)]),
    "dates": np.zeros((7, 6, 3), "datetime64[s]"),
    "text": PLAIN.astype(str),
    "bools": PLAIN > 1,
    "no rows": PLAIN[:0],
    "no channels": PLAIN[..., :0],
    "ragged": [[1.0], [1.0, 2.0]],
}


@pytest.mark.parametrize("name", ODD)
def test_other_arrays_are_refused_by_name(renderer: Renderer, name: str) -> None:
    odd, plane = ODD[name], ODD[name]
    if name == "bools":
        plane = odd[..., 0][:-1]
    elif getattr(odd, "ndim", 0) == 3:
        plane = odd[..., 0] if odd.shape[2] else odd.reshape(7, 6, 0)
    calls: dict[str, Callable[[], Any]] = {
        "image": lambda: renderer.apply(odd, SETTINGS),
        "source": lambda: vkbloom.grid(odd, SETTINGS, {"intensity": [1]}, renderer=renderer),
        "target": lambda: vkbloom.fit(PLAIN, odd, SETTINGS, "intensity", renderer=renderer),
        "image ": lambda: reference.apply(odd, SETTINGS),
        "emission": lambda: renderer.apply(PLAIN, SETTINGS, emission=odd),
        "emission ": lambda: reference.apply(PLAIN, SETTINGS, emission=odd),
        "mask": lambda: renderer.apply(PLAIN, SETTINGS, mask=plane),
        "mask ": lambda: reference.apply(PLAIN, SETTINGS, mask=plane),
        "array": lambda: vkbloom.write("odd.exr", odd),
    }
    if name not in ("objects", "bools", "text"):  # numbers, as NumPy converts them
        calls["psf"] = lambda: Convolution(psf=odd)
    for argument, call in calls.items():
        with pytest.raises((TypeError, ValueError), match=rf"\b{argument.strip()}\b"):
            call()


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
