"""Point-spread functions of lenses, and the Gaussian."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike

from vkbloom._numbers import check_size
from vkbloom._psf.base import PSF, Array, check_radii, in_grey, seen_in_grey
from vkbloom._psf.radial import RadialPSF, bessel, integrate_pixels
from vkbloom._public import public
from vkbloom._settings.fields import number_field


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class gaussian(PSF):
    """A Gaussian, defined in pixels.

    Parameters
    ----------
    sigma : float
        Standard deviation in pixels, above 0.

    Notes
    -----
    The density is exp(-r^2 / (2 sigma^2)) / (2 pi sigma^2). It is integrated over the pixels. The
    encircled energy is 1 - exp(-r^2 / (2 sigma^2)), and the MTF exp(-2 (pi sigma f)^2).
    """

    unit = "pixel"

    sigma: float = number_field(range=(0, math.inf), unit="pixel", slider=(0.1, 64))

    def _in_larger_pixels(self, factor: float) -> PSF:
        return dataclasses.replace(self, sigma=self.sigma / factor)

    def array(self, size: tuple[int, int], pixels_per_degree: float | None = None) -> Array:
        columns, rows = (self._shares(side) for side in check_size("size", size))
        return in_grey(np.outer(rows, columns))

    def _shares(self, side: int) -> Array:
        """Return the integral over each pixel of a line."""
        edges = np.arange(side + 1) - side // 2 - 0.5
        # Differences of the complementary error function keep the precision of small values.
        tails = np.array([math.erfc(abs(edge) / (self.sigma * math.sqrt(2))) / 2 for edge in edges])
        shares = np.abs(np.diff(tails))
        shares[side // 2] = 1 - tails[side // 2] - tails[side // 2 + 1]
        return shares

    def energy(self) -> Array:
        return np.ones(3)

    def encircled_energy(self, radii: ArrayLike) -> Array:
        return in_grey(-np.expm1(-0.5 * (check_radii("radii", radii) / self.sigma) ** 2))

    def mtf(self, frequencies: ArrayLike) -> Array:
        cycles = check_radii("frequencies", frequencies)
        return in_grey(np.exp(-2 * (math.pi * self.sigma * cycles) ** 2))


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class airy(PSF):
    """Diffraction of a circular aperture at one wavelength, defined in pixels.

    Parameters
    ----------
    f_number : float
        Focal length divided by the aperture's diameter, above 0.
    wavelength : float
        In nm, above 0.
    pixel_pitch : float
        Distance of the pixels on the sensor in um, above 0.

    Notes
    -----
    With x = pi r / (wavelength f_number), the density is (2 J1(x) / x)^2 divided by its integral.
    The encircled energy is 1 - J0(x)^2 - J1(x)^2. With v = f wavelength f_number, the MTF is
    2 / pi (arccos v - v sqrt(1 - v^2)) for v up to 1, and 0 above.

    Source: Born and Wolf, "Principles of Optics", 8.5.2.
    """

    unit = "pixel"

    f_number: float = number_field(default=8.0, range=(0, math.inf), slider=(1, 64))
    wavelength: float = number_field(
        default=550.0, range=(0, math.inf), unit="nm", slider=(380, 780)
    )
    pixel_pitch: float = number_field(default=4.0, range=(0, math.inf), unit="um", slider=(1, 20))

    @property
    def _scale(self) -> float:
        """Wavelength times f-number in pixels."""
        return self.wavelength * self.f_number / (1000 * self.pixel_pitch)

    def _in_larger_pixels(self, factor: float) -> PSF:
        return dataclasses.replace(self, pixel_pitch=self.pixel_pitch * factor)

    def array(self, size: tuple[int, int], pixels_per_degree: float | None = None) -> Array:
        peak = math.pi / (4 * self._scale**2)

        def per_pixel(distance: Array) -> Array:
            # At 0 the limit of 2 J1(x) / x is 1.
            x = np.maximum(np.pi * distance / self._scale, 1e-9)
            return np.asarray(peak * (2 * bessel(1, x) / x) ** 2)[np.newaxis]

        return in_grey(integrate_pixels(per_pixel, size, self._scale)[..., 0])

    def energy(self) -> Array:
        return np.ones(3)

    def encircled_energy(self, radii: ArrayLike) -> Array:
        x = np.pi * check_radii("radii", radii) / self._scale
        return in_grey(1 - bessel(0, x) ** 2 - bessel(1, x) ** 2)

    def mtf(self, frequencies: ArrayLike) -> Array:
        v = np.minimum(check_radii("frequencies", frequencies) * self._scale, 1)
        return in_grey(2 / np.pi * (np.arccos(v) - v * np.sqrt(1 - v**2)))


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class harvey_shack(RadialPSF):
    """Veiling glare of a camera lens, which is the light that its surfaces scatter.

    Parameters
    ----------
    s : float
        Slope of the scatter, -10 to 0.
    b : float
        Scatter of one surface per steradian, at 0.01 rad from the specular direction, above 0.
    l : float
        Roll-off angle in rad, above 0.
    surfaces : int
        Number of surfaces, 1 to 1000.

    Notes
    -----
    With b0 = b (100 l)^s, the density is N b0 (1 + (sin theta / l)^2)^(s / 2) cos theta. It
    describes only the scattered share of the light, which is 2.5 % with the defaults. Use this
    share as the intensity of a mix.

    Source: Ritt, "Laser Safety Calculations for Imaging Sensors" and "Estimation of Lens Stray
    Light with Regard to the Incapacitation of Imaging Sensors", Sensors 20(21), 6308, 2020,
    https://doi.org/10.3390/s20216308.
    """

    s: float = number_field(default=-1.86, range=(-10, 0), slider=(-4, 0))
    b: float = number_field(default=0.36, range=(0, math.inf), slider=(0.01, 2))
    l: float = number_field(  # noqa: E741  as its source has it
        default=0.00204, range=(0, math.inf), unit="radian", slider=(0.0005, 0.02)
    )
    surfaces: int = number_field(default=14, range=(1, 1000), slider=(1, 50))

    def density(self, theta: ArrayLike) -> Array:
        angle = np.radians(np.asarray(theta, np.float64))
        peak = self.surfaces * self.b * (100 * self.l) ** self.s
        scatter = peak * (1 + (np.sin(angle) / self.l) ** 2) ** (self.s / 2)
        # cos(pi / 2) is not quite 0 in floats.
        return seen_in_grey(scatter * np.maximum(np.cos(angle), 0))
