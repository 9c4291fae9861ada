"""The probes that the doctor runs in child processes: ``python -m vkbloom._doctor.probe <name>``.

Prints one line: `ANSWER_MARK`, then the answer as JSON, or ``{"failure": ...}``.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from typing import Any, Final

import numpy as np

from vkbloom import _core, reference
from vkbloom._c_paths import in_utf8
from vkbloom._doctor.child import ANSWER_MARK
from vkbloom._errors import AdapterNotFoundError, Error
from vkbloom._renderer.adapter import bundled_driver, from_core
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._settings.settings import check_settings

SETTINGS: Final = check_settings(None).replace(bloom_size=(32, 24))
# A rectangle in no place that a mirrored picture has one.
IMAGE: Final = np.zeros((48, 64, 3), np.uint8)
IMAGE[:20, :24] = (255, 128, 64)
# In levels of 255: half a level from rounding blur_vertical, times the gain 1.39 of the next pass;
# half a level from rounding its result; and one level at an edge from black to white, because the
# weights of a device's bilinear filter are accurate to 1/256.
_TOLERANCE: Final = 3.0


def differences(frames: Frames) -> list[str]:
    """Compare the framebuffers of `IMAGE` with those of `vkbloom.reference`."""
    expected = reference.apply(IMAGE, SETTINGS)
    results = {name: np.abs(frames[name] - 255.0 * array).max() for name, array in expected.items()}
    return [
        f"{name} differs by up to {difference:.3g}; {_TOLERANCE:g} is allowed"
        for name, difference in results.items()
        # Written this way, NaN counts as a difference.
        if not difference <= _TOLERANCE
    ]


def adapters(which: str) -> dict[str, Any]:
    """Return the adapters of the system's loader, and unless `which` is "system" the bundled."""
    results: list[dict[str, Any]] = []
    reasons: list[str] = []
    for driver in ("",) if which == "system" else dict.fromkeys(("", bundled_driver())):
        try:
            results += map(
                dataclasses.asdict, map(from_core, _core.adapters(in_utf8(driver) or driver))
            )
        except AdapterNotFoundError as error:
            reasons.append(_one_line(error))
    reason = "; ".join(reasons)
    return {"adapters": results, "reason": reason} if results or not reason else {"failure": reason}


def render(adapter: str) -> dict[str, Any]:
    """Make the test render."""
    with open_renderer(adapter) as renderer:
        info, results = renderer.info, differences(renderer.apply(IMAGE, SETTINGS))
        return {"name": info.name, "summary": info.summary, "differences": results}


def _one_line(error: Exception) -> str:
    """Return the message of an error in one line."""
    text = " ".join(str(error).split())
    if isinstance(error, AdapterNotFoundError):
        # The rest of the message advises to run the doctor, which is running.
        return text.partition(". ")[0]
    return text if isinstance(error, Error | OSError) else f"{type(error).__name__}: {text}"


def main() -> None:
    """Run the probe that the command line names and print its answer."""
    what, *arguments = sys.argv[1:]
    try:
        value = globals()[what](*arguments)
    except Exception as error:
        # The doctor reports every error as a finding.
        value = {"failure": _one_line(error)}
    # Start a new line: a driver may have printed without one.
    print(f"\n{ANSWER_MARK}{json.dumps(value)}", flush=True)


if __name__ == "__main__":
    main()
