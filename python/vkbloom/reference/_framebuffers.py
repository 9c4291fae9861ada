"""The framebuffers of every bloom method, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._array_api import run_in_other_libraries
from vkbloom._arrays import native_order, view_image
from vkbloom._image_arguments import check_emission, check_mask
from vkbloom._public import public
from vkbloom._settings.antialiasing import Antialiasing, check_antialiasing, check_use
from vkbloom._settings.exposure import Exposure, check_exposure
from vkbloom._settings.settings import Settings, resolve_settings

from . import _custom as custom
from . import _glare as glare
from ._antialiasing import Resolving
from ._compositing import composite_without_store, strength_of
from ._exposure import Exposing
from ._image import BlurInput, as_float, finite, format_of, storage
from ._lookup import Reference, reference_of
from ._sampling import Array, sample, scale_size, size_of
from ._threshold import apply_mask, apply_threshold


@public("vkbloom.reference")
@run_in_other_libraries("image", "mask", "emission")
@check_arguments
def apply(
    image: NDArray[Any],
    settings: Settings | str,
    *,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
    exposure: Exposure | str | None = None,
    taa: Antialiasing | str | None = None,
    dt: float | None = None,
    motion: NDArray[Any] | None = None,
    depth: NDArray[Any] | None = None,
    state: Mapping[str, Any] | None = None,
) -> dict[str, Array]:
    """Return what `vkbloom.Renderer.apply` returns, computed in float64.

    The image is reduced to the size of the bloom buffers by bilinear sampling at their pixel
    centres, thresholded, blurred and composited. Components that are NaN or infinite count as
    0 in the bloom and stay as they are in "final".

    An emission replaces the image up to the composite. A mask is reduced like the image and
    multiplies the thresholded image. Published methods apply their threshold while they downsample;
    they read the mask at the pixel centres of the image that this pass writes. With
    ``settings.alpha`` "blur", alpha is a fourth channel: the weights follow from rgb, and limits of
    colours (such as a clamp against overflow) do not apply to alpha.

    Every store to a bloom buffer clamps: to 0..1 in "rgba8unorm", to +-65504 in "rgba16float". Only
    "rg11b10ufloat" and "rgba8unorm-srgb" also round to the steps of the format. Published methods
    do not round their "bloom" to these, nor their "glow" to the former.

    Parameters
    ----------
    image : ndarray, shape (H, W, 3) or (H, W, 4)
        uint8 (read as value / 255), float16, float32 or float64. The format of the bloom
        buffers follows from it unless ``settings.format`` names one; that of float64 is
        "rgba32float". An array of another library (the extra `arrays`), as also mask and emission,
        gives framebuffers of that library on its device, with its derivatives.
    settings : vkbloom.Settings or str
        Settings, or the name of a preset.
    mask : ndarray, shape (H, W), optional
        uint8 (read as value / 255), bool, or floats in 0..1.
    emission : ndarray, optional
        Of the image's shape and dtype.
    exposure : Exposure or str, optional
        An exposure, or the name of one of `vkbloom.exposures`: the formulas of `expose`.
    taa : Antialiasing or str, optional
        Temporal anti-aliasing, or the name of one of `vkbloom.antialiasing`.
    dt
        As for `expose`; None is 1/60 s.
    motion : ndarray, shape (H, W, 2), optional
        As for `vkbloom.Renderer.apply`; None: 0.
    depth : ndarray, shape (H, W), optional
        As for `vkbloom.Renderer.apply`; None: each pixel has its own motion.
    state : mapping of str to ndarray, optional
        The result of the frame before. Only its "exposure", "history" and "history_motion" are
        read. None: the first frame.

    Returns
    -------
    dict of str to ndarray of float64
        In the order of the data flow: "glow", those of the stages of glare, those of `passes`, then
        "final". The values are in real units: 0..1 for unorm formats. Bloom buffers have 4
        channels. Their alpha is 1, except with ``settings.alpha`` "blur". "final" has the image's
        channels. With ``settings.bloom`` off there is only "final".

    Raises
    ------
    ValueError
        The image has another shape; the mask another size or other values; the emission another
        shape or dtype; or ``settings.alpha`` is "max" or "blur" and there is no alpha.
    """
    settings = resolve_settings(settings)
    scene, source, weights, format = check_scene(image, settings, mask, emission)
    dtype = view_image(image, "image").dtype

    def bloom(
        scene: Array, source: Array, settings: Settings, dtype: DTypeLike
    ) -> dict[str, Array]:
        if (function := getattr(settings, "numpy_reference", None)) is None:
            return framebuffers(scene, source, settings, mask=weights, format=format, dtype=dtype)
        _, seen = _first_buffer(source, settings, weights, format)
        stages = _with_alphas(glare.stages(seen, settings.glare, format))
        return custom.framebuffers(function, scene, settings, np.dtype(dtype), stages)

    check_use(taa, motion=motion, depth=depth)
    stages = _Stages(
        None if exposure is None else Exposing(check_exposure(exposure), dt, state),
        None if taa is None else Resolving(check_antialiasing(taa), motion, depth, state),
        {},
    )
    return stages.run(bloom, (scene, source), settings, dtype)


class _Stages(NamedTuple):
    """The stages in time around a bloom, and the framebuffers before it."""

    exposing: Exposing | None
    resolving: Resolving | None
    first: dict[str, Array]

    def run(
        self,
        bloom: Callable[[Array, Array, Settings, DTypeLike], dict[str, Array]],
        images: tuple[Array, Array],
        settings: Settings,
        dtype: DTypeLike,
    ) -> dict[str, Array]:
        """Return the framebuffers of the bloom and of the stages."""
        exposing, resolving = self.exposing, self.resolving
        is_first = exposing is not None and exposing.exposure._is_before_taa
        images = self._expose(images) if is_first else images
        images = self._resolve(images)
        images = images if is_first else self._expose(images)
        resolves = resolving is not None and resolving.antialiasing.order == "after"
        exposes = exposing is not None and exposing.exposure._exposes_picture
        if not resolves and not exposes:
            return self.first | bloom(*images, settings, dtype)
        plain = settings.replace(exposure=0.0, tonemap="none", encoding="none", dither=False)
        results = self.first | bloom(*images, plain, np.float64)
        picture = results.pop("final")
        if resolving is not None and resolves:
            picture, kept = resolving.resolve(picture)
            results |= kept | {"resolved": picture}
        if exposing is not None and exposes:
            if exposing.exposure._meters_bloom:
                results |= exposing.adapt(picture)
            picture = exposing.multiply(picture, exposing.adapted.after)
        results["final"] = composite_without_store(picture, None, settings, dtype)
        return results

    def _resolve(self, images: tuple[Array, Array]) -> tuple[Array, Array]:
        """Return the scene resolved; an emission stays as it is."""
        scene, source = images
        if self.resolving is None or self.resolving.antialiasing.order == "after":
            return images
        resolved, kept = self.resolving.resolve(scene)
        self.first.update(kept | {"resolved": resolved})
        return resolved, resolved if source is scene else source

    def _expose(self, images: tuple[Array, Array]) -> tuple[Array, Array]:
        """Return scene and source of the bloom, exposed if the engine does so before the bloom."""
        scene, source = images
        if self.exposing is None or self.exposing.exposure._meters_bloom:
            return images
        self.first.update(self.exposing.adapt(scene))
        if not self.exposing.exposure._exposes_bloom:
            return images
        before = self.exposing.adapted.before
        exposed = self.first["exposed"] = self.exposing.multiply(scene, before)
        return exposed, exposed if source is scene else self.exposing.multiply(source, before)


def check_scene(
    image: NDArray[Any],
    settings: Settings,
    mask: NDArray[Any] | None,
    emission: NDArray[Any] | None,
) -> tuple[Array, Array, Array | None, str]:
    """Return scene, source of the bloom and mask in real units, and the bloom buffers' format."""
    if getattr(settings, "numpy_reference", None) is None:
        _method(settings)
    scene = as_float(image, "image", (3, 4))
    format = format_of(image, settings.format)
    if settings.alpha != "keep" and (scene.shape[2] == 3 or not storage(format).has_alpha):
        raise ValueError(f'alpha: {settings.alpha!r} is not "keep"; there is no fourth channel')
    source = scene
    if emission is not None:
        source = as_float(emission, "emission", (3, 4))
        given = (view_image(emission, "emission"), view_image(image, "image"))
        native = (part if part.dtype.isnative else native_order(part) for part in given)
        check_emission(*native)
    return scene, source, _weights(mask, size_of(scene)), format


