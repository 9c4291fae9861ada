"""Threads that make all calls of the core at once: ``python -m tests.core.all_calls [CALLS]``.

Half of them use one renderer, the others many. Each result must equal what one thread gave before,
bit by bit. Arrays on the device are those of the stand-in for CUDA, and one of the methods is an
own one. Prints how many calls were made, and whether the GIL is off. VKBLOOM_VALIDATED=1: the
renderers are validated.
"""

from __future__ import annotations

import gc
import os
import random
import sys
import tempfile
import threading
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

import vkbloom
from tests.device import stand_in
from tests.device.device_work import OnDevice
from tests.images import picture
from tests.planned import MESH, scene_source
from vkbloom import DualKawase, Pyramid, Renderer, Scene, Separable, Settings, _core
from vkbloom._renderer.device_arrays import place
from vkbloom._renderer.new_arrays import new_arrays

THREADS: Final = 16
#: Renderers of the threads that share none with all others.
MANY: Final = 4
# The arrays of the last one are in the renderer's pages.
SIZES = ((24, 16), (17, 31), (300, 290))
CUSTOM: Final = """\
//!PARAM gain
//!TYPE float
0.5

//!HOOK MAIN
//!BIND GLOW
//!BIND NOISE
//!SAVE BLOOM
//!WIDTH MAIN.w 2 /
//!HEIGHT MAIN.h 2 /
vec4 hook() { return gain * GLOW_tex(GLOW_pos) * NOISE_tex(GLOW_pos); }

//!TEXTURE NOISE
//!SIZE 2 2
//!FORMAT r8
//!FILTER LINEAR
00ff80ff
"""
SETTINGS: tuple[Settings, ...] = (
    Separable(),
    Pyramid(levels=3, exposure=0.5, format="rgba32float"),
    DualKawase(levels=2),
    vkbloom.load_method(CUSTOM, name="custom")(),
)
IMAGES = [picture(*size) for size in SIZES]
UFO = Scene.ufo()
# Of arrays on the device: the oldest is freed by whichever thread adds one.
CAPSULES: deque[Any] = deque(maxlen=8)


def host(frames: Any) -> list[NDArray[Any]]:
    return [np.asarray(array) for array in frames.values()]


def run(core: _core.Renderer, source: _core.Source, plan: _core.Plan) -> list[Any]:
    arrays = new_arrays(core, plan)
    core.run(source, (plan,), (arrays,)).wait()
    return list(arrays)


def apply(renderer: Renderer, which: int, size: int) -> Any:
    return host(renderer.apply(IMAGES[size], SETTINGS[which]))


def render(renderer: Renderer, which: int, size: int) -> Any:
    return host(renderer.render(UFO, SETTINGS[which], SIZES[size]))


def leave(renderer: Renderer, which: int, size: int) -> Any:
    """Leave a sequence half way: some of its submissions are still pending."""
    frames = next(iter(renderer.sweep(IMAGES[size], [SETTINGS[which]] * 5)))
    return [frames["final"]]


def upload(renderer: Renderer, which: int, size: int) -> Any:
    image = renderer.upload(IMAGES[size])
    return host(renderer.apply(image, SETTINGS[which], framebuffers="final"))


def recycle(renderer: Renderer, which: int, size: int) -> Any:
    """Take the memory of another source."""
    core = renderer._core
    image = IMAGES[size]
    spare = core.upload(_core.image_source(image), None, True)
    source = core.upload(_core.image_source(image), spare, True)
    assert spare.kind == source.kind
    assert source.resident
    assert not spare.resident
    return run(core, source, core.plan(source, SETTINGS[which], ("final",)))


