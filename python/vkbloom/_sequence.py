"""Frames in time: a sequence whose bloom is computed when it is asked for."""

from __future__ import annotations

import itertools
import os
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from collections.abc import Sequence as AnySequence
from contextlib import ExitStack, closing, suppress
from fractions import Fraction
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._image_arguments import check_image, check_mask
from vkbloom._io.numbered_files import NumberedFile, files_of, gap_note, pattern_of
from vkbloom._io.picture import Picture
from vkbloom._io.video.reading import VideoFile, VideoPicture, is_video
from vkbloom._locks import cached_property
from vkbloom._numbers import check_above, check_floats, check_index
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer, take_exposure
from vkbloom._renderer.device_arrays import Device, on_cuda
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.sources import OF_SCENES, SCENE_SIZE
from vkbloom._settings.antialiasing import Antialiasing, check_antialiasing, check_use
from vkbloom._settings.exposure import Exposure
from vkbloom._settings.settings import Settings, Shading, check_settings

if TYPE_CHECKING:
    from vkbloom._presets.start import Start
    from vkbloom._scene import Scene

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


class _Chosen(NamedTuple):
    """The settings of a call: `settings` and `fields` of `sequence`."""

    settings: Settings | str | None
    fields: dict[str, Any]

    def of_arrays(self, *, of_image: bool) -> Settings:
        chosen = check_settings(self.settings, of_image=of_image)
        return chosen.replace(**self.fields) if self.fields else chosen

    def of_file(self, highlights: Any) -> Start:
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


class Input(ABC):
    """What a sequence reads.

    - `is_repeatable`: Whether it can be read more than once, and from any frame on.
    """

    is_repeatable: bool = True

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

    def __init__(self, images: Any, chosen: _Chosen) -> None:
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
        chosen: _Chosen,
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

    def __init__(self, path: str, chosen: _Chosen) -> None:
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


class _Turns(Input):
    """The times of a scene, whose images are periods of its animation."""

    def __init__(self, clock: Clock, chosen: _Chosen) -> None:
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


class Work(NamedTuple):
    """What computes frames.

    - `all`: Those of a sequence, from its settings, their images, the seconds before each, a state,
      and the number of the first one.
    - `one`: A frame alone.
    - `stages`: Keywords of a call for its stages in time; None: a stage that it lacks.
    """

    all: Callable[
        [Settings, Iterator[Any], Iterator[float | None], Mapping[str, Any] | None, int],
        Iterator[Frames],
    ]
    one: Callable[[Settings, Any], Frames]
    stages: Mapping[str, Any]

    @property
    def has_stages(self) -> bool:
        """Whether there is a stage in time."""
        return any(stage is not None for stage in self.stages.values())

    @property
    def continues(self) -> str:
        """What hands something on to the next frame; "": nothing does."""
        for name, stage in self.stages.items():
            if stage is not None and getattr(stage, "_adapts", True):
                return name
        return ""


def work_of_images(
    renderer: Callable[[], Renderer],
    glow_of: Callable[[Any], Mapping[str, Any]],
    how: Mapping[str, Any],
    stages: Mapping[str, Any],
    geometry: Mapping[str, Any] = MappingProxyType({}),
) -> Work:
    """Return what adds bloom to images; `glow_of`: the mask and the emission of each.

    - `geometry`: Motions and depths of all, as for `Renderer.map`.
    """

    def upload_glow(image: Any) -> Any:
        glow = glow_of(image)
        return renderer().upload(image, **glow) if glow else image

    def compute_all(
        settings: Settings,
        images: Iterator[Any],
        steps: Iterator[float | None],
        state: Mapping[str, Any] | None,
        first: int,
    ) -> Iterator[Frames]:
        given = {**how, **stages, **geometry, "state": state, "first": first}
        return renderer()._map(map(upload_glow, images), settings, dt=steps, **given)

    def compute_one(settings: Settings, image: Any) -> Frames:
        return renderer().apply(image, settings, **glow_of(image), **how, **stages)

    return Work(compute_all, compute_one, stages)


