"""Files by OpenImageIO alone, without the package's own code."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import OpenImageIO as oiio
from numpy.typing import NDArray


def write(path: Path, spec: Any, pixels: NDArray[Any]) -> Path:
    """Write an image as a specification says."""
    writer = oiio.ImageOutput.create(str(path))
    assert writer is not None
    assert writer.open(str(path), spec), writer.geterror()
    assert writer.write_image(pixels), writer.geterror()
    assert writer.close(), writer.geterror()
    # TIFF leaves a message about a directory that it left out.
    writer.geterror()
    return path


def reread(path: Path, part: int = 0) -> tuple[Any, NDArray[Any]]:
    """Return the specification of a part and its stored values, alpha not multiplied in."""
    plain = oiio.ImageSpec()
    plain.attribute("oiio:UnassociatedAlpha", 1)
    buffer = oiio.ImageBuf(str(path), part, 0, plain)
    assert not buffer.has_error, buffer.geterror()
    pixels: Any = buffer.get_pixels(buffer.spec().format)
    return buffer.spec(), pixels


def store_ultra_hdr(path: Path, pixels: NDArray[Any]) -> None:
    """Write half floats of linear P3 as a JPEG with a map of gains."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "half")
    spec.attribute("jpeg:ultrahdr", 1)
    spec.attribute("oiio:ColorSpace", "lin_p3d65_scene")
    write(path, spec, pixels)


def store_parts(path: Path, parts: Mapping[str, NDArray[Any]]) -> None:
    """Write half floats of shape (H, W, C) as parts, by name."""
    specs = []
    for name, pixels in parts.items():
        height, width, channels = pixels.shape
        specs.append(oiio.ImageSpec(width, height, channels, "half"))
        specs[-1].attribute("oiio:subimagename", name)
    writer = oiio.ImageOutput.create(str(path))
    assert writer is not None
    assert writer.open(str(path), specs)
    for index, pixels in enumerate(parts.values()):
        assert not index or writer.open(str(path), specs[index], "AppendSubimage")
        assert writer.write_image(pixels)
    assert writer.close()


def facts_in(path: Path) -> dict[str, str]:
    """Return what vkbloom wrote into a file with attributes, such as "settings"."""
    return {
        attribute.name.removeprefix("vkbloom:"): str(attribute.value)
        for attribute in reread(path)[0].extra_attribs
        if attribute.name.startswith("vkbloom:")
    }
