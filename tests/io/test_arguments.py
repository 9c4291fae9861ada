"""Wrong arguments are refused at the call, by errors that name them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.io.profiles import store_png

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

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        return {}


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
