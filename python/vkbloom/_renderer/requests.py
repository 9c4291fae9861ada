"""Sequences of requests: several are submitted together, while the device runs others."""

from __future__ import annotations

import contextlib
import time
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from vkbloom import _core
from vkbloom._locks import ProcessLock
from vkbloom._renderer.device_arrays import Destination, DeviceArray
from vkbloom._renderer.new_arrays import array_bytes, new_arrays
from vkbloom._renderer.state import Continued, State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

    from vkbloom._settings.settings import Settings

    #: The settings of a request, its arrays, the arguments of `Frames._finish`, and the state after
    #: it.
    Result = tuple[
        Settings, dict[str, NDArray[Any]], tuple[dict[str, float], int, int], State | None
    ]

#: The most requests in one submission.
MAX_REQUESTS = 32
#: The most bytes of framebuffers in one submission. A single request may have more.
MAX_BYTES = 64 << 20
#: The longest time of one submission. A single request may take longer. A device cannot be stopped,
#: so closing the renderer after an interruption waits for the pending submissions.
MAX_SECONDS = 0.25
#: Submissions that are pending while the caller takes the frames of another one.
AHEAD = 2
#: The same if each request has its own image, since the next one is copied while the device works.
IMAGES_AHEAD = 3


class PendingSubmission:
    """A submission whose result is awaited when it is first read.

    Some or all of its arrays are on a GPU, whose streams wait for them.
    """

    def __init__(self, submission: _core.Submission) -> None:
        #: Whether streams of the GPU wait for all of its arrays, so that the host need not.
        self.ordered = submission.ordered
        #: The same of those on the GPU, if others are on the host.
        self.exports_ordered = submission.exports_ordered
        self._lock = ProcessLock()
        self._submission: _core.Submission | None = submission
        self._results: tuple[list[dict[str, float]], tuple[int, ...]] | None = None
        self._error: Exception | None = None

    def wait(self) -> tuple[list[dict[str, float]], tuple[int, ...]]:
        """Return what the submission's `wait` returns, or raise what it raised."""
        self.complete()
        if self._results is None:
            assert self._error is not None
            raise self._error
        return self._results

    def complete(self) -> None:
        """Wait, and raise what that raises, unless it was done before."""
        with self._lock:
            if (submission := self._submission) is None:
                return
            self._submission = None
            self._error = RuntimeError("the wait for the framebuffers was interrupted")
            try:
                self._results = submission.wait()
            except Exception as error:
                self._error = error
                raise

    def of_request(self) -> tuple[dict[str, float], int, int]:
        """Return timings and the numbers of NaNs and infinities of its only request."""
        (timings,), (nan, inf) = self.wait()
        return timings, nan, inf

    def of_layer(self, index: int) -> tuple[dict[str, float], int, int]:
        """Return the same of one image of a batch: its share of the times."""
        (timings,), counts = self.wait()
        share = {name: 2 * took / len(counts) for name, took in timings.items()}
        return share, counts[2 * index], counts[2 * index + 1]


class PendingSubmissions:
    """The pending submissions, the oldest first.

    A call waits for them before CUDA copies its image, or when it has submitted its own. If CUDA
    copied the next image while Vulkan works, the GPU would change between both after slices of
    2 ms: on an H100, calls in a row took 2.7 ms each instead of 0.7. So the memory of a caller who
    never waits is bounded, too.
    """

    def __init__(self) -> None:
        self._pending: deque[PendingSubmission] = deque()

    def add(self, submission: PendingSubmission) -> None:
        """Add a submission."""
        self._pending.append(submission)

    def wait(self) -> None:
        """Wait until all are complete."""
        # Another thread may take the last one between the comparison and this one's turn.
        with contextlib.suppress(IndexError):
            while self._pending:
                self._pending.popleft().complete()

    def forget(self) -> None:
        """Drop them, as in a forked process, which cannot wait."""
        self._pending.clear()


def upload_each(core: _core.Renderer, sequence: Iterable[Request]) -> Iterator[Request]:
    """Copy each image to the device before the next one is taken.

    Images reuse the device memory of earlier ones whose submissions have finished.
    """
    kept: deque[_core.Source] = deque()
    for request in sequence:
        if request.source.resident or request.source.exported:
            yield request
            continue
        spare = kept.popleft() if len(kept) == IMAGES_AHEAD else None
        kept.append(core.upload(request.source, spare, True))
        settings = request.settings
        # The iterable may overwrite the array when it makes the next image.
        del request
        yield Request(kept[-1], settings)


