"""Devices without some features or with lower limits: another variant or a clear error, and the
same pictures.

A layer between the validation layer and the adapter removes features (lesser_device.c).
"""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.core.builds import ROOT, build_layer, layer_variables
from tests.exhaustive import EXHAUSTIVE, some
from tests.processes import output, python
from vkbloom import AdapterInfo

SOURCE = Path(__file__).with_name("lesser_device.c")

pytestmark = [
    pytest.mark.skipif(
        "VKBLOOM_SANITIZED" in os.environ, reason="another process, whose core is not sanitized"
    )
]

LESS_WORK = ("whole", "smaller", "pyramid", "gathered", "handles", "bands")
#: The expected errors, by the names in lesser_work.py.
LAYERS = {
    "layers float32": "Error: .* cannot add up layers in rgba32float images, but in rgba16float"
}
#: Transforms load images, of which the least of all devices binds four.
LOADS = {"convolve": "ValueError: passes: kernel needs 7 storage images; .* allows 4 "}
DRAWN = {"convolve": "Error: the compute shaders of .* cannot write images"}
SKY = {"sky float32": "ValueError: skybox: the adapter .* cannot filter float32; uint8 and float16"}


def too_large(most: int) -> dict[str, str]:
    sizes = ("6000 x 1", "1 x 6000")
    return {size: f"ValueError: size: a size of {size} is out of .* 1 to {most} " for size in sizes}


