"""Every array of the interface, empty, of one element, and of wrong sizes and types."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import pytest

import vkbloom
from tests.scene.parts import WHITE, Cubemap, Material, Mesh, Texture, load_sky
from vkbloom import Convolution, Ghosts, GodotBloom, Pyramid, Renderer, Scene, Separable, psf

Array = np.ndarray[Any, Any]
Call = Callable[[Renderer, Any], object]

IMAGE: Final = np.zeros((4, 5, 3), np.float32)
MESH: Final[Mapping[str, Array]] = {
    "vertices": np.zeros((4, 9), np.float32),
    "indices": np.arange(6, dtype=np.uint32) % 4,
    "emission": np.zeros((4, 3), np.float32),
    "texcoords": np.zeros((4, 4), np.float32),
}


def draw(
    renderer: Renderer, sky: Cubemap | None = None, texture: Texture = WHITE, **arrays: Any
) -> object:
    """Draw a mesh with such arrays."""
    body = Mesh(**{**MESH, **arrays}, surfaces=(Material(3, texture),))
    return renderer.render(Scene(body, None, sky), Separable(), size=(8, 8))


def pull(renderer: Renderer, cotangent: Any) -> object:
    _, pullback = vkbloom.vjp(IMAGE, Pyramid(levels=2, format="rgba32float"), renderer=renderer)
    return pullback({"final": cotangent})


class Place(NamedTuple):
    """Where the interface takes an array: the call, a right array, how errors begin.

    `right`: The variants that it takes, too.
    """

    call: Call
    array: Array
    begins: str
    right: tuple[str, ...] = ()


#: Types that are converted, and sizes that a place leaves free.
CONVERTED: Final = ("float16", "float32", "float64", "longdouble", "uint8", "int64")
ROWS: Final = ("one less", "one more")
COLUMNS: Final = (*ROWS, "axis 1 one more")
PLACES: Final[Mapping[str, Place]] = {
    "image": Place(
        lambda renderer, array: renderer.apply(array, Separable()),
        IMAGE,
        "image",
        (*COLUMNS, "axis 2 one more", "float16", "float64", "uint8"),
    ),
    "mask": Place(
        lambda renderer, array: vkbloom.apply(IMAGE, Separable(), mask=array, renderer=renderer),
        np.ones((4, 5), np.float32),
        "mask",
        ("float16", "float64", "uint8"),
    ),
    "emission": Place(
        lambda renderer, array: vkbloom.apply(
            IMAGE, Separable(), emission=array, renderer=renderer
        ),
        IMAGE,
        "emission",
        ("float64",),
    ),
    "out": Place(
        lambda renderer, array: renderer.apply(IMAGE, Separable(), out={"final": array}),
        np.zeros_like(IMAGE),
        "out",
    ),
    "cotangents": Place(pull, IMAGE, "cotangents", CONVERTED),
    "weights": Place(
        lambda renderer, array: renderer.apply(IMAGE, Separable(weights=array)),
        np.ones(3, np.float32),
        "weights",
        (*ROWS, *CONVERTED, "one element"),
    ),
    "layers": Place(
        lambda renderer, array: renderer.apply(IMAGE, Separable(layers=array)),
        np.ones((3, 2), np.float32),
        "layers",
        (*ROWS, *CONVERTED),
    ),
    "level_weights": Place(
        lambda renderer, array: renderer.apply(IMAGE, Pyramid(level_weights=array, levels=3)),
        np.ones(3, np.float32),
        "level_weights",
        CONVERTED,
    ),
    "Godot's level_weights": Place(
        lambda renderer, array: renderer.apply(IMAGE, GodotBloom(level_weights=array)),
        np.ones(7, np.float32),
        "level_weights",
        CONVERTED,
    ),
    "tints": Place(
        lambda _, array: Ghosts(tints=array, scales=(1.0, 1.0)),
        np.ones((2, 3), np.float32),
        "tints",
        ("one less", *CONVERTED),  # one tint is for all ghosts
    ),
    "psf": Place(
        lambda renderer, array: renderer.apply(IMAGE, Convolution(psf=array)),
        np.ones((3, 4), np.float32),
        "psf",
        (*COLUMNS, *CONVERTED),
    ),
    "values of samples": Place(
        lambda renderer, array: renderer.apply(IMAGE, Convolution(psf=psf.samples(array))),
        np.ones((3, 3, 3), np.float32),
        "values",
        (*COLUMNS, *CONVERTED),
    ),
    "faces": Place(
        lambda renderer, array: draw(renderer, sky=load_sky(array)),
        np.zeros((6, 2, 2, 4), np.float32),
        "skybox",
        ("float16", "uint8"),
    ),
    "levels of a sky": Place(
        lambda renderer, array: draw(renderer, sky=Cubemap((array,))),
        np.zeros((6, 2, 2, 4), np.float32),
        "levels",
        ("float16", "uint8"),
    ),
    "levels of a texture": Place(
        lambda renderer, array: draw(renderer, texture=Texture((array,))),
        np.zeros((3, 2, 4), np.float16),
        "levels",
        COLUMNS,
    ),
    "a second level": Place(
        lambda renderer, array: draw(
            renderer, texture=Texture((np.zeros((7, 4, 4), np.float16), array))
        ),
        np.zeros((3, 2, 4), np.float16),
        "levels",
    ),
    # Another number of vertices fits neither the indices nor the other arrays.
    "vertices": Place(
        lambda renderer, array: draw(renderer, vertices=array),
        MESH["vertices"],
        "vertices|indices|emission",
        CONVERTED,
    ),
    "indices": Place(
        lambda renderer, array: draw(renderer, indices=array),
        MESH["indices"],
        "indices",
        ("uint8", "int64"),
    ),
    "emission of a mesh": Place(
        lambda renderer, array: draw(renderer, emission=array),
        MESH["emission"],
        "emission",
        CONVERTED,
    ),
    "texcoords": Place(
        lambda renderer, array: draw(renderer, texcoords=array),
        MESH["texcoords"],
        "texcoords",
        CONVERTED,
    ),
}


def variants(array: Array) -> dict[str, Any]:
    """Return arrays that are not the one that a place takes, by what is wrong."""
    made: dict[str, Any] = {
        "empty": np.zeros(0, array.dtype),
        "no dimension": np.zeros((), array.dtype),
        "one element": array.ravel()[:1].copy(),
        "one less": array[:-1].copy(),
        "one more": np.concatenate([array, array[:1]]),
        "one dimension less": array.ravel() if array.ndim > 1 else array[0],
        "one dimension more": np.stack([array, array]),
        "None inside": np.full(array.shape, None),
        "text": np.full(array.shape, "1"),
        "complex64": array.astype(np.complex64),
    }
    for axis, side in enumerate(array.shape):
        counts = np.ones(side, int)
        made[f"axis {axis} empty"] = np.repeat(array, 0 * counts, axis)
        counts[0] = 2
        made[f"axis {axis} one more"] = np.repeat(array, counts, axis)
    del made["axis 0 one more"]  # as "one more"
    for dtype in CONVERTED:
        if np.dtype(dtype) != array.dtype:
            made[dtype] = array.astype(dtype)
    return made


def refusal(call: Call, renderer: Renderer, array: Any) -> str | None:
    """Return the text of the error of a wrong argument; None: there was none."""
    try:
        call(renderer, array)
    except (TypeError, ValueError) as error:
        return str(error)
    return None


@pytest.mark.parametrize("name", PLACES)
def test_a_wrong_array_is_refused(renderer: Renderer, name: str) -> None:
    """Its error begins with the array's name; what a place takes it takes."""
    place = PLACES[name]
    place.call(renderer, place.array.copy())
    taken = []
    for what, array in variants(place.array).items():
        if (error := refusal(place.call, renderer, array)) is None:
            taken.append(what)
        else:
            assert re.match(rf"({place.begins})\b", error), (what, error)
    assert set(taken) == set(place.right) & set(variants(place.array))
