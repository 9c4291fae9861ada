"""Read videos frame by frame."""

from __future__ import annotations

import errno
import os
from collections.abc import Generator, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._io.decoding import decode
from vkbloom._io.displayed import code_points_of
from vkbloom._io.picture import Colour, Header, Picture, StatedColours
from vkbloom._io.video.coding import (
    BT601,
    BT709,
    BT2020,
    HDR_CURVES,
    MATRICES,
    UNSPECIFIED,
    Coding,
    to_signal,
)

if TYPE_CHECKING:
    import av
    from av.container import InputContainer
    from av.video.frame import VideoFrame
    from av.video.stream import VideoStream

#: The extensions of videos.
EXTENSIONS: Final = frozenset(
    (
        *(".3gp", ".avi", ".flv", ".m2ts", ".m4v", ".mkv", ".mov", ".mp4", ".mpeg", ".mpg"),
        *(".mts", ".mxf", ".nut", ".ogv", ".ts", ".webm", ".wmv", ".y4m"),
    )
)
# Containers whose headers state how long they are, and which have an index of their frames.
_WITH_DURATION: Final = ("mov,mp4,m4a,3gp,3g2,mj2", "matroska,webm")
# Of the stated duration: how many of the last frame's durations, and seconds, may be missing.
_MISSING_FRAMES, _MISSING_SECONDS = 0.9, 0.002
_MICROSECONDS: Final = 1_000_000
# The longest time between the places of a frame in the file and on the screen.
_REORDERED_SECONDS: Final = 1.0
# FFmpeg's code points: of AVColorRange full; of side data, 9 numbers of 32 bits.
_FULL: Final = 2
_MAX_BITS: Final = 16
# Frames of this size or more have the matrix of BT.709 where a video does not say.
_MIN_HD: Final = (1280, 720)


@dataclass(frozen=True, eq=False, kw_only=True)
class VideoPicture:
    """A frame of a video.

    - `picture`: As stored, upright: a signal. `decode` makes it light.
    - `time`, `duration`: In seconds, on the clock of the video and its audio.
    - `aspect`: Width of a pixel by its height.
    """

    picture: Picture
    coding: Coding
    time: Fraction
    duration: Fraction
    aspect: Fraction = Fraction(1)

    def decode(self, colour: Colour | None = None) -> Picture:
        """Return the picture as linear light; `colour`: instead of what the video states."""
        made = decode(self.picture, colour)
        is_usual = not self.coding.is_hdr and self.coding.read_primaries == BT709
        # That videos have the colours of BT.709 is no news.
        return replace(made, notes=self.picture.notes) if is_usual else made


def is_video(path: str | os.PathLike[str]) -> bool:
    """Return whether a name has the extension of a video."""
    return Path(path).suffix.lower() in EXTENSIONS


@contextmanager
def naming(path: str) -> Iterator[None]:
    """Convert errors of PyAV to OSError and ValueError that name the file."""
    av = import_extra("av", "video", "Videos")
    try:
        yield
    except av.error.FFmpegError as error:
        if isinstance(error, MemoryError):
            raise
        reason = error.strerror or str(error)
        # FFmpeg has EIO where a file ends in its header. The system's is another exception.
        if isinstance(error, OSError) and error.errno != errno.EIO:
            raise OSError(error.errno, reason, path) from error
        raise ValueError(f"{path}: damaged, or not a video: {reason}") from error
    except OSError as error:
        # Of the file object, which PyAV calls.
        if error.filename is not None:
            raise
        if error.errno == errno.EINVAL:
            raise ValueError(f"{path}: damaged: it names a place outside of itself") from error
        raise OSError(error.errno, error.strerror or str(error), path) from error


