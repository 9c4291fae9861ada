"""Checks of files that a command will write, before the work whose results they hold."""

from __future__ import annotations

import errno
import os


def check_target(target: str) -> None:
    """Raise OSError if a file cannot be written."""
    if os.path.isdir(target):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), target)
    if os.path.exists(target) and not os.path.isfile(target):  # a pipe or a device
        return
    check_folder(target)
    if os.path.exists(target) and not os.access(target, os.W_OK):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), target)


def check_folder(target: str) -> None:
    """Raise OSError if no file can be written beside a target."""
    _check_existing(os.path.dirname(target) or ".", target)


def check_new_folder(target: str) -> None:
    """Raise OSError if no file can be written beside a target, in a folder that may be made."""
    folder = os.path.dirname(target) or "."
    # A missing folder is made with its first file.
    _check_existing(folder if os.path.lexists(folder) else os.path.dirname(folder) or ".", target)


def _check_existing(existing: str, target: str) -> None:
    if not os.path.isdir(existing):
        is_there = os.path.lexists(existing)
        code, name = (errno.ENOTDIR, existing) if is_there else (errno.ENOENT, target)
        raise OSError(code, os.strerror(code), name)
    if not os.access(existing, os.W_OK | os.X_OK):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), existing)
