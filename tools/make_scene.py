"""Make the built-in scene: the saucer's body, its glow mesh and the starfield.

Everything in ``examples/saucer`` except its README is written by this one
script, which is deterministic: a second run writes the same scene. Two glTF 2.0
files with their buffers and six cubemap faces come out. The axes are those of
glTF (right-handed, y up, counter-clockwise front faces), lengths are in scene
units, angles in degrees. Then vkbloom loads these files, and ``ufo.npz`` keeps
the arrays for `vkbloom.Scene.ufo`, which so needs no reader of glTF and images.

Run ``python tools/make_scene.py`` from anywhere; ``--out`` names another folder,
for all files. It needs ``vkbloom[scenes]``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Quaternion = tuple[float, float, float, float]
Triple = tuple[float, float, float]

ROOT = Path(__file__).resolve().parents[1]
FILES = ROOT / "examples" / "saucer"
PACKED = ROOT / "python" / "vkbloom" / "assets"

# Constants of the glTF 2.0 specification, sections 5.1 and 5.11.
FLOAT, UNSIGNED_SHORT = 5126, 5123
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963

# Positions are rounded so that a sine which differs in its last bit on another
# machine gives the same float32, and so the same min and max in the JSON.
POSITION_DECIMALS = 5
NORMAL_DECIMALS = 6

SKY_SEED = 20240531
FACE_SIZE = 512
FACE_NAMES = ("px", "nx", "py", "ny", "pz", "nz")
STAR_COUNT = 2600


# --------------------------------------------------------------------------- surfaces


@dataclass(frozen=True)
class Surface:
    """A closed triangle mesh.

    Attributes
    ----------
    positions : ndarray, shape (V, 3)
        Vertex positions in scene units.
    normals : ndarray, shape (V, 3)
        Outward unit normals. Vertices are shared where the surface is smooth and
        doubled at creases.
    triangles : ndarray of int, shape (T, 3)
        Vertex indices, counter-clockwise seen from outside.
    """

    positions: FloatArray
    normals: FloatArray
    triangles: npt.NDArray[np.int64]


def join(surfaces: Sequence[Surface]) -> Surface:
    """Put several surfaces into one, in the order given."""
    starts = np.cumsum([0] + [len(s.positions) for s in surfaces[:-1]])
    return Surface(
        np.concatenate([s.positions for s in surfaces]),
        np.concatenate([s.normals for s in surfaces]),
        np.concatenate([s.triangles + n for s, n in zip(surfaces, starts, strict=True)]),
    )


def moved(surface: Surface, offset: Triple) -> Surface:
    """Shift a surface by `offset` scene units."""
    return Surface(surface.positions + np.array(offset), surface.normals, surface.triangles)


def grid_triangles(rows: int, columns: int, *, around: bool) -> npt.NDArray[np.int64]:
    """Triangles of a grid of vertices stored row by row.

    Parameters
    ----------
    rows, columns : int
        Size of the grid, at least 2 each.
    around : bool
        Whether the last column is joined to the first.

    Returns
    -------
    ndarray of int, shape (T, 3)
        Two triangles a cell; their normal is (along rows) x (along columns).
    """
    row, column = np.meshgrid(
        np.arange(rows - 1), np.arange(columns if around else columns - 1), indexing="ij"
    )
    right = (column + 1) % columns
    a, b = row * columns + column, (row + 1) * columns + column
    c, d = (row + 1) * columns + right, row * columns + right
    cells = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], -2)
    return cells.reshape(-1, 3)


def profile_normals(points: FloatArray) -> FloatArray:
    """Unit normals, to the right of the direction of travel, of a smooth polyline.

    Parameters
    ----------
    points : ndarray, shape (P, 2)
        Radius and height. Where the first point is also the last, the line is a
        loop and both get the same normal.

    Returns
    -------
    ndarray, shape (P, 2)
    """
    steps = np.diff(points, axis=0)
    sides = np.stack([steps[:, 1], -steps[:, 0]], -1)
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    before, after = np.vstack([sides[:1], sides]), np.vstack([sides, sides[-1:]])
    if np.array_equal(points[0], points[-1]):
        before[0], after[-1] = sides[-1], sides[0]
    sums = before + after
    normals: FloatArray = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    return normals


def lathe(profile: Sequence[FloatArray], sides: int) -> Surface:
    """Turn a profile about the y axis.

    Parameters
    ----------
    profile : sequence of ndarray, shape (P, 2)
        Smooth polylines of (radius, height), each of which starts where the one
        before it ends; a crease lies between two of them. The profile runs
        counter-clockwise in the (radius, height) plane, either from axis to axis or
        as a loop.
    sides : int
        Number of vertices around, at least 3.
    """
    around = directions(np.arange(sides) * 360 / sides)
    parts: list[Surface] = []
    for points in profile:
        normal = profile_normals(points)
        on_axis = points[:, 0] == 0
        ring_points, ring_normals = points[~on_axis], normal[~on_axis]
        rows = len(ring_points)
        positions = revolve(ring_points, around)
        normals = revolve(ring_normals, around)
        triangles = [grid_triangles(rows, sides, around=True)] if rows > 1 else []
        for end, ring in ((0, 0), (-1, rows - 1)):
            if not on_axis[end]:
                continue
            pole = len(positions)
            positions = np.vstack([positions, [[0, points[end, 1], 0]]])
            normals = np.vstack([normals, [[0, np.sign(normal[end, 1]), 0]]])
            here = ring * sides + np.arange(sides)
            there = np.roll(here, -1)
            edge = (here, there) if end == 0 else (there, here)
            triangles.append(np.stack([np.full(sides, pole), *edge], -1))
        parts.append(Surface(positions, normals, np.concatenate(triangles)))
    return join(parts)


def revolve(points: FloatArray, around: FloatArray) -> FloatArray:
    """Turn (P, 2) radius-height pairs through (S, 2) unit directions: (P * S, 3)."""
    radius, height = points[:, 0, None], np.repeat(points[:, 1, None], len(around), 1)
    return np.stack([radius * around[:, 0], height, radius * around[:, 1]], -1).reshape(-1, 3)


def directions(degrees: FloatArray) -> FloatArray:
    """(A,) angles as (A, 2) unit vectors in the plane of x and z, from +x towards +z."""
    angle = np.radians(degrees)
    return np.stack([np.cos(angle), np.sin(angle)], -1)


def line(*points: tuple[float, float]) -> FloatArray:
    """A polyline through (radius, height) points."""
    return np.array(points, dtype=np.float64)


def arc(
    centre: tuple[float, float],
    radii: tuple[float, float],
    degrees: tuple[float, float],
    steps: int,
) -> FloatArray:
    """Part of an ellipse as a polyline of `steps` + 1 points, angles from +radius to +height."""
    angle = np.radians(np.linspace(*degrees, steps + 1))
    points = np.stack(
        [centre[0] + radii[0] * np.cos(angle), centre[1] + radii[1] * np.sin(angle)], -1
    )
    # cos(90 degrees) is not quite 0 in floating point, and a lathe asks for r == 0.
    return np.where(np.abs(points) < 1e-12, 0.0, points)


def ring(
    radius: float, height: float, radii: tuple[float, float], sides: int, steps: int = 8
) -> Surface:
    """A torus about the y axis with an elliptic section of half-axes `radii`."""
    section = arc((radius, height), radii, (0, 360), steps)
    section[-1] = section[0]
    return lathe([section], sides)


def half_ball(radii: tuple[float, float], sides: int, steps: int, *, base: float = 0.0) -> Surface:
    """The upper half of an ellipsoid of half-axes `radii` over y = `base`, with a floor."""
    return lathe([line((0, base), (radii[0], base)), arc((0, base), radii, (0, 90), steps)], sides)


def ball(radius: float, sides: int, steps: int) -> Surface:
    """A sphere about the origin."""
    return lathe([arc((0, 0), (radius, radius), (-90, 90), steps)], sides)


def rod(radius: float, bottom: float, top: float, sides: int) -> Surface:
    """An upright cylinder with flat ends."""
    low, high = (radius, bottom), (radius, top)
    return lathe([line((0, bottom), low), line(low, high), line(high, (0, top))], sides)


def tube(path: FloatArray, radius: float, sides: int) -> Surface:
    """Sweep a circle along a path in the plane z = 0, with flat ends.

    Parameters
    ----------
    path : ndarray, shape (P, 2)
        x and y of the centre line.
    radius : float
        Radius of the tube; the path has to bend more gently than that.
    sides : int
        Number of vertices around, at least 3.
    """
    across = -profile_normals(path)
    around = directions(np.arange(sides) * 360 / sides)
    # From `across` towards -z is the turn that makes (along the path) x (around the
    # circle), which is the normal of the grid's triangles, point outward.
    outward = np.empty((len(path), sides, 3))
    outward[..., :2] = across[:, None, :] * around[:, :1]
    outward[..., 2] = -around[:, 1]
    centre = np.pad(path, ((0, 0), (0, 1)))
    skin = centre[:, None, :] + radius * outward
    parts = [
        Surface(
            skin.reshape(-1, 3),
            outward.reshape(-1, 3),
            grid_triangles(len(path), sides, around=True),
        )
    ]
    for end, sign in ((0, -1.0), (-1, 1.0)):
        along = sign * np.array([across[end, 1], -across[end, 0], 0.0])
        here = 1 + np.arange(sides)
        there = np.roll(here, -1)
        edge = (here, there) if end == 0 else (there, here)
        parts.append(
            Surface(
                np.vstack([centre[end][None], skin[end]]),
                np.repeat(along[None], sides + 1, 0),
                np.stack([np.zeros(sides, dtype=np.int64), *edge], -1),
            )
        )
    return join(parts)


def sector(corners: FloatArray, half_angle: float, steps: int) -> Surface:
    """Turn a convex quadrilateral part of the way about the y axis, with flat ends.

    Parameters
    ----------
    corners : ndarray, shape (4, 2)
        (radius, height), counter-clockwise.
    half_angle : float
        The block spans -half_angle..half_angle degrees about the +x direction.
    steps : int
        Number of cells along the arc.
    """
    around = directions(np.linspace(-half_angle, half_angle, steps + 1))
    parts: list[Surface] = []
    for k in range(4):
        edge = corners[[k, (k + 1) % 4]]
        parts.append(
            Surface(
                revolve(edge, around),
                revolve(profile_normals(edge), around),
                grid_triangles(2, steps + 1, around=False),
            )
        )
    for end, sign in ((0, -1.0), (-1, 1.0)):
        cos, sin = around[end]
        normal = sign * np.array([-sin, 0.0, cos])
        order = [[0, 2, 1], [0, 3, 2]] if end == 0 else [[0, 1, 2], [0, 2, 3]]
        parts.append(
            Surface(
                revolve(corners, around[end][None]),
                np.repeat(normal[None], 4, 0),
                np.array(order, dtype=np.int64),
            )
        )
    return join(parts)


def bezier(points: Sequence[tuple[float, float]], steps: int) -> FloatArray:
    """A cubic Bezier curve as a polyline of `steps` + 1 points."""
    t = np.linspace(0, 1, steps + 1)[:, None]
    p = np.array(points, dtype=np.float64)
    curve: FloatArray = (
        (1 - t) ** 3 * p[0] + 3 * (1 - t) ** 2 * t * p[1] + 3 * (1 - t) * t**2 * p[2] + t**3 * p[3]
    )
    return curve


# --------------------------------------------------------------------------- the saucer


@dataclass(frozen=True)
class Finish:
    """How a part looks in each of the two files.

    Attributes
    ----------
    colour : tuple of float
        Colour of the lit body, 0..1. A channel of 0.9 or more makes the forward
        system add an ambient term, so the lamps and the glass stay above and the
        metals below that.
    glow : tuple of float
        Colour in the glow mesh, 0..1; black hides what lies behind it.
    metallic, roughness : float
        For viewers that do physically based shading, 0..1.
    """

    colour: Triple
    glow: Triple = (0.0, 0.0, 0.0)
    metallic: float = 0.0
    roughness: float = 0.4


FINISHES: Mapping[str, Finish] = {
    "steel": Finish((0.36, 0.40, 0.52), metallic=0.9),
    "gunmetal": Finish((0.16, 0.18, 0.25), metallic=0.9, roughness=0.5),
    "copper": Finish((0.82, 0.42, 0.20), metallic=1.0, roughness=0.3),
    "enamel": Finish((0.80, 0.76, 0.66), roughness=0.6),
    "glass": Finish((0.06, 0.42, 0.62), glow=(0.02, 0.46, 0.68), roughness=0.1),
    "amber": Finish((0.95, 0.60, 0.10), glow=(1.00, 0.60, 0.08)),
    "red": Finish((0.95, 0.12, 0.10), glow=(1.00, 0.08, 0.05)),
    "beam": Finish((1.00, 0.86, 0.30), glow=(0.68, 0.56, 0.15)),
}

Mesh = tuple[tuple[Surface, str], ...]


@dataclass(frozen=True)
class Node:
    """A node of the scene: a name, a transform, and a mesh or children.

    Scales are uniform, because the loader applies the same 3 x 3 matrix to normals
    as to positions, which is only right for those.
    """

    name: str
    mesh: str | None = None
    children: tuple[Node, ...] = ()
    translation: Triple = (0.0, 0.0, 0.0)
    rotation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    scale: float = 1.0


def turn(axis: str, degrees: float) -> Quaternion:
    """Rotation about the axis "x", "y" or "z", as a quaternion x, y, z, w."""
    half = np.radians(degrees) / 2
    parts = [float(np.sin(half)) if name == axis else 0.0 for name in "xyz"]
    return (parts[0], parts[1], parts[2], float(np.cos(half)))


def after(second: Quaternion, first: Quaternion) -> Quaternion:
    """The rotation that does `first`, then `second` (Hamilton product second * first)."""
    ax, ay, az, aw = second
    bx, by, bz, bw = first
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def body_meshes() -> dict[str, Mesh]:
    """The meshes that both files draw, by name; lengths in units of the node that draws them."""
    shoulder = arc((3.16, -1.02), (0.27, 0.24), (0, 62), 6)
    # The straight flank, on which the panels and the side domes sit.
    flank = line((shoulder[-1, 0], shoulder[-1, 1]), (1.98, -0.16))
    hull_top = lathe(
        [
            line((0, -1.06), (3.43, -1.06)),
            line((3.43, -1.06), (3.43, -1.02)),
            shoulder,
            flank,
            line((1.98, -0.16), (1.80, -0.12)),
            line((1.80, -0.12), (0, -0.12)),
        ],
        72,
    )
    hull_bottom = lathe(
        [
            line((0, -1.86), (1.15, -1.86)),
            arc((1.15, -1.70), (0.22, 0.16), (-90, 0), 3),
            line((1.37, -1.70), (1.37, -1.62)),
            line((1.37, -1.62), (1.90, -1.56)),
            line((1.90, -1.56), (2.02, -1.42)),
            line((2.02, -1.42), (3.36, -1.14)),
            line((3.36, -1.14), (3.36, -1.02)),
            line((3.36, -1.02), (0, -1.02)),
        ],
        72,
    )
    trim = join(
        [
            ring(3.44, -1.06, (0.22, 0.13), 72, 12),
            ring(1.74, -0.10, (0.14, 0.10), 48),
            ring(1.96, -1.50, (0.06, 0.06), 48),
            ring(0.98, -1.86, (0.13, 0.09), 40),
        ]
    )
    glass = lathe([line((0, -0.12), (1.66, -0.12)), arc((0, -0.12), (1.66, 1.13), (0, 90), 12)], 56)
    rib = tube(arc((0, -0.12), (1.66, 1.13), (3, 74), 12), 0.042, 8)
    cap = lathe(
        [
            line((0, 0.86), (0.50, 0.86)),
            line((0.50, 0.86), (0.53, 0.93)),
            arc((0, 0.93), (0.53, 0.14), (0, 90), 5),
        ],
        32,
    )
    low, high = flank[0] + (flank[1] - flank[0]) * np.array([[0.12], [0.80]])
    # The lift leans inward, so that the outer edge is bevelled.
    lift, sink = np.array([-0.06, 0.07]), np.array([0, -0.06])
    panel = sector(np.array([low + sink, low + lift, high + lift, high + sink]), 6.2, 4)
    lamp_up = half_ball((1.0, 0.92), 24, 6, base=-0.2)
    collar = ring(1.02, 0.0, (0.16, 0.14), 24)
    strut = tube(
        bezier([(1.95, -1.36), (2.75, -1.30), (3.05, -1.60), (3.02, -2.34)], 14), 0.085, 14
    )
    brace = tube(line((2.92, -1.12), (2.93, -1.78)), 0.045, 10)
    instep = arc((0.10, -2.43), (0.27, 0.15), (0, 80), 5)
    foot = lathe(
        [
            line((0, -2.46), (0.34, -2.46)),
            arc((0.34, -2.43), (0.03, 0.03), (-90, 0), 2),
            instep,
            line((instep[-1, 0], instep[-1, 1]), (0, -2.26)),
        ],
        28,
    )
    mast = tube(bezier([(0.0, 0.98), (0.02, 1.35), (0.16, 1.45), (0.02, 1.80)], 12), 0.055, 12)
    outside = arc((0, 0.62), (1.0, 0.62), (-90, -12), 8)
    inside = arc((0, 0.66), (0.92, 0.54), (-14, -90), 8)
    bowl = lathe([outside, np.stack([outside[-1], inside[0]]), inside], 28)
    return {
        "hull": ((hull_top, "steel"), (hull_bottom, "gunmetal"), (trim, "copper")),
        "panel": ((panel, "enamel"),),
        "dome": ((glass, "glass"),),
        "rib": ((rib, "steel"),),
        "cap": ((cap, "steel"),),
        "side_dome": ((lamp_up, "glass"), (collar, "copper")),
        "lamp": ((lamp_up, "amber"), (collar, "gunmetal")),
        "lens": ((half_ball((0.88, 0.20), 32, 5), "amber"),),
        "leg": ((strut, "steel"), (brace, "copper"), (moved(foot, (3.02, 0.0, 0.0)), "copper")),
        "mast": ((mast, "steel"),),
        "dish": ((bowl, "copper"), (rod(0.06, 0.02, 0.80, 12), "steel")),
        "bulb": ((ball(1.0, 18, 9), "red"),),
    }


def beam_mesh() -> Mesh:
    """The tractor beam, which only the glow mesh has: it shows as added light alone."""
    wall = line((2.55, -6.0), (0.78, -1.98))
    beam = lathe([line((0, -6.0), (2.55, -6.0)), wall, line((0.78, -1.98), (0, -1.98))], 64)
    return ((beam, "beam"),)


def around_hull(
    name: str,
    mesh: str,
    count: int,
    *,
    start: float = 0.0,
    at: tuple[float, float] = (0.0, 0.0),
    tilt: float = 0.0,
    scale: float = 1.0,
) -> Node:
    """A group of `count` equal nodes about the y axis.

    Parameters
    ----------
    name, mesh : str
        Name of the group, and the mesh that each of its nodes draws.
    count : int
        Number of nodes.
    start : float
        Direction of the first in degrees, from +x towards +z.
    at : tuple of float
        Radius and height of each node.
    tilt : float
        Degrees by which the node's y axis leans outward.
    scale : float
        Uniform scale.
    """
    children = []
    for k in range(count):
        degrees = start + 360 * k / count
        x, z = directions(np.array([degrees]))[0] * at[0]
        # A positive turn about y goes from +z towards +x, against `degrees`; one
        # about z goes from +x towards +y, against `tilt`.
        rotation = after(turn("y", -degrees), turn("z", -tilt))
        children.append(Node(f"{name}_{k}", mesh, (), (x, at[1], z), rotation, scale))
    return Node(name, children=tuple(children))


def saucer(*, with_beam: bool) -> Node:
    """The node tree of the saucer, about 7.3 units wide and 4.7 high without the beam."""
    dish = Node(
        "dish",
        "dish",
        (Node("bulb", "bulb", translation=(0.0, 0.86, 0.0), scale=0.42),),
        translation=(0.0, 1.82, 0.0),
        rotation=after(turn("y", -125.0), turn("z", -62.0)),
        scale=0.36,
    )
    parts = [
        Node("hull", "hull"),
        around_hull("panels_a", "panel", 7, start=75.0),
        around_hull("panels_b", "panel", 7, start=91.0),
        Node("dome", "dome", (around_hull("ribs", "rib", 8, start=20.0), Node("cap", "cap"))),
        around_hull(
            "side_domes", "side_dome", 7, start=57.3, at=(2.62, -0.485), tilt=26.0, scale=0.36
        ),
        around_hull("lamps", "lamp", 12, start=23.0, at=(2.70, -1.27), tilt=168.0, scale=0.17),
        Node("lens", "lens", translation=(0.0, -1.86, 0.0), rotation=turn("x", 180.0)),
        around_hull("legs", "leg", 3, start=98.0),
        Node("antenna", children=(Node("mast", "mast"), dish)),
    ]
    if with_beam:
        parts.append(Node("beam", "beam"))
    return Node("saucer", children=tuple(parts))


# --------------------------------------------------------------------------- glTF


def write_gltf(path: Path, root: Node, meshes: Mapping[str, Mesh], *, glow: bool) -> None:
    """Write a node tree and its meshes as a glTF 2.0 file with one buffer beside it.

    Parameters
    ----------
    path : Path
        The ``.gltf`` file; the buffer gets the same name with ``.bin``.
    root : Node
        The tree.
    meshes : mapping
        Meshes by the names that the nodes use.
    glow : bool
        Take each finish's glow colour, also as the emissive factor, rather than its
        colour.

    Raises
    ------
    OSError
        The files cannot be written.
    """
    materials: dict[str, dict[str, Any]] = {}
    accessors: list[dict[str, Any]] = []
    chunks: dict[str, list[bytes]] = {"positions": [], "normals": [], "indices": []}

    def add(data: npt.NDArray[Any], view: int, kind: str, **extra: Any) -> int:
        chunk = chunks[tuple(chunks)[view]]
        accessors.append(
            {
                "bufferView": view,
                "byteOffset": sum(map(len, chunk)),
                "componentType": UNSIGNED_SHORT if data.dtype == np.uint16 else FLOAT,
                "count": len(data),
                "type": kind,
                **extra,
            }
        )
        chunk.append(data.tobytes())
        return len(accessors) - 1

    def primitive(surface: Surface, finish: str) -> dict[str, Any]:
        positions = surface.positions.round(POSITION_DECIMALS).astype("<f4") + np.float32(0)
        normals = surface.normals.round(NORMAL_DECIMALS).astype("<f4") + np.float32(0)
        if len(positions) > np.iinfo(np.uint16).max:
            raise ValueError(f"{finish}: {len(positions)} vertices do not fit 16-bit indices")
        name = "occluder" if glow and FINISHES[finish].glow == (0, 0, 0) else finish
        materials.setdefault(name, material(name, FINISHES[finish], glow=glow))
        low, high = positions.min(0).tolist(), positions.max(0).tolist()
        return {
            "attributes": {
                "POSITION": add(positions, 0, "VEC3", min=low, max=high),
                "NORMAL": add(normals, 1, "VEC3"),
            },
            "indices": add(surface.triangles.astype("<u2").reshape(-1), 2, "SCALAR"),
            "material": list(materials).index(name),
        }

    mesh_list = [
        {"name": name, "primitives": [primitive(surface, finish) for surface, finish in mesh]}
        for name, mesh in meshes.items()
    ]
    mesh_index = {name: index for index, name in enumerate(meshes)}
    nodes: list[dict[str, Any]] = []

    def add_node(node: Node) -> int:
        entry: dict[str, Any] = {"name": node.name}
        nodes.append(entry)
        index = len(nodes) - 1
        if node.mesh is not None:
            entry["mesh"] = mesh_index[node.mesh]
        if node.children:
            entry["children"] = [add_node(child) for child in node.children]
        if any(node.translation):
            entry["translation"] = rounded(node.translation)
        if any(node.rotation[:3]):
            entry["rotation"] = rounded(node.rotation)
        if node.scale != 1.0:
            entry["scale"] = rounded((node.scale,) * 3)
        return index

    add_node(root)
    views = []
    blob = b""
    for view, (name, chunk) in enumerate(chunks.items()):
        data = b"".join(chunk)
        entry: dict[str, Any] = {
            "name": name,
            "buffer": 0,
            "byteOffset": len(blob),
            "byteLength": len(data),
        }
        if view < 2:
            entry |= {"byteStride": 12, "target": ARRAY_BUFFER}
        else:
            entry["target"] = ELEMENT_ARRAY_BUFFER
        views.append(entry)
        blob += data
    buffer_path = path.with_suffix(".bin")
    document = {
        "asset": {"version": "2.0", "generator": "vkbloom tools/make_scene.py"},
        "scene": 0,
        "scenes": [{"name": path.stem, "nodes": [0]}],
        "nodes": nodes,
        "meshes": mesh_list,
        "materials": list(materials.values()),
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"uri": buffer_path.name, "byteLength": len(blob)}],
    }
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    buffer_path.write_bytes(blob)


def material(name: str, finish: Finish, *, glow: bool) -> dict[str, Any]:
    """The glTF material of a finish."""
    colour = finish.glow if glow else finish.colour
    entry: dict[str, Any] = {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*colour, 1.0],
            "metallicFactor": 0.0 if glow else finish.metallic,
            "roughnessFactor": 1.0 if glow else finish.roughness,
        },
    }
    if glow:
        entry["emissiveFactor"] = list(colour)
    return entry


def rounded(values: Sequence[float]) -> list[float]:
    """Numbers for the JSON, to 7 decimals, without negative zeros."""
    return [round(float(value), 7) + 0.0 for value in values]


# --------------------------------------------------------------------------- the starfield


# Rows: the directions of sc, tc and rc of each face, by the table in the Vulkan
# specification, section "Cube Map Face Selection"; s = (sc / |rc| + 1) / 2, t with tc.
FACE_AXES = np.array(
    [
        [[0, 0, -1], [0, -1, 0], [1, 0, 0]],
        [[0, 0, 1], [0, -1, 0], [-1, 0, 0]],
        [[1, 0, 0], [0, 0, 1], [0, 1, 0]],
        [[1, 0, 0], [0, 0, -1], [0, -1, 0]],
        [[1, 0, 0], [0, -1, 0], [0, 0, 1]],
        [[-1, 0, 0], [0, -1, 0], [0, 0, -1]],
    ],
    dtype=np.float64,
)


def face_directions(size: int) -> FloatArray:
    """Unit vectors through the texel centres of a cubemap.

    Parameters
    ----------
    size : int
        Side of a face in texels.

    Returns
    -------
    ndarray, shape (6, size, size, 3)
        In the order +x, -x, +y, -y, +z, -z, top row first.
    """
    s = (np.arange(size) + 0.5) / size * 2 - 1
    tc, sc = np.meshgrid(s, s, indexing="ij")
    vectors = np.stack([sc, tc, np.ones_like(sc)], -1) @ FACE_AXES[:, None]
    unit: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def noise(points: FloatArray, lattice: FloatArray) -> FloatArray:
    """Value noise: random numbers on a periodic lattice, blended by the quintic fade curve.

    Parameters
    ----------
    points : ndarray, shape (..., 3)
        Where to evaluate, in cells of the lattice.
    lattice : ndarray, shape (L, L, L)
        The numbers.

    Returns
    -------
    ndarray, shape (...)
        Within the range of `lattice`. The fade 6 t^5 - 15 t^4 + 10 t^3 is that of
        Perlin, "Improving Noise", 2002.
    """
    cell = np.floor(points).astype(np.int64)
    t = points - cell
    fade = t**3 * (t * (t * 6 - 15) + 10)
    period = len(lattice)
    # One more layer on each side, so that a cell's far corners need no wrapping.
    padded = np.pad(lattice, ((0, 1),) * 3, mode="wrap").reshape(-1)
    strides = np.array([(period + 1) ** 2, period + 1, 1])
    near = (cell % period) @ strides
    corners: list[FloatArray] = [
        padded[near + np.dot(corner, strides)] for corner in np.ndindex(2, 2, 2)
    ]
    for axis in range(3):
        half = len(corners) // 2
        corners = [
            a + fade[..., axis] * (b - a)
            for a, b in zip(corners[:half], corners[half:], strict=True)
        ]
    return corners[0]


def cloud(
    points: FloatArray, rng: np.random.Generator, frequency: float, octaves: int
) -> FloatArray:
    """Several octaves of value noise, each half as strong and about twice as fine, in 0..1."""
    total = np.zeros(points.shape[:-1])
    amplitude, norm = 1.0, 0.0
    for _ in range(octaves):
        lattice, offset = rng.random((32, 32, 32)), rng.random(3) * 32
        total += amplitude * noise(points * frequency + offset, lattice)
        norm += amplitude
        amplitude, frequency = amplitude * 0.5, frequency * 2.03
    return total / norm


def nebula(view: FloatArray, rng: np.random.Generator, pole: FloatArray) -> FloatArray:
    """Dim coloured gas.

    Parameters
    ----------
    view : ndarray, shape (..., 3)
        Unit vectors.
    rng : numpy.random.Generator
        Source of the noise.
    pole : ndarray, shape (3,)
        Unit normal of the plane along which the gas gathers.

    Returns
    -------
    ndarray, shape (..., 3)
        Colour, 0 to about 0.25.
    """
    warp = np.stack([cloud(view, rng, 1.7, 2) for _ in range(3)], -1) - 0.5
    bent = view + 0.5 * warp
    band = np.exp(-((bent @ pole / 0.36) ** 2))
    violet, teal, rust, dust = (cloud(bent, rng, f, 4) for f in (2.1, 2.6, 3.1, 5.0))

    def above(field: FloatArray, floor: float) -> FloatArray:
        return np.clip((field - floor) / (1 - floor), 0, 1) ** 1.5

    lanes = np.clip((dust - 0.42) / 0.2, 0, 1) * band
    layers = (
        (above(violet, 0.38) * (0.25 + 0.75 * band), (0.31, 0.10, 0.50)),
        (above(teal, 0.42) * (0.30 + 0.70 * band), (0.03, 0.27, 0.38)),
        (above(rust, 0.45) * band, (0.42, 0.17, 0.07)),
    )
    colour = np.full((*view.shape[:-1], 3), (0.010, 0.011, 0.022))
    for strength, tint in layers:
        colour += strength[..., None] * tint
    return colour * (1 - 0.7 * lanes[..., None])


def add_stars(sky: FloatArray, rng: np.random.Generator, pole: FloatArray) -> None:
    """Add stars to a cubemap in place.

    A star is a Gaussian of the angle between its direction and the texel's, so that
    one that lies across an edge is the same on both faces.

    Parameters
    ----------
    sky : ndarray, shape (6, N, N, 3)
        The faces.
    rng : numpy.random.Generator
        Source of directions, brightness and colour.
    pole : ndarray, shape (3,)
        Unit normal of the plane near which stars are denser.
    """
    size = sky.shape[1]
    view = face_directions(size)
    spread = rng.standard_normal((STAR_COUNT, 3))
    in_band = np.arange(STAR_COUNT) % 5 < 2
    spread[in_band] -= 0.85 * (spread[in_band] @ pole)[:, None] * pole
    stars = spread / np.linalg.norm(spread, axis=1, keepdims=True)
    # Few bright ones, many faint ones: a power law, as with real stars.
    brightness = np.clip(0.10 * rng.random(STAR_COUNT) ** -0.75, 0.0, 1.3)
    # In texels at the centre of a face; fainter stars are also smaller.
    sigma = (0.45 + 0.32 * np.sqrt(brightness)) * 2 / size
    warmth = rng.random(STAR_COUNT)[:, None]
    tint = (1 - warmth) * [0.72, 0.84, 1.0] + warmth * [1.0, 0.86, 0.70]
    # At a corner a texel spans a third of the angle it spans at the centre.
    reach = int(np.ceil(3 * 3.5 * sigma.max() * size / 2))
    for face, axes in enumerate(FACE_AXES):
        on_face = stars @ axes.T
        # Half the length is short of a corner's 0.577, with room for the star's radius.
        for k in np.flatnonzero(on_face[:, 2] > 0.5):
            column, row = ((on_face[k, :2] / on_face[k, 2] + 1) / 2 * size).astype(np.int64)
            rows = slice(max(row - reach, 0), max(row + reach + 1, 0))
            columns = slice(max(column - reach, 0), max(column + reach + 1, 0))
            gap = np.sum((view[face, rows, columns] - stars[k]) ** 2, -1)
            dot = brightness[k] * np.exp(-gap / (2 * sigma[k] ** 2))
            sky[face, rows, columns] += dot[..., None] * tint[k]


def make_sky() -> npt.NDArray[np.uint8]:
    """The starfield as six faces, uint8, shape (6, 512, 512, 3)."""
    rng = np.random.Generator(np.random.PCG64(SKY_SEED))
    pole = np.array([0.35, 0.78, 0.52])
    pole /= np.linalg.norm(pole)
    sky = nebula(face_directions(FACE_SIZE), rng, pole)
    add_stars(sky, rng, pole)
    return (np.clip(sky, 0, 1) * 255 + 0.5).astype(np.uint8)


def write_face(path: Path, face: npt.NDArray[np.uint8]) -> None:
    """Write one face as an 8-bit RGB PNG.

    Raises
    ------
    ModuleNotFoundError
        OpenImageIO is not installed.
    OSError
        The file cannot be written.
    """
    try:
        import OpenImageIO as oiio
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "writing the starfield needs OpenImageIO: pip install vkbloom[images]"
        ) from error
    height, width, channels = face.shape
    spec = oiio.ImageSpec(width, height, channels, "uint8")
    spec.attribute("png:compressionLevel", 9)
    image = oiio.ImageBuf(spec)
    if not (image.set_pixels(oiio.ROI(), face) and image.write(str(path))):
        raise OSError(f"{path}: {image.geterror()}")


def pack(folder: Path, path: Path) -> None:
    """Write the arrays of the scene in `folder` to one file of compressed arrays."""
    import vkbloom

    faces = [folder / f"starfield_{name}.png" for name in FACE_NAMES]
    files = (folder / "saucer.gltf", folder / "saucer_glow.gltf")
    scene = vkbloom.Scene.from_gltf(files[0], glow=files[1], skybox=faces)
    arrays = {"glow_emission": scene.glow.emission, "sky": scene.skybox.levels[0]}
    for name, mesh in (("body", scene.body), ("glow", scene.glow)):
        # All indices fit 16 bits, of which half as many bytes are to be read.
        arrays[f"{name}_indices"] = mesh.indices.astype(np.uint16)
        arrays[f"{name}_vertices"] = mesh.vertices
    np.savez_compressed(path, **arrays)


def write_files(folder: Path) -> None:
    """Write the scene as glTF and images into `folder`, which is made where it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    meshes = body_meshes()
    write_gltf(folder / "saucer.gltf", saucer(with_beam=False), meshes, glow=False)
    glow_meshes = meshes | {"beam": beam_mesh()}
    write_gltf(folder / "saucer_glow.gltf", saucer(with_beam=True), glow_meshes, glow=True)
    for name, face in zip(FACE_NAMES, make_sky(), strict=True):
        write_face(folder / f"starfield_{name}.png", face)


def main() -> None:
    """Read the command line and write the scene."""
    parser = argparse.ArgumentParser(description="Make the built-in scene of vkbloom.")
    parser.add_argument("--out", type=Path, help="folder to write all files into")
    out = parser.parse_args().out
    write_files(out or FILES)
    pack(out or FILES, (out or PACKED) / "ufo.npz")


if __name__ == "__main__":
    main()
