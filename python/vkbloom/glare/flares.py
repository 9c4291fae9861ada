"""Reflections in a lens: ghosts and the halo."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom import _core
from vkbloom.checks import check_floats, check_number
from vkbloom.glare.base import GlareLight, stage_field


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ghosts(GlareLight):
    """Pictures of what glows, mirrored and scaled about the centre, as reflections in a lens make.

    Parameters
    ----------
    scales : sequence of float
        Up to 16 scales s_k, -16 to 16. Negative ones mirror; sizes above 1 make ghosts smaller.
    tints : sequence of (float, float, float)
        Red, green and blue factor of each ghost, or one for all.
    maximum : float
        Largest value of a channel that a ghost reads, after the threshold, 0 to 65504.
    falloff : float
        Exponent of the fall towards the border of what a ghost shows, 0 to 64; 0: none.
    radius : float
        Where this fall ends, as a share of the picture's sides, 0.001 to 4.
    vignette : float
        How much the ghosts are kept out of the middle, 0 to 1.
    aberration : float
        How far red and blue are moved along the radius, 0 to 0.5 of the picture's sides.
    **glare
        The fields of `GlareLight`.

    See Also
    --------
    Halo : A ring around the centre.

    Notes
    -----
    With p the place of a pixel, 0 to 1 along both sides, and c what glows,

        q_k = 1/2 + s_k (p - 1/2)
        ghosts(p) = v(p) sum over k of tint_k w(q_k) min(max(c(q_k) - threshold, 0), maximum)

    with w(q) = max(0, 1 - abs(q - 1/2) / radius)^falloff, and for (x, y) = 2 p - 1
    v(p) = 1 + vignette (min((x^2 + y^2)^2, 1) - 1). Red is read at q + a, blue at q - a, with a of
    the length `aberration` towards the centre.

    Source: Chapman, "Pseudo Lens Flare", 2013; the weights as in three.js (LensflareNode.js),
    Blender and Unity (LensFlareScreenSpaceCommon.hlsl), the aberration as in Filament (flare.mat).

    Examples
    --------
    >>> image = np.zeros((9, 9, 3), np.float32)
    >>> image[4, 7] = 1
    >>> ghosts = vkbloom.Ghosts(scales=(-1,), tints=((1, 0.5, 0),), falloff=0, halvings=0)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     frames = renderer.apply(image, vkbloom.Pyramid(glare=(ghosts,)))
    >>> frames["ghosts"][4, 1]
    array([1. , 0.5, 0. , 1. ], dtype=float32)
    """

    stage: ClassVar[str] = "ghosts"

    scales: tuple[float, ...] = (-0.5, -1.0, -2.0, 3.0, 1.5)
    tints: tuple[tuple[float, float, float], ...] = ((1.0, 1.0, 1.0),)
    maximum: float = stage_field("maximum")
    falloff: float = stage_field("falloff", default=2.0)
    radius: float = stage_field("radius", default=0.75)
    vignette: float = stage_field("vignette")
    aberration: float = stage_field("aberration")
    halvings: int = stage_field("halvings", default=2)

    def __post_init__(self) -> None:
        super().__post_init__()
        scales = check_floats("scales", self.scales)
        if not 1 <= len(scales) <= _core.MOST_GHOSTS:
            raise ValueError(f"scales: {len(scales)} are out of range, 1 to {_core.MOST_GHOSTS}")
        for scale in scales:
            check_number("scales", scale, -16, 16)
        try:
            tints = tuple(check_floats("tints", tuple(tint)) for tint in self.tints)
        except TypeError:
            raise TypeError(f"tints: {self.tints!r} is not a sequence of (r, g, b)") from None
        if len(tints) not in (1, len(scales)) or any(len(tint) != 3 for tint in tints):
            raise ValueError(
                f"tints: {self.tints!r} is not one (r, g, b), or one for each of the "
                f"{len(scales)} scales"
            )
        for tint in tints:
            for factor in tint:
                check_number("tints", factor, 0, 65504)
        object.__setattr__(self, "scales", scales)
        object.__setattr__(self, "tints", tints)

    @property
    def ghosts(self) -> tuple[tuple[float, tuple[float, float, float]], ...]:
        """The scale and the tint of each."""
        tints = self.tints if len(self.tints) > 1 else self.tints * len(self.scales)
        return tuple(zip(self.scales, tints, strict=True))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Halo(GlareLight):
    """A ring around the centre of the picture, from what glows near the centre.

    Parameters
    ----------
    radius : float
        Of the ring, in heights of the picture, 0.001 to 4.
    width : float
        From the middle of the ring to where it ends, in heights of the picture, 0.001 to 4.
    maximum : float
        Largest value of a channel that the halo reads, after the threshold, 0 to 65504.
    aberration : float
        How far red and blue are moved along the radius, 0 to 0.5 of the picture's sides.
    **glare
        The fields of `GlareLight`.

    See Also
    --------
    Ghosts : Mirrored and scaled pictures.

    Notes
    -----
    With p the place of a pixel and d its distance from the centre, in heights of the picture, and u
    the direction from p to the centre, halo(p) is

        (1 - smoothstep(0, 1, abs(d - radius) / width)) c'(p + radius u)

    with c' = min(max(c - threshold, 0), maximum). Red and blue are moved as in `Ghosts`.

    Source: google/filament, flare.mat @ 523a261b1052.

    Examples
    --------
    >>> image = np.zeros((33, 33, 3), np.float32)
    >>> image[16, 16] = 1
    >>> halo = vkbloom.Halo(radius=0.25, width=0.1, halvings=0)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     light = renderer.apply(image, vkbloom.Pyramid(glare=(halo,)))["halo"][16, :, 0]
    >>> np.flatnonzero(light > 0.4)
    array([ 8, 24])
    """

    stage: ClassVar[str] = "halo"

    radius: float = stage_field("radius", default=0.4)
    width: float = stage_field("width")
    maximum: float = stage_field("maximum")
    aberration: float = stage_field("aberration")
    halvings: int = stage_field("halvings", default=2)
