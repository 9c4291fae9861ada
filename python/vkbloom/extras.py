"""Imports of the optional packages, which say what to install where one is missing."""

from __future__ import annotations

import importlib
from types import ModuleType

__all__ = ["import_extra"]


def import_extra(package: str, extra: str, purpose: str) -> ModuleType:
    """Import a package that one of vkbloom's extras brings.

    Parameters
    ----------
    package : str
        Its name, such as "OpenImageIO".
    extra : str
        The extra that installs it, such as "images".
    purpose : str
        What needs it, as the subject of the message.

    Returns
    -------
    module
        The package.

    Raises
    ------
    ModuleNotFoundError
        If it is missing; the message gives the command that installs it.
    """
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{purpose} needs {package}: pip install vkbloom[{extra}]", name=error.name
        ) from error
