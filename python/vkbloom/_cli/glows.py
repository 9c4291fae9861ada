"""The options of a mask and an emission, and their files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import click
from numpy.typing import NDArray

from vkbloom._cli.image_files import read_picture
from vkbloom._io.glows import alike, grey_mask
from vkbloom._presets.start import multiply_by_alpha


def glow_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of a mask and an emission."""
    mask = click.option(
        "--mask",
        metavar="FILE",
        type=click.Path(),
        help="A grey image: white glows, black does not.",
    )
    emission = click.option(
        "--emission",
        metavar="FILE",
        type=click.Path(),
        help="An image that glows instead of IN.",
    )
    return mask(emission(command))


@dataclass(frozen=True)
class Glows:
    """The mask and the emission of files; None: not given."""

    mask: NDArray[Any] | None
    emission: NDArray[Any] | None

    def of(self, image: NDArray[Any]) -> dict[str, Any]:
        """Return those that are there as arguments beside an image."""
        emission = None if self.emission is None else alike(self.emission, image)
        return {
            name: array
            for name, array in (("mask", self.mask), ("emission", emission))
            if array is not None
        }


def read_glows(
    mask: str | None, emission: str | None, colour: str | None, *, is_blended: bool
) -> Glows:
    """Read files of a mask and an emission.

    - `colour`: The colour space of the emission, as of an image.
    - `is_blended`: Multiply the emission by its alpha.
    """
    grey = glow = None
    if mask is not None:
        grey = grey_mask(read_picture(mask, 0, "linear").pixels, mask)
    if emission is not None:
        picture = read_picture(emission, 0, colour)
        glow = (multiply_by_alpha(picture) if is_blended else picture).pixels
    return Glows(grey, glow)
