"""The built-in scene is sound, and is that of the files in examples/saucer.

The glTF files and images are read here with NumPy and OpenImageIO alone, so that a fault of the
package's own loaders cannot hide one of theirs. The package has the arrays that its loaders make of
these files.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from vkbloom._scene import Scene

Array = npt.NDArray[Any]

ROOT = Path(__file__).resolve().parents[2]
FILES = ROOT / "examples" / "saucer"
PACKED = ROOT / "python" / "vkbloom" / "assets" / "ufo.npz"
MESHES = ("saucer", "saucer_glow")
FACES = ("px", "nx", "py", "ny", "pz", "nz")

# glTF 2.0, section 5.1: component types and the element sizes of accessors.
COMPONENTS: dict[int, np.dtype[Any]] = {5123: np.dtype("<u2"), 5126: np.dtype("<f4")}
WIDTHS = {"SCALAR": 1, "VEC3": 3}

# Vulkan specification, "Cube Map Face Selection": the directions of sc, tc and rc.
FACE_TABLE = {
    "px": ((0, 0, -1), (0, -1, 0), (1, 0, 0)),
    "nx": ((0, 0, 1), (0, -1, 0), (-1, 0, 0)),
    "py": ((1, 0, 0), (0, 0, 1), (0, 1, 0)),
    "ny": ((1, 0, 0), (0, 0, -1), (0, -1, 0)),
    "pz": ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
    "nz": ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
}


@dataclass(frozen=True)
class Part:
    """One primitive of one node: as stored, and with the node's transform applied."""

    node: str
    material: str
    stored: Array
    positions: Array
    normals: Array
    triangles: Array


def read_json(path: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return document


def read_accessor(document: dict[str, Any], blob: bytes, index: int) -> Array:
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    dtype, width = COMPONENTS[accessor["componentType"]], WIDTHS[accessor["type"]]
    assert view.get("byteStride", dtype.itemsize * width) == dtype.itemsize * width
    start = view["byteOffset"] + accessor["byteOffset"]
    end = start + accessor["count"] * dtype.itemsize * width
    assert start % dtype.itemsize == 0
    assert end <= view["byteOffset"] + view["byteLength"] <= len(blob)
    values: Array = np.frombuffer(blob[start:end], dtype).reshape(-1, width)
    return values


def local_matrix(node: dict[str, Any]) -> Array:
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    assert x * x + y * y + z * z + w * w == pytest.approx(1, abs=1e-6)
    # glTF 2.0, section 3.5.3: T * R * S, R from the unit quaternion.
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1, 1, 1)))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def read_parts(path: Path) -> list[Part]:
    document = read_json(path)
    (buffer,) = document["buffers"]
    blob = (path.parent / buffer["uri"]).read_bytes()
    assert buffer["byteLength"] == len(blob)
    parts: list[Part] = []

    def visit(index: int, parent: Array) -> None:
        node = document["nodes"][index]
        matrix = parent @ local_matrix(node)
        primitives = document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []
        for primitive in primitives:
            attributes = primitive["attributes"]
            positions = read_accessor(document, blob, attributes["POSITION"]).astype(np.float64)
            normals = read_accessor(document, blob, attributes["NORMAL"]).astype(np.float64)
            turned = normals @ matrix[:3, :3].T
            parts.append(
                Part(
                    node["name"],
                    document["materials"][primitive["material"]]["name"],
                    positions,
                    positions @ matrix[:3, :3].T + matrix[:3, 3],
                    turned / np.linalg.norm(turned, axis=1, keepdims=True),
                    read_accessor(document, blob, primitive["indices"])
                    .astype(np.int64)
                    .reshape(-1, 3),
                )
            )
        for child in node.get("children", ()):
            visit(child, matrix)

    for root in document["scenes"][document["scene"]]["nodes"]:
        visit(root, np.eye(4))
    return parts


def read_face(path: Path) -> Array:
    image = oiio.ImageBuf(str(path))
    pixels = image.get_pixels(oiio.UINT8)
    assert pixels is not None, image.geterror()
    return pixels


@pytest.fixture(scope="module", params=MESHES)
def parts(request: pytest.FixtureRequest) -> list[Part]:
    return read_parts(FILES / f"{request.param}.gltf")


@pytest.fixture(scope="module")
def sky() -> dict[str, Array]:
    return {name: read_face(FILES / f"starfield_{name}.png") for name in FACES}


# ------------------------------------------------------------------- the packed arrays


def arrays_of(scene: Scene) -> list[Array]:
    assert scene.glow is not None
    assert scene.glow.emission is not None
    assert scene.skybox is not None
    assert scene.body.emission is None
    assert scene.body.surfaces == scene.glow.surfaces == ()
    meshes = [a for mesh in (scene.body, scene.glow) for a in (mesh.vertices, mesh.indices)]
    return [*meshes, scene.glow.emission, *scene.skybox.levels]


