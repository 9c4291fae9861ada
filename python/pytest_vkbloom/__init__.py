"""vkbloom's pytest plugin: fixtures and options for tests of bloom and other rendered images.

It is a separate package because pytest imports its plugins on every run: vkbloom and NumPy are
imported only when a test requests a fixture.
"""

from __future__ import annotations

import shutil
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from vkbloom import Renderer
    from vkbloom.testing._regression import FrameRegression
    from vkbloom.testing._test_report import Record

__all__ = ["bloom_renderer", "frame_regression"]

_RECORDS = pytest.StashKey[list["Record"]]()
_RUN = pytest.StashKey["_Run"]()
# Attribute of a test's report, which carries its checks from an xdist worker to the controller.
_CHECKS = "vkbloom_checks"
_FOLDER = "bloom_references"
# Options that are set or not.
_FLAGS = {
    "update": "replace the references of failed checks, and write missing ones",
    "add": "write further references for failed checks, beside those of other machines",
    "allow-missing": "let checks without a reference pass",
    "hash": "references are hashes, for drivers that draw equal bits; every value must be equal",
}
# Options with a value: its name, its default, and the help.
_VALUES = {
    "adapter": ("NAME", "auto", 'adapter of bloom_renderer: "software", "hardware" or a name'),
    "report": ("DIR", None, "write an HTML page with all checks, and pictures of the failed ones"),
}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("vkbloom", "bloom and other rendered images")
    for name, text in _FLAGS.items():
        group.addoption(f"--bloom-{name}", action="store_true", help=text)
    for name, (metavar, default, text) in _VALUES.items():
        group.addoption(f"--bloom-{name}", metavar=metavar, default=default, help=text)


def pytest_configure(config: pytest.Config) -> None:
    """Check the options."""
    writes = config.getoption("bloom_update") or config.getoption("bloom_add")
    is_worker = hasattr(config, "workerinput")
    if writes and (is_worker or config.getoption("dist", "no") != "no"):
        raise pytest.UsageError(
            "--bloom-update and --bloom-add write files that all workers share; run without -n"
        )
    if config.getoption("bloom_update") and config.getoption("bloom_add"):
        raise pytest.UsageError(
            "--bloom-update and --bloom-add exclude each other; give one of them"
        )
    if config.getoption("bloom_report") == "":
        raise pytest.UsageError("--bloom-report: empty; give a folder")
    run = _Run(config)
    config.stash[_RUN] = run
    config.pluginmanager.register(run, "vkbloom-run")


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Tell an xdist worker the folder of the report's parts."""
    parts = node.config.stash[_RUN].parts
    node.workerinput["vkbloom_parts"] = None if parts is None else str(parts)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Attach the records of a test's checks to its report."""
    report = yield
    records = item.stash.get(_RECORDS, None)
    if records:
        setattr(report, _CHECKS, list(records))
        records.clear()
        if report.failed and (parts := item.config.stash[_RUN].parts) is not None:
            # A property of the JUnit report, and the line that CI systems read as an attachment.
            page = parts.parent / "index.html"
            item.user_properties.append(("bloom_report", str(page)))
            item.add_report_section("call", "stdout", f"[[ATTACHMENT|{page}]]\n")
    return report


@pytest.fixture(scope="session")
def bloom_renderer(pytestconfig: pytest.Config) -> Iterator[Renderer]:
    """Provide one `vkbloom.Renderer` per process, on the adapter of ``--bloom-adapter``."""
    from vkbloom import (  # noqa: PLC0415  costs start-up time, as all of vkbloom
        AdapterNotFoundError,
        Renderer,
    )

    try:
        renderer = Renderer(pytestconfig.getoption("bloom_adapter"))
    except AdapterNotFoundError as error:
        pytest.fail(str(error), pytrace=False)
    with renderer:
        yield renderer


@pytest.fixture
def frame_regression(request: pytest.FixtureRequest) -> FrameRegression:
    """Compare frames with references: see `vkbloom.testing.FrameRegression.check`.

    Examples
    --------
    A test that compares every framebuffer with its reference:

    >>> import numpy as np
    >>> import vkbloom
    >>> def test_blur(bloom_renderer, frame_regression):
    ...     image = np.full((16, 16, 4), 0.5, np.float32)
    ...     frame_regression.check(bloom_renderer.apply(image, vkbloom.Pyramid(levels=2)))
    """
    from vkbloom.testing._regression import (  # noqa: PLC0415  costs start-up time
        FrameRegression,
        Mode,
        name_of_test,
    )

    config, item = request.config, request.node
    return FrameRegression(
        folder=folder_of(item.path),
        test=item.nodeid,
        name=name_of_test(item.nodeid.partition("::")[2] or item.name),
        mode=Mode(
            update=config.getoption("bloom_update"),
            add=config.getoption("bloom_add"),
            allow_missing=config.getoption("bloom_allow_missing"),
            hashed=config.getoption("bloom_hash"),
            parts=config.stash[_RUN].parts,
        ),
        records=item.stash.setdefault(_RECORDS, []),
    )


def folder_of(module: Path) -> Path:
    """Return the folder with the references of a test module."""
    return module.parent / _FOLDER / module.stem


class _Run:
    """The state of a run's checks; registered as a separate plugin."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._worker_input: dict[str, Any] | None = getattr(config, "workerinput", None)
        self._records: list[Record] = []
        self._page: Path | None = None
        # Why the page could not be written.
        self._reason = ""
        wanted = config.getoption("bloom_report")
        self._report = None if wanted is None else config.invocation_params.dir / wanted
        self.parts = None if self._report is None else self._report / ".parts"
        if self._worker_input is not None:
            given = self._worker_input["vkbloom_parts"]
            self.parts = None if given is None else Path(given)
        elif self._report is not None and self.parts is not None:
            # Remove the parts that an interrupted run left.
            shutil.rmtree(self.parts, ignore_errors=True)
            try:
                self._report.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise pytest.UsageError(f"--bloom-report={wanted}: {error.strerror}") from error

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Collect the records of a report from this process or a worker."""
        self._records += getattr(report, _CHECKS, [])

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write the report; if that fails, the summary says so and the run goes on."""
        if self._report is None or self.parts is None or self._worker_input is not None:
            return
        from vkbloom.testing._test_report import write_report  # noqa: PLC0415  costs start-up time

        try:
            self._page = write_report(self._report, self.parts, self._records)
        except OSError as error:
            self._reason = f"{self._relative(self._report)} is not written: {error}"
            session.exitstatus = pytest.ExitCode.INTERNAL_ERROR

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """List written and missing references, and the report's path."""
        suffix = ".hashes" if self._config.getoption("bloom_hash") else ".json"
        lines = [
            f"{record['outcome']}: "
            f"{self._relative(Path(record['folder']) / record['name'])}{suffix}"
            for record in self._records
            if record["outcome"] in ("written", "missing")
        ]
        if self._page is not None:
            lines.append(f"report: {self._relative(self._page)}")
        if self._reason:
            lines.append(f"report: {self._reason}")
        if lines:
            terminalreporter.section("vkbloom")
            for line in lines:
                terminalreporter.write_line(line)

    def _relative(self, path: Path) -> str:
        """Shorten a path for the terminal."""
        base = self._config.invocation_params.dir
        return str(path.relative_to(base) if path.is_relative_to(base) else path)
