"""vkbloom: measure bloom.

A complete Vulkan bloom pipeline that returns each of its framebuffers as a NumPy array. It runs on
a GPU, or on a CPU with Mesa's lavapipe.

Examples
--------
>>> image = np.zeros((16, 16, 4), np.uint8)
>>> image[8, 8] = 255
>>> with vkbloom.Renderer("software") as renderer:
...     frames = renderer.apply(image, vkbloom.Separable())
>>> list(frames)
['glow', 'blur_vertical', 'bloom', 'final']
>>> frames["final"].shape
(16, 16, 4)
"""

from __future__ import annotations

# typing.TYPE_CHECKING, whose import takes longer than that of this module.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any

    from vkbloom import psf, reference, testing
    from vkbloom._core import (
        AdapterNotFoundError,
        DeviceLostError,
        Error,
        OutOfMemoryError,
        ShaderError,
        ValidationError,
    )
    from vkbloom.adapter import AdapterInfo, adapters
    from vkbloom.device_arrays import DeviceArray
    from vkbloom.explorer import explore
    from vkbloom.fits import FitResult, fit, fit_pyramid, translate
    from vkbloom.frames import Frames
    from vkbloom.glare.base import Glare, GlareLight
    from vkbloom.glare.dirt import Dirt
    from vkbloom.glare.flares import Ghosts, Halo
    from vkbloom.glare.streaks import Streaks
    from vkbloom.grid import reductions
    from vkbloom.grid.checking import GridReport, check_grid
    from vkbloom.grid.curves import response_curves
    from vkbloom.grid.sheet import contact_sheet
    from vkbloom.grid.zarr_grid import grid_to_zarr
    from vkbloom.image import Image
    from vkbloom.io.array_files import read, write
    from vkbloom.large_files import apply_file
    from vkbloom.methods.bevy import BevyBloom
    from vkbloom.methods.blender import BlenderGlare
    from vkbloom.methods.convolution import Convolution
    from vkbloom.methods.filament import FilamentBloom
    from vkbloom.methods.godot import GodotBloom
    from vkbloom.methods.kino import KinoBloom
    from vkbloom.methods.mip_chain import DualKawase, Pyramid
    from vkbloom.methods.pygfx import PygfxBloom
    from vkbloom.methods.separable import TUTORIAL, Separable, gaussian_weights
    from vkbloom.methods.unity import HdrpBloom, UrpBloom
    from vkbloom.methods.unreal import UnrealBloom
    from vkbloom.named_glares import glares
    from vkbloom.named_settings import presets
    from vkbloom.own.method import load_method
    from vkbloom.plans import Pass, Plan
    from vkbloom.renderer import Renderer
    from vkbloom.scene import Camera, Scene
    from vkbloom.settings import Settings
    from vkbloom.surface import Surface

#: Version of the installed package, read from its metadata on first access.
__version__: str

# All is imported on first use: the command line must be able to answer Ctrl-C before NumPy is
# imported, and a program that only calls `apply` needs few of them. So are the classes of the
# registries. A module must not have the name of something else that is public: its import would
# take the name.
_LATE_MODULES = {
    "psf": "vkbloom.psf",
    "reductions": "vkbloom.grid.reductions",
    "reference": "vkbloom.reference",
    "scene": "vkbloom.scene",
    "testing": "vkbloom.testing",
}
_LATE = {
    "AdapterInfo": "vkbloom.adapter",
    "AdapterNotFoundError": "vkbloom._core",
    "Camera": "vkbloom.scene",
    "DeviceArray": "vkbloom.device_arrays",
    "DeviceLostError": "vkbloom._core",
    "DualKawase": "vkbloom.methods.mip_chain",
    "Error": "vkbloom._core",
    "FitResult": "vkbloom.fits",
    "Frames": "vkbloom.frames",
    "Glare": "vkbloom.glare.base",
    "GlareLight": "vkbloom.glare.base",
    "GridReport": "vkbloom.grid.checking",
    "Image": "vkbloom.image",
    "OutOfMemoryError": "vkbloom._core",
    "Pass": "vkbloom.plans",
    "Plan": "vkbloom.plans",
    "Pyramid": "vkbloom.methods.mip_chain",
    "Renderer": "vkbloom.renderer",
    "Scene": "vkbloom.scene",
    "Separable": "vkbloom.methods.separable",
    "Settings": "vkbloom.settings",
    "ShaderError": "vkbloom._core",
    "Surface": "vkbloom.surface",
    "TUTORIAL": "vkbloom.methods.separable",
    "ValidationError": "vkbloom._core",
    "adapters": "vkbloom.adapter",
    "apply_file": "vkbloom.large_files",
    "check_grid": "vkbloom.grid.checking",
    "contact_sheet": "vkbloom.grid.sheet",
    "explore": "vkbloom.explorer",
    "fit": "vkbloom.fits",
    "fit_pyramid": "vkbloom.fits",
    "gaussian_weights": "vkbloom.methods.separable",
    "glares": "vkbloom.named_glares",
    "grid_to_zarr": "vkbloom.grid.zarr_grid",
    "load_method": "vkbloom.own.method",
    "presets": "vkbloom.named_settings",
    "read": "vkbloom.io.array_files",
    "response_curves": "vkbloom.grid.curves",
    "translate": "vkbloom.fits",
    "write": "vkbloom.io.array_files",
}

__all__ = [
    "TUTORIAL",
    "AdapterInfo",
    "AdapterNotFoundError",
    "BevyBloom",
    "BlenderGlare",
    "Camera",
    "Convolution",
    "DeviceArray",
    "DeviceLostError",
    "Dirt",
    "DualKawase",
    "Error",
    "FilamentBloom",
    "FitResult",
    "Frames",
    "Ghosts",
    "Glare",
    "GlareLight",
    "GodotBloom",
    "GridReport",
    "Halo",
    "HdrpBloom",
    "Image",
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
    "Streaks",
    "Surface",
    "UnrealBloom",
    "UrpBloom",
    "ValidationError",
    "adapters",
    "apply_file",
    "check_grid",
    "contact_sheet",
    "explore",
    "fit",
    "fit_pyramid",
    "gaussian_weights",
    "glares",
    "grid_to_zarr",
    "load_method",
    "presets",
    "psf",
    "read",
    "reductions",
    "reference",
    "response_curves",
    "testing",
    "translate",
    "write",
]


def __getattr__(name: str) -> Any:
    from importlib import import_module  # noqa: PLC0415  see _LATE

    if name in _LATE_MODULES:
        return import_module(_LATE_MODULES[name])
    if name in _LATE:
        return getattr(import_module(_LATE[name]), name)
    if name == "__version__":
        version: str = import_module("vkbloom.version").installed_version()
        return version
    if name[:1].isupper():
        registry = import_module("vkbloom.registry")
        kind = registry.METHODS.class_named(name) or registry.STAGES.class_named(name)
        if kind is not None:
            return kind
    deprecations = import_module("vkbloom.deprecations")
    if (renamed := deprecations.NAMES.get(name)) is not None:
        new = renamed._replace(new=f"vkbloom.{renamed.new}")
        deprecations.warn(f"vkbloom.{name}", new)
        return getattr(import_module(__name__), renamed.new)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
