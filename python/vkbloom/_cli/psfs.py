"""``vkbloom psfs``: list the point-spread functions, or draw a picture with each."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any, Final

import vkbloom
from vkbloom import psf
from vkbloom._cli.listing import Entry, listing_command
from vkbloom._settings.fields import fields_of
from vkbloom._settings.settings import Settings
from vkbloom.psf._base import PSF, functions

# Arguments of functions that need some, for their picture.
_IRIS = psf.iris(blades=6)
_GIVEN: Final[dict[str, dict[str, Any]]] = {
    "aperture": {"mask": _IRIS},
    "gaussian": {"sigma": 8.0},
    "measured": {"settings": vkbloom.Pyramid(threshold=None)},
    "unreal": {"image": psf.aperture(_IRIS)},
}


def entries() -> Iterator[Entry]:
    """Yield the functions."""
    for name, kind in functions().items():
        text = inspect.getdoc(kind) or ""
        what = text.partition("\n")[0].rstrip(".")
        source = re.search(r"^Source: (.+?)(?:[;.] |[;.]?\n\n|[;.]?\Z)", text, re.S | re.M)
        whose = " ".join(source[1].split()).rstrip(".") if source else "vkbloom"
        values = {"parameters": list(fields_of(kind)), "unit": kind.unit}
        yield Entry(name, what[:1].lower() + what[1:], whose, "mix", False, values)


def _example(name: str) -> PSF | None:
    """Return a function with its defaults; None for one that needs a file."""
    if name == "samples":
        return None
    return functions()[name](**_GIVEN.get(name, {}))


def _shown(entry: Entry, _: Settings) -> Settings | None:
    spread = _example(entry.name)
    if spread is None:
        return None
    # A function that describes scattered light alone has that share as the intensity of the mix.
    share = min(1.0, float(spread.energy().mean()))
    return vkbloom.Convolution(spread, composite="mix", intensity=share)


command = listing_command(
    "List the point-spread functions that --method convolution --psf takes, and whose they are. "
    "They stand for the complete picture: mix them, with the share of the light that they describe "
    "as the intensity.",
    entries,
    _shown,
)