def framebuffers(
    scene: Array,
    source: Array,
    settings: Settings,
    *,
    mask: Array | None,
    format: str,
    dtype: DTypeLike,
) -> dict[str, Array]:
    """Return the framebuffers of `apply`; without an emission, `source` is `scene`."""
    method = _method(settings)
    if not settings.bloom:
        return {"final": composite_without_store(scene, None, settings, dtype)}
    glow, seen = _first_buffer(source, settings, mask, format)
    given = BlurInput(glow, size_of(scene), storage(format), mask)
    blurred = method.passes(given, settings)
    stages = glare.stages(seen, settings.glare, format)
    results = _with_alphas({"glow": glow, **stages, **blurred})
    strength = strength_of(settings)
    if settings.glare:
        images = [results[name] for name in stages]
        light = glare.light(results["bloom"], strength, images, settings.glare)
    else:
        light = results["bloom"] * strength
    # The share of the scene that is the source of the bloom.
    share = 0.0 if source is not scene else 1.0 if mask is None else mask
    results["final"] = composite_without_store(scene, light, settings, dtype, share)
    return results


def _first_buffer(
    source: Array, settings: Settings, mask: Array | None, format: str
) -> tuple[Array, Array]:
    """Return the glow, and what the stages of glare read."""
    store = storage(format)
    channels = 4 if settings.alpha == "blur" else 3

    def threshold_light(colours: Array) -> Array:
        return apply_mask(apply_threshold(colours, settings.threshold, settings.knee), mask)

    buffers = settings.bloom_size or scale_size(size_of(source), settings.bloom_scale)
    reduced = sample(finite(source[..., :channels]), buffers)
    if settings.published:
        glow: Array = store.first(reduced)
        return glow, threshold_light(glow)
    glow = store(threshold_light(reduced))
    return glow, glow