def _work_of_scene(
    renderer: Callable[[], Renderer],
    scene: Scene,
    how: Mapping[str, Any],
    stages: Mapping[str, Any],
) -> Work:
    def compute_all(
        settings: Settings,
        turns: Iterator[float],
        steps: Iterator[float | None],
        state: Mapping[str, Any] | None,
        first: int,
    ) -> Iterator[Frames]:
        for number, time in enumerate(turns, first):
            chosen = settings._in_sequence(number, {})
            given = {**how, **stages, "dt": next(steps), "state": state}
            frames = renderer().render(scene, chosen, time=time, **given)
            state = frames.state
            yield frames

    def compute_one(settings: Settings, turns: float) -> Frames:
        return renderer().render(scene, settings, time=turns, **how, **stages)

    return Work(compute_all, compute_one, stages)


@public("vkbloom")
class Sequence(Iterable[Frames]):
    """Frames in time, of `sequence`. The bloom of each is computed when it is taken.

    It iterates over `Frames`; each iteration begins with the first frame. Its length is that of its
    input, and a TypeError where that has none (a generator, a scene without `times`).
    ``sequence[i]`` computes one frame alone. It is a TypeError where frames depend on those before
    (an exposure that adapts, custom methods with a history or a storage), or the input is an
    iterator.

    ``frames.info["time"]`` is the time of a frame in seconds, if it is known. Memory does not
    grow with the number of frames.
    """

    def __init__(
        self,
        source: Input,
        work: Work,
        clock: Clock,
        *,
        start: int = 0,
        state: Mapping[str, Any] | None = None,
    ) -> None:
        self._source, self._work, self._clock = source, work, clock
        self._start, self._begun_with = start, state
        self._state: Mapping[str, Any] = {} if state is None else state
        self._is_begun = False

    @property
    def settings(self) -> Settings:
        """The settings of all frames. Those of files can follow from the first one."""
        return self._source.settings

    @property
    def state(self) -> Mapping[str, Any]:
        """`Frames.state` of the frame that was taken last; before the first, what was given.

        Another sequence, in any process, continues from it: with `start`, the number of the next
        frame.
        """
        return self._state

    def __iter__(self) -> Iterator[Frames]:
        return (frames for frames, _ in self.with_origins())

    def with_origins(self) -> Iterator[tuple[Frames, Any]]:
        """Return an iterator over frames, each with the origin of what was read of it."""
        if self._is_begun and not self._source.is_repeatable:
            raise ValueError("frames: this iterator has been read; give a list of images")
        self._is_begun = True
        return self._compute()

    def _compute(self) -> Iterator[tuple[Frames, Any]]:
        # Several frames are read before the first of them is complete.
        read: deque[tuple[float | None, Any]] = deque()
        steps: deque[float | None] = deque()

        def images() -> Iterator[Any]:
            with closing(self._read(self._start)) as reading:
                for taken, step in reading:
                    read.append((taken.time, taken.origin))
                    steps.append(step)
                    yield taken.image

        def take_steps() -> Iterator[float | None]:
            while True:
                yield steps.popleft()

        given = self._begun_with, self._start
        for frames in self._work.all(self.settings, images(), take_steps(), *given):
            time, origin = read.popleft()
            self._state = frames.state
            yield _at(frames, time), origin

    def __len__(self) -> int:
        count = self._source.count()
        if count is None:
            raise TypeError("this sequence has no length: its input has none")
        return max(0, count - self._start)

    def __getitem__(self, index: int) -> Frames:
        if not self._source.is_repeatable:
            raise TypeError("an iterator cannot be indexed; give a list of images")
        self._check_alone()
        number = check_index("index", index, -_MAX_INDEX, _MAX_INDEX)
        number += len(self) if number < 0 else 0
        if number >= 0:
            number += self._start
            with closing(self._read(number)) as reading:
                for taken, _ in reading:
                    chosen = self.settings._in_sequence(number, {})
                    return _at(self._work.one(chosen, taken.image), taken.time)
        raise IndexError(f"index: {index} is not in this sequence")

    def _check_alone(self) -> None:
        """Raise TypeError if frames depend on those before."""
        which = ""
        if self.settings._continues:
            which = f"of the method {self.settings.method}"
        elif self._work.continues:
            which = f"with {self._work.continues}="
        if which:
            raise TypeError(f"frames {which} depend on those before; iterate")

    def _read(self, first: int) -> Generator[tuple[Taken, float | None], None, None]:
        """Yield from a frame on each one at its time, and the seconds before it."""
        number, times = first - 1, self._clock.times
        before: Moment | None = None
        if first and self._work.has_stages:
            before = self._moment(first - 1, self._source.time_of(first - 1))
        with closing(self._source.read(first)) as reading:
            for number, taken in enumerate(reading, first):
                if times is not None and number >= len(times):
                    raise ValueError(f"times: there are more frames than the {len(times)} times")
                now = self._moment(number, taken.time)
                step = self._clock.step(before, now, taken.duration)
                before = now
                yield taken._replace(time=now.time), step
        if times is not None and first <= number + 1 < len(times):
            raise ValueError(f"times: {len(times)} times do not match {number + 1} frames")

    def _moment(self, number: int, own: float | None) -> Moment:
        return moment_of(self._source, self._clock, number, own)


