"""Wrong arguments are refused at the call, by errors that name them."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.io.profiles import store_png
from vkbloom._checks import check_image, check_mask

IMAGE = np.zeros((16, 24, 3), np.float32)


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


def settings() -> Iterator[vkbloom.Settings]:
    pytest.fail("an iterator was consumed")
    yield vkbloom.Pyramid()


CALLS: dict[str, Callable[[vkbloom.Renderer], object]] = {
    "framebuffers each": lambda one: one.map([IMAGE], framebuffers=("nonsense",)),
    "framebuffers iterator": lambda one: one.map(iter([IMAGE]), framebuffers="nonsense"),
    "framebuffers settings": lambda one: one.map(
        iter([IMAGE]), [vkbloom.Pyramid(levels=2)], framebuffers=("blur_vertical",)
    ),
    "framebuffers many": lambda one: one.sweep(
        IMAGE, [vkbloom.Pyramid(levels=2)], framebuffers=("nonsense",)
    ),
    "framebuffers scene": lambda one: one.sweep(
        vkbloom.Scene.ufo(), [vkbloom.Pyramid(levels=2)], size=(64, 48), framebuffers=("nonsense",)
    ),
    "framebuffers type": lambda one: one.sweep(IMAGE, settings(), framebuffers=(3,)),  # type: ignore[arg-type]
    "psf: 'spencer'": lambda _: vkbloom.Convolution(psf="spencer"),
    "psf: complex": lambda _: vkbloom.Convolution(psf=np.ones((3, 3), complex)),
    "psf: an array": lambda _: vkbloom.Convolution(psf=[[1, 2], [3]]),
    "image: an array is needed, not 'dirt.png'": lambda _: vkbloom.Dirt(image="dirt.png"),
    "radii": lambda _: vkbloom.psf.spencer().encircled_energy(["x"]),
    "reduce: 3": lambda one: vkbloom.grid(IMAGE, axes={"exposure": [2]}, reduce=3, renderer=one),  # type: ignore[arg-type]
    "axes: 3": lambda one: vkbloom.grid(IMAGE, axes={3: [1]}, renderer=one),  # type: ignore[dict-item]
    "metadata: 3": lambda _: vkbloom.write("o.png", IMAGE, metadata=3),  # type: ignore[arg-type]
    "path: b'o.png'": lambda _: vkbloom.write(b"o.png", IMAGE),  # type: ignore[arg-type]
    "path: b'i.png'": lambda _: vkbloom.read(b"i.png"),  # type: ignore[call-overload]
    "path: 3": lambda _: vkbloom.read(3),  # type: ignore[call-overload]
    "image: OnCuda is on another device; copy it to the CPU: image.cpu() for PyTorch": lambda one: (
        one.apply(OnCuda())  # type: ignore[arg-type]
    ),
    "image: WithoutView is on another device": lambda one: one.apply(WithoutView()),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("named", CALLS)
def test_errors_at_the_call_name_the_argument(named: str, renderer: vkbloom.Renderer) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        CALLS[named](renderer)
    text = str(caught.value)
    assert text.startswith(named if ":" in named else f"{named.split(maxsplit=1)[0]}:"), text


@pytest.mark.parametrize("subimage", ["one", 1.5, None])
def test_subimages_are_integers(tmp_path: Path, subimage: Any) -> None:
    path = store_png(tmp_path / "a.png", np.zeros((4, 4, 3), np.uint8))
    with pytest.raises(TypeError, match=r"^subimage: "):
        vkbloom.read(path, subimage=subimage)


def test_names_of_levels_of_larger_images_are_accepted(renderer: vkbloom.Renderer) -> None:
    image = np.zeros((300, 300, 3), np.float32)
    settings = vkbloom.Pyramid(levels=7)
    (frames,) = renderer.map(iter([image]), settings, framebuffers=("down_6",))
    assert list(frames) == ["down_6"]


# Objects other than ndarrays as images, and the errors for objects that are none.


RANDOM = np.random.default_rng(2).random((5, 7, 3), dtype=np.float32)


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
    "like", [Viewed(), Packed(), memoryview(RANDOM.data)], ids=["__array__", "dlpack", "buffer"]
)
def test_array_likes(renderer: vkbloom.Renderer, like: Any) -> None:
    expected = renderer.apply(RANDOM)["final"]
    assert np.array_equal(renderer.apply(like)["final"], expected)


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


@pytest.mark.parametrize("dtype", ["<f8", ">f8"])
def test_float64_is_computed_in_float32(renderer: vkbloom.Renderer, dtype: str) -> None:
    made = renderer.apply(RANDOM.astype(dtype))["final"]
    assert made.dtype == np.float32
    assert np.array_equal(made, renderer.apply(RANDOM)["final"])


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


def test_a_scene_is_no_array(renderer: vkbloom.Renderer) -> None:
    with pytest.raises(TypeError, match=r"^scene: ndarray is not a Scene$"):
        renderer.render(RANDOM)  # type: ignore[arg-type]


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
