"""Many settings over one source: several go to the device at once, while it has others to run."""

from __future__ import annotations

import time
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

from vkbloom import _core

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

    from vkbloom.settings import Settings

    Allocate = Callable[[str, tuple[int, ...], str], NDArray[Any]]
    Result = tuple[dict[str, NDArray[Any]], dict[str, float], tuple[int, int]]

#: Settings in one batch at most.
POINTS = 32
#: Bytes of the framebuffers of one batch at most, one frame at the least.
BYTES = 64 << 20
#: What one batch may take, one setting at the least: a device cannot be stopped, so that whoever is
#: interrupted and closes the renderer waits for what the device has.
SECONDS = 0.25
#: Batches that the device has while the frames of another are taken.
AHEAD = 2


class _Submitted(NamedTuple):
    batch: _core.Batch
    settings: list[Settings]
    since: float


class _Points:
    """A sequence of settings, put into batches in its order.

    Attributes
    ----------
    failure : Exception or None
        What comes after all that was submitted.
    """

    def __init__(
        self,
        settings_seq: Iterable[Settings],
        open_batch: Callable[[], _core.Batch],
        allocate: Allocate,
    ) -> None:
        self._sequence = iter(settings_seq)
        self._open_batch = open_batch
        self._allocate = allocate
        self._waiting: deque[Settings] = deque()  # taken from the sequence, and not submitted
        self._alone = 0  # how many of those go one by one
        self._limit = 1
        self._most = POINTS  # in SECONDS, as far as is known
        self._ended = False
        self.failure: Exception | None = None

    def submit(self) -> _Submitted | None:
        """Hand the next settings to the device; None: there are none, or the next one failed."""
        while True:
            batch, settings = None, []
            try:
                batch = self._open_batch()
                settings = self._fill(batch)
                if not settings:
                    return None
                batch.submit()
            except Exception as error:
                if not self._blames_one(error, settings):
                    self._fail(error)
                    return None
                # Those before it still come, and the error in its turn.
                self._waiting.extendleft(reversed(settings))
                self._alone = len(settings)
            else:
                self._alone = max(0, self._alone - 1)
                # The first frame waits for no other, and whoever uses a few has a few made in vain:
                # twice as many as these, which may be fewer than the limit was.
                self._limit = min(2 * len(settings), POINTS)
                return _Submitted(batch, settings, time.perf_counter())

    def took(self, seconds: float, count: int) -> None:
        """Learn from a batch of so many settings, which took no longer than that."""
        self._most = max(1, int(SECONDS * count / max(seconds, SECONDS / POINTS)))

    def _fill(self, batch: _core.Batch) -> list[Settings]:
        settings: list[Settings] = []
        limit = 1 if self._alone else min(self._limit, self._most)
        while len(settings) < limit:
            if settings and batch.size + batch.size // len(settings) > BYTES:
                break
            point = self._next()
            if point is None:
                break
            try:
                fits = batch.add(point, self._allocate)
            except Exception as error:
                self._fail(error)
                break
            if not fits:
                self._waiting.appendleft(point)
                break
            settings.append(point)
        return settings

    def _next(self) -> Settings | None:
        if self._waiting:
            return self._waiting.popleft()
        if self._ended:
            return None
        try:
            return next(self._sequence)
        except StopIteration:
            self._ended = True
        except Exception as error:
            self._fail(error)
        return None

    def _fail(self, error: Exception) -> None:
        self.failure = error
        self._ended = True
        self._waiting.clear()

    @staticmethod
    def _blames_one(error: Exception, settings: list[Settings]) -> bool:
        """Whether one of several settings is to blame, so that the others may do alone."""
        general = _core.ValidationError, _core.DeviceLostError
        return (
            len(settings) > 1 and isinstance(error, _core.Error) and not isinstance(error, general)
        )


def run(
    settings_seq: Iterable[Settings],
    open_batch: Callable[[], _core.Batch],
    allocate: Allocate,
) -> Iterator[tuple[Settings, Result]]:
    """Yield the result of each of the settings, in their order.

    Settings are taken ahead of the results, so that the device has work while results are used:
    none ahead of the first result, then as many as make `AHEAD` batches.

    Parameters
    ----------
    settings_seq : iterable of Settings
    open_batch : callable
        Gives an empty batch of the source.
    allocate : callable
        Gives the array of a framebuffer from its name, shape and dtype.

    Raises
    ------
    Exception
        What a point or the sequence raises, after the results before it.
    """
    points = _Points(settings_seq, open_batch, allocate)
    submitted: deque[_Submitted] = deque()
    ahead = 1
    before = 0.0  # when the last batch was collected
    try:
        while True:
            while len(submitted) < ahead and (added := points.submit()) is not None:
                submitted.append(added)
            if not submitted:
                break
            batch, settings, since = submitted.popleft()
            results = batch.collect()
            del batch
            # The device began with it when it had it and was done with the one before.
            end = time.perf_counter()
            points.took(end - max(since, before), len(settings))
            before = end
            # A result is the taker's alone: none is kept until its batch is through.
            results.reverse()
            for point in settings:
                yield point, results.pop()
            ahead = AHEAD
    finally:
        # Whatever nobody takes is waited for here, not when the collector comes round.
        submitted.clear()
    failure, points.failure = points.failure, None
    if failure is not None:
        try:
            raise failure
        finally:
            # Its traceback holds this frame, and so the batch, until the collector comes round.
            del failure