class VideoFile:
    """A video file, open to be read once from its begin; a context manager that closes it.

    Errors are OSError and ValueError, which name the file.

    - `rate`: Mean frames per second, as the file states or as its first frames have it.
    - `time_base`: The unit of times, in seconds.
    - `count`: How many frames there are; 0: the file does not say.
    - `has_audio`: Whether there is audio that can be copied.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        av = import_extra("av", "video", "Reading videos")
        self._name = os.fspath(path)
        with ExitStack() as stack, naming(self._name):
            # A file object, so that any name is a file, and errors of reading are the system's.
            stream = stack.enter_context(open(self._name, "rb"))
            self._container: InputContainer = stack.enter_context(av.open(stream))
            self._stream = self._choose_stream()
            self.rate = Fraction(self._stream.average_rate or self._stream.guessed_rate or 25)
            self.time_base = Fraction(self._stream.time_base or 1 / self.rate)
            self.count: int = self._stream.frames
            # What the file says of the program that wrote it.
            self.comment: str = next(
                (
                    text
                    for key, text in self._container.metadata.items()
                    if key.lower() == "comment"
                ),
                "",
            )
            self.has_audio = bool(self._container.streams.audio)
            self._aspect = Fraction(self._stream.sample_aspect_ratio or 1) or Fraction(1)
            self._stream.thread_type = "AUTO"
            self._opened = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._opened.close()

    @property
    def frames_expected(self) -> int | None:
        """About how many frames there are, for a progress bar."""
        if self.count:
            return self.count
        duration = self._container.duration
        return None if duration is None else round(duration * self.rate / _MICROSECONDS)

    def times(self) -> list[float]:
        """Return the time of each frame in seconds, without decoding any; the file is read."""
        with naming(self._name):
            return sorted(
                float(packet.pts * self.time_base)
                for packet in self._container.demux(self._stream)
                if packet.pts is not None
            )

    def seek(self, time: float) -> None:
        """Let `frames` begin at a frame from which that of a time can be decoded.

        Where the container's index is wrong it begins later: who needs a frame looks at the time
        of the first one. A container without an index stays at its begin.
        """
        if self._container.format.name not in _WITH_DURATION:
            return
        # Frames are in the file in another order than they are shown.
        place = max(0.0, time - _REORDERED_SECONDS)
        with naming(self._name):
            self._container.seek(int(place / float(self.time_base)), stream=self._stream)

    def frames(self) -> Generator[VideoPicture, None, None]:
        """Yield the frames; ValueError where the file is damaged or ends too early."""
        end, last, number = Fraction(0), 1 / self.rate, 0
        with naming(self._name):
            for packet in self._container.demux():
                end = max(end, _end_of(packet))
                if packet.stream is not self._stream:
                    continue
                if packet.is_corrupt:
                    raise ValueError(f"{self._name}: damaged: frame {number} is not complete")
                for frame in cast("list[VideoFrame]", packet.decode()):
                    made = self._picture_of(frame, number)
                    last, number = made.duration, number + 1
                    end = max(end, made.time + last)
                    yield made
            if number == 0:
                raise ValueError(f"{self._name}: damaged: there are no frames")
            self._check_end(end, last)

    def _choose_stream(self) -> VideoStream:
        stream: VideoStream
        for stream in self._container.streams.video:
            # (The cover of an album is a stream of one picture.)
            if not stream.disposition.value & stream.disposition.__class__.attached_pic.value:
                return stream
        raise ValueError(f"{self._name}: there is no video in this file")

    def _check_end(self, end: Fraction, last: Fraction) -> None:
        """Raise ValueError if a file is shorter than its header states."""
        duration = self._container.duration
        if duration is None or self._container.format.name not in _WITH_DURATION:
            return
        start = Fraction(self._container.start_time or 0, _MICROSECONDS)
        stated = Fraction(duration, _MICROSECONDS)
        if stated - (end - start) > _MISSING_FRAMES * float(last) + _MISSING_SECONDS:
            raise ValueError(
                f"{self._name}: damaged: it ends after {float(end - start):.4g} s, but its header "
                f"states {float(stated):.4g} s"
            )

    def _picture_of(self, frame: VideoFrame, number: int) -> VideoPicture:
        if frame.is_corrupt:
            raise ValueError(f"{self._name}: damaged: frame {number} is not complete")
        coding, planes, left_out = self._planes_of(frame)
        matrix = _matrix_of(frame)
        signal = _upright(to_signal(planes, coding), matrix)
        aspect = self._aspect
        if _is_transposed(matrix):
            aspect = 1 / aspect
            coding = replace(coding, shifts=coding.shifts[::-1])
        points = code_points_of((coding.read_primaries, coding.read_curve, 0, 1), 3)
        numbers = "uint8" if coding.bits == 8 else "uint16"
        channels = ("Y",) if coding.kind == "grey" else ("R", "G", "B")
        header = Header(
            channels=channels,
            numbers=(numbers,) * len(channels),
            display=(0, 0, signal.shape[1], signal.shape[0]),
            colours=StatedColours(space=coding.name, code_points=points, is_encoded=True),
        )
        base = Fraction(frame.time_base or self.time_base)
        time = frame.pts * base if frame.pts is not None else number / self.rate
        duration = frame.duration * base if frame.duration else 1 / self.rate
        notes = (*coding.notes(), *left_out)
        picture = Picture(pixels=signal, header=header, numbers=numbers, notes=notes)
        return VideoPicture(
            picture=picture, coding=coding, time=time, duration=duration, aspect=aspect
        )

    def _planes_of(self, frame: VideoFrame) -> tuple[Coding, list[NDArray[Any]], list[str]]:
        """Return the coding of a frame, its planes as they are coded, and notes."""
        name, left_out = frame.format.name, []
        kind, bits, shifts = self._layout_of(frame.format)
        if frame.format.has_palette:
            bits = 8
        if any(component.is_alpha for component in frame.format.components):
            left_out.append("the alpha of the video is left out")
        planar = plane_format(kind, bits, shifts)
        is_full = name.startswith("yuvj") or frame.color_range == _FULL
        if frame.color_range == 0 and not is_full:
            # As FFmpeg takes what does not state its range.
            is_full = kind != "yuv"
        matrix = frame.colorspace if kind == "yuv" else BT709
        if kind == "yuv" and matrix not in (*MATRICES, UNSPECIFIED):
            raise ValueError(
                f"{self._name}: the colour matrix of code point {matrix} is not supported; convert "
                "the video to that of BT.709 or BT.2020 (non-constant luminance)"
            )
        if matrix == UNSPECIFIED:
            matrix = _assumed_matrix(frame)
        coding = Coding(
            kind=kind,
            bits=bits,
            shifts=shifts,
            matrix=matrix,
            primaries=frame.color_primaries,
            curve=frame.color_trc,
            is_narrow=not is_full,
        )
        if name.replace("yuvj", "yuv") != planar:
            # Packed, or with alpha: the same code values in planes.
            frame = frame.reformat(format=planar)
        dtype = np.dtype(np.uint8 if bits == 8 else "<u2")
        count = 1 if kind == "grey" else 3
        return coding, [_values_of(plane, dtype) for plane in frame.planes[:count]], left_out

    def _layout_of(self, pixels: av.VideoFormat) -> tuple[Any, int, tuple[int, int]]:
        """Return the kind of a pixel format, its bits, and the shifts of its smaller planes."""
        components = [part for part in pixels.components if not part.is_alpha]
        bits = max(part.bits for part in components)
        if "f16" in pixels.name or "f32" in pixels.name or bits > _MAX_BITS:
            raise ValueError(
                f"{self._name}: the pixel format {pixels.name} is not supported; use integers of "
                f"8 to {_MAX_BITS} bits"
            )
        bits = max(bits, 8)
        if pixels.is_rgb or pixels.has_palette:
            return "rgb", bits, (0, 0)
        if len(components) == 1:
            return "grey", bits, (0, 0)
        side = 1 << 10
        width, height = pixels.chroma_width(side), pixels.chroma_height(side)
        return "yuv", bits, ((side // width).bit_length() - 1, (side // height).bit_length() - 1)


#: Pixel formats' names of the shifts of smaller planes.
SUBSAMPLINGS: Final = {
    (0, 0): "444",
    (1, 0): "422",
    (1, 1): "420",
    (2, 0): "411",
    (2, 2): "410",
    (0, 1): "440",
}


def plane_format(kind: str, bits: int, shifts: tuple[int, int]) -> str:
    """Return FFmpeg's name of a planar pixel format."""
    begun = {"rgb": "gbrp", "grey": "gray"}.get(kind) or f"yuv{SUBSAMPLINGS[shifts]}p"
    return begun if bits == 8 else f"{begun}{bits}le"


