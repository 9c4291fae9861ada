"""Derivatives of the framebuffers, in float64."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._arrays import plain_array
from vkbloom._public import public
from vkbloom._settings.fields import fields_of
from vkbloom._settings.settings import Settings, resolve_settings

from ._framebuffers import check_scene, framebuffers
from ._sampling import Array
from ._tape import Traced, gradients, value_of


class Gradients(dict[str, Array]):
    """Derivatives by name. A name without a derivative raises ValueError."""

    def __missing__(self, name: str) -> Array:
        check_known(name, self)
        raise KeyError(name)


def check_known(name: str, names: Collection[str]) -> None:
    """Raise ValueError for a name without a derivative."""
    if name not in names:
        raise ValueError(f"gradients: {name!r} has no derivative; available: {', '.join(names)}")


@public("vkbloom.reference")
@check_arguments
def vjp(
    image: NDArray[Any],
    settings: Settings | str,
    *,
    mask: NDArray[Any] | None = None,
    emission: NDArray[Any] | None = None,
) -> tuple[dict[str, Array], Callable[[Mapping[str, NDArray[Any]]], Gradients]]:
    """Return the framebuffers, and a function for the derivatives of a sum over them.

    The bloom buffers are "rgba32float", so that stores do not clamp. Rounding to 8 bits and dither
    count as the identity.

    Where the function has a kink, such as an end of a clamp, a threshold that is subtracted, or the
    offset of a tap that lies on a texel centre, the subgradient is the mean of both sides. Equal
    channels have equal shares of a maximum. A hard threshold has the derivative of what it keeps:
    its own derivative is 0.

    Parameters
    ----------
    image : ndarray, shape (H, W, 3) or (H, W, 4)
        As for `apply`.
    settings : vkbloom.Settings or str
        Settings, or the name of a preset.
    mask : ndarray, shape (H, W), optional
    emission : ndarray, optional
        Of the image's shape and dtype.

    Returns
    -------
    framebuffers : dict of str to ndarray of float64
        As of `apply`, with buffers of "rgba32float".
    pullback : callable
        ``pullback(cotangents)`` takes arrays by framebuffer, of their shapes. With S the sum over
        all framebuffers of (framebuffer . cotangent), it returns the derivatives of S: by "image",
        "mask" (H, W) and "emission" if they were given, by "kernel" (of `vkbloom.Convolution`), and
        by each real field under its name. Fields of glare have names such as "glare.0.intensity",
        the weights of a `vkbloom.psf.Varying` "psf.weights". Values are derivatives by real units:
        for uint8, by value / 255. At NaN and infinity of the image they are 0. Any other name, such
        as that of an integer field, raises ValueError.

    Raises
    ------
    TypeError, ValueError
        As for `apply`. The method was loaded from a file of passes, which has no derivative. From
        `pullback`: there is no such framebuffer, or a cotangent has another shape, is not of real
        numbers, or is not finite.

    Notes
    -----
    The formulas of the reference run on arrays that record each operation with its derivative; the
    records are applied in reverse order (Griewank and Walther, "Evaluating Derivatives", 2008).
    """
    settings = resolve_settings(settings)
    if hasattr(settings, "numpy_reference"):
        raise ValueError(
            f"method: {settings.method!r} has no derivative, since its passes come from a file"
        )
    scene, source, weights, _ = check_scene(image, settings, mask, emission)
    inputs: dict[str, Traced] = {"image": Traced(scene)}
    if emission is not None:
        inputs["emission"] = Traced(source)
    if weights is not None:
        inputs["mask"] = Traced(weights)
    traced: Any = _TracedSettings(settings, inputs)
    images: dict[str, Any] = {**inputs}
    results_by_name: dict[str, Any] = framebuffers(
        images["image"],
        images.get("emission", images["image"]),
        traced,
        mask=images.get("mask"),
        format="rgba32float",
        dtype=np.asarray(image).dtype,
    )
    values: dict[str, Array] = {name: value_of(part) for name, part in results_by_name.items()}

    def pullback(cotangents: Mapping[str, NDArray[Any]]) -> Gradients:
        given = check_cotangents(cotangents, values)
        pairs = [(results_by_name[name], part) for name, part in given.items()]
        traced_pairs = [pair for pair in pairs if isinstance(pair[0], Traced)]
        derivatives = gradients(traced_pairs, [*inputs.values()])
        results = Gradients(zip(inputs, derivatives, strict=True))
        for name, pixels in (("image", scene), ("emission", source)):
            if name in results:
                results[name] = np.where(np.isfinite(pixels), results[name], 0.0)
        if "mask" in results:
            results["mask"] = results["mask"][..., 0]
        known = differentiable(settings)
        if "psf.weights" in known:
            results["psf.weights"] = traced.by_weights(results, known["psf.weights"].shape)
        return results

    given = {"image": image, "mask": mask, "emission": emission}
    arrays = {name: np.array(part) for name, part in given.items() if part is not None}
    return values, RecordedPullback(pullback, arrays, settings)


class RecordedPullback:
    """The pullback of `vjp`, which never changes. What is pickled is recorded anew."""

    def __init__(
        self,
        pullback: Callable[[Mapping[str, NDArray[Any]]], Gradients],
        arrays: dict[str, Array],
        settings: Settings,
    ) -> None:
        self._pullback, self._arrays, self._settings = pullback, arrays, settings

    def __call__(self, cotangents: Mapping[str, NDArray[Any]]) -> Gradients:
        return self._pullback(cotangents)

    def __reduce__(self) -> tuple[Any, ...]:
        return _record, (self._arrays, self._settings)

    def __copy__(self) -> RecordedPullback:
        return self

    def __deepcopy__(self, memo: object) -> RecordedPullback:
        return self


def _record(arrays: dict[str, Array], settings: Settings) -> Any:
    """Return the pullback of arrays by name; for pickle."""
    return vjp(settings=settings, **arrays)[1]


def differentiable(settings: Any) -> dict[str, Any]:
    """Return the values of the real fields with a derivative, by name."""
    fields = {
        name: getattr(settings, name)
        for name, info in fields_of(type(settings)).items()
        if info.differentiable and not info.fixed and _is_real(getattr(settings, name))
    }
    weights = getattr(getattr(settings, "psf", None), "weights", None)
    if weights is not None:
        fields["psf.weights"] = weights.array
    for index, stage in enumerate(getattr(settings, "glare", ())):
        fields |= {f"glare.{index}.{name}": value for name, value in differentiable(stage).items()}
    return fields


def is_unset(settings: Any, name: str) -> bool:
    """Whether a field is None that has a derivative at other values."""
    info = fields_of(type(settings)).get(name)
    return (
        info is not None
        and info.kind in ("number", "numbers")
        and getattr(settings, name) is None
        and info.differentiable
        and not info.fixed
    )


def _is_real(value: Any) -> bool:
    """Whether a value is a float, or a tuple of such or of tuples of them, all of one length."""
    if isinstance(value, tuple) and value:
        return all(map(_is_real, value)) and len({np.shape(item) for item in value}) == 1
    return isinstance(value, float)


class _TracedSettings:
    """Settings whose real fields are traced; every other attribute is that of the settings."""

    def __init__(self, settings: Any, inputs: dict[str, Traced], prefix: str = "") -> None:
        self._settings = settings
        self.dither = False
        fields = differentiable(settings)
        for name in (name for name in fields if "." not in name):
            inputs[prefix + name] = Traced(fields[name])
            setattr(self, name, inputs[prefix + name])
        if stages := getattr(settings, "glare", ()):
            self.glare = tuple(
                _TracedSettings(stage, inputs, f"glare.{index}.")
                for index, stage in enumerate(stages)
            )
        if callable(getattr(settings, "kernel", None)):
            self._inputs = inputs
            self.kernel = self._kernel

    def _kernel(self, *sizes: tuple[int, int]) -> Traced:
        self._sizes = sizes
        self._inputs["kernel"] = Traced(self._settings.kernel(*sizes))
        return self._inputs["kernel"]

    def by_weights(self, derivatives: Mapping[str, Array], shape: tuple[int, ...]) -> Array:
        """Return derivatives by the weights of a field from those by the kernels of its grid."""
        if "kernel" not in derivatives:
            return np.zeros(shape)
        kernels = np.array(self._settings._component_kernels(*self._sizes))
        made: Array = np.einsum("jihwc,khwc->kji", derivatives["kernel"], kernels, optimize=True)
        return made

    def __getattr__(self, name: str) -> Any:
        return getattr(self._settings, name)


def check_cotangents(
    cotangents: Mapping[str, NDArray[Any]], values: Mapping[str, Any]
) -> dict[str, Array]:
    """Check and return cotangents in float64; `values` are the framebuffers."""
    if not isinstance(cotangents, Mapping):
        raise TypeError(
            f"cotangents: {type(cotangents).__name__} is not a mapping of framebuffer to array; "
            'give {"final": array}'
        )
    return {name: _check_cotangent(name, part, values) for name, part in cotangents.items()}


def check_shape(name: str, shape: tuple[int, ...], values: Mapping[str, Any]) -> None:
    """Raise ValueError unless a framebuffer has the cotangent's shape."""
    if name not in values:
        known = ", ".join(values)
        raise ValueError(f"cotangents: unknown framebuffer {name!r}; available: {known}")
    if shape != values[name].shape:
        raise ValueError(f"cotangents: the shape of {name!r} is {shape}, not {values[name].shape}")


def _check_cotangent(name: str, cotangent: NDArray[Any], values: Mapping[str, Any]) -> Array:
    given = plain_array(cotangent, f"cotangents: {name!r}")
    check_shape(name, given.shape, values)
    if given.dtype.kind not in "fiub":
        raise TypeError(f"cotangents: {name!r} is of dtype {given.dtype}, not of real numbers")
    array = given.astype(np.float64)
    if not np.isfinite(array).all():
        raise ValueError(f"cotangents: {name!r} has NaN or infinity")
    return array