_MAX_INDEX: Final = 1 << 62


def _at(frames: Frames, time: float | None) -> Frames:
    if time is not None:
        frames._info["time"] = time
    return frames


@public("vkbloom")
@check_arguments
def sequence(
    frames: Any,
    settings: Settings | str | None = None,
    *,
    fps: float | None = None,
    times: AnySequence[float] | None = None,
    gaps: Literal["error", "time"] = "error",
    start: int = 0,
    exposure: Exposure | str | float | None = None,
    taa: Antialiasing | str | None = None,
    motion: Iterable[NDArray[Any] | None] | None = None,
    depth: Iterable[NDArray[Any] | None] | None = None,
    state: Mapping[str, Any] | None = None,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
    size: tuple[int, int] = SCENE_SIZE,
    shading: Shading = "forward",
    framebuffers: Literal["all"] | str | AnySequence[str] = "all",
    device: Device | None = None,
    renderer: Renderer | None = None,
    **fields: Any,
) -> Sequence:
    """Add bloom to frames in time; each is computed when it is taken.

    Parameters
    ----------
    frames : iterable, str, path-like or Scene
        Images as for `Renderer.apply`, or paths of image files; an array (N, H, W, C); a pattern
        of files with numbers, such as ``"f.%04d.exr"`` or ``"f.####.exr"``; a video (extra
        ``video``); or a scene, whose animation runs once in 8 seconds.
    settings : Settings or str, optional
        Settings, or the name of a preset, for all frames. Default: as for `apply`. The first file
        decides for all whether they are photographs.
    fps : float, optional
        Frames per second, above 0, of images and scenes; of a video instead of its own times. The
        first frame is at 0 s.
    times : sequence of float, optional
        The time of each frame in seconds, increasing, instead of `fps`.
    gaps : {"error", "time"}
        Numbers that a pattern lacks: an error that names them, or time in which no frame is. With
        `fps`, a number is a frame's time.
    start : int
        The number of the first frame that is computed, from 0. Those before it are left out, and
        times are counted from the first one.
    exposure : Exposure, str or float, optional
        As for `apply`. Its `dt` is the time since the frame before. That of frame 0 is the time to
        the next one.
    taa : Antialiasing or str, optional
        As for `apply`, and for `render` of a scene.
    motion, depth : iterable of ndarray, optional
        As for `Renderer.map`, of images: one for each frame from `start` on.
    state : mapping of str to ndarray, optional
        What the first frame continues from: `Frames.state` of the one before it.
    mask, emission
        As for `Renderer.apply`, for all frames.
    size, shading
        Of a scene, as for `Renderer.render`.
    framebuffers, device
        As for `Renderer.apply`.
    renderer : Renderer, optional
        Default: `default_renderer`.
    **fields
        Fields of the settings that are changed, as by `Settings.replace`.

    Returns
    -------
    Sequence
        An iterable of `Frames`; see there for its length and its items.

    Raises
    ------
    FileNotFoundError
        No file has the pattern's name.
    ValueError
        A file cannot be read, numbers are missing, a scene or an exposure of images has neither
        `fps` nor `times`, both are given, or an argument is out of range. Of the frames themselves
        when they are taken.

    Notes
    -----
    A sequence with an exposure can be cut at any frame, also between processes: the rest, with
    `start` and the `state` of the frame before, has equal bits.

    Examples
    --------
    >>> images = [np.full((16, 24, 3), level, np.float32) for level in (0.25, 0.5, 1.0)]
    >>> sequence = vkbloom.sequence(images, "bevy_natural", fps=24)
    >>> [float(round(frames.info["time"], 4)) for frames in sequence]
    [0.0, 0.0417, 0.0833]
    >>> sequence[2]["final"].shape
    (16, 24, 3)
    """
    clock = _clock_of(fps, times)
    if gaps not in ("error", "time"):
        raise ValueError(f"gaps: {gaps!r} is not one of error, time")
    from vkbloom._scene import Scene  # noqa: PLC0415  costs start-up time

    # Stages in time: each is a keyword of `Renderer.apply` and `Renderer.render`.
    stages: dict[str, Any] = {
        "exposure": take_exposure(exposure, fields),
        "taa": None if taa is None else check_antialiasing(taa),
    }
    check_use(taa, motion=motion, depth=depth)
    chosen = _Chosen(settings, fields)
    how: dict[str, Any] = {"framebuffers": framebuffers, "device": device}
    begun: dict[str, Any] = {"start": check_index("start", start, 0, _MAX_INDEX), "state": state}

    def opened() -> Renderer:
        return renderer or default_renderer()

    if isinstance(frames, Scene):
        if clock == Clock(None, None):
            raise ValueError("fps: a scene needs frames per second, or times")
        if mask is not None or emission is not None:
            raise ValueError("mask: a scene takes neither a mask nor an emission")
        if motion is not None or depth is not None:
            raise ValueError(f"motion: {OF_SCENES}")
        how |= {"size": size, "shading": shading}
        work = _work_of_scene(opened, frames, how, stages)
        return Sequence(_Turns(clock, chosen), work, clock, **begun)
    # Wrong settings, masks and emissions fail at the call; their sizes with the first frame.
    chosen.of_arrays(of_image=True)
    if mask is not None and not on_cuda(mask):
        height, width = (*np.shape(mask), 0, 0)[:2]
        check_mask(mask, (height, width))
    if emission is not None and not on_cuda(emission):
        check_image(emission, "emission")
    source = _input_of(frames, chosen, gaps)
    if clock.times is not None and not isinstance(source, _Video):
        count = source.count()
        if count not in (None, len(clock.times)):
            raise ValueError(f"times: {len(clock.times)} times do not match {count} frames")
    given = {"mask": mask, "emission": emission}
    glow = {name: array for name, array in given.items() if array is not None}
    geometry = {"motion": motion, "depth": depth}
    work = work_of_images(opened, lambda _: glow, how, stages, geometry)
    if (
        stages["exposure"] is not None
        and clock == Clock(None, None)
        and not isinstance(source, _Video)
    ):
        raise ValueError("fps: an exposure needs frames per second, or times")
    return Sequence(source, work, clock, **begun)


def _clock_of(fps: float | None, times: AnySequence[float] | None) -> Clock:
    if times is None:
        return Clock(None if fps is None else check_above("fps", fps), None)
    if fps is not None:
        raise ValueError("times: fps is given as well; leave one of them out")
    moments = check_floats("times", times)
    if not moments or any(later <= now for now, later in itertools.pairwise(moments)):
        raise ValueError("times: each one must be later than the one before")
    return Clock(None, moments)


def _input_of(frames: Any, chosen: _Chosen, gaps: str) -> Input:
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

    chosen = _Chosen(None, {})
    if isinstance(frames, Scene):
        return _Turns(clock, chosen)
    if read_file is not None:
        return _Files(frames, chosen, read_file)
    return _input_of(frames, chosen, "time")