@pytest.fixture(scope="module")
def layer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the layer; return the folder of its manifest."""
    return build_layer(SOURCE, tmp_path_factory.mktemp("layer"))


@pytest.fixture(scope="module")
def name(software: AdapterInfo) -> str:
    """A name that finds the software adapter, also if the layer changes its type."""
    return software.name


def lavapipes() -> list[Path]:
    manifests = list(Path("/usr/share/vulkan/icd.d").glob("lvp_icd*.json"))
    return manifests or pytest.skip("lavapipe is not installed")


WORK = ("-m", "tests.core.lesser_work")


def run(
    layer: Path, name: str, lesser: str, program: tuple[str, ...] = WORK, **environment: str
) -> subprocess.CompletedProcess[str]:
    variables = {
        **layer_variables(layer, "VK_LAYER_VKBLOOM_lesser_device"),
        "VKBLOOM_LESSER": lesser,
        "VKBLOOM_TEST_NAME": name,
        "VKBLOOM_CACHE_DIR": "",
        **environment,
    }
    return python(*program, cwd=ROOT, **variables)


#: What is taken away, and the expected errors: of each once from a CPU or from a GPU.
LESSER: list[tuple[str, dict[str, str]]] = [
    # No more than every device has, of what limits say.
    ("cpu,limits", {**too_large(4096), **LOADS}),
    # An image may be no larger than the least of several limits; nothing is timed; no memory
    # comes from the host.
    ("wide,timestamps,import", too_large(5000)),
    # The same; compute shaders cannot write images.
    ("high,storage", {**too_large(5000), **DRAWN}),
    # Memory of the device's own, and the host's, which is coherent or cached; a buffer does not
    # reach all rows of a large image.
    ("cpu,memory,bands,portability", {}),
    # Images of single floats are neither blended nor filtered; a buffer does not reach all rows
    # of a large array, to which the last pass stores.
    ("blend,filter,bands", {**LAYERS, **SKY}),
]
OTHER: list[tuple[str, dict[str, str]]] = [
    ("limits", {**too_large(4096), **LOADS}),
    ("memory", {}),
    ("cpu,blend,filter", {**LAYERS, **SKY}),
]


@pytest.mark.parametrize(("lesser", "errors"), LESSER + OTHER * EXHAUSTIVE)
def test_lesser_devices(layer: Path, name: str, lesser: str, errors: dict[str, str]) -> None:
    done = run(layer, name, lesser)
    assert done.returncode == 0, done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    assert result["wrong"].keys() == errors.keys(), result["wrong"]
    for case, words in errors.items():
        assert re.search(words, result["wrong"][case]), result["wrong"][case]
    taken = lesser.split(",")
    assert result["type"] == ("discrete" if "cpu" in taken else "cpu")
    assert result["timed"] is ("timestamps" not in taken)


#: What methods from files need beyond the least of all devices (lesser_work.py).
CUSTOM = {
    "buffers": "5 storage buffers; .* allows 4 .maxPerStageDescriptorStorageBuffers",
    "images": "5 storage images; .* allows 4 .maxPerStageDescriptorStorageImages",
    "threads": "256 threads of a workgroup; .* allows 128 .maxComputeWorkGroupInvocations",
    "shared": "16400 bytes of shared memory; .* allows 16384 .maxComputeSharedMemorySize",
}


def test_custom_methods_name_the_limit_that_they_exceed(layer: Path, name: str) -> None:
    results = []
    for lesser in ("cpu,limits", "cpu"):
        done = run(layer, name, lesser, (*WORK, "custom"))
        assert done.returncode == 0, done.stderr
        results.append(json.loads(done.stdout)["wrong"])
    assert [*results[0]] == [f"custom {name}" for name in CUSTOM]
    for case, words in CUSTOM.items():
        error = results[0][f"custom {case}"]
        assert re.search(f"^ValueError: passes: bloom needs {words}", error), error
    assert results[1] == {}


def test_more_allocations_than_the_device_allows(layer: Path, name: str) -> None:
    done = run(layer, name, "allocations", (*WORK, "handles"))
    (error,) = json.loads(done.stdout)["wrong"].values()
    assert re.search("allows 24 allocations .maxMemoryAllocationCount.; delete", error)


def test_pools_give_no_more_than_they_were_created_for(layer: Path, name: str) -> None:
    """Strict drivers; lavapipe gives more."""
    done = run(layer, name, "pools", (*WORK, "surfaces", *LESS_WORK))
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["wrong"] == {}


@pytest.mark.usefixtures("glslang")
def test_the_memory_of_states_is_freed(layer: Path, name: str) -> None:
    """Not of many frames at once: each has two buffers, one of them only for a copy."""
    done = run(layer, name, "allocations", (*WORK, "state"))
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["wrong"] == {}


@pytest.mark.parametrize("format", some(["store8", "store16", "store32", "store1"], 2))
def test_no_storage_of_a_format(layer: Path, name: str, format: str) -> None:
    """All workloads are drawn."""
    done = run(layer, name, f"cpu,{format}", (*WORK, *LESS_WORK))
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["wrong"] == {}
    variable = {"VKBLOOM_VARIANT": "gpu"}
    done = run(layer, name, f"cpu,{format}", (*WORK, "whole"), **variable)
    assert "compute shaders of" in done.stderr


def test_fused_passes_read_levels_as_the_device_does(layer: Path, name: str) -> None:
    """As products on a GPU, too; on a device that reads neither products nor quotients, no passes
    are fused."""
    passes = []
    for lesser in ("", "cpu", "cpu,texels"):
        done = run(layer, name, lesser, (*WORK, "fuse"), VKBLOOM_VARIANT="gpu")
        assert done.returncode == 0, done.stderr
        result = json.loads(done.stdout)
        assert result["wrong"] == {}
        passes.append(sum(result["passes"].values()))
    assert passes[0] == passes[1] < passes[2], passes


@pytest.mark.parametrize("lesser", ["cpu", "cpu,extended", "cpu,store2"])
def test_spectra_of_complete_lines_need_images_of_complex_numbers(
    layer: Path, name: str, lesser: str
) -> None:
    """Without these, and shaders that load them, transforms run stage by stage."""
    done = run(layer, name, lesser, (*WORK, "convolve"))
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["wrong"] == {}
    assert result["passes"]["lines"] == (6 if lesser == "cpu" else 0)


def test_an_adapter_of_the_portability_subset_is_found(tmp_path: Path) -> None:
    """The loader hides such drivers, MoltenVK among them, unless an instance asks for them."""
    manifest = json.loads(lavapipes()[0].read_text())
    manifest["ICD"]["is_portability_driver"] = True
    file = tmp_path / "portable.json"
    file.write_text(json.dumps(manifest))
    variables = dict.fromkeys(("VK_DRIVER_FILES", "VK_ICD_FILENAMES"), str(file))
    program = "import vkbloom; print(*(one.type for one in vkbloom.adapters()))"
    assert output("-c", program, VKBLOOM_DRIVER="system", **variables) == "cpu\n"


def test_no_depth(layer: Path, name: str) -> None:
    done = run(layer, name, "depth", (*WORK, "whole", "sky"))
    assert done.returncode == 0, done.stderr
    wrong: dict[str, str] = json.loads(done.stdout)["wrong"]
    assert wrong.keys() >= {"whole forward", "whole deferred", "sky uint8"}
    for case, error in wrong.items():
        assert not case.endswith(("uint8", "float16", "float32")) or case.startswith("sky ")
        assert re.search("^Error: the adapter .* cannot render to depth32float images", error) or (
            re.search("^ValueError: size: ", error)
        )


# Prints the errors of plans that need more memory than the device has. The kernel of the second one
# has four times the size of the image and must not be computed first.
TOO_LARGE = """
import os
import numpy as np
import vkbloom
from tests.processes import python

