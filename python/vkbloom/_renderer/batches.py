"""Batches on the device: as layers of one image, so that each pass runs once for many images."""

from __future__ import annotations

import functools
import math
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vkbloom import _core
from vkbloom._renderer.device_arrays import DeviceArray, memory_for
from vkbloom._renderer.requests import PendingSubmission

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from vkbloom._renderer.device_arrays import ImportedArray
    from vkbloom._renderer.frames import Frames
    from vkbloom._renderer.requests import PendingSubmissions
    from vkbloom._settings.settings import Settings

#: The most bytes of images on the device, half of what the core keeps.
MAX_BYTES = 128 << 20
#: The most layers, which every device has.
MAX_LAYERS = 256
#: With fewer, large images are taken one by one: each of them keeps the device busy.
MIN_LAYERS = 4
#: Submissions that are pending while the caller takes the frames of another one.
AHEAD = 2
#: Between the results of images, whose arrays begin at multiples of it (vkb_layer_stride).
ALIGNMENT = 256


class _Part(NamedTuple):
    """Images from `first` on that were submitted together.

    `frames`: Of those that are not yielded yet, in reverse; complete after the submission.
    """

    submission: _core.Submission
    first: int
    layers: int
    outputs: list[tuple[str, tuple[int, ...], str, int, _core.Exported]]
    frames: list[Frames]

    def arrays(self, layer: int) -> dict[str, Any]:
        """Return the framebuffers of one image."""
        return {
            name: DeviceArray(memory, shape, dtype, layer * stride)
            for name, shape, dtype, stride, memory in self.outputs
        }


class Batches:
    """The batches of a renderer."""

    def __init__(self, core: _core.Renderer, ends: PendingSubmissions) -> None:
        self._core = core
        self._pending = ends
        self._size: tuple[Settings, tuple[Any, ...], int] | None = None

    def run(
        self,
        batch: ImportedArray,
        settings: Settings,
        plan_of: Callable[[_core.Source], _core.Plan],
        frames: Callable[[Settings, dict[str, Any]], Frames],
        rest: Callable[[int], Iterator[Frames]],
    ) -> Iterator[Frames]:
        """Yield the Frames of each image."""
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
                        part = self._submit(batch, first, layers, plan_of)
                    except _core.ValidationError:
                        raise
                    except (_core.Error, ValueError):
                        layers = 0
                        break
                    for layer in reversed(range(submitted - first, layers)):
                        # While the device works.
                        part.frames.append(frames(settings, part.arrays(layer)))
                    pending.append(part)
                    submitted = first + layers
                    del part
                if not pending:
                    yield from rest(done)
                    return
                part = pending.popleft()
                done = part.first + part.layers
                submission = PendingSubmission(part.submission)
                self._pending.add(submission)
                if not submission.ordered:
                    submission.complete()
                while part.frames:
                    # Yielded frames are not kept, so that the caller is their only owner.
                    layer = part.layers - len(part.frames)
                    part.frames[-1]._finish_later(functools.partial(submission.of_layer, layer))
                    yield part.frames.pop()
                del part
        finally:
            pending.clear()

    def _layers(self, batch: ImportedArray, settings: Settings) -> int:
        """Return how many images are taken together; 0: they are taken one by one."""
        count, kind = batch.shape[0], (batch.shape[1:], batch.dtype)
        if settings._has_state or count < MIN_LAYERS:
            return 0
        if self._size is None or self._size[:2] != (settings, kind):
            single = self._core.plan(_core.image_source(batch.at(0).image()), settings, None)
            if single.histories:  # each image continues the one before
                return 0
            self._size = settings, kind, single.image_size
        parts = math.ceil(count / max(1, min(MAX_LAYERS, MAX_BYTES // self._size[2])))
        layers = math.ceil(count / parts)
        return layers if layers >= MIN_LAYERS else 0

    def _submit(
        self,
        batch: ImportedArray,
        first: int,
        layers: int,
        plan_of: Callable[[_core.Source], _core.Plan],
    ) -> _Part:
        source = _core.image_source(batch.layers(first, layers))
        plan = plan_of(source)
        outputs = []
        for name, shape, dtype in plan.outputs:
            stride = _stride(shape, dtype)
            outputs.append((name, shape, dtype, stride, memory_for(self._core, layers * stride)))
        arrays = tuple([memory for *_, memory in outputs])
        self._pending.wait()
        return _Part(self._core.run(source, (plan,), (arrays,)), first, layers, outputs, [])


def _stride(shape: tuple[int, ...], dtype: str) -> int:
    size = math.prod(shape) * np.dtype(dtype).itemsize
    return -(-size // ALIGNMENT) * ALIGNMENT
