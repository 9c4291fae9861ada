"""Images that stay on the device, and sequences of images: upload and map."""

from __future__ import annotations

import gc
import sys
import weakref
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.framebuffers import assert_same
from tests.images import picture
from tests.processes import output
from vkbloom import AdapterInfo, BevyBloom, Pyramid, Renderer, Separable, _core
from vkbloom._renderer.new_arrays import new_arrays

#: Changes of size, dtype and channels, and sizes above 1 MiB, which are copied in another way.
IMAGES: list[tuple[int, int, int, str]] = [
    (40, 30, 3, "float32"),
    (40, 30, 3, "float32"),
    (41, 29, 4, "float16"),
    (41, 29, 4, "uint8"),
    (7, 1, 3, "uint8"),
    (600, 601, 4, "float16"),
    (40, 30, 3, "float32"),
    (600, 601, 4, "float16"),
]


def images() -> list[NDArray[Any]]:
    return [
        picture(width, height, channels, dtype, seed=seed)
        for seed, (width, height, channels, dtype) in enumerate(IMAGES)
    ]


# Handles


def test_a_handle_gives_what_its_image_does(new_renderer: Callable[[], Renderer]) -> None:
    with_arrays, with_handles = new_renderer(), new_renderer()
    for image in images()[1:7]:
        handle = with_handles.upload(image)
        assert (handle.shape, handle.dtype) == (image.shape, image.dtype)
        for settings in (Separable(threshold=0.5), Pyramid(levels=2), Separable(bloom=False)):
            expected = with_arrays.apply(image, settings)
            got = with_handles.apply(handle, settings)
            assert_same(got, expected)
            assert got.info == expected.info
            assert list(got.timings) == list(expected.timings)


def test_a_handle_is_a_snapshot_and_nothing_runs_twice(renderer: Renderer) -> None:
    image = picture(33, 21, 4, "float32", seed=3)
    expected = renderer.apply(image, Separable())
    handle = renderer.upload(image)
    image[:] = 0
    assert_same(renderer.apply(handle, Separable()), expected)
    assert renderer.apply(handle, Separable()).timings == {}
    assert list(renderer.apply(handle, Separable(exposure=1.0)).timings) == ["final"]


def test_handles_and_arrays_take_turns(renderer: Renderer) -> None:
    array = picture(33, 21, 4, "float16", seed=4)
    other = picture(33, 21, 4, "float16", seed=5)
    right = [renderer.apply(image, Separable())["final"].copy() for image in (array, other)]
    handle = renderer.upload(other)
    for image, expected in ((array, 0), (handle, 1), (array, 0), (other, 1), (handle, 1)):
        np.testing.assert_array_equal(renderer.apply(image, Separable())["final"], right[expected])


def test_a_handle_is_accepted_wherever_an_image_is(renderer: Renderer) -> None:
    pytest.importorskip("xarray")
    image = picture(33, 21, 3, "float32", seed=6)
    handle = renderer.upload(image)
    settings = [Separable(exposure=exposure) for exposure in (0.0, 1.0)]
    for got, right in zip(
        renderer.sweep(handle, settings), renderer.sweep(image, settings), strict=True
    ):
        assert_same(got, right)
    for frames in renderer.map([handle, image, handle], settings[1]):
        assert_same(frames, renderer.apply(image, settings[1]))
    assert renderer.plan(handle, settings[0]) == renderer.plan(image, settings[0])
    axes = {"exposure": [0.0, 1.0, 2.0], "intensity": [0.5, 1.0]}
    one, two = (
        vkbloom.grid(source, Separable(), axes, progress=False, renderer=renderer)
        for source in (handle, image)
    )
    assert one.equals(two)


def test_special_values_of_a_handle_are_counted(renderer: Renderer) -> None:
    image = picture(33, 21, 3, "float32", seed=7)
    image[0, 0, 0], image[1, 1, 1], image[2, 2] = np.nan, np.inf, -np.inf
    handle = renderer.upload(image)
    renderer.apply(np.zeros_like(image))
    info = renderer.apply(handle).info
    assert (info["nan"], info["inf"]) == (1, 4)


