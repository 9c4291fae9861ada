"""Batches on the device: as layers of one image, so that each pass runs once for many images."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from vkbloom import _core
from vkbloom.device_arrays import DeviceArray
from vkbloom.requests import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from vkbloom.device_arrays import Taken
    from vkbloom.settings import Settings

__all__ = ["Batches"]

#: The most bytes of images on the device, half of what the core keeps.
BYTES = 128 << 20
#: The most layers, which every device has.
LAYERS = 256
#: With fewer, large images are taken one by one: each of them keeps the device busy.
LEAST = 4
#: Submissions that are pending while the caller takes the frames of another one.
AHEAD = 2
#: Between the results of images, whose arrays begin at multiples of it (vkb_layer_stride).
ALIGNMENT = 256


class _Part(NamedTuple):
    """Images from `first` on that were submitted together; those before `fresh` were yielded."""

    submission: _core.Submission
    plan: _core.Plan
    arrays: tuple[_core.Exported, ...]
    first: int
    fresh: int


class Batches:
    """The batches of a renderer. Keeps the last plan: of small images it takes long to make."""

    def __init__(self, core: _core.Renderer) -> None:
        self._core = core
        self._last: tuple[Settings, tuple[str, ...] | None, _core.Plan] | None = None
        self._size: tuple[Settings, tuple[Any, ...], int] | None = None

    def forget(self) -> None:
        """Release the plan."""
        self._last = None

    def run(
        self,
        batch: Taken,
        settings: Settings,
        names: tuple[str, ...] | None,
        rest: Callable[[int], Iterator[tuple[Settings, Result]]],
    ) -> Iterator[tuple[Settings, Result]]:
        """Yield the result of each image.

        `rest`: Yields them one by one from an image on. It is called where images have no layers,
        or where the device has too little memory for many of them.
        """
        count = batch.shape[0]
        layers = self._layers(batch, settings)
        pending: deque[_Part] = deque()
        submitted = done = 0
        try:
            while done < count:
                while layers and submitted < count and len(pending) < AHEAD:
                    # All parts have the same number of images, so that they use the same memory.
                    first = min(submitted, count - layers)
                    try:
                        part = self._submit(batch, first, layers, submitted, settings, names)
                    except _core.ValidationError:
                        raise
                    except (_core.Error, ValueError):
                        layers = 0
                        break
                    pending.append(part)
                    submitted = first + layers
                    del part
                if not pending:
                    yield from rest(done)
                    return
                part = pending.popleft()
                timings, counts = part.submission.wait()
                done = part.first + len(counts) // 2
                yield from _results(part, settings, timings[0], counts)
                del part
        finally:
            pending.clear()

    def _layers(self, batch: Taken, settings: Settings) -> int:
        """Return how many images are taken together; 0: they are taken one by one."""
        count, kind = batch.shape[0], (batch.shape[1:], batch.dtype)
        if settings._has_state or count < LEAST:
            return 0
        if self._size is None or self._size[:2] != (settings, kind):
            one = self._core.plan(_core.image_source(batch.at(0).image()), settings, None)
            self._size = settings, kind, one.image_size
        parts = math.ceil(count / max(1, min(LAYERS, BYTES // self._size[2])))
        layers = math.ceil(count / parts)
        return layers if layers >= LEAST else 0

    def _submit(  # noqa: PLR0917
        self,
        batch: Taken,
        first: int,
        layers: int,
        fresh: int,
        settings: Settings,
        names: tuple[str, ...] | None,
    ) -> _Part:
        source = _core.image_source(batch.layers(first, layers))
        if (
            self._last is None
            or self._last[:2] != (settings, names)
            or not self._last[2].is_of_image(source)
        ):
            self._last = settings, names, self._core.plan(source, settings, names)
        plan = self._last[2]
        arrays = tuple(
            [self._core.export(layers * _stride(shape, dtype)) for _, shape, dtype in plan.outputs]
        )
        return _Part(self._core.run(source, (plan,), (arrays,)), plan, arrays, first, fresh)


def _stride(shape: tuple[int, ...], dtype: str) -> int:
    size = math.prod(shape) * np.dtype(dtype).itemsize
    return -(-size // ALIGNMENT) * ALIGNMENT


def _results(
    part: _Part, settings: Settings, timings: dict[str, float], counts: tuple[int, ...]
) -> Iterator[tuple[Settings, Result]]:
    layers = len(counts) // 2
    share = {name: seconds / layers for name, seconds in timings.items()}
    outputs = [
        (name, shape, dtype, _stride(shape, dtype), memory)
        for (name, shape, dtype), memory in zip(part.plan.outputs, part.arrays, strict=True)
    ]
    for layer in range(part.fresh - part.first, layers):
        arrays = {
            name: DeviceArray(memory, shape, dtype, layer * stride)
            for name, shape, dtype, stride, memory in outputs
        }
        yield (
            settings,
            Result(
                cast("dict[str, NDArray[Any]]", arrays),
                dict(share),
                (counts[2 * layer], counts[2 * layer + 1]),
            ),
        )
