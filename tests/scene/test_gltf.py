"""Meshes from glTF: the rules of loading, damaged files, and files that refer to other files."""

from __future__ import annotations

import base64
import json
import math
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from hypothesis import given

from tests.refusals import assert_refused, rows
from tests.scene.gltf_documents import (
    BYTE,
    CHANGES,
    DTYPES,
    FLOAT,
    INT,
    NORMALS,
    POSITIONS,
    SHORT,
    Document,
    at,
    load_or_refuse,
    many,
    nested,
    places,
    triangle,
)
from tests.scene.parts import Mesh, load_mesh


def corners(mesh: Mesh) -> np.ndarray:
    """Corner positions of each triangle, y up again: (t, 3, 3)."""
    return mesh.vertices[mesh.indices, :3].reshape(-1, 3, 3) * (1.0, -1.0, 1.0)


# Rules


# By hand: the child takes (x, y, z) to (-3y, x, z), the parent that to (10 - 6y, 20 + 2x, 30 + 2z),
# and the loader negates y. The normal (0.6, 0.8, 0) becomes (-4.8, 1.2, 0) before it is
# normalized: (-4, 1, 0) / sqrt(17).
NESTED_VERTICES = [
    [10, -22, 30, -4 / math.sqrt(17), -1 / math.sqrt(17), 0, 0.5, 0.25, 0.25],
    [4, -20, 30, 0, 0, 1, 0.5, 0.25, 0.25],
    [10, -20, 32, 0, -1, 0, 0.5, 0.25, 0.25],
]


@pytest.mark.parametrize("noise", [None, 0.0, 1e-17, 6e-8, -3e-6])
def test_transforms_are_baked_colours_multiplied_and_y_negated(
    tmp_path: Path, noise: float | None
) -> None:
    """Of two nodes; of a column-major matrix, rounded as exporters multiply those of floats."""
    document = nested()
    if noise is not None:
        matrix = [0, 2, 0, noise, -6, 0, 0, -noise, 0, 0, 2, noise, 10, 20, 30, 1 + noise]
        document.json["nodes"] = [{"mesh": 0, "matrix": matrix}]
    mesh = document.load(tmp_path)
    np.testing.assert_allclose(mesh.vertices, NESTED_VERTICES, atol=1e-6)
    assert mesh.indices.tolist() == [0, 1, 2]
    assert mesh.emission is None


def test_colours_are_never_negative(tmp_path: Path) -> None:
    document = triangle()
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["COLOR_0"] = document.accessor([[-1e-9, -1.0, 0.5]] * 3)
    assert document.load(tmp_path).vertices[:, 6:].tolist() == [[0.0, 0.0, 0.5]] * 3


@pytest.mark.parametrize("extras", [1, "by hand", [1, [2]], None, True, {"extras": [{}]}])
def test_extras_may_be_anything_anywhere(tmp_path: Path, extras: Any) -> None:
    document = nested()
    file = tmp_path / "mesh.gltf"
    file.write_bytes(document.as_gltf())
    expected = load_mesh(file)
    text = json.loads(document.as_gltf())
    for path in places(text):
        place: Any = text
        for key in path:
            place = place[key]
        if isinstance(place, dict) and path[-1] != "attributes":
            place["extras"] = extras
    text["extras"] = extras
    file.write_text(json.dumps(text))
    np.testing.assert_array_equal(load_mesh(file).vertices, expected.vertices)


def test_no_material_and_no_colours_are_white(tmp_path: Path) -> None:
    assert (triangle().load(tmp_path).vertices[:, 6:] == 1.0).all()


def test_the_factor_is_the_colour_where_the_mesh_has_none(tmp_path: Path) -> None:
    document = triangle()
    document.json["meshes"][0]["primitives"][0]["material"] = 0
    document.json["materials"] = [
        {"pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 0.75, 0.1]}}
    ]
    assert document.load(tmp_path).vertices[:, 6:].tolist() == [[0.25, 0.5, 0.75]] * 3


def test_emission_is_factor_times_strength(tmp_path: Path) -> None:
    document = triangle()
    document.primitive(material=0)
    document.json["extensionsUsed"] = ["KHR_materials_emissive_strength"]
    document.json["extensionsRequired"] = ["KHR_materials_emissive_strength"]
    document.json["materials"] = [
        {
            "emissiveFactor": [1.0, 0.5, 0.0],
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8.0}},
        }
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh = document.load(tmp_path)
    assert mesh.emission is not None
    assert mesh.emission.tolist() == [[0.0, 0.0, 0.0]] * 3 + [[8.0, 4.0, 0.0]] * 3


