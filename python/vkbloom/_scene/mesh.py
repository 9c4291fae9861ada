"""Meshes: vertices, triangles and surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._scene.arrays import read_only
from vkbloom._scene.textures import WHITE, Surface


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """Triangles with normals and colours, some of them with textures.

    Parameters
    ----------
    vertices
        ``(N, 9)`` float32, finite: position xyz, normal xyz and linear colour rgb of each vertex.
        y points down.
    indices
        ``(M,)`` uint32, each less than N: the triangles. M is a positive multiple of 3.
    emission
        ``(N, 3)`` float32, finite: emitted radiance rgb of each vertex. The deferred system adds it
        to `brightness`. The forward system draws it, and it glows, if the scene has no glow mesh.
        None: nothing emits.
    texcoords
        ``(N, 4)`` float32, finite: the position of each vertex in the base texture, then in the
        emission texture. (0, 0) is the top left corner of a texture, (1, 1) the bottom right one.
        May be None if there are no surfaces.
    surfaces
        The textures of triangles at the end of `indices`. Each `Surface` covers `index_count`
        entries, one surface after the other; the last one ends at the last entry. The triangles
        before the first surface have no textures.

    Arrays are copied unless they are read-only, C-contiguous owners of their memory.
    """

    vertices: NDArray[np.float32]
    indices: NDArray[np.uint32]
    emission: NDArray[np.float32] | None = None
    texcoords: NDArray[np.float32] | None = None
    surfaces: tuple[Surface, ...] = ()

    def __post_init__(self) -> None:
        _check_array("vertices", self.vertices, np.float32, 9)
        count = len(self.vertices)
        if not 0 < count <= 2**32 - 1:
            raise ValueError(f"vertices has {count} rows; 1..{2**32 - 1} are needed")
        _check_array("indices", self.indices, np.uint32, None)
        if len(self.indices) == 0 or len(self.indices) % 3:
            raise ValueError(
                f"indices has {len(self.indices)} entries; a positive multiple of 3 is needed"
            )
        if (highest := int(self.indices.max())) >= count:
            raise ValueError(f"indices has {highest}; there are {count} vertices")
        object.__setattr__(self, "vertices", read_only(self.vertices))
        object.__setattr__(self, "indices", read_only(self.indices))
        for name, columns in (("emission", 3), ("texcoords", 4)):
            array = getattr(self, name)
            if array is not None:
                _check_array(name, array, np.float32, columns)
                if len(array) != count:
                    raise ValueError(f"{name} has {len(array)} rows; {count} are needed")
                object.__setattr__(self, name, read_only(array))
        self._check_surfaces()

    def _check_surfaces(self) -> None:
        object.__setattr__(self, "surfaces", tuple(self.surfaces))
        for surface in self.surfaces:
            if not isinstance(surface, Surface):
                raise TypeError(f"surfaces must hold Surfaces, not {surface!r}")
        taken = sum(surface.index_count for surface in self.surfaces)
        if taken > len(self.indices):
            raise ValueError(f"surfaces take {taken} indices; there are {len(self.indices)}")
        if self.surfaces and self.texcoords is None:
            raise ValueError("texcoords is None; surfaces need texture coordinates")

    def __reduce__(self) -> tuple[type[Mesh], tuple[Any, ...]]:
        # Through the constructor, because NumPy pickles do not keep arrays read-only.
        arrays = (self.vertices, self.indices, self.emission, self.texcoords)
        return Mesh, (*arrays, self.surfaces)

    def __repr__(self) -> str:
        return f"Mesh({self.summary})"

    @property
    def summary(self) -> str:
        """The size of the mesh as text."""
        size = f"{len(self.indices) // 3} triangles, {len(self.vertices)} vertices"
        if not self.surfaces:
            return size
        textures = {texture for part in self.surfaces for texture in (part.base, part.emission)}
        return f"{size}, textures: {len(textures - {WHITE})}"


def _check_array(name: str, array: object, kind: type[np.generic], columns: int | None) -> None:
    """Check the dtype, the shape ``(n,)`` or ``(n, columns)``, and that all values are finite."""
    if not isinstance(array, np.ndarray) or array.dtype != np.dtype(kind):
        given = array.dtype if isinstance(array, np.ndarray) else type(array).__name__
        raise TypeError(f"{name} must be an array of {np.dtype(kind)}, not {given}")
    fits = array.ndim == 1 if columns is None else array.ndim == 2 and array.shape[1] == columns
    if not fits:
        needed = "(n,)" if columns is None else f"(n, {columns})"
        raise ValueError(f"{name} has shape {array.shape}; {needed} is needed")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} holds NaN or infinity; finite values are needed")
