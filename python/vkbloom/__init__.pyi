# The public names of the package; lazy_loader reads them, and imports what is asked for.
from . import psf, reference, testing
from ._antialiasing.bevy import BevyAntialiasing
from ._antialiasing.godot import GodotAntialiasing
from ._antialiasing.o3de import O3deAntialiasing
from ._antialiasing.unity import HdrpAntialiasing
from ._capture import capture
from ._core import (
    AdapterNotFoundError,
    DeviceLostError,
    Error,
    OutOfMemoryError,
    ShaderError,
    ValidationError,
)
from ._custom.method import load_method
from ._explorer import explore
from ._exposure.bevy import BevyExposure
from ._exposure.fixed import FixedExposure, KeyframedExposure
from ._exposure.godot import GodotExposure
from ._exposure.granite import GraniteExposure
from ._exposure.o3de import O3deExposure
from ._exposure.unity import HdrpExposure, PostProcessingExposure
from ._fit import FitResult, RecoveredPSF, fit, fit_pyramid, recover_psf, translate
from ._glare.dirt import Dirt
from ._glare.flares import Ghosts, Halo
from ._glare.streaks import Streaks
from ._gradients import vjp
from ._gradients.deglare import deglare
from ._grid.checking import GridReport, check_grid
from ._grid.grid import grid
from ._io.array_files import read, write
from ._methods.babylon import BabylonBloom
from ._methods.bevy import BevyBloom
from ._methods.blender import BlenderGlare
from ._methods.convolution import Convolution
from ._methods.darktable import DarktableBloom
from ._methods.filament import FilamentBloom
from ._methods.godot import GodotBloom
from ._methods.halation import Halation
from ._methods.kino import KinoBloom
from ._methods.mip_chain import DualKawase, Pyramid
from ._methods.playcanvas import PlayCanvasBloom
from ._methods.pmndrs import PmndrsBloom
from ._methods.pygfx import PygfxBloom
from ._methods.separable import Separable, gaussian_weights
from ._methods.three import ThreeBloom
from ._methods.unity import HdrpBloom, PostProcessingBloom, UrpBloom
from ._methods.unreal import UnrealBloom
from ._renderer.adapter import AdapterInfo, adapters
from ._renderer.default import apply, default_renderer, render
from ._renderer.device_arrays import DeviceArray
from ._renderer.frames import Frames
from ._renderer.image import Image
from ._renderer.plans import Plan
from ._renderer.renderer import Renderer
from ._scene import Camera, Scene
from ._sequence.sequence import Sequence, sequence
from ._settings.antialiasing import Antialiasing, antialiasing
from ._settings.exposure import Exposure, exposures
from ._settings.glare import Glare, glares
from ._settings.settings import Settings, presets

__all__ = [
    "AdapterInfo",
    "AdapterNotFoundError",
    "Antialiasing",
    "BabylonBloom",
    "BevyAntialiasing",
    "BevyBloom",
    "BevyExposure",
    "BlenderGlare",
    "Camera",
    "Convolution",
    "DarktableBloom",
    "DeviceArray",
    "DeviceLostError",
    "Dirt",
    "DualKawase",
    "Error",
    "Exposure",
    "FilamentBloom",
    "FitResult",
    "FixedExposure",
    "Frames",
    "Ghosts",
    "Glare",
    "GodotAntialiasing",
    "GodotBloom",
    "GodotExposure",
    "GraniteExposure",
    "GridReport",
    "Halation",
    "Halo",
    "HdrpAntialiasing",
    "HdrpBloom",
    "HdrpExposure",
    "Image",
    "KeyframedExposure",
    "KinoBloom",
    "O3deAntialiasing",
    "O3deExposure",
    "OutOfMemoryError",
    "Plan",
    "PlayCanvasBloom",
    "PmndrsBloom",
    "PostProcessingBloom",
    "PostProcessingExposure",
    "PygfxBloom",
    "Pyramid",
    "RecoveredPSF",
    "Renderer",
    "Scene",
    "Separable",
    "Sequence",
    "Settings",
    "ShaderError",
    "Streaks",
    "ThreeBloom",
    "UnrealBloom",
    "UrpBloom",
    "ValidationError",
    "adapters",
    "antialiasing",
    "apply",
    "capture",
    "check_grid",
    "default_renderer",
    "deglare",
    "explore",
    "exposures",
    "fit",
    "fit_pyramid",
    "gaussian_weights",
    "glares",
    "grid",
    "load_method",
    "presets",
    "psf",
    "read",
    "recover_psf",
    "reference",
    "render",
    "sequence",
    "testing",
    "translate",
    "vjp",
    "write",
]

__version__: str