def test_the_built_in_scene_is_that_of_the_files() -> None:
    faces = [FILES / f"starfield_{name}.png" for name in FACES]
    glow = FILES / "saucer_glow.gltf"
    loaded = Scene.from_gltf(FILES / "saucer.gltf", glow=glow, skybox=faces)
    for built_in, of_files in zip(arrays_of(Scene.ufo()), arrays_of(loaded), strict=True):
        np.testing.assert_array_equal(built_in, of_files, strict=True)


def test_the_built_in_scene_needs_no_extra() -> None:
    hide = "sys.modules.update(dict.fromkeys(('pygltflib', 'OpenImageIO'), None))"
    code = f"import sys; {hide}; import vkbloom; vkbloom.Scene.ufo()"
    subprocess.run([sys.executable, "-c", code], check=True)


# ------------------------------------------------------------------- the meshes


def test_the_meshes_are_fine_but_small() -> None:
    for name in MESHES:
        document = read_json(FILES / f"{name}.gltf")
        stored = sum(
            document["accessors"][primitive["indices"]]["count"] // 3
            for mesh in document["meshes"]
            for primitive in mesh["primitives"]
        )
        assert stored >= 5000
    assert PACKED.stat().st_size < 1_600_000


def attributes_of(name: str, attribute: str) -> Iterator[tuple[Any, npt.NDArray[Any]]]:
    """The accessors and the values of an attribute of all primitives of a mesh's file."""
    document = read_json(FILES / f"{name}.gltf")
    blob = (FILES / f"{name}.bin").read_bytes()
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            index = primitive["attributes"][attribute]
            yield document["accessors"][index], read_accessor(document, blob, index)


@pytest.mark.parametrize("name", MESHES)
def test_bounds_of_positions_are_exact(name: str) -> None:
    for accessor, positions in attributes_of(name, "POSITION"):
        np.testing.assert_array_equal(positions.min(0), np.float32(accessor["min"]))
        np.testing.assert_array_equal(positions.max(0), np.float32(accessor["max"]))


@pytest.mark.parametrize("name", MESHES)
def test_stored_normals_are_of_unit_length(name: str) -> None:
    for _, normals in attributes_of(name, "NORMAL"):
        lengths = np.linalg.norm(normals.astype(np.float64), axis=1)
        # Components are kept to 6 decimals.
        np.testing.assert_allclose(lengths, 1, rtol=0, atol=2e-6)


def test_indices_are_in_range_and_use_every_vertex(parts: list[Part]) -> None:
    for part in parts:
        used = np.unique(part.triangles)
        np.testing.assert_array_equal(used, np.arange(len(part.positions)), part.node)


def test_faces_wind_counter_clockwise_about_their_normals(parts: list[Part]) -> None:
    for part in parts:
        a, b, c = np.moveaxis(part.positions[part.triangles], 1, 0)
        cross = np.cross(b - a, c - a)
        area = np.linalg.norm(cross, axis=1)
        assert area.min() > 1e-7, f"{part.node}: a triangle without area"
        agreement = np.einsum("tk,tvk->tv", cross / area[:, None], part.normals[part.triangles])
        # The coarsest smooth surfaces are the thin rings, of 8 facets of 45 degrees in section:
        # half of that from a facet to its vertex normals, and about 7.5 around the axis.
        assert agreement.min() > np.cos(np.radians(35)), f"{part.node}, {part.material}"


def test_every_part_is_closed_and_faces_outward(parts: list[Part]) -> None:
    for part in parts:
        _, weld = np.unique(part.stored, axis=0, return_inverse=True)
        corners = weld.reshape(-1)[part.triangles]
        edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
        key, reverse = (edges @ [len(weld), 1], edges @ [1, len(weld)])
        assert len(np.unique(key)) == len(key), f"{part.node}: an edge is used twice one way"
        assert np.array_equal(np.sort(key), np.sort(reverse)), f"{part.node}: an open edge"

        # Each closed surface gets the lowest vertex number that it has.
        label = np.arange(len(weld))
        while True:
            lowest = label[corners].min(1)
            spread = label.copy()
            np.minimum.at(spread, corners, lowest[:, None])
            if np.array_equal(spread, label):
                break
            label = spread
        # By the divergence theorem, a closed surface holds the sum of a . (b x c) / 6.
        a, b, c = np.moveaxis(part.positions[part.triangles], 1, 0)
        volume = np.zeros(len(weld))
        np.add.at(volume, label[corners[:, 0]], np.einsum("tk,tk->t", a, np.cross(b, c)) / 6)
        surfaces = np.unique(label[corners])
        assert volume[surfaces].min() > 1e-6, f"{part.node}, {part.material}: inside out"


