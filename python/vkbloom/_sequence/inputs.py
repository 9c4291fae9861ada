"""What a sequence reads: images, files, videos and the times of a scene, each frame at its time."""

from __future__ import annotations

import itertools
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterable, Iterator
from collections.abc import Sequence as AnySequence
from contextlib import ExitStack, closing, suppress
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeAlias

import numpy as np

from vkbloom._io.numbered_files import NumberedFile, files_of, gap_note, pattern_of
from vkbloom._io.picture import Picture
from vkbloom._io.video.reading import VideoFile, VideoPicture, is_video
from vkbloom._locks import cached_property
from vkbloom._numbers import check_above, check_floats
from vkbloom._settings.settings import Settings, check_settings

if TYPE_CHECKING:
    from vkbloom._presets.start import Start

#: The seconds in which the animation of a scene runs once, as in a window.
TURN_SECONDS: Final = 8.0
#: Frames per second of images where a program gives none.
DEFAULT_RATE: Final = Fraction(24)
# Frames of a video before this one are decoded from the begin on.
_MIN_SOUGHT: Final = 24


class Taken(NamedTuple):
    """A frame that was read.

    - `image`: Its pixels; of a scene, the periods of its animation.
    - `time`, `duration`: Its own, in seconds; None: it has none.
    - `origin`: What it was read from, for who reads it.
    """

    image: Any
    time: float | None = None
    duration: float | None = None
    origin: Any = None


#: Frames as they are read.
_Reading: TypeAlias = Generator[Taken, None, None]


class Chosen(NamedTuple):
    """The settings of a call: `settings` and `fields` of `sequence`."""

    settings: Settings | str | None
    fields: dict[str, Any]

    def of_arrays(self, *, of_image: bool) -> Settings:
        """Return the settings of images, or of a scene."""
        chosen = check_settings(self.settings, of_image=of_image)
        return chosen.replace(**self.fields) if self.fields else chosen

    def of_file(self, highlights: Any) -> Start:
        """Return where a file with these highlights starts."""
        from vkbloom._presets.start import start_of  # noqa: PLC0415  costs start-up time

        return start_of(highlights, self.settings, self.fields)


class Moment(NamedTuple):
    """When a frame is: its place at constant frames per second, and its time in seconds."""

    place: int
    time: float | None


class Clock(NamedTuple):
    """The times of frames that a call gives: frames per second, or each one."""

    rate: float | None
    times: tuple[float, ...] | None

    def at(self, place: int) -> float | None:
        """Return the time in seconds of a frame or a gap; None: it is not given."""
        if self.times is not None:
            return self.times[place]
        return None if self.rate is None else place / self.rate

    def step(self, before: Moment | None, now: Moment, duration: float | None) -> float | None:
        """Return the seconds before a frame; None: as of a call that gives none.

        - `before`: That of the frame before. None: there is none. Then it is the time to the next.
        - `duration`: The frame's own.
        """
        if self.rate is not None:
            return (1 if before is None else now.place - before.place) / self.rate
        if before is not None and before.time is not None and now.time is not None:
            return max(0.0, now.time - before.time)
        if self.times is not None and len(self.times) > 1:
            return self.times[1] - self.times[0]
        return duration


def clock_of(fps: float | None, times: AnySequence[float] | None) -> Clock:
    """Return the clock of `fps` or `times` of a call; neither: frames have their own times."""
    if times is None:
        return Clock(None if fps is None else check_above("fps", fps), None)
    if fps is not None:
        raise ValueError("times: fps is given as well; leave one of them out")
    moments = check_floats("times", times)
    if not moments or any(later <= now for now, later in itertools.pairwise(moments)):
        raise ValueError("times: each one must be later than the one before")
    return Clock(None, moments)


class Input(ABC):
    """What a sequence reads.

    - `is_repeatable`: Whether it can be read more than once, and from any frame on.
    - `has_times`: Whether its frames have times of their own.
    """

    is_repeatable: bool = True
    has_times: bool = False

    @property
    @abstractmethod
    def settings(self) -> Settings:
        """The settings of all frames."""

    @abstractmethod
    def read(self, first: int) -> _Reading:
        """Yield from a frame on each one."""

    @abstractmethod
    def count(self) -> int | None:
        """Return how many frames there are; None: endless, or not known."""

    def decoded(self, first: int) -> _Reading:
        """Yield the same before they are developed for their bloom: of a file its `Picture`."""
        return self.read(first)

    def place_of(self, number: int) -> int:
        """Return the place in time of a frame at constant frames per second."""
        return number

    def time_of(self, number: int) -> float | None:
        """Return the time that a frame has by itself, in seconds; None: it has none."""
        return None


