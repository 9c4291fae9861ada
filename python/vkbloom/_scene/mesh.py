"""Meshes: vertices, triangles and surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vkbloom._locks import cached_property
from vkbloom._scene.arrays import Constructed, check_indices, check_rows, read_only
from vkbloom._scene.textures import WHITE, Material


@dataclass(frozen=True, eq=False, repr=False)
class Mesh(Constructed):
    """Triangles with normals and colours, some of them with textures.

    - `vertices`: (N, 9) float32: position xyz (y points down), normal xyz and linear colour rgb.
    - `indices`: (M,) uint32: the triangles.
    - `emission`: (N, 3) float32: emitted radiance rgb. The deferred system adds it to `brightness`.
      The forward system draws it, and it glows, if the scene has no glow mesh. None: nothing emits.
    - `texcoords`: (N, 4) float32: the position of each vertex in the base texture, then in the
      emission texture; (0, 0) is the top left corner of a texture. May be None without surfaces.
    - `surfaces`: The textures of triangles at the end of `indices`, one surface after the other.
      The triangles before the first surface have no textures.

    Arrays are copied unless they are read-only, C-contiguous owners of their memory. N is at least
    1, M a positive multiple of 3, and all numbers are finite: else a ValueError names the array.
    """

    vertices: NDArray[np.float32]
    indices: NDArray[np.uint32]
    emission: NDArray[np.float32] | None = None
    texcoords: NDArray[np.float32] | None = None
    surfaces: tuple[Material, ...] = ()

    def __post_init__(self) -> None:
        count = len(check_rows("vertices", self.vertices, 9))
        check_indices(self.indices, count)
        for name, columns in (("emission", 3), ("texcoords", 4)):
            if getattr(self, name) is not None:
                check_rows(name, getattr(self, name), columns, count)
        self._check_surfaces()
        for name in ("vertices", "indices", "emission", "texcoords"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, read_only(getattr(self, name)))

    def _check_surfaces(self) -> None:
        for surface in self.surfaces:
            if not isinstance(surface, Material):
                raise TypeError(f"surfaces: {type(surface).__name__} is not a Surface")
        textured = sum(surface.index_count for surface in self.surfaces)
        if textured > len(self.indices):
            raise ValueError(
                f"surfaces: {textured} indices are more than the mesh's {len(self.indices)}"
            )
        if self.surfaces and self.texcoords is None:
            raise ValueError("texcoords: None; surfaces need them")

    def __repr__(self) -> str:
        return f"Mesh({self.summary})"

    @cached_property
    def packed(self) -> NDArray[np.float32]:
        """The vertices as the device reads them, with the emission: (N, 3, 4)."""
        packed = np.zeros((len(self.vertices), 3, 4), np.float32)
        packed[..., :3] = self.vertices.reshape(-1, 3, 3)
        if self.emission is not None:
            packed[..., 3] = self.emission
        return packed

    @property
    def summary(self) -> str:
        """The size of the mesh as text."""
        size = f"{len(self.indices) // 3} triangles, {len(self.vertices)} vertices"
        if not self.surfaces:
            return size
        textures = {texture for part in self.surfaces for texture in part.textures}
        return f"{size}, textures: {len(textures - {WHITE})}"
