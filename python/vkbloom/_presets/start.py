"""With which settings, expansion and pixels the bloom of an image file starts.

The one rule for all doors: `vkbloom.apply` of a path, the commands, the explorer and the window.

========================================= ============== ==================
file                                      preset         expanded to
========================================= ============== ==================
integers for SDR (JPEG, PNG)              photo          4
integers for SDR with a gain map          photo          not
integers on the curves PQ and HLG, floats bevy_natural   not
========================================= ============== ==================

With settings that are given, the first kind is expanded if they start from the preset photo, which
is made for it. An expansion that is given replaces this, such as that of --expand, or of the file
that the settings came from.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from vkbloom._io.array_files import premultiplied
from vkbloom._io.expansion import PHOTO_EXPANSION, expanded
from vkbloom._io.images import Highlights, Picture
from vkbloom._settings.settings import Settings, check_settings, presets

#: The preset of images whose highlights are stored.
PRESET_OF_IMAGES: Final = presets.start("images")
#: The preset of files of integers for SDR.
PRESET_OF_PHOTOS: Final = presets.start("photographs")
#: The preset of scenes.
PRESET_OF_SCENES: Final = presets.start("scenes")

_DEFAULTS: Final[Mapping[Highlights | None, str]] = {
    Highlights.CLIPPED: PRESET_OF_PHOTOS,
    Highlights.MAPPED: PRESET_OF_PHOTOS,
    Highlights.STORED: PRESET_OF_IMAGES,
    None: PRESET_OF_SCENES,
}
_NONE: Final[Mapping[str, Any]] = MappingProxyType({})
# What makes a glow that needs the expansion. The other fields may differ.
_OF_PHOTOS: Final = ("method", "composite", "threshold", "knee")


class Start(NamedTuple):
    """Settings, and what the highlights of a photograph are expanded up to; None: they are not."""

    settings: Settings
    expand: float | None


def start_of(
    highlights: Highlights | None,
    settings: Settings | str | None = None,
    changes: Mapping[str, Any] = _NONE,
    *,
    expand: float | None = None,
) -> Start:
    """Return where an image file with these highlights starts; None: a scene.

    `changes`: fields of the settings that are changed.
    """
    if settings is None:
        settings = _DEFAULTS[highlights]
    begun = check_settings(settings)
    changed = begun.replace(**changes) if changes else begun
    if expand is None and highlights is Highlights.CLIPPED:
        is_made_for_it = _is_of_photos(begun) or _is_of_photos(changed)
        expand = PHOTO_EXPANSION if is_made_for_it else None
    return Start(changed, expand)


def _is_of_photos(settings: Settings) -> bool:
    """Whether settings are the preset for photographs, or differ only in strength and look."""
    photo = presets[PRESET_OF_PHOTOS]
    return all(getattr(settings, name) == getattr(photo, name) for name in _OF_PHOTOS)


def developed(picture: Picture, expand: float | None, alpha: str) -> Picture:
    """Return the picture whose pixels a renderer gets, of one that was decoded unexpanded.

    Its highlights are expanded, and its colours are multiplied by alpha if the setting `alpha`
    gives the bloom its own.
    """
    if picture.highlights is Highlights.CLIPPED:
        picture = dataclasses.replace(picture, pixels=expanded(picture.pixels, expand))
    return picture if alpha == "keep" else premultiplied(picture)
