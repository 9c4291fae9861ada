"""``vkbloom presets``: list the presets."""

from __future__ import annotations

from collections.abc import Iterator

from vkbloom._cli.listing import Entry, listing_command
from vkbloom._cli.settings_options import PRESET_OF_PHOTOS
from vkbloom._presets.named_settings import ENGINES, PRESETS


def entries() -> Iterator[Entry]:
    """Yield the presets, those of an engine after each other."""
    engines = {
        name: (engine, confirmed) for engine, confirmed, names in ENGINES for name in names.split()
    }
    for name, (engine, confirmed) in engines.items():
        item = PRESETS[name]
        settings = item.make()
        # The command line expands the highlights of a photograph for the preset photo.
        needs_hdr = (settings.threshold or 0) >= 1 and name != PRESET_OF_PHOTOS
        yield {
            **{"name": name, "what": item.what, "whose": item.whose},
            **{"composite": settings.composite, "needs_hdr": needs_hdr},
            **{"intensity": settings.intensity, "settings": settings.to_dict()},
            **{"engine": engine, "confirmed": confirmed},
        }


command = listing_command(
    "List the presets by engine: what they look like, their versions, what confirmed them (frames "
    "of the engine's shaders, the program itself, or a formula alone), whether they mix or add, "
    "and whether they need values above 1.",
    entries,
)