size = (2000, 2000)
small = vkbloom.Convolution(np.ones((3, 3), np.float32), bloom_size=size)
large = vkbloom.Convolution(kernel_size=(3999, 3999), bloom_size=size)
with vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True) as renderer:
    for settings in (small, large):
        if settings is large:
            vkbloom.Convolution.core_kernel = None
        try:
            renderer.plan(vkbloom.Scene.ufo(), settings, size)
        except vkbloom.OutOfMemoryError as error:
            print(error)
    for side in (5800, 8000):
        image = np.broadcast_to(np.float16(1), (side, side, 4))
        print(renderer.plan(image, vkbloom.Separable(), framebuffers="final").size)
    try:
        image = np.broadcast_to(np.float16(1), (8000, 8000, 4))
        renderer.apply(image, vkbloom.Separable(), framebuffers="final")
    except vkbloom.OutOfMemoryError as error:
        print(error)
"""


def test_images_of_too_much_memory(layer: Path, name: str) -> None:
    """An error before any work of the device, with the memory that is needed.

    The plan of a convolution raises it, since its kernel takes long; that of others needs none.
    """
    # A CPU has the memory of the host.
    done = run(layer, name, "heap,cpu", ("-c", TOO_LARGE))
    assert done.returncode == 0, done.stderr
    words = r"memory is short: \d+ MiB of images are needed, and the .* has 256; use a smaller"
    first, second, *sizes, image = done.stdout.splitlines()
    assert re.match(words, first), first
    assert re.match(words, second), second
    assert "has 256; an image of 3" in image
    assert sizes == ["(5800, 5800)", "(8000, 8000)"]


# Prints bytes of the images of `final` alone, by first and later calls, and of all framebuffers.
SHARED = """
import os
import numpy as np
import vkbloom

image = np.random.default_rng(0).random((128, 256, 4), np.float32)
settings = {
    "loops": vkbloom.Separable(loops=3, threshold=0.5),
    "streaks": vkbloom.presets["blender_streaks"].replace(threshold=0.5),
    "levels": vkbloom.Pyramid(levels=3, bloom_scale=2.0),
}
sizes = []
for name, one in settings.items():
    with vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True) as renderer:
        first = renderer.apply(image, one, framebuffers=("final",))["final"]
        sizes.append(renderer._core.cached[1])
        brighter = renderer.apply(image, one.replace(intensity=0.25), framebuffers=("final",))
        again = renderer.apply(image, one, framebuffers=("final",))["final"]
        assert np.array_equal(first, again), name
        sizes.append(renderer._core.cached[1])
        frames = renderer.apply(image, one)
        sizes.append(renderer._core.cached[1])
        assert np.array_equal(first, frames["final"]), name
        alone = renderer.apply(image, one.replace(intensity=0.25))
        assert np.array_equal(brighter["final"], alone["final"]), name
        for key in ("glow", "bloom"):
            small = renderer.apply(image, one, framebuffers=(key,))[key]
            assert np.array_equal(small, frames[key]), (name, key)
