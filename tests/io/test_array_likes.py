"""Objects other than ndarrays as images, and the errors for objects that are none."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from vkbloom._checks import check_image, check_mask

IMAGE = np.random.default_rng(2).random((5, 7, 3), dtype=np.float32)


class Viewed:
    """An object that NumPy sees as an array."""

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return IMAGE


class Packed:
    """An object of another array library, of which only DLPack is known."""

    def __dlpack__(self, **options: Any) -> Any:
        return IMAGE.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[Any, Any]:
        return IMAGE.__dlpack_device__()


@pytest.mark.parametrize(
    "like", [Viewed(), Packed(), memoryview(IMAGE.data)], ids=["__array__", "dlpack", "buffer"]
)
def test_array_likes(renderer: vkbloom.Renderer, like: Any) -> None:
    expected = renderer.apply(IMAGE)["final"]
    assert np.array_equal(renderer.apply(like)["final"], expected)


def test_data_arrays_in_any_order(renderer: vkbloom.Renderer) -> None:
    xr = pytest.importorskip("xarray")
    expected = renderer.apply(IMAGE)["final"]
    image: Any = xr.DataArray(IMAGE, dims=("y", "x", "channel"))
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
    assert again["final"].shape == IMAGE.shape
    bloom = renderer.apply(grid["bloom"].isel(intensity=1))
    assert bloom["final"].shape == (5, 7, 4)
    with pytest.raises(ValueError, match=r"image\.isel\(intensity=0\)"):
        renderer.apply(grid["final"])


@pytest.mark.parametrize("dtype", ["<f8", ">f8"])
def test_float64_is_computed_in_float32(renderer: vkbloom.Renderer, dtype: str) -> None:
    made = renderer.apply(IMAGE.astype(dtype))["final"]
    assert made.dtype == np.float32
    assert np.array_equal(made, renderer.apply(IMAGE)["final"])


@pytest.mark.parametrize(
    ("image", "error", "hint"),
    [
        ((IMAGE * 65535).astype(np.uint16), TypeError, "(image / 65535).astype(np.float32)"),
        (IMAGE[..., 0], ValueError, "np.repeat(image[..., None], 3, axis=2)"),
        (IMAGE[..., :1], ValueError, "np.repeat(image, 3, axis=2)"),
        (IMAGE.transpose(2, 0, 1), ValueError, "np.moveaxis(image, 0, -1)"),
        (IMAGE.astype(np.longdouble), TypeError, "image.astype(np.float32)"),
    ],
    ids=["uint16", "grey", "one channel", "channels first", "longdouble"],
)
def test_errors_give_a_hint(image: NDArray[Any], error: type[Exception], hint: str) -> None:
    with pytest.raises(error) as caught:
        check_image(image)
    assert str(caught.value).endswith(hint)
    mended = eval(hint, {"image": image, "np": np})
    assert check_image(mended).shape == (5, 7, 3)


def test_a_scene_is_no_array(renderer: vkbloom.Renderer) -> None:
    with pytest.raises(TypeError, match=r"^scene: ndarray is not a Scene$"):
        renderer.render(IMAGE)  # type: ignore[arg-type]


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, pickle.dumps])
def test_renderers_are_not_copied(renderer: vkbloom.Renderer, duplicate: Any) -> None:
    with pytest.raises(TypeError, match="a Renderer cannot be copied or pickled"):
        duplicate(renderer)
    assert not renderer.closed


def test_unknown_presets_suggest_the_nearest() -> None:
    with pytest.raises(KeyError) as caught:
        vkbloom.presets["unity"]
    text = str(caught.value)
    assert "unknown preset 'unity'; did you mean 'unity_" in text
    assert all(name in text for name in vkbloom.presets)
    assert vkbloom.presets.get("unity") is None
    assert "unity" not in vkbloom.presets


@pytest.mark.parametrize(
    ("mode", "hint"),
    [("CMYK", "RGB"), ("YCbCr", "RGB"), ("P", "RGB"), ("L", "RGB"), ("LA", "RGBA")],
)
def test_pictures_of_other_colours_are_refused(mode: str, hint: str) -> None:
    """Their arrays may have the shape of RGB or RGBA."""
    pil = pytest.importorskip("PIL.Image")
    with pytest.raises(ValueError, match=rf"mode {mode} is not.*image\.convert\(\"{hint}\"\)"):
        check_image(pil.new(mode, (7, 5)))


def test_palettes_are_no_masks() -> None:
    pil = pytest.importorskip("PIL.Image")
    with pytest.raises(ValueError, match=r'palette; convert it: mask\.convert\("L"\)'):
        check_mask(pil.new("P", (7, 5)), (5, 7))
    assert check_mask(pil.new("L", (7, 5), 255), (5, 7)).min() == 1
