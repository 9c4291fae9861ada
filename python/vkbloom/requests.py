"""Many requests in their order: several go to the device at once, while it has others to run."""

from __future__ import annotations

import math
import time
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vkbloom import _core

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from vkbloom.settings import Settings

__all__ = ["Result", "Work", "new_array", "new_arrays", "run", "run_one", "uploaded"]

#: Requests in one submission at most.
REQUESTS = 32
#: Bytes of the framebuffers of one submission at most, one request at the least.
BYTES = 64 << 20
#: What one submission may take, one request at the least: a device cannot be stopped, so that
#: whoever is interrupted and closes the renderer waits for what the device has.
SECONDS = 0.25
#: Submissions that the device has while the frames of another are taken.
AHEAD = 2
#: The same where each request has an image of its own: the next is copied while the device works.
IMAGES_AHEAD = 3

#: Arrays of so many bytes and more are in a renderer's pages, where the device writes them itself.
#: NumPy keeps some of the memory of smaller ones for the next.
LARGE_BYTES = 1 << 20


class Result(NamedTuple):
    """What a request gave.

    Attributes
    ----------
    arrays : dict of str to ndarray
    timings : dict of str to float
    counts : (int, int)
        How many NaN and infinities the input held.
    """

    arrays: dict[str, NDArray[Any]]
    timings: dict[str, float]
    counts: tuple[int, int]


def new_array(core: _core.Renderer, shape: tuple[int, ...], dtype: str) -> NDArray[Any]:
    """Return an array for a framebuffer; it holds anything.

    A large one is in pages that its `base` owns, and that are used again when it is gone.

    Raises
    ------
    OutOfMemoryError
        There is no memory for it.
    """
    size = math.prod(shape) * np.dtype(dtype).itemsize
    if size < LARGE_BYTES:
        return np.empty(shape, dtype)
    # NumPy's types know the standard library's buffers only.
    return np.ndarray(shape, dtype, buffer=core.pages(size))  # type: ignore[arg-type]


def new_arrays(core: _core.Renderer, plan: _core.Plan) -> tuple[NDArray[Any], ...]:
    """Return an array for each of a plan's outputs."""
    arrays = []
    # A generator would make a cell of `core`. CPython 3.11 leaks all arguments of a call that gets
    # no memory for a cell, and the plan with them.
    for _, shape, dtype in plan.outputs:
        arrays.append(new_array(core, shape, dtype))
    return tuple(arrays)


def run_one(
    core: _core.Renderer,
    source: _core.Source,
    plan: _core.Plan,
    arrays: tuple[NDArray[Any], ...],
) -> Result:
    """Run a plan and wait for it.

    Parameters
    ----------
    core : Renderer of the core
    source : Source of the core
    plan : Plan of the core
        Made for both.
    arrays : tuple of ndarray
        To be filled, one for each of the plan's outputs.
    """
    (timings,), counts = core.run(source, (plan,), (arrays,)).wait()
    return Result(_named(plan, arrays), timings, counts)


def uploaded(core: _core.Renderer, sequence: Iterable[Work]) -> Iterator[Work]:
    """Copy each image to the device before the next is asked for.

    Images of arrays take the device's memory of those before, whose submissions are over by then.

    Parameters
    ----------
    core : Renderer of the core
    sequence : iterable of Work
        Of images; one that is on the device stays as it is.
    """
    kept: deque[_core.Source] = deque()
    for work in sequence:
        if work.source.resident:
            yield work
            continue
        spare = kept.popleft() if len(kept) == IMAGES_AHEAD else None
        kept.append(core.upload(work.source, spare, True))
        settings = work.settings
        # The array is the caller's again while the next is asked for.
        del work
        yield Work(kept[-1], settings)


def _named(plan: _core.Plan, arrays: tuple[NDArray[Any], ...]) -> dict[str, NDArray[Any]]:
    return {name: array for (name, _, _), array in zip(plan.outputs, arrays, strict=True)}


class Work(NamedTuple):
    """What a request is made of.

    Attributes
    ----------
    source : Source of the core
    settings : Settings
    """

    source: _core.Source
    settings: Settings


class _Request(NamedTuple):
    work: Work
    plan: _core.Plan
    arrays: tuple[NDArray[Any], ...]


def _taken(
    request: _Request, timings: dict[str, float], counts: tuple[int, int]
) -> tuple[Settings, Result]:
    return request.work.settings, Result(_named(request.plan, request.arrays), timings, counts)


class _Submitted(NamedTuple):
    submission: _core.Submission
    requests: list[_Request]
    since: float


