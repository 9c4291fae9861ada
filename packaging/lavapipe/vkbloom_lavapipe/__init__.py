"""Mesa's lavapipe, a Vulkan driver for any CPU, as one library."""

from __future__ import annotations

import ctypes
import os
import platform
from pathlib import Path
from typing import Final

from vkbloom_lavapipe._build import LLVM, MESA, SHA256

__all__ = ["LIBRARY", "LLVM", "MANIFEST", "MESA", "SHA256", "activate", "environment"]

#: Where the driver is. It exports ``vk_icdNegotiateLoaderICDInterfaceVersion`` and
#: ``vk_icdGetInstanceProcAddr``, as the Vulkan loader's documentation describes them.
LIBRARY: Final = Path(__file__).parent / "libvulkan_lvp.so"
#: The driver's manifest, which the Vulkan loader reads.
MANIFEST: Final = LIBRARY.with_name("lvp_icd.json")
# With instructions that every CPU of x86-64 since 2011 has, and vectors of four numbers, Mesa
# generates the same code on all of them.
_FROZEN: Final = {"GALLIUM_OVERRIDE_CPU_CAPS": "sse4.1", "LP_NATIVE_VECTOR_WIDTH": "128"}
# In place of the system's loader, where there is none.
_LOADER: Final = LIBRARY.parent / "loader" / "libvulkan.so.1"


def environment(*, frozen: bool = False) -> dict[str, str]:
    """Return the environment variables with which Vulkan programs use this driver alone.

    `frozen`: with the same code on every x86-64 CPU with SSE4.1, and so the same bits. Without it,
    the code uses what the CPU has, and is faster. Raises RuntimeError on a CPU without SSE4.1.
    """
    # Loaders before 1.3.207 know only the second.
    found = dict.fromkeys(("VK_DRIVER_FILES", "VK_ICD_FILENAMES"), str(MANIFEST))
    if not _has_loader():
        folders = [str(_LOADER.parent), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
        found["LD_LIBRARY_PATH"] = ":".join(folders)
    if frozen:
        if not _has_sse4_1():
            raise RuntimeError("frozen: this CPU has no SSE4.1, so its bits are its own")
        found.update(_FROZEN)
    return found


def activate(*, frozen: bool = False) -> None:
    """Let this process and those that it starts use this driver; call it before Vulkan is used.

    `frozen`: as of `environment`.
    """
    has_loader = _has_loader()
    os.environ.update(environment(frozen=frozen))
    if not has_loader:
        # The name of a loaded library is not searched for again.
        ctypes.CDLL(str(_LOADER), mode=ctypes.RTLD_GLOBAL)


def _has_sse4_1() -> bool:
    """Return False on an old CPU of x86-64; others have no such instructions to choose from."""
    if platform.machine() != "x86_64":
        return True
    try:
        # QEMU shows the flags of the machine; Mesa asks the emulated CPU.
        return " sse4_1 " in Path("/proc/cpuinfo").read_text()
    except OSError:
        return True


def _has_loader() -> bool:
    try:
        ctypes.CDLL("libvulkan.so.1")
    except OSError:
        return False
    return True