def test_body_stands_in_the_default_cameras_frame(parts: list[Part]) -> None:
    # The default camera and the model matrix at time 0, y negated as the loader does.
    x, y = np.radians([7.5, -343.0])
    turn_x = [[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]]
    turn_y = [[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]]
    positions = np.concatenate([p.positions for p in parts if p.material != "beam"])
    world = positions * [1, -1, 1] + [0, -1, 0.25]
    view = world @ (np.array(turn_x) @ np.array(turn_y)).T + [0, 0, -10.25]
    half_height = -view[:, 2] * np.tan(np.radians(22.5))
    ndc = view[:, :2] / np.stack([half_height * 16 / 9, half_height], -1)
    assert np.abs(ndc).max() < 0.9
    assert np.ptp(ndc[:, 0]) > 1.0


def test_radius_of_the_hull(parts: list[Part]) -> None:
    positions = np.concatenate([p.positions for p in parts])
    radius = np.hypot(positions[:, 0], positions[:, 2]).max()
    assert radius == pytest.approx(3.66, abs=1e-4)


def test_metals_stay_dark_in_the_shade() -> None:
    # The forward system adds an ambient term wherever a channel is 0.9 or more.
    colours = {
        entry["name"]: entry["pbrMetallicRoughness"]["baseColorFactor"]
        for entry in read_json(FILES / "saucer.gltf")["materials"]
    }
    assert colours.keys() == {"steel", "gunmetal", "copper", "enamel", "glass", "amber", "red"}
    lit = {name for name, colour in colours.items() if max(colour[:3]) >= 0.9}
    assert lit == {"amber", "red"}


def test_glow_colours_are_emissive_and_the_rest_is_black() -> None:
    materials = read_json(FILES / "saucer_glow.gltf")["materials"]
    colours = {}
    for entry in materials:
        base = entry["pbrMetallicRoughness"]["baseColorFactor"]
        assert base[:3] == entry["emissiveFactor"]
        assert base[3] == 1
        colours[entry["name"]] = base[:3]
    assert colours.pop("occluder") == [0, 0, 0]
    assert colours.keys() == {"glass", "amber", "red", "beam"}
    assert min(max(colour) for colour in colours.values()) > 0.6


def test_glow_mesh_is_the_body_with_a_beam() -> None:
    body, glow = (read_parts(FILES / f"{name}.gltf") for name in MESHES)
    assert [(part.node, part.material) for part in glow[len(body) :]] == [("beam", "beam")]
    for mine, other in zip(body, glow, strict=False):
        assert mine.node == other.node
        expected = mine.material if mine.material in {"glass", "amber", "red"} else "occluder"
        assert other.material == expected
        np.testing.assert_array_equal(mine.positions, other.positions)
        np.testing.assert_array_equal(mine.triangles, other.triangles)


# ------------------------------------------------------------------- the starfield


def test_starfield_is_dark_with_bright_stars(sky: dict[str, Array]) -> None:
    for name, face in sky.items():
        assert face.shape == (512, 512, 3), name
        assert face.dtype == np.uint8
        assert np.median(face) < 20
        assert 0.0002 < np.mean(face.max(-1) > 180) < 0.005, name


def border(face: Array, name: str, edge_points: Array, depth: int) -> Array:
    """Texels of a face next to points on one of its edges, `depth` texels inside."""
    axes = np.array(FACE_TABLE[name])
    size = len(face)
    sc, tc = ((edge_points @ axes[:2].T + 1) / 2 * size).T
    column, row = (np.floor(np.clip(v, 0.5, size - 0.5)).astype(np.int64) for v in (sc, tc))
    on_side = np.abs(edge_points @ axes[0]) > 1 - 1e-9
    inward = np.where(on_side, -np.sign(edge_points @ axes[0]), 0).astype(np.int64)
    upward = np.where(on_side, 0, -np.sign(edge_points @ axes[1])).astype(np.int64)
    texels: Array = face[row + depth * upward, column + depth * inward].astype(np.int64)
    return texels


@pytest.mark.parametrize(
    ("one", "other"),
    [(one, other) for k, one in enumerate(FACES) for other in FACES[k + 1 :] if one[1] != other[1]],
)
def test_starfield_has_no_seam(sky: dict[str, Array], one: str, other: str) -> None:
    size = len(sky[one])
    along = (np.arange(size) + 0.5) / size * 2 - 1
    normals = np.array([FACE_TABLE[one][2], FACE_TABLE[other][2]])
    points = normals.sum(0) + along[:, None] * np.cross(*normals)
    a0, a1 = (border(sky[one], one, points, depth) for depth in (0, 1))
    b0, b1 = (border(sky[other], other, points, depth) for depth in (0, 1))
    across = np.abs(a0 - b0)
    beside = np.maximum(np.abs(a0 - a1), np.abs(b0 - b1))
    # A star on the edge may be steeper there than one texel inside, by no more than this;
    # one that is cut off at the edge is off by its brightness.
    assert (across - beside).max() <= 24
    # Over a whole edge the step across it is as small as that between any two rows.
    assert across.mean() <= 1.25 * beside.mean() + 0.1
