"""The memory that this process can still allocate."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path
from typing import Final

if sys.platform != "win32":
    import resource

#: What helps where memory is short.
ADVICE: Final = (
    "raise the limit (ulimit -v), close other programs, or use less memory: half floats (--half), "
    "smaller bloom buffers (--bloom-scale), or smaller pictures"
)


def free_address_space() -> int | None:
    """Return the bytes below this process's limit of address space; None without a limit."""
    if sys.platform == "win32":
        return None
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return None
    used = 0
    with contextlib.suppress(OSError, ValueError):
        pages = Path("/proc/self/statm").read_text("ascii").split()[0]
        used = int(pages) * os.sysconf("SC_PAGE_SIZE")
    return max(limit - used, 0)


def free_memory() -> int | None:
    """Return the bytes that this process can still allocate; None if this is not known."""
    left = [] if (space := free_address_space()) is None else [space]
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
