"""For a run without the core (make test-pure): a test that asks for a device is skipped.

What is left fails as usual. `MIN_PASSED` guards against a run in which nearly all is skipped.
"""

from __future__ import annotations

from collections.abc import Generator

import pytest

import vkbloom

MIN_PASSED = 300


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    reason = "core cannot be loaded"
    if report.failed and reason in str(report.longrepr):
        report.outcome = "skipped"
        report.longrepr = (str(item.path), 0, f"Skipped: vkbloom's {reason}")
    return report


def pytest_sessionfinish(session: pytest.Session) -> None:
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    passed = len(reporter.stats.get("passed", ())) if reporter else 0
    if passed < MIN_PASSED and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
        print(f"\nwithout the core {passed} tests passed, {MIN_PASSED} are expected")


def pytest_configure() -> None:
    assert not vkbloom.adapters(), "a core is here"
