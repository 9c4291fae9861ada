"""Write a small textured model as glTF: a brick house with lit windows on a tiled ground."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

WALL = 256
# For each wall: the axis along it, and its side on the other axis.
WALLS = [(0, 1), (2, 1), (0, -1), (2, -1)]


def bricks() -> NDArray[np.uint8]:
    """Return a wall of 16 x 16 bricks, sRGB."""
    y, x = np.indices((WALL, WALL))
    row = y // 16
    x = x + 8 * (row % 2) * 2
    shade = np.random.default_rng(1).uniform(0.75, 1.1, (16, 17))[row, x // 32]
    mortar = (y % 16 < 2) | (x % 32 < 2)
    colours = np.where(mortar[..., None], (140, 135, 125), shade[..., None] * (150, 70, 50))
    return np.clip(colours, 0, 255).astype(np.uint8)


def windows() -> NDArray[np.uint8]:
    """Return the emission of a wall: four framed windows, each in another warm colour, sRGB."""
    lights = np.zeros((WALL, WALL, 3), np.uint8)
    colours = [(255, 200, 120), (255, 150, 60), (120, 190, 255), (255, 220, 170)]
    for index, colour in enumerate(colours):
        top, left = 40 + 110 * (index // 2), 40 + 110 * (index % 2)
        lights[top : top + 66, left : left + 66] = colour
        lights[top + 30 : top + 36, left : left + 66] = 0
        lights[top : top + 66, left + 30 : left + 36] = 0
    return lights


def tiles() -> NDArray[np.uint8]:
    """Return two by two tiles with an odd size, sRGB."""
    y, x = np.indices((75, 75))
    colours = np.where((((y < 37) ^ (x < 37))[..., None]), (96, 104, 120), (170, 170, 160))
    colours[(y % 37 < 2) | (x % 37 < 2)] = 50
    return colours.astype(np.uint8)


def png(pixels: NDArray[np.uint8], path: Path) -> None:
    """Write an image."""
    buffer = oiio.ImageBuf(np.ascontiguousarray(pixels))
    if not buffer.write(str(path)):
        raise OSError(f"{path}: {buffer.geterror()}")


def house() -> list[tuple[int, list[list[float]], list[float]]]:
    """Return quads: material, corners from the top left on, counter-clockwise, and a normal."""
    quads: list[tuple[int, list[list[float]], list[float]]] = []
    for across, sign in WALLS:
        side = -sign if across == 2 else sign
        corners = []
        for u, v in ((-1, 1), (-1, -1), (1, -1), (1, 1)):
            corner = [0.0, v * 1.3, 0.0]
            corner[across] = u * side * 1.5
            corner[2 - across] = sign * 1.5
            corners.append(corner)
        normal = [0.0, 0.0, 0.0]
        normal[2 - across] = float(sign)
        quads.append((0, corners, normal))
        ridge = [0.0, 2.6, 0.0]
        eaves = [[corners[i][0] * 1.15, 1.25, corners[i][2] * 1.15] for i in (0, 3)]
        slope = np.cross(np.subtract(eaves[1], eaves[0]), np.subtract(ridge, eaves[0]))
        slope /= np.linalg.norm(slope)
        quads.append((2, [ridge, eaves[0], eaves[1], ridge], slope.tolist()))
    ground = [[-14.0, -1.3, -14.0], [-14.0, -1.3, 14.0], [14.0, -1.3, 14.0], [14.0, -1.3, -14.0]]
    quads.append((1, ground, [0.0, 1.0, 0.0]))
    return quads


def write(folder: Path) -> Path:
    """Write house.gltf and its images into a folder; return the glTF file's path."""
    for name, pixels in (("bricks", bricks()), ("windows", windows()), ("tiles", tiles())):
        png(pixels, folder / f"{name}.png")
    data = b""
    accessors: list[dict[str, Any]] = []
    views: list[dict[str, Any]] = []
    primitives: list[dict[str, Any]] = []

    def accessor(values: Any, kind: str, component: int = 5126) -> int:
        nonlocal data
        array = np.asarray(values, np.float32 if component == 5126 else np.uint32)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": component,
                "count": len(array),
                "type": kind,
            }
        )
        data += array.tobytes()
        return len(accessors) - 1

    for material, corners, normal in house():
        attributes = {
            "POSITION": accessor(corners, "VEC3"),
            "NORMAL": accessor([normal] * 4, "VEC3"),
            "TEXCOORD_0": accessor([[0, 0], [0, 1], [1, 1], [1, 0]], "VEC2"),
        }
        corners_of_two = accessor([0, 1, 2, 0, 2, 3], "SCALAR", 5125)
        primitives.append(
            {"attributes": attributes, "indices": corners_of_two, "material": material}
        )
    repeated = {"extensions": {"KHR_texture_transform": {"scale": [14, 14]}}}
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_texture_transform", "KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [
            {
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
                "emissiveTexture": {"index": 1},
                "emissiveFactor": [1, 1, 1],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 6}},
            },
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 2, **repeated}}},
            {"pbrMetallicRoughness": {"baseColorFactor": [0.12, 0.05, 0.05, 1]}},
        ],
        "textures": [{"source": index} for index in range(3)],
        "images": [{"uri": f"{name}.png"} for name in ("bricks", "windows", "tiles")],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {
                "byteLength": len(data),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
            }
        ],
    }
    path = folder / "house.gltf"
    path.write_text(json.dumps(document))
    return path
