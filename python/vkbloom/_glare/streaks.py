"""Streaks: rays from what glows."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

from vkbloom._public import public
from vkbloom._settings.fields import number_field
from vkbloom._settings.glare import GlareLight


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Streaks(GlareLight):
    """Rays from what glows, as a star filter makes them; with one direction an anamorphic streak.

    Parameters
    ----------
    directions : int
        Number of rays, 1 to 16, at equal angles. 1: one line of two opposite rays.
    angle : float
        Direction of the first ray in degrees, -360 to 360, counter-clockwise from the right.
    length : float
        Distance of neighbouring taps in texels, 0 to 16. A ray is length * base**iterations texels
        long.
    fade : float
        Factor of the light from one tap to the next, 0 to 1.
    base : int
        Number of taps of each iteration, 2 to 8.
    iterations : int
        Number of iterations, 1 to 6.
    colour_shift : float
        Attenuation of two channels of a tap, 0 to 1, which gives the rays colours.
    **glare
        The fields of `GlareLight`.

    Notes
    -----
    With b the base and d a step of `length` texels along the ray, iteration i is

        c_i+1(x) = sum over k < b of f_i^k m_k c_i(x - k b^i d) / sum over k < b of f_i^k

    with f_i = fade^(b^i), so that all N iterations together are the exponential fade^n over b^N
    taps. ``streaks`` is the mean of the rays. Without a colour shift, a flat image keeps its value
    far from the border. m_k multiplies the channels: it is 1 for the first tap. With a colour shift
    s, each further tap has one channel with the factor 1 (red, blue, green, in turn); the other two
    have 1 - s^(i + 1).

    Source: Kawase, "Frame Buffer Postprocessing Effects in DOUBLE-S.T.E.A.L", GDC 2003. The colours
    are those of Blender's node Glare (blender/blender,
    source/blender/nodes/composite/nodes/node_composite_glare.cc).
    """

    stage: ClassVar[str] = "streaks"

    directions: int = number_field()
    angle: float = number_field(unit="degree", slider=(-180, 180))
    length: float = number_field(unit="texel", slider=(0, 4))
    fade: float = number_field()
    base: int = number_field()
    iterations: int = number_field()
    colour_shift: float = number_field()
