"""The registries of methods and of stages of glare: their classes by name.

All parts of the package read a registry at the time of use, so that a class that is registered
later has options, controls, axes, fits and JSON like the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final, Protocol

from vkbloom.suggestions import Named

__all__ = ["METHODS", "STAGES", "Methods", "Reference", "Registry"]


class Reference(Protocol):
    """A method in NumPy, such as the modules of `vkbloom.reference`.

    ``passes(source, settings)`` returns the framebuffers after the glow, in the order of the data
    flow; the last one is "bloom". `source` is a `vkbloom.reference.image.BlurInput`.
    ``gain(settings, size)`` returns the bloom of a flat image of 1; `size` is the width and height
    of the frame.
    """

    passes: Any
    gain: Any


def _imported(source: str | type[Any]) -> type[Any]:
    if isinstance(source, type):
        return source
    module, _, kind = source.partition(":")
    return getattr(import_module(module), kind)  # type: ignore[no-any-return]


class Registry(Named[type[Any]]):
    """Classes by name. Those of the package are imported on first use, since some import much.

    `places`: "module:Class" in `package`, by name.
    """

    def __init__(self, kind: str, package: str, places: Mapping[str, str]) -> None:
        sources = {name: f"{package}.{place}" for name, place in places.items()}
        super().__init__(kind, sources, _imported)

    def is_added(self, name: str) -> bool:
        """Return whether the class was added at run time."""
        return isinstance(self._entries.get(name), type)

    def class_named(self, name: str) -> type[Any] | None:
        """Return the class with this name in Python; None if there is none."""
        for key, source in self._entries.items():
            own = source.partition(":")[2] if isinstance(source, str) else source.__name__
            if own == name:
                return self[key]
        return None


class Methods(Registry):
    """The settings classes of the methods, and the methods in NumPy."""

    _references: Final[dict[str, Reference]]

    def __init__(self, kind: str, package: str, places: Mapping[str, str]) -> None:
        super().__init__(kind, package, places)
        self._references = {}

    def register(self, kind: type[Any], reference: Reference | None = None) -> None:
        """Add a class under its `method`, or replace one that was added."""
        name = kind.method
        if isinstance(self._entries.get(name), str):
            raise ValueError(f"method: {name!r} is a method of vkbloom; give another name")
        self.unregister(name)
        self._entries[name] = kind
        if reference is not None:
            self._references[name] = reference

    def unregister(self, name: str) -> None:
        """Remove a class that was added, if it is there."""
        if isinstance(self._entries.get(name), type):
            del self._entries[name]
            self._made.pop(name, None)
            self._references.pop(name, None)

    def has_reference(self, name: str) -> bool:
        """Return whether the method is there in NumPy."""
        return isinstance(self._entries.get(name), str) or name in self._references

    def reference(self, name: str) -> Reference:
        """Return a method in NumPy; raise KeyError if there is none."""
        if isinstance(self._entries.get(name), str):
            module: Any = import_module(f"vkbloom.reference.{name}")
            return module  # type: ignore[no-any-return]
        return self._references[name]


#: The methods. Their order is that of ``VKB_METHODS`` in the core.
METHODS: Final = Methods(
    "method",
    "vkbloom.methods",
    {
        "separable": "separable:Separable",
        "pyramid": "mip_chain:Pyramid",
        "dual_kawase": "mip_chain:DualKawase",
        "convolution": "convolution:Convolution",
        "bevy": "bevy:BevyBloom",
        "kino": "kino:KinoBloom",
        "filament": "filament:FilamentBloom",
        "urp": "unity:UrpBloom",
        "hdrp": "unity:HdrpBloom",
        "unreal": "unreal:UnrealBloom",
        "godot": "godot:GodotBloom",
        "blender": "blender:BlenderGlare",
        "pygfx": "pygfx:PygfxBloom",
    },
)
#: The stages of glare.
STAGES: Final = Registry(
    "glare",
    "vkbloom.glare",
    {
        "streaks": "streaks:Streaks",
        "ghosts": "flares:Ghosts",
        "halo": "flares:Halo",
        "dirt": "dirt:Dirt",
    },
)