def moment_of(source: Input, clock: Clock, number: int, own: float | None) -> Moment:
    """Return when a frame is; `own`: the time that it has if the call gives none."""
    place = number if clock.times is not None else source.place_of(number)
    time = clock.at(place)
    return Moment(place, own if time is None else time)


class _Decoded(Input):
    """Frames that are decoded, by `decoded`, before they are developed for their bloom."""

    @property
    @abstractmethod
    def _start(self) -> Start | None:
        """Where all files start; None: the first item is none."""

    def read(self, first: int) -> _Reading:
        with closing(self.decoded(first)) as frames:
            for taken in frames:
                yield taken._replace(image=self._develop(taken.image))

    def _develop(self, decoded: Any) -> Any:
        if not isinstance(decoded, Picture):
            return decoded
        return (decoded if self._start is None else self._start.develop(decoded)).pixels


class _Arrays(_Decoded):
    """Images, or paths of image files, in any iterable."""

    def __init__(self, images: Any, chosen: Chosen) -> None:
        self._images, self._chosen = images, chosen
        self.is_repeatable = not isinstance(images, Iterator)

    @cached_property
    def _start(self) -> Start | None:
        has_items = hasattr(self._images, "__getitem__") and len(self._images) > 0
        first = self._images[0] if has_items else None
        if not isinstance(first, str | os.PathLike):
            return None
        return self._chosen.of_file(_highlights_of(first))

    @cached_property
    def settings(self) -> Settings:
        if self._start is not None:
            return self._start.settings
        return self._chosen.of_arrays(of_image=True)

    def decoded(self, first: int) -> _Reading:
        images = self._images
        if first and hasattr(images, "__getitem__"):
            # A list of lazily read images reads only those.
            read: Iterator[Any] = (images[number] for number in range(first, len(images)))
        else:
            read = itertools.islice(images, first, None)
        for image in read:
            yield Taken(_read(image) if isinstance(image, str | os.PathLike) else image)

    def count(self) -> int | None:
        return len(self._images) if hasattr(self._images, "__len__") else None


class _Files(_Decoded):
    """Files, each with the number of its frame; `read_file` decodes one."""

    def __init__(
        self,
        files: AnySequence[NumberedFile],
        chosen: Chosen,
        read_file: Callable[[str], Picture] | None = None,
    ) -> None:
        self._files, self._chosen = [name for name, _ in files], chosen
        numbers = [number for _, number in files if number is not None]
        # Without numbers, files are counted.
        is_numbered = len(numbers) == len(files)
        self._numbers: AnySequence[int] = numbers if is_numbered else range(len(files))
        self._read_file = read_file or _read

    @cached_property
    def _start(self) -> Start:
        return self._chosen.of_file(_highlights_of(self._files[0]))

    @property
    def settings(self) -> Settings:
        return self._start.settings

    def decoded(self, first: int) -> _Reading:
        for file in self._files[first:]:
            yield Taken(self._read_file(file))

    def count(self) -> int | None:
        return len(self._files)

    def place_of(self, number: int) -> int:
        return self._numbers[min(number, len(self._numbers) - 1)] - self._numbers[0]


def files_of_pattern(pattern: str) -> list[NumberedFile]:
    """Return the files of a pattern by their numbers; ValueError or OSError if there are none."""
    folder, name = os.path.split(pattern)
    found = pattern_of(name)
    if found is None:
        raise ValueError(
            f"frames: {pattern!r} is neither a video nor a pattern of numbers, such as f.%04d.exr"
        )
    files = files_of(folder, found)
    if not files:
        raise FileNotFoundError(f"{pattern}: no file was found")
    return files


