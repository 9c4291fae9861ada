"""A sequence on a page: any frame of it, with the state that the frames before it leave.

A state is a value, so a `Chain` keeps some of them: the nearest one before a frame is where its
computation begins. What takes long is computed in parts, and the page asks again.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Generator, Hashable, Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom._array_cache import ArrayCache
from vkbloom._io.numbered_files import pattern_of
from vkbloom._io.video.reading import is_video
from vkbloom._numbers import check_above, check_index
from vkbloom._renderer.state import State
from vkbloom._scene import Scene
from vkbloom._sequence.inputs import (
    DEFAULT_RATE,
    TURN_SECONDS,
    Clock,
    Input,
    Taken,
    moment_of,
    open_input,
)
from vkbloom._settings.antialiasing import Antialiasing, antialiasing, check_antialiasing
from vkbloom._settings.exposure import Exposure, check_exposure, exposures

if TYPE_CHECKING:
    from vkbloom._io.picture import Picture
    from vkbloom._renderer.frames import Frames
    from vkbloom._settings.settings import Settings

#: The framebuffers that have what stages in time leave to the next frame.
STATES: Final = ("exposure", "history", "history_motion")
#: What is wrong with a stage in time, or a rate, of a still.
ONLY_OF_SEQUENCES: Final = (
    "only a sequence has it: a pattern such as f.%04d.exr, a video, a list of images, or a scene"
)
#: How long a message may take to compute the states before its frame, in seconds.
PATIENCE: Final = 0.2
# The states that a chain keeps, the chains, and the reduced images of a clip.
_STATE_BYTES: Final = 96 << 20
_MIN_STATE_BYTES: Final = 4096  # of an object
_CHAINS: Final = 3
_IMAGE_BYTES: Final = 256 << 20
# Frames that are left out more quickly by decoding them than by opening a file anew.
_SKIPPED: Final = 24


class NotReached(Exception):
    """The frames before one are not computed yet; `number`: of the next of them in a chain."""

    def __init__(self, number: int, chain: Chain) -> None:
        super().__init__(number)
        self.number, self.chain = number, chain


class Stages(NamedTuple):
    """The stages in time of a frame; None: there is none."""

    exposure: Exposure | None = None
    taa: Antialiasing | None = None

    def keywords(self) -> dict[str, Any]:
        """Return the keywords of a call."""
        return {name: stage for name, stage in self._asdict().items() if stage is not None}

    def continues(self, settings: Settings) -> bool:
        """Return whether a frame depends on those before."""
        adapts = self.exposure is not None and self.exposure._adapts
        return adapts or self.taa is not None or settings._continues

    def needs_bloom(self, settings: Settings) -> bool:
        """Return whether a state depends on the bloom of its frame, and so on its settings."""
        meters_bloom = self.exposure is not None and self.exposure._meters_bloom
        is_after = self.taa is not None and self.taa.order == "after"
        return meters_bloom or is_after or settings._continues


class Clip:
    """Frames in time, and the stages in time that a page begins with."""

    def __init__(
        self,
        source: Input,
        clock: Clock,
        exposure: Exposure | str | None = None,
        taa: Antialiasing | str | None = None,
        *,
        is_scene: bool = False,
    ) -> None:
        if not source.is_repeatable:
            raise TypeError("source: an iterator cannot be played; give a list of images")
        self._source, self._clock, self.is_scene = source, clock, is_scene
        count = source.count()
        if count is None:
            assert clock.rate is not None
            count = round(TURN_SECONDS * clock.rate)
        #: How many frames there are.
        self.count = max(1, count)
        # The stages to begin with, by keyword, and what a page calls them.
        given = {"exposure": exposure, "taa": taa}
        self._begun = {
            name: None if stage is None else _STAGES[name].check(stage)
            for name, stage in given.items()
        }
        self._labels = {name: _label_of(name, stage) for name, stage in self._begun.items()}
        self._images = ArrayCache(_IMAGE_BYTES, 2)
        self._reading: Generator[Taken, None, None] | None = None
        self._last: tuple[int, Taken] | None = None
        self._first_duration: float | None = None

    def describe(self) -> dict[str, Any]:
        """Return what a page knows of it: times in seconds, and the names of stages."""
        stages = {}
        for name, label in self._labels.items():
            choices = list(_STAGES[name].presets)
            if label is not None and label not in choices:
                choices.insert(0, label)
            stages[name] = {"choices": choices, "begun": label}
        return {
            "times": [round(self.time(number), 6) for number in range(self.count)],
            "stages": stages,
        }

    def time(self, number: int) -> float:
        """Return the time of a frame in seconds."""
        moment = moment_of(self._source, self._clock, number, self._source.time_of(number))
        return float(number) if moment.time is None else moment.time

    def number(self, message: Mapping[str, Any]) -> int:
        """Return the frame that a message asks for; 0: it does not say."""
        return check_index("number", message.get("number", 0), 0, self.count - 1)

    def stages(self, message: Mapping[str, Any]) -> Stages:
        """Return the stages that a message asks for; what it leaves out is as at first."""
        found: dict[str, Any] = {}
        for name, begun in self._begun.items():
            asked = message.get(name, self._labels[name])
            if asked is not None:
                found[name] = begun if asked == self._labels[name] else _STAGES[name].check(asked)
        return Stages(**found)

    def code(self, file: str, stages: Stages, shading: str) -> str:
        """Return Python code of its frames.

        - `file`: The pattern or the video; "": there are arrays.
        - `shading`: Of a scene.
        """
        source = "scene" if self.is_scene else json.dumps(file) if file else "images"
        words = [source, "settings"]
        if self._clock.rate is not None:
            words.append(f"fps={self._clock.rate:.10g}")
        for name, stage in stages.keywords().items():
            label = _label_of(name, stage)
            is_preset = label in _STAGES[name].presets
            words.append(f'{name}="{label}"' if is_preset else f"{name}=vkbloom.{stage!r}")
        if self.is_scene:
            words.append(f'shading="{shading}"')
        return f"frames = vkbloom.sequence({', '.join(words)})"

    def step(self, number: int) -> float | None:
        """Return the seconds before a frame, as a sequence counts them."""
        before, now = (
            moment_of(self._source, self._clock, one, self._source.time_of(one))
            if one >= 0
            else None
            for one in (number - 1, number)
        )
        assert now is not None
        if number == 0 and self._first_duration is None:
            self.decoded(0)
        return self._clock.step(before, now, self._first_duration)

    def decoded(self, number: int) -> Any:
        """Return a frame as it was read: a picture, an array, or the turns of a scene."""
        if self._last is None or self._last[0] != number:
            self._last = number, self._take(number)
        taken = self._last[1]
        if number == 0:
            self._first_duration = taken.duration
        return taken.image

    def _take(self, number: int) -> Taken:
        """Read on to a frame, or from it if it is before, or far behind, what was read last."""
        last = -1 if self._last is None else self._last[0]
        if self._reading is None or not 0 < number - last <= _SKIPPED:
            self.close()
            self._reading = self._source.decoded(number)
            last = number - 1
        taken: Taken | None = None
        for _ in range(number - last):
            # What cannot be read fails again when it is asked for again.
            reading, self._reading = self._reading, None
            taken = next(reading, None)
            self._reading = reading
        if taken is None:
            raise ValueError(f"number: frame {number} cannot be read: there are fewer frames")
        return taken

    def turns(self, number: int) -> float:
        """Return the time of a scene's frame in periods of its animation."""
        return self.time(number) / TURN_SECONDS

    def image(self, key: Hashable, make: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        """Return an image that was made before, or make it."""
        image = self._images.find(key)
        if image is None:
            image = make()
            self._images.add(key, image)
        return cast("NDArray[Any]", image)

    def close(self) -> None:
        """Close the file that is read."""
        if self._reading is not None:
            self._reading.close()
            self._reading = None


#: Computes a frame, from its number and the state before it.
Compute = Callable[[int, Mapping[str, Any]], "Frames"]


class _Kind(NamedTuple):
    """A kind of stages in time: what checks one, and its presets."""

    check: Callable[[object], Any]
    presets: Mapping[str, Any]


_STAGES: Final = {
    "exposure": _Kind(check_exposure, exposures),
    "taa": _Kind(check_antialiasing, antialiasing),
}


def _label_of(kind: str, stage: Any) -> str | None:
    """Return the name of a preset, or what is shown of another stage; None: there is none."""
    if stage is None:
        return None
    for name, preset in _STAGES[kind].presets.items():
        if preset == stage:
            return name
    return f"{stage.engine}, as given"


class Chains:
    """The chains of a page; those that it asked for last are kept."""

    def __init__(self) -> None:
        self._chains: OrderedDict[Hashable, Chain] = OrderedDict()

    def find(self, key: Hashable, make: Callable[[], Chain]) -> Chain:
        """Return the chain of what all its states depend on."""
        chain = self._chains.pop(key, None) or make()
        self._chains[key] = chain
        while len(self._chains) > _CHAINS:
            self._chains.popitem(last=False)
        return chain


class Chain:
    """What each frame of a clip leaves to the next one; some of it is kept.

    - `compute`: Computes a frame from its number and the state before it.
    - `count`: How many frames there are.
    - `most`: The bytes of the states that are kept; at least a few are.
    - `stops`: The exposure of each frame from the first on, as far as they are computed; None: it
      is infinite.
    """

    _made = 0

    def __init__(
        self, compute: Compute, count: int, *, has_exposure: bool, most: int = _STATE_BYTES
    ) -> None:
        self._compute, self._count, self._most = compute, count, most
        self.has_exposure = has_exposure
        # The states before frames. Those of multiples of the spacing stay; others are recent.
        self._states: dict[int, State] = {0: State()}
        self._spacing = 1
        self._recent: deque[tuple[int, State]] = deque(maxlen=2)
        self.stops: list[float | None] = []
        Chain._made += 1
        self.number = Chain._made

    def state(self, number: int, seconds: float) -> State:
        """Return the state before a frame; raise NotReached if it takes longer than `seconds`."""
        deadline = time.perf_counter() + seconds
        at, state = max(
            (item for item in (*self._states.items(), *self._recent) if item[0] <= number),
            key=lambda item: item[0],
        )
        is_begun = False
        while at < number:
            # At least one frame at a time.
            if is_begun and time.perf_counter() > deadline:
                raise NotReached(at, self)
            is_begun = True
            state = self.advance(at, self._compute(at, state))
            at += 1
        return state

    def advance(self, number: int, frames: Frames) -> State:
        """Keep what a frame has left, and its exposure; return the state."""
        state = frames.state
        assert isinstance(state, State)
        if self.has_exposure:
            # What is read here does not stay on the device.
            stops = frames.exposure - frames.settings.exposure
            if number == len(self.stops):
                self.stops.append(stops if math.isfinite(stops) else None)
            if "exposure" in frames:
                state = state.replace("exposure", frames["exposure"])
        number += 1
        if number % self._spacing == 0:
            self._states[number] = state
            size = max(_MIN_STATE_BYTES, state.nbytes)
            if len(self._states) * size > max(self._most, 4 * size):
                self._spacing *= 2
                self._states = {
                    one: kept for one, kept in self._states.items() if one % self._spacing == 0
                }
        self._recent.append((number, state))
        return state

    @property
    def kept(self) -> int:
        """How many states are kept."""
        return len(self._states) + len(self._recent)

    def extend(self, seconds: float) -> None:
        """Compute the exposures of frames, as many as there is time for."""
        if len(self.stops) < self._count:
            with suppress(NotReached):
                self.state(self._count, seconds)

    def curve(self, known: object) -> dict[str, Any]:
        """Return the exposures that a page does not know; `known`: its chain, and how many."""
        first = 0
        if isinstance(known, list) and len(known) == 2 and known[0] == self.number:
            first = check_index("curve", known[1], 0, self._count)
        return {
            "chain": self.number,
            "from": first,
            "stops": self.stops[first:],
            "is_done": len(self.stops) >= self._count,
        }


def open_clip(
    source: Any,
    *,
    fps: float | None = None,
    exposure: Exposure | str | None = None,
    taa: Antialiasing | str | None = None,
    read_file: Callable[[str], Picture] | None = None,
) -> Clip | None:
    """Return the frames of a source in time; None: it is a still, or an animation without stages.

    - `source`: As for `vkbloom.explore`, or files with their numbers, which `read_file` decodes.
    """
    given = {"fps": fps, "exposure": exposure, "taa": taa}
    is_file = isinstance(source, str | os.PathLike)
    if isinstance(source, Scene):
        if all(value is None for value in given.values()):
            return None
    elif not (read_file or _is_sequence(source)):
        for name, value in given.items():
            if value is not None:
                raise ValueError(f"{name}: {ONLY_OF_SEQUENCES}")
        return None
    has_times = is_file and is_video(source)
    rate = (
        check_above("fps", fps) if fps is not None else None if has_times else float(DEFAULT_RATE)
    )
    clock = Clock(rate, None)
    reading = open_input(source, clock, read_file)
    return Clip(reading, clock, exposure, taa, is_scene=isinstance(source, Scene))


def _is_sequence(source: Any) -> bool:
    if isinstance(source, str | os.PathLike):
        path = os.fspath(source)
        is_pattern = pattern_of(os.path.basename(path)) is not None and not os.path.isfile(path)
        return is_video(path) or is_pattern
    return isinstance(source, list | tuple | Iterator) or (
        isinstance(source, np.ndarray) and source.ndim == 4
    )