def on_device(renderer: Renderer, which: int, size: int) -> Any:
    """Hand arrays of CUDA on: to the renderer, to other consumers, and back."""
    core = renderer._core
    image: Any = OnDevice(IMAGES[size])
    frames: Any = renderer.apply(image, SETTINGS[which])
    final = frames["final"]
    CAPSULES.append(final.__dlpack__(stream=1))
    copied = _core.read_dlpack(final.__dlpack__(stream=1, copy=True))
    assert copied[0] != final.__cuda_array_interface__["data"][0]
    out = OnDevice(np.zeros(final.shape, final.dtype))
    handle = renderer.upload(image)
    renderer.apply(handle, SETTINGS[which], out={"final": out})
    again: Any = renderer.apply(final, SETTINGS[which], framebuffers="final")["final"]
    written = place(IMAGES[size], "cuda", core)
    found = [one.numpy() for one in (*frames.values(), again, written)]
    return [*found, out.array, core.cuda(), core.cuda_name(0)]


def load(renderer: Renderer, which: int, size: int) -> Any:
    """Load a method while other threads load one of the same name."""
    text = CUSTOM.replace("0.5", f"0.{which + 1}")
    settings = vkbloom.load_method(text, name=f"own_{which}")()
    return host(renderer.apply(IMAGES[size], settings))


def wait_twice(renderer: Renderer, which: int, size: int) -> Any:
    """Two threads wait for the same submission: one of them gets it; a third looks at it."""
    core = renderer._core
    source = _core.image_source(IMAGES[size])
    plan = core.plan(source, SETTINGS[which], None)
    arrays = new_arrays(core, plan)
    submission = core.run(source, (plan,), (arrays,))
    got: list[Any] = []

    def wait() -> None:
        try:
            got.append(submission.wait())
        except RuntimeError:
            got.append(None)

    def look_on() -> None:
        while len(got) < 2:
            assert not submission.ordered

    others = [threading.Thread(target=target) for target in (wait, look_on)]
    for other in others:
        other.start()
    wait()
    for other in others:
        other.join()
    assert sum(one is not None for one in got) == 1
    return list(arrays)


def adjoint(renderer: Renderer, which: int, size: int) -> Any:
    del which
    core = renderer._core
    image = IMAGES[size].astype(np.float32)
    source = _core.image_source(image, None, None, (image,))
    plan = core.plan(source, SETTINGS[1], None, ("final",), "images")
    return [] if plan is None else run(core, source, plan)


def look(renderer: Renderer, which: int, size: int) -> Any:
    """Return all that is known of plans, without a device."""
    core = renderer._core
    source = _core.image_source(IMAGES[size])
    settings = SETTINGS[which]
    plan, any_plan = core.plan(source, settings, None), _core.plan(source, settings, None)
    assert plan.shares_images(plan)
    assert plan.is_of(source)
    scene = scene_source((64, 36))
    found: list[Any] = [plan.outputs, plan.passes, any_plan.passes, source.kind]
    found += [_core.dry_run(((source, plan), (source, plan))), core.info, source.exported]
    found += [_core.plan(scene, Separable(), None).passes, len(core.pages(1 << 20))]
    _core.read_dlpack(IMAGES[size].__dlpack__())
    return [str((*found, MESH.indices.sum()))]


def ask(renderer: Renderer, which: int, size: int) -> Any:
    """Read what other threads change meanwhile."""
    del which, size
    core = renderer._core
    assert core.pipeline_count > 0
    assert core.transposes >= (0, 0)
    assert core.cached[0] > 0
    assert core.instance
    assert core.pipeline_cache()
    return [core.closed, [one[0] for one in _core.adapters("")]]


def show(renderer: Renderer, which: int, size: int) -> Any:
    core = renderer._core
    source = _core.image_source(IMAGES[size])
    plan = core.plan(source, SETTINGS[which], ("final",))
    try:
        screen = core.open_screen(0)
    except _core.Error as error:
        assert "VK_EXT_headless_surface" in str(error)  # noqa: PT017  Mesa 22.3 has none
        return []
    submission = core.run(source, (plan,), ((None,),), False, (screen, 32, 16, False))
    if submission:
        submission.wait()
    core.close_screen(screen)
    return []


