"""Large arrays: NumPy's own, in pages that the device writes to and that are used again."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy._core.multiarray import get_handler_name
from numpy.typing import NDArray

from tests.images import picture
from vkbloom import Renderer, Separable

PLAIN = "default_allocator"
#: Of 1.3 MiB at least in every dtype: the device writes them past the staging memory.
SIDE = 600


@pytest.fixture
def own(new_renderer: Callable[[], Renderer]) -> Renderer:
    """A renderer without pages from other tests."""
    return new_renderer()


def final(renderer: Renderer, image: NDArray[np.generic], exposure: float) -> NDArray[np.generic]:
    return renderer.apply(image, Separable(bloom=False, exposure=exposure), attachments="final")[
        "final"
    ]


def place(array: NDArray[np.generic]) -> int:
    return int(array.ctypes.data)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
def test_the_memory_of_an_array_that_is_gone_is_used_again(
    own: Renderer, dtype: str, channels: int
) -> None:
    image = picture(SIDE - 1, SIDE, channels, dtype)
    expected = [final(own, image, exposure).copy() for exposure in (1.0, 0.5)]
    first = final(own, image, 1.0)
    before = place(first)
    assert first.flags.owndata
    assert get_handler_name(first) == "vkbloom"
    view = first[1:]
    del first
    # The view keeps it.
    second = final(own, image, 0.5)
    assert place(second) != before
    np.testing.assert_array_equal(view, expected[0][1:])
    del view
    third = final(own, image, 1.0)
    assert place(third) == before
    np.testing.assert_array_equal(third, expected[0])
    np.testing.assert_array_equal(second, expected[1])


def test_other_arrays_are_plain(own: Renderer) -> None:
    large = final(own, picture(SIDE - 1, SIDE, dtype="float32"), 1.0)
    small = final(own, picture(63, 64, dtype="float32"), 1.0)
    names = [get_handler_name(array) for array in (large.copy(), large + 1, small, np.empty(1))]
    assert names == [PLAIN] * 4
    assert get_handler_name() == PLAIN


@pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
def test_arrays_are_large_from_a_mebibyte_on(own: Renderer, dtype: str) -> None:
    """Elements were counted once: a quarter of a mebibyte of uint8 was large."""
    elements = (1 << 20) // np.dtype(dtype).itemsize
    shapes = {(elements // 4, 4): "vkbloom", (elements // 4 - 1, 4): PLAIN, (1,): PLAIN}
    for shape, name in shapes.items():
        assert get_handler_name(own._core.new_array(np.empty, shape, dtype)) == name


def test_an_array_given_back_is_written_in_place(own: Renderer) -> None:
    image = picture(SIDE - 1, SIDE, dtype="float16")
    expected = final(own, image, 0.5).copy()
    array = final(own, image, 1.0)
    frames = own.apply(
        image, Separable(bloom=False, exposure=0.5), attachments="final", out={"final": array}
    )
    assert frames["final"] is array
    np.testing.assert_array_equal(array, expected)


# Slices of one array's pages, at multiples of a pixel and between them.
@pytest.mark.parametrize("start", [0, 4, 1, 2])
def test_slices_of_an_array_are_written_in_place(own: Renderer, start: int) -> None:
    image = picture(SIDE - 1, SIDE, dtype="float16")
    expected = final(own, image, 0.5).copy()
    pages = own._core.new_array(np.empty, (3 * image.size,), "float16")
    pages[:] = 7
    out = pages[start : start + image.size].reshape(image.shape)
    own.apply(image, Separable(bloom=False, exposure=0.5), attachments="final", out={"final": out})
    np.testing.assert_array_equal(out, expected)
    assert (pages[:start] == 7).all()
    assert (pages[start + image.size :] == 7).all()


def test_arrays_outlive_the_renderer_and_can_grow(own: Renderer) -> None:
    array = final(own, picture(SIDE - 1, SIDE, dtype="float32"), 1.0)
    kept = array.copy()
    own.close()
    np.testing.assert_array_equal(array, kept)
    array[0] = 3
    kept[0] = 3
    shape = array.shape
    array.resize((2 * shape[0], *shape[1:]), refcheck=False)
    np.testing.assert_array_equal(array[: shape[0]], kept)
    array.resize((5, *shape[1:]), refcheck=False)
    np.testing.assert_array_equal(array, kept[:5])


def test_zeros_in_memory_that_was_used(own: Renderer) -> None:
    used = own._core.new_array(np.empty, (1 << 20,), "uint8")
    used[:] = 7
    before = place(used)
    del used
    zeros = own._core.new_array(np.zeros, (1 << 20,), "uint8")
    assert place(zeros) == before
    assert not zeros.any()


def test_idle_memory_has_a_limit(own: Renderer) -> None:
    quarter = 64 << 20  # bytes, of the 256 MiB that are kept

    def take(count: int) -> list[NDArray[np.generic]]:
        return [own._core.new_array(np.empty, (quarter,), "uint8") for _ in range(count)]

    arrays = take(6)
    places = [place(array) for array in arrays]
    while arrays:
        del arrays[0]
    again = [place(array) for array in take(4)]
    # The four that went last, the latest first.
    assert again == places[:1:-1]


def test_memory_that_is_not_there(own: Renderer) -> None:
    with pytest.raises(MemoryError, match="no host memory for 1 objects of"):
        own._core.new_array(np.empty, (1 << 62,), "uint8")
    assert get_handler_name() == PLAIN
    with pytest.raises(TypeError):
        own._core.new_array(np.empty, (1 << 20,), "no dtype")
    assert get_handler_name() == PLAIN
    with pytest.raises(TypeError):
        own._core.new_array(np.empty, (1 << 20, "rows"), "uint8")  # type: ignore[arg-type]


def test_threads_free_what_others_render(own: Renderer) -> None:
    image = picture(511, 512, dtype="float32")
    exposures = [0.5, 1.0, 2.0, 4.0]
    expected = {exposure: final(own, image, exposure).copy() for exposure in exposures}

    def work(seed: int) -> None:
        kept = []
        for exposure in np.random.default_rng(seed).permutation(exposures * 3):
            kept.append((exposure, final(own, image, float(exposure))))
            if len(kept) > 2:
                kept.pop(0)
            for of, array in kept:
                np.testing.assert_array_equal(array, expected[of])

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))


@pytest.mark.skipif(os.name == "nt", reason="nothing forks there")
def test_a_forked_process_keeps_its_copies(own: Renderer) -> None:
    image = picture(SIDE - 1, SIDE, dtype="float32")
    array = final(own, image, 1.0)
    kept = array.copy()
    child = os.fork()
    if child == 0:
        same = bool((array == kept).all())
        del array
        gc.collect()
        os._exit(0 if same else 1)
    final(own, image, 0.5)
    assert os.waitpid(child, 0)[1] == 0
    np.testing.assert_array_equal(array, kept)
    del array
    np.testing.assert_array_equal(final(own, image, 1.0), kept)
