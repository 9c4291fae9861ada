"""Custom methods: the framebuffers of a reference in NumPy, given with the method's file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._compositing import composite
from ._sampling import Array

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

Function = Callable[[Array, Any], Mapping[str, NDArray[Any]]]


def framebuffers(
    function: Function, scene: Array, settings: Settings, dtype: np.dtype[Any]
) -> dict[str, Array]:
    """Return the framebuffers of a reference.

    One that returns "final" composites by itself; then "bloom" is the difference to the scene.
    """
    height, width, channels = scene.shape
    image = scene if channels == 4 else np.dstack([scene, np.ones((height, width))])
    found = {
        name: np.asarray(array, np.float64) for name, array in function(image, settings).items()
    }
    if "final" in found:
        final = found.pop("final")[..., :channels]
        found.setdefault(
            "bloom", np.dstack([final[..., :3] - scene[..., :3], image[..., 3:] * 0 + 1])
        )
        return {**found, "final": final}
    if "bloom" not in found:
        raise ValueError(
            f"reference: it returned {', '.join(found) or 'nothing'}; it must return 'bloom' "
            "or 'final'"
        )
    return {**found, "final": composite(scene, found["bloom"], settings, dtype)}
