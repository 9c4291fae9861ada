"""File descriptors of this process."""

from __future__ import annotations

import os


def open_descriptors() -> int:
    """Count them, where there is /proc, without those of the driver's cache of compiled shaders.

    A thread of Mesa's writes its files whenever it comes round.
    """
    count = 0
    for name in os.listdir("/proc/self/fd"):
        try:
            count += "mesa_shader_cache" not in os.readlink(f"/proc/self/fd/{name}")
        except FileNotFoundError:  # closed by now, as the folder's own is
            continue
    return count
