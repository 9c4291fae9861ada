"""Write framebuffers to image files without loss: all files, or none if one fails."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import import_extra
from vkbloom.framebuffers import Framebuffers, leading
from vkbloom.io import safe_writing
from vkbloom.io.images import check_name

if TYPE_CHECKING:
    import OpenImageIO


__all__ = ["save"]

# OpenImageIO's names of the pixel types, by the array's dtype.
_PIXEL_TYPES = {"uint8": "uint8", "float16": "half", "float32": "float"}


def save(frames: Framebuffers, path: str | os.PathLike[str]) -> list[Path]:
    """Write framebuffers to image files, as `Frames.save` documents.

    Parameters
    ----------
    frames : Framebuffers
        At least one framebuffer.
    path : str or path-like
        A file name with an extension that OpenImageIO writes, or a folder.

    Returns
    -------
    list of Path
        The written files, in the order of the framebuffers.

    Raises
    ------
    ValueError
        The extension is unknown, the name is not UTF-8, or there is no framebuffer.
    OSError
        A file cannot be written; the error names it, and no partial file is left.
    ModuleNotFoundError
        OpenImageIO is missing: ``pip install vkbloom[images]``.
    """
    if not frames:
        raise ValueError("frames: there is no framebuffer to save")
    oiio = import_extra("OpenImageIO", "images", "Frames.save")
    if os.fspath(path) == "":
        # An empty name is usually an unset shell variable, and must not mean the current folder.
        raise ValueError("path: '' is not the name of a file or a folder; use '.' for this folder")
    target = Path(path)
    check_name(target)
    plan: dict[Path, list[str]]
    if target.is_dir() or not target.suffix or os.fspath(path).endswith(("/", os.sep)):
        target.mkdir(parents=True, exist_ok=True)
        plan = {target / f"{name}.png": [name] for name in frames}
    else:
        safe_writing.check_extension(oiio, target.suffix)
        if _is_exr(target) or len(frames) == 1:
            plan = {target: list(frames)}
        else:
            plan = {
                target.with_name(f"{target.stem}_{name}{target.suffix}"): [name] for name in frames
            }
    # (temporary file, final file) of every reserved file.
    files: list[tuple[Path, Path]] = []
    try:
        for file, names in plan.items():
            size = sum(frames[name].nbytes for name in names)
            files.append((safe_writing.reserve(file, size), file))
            if not _is_exr(file):
                if _write_image(oiio, frames, names[0], *files[-1]):
                    continue
                files.pop()[0].unlink()
                beside = file.with_suffix(".exr")
                files.append((safe_writing.reserve(beside, size), beside))
            _write_exr(oiio, frames, names, *files[-1])
        for temporary, file in files:
            safe_writing.put_in_place(temporary, file)
    finally:
        for temporary, _ in files:
            temporary.unlink(missing_ok=True)
    return [file for _, file in files]


def _write_image(
    oiio: ModuleType, frames: Framebuffers, name: str, temporary: Path, file: Path
) -> bool:
    """Write one framebuffer to a file of any format; False if the format cannot hold it."""
    pixels = np.atleast_3d(frames[name])
    writer = oiio.ImageOutput.create(str(temporary))
    if pixels.shape[2] == 4 and not writer.supports("alpha"):
        opaque = 255 if pixels.dtype == np.uint8 else 1.0
        if not (pixels[:, :, 3] == opaque).all():
            return False
        pixels = pixels[:, :, :3]
    if not safe_writing.holds(oiio, temporary, pixels.shape[2], _PIXEL_TYPES[str(pixels.dtype)]):
        return False
    spec = _spec(oiio, frames, pixels)
    # Otherwise OpenImageIO assumes premultiplied colours and divides them by alpha.
    spec.attribute("oiio:UnassociatedAlpha", 1)
    if not (
        writer.open(str(temporary), spec)
        and writer.write_image(np.ascontiguousarray(pixels))
        and writer.close()
    ):
        raise safe_writing.write_error(writer, temporary, file)
    safe_writing.check_complete(oiio, temporary, file)
    return True


def _write_exr(
    oiio: ModuleType, frames: Framebuffers, names: Iterable[str], temporary: Path, file: Path
) -> None:
    parts: list[NDArray[Any]] = []
    specs: list[Any] = []
    height, width = frames[leading(frames)].shape[:2]
    for name in names:
        pixels = np.atleast_3d(frames[name])
        if pixels.dtype == np.uint8:
            pixels = (pixels / np.float32(255)).astype(np.float16)
        spec = _spec(oiio, frames, pixels)
        # OpenImageIO writes this attribute as the part's name.
        spec.attribute("oiio:subimagename", name)
        spec.attribute("vkbloom:dtype", str(frames[name].dtype))
        spec.full_width, spec.full_height = width, height
        if pixels.shape[2] == 1:
            spec.channelnames = ("Z",)
            spec.z_channel = 0
        parts.append(pixels)
        specs.append(spec)
    writer = oiio.ImageOutput.create(str(temporary))
    if not writer.open(str(temporary), specs):
        raise safe_writing.write_error(writer, temporary, file)
    for index, (pixels, spec) in enumerate(zip(parts, specs, strict=True)):
        if index and not writer.open(str(temporary), spec, "AppendSubimage"):
            raise safe_writing.write_error(writer, temporary, file)
        if not writer.write_image(np.ascontiguousarray(pixels)):
            raise safe_writing.write_error(writer, temporary, file)
    if not writer.close():
        raise safe_writing.write_error(writer, temporary, file)


def _spec(oiio: ModuleType, frames: Framebuffers, pixels: NDArray[Any]) -> OpenImageIO.ImageSpec:
    """Make the ImageSpec of an (H, W, C) array, with the frames' settings and adapter."""
    height, width, channels = pixels.shape
    spec: OpenImageIO.ImageSpec = oiio.ImageSpec(
        width, height, channels, _PIXEL_TYPES[str(pixels.dtype)]
    )
    settings = json.dumps(frames.settings.as_dict())
    adapter = frames.info.get("adapter", "an unnamed adapter")
    spec.attribute("Software", f"vkbloom {frames.info.get('version', '')}".rstrip())
    spec.attribute("ImageDescription", f"vkbloom on {adapter}, settings {settings}")
    for key, value in frames.info.items():
        spec.attribute(f"vkbloom:{key}", str(value))
    spec.attribute("vkbloom:settings", settings)
    spec.attribute("vkbloom:timings", json.dumps(dict(frames.timings)))
    return spec


def _is_exr(file: Path) -> bool:
    return file.suffix.lower() == ".exr"