@pytest.mark.parametrize("with_mask", [True, False])
@pytest.mark.parametrize("with_emission", [True, False])
def test_a_handle_has_its_mask_and_emission(
    renderer: Renderer, with_mask: bool, with_emission: bool
) -> None:
    given: dict[str, Any] = {}
    if with_mask:
        given["mask"] = np.linspace(0, 1, 21 * 33, dtype=np.float32).reshape(21, 33)
    if with_emission:
        given["emission"] = picture(33, 21, 3, "float16", seed=11)
        given["emission"][3, 3] = np.nan
    image = picture(33, 21, 3, "float16", seed=12)
    settings = Separable(threshold=0.25)
    expected = renderer.apply(image, settings, **given)
    handle = renderer.upload(image, **given)
    other = renderer.upload(image)
    for array in (image, *given.values()):
        array[:] = 0
    got = renderer.apply(handle, settings)
    assert_same(got, expected)
    assert got.info == expected.info
    for frames in renderer.map([handle, other, handle], settings):
        assert (frames["final"] == expected["final"]).all() or frames.info["nan"] == 0
    for name, array in {"mask": np.ones((21, 33), np.float32), "emission": image}.items():
        with pytest.raises(ValueError, match=f"{name}: the image was uploaded already"):
            renderer.apply(handle, settings, **{name: array})  # type: ignore[arg-type]


@pytest.mark.parametrize("first", ["renderer", "handle"])
def test_handle_and_renderer_go_in_any_order(first: str) -> None:
    renderer = Renderer(validation=True)
    handle = renderer.upload(picture(64, 36))
    renderer.apply(handle)
    if first == "renderer":
        # Forgotten, not closed.
        gone = weakref.ref(renderer)
        del renderer
        gc.collect()
        assert gone() is None
        del handle
    else:
        del handle
        renderer.apply(picture(64, 36))
        renderer.close()
    gc.collect()


def test_a_handle_that_is_dropped_while_the_device_works(renderer: Renderer) -> None:
    image = picture(600, 601, 4, "float32", seed=8)
    expected = renderer.apply(image, Separable(loops=3))["final"].copy()
    source = renderer.upload(image)._source
    plan = renderer._core.plan(source, Separable(loops=3), ("final",))
    arrays = new_arrays(renderer._core, plan)
    submission = renderer._core.run(source, (plan,), (arrays,))
    del source
    gc.collect()
    submission.wait()
    np.testing.assert_array_equal(arrays[0], expected)


def test_an_image_in_use_is_not_taken_over(renderer: Renderer) -> None:
    core = renderer._core
    old, new = (picture(33, 21, 4, "float32", seed=seed) for seed in (9, 10))
    settings = Separable(bloom=False)
    used = core.upload(_core.image_source(old), None, True)
    plan = core.plan(used, settings, ("final",))
    arrays = new_arrays(core, plan)
    submission = core.run(used, (plan,), (arrays,))
    other = core.upload(_core.image_source(new), used, True)
    assert used.resident
    submission.wait()
    np.testing.assert_array_equal(arrays[0], old)
    # Now it is.
    third = core.upload(_core.image_source(old), used, True)
    assert not used.resident
    for source, image in ((other, new), (third, old)):
        (arrays_,) = ((np.empty_like(image),),)
        core.run(source, (core.plan(source, settings, ("final",)),), (arrays_,)).wait()
        np.testing.assert_array_equal(arrays_[0], image)
    with pytest.raises(ValueError, match="another upload has taken its memory"):
        core.plan(used, settings, None)


