"""Mesa's lavapipe, a Vulkan driver for any CPU, as one library."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import Final

from vkbloom_lavapipe._build import LLVM, MESA, SHA256

__all__ = ["LIBRARY", "LLVM", "MANIFEST", "MESA", "SHA256", "activate", "environment"]

#: Where the driver is. It exports ``vk_icdNegotiateLoaderICDInterfaceVersion`` and
#: ``vk_icdGetInstanceProcAddr``, as the Vulkan loader's documentation describes them.
LIBRARY: Final = Path(__file__).parent / "libvulkan_lvp.so"
#: The driver's manifest, which the Vulkan loader reads.
MANIFEST: Final = LIBRARY.with_name("lvp_icd.json")
# In place of the system's loader, where there is none.
_LOADER: Final = LIBRARY.parent / "loader" / "libvulkan.so.1"


def environment() -> dict[str, str]:
    """Return the environment variables with which Vulkan programs use this driver alone."""
    # Loaders before 1.3.207 know only the second.
    found = dict.fromkeys(("VK_DRIVER_FILES", "VK_ICD_FILENAMES"), str(MANIFEST))
    if not _has_loader():
        folders = [str(_LOADER.parent), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
        found["LD_LIBRARY_PATH"] = ":".join(folders)
    return found


def activate() -> None:
    """Let this process and those that it starts use this driver; call it before Vulkan is used."""
    has_loader = _has_loader()
    os.environ.update(environment())
    if not has_loader:
        # The name of a loaded library is not searched for again.
        ctypes.CDLL(str(_LOADER), mode=ctypes.RTLD_GLOBAL)


def _has_loader() -> bool:
    try:
        ctypes.CDLL("libvulkan.so.1")
    except OSError:
        return False
    return True