class _Video(_Decoded):
    """The frames of a video."""

    has_times = True

    def __init__(self, path: str, chosen: Chosen) -> None:
        self._path, self._chosen = path, chosen
        # Fails at once if it is none.
        VideoFile(path).close()

    @cached_property
    def _start(self) -> Start:
        with closing(self.decoded(0)) as frames:
            for taken in frames:
                return self._chosen.of_file(taken.image.highlights)
        raise AssertionError("a video without frames is an error")

    @property
    def settings(self) -> Settings:
        return self._start.settings

    def decoded(self, first: int) -> _Reading:
        with ExitStack() as stack:
            for frame in self._frames(first, stack):
                yield Taken(frame.decode(), float(frame.time), float(frame.duration))

    def _frames(self, first: int, stack: ExitStack) -> Iterator[VideoPicture]:
        """Return the frames from one on; the stack closes their file."""
        file = stack.enter_context(VideoFile(self._path))
        time = self.time_of(first) if first > _MIN_SOUGHT else None
        if time is not None:
            frames, begun = stack.enter_context(closing(file.frames())), None
            with suppress(OSError, ValueError):
                file.seek(time)
                begun = next(frames, None)
            # Half of a unit: times are whole numbers of units.
            exact = time - float(file.time_base) / 2
            if begun is not None and begun.time <= time + float(file.time_base) / 2:
                every = itertools.chain([begun], frames)
                return itertools.dropwhile(lambda frame: frame.time < exact, every)
            # Its index is wrong: from the begin on.
            file = stack.enter_context(VideoFile(self._path))
        frames = stack.enter_context(closing(file.frames()))
        return itertools.islice(frames, first, None)

    @cached_property
    def _times(self) -> list[float]:
        with VideoFile(self._path) as file:
            return file.times()

    def count(self) -> int | None:
        return len(self._times)

    def time_of(self, number: int) -> float | None:
        return self._times[number] if number < len(self._times) else None


class Turns(Input):
    """The times of a scene, whose images are periods of its animation."""

    def __init__(self, clock: Clock, chosen: Chosen) -> None:
        self._clock, self._settings = clock, chosen.of_arrays(of_image=False)

    @property
    def settings(self) -> Settings:
        return self._settings

    def read(self, first: int) -> _Reading:
        count = self.count()
        for number in itertools.count(first) if count is None else range(first, count):
            time = self._clock.at(number)
            assert time is not None
            yield Taken(time / TURN_SECONDS, time)

    def count(self) -> int | None:
        return None if self._clock.times is None else len(self._clock.times)


def _highlights_of(path: str | os.PathLike[str]) -> Any:
    from vkbloom._io.image_file import ImageFile  # noqa: PLC0415  costs start-up time

    with ImageFile(path) as file:
        return file.header.highlights()


def _read(path: str | os.PathLike[str]) -> Picture:
    from vkbloom._io.image_file import read_picture  # noqa: PLC0415  costs start-up time

    return read_picture(path)


def input_of(frames: Any, chosen: Chosen, gaps: str) -> Input:
    """Return what reads frames other than those of a scene; `gaps` as for `sequence`."""
    if isinstance(frames, str | os.PathLike):
        path = os.fspath(frames)
        if is_video(path):
            return _Video(path, chosen)
        files = files_of_pattern(path)
        if gaps == "error" and (missing := gap_note(files)) is not None:
            raise ValueError(f'{path}: {missing}; gaps="time" takes them as time')
        return _Files(files, chosen)
    is_one = isinstance(frames, bytes) or (isinstance(frames, np.ndarray) and frames.ndim != 4)
    if is_one or not (isinstance(frames, Iterable) or hasattr(frames, "__getitem__")):
        raise TypeError(
            f"frames: {type(frames).__name__} is not an iterable of images, a pattern of files, a "
            "video or a scene"
        )
    return _Arrays(frames, chosen)


def open_input(
    frames: Any, clock: Clock, read_file: Callable[[str], Picture] | None = None
) -> Input:
    """Return what reads frames as for `sequence`, for who develops what is decoded.

    - `frames`: Also files with their numbers. Numbers that are missing are time.
    - `read_file`: Decodes one of these files.
    """
    from vkbloom._scene import Scene  # noqa: PLC0415  costs start-up time

    chosen = Chosen(None, {})
    if isinstance(frames, Scene):
        return Turns(clock, chosen)
    if read_file is not None:
        return _Files(frames, chosen, read_file)
    return input_of(frames, chosen, "time")
