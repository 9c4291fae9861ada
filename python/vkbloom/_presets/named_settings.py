"""Settings under their published names.

``docs/presets.md`` has the source and the formula of each, and the differences from its source.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from vkbloom._settings.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Mapping


#: Whose the presets are, in the order of lists.
Engine = Literal[
    "Samples in C++",
    "Unreal Engine",
    "Unity",
    "Godot",
    "Bevy",
    "Filament",
    "three.js",
    "Babylon.js",
    "PlayCanvas",
    "pygfx",
    "Blender",
    "Film",
    "Optics",
    "Articles",
    "vkbloom",
]
#: How a preset was confirmed (docs/presets.md). "frames": by pictures that the engine's own shaders
#: drew. "binary": by the program itself. "formula": the source alone.
Confirmed = Literal["frames", "binary", "formula"]


class Preset(NamedTuple):
    """Settings as `Settings.from_dict` reads them, what they look like, and whose they are.

    - `starts`: The sources that start from the preset if a call gives no settings: "images" whose
      highlights are stored, "photographs", which are files of integers for SDR, or "scenes".
    - `expands`: Whether the highlights of photographs are expanded for it.
    """

    fields: Mapping[str, Any]
    what: str
    whose: str
    engine: Engine
    confirmed: Confirmed
    starts: Literal["images", "photographs", "scenes", ""] = ""
    expands: bool = False

    def make(self) -> Settings:
        """Return the settings; only now is their method imported."""
        return Settings.from_dict(self.fields)


#: An iris as a mapping of JSON, since point-spread functions cost start-up time.
_IRIS_6: Final = {"psf": "aperture", "mask": {"blades": 6}}


def _star(rays: int, angle: float, **further: Any) -> Mapping[str, Any]:
    """Return settings whose small lights have rays.

    Only "screen" has none of the surround. Large intensities would magnify steps of other formats.
    """
    star = {"psf": "star", "rays": rays, "angle": angle, "surround": 1.5}
    return {
        **{"method": "convolution", "psf": star | further, "normalize": False},
        **{"composite": "screen", "threshold": 0.9, "knee": 0.15},
        "format": "rgba32float",
    }


#: The presets by name.
PRESETS: Final[Mapping[str, Preset]] = {
    "tutorial": Preset(
        {"method": "separable"},
        "nine taps across and down, in small buffers",
        "the forward system",
        engine="Samples in C++",
        confirmed="binary",
        starts="scenes",
    ),
    "outline": Preset(
        {"method": "separable", "first_tap": 0, "texel": "x"},
        "the same, with a loop that starts at the centre, and steps of a texel of the width",
        "the outline system",
        engine="Samples in C++",
        confirmed="formula",
    ),
    "deferred": Preset(
        {
            "method": "separable",
            "weights": (0.175713, 0.121703, 0.065984, 0.028002, 0.0093),
            "loops": 3,
            "blur_scale": 1.1,
            "blur_strength": 1.5,
        },
        "nine weights with a sum below 1, in three loops",
        "the deferred HDR system",
        engine="Samples in C++",
        confirmed="formula",
    ),
    "jimenez2014": Preset(
        {
            "method": "pyramid",
            "levels": 6,
            "radius": 1.0,
            "firefly_filter": True,
            "composite": "mix",
            "intensity": 0.04,
        },
        "six levels with a filter of fireflies, mixed in with 0.04",
        "Jimenez, SIGGRAPH 2014; levels of LearnOpenGL @ a545a703f958",
        engine="Articles",
        confirmed="formula",
    ),
    # In KWin, the six strengths with four iterations have evenly spaced offsets, 3 to 8.
    "dual_kawase": Preset(
        {"method": "dual_kawase", "levels": 4, "offset": 3 + 5 / 6},
        "one wide blur of the complete picture",
        "Bjorge, SIGGRAPH 2015; KDE/kwin @ 00a2faf64fbf, the tenth strength",
        engine="Articles",
        confirmed="formula",
    ),
    "bevy_natural": Preset(
        {"method": "bevy"},
        "a soft glow of the complete picture, which keeps its energy",
        "Bevy 0.19, Bloom::NATURAL (bevyengine/bevy @ b56fc29d3016)",
        engine="Bevy",
        confirmed="frames",
        starts="images",
    ),
    "kino": Preset(
        {"method": "kino"},
        "a wide glow above a soft threshold",
        "keijiro/KinoBloom @ 0a04c43fa47d",
        engine="Unity",
        confirmed="frames",
    ),
    "filament": Preset(
        {"method": "filament"},
        "a faint, wide glow of what is above 1, at low quality",
        "google/filament, Options.h @ 2fac13e154fb",
        engine="Filament",
        confirmed="frames",
    ),
    "unity_urp": Preset(
        {"method": "urp"},
        "a narrow glow above a soft threshold, with the intensity 1",
        "Unity URP 17, Bloom.cs @ a085de35f86e",
        engine="Unity",
        confirmed="frames",
    ),
    "unity_hdrp": Preset(
        {"method": "hdrp"},
        "a glow of the complete picture, with Unity's intensity 0.2",
        "Unity HDRP, Bloom.cs @ 2084a9d19159",
        engine="Unity",
        confirmed="frames",
    ),
    "threejs_unreal": Preset(
        {"method": "three"},
        "five Gaussians of the complete picture, strength 1, threshold 0",
        "mrdoob/three.js, UnrealBloomPass since #31528 and #32517",
        engine="three.js",
        confirmed="frames",
    ),
    "threejs_r187": Preset(
        {"method": "three", "variant": "r187"},
        "the same with samples of two taps",
        "mrdoob/three.js r187, UnrealBloomPass since #34479",
        engine="three.js",
        confirmed="frames",
    ),
    "threejs_node": Preset(
        {"method": "three", "variant": "node", "intensity": 1.0},
        "the same for WebGPU, without the factor 3",
        "mrdoob/three.js, BloomNode.js @ 07e4c12b3840",
        engine="three.js",
        confirmed="frames",
    ),
    "unity_urp_kawase": Preset(
        {"method": "urp", "filter": "kawase"},
        "a narrow glow at half of the size",
        "Unity URP 17, Bloom.shader, filter Kawase",
        engine="Unity",
        confirmed="frames",
    ),
    "unity_urp_dual": Preset(
        {"method": "urp", "filter": "dual"},
        "the smallest level, enlarged",
        "Unity URP 17, Bloom.shader, filter Dual",
        engine="Unity",
        confirmed="frames",
    ),
    "unity_ppv2": Preset(
        {"method": "post_processing"},
        "a sum of levels of what is above 1",
        "Unity-Technologies/PostProcessing @ 32c3155207d3",
        engine="Unity",
        confirmed="frames",
    ),
    "unreal": Preset(
        {"method": "unreal"},
        "six Gaussians of the complete picture, up to wider than it",
        "Epic Games, Bloom (Unreal Engine 4.27), by its documentation",
        engine="Unreal Engine",
        confirmed="formula",
    ),
    "halation": Preset(
        {"method": "halation"},
        "film as measured: a faint red glow and softness; film_halation is stronger",
        "andreavolpato/agx-emulsion @ 0e0baf2e3dd5",
        engine="Film",
        confirmed="frames",
    ),
    "pmndrs": Preset(
        {"method": "pmndrs"},
        "eight levels of what is above 1, as a screen",
        "pmndrs/postprocessing @ 69c61a640078 (6.39.0)",
        engine="three.js",
        confirmed="frames",
    ),
    "babylon": Preset(
        {"method": "babylon"},
        "one Gaussian of what is above a hard threshold",
        "BabylonJS/Babylon.js, bloomEffect.ts @ 05c105649f04",
        engine="Babylon.js",
        confirmed="frames",
    ),
    "playcanvas": Preset(
        {"method": "playcanvas"},
        "the sum of all levels of the complete picture",
        "playcanvas/engine 2.23, frame-pass-bloom.js @ 1f7213d06f78",
        engine="PlayCanvas",
        confirmed="frames",
    ),
    "godot_4_5": Preset(
        {
            "method": "godot",
            "level_weights": (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0),
            "intensity": 0.8,
            "composite": "soft_light",
        },
        "two levels of what is above 1, as soft light",
        "Godot up to 4.5, copy.glsl @ 0a5efd02df51",
        engine="Godot",
        confirmed="frames",
    ),
    "godot_4_6": Preset(
        {"method": "godot"},
        "three levels of what is above 1",
        "Godot from 4.6, copy.glsl @ 0a5efd02df51",
        engine="Godot",
        confirmed="frames",
    ),
    "blender_bloom": Preset(
        {"method": "blender"},
        "a wide, smooth glow of what is above 1",
        "Blender 5.0, Glare node, Bloom, High",
        engine="Blender",
        confirmed="binary",
    ),
    "blender_ghosts": Preset(
        {"method": "blender", "type": "ghosts"},
        "reflections in a lens of what is above 1",
        "Blender 5.0, Glare node, Ghosts, High",
        engine="Blender",
        confirmed="binary",
    ),
    "blender_streaks": Preset(
        {"method": "blender", "type": "streaks"},
        "stars of four streaks of what is above 1",
        "Blender 5.0, Glare node, Streaks, High",
        engine="Blender",
        confirmed="binary",
    ),
    "blender_simple_star": Preset(
        {"method": "blender", "type": "simple_star"},
        "small diagonal stars of what is above 1",
        "Blender 5.0, Glare node, Simple Star, High",
        engine="Blender",
        confirmed="binary",
    ),
    "blender_sun_beams": Preset(
        {"method": "blender", "type": "sun_beams"},
        "beams from the centre of what is above 1",
        "Blender 5.0, Glare node, Sun Beams, High",
        engine="Blender",
        confirmed="binary",
    ),
    "pygfx": Preset(
        {"method": "pygfx"},
        "six levels of the complete picture, added up, mixed in with 0.04",
        "pygfx/pygfx, bloom.py @ f5f8f72c",
        engine="pygfx",
        confirmed="binary",
    ),
    "spencer_photopic": Preset(
        {"method": "convolution", "composite": "mix"},
        "the glare of an eye by day",
        "Spencer et al., SIGGRAPH 1995",
        engine="Optics",
        confirmed="formula",
    ),
    "blender_fog_glow": Preset(
        {"method": "blender", "type": "fog_glow"},
        "a fog around what is above 1",
        "Blender 5.0, Glare node, Fog Glow, High",
        engine="Blender",
        confirmed="binary",
    ),
    # Not normalized, because the sums of the channels are the kernel's tint.
    "unreal_convolution": Preset(
        {
            "method": "convolution",
            "psf": {"psf": "unreal", "image": _IRIS_6},
            "normalize": False,
            "composite": "mix",
        },
        "a star of six rays whose centre keeps its energy",
        "Unreal Engine's convolution bloom; the kernel of iris_6",
        engine="Unreal Engine",
        confirmed="formula",
    ),
    "camera_lens": Preset(
        {
            "method": "convolution",
            "psf": {"psf": "harvey_shack"},
            "composite": "mix",
            "intensity": 0.025,
        },
        "the 2.5 % of the light that a lens of 14 surfaces scatters",
        "Ritt, Sensors 20(21):6308, 2020",
        engine="Optics",
        confirmed="formula",
    ),
    "iris_6": Preset(
        {"method": "convolution", "psf": _IRIS_6, "composite": "mix"},
        "diffraction at an iris of six blades at f/8",
        "physical optics",
        engine="Optics",
        confirmed="formula",
    ),
    "photo": Preset(
        {"method": "bevy", "composite": "add", "threshold": 1.0, "knee": 0.5},
        "a soft glow of highlights that --expand makes brighter; nothing becomes darker",
        "vkbloom, for pictures without values above 1; Bevy's chain",
        engine="vkbloom",
        confirmed="formula",
        starts="photographs",
        expands=True,
    ),
    "mist": Preset(
        {"method": "bevy", "low_frequency_boost": 0.9, "intensity": 0.15},
        "a mist filter: wide glows around lights, and softer contrast",
        "vkbloom, for photographs; Bevy's chain",
        engine="vkbloom",
        confirmed="formula",
        expands=True,
    ),
    "soft": Preset(
        {
            **{"method": "bevy", "low_frequency_boost": 0.7, "high_pass_frequency": 1.0},
            "intensity": 0.3,
        },
        "a soft-focus lens: a sharp picture in its own soft glow",
        "vkbloom, for photographs; Bevy's chain",
        engine="vkbloom",
        confirmed="formula",
    ),
    "dreamy": Preset(
        {
            **{"method": "bevy", "low_frequency_boost": 0.65, "high_pass_frequency": 1.0},
            "intensity": 0.35,
        },
        "a dream: soft details in bright, wide glows",
        "vkbloom, for photographs; Bevy's chain",
        engine="vkbloom",
        confirmed="formula",
        expands=True,
    ),
    "film_halation": Preset(
        {
            **{"method": "halation", "strength": (1.2, 0.15, 0.015), "sizes": (600, 450, 300)},
            "intensity": 0.7,
        },
        "film without an anti-halation layer: red and orange rims around lights",
        "vkbloom, for photographs; the method of halation, stronger and wider",
        engine="vkbloom",
        confirmed="formula",
    ),
    "star4": Preset(
        {**_star(4, 45), "intensity": 36.0},
        "a star filter: four rays of small lights",
        "vkbloom, for photographs",
        engine="vkbloom",
        confirmed="formula",
    ),
    "star6": Preset(
        {**_star(6, 30), "intensity": 50.0},
        "a star filter: six rays of small lights",
        "vkbloom, for photographs",
        engine="vkbloom",
        confirmed="formula",
    ),
    "anamorphic": Preset(
        {
            **_star(2, 0, length=0.35, width=0.0012, tint=(0.35, 0.6, 1.0), surround=2.2),
            **{"threshold": 0.95, "knee": 0.1, "intensity": 80.0},
        },
        "an anamorphic lens: long blue streaks of small lights",
        "vkbloom, for photographs",
        engine="vkbloom",
        confirmed="formula",
    ),
}
