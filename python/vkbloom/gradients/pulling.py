"""The framebuffers of an image, and the function that takes cotangents back."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import check_emission, check_image, check_mask
from vkbloom.core_access import HasCore
from vkbloom.frames import Frames
from vkbloom.gradients.passes import DeviceGradients, Passes
from vkbloom.image import Image
from vkbloom.reference import vjp as reference_vjp
from vkbloom.reference.derivatives import Gradients, check_cotangents, differentiable
from vkbloom.settings import Settings

__all__ = ["Pullback", "checked_inputs", "pullback_of", "vjp"]

#: From cotangents by framebuffer to derivatives by name.
Pullback = Callable[[Mapping[str, NDArray[Any]]], Gradients]


class _Renderer(HasCore, Protocol):
    @property
    def apply(self) -> Callable[..., Frames]: ...


def vjp(
    renderer: _Renderer,
    image: object,
    settings: Settings,
    mask: object | None,
    emission: object | None,
) -> tuple[Frames, Pullback]:
    """Return the framebuffers of `Renderer.apply` in buffers of floats, and their pullback.

    The arrays are copied, since they may change before the pullback is called.
    """
    if isinstance(image, Image):
        raise ValueError("image: derivatives need the pixels; give the array, not the uploaded one")
    if hasattr(settings, "twin"):
        raise ValueError(
            f"method: {settings.method!r} has no derivative, since its passes come from a file"
        )
    pixels, given = checked_inputs(image, mask, emission)
    pixels, given = pixels.copy(), {name: part.copy() for name, part in given.items()}
    frames = renderer.apply(pixels, settings.replace(format="rgba32float"), **given)
    pulled = pullback_of(renderer, pixels, settings, given)

    def pullback(cotangents: Mapping[str, NDArray[Any]]) -> Gradients:
        return pulled(check_cotangents(cotangents, frames))

    return frames, pullback


def checked_inputs(
    image: object, mask: object | None, emission: object | None
) -> tuple[NDArray[Any], dict[str, NDArray[Any]]]:
    """Return the image, and mask and emission by name where they are given."""
    pixels = check_image(image)
    given: dict[str, NDArray[Any]] = {}
    if mask is not None:
        given["mask"] = check_mask(mask, (pixels.shape[0], pixels.shape[1]))
    if emission is not None:
        given["emission"] = check_emission(emission, pixels)
    return pixels, given


def pullback_of(
    renderer: HasCore,
    pixels: NDArray[Any],
    settings: Settings,
    given: Mapping[str, NDArray[Any]],
) -> Pullback:
    """Return the pullback alone, of checked arrays that do not change, and checked cotangents."""
    floats = settings.replace(format="rgba32float")
    recorded = functools.cache(lambda: reference_vjp(pixels, settings, **given)[1])
    names = ("image", *sorted(given), *differentiable(settings))
    if callable(getattr(settings, "kernel", None)):
        names += ("kernel",)

    def by_reference(cotangents: Mapping[str, NDArray[Any]]) -> Gradients:
        found = recorded()(cotangents)
        return Gradients((name, part.astype(np.float32)) for name, part in found.items())

    def pullback(cotangents: Mapping[str, NDArray[Any]]) -> Gradients:
        passes = Passes(renderer, pixels, floats, given, cotangents)
        found = passes.images()
        if found is None:
            return by_reference(cotangents)
        return DeviceGradients(found, names, passes.fields, lambda: by_reference(cotangents))

    return pullback
