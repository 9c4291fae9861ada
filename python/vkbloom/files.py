"""Image files of framebuffers: every value kept, and all files or none."""

from __future__ import annotations

import contextlib
import errno
import json
import os
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vkbloom.dimensions import leading
from vkbloom.extras import import_extra

if TYPE_CHECKING:
    import OpenImageIO

    from vkbloom.frames import Frames

__all__ = ["save"]

# OpenImageIO's names of the pixel types, by the array's dtype.
_PIXEL_TYPES = {"uint8": "uint8", "float16": "half", "float32": "float"}

# Formats of OpenImageIO that throw the picture away or print it on the terminal.
_FORMATS_WITHOUT_A_FILE = ("null", "term")

_LARGEST_HEADER = 65536  # bytes; what a file may hold beside the pixels


def save(frames: Frames, path: str | os.PathLike[str]) -> list[Path]:
    """Write framebuffers to image files: what `Frames.save` does and describes.

    Parameters
    ----------
    frames : Frames
        One framebuffer at least.
    path : str or path-like
        A file name with an extension that OpenImageIO writes, or a folder.

    Returns
    -------
    list of Path
        The files written, in the order of the framebuffers.

    Raises
    ------
    ValueError
        If the extension is unknown, or there is no framebuffer.
    OSError
        If a file cannot be written; it names the file, and no half file is left.
    ModuleNotFoundError
        If OpenImageIO is missing: ``pip install vkbloom[images]``.
    """
    if not frames:
        raise ValueError("these Frames hold no framebuffer to save")
    oiio = import_extra("OpenImageIO", "images", "Frames.save")
    target = Path(path)
    plan: dict[Path, list[str]]
    if target.is_dir() or not target.suffix or os.fspath(path).endswith(("/", os.sep)):
        target.mkdir(parents=True, exist_ok=True)
        plan = {target / f"{name}.png": [name] for name in frames}
    else:
        _check_extension(oiio, target.suffix)
        if _is_exr(target) or len(frames) == 1:
            plan = {target: list(frames)}
        else:
            plan = {
                target.with_name(f"{target.stem}_{name}{target.suffix}"): [name] for name in frames
            }
    # (temporary file, file) of everything reserved so far.
    files: list[tuple[Path, Path]] = []
    try:
        for file, names in plan.items():
            arrays = [frames[name] for name in names]
            files.append((_reserve(file, arrays), file))
            if not _is_exr(file):
                if _write_image(oiio, frames, names[0], *files[-1]):
                    continue
                files.pop()[0].unlink()
                beside = file.with_suffix(".exr")
                files.append((_reserve(beside, arrays), beside))
            _write_exr(oiio, frames, names, *files[-1])
        for temporary, file in files:
            try:
                temporary.replace(file)
            except OSError as error:
                raise OSError(error.errno, error.strerror, str(file)) from error
    finally:
        for temporary, _ in files:
            temporary.unlink(missing_ok=True)
    return [file for _, file in files]


def _write_image(oiio: ModuleType, frames: Frames, name: str, temporary: Path, file: Path) -> bool:
    """Write one framebuffer to a file of any format; False if the format cannot hold it."""
    pixels = np.atleast_3d(frames[name])
    writer = oiio.ImageOutput.create(str(temporary))
    if pixels.shape[2] == 4 and not writer.supports("alpha"):
        opaque = 255 if pixels.dtype == np.uint8 else 1.0
        if not (pixels[:, :, 3] == opaque).all():
            return False
        pixels = pixels[:, :, :3]
    if not _holds(oiio, temporary, pixels):
        return False
    spec = _spec(oiio, frames, pixels)
    # Otherwise OpenImageIO takes the colours for premultiplied and divides them by alpha.
    spec.attribute("oiio:UnassociatedAlpha", 1)
    if not (
        writer.open(str(temporary), spec)
        and writer.write_image(np.ascontiguousarray(pixels))
        and writer.close()
    ):
        raise _write_error(writer, temporary, file)
    # Should the disk have filled up since: not all writers (PNG, Targa) notice that.
    if not _is_readable(oiio, temporary):
        raise OSError(errno.EIO, "not written completely; is the disk full?", str(file))
    return True


