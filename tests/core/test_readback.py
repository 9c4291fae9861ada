"""Large framebuffers, which the device writes directly into arrays: all their bytes and no others.

Arrays that the device cannot import, and small ones, use staging memory. Both ways must agree.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.device.abilities import max_side
from tests.exhaustive import by_turns
from tests.images import DTYPES, picture
from vkbloom import Pyramid, Renderer, Scene, Separable, Settings, _core

OFF = Separable(bloom=False)


def place(shape: tuple[int, ...], dtype: str, start: int) -> tuple[Any, Any]:
    """Return an array `start` bytes after a multiple of a page's size, and the bytes around it."""
    page = 4096
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    around = np.full(size + 4 * page, 0xA5, np.uint8)
    first = -around.ctypes.data % page + page + start
    array = around[first : first + size].view(dtype).reshape(shape)
    assert array.ctypes.data % page == start
    return array, around


@pytest.mark.parametrize(
    ("dtype", "size", "channels"),
    by_turns(DTYPES, [(513, 512), (1001, 333), (1, 16000), (16000, 21)], turns=[3, 4]),
)
def test_large_images_come_back_to_the_byte(
    renderer: Renderer, size: tuple[int, int], dtype: str, channels: int
) -> None:
    width, height = (min(side, max_side(renderer)) for side in size)
    image = picture(width, height, channels, dtype, 1)
    final = renderer.apply(image, OFF)["final"]
    np.testing.assert_array_equal(final, image)
    assert type(final) is np.ndarray
    assert final.flags.owndata or isinstance(final.base, _core.Pages)
    assert final.flags.c_contiguous
    assert final.flags.writeable


# Multiples of the largest pixel, as new arrays have them; of smaller pixels; of nothing.
@pytest.mark.parametrize(
    ("dtype", "start", "channels"),
    by_turns(DTYPES, [0, 16, 64, 4080, 8, 4, 12, 2, 1, 4095], turns=[3, 4]),
)
def test_nothing_around_an_array_is_touched(
    renderer: Renderer, dtype: str, channels: int, start: int
) -> None:
    # The last page is left half-used, too.
    image = picture(701, 603, channels, dtype, 2)
    out, around = place(image.shape, dtype, start)
    frames = renderer.apply(image, OFF, out={"final": out})
    assert frames["final"] is out
    np.testing.assert_array_equal(out, image)
    out.view(np.uint8)[:] = 0xA5
    assert (around == 0xA5).all()


@pytest.mark.parametrize("shading", ["forward", "deferred"])
def test_every_framebuffer_both_ways(renderer: Renderer, scene: Scene, shading: Any) -> None:
    settings, size = Separable(bloom_size=(600, 500)), (640, 480)
    whole = renderer.render(scene, settings, size, shading=shading, time=0.1)
    out = {name: place(array.shape, array.dtype.name, 1)[0] for name, array in whole.items()}
    # Without its alignment an array cannot be the device's.
    apart = renderer.render(scene, settings, size, shading=shading, time=0.1, out=out)
    # (A result that a pass stored to the array is not in the cached image.)
    assert apart.timings.keys() <= {"final"}
    for name, array in whole.items():
        np.testing.assert_array_equal(apart[name], array, err_msg=name)


@pytest.mark.parametrize(("dtype", "width", "channels"), by_turns(DTYPES, [960, 701], turns=[3, 4]))
def test_a_final_that_comes_again_is_kept(
    new_renderer: Callable[[], Renderer], width: int, dtype: str, channels: int
) -> None:
    image = picture(width, 600, channels, dtype, 5)
    renderer = new_renderer()
    finals = []
    runs = []
    for _ in range(5):
        frames = renderer.apply(image, Separable(), framebuffers=("final",))
        finals.append(frames["final"].copy())
        runs.append(list(frames.timings))
        # It is the caller's alone.
        frames["final"][:] = 0
    for final in finals[1:]:
        np.testing.assert_array_equal(final, finals[0])
    alone = renderer.plan(image, Separable(), framebuffers="final").passes
    assert runs[0] == [one.name for one in alone]
    # Where the first call reads the array in place, the next one copies it.
    assert runs[3:] == [[], []]


def test_rows_of_three_bytes_are_packed_at_any_width(renderer: Renderer) -> None:
    """Some pixels are packed at a time, and the last ones one by one."""
    for width in range(1, 14):
        image = picture(width, 3, 3, "uint8", width)
        final = renderer.apply(image, Separable(bloom=False), framebuffers=("final",))["final"]
        np.testing.assert_array_equal(final, image, err_msg=f"{width}")


# A fused pass, an upsampling and a composite store the picture without its alpha. In the second
# size the rows are complete words but no complete blocks; in the third they are no complete words.
@pytest.mark.parametrize(
    ("settings", "size", "dtype"),
    by_turns(
        [Separable(threshold=0.4), Pyramid(levels=3), Separable(threshold=0.4, blur_scale=2.0)],
        [(960, 600), (944, 403), (701, 603)],
        turns=DTYPES,
    ),
)
def test_three_channels_are_stored_without_alpha(
    renderer: Renderer, settings: Settings, dtype: str, size: tuple[int, int]
) -> None:
    image = picture(*size, 4, dtype, 4)
    if dtype != "uint8":
        image[5, 7, 1], image[402, 700, 2] = np.nan, np.inf
    expected = renderer.apply(image, settings, framebuffers=("final",))["final"][..., :3]
    image = np.ascontiguousarray(image[..., :3])
    # New memory, memory around it that must stay, and memory to which a pass cannot store.
    new = renderer.apply(image, settings, framebuffers=("final",))["final"]
    np.testing.assert_array_equal(new, expected)
    for start in (16, 4):
        renderer.apply(image[::-1], settings, framebuffers=("final",))
        out, around = place(image.shape, dtype, start)
        renderer.apply(image, settings, framebuffers=("final",), out={"final": out})
        np.testing.assert_array_equal(out, expected)
        out.view(np.uint8)[:] = 0xA5
        assert (around == 0xA5).all()
