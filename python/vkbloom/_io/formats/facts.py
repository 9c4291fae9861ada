"""What a format's own bytes say of a part of a file, beside OpenImageIO's header of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, TypeAlias

from numpy.typing import NDArray

from vkbloom._io.picture import Alpha, StatedColours

if TYPE_CHECKING:
    import OpenImageIO


class Corrected(NamedTuple):
    """Values (H, W, C) as a file means them.

    - `notes`: Notes for the user.
    - `alpha`: What alpha is to them, if the values tell. None: as in the facts.
    """

    pixels: NDArray[Any]
    notes: tuple[str, ...] = ()
    alpha: Alpha | None = None


class Facts(NamedTuple):
    """What a format's own bytes say of a part of a file.

    - `channels`: Names of the channels. None: those that OpenImageIO gives.
    - `orientation`: 1 to 8. None: as OpenImageIO says.
    - `alpha`: Of files with an alpha channel.
    - `colours`: None: the space and the exponent that OpenImageIO gives.
    - `numbers`: OpenImageIO's name of the number type that `correct` makes. None: that of the file.
    - `correct`: Corrects the values that OpenImageIO returns. None: they are right.
    """

    channels: tuple[str, ...] | None = None
    orientation: int | None = None
    alpha: Alpha = Alpha.STRAIGHT
    colours: StatedColours | None = None
    numbers: str | None = None
    correct: Callable[[NDArray[Any]], Corrected] | None = None


#: From a file, OpenImageIO's header of a part, and the part's number.
FindFacts: TypeAlias = "Callable[[BinaryIO, OpenImageIO.ImageSpec, int], Facts]"
