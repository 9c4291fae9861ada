"""Glare of the human eye."""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from vkbloom._psf.base import Array, seen_in_grey
from vkbloom._psf.radial import RadialPSF
from vkbloom._public import public
from vkbloom._settings.fields import number_field, numbers_field

State = Literal["photopic", "mesopic", "scotopic"]

# Shares of f0, f1, f2 and f3.
_SHARES: dict[str, tuple[float, float, float, float]] = {
    "photopic": (0.384, 0.478, 0.138, 0.0),
    "mesopic": (0.368, 0.478, 0.138, 0.016),
    "scotopic": (0.282, 0.478, 0.207, 0.033),
}


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class spencer(RadialPSF):
    """Glare of the eye by day, at dusk and at night, by Spencer et al.

    Parameters
    ----------
    state : {"photopic", "mesopic", "scotopic"}
        Adaptation of the eye: to daylight, to dusk, to night.
    wavelengths : (float, float, float)
        Wavelengths of red, green and blue in nm, 380 to 780. They determine the halo of the lens,
        which "mesopic" and "scotopic" have.

    Notes
    -----
    With theta in degrees, f0 = 2.61e6 exp(-(theta / 0.02)^2), f1 = 20.91 / (theta + 0.02)^3,
    f2 = 72.37 / (theta + 0.02)^2 and, for the wavelength w in nm,
    f3 = 436.9 (568 / w) exp(-19.75 (theta - 3 w / 568)^2). The energy of each term is 1. The
    density is

        0.384 f0 + 0.478 f1 + 0.138 f2              photopic
        0.368 f0 + 0.478 f1 + 0.138 f2 + 0.016 f3   mesopic
        0.282 f0 + 0.478 f1 + 0.207 f2 + 0.033 f3   scotopic

    Source: Spencer, Shirley, Zimmerman, Greenberg, "Physically-Based Glare Effects for Digital
    Images", SIGGRAPH 1995, https://doi.org/10.1145/218380.218466.
    """

    state: State = "photopic"
    wavelengths: tuple[float, float, float] = numbers_field(
        (611.0, 549.0, 467.0), 380, 780, unit="nm"
    )

    def density(self, theta: ArrayLike) -> Array:
        angle = np.asarray(theta, np.float64)[..., np.newaxis]
        shares = _SHARES[self.state]
        core = 2.61e6 * np.exp(-((angle / 0.02) ** 2))
        near, wide = 20.91 / (angle + 0.02) ** 3, 72.37 / (angle + 0.02) ** 2
        total = shares[0] * core + shares[1] * near + shares[2] * wide
        lengths = np.array(self.wavelengths)
        if shares[3] == 0:
            return seen_in_grey(total[..., 0])
        halo = 436.9 * (568 / lengths) * np.exp(-19.75 * (angle - 3 * lengths / 568) ** 2)
        return np.asarray(total + shares[3] * halo)


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class cie_general(RadialPSF):
    """The CIE's general disability glare, for 0.1 to 100 degrees.

    Parameters
    ----------
    age : float
        In years, 0 to 120.
    pigment : float
        Colour of the iris: 0 very dark, 0.5 brown, 1 blue, 1.2 very light.

    Notes
    -----
    With theta in degrees, age A and pigment p:
    10 / theta^3 + (5 / theta^2 + 0.1 p / theta) (1 + (A / 62.5)^4) + 0.0025 p. The formula does not
    apply below 0.1 degrees, where the function has its value at 0.1. It describes only the
    scattered light, so its energy is not 1.

    Source: CIE 146:2002, "CIE Equations for Disability Glare"; Vos, "On the cause of disability
    glare and its dependence on glare angle, age and ocular pigmentation", Clinical and
    Experimental Optometry 86(6), 2003, https://doi.org/10.1111/j.1444-0938.2003.tb03080.x.
    """

    age: float = number_field(default=35.0, range=(0, 120), unit="year")
    pigment: float = number_field(default=0.5, range=(0, 1.2))

    def density(self, theta: ArrayLike) -> Array:
        angle = np.maximum(np.asarray(theta, np.float64), 0.1)
        old = 1 + (self.age / 62.5) ** 4
        veil = (5 / angle**2 + 0.1 * self.pigment / angle) * old
        return seen_in_grey(10 / angle**3 + veil + 0.0025 * self.pigment)


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class cie_total(RadialPSF):
    """The CIE's total glare, the complete point-spread function of the eye.

    Parameters
    ----------
    age : float
        In years, 0 to 120.
    pigment : float
        Colour of the iris: 0 very dark, 0.5 brown, 1 blue, 1.2 very light.

    Notes
    -----
    With theta in degrees, a = (age / 70)^4 and the pigment p:
    {(1 - 0.08 a) [9.2e6 (1 + (theta / 0.0046)^2)^-1.5 + 1.5e5 (1 + (theta / 0.045)^2)^-1.5]
    + (1 + 1.6 a) [400 / (1 + (theta / 0.1)^2) + 3e-8 theta^2
    + p (1300 (1 + (theta / 0.1)^2)^-1.5 + 0.8 (1 + (theta / 0.1)^2)^-0.5)] + 0.0025 p}
    / (1 + p (0.0417 + 0.055 a)).

    Source: CIE 135/1, "Disability Glare"; Vos and van den Berg, 1999. The formula is a
    reconstruction, which was not compared with the printed text. All of its constants are those of
    HDR-VDP 3.0.7 (utils/hdrvdp_otf_cie99.m), which has its Fourier transform along a line. `mtf` is
    that of the plane. The energy is 1 within 3.2 %. The ratio to the general disability glare is
    1.26 at 1 degree and 0.83 at 30 degrees.
    """

    age: float = number_field(default=35.0, range=(0, 120), unit="year")
    pigment: float = number_field(default=0.5, range=(0, 1.2))

    def density(self, theta: ArrayLike) -> Array:
        angle = np.asarray(theta, np.float64)
        old, p = (self.age / 70) ** 4, self.pigment
        wide = 1 + (angle / 0.1) ** 2
        core = 9.2e6 * (1 + (angle / 0.0046) ** 2) ** -1.5
        core += 1.5e5 * (1 + (angle / 0.045) ** 2) ** -1.5
        veil = 400 / wide + 3e-8 * angle**2 + p * (1300 * wide**-1.5 + 0.8 * wide**-0.5)
        total = (1 - 0.08 * old) * core + (1 + 1.6 * old) * veil + 0.0025 * p
        return seen_in_grey(total / (1 + p * (0.0417 + 0.055 * old)))
