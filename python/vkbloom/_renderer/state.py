"""What a call hands on to the next one: framebuffers that have a history."""

from __future__ import annotations

import contextlib
import math
import weakref
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from vkbloom import _core
from vkbloom._locks import ProcessLock
from vkbloom._renderer.new_arrays import new_arrays
from vkbloom._renderer.sources import ANIMATION, Moment, image_source
from vkbloom._settings.settings import check_settings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vkbloom._settings.antialiasing import Antialiasing

#: For each history of a plan what a call before has made; None: zeros.
Histories = tuple["_core.Source | None", ...]


class Kept:
    """An image on a renderer's device, which nothing changes."""

    __slots__ = ("__weakref__", "_array", "core", "dtype", "shape", "source")

    def __init__(
        self, core: _core.Renderer, source: _core.Source, shape: tuple[int, ...], dtype: str
    ) -> None:
        self.core, self.source, self.shape, self.dtype = core, source, shape, dtype
        self._array: NDArray[Any] | None = None
        with _LOCK:
            _KEPT.add(self)

    def read(self) -> NDArray[Any]:
        """Return the pixels."""
        if self._array is None:
            self._array = self._read()
            self._array.flags.writeable = False
        return self._array

    def _read(self) -> NDArray[Any]:
        # A pass without bloom copies the pixels.
        copy = check_settings(None).replace(bloom=False)
        plan = self.core.plan(self.source, copy, ("final",))
        (array,) = arrays = new_arrays(self.core, plan)
        self.core.run(self.source, (plan,), (arrays,)).wait()
        assert isinstance(array, np.ndarray)
        return array


_LOCK: Final = ProcessLock()
_KEPT: Final[weakref.WeakSet[Kept]] = weakref.WeakSet()


def read_kept(core: _core.Renderer) -> None:
    """Read the images of states on a device that is closed next, unless it is lost."""
    with _LOCK:
        images = [image for image in _KEPT if image.core is core]
    # (The device of a parent process gives a ValueError.)
    with contextlib.suppress(_core.Error, ValueError):
        for image in images:
            image.read()


class State(Mapping[str, "NDArray[Any]"]):
    """The framebuffers of earlier calls that the next call reads, by name. It never changes.

    Images stay on the device of the renderer that made them until this object is collected. They
    are read when an item is first taken, or when the renderer is closed. States are equal if their
    arrays have the same bytes. A pickled state has the arrays.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        (H, W, 4) of uint8, float16 or float32, as framebuffers are; float64 becomes float32. They
        are copied.
    """

    def __init__(self, arrays: Mapping[str, NDArray[Any]] = MappingProxyType({})) -> None:
        self._images: dict[str, NDArray[Any] | Kept] = {}
        for name, array in arrays.items():
            copied = np.array(array, order="C")
            if copied.dtype == np.float64:  # as of images
                copied = copied.astype(np.float32)
            copied.flags.writeable = False
            self._images[name] = copied
        #: Images of one texel that the call before continued.
        self._before: dict[str, NDArray[Any] | Kept] = {}
        #: Arrays on the device that has read them last, for calls that continue the same state.
        self._uploaded: dict[str, tuple[_core.Renderer, _core.Source]] = {}

    def __getitem__(self, name: str) -> NDArray[Any]:
        return _read(self._images, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._images)

    def __len__(self) -> int:
        return len(self._images)

    @property
    def nbytes(self) -> int:
        """The bytes of all images, on the host or on the device."""
        return sum(
            math.prod(image.shape) * np.dtype(image.dtype).itemsize
            for image in self._images.values()
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, State):
            return NotImplemented
        return self.keys() == other.keys() and all(
            self[name].dtype == other[name].dtype
            and self[name].shape == other[name].shape
            and self[name].tobytes() == other[name].tobytes()
            for name in self
        )

    __hash__ = None  # type: ignore[assignment]  # as other mappings of arrays

    def replace(self, name: str, array: NDArray[Any]) -> State:
        """Return the state with another array."""
        after = State({name: array})
        after._images = {**self._images, **after._images}
        after._before = self._before
        return after

    def __repr__(self) -> str:
        return f"<vkbloom state of {', '.join(self) or 'nothing'}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return State, (dict(self),)

    def before(self) -> dict[str, Any]:
        """Return what the call before continued, of one texel each, as lists of numbers."""
        return {name: _read(self._before, name).tolist() for name in self._before}

    def check(self, plan: _core.Plan) -> None:
        """Raise ValueError for an image that a call of the plan cannot continue."""
        for name, shape, dtype in plan.histories:
            image = self._images.get(name)
            if image is not None and not is_alike(image, shape, dtype):
                raise ValueError(
                    f"state: {name} has shape {image.shape} and dtype {image.dtype}, and in this "
                    f"call it has {shape} and {dtype}; leave it out to begin anew"
                )

    def histories(self, core: _core.Renderer, plan: _core.Plan) -> Histories | None:
        """Return what a call of the plan continues; None: it has no history.

        An image of another size or type than in the call is as one that is not there.
        """
        if not plan.histories:
            return None
        found: list[_core.Source | None] = []
        for name, shape, dtype in plan.histories:
            image = self._images.get(name)
            found.append(
                None
                if image is None or not is_alike(image, shape, dtype)
                else self._source(name, core)
            )
        return tuple(found)

    def _source(self, name: str, core: _core.Renderer) -> _core.Source:
        image = self._images[name]
        if isinstance(image, Kept) and image.core is core:
            return image.source
        uploaded = self._uploaded.get(name)
        if uploaded is None or uploaded[0] is not core:
            source = image_source(self[name], name=f"state: {name}")
            uploaded = self._uploaded[name] = core, core.upload(source, None, False)
        return uploaded[1]

    def advance(
        self, core: _core.Renderer, plan: _core.Plan, submission: _core.Submission
    ) -> State:
        """Return the state after a call: what it does not write stays."""
        if submission.histories is None:
            return self
        after = State()
        after._images = dict(self._images)
        after._before = {
            name: image for name, image in self._images.items() if image.shape[:2] == (1, 1)
        }
        for (name, shape, dtype), source in zip(plan.histories, submission.histories, strict=True):
            after._images[name] = Kept(core, source, shape, dtype)
        return after


def _read(images: dict[str, NDArray[Any] | Kept], name: str) -> NDArray[Any]:
    """Return the pixels of an image, which replace it."""
    image = images[name]
    if isinstance(image, Kept):
        images[name] = image = image.read()
    return image


def is_alike(image: NDArray[Any] | Kept, shape: tuple[int, ...], dtype: str) -> bool:
    """Return whether an image has a shape and a type."""
    return image.shape == shape and image.dtype == np.dtype(dtype)


def advance_moment(
    antialiasing: Antialiasing | None, time: float, state: State
) -> tuple[Moment | None, State]:
    """Return the moment of a scene's frame after a state, and the state that the frame advances.

    Without anti-aliasing None and the state.
    """
    if antialiasing is None:
        return None, state
    moment = Moment.after(state, time, antialiasing)
    return moment, state.replace(ANIMATION, moment.array())


class Continued(NamedTuple):
    """The state that requests continue.

    - `is_chain`: Whether each continues that of the one before; else all continue this one.
    """

    state: State
    is_chain: bool = True