MEMORY = """
import os
import numpy as np
from vkbloom import Renderer, Separable

def megabytes():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") >> 20

with Renderer() as renderer:
    image = np.full((2048, 2048, 4), 0.5, np.float32)
    settings = Separable(bloom=False)
    renderer.apply(renderer.upload(image), settings, framebuffers=())
    before = megabytes()
    handle = renderer.upload(image)
    renderer.apply(handle, settings, framebuffers=())
    during = megabytes()
    del handle
    print(during - before, megabytes() - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_the_memory_of_a_handle_goes_with_it(software: AdapterInfo) -> None:
    # Only a software adapter has its images in the memory of the process. A process of its own:
    # what earlier tests of a process have left may go at any time.
    during, after = output("-c", MEMORY, VKBLOOM_ADAPTER=software.name).split()
    assert int(during) >= 60
    assert int(after) < 30


# One image after the other


# As the default, of levels that do not take most of the time.
LOW = BevyBloom(max_mip_dimension=16)


def test_images_one_by_one_and_in_a_row(new_renderer: Callable[[], Renderer]) -> None:
    alone, together = new_renderer(), new_renderer()
    settings = [Separable(threshold=0.5), Pyramid(levels=2)] * (len(IMAGES) // 2)
    results = list(together.map(images(), settings))
    assert len(results) == len(IMAGES)
    for got, image, one in zip(results, images(), settings, strict=True):
        right = alone.apply(image, one)
        assert_same(got, right)
        assert got.settings == one
        assert got.info == right.info
    for got, image in zip(together.map(iter(images()[:4]), LOW), images(), strict=False):
        assert_same(got, alone.apply(image, LOW))


def test_one_array_filled_again_and_again(renderer: Renderer) -> None:
    """Each image is copied before the next one is taken, and at most two are taken ahead."""
    array = np.zeros((21, 33, 4), np.float32)
    asked = given = 0

    def fill() -> Iterator[NDArray[Any]]:
        nonlocal asked
        for level in range(1, 9):
            asked += 1
            array[:] = level
            yield array
            array[:] = -1

    settings = Separable(bloom=False)
    for level, frames in enumerate(renderer.map(fill(), settings), 1):
        given += 1
        assert asked <= given + 2
        assert (frames["final"] == level).all()
    assert given == asked == 8


def test_a_generator_gets_its_array_back(renderer: Renderer) -> None:
    """A buffer that is exported could not change its size."""
    buffer = bytearray(4 * 4 * 3)

    def resize() -> Iterator[NDArray[Any]]:
        for _ in range(4):
            yield np.frombuffer(buffer, np.uint8).reshape(4, 4, 3)
            gc.collect()
            buffer.extend(b"\0")
            del buffer[-1]

    assert len(list(renderer.map(resize(), LOW))) == 4


def wrong(kind: str) -> Iterator[Any]:
    yield picture(16, 16, seed=1)
    yield picture(16, 16, seed=2)
    if kind == "raises":
        raise KeyError("mine")
    yield np.zeros((16, 16), np.float32) if kind == "shape" else "text"
    raise AssertionError("asked for more than the failing one")


@pytest.mark.parametrize(
    ("kind", "error", "text"),
    [
        ("raises", KeyError, "mine"),
        ("shape", ValueError, "shape"),
        ("text", TypeError, "an array is needed"),
    ],
)
def test_an_error_comes_at_its_images_turn(
    renderer: Renderer, kind: str, error: type[Exception], text: str
) -> None:
    results = renderer.map(wrong(kind))
    for seed in (1, 2):
        assert_same(next(results), renderer.apply(picture(16, 16, seed=seed)))
    with pytest.raises(error, match=text):
        next(results)
    with pytest.raises(StopIteration):
        next(results)


# Images of several megabytes, whose rows several threads compare and pack


@pytest.mark.parametrize("channels", [4, 3])
def test_a_change_in_any_row_of_a_large_image_is_uploaded(
    new_renderer: Callable[[], Renderer], channels: int
) -> None:
    renderer = new_renderer()
    image = np.full((1031, 1024, channels), 0.25, np.float16)
    settings = Separable(bloom=False)

    def final() -> NDArray[Any]:
        frames = renderer.apply(image, settings, framebuffers=("final",))
        assert frames.info["nan"] == np.isnan(image).sum()
        assert frames.info["inf"] == np.isinf(image).sum()
        return frames["final"]

    final()
    for row, value in [(0, 0.5), (1, np.inf), (515, np.nan), (516, 0.5), (1030, np.nan)]:
        image[row, 7, 1] = value
        image[row, 8, 2] = 0.75
        got = final()
        finite = np.isfinite(image)
        np.testing.assert_array_equal(got[finite], image[finite])
        assert renderer.apply(image, settings, framebuffers=("final",)).timings == {}
