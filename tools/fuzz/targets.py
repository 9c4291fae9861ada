"""The readers of the package, as functions of bytes; each may raise only documented exceptions.

A target writes the bytes to the file of its reader and calls it. Files that do not load may raise
OSError and ValueError, custom methods also ShaderError; any other exception is a finding.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import OpenImageIO

import vkbloom
from vkbloom._io import disk_cache
from vkbloom._io.formats import tiff
from vkbloom._io.formats.table import FORMATS
from vkbloom._scene import ktx, skybox
from vkbloom._scene.gltf import load_mesh

FOLDER = Path(tempfile.mkdtemp(prefix="vkbloom-fuzz-"))
PROMISED = (OSError, ValueError, vkbloom.ShaderError)
DRIVER = bytes(range(16))


class Target(NamedTuple):
    """A reader: a function of bytes, and valid files to start from."""

    run: Callable[[bytes], None]
    seeds: Callable[[], list[bytes]]


def _file(name: str, data: bytes) -> Path:
    path = FOLDER / name
    path.write_bytes(data)
    return path


def _gltf(data: bytes) -> None:
    load_mesh(_file("input.glb" if data[:4] == b"glTF" else "input.gltf", data))


def _gltf_seeds() -> list[bytes]:
    image = _image(".png", np.full((2, 3, 3), 200, np.uint8))
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    blob = points.tobytes() + points[:, :2].tobytes() + np.arange(3, dtype="<u2").tobytes()
    views = [(0, 36), (36, 24), (60, 6)]
    kinds = [(5126, "VEC3"), (5126, "VEC2"), (5123, "SCALAR")]
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": [0, 0, 0, 1], "children": [1]}, {"scale": [1, 2, 1]}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}
                ]
            }
        ],
        "materials": [
            {
                "emissiveFactor": [1, 0.5, 0],
                "emissiveTexture": {"index": 0},
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2}},
            }
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071, "minFilter": 9987}],
        "images": [{"uri": "data:image/png;base64," + base64.b64encode(image).decode()}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": size} for start, size in views
        ],
        "accessors": [
            {"bufferView": index, "componentType": component, "type": shape, "count": 3}
            for index, (component, shape) in enumerate(kinds)
        ],
        "buffers": [{"byteLength": len(blob)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    padded = blob + bytes(-len(blob) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(padded), b"BIN\0") + padded
    glb = struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
    uri = "data:application/octet-stream;base64," + base64.b64encode(blob).decode()
    document["buffers"] = [{"byteLength": len(blob), "uri": uri}]
    sparse = {
        "count": 1,
        "indices": {"bufferView": 2, "componentType": 5123},
        "values": {"bufferView": 0},
    }
    plain = json.dumps(document).encode()
    document["accessors"][0]["sparse"] = sparse  # type: ignore[index]
    return [glb, plain, json.dumps(document).encode()]


def _ktx(data: bytes) -> None:
    ktx.read(_file("input.ktx", data))


def _ktx_seeds() -> list[bytes]:
    seeds = []
    for order in "<>":
        for internal, layout, kind, size in (
            (0x8058, 0x1908, 0x1401, 4),
            (0x881B, 0x1907, 0x140B, 6),
            (0x8814, 0x1908, 0x1406, 16),
        ):
            header = (0x04030201, kind, 1, layout, internal, layout, 2, 2, 0, 0, 6, 2, 8)
            data = ktx.IDENTIFIER + struct.pack(f"{order}13I", *header) + b"keyvalue"
            for side in (2, 1):
                face = ((side * size + 3) & ~3) * side
                data += struct.pack(f"{order}I", face) + bytes(6 * face)
            seeds.append(data)
    return seeds


def _image(suffix: str, pixels: np.ndarray[tuple[int, ...], np.dtype[np.generic]]) -> bytes:
    path = FOLDER / f"seed{suffix}"
    height, width, channels = pixels.shape
    output = OpenImageIO.ImageOutput.create(str(path))
    kind = {"float16": "half", "float32": "float"}.get(pixels.dtype.name, pixels.dtype.name)
    assert output.open(str(path), OpenImageIO.ImageSpec(width, height, channels, kind))
    assert output.write_image(pixels)
    output.close()
    return path.read_bytes()


def _suffix(data: bytes) -> str:
    kinds = {b"\x89PNG": ".png", b"\xff\xd8": ".jpg", b"v/1\x01": ".exr", b"#?": ".hdr"}
    return next((suffix for start, suffix in kinds.items() if data.startswith(start)), ".tif")


def _faces(data: bytes) -> None:
    path = _file(f"face{_suffix(data)}", data)
    skybox.from_faces([path] * 6)


def _equirectangular(data: bytes) -> None:
    skybox.from_equirectangular(_file(f"panorama{_suffix(data)}", data))


def _image_seeds(shape: tuple[int, int, int]) -> list[bytes]:
    values = np.random.default_rng(5).random(shape)
    return [
        _image(".png", (values * 255).astype(np.uint8)),
        _image(".exr", values.astype(np.float16)),
        _image(".tif", values.astype(np.float32)),
    ]


def _headers(data: bytes) -> None:
    """Run all readers of headers, whatever the format is."""
    path = _file("input", data)
    spec = OpenImageIO.ImageSpec(1, 1, 3, "uint8")
    tiff.is_raw(path)
    tiff.reduced_parts(path)
    for find in FORMATS.values():
        for part in range(2):
            with contextlib.suppress(ValueError), open(path, "rb") as stream:
                facts = find(stream, spec, part)
                if facts.correct is not None:
                    facts.correct(np.zeros((1, 1, 4), np.uint8))


def _header_seeds() -> list[bytes]:
    values = np.full((40, 40, 4), 200, np.uint8)
    # TIFF: primaries; a directory of Exif with its colour space and, below, its index.
    exif = struct.pack("<HHHII", 3, 319, 5, 6, 200) + struct.pack("<HHII", 330, 4, 1, 8)
    exif += struct.pack("<HHIII", 34665, 4, 1, 50, 0)
    exif += struct.pack("<HHHIHHHHIII", 2, 40961, 3, 1, 65535, 0, 40965, 4, 1, 80, 0)
    exif += struct.pack("<HHHI4sI", 1, 1, 2, 4, b"R03", 0)
    fields = b"II*\0\x08\0\0\0" + exif
    fields = fields.ljust(200, b"\0") + struct.pack("<12I", *[640, 1000] * 6)
    segment = b"Exif\0\0" + fields
    jpeg = b"\xff\xd8\xff\xe1" + struct.pack(">H", 2 + len(segment)) + segment
    webp = b"RIFF\0\0\0\0WEBPEXIF" + struct.pack("<I", len(fields)) + fields
    fits = "".join(
        f"{line:80}" for line in ("SIMPLE  = T", "BSCALE  = 1.5E0", "BZERO   = 2", "END")
    )
    hdr = b"#?RADIANCE\nPRIMARIES= .7 .3 .2 .7 .1 .1 .3 .3\nEXPOSURE=2\n\n-Y 4 +X 4\n"
    images = [_image(suffix, values) for suffix in (".jxl", ".jp2", ".png", ".bmp")]
    return [fields, jpeg, webp, fits.ljust(2880).encode(), hdr, *images]


def _pipelines(data: bytes) -> None:
    os.environ["VKBLOOM_CACHE_DIR"] = str(FOLDER / "cache")
    cache = disk_cache.DiskCache("pipelines")
    file = cache.file(DRIVER)
    assert file is not None
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(data)
    found = cache.read(DRIVER)
    # Only a completely written file counts as the driver's data.
    assert found is None or data == disk_cache.header(DRIVER, found) + found


def _pipeline_seeds() -> list[bytes]:
    kept = struct.pack("<IIII", 32, 1, 0x10005, 0) + bytes(16) + b"pipelines"
    return [disk_cache.header(DRIVER, kept) + kept]


#: Blocks that the examples do not have.
_BLOCKS = b"""\
//!TEXTURE line
//!SIZE 4
//!FORMAT r8
//!FILTER LINEAR
//!BORDER REPEAT
ff 00 00 00
//!TEXTURE kept
//!SIZE 2 2
//!FORMAT rgba16f
//!STORAGE

