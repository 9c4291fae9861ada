"""A store that was written without an interruption."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.grid.stores import make


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    store = tmp_path_factory.mktemp("grid") / "whole.zarr"
    make(store)
    return store
