"""Prints the processor time of the test files that take the most, and of those over their budget.

The seconds are those of the test's process and of its children, so that other work on the machine
hardly changes them. A file over its budget is a warning and no failure, because machines differ:
make its tests smaller, or raise the budget with a reason.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Generator
from typing import Final

import pytest

#: Processor seconds of a file without an entry of its own.
USUAL: Final = 15
#: Processor seconds of files that need more: kills, walks over all faults, many methods.
BUDGET: Final[dict[str, int]] = {
    "bench/test_bench.py": 20,
    "cli/test_cli.py": 20,
    "cli/test_cli_apply.py": 20,
    "cli/test_doctor.py": 25,
    "core/test_batches.py": 35,
    "core/test_eviction.py": 20,
    "core/test_faults.py": 80,
    "core/test_handles.py": 20,
    "core/test_interruption.py": 20,
    "core/test_lesser_devices.py": 45,
    "core/test_lifetime.py": 35,
    "core/test_mutations.py": 25,
    "core/test_out_of_date.py": 20,
    "core/test_plans.py": 35,
    "core/test_readback.py": 20,
    "device/test_cuda_path.py": 25,
    "device/test_second_driver.py": 30,
    "docs/test_commands.py": 25,
    "docs/test_docs.py": 40,
    "docs/test_examples.py": 20,
    "docs/test_scripts.py": 45,
    "explorer/test_explorer_page.py": 45,
    "grid/test_grid.py": 30,
    "grid/test_grid_cluster.py": 30,
    "grid/test_grid_parts.py": 30,
    "grid/test_grid_store.py": 45,
    "methods/test_adjoint_glare.py": 40,
    "methods/test_adjoint_passes.py": 40,
    "methods/test_apply.py": 30,
    "methods/test_convolution.py": 25,
    "methods/test_engine_frames.py": 20,
    "methods/test_glare.py": 20,
    "methods/test_matrix.py": 45,
    "methods/test_one_sided.py": 30,
    "methods/test_presets.py": 20,
    "methods/test_torch.py": 25,
    "methods/test_variants.py": 25,
}

_PROPERTY: Final = "processor seconds"
_SHOWN: Final = 10


def _spent() -> float:
    return sum(os.times()[:4])


class TimeBudget:
    """Measures each test where it runs, and adds the seconds up by file where they are printed."""

    def __init__(self) -> None:
        self.began = 0.0
        self.seconds: defaultdict[str, float] = defaultdict(float)

    def pytest_runtest_logstart(self) -> None:
        self.began = _spent()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        if call.when == "teardown":
            report.user_properties.append((_PROPERTY, _spent() - self.began))
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
            budget = BUDGET.get(name, USUAL)
            line = f"{seconds:7.1f} of {budget:3d}  {name}"
            if seconds > budget:
                terminalreporter.write_line(f"{line}  WARNING: over its budget", yellow=True)
            elif place < _SHOWN:
                terminalreporter.write_line(line)
