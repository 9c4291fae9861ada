"""Reflections in a lens: ghosts and the halo."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom import _core
from vkbloom._public import public
from vkbloom._settings.fields import number_field, numbers_field
from vkbloom._settings.glare import GlareLight


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Ghosts(GlareLight):
    """Reflections in a lens: copies of what glows, mirrored and scaled about the centre.

    Parameters
    ----------
    scales : sequence of float
        Up to 16 scales s_k, -16 to 16. A negative scale mirrors the copy. A copy has 1 / abs(s_k)
        times the size of the picture.
    tints : sequence of (float, float, float)
        Factors of red, green and blue for each ghost, or one tint for all ghosts.
    maximum : float
        Limit of each channel that a ghost reads, after the threshold, 0 to 65504.
    falloff : float
        Exponent of the attenuation towards the border of a copy, 0 to 64. 0: no attenuation.
    radius : float
        Distance from the copy's centre at which the attenuation ends in 0, as a share of the
        picture's sides, 0.001 to 4.
    vignette : float
        Attenuation of the ghosts in the middle of the picture, 0 to 1.
    aberration : float
        Distance by which red and blue are moved along the radius, 0 to 0.5 of the picture's sides.
    **glare
        The fields of `GlareLight`.

    Notes
    -----
    With the position p of a pixel, 0 to 1 along both sides, and the glow c,

        q_k = 1/2 + s_k (p - 1/2)
        ghosts(p) = v(p) sum over k of tint_k w(q_k) min(max(c(q_k) - threshold, 0), maximum)

    with w(q) = max(0, 1 - abs(q - 1/2) / radius)^falloff, and with (x, y) = 2 p - 1,
    v(p) = 1 + vignette (min((x^2 + y^2)^2, 1) - 1). Red is read at q + a and blue at q - a, where a
    points towards the centre and has the length `aberration`.

    Source: Chapman, "Pseudo Lens Flare", 2013. The weights are those of three.js
    (LensflareNode.js), Blender and Unity (LensFlareScreenSpaceCommon.hlsl), the aberration is
    Filament's (flare.mat).
    """

    stage: ClassVar[str] = "ghosts"

    scales: tuple[float, ...] = numbers_field(
        (-0.5, -1.0, -2.0, 3.0, 1.5), -16, 16, count=(1, _core.MAX_GHOSTS)
    )
    tints: tuple[tuple[float, float, float], ...] = numbers_field(
        ((1.0, 1.0, 1.0),), count=(1, _core.MAX_GHOSTS)
    )
    maximum: float = number_field(slider=(0, 100))
    falloff: float = number_field(default=2.0, slider=(0, 32))
    radius: float = number_field(default=0.75, slider=(0.001, 1.5))
    vignette: float = number_field()
    aberration: float = number_field(slider=(0, 0.05))

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.tints) not in (1, len(self.scales)):
            raise ValueError(
                f"tints: {self.tints!r} is not one (r, g, b) or {len(self.scales)} of them, one "
                "for each scale"
            )

    @property
    def ghosts(self) -> tuple[tuple[float, tuple[float, float, float]], ...]:
        """The scale and the tint of each ghost."""
        tints = self.tints if len(self.tints) > 1 else self.tints * len(self.scales)
        return tuple(zip(self.scales, tints, strict=True))


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Halo(GlareLight):
    """A ring around the centre of the picture, made from the glow near the centre.

    Parameters
    ----------
    radius : float
        Radius of the ring in heights of the picture, 0.001 to 4.
    width : float
        Distance from the middle of the ring to its ends in heights of the picture, 0.001 to 4.
    maximum : float
        Limit of each channel that the halo reads, after the threshold, 0 to 65504.
    aberration : float
        Distance by which red and blue are moved along the radius, 0 to 0.5 of the picture's sides.
    **glare
        The fields of `GlareLight`.

    Notes
    -----
    With the position p of a pixel, its distance d from the centre in heights of the picture, and
    the direction u from p to the centre, halo(p) is

        (1 - smoothstep(0, 1, abs(d - radius) / width)) c'(p + radius u)

    with c' = min(max(c - threshold, 0), maximum). Red and blue are moved as in `Ghosts`.

    Source: google/filament, flare.mat @ 523a261b1052.
    """

    stage: ClassVar[str] = "halo"

    radius: float = number_field(default=0.4, slider=(0.001, 1.5))
    width: float = number_field(slider=(0.001, 1))
    maximum: float = number_field(slider=(0, 100))
    aberration: float = number_field(slider=(0, 0.05))
