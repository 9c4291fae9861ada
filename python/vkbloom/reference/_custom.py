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
    result = {
        name: np.asarray(array, np.float64) for name, array in function(image, settings).items()
    }
    if "final" in result:
        final = result.pop("final")[..., :channels]
        result.setdefault(
            "bloom", np.dstack([final[..., :3] - scene[..., :3], image[..., 3:] * 0 + 1])
        )
        return {**result, "final": final}
    if "bloom" not in result:
        raise ValueError(
            f"reference: it returned {', '.join(result) or 'nothing'}; it must return 'bloom' "
            "or 'final'"
        )
    return {**result, "final": composite(scene, result["bloom"], settings, dtype)}
