"""Meshes from glTF 2.0 and GLB files: nodes, primitives and materials.

Section numbers are those of the "glTF 2.0 Specification", version 2.0.1, Khronos Group.
"""

from __future__ import annotations

import os
import reprlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._formats import MAX_FLOAT
from vkbloom._scene.gltf_file import (
    EMISSIVE_STRENGTH,
    INTEGERS,
    MAX_VERTICES,
    Floats,
    GltfFile,
    Parsed,
)
from vkbloom._scene.gltf_textures import TextureReader, TextureUse
from vkbloom._scene.mesh import Mesh
from vkbloom._scene.textures import WHITE, Material, Texture

_LINE_MODES: Final = {0: "points", 1: "lines", 2: "line loops", 3: "line strips"}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


def load_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Load all triangles of a glTF or GLB file as one mesh.

    Node transforms are baked: positions are transformed; normals are multiplied by the 3x3 part and
    normalized. Colours are COLOR_0 times the material's base colour factor. Each of them is 1 if it
    is missing, and negative values of COLOR_0 count as 0. The y of positions and normals is
    negated. If a material emits, the mesh's `emission` is the emissive factor times its strength
    (KHR_materials_emissive_strength).

    Textures of the base colour and of the emission are read from PNG and JPEG images, decoded with
    the sRGB curve (3.9.2, 3.9.3) and sampled as their sampler states. A texture whose sampler has
    no minification filter gets mip levels. Any TEXCOORD_n can be used, with KHR_texture_transform.
    An emissive texture whose factor is 0 is not read. The alpha of a base colour is ignored.

    The nodes of the file's default scene are used; without a default scene those of the first one;
    without scenes all root nodes. Triangles, strips and fans are read, with or without indices. If
    there are no normals, flat ones are computed (3.7.2.1). A transform with a negative determinant
    reverses the winding (3.7.4). A normal of length 0 becomes the mesh's y axis, since a shader
    would make it NaN. The file's cameras and `doubleSided` are ignored.
    """
    file = GltfFile(Path(path))
    mesh = _Loader(file).mesh()
    if file.left_out:
        warnings.warn(f"{path}: left out: {', '.join(file.left_out)}", UserWarning, stacklevel=2)
    return mesh


@dataclass(frozen=True)
class _Material:
    """The factors and textures of a material."""

    factor: Floats  # rgb
    emission: Floats  # rgb
    # None: no texture.
    base_texture: TextureUse | None = None
    emission_texture: TextureUse | None = None

    @property
    def textures(self) -> tuple[Texture, Texture] | None:
        """The two textures of a `Material`; None if the material has none."""
        uses = (self.base_texture, self.emission_texture)
        if uses == (None, None):
            return None
        base, emission = (WHITE if use is None else use.texture for use in uses)
        return base, emission


@dataclass(frozen=True)
class _Geometry:
    """One primitive in its local space."""

    positions: Floats  # (n, 3)
    normals: Floats | None  # (n, 3)
    colours: Floats  # (n, 3)
    texcoords: Floats  # (n, 4): base colour's, emission's
    material: _Material
    triangles: NDArray[np.int64]  # (t, 3)

    @property
    def vertex_count(self) -> int:
        """The number of vertices after baking: flat normals need one for every corner."""
        return self.triangles.size if self.normals is None else len(self.positions)


class _Loader:
    """Bakes the triangles of a file's scene."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._textures = TextureReader(file)

    # Nodes

    def _place_meshes(self) -> Iterator[tuple[int, Floats, str]]:
        """Yield the index, the world matrix and the node of every mesh of the scene."""
        count = len(self._file.items("nodes"))
        shown = self._file.root.scene
        if shown is None and self._file.items("scenes"):
            # Only one scene is shown, as in other viewers.
            shown = 0
        if shown is None:
            children = {child for index in range(count) for child in self._children(index)}
            starts = [index for index in range(count) if index not in children]
        else:
            scene = self._file.item("scenes", shown, "scene")
            starts = self._node_list(scene.nodes, f"scenes[{shown}].nodes")
        reached: set[int] = set()
        pending = [(start, np.eye(4)) for start in reversed(starts)]
        while pending:
            index, outer = pending.pop()
            if index in reached:
                self._file.fail(f"damaged: node {index} has two parents, or is below itself")
            reached.add(index)
            node = self._file.item("nodes", index, "nodes")
            # An overflow is found later: the baked vertices are then not finite.
            with np.errstate(over="ignore", invalid="ignore"):
                world = outer @ self._local_matrix(node, f"nodes[{index}]")
            if node.skin is not None:
                self._file.leave_out("skins")
            if node.mesh is not None:
                yield node.mesh, world, f"nodes[{index}]"
            pending.extend((child, world) for child in reversed(self._children(index)))
        if shown is None and len(reached) != count:
            stray = min(set(range(count)) - reached)
            self._file.fail(f"damaged: node {stray} has two parents, or is below itself")

    def _children(self, index: int) -> list[int]:
        node = self._file.item("nodes", index, "nodes")
        return self._node_list(node.children, f"nodes[{index}].children")

    def _node_list(self, value: object, what: str) -> list[int]:
        if value is None:
            return []
        if not isinstance(value, list):
            self._file.fail(f"{what} is not a list")
        last = len(self._file.items("nodes")) - 1
        return [self._file.integer(index, what, 0, last) for index in value]

    def _local_matrix(self, node: Parsed, what: str) -> Floats:
        """Return the 4x4 matrix of a node: its own, or T * R * S (3.5.3)."""
        matrix = np.eye(4)
        placed = (node.translation, node.rotation, node.scale)
        if node.matrix is not None:
            if any(part is not None for part in placed):
                self._file.fail(
                    f"damaged: {what} has both a matrix and a translation, rotation or scale"
                )
            matrix = self._file.floats(node.matrix, f"{what}.matrix", range(16)).reshape(4, 4).T
            affine_row = (0.0, 0.0, 0.0, 1.0)
            # A tolerance, since exporters multiply in single precision.
            if not np.allclose(matrix[3], affine_row, rtol=0.0, atol=1e-5):
                self._file.fail(f"damaged: {what}.matrix is not affine")
            matrix[3] = affine_row
            return matrix
        rotation = self._file.floats(node.rotation, f"{what}.rotation", (0, 0, 0, 1))
        length = np.linalg.norm(rotation)
        if length == 0.0:
            self._file.fail(f"damaged: {what}.rotation has no length")
        x, y, z, w = rotation / length
        matrix[:3, :3] = (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
        matrix[:3, :3] *= self._file.floats(node.scale, f"{what}.scale", (1, 1, 1))
        matrix[:3, 3] = self._file.floats(node.translation, f"{what}.translation", (0, 0, 0))
        return matrix

    # Meshes

    def mesh(self) -> Mesh:
        """Bake all triangles of the scene into one mesh."""
        vertices: list[NDArray[np.float32]] = []
        texcoords: list[NDArray[np.float32]] = []
        # By textures; triangles without textures come first.
        indices: dict[tuple[Texture, Texture] | None, list[NDArray[np.uint32]]] = {None: []}
        emission: list[NDArray[np.float32]] = []
        read: dict[tuple[int, int], _Geometry | None] = {}
        total = corners = 0
        for mesh_index, world, user in self._place_meshes():
            mesh = self._file.item("meshes", mesh_index, user)
            if not isinstance(mesh.primitives, list):
                self._file.fail(f"meshes[{mesh_index}].primitives is not a list")
            for number, primitive in enumerate(mesh.primitives):
                what = f"meshes[{mesh_index}].primitives[{number}]"
                key = (mesh_index, number)
                if key not in read:
                    read[key] = self._geometry(primitive, what)
                geometry = read[key]
                if geometry is None:
                    continue
                corners += geometry.triangles.size
                total += geometry.vertex_count
                if max(total, corners / 3) > MAX_VERTICES:
                    self._file.fail(f"too large: over {MAX_VERTICES} vertices or triangles")
                rows, coordinates, triangles = self._bake(geometry, world, f"{user}: {what}")
                material = geometry.material
                indices.setdefault(material.textures, []).append(
                    (triangles + (total - len(rows))).astype(np.uint32).ravel()
                )
                vertices.append(rows)
                texcoords.append(coordinates)
                emission.append(
                    np.broadcast_to(material.emission.astype(np.float32), (len(rows), 3))
                )
        if not vertices:
            self._file.fail("has no triangles")
        emits = any(rows[0].any() for rows in emission)
        surfaces = tuple(
            Material(sum(map(len, parts)), *textures)
            for textures, parts in indices.items()
            if textures is not None
        )
        return Mesh(
            _join(vertices),
            _join([part for parts in indices.values() for part in parts]),
            _join(emission) if emits else None,
            _join(texcoords) if surfaces else None,
            surfaces,
        )

    def _bake(
        self, geometry: _Geometry, world: Floats, what: str
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
        """Transform a primitive to the renderer's world space.

        Return its rows of `Mesh.vertices`, those of `Mesh.texcoords`, and its triangles.
        """
        linear = world[:3, :3]
        triangles = geometry.triangles
        colours, texcoords = geometry.colours, geometry.texcoords
        with np.errstate(over="ignore", invalid="ignore"):
            positions = geometry.positions @ linear.T + world[:3, 3]
            if np.linalg.det(linear) < 0.0:
                triangles = triangles[:, ::-1]
            if geometry.normals is None:
                flat = triangles.ravel()
                positions, colours, texcoords = positions[flat], colours[flat], texcoords[flat]
                first, second, third = positions[0::3], positions[1::3], positions[2::3]
                normals = np.repeat(np.cross(second - first, third - first), 3, axis=0)
                triangles = np.arange(len(positions)).reshape(-1, 3)
            else:
                normals = geometry.normals @ linear.T
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            normals = np.where(
                length > 0.0, normals / np.where(length > 0.0, length, 1.0), (0, 1, 0)
            )
        rows = np.concatenate((positions, normals, colours), axis=1)
        rows[:, (1, 4)] *= -1.0
        # Also False for NaN.
        if not all((np.abs(values) <= MAX_FLOAT).all() for values in (rows, texcoords)):
            self._file.fail(f"{what}: a transformed vertex is not finite")
        return rows.astype(np.float32), texcoords.astype(np.float32), triangles

    def _geometry(self, primitive: Parsed, what: str) -> _Geometry | None:
        """Read a primitive; None if it has no triangles."""
        primitive = self._file.part(primitive, what)
        attributes = self._file.part(primitive.attributes, f"{what}.attributes")
        mode = _TRIANGLES if primitive.mode is None else primitive.mode
        mode = self._file.integer(mode, f"{what}.mode", 0, _FAN)
        if mode in _LINE_MODES:
            self._file.leave_out(_LINE_MODES[mode])
            return None
        if primitive.targets:
            self._file.leave_out("morph targets")
        attribute = {name: getattr(attributes, name) for name in ("POSITION", "NORMAL", "COLOR_0")}
        if attribute["POSITION"] is None:
            self._file.leave_out("primitives without positions")
            return None
        positions = self._file.vectors(attribute["POSITION"], f"{what}.POSITION")
        count = len(positions)
        normals = None
        if attribute["NORMAL"] is not None:
            normals = self._file.vectors(attribute["NORMAL"], f"{what}.NORMAL", count)
        material = self._material(primitive.material, what)
        colours = np.broadcast_to(material.factor, (count, 3))
        if attribute["COLOR_0"] is not None:
            read = self._file.vectors(attribute["COLOR_0"], f"{what}.COLOR_0", count)
            # 3.7.2.1 requires 0..1. Values above 1 are kept for the deferred system.
            colours = material.factor * np.maximum(read, 0.0)
        if primitive.indices is None:
            corners = np.arange(count, dtype=np.int64)
        else:
            corners = (
                self._file.accessor(primitive.indices, f"{what}.indices", ("SCALAR",), INTEGERS)
                .ravel()
                .astype(np.int64)
            )
            if corners.max() >= count:
                self._file.fail(
                    f"damaged: {what} has index {corners.max()}, but only {count} vertices"
                )
        return _Geometry(
            positions,
            normals,
            colours,
            self._texcoords(primitive, material, count, what),
            material,
            self._triangles(corners, mode, what),
        )

    def _texcoords(self, primitive: Parsed, material: _Material, count: int, what: str) -> Floats:
        """Return each vertex's coordinates in its two textures ``(n, 4)``; 0 without a texture."""
        if material.textures is None:
            return np.broadcast_to(np.float64(0.0), (count, 4))
        texcoords = np.zeros((count, 4))
        for column, use in ((0, material.base_texture), (2, material.emission_texture)):
            if use is None:
                continue
            index = getattr(primitive.attributes, use.coordinates)
            if index is None:
                self._file.fail(
                    f"damaged: {what} has no {use.coordinates}, "
                    f"where the textures of materials[{primitive.material}] are looked up"
                )
            read = self._file.vectors(index, f"{what}.{use.coordinates}", count)
            texcoords[:, column : column + 2] = use.map_coordinates(read)
        return texcoords

    def _triangles(self, corners: NDArray[np.int64], mode: int, what: str) -> NDArray[np.int64]:
        """Split a list, a strip or a fan into triangles ``(t, 3)`` as in 3.7.2.1."""
        count = len(corners)
        if count < 3 or (mode == _TRIANGLES and count % 3):
            self._file.fail(
                f"damaged: {what} has {count} corners, which is not a number of complete triangles"
            )
        if mode == _TRIANGLES:
            return corners.reshape(-1, 3)
        if mode == _FAN:
            hub = np.broadcast_to(corners[0], count - 2)
            return np.stack((corners[1:-1], corners[2:], hub), axis=1)
        step = np.arange(count - 2)
        odd = step % 2
        return np.stack((corners[step], corners[step + 1 + odd], corners[step + 2 - odd]), axis=1)

    def _material(self, index: object, what: str) -> _Material:
        """Return the base colour's factor, the emitted radiance, and their textures."""
        if index is None:
            return _Material(np.ones(3), np.zeros(3))
        material = self._file.item("materials", index, what)
        what = f"materials[{index}]"
        metal = self._file.part(material.pbrMetallicRoughness, f"{what}.pbrMetallicRoughness")
        factor = self._file.floats(
            metal.baseColorFactor, f"{what}.baseColorFactor", (1, 1, 1, 1), low=0.0
        )[:3]
        base_texture = self._textures.use(metal.baseColorTexture, f"{what}.baseColorTexture")
        if metal.metallicRoughnessTexture is not None:
            self._file.leave_out("metallic-roughness textures")
        if material.normalTexture is not None:
            self._file.leave_out("normal textures")
        if material.occlusionTexture is not None:
            self._file.leave_out("occlusion textures")
        if material.alphaMode not in (None, "OPAQUE"):
            self._file.leave_out(f"alpha mode {reprlib.repr(material.alphaMode)}")
        emission = self._emission(material, what)
        emission_texture = None
        if emission.any():
            emission_texture = self._textures.use(
                material.emissiveTexture, f"{what}.emissiveTexture"
            )
        return _Material(factor, emission, base_texture, emission_texture)

    def _emission(self, material: Parsed, what: str) -> Floats:
        """Return the emissive factor times its strength."""
        emission = self._file.floats(
            material.emissiveFactor, f"{what}.emissiveFactor", (0, 0, 0), low=0.0
        )
        extension = self._file.extension(material, EMISSIVE_STRENGTH, what)
        if extension is not None and extension.emissiveStrength is not None:
            strength = [extension.emissiveStrength]
            emission *= self._file.floats(strength, f"{what}.emissiveStrength", (1,), low=0.0)
            if emission.max() > MAX_FLOAT:
                self._file.fail(f"{what} emits more than float32 can hold")
        return emission


def _join(parts: list[NDArray[Any]]) -> NDArray[Any]:
    """Join arrays into a read-only one that owns its memory, which Mesh does not copy."""
    joined = np.concatenate(parts)
    joined.flags.writeable = False
    return joined