@public("vkbloom.reference")
@run_in_other_libraries("glow", "mask")
@check_arguments
def passes(
    glow: NDArray[Any],
    settings: Settings | str,
    size: tuple[int, int] | None = None,
    format: str | None = None,
    *,
    mask: NDArray[Any] | None = None,
) -> dict[str, Array]:
    """Return the framebuffers of the blur of a glow, without threshold and composite.

    Parameters
    ----------
    glow : ndarray, shape (H, W, C)
        The content of the first bloom buffer, at its size: uint8 (read as value / 255), float16,
        float32 or float64. A fourth channel is alpha; it becomes 1, except with ``settings.alpha``
        "blur". All other channels are blurred separately. NaN and infinity count as 0.
    settings : vkbloom.Settings or str
        Settings, or the name of a preset. Only the fields of the blur and `format` are used.
    size : (int, int), optional
        Width and height of the final image, at whose pixels the last pass is evaluated; by default
        those of the glow.
    format : str, optional
        Format of the bloom buffers; by default that of the settings, and if this is None, the one
        of the glow's dtype.
    mask : ndarray, shape (height, width), optional
        Multiplies the thresholded image of a published method, as in `apply`. For other methods the
        glow is already thresholded and masked.

    Returns
    -------
    dict of str to ndarray of float64
        In the order of the data flow: "blur_vertical" (`Separable` without ``direct``), or
        "down_0" to "down_N-1" and "up_N-2" to "up_0", then "bloom".

    Raises
    ------
    ValueError
        The glow has another shape, the size is below 1, or the format is unknown.
    """
    settings = resolve_settings(settings)
    method = _method(settings)
    values = finite(as_float(glow, "glow"))
    channels = values.shape[2]
    if size is not None and min(size) < 1:
        raise ValueError(f"size: {size} is not (width, height) of at least 1")
    store = storage(format_of(glow, settings.format if format is None else format))
    has_alpha = channels == 4 and settings.alpha != "blur"
    colours = values[..., :3] if has_alpha else values
    colours = store.first(colours) if settings.published else store(colours)
    size = size or size_of(values)
    weights = _weights(mask, size)
    given = BlurInput(colours, size, store, weights if settings.published else None)
    framebuffers: dict[str, Array] = method.passes(given, settings)
    return _with_alphas(framebuffers) if has_alpha else framebuffers


@public("vkbloom.reference")
@run_in_other_libraries("glow")
@check_arguments
def blur(
    glow: NDArray[Any],
    settings: Settings | str,
    size: tuple[int, int] | None = None,
    format: str | None = None,
) -> Array:
    """Return the bloom of a glow, without threshold and composite.

    Parameters
    ----------
    glow, settings, size, format
        As for `passes`.

    Returns
    -------
    ndarray of float64, shape (height, width, C)
        "bloom" of `passes`.
    """
    return passes(glow, settings, size, format)["bloom"]


@public("vkbloom.reference")
@check_arguments
def gain(settings: Settings | str, size: tuple[int, int] = (1280, 720)) -> Any:
    """Return the bloom of a flat image of 1, without clamps and before the intensity.

    Parameters
    ----------
    settings : vkbloom.Settings or str
        Settings, or the name of a preset. Their threshold is applied to the flat image of 1.
    size : (int, int), optional
        Width and height of the image. It matters for `vkbloom.KinoBloom`, which has more levels for
        higher images, and in the eighth digit for `vkbloom.UrpBloom`.

    Returns
    -------
    float, or ndarray of float64, shape (3,)
        For `vkbloom.Convolution` one number for each channel, without the effect of the boundary.
    """
    settings = resolve_settings(settings)
    method = _method(settings)
    threshold = None if settings.published else settings.threshold
    glow = float(apply_threshold(np.ones((1, 1, 3)), threshold, settings.knee)[0, 0, 0])
    return glow * method.gain(settings, size)


def _method(settings: Settings) -> Reference:
    try:
        return reference_of(settings.method)
    except KeyError:
        raise ValueError(
            f"method: {settings.method!r} has no reference in NumPy; give one when it is loaded, "
            "load_method(file, reference=function)"
        ) from None


def _weights(mask: NDArray[Any] | None, size: tuple[int, int]) -> Array | None:
    """Return a mask as values of 0 to 1, (H, W, 1)."""
    return None if mask is None else check_mask(mask, size[::-1], np.float64)[..., np.newaxis]


def _with_alphas(framebuffers: dict[str, Array]) -> dict[str, Array]:
    """Return the images with a fourth channel, by default of 1; a kernel has three."""
    return {
        name: part
        if name == "kernel" or part.shape[2] == 4
        else np.concatenate([part, np.ones((*part.shape[:2], 1))], axis=-1)
        for name, part in framebuffers.items()
    }
