"""Make every call of some workloads fail once, and print the results as one line of JSON.

Runs over a core built with VKBLOOM_FAULTS: ``python fault_walk.py STRIDE [WORKLOAD ...]``. Point n
is the n-th Vulkan call or allocation; the walk ends when the workload finishes without reaching it.
One of STRIDE points is walked (1: all points). Without names, all workloads are walked, but of the
methods and variants some in a run that is not exhaustive.
"""

from __future__ import annotations

import functools
import json
import math
import os
import shutil
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

import vkbloom
from tests.custom import TRAIL
from tests.device.device_work import Consumer, OnDevice, vjp
from tests.exhaustive import some
from tests.images import picture
from tests.processes import open_descriptors
from tests.scene.parts import Texture
from tests.screens import CAMERA, panel
from vkbloom import Renderer, Scene, _core
from vkbloom._renderer.surface import Surface

OUT_OF_DEVICE_MEMORY = -2
DEVICE_LOST = -4
#: The calls that report a lost device.
CAN_LOSE = "vkQueueSubmit vkWaitForFences vkGetQueryPoolResults"
#: The number of methods, each with a set of variants, that the usual run walks.
METHODS = 4
SIZE = (24, 16)

Arrays = Mapping[str, NDArray[Any]]
Work = Callable[[Renderer], Arrays]
Result = TypeVar("Result")
core: Any = _core  # arm_fault, fault_state and forget_instances are in test builds only


def mean(frames: vkbloom.Frames) -> float:
    return float(frames["final"].mean())


def make_textured() -> Scene:
    """Return a scene with textures of two meshes, of which one emits."""
    colours = np.random.default_rng(1).random((5, 7, 4)).astype(np.float16)
    body = panel(SIZE, Texture((colours,)), Texture((colours[:3, :3],)), radiance=(1.0, 2.0, 1.0))
    glow = panel(SIZE, Texture((colours[:, :2],)), across=(0.2, 0.5))
    return Scene(body=body, glow=glow, camera=CAMERA)


def method(settings: vkbloom.Settings) -> Work:
    return lambda renderer: renderer.apply(picture(*SIZE), settings)


def by_name(results: Mapping[Any, vkbloom.Frames]) -> Arrays:
    return {f"{key} {name}": one[name] for key, one in results.items() for name in one}


def accompanied(renderer: Renderer) -> Arrays:
    """The same image with another mask, then with another emission; all stages of glare."""
    image, emission = picture(*SIZE), picture(*SIZE, seed=1)
    mask = picture(*SIZE, 1, seed=2)[..., 0]
    streaks = vkbloom.Streaks(directions=2, base=2, iterations=2)
    stages = (streaks, vkbloom.Ghosts(), vkbloom.Halo(), vkbloom.Dirt(seed=1))
    settings = vkbloom.Separable(layers=((1, 1), (2, 1)), composite="mix", alpha="blur")
    flaring = vkbloom.Separable(glare=stages)
    return by_name(
        {
            "first": renderer.apply(image, settings, mask=mask),
            "masked": renderer.apply(image, settings, mask=mask[::-1]),
            "both": renderer.apply(image, settings, mask=mask[::-1], emission=emission),
            "glare": renderer.apply(image, flaring, mask=mask),
            "masked glare": renderer.apply(image, flaring, mask=mask[::-1]),
        }
    )


def swept(renderer: Renderer, source: Any, settings: Iterable[Any], **more: Any) -> Arrays:
    return by_name(dict(enumerate(renderer.sweep(source, settings, **more))))


