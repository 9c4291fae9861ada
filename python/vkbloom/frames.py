"""Framebuffers that come back from a renderer: access by name, files and pictures of them."""

from __future__ import annotations

import base64
import contextlib
import errno
import html
import importlib
import json
import math
import operator
import os
import struct
import warnings
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import OpenImageIO
    import xarray

    from vkbloom.settings import Settings

__all__ = ["Frames", "contact_sheet_png", "dimensions"]

_IMAGE_DTYPES = (np.dtype(np.uint8), np.dtype(np.float16), np.dtype(np.float32))
_CHANNELS = ("r", "g", "b", "a")

# OpenImageIO's names of the pixel types, by the array's dtype.
_PIXEL_TYPES = {"uint8": "uint8", "float16": "half", "float32": "float"}

# Formats of OpenImageIO that throw the picture away or print it on the terminal.
_FORMATS_WITHOUT_A_FILE = ("null", "term")

_LARGEST_HEADER = 65536  # bytes; what a file may hold beside the pixels

_THUMBNAIL_SIDE = 320  # pixels; keeps the page of a whole frame under about 1 MB


class Frames(Mapping[str, NDArray[Any]]):
    """Framebuffers by name, in the order that the data flows, with how they came about.

    A read-only mapping: framebuffers cannot be added, replaced or removed. The arrays
    themselves are plain `numpy.ndarray` and belong to the caller. Two Frames are equal only
    if they are the same object; compare their arrays with `numpy.array_equal`.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        Images of shape (H, W, 3) or (H, W, 4) and dtype uint8, float16 or float32; depth of
        shape (H, W) and dtype float32. Top row first. They are kept, not copied.
    timings : mapping of str to float
        Seconds on the device by pass name, for the passes that ran.
    settings : Settings
        What the frames were made with.
    info : mapping of str to object
        "adapter", "driver", "version", and how many "nan" and "inf" the input held.

    Raises
    ------
    TypeError
        If a framebuffer is not an ndarray or its name not a str.
    ValueError
        If a name is not an identifier, or an array's shape or dtype is not one of the above.
    """

    def __init__(
        self,
        arrays: Mapping[str, NDArray[Any]],
        *,
        timings: Mapping[str, float],
        settings: Settings,
        info: Mapping[str, Any],
    ) -> None:
        self._arrays = {name: _checked(name, array) for name, array in arrays.items()}
        self._timings = {name: float(seconds) for name, seconds in timings.items()}
        self._settings = settings
        self._info = dict(info)

    @property
    def timings(self) -> Mapping[str, float]:
        """Seconds on the device by pass name, for the passes that ran; read-only."""
        return MappingProxyType(self._timings)

    @property
    def settings(self) -> Settings:
        """The settings that the frames were made with."""
        return self._settings

    @property
    def info(self) -> dict[str, Any]:
        """Adapter, driver and version, and how many "nan" and "inf" the input held."""
        return self._info

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self._arrays[name]
        except KeyError:
            held = ", ".join(self._arrays) or "nothing"
            raise KeyError(f"no framebuffer {name!r}; there are: {held}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    # Mapping compares values with ==, which is ambiguous for arrays.
    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return object.__hash__(self)

    def __repr__(self) -> str:
        column = max((len(name) for name in self), default=0)
        lines = [f"Frames on {self._info.get('adapter', 'an unnamed adapter')}"]
        lines += [
            f"  {name:{column}}  {array.dtype!s:7}  {array.shape}" for name, array in self.items()
        ]
        return "\n".join(lines)

    def to_xarray(self) -> xarray.Dataset:
        """Return the framebuffers as one Dataset, a variable each.

        Returns
        -------
        xarray.Dataset
            Dimensions as `dimensions` gives them; channels carry the coordinates "r", "g",
            "b" and, where there is one, "a". The attributes hold `info` and, as JSON text,
            the settings and the timings: text and numbers only, as netCDF and zarr want
            them. The variables share memory with the framebuffers.

        Raises
        ------
        ModuleNotFoundError
            If xarray is missing: ``pip install vkbloom[grid]``.
        """
        try:
            xr = importlib.import_module("xarray")
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                "Frames.to_xarray needs xarray: pip install vkbloom[grid]", name=error.name
            ) from error
        dims = dimensions(self)
        channels = {
            dims[name][2]: list(_CHANNELS[: array.shape[2]])
            for name, array in self.items()
            if array.ndim == 3
        }
        dataset: xarray.Dataset = xr.Dataset(
            {name: (dims[name], array) for name, array in self.items()},
            coords=channels,
            attrs={
                **{k: v if isinstance(v, int | float) else str(v) for k, v in self._info.items()},
                "settings": json.dumps(self._settings.as_dict()),
                "timings": json.dumps(self._timings),
            },
        )
        return dataset

    def save(self, path: str | os.PathLike[str]) -> list[Path]:
        """Write the framebuffers to image files and lose nothing on the way.

        ========================== ========================================================
        path                       files
        ========================== ========================================================
        ``out.exr``                one multi-part OpenEXR file, one part per framebuffer
        ``out.png``, ``out.tif``   ``out_<name>.png``; ``out.png`` if there is one only
        a folder, or no extension  ``<name>.png`` in that folder, which is made if missing
        ========================== ========================================================

        A framebuffer that the chosen format cannot hold as it is becomes an ``.exr`` of the
        same stem beside the others: float images and depth beside ``out.png``, for example.
        An alpha that is 1 everywhere is left out where the format has none. Formats that
        compress with loss (JPEG, WebP, GIF, Radiance HDR) keep their loss.

        In OpenEXR half stays half and float stays float; 8-bit values are stored as half
        value / 255, from which ``round(255 * value)`` gives the same levels again, with the
        attribute ``vkbloom:dtype`` telling what they were. Depth is a float channel ``Z``.
        The display window of all parts is that of `final` (without it, of the last image), as
        the parts of one file must share it. Values are stored as they are: no gamma, no
        multiplication by alpha.

        ``Software`` and ``ImageDescription`` (``Description`` in PNG) carry the version, the
        adapter and the settings, and ``vkbloom:<key>`` each entry of `info`, the settings
        and the timings (both as JSON), where the format stores such attributes.

        Parameters
        ----------
        path : str or path-like
            A file name with an extension that OpenImageIO writes, or a folder. What is
            already there is replaced. All files are written under temporary names first
            and renamed when all are complete.

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
        if not self._arrays:
            raise ValueError("these Frames hold no framebuffer to save")
        oiio = _import_openimageio("Frames.save")
        target = Path(path)
        plan: dict[Path, list[str]]
        if target.is_dir() or not target.suffix or os.fspath(path).endswith(("/", os.sep)):
            target.mkdir(parents=True, exist_ok=True)
            plan = {target / f"{name}.png": [name] for name in self}
        else:
            _check_extension(oiio, target.suffix)
            if _is_exr(target) or len(self) == 1:
                plan = {target: list(self)}
            else:
                plan = {
                    target.with_name(f"{target.stem}_{name}{target.suffix}"): [name]
                    for name in self
                }
        # (temporary file, file) of everything reserved so far.
        files: list[tuple[Path, Path]] = []
        try:
            for file, names in plan.items():
                arrays = [self[name] for name in names]
                files.append((_reserve(file, arrays), file))
                if not _is_exr(file):
                    if self._write_image(oiio, names[0], *files[-1]):
                        continue
                    files.pop()[0].unlink()
                    beside = file.with_suffix(".exr")
                    files.append((_reserve(beside, arrays), beside))
                self._write_exr(oiio, names, *files[-1])
            for temporary, file in files:
                try:
                    temporary.replace(file)
                except OSError as error:
                    raise OSError(error.errno, error.strerror, str(file)) from error
        finally:
            for temporary, _ in files:
                temporary.unlink(missing_ok=True)
        return [file for _, file in files]

    def _write_image(self, oiio: ModuleType, name: str, temporary: Path, file: Path) -> bool:
        """Write one framebuffer to a file of any format; False if the format cannot hold it."""
        pixels = _with_channel_axis(self[name])
        writer = oiio.ImageOutput.create(str(temporary))
        if pixels.shape[2] == 4 and not writer.supports("alpha"):
            opaque = 255 if pixels.dtype == np.uint8 else 1.0
            if not (pixels[:, :, 3] == opaque).all():
                return False
            pixels = pixels[:, :, :3]
        if not _holds(oiio, temporary, pixels):
            return False
        spec = self._spec(oiio, pixels)
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
        self, oiio: ModuleType, names: Iterable[str], temporary: Path, file: Path
    ) -> None:
        parts: list[NDArray[Any]] = []
        specs: list[Any] = []
        height, width = self[_leading(self)].shape[:2]
        for name in names:
            pixels = _with_channel_axis(self[name])
            if pixels.dtype == np.uint8:
                pixels = (pixels / np.float32(255)).astype(np.float16)
            spec = self._spec(oiio, pixels)
            # What OpenEXR calls the name of the part.
            spec.attribute("oiio:subimagename", name)
            spec.attribute("vkbloom:dtype", str(self[name].dtype))
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

    def _spec(self, oiio: ModuleType, pixels: NDArray[Any]) -> OpenImageIO.ImageSpec:
        """Describe an (H, W, C) array to OpenImageIO, with what the frames came from."""
        height, width, channels = pixels.shape
        spec: OpenImageIO.ImageSpec = oiio.ImageSpec(
            width, height, channels, _PIXEL_TYPES[str(pixels.dtype)]
        )
        settings = json.dumps(self._settings.as_dict())
        adapter = self._info.get("adapter", "an unnamed adapter")
        spec.attribute("Software", f"vkbloom {self._info.get('version', '')}".rstrip())
        spec.attribute("ImageDescription", f"vkbloom on {adapter}, settings {settings}")
        for key, value in self._info.items():
            spec.attribute(f"vkbloom:{key}", str(value))
        spec.attribute("vkbloom:settings", settings)
        spec.attribute("vkbloom:timings", json.dumps(self._timings))
        return spec

    def _picture(self, name: str, size: tuple[int, int] | None = None) -> NDArray[np.uint8]:
        """Return a framebuffer as an 8-bit (H, W, C) picture, resized to (width, height)."""
        array = self[name]
        values = _with_channel_axis(array).astype(np.float32)
        linear = False
        if array.dtype == np.uint8:
            shown = values / np.float32(255)
        elif array.ndim == 2:
            shown = np.float32(1) - _stretched(values)
        elif name == "position":
            shown = _stretched(values)
        elif name == "normal":
            shown = _clipped(values * np.float32(0.5) + np.float32(0.5))
        else:
            shown = _clipped(values)
            linear = name != "final" or self._settings.encoding == "none"
        if size is not None:
            shown = _resized(shown, *size)
        if linear:
            shown[:, :, :3] = _srgb(shown[:, :, :3])
        picture: NDArray[np.uint8] = np.rint(shown * np.float32(255)).astype(np.uint8)
        return picture

    def _repr_png_(self) -> bytes | None:
        """Return `final` as PNG, or else the last image, or else the last framebuffer.

        8-bit images are shown as stored. Float images are clipped to 0..1 and shown with
        the sRGB curve, unless the settings' encoding was already applied to them; `normal`
        is shown as (n + 1) / 2, `position` with each axis stretched to 0..1, depth from
        white (nearest) to black (farthest). NaN counts as 0. None without framebuffers.
        """
        if not self._arrays:
            return None
        return _png(self._picture(_leading(self)))

    def _repr_html_(self) -> str:
        """Return a contact sheet of all framebuffers, with the pass times, as HTML.

        Pictures are as in `_repr_png_`, without alpha, so that nothing is hidden, and
        averaged down to 320 pixels at most. Colours are those of the page.
        """
        page = ['<div style="color:inherit;color-scheme:light dark;font-size:13px;max-width:68em">']
        page.append(
            '<div style="display:grid;gap:12px;'
            'grid-template-columns:repeat(auto-fill,minmax(200px,1fr))">'
        )
        for name, array in self.items():
            height, width = array.shape[:2]
            shrink = min(1.0, _THUMBNAIL_SIDE / max(width, height))
            picture = self._picture(name, _scaled(width, height, shrink))[:, :, :3]
            data = base64.b64encode(_png(picture)).decode("ascii")
            # An enlarged level of a pyramid shall show its pixels.
            rendering = "auto" if max(picture.shape[:2]) >= _THUMBNAIL_SIDE / 2 else "pixelated"
            label, size = html.escape(name), html.escape(_described(array))
            page.append(
                '<figure style="margin:0">'
                f'<img src="data:image/png;base64,{data}" alt="{label}, {size}" '
                'style="display:block;width:100%;height:auto;max-width:none;'
                f"aspect-ratio:{_aspect(self):.4g};object-fit:contain;"
                f'background:rgba(128,128,128,.15);image-rendering:{rendering}">'
                f'<figcaption><b>{label}</b> <span style="opacity:.7">{size}</span></figcaption>'
                "</figure>"
            )
        page.append("</div>")
        if self._timings:
            page.append(self._timings_html())
        facts = [f"{key} {value}" for key, value in self._info.items()]
        page.append(
            '<div style="margin-top:10px;opacity:.8">' + html.escape(", ".join(facts)) + "<br>"
            '<code style="color:inherit;background:none;padding:0;white-space:pre-wrap;'
            f'overflow-wrap:anywhere">{html.escape(repr(self._settings))}</code></div></div>'
        )
        return "".join(page)

    def _timings_html(self) -> str:
        longest = max((t for t in self._timings.values() if math.isfinite(t)), default=0.0)
        adapter = html.escape(str(self._info.get("adapter", "the device")))
        rows = [
            f'<div style="margin-top:10px">Time of each pass on {adapter}</div>'
            '<div style="display:grid;grid-template-columns:max-content 1fr max-content;'
            'gap:2px 8px;align-items:center">'
        ]
        for name, seconds in self._timings.items():
            part = seconds / longest if longest > 0 and math.isfinite(seconds) else 0.0
            rows.append(
                f"<div>{html.escape(name)}</div>"
                f'<div style="width:{100 * part:.1f}%;height:.7em;background:#5b8def;'
                'border-radius:2px"></div>'
                f'<div style="text-align:right">{1e3 * seconds:.3f} ms</div>'
            )
        rows.append("</div>")
        return "".join(rows)


def dimensions(arrays: Mapping[str, NDArray[Any]]) -> dict[str, tuple[str, ...]]:
    """Name the axes of framebuffers, so that those of one size share their dimensions.

    Framebuffers of the size of `final` (or, without it, of the last image) have the
    dimensions "y" and "x"; others "<first>_y" and "<first>_x", where <first> is the first
    framebuffer of that size. Likewise "channel" belongs to `final`'s number of channels
    and "<first>_channel" to any other. So `glow - blur_vertical` is an image, and not an
    array of six dimensions.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        Images of shape (H, W, C) and depth of shape (H, W), one at least.

    Returns
    -------
    dict of str to tuple of str
        The names of the axes by framebuffer, three for images, two for depth.
    """
    shape = arrays[_leading(arrays)].shape
    # Keys are (H, W) and (C,), which cannot meet.
    prefixes = {shape[:2]: "", shape[2:]: ""}
    named: dict[str, tuple[str, ...]] = {}
    for name, array in arrays.items():
        plane = prefixes.setdefault(array.shape[:2], f"{name}_")
        named[name] = (f"{plane}y", f"{plane}x")
        if array.ndim == 3:
            named[name] += (prefixes.setdefault(array.shape[2:], f"{name}_") + "channel",)
    return named


def contact_sheet_png(frames: Frames, columns: int = 3, width: int = 320) -> bytes:
    """Return a labelled contact sheet of all framebuffers as PNG.

    Pictures are shown as in a notebook, without alpha, fitted into cells that have the
    shape of `final`; small ones are enlarged with hard pixels. The labels are drawn by
    OpenImageIO; where that or its fonts are missing, they are left out with a warning.

    Parameters
    ----------
    frames : Frames
        One framebuffer at least.
    columns : int, default 3
        Pictures in a row, 1 to 32.
    width : int, default 320
        Width of a picture in pixels, 128 to 4096.

    Returns
    -------
    bytes
        An 8-bit RGB PNG file.

    Raises
    ------
    TypeError
        If `columns` or `width` is not an integer.
    ValueError
        If `columns` or `width` is out of range, or `frames` is empty.
    """
    columns = _in_range("columns", columns, 1, 32)
    width = _in_range("width", width, 128, 4096)
    if not frames:
        raise ValueError("frames: a contact sheet needs one framebuffer at least")
    columns = min(columns, len(frames))
    height = round(width / _aspect(frames))
    text = max(11, width // 20)
    gap, caption = text, 3 * text
    rows = -(-len(frames) // columns)
    sheet = np.full(
        (
            gap + 2 * text + rows * (height + caption + gap),
            gap + columns * (width + gap),
            3,
        ),
        24,
        np.uint8,
    )
    version, adapter = frames.info.get("version", ""), frames.info.get("adapter", "")
    labels = [(gap, gap + text, f"vkbloom {version}".strip() + (f" on {adapter}" * bool(adapter)))]
    for index, (name, array) in enumerate(frames.items()):
        row, column = divmod(index, columns)
        left = gap + column * (width + gap)
        top = gap + 2 * text + row * (height + caption + gap)
        fit = min(width / array.shape[1], height / array.shape[0])
        picture = frames._picture(name, _scaled(array.shape[1], array.shape[0], fit))[:, :, :3]
        y = top + (height - picture.shape[0]) // 2
        x = left + (width - picture.shape[1]) // 2
        sheet[top : top + height, left : left + width] = 40
        sheet[y : y + picture.shape[0], x : x + picture.shape[1]] = picture
        baseline = top + height + text + text // 4
        labels += [(left, baseline, name), (left, baseline + text + 2, _described(array))]
    return _png(_labelled(sheet, labels, text))


def _labelled(
    sheet: NDArray[np.uint8], labels: Iterable[tuple[int, int, str]], size: int
) -> NDArray[np.uint8]:
    """Draw texts at (x, baseline y), in light grey; without a font, leave them out."""
    try:
        oiio = _import_openimageio("A labelled contact sheet")
    except ModuleNotFoundError as error:
        warnings.warn(f"the contact sheet has no labels: {error}", stacklevel=3)
        return sheet
    canvas = oiio.ImageBuf(sheet)
    for x, y, label in labels:
        if not oiio.ImageBufAlgo.render_text(canvas, x, y, label, size, "", (0.87, 0.87, 0.87)):
            warnings.warn(f"the contact sheet has no labels: {canvas.geterror()}", stacklevel=3)
            return sheet
    drawn: NDArray[np.uint8] = canvas.get_pixels(oiio.UINT8)
    return drawn


def _checked(name: str, array: NDArray[Any]) -> NDArray[Any]:
    if not isinstance(name, str):
        raise TypeError(f"arrays: a framebuffer's name is a str, not {type(name).__name__}")
    if not name.isidentifier():
        raise ValueError(f"arrays: {name!r} cannot name a framebuffer; it must be an identifier")
    if not isinstance(array, np.ndarray):
        raise TypeError(f"arrays[{name!r}]: an ndarray is needed, not {type(array).__name__}")
    is_image = array.ndim == 3 and array.shape[2] in (3, 4) and array.dtype in _IMAGE_DTYPES
    is_depth = array.ndim == 2 and array.dtype == np.float32
    if not (is_image or is_depth) or array.size == 0:
        raise ValueError(
            f"arrays[{name!r}]: {array.dtype} of shape {array.shape} is neither an image, "
            "(H, W, 3) or (H, W, 4) of uint8, float16 or float32, nor depth, (H, W) of float32"
        )
    return np.asarray(array)


def _leading(arrays: Mapping[str, NDArray[Any]]) -> str:
    """Name the framebuffer that stands for all: `final`, the last image, or the last."""
    if "final" in arrays:
        return "final"
    images = [name for name, array in arrays.items() if array.ndim == 3]
    return (images or list(arrays))[-1]


def _aspect(arrays: Mapping[str, NDArray[Any]]) -> float:
    """Width by height of the cells of a contact sheet: that of the leading framebuffer.

    Bounded, so that a strip of one pixel still leaves room to look at the others.
    """
    height, width = arrays[_leading(arrays)].shape[:2]
    return float(min(max(width / height, 0.5), 3.0))


def _with_channel_axis(array: NDArray[Any]) -> NDArray[Any]:
    return array if array.ndim == 3 else array[:, :, np.newaxis]


def _described(array: NDArray[Any]) -> str:
    return f"{array.shape[1]} x {array.shape[0]}, {array.dtype}"


def _in_range(field: str, value: int, low: int, high: int) -> int:
    try:
        index = operator.index(value)
    except TypeError:
        raise TypeError(f"{field}: an int is needed, not {type(value).__name__}") from None
    if not low <= index <= high:
        raise ValueError(f"{field}: {index} is outside {low} to {high}")
    return index


def _import_openimageio(purpose: str) -> ModuleType:
    try:
        return importlib.import_module("OpenImageIO")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{purpose} needs OpenImageIO: pip install vkbloom[images]", name=error.name
        ) from error


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


def _clipped(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Clip to 0..1; NaN gives 0."""
    finite = np.nan_to_num(values, nan=0.0, posinf=1.0, neginf=0.0)
    return np.clip(finite, 0.0, 1.0)


