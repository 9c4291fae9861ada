"""With which settings, expansion and pixels the bloom of an image file starts.

The one rule for all doors: `vkbloom.apply` of a path, the commands, the explorer and the window.

========================================= ============== ==================
file                                      preset         expanded to
========================================= ============== ==================
integers for SDR (JPEG, PNG)              photo          4
integers for SDR with a gain map          photo          not
integers on the curves PQ and HLG, floats bevy_natural   not
========================================= ============== ==================

With settings that are given, the first kind is expanded if they start from a preset that is made
for it, such as photo or mist. An expansion that is given replaces this, such as that of --expand,
or of the file that the settings came from.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from vkbloom._io.alpha import multiply
from vkbloom._io.expansion import PHOTO_EXPANSION, expand_photograph
from vkbloom._io.image_file import read_picture
from vkbloom._io.picture import PHOTOGRAPHS, Highlights, Picture
from vkbloom._settings.fields import fields_of
from vkbloom._settings.settings import Settings, check_settings, presets

#: The preset of images whose highlights are stored.
PRESET_OF_IMAGES: Final = presets.start("images")
#: The preset of files of integers for SDR.
PRESET_OF_PHOTOS: Final = presets.start("photographs")
#: The preset of scenes.
PRESET_OF_SCENES: Final = presets.start("scenes")

_NONE: Final[Mapping[str, Any]] = MappingProxyType({})


class Start(NamedTuple):
    """Settings, and what the highlights of a photograph are expanded up to; None: they are not."""

    settings: Settings
    expand: float | None

    def develop(self, picture: Picture) -> Picture:
        """Return the picture whose pixels a renderer gets, of one that was decoded.

        The highlights of a photograph are expanded, and colours are multiplied by alpha if the
        settings give the bloom its own.
        """
        if self.expand is not None:
            picture = expand_photograph(picture, self.expand)
        if self.settings.alpha == "keep":
            return picture
        return multiply_by_alpha(picture)


def start_file(
    path: str | os.PathLike[str],
    settings: Settings | str | None = None,
    changes: Mapping[str, Any] = _NONE,
) -> tuple[Picture, Start]:
    """Return the decoded picture of an image file, and where it starts."""
    picture = read_picture(path)
    return picture, start_of(picture.highlights, settings, changes)


def start_of(
    highlights: Highlights | None,
    settings: Settings | str | None = None,
    changes: Mapping[str, Any] = _NONE,
    *,
    expand: float | None = None,
    amount: float = 1.0,
) -> Start:
    """Return where an image file with these highlights starts; None: a scene.

    `changes`: fields of the settings that are changed. `amount`: a factor of their strength; with
    0 a picture stays as it is.
    """
    if settings is None:
        settings = _default_preset(highlights)
    begun = check_settings(settings)
    changed = begun.replace(**changes) if changes else begun
    if expand is None and highlights is Highlights.CLIPPED:
        is_made_for_it = presets.expands(begun) or presets.expands(changed)
        expand = PHOTO_EXPANSION if is_made_for_it else None
    if amount != 1:
        changed = _scale_strength(changed, amount)
        # An expansion to 1 changes nothing.
        expand = expand if amount or expand is None else 1.0
    return Start(changed, expand)


def _scale_strength(settings: Settings, amount: float) -> Settings:
    """Return settings whose intensities are multiplied, as far as their ranges allow."""
    glare = tuple(_scale(stage, amount) for stage in settings.glare)
    scaled: Settings = _scale(settings.replace(glare=glare), amount)
    return scaled


def _scale(owner: Any, amount: float) -> Any:
    """Return settings or a stage of glare; dirt has no intensity."""
    info = fields_of(type(owner)).get("intensity")
    if info is None or info.range is None:
        return owner
    return replace(owner, intensity=min(owner.intensity * amount, info.range[1]))


def _default_preset(highlights: Highlights | None) -> str:
    if highlights is None:
        return PRESET_OF_SCENES
    return PRESET_OF_PHOTOS if highlights in PHOTOGRAPHS else PRESET_OF_IMAGES


def multiply_by_alpha(picture: Picture) -> Picture:
    """Return a decoded picture's colours multiplied by alpha, if its file has straight ones.

    The file that is written has straight ones again.
    """
    if not picture.has_straight:
        return picture
    return replace(picture, pixels=multiply(picture.pixels))
