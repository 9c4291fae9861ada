"""The custom methods that a page knows, whose files may change while it is open."""

from __future__ import annotations

import os

from vkbloom import _core
from vkbloom._custom.method import CustomType, read_again, register
from vkbloom._settings.fields import fields_of
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import Settings


class CustomFiles:
    """The custom methods that a page knows, and the errors of their files."""

    def __init__(self) -> None:
        self._known = {name: METHODS[name] for name in METHODS if METHODS.is_added(name)}
        self._read: dict[str, tuple[tuple[int, int], ...]] = {}
        self._errors: dict[str, str] = {}

    def __bool__(self) -> bool:
        return bool(self._known)

    def changes(self) -> tuple[dict[str, type[Settings]], dict[str, str]]:
        """Load changed files again.

        Returns: the classes that are new since the last call, and the errors of all files that do
        not load, by the names of the methods. A method whose file does not load stays as it was.
        """
        new: dict[str, type[Settings]] = {}
        for name in self._known:
            self._load(name)
            if name in METHODS and METHODS[name] is not self._known[name]:
                new[name] = self._known[name] = METHODS[name]
        return new, self._errors

    def _load(self, name: str) -> None:
        """Load a method's file again if it is another than before."""
        kind = METHODS.get(name)
        if not isinstance(kind, CustomType) or not kind.file.source.files:
            return
        try:
            results = [os.stat(file) for file in kind.file.source.files]
            stamp = tuple((result.st_mtime_ns, result.st_size) for result in results)
            if self._read.get(name) == stamp:
                return
            self._read[name] = stamp
            source = read_again(kind.file.source)
            if source != kind.file.source:
                register(name, source, kind.numpy_reference)
            self._errors.pop(name, None)
        except (_core.Error, OSError, ValueError) as error:
            self._errors[name] = str(error)


def current(settings: Settings) -> Settings:
    """Return settings of a custom method as those of the class that is loaded now.

    Fields that the class does not have, or whose values it does not accept, are its defaults.
    """
    kind = METHODS.get(settings.method)
    if kind is None or isinstance(settings, kind):
        return settings
    begun: Settings = kind()
    for name in fields_of(kind):
        if hasattr(settings, name):
            try:
                begun = begun.replace(**{name: getattr(settings, name)})
            except (TypeError, ValueError):
                continue
    return begun
