"""The registries of methods and of stages of glare: their classes by name.

All parts of the package read a registry at the time of use, so that a class that is registered
later has options, controls, axes, fits and JSON like the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final, Protocol

from vkbloom._settings.named import Named, T


class Reference(Protocol):
    """A module of `vkbloom.reference`: a method in NumPy.

    ``passes(source, settings)`` returns the framebuffers after the glow, in the order of the data
    flow; the last one is "bloom". `source` is a `vkbloom.reference._image.BlurInput`.
    ``gain(settings, size)`` returns the bloom of a flat image of 1; `size` is the width and height
    of the frame.

    A method with a composite of its own has ``composite(scene, light, settings, share)`` (as that
    of `vkbloom.reference._blending`), and ``slope(scene, settings)``, if its largest derivative by
    the light is not 1. ``strength(settings)`` is the factor of a bloom that has more than the
    intensity.
    """

    passes: Any
    gain: Any


def _imported(source: str | type[Any]) -> type[Any]:
    if isinstance(source, type):
        return source
    module, _, kind = source.partition(":")
    return getattr(import_module(module), kind)  # type: ignore[no-any-return]


class Registry(Named[type[Any]]):
    """Classes by name. Those of the package are imported on first use, since some import much."""

    def __init__(self, kind: str) -> None:
        super().__init__(kind, _imported)

    def supply(self, package: str, sources: Mapping[str, str]) -> None:
        """Set the classes of a package: "module:Class" by name."""
        entries = {name: f"{package}.{source}" for name, source in sources.items()}
        self.fill(lambda: entries)

    def _object(self, name: str, entry: str | type[Any]) -> type[Any]:
        """Return the class of an entry. None is kept, since a registered class may be replaced."""
        return _imported(entry)

    def _rows(self) -> list[tuple[str, ...]]:
        return [
            (name, entry if isinstance(entry, str) else entry.__name__, "")
            for name, entry in self._entries.items()
        ]

    def is_added(self, name: str) -> bool:
        """Return whether the class was added at run time."""
        return isinstance(self._entries.get(name), type)


class Methods(Registry):
    """The settings classes of the methods, and the methods in NumPy.

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

    def reference(self, name: str) -> Reference:
        """Return a method of the package in NumPy; raise KeyError for a custom one."""
        if not isinstance(self._entries[name], str):
            raise KeyError(name)
        module: Any = import_module(f"vkbloom.reference._{name}")
        return module  # type: ignore[no-any-return]


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


#: The methods, which `vkbloom._methods` supplies, in the order of ``VKB_METHODS`` in the core.
METHODS: Final = Methods("method")
#: The stages of glare, which `vkbloom._glare` supplies.
STAGES: Final = Registry("glare")
#: What `vkbloom.presets` and `vkbloom.glares` are, which `vkbloom._presets` supplies.
NAMED_SETTINGS: Final[Presets[Any]] = Presets()
NAMED_STAGES: Final[Named[Any]] = Named("glare", lambda glare: glare.stages)
