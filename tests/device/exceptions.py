"""What a driver cannot do as the tests have it, with its cause, in one table.

test_second_driver.py shows the causes. Tests ask an adapter for what it has (abilities.py).
"""

from __future__ import annotations

import os
from typing import Final

#: By a part of the manifest's path and by the cause: names of tests, or of all parameters of one.
EXCEPTIONS: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    "swiftshader": {
        "it stores infinity in half floats as NaN": ("NaN and infinity: pyramid, float16",),
        "of a NaN in half floats, its rounding changes the next channel": (
            "test_values_that_are_not_finite[gpu-float16]",
        ),
        "a forked child has no threads of the driver: its first frame waits for them or crashes": (
            *("test_a_forked_child_opens_its_own", "test_a_forked_process"),
            "test_a_forked_worker_opens_a_renderer_of_its_own",
        ),
    }
}


def reason_against(test: str) -> str | None:
    """Return why a test cannot hold on the driver that the environment names; None: it can."""
    manifests = os.environ.get("VK_DRIVER_FILES", "")
    for driver, causes in EXCEPTIONS.items():
        for cause, tests in causes.items() if driver in manifests else ():
            if test in tests or test.partition("[")[0] in tests:
                return f"{driver}: {cause}"
    return None