def test_missing_normals_are_flat(tmp_path: Path) -> None:
    # Two triangles share an edge; flat normals need corners of their own.
    document = Document()
    document.primitive(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        indices=document.accessor([0, 1, 2, 0, 3, 1], BYTE),
    )
    mesh = document.load(tmp_path)
    # (1,0,0) x (0,1,0) = +z; (0,0,1) x (1,0,0) = +y, negated by the loader.
    assert mesh.vertices[:, 3:6].tolist() == [[0, 0, 1]] * 3 + [[0, -1, 0]] * 3
    assert mesh.indices.tolist() == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize("with_normals", [False, True])
def test_a_mirrored_node_reverses_the_winding(tmp_path: Path, with_normals: bool) -> None:
    document = Document()
    primitive = document.primitive([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    if with_normals:
        primitive["attributes"]["NORMAL"] = document.accessor([[0, 0, 1]] * 3)
    document.json["nodes"] = [{"mesh": 0, "scale": [-1, 1, 1]}]
    mesh = document.load(tmp_path)
    a, b, c = corners(mesh)[0]
    # Seen from +z, where the normal points, the triangle is still counter-clockwise.
    assert np.cross(b - a, c - a)[2] > 0
    assert mesh.vertices[:, 3:6].tolist() == [[0, 0, 1]] * 3


STRIP_POSITIONS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]]


@pytest.mark.parametrize("indexed", [False, True])
@pytest.mark.parametrize(
    ("mode", "expected"),
    [(5, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]), (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0]])],
)
def test_strips_and_fans(
    tmp_path: Path, mode: int, expected: list[list[int]], indexed: bool
) -> None:
    document = Document()
    order = [4, 3, 2, 1, 0] if indexed else [0, 1, 2, 3, 4]
    primitive = document.primitive([STRIP_POSITIONS[i] for i in order], mode=mode)
    primitive["attributes"]["NORMAL"] = document.accessor([[0, 0, 1]] * 5)
    if indexed:
        primitive["indices"] = document.accessor(order, INT)
    mesh = document.load(tmp_path)
    np.testing.assert_array_equal(corners(mesh), np.array(STRIP_POSITIONS)[expected])


@pytest.mark.parametrize("component", [BYTE, SHORT, INT])
def test_index_types(tmp_path: Path, component: int) -> None:
    document = Document()
    document.primitive(indices=document.accessor([2, 1, 0], component))
    np.testing.assert_array_equal(corners(document.load(tmp_path))[0], POSITIONS[::-1])


