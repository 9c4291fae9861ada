"""Import the optional packages, which vkbloom's extras install."""

from __future__ import annotations

import importlib
import signal
import threading
from types import ModuleType


def import_extra(package: str, extra: str, purpose: str) -> ModuleType:
    """Import a package that one of vkbloom's extras installs."""
    # Not the module of sys.modules as it is: another thread may just import it.
    try:
        return _import_before_interrupts(package)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{purpose} needs {package}: pip install vkbloom[{extra}]", name=error.name
        ) from error


def _import_before_interrupts(package: str) -> ModuleType:
    """Import a package; Ctrl-C raises after it.

    The modules of nanobind, OpenImageIO's among them, call Python while they are imported, and
    abort the process if that raises (OpenImageIO 3.2.2).
    """
    handler = signal.getsignal(signal.SIGINT)
    # Python runs signal handlers in the main thread alone.
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        return importlib.import_module(package)  # noqa: TID251  of others
    interrupts: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: interrupts.append(number))
    try:
        return importlib.import_module(package)  # noqa: TID251  of others
    finally:
        signal.signal(signal.SIGINT, handler)
        if interrupts:
            signal.raise_signal(signal.SIGINT)
