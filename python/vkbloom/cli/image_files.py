"""Image files as arguments: how they are read, and what is said about them."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

import click
import numpy as np

from vkbloom.cli.program import given
from vkbloom.io import image_reading
from vkbloom.io.colour import check_space
from vkbloom.io.images import Colour, Picture, StoredImage

#: What the colours of a written file can be.
COLOURS: Final = ("linear", "srgb")

_STANDARD_ERROR = 2


def subimage_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--subimage``, the argument of `vkbloom.io.image_reading.load`."""
    return click.option(
        "--subimage",
        metavar="N",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        help="Which part to read of files that have several.",
    )(command)


def layer_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--layer``, the argument of `vkbloom.read`."""
    return click.option(
        "--layer",
        metavar="NAME",
        help="Which layer to read of an OpenEXR file that has several, such as ViewLayer.Combined.",
    )(command)


def input_colour_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--input-colour``, the argument `colour` of `vkbloom.io.image_reading.decode`."""
    return click.option(
        "--input-colour",
        metavar="linear|srgb|SPACE",
        help="What the colours in the file are; SPACE is one of OpenColorIO's built-in "
        "configuration, such as ACEScg or 'Linear Rec.2020' [default linear for floats; for "
        "integers what the file says, else srgb]",
    )(command)


def read(path: str, subimage: int, layer: str | None = None) -> StoredImage:
    """Read an image file; the only message of a failure is that of the exception."""
    with _silenced():
        return image_reading.load(path, subimage, layer)


def check_part_is_given(path: str, stored: StoredImage) -> None:
    """Raise click.UsageError where a file has several parts and nobody said which is meant."""
    if len(stored.parts) > 1 and not given("subimage"):
        raise click.UsageError(f"{path}: --subimage has to name one of its {_listed(stored)}")


def _listed(stored: StoredImage) -> str:
    names = ", ".join(f"{index} {name}" for index, name in enumerate(stored.parts) if name)
    return f"parts {names}" if names else f"{len(stored.parts)} parts"


def note(text: str) -> None:
    """Tell the user something that is no failure, on standard error."""
    click.echo(f"vkbloom: note: {text}", err=True)


def read_picture(
    source: str,
    subimage: int,
    colour: Colour | None,
    *,
    layer: str | None = None,
    raw: bool = False,
) -> Picture:
    """Read an image file as what a renderer takes, and tell what the user may want to know.

    Raises
    ------
    click.UsageError
        `raw` is for 8-bit files, and this is none; there is no such `colour`.
    OSError, ValueError
        The file cannot be read, or not be given bloom.
    """
    if colour not in (None, *COLOURS):
        try:
            check_space(colour)
        except ValueError as error:
            raise click.UsageError(f"--input-colour: {error}") from error
    stored = read(source, subimage, layer)
    if raw and stored.pixels.dtype != np.uint8:
        raise click.UsageError(
            f"--raw is for files of 8-bit integers; {source} holds {stored.numbers[0]}"
        )
    try:
        picture = image_reading.decode(stored, colour, raw=raw)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error
    if len(stored.parts) > 1 and layer is None and not given("subimage"):
        note(f"{source}: the first of its {_listed(stored)}; --subimage reads another")
    nan = int(np.isnan(picture.values).sum())
    infinite = int(np.isinf(picture.values).sum())
    if nan or infinite:
        note(
            f"{source} holds NaN {nan} times and infinity {infinite} times: 0 in the bloom, kept "
            "at their own pixels"
        )
    for text in picture.notes:
        note(f"{source}: {text}")
    return picture


@contextmanager
def _silenced() -> Iterator[None]:
    """Keep the C libraries of image formats from writing to standard error.

    libpng does so of damaged files, and not through OpenImageIO.
    """
    if sys.stderr is None:
        # It was closed before this process began: the descriptor is of something else, or of none.
        yield
        return
    sys.stderr.flush()
    try:
        kept = os.dup(_STANDARD_ERROR)
    except OSError:
        # There is no standard error that could be written to.
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, _STANDARD_ERROR)
        yield
    finally:
        os.dup2(kept, _STANDARD_ERROR)
        os.close(nowhere)
        os.close(kept)
