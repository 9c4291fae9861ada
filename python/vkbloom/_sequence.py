"""Frames in time: a sequence whose bloom is computed when it is asked for."""

from __future__ import annotations

import itertools
import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from collections.abc import Sequence as AnySequence
from contextlib import closing
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._image_arguments import check_image, check_mask
from vkbloom._io.numbered_files import files_of, gap_note, pattern_of
from vkbloom._io.video.reading import VideoFile, is_video
from vkbloom._locks import cached_property
from vkbloom._numbers import check_above, check_floats, check_index
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.device_arrays import Device, on_cuda
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.sources import SCENE_SIZE
from vkbloom._settings.settings import Settings, Shading, check_settings

if TYPE_CHECKING:
    from vkbloom._presets.start import Start
    from vkbloom._scene import Scene

# The seconds in which the animation of a scene runs once, as in a window.
_TURN_SECONDS: Final = 8.0

#: Images with their own times in seconds; None: they have none.
_Timed: TypeAlias = Generator[tuple[Any, float | None], None, None]


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


class _Clock(NamedTuple):
    """The times of frames that a call gives: frames per second, or each one."""

    rate: float | None
    times: tuple[float, ...] | None

    def at(self, place: int) -> float | None:
        """Return the time in seconds of a frame or a gap; None: it is not given."""
        if self.times is not None:
            return self.times[place]
        return None if self.rate is None else place / self.rate


class _Input(Protocol):
    """What a sequence reads.

    - `is_repeatable`: Whether it can be read more than once, and from any frame on.
    """

    is_repeatable: bool

    @property
    def settings(self) -> Settings:
        """The settings of all frames."""

    def read(self, first: int) -> _Timed:
        """Yield from a frame on each image."""

    def count(self) -> int | None:
        """Return how many images there are; None: endless, or not known."""

    def place_of(self, number: int) -> int:
        """Return the place in time of a frame at constant frames per second."""


class _Arrays:
    """Images, or paths of image files, in any iterable."""

    def __init__(self, images: Any, chosen: _Chosen) -> None:
        self._images, self._chosen = images, chosen
        self.is_repeatable = not isinstance(images, Iterator)

    @cached_property
    def _start(self) -> Start | None:
        """Where the first item starts, if it is a file."""
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

    def read(self, first: int) -> _Timed:
        images = self._images
        if first and hasattr(images, "__getitem__"):
            # A list of lazily read images reads only those.
            read: Iterator[Any] = (images[number] for number in range(first, len(images)))
        else:
            read = itertools.islice(images, first, None)
        for image in read:
            is_file = isinstance(image, str | os.PathLike)
            yield (_read(image, self._start) if is_file else image), None

    def count(self) -> int | None:
        return len(self._images) if hasattr(self._images, "__len__") else None

    def place_of(self, number: int) -> int:
        return number


class _Files:
    """The files of a pattern."""

    is_repeatable = True

    def __init__(self, pattern: str, chosen: _Chosen, gaps: str) -> None:
        folder, name = os.path.split(pattern)
        found = pattern_of(name)
        if found is None:
            raise ValueError(
                f"frames: {pattern!r} is neither a video nor a pattern of numbers, such as "
                "f.%04d.exr"
            )
        files = files_of(folder, found)
        if not files:
            raise FileNotFoundError(f"{pattern}: no file was found")
        if gaps == "error" and (missing := gap_note(files)) is not None:
            raise ValueError(f'{pattern}: {missing}; gaps="time" takes them as time')
        self._files, self._chosen = [name for name, _ in files], chosen
        self._numbers = [number or 0 for _, number in files]

    @cached_property
    def _start(self) -> Start:
        return self._chosen.of_file(_highlights_of(self._files[0]))

    @property
    def settings(self) -> Settings:
        return self._start.settings

    def read(self, first: int) -> _Timed:
        for file in self._files[first:]:
            yield _read(file, self._start), None

    def count(self) -> int | None:
        return len(self._files)

    def place_of(self, number: int) -> int:
        return self._numbers[number] - self._numbers[0]