def name_outputs(
    plan: _core.Plan,
    arrays: tuple[NDArray[Any] | _core.Exported, ...],
    destination: Destination = "host",
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a plan's outputs by name."""
    frames: dict[str, NDArray[Any]] = {}
    # Not a comprehension, for the reason above: `destination` would be a cell.
    for (name, shape, dtype), array in zip(plan.outputs, arrays, strict=True):
        if destination == "viewed" or isinstance(array, _core.Exported):
            # Annotated as arrays of NumPy, which they are unless the caller asked for others.
            frames[name] = cast("NDArray[Any]", DeviceArray(array, shape, dtype))
        else:
            frames[name] = array
    return frames


class Request(NamedTuple):
    """The source and the settings of a request."""

    source: _core.Source
    settings: Settings


class _Planned(NamedTuple):
    request: Request
    plan: _core.Plan
    arrays: tuple[NDArray[Any] | _core.Exported, ...]
    destination: Destination

    def result(
        self, timings: dict[str, float], counts: tuple[int, ...], state: State | None
    ) -> Result:
        arrays = name_outputs(self.plan, self.arrays, self.destination)
        return self.request.settings, arrays, (timings, counts[0], counts[1]), state


class _Submitted(NamedTuple):
    submission: _core.Submission
    requests: list[_Planned]
    since: float
    state: State | None


class _Requests:
    """Divides a sequence of requests into submissions, in order.

    - `before`: What they continue; so each is a submission of its own. None: nothing.
    - `failure`: To be raised after the results of everything that was submitted.
    """

    def __init__(
        self,
        sequence: Iterable[Request],
        core: _core.Renderer,
        names: tuple[str, ...] | None,
        before: Continued | None,
        destination: Callable[[_core.Source], Destination],
    ) -> None:
        self._sequence = iter(sequence)
        self._core = core
        self._names = names
        self._before = before
        self._ever = MAX_REQUESTS if before is None else 1
        self._destination = destination
        self._waiting: deque[Request] = deque()  # taken from the sequence, not submitted yet
        self._limit = 1
        self._most = self._ever  # that fit into MAX_SECONDS, as far as is known
        self._ended = False
        self.failure: Exception | None = None

    def submit(self) -> _Submitted | None:
        """Submit the next requests. None: there are no more, or the next one failed."""
        requests = self._take()
        if not requests:
            return None
        plans = tuple(planned.plan for planned in requests)
        arrays = tuple(planned.arrays for planned in requests)
        source = requests[0].request.source
        after: State | None = None
        try:
            if self._before is None:
                submission = self._core.run(source, plans, arrays)
            else:
                state, is_chain = self._before
                histories = state.histories(self._core, plans[0])
                submission = self._core.run(source, plans, arrays, False, None, histories)
                after = state.advance(self._core, plans[0], submission)
                if is_chain:
                    self._before = Continued(after)
        except Exception as error:
            self._fail(error)
            return None
        # Double the number, starting with one request. So the first frame waits for no other, and
        # a caller that stops early wastes little work.
        self._limit = min(2 * len(requests), MAX_REQUESTS)
        return _Submitted(submission, requests, time.perf_counter(), after)

    def took(self, seconds: float, count: int) -> None:
        """Update the limit after a submission of `count` requests that took at most `seconds`."""
        fit = int(MAX_SECONDS * count / max(seconds, MAX_SECONDS / MAX_REQUESTS))
        self._most = min(max(1, fit), self._ever)

    def _take(self) -> list[_Planned]:
        """Return the requests of the next submission."""
        requests: list[_Planned] = []
        size = 0
        limit = min(self._limit, self._most)
        while len(requests) < limit:
            if requests and size + size // len(requests) > MAX_BYTES:
                break
            request = self._next()
            if request is None:
                break
            try:
                plan = self._core.plan(request.source, request.settings, self._names)
                # Another source or other images need another submission.
                if requests and not (
                    request.source is requests[0].request.source
                    and plan.shares_images(requests[0].plan)
                ):
                    self._waiting.appendleft(request)
                    break
                destination = self._destination(request.source)
                arrays = new_arrays(self._core, plan, destination)
                requests.append(_Planned(request, plan, arrays, destination))
            except Exception as error:
                self._fail(error)
                break
            size += sum(array_bytes(shape, dtype) for _, shape, dtype in plan.outputs)
        return requests

    def _next(self) -> Request | None:
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


def run(
    sequence: Iterable[Request],
    core: _core.Renderer,
    names: tuple[str, ...] | None,
    *,
    before: Continued | None = None,
    destination: Callable[[_core.Source], Destination] = lambda _: "host",
) -> Iterator[Result]:
    """Yield the result of each request, in their order.

    Work is taken before earlier results are yielded, so that the device is busy while the caller
    uses results: none before the first result, then enough for `AHEAD` submissions.
    """
    waiting = _Requests(sequence, core, names, before, destination)
    submitted: deque[_Submitted] = deque()
    ahead = 1
    ended = 0.0  # when the last submission ended
    try:
        while True:
            while len(submitted) < ahead and (added := waiting.submit()) is not None:
                submitted.append(added)
            if not submitted:
                break
            submission, requests, since, after = submitted.popleft()
            timings, counts = submission.wait()
            del submission
            # The device started it after it was submitted and the one before had ended.
            end = time.perf_counter()
            waiting.took(end - max(since, ended), len(requests))
            ended = end
            # Yielded results are not kept, so that the caller is their only owner.
            requests.reverse()
            timings.reverse()
            while requests:
                yield requests.pop().result(timings.pop(), counts, after)
            ahead = AHEAD if before is None else IMAGES_AHEAD
    finally:
        # Waits here for submissions whose results nobody takes, not at the next garbage
        # collection.
        submitted.clear()
    failure, waiting.failure = waiting.failure, None
    if failure is not None:
        try:
            raise failure
        finally:
            # Its traceback would keep this frame and its arrays until the next garbage collection.
            del failure
