"""Measure what a renderer leaves behind in memory, and how much of it is the driver's own.

Three things are repeated, and the growth of the process is shown in bytes for one repetition:

- ``device``: a bare Vulkan instance and device, created and destroyed through ctypes, with nothing
  of vkbloom in it;
- ``renderer``: a `vkbloom.Renderer`, created and closed;
- ``frame``: the same with one small frame of all framebuffers between.

Three sizes are taken, after a collection and a trim of the heap:

- ``heap``: bytes in use by malloc, of all libraries and of Python (whose own allocator is turned
  off), exact to the byte whatever the heap's fragmentation;
- ``data``: resident memory that is not executable, the heap with its gaps and all other mappings;
- ``code``: resident memory of anonymous executable mappings. The package makes none: it is what
  the driver compiled shaders to and did not give back.

Linux with glibc 2.33 or newer. Usage: ``python tools/renderer_memory.py [COUNT]``
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import sys
from collections.abc import Callable
from typing import ClassVar

import vkbloom

# One arena, so that memory does not wander between the heaps of threads; and all of Python's
# objects in it, so that they count by the byte.
ENVIRONMENT = {"PYTHONMALLOC": "malloc", "MALLOC_ARENA_MAX": "1"}

CPU = 4  # VK_PHYSICAL_DEVICE_TYPE_CPU

_Fields = ClassVar[list[tuple[str, type]]]


class _HeapInfo(ctypes.Structure):
    """struct mallinfo2 of <malloc.h>."""

    _fields_: _Fields = [
        (name, ctypes.c_size_t)
        for name in (
            "arena",
            "ordblks",
            "smblks",
            "hblks",
            "hblkhd",
            "usmblks",
            "fsmblks",
            "uordblks",
            "fordblks",
            "keepcost",
        )
    ]


class _InstanceCreateInfo(ctypes.Structure):
    """VkInstanceCreateInfo."""

    _fields_: _Fields = [
        ("type", ctypes.c_uint32),
        ("next", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("application", ctypes.c_void_p),
        ("layer_count", ctypes.c_uint32),
        ("layers", ctypes.c_void_p),
        ("extension_count", ctypes.c_uint32),
        ("extensions", ctypes.c_void_p),
    ]


class _QueueCreateInfo(ctypes.Structure):
    """VkDeviceQueueCreateInfo."""

    _fields_: _Fields = [
        ("type", ctypes.c_uint32),
        ("next", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("family", ctypes.c_uint32),
        ("count", ctypes.c_uint32),
        ("priorities", ctypes.c_void_p),
    ]


class _DeviceCreateInfo(ctypes.Structure):
    """VkDeviceCreateInfo."""

    _fields_: _Fields = [
        ("type", ctypes.c_uint32),
        ("next", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("queue_count", ctypes.c_uint32),
        ("queues", ctypes.c_void_p),
        ("layer_count", ctypes.c_uint32),
        ("layers", ctypes.c_void_p),
        ("extension_count", ctypes.c_uint32),
        ("extensions", ctypes.c_void_p),
        ("features", ctypes.c_void_p),
    ]


def sizes() -> dict[str, int]:
    """Return the sizes of this process in bytes, as the module describes them."""
    # CPython's cache of type attributes holds on to up to 4096 names until it is cleared.
    getattr(sys, "_clear_internal_caches", sys._clear_type_cache)()
    gc.collect()
    libc = ctypes.CDLL(None)
    libc.malloc_trim(0)
    libc.mallinfo2.restype = _HeapInfo
    heap = libc.mallinfo2()
    data = code = 0
    executable = anonymous = False
    with open("/proc/self/smaps") as mappings:
        for line in mappings:
            words = line.split()
            if not words[0].endswith(":"):
                executable, anonymous = "x" in words[1], words[4] == "0"
            elif words[0] == "Rss:" and executable and anonymous:
                code += int(words[1]) * 1024
            elif words[0] == "Rss:" and not executable:
                data += int(words[1]) * 1024
    return {"heap": heap.uordblks + heap.hblkhd, "data": data, "code": code}


def growth(action: Callable[[], None], count: int) -> dict[str, float]:
    """Return the bytes that one call of the action leaves behind, on the average of `count`."""
    # What the first calls build up once, in the loader, the driver and Python.
    for _ in range(max(10, count // 10)):
        action()
    before = sizes()
    for _ in range(count):
        action()
    after = sizes()
    return {name: (after[name] - before[name]) / count for name in before}


def _check(call: str, result: int) -> None:
    if result != 0:
        raise RuntimeError(f"{call} failed with {result}")


def bare_device() -> Callable[[], None]:
    """Return what makes and destroys an instance and a device of the software adapter."""
    vulkan = ctypes.CDLL("libvulkan.so.1")
    priority = ctypes.c_float(1.0)
    queue = _QueueCreateInfo(type=2, count=1, priorities=ctypes.addressof(priority))
    instance_info = _InstanceCreateInfo(type=1)
    device_info = _DeviceCreateInfo(type=3, queue_count=1, queues=ctypes.addressof(queue))

    def device_type(adapter: int | None) -> int:
        # VkPhysicalDeviceProperties: four 32-bit numbers, then the type; 824 bytes in all.
        properties = (ctypes.c_uint32 * 256)()
        vulkan.vkGetPhysicalDeviceProperties(ctypes.c_void_p(adapter), properties)
        return properties[4]

    def action() -> None:
        instance, device = ctypes.c_void_p(), ctypes.c_void_p()
        count = ctypes.c_uint32(32)
        adapters = (ctypes.c_void_p * 32)()
        _check(
            "vkCreateInstance",
            vulkan.vkCreateInstance(ctypes.byref(instance_info), None, ctypes.byref(instance)),
        )
        _check(
            "vkEnumeratePhysicalDevices",
            vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), adapters),
        )
        software = next(a for a in adapters[: count.value] if device_type(a) == CPU)
        _check(
            "vkCreateDevice",
            vulkan.vkCreateDevice(
                ctypes.c_void_p(software), ctypes.byref(device_info), None, ctypes.byref(device)
            ),
        )
        # The queue belongs to what the callers compare with; it needs no destruction.
        vulkan.vkGetDeviceQueue(device, 0, 0, ctypes.byref(ctypes.c_void_p()))
        vulkan.vkDestroyDevice(device, None)
        vulkan.vkDestroyInstance(instance, None)

    return action


def measure(count: int) -> dict[str, dict[str, float]]:
    """Return the growth for one repetition of each of the three things, of `count` each."""
    scene = vkbloom.Scene.ufo()

    def renderer() -> None:
        vkbloom.Renderer("software").close()

    def frame() -> None:
        with vkbloom.Renderer("software") as opened:
            opened.render(scene, size=(32, 32))

    return {
        "device": growth(bare_device(), count),
        "renderer": growth(renderer, count),
        "frame": growth(frame, max(1, count // 5)),
    }


def main() -> None:
    """Print the growths as JSON."""
    if any(os.environ.get(name) != value for name, value in ENVIRONMENT.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **ENVIRONMENT})
    print(json.dumps(measure(int(sys.argv[1]) if len(sys.argv) > 1 else 500), indent=1))


if __name__ == "__main__":
    main()