class _Video:
    """The frames of a video."""

    is_repeatable = True

    def __init__(self, path: str, chosen: _Chosen) -> None:
        self._path, self._chosen = path, chosen
        # Fails at once if it is none.
        VideoFile(path).close()

    @cached_property
    def _start(self) -> Start:
        with VideoFile(self._path) as file, closing(file.frames()) as frames:
            for frame in frames:
                return self._chosen.of_file(frame.picture.header.highlights())
        raise AssertionError("a video without frames is an error")

    @property
    def settings(self) -> Settings:
        return self._start.settings

    def read(self, first: int) -> _Timed:
        with VideoFile(self._path) as file, closing(file.frames()) as frames:
            for frame in itertools.islice(frames, first, None):
                yield self._start.develop(frame.decode()).pixels, float(frame.time)

    @cached_property
    def _times(self) -> list[float]:
        with VideoFile(self._path) as file:
            return file.times()

    def count(self) -> int | None:
        return len(self._times)

    def place_of(self, number: int) -> int:
        return number


class _Turns:
    """The times of a scene, whose images are periods of its animation."""

    is_repeatable = True

    def __init__(self, clock: _Clock, chosen: _Chosen) -> None:
        self._clock, self.settings = clock, chosen.of_arrays(of_image=False)

    def read(self, first: int) -> _Timed:
        count = self.count()
        for number in itertools.count(first) if count is None else range(first, count):
            time = self._clock.at(number)
            assert time is not None
            yield time / _TURN_SECONDS, time

    def count(self) -> int | None:
        return None if self._clock.times is None else len(self._clock.times)

    def place_of(self, number: int) -> int:
        return number


def _highlights_of(path: str | os.PathLike[str]) -> Any:
    from vkbloom._io.image_file import ImageFile  # noqa: PLC0415  costs start-up time

    with ImageFile(path) as file:
        return file.header.highlights()


def _read(path: str | os.PathLike[str], start: Start | None) -> NDArray[Any]:
    from vkbloom._io.image_file import read_picture  # noqa: PLC0415  costs start-up time

    picture = read_picture(path)
    return picture.pixels if start is None else start.develop(picture).pixels


class _Work(NamedTuple):
    """What computes the frames of images or of a scene's times, and that of one."""

    all: Callable[[Iterator[Any], Settings], Iterator[Frames]]
    one: Callable[[Any, Settings], Frames]


def _work_of_images(
    renderer: Renderer | None, glow: Mapping[str, Any], how: Mapping[str, Any]
) -> _Work:
    def compute_all(images: Iterator[Any], settings: Settings) -> Iterator[Frames]:
        opened = renderer or default_renderer()
        if any(array is not None for array in glow.values()):
            images = (opened.upload(image, **glow) for image in images)
        return opened.map(images, settings, **how)

    def compute_one(image: Any, settings: Settings) -> Frames:
        return (renderer or default_renderer()).apply(image, settings, **glow, **how)

    return _Work(compute_all, compute_one)


def _work_of_scene(renderer: Renderer | None, scene: Scene, how: Mapping[str, Any]) -> _Work:
    def compute_one(turns: float, settings: Settings) -> Frames:
        return (renderer or default_renderer()).render(scene, settings, time=turns, **how)

    return _Work(
        lambda times, settings: (compute_one(turns, settings) for turns in times), compute_one
    )