def _stretched(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Map each channel's finite range to 0..1; a channel of one value gives 0."""
    finite = np.isfinite(values)
    low: NDArray[np.float32] = values.min(axis=(0, 1), where=finite, initial=np.inf)
    high: NDArray[np.float32] = values.max(axis=(0, 1), where=finite, initial=-np.inf)
    # Also positive where no value is finite, and the range therefore inf to -inf.
    span = np.maximum(high - low, np.finfo(np.float32).tiny)
    return _clipped((np.clip(values, low, high) - low) / span)


def _srgb(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """Apply the sRGB transfer function of IEC 61966-2-1 to values in 0..1."""
    curve = np.float32(1.055) * linear ** np.float32(1 / 2.4) - np.float32(0.055)
    return np.where(linear <= 0.0031308, linear * np.float32(12.92), curve)


def _scaled(width: int, height: int, factor: float) -> tuple[int, int]:
    return max(1, round(width * factor)), max(1, round(height * factor))


def _resized(image: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """Average groups of pixels where an (H, W, C) image shrinks, repeat them where it grows."""
    for axis, wanted in ((0, height), (1, width)):
        count = image.shape[axis]
        starts = np.arange(wanted) * count // wanted
        if wanted < count:
            lengths = np.diff(starts, append=count).astype(np.float32)
            sums = np.add.reduceat(image, starts, axis=axis)
            image = sums / lengths.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        else:
            image = image.take(starts, axis=axis)
    return image


def _png(pixels: NDArray[np.uint8]) -> bytes:
    """Encode an (H, W, C) picture of 1, 3 or 4 channels as PNG (W3C PNG specification).

    Here so that notebooks show pictures with nothing but NumPy installed; files that users
    save are written by OpenImageIO.
    """
    height, width, channels = pixels.shape
    rows = pixels.reshape(height, width * channels)
    # Filter type 2, each row less the one above, compresses soft pictures far better.
    filtered = np.full((height, 1 + rows.shape[1]), 2, np.uint8)
    filtered[:, 1:] = rows
    filtered[1:, 1:] -= rows[:-1]
    colour_type = {1: 0, 3: 2, 4: 6}[channels]
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour_type, 0, 0, 0)),
        (b"IDAT", zlib.compress(filtered.tobytes())),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
