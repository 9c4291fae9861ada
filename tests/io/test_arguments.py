"""Wrong arguments are refused at the call, by errors that name them, and leave no file."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.framebuffers import names_in
from tests.refusals import assert_refused, rows
from vkbloom._image_arguments import check_image, check_mask

IMAGE = np.zeros((16, 24, 3), np.float32)
RANDOM = np.random.default_rng(2).random((5, 7, 3), dtype=np.float32)
RGBA = np.ones((4, 5, 4), np.float32)
LEVELS = np.zeros((4, 5, 3), np.uint8)
SDR = "ACES 2.0 - SDR 100 nits (Rec.709)"


class OnCuda:
    """An array in the memory of a GPU, such as a tensor of PyTorch."""

    def __array__(self, *_: object, **__: object) -> Any:
        raise TypeError("can't convert cuda:0 device type tensor to numpy.")

    def __dlpack__(self, **_: object) -> Any:
        raise BufferError("not on the CPU")

    def __dlpack_device__(self) -> tuple[int, int]:
        return 2, 0


class WithoutView(OnCuda):
    """The same, such as an array of CuPy."""

    __array__ = None  # type: ignore[assignment]


def of_mode(mode: str) -> Any:
    """Return a picture of Pillow. Its array may have the shape of RGB or RGBA."""
    pil = pytest.importorskip("PIL.Image")
    return pil.new(mode, (7, 5), 255 if mode == "L" else None)


def settings() -> Iterator[vkbloom.Settings]:
    pytest.fail("an iterator was consumed")
    yield vkbloom.Pyramid()


@pytest.mark.parametrize(
    ("call", "error"), [*rows(__file__, "arguments"), *rows(__file__, "files")]
)
def test_a_wrong_value_is_refused(
    renderer: vkbloom.Renderer,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    call: str,
    error: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    vkbloom.write("a.png", LEVELS)
    modules = {"copy": copy, "pickle": pickle, "Settings": vkbloom.Settings}
    of_files = {"read": vkbloom.read, "write": vkbloom.write}
    assert_refused(call, error, {**globals(), **modules, **of_files, "renderer": renderer})
    assert names_in(tmp_path) == ["a.png"]


def test_names_of_levels_of_larger_images_are_accepted(renderer: vkbloom.Renderer) -> None:
    image = np.zeros((300, 300, 3), np.float32)
    settings = vkbloom.Pyramid(levels=7)
    (frames,) = renderer.map(iter([image]), settings, framebuffers=("down_6",))
    assert list(frames) == ["down_6"]


# Objects other than ndarrays as images, and the errors for objects that are none.


class Viewed:
    """An object that NumPy sees as an array."""

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return RANDOM


class Packed:
    """An object of another array library, of which only DLPack is known."""

    def __dlpack__(self, **options: Any) -> Any:
        return RANDOM.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[Any, Any]:
        return RANDOM.__dlpack_device__()


@pytest.mark.parametrize(
    "like",
    [Viewed(), Packed(), memoryview(RANDOM.data), *(RANDOM.astype(f"{order}f8") for order in "<>")],
    ids=["__array__", "dlpack", "buffer", "doubles", "big-endian doubles"],
)
def test_array_likes(renderer: vkbloom.Renderer, like: Any) -> None:
    """They are computed in float32."""
    expected, made = renderer.apply(RANDOM)["final"], renderer.apply(like)["final"]
    assert made.dtype == np.float32
    assert np.array_equal(made, expected)


def test_data_arrays_in_any_order(renderer: vkbloom.Renderer) -> None:
    xr = pytest.importorskip("xarray")
    expected = renderer.apply(RANDOM)["final"]
    image: Any = xr.DataArray(RANDOM, dims=("y", "x", "channel"))
    for dims in (("y", "x", "channel"), ("channel", "y", "x"), ("x", "channel", "y")):
        assert np.array_equal(renderer.apply(image.transpose(*dims))["final"], expected)
    with pytest.raises(
        ValueError, match=r"\('a', 'b', 'c'\) are not y, x, channel; rename them: image\.rename"
    ):
        renderer.apply(image.rename(y="a", x="b", channel="c"))
    grid: Any = vkbloom.grid(
        image, axes={"intensity": [0.5, 1]}, framebuffers=("final", "bloom"), renderer=renderer
    )
    again = renderer.apply(grid["final"].isel(intensity=1))
    assert again["final"].shape == RANDOM.shape
    bloom = renderer.apply(grid["bloom"].isel(intensity=1))
    assert bloom["final"].shape == (5, 7, 4)
    with pytest.raises(ValueError, match=r"image\.isel\(intensity=0\)"):
        renderer.apply(grid["final"])


@pytest.mark.parametrize(
    ("image", "error", "hint"),
    [
        ((RANDOM * 65535).astype(np.uint16), TypeError, "(image / 65535).astype(np.float32)"),
        (RANDOM[..., 0], ValueError, "np.repeat(image[..., None], 3, axis=2)"),
        (RANDOM[..., :1], ValueError, "np.repeat(image, 3, axis=2)"),
        (RANDOM.transpose(2, 0, 1), ValueError, "np.moveaxis(image, 0, -1)"),
        (RANDOM.astype(np.longdouble), TypeError, "image.astype(np.float32)"),
    ],
    ids=["uint16", "grey", "one channel", "channels first", "longdouble"],
)
def test_errors_give_a_hint(image: NDArray[Any], error: type[Exception], hint: str) -> None:
    with pytest.raises(error) as caught:
        check_image(image)
    assert str(caught.value).endswith(hint)
    mended = eval(hint, {"image": image, "np": np})
    assert check_image(mended).shape == (5, 7, 3)


def test_unknown_presets_suggest_the_nearest() -> None:
    with pytest.raises(KeyError) as caught:
        vkbloom.presets["unity"]
    text = str(caught.value)
    assert "unknown preset 'unity'; did you mean 'unity_" in text
    assert all(name in text for name in vkbloom.presets)
    assert vkbloom.presets.get("unity") is None
    assert "unity" not in vkbloom.presets


def test_pictures_are_masks() -> None:
    assert check_mask(of_mode("L"), (5, 7)).min() == 1