@public("vkbloom")
class Sequence(Iterable[Frames]):
    """Frames in time, of `sequence`. The bloom of each is computed when it is taken.

    It iterates over `Frames`; each iteration begins with the first frame. Its length is that of its
    input, and a TypeError where that has none (a generator, a scene without `times`).
    ``sequence[i]`` computes one frame alone. It is a TypeError where frames depend on those before
    (custom methods with a history or a storage), or the input is an iterator.

    ``frames.info["time"]`` is the time of a frame in seconds, if it is known. Memory does not
    grow with the number of frames.
    """

    def __init__(self, source: _Input, work: _Work, clock: _Clock) -> None:
        self._source, self._work, self._clock = source, work, clock
        self._is_begun = False

    @property
    def settings(self) -> Settings:
        """The settings of all frames. Those of files can follow from the first one."""
        return self._source.settings

    def __iter__(self) -> Iterator[Frames]:
        if self._is_begun and not self._source.is_repeatable:
            raise ValueError("frames: this iterator has been read; give a list of images")
        self._is_begun = True
        return self._iterate()

    def _iterate(self) -> Iterator[Frames]:
        times: deque[float | None] = deque()

        def images() -> Iterator[Any]:
            with closing(self._read(0)) as read:
                for image, time in read:
                    times.append(time)
                    yield image

        for frames in self._work.all(images(), self.settings):
            yield _at(frames, times.popleft())

    def __len__(self) -> int:
        count = self._source.count()
        if count is None:
            raise TypeError("this sequence has no length: its input has none")
        return count

    def __getitem__(self, index: int) -> Frames:
        if not self._source.is_repeatable:
            raise TypeError("an iterator cannot be indexed; give a list of images")
        if self.settings._continues:
            raise TypeError(
                f"frames of the method {self.settings.method} depend on those before; iterate"
            )
        number = check_index("index", index, -_MAX_INDEX, _MAX_INDEX)
        number += len(self) if number < 0 else 0
        if number >= 0:
            with closing(self._read(number)) as read:
                for image, time in read:
                    chosen = self.settings._in_sequence(number, {})
                    return _at(self._work.one(image, chosen), time)
        raise IndexError(f"index: {index} is not in this sequence")

    def _read(self, first: int) -> _Timed:
        """Yield from a frame on each image with its time."""
        number, times = first - 1, self._clock.times
        with closing(self._source.read(first)) as images:
            for number, (image, own) in enumerate(images, first):
                if times is not None and number >= len(times):
                    raise ValueError(f"times: there are more frames than the {len(times)} times")
                place = number if times is not None else self._source.place_of(number)
                time = self._clock.at(place)
                yield image, own if time is None else time
        if times is not None and first <= number + 1 < len(times):
            raise ValueError(f"times: {len(times)} times do not match {number + 1} frames")


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
        A file cannot be read, numbers are missing, a scene has neither `fps` nor `times`, both are
        given, or an argument is out of range. Of the frames themselves when they are taken.

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

    chosen = _Chosen(settings, fields)
    how: dict[str, Any] = {"framebuffers": framebuffers, "device": device}
    if isinstance(frames, Scene):
        if clock == _Clock(None, None):
            raise ValueError("fps: a scene needs frames per second, or times")
        if mask is not None or emission is not None:
            raise ValueError("mask: a scene takes neither a mask nor an emission")
        work = _work_of_scene(renderer, frames, how | {"size": size, "shading": shading})
        return Sequence(_Turns(clock, chosen), work, clock)
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
    work = _work_of_images(renderer, {"mask": mask, "emission": emission}, how)
    return Sequence(source, work, clock)


def _clock_of(fps: float | None, times: AnySequence[float] | None) -> _Clock:
    if times is None:
        return _Clock(None if fps is None else check_above("fps", fps), None)
    if fps is not None:
        raise ValueError("times: fps is given as well; leave one of them out")
    moments = check_floats("times", times)
    if not moments or any(later <= now for now, later in itertools.pairwise(moments)):
        raise ValueError("times: each one must be later than the one before")
    return _Clock(None, moments)


def _input_of(frames: Any, chosen: _Chosen, gaps: str) -> _Input:
    if isinstance(frames, str | os.PathLike):
        path = os.fspath(frames)
        return _Video(path, chosen) if is_video(path) else _Files(path, chosen, gaps)
    is_one = isinstance(frames, bytes) or (isinstance(frames, np.ndarray) and frames.ndim != 4)
    if is_one or not (isinstance(frames, Iterable) or hasattr(frames, "__getitem__")):
        raise TypeError(
            f"frames: {type(frames).__name__} is not an iterable of images, a pattern of files, a "
            "video or a scene"
        )
    return _Arrays(frames, chosen)
