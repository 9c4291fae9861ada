"""Run code that may crash, such as a broken driver, in a child process and return its answer.

A driver is native code of another project: it can end the process that opens it, print to standard
output, or never return. In a child process each of these becomes an error message.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

TIMEOUT: Final = 60.0
#: Prefix of the line with a probe's answer: drivers and layers may print on stdout as well.
ANSWER_MARK: Final = "vkbloom-probe "
_OPEN_DRIVER: Final = "import ctypes, sys; ctypes.CDLL(sys.argv[1]).vk_icdGetInstanceProcAddr"


@dataclass(frozen=True)
class Answer:
    """The answer of a child process.

    - `value`: The findings; None if the process failed.
    - `failure`: Why the process failed, in one sentence; "" if it did not.
    - `messages`: The lines that the process wrote to standard error.
    """

    value: Mapping[str, Any] | None
    failure: str = ""
    messages: tuple[str, ...] = ()


def ask(*question: str, environment: Mapping[str, str] | None = None) -> Answer:
    """Run `vkbloom.doctor.probe` with arguments and return its answer."""
    ended = _run(["-m", "vkbloom.doctor.probe", *question], environment)
    if isinstance(ended, str):
        return Answer(None, ended)
    messages = tuple(line for line in ended.stderr.splitlines() if line.strip())
    if ended.returncode:
        return Answer(None, _ending(ended), messages)
    answers = [line for line in ended.stdout.splitlines() if line.startswith(ANSWER_MARK)]
    if not answers:
        return Answer(None, "the probe process ended without an answer", messages)
    value: dict[str, Any] = json.loads(answers[0].removeprefix(ANSWER_MARK))
    if "failure" in value:
        return Answer(None, value["failure"], messages)
    return Answer(value, messages=messages)


def why_driver_does_not_open(library: str) -> str:
    """Open a driver's library as the Vulkan loader would."""
    ended = _run(["-c", _OPEN_DRIVER, library], None)
    if isinstance(ended, str):
        return ended
    return _ending(ended) if ended.returncode else ""


def _run(
    arguments: list[str], environment: Mapping[str, str] | None
) -> subprocess.CompletedProcess[str] | str:
    """Return the finished process, or the reason why it did not finish."""
    if not sys.executable:
        return "sys.executable is empty, so no probe process was started"
    try:
        return subprocess.run(
            [sys.executable, *arguments],
            env={**os.environ, **(environment or {})},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {TIMEOUT:g} s"
    except OSError as error:
        return f"{sys.executable} does not start: {error.strerror}"


def _ending(ended: subprocess.CompletedProcess[str]) -> str:
    """Describe how a failed process ended."""
    if ended.returncode < 0:
        try:
            name = signal.Signals(-ended.returncode).name
        except ValueError:
            name = "unnamed"
        return f"the probe process was ended by signal {-ended.returncode} ({name})"
    lines = ended.stderr.strip().splitlines()
    # The last line of a Python traceback is "<type>: <message>".
    return lines[-1].partition(": ")[2] or lines[-1] if lines else f"exit {ended.returncode}"
