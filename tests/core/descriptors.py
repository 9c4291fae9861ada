"""File descriptors of this process."""

from __future__ import annotations

import os


def open_descriptors() -> int:
    """Count them if /proc exists, without those of the driver's shader cache.

    A thread of Mesa writes these files at any time.
    """
    count = 0
    for name in os.listdir("/proc/self/fd"):
        try:
            count += "mesa_shader_cache" not in os.readlink(f"/proc/self/fd/{name}")
        except FileNotFoundError:  # closed by now, as the folder's own is
            continue
    return count
