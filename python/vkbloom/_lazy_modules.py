"""Modules of a package that are imported by a name at the first use, since some import much."""

from __future__ import annotations

from importlib import import_module  # noqa: TID251  of the caller's own package alone
from types import ModuleType


def own_module(package: str, name: str) -> ModuleType:
    """Import a module of a package; `package` is the caller's ``__package__``."""
    return import_module(f"{package}.{name}")
