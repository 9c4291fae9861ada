"""Framebuffers of the call before: states of calls, sequences, and what does not change them."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.custom import TRAIL
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, Separable, _core

Array = NDArray[Any]

pytestmark = pytest.mark.usefixtures("glslang")


def method(**fields: Any) -> vkbloom.Settings:
    return vkbloom.load_method(TRAIL, name="trail")(**fields)


def other(**fields: Any) -> vkbloom.Settings:
    """Return settings of another method, whose framebuffer has another name."""
    return vkbloom.load_method(TRAIL.replace("TRAIL", "TAIL"), name="tail")(**fields)


def image(seed: int, width: int = 12, height: int = 8, dtype: str = "float32") -> Array:
    """Return an image of multiples of 1/256: all shares of it are exact."""
    levels = np.random.default_rng(seed).integers(0, 256, (height, width, 4))
    pixels = levels if dtype == "uint8" else levels / 256
    return pixels.astype(dtype)


def follow(images: Sequence[Array], keep: float = 0.5, before: Array | None = None) -> list[Array]:
    """Return the trail after each image; its alpha counts the frames."""
    trail = np.zeros_like(images[0]) if before is None else before
    trails = []
    for one in images:
        trail = np.dstack(
            [(1 - keep) * one[..., :3] + keep * trail[..., :3], trail[..., 3] + 1]
        ).astype(one.dtype)
        trails.append(trail)
    return trails


def same(one: Any, other: Any) -> None:
    np.testing.assert_array_equal(np.asarray(one), np.asarray(other))


def test_calls_continue_a_state(renderer: Renderer) -> None:
    images = [image(seed) for seed in range(4)]
    expected = follow(images)
    state: Mapping[str, Array] = {}
    for one, trail in zip(images, expected, strict=True):
        frames = renderer.apply(one, method(), state=state)
        for name in ("trail", "bloom"):
            same(frames[name], trail)
        state = frames.state
        assert list(state) == ["trail"]
        same(state["trail"], trail)
    # Without a state each call begins anew, with the same image, too.
    for _ in range(2):
        same(renderer.apply(images[3], method())["trail"], follow(images[3:])[0])


def test_a_state_is_a_value(renderer: Renderer, new_renderer: Callable[[], Renderer]) -> None:
    first, second = image(1), image(2)
    state = renderer.apply(first, method()).state
    copied = pickle.loads(pickle.dumps(state))
    expected = follow([first, second])[1]
    given: list[Any] = [state, state, copied, dict(state), {"trail": np.asarray(state["trail"])}]
    given += [{"trail": state["trail"].astype(np.float64)}]
    after = [renderer.apply(second, method(), state=one) for one in given]
    after += [new_renderer().apply(second, method(), state=one) for one in (copied, state)]
    for frames in after:
        same(frames["trail"], expected)
        assert frames.state == after[0].state != state
    assert state == copied
    same(state["trail"], follow([first])[0])
    with pytest.raises(ValueError, match="read-only"):
        state["trail"][:] = 0
    with pytest.raises(TypeError, match="unhashable"):
        hash(state)
    # Its arrays may have any content. A framebuffer that this method does not read is handed on.
    far = np.full((8, 12, 4), [2.0, -4.0, 1e4, 7.0], np.float32)
    frames = renderer.apply(first, method(), state={"trail": far, "more": far})
    same(frames["trail"], follow([first], before=far)[0])
    same(frames.state["more"], far)
    assert not renderer.apply(first, Separable()).state


@pytest.mark.parametrize("dtype", ["uint8", "float16", "float32"])
def test_each_format_keeps_its_bits(renderer: Renderer, dtype: str) -> None:
    """Those of a sequence in one renderer, and of one that is cut after each frame."""
    images = [image(seed, dtype=dtype) for seed in range(5)]
    whole = list(renderer.map(images, method(keep=0.75)))
    state: Mapping[str, Array] = {}
    for one, frames in zip(images, whole, strict=True):
        state = dict(renderer.apply(one, method(keep=0.75), state=state).state)
        same(state["trail"], frames["trail"])
        assert state["trail"].dtype == dtype
    assert whole[3].state != whole[4].state == frames.state


def test_a_sequence_of_several_settings_and_sizes(renderer: Renderer) -> None:
    """Each method continues what it made last; an image of another size begins anew."""
    images = [image(seed, 12 if seed < 6 else 9) for seed in range(8)]
    settings = [method(), Separable(), other(keep=0.25), method(), other(keep=0.25), method()]
    settings += [other(), method()]
    frames = list(renderer.map(images, settings))
    of_trail = follow([images[0], images[3], images[5]]) + follow(images[7:])
    of_tail = follow([images[2], images[4]], 0.25) + follow(images[6:7])
    for place, trail in zip((0, 3, 5, 7), of_trail, strict=True):
        same(frames[place]["trail"], trail)
    for place, trail in zip((2, 4, 6), of_tail, strict=True):
        same(frames[place]["tail"], trail)
    assert list(frames[1].state) == ["trail"]
    assert list(frames[7].state) == ["trail", "tail"]
    # A call in between, of the same framebuffers, changes nothing.
    sequence = renderer.map(images[:3], method())
    expected = follow(images[:3])
    for trail in expected:
        same(next(sequence)["trail"], trail)
        renderer.apply(images[5], method(), state=frames[0].state)
    same(next(renderer.map(images[1:], method(), state=frames[0].state))["trail"], expected[1])


def test_what_is_requested_changes_no_state(renderer: Renderer) -> None:
    one = image(3)
    state = renderer.apply(one, method()).state
    for names in ("glow", "final", "trail"):
        frames = renderer.apply(one, method(), state=state, framebuffers=names)
        assert list(frames) == [names]
        same(frames.state["trail"], follow([one, one])[1])


def test_requests_of_a_sweep_are_independent(renderer: Renderer) -> None:
    """Each begins anew, whatever ran before; a dry run counts the same passes."""
    one = image(4)
    settings = [method(exposure=exposure) for exposure in (0, 1, 0)] + [method(keep=0.25)]
    ran = []
    for frames, chosen in zip(renderer.sweep(one, settings), settings, strict=True):
        keep: Any = chosen
        same(frames["trail"], follow([one], keep.keep)[0])
        ran.append(set(frames.timings))
        assert not frames.state
    assert ran[1:3] == [{"final"}, {"final"}]
    source = _core.image_source(one)
    steps = tuple((source, renderer._core.plan(source, chosen, None)) for chosen in settings)
    assert [{name for name, *_ in passes} for passes in _core.dry_run(steps)] == ran


def test_a_plan_names_what_it_reads(renderer: Renderer) -> None:
    plan = renderer._core.plan(_core.image_source(image(1)), method(), ("final",))
    assert plan.histories == (("trail", (8, 12, 4), "float32"),)
    reads = {one.name: one.reads for one in renderer.plan(image(1), method()).passes}
    assert reads["trail"] == ("stays", "glow", "history_0")


def test_a_call_that_fails_leaves_its_state(renderer: Renderer) -> None:
    one = image(5)
    state = renderer.apply(one, method()).state
    wrong: list[dict[str, Any]] = [
        {"out": {"final": np.zeros((1, 1, 4), np.float32)}},
        {"framebuffers": "nothing"},
        {"mask": np.full((8, 12), 2.0)},
    ]
    for given in wrong:
        with pytest.raises(ValueError, match=next(iter(given))):
            renderer.apply(one, method(), state=state, **given)
    frames = renderer.map([one, one, "no image"], method(), state=state)  # type: ignore[list-item]
    after = [next(frames).state, next(frames).state]
    with pytest.raises((TypeError, ValueError)):
        next(frames)
    for trail, found in zip(follow([one] * 3), [state, *after], strict=True):
        same(found["trail"], trail)


def test_threads_continue_one_state(renderer: Renderer) -> None:
    images = [image(seed) for seed in range(8)]
    state = renderer.apply(image(9), method()).state
    found: dict[int, Any] = {}

    def work(place: int) -> None:
        found[place] = renderer.apply(images[place], method(), state=state)

    threads = [threading.Thread(target=work, args=(place,)) for place in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for place, one in enumerate(images):
        same(found[place]["trail"], follow([image(9), one])[1])


def test_states_outlive_what_made_them() -> None:
    renderer = Renderer()
    frames = renderer.apply(image(1), method())
    read, unread = frames.state, renderer.apply(image(1), method()).state
    same(read["trail"], frames["trail"])
    renderer.close()
    same(read["trail"], frames["trail"])
    same(unread["trail"], frames["trail"])
    with Renderer() as other:
        same(
            other.apply(image(2), method(), state=unread)["trail"], follow([image(1), image(2)])[1]
        )


@pytest.mark.parametrize(("shading", "glow"), [("forward", "glow"), ("deferred", "brightness")])
def test_scenes_continue(renderer: Renderer, scene: vkbloom.Scene, shading: Any, glow: str) -> None:
    """With a method that reads two framebuffers of the call before."""
    first, passes = TRAIL.split("//!HOOK", 1)
    again = passes.replace("TRAIL", "TAIL").replace("STAYS", "OVER").replace("BLOOM", "COPY")
    settings = vkbloom.load_method(f"{first}//!HOOK{passes}\n//!HOOK{again}", name="two")
    size = (32, 18)
    before: Any = None
    for _ in range(3):
        state = before.state if before else None
        frames = renderer.render(
            scene, settings(bloom_size=size), size, shading=shading, state=state
        )
        off = 1 if frames["trail"].dtype == np.uint8 else 1e-3
        trail = before["trail"] if before else np.zeros_like(frames["trail"])
        expected = frames[glow][..., :3] / 2.0 + trail[..., :3] / 2.0
        np.testing.assert_allclose(frames["trail"][..., :3], expected, atol=off, rtol=1e-3)
        same(frames["tail"], frames["trail"])
        assert list(frames.state) == ["trail", "tail"]
        before = frames


@pytest.mark.parametrize(("call", "error"), rows(__file__, "states of calls"))
def test_a_wrong_state_is_refused(renderer: Renderer, call: str, error: str) -> None:
    core, source = renderer._core, _core.image_source(image(1))
    plan = core.plan(source, method(), ("final",))
    kept = core.upload(_core.image_source(image(1)), None, False)
    names = {
        "apply": lambda settings=None, **given: renderer.apply(
            image(1), settings or method(), **given
        ),
        "run": lambda *histories, plans=(plan,): core.run(
            source,
            plans,
            ((np.empty((8, 12, 4), np.float32),),) * len(plans),
            False,
            None,
            *histories,
        ),
        "f4": lambda *shape: np.zeros(shape, np.float32),
        "uploaded": lambda *shape: core.upload(
            _core.image_source(np.zeros(shape, np.float32)), None, False
        ),
        **globals(),
        "plan": plan,
        "kept": kept,
        "source": source,
        "renderer": renderer,
    }
    assert_refused(call, error, names)
