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
from typing import Any, Final, NamedTuple

TIMEOUT: Final = 60.0
#: Python's option for a child process that runs no modules of the current folder (a json.py).
SAFE_PATH: Final = "-P"
#: Prefix of the line with a probe's answer: drivers and layers may print on stdout as well.
ANSWER_MARK: Final = "vkbloom-probe "


class Answer(NamedTuple):
    """The answer of a child process.

    - `value`: The findings; None if the process failed.
    - `failure`: Why the process failed, in one sentence; "" if it did not.
    - `messages`: The lines that the process wrote to standard error.
    """

    value: Mapping[str, Any] | None
    failure: str = ""
    messages: tuple[str, ...] = ()


def ask(*question: str, environment: Mapping[str, str] | None = None) -> Answer:
    """Run `vkbloom._doctor.probe` with arguments and return its answer."""
    try:
        ended = subprocess.run(
            [sys.executable, SAFE_PATH, "-m", "vkbloom._doctor.probe", *question],
            env={**os.environ, **(environment or {})},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Answer(None, f"no answer within {TIMEOUT:g} s")
    except OSError as error:
        return Answer(None, f"{sys.executable!r} does not start: {error.strerror}")
    messages = tuple(line for line in ended.stderr.splitlines() if line.strip())
    answers = [line for line in ended.stdout.splitlines() if line.startswith(ANSWER_MARK)]
    if ended.returncode or not answers:
        ending = f"with exit status {ended.returncode}"
        if ended.returncode < 0:
            ending = f"by signal {-ended.returncode} ({signal.strsignal(-ended.returncode)})"
        return Answer(None, f"the probe process ended without an answer, {ending}", messages)
    value: dict[str, Any] = json.loads(answers[0].removeprefix(ANSWER_MARK))
    return Answer(None if "failure" in value else value, value.get("failure", ""), messages)
