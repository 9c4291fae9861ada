"""Framebuffers for tests, and functions that read the files that were written from them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from tests.images import noise
from tests.io.parts import reread, write
from vkbloom import Frames, Separable, Settings

INFO = {
    "adapter": "Some <GPU> & co",
    "driver": "driver 1.2",
    "version": "0.1.0",
    "nan": 3,
    "inf": 0,
}
TIMINGS = {"glow": 0.001, "blur_vertical": 0.004, "composite": 0.002}


def make(
    arrays: Mapping[str, NDArray[Any]],
    *,
    timings: Mapping[str, float] = TIMINGS,
    settings: Settings | None = None,
) -> Frames:
    return Frames(
        arrays, timings=timings, settings=settings or Separable(blur_scale=2.0), info=INFO
    )


def make_mixed() -> Frames:
    """Return Frames of every dtype, of two sizes, with three and four channels, and depth."""
    return make(
        {
            "glow": noise(5, 7, 4, dtype="float16"),
            "glow_depth": noise(5, 7, dtype="float32"),
            "blur_vertical": noise(5, 7, 4, dtype="float16"),
            "scene": noise(11, 13, 3, dtype="float32"),
            "depth": noise(11, 13, dtype="float32"),
            "final": noise(11, 13, 4, dtype="uint8"),
        }
    )


@dataclasses.dataclass
class Part:
    pixels: NDArray[Any]
    channels: tuple[str, ...]
    attributes: dict[str, Any]


def read(file: Path) -> dict[str, Part]:
    """Read every part of a file with its stored values, alpha not multiplied in."""
    parts = {}
    # (Of TIFF, OpenImageIO does not count them.)
    for index in range(oiio.ImageBuf(str(file)).nsubimages or 1):
        spec, pixels = reread(file, index)
        attributes = {attribute.name: attribute.value for attribute in spec.extra_attribs}
        name = spec.getattribute("oiio:subimagename") or ""
        parts[name] = Part(pixels, tuple(spec.channelnames), attributes)
    return parts


def write_image(path: Path, pixels: NDArray[Any], kind: str = "", **changes: Any) -> Path:
    """Write pixels (h, w, C) as they are, without the package; `changes`: fields or attributes.

    Without the first attribute PNG divides by alpha. Names have "__" in place of a colon.
    """
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind or pixels.dtype.name)
    for name, value in {"oiio:UnassociatedAlpha": 1, **changes}.items():
        if hasattr(spec, name):
            setattr(spec, name, value)
        else:
            spec.attribute(name.replace("__", ":"), value)
    return write(path, spec, np.ascontiguousarray(pixels))


def decode(data: bytes | None, folder: Path) -> NDArray[np.uint8]:
    assert data is not None
    (folder / "decoded.png").write_bytes(data)
    return read(folder / "decoded.png")[""].pixels


def assert_same(frames: Frames, expected: Frames) -> None:
    """Check that the settings are equal, and each framebuffer bit for bit."""
    assert frames.settings == expected.settings
    assert list(frames) == list(expected)
    for name in expected:
        np.testing.assert_array_equal(frames[name], expected[name], err_msg=name)


def names_in(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())
