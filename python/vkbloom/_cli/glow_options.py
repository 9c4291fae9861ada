"""The options for the part of an image that glows: ``--mask`` and ``--emission``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import click
from numpy.typing import NDArray

import vkbloom
from vkbloom._cli.image_files import read_picture
from vkbloom._io.array_files import premultiplied
from vkbloom._io.glows import alike, grey_mask
from vkbloom._io.images import Colour

Array = NDArray[Any]


_MASK: Final = click.option(
    "--mask",
    metavar="FILE",
    type=click.Path(),
    help="A grey image of the same size, which multiplies what glows: white keeps it, black "
    "removes it. Its values are not decoded.",
)
_EMISSION: Final = click.option(
    "--emission",
    metavar="FILE",
    type=click.Path(),
    help="An image of the same size that glows instead of the image, such as a renderer's pass of "
    "emissive materials. It is decoded like the image.",
)


def glow_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--mask`` and ``--emission``, the arguments of `vkbloom.Renderer.apply`."""
    return _MASK(_EMISSION(command))


def refuse_glow_of_scene(mask: str | None, emission: str | None) -> None:
    """Raise a UsageError if a scene is given a mask or an emission."""
    if mask or emission:
        raise click.UsageError("--mask and --emission need an IMAGE; a scene has a glow mesh")


def accompanying(
    mask: str | None,
    emission: str | None,
    colour: Colour | None = None,
    *,
    is_blended: bool = False,
) -> Callable[[Array], dict[str, Any]]:
    """Read both files, and return a function from an image to its `mask` and `emission`."""
    values = None if mask is None else grey_mask(read_picture(mask, 0, "linear").pixels, mask)
    glow = None
    if emission is not None:
        read = read_picture(emission, 0, colour)
        glow = (premultiplied(read) if is_blended else read).pixels

    def arguments(image: Array) -> dict[str, Array]:
        given = {} if values is None else {"mask": values}
        return given if glow is None else {**given, "emission": alike(glow, image)}

    return arguments


def uploaded(
    renderer: vkbloom.Renderer, image: Array, arguments: dict[str, Array]
) -> Array | vkbloom.Image:
    """Return an image, or a handle of it with its mask and its emission."""
    return renderer.upload(image, **arguments) if arguments else image
