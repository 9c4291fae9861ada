"""Read the image files of a command, and print notes about them."""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

import click
import numpy as np
from numpy.typing import NDArray

from vkbloom._cli.program import is_given
from vkbloom._cli.sequences import as_file, displayed_name
from vkbloom._cli.terminal import note
from vkbloom._formats import LUMINANCE
from vkbloom._io.alpha import divide, hidden_notes
from vkbloom._io.decoding import check_space
from vkbloom._io.expansion import PHOTO_EXPANSION
from vkbloom._io.image_file import ImageFile
from vkbloom._io.picture import Colour, Highlights, Picture, list_all
from vkbloom._settings.settings import Settings, expansion_of_final

#: Encodings of a written file.
COLOURS: Final = ("linear", "srgb")

_STANDARD_ERROR = 2


subimage_option: Final = click.option(
    "--subimage", metavar="N", type=click.IntRange(min=0), default=0, help="A part of the file."
)
layer_option: Final = click.option(
    "--layer",
    metavar="NAME",
    help="The layer to read from an OpenEXR file with several layers, such as ViewLayer.Combined.",
)
expand_option: Final = click.option(
    "--expand",
    metavar="X",
    type=click.FloatRange(1, 1024),
    help="What the highlights of a file of integers are expanded up to, so that they can glow; "
    f"1: they stay as they are [default {PHOTO_EXPANSION:g} with presets such as photo and mist, "
    "else 1]",
)
input_colour_option: Final = click.option(
    "--input-colour",
    metavar="linear|srgb|SPACE",
    help="Colour space of the file; SPACE is one of OpenColorIO's built-in configuration, such "
    "as ACEScg or 'Linear Rec.2020' [default linear for floats; for integers that of the file, "
    "or srgb if it names none]",
)


def reading_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of how an image is read for its bloom."""
    return subimage_option(layer_option(expand_option(command)))


@contextmanager
def opened(source: str, subimage: int, layer: str | None = None) -> Iterator[ImageFile]:
    """Open an image file; libraries print no messages of their own."""
    with silence(), as_file(source) as file, ImageFile(file, subimage, layer) as image:
        yield image


def read(source: str, subimage: int) -> Picture:
    """Read an image file as it is stored."""
    with opened(source, subimage) as file:
        return file.stored()


def other_parts(picture: Picture) -> str:
    """Return the parts of a file of several if neither --subimage nor the file chooses one."""
    parts = picture.parts
    if len(parts) < 2 or is_given("subimage") or picture.header.part:
        return ""
    names = list_all(f"{index} {name}" for index, name in enumerate(parts) if name)
    return f"parts {names}" if names else f"{len(parts)} parts"


def check_input_colour(colour: Colour | None) -> None:
    """Raise click.UsageError for a colour space that is not known."""
    if colour in (None, *COLOURS):
        return
    try:
        check_space(str(colour))
    except ValueError as error:
        raise click.UsageError(f"--input-colour: {error}") from error


def read_picture(
    source: str,
    subimage: int,
    colour: Colour | None,
    *,
    layer: str | None = None,
    prepare: Callable[[Picture], Picture] | None = None,
) -> Picture:
    """Read an image file, decode it to linear light, and print notes about its contents.

    `prepare`: What is made of the decoded picture before its notes are printed.
    """
    check_input_colour(colour)
    with opened(source, subimage, layer) as file:
        picture = file.picture(colour)
    picture = picture if prepare is None else prepare(picture)
    source = displayed_name(source)
    if layer is None and (parts := other_parts(picture)):
        note(f"{source}: read the first of its {parts}; --subimage reads another")
    nan, infinite = (int(test(picture.values).sum()) for test in (np.isnan, np.isinf))
    if nan or infinite:
        note(
            f"{source} has {nan} NaN and {infinite} infinite values; they count as 0 in the bloom, "
            "and stay in the picture"
        )
    for text in picture.notes:
        note(f"{source}: {text}")
    return picture


def note_hidden(picture: Picture, source: str) -> None:
    """Print a note if light where alpha is 0 blooms like visible light."""
    for text in hidden_notes(picture):
        note(f"{displayed_name(source)}: {text}")


def highlights_of_file(
    source: str, subimage: int, layer: str | None, colour: Colour | None
) -> Highlights:
    """Return what a file has of light above white, as its picture says.

    That of floats for what cannot be read: the error comes from the command that reads it.
    """
    with suppress(OSError, ValueError), opened(source, subimage, layer) as file:
        return file.header.highlights(colour)
    return Highlights.STORED


def finish(picture: Picture, final: NDArray[Any], settings: Settings) -> Picture:
    """Return a picture with the pixels of `final`, and their alpha and encoding as in its file."""
    if settings.alpha != "keep" and picture.has_straight:
        final = divide(final)
    if picture.grey:
        final = _in_grey(final)
    encoding = picture.encoding if settings.encoding == "none" else settings.encoding
    expand = expansion_of_final(settings, picture.expand)
    return dataclasses.replace(picture, pixels=final, encoding=encoding, expand=expand)


def _in_grey(final: NDArray[Any]) -> NDArray[Any]:
    """Return floats (H, W, C) with three equal components: their luminance where they differ.

    A look has its own colour: halation blurs red alone, which is not the light of a grey picture.
    """
    red = final[:, :, :1]
    if np.array_equal(np.broadcast_to(red, final[:, :, :3].shape), final[:, :, :3]):
        return final
    made = final.copy()
    light = final[:, :, :3].astype(np.float32) @ np.array(LUMINANCE, np.float32)
    is_grey = (final[:, :, 1:3] == red).all(axis=2)
    made[:, :, :3] = np.where(is_grey, red[:, :, 0], light)[:, :, np.newaxis]
    return made


@contextmanager
def silence() -> Iterator[None]:
    """Suppress what C libraries print on standard error, and this process meanwhile.

    libpng prints messages about damaged files, instead of passing them to OpenImageIO.
    """
    # Standard error was closed when this process began, so descriptor 2 may be another file.
    if sys.stderr is None:
        yield
        return
    sys.stderr.flush()
    kept, nowhere = os.dup(_STANDARD_ERROR), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, _STANDARD_ERROR)
        yield
    finally:
        os.dup2(kept, _STANDARD_ERROR)
        os.close(nowhere)
        os.close(kept)