//!BUFFER numbers
//!VAR vec3 colour
//!VAR float weights[2]
0000803f000000000000803f00000000 0000803f000000000000000000000000 00000000000000000000000000000000
//!PARAM kind
//!DESC a choice
//!TYPE ENUM DEFINE
plain
squared
//!PARAM count
//!TYPE CONSTANT int
//!MINIMUM 1
//!MAXIMUM 4
2
//!HOOK RGB
//!HOOK OUTPUT
//!BIND HOOKED
//!BIND line
//!BIND numbers
//!BIND kept
//!SAVE LOW
//!WIDTH HOOKED.w 2 / 1 +
//!HEIGHT HOOKED.h count % 2 +
//!WHEN kind squared = ! OUTPUT.w 4 > *
//!OFFSET 0.5 -1
//!COMPUTE 8 8 4 4
void hook() {
    imageStore(kept, ivec2(0), vec4(random, float(frame), target_size));
    imageStore(out_image, ivec2(gl_GlobalInvocationID.xy), line_tex(weights[0]) + colour.xyzz);
}
//!HOOK RGB
//!BIND LOW
//!BIND HOOKED
//!COMPONENTS 3
vec4 hook() { return LOW_gather(LOW_pos, 0) + HOOKED_texOff(ivec2(1, 0)); }
"""


def _custom(data: bytes) -> None:
    kind: Any = vkbloom.load_method(_file("custom.hook", data), name="fuzzed")
    kind().core_passes((16, 12), (8, 6))


def _custom_seeds() -> list[bytes]:
    # Not the user's cache. Passes that a mutation leaves alone are not compiled again.
    os.environ["VKBLOOM_CACHE_DIR"] = str(FOLDER / "custom")
    examples = Path(__file__).parents[2] / "examples" / "custom_methods"
    return [_BLOCKS, *(file.read_bytes() for file in sorted(examples.glob("*.hook")))]


def _described(data: bytes) -> None:
    # Shaders stand beside it, so that those that a mutation leaves alone are found.
    kind: Any = vkbloom.load_method(_file("bloom.toml", data), name="fuzzed")
    kind().core_passes((16, 12), (8, 6))


def _described_seeds() -> list[bytes]:
    os.environ["VKBLOOM_CACHE_DIR"] = str(FOLDER / "described")
    folder = Path(__file__).parents[2] / "examples" / "languages" / "glsl"
    for name in ("down.frag", "up.frag"):
        _file(name, (folder / name).read_bytes())
    return [(folder / "bloom.toml").read_bytes()]


TARGETS = {
    "gltf": Target(_gltf, _gltf_seeds),
    "ktx": Target(_ktx, _ktx_seeds),
    "faces": Target(_faces, lambda: _image_seeds((4, 4, 3))),
    "equirectangular": Target(_equirectangular, lambda: _image_seeds((4, 8, 3))),
    "headers": Target(_headers, _header_seeds),
    "pipelines": Target(_pipelines, _pipeline_seeds),
    "custom": Target(_custom, _custom_seeds),
    "described": Target(_described, _described_seeds),
}


def run(target: Target, data: bytes) -> None:
    """Give the bytes to the reader; undocumented exceptions are not caught."""
    with contextlib.suppress(PROMISED):
        target.run(data)
