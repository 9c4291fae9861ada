"""``vkbloom glares``: list the stages and published names of glare."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence

from vkbloom._cli.listing import Entry, listing_command
from vkbloom._presets.named_glares import GLARES
from vkbloom._settings.glare import Glare, GlareLight
from vkbloom._settings.registry import STAGES


def entries() -> Iterator[Entry]:
    """Yield the stages with their defaults, then the published glares."""
    for name, kind in STAGES.items():
        what = (inspect.getdoc(kind) or "").partition(".")[0]
        yield _entry(name, what[:1].lower() + what[1:], "a stage with its defaults", (kind(),))
    for name, item in GLARES.items():
        yield _entry(name, item.what, item.whose, item.stages)


def _entry(name: str, what: str, whose: str, stages: Sequence[Glare]) -> Entry:
    lights = [stage for stage in stages if isinstance(stage, GlareLight)]
    composite = "add" if lights else "multiply"
    needs_hdr = bool(lights) and min(stage.threshold for stage in lights) >= 1
    return {
        **{"name": name, "what": what, "whose": whose},
        **{"composite": composite, "needs_hdr": needs_hdr},
        "glare": [stage.to_dict() for stage in stages],
    }


command = listing_command(
    "List what --glare takes: stages and published glares, whose they are, and whether they need "
    "values above 1. Stages add their light to the bloom, dirt multiplies it.",
    entries,
)
