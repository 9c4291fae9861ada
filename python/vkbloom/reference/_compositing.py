"""The last pass: scene and bloom to the final image."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._array_api import run_in_other_libraries
from vkbloom._arrays import check_dtype, view_image
from vkbloom._public import public
from vkbloom._settings.settings import Settings, resolve_settings

from . import _blending as blending
from ._blending import develop
from ._image import as_float, format_of, storage
from ._lookup import reference_of
from ._sampling import Array
from ._tape import join_curves
from ._tone_map import ENCODINGS


@public("vkbloom.reference")
@run_in_other_libraries("scene", "bloom", "share")
@check_arguments
def composite(
    scene: NDArray[Any],
    bloom: NDArray[Any] | None,
    settings: Settings | str,
    dtype: DTypeLike | None = None,
    *,
    share: float | Array = 1.0,
) -> Array:
    """Return the final image: composite, exposure, tone map, encoding, dither, in this order.

    With s the scene, b the bloom and i the intensity, "add" is s + i b, "mix" is s + (b - s) i, and
    "screen" is 1 - (1 - s)(1 - i b) with s and i b clamped to 0..1. The exposure e multiplies by
    2^e. `vkbloom.GodotBloom` has its own composites, with the exposure before them, and
    `vkbloom.BlenderGlare` has max(0, s) + i b. Dither rounds
    uint8 to floor(255 c + n) / 255, with c clamped to 0..1 and a noise n in 0..1. It does not
    change other types. All this applies to rgb. ``settings.alpha`` selects the result's alpha from
    the scene's alpha a: "keep" is a; "max" is max(a, clamp(max over rgb of i b, 0, 1)); "blur",
    with the bloom's alpha b_a, is 1 - (1 - a)(1 - clamp(i b_a, 0, 1)).

    If the bloom was made from only a share of the scene, "mix" is s + i (b - share s).

    A component of the scene that is NaN or infinite stays so. It counts as 0 in tone maps that mix
    the channels.

    Parameters
    ----------
    scene : ndarray, shape (H, W, 3) or (H, W, 4)
        uint8 (read as value / 255), float16, float32 or float64.
    bloom : ndarray, shape (H, W, 3) or (H, W, 4), or None
        Finite, of the same types. Not read if ``settings.bloom`` is off.
    settings : vkbloom.Settings or str
        Settings, or the name of a preset.
    dtype : dtype, optional
        Dtype of the final image; by default the scene's. The result is clamped to its range.
    share : float or ndarray, shape (H, W, 1)
        The share of the scene in the bloom's source: the mask, or 0 with an emission.

    Returns
    -------
    ndarray of float64, shape of the scene
        In real units. Only the dither rounds to `dtype`.

    Raises
    ------
    ValueError
        An image has another shape, or the sizes differ.
    """
    settings = resolve_settings(settings)
    image = as_float(scene, "scene", (3, 4))
    stored = view_image(scene, "scene").dtype if dtype is None else check_dtype("dtype", dtype)
    if not settings.bloom:
        return composite_without_store(image, None, settings, stored)
    if bloom is None:
        raise TypeError("bloom: None is not an array; settings.bloom is True")
    light = as_float(bloom, "bloom", (3, 4)) * strength_of(settings)
    if light.shape[:2] != image.shape[:2]:
        raise ValueError(
            f"bloom: height and width {light.shape[:2]} are not the scene's {image.shape[:2]}"
        )
    return composite_without_store(image, light, settings, stored, share)


def strength_of(settings: Settings) -> Any:
    """Return the factor of the bloom: the intensity, unless the method says more."""
    strength = _function_of("strength", settings)
    return settings.intensity if strength is None else strength(settings)


def slope_of(scene: Array, settings: Settings) -> float | Array:
    """Return the largest derivative of the composite by the light, before exposure and curve."""
    slope = _function_of("slope", settings)
    return 1.0 if slope is None else slope(scene, settings)


def _function_of(name: str, settings: Settings) -> Any:
    """Return a function of the method's module; None if there is none, as for custom methods."""
    try:
        module = reference_of(settings.method)
    except KeyError:
        return None
    return getattr(module, name, None)


def composite_without_store(
    image: Array,
    light: Array | None,
    settings: Settings,
    dtype: DTypeLike,
    share: float | Array = 1.0,
) -> Array:
    """Return the final image of a scene and light, both in real units; None: without bloom."""
    original, alpha = image[..., :3], image[..., 3:]
    rgb = np.where(np.isfinite(original), original, 0.0)
    if light is None:
        rgb = develop(rgb, settings)
    else:
        method = _function_of("composite", settings) or blending.composite
        rgb = method(rgb, light[..., :3], settings, share)
        alpha = _blend_alpha(alpha, light, settings.alpha)
    rgb = ENCODINGS[settings.encoding](rgb, settings.reference_white)
    stored = np.dtype(dtype)
    store = storage(format_of(np.empty(0, stored), None))
    rgb = store(rgb)
    if settings.dither and stored == np.uint8:
        rgb = np.floor(255 * rgb + _noise(rgb.shape[:2], settings.dither_seed)) / 255
    result = np.concatenate([rgb, store(alpha)], axis=-1)
    kept: Array = np.where(np.isfinite(image), result, image)
    return kept


def _blend_alpha(alpha: Array, light: Array, mode: str) -> Array:
    """Return the alpha of the final image, (H, W, 1); (H, W, 0) if the scene has none."""
    if mode == "max":
        largest = np.clip(light[..., :3].max(axis=-1, keepdims=True), 0, 1)
        # The maximum, of which light that is 0 at an alpha of 0 has the side of its clamp.
        larger: Array = join_curves(largest - alpha, 0.0, alpha, largest)
        return larger
    if mode == "blur":
        if light.shape[2] == 3:
            raise ValueError('bloom: 3 channels are not the 4 that settings.alpha "blur" needs')
        return 1 - (1 - alpha) * (1 - np.clip(light[..., 3:], 0, 1))
    return alpha


def _noise(size: tuple[int, int], seed: int) -> Array:
    """Return the noise of an image of (height, width): (n + 1/2) / 4096, n in 0..4095.

    For each channel, n is the upper 12 bits of one of the three 32-bit numbers that pcg3d computes
    from column, row and seed (Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3),
    2020).
    """
    rows, columns = np.indices(size, np.uint32)
    state = [columns, rows, np.full(size, seed, np.uint32)]
    state = [np.uint32(1664525) * number + np.uint32(1013904223) for number in state]
    for mixing in range(2):
        for channel in range(3):
            state[channel] = state[channel] + state[channel - 2] * state[channel - 1]
        if mixing == 0:
            state = [number ^ (number >> np.uint32(16)) for number in state]
    return (np.stack(state, axis=-1) // np.uint32(2**20) + 0.5) / 4096
