"""Many settings for one source: the frames equal those of single calls, in order, also after
errors."""

from __future__ import annotations

import gc
import itertools
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.framebuffers import assert_same
from tests.images import picture
from tests.planned import new_arrays
from vkbloom import BevyBloom, DualKawase, Pyramid, Renderer, Scene, Separable, Settings, _core
from vkbloom._renderer import requests

SIZE = (64, 36)
# As the default, of levels that do not take most of the time.
LOW = BevyBloom(max_mip_dimension=16)


#: Changes of one pass, of all, of the images' number, sizes and formats; more than one batch.
SEQUENCE: list[Settings] = [
    *(Separable(exposure=exposure / 8, tonemap="aces") for exposure in range(12)),
    *(Separable(blur_strength=strength / 4) for strength in range(12)),
    *(Separable(threshold=threshold / 8) for threshold in range(6)),
    *(Separable(bloom_size=(10 + size, 20 - size)) for size in range(6)),
    Separable(loops=3),
    Separable(direct=True),
    Separable(direct=True, exposure=1.0),
    *(Pyramid(levels=levels) for levels in (1, 2, 3, 3)),
    *(DualKawase(offset=offset) for offset in (0.5, 1.0, 1.5)),
    Separable(bloom=False),
    *(Separable(format=format) for format in ("rgba8unorm", "rgba16float", "rgba32float")),
    Separable(),
]


# The same frames


@pytest.mark.parametrize("framebuffers", ["all", "final"], ids=str)
def test_images_one_by_one_and_many(
    new_renderer: Callable[[], Renderer], framebuffers: str | Sequence[str]
) -> None:
    image = picture(40, 30, 3, seed=1)
    alone, together = new_renderer(), new_renderer()
    sequence = [settings for settings in SEQUENCE if settings.bloom or "bloom" not in framebuffers]
    expected = [alone.apply(image, s, framebuffers=framebuffers) for s in sequence]
    frames = list(together.sweep(image, sequence, framebuffers=framebuffers))
    assert len(frames) == len(sequence)
    for got, right in zip(frames, expected, strict=True):
        assert_same(got, right)
        # Each request runs the passes that are out of date at its turn, and has its own times.
        assert list(got.timings) == list(right.timings)
        assert all(seconds >= 0.0 for seconds in got.timings.values())
        assert got.info == right.info
    # The device has the images of the last single call.
    assert_same(together.apply(image, SEQUENCE[-1]), alone.apply(image, SEQUENCE[-1]))


@pytest.mark.parametrize("shading", ["forward", "deferred"])
def test_scenes_one_by_one_and_many(
    new_renderer: Callable[[], Renderer], scene: Scene, shading: Any
) -> None:
    alone, together = new_renderer(), new_renderer()
    sequence = [settings for settings in SEQUENCE if isinstance(settings, Separable)]
    expected = [alone.render(scene, s, SIZE, shading=shading, time=0.2) for s in sequence]
    frames = list(together.sweep(scene, sequence, size=SIZE, shading=shading, time=0.2))
    for got, right in zip(frames, expected, strict=True):
        assert_same(got, right)
        assert list(got.timings) == list(right.timings)


class CountingCore:
    """A renderer's core that records the number of plans in each submission.

    `failing`: the exceptions of submissions, `at5` that of the sixth.
    """

    def __init__(self, core: _core.Renderer, **failing: Exception) -> None:
        self.core = core
        self.failing = failing
        self.counts: list[int] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self.core, name)

    def run(self, source: Any, plans: Any, arrays: Any) -> _core.Submission:
        if error := self.failing.get(f"at{len(self.counts)}"):
            raise error
        self.counts.append(len(plans))
        return self.core.run(source, plans, arrays)


@pytest.mark.parametrize(
    ("frames", "seconds", "most"),
    [(1, 1e6, 1), (2, 1e6, 2), (5, 1e6, 5), (100, 1e-9, 1), (100, 1e6, requests.MAX_REQUESTS)],
)
def test_a_submission_has_a_limit_of_bytes_and_of_time(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, frames: int, seconds: float, most: int
) -> None:
    image = picture(33, 21, 4, seed=2)
    monkeypatch.setattr(requests, "MAX_BYTES", frames * image.nbytes)
    monkeypatch.setattr(requests, "MAX_SECONDS", seconds)
    counting: Any = CountingCore(renderer._core)
    settings = [Separable(exposure=step / 8) for step in range(100)]
    source = _core.image_source(image)
    work = [requests.Request(source, one) for one in settings]
    results = list(requests.run(work, counting, ("final",)))
    assert [one for one, *_ in results] == settings
    assert max(counting.counts) == most
    assert sum(counting.counts) == len(settings)
    for one, arrays, *_ in results[::20]:
        np.testing.assert_array_equal(arrays["final"], renderer.apply(image, one)["final"])


