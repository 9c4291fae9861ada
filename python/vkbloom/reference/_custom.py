"""Custom methods: the framebuffers of a reference in NumPy, given with the method's file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._compositing import composite, composite_without_store, strength_of
from ._glare import light
from ._image import as_float
from ._sampling import Array

if TYPE_CHECKING:
    from vkbloom._settings.settings import Settings

Function = Callable[[Array, Any], Mapping[str, NDArray[Any]]]


def framebuffers(
    function: Function,
    scene: Array,
    settings: Settings,
    dtype: np.dtype[Any],
    stages: Mapping[str, Array],
) -> dict[str, Array]:
    """Return the framebuffers of a reference, and the stages of glare before them.

    One that returns "final" composites by itself; then "bloom" is the difference to the scene, and
    the light of the glare is added to "final".
    """
    if not settings.bloom:
        return {"final": composite_without_store(scene, None, settings, dtype)}
    height, width, channels = scene.shape
    image = scene if channels == 4 else np.dstack([scene, np.ones((height, width))])
    result = {
        name: np.asarray(array, np.float64) for name, array in function(image, settings).items()
    }
    final = result.pop("final", None)
    if final is not None:
        final = final[..., :channels]
        result.setdefault(
            "bloom", np.dstack([final[..., :3] - scene[..., :3], image[..., 3:] * 0 + 1])
        )
        if stages:
            final = _lit(final, settings, dtype, stages)
    elif "bloom" in result and not settings.glare:
        final = composite(scene, result["bloom"], settings, dtype)
    elif "bloom" in result:
        bloom = as_float(result["bloom"], "bloom", (3, 4))
        whole = bloom if bloom.shape[2] == 4 else np.dstack([bloom, image[..., 3:] * 0 + 1])
        total = light(whole, strength_of(settings), list(stages.values()), settings.glare)
        final = composite_without_store(scene, total, settings, dtype)
    else:
        raise ValueError(
            f"reference: it returned {', '.join(result) or 'nothing'}; it must return 'bloom' "
            "or 'final'"
        )
    # As the core names textures that the method saves under the name of a stage.
    named = {
        f"saved{'__' if f'saved_{name}' in result else '_'}{name}" if name in stages else name: part
        for name, part in result.items()
    }
    return {**stages, **named, "final": final}


def _lit(
    final: Array, settings: Settings, dtype: np.dtype[Any], stages: Mapping[str, Array]
) -> Array:
    """Return a picture with the light of the glare."""
    if settings.exposure or settings.tonemap != "none" or settings.encoding != "none":
        raise ValueError(
            "glare: the method's reference returns 'final' after exposure, tonemap and encoding, "
            "but glare is added before them; leave these as they are, or let it return 'bloom'"
        )
    none = np.zeros((*final.shape[:2], 4))
    return composite_without_store(
        final, light(none, 0.0, list(stages.values()), settings.glare), settings, dtype
    )