print(*sizes)
"""


@pytest.mark.parametrize("variant", ["fragment", "cpu", "gpu"])
def test_images_share_memory(layer: Path, name: str, variant: str) -> None:
    """Where they take a quarter of it: those that no later pass reads, for `final` alone most."""
    done = run(layer, name, "room,cpu", ("-c", SHARED), VKBLOOM_VARIANT=variant)
    assert done.returncode == 0, done.stderr
    loops, loops_again, all_loops, streaks, *_ = map(int, done.stdout.split())
    one = 128 * 256 * 16
    assert loops == loops_again == 3 * one
    assert all_loops > loops
    assert streaks <= 5 * one


# A method that reads the frame before, whose images share memory.
HISTORY = """
import os
import numpy as np
import vkbloom
from tests.custom import TRAIL

image = np.random.default_rng(0).integers(0, 256, (256, 256, 4)).astype(np.float32) / 256
settings = vkbloom.load_method(TRAIL, name="trail")()
trail = np.zeros((256, 256, 3), np.float32)
with vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True) as renderer:
    for frames in renderer.map([image] * 3, settings, framebuffers="final"):
        trail = (image[..., :3] + trail) / 2
        assert np.array_equal(frames["final"][..., :3], image[..., :3] + trail)
        assert np.array_equal(frames.state["trail"][..., :3], trail)
"""


@pytest.mark.usefixtures("glslang")
def test_what_has_a_history_shares_no_memory(layer: Path, name: str) -> None:
    done = run(layer, name, "room,cpu", ("-c", HISTORY))
    assert done.returncode == 0, done.stderr


# Prints what a deferred scene shows, whose first pass writes several images of one format.
SHARED_SCENE = """
import hashlib
import os
import vkbloom

with vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True) as renderer:
    for names in (("final",), ("albedo", "final"), "all"):
        frames = renderer.render(
            vkbloom.Scene.ufo(), "deferred", (512, 225), shading="deferred", framebuffers=names
        )
        for name in frames:
            print(name, hashlib.sha256(frames[name].tobytes()).hexdigest())
"""


def test_images_of_one_pass_share_no_memory(layer: Path, name: str) -> None:
    short, enough = (
        run(layer, name, lesser, ("-c", SHARED_SCENE)) for lesser in ("room,cpu", "cpu")
    )
    assert short.returncode == enough.returncode == 0, short.stderr + enough.stderr
    assert short.stdout == enough.stdout


# Prints why each variant is refused.
VARIANTS = """
import os
import vkbloom

for variant in ("tiles", "cpu", "gpu"):
    os.environ["VKBLOOM_VARIANT"] = variant
    try:
        vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"])
    except ValueError as error:
        print(error)
"""


def test_variants_that_are_none_or_that_the_device_cannot_run(layer: Path, name: str) -> None:
    none, *others = run(layer, name, "storage", ("-c", VARIANTS)).stdout.splitlines()
    assert none.startswith("VKBLOOM_VARIANT: tiles is not one of auto")
    for variant, words in zip(("cpu", "gpu"), others, strict=True):
        needs = f"VKBLOOM_VARIANT: the compute shaders of .* cannot write .* {variant} needs"
        assert re.match(needs, words), words


def test_the_doctor_on_a_device_without_timestamps(layer: Path, name: str) -> None:
    done = run(layer, name, "timestamps,storage", ("-m", "vkbloom._cli", "doctor", "--json"))
    findings = {finding["topic"]: finding for finding in json.loads(done.stdout)["findings"]}
    assert findings["test render"]["status"] == "ok"


# Prints the exception if Ctrl-C and a validation message come in the same wait.
INTERRUPTED = """
import os
import numpy as np
import vkbloom

exposures = iter(range(9))

def frame():
    renderer.apply(np.zeros((8, 8, 3), np.float32), vkbloom.Separable(exposure=next(exposures)))

def attempt(call, lesser):
    os.environ["VKBLOOM_LESSER"] = lesser
    try:
        call()
    except BaseException as error:
        print(type(error).__name__, error)
    else:
        print("nothing")