def test_arrays_are_the_takers(renderer: Renderer) -> None:
    image = picture(20, 10, 4, seed=3)
    frames = list(renderer.sweep(image, [Separable()] * 10))
    kept = frames[0]["final"].copy()
    for one in frames:
        for array in one.values():
            assert array.flags.writeable
    for one in frames[1:]:
        one["final"][:] = 0
    np.testing.assert_array_equal(frames[0]["final"], kept)


def test_specials_are_counted_in_every_frame(renderer: Renderer) -> None:
    image = picture(20, 10, 4, seed=4)
    image[3, 4] = (np.nan, np.inf, 0.0, -np.inf)
    frames = list(renderer.sweep(image, [Separable(), Pyramid(), Separable()]))
    assert [(one.info["nan"], one.info["inf"]) for one in frames] == [(1, 2)] * 3


def test_no_settings(renderer: Renderer, scene: Scene) -> None:
    assert list(renderer.sweep(picture(4, 4, 3, seed=5), [])) == []
    assert list(renderer.sweep(scene, [], size=SIZE)) == []


# ImportedArray ahead, and no further


@pytest.mark.parametrize("slow", [0, 1, 2, 5])
def test_settings_are_taken_a_bounded_way_ahead(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, slow: int
) -> None:
    taken = collected = 0
    took = requests._Requests.took

    def took_long(waiting: Any, seconds: float, count: int) -> None:
        # The times of the first batches determine the size of the next ones.
        nonlocal collected
        collected += 1
        took(waiting, 1e6 if collected <= slow else seconds, count)

    monkeypatch.setattr(requests._Requests, "took", took_long)

    def endless() -> Iterator[Settings]:
        nonlocal taken
        while True:
            taken += 1
            yield Separable(exposure=taken % 7 / 7)

    frames = renderer.sweep(picture(8, 8, 4, seed=6), endless(), framebuffers=("final",))
    assert taken == 0
    next(frames)
    assert taken == 1
    limit = (requests.AHEAD + 1) * requests.MAX_REQUESTS
    for given in range(2, 300):
        next(frames)
        assert given <= taken <= given + limit
        # Batches grow with the number of frames taken, so that few frames are wasted.
        assert taken < 4 * given
    frames.close()  # type: ignore[attr-defined]


# Other calls between two frames


def test_other_calls_between_two_frames(renderer: Renderer, scene: Scene) -> None:
    image, other = picture(40, 30, 3, seed=7), picture(25, 50, 4, seed=8)
    settings = [Separable(blur_strength=strength / 8) for strength in range(24)]
    expected = [renderer.apply(image, s) for s in settings]
    of_other, of_scene = renderer.apply(other, LOW), renderer.render(scene, None, SIZE)
    last = renderer.apply(1.0 - image, LOW)
    calls: list[Callable[[], None]] = [
        lambda: assert_same(renderer.apply(other, LOW), of_other),
        lambda: assert_same(renderer.render(scene, None, SIZE), of_scene),
        # The same size, so that images on the device and in staging memory are overwritten.
        lambda: assert_same(renderer.apply(1.0 - image, LOW), last),
        lambda: None,
    ]
    for index, frames in enumerate(renderer.sweep(image, settings)):
        assert_same(frames, expected[index])
        calls[index % len(calls)]()


def test_a_sequence_that_goes_from_thread_to_thread(renderer: Renderer) -> None:
    image = picture(30, 20, 3, seed=13)
    settings = [Separable(blur_strength=strength / 8) for strength in range(12)]
    expected = [renderer.apply(image, s) for s in settings]
    frames = renderer.sweep(image, settings)
    for right in expected:
        with ThreadPoolExecutor(1) as pool:
            assert_same(pool.submit(next, frames).result(), right)


# PendingSubmissions before the end


