"""Derivatives by adjoint passes on the device."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._gradients.sums import Sums, device_fields, sums_of, wanted_sums
from vkbloom._locks import ProcessLock
from vkbloom._renderer import requests
from vkbloom._renderer.device_arrays import Destination, ImportedArray, on_host, place
from vkbloom._renderer.new_arrays import new_memory
from vkbloom._renderer.renderer import DerivativeKind, Renderer
from vkbloom._renderer.sources import Inputs
from vkbloom.reference._derivatives import Gradients, check_known, differentiable

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

#: The most framebuffers with cotangents that a source can bring.
_MAX_LEVELS: Final = 7
#: The framebuffers of derivatives by images.
_BY_IMAGES: Final = (".by_image", ".by_emission", ".by_mask")
#: The weights of a field of kernels.
WEIGHTS: Final = "psf.weights"
#: A sum that is less than this, relative to the root of the sum of its squares, has lost digits.
MIN_SHARE: Final = 0.3
#: Curves that magnify the rounding of a float.
_STEEP: Final = {"aces", "agx", "pq", "hlg"}


def check_finite(cotangents: Mapping[str, NDArray[Any] | ImportedArray]) -> None:
    """Raise ValueError if a cotangent on the device is not finite; those of the host are."""
    for name, part in cotangents.items():
        if isinstance(part, ImportedArray) and not np.isfinite(part.numpy()).all():
            raise ValueError(f"cotangents: {name!r} has NaN or infinity")


@dataclass(frozen=True, eq=False)
class Running:
    """Adjoint passes that were submitted; without a submission there is nothing to run."""

    passes: Passes
    plan: _core.Plan
    arrays: tuple[NDArray[Any] | _core.Exported, ...]
    submission: requests.PendingSubmission | None
    results: DerivativeKind
    #: Those whose sums were computed; None: all.
    fields: Collection[str] | None = None

    def check(self) -> None:
        """Wait, and raise ValueError if a cotangent is not finite."""
        counts = self.submission.wait()[1] if self.submission else (1, 0)
        # The device counts what is not finite in all inputs together.
        if any(counts):
            check_finite(self.passes.cotangents)

    def by_name(self) -> dict[str, NDArray[Any]]:
        """Return the framebuffers; wait for those that no stream of a GPU waits for."""
        if self.submission and not self.submission.ordered:
            self.submission.complete()
        return self._named()

    def _named(self) -> dict[str, NDArray[Any]]:
        return requests.name_outputs(self.plan, self.arrays, self.passes.destination)

    def images(self) -> dict[str, NDArray[Any]]:
        """Return the derivatives by image, mask and emission, as `by_name` does, if it has them."""
        if self.results not in ("images", "all"):
            return {}
        # Beside sums on the host: who takes the images goes on while the device works.
        is_ordered = self.submission is not None and self.submission.exports_ordered
        framebuffers = self._named() if is_ordered else self.by_name()
        return {
            name: framebuffers[f".by_{name}"]
            if f".by_{name}" in framebuffers
            else self._zeros(part.shape)
            for name, part in self.passes.inputs.by_name().items()
        }

    def sums(self, min_share: float = MIN_SHARE) -> dict[str, NDArray[np.float32]]:
        """Return the derivatives by `device_fields`.

        A sum that is less than `min_share` of the root of the sum of its squares is left out, and
        so are those behind a steep curve unless `min_share` is 0.
        """
        if min_share > 0 and {self.passes.settings.tonemap, self.passes.settings.encoding} & _STEEP:
            return {}
        running = self if self.results in ("sums", "all") else self.passes.submit("sums")
        if running is None:
            return {}
        known = device_fields(self.passes.settings)
        sums = running.sums_for(known if self.fields is None else known.intersection(self.fields))
        kinds = [on_host(array)[:, 0].astype(np.float64) for array in sums.arrays]
        # Without fields there are no sums.
        by_channel, squares = np.concatenate([np.zeros((2, 0)), *kinds], axis=1)
        results: dict[str, NDArray[np.float32]] = {}
        for name, factors in sums.factors.items():
            # What a field does not need may be infinite.
            used = factors.any(axis=tuple(range(factors.ndim - 1)))
            total = factors[..., used] @ by_channel[used]
            square = factors[..., used] ** 2 @ squares[used]
            # Infinite sums are left to the reference.
            if np.isfinite(square).all() and (total**2 >= min_share**2 * square).all():
                results[name] = total.astype(np.float32)
        return results

    def sums_for(self, fields: Collection[str]) -> Sums:
        """Return the sums of these passes, with those of the fields whose derivatives they give."""
        totals = {name: array for name, array in self.by_name().items() if name not in _BY_IMAGES}
        height, width = self.passes.inputs.image.shape[:2]
        return sums_of(self.passes.settings, (width, height), totals, fields)

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """Return the derivative by `WEIGHTS`, if there are any, unless the reference has to."""
        if WEIGHTS not in differentiable(self.passes.settings):
            return {}
        running = self if self.results == "weights" else self.passes.submit("weights")
        images = list(running.by_name().values()) if running else []
        if not images:
            return {}
        # Four weights in each, at the places of their grid.
        made = np.concatenate([on_host(image) for image in images], axis=2)
        count = len(self.passes.settings.value_of(WEIGHTS).array)
        return {WEIGHTS: np.ascontiguousarray(made.transpose(2, 0, 1)[:count])}

    def _zeros(self, shape: tuple[int, ...]) -> NDArray[Any]:
        zeros, passes = np.zeros(shape, np.float32), self.passes
        return cast("NDArray[Any]", place(zeros, passes.destination, passes.renderer._core))


@dataclass(frozen=True, eq=False)
class Passes:
    """The adjoint passes of an image with settings and cotangents.

    - `cotangents`: Checked, by framebuffer; those on the device but for NaN and infinity.
    - `destination`: Where the derivatives by images go.
    - `sums_destination`: Where the sums go.
    """

    renderer: Renderer
    inputs: Inputs
    settings: Settings
    cotangents: Mapping[str, NDArray[Any] | ImportedArray]
    destination: Destination = "host"
    sums_destination: Destination = "host"

    def submit(
        self, results: DerivativeKind = "images", fields: Collection[str] | None = None
    ) -> Running | None:
        """Submit the passes of the derivatives by images, the sums of those by fields, or all.

        None: a pass has no adjoint, or the renderer is closed. With `fields`, only the sums that
        these need.
        """
        core = self.renderer._core
        levels = tuple(map(_level, self.cotangents.values()))
        if core.closed or not 0 < len(levels) <= _MAX_LEVELS:
            return None
        if any(len(level.shape) != 3 or level.shape[2] not in (3, 4) for level in levels):
            return None
        source = self.inputs.source(levels)
        sums: tuple[str, ...] = ()
        if results in ("sums", "all"):
            known = device_fields(self.settings)
            sums = wanted_sums(self.settings, known if fields is None else known & {*fields})
        plan = self.renderer._plan_derivatives(
            source, self.settings, tuple(self.cotangents), results, sums
        )
        if plan is None:
            return None
        # The host reads weights.
        others = "host" if results == "weights" else self.sums_destination
        arrays = tuple(
            new_memory(core, shape, dtype, self.destination if name in _BY_IMAGES else others)
            for name, shape, dtype in plan.outputs
        )
        submission = None
        if arrays:
            submission = requests.PendingSubmission(core.run(source, (plan,), (arrays,)))
            self.renderer._pending.wait()
            if submission.exports_ordered:
                self.renderer._pending.add(submission)
        return Running(self, plan, arrays, submission, results, fields)


def _level(cotangent: NDArray[Any] | ImportedArray) -> NDArray[Any] | ImportedArray:
    if isinstance(cotangent, ImportedArray):
        return cotangent
    return np.ascontiguousarray(cotangent, np.float32)


# Few: settings may have large arrays.
@functools.lru_cache(16)
def in_floats(settings: Settings) -> Settings:
    """Return settings whose bloom buffers are floats; the same object, whose plan is kept."""
    floats = "rgba32float"
    return settings if settings.format == floats else settings.replace(format=floats)


def on_device(renderer: Renderer, settings: Settings) -> bool:
    """Return whether the device has passes for the derivative of "final" by an image with alpha."""
    pixels = np.zeros((32, 40, 4), np.float32)
    floats = in_floats(settings)
    return Passes(renderer, Inputs(pixels), floats, {"final": pixels}).submit() is not None


class DeviceGradients(Mapping[str, NDArray[Any]]):
    """Derivatives of the device; others are computed when the first of them is read.

    What is pickled has all of them. After an error the next reading tries again.

    - `known`: Those by images.
    - `names`: All names, in the order of the reference.
    - `sources`: Names, and what returns their derivatives or leaves some to the reference, which
      is the last source and has all names.
    - `sums_for`: What returns the sums for some fields, if these are on the device.
    """

    def __init__(
        self,
        known: Mapping[str, NDArray[Any]],
        names: Iterable[str],
        *sources: tuple[Container[str], Callable[[], Mapping[str, NDArray[Any]]]],
        sums_for: Callable[[Collection[str]], Sums] | None = None,
    ) -> None:
        self._known = dict(known)
        self._names = tuple(names)
        self._sources = list(sources)
        self._lock = ProcessLock()
        self.sums_for = sums_for

    def __getitem__(self, name: str) -> NDArray[Any]:
        check_known(name, self._names)
        with self._lock:
            while name not in self._known:
                device = [source for source in self._sources[:-1] if name in source[0]]
                # The device's come before the reference, so that each has the same bits always.
                source = (device or self._sources)[0]
                self._known = {**source[1](), **self._known}
                self._sources.remove(source)
            return self._known[name]

    def __reduce__(self) -> tuple[type[Gradients], tuple[dict[str, NDArray[Any]]]]:
        return Gradients, (dict(self),)

    def __copy__(self) -> DeviceGradients:
        return self

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __repr__(self) -> str:
        return repr(dict(self))

    def get(self, name: str, default: Any = None) -> Any:
        """Return a derivative, or the default where there is none."""
        return self[name] if name in self._names else default
