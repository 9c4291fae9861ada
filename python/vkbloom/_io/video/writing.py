"""Write videos frame by frame; a file is complete, or there is none."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._io import safe_writing
from vkbloom._io.displayed import (
    Saved,
    check_saved,
    convert,
    names_of_points,
    points_of_names,
)
from vkbloom._io.picture import Picture
from vkbloom._io.video.coding import BT709, BT2020, MATRICES, Codec, Coding, to_planes
from vkbloom._io.video.reading import naming, plane_format
from vkbloom._numbers import check_index

if TYPE_CHECKING:
    from av.container import OutputContainer

# FFmpeg's names of the encoders.
_ENCODERS: Final[Mapping[Codec, str]] = {"ffv1": "ffv1", "h264": "libx264", "h265": "libx265"}
_FORMATS: Final = {".mkv": "matroska", ".mp4": "mp4", ".m4v": "mp4", ".mov": "mov"}
#: The extensions of videos that can be written.
WRITABLE: Final = tuple(_FORMATS)
# Constant rate factors of quality 1 and 100; 100 is lossless.
_MAX_FACTOR: Final = 51.0
_DEFAULT_QUALITY: Final = 70
_LOSSLESS: Final = 100
# FFmpeg's AVColorRange.
_NARROW, _FULL = 1, 2
# Bits that encoders are tried with, if they have not those of the source.
_BITS: Final = (16, 12, 10, 8)


class Layout(NamedTuple):
    """What a video is written as.

    - `size`: Width and height in pixels.
    - `rate`: Frames per second; of varying times, about.
    - `time_base`: The unit of times, in seconds.
    - `aspect`: Width of a pixel by its height.
    - `quality`: 1 to 100, which is lossless; None: good. FFV1 is always lossless.
    - `audio`: The file whose audio is copied; "": none.
    """

    size: tuple[int, int]
    rate: Fraction
    time_base: Fraction
    coding: Coding
    codec: Codec
    aspect: Fraction = Fraction(1)
    quality: int | None = None
    audio: str = ""


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise ValueError for a name whose extension is none of `WRITABLE`."""
    suffix = Path(path).suffix
    if suffix.lower() not in WRITABLE:
        raise ValueError(
            f"{os.fspath(path)}: {suffix!r} is not the extension of a writable video; take one of "
            + ", ".join(WRITABLE)
        )


def check_options(
    path: str | os.PathLike[str],
    codec: Codec | None,
    saved: Saved,
    quality: int | None,
    bits: int | None,
) -> None:
    """Raise ValueError for a video that cannot be written, or not as these options say."""
    check_writable(path)
    check_saved(saved)
    if codec not in (None, *get_args(Codec)):
        raise ValueError(f"codec: {codec!r} is not one of {', '.join(get_args(Codec))}")
    if saved.view is not None:
        raise ValueError("view: videos have none; give their encoding and primaries")
    if quality is not None:
        check_index("quality", quality, 1, 100)
        if codec == "ffv1" or (codec is None and Path(path).suffix.lower() == ".mkv"):
            raise ValueError("quality: ffv1 is lossless; h264 and h265 have a quality")
    if bits not in (None, 8, 10, 12, 16):
        raise ValueError(f"bits: {bits} is not one of 8, 10, 12, 16")


def choose_coding(
    path: str | os.PathLike[str],
    picture: Picture,
    source: Coding | None,
    *,
    codec: Codec | None,
    saved: Saved,
    bits: int | None,
) -> tuple[Codec, Coding]:
    """Return the codec and the coding of a video, closest to that of its source.

    - `picture`: What is written first: linear, or on a curve with Rec. 709's primaries.
    - `source`: The coding of the video that the pictures come from; None: they come from images.
    - `codec`: None: FFV1 for .mkv, else H.264, or H.265 for more than 8 bits.
    - `saved`: Curve and primaries to write; `Saved()`: those of the source, or sRGB.
    """
    is_lossless = codec == "ffv1" or (codec is None and Path(path).suffix.lower() == ".mkv")
    coding = source or _coding_of_images(picture, is_lossless=is_lossless)
    if picture.encoding != "linear":
        primaries, curve = points_of_names("rec709", picture.encoding or "none")
        coding = _with_colours(coding, primaries, curve)
    elif saved != Saved():
        coding = _with_colours(coding, *points_of_names(saved.primaries, saved.curve or "srgb"))
    least = 10 if coding.is_hdr else 8
    coding = replace(coding, bits=bits or max(coding.bits, least))
    if codec is None:
        codec = "ffv1" if is_lossless else "h264" if coding.bits == 8 else "h265"
    return codec, _closest(coding, codec, os.fspath(path), is_fixed=bits is not None)


def _coding_of_images(picture: Picture, *, is_lossless: bool) -> Coding:
    primaries, curve = points_of_names("rec709", "srgb")
    colours: dict[str, Any] = {"primaries": primaries, "curve": curve}
    if is_lossless:
        bits = {"uint8": 8, "uint16": 16}.get(picture.numbers, 10)
        return Coding(kind="rgb", bits=bits, **colours)
    return Coding(kind="yuv", bits=8, shifts=(1, 1), matrix=BT709, is_narrow=True, **colours)