def batch(renderer: Renderer) -> Arrays:
    steps = range(8)
    settings = (vkbloom.Separable(exposure=step / 4, loops=1 + step // 5) for step in steps)
    return swept(renderer, picture(*SIZE), settings)


def grid(renderer: Renderer) -> Arrays:
    settings = (vkbloom.Pyramid(levels=2, radius=step / 2) for step in range(5))
    return swept(renderer, UFO, settings, size=SIZE, framebuffers=("final", "bloom"))


def readback(renderer: Renderer) -> Arrays:
    """Large enough for the device to write directly into the arrays.

    The caller's array, new pages of the renderer, and the same pages after their array was freed.
    """
    image = picture(512, 512, dtype="uint8")

    def final(exposure: float, **out: Any) -> NDArray[Any]:
        settings = vkbloom.Separable(exposure=exposure)
        return renderer.apply(image, settings, framebuffers="final", **out)["final"]

    own = final(1.0, out={"final": np.zeros((512, 512, 4), np.uint8)})
    first = final(0.5)
    place, new = first.ctypes.data, first.copy()
    del first
    again = final(0.25)
    # Neither this process nor a fault takes idle pages away.
    assert again.ctypes.data == place
    return {"own": own, "new": new, "again": again}


def handles(renderer: Renderer) -> Arrays:
    """Uploaded images of two sizes, each in the memory of earlier ones."""
    kept = renderer.upload(picture(*SIZE, seed=9))
    images = [picture(24 + seed // 3, 16, seed=seed) for seed in range(6)]
    frames = renderer.map([*images, kept], vkbloom.Separable(threshold=0.5))
    arrays = {f"{i} final": one["final"] for i, one in enumerate(frames)}
    arrays["twice"] = renderer.apply(kept, vkbloom.Separable())["final"]
    return arrays


@functools.cache
def trail() -> vkbloom.Settings:
    return vkbloom.load_method(TRAIL, name="trail")()


def histories(renderer: Renderer) -> Arrays:
    """Calls that continue others. One that fails leaves what it would have continued as it was."""
    image = picture(*SIZE)
    first = renderer.apply(image, trail())

    def following() -> vkbloom.Frames:
        return renderer.apply(image[::-1], trail(), state=first.state)

    try:
        frames = [first, following()]
    except (vkbloom.Error, MemoryError):
        if not renderer._core.lost:
            expected = 0.5 * image[::-1, :, :3] + 0.5 * first["trail"][..., :3]
            np.testing.assert_allclose(following()["trail"][..., :3], expected, rtol=1e-6)
        raise
    frames += renderer.map([image, image[:8], image[:8]], trail(), state=frames[1].state)
    states = {f"{i} state": np.array(one.state["trail"]) for i, one in enumerate(frames)}
    return states | {f"{i} trail": one["trail"] for i, one in enumerate(frames)}


def gradients(renderer: Renderer) -> Arrays:
    """Adjoint passes for an image, and sums for fields."""
    image = picture(24, 16, seed=4)
    settings = vkbloom.Pyramid(levels=2, threshold=0.3, knee=0.5)
    frames, pullback = vkbloom.vjp(image, settings, renderer=renderer)
    found = pullback({"final": np.ones(image.shape)})
    names = ("image", "threshold", "intensity")
    return {"final": frames["final"], **{name: found[name] for name in names}}


def presented(renderer: Renderer) -> Arrays:
    """Frames on two surfaces; one changes its size, and is left to the renderer."""
    shown = []
    with Surface(renderer, size=SIZE) as closed:
        shown += [closed.present(UFO, time=step / 9) for step in range(3)]
    left = Surface(renderer, size=SIZE)
    shown += [left.present(UFO, size=(16, 16)) for _ in range(2)]
    left._size = (32, 16)
    shown += [left.present(UFO) for _ in range(4)]
    return {"shown": np.array(shown), "final": renderer.render(UFO, size=SIZE)["final"]}


def presents() -> bool:
    """Return whether there is a surface without a window."""
    with open_renderer() as renderer:
        try:
            Surface(renderer).close()
        except vkbloom.Error:
            return False
    return True


def variables(dataset: Any) -> Arrays:
    return {str(name): variable.values for name, variable in dataset.variables.items()}


AXES = {"radius": [0.25, 0.5, 0.75], "exposure": [0.5, 1.0]}


#: The folder of the grid that a fault has ended. The next call continues it.
FOLDER = Path(tempfile.gettempdir()) / f"vkbloom-fault-walk-{os.getpid()}"


def stored_grid(renderer: Renderer) -> Arrays:
    """A complete store is removed, so that the next run starts again."""
    base = vkbloom.Pyramid(levels=2)
    dataset = vkbloom.grid(
        picture(*SIZE),
        base,
        AXES,
        store=FOLDER,
        chunks={"exposure": 2},
        reduce={"mean": mean},
        progress=False,
        renderer=renderer,
    )
    arrays = variables(dataset)
    assert arrays["done"].all()
    shutil.rmtree(FOLDER)
    return arrays


@functools.cache
def custom_settings() -> tuple[vkbloom.Settings, ...]:
    """Return the settings of two custom methods, of draws and of dispatches; compiled once."""
    folder = Path("examples/custom_methods")
    return tuple(vkbloom.load_method(folder / f"{name}.hook")() for name in ("karis", "compute"))


def on_device(renderer: Any) -> Arrays:
    """Images of CUDA, over the stand-in for it: strided, a batch, results in memory used before.

    The derivatives by the emission are passes', those by the image zeros of the host.
    """
    images = np.stack([picture(*SIZE, dtype="float16", seed=seed) for seed in range(3)])
    settings = vkbloom.Separable(threshold=0.3)
    one, pullback = vjp(
        OnDevice(images[0, ::-1]), settings, emission=OnDevice(images[1]), renderer=renderer
    )
    found = pullback({"bloom": OnDevice(np.ones(one["bloom"].shape, np.float16))})
    arrays = {name: array.numpy() for name, array in one.items()}
    arrays |= {f"by {name}": found[name].numpy() for name in ("image", "emission")}
    copied = np.from_dlpack(Consumer(one["bloom"]))
    del one
    # The host waits late where CUDA shares semaphores: for the second when it reads the counts.
    first, second = (renderer.apply(OnDevice(image), settings) for image in images[:2])
    arrays |= {"first": np.from_dlpack(Consumer(first["final"]))}
    assert second.info["nan"] == 0
    arrays |= {"second": second["final"].numpy()}
    del first, second
    for index, frames in enumerate(renderer.map(OnDevice(images), settings)):
        arrays[f"{index} final"] = frames["final"].numpy()
    return {**arrays, "copied": copied}


UFO = Scene.ufo()
# One convolution stands for all: they have the same passes.
PRESETS = {
    name: settings
    for name, settings in vkbloom.presets.items()
    if name == "blender_fog_glow" or not isinstance(settings, vkbloom.Convolution)
}
WORK: dict[str, Work] = {
    "render forward": lambda renderer: renderer.render(UFO, size=SIZE),
    "render deferred": lambda renderer: renderer.render(
        make_textured(), size=SIZE, shading="deferred"
    ),
    "mask, emission, glare": accompanied,
    "batch": batch,
    "grid": grid,
    "grid to Zarr": stored_grid,
    "readback": readback,
    "handles": handles,
    "histories": histories,
    "gradients": gradients,
    "present": presented,
    "custom passes": lambda renderer: swept(renderer, picture(*SIZE), custom_settings()),
    **({"arrays on the device": on_device} if "STAND_IN_UUID" in os.environ else {}),
    **{
        f"apply {preset} {variant}": method(settings)
        for preset, settings in PRESETS.items()
        for variant in ("fragment", "cpu", "gpu")
    },
}


def state() -> dict[str, int]:
    """Return the counts that must be unchanged when all renderers are closed."""
    _, _, blocks, messages = core.fault_state()
    count = {"blocks": blocks, "messages": messages}
    if Path("/proc/self/fd").is_dir():
        count["descriptors"] = open_descriptors()
    return count


def open_renderer() -> Renderer:
    return Renderer(validation=True)


def check_error(error: BaseException, failed: str, result: int) -> None:
    """The exception has the right class and names the failed call."""
    if failed == "vkb_alloc":
        assert isinstance(error, MemoryError), error
        return
    assert isinstance(error, vkbloom.Error | TypeError), error
    if failed == "vkEnumerateInstanceLayerProperties":
        assert "validation was asked for" in str(error), error
        return
    if failed == "volkInitialize":
        assert isinstance(error, vkbloom.AdapterNotFoundError), error
        return
    if failed.startswith("cu"):
        # What CUDA says when arrays are taken is the reason why they are not.
        assert isinstance(error, vkbloom.OutOfMemoryError | TypeError), error
        assert f"CUDA: {failed} failed with CUDA_ERROR_OUT_OF_MEMORY" in str(error)
        return
    expected = vkbloom.OutOfMemoryError if result != DEVICE_LOST else vkbloom.DeviceLostError
    assert type(error) is expected, error
    assert (error.vk_call, error.vk_result) == (failed, result)
    assert failed in str(error)


def same(arrays: Arrays, right: Arrays) -> None:
    assert list(arrays) == list(right)
    for name, array in right.items():
        np.testing.assert_array_equal(arrays[name], array, err_msg=name)


class Walk:
    """One workload, point after point.

    Attributes
    ----------
    walked, raised, survived : int
        The numbers of points walked, of points that raised, and of points that did not end the
        call.
    calls : dict
        How often each call failed.
    """

    def __init__(self, name: str, work: Work | None) -> None:
        self.name, self.work = name, work
        self.walked = self.raised = self.survived = self.points = 0
        self.calls: dict[str, int] = {}

    def _fail(self, error: BaseException | None, failed: str, result: int) -> None:
        self.walked += 1
        self.calls[failed] = self.calls.get(failed, 0) + 1
        self.raised += error is not None
        self.survived += error is None
        if error is not None:
            check_error(error, failed, result)

    def _at(
        self, n: int, result: int, names: str, call: Callable[[], Result]
    ) -> tuple[Result | None, BaseException | None, bool]:
        """Call with a fault at the n-th point; return the result, the exception, and whether it was
        reached."""
        value: Result | None = None
        error: BaseException | None = None
        core.arm_fault(n, result, names)
        try:
            value = call()
        except Exception as raised:
            # Without its frames, which refer to the batch and to this variable.
            error = raised.with_traceback(None)
        passed, failed, *_ = core.fault_state()
        core.arm_fault(0, 0, "")
        if failed:
            self._fail(error, failed, result)
        self.points = max(self.points, passed)
        return value, error, bool(failed)

    def renderer_at(self, n: int, result: int) -> bool:
        """Opening a process's first renderer with a fault at its n-th point; False: fewer there."""
        core.forget_instances()
        renderer, error, failed = self._at(n, result, "", open_renderer)
        if error is not None and not failed:
            raise error
        if renderer is not None:
            renderer.close()
        with open_renderer() as again:
            assert not again.closed
        return failed

    def close_at(self, n: int, result: int, names: str) -> bool:
        """Closing a renderer while its device is busy."""
        renderer = open_renderer()
        frames = renderer.sweep(picture(64, 64), [vkbloom.Separable()] * 9)
        next(frames)
        next(frames)
        _, _, failed = self._at(n, result, names, renderer.close)
        assert renderer.closed
        return failed

    def work_at(self, n: int, right: Arrays, result: int, names: str) -> bool:
        """A workload in a new renderer, and afterwards the same without a fault, if possible."""
        assert self.work is not None
        work, renderer = self.work, open_renderer()
        arrays, error, failed = self._at(n, result, names, lambda: work(renderer))
        if error is not None and not failed:
            raise error
        if arrays is not None:
            same(arrays, right)
        if isinstance(error, vkbloom.DeviceLostError):
            for _ in range(2):
                try:
                    self.work(renderer)
                except vkbloom.DeviceLostError:
                    pass
                else:
                    raise AssertionError("a lost device worked")
        else:
            same(self.work(renderer), right)
        renderer.close()
        return failed


def walk(
    point: Callable[[int], bool],
    first: int,
    stride: int,
    before: dict[str, int],
    most: float = math.inf,
) -> None:
    """Walk until a point is not reached; beyond `most` points none is tried."""
    n = first
    while n <= most:
        try:
            there = point(n)
            assert state() == before, (state(), before)
        except BaseException as error:
            error.add_note(f"at point {n}: {core.fault_state()}")
            raise
        if not there:
            return
        n += stride


def walk_one(name: str, stride: int) -> None:
    os.environ["VKBLOOM_VARIANT"] = name.rsplit(" ", 1)[1] if name.startswith("apply ") else "auto"
    one = Walk(name, WORK.get(name))
    # Each workload starts at another point, so that the strides do not skip the same calls.
    start = 1 + zlib.crc32(name.encode()) % stride
    before = state()
    if name == "create":
        # It has few points, which are quickly walked.
        stride = max(1, stride // 10)
        start = 1 + start % stride
        walk(lambda n: one.renderer_at(n, OUT_OF_DEVICE_MEMORY), start, stride, before)
    elif name == "close":
        walk(lambda n: one.close_at(n, OUT_OF_DEVICE_MEMORY, ""), 1, 1, before)
        walk(lambda n: one.close_at(n, DEVICE_LOST, CAN_LOSE), 1, 1, before)
    else:
        assert one.work is not None
        core.arm_fault(0, 0, "")
        with open_renderer() as renderer:
            right = {key: array.copy() for key, array in one.work(renderer).items()}
        # With opening and closing, so a few more than can fail; all are tried where all are walked.
        most = core.fault_state()[0] if stride > 1 else math.inf
        # With the libraries' event loops and the like, which the first grid of a process opens.
        opened = state()
        assert {**opened, "descriptors": 0} == {**before, "descriptors": 0}, (opened, before)
        before = opened
        walk(lambda n: one.work_at(n, right, OUT_OF_DEVICE_MEMORY, ""), start, stride, before, most)
        lost = 1 + start % 4
        walk(lambda n: one.work_at(n, right, DEVICE_LOST, CAN_LOSE), lost, stride, before, most)
    columns = ("points", "walked", "raised", "survived", "calls")
    figures = {column: getattr(one, column) for column in columns}
    print(json.dumps({"workload": name, **figures}), flush=True)


def workloads() -> list[str]:
    """Return the names of the workloads that are walked by default."""
    methods = [name for name in WORK if name.startswith("apply ")]
    others = [name for name in WORK if name not in methods]
    return ["create", "close", *others, *some(methods, METHODS)]


def main(stride: int, names: list[str]) -> None:
    # Objects that a process creates once must exist before the count.
    custom_settings()
    with open_renderer() as renderer:
        WORK["render forward"](renderer)
    try:
        for name in names or workloads():
            if name != "present" or presents():
                walk_one(name, stride)
    finally:
        shutil.rmtree(FOLDER, ignore_errors=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
