"""The default renderer of the process, and functions that take a renderer."""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.core.builds import ROOT
from tests.images import picture
from tests.processes import output

IMAGE = picture(24, 16)


def test_functions_equal_the_methods(renderer: vkbloom.Renderer) -> None:
    expected = renderer.apply(IMAGE, vkbloom.presets["kino"].replace(threshold=0.5))
    found = vkbloom.apply(IMAGE, "kino", threshold=0.5, renderer=renderer)
    assert {name: array.tobytes() for name, array in found.items()} == {
        name: array.tobytes() for name, array in expected.items()
    }
    scene = vkbloom.Scene.ufo()
    drawn = vkbloom.render(scene, size=(32, 18), blur_scale=2, renderer=renderer)
    settings = vkbloom.Separable(blur_scale=2)
    assert np.array_equal(drawn["final"], renderer.render(scene, settings, (32, 18))["final"])


@pytest.mark.parametrize("call", ["apply", "map", "sweep", "plan", "vjp", "grid"])
def test_a_presets_name_is_a_settings(renderer: vkbloom.Renderer, call: str) -> None:
    def call_default(settings: Any) -> Any:
        if call == "vjp":
            return vkbloom.vjp(IMAGE, settings, renderer=renderer)[0]["final"].tobytes()
        if call == "grid":
            axes = {"intensity": [0.5, 1.0]}
            return vkbloom.grid(IMAGE, settings, axes, progress=False, renderer=renderer)["final"]
        if call == "plan":
            return renderer.plan(IMAGE, settings)
        if call == "apply":
            return renderer.apply(IMAGE, settings)["final"].tobytes()
        images, many = ([IMAGE], settings) if call == "map" else (IMAGE, [settings])
        return [frames["final"].tobytes() for frames in getattr(renderer, call)(images, many)]

    found, expected = call_default("kino"), call_default(vkbloom.presets["kino"])
    assert found.equals(expected) if call == "grid" else found == expected


@pytest.mark.parametrize(("suffix", "preset"), [(".png", "photo"), (".exr", "bevy_natural")])
def test_a_file_starts_from_the_settings_of_its_type(
    renderer: vkbloom.Renderer, tmp_path: Path, suffix: str, preset: str
) -> None:
    path = vkbloom.write(tmp_path / f"a{suffix}", picture(24, 16, 3, dtype="float32"))
    image = vkbloom.read(path, expand=4 if preset == "photo" else None)
    for given in (path, str(path)):
        frames = vkbloom.apply(given, renderer=renderer)
        assert frames.settings == vkbloom.presets[preset]
        assert np.array_equal(frames["final"], renderer.apply(image, preset)["final"])
    plain = renderer.apply(vkbloom.read(path), "kino")["final"]
    assert np.array_equal(vkbloom.apply(path, "kino", renderer=renderer)["final"], plain)


def test_threads_share_one_renderer() -> None:
    found: list[vkbloom.Renderer] = []
    barrier = threading.Barrier(8)

    def ask() -> None:
        barrier.wait()
        found.append(vkbloom.default_renderer())

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    try:
        assert len(found) == 8
        assert len({*map(id, found)}) == 1
    finally:
        found[0].close()
    again = vkbloom.default_renderer()
    assert again is not found[0]
    again.close()


# A thread holds the lock of the default renderer while the process forks.
FORKED = """
import os, threading, warnings
import numpy as np
import vkbloom
from vkbloom._renderer import default
warnings.simplefilter("ignore")
image = np.ones((8, 8, 3), np.float32)
parent = vkbloom.apply(image)["final"]
first = vkbloom.default_renderer()
with default._DEFAULT.lock:
    child = os.fork()
if child == 0:
    same = np.array_equal(vkbloom.apply(image)["final"], parent)
    print("child", same, vkbloom.default_renderer() is not first, flush=True)
    raise SystemExit
assert os.waitpid(child, 0)[1] == 0
print("parent", vkbloom.default_renderer() is first)
"""


def test_a_forked_child_opens_its_own() -> None:
    assert output("-c", FORKED).split() == ["child", "True", "True", "parent", "True"]


# A thread holds all other locks of the package while the process forks.
LOCKED = """
import os, signal, threading, types, warnings
import numpy as np
import vkbloom
from tests.planned import MESH
from vkbloom import _array_cache as array_cache
from vkbloom import _locks as locks
from vkbloom._gradients.passes import DeviceGradients
from vkbloom._renderer.requests import PendingSubmission
warnings.simplefilter("ignore")
image = np.ones((8, 8, 3), np.float32)
settings = vkbloom.Convolution(vkbloom.psf.gaussian(2))
renderer = vkbloom.Renderer()
renderer.apply(image, settings)
submission = types.SimpleNamespace(ordered=True, exports_ordered=True, wait=lambda: ([], ()))
pending = PendingSubmission(submission)
gradients = DeviceGradients({}, ("exposure",), ({"exposure"}, lambda: {"exposure": image}))
held = [*(one._lock for one in locks._locks), *(one.lock for one in locks._properties)]
assert len(held) >= 3
enter = [gradients._lock.__enter__, *(one.acquire for one in held)]
holder = threading.Thread(target=lambda: [one() for one in enter])
holder.start()
holder.join()
child = os.fork()
if child == 0:
    signal.alarm(30)  # of a deadlock
    array_cache._IN_PROCESS.find(1)
    array_cache.shared_cache().find(1)
    pending.complete()
    assert MESH.packed.shape == (3, 3, 4)
    assert gradients["exposure"] is image
    print(vkbloom.apply(image, settings)["final"].shape, flush=True)
    os._exit(0)
os._exit(os.waitpid(child, 0)[1])
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks there")
def test_a_forked_child_finds_all_locks_free() -> None:
    assert output("-c", LOCKED, cwd=ROOT) == "(8, 8, 3)\n"


# At exit, other functions may still use it; the validation layer reports what is not destroyed.
AT_EXIT = """
import atexit
import numpy as np
import vkbloom
image = np.ones((8, 8, 3), np.float32)
print(vkbloom.apply(image)["final"].shape)
atexit.register(lambda: print(vkbloom.apply(image)["final"].shape))
"""


def test_the_exit_of_the_interpreter() -> None:
    assert output("-c", AT_EXIT).split("\n")[:2] == ["(8, 8, 3)"] * 2


LOST = """
import os, time
import numpy as np
import vkbloom
vkbloom.apply(np.ones((8, 8, 3), np.float32))
vkbloom.default_renderer().close()
os.environ["VKBLOOM_TIMEOUT"] = "1e-6"
try:
    vkbloom.apply(np.ones((2048, 2048, 3), np.float32))
except vkbloom.DeviceLostError as error:
    print("VKBLOOM_TIMEOUT" in str(error))
del os.environ["VKBLOOM_TIMEOUT"]
time.sleep(4)  # The device finishes, so that its objects can be destroyed.
print(vkbloom.apply(np.ones((8, 8, 3), np.float32))["final"].shape)
"""


def test_a_lost_device_is_replaced_after_its_error() -> None:
    assert output("-c", LOST).splitlines() == ["True", "(8, 8, 3)"]
