"""Prints the processor time of the test files that take the most, and warns of long ones.

The seconds are those of the test's process and of its children. Other work on the machine changes
them less than the time on the clock: by up to a third where it shares cores. Mesa keeps compiled
shaders (`MESA_SHADER_CACHE_DIR`), so a first run takes several times as long: compare second ones.
It is a warning and no failure, because machines differ: make a file's tests smaller.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Generator
from typing import Final

import pytest

#: Processor seconds of a file, from which on a warning is printed.
BUDGET: Final = 40

_PROPERTY: Final = "processor seconds"
_SHOWN: Final = 10


def _spent_seconds() -> float:
    return sum(os.times()[:4])


class TimeBudget:
    """Measures each test where it runs, and adds the seconds up by file where they are printed."""

    def __init__(self) -> None:
        self.began = 0.0
        self.seconds: defaultdict[str, float] = defaultdict(float)

    def pytest_runtest_logstart(self) -> None:
        self.began = _spent_seconds()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        if call.when == "teardown":
            report.user_properties.append((_PROPERTY, _spent_seconds() - self.began))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        # Names such as "tests/core/test_plans.py::test_defaults", also from xdist's workers.
        name = report.nodeid.partition("::")[0].removeprefix("tests/")
        for key, value in report.user_properties:
            if key == _PROPERTY:
                assert isinstance(value, float)
                self.seconds[name] += value

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        terminalreporter.section(f"processor seconds, {sum(self.seconds.values()):.0f} in all")
        slowest = sorted(self.seconds.items(), key=lambda item: -item[1])
        for place, (name, seconds) in enumerate(slowest):
            line = f"{seconds:7.1f}  {name}"
            if seconds > BUDGET:
                terminalreporter.write_line(f"{line}  WARNING: too long", yellow=True)
            elif place < _SHOWN:
                terminalreporter.write_line(line)
