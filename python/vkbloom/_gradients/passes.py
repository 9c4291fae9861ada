"""Derivatives by adjoint passes on the device."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._gradients.levels import (
    distance_by,
    distance_fields,
    factor_fields,
    factors_by_shares,
    factors_of_levels,
    share_fields,
    stage_fields,
)
from vkbloom._locks import ProcessLock
from vkbloom._renderer import requests
from vkbloom._renderer.device_arrays import Destination, ImportedArray, on_host, place
from vkbloom._renderer.new_arrays import new_memory
from vkbloom._renderer.renderer import DerivativeKind, Renderer
from vkbloom._renderer.sources import Inputs
from vkbloom.reference._derivatives import Gradients, check_known, differentiable
from vkbloom.reference._sampling import scale_size

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

#: The most framebuffers with cotangents that a source can bring.
_MAX_LEVELS: Final = 7
#: The framebuffers of derivatives by images.
_BY_IMAGES: Final = (".by_image", ".by_emission", ".by_mask")
_BY_LIGHT: Final = ".by_light"
#: The weights of a field of kernels.
WEIGHTS: Final = "psf.weights"
#: The fields that the composite reads.
_OF_COMPOSITE: Final = ("intensity", "exposure", "reference_white")
#: With the number of the sum of two levels, from the largest on.
_BY_SHARES: Final = ".by_shares_"
#: A sum that is less than this, relative to the root of the sum of its squares, has lost digits.
MIN_SHARE: Final = 0.3
#: Curves that magnify the rounding of a float.
_STEEP: Final = {"aces", "agx", "pq", "hlg"}


def check_finite(cotangents: Mapping[str, NDArray[Any] | ImportedArray]) -> None:
    """Raise ValueError if a cotangent on the device is not finite; those of the host are."""
    for name, part in cotangents.items():
        if isinstance(part, ImportedArray) and not np.isfinite(part.numpy()).all():
            raise ValueError(f"cotangents: {name!r} has NaN or infinity")


class Sums(NamedTuple):
    """Sums of the device, and the fields whose derivatives are combinations of them.

    - `factors`: By field, of its shape, and with a factor for each channel of each array.
    - `arrays`: Of shape (2, 1, channels): the sums, and those of the squares of their terms.
    """

    factors: Mapping[str, NDArray[np.float64]]
    arrays: tuple[NDArray[Any], ...]


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
        return _sums_of(self.passes.settings, (width, height), totals, fields)

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
            sums = _wanted_sums(self.settings, known if fields is None else known & {*fields})
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


def _wanted_sums(settings: Settings, wanted: Collection[str]) -> tuple[str, ...]:
    """Return what the core calls the sums that some of `device_fields` need."""
    by_shares, factors = share_fields(settings), factor_fields(settings)
    distances, stages = distance_fields(settings), stage_fields(settings)
    channels = _channels(settings)
    zeros = {name for factors in channels.values() for name, one in factors.items() if one == 0}
    sums = set()
    for name in {*wanted} - zeros:
        if name in by_shares:
            sums.add("shares")
        if name in stages:
            sums.add("stages")
        elif name == "intensity":
            sums.add("composite" if settings.value_of(name) == 0 else name)
        elif name in _OF_COMPOSITE:
            sums.add("composite")
        elif name in distances:
            sums |= {kind[: -len("_x")] for kind in distances[name]}
        elif name not in by_shares:
            sums.add(factors.get(name, "threshold"))
    return tuple(sorted(sums))


def _channels(settings: Settings) -> dict[str, dict[str, float | None]]:
    """Return for each sum the fields whose derivatives its channels are, times a factor.

    0: the derivative is 0, also without the sum. None: it is not that of the field.
    """
    is_set, intensity = settings.threshold is not None, settings.value_of("intensity")
    threshold: dict[str, float | None] = {}
    if not settings.published:
        # Without a knee it is a step.
        threshold = dict.fromkeys(("threshold", "knee"), float(is_set and settings.knee != 0))
    own = settings._threshold_slopes()
    composite: dict[str, float | None] = dict.fromkeys(_OF_COMPOSITE, 1.0)
    if settings.glare:
        # It is that of the sum of the bloom and the stages.
        composite["intensity"] = None
    return {
        ".by_composite": composite,
        ".by_threshold": threshold,
        ".by_own_threshold": {name: slope * is_set for name, slope in own.items()},
        # The intensity's derivative, times the intensity.
        _BY_LIGHT: threshold | {"intensity": 1.0 / intensity if intensity != 0 else None},
    }


def _sums_of(
    settings: Settings,
    size: tuple[int, int],
    totals: Mapping[str, NDArray[Any]],
    fields: Collection[str],
) -> Sums:
    """Return the sums of the device with what they are multiplied by for each of the fields.

    `size`: of the image.
    """
    size = settings.bloom_size or scale_size(size, settings.bloom_scale)
    starts, width = {}, 0
    for name, array in totals.items():
        starts[name] = width
        width += array.shape[-1]
    found: dict[str, NDArray[np.float64]] = {}
    for kind, factors in _channels(settings).items():
        for channel, (name, factor) in enumerate(factors.items()):
            if factor == 0 or (kind in starts and factor is not None and name not in found):
                found[name] = np.zeros(width)
                if factor != 0:
                    found[name][starts[kind] + channel] = factor
    count = sum(name.startswith(_BY_SHARES) for name in totals)
    by_shares = factors_by_shares(settings, size) if count and share_fields(settings) else {}
    for name, given in by_shares.items():
        # The composite reads the field, too. Without cotangents the largest levels have no sums.
        pairs = np.broadcast_to(given[..., -count:, :], (*given.shape[:-2], count, 2))
        rows = found.setdefault(name, np.zeros((*given.shape[:-2], width)))
        for number in range(count):
            start = starts[f"{_BY_SHARES}{number}"]
            rows[..., start : start + 2] = pairs[..., number, :]
            if _blurred(settings) == 4:
                rows[..., start + 2 : start + 4] = pairs[..., number, :]
    if not {*factor_fields(settings)}.isdisjoint(fields):
        found |= _by_factors(settings, starts, width)
    for name, number in stage_fields(settings).items():
        start, value = starts.get(f".by_stages_{number}"), settings.value_of(name)
        if start is None:
            found.pop(name, None)
            continue
        row = found.setdefault(name, np.zeros(width))
        row[start : start + _blurred(settings)] = 1 / value if value else np.inf
    for name in distance_fields(settings).keys() & {*fields}:
        found[name] = _by_distance(settings, name, size, starts, width)
    # Other derivatives are left to the reference.
    known = {name: found[name] for name in fields if name in found}
    known = {name: factors for name, factors in known.items() if np.isfinite(factors).all()}
    return Sums(known, tuple(totals.values()))


def _by_distance(
    settings: Settings, name: str, size: tuple[int, int], starts: Mapping[str, int], width: int
) -> NDArray[np.float64]:
    """Return the factors of all sums for a field that sets distances of taps."""
    kinds, distance = distance_fields(settings)[name], distance_by(settings, name, size)
    found = np.zeros(width)
    for total, start in starts.items():
        if total.removeprefix(".by_").rpartition("_")[0] in kinds:
            # A distance of 0 leaves nothing of the slopes.
            found[start : start + _blurred(settings)] = 1 / distance if distance else np.inf
    return found


def _blurred(settings: Settings) -> int:
    """Return how many channels of levels the composite reads."""
    return 4 if settings.alpha == "blur" else 3


def _by_factors(
    settings: Settings, starts: Mapping[str, int], width: int
) -> dict[str, NDArray[np.float64]]:
    """Return the factors of all sums for the fields that multiply channels of levels."""
    found, channels = {}, _blurred(settings)
    for name, by_level in factors_of_levels(settings).items():
        kind, count = factor_fields(settings)[name], by_level.shape[-2]
        kinds = [".by_colour"] if kind == "colour" else [f".by_levels_{i}" for i in range(count)]
        # A level that has cotangents of its own has no sum.
        if not all(level in starts for level in kinds):
            continue
        found[name] = np.zeros((*by_level.shape[:-2], width))
        for number, level in enumerate(kinds):
            start = starts[level]
            found[name][..., start : start + channels] = by_level[..., number, :channels]
    return found


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


# Each step of a training loop asks several times.
@functools.lru_cache(16)
def device_fields(settings: Settings) -> frozenset[str]:
    """Return the fields by which the device has the derivatives.

    These are what only the composite, the threshold, or the sums of levels and of stages read.
    Stages of glare read the threshold of a published method, too.
    """
    known = {*_OF_COMPOSITE} - settings._fields_before_composite
    if not settings.published:
        known |= {"threshold", "knee"}
    elif not settings.glare:
        known |= settings._threshold_slopes().keys()
    known |= {*share_fields(settings), *factor_fields(settings), *distance_fields(settings)}
    if settings.glare:
        known = (known - {"intensity"}) | stage_fields(settings).keys()
    return frozenset(known & differentiable(settings).keys())


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