@pytest.mark.parametrize(("component", "full"), [(BYTE, 255), (SHORT, 65535)])
@pytest.mark.parametrize("width", [3, 4])
def test_integer_colours(tmp_path: Path, component: int, full: int, width: int) -> None:
    document = triangle()
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    values = [[full, 0, full // 5, full][:width]] * 3
    attributes["COLOR_0"] = document.accessor(values, component, normalized=True)
    colours = document.load(tmp_path).vertices[:, 6:]
    np.testing.assert_allclose(colours, [[1.0, 0.0, 0.2]] * 3, rtol=1e-6)
    document.json["accessors"][-1]["normalized"] = False
    with pytest.raises(ValueError, match=r"mesh\.gltf.*not normalized"):
        document.load(tmp_path)


def test_interleaved_attributes(tmp_path: Path) -> None:
    document = Document()
    rows = np.hstack((np.array(POSITIONS), np.array(NORMALS), np.full((3, 1), np.nan)))
    view = document.view(rows.astype("<f4").tobytes(), byteStride=28)
    shared = {"bufferView": view, "componentType": FLOAT, "count": 3, "type": "VEC3"}
    document.json["accessors"] = [shared, {**shared, "byteOffset": 12}]
    document.json["meshes"][0]["primitives"] = [{"attributes": {"POSITION": 0, "NORMAL": 1}}]
    vertices = document.load(tmp_path).vertices[:, :6] * (1, -1, 1, 1, -1, 1)
    np.testing.assert_allclose(vertices, np.hstack((POSITIONS, NORMALS)), atol=1e-7)


@pytest.mark.parametrize("component", [BYTE, SHORT, INT])
@pytest.mark.parametrize("with_base", [False, True])
def test_sparse_accessors(tmp_path: Path, component: int, with_base: bool) -> None:
    document = triangle()
    accessor = document.json["accessors"][1]
    assert accessor["type"] == "VEC3"
    accessor["sparse"] = {
        "count": 2,
        "indices": {
            "bufferView": document.view(np.array([0, 2], DTYPES[component]).tobytes()),
            "componentType": component,
        },
        "values": {"bufferView": document.view(np.array([[5, 6, 7], [8, 9, 1]], "<f4").tobytes())},
    }
    if not with_base:
        del accessor["bufferView"]
    middle = POSITIONS[1] if with_base else [0, 0, 0]
    assert corners(document.load(tmp_path))[0].tolist() == [[5, 6, 7], middle, [8, 9, 1]]


def test_glb_and_outer_buffers_give_the_same_mesh(tmp_path: Path) -> None:
    document = nested()
    expected = document.load(tmp_path)
    (tmp_path / "any.name").write_bytes(document.as_glb())
    folder = tmp_path / "my parts"
    folder.mkdir()
    (folder / "a.bin").write_bytes(document.data + b"more")
    (tmp_path / "outer.gltf").write_bytes(document.as_gltf("my%20parts/a.bin"))
    for name in ("any.name", "outer.gltf"):
        mesh = load_mesh(tmp_path / name)
        np.testing.assert_array_equal(mesh.vertices, expected.vertices)
        np.testing.assert_array_equal(mesh.indices, expected.indices)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("accessors.0.count", 3.0),
        ("accessors.0.componentType", 5121.0),
        ("nodes.1.mesh", 0.0),
        ("accessors.0.min", [None]),
        ("accessors.1.max", ["NaN", None, 1e400]),
        ("accessors.1.name", 5),
        ("asset.generator", None),
        ("asset.minVersion", "2.0"),
        ("nodes.0.extensions", {"EXT_unknown": {"weights": "odd"}}),
        ("nodes.0.camera", 0),
        ("nodes.0.weights", [None]),
        ("meshes.0.weights", ["odd"]),
        ("meshes.0.primitives.0.attributes._MARK", 99),
        ("meshes.0.primitives.0.attributes.TEXCOORD_0", 99),
        ("meshes.0.primitives.0.mode", None),
        ("bufferViews.0.target", "odd"),
        ("cameras", [{"type": 7, "perspective": 3}]),
        ("skins", ["odd"]),
        ("accessors.+", {"bufferView": 99, "sparse": {"count": -1}}),
        ("bufferViews.+", {"buffer": 99}),
        ("buffers.+", {"byteLength": 8, "uri": "gone.bin"}),
        ("images", [{"uri": "gone.png"}, {}]),
        ("textures", [{"source": 9, "sampler": 9}]),
        ("samplers", [{"magFilter": 1}]),
        ("materials.+", {"emissiveFactor": [9], "alphaMode": "odd"}),
        ("meshes.+", {"primitives": [{"attributes": {"POSITION": 99}}]}),
    ],
)
def test_parts_without_a_meaning_may_be_anything(tmp_path: Path, path: str, value: Any) -> None:
    text = json.loads(nested().as_gltf())
    at(text, path, value)
    file = tmp_path / "mesh.gltf"
    file.write_text(json.dumps(text))
    np.testing.assert_allclose(load_mesh(file).vertices, NESTED_VERTICES, atol=1e-6)


@pytest.mark.parametrize(
    "header",
    [
        "data:application/octet-stream;base64,",
        "data:application/gltf-buffer;base64,",
        "data:;base64,",
        "DATA:text/plain;charset=utf-8;BASE64,",
    ],
)
@pytest.mark.parametrize("escape", [str, quote])
def test_data_uris(tmp_path: Path, header: str, escape: Callable[[str], str]) -> None:
    document = nested()
    file = tmp_path / "mesh.gltf"
    # A length that base64 pads, so that there is something to escape.
    payload = base64.b64encode(document.data + b"m").decode()
    file.write_bytes(document.as_gltf(header + escape(payload)))
    np.testing.assert_allclose(load_mesh(file).vertices, NESTED_VERTICES, atol=1e-6)


@pytest.mark.parametrize("field", ["extensionsUsed", "animations"])
def test_what_is_left_out_is_named_and_the_rest_is_read(tmp_path: Path, field: str) -> None:
    document = nested()
    document.json[field] = ["odd"]
    with pytest.warns(UserWarning, match=r"left out: (extension odd|animations)$"):
        mesh = document.load(tmp_path)
    np.testing.assert_allclose(mesh.vertices, NESTED_VERTICES, atol=1e-6)


@pytest.mark.parametrize("padding", [b"   ", b"\0", b"\0\0\0", b" \0", b"\n"])
def test_padding_of_the_json(tmp_path: Path, padding: bytes) -> None:
    document = nested()
    for content in (document.as_glb(padding), document.as_gltf() + padding):
        path = tmp_path / "mesh"
        path.write_bytes(content)
        np.testing.assert_allclose(load_mesh(path).vertices, NESTED_VERTICES, atol=1e-6)


