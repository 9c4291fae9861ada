"""The settings class of each method, a module for each engine, as in ``csrc/methods``.

Parameters of engines have the names, defaults and ranges of their sources. Methods of engines start
from the complete frame (``bloom_scale`` is 1 in scenes, too), reduce it by their own rules, and
apply the threshold where their source does. So ``glow`` is the input of the method, not the result
of the threshold. Their buffers are half floats unless ``format`` is set, since the buffers of the
sources are floats.

`vkbloom._settings.registry.METHODS` has the order of the methods.
"""

from __future__ import annotations

from vkbloom._settings.registry import METHODS

METHODS.supply(
    __package__,
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
        "three": "three:ThreeBloom",
        "godot": "godot:GodotBloom",
        "blender": "blender:BlenderGlare",
        "pygfx": "pygfx:PygfxBloom",
        "post_processing": "unity:PostProcessingBloom",
        "unreal": "unreal:UnrealBloom",
        "halation": "halation:Halation",
        "pmndrs": "pmndrs:PmndrsBloom",
        "babylon": "babylon:BabylonBloom",
        "playcanvas": "playcanvas:PlayCanvasBloom",
        "darktable": "darktable:DarktableBloom",
    },
)