def open_and_close(renderer: Renderer, which: int, size: int) -> Any:
    """Close a renderer that another thread uses; its arrays and handles outlive it."""
    del renderer
    own = Renderer()
    image = own.upload(IMAGES[size])
    kept = own.apply(IMAGES[size], SETTINGS[which])

    def work() -> None:
        try:
            while True:
                own.apply(image, SETTINGS[which], framebuffers="final")
                assert own._core.instance
        except ValueError:
            assert own.closed

    other = threading.Thread(target=work)
    other.start()
    own.close()
    other.join()
    return host(kept)


def collect(renderer: Renderer, which: int, size: int) -> Any:
    """Collect garbage while others submit."""
    core = renderer._core
    source = _core.image_source(IMAGES[size])
    plan = core.plan(source, SETTINGS[which], None)
    core.run(source, (plan,), (new_arrays(core, plan),))
    gc.collect()
    return []


Call = Callable[[Renderer, int, int], Any]
#: With how often they come.
CALLS: Final[dict[Call, int]] = {
    apply: 12,
    render: 6,
    leave: 6,
    upload: 12,
    recycle: 12,
    on_device: 12,
    load: 1,
    wait_twice: 12,
    adjoint: 6,
    look: 24,
    ask: 24,
    show: 3,
    collect: 1,
    open_and_close: 1,
}


def same(got: Any, right: Any) -> bool:
    return len(got) == len(right) and all(
        np.array_equal(one, other, equal_nan=True) if isinstance(one, np.ndarray) else one == other
        for one, other in zip(got, right, strict=True)
    )


class Made(NamedTuple):
    """A call of one thread."""

    #: In `renderers` of `play`: 0 is the one that half of the threads share.
    renderer: int
    name: str
    which: int
    size: int

    @property
    def key(self) -> tuple[str, int, int]:
        return self[1:]


def plan_calls(thread: int, count: int) -> list[Made]:
    """Return a thread's calls."""
    dice = random.Random(thread)
    names = [call.__name__ for call in CALLS]
    found = []
    for number in range(count):
        (name,) = dice.choices(names, list(CALLS.values()))
        if number == 0:
            name = names[thread % len(names)]  # so that each is made
        which, (size,) = dice.randrange(len(SETTINGS)), dice.choices(range(3), (8, 8, 1))
        found.append(Made(0 if thread % 2 else dice.randrange(1, 1 + MANY), name, which, size))
    return found


def play(calls: int) -> Counter[str]:
    """Make so many calls; return how often each was made."""
    names = {call.__name__: call for call in CALLS}
    planned = [plan_calls(thread, -(-calls // THREADS)) for thread in range(THREADS)]
    keys = dict.fromkeys(one.key for row in planned for one in row)
    with Renderer() as single, tempfile.TemporaryDirectory() as folder:
        stand_in.load(Path(folder), single.info)
        right = {key: names[key[0]](single, *key[1:]) for key in keys}
    validation = "VKBLOOM_VALIDATED" in os.environ
    renderers = [Renderer(validation=validation) for _ in range(1 + MANY)]
    start = threading.Barrier(THREADS)

    def work(thread: int) -> Counter[str]:
        start.wait()
        for one in planned[thread]:
            renderer = renderers[one.renderer]
            apply(renderer, 0, 0)  # what `ask` asks for is there then
            assert same(names[one.name](renderer, *one.key[1:]), right[one.key]), one.key
        return Counter(one.name for one in planned[thread])

    with ThreadPoolExecutor(THREADS) as pool:
        made = sum(pool.map(work, range(THREADS)), Counter[str]())
    # At the end of the interpreter it is too late for what they keep.
    CAPSULES.clear()
    for renderer in renderers:
        renderer.close()
    return made


if __name__ == "__main__":
    made = play(int(sys.argv[1]) if sys.argv[1:] else 1000)
    print(f"{made.total()} calls in {THREADS} threads, all exact:")
    print(", ".join(f"{name} {count}" for name, count in sorted(made.items())))
    enabled = getattr(sys, "_is_gil_enabled", lambda: True)()
    print("the GIL is on" if enabled else "the GIL is off")
    sys.exit(0 if set(made) == {call.__name__ for call in CALLS} else 1)
