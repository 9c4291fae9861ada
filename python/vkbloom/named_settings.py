"""Settings under their published names.

``docs/presets.md`` has the source and the formula of each, and the differences from its source.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

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

if TYPE_CHECKING:
    from collections.abc import Mapping

    from vkbloom.settings import Settings


class _Presets(dict[str, "Settings"]):
    """Settings by name; the error for an unknown name lists the known ones."""

    def __missing__(self, name: object) -> Settings:
        # Imported here, since only the error needs it.
        import difflib  # noqa: PLC0415

        near = difflib.get_close_matches(str(name), self, n=1, cutoff=0.3)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise KeyError(f"unknown preset {name!r}; {hint}available: {', '.join(self)}")


#: Name to settings.
#:
#: - ``"tutorial"``: the forward system, 256 x 256 bloom buffers, nine taps.
#: - ``"outline"``: the same passes, with a loop that starts at the centre, and with a step of one
#:   texel of the width in both directions.
#: - ``"deferred"``: the nine weights of the deferred HDR system, whose sum is less than 1, in three
#:   loops. For ``shading="deferred"`` and for images.
#: - ``"jimenez2014"``: Jimenez, "Next Generation Post Processing in Call of Duty: Advanced
#:   Warfare", SIGGRAPH 2014; six levels as in LearnOpenGL's guest article on it
#:   (JoeyDeVries/LearnOpenGL @ a545a703f958), mixed in with the talk's 0.04.
#: - ``"dual_kawase"``: Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015, with the
#:   iterations and the offset of KWin's tenth strength (KDE/kwin @ 00a2faf64fbf,
#:   src/plugins/blur/blur.cpp).
#: - ``"bevy_natural"``: ``Bloom::NATURAL`` of bevyengine/bevy, tag v0.19.1 (b56fc29d3016),
#:   crates/bevy_post_process/src/bloom/settings.rs.
#: - ``"kino"``: keijiro/KinoBloom @ 0a04c43fa47d, Assets/Kino/Bloom/Bloom.cs, in high quality.
#: - ``"filament"``: google/filament, filament/include/filament/Options.h @ 2fac13e154fb, at its
#:   low quality; the strength is the intensity.
#: - ``"unity_urp"``: Unity-Technologies/Graphics, Packages/com.unity.render-pipelines.universal,
#:   Runtime/Overrides/Bloom.cs @ a085de35f86e, with an intensity of 1 (Unity's default is 0, off).
#: - ``"unity_hdrp"``: Unity-Technologies/Graphics,
#:   Packages/com.unity.render-pipelines.high-definition, Runtime/PostProcessing/Components/Bloom.cs
#:   @ 2084a9d19159, with an intensity of 0.2 (Unity's default is 0, off; HDRP uses 2^i - 1 of its
#:   intensity i).
#: - ``"threejs_unreal"``: mrdoob/three.js, examples/jsm/postprocessing/UnrealBloomPass.js since
#:   #31528 and #32517 (2025), with the defaults of its successor BloomNode: strength 1, radius
#:   and threshold 0.
#: - ``"godot_4_5"``, ``"godot_4_6"``: godotengine/godot, servers/rendering/renderer_rd/shaders/
#:   effects: copy.glsl @ 0a5efd02df51, tonemap.glsl @ 001c8c9c24dc, with the environment's defaults
#:   up to 4.5 and from 4.6 on.
#: - ``"blender_bloom"``, ``"blender_ghosts"``, ``"blender_streaks"``, ``"blender_simple_star"``,
#:   ``"blender_sun_beams"``, ``"blender_fog_glow"``: types of the Glare node of Blender 5.0 in
#:   quality High, with its defaults.
#: - ``"pygfx"``: pygfx/pygfx, pygfx/renderers/wgpu/engine/bloom.py @ f5f8f72c.
#: - ``"spencer_photopic"``: the glare of an eye by day, `vkbloom.psf.spencer`. The functions of
#:   ``"spencer_photopic"``, ``"unreal_convolution"`` and ``"iris_6"`` describe all light of a
#:   point, so that the bloom replaces the picture.
#: - ``"unreal_convolution"``: convolution bloom of Unreal Engine, with its prefilter and the
#:   energy of its centre, `vkbloom.psf.unreal`. The kernel image is that of ``"iris_6"``.
#: - ``"camera_lens"``: the scattered light of a lens with 14 surfaces, `vkbloom.psf.harvey_shack`,
#:   which is 2.5 % of all light.
#: - ``"photo"``: for pictures without values above 1, whose highlights ``vkbloom.read(...,
#:   expand=4)`` expands: Bevy's chain, added, with a soft threshold at 1. Nothing becomes darker.
#: - ``"iris_6"``: diffraction at an iris of six blades at f/8, `vkbloom.psf.aperture`.
presets: Mapping[str, Settings] = MappingProxyType(
    _Presets(
        {
            "tutorial": Separable(),
            "outline": Separable(first_tap=0, texel="x"),
            "deferred": Separable(
                weights=(0.175713, 0.121703, 0.065984, 0.028002, 0.0093),
                loops=3,
                blur_scale=1.1,
                blur_strength=1.5,
            ),
            "jimenez2014": Pyramid(
                levels=6, radius=1.0, firefly_filter=True, composite="mix", intensity=0.04
            ),
            # In KWin, the six strengths with four iterations have evenly spaced offsets, 3 to 8.
            "dual_kawase": DualKawase(levels=4, offset=3 + 5 / 6),
            "bevy_natural": BevyBloom(),
            "kino": KinoBloom(),
            "filament": FilamentBloom(),
            "unity_urp": UrpBloom(),
            "unity_hdrp": HdrpBloom(),
            "threejs_unreal": UnrealBloom(),
            "godot_4_5": GodotBloom(
                level_weights=(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0),
                intensity=0.8,
                composite="soft_light",
            ),
            "godot_4_6": GodotBloom(),
            "blender_bloom": BlenderGlare(),
            "blender_ghosts": BlenderGlare(type="ghosts"),
            "blender_streaks": BlenderGlare(type="streaks"),
            "blender_simple_star": BlenderGlare(type="simple_star"),
            "blender_sun_beams": BlenderGlare(type="sun_beams"),
            "pygfx": PygfxBloom(),
            "spencer_photopic": Convolution(spencer(), boundary="edge", composite="mix"),
            "blender_fog_glow": BlenderGlare(type="fog_glow"),
            # Not normalized, because the sums of the channels are the kernel's tint.
            "unreal_convolution": Convolution(
                unreal(aperture(iris(blades=6))), normalize=False, composite="mix"
            ),
            "camera_lens": Convolution(
                harvey_shack(), boundary="edge", composite="mix", intensity=0.025
            ),
            "iris_6": Convolution(aperture(iris(blades=6)), boundary="edge", composite="mix"),
            "photo": BevyBloom(composite="add", threshold=1.0, knee=0.5),
        }
    )
)
