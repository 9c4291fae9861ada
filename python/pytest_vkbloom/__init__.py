"""vkbloom's pytest plugin: fixtures and options for tests of bloom and other rendered images.

It is a separate package because pytest imports its plugins on every run: vkbloom and NumPy are
imported only when a test requests a fixture.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from vkbloom import Renderer
    from vkbloom.testing._regression import FrameRegression

__all__ = ["bloom_renderer", "frame_regression"]

_WRITTEN = pytest.StashKey[list[Path]]()
_USED = pytest.StashKey["dict[Path, FrameRegression]"]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("vkbloom", "bloom and other rendered images")
    group.addoption(
        "--bloom-update", action="store_true", help="write references of failed and of new checks"
    )
    group.addoption(
        "--bloom-adapter",
        metavar="NAME",
        default="auto",
        help='adapter of bloom_renderer: "software", "hardware" or a name',
    )
    group.addoption(
        "--bloom-save", metavar="DIR", type=Path, help="write the images of failed checks to DIR"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Check the options."""
    is_shared = hasattr(config, "workerinput") or config.getoption("dist", "no") != "no"
    if config.getoption("bloom_update") and is_shared:
        raise pytest.UsageError(
            "--bloom-update writes files that all workers share; run without -n"
        )
    config.stash[_WRITTEN] = []
    config.stash[_USED] = {}


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """List the references that were written."""
    if not config.stash[_WRITTEN]:
        return
    terminalreporter.section("vkbloom")
    base = config.invocation_params.dir
    for file in config.stash[_WRITTEN]:
        shown = file.relative_to(base) if file.is_relative_to(base) else file
        terminalreporter.write_line(f"written: {shown}")


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
        name_of_test,
    )

    config, item = request.config, request.node
    save: Path | None = config.getoption("bloom_save")
    return FrameRegression(
        folder=item.path.parent / "bloom_references" / item.path.stem,
        name=name_of_test(item.nodeid.partition("::")[2] or item.name),
        update=config.getoption("bloom_update"),
        save=None if save is None else config.invocation_params.dir / save,
        written=config.stash[_WRITTEN],
        test=item.nodeid,
        used=config.stash[_USED],
    )