renderer = vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True)
attempt(frame, "")
attempt(frame, "patience")
attempt(frame, "")
attempt(frame, "")
attempt(frame, "patience")
attempt(renderer.close, "patience")
attempt(renderer.close, "")
print(renderer.closed)
"""


def test_an_interruption_is_raised_before_what_validation_says(layer: Path, name: str) -> None:
    """Regression: the ValidationError replaced the exception of the signal handler, a
    SystemError."""
    done = run(layer, name, "", ("-c", INTERRUPTED))
    assert done.returncode == 0, done.stderr
    lines = [line.split(" (")[0].strip() for line in done.stdout.splitlines()]
    objection = "ValidationError an objection"
    assert lines == [
        *("nothing", "KeyboardInterrupt", objection, "nothing"),
        *("KeyboardInterrupt", "KeyboardInterrupt", objection, "True"),
    ]


# Sizes that change; then surfaces without an area, out of date, or of another size. Prints which
# frames were shown, and by how much the last one differs from the result.
RENEWED = """
import os
import glfw
import vkbloom
from tests.core.windows import UFO, difference, open_window, settle
from vkbloom._renderer.surface import Surface

window = open_window((64, 36))
with vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True) as renderer:
    with Surface(renderer, window) as surface:
        for side in (64, 80, 64, 96):
            glfw.set_window_size(window, side, side)
            glfw.poll_events()
            for _ in range(3):
                surface.present(UFO, size=(32, 18))
        for side, lesser in enumerate(("area", "height", "date", "fit"), 64):
            glfw.set_window_size(window, side, 36)
            settle(window, (side, 36))
            shown = []
            for taken in (lesser, ""):
                os.environ["VKBLOOM_LESSER"] = taken
                shown += [surface.present(UFO, time=step / 3) for step in range(3)]
            expected = renderer.render(UFO, size=(side, 36), time=2 / 3)["final"]
            print(lesser, *shown, difference(expected))
glfw.terminate()
"""


def test_swapchains_are_renewed(layer: Path, name: str, display: dict[str, str]) -> None:
    """Also: the new one waits for presentations. The validation layer does not know of them; the
    layer of these tests does."""
    done = run(layer, name, "", ("-c", RENEWED), **display)
    assert done.returncode == 0, done.stderr
    hidden = "False False False True True True 0"
    assert done.stdout.splitlines() == [
        *(f"area {hidden}", f"height {hidden}", f"date {hidden}"),
        "fit True True True True True True 0",
    ]


# Presentations that never end, while the size changes or when the surface is closed.
ENDLESS = """
import contextlib
import os
import sys
import glfw
import vkbloom
from tests.core.windows import UFO, open_window, settle
from vkbloom._renderer.surface import Surface

window = open_window((64, 36))
renderer = vkbloom.Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True)
surface = Surface(renderer, window)
surface.present(UFO)
glfw.set_window_size(window, 80, 36)
settle(window, (80, 36))
os.environ["VKBLOOM_LESSER"] = "end"
calls = {"present": lambda: surface.present(UFO), "close": surface.close, "end": renderer.close}
for name in sys.argv[1:]:
    try:
        calls[name]()
    except vkbloom.Error as error:
        print(name, type(error).__name__, str(error).split(";")[0])
sys.stdout.flush()
os._exit(0)
"""


@pytest.mark.parametrize("first", ["present", "close"])
def test_waits_for_presentations_have_a_limit(
    layer: Path, name: str, display: dict[str, str], first: str
) -> None:
    program = ("-c", ENDLESS, first, "end")
    done = run(layer, name, "", program, VKBLOOM_TIMEOUT="0.2", **display)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        f"{first} DeviceLostError the device has not finished within 0.2 s",
        "end DeviceLostError the device is still busy",
    ]


def test_validation_sees_the_lesser_device(layer: Path, name: str) -> None:
    done = run(layer, name, "bindings", (*WORK, "whole"))
    assert "VUID-VkPipelineLayoutCreateInfo" in done.stdout
    assert "maxPerStageDescriptorUniformBuffers limit (0)" in done.stdout


# Prints which of several equal GPUs each choice opens, or its error, where CUDA sees some of them.
CHOICES = """
import json, os, vkbloom
def opened(visible, choice):
    os.environ["CUDA_VISIBLE_DEVICES"] = visible or ""
    if visible is None:
        del os.environ["CUDA_VISIBLE_DEVICES"]
    try:
        with vkbloom.Renderer(choice) as renderer:
            return f"{renderer.info.uuid[:2]} {renderer.info.pci} {renderer.info.type}"
    except (ValueError, vkbloom.Error) as error:
        return type(error).__name__ + ": " + str(error)
