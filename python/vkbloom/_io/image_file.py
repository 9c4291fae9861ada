"""An image file, from its header to a picture of linear light."""

from __future__ import annotations

import os
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, Final, Self

import numpy as np

from vkbloom._io.attributes import exr_attributes, kept_attributes
from vkbloom._io.decoding import decode
from vkbloom._io.displayed import code_points_of
from vkbloom._io.formats.facts import Facts
from vkbloom._io.formats.table import FORMATS, GREY_AND_ALPHA
from vkbloom._io.picture import (
    Alpha,
    Attributes,
    CodePoints,
    Colour,
    Header,
    Picture,
    StatedColours,
)
from vkbloom._io.readers import choose_part, names_of_parts, open_image, place_upright, read_values

# The code point of an unspecified curve.
_UNSPECIFIED: Final = 2


class ImageFile:
    """A part of an image file, open to be read once; a context manager that closes it.

    Its header is read when it is opened, and says what the pixels are before they are read. Errors
    are OSError and ValueError, which name the file.

    - `subimage`, `layer`: As of `vkbloom.read`.
    - `header`: What the part says. The windows, and an alpha that only the pixels tell, are those
      of the header of `stored`.
    """

    def __init__(
        self, path: str | os.PathLike[str], subimage: int = 0, layer: str | None = None
    ) -> None:
        self._name, self._layer = os.fspath(path), layer
        with ExitStack() as stack:
            self._reader = stack.enter_context(open_image(path, "Reading images"))
            self._part = choose_part(self._reader, self._name, subimage, layer)
            self._kind: str = self._reader.format_name()
            with open(self._name, "rb") as stream:
                find = FORMATS.get(self._kind)
                spec, number = self._part.spec, self._part.number
                self._facts = Facts() if find is None else find(stream, spec, number)
            attributes = kept_attributes(spec)
            exr = exr_attributes(spec) if self._kind == "openexr" else {}
            points = spec.getattribute("CICP")
            known = None if points is None else code_points_of(points, spec.nchannels)
            self.header = self._header_with(attributes, exr, known)
            self._notes = [*self._part.notes]
            if points is not None and known is None and points[1] != _UNSPECIFIED:
                numbers = " ".join(map(str, points))
                text = f"the code points {numbers} of its colours are not known, and are ignored"
                self._notes.insert(0, text)
            self._opened = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    def stored(self) -> Picture:
        """Return the picture as it is stored: every channel, no value changed."""
        header, notes, kept = self.header, [*self._notes], self._part.kept
        values, said = read_values(self._reader, self._part.spec, self._name, header.part)
        notes += said
        alpha, channels = header.alpha, header.channels
        if alpha is Alpha.UNKNOWN:
            alpha = Alpha.STRAIGHT
            if not values[:, :, -1].any():
                alpha, channels = Alpha.NONE, _without_alpha(channels)
        if self._facts.correct is not None:
            values, more, found = self._facts.correct(values)
            notes += more
            alpha = found or alpha
        values, origin, display = place_upright(
            values, self._part.spec, self._kind, header.orientation
        )
        for text in header.colours.said:
            notes.append(f"the file says {text} of its values, which are taken as they are")
        return Picture(
            pixels=np.ascontiguousarray(values if self._layer is None else values[:, :, kept]),
            header=replace(header, channels=channels, origin=origin, display=display, alpha=alpha),
            numbers=header.numbers[0] if len({*header.numbers}) == 1 else "float",
            notes=tuple(notes),
            # Last, since the reader goes to other parts.
            parts=names_of_parts(self._reader),
        )

    def picture(self, colour: Colour | None = None) -> Picture:
        """Return the picture, decoded to linear light, and close the file.

        `colour`: A colour space instead of the one that the file states.
        """
        with self._opened:
            stored = self.stored()
        try:
            return decode(stored, colour)
        except ValueError as error:
            raise ValueError(f"{self._name}: {error}") from error

    def _header_with(
        self, attributes: Attributes, exr: Attributes, points: CodePoints | None
    ) -> Header:
        """Return the header with these attributes and known code points."""
        spec, facts, kept = self._part.spec, self._facts, self._part.kept
        names = facts.channels or tuple(spec.channelnames)
        if names[:2] == ("R", "G") == names and self._kind in GREY_AND_ALPHA:
            names = ("Y", "A")
        # Alpha of a layer of OpenEXR has another name.
        has_alpha = "A" in names or self._kind == "openexr"
        if facts.alpha is Alpha.NONE:
            names = _without_alpha(names)
        if self._layer is not None:
            names = tuple(name.rpartition(".")[2] for name in names)
        numbers = [facts.numbers or str(spec.channelformat(index)) for index in kept]
        orientation: Any = facts.orientation
        if orientation is None:
            orientation = spec.getattribute("Orientation")
        is_turned = isinstance(orientation, int) and 1 <= orientation <= 8
        return Header(
            channels=tuple(names[index] for index in kept),
            numbers=tuple(numbers),
            display=(0, 0, spec.width, spec.height),
            alpha=facts.alpha if has_alpha else Alpha.STRAIGHT,
            orientation=orientation if is_turned else 1,
            colours=self._colours_with(attributes, points),
            attributes=attributes,
            exr_attributes=exr,
            part=self._part.number,
        )

    def _colours_with(self, attributes: Attributes, points: CodePoints | None) -> StatedColours:
        spec = self._part.spec
        space = spec.get_string_attribute("oiio:ColorSpace")
        gamma = spec.get_float_attribute("oiio:Gamma", 0.0) or None
        stated = self._facts.colours or StatedColours(space, gamma)
        _, profile = attributes.get("ICCProfile", (None, None))
        return stated._replace(
            space=stated.space if points is None else space,
            code_points=points,
            profile=None if profile is None else np.asarray(profile, np.uint8).tobytes(),
            profile_name=spec.get_string_attribute("ICCProfile:profile_description"),
            # OpenImageIO applies the gain map of a JPEG file.
            has_gain_map=self._kind == "jpeg" and str(spec.format) == "half",
        )


def _without_alpha(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return names of channels of which alpha means nothing."""
    return tuple("" if name == "A" else name for name in names)


def read_stored(
    path: str | os.PathLike[str], subimage: int = 0, layer: str | None = None
) -> Picture:
    """Return the picture of a file as it is stored."""
    with ImageFile(path, subimage, layer) as file:
        return file.stored()


def read_picture(
    path: str | os.PathLike[str],
    subimage: int = 0,
    layer: str | None = None,
    *,
    colour: Colour | None = None,
) -> Picture:
    """Return the picture of a file, decoded to linear light; `colour`: as of `ImageFile`."""
    return ImageFile(path, subimage, layer).picture(colour)
