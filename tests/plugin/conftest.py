"""The fixture of tests that run pytest."""

from __future__ import annotations

import pytest


@pytest.fixture
def project(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A folder in which pytest runs with this plugin."""
    monkeypatch.delenv("SHIFT", raising=False)
    # The outer run's, which an inner one would take for its own.
    monkeypatch.delenv("PYTEST_XDIST_WORKER", raising=False)
    return pytester
