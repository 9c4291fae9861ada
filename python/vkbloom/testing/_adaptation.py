"""An exposure under test: a function of a frame, the seconds before it, and what is adapted to."""

from __future__ import annotations

import copy
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import copy_to_host, plain_array
from vkbloom._methods.mip_chain import Pyramid
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.exposure import Exposure, check_exposure
from vkbloom._settings.settings import Settings
from vkbloom.testing._probe import BloomError, Probe

__tracebackhide__ = True

#: A frame in linear light, (H, W, 3) of float32.
Frame: TypeAlias = NDArray[np.float32]

#: An exposure under test: ``meter(image, *, dt, state)`` returns the stops that the picture has, or
#: the exposed picture, and the next state. The first state is None. Without the keyword `state`, it
#: keeps its state itself, and returns the stops or the picture alone.
Meter: TypeAlias = Callable[..., Any]

#: The settings of a picture without bloom.
NO_BLOOM: Final = Pyramid(bloom=False)
#: Size of the test images: Godot's blocks leave a third of it out.
SIZE: Final = (96, 64)
# Steps of time in seconds by which a goal is looked for, the longest first: exponential ones arrive
# at once, others go beyond it for ever. And the most frames of each; of the shortest, 30 seconds.
_STEPS: Final = (64.0, 2.0, 0.5, 0.25, 0.1, 1 / 30)
_FRAMES: Final = 60
_LAST_FRAMES: Final = 900
# What keeps its state itself cannot begin anew after a step that was too long.
_SAFE_STEPS: Final = (0.1,)
# A goal is reached if so many stops are left at most, where each step leaves a share of at most so
# much of the one before.
_ACCURACY: Final = 5e-4
_SLOWEST: Final = 0.985


class UnsettledError(ValueError):
    """The exposure of an image that stays does not come to rest."""


class Adapted(NamedTuple):
    """What follows from frames: the stops that the picture has, and what the next one needs.

    - `picture`: (H, W, 3) or (H, W, 4), if there is one.
    """

    stops: float
    state: Any
    picture: NDArray[Any] | None = None


def is_meter(subject: object) -> TypeGuard[Meter | Exposure | str]:
    """Return whether a subject of laws is an exposure, and no bloom."""
    if isinstance(subject, Exposure | str):
        return True
    return callable(subject) and has_keyword(subject, "dt")


def has_keyword(meter: object, name: str) -> bool:
    """Return whether a callable names a parameter, which other keywords do not stand for."""
    try:
        return name in inspect.signature(meter).parameters  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return False


def meter_of(
    exposure: Exposure | str, renderer: Renderer | None = None, settings: Settings | None = None
) -> Meter:
    """Return an exposure of the package as a meter; `settings`: of the bloom that it has."""
    chosen, bloom = check_exposure(exposure), settings or NO_BLOOM

    def meter(image: Frame, *, dt: float, state: Any) -> Frames:
        opened = renderer or default_renderer()
        return opened.apply(image, bloom, exposure=chosen, dt=dt, state=state, framebuffers=())

    return meter


