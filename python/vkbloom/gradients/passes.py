"""Derivatives by adjoint passes on the device."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core, requests
from vkbloom.core_access import HasCore, core_of
from vkbloom.reference.derivatives import Gradients, differentiable

if TYPE_CHECKING:
    from vkbloom.settings import Settings

__all__ = ["DeviceGradients", "by_passes", "device_fields"]

#: The framebuffers with cotangents that a source can bring.
_MOST: Final = 7
#: The fields whose derivatives are the channels of a sum.
_SUMS: Final = {
    "by_composite": ("intensity", "exposure", "reference_white"),
    "by_threshold": ("threshold", "knee"),
}


def by_passes(
    renderer: HasCore,
    pixels: NDArray[Any],
    settings: Settings,
    given: Mapping[str, NDArray[Any]],
    cotangents: Mapping[str, NDArray[Any]],
) -> dict[str, NDArray[np.float32]] | None:
    """Return the derivatives that the device has passes for, by name.

    None: a pass of the method has no adjoint, or the renderer is closed.

    - `given`: Mask and emission.
    - `cotangents`: Checked, by framebuffer.
    """
    core = core_of(renderer)
    if core.closed or not 0 < len(cotangents) <= _MOST:
        return None
    levels = tuple(
        np.ascontiguousarray(one, dtype=np.float32) for one in cotangents.values()
    )
    if any(level.ndim != 3 or level.shape[2] not in (3, 4) for level in levels):
        return None
    source = _core.image_source(pixels, given.get("emission"), given.get("mask"), levels)
    plan = core.adjoint(source, settings, tuple(cotangents))
    if plan is None:
        return None
    found: dict[str, Any] = {}
    if plan.outputs:
        arrays = requests.new_arrays(core, plan)
        core.run(source, (plan,), (arrays,)).wait()
        found = requests.named(plan, arrays)
    results = {
        name: found.get(f"by_{name}", np.zeros(array.shape, np.float32))
        for name, array in (("image", pixels), *given.items())
    }
    if "mask" in results and results["mask"].ndim == 3:
        results["mask"] = np.ascontiguousarray(results["mask"][..., 0])
    sums = {
        name: found[kind][0, 0, place]
        for kind, names in _SUMS.items()
        if kind in found
        for place, name in enumerate(names)
    }
    fields = device_fields(settings)
    return results | {name: np.asarray(value) for name, value in sums.items() if name in fields}


def device_fields(settings: Settings) -> frozenset[str]:
    """Return the fields that only the composite and the threshold pass read."""
    known = frozenset(differentiable(settings))
    if settings.published:
        # Their first passes have thresholds of their own; some read the exposure or the intensity.
        return known & {"reference_white"}
    return known & {name for names in _SUMS.values() for name in names}


class DeviceGradients(Gradients):
    """Derivatives of the device, and those of the reference, which is called for the first of these.

    - `names`: All names, in the order of the reference.
    - `rest`: Returns all derivatives of the reference.
    """

    def __init__(
        self,
        found: Mapping[str, NDArray[Any]],
        names: Iterable[str],
        rest: Callable[[], Mapping[str, NDArray[Any]]],
    ) -> None:
        super().__init__(found)
        self._names = tuple(names)
        self._rest: Callable[[], Mapping[str, NDArray[Any]]] | None = rest

    def _complete(self) -> None:
        if (rest := self._rest) is None:
            return
        self._rest = None
        known = dict(super().items())
        every = rest()
        super().clear()
        super().update({name: known.get(name, every[name]) for name in every})

    def __missing__(self, name: str) -> NDArray[Any]:
        if self._rest is None or name not in self._names:
            raise ValueError(
                f"gradients: {name!r} has no derivative; available: {', '.join(self._names)}"
            )
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
