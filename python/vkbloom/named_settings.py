"""Settings under their published names.

``docs/presets.md`` has the source and the formula of each, and the differences from its source.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

from vkbloom.methods.bevy import BevyBloom
from vkbloom.methods.blender import BlenderGlare
from vkbloom.methods.convolution import Convolution
from vkbloom.methods.filament import FilamentBloom
from vkbloom.methods.godot import GodotBloom
from vkbloom.methods.kino import KinoBloom
from vkbloom.methods.mip_chain import DualKawase, Pyramid
from vkbloom.methods.pygfx import PygfxBloom
from vkbloom.methods.separable import Separable
from vkbloom.methods.unity import HdrpBloom, UrpBloom
from vkbloom.methods.unreal import UnrealBloom
from vkbloom.psf.aperture import aperture, iris
from vkbloom.psf.eye import spencer
from vkbloom.psf.lens import harvey_shack
from vkbloom.psf.renderers import unreal
from vkbloom.suggestions import Named

if TYPE_CHECKING:
    from collections.abc import Mapping

    from vkbloom.settings import Settings


class Preset(NamedTuple):
    """Settings, what they look like, and whose they are."""

    settings: Settings
    what: str
    whose: str


#: The presets by name.
PRESETS: Final[Mapping[str, Preset]] = {
    "tutorial": Preset(
        Separable(), "nine taps across and down, in small buffers", "the forward system"
    ),
    "outline": Preset(
        Separable(first_tap=0, texel="x"),
        "the same, with a loop that starts at the centre, and steps of a texel of the width",
        "the outline system",
    ),
    "deferred": Preset(
        Separable(
            weights=(0.175713, 0.121703, 0.065984, 0.028002, 0.0093),
            loops=3,
            blur_scale=1.1,
            blur_strength=1.5,
        ),
        "nine weights with a sum below 1, in three loops",
        "the deferred HDR system",
    ),
    "jimenez2014": Preset(
        Pyramid(levels=6, radius=1.0, firefly_filter=True, composite="mix", intensity=0.04),
        "six levels with a filter of fireflies, mixed in with 0.04",
        "Jimenez, SIGGRAPH 2014; levels of LearnOpenGL @ a545a703f958",
    ),
    # In KWin, the six strengths with four iterations have evenly spaced offsets, 3 to 8.
    "dual_kawase": Preset(
        DualKawase(levels=4, offset=3 + 5 / 6),
        "one wide blur of the complete picture",
        "Bjorge, SIGGRAPH 2015; KDE/kwin @ 00a2faf64fbf, the tenth strength",
    ),
    "bevy_natural": Preset(
        BevyBloom(),
        "a soft glow of the complete picture, which keeps its energy",
        "Bevy 0.19, Bloom::NATURAL (bevyengine/bevy @ b56fc29d3016)",
    ),
    "kino": Preset(
        KinoBloom(), "a wide glow above a soft threshold", "keijiro/KinoBloom @ 0a04c43fa47d"
    ),
    "filament": Preset(
        FilamentBloom(),
        "a faint, wide glow of what is above 1, at low quality",
        "google/filament, Options.h @ 2fac13e154fb",
    ),
    "unity_urp": Preset(
        UrpBloom(),
        "a narrow glow above a soft threshold, with the intensity 1",
        "Unity URP, Bloom.cs @ a085de35f86e",
    ),
    "unity_hdrp": Preset(
        HdrpBloom(),
        "a glow of the complete picture, with Unity's intensity 0.2",
        "Unity HDRP, Bloom.cs @ 2084a9d19159",
    ),
    "threejs_unreal": Preset(
        UnrealBloom(),
        "five Gaussians of the complete picture, strength 1, threshold 0",
        "mrdoob/three.js, UnrealBloomPass since #31528 and #32517",
    ),
    "godot_4_5": Preset(
        GodotBloom(
            level_weights=(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0),
            intensity=0.8,
            composite="soft_light",
        ),
        "two levels of what is above 1, as soft light",
        "Godot up to 4.5, copy.glsl @ 0a5efd02df51",
    ),
    "godot_4_6": Preset(
        GodotBloom(), "three levels of what is above 1", "Godot from 4.6, copy.glsl @ 0a5efd02df51"
    ),
    "blender_bloom": Preset(
        BlenderGlare(),
        "a wide, smooth glow of what is above 1",
        "Blender 5.0, Glare node, Bloom, High",
    ),
    "blender_ghosts": Preset(
        BlenderGlare(type="ghosts"),
        "reflections in a lens of what is above 1",
        "Blender 5.0, Glare node, Ghosts, High",
    ),
    "blender_streaks": Preset(
        BlenderGlare(type="streaks"),
        "stars of four streaks of what is above 1",
        "Blender 5.0, Glare node, Streaks, High",
    ),
    "blender_simple_star": Preset(
        BlenderGlare(type="simple_star"),
        "small diagonal stars of what is above 1",
        "Blender 5.0, Glare node, Simple Star, High",
    ),
    "blender_sun_beams": Preset(
        BlenderGlare(type="sun_beams"),
        "beams from the centre of what is above 1",
        "Blender 5.0, Glare node, Sun Beams, High",
    ),
    "pygfx": Preset(
        PygfxBloom(),
        "six levels of the complete picture, added up, mixed in with 0.04",
        "pygfx/pygfx, bloom.py @ f5f8f72c",
    ),
    "spencer_photopic": Preset(
        Convolution(spencer(), boundary="edge", composite="mix"),
        "the glare of an eye by day",
        "Spencer et al., SIGGRAPH 1995",
    ),
    "blender_fog_glow": Preset(
        BlenderGlare(type="fog_glow"),
        "a fog around what is above 1",
        "Blender 5.0, Glare node, Fog Glow, High",
    ),
    # Not normalized, because the sums of the channels are the kernel's tint.
    "unreal_convolution": Preset(
        Convolution(unreal(aperture(iris(blades=6))), normalize=False, composite="mix"),
        "a star of six rays whose centre keeps its energy",
        "Unreal Engine's convolution bloom; the kernel of iris_6",
    ),
    "camera_lens": Preset(
        Convolution(harvey_shack(), boundary="edge", composite="mix", intensity=0.025),
        "the 2.5 % of the light that a lens of 14 surfaces scatters",
        "Ritt, Sensors 20(21):6308, 2020",
    ),
    "iris_6": Preset(
        Convolution(aperture(iris(blades=6)), boundary="edge", composite="mix"),
        "diffraction at an iris of six blades at f/8",
        "physical optics",
    ),
    "photo": Preset(
        BevyBloom(composite="add", threshold=1.0, knee=0.5),
        "a soft glow of highlights that --expand makes brighter; nothing becomes darker",
        "vkbloom, for pictures without values above 1; Bevy's chain",
    ),
}

#: Name to settings. ``vkbloom presets`` and ``docs/presets.md`` list what they are, with their
#: sources.
presets: Mapping[str, Settings] = MappingProxyType(
    Named("preset", {name: one.settings for name, one in PRESETS.items()})
)
