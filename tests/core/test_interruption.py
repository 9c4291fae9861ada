"""Signals, time limits and forks: every wait ends, and the renderer can be used again."""

from __future__ import annotations

import gc
import math
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray
from numpy.typing import NDArray

import vkbloom
from tests.images import picture
from tests.processes import output
from vkbloom import DeviceLostError, Frames, Renderer, Scene, Separable, gaussian_weights

LEAVES_BEHIND = pytest.mark.skipif(
    "VKBLOOM_SANITIZED" in os.environ, reason="leaves a device behind on purpose: a leak to LSan"
)
UNIX = pytest.mark.skipif(os.name == "nt", reason="signals and forks of Unix")

SHORT = Separable(blur_strength=0.5)
RIGHT_SIZE = (24, 16)


class Alarm(BaseException):
    """The exception of the signal handler. It is not an Exception, like KeyboardInterrupt."""


@pytest.fixture
def alarm() -> Iterator[Callable[[float], None]]:
    """A signal after some seconds, whose handler raises Alarm in the main thread."""

    def handler(number: int, frame: object) -> None:
        raise Alarm

    before = signal.signal(signal.SIGALRM, handler)
    yield lambda seconds: signal.setitimer(signal.ITIMER_REAL, seconds) and None
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


def slow(radius: int) -> Separable:
    """Return settings of (2 radius + 1)^2 taps a pixel, filtered by hand."""
    weights = gaussian_weights(10.0, radius)
    return Separable(weights=weights, blur_scale=0.5, direct=True, format="rgba32float")


