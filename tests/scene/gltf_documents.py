"""glTF files that tests write, and ways to damage them."""

from __future__ import annotations

import base64
import copy
import json
import math
import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import settings, strategies

from tests.exhaustive import examples
from tests.scene.parts import Mesh, load_mesh

FLOAT, BYTE, SHORT, INT = 5126, 5121, 5123, 5125
DTYPES = {FLOAT: "<f4", BYTE: "<u1", SHORT: "<u2", INT: "<u4"}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}

POSITIONS = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
NORMALS = [[0.6, 0.8, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]


class Document:
    """A glTF document that grows by accessors; its one buffer is written as the test wants it."""

    def __init__(self) -> None:
        self.data = b""
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": []}],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, data: bytes, **more: Any) -> int:
        self.data += bytes(-len(self.data) % 4)
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        )
        self.data += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: Any, component: int = FLOAT, **more: Any) -> int:
        array = np.asarray(values, DTYPES[component])
        width = 1 if array.ndim == 1 else array.shape[1]
        self.json["accessors"].append(
            {
                "bufferView": self.view(array.tobytes()),
                "componentType": component,
                "count": len(array),
                "type": TYPES[width],
                **more,
            }
        )
        return len(self.json["accessors"]) - 1

    def primitive(self, positions: Any = POSITIONS, **more: Any) -> dict[str, Any]:
        primitive = {"attributes": {"POSITION": self.accessor(positions)}, **more}
        self.json["meshes"][0]["primitives"].append(primitive)
        return primitive

    def as_gltf(self, uri: str | None = None) -> bytes:
        uri = uri or "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        buffers = [{"byteLength": len(self.data), "uri": uri}]
        return json.dumps({**self.json, "buffers": buffers}).encode()

    def as_glb(self, padding: bytes = b"") -> bytes:
        text = json.dumps({**self.json, "buffers": [{"byteLength": len(self.data)}]}).encode()
        text += b" " * (-len(text + padding) % 4) + padding
        data = self.data + bytes(-len(self.data) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def load(self, folder: Path) -> Mesh:
        path = folder / "mesh.gltf"
        path.write_bytes(self.as_gltf())
        return load_mesh(path)


def triangle() -> Document:
    document = Document()
    document.primitive(indices=document.accessor([0, 1, 2], SHORT))
    return document


def nested() -> Document:
    document = Document()
    primitive = document.primitive(indices=document.accessor([0, 1, 2], BYTE), material=0)
    primitive["attributes"]["NORMAL"] = document.accessor(NORMALS)
    primitive["attributes"]["COLOR_0"] = document.accessor([[1.0, 0.5, 0.25]] * 3)
    document.json["materials"] = [
        {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 1.0, 1.0]}}
    ]
    half = math.sqrt(0.5)
    document.json["nodes"] = [
        {"children": [1], "translation": [10, 20, 30], "scale": [2, 2, 2]},
        {"mesh": 0, "rotation": [0, 0, half, half], "scale": [1, 3, 1]},
    ]
    return document


ODD_VALUES: list[Any] = [
    None, True, -1, 3, 2**31, 10**400, 0.5, math.nan, "", "VEC3",
    [], [None], [0], ["a"], {}, {"indices": 0}, [1e300] * 3, [0.0] * 4,
]  # fmt: skip


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """All paths into a JSON value."""
    keys: list[Any] = []
    if isinstance(value, dict):
        keys = list(value)
    elif isinstance(value, list):
        keys = list(range(len(value)))
    return [path] * bool(path) + [p for key in keys for p in places(value[key], (*path, key))]


def at(document: dict[str, Any], path: str, value: Any) -> None:
    """Put a value at a place of a document; "+" is the end of a list."""
    *parents, last = path.split(".")
    place: Any = document
    for key in parents:
        place = place[int(key)] if isinstance(place, list) else place[key]
    if last == "+":
        place.append(value)
    else:
        place[int(last) if isinstance(place, list) else last] = value


def load_or_refuse(path: Path, content: bytes) -> Mesh | None:
    """Load; None if it is refused as it should be. Numeric warnings count as failures."""
    path.write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", RuntimeWarning)
        try:
            return load_mesh(path)
        except (OSError, ValueError) as error:
            message = str(error)
    assert path.name in message
    return None


def refusals(path: Path, original: Any, chosen: list[tuple[Any, ...]], step: int) -> int:
    """Put odd values at places of a document, and return how many of the documents are refused.

    One of `step` values is put at each place, since all of them take long; the next place has the
    next ones.
    """
    refused = 0
    for number, (*parents, last) in enumerate(chosen):
        for value in ODD_VALUES[number % step :: step]:
            changed = copy.deepcopy(original)
            place = changed
            for key in parents:
                place = place[key]
            place[last] = value
            refused += load_or_refuse(path, json.dumps(changed).encode()) is None
    return refused


#: Up to four changes: the place, modulo a number of bytes, and the new byte.
CHANGES = strategies.lists(
    strategies.tuples(strategies.integers(0), strategies.integers(0, 255)), min_size=1, max_size=4
)
#: Files are small, so there can be many examples.
many = settings(max_examples=examples(250))
