"""Fail if a sanitizer's log has an error, or a leak of memory that the core itself allocated.

CPython and other extension modules leak memory at exit. LeakSanitizer reports it with stacks that
may pass through the core. A leak belongs to the core only if the first frames are in the core.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

# The sanitized core has debug information, so its frames name their source. A frame that names only
# the core's file is beyond its end, in a driver that was unloaded.
OURS = re.compile(r" csrc/")
FRAMES = 3  # the allocator, the core's own allocation function, its caller


def findings(log: str) -> list[str]:
    """Return the errors and leaks of the core in a log."""
    found = []
    if "runtime error" in log or re.search(r"ERROR: AddressSanitizer", log):
        found.append(log)
    for leak in re.split(r"\n(?=(?:Direct|Indirect) leak of)", log)[1:]:
        frames = re.findall(r"^\s*#\d+ .*$", leak, re.MULTILINE)
        if any(OURS.search(frame) for frame in frames[:FRAMES]):
            found.append(leak)
    return found


def main(folder: Path) -> int:
    """Print the errors and leaks of the core in a folder of logs; return 1 if there are any."""
    logs = sorted(folder.glob("*"))
    found = [part for log in logs for part in findings(log.read_text(errors="replace"))]
    print(f"sanitizers: {len(logs)} logs, {len(found)} findings in the core")
    for part in found:
        print(part)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