class _Requests:
    """A sequence of work, put into submissions in its order.

    Parameters
    ----------
    sequence : iterable of Work
    core : Renderer of the core
    names : tuple of str or None
    most : int
        Requests in one submission at most.

    Attributes
    ----------
    failure : Exception or None
        What comes after all that was submitted.
    """

    def __init__(
        self,
        sequence: Iterable[Work],
        core: _core.Renderer,
        names: tuple[str, ...] | None,
        most: int,
    ) -> None:
        self._sequence = iter(sequence)
        self._core = core
        self._names = names
        self._ever = most
        self._waiting: deque[Work] = deque()  # taken from the sequence, and not submitted
        self._alone = 0  # how many of those go one by one
        self._limit = 1
        self._most = most  # in SECONDS, as far as is known
        self._ended = False
        self.failure: Exception | None = None

    def submit(self) -> _Submitted | None:
        """Hand the next work to the device; None: there are none, or the next one failed."""
        while requests := self._take():
            plans = tuple(request.plan for request in requests)
            try:
                submission = self._core.run(
                    requests[0].work.source, plans, tuple(one.arrays for one in requests)
                )
            except Exception as error:
                if not self._blames_one(error, requests):
                    self._fail(error)
                    return None
                # Those before it still come, and the error in its turn.
                self._waiting.extendleft(request.work for request in reversed(requests))
                self._alone = len(requests)
            else:
                self._alone = max(0, self._alone - 1)
                # The first frame waits for no other, and whoever uses a few has a few made in vain:
                # twice as many as these, which may be fewer than the limit was.
                self._limit = min(2 * len(requests), REQUESTS)
                return _Submitted(submission, requests, time.perf_counter())
        return None

    def took(self, seconds: float, count: int) -> None:
        """Learn from a submission of so many requests, which took no longer than that."""
        fit = int(SECONDS * count / max(seconds, SECONDS / REQUESTS))
        self._most = min(max(1, fit), self._ever)

    def _take(self) -> list[_Request]:
        """Return the requests of the next submission."""
        requests: list[_Request] = []
        size = 0
        limit = 1 if self._alone else min(self._limit, self._most)
        while len(requests) < limit:
            if requests and size + size // len(requests) > BYTES:
                break
            work = self._next()
            if work is None:
                break
            try:
                plan = self._core.plan(work.source, work.settings, self._names)
                # Those with another source or other images need another submission.
                if requests and not (
                    work.source is requests[0].work.source and plan.shares_images(requests[0].plan)
                ):
                    self._waiting.appendleft(work)
                    break
                requests.append(_Request(work, plan, new_arrays(self._core, plan)))
            except Exception as error:
                self._fail(error)
                break
            size += plan.size
        return requests

    def _next(self) -> Work | None:
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
    def _blames_one(error: Exception, requests: list[_Request]) -> bool:
        """Whether one of several requests is to blame, so that the others may do alone."""
        general = _core.ValidationError, _core.DeviceLostError
        return (
            len(requests) > 1 and isinstance(error, _core.Error) and not isinstance(error, general)
        )


def run(
    sequence: Iterable[Work],
    core: _core.Renderer,
    names: tuple[str, ...] | None,
    *,
    alone: bool = False,
) -> Iterator[tuple[Settings, Result]]:
    """Yield the result of each request, in their order.

    Work is taken ahead of the results, so that the device has some while results are used: none
    ahead of the first result, then as much as makes `AHEAD` submissions.

    Parameters
    ----------
    sequence : iterable of Work
    core : Renderer of the core
    names : tuple of str or None
        The framebuffers wanted; None: all.
    alone : bool
        Each request is a submission: less than `IMAGES_AHEAD` requests are taken ahead.

    Raises
    ------
    Exception
        What a request or the sequence raises, after the results before it.
    """
    waiting = _Requests(sequence, core, names, 1 if alone else REQUESTS)
    submitted: deque[_Submitted] = deque()
    ahead = 1
    before = 0.0  # when the last submission was over
    try:
        while True:
            while len(submitted) < ahead and (added := waiting.submit()) is not None:
                submitted.append(added)
            if not submitted:
                break
            submission, requests, since = submitted.popleft()
            timings, counts = submission.wait()
            del submission
            # The device began with it when it had it and was done with the one before.
            end = time.perf_counter()
            waiting.took(end - max(since, before), len(requests))
            before = end
            # A result is the taker's alone: none is kept until its submission is through.
            requests.reverse()
            timings.reverse()
            while requests:
                yield _taken(requests.pop(), timings.pop(), counts)
            ahead = IMAGES_AHEAD if alone else AHEAD
    finally:
        # Whatever nobody takes is waited for here, not when the collector comes round.
        submitted.clear()
    failure, waiting.failure = waiting.failure, None
    if failure is not None:
        try:
            raise failure
        finally:
            # Its traceback holds this frame, and so the arrays, until the collector comes round.
            del failure