def _with_colours(coding: Coding, primaries: int, curve: int) -> Coding:
    """Return a coding with other colours, and the matrix that belongs to them."""
    rec2020 = points_of_names("rec2020", "none")[0]
    matrix = BT2020 if primaries == rec2020 else BT709
    return replace(coding, primaries=primaries, curve=curve, matrix=matrix)


def _closest(coding: Coding, codec: Codec, path: str, *, is_fixed: bool) -> Coding:
    """Return the closest coding that the encoder has, or raise ValueError."""
    av = import_extra("av", "video", "Writing videos")
    name = _ENCODERS[codec]
    try:
        known = {found.name for found in av.Codec(name, "w").video_formats or ()}
    except (av.error.FFmpegError, ValueError) as error:
        raise ValueError(f"{path}: this PyAV is built without {name}; write .mkv (FFV1)") from error
    others = [bits for bits in _BITS if bits < coding.bits] + [
        bits for bits in reversed(_BITS) if bits > coding.bits
    ]
    matrix = coding.matrix if coding.matrix in MATRICES else BT709
    in_luma = [
        replace(coding, kind="yuv", shifts=shifts, matrix=matrix, is_narrow=True)
        for shifts in ((0, 0), (1, 1))
    ]
    for bits in (coding.bits, *(() if is_fixed else others)):
        for one in (coding, *in_luma):
            tried = replace(one, bits=bits)
            if _format_of(tried, codec) in known:
                return tried
    raise ValueError(f"{path}: {codec} has no pixels of {coding.bits} bits")


def _format_of(coding: Coding, codec: Codec) -> str:
    if codec == "ffv1" and coding.kind == "rgb" and coding.bits == 8:
        return "bgr0"
    return plane_format(coding.kind, coding.bits, coding.shifts)


def encode_signal(picture: Picture, coding: Coding) -> NDArray[np.float32]:
    """Return a picture's red, green and blue as a signal of 0..1, on the curve of a coding."""
    values = picture.pixels[:, :, :3]
    if values.dtype.kind == "u":
        values = values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max)
    if picture.encoding == "linear":
        primaries, curve = names_of_points(coding.read_primaries, coding.read_curve)
        oiio = import_extra("OpenImageIO", "images", "Writing videos")
        saved, expand = Saved(curve, primaries), picture.expand
        values, _ = convert(oiio, values, saved, curve, is_integer=True, expand=expand)
    signal = np.nan_to_num(values.astype(np.float32), nan=0.0, posinf=1.0, neginf=0.0)
    made: NDArray[np.float32] = np.clip(signal, 0, 1)
    return made


@contextlib.contextmanager
def writing(path: str | os.PathLike[str], layout: Layout) -> Iterator[VideoWriter]:
    """Yield a writer of a video; the file is there when the block ends, unless it raises."""
    check_writable(path)
    name = os.fspath(path)
    with safe_writing.replacing_stream(Path(path)) as stream, naming(name):
        writer = VideoWriter(stream, name, layout)
        try:
            yield writer
            writer.finish()
        finally:
            writer.close()


