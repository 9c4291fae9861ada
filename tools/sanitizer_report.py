"""Fail where a sanitizer's log has an error, or a leak whose memory the core itself allocated.

CPython and other extension modules leave memory behind at exit, which LeakSanitizer reports with
stacks that may pass through the core; only a stack whose first frames lie in it is ours.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

# The sanitized core has debug information, so that its frames name their source. A frame that names
# the core's file alone lies past its end, in a driver that has been unloaded since.
OURS = re.compile(r" csrc/")
FRAMES = 3  # the allocator, the core's own allocation function, its caller


def findings(log: str) -> list[str]:
    """Return the parts of a log that the core must answer for."""
    found = []
    if "runtime error" in log or re.search(r"ERROR: AddressSanitizer", log):
        found.append(log)
    for leak in re.split(r"\n(?=(?:Direct|Indirect) leak of)", log)[1:]:
        frames = re.findall(r"^\s*#\d+ .*$", leak, re.MULTILINE)
        if any(OURS.search(frame) for frame in frames[:FRAMES]):
            found.append(leak)
    return found


def main(folder: Path) -> int:
    """Print what the logs of a folder hold against the core; 1 where there is something."""
    logs = sorted(folder.glob("*"))
    found = [part for log in logs for part in findings(log.read_text(errors="replace"))]
    print(f"sanitizers: {len(logs)} logs, {len(found)} findings in the core")
    for part in found:
        print(part)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