print(json.dumps([opened(*one) for one in json.loads(os.environ["CHOICES"])]))
"""
FIRST, SECOND = "a0 0000:3f:00.0", "a1 0000:3e:00.0"


NONE = "AdapterNotFoundError: "
#: What is taken away: what CUDA sees, a choice, and what it opens, or its error.
EQUAL: dict[str, list[tuple[str | None, str, str]]] = {
    "gpus": [
        (None, "auto", FIRST),
        (None, "hardware", FIRST),
        (None, "uuid:GPU-A1a1a1a1-a1a1-a1a1", SECOND),
        (None, "uuid:a0", FIRST),
        (None, "pci:00000000:3E:00.0", SECOND),
        (None, "pci:3f:00.0", FIRST),
        (None, "uuid:ff", f"{NONE}.*uuid:a1a1a1a1-a1a1-a1a1-a1a1-a1a1a1a1a1a1, "),
        (None, "pci:3f:00", f"{NONE}.*0000:3e:00.0"),
        (None, "uuid:", NONE),
        (None, "llvmpipe", '.*: "llvmpipe" fits several .*a0a0.*a1a1.*"uuid:a0a0'),
        # By address, since the GPUs have one name.
        *(("0", choice, SECOND) for choice in ("auto", "hardware", "llvmpipe")),
        ("0", "uuid:a0", FIRST),
        ("1,0", "auto", FIRST),
        ("1,0", "llvmpipe", FIRST),
        ("GPU-a1a1a1", "auto", SECOND),
        ("GPU-a1a1a1", "hardware", SECOND),
        ("7", "hardware", f"{NONE}.*CUDA_VISIBLE_DEVICES names; found: .*a1a1"),
        ("", "hardware", f"{NONE}.*CUDA_VISIBLE_DEVICES"),
        ("-1", "hardware", f"{NONE}.*CUDA_VISIBLE_DEVICES"),
    ],
    # An adapter whose query fails hides no other. Its address is not known, and it does not open.
    "gpus,query": [
        (None, "uuid:a1", SECOND),
        (None, "pci:3e:00.0", SECOND),
        (None, "pci:3f:00.0", f"{NONE}.*a0a0.*a1a1"),
        (None, "uuid:a0", "OutOfMemoryError: vkEnumerateDeviceExtensionProperties failed"),
    ],
    # A driver that is not conformant comes last.
    "conformance": [
        (None, "auto", ".* cpu"),
        (None, "software", ".* cpu"),
        (None, "hardware", ".* discrete"),
    ],
}


@pytest.mark.parametrize("lesser", EQUAL)
def test_equal_gpus(layer: Path, tmp_path: Path, lesser: str) -> None:
    """The software adapter twice, as two devices."""
    manifests = lavapipes()
    second = tmp_path / "second.json"
    second.write_text(manifests[0].read_text())
    drivers = os.pathsep.join((str(manifests[0]), str(second)))
    variables = {
        "VK_DRIVER_FILES": drivers,
        "VK_ICD_FILENAMES": drivers,
        "VKBLOOM_DRIVER": "system",
        "VKBLOOM_ADAPTER": "",
        "CHOICES": json.dumps([row[:2] for row in EQUAL[lesser]]),
        "VK_INSTANCE_LAYERS": "VK_LAYER_VKBLOOM_lesser_device",
    }
    done = run(layer, "", lesser, ("-c", CHOICES), **variables)
    assert done.returncode == 0, done.stderr
    for row, found in zip(EQUAL[lesser], json.loads(done.stdout), strict=True):
        assert re.match(row[2], found), (row, found)
