"""What a page says of files, framebuffers and errors, and reads of messages."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.image_file import read_picture
from vkbloom._io.picture import Picture
from vkbloom._numbers import check_number
from vkbloom._settings.registry import METHODS

if TYPE_CHECKING:
    from vkbloom._renderer.plans import Plan
    from vkbloom._settings.settings import Settings


def read_opened(name: str, files: Sequence[bytes]) -> Picture:
    """Return the picture of a file."""
    if len(files) != 1:
        raise ValueError("open: the message does not have the content of one file")
    with tempfile.TemporaryDirectory() as folder:
        # The file name may be anything. Only its extension is used, for the format.
        path = Path(folder, f"image{PurePath(name).suffix[:8]}")
        path.write_bytes(files[0])
        try:
            return read_picture(path)
        except (OSError, ValueError) as error:
            text = str(error).replace(str(path), name)
            raise ValueError(text if name in text else f"{name}: {text}") from error


def note_of(settings: Settings, shown: str) -> str:
    """Return what a page says of a framebuffer that is not what its name or its colours tell."""
    if shown == "glow":
        return settings.glow_note and f"glow is {settings.glow_note}"
    if shown == "kernel" and not METHODS.is_added(settings.method):
        return "kernel is the point-spread function, which no pass writes: it is computed once"
    if shown != "final" or settings.encoding not in ("pq", "hlg"):
        return ""
    return f"this page shows SDR: final's {settings.encoding} signal is shown as sRGB"


def rows_of(plan: Plan) -> list[dict[str, Any]]:
    """Return what a page says of the passes of a plan."""
    return [{**one._asdict(), "sentence": plan.sentences[one.name]} for one in plan.passes]


def keep_finite(timings: Mapping[str, float]) -> dict[str, float]:
    """Return the times that are finite, which JSON requires."""
    return {name: seconds for name, seconds in timings.items() if math.isfinite(seconds)}


def describe_error(error: BaseException) -> str:
    return str(error) or type(error).__name__


def read_position(at: object) -> tuple[float, float]:
    if not (isinstance(at, list | tuple) and len(at) == 2):
        raise TypeError(f"at: {at!r:.80} is not (x, y)")
    for part in at:
        check_number("at", part, 0, 1)
    return float(at[0]), float(at[1])


def probe(array: NDArray[Any], at: tuple[float, float]) -> dict[str, Any]:
    height, width = array.shape[:2]
    # A position of 1 is the far edge of the last pixel.
    x, y = min(int(at[0] * width), width - 1), min(int(at[1] * height), height - 1)
    number = int if array.dtype.kind == "u" else float
    # NumPy's text of a value has the digits that tell it apart from others of its dtype.
    values = [str(number(str(value))) for value in np.atleast_1d(array[y, x])]
    return {"x": x, "y": y, "values": values}
