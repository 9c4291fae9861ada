"""Frames in time: a sequence whose bloom is computed when it is asked for."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterable, Iterator, Mapping
from collections.abc import Sequence as AnySequence
from contextlib import closing
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._image_arguments import check_image, check_mask
from vkbloom._numbers import check_index
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer, take_exposure
from vkbloom._renderer.device_arrays import Device, on_cuda
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.sources import OF_SCENES, SCENE_SIZE
from vkbloom._sequence.inputs import (
    Chosen,
    Clock,
    Input,
    Moment,
    Taken,
    Turns,
    clock_of,
    input_of,
    moment_of,
)
from vkbloom._sequence.work import Work, work_of_images, work_of_scene
from vkbloom._settings.antialiasing import Antialiasing, check_antialiasing, check_use
from vkbloom._settings.exposure import Exposure
from vkbloom._settings.settings import Settings, Shading

_MAX_INDEX: Final = 1 << 62


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
    clock = clock_of(fps, times)
    if gaps not in ("error", "time"):
        raise ValueError(f"gaps: {gaps!r} is not one of error, time")
    from vkbloom._scene import Scene  # noqa: PLC0415  costs start-up time

    # Stages in time: each is a keyword of `Renderer.apply` and `Renderer.render`.
    stages: dict[str, Any] = {
        "exposure": take_exposure(exposure, fields),
        "taa": None if taa is None else check_antialiasing(taa),
    }
    check_use(taa, motion=motion, depth=depth)
    chosen = Chosen(settings, fields)
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
        work = work_of_scene(opened, frames, how, stages)
        return Sequence(Turns(clock, chosen), work, clock, **begun)
    # Wrong settings, masks and emissions fail at the call; their sizes with the first frame.
    chosen.of_arrays(of_image=True)
    if mask is not None and not on_cuda(mask):
        height, width = (*np.shape(mask), 0, 0)[:2]
        check_mask(mask, (height, width))
    if emission is not None and not on_cuda(emission):
        check_image(emission, "emission")
    source = input_of(frames, chosen, gaps)
    if clock.times is not None and not source.has_times:
        count = source.count()
        if count not in (None, len(clock.times)):
            raise ValueError(f"times: {len(clock.times)} times do not match {count} frames")
    given = {"mask": mask, "emission": emission}
    glow = {name: array for name, array in given.items() if array is not None}
    geometry = {"motion": motion, "depth": depth}
    work = work_of_images(opened, lambda _: glow, how, stages, geometry)
    if stages["exposure"] is not None and clock == Clock(None, None) and not source.has_times:
        raise ValueError("fps: an exposure needs frames per second, or times")
    return Sequence(source, work, clock, **begun)
