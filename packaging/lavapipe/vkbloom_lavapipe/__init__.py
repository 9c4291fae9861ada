"""Mesa's lavapipe, a Vulkan driver for any CPU, as one library."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from vkbloom_lavapipe._build import LLVM, MESA, SHA256

__all__ = ["LIBRARY", "LLVM", "MESA", "SHA256"]

#: Where the driver is. It exports ``vk_icdNegotiateLoaderICDInterfaceVersion`` and
#: ``vk_icdGetInstanceProcAddr``, as the Vulkan loader's documentation describes them.
LIBRARY: Final = Path(__file__).parent / "libvulkan_lvp.so"
