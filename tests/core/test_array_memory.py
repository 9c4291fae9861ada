"""Large arrays: they are in pages that the device writes to, and that are reused."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.images import picture
from tests.planned import new_array
from vkbloom import OutOfMemoryError, Renderer, Separable, _core

#: At least 1.3 MiB in every dtype, so that the device writes without staging memory.
SIDE = 600


@pytest.fixture
def own(new_renderer: Callable[[], Renderer]) -> Renderer:
    """A renderer without pages from other tests."""
    return new_renderer()


def final(renderer: Renderer, image: NDArray[np.generic], exposure: float) -> NDArray[np.generic]:
    return renderer.apply(image, Separable(bloom=False, exposure=exposure), framebuffers="final")[
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
    assert isinstance(first.base, _core.Pages)
    assert first.flags.writeable
    assert first.flags.aligned
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


@pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
def test_arrays_are_large_from_a_mebibyte_on(own: Renderer, dtype: str) -> None:
    """Elements were counted once: a quarter of a mebibyte of uint8 was large."""
    elements = (1 << 20) // np.dtype(dtype).itemsize
    for shape, large in {(elements // 4, 4): True, (elements // 4 - 1, 4): False}.items():
        array = new_array(own._core, shape, dtype)
        assert array.shape == shape
        assert array.dtype == dtype
        assert isinstance(array.base, _core.Pages) == large
        assert array.flags.owndata == (not large)


def test_pages_are_a_buffer(own: Renderer) -> None:
    pages = own._core.pages(1000)
    assert len(pages) == 1000
    with memoryview(pages) as view:
        assert (view.nbytes, view.format) == (1000, "B")
        assert view.contiguous
        assert not view.readonly
        view[999] = 7
    assert memoryview(pages)[999] == 7
    array = np.frombuffer(memoryview(pages), np.uint16)
    array[:] = 5
    del pages
    gc.collect()
    assert (array == 5).all()


# Slices of an array's pages, at multiples of a pixel and between them.
@pytest.mark.parametrize("start", [0, 4, 1, 2])
def test_slices_of_an_array_are_written_in_place(own: Renderer, start: int) -> None:
    image = picture(SIDE - 1, SIDE, dtype="float16")
    expected = final(own, image, 0.5).copy()
    pages = new_array(own._core, (3 * image.size,), "float16")
    pages[:] = 7
    out = pages[start : start + image.size].reshape(image.shape)
    own.apply(image, Separable(bloom=False, exposure=0.5), framebuffers="final", out={"final": out})
    np.testing.assert_array_equal(out, expected)
    assert (pages[:start] == 7).all()
    assert (pages[start + image.size :] == 7).all()


def test_arrays_outlive_the_renderer(own: Renderer) -> None:
    array = final(own, picture(SIDE - 1, SIDE, dtype="float32"), 1.0)
    kept = array.copy()
    later = own._core.pages(1 << 20)
    own.close()
    np.testing.assert_array_equal(array, kept)
    array[0] = 3
    kept[0] = 3
    del own, later
    gc.collect()
    np.testing.assert_array_equal(array, kept)


def test_idle_memory_has_a_limit(own: Renderer) -> None:
    quarter = 64 << 20  # bytes, of the 256 MiB that are kept

    def take(count: int) -> list[NDArray[np.generic]]:
        return [new_array(own._core, (quarter,), "uint8") for _ in range(count)]

    arrays = take(6)
    places = [place(array) for array in arrays]
    while arrays:
        del arrays[0]
    again = [place(array) for array in take(4)]
    # The four that went last, the latest first.
    assert again == places[:1:-1]


def test_lack_of_memory_is_an_error(own: Renderer) -> None:
    with pytest.raises(
        OutOfMemoryError, match=r"memory is short: the host has no 2.199e\+12 MiB more\. Smaller"
    ):
        new_array(own._core, (1 << 61,), "uint8")
    with pytest.raises(TypeError):
        new_array(own._core, (1 << 20,), "no dtype")


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
