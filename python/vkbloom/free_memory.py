"""The memory that this process can still allocate."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path
from typing import Final

from vkbloom import _core

__all__ = ["ADVICE", "address_space_left", "check_for_driver", "memory_left", "shortage"]

#: What helps where memory is short.
ADVICE: Final = (
    "raise the limit (ulimit -v), close other programs, or use less memory: half floats (--half), "
    "smaller bloom buffers (--bloom-scale), or smaller pictures"
)
# Address space that opening a driver takes. lavapipe with LLVM 15 maps 400 to 700 MB, and ends the
# process if it cannot.
_DRIVER_BYTES: Final = 512 << 20


def address_space_left() -> int | None:
    """Return the bytes below this process's limit of address space; None without a limit."""
    if sys.platform == "win32":
        return None
    import resource  # noqa: PLC0415  not on Windows

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return None
    used = 0
    with contextlib.suppress(OSError, ValueError):
        pages = Path("/proc/self/statm").read_text("ascii").split()[0]
        used = int(pages) * os.sysconf("SC_PAGE_SIZE")
    return max(limit - used, 0)


def memory_left() -> int | None:
    """Return the bytes that this process can still allocate; None if this is not known."""
    left = [] if (space := address_space_left()) is None else [space]
    try:
        for line in Path("/proc/meminfo").read_text("ascii").splitlines():
            if line.startswith("MemAvailable:"):
                left.append(int(line.split()[1]) << 10)
    except OSError:
        if "SC_PHYS_PAGES" in getattr(os, "sysconf_names", ()):
            left.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    with contextlib.suppress(OSError, ValueError):
        # The limits of a container.
        most, used = (
            int(Path(f"/sys/fs/cgroup/memory.{name}").read_text("ascii"))
            for name in ("max", "current")
        )
        left.append(max(most - used, 0))
    return min(left, default=None)


def shortage() -> str:
    """Return that the limit of address space is too low for a driver; "" if it is not."""
    left = address_space_left()
    if left is None or left >= _DRIVER_BYTES:
        return ""
    return (
        f"memory is short: the process can allocate {left >> 20} MiB more, but opening a Vulkan "
        f"driver needs about {_DRIVER_BYTES >> 20} MiB"
    )


def check_for_driver() -> None:
    """Raise OutOfMemoryError where a driver could not be opened, since it might crash."""
    if said := shortage():
        raise _core.OutOfMemoryError(f"{said}; {ADVICE}")
