"""``vkbloom presets``: list the presets."""

from __future__ import annotations

from collections.abc import Iterator

from vkbloom._cli.listing import Entry, listing_command
from vkbloom._cli.settings_options import PRESET_OF_PHOTOS
from vkbloom._presets.named_settings import PRESETS


def entries() -> Iterator[Entry]:
    """Yield the presets."""
    for name, one in PRESETS.items():
        settings = one.make()
        # The command line expands the highlights of a photograph for the preset photo.
        needs_hdr = (settings.threshold or 0) >= 1 and name != PRESET_OF_PHOTOS
        values = {"intensity": settings.intensity, "settings": settings.to_dict()}
        yield Entry(name, one.what, one.whose, settings.composite, needs_hdr, values)


command = listing_command(
    "List the presets: what they look like, whose they are, whether they mix or add, and whether "
    "they need values above 1.",
    entries,
)
