"""The probes that the doctor runs in child processes: ``python -m vkbloom.doctor.probe <name>``.

Prints one line: `ANSWER_MARK`, then the answer as JSON, or ``{"failure": ...}``.
"""

from __future__ import annotations

import ctypes
import json
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

import vkbloom
from vkbloom import _core
from vkbloom.adapter import bundled_driver
from vkbloom.doctor import trial
from vkbloom.doctor.child import ANSWER_MARK

# The names that the core tries, in its order.
_LOADER_NAMES: Final = {
    "win32": ("vulkan-1.dll",),
    "darwin": ("libvulkan.dylib", "libvulkan.1.dylib", "libMoltenVK.dylib"),
}
_LINUX_LOADER_NAMES: Final = ("libvulkan.so.1", "libvulkan.so")


class _Symbol(ctypes.Structure):
    """Dl_info of dlfcn.h."""

    _fields_ = (
        ("file", ctypes.c_char_p),
        ("base", ctypes.c_void_p),
        ("name", ctypes.c_char_p),
        ("address", ctypes.c_void_p),
    )


class _Layer(ctypes.Structure):
    """VkLayerProperties of vulkan_core.h."""

    _fields_ = (
        ("name", ctypes.c_char * 256),
        ("spec_version", ctypes.c_uint32),
        ("implementation_version", ctypes.c_uint32),
        ("description", ctypes.c_char * 256),
    )


def _version(packed: int) -> str:
    """Unpack VK_MAKE_API_VERSION."""
    return f"{packed >> 22 & 0x7F}.{packed >> 12 & 0x3FF}.{packed & 0xFFF}"


def _open_loader() -> ctypes.CDLL:
    failures = []
    for name in _LOADER_NAMES.get(sys.platform, _LINUX_LOADER_NAMES):
        try:
            return ctypes.CDLL(name)
        except OSError as error:
            failures.append(str(error))
    raise OSError("; ".join(failures))


def _file_of(library: ctypes.CDLL) -> str:
    """Return the file that a library was opened from; "" if the system does not tell."""
    if sys.platform == "win32":
        return ""
    symbol = _Symbol()
    address = ctypes.cast(library.vkGetInstanceProcAddr, ctypes.c_void_p)
    found = ctypes.CDLL(None).dladdr(address, ctypes.byref(symbol))
    return symbol.file.decode(errors="replace") if found and symbol.file else ""


def _layers(library: ctypes.CDLL) -> dict[str, str]:
    """Return the versions of the layers that the loader lists, by name."""
    count = ctypes.c_uint32()
    if library.vkEnumerateInstanceLayerProperties(ctypes.byref(count), None):
        return {}
    layers = (_Layer * count.value)()
    if library.vkEnumerateInstanceLayerProperties(ctypes.byref(count), layers) < 0:
        return {}
    return {
        layer.name.decode(errors="replace"): _version(layer.spec_version)
        for layer in layers[: count.value]
    }


def loader() -> dict[str, Any]:
    """Return the Vulkan loader's file and version, and the versions of the layers by name."""
    library = _open_loader()
    version = ctypes.c_uint32(1 << 22)
    # Loaders of Vulkan 1.0 lack this function.
    if hasattr(library, "vkEnumerateInstanceVersion"):
        library.vkEnumerateInstanceVersion(ctypes.byref(version))
    return {
        "file": _file_of(library),
        "version": _version(version.value),
        "layers": _layers(library),
    }


def adapters() -> dict[str, Any]:
    """Return the adapters of the system's loader and of the bundled driver."""
    found: list[dict[str, Any]] = []
    reasons: list[str] = []
    for driver in dict.fromkeys(("", bundled_driver())):
        try:
            listed = _core.adapters(driver)
        except vkbloom.AdapterNotFoundError as error:
            reasons.append(_one_line(error))
            continue
        found += [
            {
                "name": name,
                "type": kind,
                "driver_info": driver_info,
                "driver_uuid": uuid.hex(),
                "bundled": bundled,
            }
            for name, kind, _, driver_info, _, uuid, bundled, *_ in listed
        ]
    if not found and reasons:
        return {"failure": "; ".join(reasons)}
    return {"adapters": found}


def render(adapter: str, validation: str) -> dict[str, Any]:
    """Make the test render, with the validation layer if `validation` is "validated"."""
    with vkbloom.Renderer(adapter, validation=validation == "validated") as renderer:
        start = time.perf_counter()
        frames = trial.render(renderer)
        return {
            "name": renderer.info.name,
            "summary": renderer.info.summary,
            "seconds": time.perf_counter() - start,
            "timings": dict(frames.timings),
            "differences": trial.differences(frames),
        }


_QUESTIONS: Final[Mapping[str, Callable[..., dict[str, Any]]]] = {
    "loader": loader,
    "adapters": adapters,
    "render": render,
}


def _one_line(error: Exception) -> str:
    """Return the message of an error in one line."""
    text = " ".join(str(error).split())
    if isinstance(error, vkbloom.AdapterNotFoundError):
        # The rest of the message advises to run the doctor, which is running.
        return text.partition(". ")[0]
    if text and isinstance(error, (vkbloom.Error, OSError)):
        return text
    return f"{type(error).__name__}: {text}"


def main() -> None:
    """Run the probe that the command line names and print its answer."""
    what, *arguments = sys.argv[1:]
    try:
        value = _QUESTIONS[what](*arguments)
    except Exception as error:
        # The doctor reports every error as a finding.
        value = {"failure": _one_line(error)}
    # Start a new line: a driver may have printed without one.
    print(f"\n{ANSWER_MARK}{json.dumps(value)}", flush=True)


if __name__ == "__main__":
    main()
