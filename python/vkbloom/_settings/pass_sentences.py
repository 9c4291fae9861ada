"""What each pass does, in one sentence: shown in plans, contact sheets and the explorer.

A sentence belongs to a name of passes, whose numbers are left out: "down" is that of ``down_0``. A
method's class replaces those that it computes otherwise (``_pass_sentences``), and those that
depend on its fields (``_pass_sentence``).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

HALVED_BY_13: Final = "halves the size with 13 taps, so that small lights do not flicker"
HALVED_BY_5: Final = "halves the size with five taps"
DOUBLED_BY_8: Final = "doubles the size with eight taps"
BLURRED_AT_ONCE: Final = "blurs along rows and columns at once, with N x N taps"
BLURRED_DOWN: Final = "blurs the smaller level along its columns, so that it is blurred along both"

_COMPLETE: Final = "takes the complete frame; the method applies its threshold later"
_ALL: Final = "takes the complete frame: without a threshold all of it glows"
_LIGHTS: Final = "draws the lights of the scene, which will glow"
_CUSTOM: Final = "is a pass of the method's own file"
# Passes that a custom method has in common with others.
_SHARED: Final = ("scene", "glow", "final", "albedo")

PASS_SENTENCES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "scene": "draws the picture without bloom",
        "albedo": "draws colours, normals, positions and depths of what is visible",
        "glow": "keeps the light that will glow: what is above the threshold",
        "exposure": "measures the brightness of the frame and adapts the exposure to it",
        "histogram": "adds the counts of all tiles of the frame",
        "histogram_tiles": "counts how many pixels of a tile have each brightness",
        "meter": "averages the brightness of the frame, level by level",
        "exposed": "multiplies the picture by the exposure",
        "exposed_emission": "multiplies the light that glows by the exposure",
        "exposed_picture": "multiplies the picture by the exposure",
        "resolved": "mixes the frame with the frames before: temporal anti-aliasing",
        "resolved_glow": "mixes the light that glows with that of the frames before",
        "history": "keeps the resolved frame for the next one",
        "history_glow": "keeps the resolved light for the next frame",
        "history_motion": "keeps where each pixel came from for the next frame",
        "weights": "multiplies the light by the share of one kernel at each place",
        "weighted": "transforms the light of one kernel to frequencies",
        "products": "multiplies light and kernels as frequencies and adds them",
        "product": "multiplies light and kernels as frequencies and adds them",
        "gathered": "transforms the light of one kernel back to pixels",
        "convolved": "blurs the light by the point-spread function",
        "tinted": "colours the light of a stage of glare",
        "highlights": "takes the bright light of a stage of glare",
        "glare_source": "takes the light that the stages of glare begin with",
        "frame": "takes the frame as the method's input",
        "bright": "keeps the pixels that are brighter than the threshold",
        "half": "halves the size of the frame with one sample a pixel",
        "reduced": "reduces the frame to the size of the first level",
        "down": "halves the size, so that a few taps reach twice as far",
        "down_across": "blurs the smaller level along its rows",
        "blur": BLURRED_AT_ONCE,
        "blur_vertical": "blurs along the columns, the first half of a blur in two passes",
        "blur_horizontal": "blurs along the rows",
        "kawase": "averages four samples at the corners of a square that grows from pass to pass",
        "star": "spreads bright light along two lines, from pixel to pixel",
        "ray": "spreads bright light along one ray, farther from pass to pass",
        "beams": "spreads bright light away from the sun",
        "beams_dark": "takes away what is too dark for beams",
        "ghost": "blurs the bright light that becomes ghosts",
        "ghost_down": "blurs the bright light of ghosts along its columns",
        "ghosts_of_blur": "mirrors the blurred light through the middle of the frame",
        "level": "halves the size, since a wide Gaussian needs no small pixels",
        "gaussian": "blurs a level with one of the Gaussians whose sum is the bloom",
        "gaussian_down": "blurs a level along its columns with one of the Gaussians",
        "sum": "enlarges the sum of the wider Gaussians and adds this one",
        "box": "averages along rows and columns again and again, which is nearly a Gaussian",
        "kernel": "transforms the point-spread function to frequencies, once for many frames",
        "spectrum": "transforms the light to frequencies, where any blur is one product",
        "up": "enlarges the smaller level and combines it with this one: wide and narrow glow",
        "bloom": "brings the blurred light to the size of the frame: what is added",
        "light": "adds what the stages of glare have made to the bloom",
        "glare_down": "halves the size for a stage of glare with 13 taps",
        "streaks": "spreads bright light along the rays of a star",
        "halo": "draws a ring around the middle of the frame from its bright light",
        "ghosts": "mirrors bright light through the middle of the frame, as lenses do",
        "dirty_light": "multiplies the light by a picture of dirt on the lens",
        "combined": "combines picture and bloom, whose brightness the exposure measures",
        "final": "combines picture and bloom, and applies exposure, tone map and encoding",
    }
)


def pass_sentence(settings: Settings, name: str, *, of_scene: bool, is_custom: bool) -> str:
    """Return the sentence of a pass by its name; "" if there is none.

    - `of_scene`: Whether the source is a scene, whose lights are drawn.
    - `is_custom`: Whether the method is a user's, whose passes have any names.
    """
    stem = re.sub(r"^\.|_?\d+", "", name)
    if is_custom and stem not in _SHARED:
        return _CUSTOM
    if stem == "glow" and (of_scene or settings.glow_note):
        return _LIGHTS if of_scene else _COMPLETE
    if stem == "glow" and settings.threshold is None:
        return _ALL
    return settings._pass_sentence(stem) or PASS_SENTENCES.get(stem, "")
