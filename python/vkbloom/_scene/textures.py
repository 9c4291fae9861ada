"""Textures of meshes: pictures by which a surface's colours are multiplied."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom._numbers import check_integer
from vkbloom._scene.arrays import Constructed, check_levels

#: How a texture continues beyond its edge, and how texels are filtered: WebGPU's names.
AddressMode = Literal["repeat", "mirror-repeat", "clamp-to-edge"]
Filter = Literal["nearest", "linear"]


@dataclass(frozen=True, eq=False, repr=False)
class Texture(Constructed):
    """A picture with its mip levels, and how it is sampled.

    - `levels`: Arrays ``(h, w, 4)`` of float16, all finite: linear RGBA, top row first; sides
      1..16384. h and w are halved and rounded down from level to level, but at least 1. The chain
      may end early; a single level is a texture without mip levels. Arrays are copied unless they
      are read-only and own their memory.
    - `address_mode`: Horizontal and vertical: "repeat", "mirror-repeat" or "clamp-to-edge".
    - `mag_filter`, `min_filter`: "nearest" or "linear": used where a texel is larger (`mag_filter`)
      or smaller (`min_filter`) than a pixel.
    - `mipmap_filter`: "nearest" or "linear": the nearest level, or a mean of two.
    """

    levels: tuple[NDArray[np.float16], ...]
    address_mode: tuple[AddressMode, AddressMode] = ("repeat", "repeat")
    mag_filter: Filter = "linear"
    min_filter: Filter = "linear"
    mipmap_filter: Filter = "linear"

    def __post_init__(self) -> None:
        levels = check_levels(self.levels, (np.dtype(np.float16),))
        if not all(np.isfinite(level).all() for level in levels):
            raise ValueError("levels: some numbers are not finite")
        object.__setattr__(self, "levels", levels)
        if not isinstance(self.address_mode, tuple) or len(self.address_mode) != 2:
            raise ValueError(f"address_mode: {self.address_mode!r} is not two names")
        for name, values, kind in (
            ("address_mode", self.address_mode, AddressMode),
            ("mag_filter", (self.mag_filter,), Filter),
            ("min_filter", (self.min_filter,), Filter),
            ("mipmap_filter", (self.mipmap_filter,), Filter),
        ):
            for value in values:
                if value not in get_args(kind):
                    raise ValueError(f"{name}: {value!r} is not one of {', '.join(get_args(kind))}")

    def __repr__(self) -> str:
        height, width, _ = self.levels[0].shape
        return f"Texture({width} x {height}, levels: {len(self.levels)})"


#: The texture that changes nothing.
WHITE: Final = Texture((np.ones((1, 1, 4), np.float16),), mag_filter="nearest")


@dataclass(frozen=True)
class Material:
    """The textures of some of a mesh's triangles.

    - `index_count`: Entries of the mesh's indices, a positive multiple of 3.
    - `base`: Multiplies the vertex colours; sampled at the first two texture coordinates.
    - `emission`: Multiplies the emission; sampled at the last two texture coordinates.
    """

    index_count: int
    base: Texture = WHITE
    emission: Texture = WHITE

    def __post_init__(self) -> None:
        count = check_integer("index_count", self.index_count, 3, 2**32 - 1)
        if count % 3:
            raise ValueError(f"index_count: {count} is not a multiple of 3")
        for name in ("base", "emission"):
            if not isinstance(value := getattr(self, name), Texture):
                raise TypeError(f"{name}: {type(value).__name__} is not a Texture")

    @property
    def textures(self) -> tuple[Texture, Texture]:
        """Both textures."""
        return self.base, self.emission


def mip_levels(picture: NDArray[Any]) -> tuple[NDArray[Any], ...]:
    """Make all mip levels of a picture.

    - `picture`: ``(h, w, C)`` of uint8, float16 or float32.
    - Returns: the picture and all smaller levels down to 1 x 1; sizes are halved and rounded down.
      A texel is the mean of the part of the larger level that it covers: of two texels along an
      even side, and of three weighted texels along an odd side (Guthe and Heckbert,
      "Non-Power-of-Two Mipmapping", NVIDIA, 2005). Means are computed in float32 and rounded once
      for each level.
    """
    levels = [picture]
    mean = finite_floats(picture)
    while max(mean.shape[:2]) > 1:
        mean = _halve(_halve(mean, 0), 1)
        levels.append(round_to(mean, picture.dtype))
    return tuple(levels)


def finite_floats(image: NDArray[Any]) -> NDArray[np.float32]:
    """Return an image in float32. NaN and infinity become 0, since a mean would spread them."""
    values = image.astype(np.float32)
    if image.dtype.kind == "f":
        values[~np.isfinite(values)] = 0.0
    return values


def round_to(values: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return floats as numbers of a dtype: integers are rounded to the nearest."""
    return (np.rint(values) if dtype == np.uint8 else values).astype(dtype)


def _halve(picture: NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    """Return the picture with one of its first two sides halved."""
    side = picture.shape[axis]
    if side == 1:
        return picture
    half = side // 2
    lines = np.moveaxis(picture, axis, 0)
    first, second = lines[0 : 2 * half : 2], lines[1 : 2 * half : 2]
    # Shares are multiplied before the sum, so that the largest float32 does not overflow.
    if side % 2 == 0:
        mean = first * np.float32(0.5) + second * np.float32(0.5)
    else:
        index = np.arange(half, dtype=np.float32)[:, np.newaxis, np.newaxis]
        first_share, last_share = (half - index) / side, (index + 1) / side
        mean = first_share * first + np.float32(half / side) * second + last_share * lines[2::2]
    return np.moveaxis(mean, 0, axis)