def _assumed_matrix(frame: VideoFrame) -> int:
    """Return the matrix of a frame that states none."""
    if frame.color_primaries == BT2020 or frame.color_trc in HDR_CURVES:
        return BT2020
    is_hd = frame.width >= _MIN_HD[0] or frame.height >= _MIN_HD[1]
    return BT709 if is_hd else BT601


def _end_of(packet: av.Packet[Any]) -> Fraction:
    if packet.pts is None or packet.time_base is None:
        return Fraction(0)
    return (packet.pts + (packet.duration or 0)) * Fraction(packet.time_base)


def _values_of(plane: Any, dtype: np.dtype[Any]) -> NDArray[Any]:
    rows = np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)[: plane.height]
    values: NDArray[Any] = rows[:, : plane.width * dtype.itemsize].view(dtype)
    return values


def _matrix_of(frame: VideoFrame) -> NDArray[np.int32] | None:
    """Return the part of the display matrix that turns and mirrors; None: there is none."""
    for data in cast("Iterable[Any]", frame.side_data):
        if data.type.name == "DISPLAYMATRIX":
            numbers: NDArray[np.int32] = np.frombuffer(data, np.int32)[:9].reshape(3, 3)
            return numbers[:2, :2]
    return None


def _is_transposed(matrix: NDArray[np.int32] | None) -> bool:
    return matrix is not None and abs(int(matrix[0, 1])) > abs(int(matrix[0, 0]))


def _upright(signal: NDArray[Any], matrix: NDArray[np.int32] | None) -> NDArray[Any]:
    """Apply the display matrix, to multiples of 90 degrees: (x', y') = (a x + c y, b x + d y)."""
    if matrix is None:
        return signal
    (a, b), (c, d) = matrix.tolist()
    along_x, along_y = a, d
    if _is_transposed(matrix):
        signal = signal.swapaxes(0, 1)
        along_x, along_y = c, b
    if along_x < 0:
        signal = signal[:, ::-1]
    return np.ascontiguousarray(signal[::-1] if along_y < 0 else signal)
