"""Halation and scattering of film."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import MAX_HALF
from vkbloom._methods.gaussian_sum import GaussianSum, gaussian
from vkbloom._public import public
from vkbloom._settings.fields import choice_field, number_field, numbers_field, value_field
from vkbloom._settings.settings import Composite

Channels = tuple[float, float, float]
Size = tuple[int, int]

#: Micrometres along the longer side of a frame of film.
_FILM = 35000.0


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Halation(GaussianSum):
    """Halation of film, light that its base reflects, and the scattering in its layers.

    Parameters
    ----------
    strength : tuple of 3 floats
        Of the halation, for each channel: h of the share h / (1 + h), 0 to 65504.
    sizes : tuple of 3 floats
        Standard deviations of the halation in micrometres.
    scattering_strength, scattering_sizes : tuple of 3 floats
        The same of the scattering.
    pixel_size : float or None
        Micrometres. None: the longer side of the frame has 35,000.
    composite : {"mix"}
    intensity : float
        Share of the film's picture in ``final``, 0 to 1.
    **settings
        The other fields of `Settings`; there is no threshold and no knee.

    Notes
    -----
    With G a Gaussian, cut off at seven standard deviations, each channel a becomes
    (a + h G(a)) / (1 + h), first by the halation, then by the scattering. ``kernel`` is both.
    Beyond a border is the mirrored frame, whose outermost pixels are there twice.

    Source: andreavolpato/agx-emulsion @ 0e0baf2e3dd5, apply_halation_um.
    """

    method: ClassVar[str] = "halation"
    _knobs: ClassVar[tuple[str, ...]] = ("pixel_size",)
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType(
        {"bloom": "multiplies by the kernel's frequencies and transforms back to pixels"}
    )
    boundary: ClassVar[str] = "mirror"
    shaping: ClassVar[tuple[str, ...]] = (
        *("strength", "sizes", "scattering_strength", "scattering_sizes"),
        "pixel_size",
    )

    threshold: float | None = value_field(None, fixed="film has no threshold")
    composite: Composite = choice_field(("mix",))
    intensity: float = number_field(default=1.0, range=(0, 1))
    strength: Channels = numbers_field(
        (0.08, 0.005, 0.001), option="halation_strength", differentiable=False
    )
    sizes: Channels = numbers_field(
        (200.0, 200.0, 200.0), option="halation_sizes", differentiable=False
    )
    scattering_strength: Channels = numbers_field(
        (0.01, 0.02, 0.04), option="halation_scattering_strength", differentiable=False
    )
    scattering_sizes: Channels = numbers_field(
        (30.0, 20.0, 15.0), option="halation_scattering_sizes", differentiable=False
    )
    pixel_size: float | None = number_field(
        default=None, range=(0.01, MAX_HALF), slider=(1, 100), differentiable=False
    )

    def core_kernel_size(self, frame: Size, buffers: Size) -> Size:
        """Return the kernel's width and height, without the kernel.

        A mirrored line has a period of twice its length, to which a longer kernel is folded.
        """
        width, height = (
            min(2 * max(sum(map(_radius, pair)) for pair in deviations) + 1, 2 * buffers[axis])
            for axis, deviations in enumerate(self._deviations(frame, buffers))
        )
        return width, height

    def _deviations(self, frame: Size, buffers: Size) -> list[list[tuple[float, float]]]:
        """Return those of halation and scattering in pixels, by axis and channel."""
        pixel = self.pixel_size or _FILM / max(frame)
        scales = [side / of / pixel for side, of in zip(buffers, frame, strict=True)]
        pairs = [*zip(self.sizes, self.scattering_sizes, strict=True)]
        return [[(scale * first, scale * other) for first, other in pairs] for scale in scales]

    def _kernel(self, frame: Size, buffers: Size) -> NDArray[np.float64]:
        sides = zip(
            self._deviations(frame, buffers), self.core_kernel_size(frame, buffers), strict=True
        )
        x, y = ([_lines(*pair, length) for pair in deviations] for deviations, length in sides)
        planes = []
        for channel, pair in enumerate(zip(self.strength, self.scattering_strength, strict=True)):
            shares = np.array([1, pair[0], pair[1], pair[0] * pair[1]])
            planes.append((y[channel] * shares[:, np.newaxis]).T @ x[channel] / shares.sum())
        return np.stack(planes, axis=2)

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        return {"strength": None, "boundary": self.boundary}


def _radius(deviation: float) -> int:
    return int(7 * deviation + 0.5)


def _lines(inner: float, outer: float, length: int) -> NDArray[np.float64]:
    """Return a point, both Gaussians, and one after the other, folded to a length."""
    first, second = (gaussian(deviation, _radius(deviation)) for deviation in (inner, outer))
    lines = np.zeros((4, length))
    for line, kernel in zip(
        lines, (np.ones(1), first, second, np.convolve(first, second)), strict=True
    ):
        indices = np.arange(len(kernel)) - len(kernel) // 2 + length // 2
        np.add.at(line, indices % length, kernel)
    return lines