@dataclass(eq=False, kw_only=True)
class Adaptation:
    """An exposure under test, and what more than one law measures of it.

    - `meter`: See `Meter`.
    - `size`: Width and height of the test images.
    - `gives_pictures`: Whether it returns pictures, as `try_once` has found.
    """

    meter: Meter
    size: tuple[int, int] = SIZE
    gives_pictures: bool = field(default=False, init=False)
    _first_step: int = 0
    _goals: dict[bytes, Adapted] = field(default_factory=dict)

    @property
    def keeps_state(self) -> bool:
        """Whether the exposure keeps its state itself."""
        declared: bool | None = getattr(self.meter, "keeps_state", None)
        return not has_keyword(self.meter, "state") if declared is None else declared

    @property
    def untaken(self) -> tuple[str, ...]:
        """What the exposure does not take."""
        return ("state",) if self.keeps_state else ()

    @property
    def probe(self) -> Probe:
        """The test images."""
        return Probe(size=self.size)

    def try_once(self) -> None:
        """Show a grey frame, so that what cannot run at all fails."""
        grey = np.full((self.size[1], self.size[0], 3), 0.18, np.float32)
        self.gives_pictures = self.step(grey, 1 / 60, None).picture is not None

    def check_visible(self) -> None:
        """Frames are floats, which show all."""

    def step(self, image: Frame, dt: float, state: Any) -> Adapted:
        """Show a frame so many seconds after the one before."""
        given = {} if self.keeps_state else {"state": copy.deepcopy(state)}
        try:
            result = self.meter(image.copy(), dt=dt, **given)
            if isinstance(result, Frames):
                return Adapted(result.exposure, result.state, result.get("final"))
            if self.keeps_state:
                result = result, None
            if not (isinstance(result, tuple) and len(result) == 2):
                raise TypeError(f"it returns {type(result).__name__}, not a tuple (stops, state)")
            first, after = result
            if isinstance(first, int | float | np.generic) or np.ndim(first) == 0:
                return Adapted(float(first), after)
            picture = _real_values(first, image)
            return Adapted(_stops_of(picture, image), after, picture)
        except Exception as error:
            raise BloomError(f"the exposure raised {type(error).__name__}: {error}") from error

    def read(self, image: Frame, state: Any) -> float:
        """Return the stops of a state. Some engines apply what they adapt to one frame later."""
        return self.step(image, 0.0, state).stops

    def run(self, image: Frame, dt: float, count: int, state: Any) -> Adapted:
        """Show a frame again and again, and return the stops of the last state, and the state."""
        for _ in range(count):
            state = self.step(image, dt, state).state
        return Adapted(self.read(image, state), state)

    def settle(self, image: Frame) -> Adapted:
        """Show a frame until the stops stay as they are, and return them: the goal.

        They may be infinite or NaN. Raises UnsettledError if they do not come to rest.
        """
        key = image.tobytes()
        if self.keeps_state or key not in self._goals:
            self._goals[key] = self._find_goal(image)
        return self._goals[key]

    def _find_goal(self, image: Frame) -> Adapted:
        steps = _SAFE_STEPS if self.keeps_state else _STEPS[self._first_step :]
        for number, dt in enumerate(steps, self._first_step):
            is_last = dt == steps[-1]
            found = self._rest(image, dt, _LAST_FRAMES if is_last else _FRAMES)
            if found is None:
                continue
            if math.isfinite(found.stops):
                self._first_step = 0 if self.keeps_state else number
                return found
            if is_last:
                return found
        raise UnsettledError(
            "the exposure of an image that stays does not come to rest within "
            f"{_LAST_FRAMES} frames of {steps[-1]:.3g} s, nor with longer steps"
        )

    def _rest(self, image: Frame, dt: float, count: int) -> Adapted | None:
        """Return what an image that stays comes to with a step of time; None: it does not rest.

        Where each step leaves a share of the one before, what is left follows from it.
        """
        seen: list[float] = []
        state = None
        for _ in range(count):
            now = self.step(image, dt, state)
            seen, state = [*seen[-2:], now.stops], now.state
            if len(seen) < 3:
                continue
            if not math.isfinite(seen[1]):
                # From the second frame on; what grows without limit gets there later.
                return None if math.isfinite(seen[2]) else now
            before, last = seen[1] - seen[0], seen[2] - seen[1]
            if not math.isfinite(last):
                return None
            share = abs(last / before) if before else 0.0
            is_near = share <= _SLOWEST and abs(last) * share <= _ACCURACY * (1 - share)
            if is_near and (before or not last):
                return Adapted(self.read(image, state), state)
        return None


def _real_values(result: object, image: Frame) -> NDArray[np.float64]:
    """Return the colours of a picture beside the image that was given, in real units."""
    picture = plain_array(copy_to_host(result), "its picture")
    if picture.ndim != 3 or picture.shape[:2] != image.shape[:2] or picture.shape[2] < 3:
        raise ValueError(f"its picture has shape {picture.shape} for {image.shape}")
    made = picture[..., :3].astype(np.float64)
    return made / np.iinfo(picture.dtype).max if picture.dtype.kind in "ui" else made


def _stops_of(picture: NDArray[np.float64], image: Frame) -> float:
    """Return the stops of a picture beside the image that was given; NaN: not known."""
    seen = np.isfinite(picture) & np.isfinite(image)
    # All pixels: a bloom takes light from lit ones to black ones. Of black, nothing is known.
    light = image[seen].astype(np.float64).sum()
    with np.errstate(all="ignore"):
        return float(np.log2(picture[seen].sum() / light)) if light > 0 else math.nan
