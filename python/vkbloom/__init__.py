"""vkbloom: measure bloom.

A whole Vulkan bloom pipeline, on a GPU or on a CPU with Mesa's lavapipe, that gives back every
framebuffer as a NumPy array.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from vkbloom._core import (
    AdapterNotFoundError,
    DeviceLostError,
    Error,
    OutOfMemoryError,
    ShaderError,
    ValidationError,
)
from vkbloom.adapter import AdapterInfo, adapters
from vkbloom.explorer import explore
from vkbloom.frames import Frames
from vkbloom.glows import BlenderGlare, GodotBloom, PygfxBloom
from vkbloom.plans import Pass, Plan
from vkbloom.presets import presets
from vkbloom.published import BevyBloom, FilamentBloom, HdrpBloom, KinoBloom, UnrealBloom, UrpBloom
from vkbloom.renderer import Renderer
from vkbloom.settings import TUTORIAL, DualKawase, Pyramid, Separable, Settings, gaussian_weights
from vkbloom.version import installed_version

if TYPE_CHECKING:
    from vkbloom import reference
    from vkbloom.grid import reductions
    from vkbloom.grid.checking import GridReport, check_grid
    from vkbloom.grid.curves import response_curves
    from vkbloom.grid.sheet import contact_sheet
    from vkbloom.grid.zarr_grid import grid_to_zarr
    from vkbloom.io.array_files import read, write
    from vkbloom.scene import Camera, Scene

#: Of the installed package; looked up when it is asked for.
__version__: str

# Imported at the first use, because a program that gives images bloom needs none of them.
_LATE_MODULES = {
    "reductions": "vkbloom.grid.reductions",
    "reference": "vkbloom.reference",
    "scene": "vkbloom.scene",
}
_LATE = {
    "Camera": "vkbloom.scene",
    "GridReport": "vkbloom.grid.checking",
    "Scene": "vkbloom.scene",
    "check_grid": "vkbloom.grid.checking",
    "contact_sheet": "vkbloom.grid.sheet",
    "grid_to_zarr": "vkbloom.grid.zarr_grid",
    "read": "vkbloom.io.array_files",
    "response_curves": "vkbloom.grid.curves",
    "write": "vkbloom.io.array_files",
}

__all__ = [
    "TUTORIAL",
    "AdapterInfo",
    "AdapterNotFoundError",
    "BevyBloom",
    "BlenderGlare",
    "Camera",
    "DeviceLostError",
    "DualKawase",
    "Error",
    "FilamentBloom",
    "Frames",
    "GodotBloom",
    "GridReport",
    "HdrpBloom",
    "KinoBloom",
    "OutOfMemoryError",
    "Pass",
    "Plan",
    "PygfxBloom",
    "Pyramid",
    "Renderer",
    "Scene",
    "Separable",
    "Settings",
    "ShaderError",
    "UnrealBloom",
    "UrpBloom",
    "ValidationError",
    "adapters",
    "check_grid",
    "contact_sheet",
    "explore",
    "gaussian_weights",
    "grid_to_zarr",
    "presets",
    "read",
    "reductions",
    "reference",
    "response_curves",
    "write",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return installed_version()
    if name in _LATE_MODULES:
        return import_module(_LATE_MODULES[name])
    if name in _LATE:
        return getattr(import_module(_LATE[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