@pytest.mark.parametrize(
    ("taken", "end"), [(0, "close"), (1, "forget"), (2, "close"), (5, "forget")]
)
def test_unread_frames_of_a_sequence_are_dropped(renderer: Renderer, taken: int, end: str) -> None:
    image = picture(40, 30, 3, seed=14)
    right = renderer.apply(image, LOW)
    for _ in range(2):
        frames = renderer.sweep(image, SEQUENCE)
        for _ in range(taken):
            next(frames)
        if end == "close":
            frames.close()  # type: ignore[attr-defined]
        del frames
        gc.collect()
        assert_same(renderer.apply(image, LOW), right)


def test_a_renderer_that_is_closed_in_the_middle(new_renderer: Callable[[], Renderer]) -> None:
    image = picture(40, 30, 3, seed=16)
    renderer = new_renderer()
    expected = [renderer.apply(image, settings) for settings in SEQUENCE]
    frames = renderer.sweep(image, SEQUENCE)
    got = [next(frames) for _ in range(4)]
    # With validation: pending submissions are waited for, and all objects are destroyed.
    renderer.close()
    with pytest.raises(ValueError, match="closed"):
        got.extend(frames)
    assert len(got) < len(SEQUENCE)
    for one, right in zip(got, expected, strict=False):
        assert_same(one, right)
    with pytest.raises(StopIteration):
        next(frames)


# Errors


def wrong_ones() -> list[tuple[Any, type[Exception], str]]:
    return [
        (Separable, TypeError, "settings"),
        (Separable(bloom_size=(100_000, 1)), ValueError, "100000 x 1"),
        (Separable(bloom=False), ValueError, "framebuffers: unknown framebuffer 'bloom'"),
    ]


@pytest.mark.parametrize(("wrong", "kind", "words"), wrong_ones(), ids=["type", "size", "name"])
@pytest.mark.parametrize("place", [0, 1, 2, 4, 6, 13])
def test_an_error_comes_in_its_turn(
    renderer: Renderer, place: int, wrong: Any, kind: type[Exception], words: str
) -> None:
    image = picture(20, 30, 4, seed=17)
    right = [Separable(blur_strength=strength / 8) for strength in range(20)]
    sequence = [*right[:place], wrong, *right[place:]]
    frames = renderer.sweep(image, sequence, framebuffers=("bloom", "final"))
    for settings in right[:place]:
        assert_same(next(frames), renderer.apply(image, settings, framebuffers=("bloom", "final")))
    with pytest.raises(kind, match=words):
        next(frames)
    with pytest.raises(StopIteration):
        next(frames)


# The core's errors


@pytest.mark.parametrize(
    "kind", [_core.OutOfMemoryError, _core.ValidationError, _core.DeviceLostError, ValueError]
)
def test_an_error_of_the_device_loses_the_frames_of_its_submission(
    renderer: Renderer, kind: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Batches double up to the largest size, however slow the machine is.
    monkeypatch.setattr(requests, "MAX_SECONDS", 1e6)
    settings = [Separable(exposure=exposure / 100) for exposure in range(100)]
    failing: Any = CountingCore(renderer._core, at5=kind("all"))
    source = _core.image_source(picture(8, 8))
    results = requests.run([requests.Request(source, one) for one in settings], failing, ())
    # Only the frames of its submission, which begins after 1 + 2 + 4 + 8 + 16, are lost.
    assert [one for one, *_ in itertools.islice(results, 31)] == settings[:31]
    with pytest.raises(kind, match="all"):
        next(results)


# The core's own types


def test_a_plan_runs_as_often_as_it_is_wanted(renderer: Renderer) -> None:
    image = picture(8, 8, 4, seed=22)
    source, core = _core.image_source(image), renderer._core
    plan = core.plan(source, Separable(), ("final",))
    first, second = new_arrays(core, plan), new_arrays(core, plan)
    (ran, again), _ = core.run(source, (plan, plan), (first, second)).wait()
    assert "final" in ran
    assert again == {}
    for (array,) in (first, second):
        np.testing.assert_array_equal(array, renderer.apply(image, Separable())["final"])


def test_a_submission_of_a_closed_renderer() -> None:
    renderer = vkbloom.Renderer(validation=True)
    core, source = renderer._core, _core.image_source(picture(8, 8, 4, seed=21))
    plan = core.plan(source, Separable(), None)
    arrays = new_arrays(core, plan)
    submission = core.run(source, (plan,), (arrays,))
    renderer.close()
    with pytest.raises(ValueError, match="closed"):
        submission.wait()
    with pytest.raises(ValueError, match="closed"):
        core.run(source, (plan,), (arrays,))
    with pytest.raises(ValueError, match="closed"):
        core.plan(source, Separable(), None)
