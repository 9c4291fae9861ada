"""Caches are bounded, and objects that are used again stay in them."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.exhaustive import EXHAUSTIVE
from tests.images import picture
from tests.kinds import fields_of
from vkbloom import Pyramid, Renderer, Separable, Settings, _core

#: The core's bounds (csrc/execute/age.h, pipeline.h, image_cache.h).
MIN_AGE = 64
PIPELINES = 256
IMAGE_BYTES = 256 << 20


def finals(
    renderer: Renderer, image: NDArray[np.float32], settings: Sequence[Settings]
) -> list[NDArray[np.float32]]:
    return [frames["final"] for frames in renderer.sweep(image, settings)]


HALF = 500 if EXHAUSTIVE else 100


def test_a_thousand_sizes_take_no_more_memory_than_a_few(
    new_renderer: Callable[[], Renderer],
) -> None:
    renderer = new_renderer()
    image = picture(70, 70)
    cached, created = [], []
    for side in range(2 * HALF):
        # Both halves have all heights and all widths, and so all variants.
        height, width = 20 + side % 50, 20 + (7 * side + side // 50) % 50
        renderer.apply(image[:height, :width], Pyramid(levels=1 + side % 16), framebuffers="final")
        cached.append(renderer._core.cached)
        created.append(renderer._core.pipeline_count)
    # Both halves have all sixteen numbers of levels.
    early, late = (np.max(half, axis=0) for half in (cached[:HALF], cached[HALF:]))
    pipelines, image_bytes, _ = late
    assert pipelines <= early[0]
    # 3 images of the size and the levels, all of them smaller, and as much spare memory. GPUs round
    # up the memory of small levels: 4 KiB on an H200.
    assert image_bytes <= 2 * (6 * 70 * 70 * 16 + 2 * 16 * 4096)
    assert created[-1] == created[HALF - 1]


def test_sizes_in_turn_share_memory(new_renderer: Callable[[], Renderer]) -> None:
    """An allocation takes longer than all passes, so a size that comes again needs none."""
    renderer = new_renderer()
    images = [picture(40 * step, 60 * step) for step in (3, 4, 5, 6, 7)]
    settings = Pyramid(levels=3), Separable(threshold=0.5, bloom_size=(50, 70))
    expected: list[NDArray[np.float32]] = []
    counts = []
    for _ in range(4):
        made = [finals(renderer, image, settings) for image in images]
        counts.append(renderer._core.cached[2])
        finals_of_all = list(itertools.chain.from_iterable(made))
        expected = expected or finals_of_all
        for got, right in zip(finals_of_all, expected, strict=True):
            np.testing.assert_array_equal(got, right)
    # The second turn begins with the smallest size after the largest.
    assert counts[1] == counts[3]


def test_unused_images_are_freed(new_renderer: Callable[[], Renderer]) -> None:
    renderer = new_renderer()
    image = picture(16, 24)
    # Twenty images of 16 MiB.
    large = Separable(loops=10, bloom_size=(1024, 1024), format="rgba32float")
    expected = renderer.apply(image, large)["final"].copy()
    assert renderer._core.cached[1] > IMAGE_BYTES
    for step in range(MIN_AGE - 1):
        renderer.apply(image, Pyramid(exposure=step / 100), framebuffers="final")
    assert renderer._core.cached[1] > IMAGE_BYTES
    for step in range(2):
        renderer.apply(image, Pyramid(exposure=step / 100), framebuffers="final")
    assert renderer._core.cached[1] <= IMAGE_BYTES // 2
    np.testing.assert_array_equal(renderer.apply(image, large)["final"], expected)


@pytest.mark.slow
def test_unused_pipelines_are_freed(monkeypatch: pytest.MonkeyPatch) -> None:
    # In this variant each setting of the final pass has one pipeline, which drivers compile
    # quickly. (Validation would see each shader 300 times; the next test has it.)
    monkeypatch.setenv("VKBLOOM_VARIANT", "fragment")
    composites = fields_of(Separable)["composite"].choices
    names = (composites, *(_core.CHOICES[name] for name in ("tonemap", "encoding")))
    chosen = [
        Separable(composite=composite, tonemap=tonemap, encoding=encoding)
        for composite, tonemap, encoding in itertools.product(*names)
    ]
    chosen += [dataclasses.replace(one, bloom=False) for one in chosen if one.composite == "add"]
    dithered = [dataclasses.replace(one, dither=True) for one in chosen]
    single, half, byte = (picture(5, 4).astype(dtype) for dtype in ("float32", "float16", "uint8"))
    requests = [
        *itertools.product((single, half), chosen),
        *itertools.product((byte,), dithered[:40]),
    ]
    with Renderer() as renderer:
        expected = finals(renderer, single, chosen[:4])
        counts = []
        for image, settings in requests:
            renderer.apply(image, settings, framebuffers="final")
            counts.append(renderer._core.cached[0])
        assert renderer._core.pipeline_count > PIPELINES + 8
        assert max(counts) <= PIPELINES + 8
        for got, right in zip(finals(renderer, single, chosen[:4]), expected, strict=True):
            np.testing.assert_array_equal(got, right)


def test_pipelines_do_not_go_under_submissions_that_wait(
    new_renderer: Callable[[], Renderer],
) -> None:
    """Frames are taken late, while many others are made, under the validation layer."""
    renderer = new_renderer()
    image = picture(8, 8)
    waiting = renderer.sweep(image, [Separable(exposure=step / 8) for step in range(40)])
    next(waiting)
    for step in range(MIN_AGE + 20):
        renderer.apply(picture(9 + step % 5, 9), Pyramid(exposure=step / 100))
    assert len(list(waiting)) == 39