class VideoWriter:
    """An encoder of pictures and a container, opened by `writing`."""

    def __init__(self, stream: Any, name: str, layout: Layout) -> None:
        av = import_extra("av", "video", "Writing videos")
        self._av, self._layout, self._name = av, layout, name
        coding = layout.coding
        suffix = Path(name).suffix.lower()
        self._last: int | None = None
        self._count = 0
        self._lock, self._is_closed = threading.Lock(), False
        self._durations: dict[int, int] = {}
        self._audio: _AudioCopy | None = None
        self._container: OutputContainer = av.open(stream, "w", format=_FORMATS[suffix])
        # By it the command knows its own files.
        self._container.metadata["comment"] = safe_writing.PROGRAM
        try:
            encoder = _ENCODERS[layout.codec]
            options = _options_of(layout)
            self._stream: Any = self._container.add_stream(encoder, layout.rate, options=options)
            context = self._stream.codec_context
            context.width, context.height = layout.size
            context.pix_fmt = self._format = _format_of(coding, layout.codec)
            context.time_base = layout.time_base
            context.color_primaries, context.color_trc = coding.primaries, coding.curve
            context.colorspace = 0 if coding.kind == "rgb" else coding.matrix
            context.color_range = _NARROW if coding.is_narrow else _FULL
            context.sample_aspect_ratio = layout.aspect
            if layout.codec == "h265" and suffix != ".mkv":
                # Apple's players take this name alone.
                context.codec_tag = "hvc1"
            if layout.audio:
                self._audio = _AudioCopy(layout.audio, self._container)
            self._start()
        except BaseException:
            self.close()
            raise

    def _start(self) -> None:
        try:
            self._container.start_encoding()
        except self._av.error.FFmpegError as error:
            what: str = self._layout.codec
            if self._audio is not None:
                what += f" with audio of {', '.join(self._audio.codecs)}"
            reason = error.strerror or str(error)
            raise ValueError(f"{self._name}: cannot hold {what}: {reason}; try .mkv") from error

    def write(self, picture: Picture, time: Fraction, duration: Fraction | None = None) -> None:
        """Write a picture, linear or on the curve that the coding has, at a time in seconds.

        Raises
        ------
        ValueError
            If it has another size, or is not later than the one before.
        """
        width, height = self._layout.size
        if picture.pixels.shape[:2] != (height, width):
            shape = picture.pixels.shape
            raise ValueError(
                f"{self._name}: a frame has {shape[1]} x {shape[0]} pixels, the first one "
                f"{width} x {height}"
            )
        base = self._layout.time_base
        number = round(time / base)
        if self._last is not None and number <= self._last:
            raise ValueError(
                f"{self._name}: a frame at {float(time):.6g} s is not later than the one before"
            )
        self._last, self._count = number, self._count + 1
        if duration is not None:
            self._durations[number] = max(1, round(duration / base))
        frame = self._frame_of(picture)
        frame.pts, frame.time_base = number, base
        with self._lock:
            if self._is_closed:
                raise ValueError(f"{self._name}: the video is closed")
            self._mux(self._stream.encode(frame))
            if self._audio is not None:
                self._audio.copy(until=time)

    def finish(self) -> None:
        """Write what is left, and the end of the container."""
        self._mux(self._stream.encode())
        if self._audio is not None:
            self._audio.copy(until=None)
        self._container.close()

    def close(self) -> None:
        """Close the files, of a video that is complete or given up."""
        # FFmpeg crashes if a thread writes to what another one closes.
        with self._lock:
            self._is_closed = True
            if self._audio is not None:
                self._audio.close()
            with contextlib.suppress(self._av.error.FFmpegError, OSError, ValueError):
                self._container.close()

    def _mux(self, packets: list[Any]) -> None:
        for packet in packets:
            duration = self._durations.pop(packet.pts, None)
            if duration is not None and packet.time_base == self._layout.time_base:
                packet.duration = duration
            if self._count == 1:
                # x265 gives a sole frame a random decoding time (4.2 in FFmpeg 8.1).
                packet.dts = packet.pts
            self._container.mux_one(packet)

    def _frame_of(self, picture: Picture) -> Any:
        coding = self._layout.coding
        planes = to_planes(encode_signal(picture, coding), coding)
        frame = self._av.VideoFrame(*self._layout.size, self._format)
        if self._format == "bgr0":
            green, blue, red = planes
            packed = np.stack([blue, green, red, np.zeros_like(red)], axis=2)
            planes = [packed.reshape(packed.shape[0], -1)]
        for plane, values in zip(frame.planes, planes, strict=True):
            rows = np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)
            content = np.ascontiguousarray(
                values.astype(values.dtype.newbyteorder("<"), copy=False)
            )
            content = content.view(np.uint8)
            rows[: content.shape[0], : content.shape[1]] = content
        frame.color_primaries, frame.color_trc = coding.primaries, coding.curve
        frame.colorspace = 0 if coding.kind == "rgb" else coding.matrix
        frame.color_range = _NARROW if coding.is_narrow else _FULL
        return frame


def _options_of(layout: Layout) -> dict[str, str]:
    """Return an encoder's options."""
    quality = _DEFAULT_QUALITY if layout.quality is None else layout.quality
    factor = f"{_MAX_FACTOR * (1 - (quality - 1) / (_LOSSLESS - 1)):.1f}"
    if layout.codec == "ffv1":
        # Version 3 with a checksum of each slice.
        return {"level": "3", "slicecrc": "1"}
    if layout.codec == "h264":
        return {"qp": "0"} if quality == _LOSSLESS else {"crf": factor}
    # x265 prints on standard error.
    quiet = "log-level=error"
    if quality == _LOSSLESS:
        return {"x265-params": f"{quiet}:lossless=1"}
    return {"x265-params": quiet, "crf": factor}


class _AudioCopy:
    """The audio of a file, copied to a container as it is coded."""

    def __init__(self, source: str, output: OutputContainer) -> None:
        av = import_extra("av", "video", "Copying audio")
        self._output = output
        self._opened = contextlib.ExitStack()
        with naming(source), contextlib.ExitStack() as stack:
            stream = stack.enter_context(open(source, "rb"))
            container = stack.enter_context(av.open(stream))
            audio = container.streams.audio
            self._targets = {one.index: output.add_stream_from_template(one) for one in audio}
            self.codecs = [one.codec_context.name for one in audio]
            self._packets = container.demux(*audio)
            self._opened = stack.pop_all()
        self._source = source
        self._next: Any = None

    def copy(self, *, until: Fraction | None) -> None:
        """Copy what comes before a time in seconds; None: all."""
        with naming(self._source):
            while (packet := self._next or next(self._packets, None)) is not None:
                self._next = None
                if packet.dts is None:
                    continue
                if until is not None and packet.dts * Fraction(packet.time_base) > until:
                    self._next = packet
                    return
                packet.stream = self._targets[packet.stream.index]
                self._output.mux_one(packet)

    def close(self) -> None:
        """Close the file."""
        self._opened.close()