class Long(NamedTuple):
    """Work that takes more than 0.3 s, so that there is a wait to interrupt after 0.1 s.

    The image has at least 1 MiB, so that the device writes directly into the array.
    """

    image: NDArray[np.float32]
    radius: int

    @property
    def settings(self) -> Separable:
        return slow(self.radius)

    @property
    def half(self) -> NDArray[np.float32]:
        return self.image[: len(self.image) // 2, : len(self.image) // 2]

    def run(self, renderer: Renderer) -> None:
        renderer.apply(self.image, self.settings, framebuffers="final")


@pytest.fixture(scope="module")
def long() -> Long:
    """No longer than necessary, since all of these tests wait for it several times."""
    with Renderer() as renderer:
        # Of a CPU, the seconds that it takes without other work on the machine.
        is_cpu = renderer.info.type == "cpu"
        clock = time.process_time if is_cpu else time.perf_counter
        threads = int(os.environ.get("LP_NUM_THREADS") or os.cpu_count() or 1) if is_cpu else 1
        side, radius = 256, 4
        while side <= 4096:
            work = Long(picture(side, side), radius)
            # Another image of this size first, so that the next call does not compile shaders.
            work._replace(image=work.image[::-1]).run(renderer)
            begin = clock()
            work.run(renderer)
            seconds = (clock() - begin) / threads
            if seconds > 0.3:
                return work
            growth = math.sqrt(min(4.0, max(1.2, 0.36 / seconds)))
            if radius < 32:
                radius = min(32, math.ceil(growth * radius))
            else:
                side = int(side * growth)
    pytest.skip("this device is done before a wait can be interrupted")


class Case(NamedTuple):
    """A new renderer, work that is long, and an alarm."""

    renderer: Renderer
    long: Long
    alarm: Callable[[float], None]
    scene: Scene
    right: list[NDArray[Any]]

    @contextmanager
    def interrupt(self, seconds: float = 0.1) -> Iterator[None]:
        """The alarm ends the work within."""
        self.alarm(seconds)
        with pytest.raises(Alarm):
            yield

    def check(self) -> None:
        """The renderer gives the exact pictures of a new one."""
        for array, expected in zip(exact(self.renderer, self.scene), self.right, strict=True):
            np.testing.assert_array_equal(array, expected)


def exact(renderer: Renderer, scene: Scene) -> list[NDArray[Any]]:
    rendered = (
        renderer.render(scene, settings, RIGHT_SIZE)
        for settings in (SHORT, Separable(bloom_size=(7, 5)))
    )
    arrays = [array for frames in rendered for array in frames.values()]
    return [*arrays, renderer.apply(picture(9, 9), SHORT)["final"]]


@pytest.fixture(scope="module")
def right(scene: Scene) -> list[NDArray[Any]]:
    with Renderer() as new:
        return exact(new, scene)


@pytest.fixture
def case(
    new_renderer: Callable[[], Renderer],
    long: Long,
    alarm: Callable[[float], None],
    scene: Scene,
    right: list[NDArray[Any]],
) -> Case:
    return Case(new_renderer(), long, alarm, scene, right)


# Signals


@UNIX
def test_a_long_frame_is_interrupted(case: Case) -> None:
    case.renderer.apply(picture(8, 8), case.long.settings)
    for _ in range(2):
        with case.interrupt():
            case.long.run(case.renderer)
    case.check()


@UNIX
def test_an_interrupted_frame_keeps_its_arrays(case: Case) -> None:
    # The device writes into the array when no one else refers to it.
    renderer, image, settings = case.renderer, case.long.image, case.long.settings
    expected = renderer.apply(image, settings, framebuffers="final")["final"]
    renderer.apply(image[:8, :8], settings)
    with case.interrupt():
        renderer.apply(image, settings, framebuffers="final", out={"final": np.zeros_like(image)})
    gc.collect()
    others = [np.zeros_like(image) for _ in range(4)]
    again = renderer.apply(image, settings, framebuffers="final")["final"]
    np.testing.assert_array_equal(again, expected)
    assert not any(other.any() for other in others)


@UNIX
def test_a_finalizer_of_an_array_may_wait_for_the_renderer(case: Case) -> None:
    """Regression: the array of an interrupted call was released with the renderer's lock held."""
    renderer, image, settings = case.renderer, case.long.image, case.long.settings
    renderer.apply(picture(8, 8), settings)
    finished: list[bool] = []

    def use_elsewhere() -> None:
        thread = threading.Thread(target=renderer.apply, args=(picture(8, 8), SHORT), daemon=True)
        thread.start()
        thread.join(20.0)
        finished.append(not thread.is_alive())

    array = np.zeros_like(image)
    weakref.finalize(array, use_elsewhere)
    with case.interrupt():
        renderer.apply(image, settings, framebuffers="final", out={"final": array})
    del array
    gc.collect()
    assert not finished
    # The next submission waits for the abandoned one, which has then finished.
    renderer.apply(picture(9, 9), SHORT)
    assert finished == [True]


@UNIX
def test_a_sequence_is_interrupted(case: Case) -> None:
    settings = [
        case.long.settings.replace(exposure=step / 8, blur_strength=1 + step / 8)
        for step in range(3)
    ]
    with case.interrupt(0.3):
        for _ in case.renderer.sweep(case.long.image, settings):
            pass
    case.check()


POINTS = 12
STRENGTHS = {"blur_strength": np.linspace(1, 2, POINTS).tolist()}


class Stopper:
    """A reduction that sets the alarm at its fifth point; it comes in the wait for another."""

    def __init__(self, alarm: Callable[[float], None] | None) -> None:
        self.alarm = alarm
        self.points = 0

    def __call__(self, frames: Frames) -> np.float64:
        self.points += 1
        if self.alarm is not None and self.points == 5:
            self.alarm(0.02)
        return np.mean(frames["final"], dtype=np.float64)


@UNIX
def test_an_interrupted_store_is_completed(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    closers: list[threading.Thread] = []
    close = Renderer.close

    def note_close(renderer: Renderer) -> None:
        closers.append(threading.current_thread())
        close(renderer)

    monkeypatch.setattr(Renderer, "close", note_close)

    def make(stopper: Stopper, **more: Any) -> xarray.Dataset:
        reduce = {"mean": stopper}
        source, settings = case.long.half, case.long.settings
        return vkbloom.grid(source, settings, STRENGTHS, reduce=reduce, progress=False, **more)

    stored: dict[str, Any] = {"store": tmp_path / "grid", "chunks": {"blur_strength": 2}}
    first, second = Stopper(case.alarm), Stopper(None)
    with pytest.raises(Alarm):
        make(first, adapter="auto", **stored)
    # The caller does not wait for pending submissions after an interruption.
    assert threading.main_thread() not in closers
    done = int(xarray.open_zarr(tmp_path / "grid")["done"].sum())
    assert 2 <= done <= first.points < POINTS
    got = make(second, adapter="auto", **stored)
    assert closers[1:] == [threading.main_thread()]
    # And the first point, for its shape. A block may be complete without a mark.
    assert second.points <= POINTS - done + 1
    right = make(Stopper(None), renderer=case.renderer)
    assert bool(got["done"].all())
    for name in ("final", "mean"):
        np.testing.assert_array_equal(got[name], right[name])


@UNIX
def test_an_interrupted_close_leaves_the_renderer_open(case: Case) -> None:
    with case.interrupt():
        case.long.run(case.renderer)
    with case.interrupt():
        case.renderer.close()
    assert not case.renderer.closed
    case.check()
    case.renderer.close()
    assert case.renderer.closed


@UNIX
def test_waiting_for_another_thread_is_interrupted(case: Case) -> None:
    thread = threading.Thread(target=case.long.run, args=(case.renderer,))
    thread.start()
    time.sleep(0.05)
    with case.interrupt():
        list(map(case.renderer.apply, [picture(8, 8)] * 1000))
    thread.join()
    case.check()


@UNIX
def test_a_handler_that_uses_the_renderer_gets_an_error(case: Case) -> None:
    caught: list[str] = []

    def handler(number: int, frame: object) -> None:
        # Between two waits it may be used; a later signal comes in one. On a busy machine the next
        # one is there before the timer is stopped, also in the middle of this.
        if caught:
            return
        try:
            case.renderer.render(case.scene, SHORT, RIGHT_SIZE)
        except Exception as error:
            caught.append(str(error))
            signal.setitimer(signal.ITIMER_REAL, 0)

    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, 0.1, 0.1)
    while not caught:
        case.long.run(case.renderer)
    signal.signal(signal.SIGALRM, before)
    (message,) = set(caught)
    assert "at work in this thread" in message
    case.check()


# Limits of time


@pytest.mark.parametrize("text", ["0", "-1", "soon", "nan"])
def test_wrong_wait_limit_is_refused(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setenv("VKBLOOM_TIMEOUT", text)
    with pytest.raises(ValueError, match=f"VKBLOOM_TIMEOUT: '{text}' is not"):
        Renderer()


@LEAVES_BEHIND
def test_a_device_that_takes_too_long(
    monkeypatch: pytest.MonkeyPatch, scene: Scene, long: Long
) -> None:
    # On GPUs, transfers take a part of the 0.3 s. This has four times as many taps.
    longer = slow(2 * long.radius)
    monkeypatch.setenv("VKBLOOM_TIMEOUT", "0.1")
    renderer = Renderer(validation=True)
    # The limit is 0.1 s for each frame; a large image counts as several.
    with pytest.raises(
        DeviceLostError, match=r"not finished within 0\.\d s.*VKBLOOM_TIMEOUT"
    ) as hung:
        renderer.apply(long.image, longer, framebuffers="final")
    assert hung.value.vk_call == "vkWaitForFences"
    assert hung.value.vk_result == 2  # VK_TIMEOUT
    with pytest.raises(DeviceLostError):
        renderer.render(scene, SHORT, RIGHT_SIZE)
    # Objects that the busy device uses cannot be destroyed, and there is no wait for them.
    with pytest.raises(DeviceLostError, match="still busy"):
        renderer.close()
    assert renderer.closed
    renderer.close()


# Collects a renderer while its device is at work; prints how it ended, and after how many seconds
# from the collection, or from Ctrl-C in it.
COLLECT = """
import gc, os, signal, sys, threading, time
import numpy as np
import vkbloom

side, radius, pressing = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3] == "pressed"
image = np.random.default_rng(side).random((side, side, 4), dtype=np.float32)
long = vkbloom.Separable(
    weights=vkbloom.gaussian_weights(10.0, radius),
    blur_scale=0.5,
    direct=True,
    format="rgba32float",
)
renderer = vkbloom.Renderer()
source = vkbloom._core.image_source(image)
plan = renderer._core.plan(source, long, ("final",))
submission = renderer._core.run(source, (plan,), ((np.empty(image.shape, image.dtype),),))
begin = time.perf_counter()

def press():
    global begin
    begin = time.perf_counter()
    signal.raise_signal(signal.SIGINT)

timer = threading.Timer(0.1, press)
if pressing:
    timer.start()
try:
    del renderer, submission
    gc.collect()
    print("collected", time.perf_counter() - begin, flush=True)
    if pressing:
        timer.join()
except KeyboardInterrupt:
    print("interrupted", time.perf_counter() - begin, flush=True)
# The device is left at work.
os._exit(0)
"""


@UNIX
@LEAVES_BEHIND
@pytest.mark.parametrize(
    ("how", "limit", "words"), [("left", "0.1", "collected"), ("pressed", "300", "interrupted")]
)
def test_collecting_a_renderer_at_work(long: Long, how: str, limit: str, words: str) -> None:
    """Regression: this wait had no limit, and Ctrl-C did not end it."""
    # The side of an image on a GPU is large already.
    factor = 4 if len(long.image) <= 1024 else 2
    sizes = (str(factor * len(long.image)), str(long.radius))
    printed = output("-c", COLLECT, *sizes, how, VKBLOOM_TIMEOUT=limit)
    ending, seconds = printed.split()
    assert ending == words
    # A device that is waited for takes longer, above all on a busy machine.
    assert float(seconds) < 0.25 * factor**2


# Forks

CHILD = """
import os, sys, gc
import numpy as np
import vkbloom

image = np.random.default_rng(3).random((16, 24, 3), dtype=np.float32)
renderer = vkbloom.Renderer(validation=True)
# Exit handlers of a GPU's driver may crash or hang in a child: docs/robustness.md, Forks.
leaves = sys.argv[1] == "leave" or (renderer.info.type != "cpu" and sys.argv[1] != "exit")
right = renderer.apply(image, vkbloom.Separable())["final"]
batches = renderer.sweep(image, [vkbloom.Separable()] * 9)
next(batches); next(batches)
child = os.fork()
if child == 0:
    try:
        for use in (
            lambda: renderer.apply(image),
            lambda: renderer.render(vkbloom.Scene.ufo(), size=(8, 8)),
            lambda: renderer._core.pipeline_cache(),
            lambda: list(batches),
        ):
            try:
                use()
            except ValueError as error:
                assert "opened in another process" in str(error), error
            else:
                raise AssertionError("the child used its parent's device")
        assert not renderer.closed
        try:
            with vkbloom.Renderer(validation=True) as own:
                np.testing.assert_array_equal(own.apply(image, vkbloom.Separable())["final"], right)
        except vkbloom.Error as error:
            # Drivers of GPUs may open no device after a fork.
            assert renderer.info.type != "cpu" and '"spawn"' in str(error), error
        if sys.argv[1] == "close":
            renderer.close()
            assert renderer.closed
        elif sys.argv[1] == "collect":
            del renderer, batches, use
            gc.collect()
        print("child done", flush=True)
    except BaseException:
        import traceback
        traceback.print_exc()
        os._exit(1)
    if leaves:
        os._exit(0)
    sys.exit(0)
_, status = os.waitpid(child, 0)
assert status == 0, status
np.testing.assert_array_equal(list(batches)[-1]["final"], right)
np.testing.assert_array_equal(renderer.apply(image, vkbloom.Separable())["final"], right)
renderer.close()
print("parent done")
"""


@UNIX
@LEAVES_BEHIND
@pytest.mark.parametrize("how", ["close", "collect", "exit", "leave"])
def test_a_forked_process(how: str, renderer: Renderer) -> None:
    if how == "exit" and renderer.info.type != "cpu":
        pytest.skip("drivers of GPUs may not end in a child (docs/robustness.md, Forks)")
    assert output("-c", CHILD, how) == "child done\nparent done\n"


# Of a process with the id 1, whose child has the id 1 in a namespace of its own.
SAME_ID = """
import ctypes, os
import numpy as np
import vkbloom

image = np.ones((8, 8, 3), np.float32)
renderer = vkbloom.Renderer("software")
assert os.getpid() == 1
assert ctypes.CDLL(None).unshare(0x20000000) == 0  # CLONE_NEWPID
child = os.fork()
if child == 0:
    try:
        renderer.apply(image)
    except ValueError as error:
        print(os.getpid(), str(error).split(";")[0], flush=True)
    os._exit(0)
os.waitpid(child, 0)
"""


@UNIX
@LEAVES_BEHIND
def test_a_forked_process_with_the_id_of_its_parent() -> None:
    """As containers have it. Regression: the child used its parent's device."""
    isolate = ("unshare", "--pid", "--fork", "--kill-child")
    if subprocess.run([*isolate, "true"], capture_output=True, check=False).returncode:
        pytest.skip("this system gives the tests no namespace of process ids")
    done = subprocess.run(
        [*isolate, sys.executable, "-c", SAME_ID],
        env={**os.environ, "VKBLOOM_TIMEOUT": "5"},
        capture_output=True,
        text=True,
        check=False,
    )
    message = "1 the renderer was opened in another process, from which this one was forked\n"
    assert (done.stdout, done.stderr) == (message, "")


# Prints the error of a child whose driver opens no device.
ADVICE = """
import os, sys
import vkbloom

vkbloom.adapters()
for _ in range(2):
    if os.fork():
        os.wait()
        sys.exit()
    # The child, then the child's.
    try:
        vkbloom.Renderer("no such adapter")
    except vkbloom.AdapterNotFoundError as error:
        print(error, flush=True)
"""


@UNIX
def test_a_child_without_an_adapter_is_told_to_spawn() -> None:
    message = output("-c", ADVICE).splitlines()
    assert len(message) == 2
    for line in message:
        assert "no such adapter" in line
        assert "forked" in line
        assert '"spawn"' in line
    with pytest.raises(vkbloom.AdapterNotFoundError) as caught:
        Renderer("no such adapter")
    assert "forked" not in str(caught.value)