def _write_exr(
    oiio: ModuleType, frames: Frames, names: Iterable[str], temporary: Path, file: Path
) -> None:
    parts: list[NDArray[Any]] = []
    specs: list[Any] = []
    height, width = frames[leading(frames)].shape[:2]
    for name in names:
        pixels = np.atleast_3d(frames[name])
        if pixels.dtype == np.uint8:
            pixels = (pixels / np.float32(255)).astype(np.float16)
        spec = _spec(oiio, frames, pixels)
        # What OpenEXR calls the name of the part.
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
        raise _write_error(writer, temporary, file)
    for index, (pixels, spec) in enumerate(zip(parts, specs, strict=True)):
        if index and not writer.open(str(temporary), spec, "AppendSubimage"):
            raise _write_error(writer, temporary, file)
        if not writer.write_image(np.ascontiguousarray(pixels)):
            raise _write_error(writer, temporary, file)
    if not writer.close():
        raise _write_error(writer, temporary, file)


def _spec(oiio: ModuleType, frames: Frames, pixels: NDArray[Any]) -> OpenImageIO.ImageSpec:
    """Describe an (H, W, C) array to OpenImageIO, with what the frames came from."""
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


def _check_extension(oiio: ModuleType, suffix: str) -> None:
    writer = oiio.ImageOutput.create(f"image{suffix}")
    if writer is None:
        oiio.geterror()
    if writer is None or writer.format_name() in _FORMATS_WITHOUT_A_FILE:
        raise ValueError(f"path: no image format for the extension {suffix!r} can be written")


def _holds(oiio: ModuleType, temporary: Path, pixels: NDArray[Any]) -> bool:
    """Tell whether a format keeps an array's dtype and channels.

    A format answers only once a file is open, and libpng complains on stderr about a file
    without pixels; so one pixel is written.
    """
    pixel = np.ascontiguousarray(pixels[:1, :1])
    spec = oiio.ImageSpec(1, 1, pixel.shape[2], _PIXEL_TYPES[str(pixel.dtype)])
    writer = oiio.ImageOutput.create(str(temporary))
    if not writer.open(str(temporary), spec):
        writer.geterror()
        return False
    opened = writer.spec()
    kept = (str(opened.format), opened.nchannels) == (str(spec.format), spec.nchannels)
    writer.write_image(pixel)
    writer.close()
    return kept


def _is_readable(oiio: ModuleType, file: Path) -> bool:
    reader = oiio.ImageInput.open(str(file))
    if reader is None:
        oiio.geterror()
        return False
    spec = reader.spec()
    readable = reader.read_image(0, 0, 0, spec.nchannels, spec.format) is not None
    reader.geterror()
    reader.close()
    return readable


def _reserve(file: Path, arrays: Iterable[NDArray[Any]]) -> Path:
    """Make a file of a new name beside a file, as large as the arrays that it shall hold.

    Doing it here gives the system's own reason where it fails, which OpenImageIO does not
    pass on. And on a full disk its JPEG writer would end the process and its WebP writer
    would not return.
    """
    temporary = file.with_name(f".vkbloom-{os.urandom(8).hex()}{file.suffix}")
    try:
        with temporary.open("xb") as stream:
            stream.write(bytes(_LARGEST_HEADER))
            for array in arrays:
                stream.write(np.ascontiguousarray(array).data)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise OSError(error.errno, error.strerror, str(file)) from error
    return temporary


def _write_error(writer: OpenImageIO.ImageOutput, temporary: Path, file: Path) -> OSError:
    reason = writer.geterror().replace(str(temporary), file.name).strip() or "not written"
    return OSError(errno.EIO, reason, str(file))