def test_an_accessor_without_a_view_is_zeros(tmp_path: Path) -> None:
    document = nested()
    for accessor in document.json["accessors"][1:]:
        del accessor["bufferView"]
    mesh = document.load(tmp_path)
    assert (mesh.vertices[:, :3] == mesh.vertices[0, :3]).all()
    assert mesh.vertices[:, 3:6].tolist() == [[0, -1, 0]] * 3
    assert (mesh.vertices[:, 6:] == 0.0).all()


def test_the_default_scene_or_the_first_or_all_roots(tmp_path: Path) -> None:
    document = triangle()
    document.json["nodes"] = [
        {"mesh": 0},
        {"mesh": 0, "translation": [5, 0, 0]},
        {"children": [3], "translation": [0, 0, 7]},
        {"mesh": 0},
    ]
    document.json["scenes"] = [{"nodes": [0]}, {"nodes": [2, 1]}]
    document.json["scene"] = 1
    first_corners = corners(document.load(tmp_path))[:, 0].tolist()
    assert first_corners == [[1, 0, 7], [6, 0, 0]]
    del document.json["scene"]
    assert corners(document.load(tmp_path))[:, 0].tolist() == [[1, 0, 0]]
    del document.json["scenes"]
    first_corners = corners(document.load(tmp_path))[:, 0].tolist()
    assert first_corners == [[1, 0, 0], [6, 0, 0], [1, 0, 7]]


def test_deep_nesting_needs_no_deep_stack(tmp_path: Path) -> None:
    document = triangle()
    depth = 1200
    document.json["nodes"] = [
        {"children": [i + 1], "translation": [0, 0, 1]} for i in range(depth)
    ] + [{"mesh": 0}]
    assert corners(document.load(tmp_path))[0, 0].tolist() == [1, 0, depth]


def test_a_normal_without_length_stays_finite(tmp_path: Path) -> None:
    document = triangle()
    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["NORMAL"] = document.accessor([[0, 0, 0], [0, 0, 2], [3, 0, 0]])
    assert document.load(tmp_path).vertices[:, 3:6].tolist() == [[0, -1, 0], [0, 0, 1], [1, 0, 0]]


# What is left out


def test_everything_left_out_is_named_in_one_warning(tmp_path: Path) -> None:
    document = triangle()
    document.primitive(mode=0)
    document.primitive(mode=3)
    document.primitive(material=0, targets=[{"POSITION": 0}])
    document.json["meshes"][0]["primitives"].append({"attributes": {"NORMAL": 0}})
    document.json["materials"] = [{"normalTexture": {"index": 0}, "alphaMode": "BLEND"}]
    document.json["nodes"][0]["skin"] = 0
    document.json["animations"] = [{"channels": [], "samplers": []}]
    document.json["extensionsUsed"] = ["KHR_lights_punctual"]
    with pytest.warns(UserWarning, match="left out") as caught:
        mesh = document.load(tmp_path)
    assert len(mesh.indices) == 6
    assert len(caught) == 1
    message = str(caught[0].message)
    for part in (
        "mesh.gltf",
        "points",
        "line strips",
        "normal textures",
        "'BLEND'",
        "skins",
        "morph targets",
        "animations",
        "KHR_lights_punctual",
        "without positions",
    ):
        assert part in message


# Files that point elsewhere


@pytest.mark.parametrize(
    ("uri", "name"),
    [
        ("sub/../a.bin", "a.bin"),
        ("./sub//a.bin", "sub/a.bin"),
        ("gone/../sub/./a.bin", "sub/a.bin"),
        ("elsewhere/../a.bin", "a.bin"),
        ("../model/a.bin", "a.bin"),
        ("sub%2F..%2Fa.bin", "a.bin"),
        ("link.bin", "a.bin"),
        ("part%201%3A2%25.bin", "part 1:2%.bin"),
        ("teil ü.bin", "teil ü.bin"),
        ("teil%20%C3%BC.bin", "teil ü.bin"),
    ],
)
def test_a_uri_within_the_folder_is_read(tmp_path: Path, uri: str, name: str) -> None:
    document = triangle()
    folder = tmp_path / "model"
    (folder / "sub").mkdir(parents=True)
    (folder / "elsewhere").symlink_to(tmp_path)
    (folder / "link.bin").symlink_to("a.bin")
    (folder / name).write_bytes(document.data)
    (folder / "mesh.gltf").write_bytes(document.as_gltf(uri))
    assert len(load_mesh(folder / "mesh.gltf").indices) == 3


