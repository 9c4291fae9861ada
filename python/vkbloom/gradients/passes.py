"""Derivatives by adjoint passes on the device."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core, requests
from vkbloom.core_access import HasCore, core_of
from vkbloom.reference.derivatives import Gradients, differentiable

if TYPE_CHECKING:
    from vkbloom.settings import Settings

__all__ = ["DeviceGradients", "Passes", "device_fields", "on_device"]

#: The most framebuffers with cotangents that a source can bring.
_MOST: Final = 7
#: The fields whose derivatives are the channels of a sum.
_SUMS: Final = {
    "by_composite": ("intensity", "exposure", "reference_white"),
    "by_threshold": ("threshold", "knee"),
}
#: A sum that is less than this, relative to the root of the sum of its squares, has lost digits.
_LEAST: Final = 0.3
#: Curves that magnify the rounding of a float.
_STEEP: Final = {"aces", "agx", "pq", "hlg"}


@dataclass(frozen=True, eq=False)
class Passes:
    """The adjoint passes of an image with settings and cotangents.

    - `given`: Mask and emission.
    - `cotangents`: Checked, by framebuffer.
    """

    renderer: HasCore
    pixels: NDArray[Any]
    settings: Settings
    given: Mapping[str, NDArray[Any]]
    cotangents: Mapping[str, NDArray[Any]]

    def images(self) -> dict[str, NDArray[np.float32]] | None:
        """Return the derivatives by image, mask and emission.

        None: a pass has no adjoint, or the renderer is closed.
        """
        found = self._run(sums=False)
        if found is None:
            return None
        results = {
            name: found.get(f"by_{name}", np.zeros(array.shape, np.float32))
            for name, array in (("image", self.pixels), *sorted(self.given.items()))
        }
        if "by_mask" in found:
            results["mask"] = np.ascontiguousarray(results["mask"][..., 0])
        return results

    def fields(self) -> dict[str, NDArray[np.float32]]:
        """Return the derivatives by fields that are exact to single floats."""
        wanted = device_fields(self.settings)
        found = self._run(sums=True) if wanted else None
        results: dict[str, NDArray[np.float32]] = {}
        for kind, names in _SUMS.items():
            if found is None or kind not in found:
                continue
            sums, squares = (found[key][0, 0] for key in (kind, f"{kind}_squares"))
            for name, total, square in zip(names, sums, squares, strict=False):
                if name in wanted and abs(total) >= _LEAST * np.sqrt(square):
                    results[name] = np.asarray(total)
        return results

    def _run(self, *, sums: bool) -> dict[str, NDArray[Any]] | None:
        core = core_of(self.renderer)
        levels = tuple(np.ascontiguousarray(one, np.float32) for one in self.cotangents.values())
        if core.closed or not 0 < len(levels) <= _MOST:
            return None
        if any(level.ndim != 3 or level.shape[2] not in (3, 4) for level in levels):
            return None
        given = self.given
        source = _core.image_source(self.pixels, given.get("emission"), given.get("mask"), levels)
        plan = core.adjoint(source, self.settings, tuple(self.cotangents), sums)
        if plan is None or not plan.outputs:
            return None if plan is None else {}
        arrays = requests.new_arrays(core, plan)
        core.run(source, (plan,), (arrays,)).wait()
        return requests.named(plan, arrays)


def on_device(renderer: HasCore, settings: Settings) -> bool:
    """Return whether the device has passes for the derivative of "final" by an image with alpha."""
    pixels = np.zeros((32, 40, 4), np.float32)
    floats = settings.replace(format="rgba32float")
    return Passes(renderer, pixels, floats, {}, {"final": pixels}).images() is not None


def device_fields(settings: Settings) -> frozenset[str]:
    """Return the fields by which the device has the derivatives.

    These are what only the composite and the threshold pass read. Published methods have
    thresholds of their own, and some read the intensity or the exposure before the composite.
    """
    if settings.published or {settings.tonemap, settings.encoding} & _STEEP:
        return frozenset()
    known = frozenset(name for names in _SUMS.values() for name in names)
    return known & frozenset(differentiable(settings))


class DeviceGradients(Gradients):
    """Derivatives of the device; others are computed when the first of them is read.

    - `found`: Those by images.
    - `names`: All names, in the order of the reference.
    - `fields`: Returns those by some of the fields.
    - `every`: Returns all, from the reference.
    """

    def __init__(
        self,
        found: Mapping[str, NDArray[Any]],
        names: Iterable[str],
        fields: Callable[[], Mapping[str, NDArray[Any]]],
        every: Callable[[], Mapping[str, NDArray[Any]]],
    ) -> None:
        super().__init__(found)
        self._names = tuple(names)
        self._more = [fields, every]

    def _complete(self) -> None:
        """Take what is missing from the reference."""
        if self._more:
            every = self._more[-1]()
            self._more.clear()
            known = dict(super().items())
            super().clear()
            super().update((name, known.get(name, part)) for name, part in every.items())

    def __missing__(self, name: str) -> NDArray[Any]:
        if name not in self._names:
            raise ValueError(
                f"gradients: {name!r} has no derivative; available: {', '.join(self._names)}"
            )
        if len(self._more) > 1:
            super().update(self._more.pop(0)())
            return self[name]
        self._complete()
        return self[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __repr__(self) -> str:
        self._complete()
        return super().__repr__()

    def __eq__(self, other: object) -> bool:
        self._complete()
        return super().__eq__(other)

    __hash__ = None  # type: ignore[assignment]

    def get(self, name: str, default: Any = None) -> Any:
        """Return a derivative, or the default where there is none."""
        return self[name] if name in self._names else default

    def keys(self) -> Any:
        """Return the names."""
        return dict.fromkeys(self._names).keys()

    def values(self) -> Any:
        """Return all derivatives."""
        self._complete()
        return super().values()

    def items(self) -> Any:
        """Return all names and derivatives."""
        self._complete()
        return super().items()
