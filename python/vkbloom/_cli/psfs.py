"""``vkbloom psfs``: list the point-spread functions."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

from vkbloom._cli.listing import Entry, listing_command
from vkbloom._settings.fields import fields_of
from vkbloom.psf._base import functions


def entries() -> Iterator[Entry]:
    """Yield the functions."""
    for name, kind in functions().items():
        text = inspect.getdoc(kind) or ""
        what = text.partition("\n")[0].rstrip(".")
        source = re.search(r"^Source: (.+?)(?:[;.] |[;.]?\n\n|[;.]?\Z)", text, re.S | re.M)
        whose = " ".join(source[1].split()).rstrip(".") if source else "vkbloom"
        yield {
            **{"name": name, "what": what[:1].lower() + what[1:], "whose": whose},
            **{"composite": "mix", "needs_hdr": False},
            **{"parameters": list(fields_of(kind)), "unit": kind.unit},
        }


command = listing_command(
    "List the point-spread functions that --method convolution --psf takes, and whose they are. "
    "They stand for the complete picture: mix them, with the share of the light that they describe "
    "as the intensity.",
    entries,
)
