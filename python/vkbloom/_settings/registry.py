"""The registries of methods, stages of glare, exposures and anti-aliasing: their classes by name.

All parts of the package read a registry at the time of use, so that a class that is registered
later has options, controls, axes, fits and JSON like the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from vkbloom._lazy_modules import own_module
from vkbloom._settings.named import Named, T


class Registry(Named[type[Any]]):
    """Classes by name. Those of the package are imported on first use, since some import much."""

    def __init__(self, kind: str) -> None:
        super().__init__(kind, self._import)
        self._package = ""

    def supply(self, package: str, sources: Mapping[str, str]) -> None:
        """Set the classes of a package: "module:Class" by name; `package` is its ``__package__``.

        It is above this floor, and imports its own modules.
        """
        self._package = package
        self.fill(lambda: sources)

    def _import(self, entry: str | type[Any]) -> type[Any]:
        if isinstance(entry, type):
            return entry
        module, _, kind = entry.partition(":")
        return getattr(own_module(self._package, module), kind)  # type: ignore[no-any-return]

    def _object(self, name: str, entry: str | type[Any]) -> type[Any]:
        """Return the class of an entry. None is kept, since a registered class may be replaced."""
        return self._import(entry)

    def _rows(self) -> list[tuple[str, ...]]:
        return [
            (name, f"{self._package}.{entry}" if isinstance(entry, str) else entry.__name__, "")
            for name, entry in self._entries.items()
        ]

    def is_added(self, name: str) -> bool:
        """Return whether the class was added at run time."""
        return isinstance(self._entries.get(name), type)


class Methods(Registry):
    """The settings classes of the methods.

    Both changes assign a new mapping: other threads may be reading the old one. Two changes at once
    need the lock of their caller (`vkbloom._custom.method`).
    """

    def register(self, kind: type[Any]) -> None:
        """Add the class of a custom method, or replace one that was added."""
        self._filled = {**self._entries, kind.method: kind}

    def unregister(self, name: str) -> None:
        """Remove a class that was added, if it is there."""
        if self.is_added(name):
            self._filled = {other: kind for other, kind in self._entries.items() if other != name}


def _has_fields(settings: Any, row: Any) -> bool:
    """Whether settings have the method of a preset and what it sets, but for the intensity."""
    if settings.method != row.fields["method"]:
        return False
    made = row.make()
    return all(
        getattr(settings, name) == getattr(made, name) for name in {*row.fields} - {"intensity"}
    )


class Presets(Named[T]):
    """Settings by their published names."""

    def __init__(self) -> None:
        super().__init__("preset", lambda preset: preset.make())
        self._starts: dict[str, str] = {}

    def start(self, sources: str) -> str:
        """Return the preset that images, photographs or scenes start from if a call names none."""
        if sources not in self._starts:
            self._starts = {preset.starts: name for name, preset in self._entries.items()}
        return self._starts[sources]

    def descriptions(self) -> dict[str, str]:
        """Return what each preset looks like, by its name."""
        return {name: preset.what for name, preset in self._entries.items()}

    def engines(self) -> list[tuple[str, str]]:
        """Return the name of each preset, and whose it is."""
        return [(name, preset.engine) for name, preset in self._entries.items()]

    def expands(self, settings: Any) -> bool:
        """Whether photographs are expanded for settings: a preset's for which they are.

        The intensity, and fields that the preset does not set, may differ.
        """
        return any(_has_fields(settings, row) for row in self._entries.values() if row.expands)


#: The methods, which `vkbloom._methods` supplies, in the order of ``VKB_METHODS`` in the core.
METHODS: Final = Methods("method")
#: The point-spread functions of the package, which `vkbloom.psf` supplies: one of them renders, and
#: is defined above this floor.
FUNCTIONS: Final[Named[type[Any]]] = Named("psf", lambda kind: kind)
#: The stages of glare, which `vkbloom._glare` supplies.
STAGES: Final = Registry("glare")
#: The classes of exposure, which `vkbloom._exposure` supplies.
EXPOSURES: Final = Registry("exposure")
#: What `vkbloom.exposures` is, which `vkbloom._exposure` supplies.
NAMED_EXPOSURES: Final[Named[Any]] = Named("exposure", lambda entry: entry.make())
#: The classes of temporal anti-aliasing, which `vkbloom._antialiasing` supplies.
ANTIALIASINGS: Final = Registry("antialiasing")
#: What `vkbloom.antialiasing` is, which `vkbloom._antialiasing` supplies.
NAMED_ANTIALIASINGS: Final[Named[Any]] = Named("antialiasing", lambda entry: entry.make())
#: What `vkbloom.presets` and `vkbloom.glares` are, which `vkbloom._presets` supplies.
NAMED_SETTINGS: Final[Presets[Any]] = Presets()
NAMED_STAGES: Final[Named[Any]] = Named("glare", lambda glare: glare.stages)