def test_a_link_that_loops_is_an_os_error(tmp_path: Path) -> None:
    document = triangle()
    (tmp_path / "loop.bin").symlink_to("loop.bin")
    (tmp_path / "mesh.gltf").write_bytes(document.as_gltf("loop.bin"))
    with pytest.raises(OSError, match=r"loop\.bin"):
        load_mesh(tmp_path / "mesh.gltf")


def test_missing_files_are_os_errors_that_name_them(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"gone\.gltf"):
        load_mesh(tmp_path / "gone.gltf")
    (tmp_path / "mesh.gltf").write_bytes(triangle().as_gltf("gone.bin"))
    with pytest.raises(FileNotFoundError, match=r"mesh\.gltf.*gone\.bin"):
        load_mesh(tmp_path / "mesh.gltf")


# Damaged files


class Damage:
    """Files of glTF that are damaged; each function loads one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def load(self, content: bytes) -> Mesh:
        path = self.folder / "mesh.gltf"
        path.write_bytes(content)
        return load_mesh(path)

    def damage(self, path: str, value: Any) -> Mesh:
        text = json.loads(nested().as_gltf())
        at(text, path, value)
        return self.load(json.dumps(text).encode())

    def with_values(self, attribute: str, value: float) -> Mesh:
        document = nested()
        values = document.accessor([[0, 0, 1], [0, value, 0], [0, 1, 0]])
        at(document.json, f"meshes.0.primitives.0.attributes.{attribute}", values)
        return document.load(self.folder)

    def with_indices(self, indices: list[int]) -> Mesh:
        document = Document()
        document.primitive(indices=document.accessor(indices, BYTE))
        return document.load(self.folder)

    def with_sparse(self, places: list[int]) -> Mesh:
        document = triangle()
        indices = {"bufferView": document.view(bytes(places)), "componentType": BYTE}
        values = {"bufferView": document.view(bytes(24))}
        sparse = {"count": 2, "indices": indices, "values": values}
        document.json["accessors"][1]["sparse"] = sparse
        return document.load(self.folder)

    def with_header(self, place: int) -> Mesh:
        content = bytearray(nested().as_glb())
        content[place : place + 4] = struct.pack("<I", 10**6)
        return self.load(bytes(content))

    def with_uri(self, uri: str) -> Mesh:
        document, folder = triangle(), self.folder / "model"
        (folder / "inner").mkdir(parents=True)
        (self.folder / "secret.bin").write_bytes(document.data)
        (folder / "inside.bin").write_bytes(document.data)
        (folder / "link.bin").symlink_to(self.folder / "secret.bin")
        (folder / "linked").symlink_to(self.folder)
        text = json.loads(document.as_gltf("x"))
        text["buffers"][0]["uri"] = uri
        self.folder = folder
        return self.load(json.dumps(text).encode())


@pytest.mark.parametrize(("call", "error"), rows(__file__, "damaged glTF"))
def test_damage_is_named(tmp_path: Path, call: str, error: str) -> None:
    damage = Damage(tmp_path)
    names = {name: getattr(damage, name) for name in vars(Damage) if name[0] != "_"}
    assert_refused(call, error, {**names, "math": math})


def test_a_small_file_cannot_ask_for_any_amount_of_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = triangle()
    document.json["nodes"] = [{"mesh": 0} for _ in range(40)]
    document.json["scenes"] = [{"nodes": list(range(40))}]
    assert len(document.load(tmp_path).vertices) == 120
    monkeypatch.setattr("vkbloom._scene.gltf.MAX_VERTICES", 119)
    with pytest.raises(ValueError, match=r"mesh\.gltf: too large"):
        document.load(tmp_path)
    accessor = document.json["accessors"][1]
    accessor["count"] = 3 * 2**24 + 1
    with pytest.raises(ValueError, match=r"mesh\.gltf: .*count is"):
        document.load(tmp_path)


def test_a_glb_cut_anywhere_is_refused(tmp_path: Path) -> None:
    whole = nested().as_glb()
    path = tmp_path / "mesh.glb"
    assert load_or_refuse(path, whole) is not None
    for size in range(len(whole)):
        assert load_or_refuse(path, whole[:size]) is None, size


@many
@given(changes=CHANGES)
def test_changed_bytes_load_or_are_refused(tmp_path: Path, changes: list[tuple[int, int]]) -> None:
    content = bytearray(nested().as_glb())
    for place, value in changes:
        content[place % len(content)] = value
    mesh = load_or_refuse(tmp_path / "mesh.glb", bytes(content))
    if mesh is not None:
        assert np.isfinite(mesh.vertices).all()
