"""The version of the installed package."""

from __future__ import annotations

import functools


@functools.cache
def installed_version() -> str:
    """Return the version of the installed package."""
    # Imported here because it takes a sixth of the package's import time.
    from importlib.metadata import version  # noqa: PLC0415

    return version("vkbloom")
