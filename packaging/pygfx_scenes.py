"""Draw scenes with pygfx, as its screenshot tests do: lit meshes, a texture, a colormap, lines.

With ``--examples`` these are the examples of a checkout of pygfx whose screenshots its own tests
compare, drawn as those tests draw them.

pygfx draws into sRGB with 8 bits, which Mesa encodes by approximate square roots where the CPU has
them.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygfx as gfx
from rendercanvas.offscreen import OffscreenRenderCanvas

SIZE = (320, 200)


def picture() -> np.ndarray:
    """Make a picture of 64 x 64 texels, of integers."""
    index = np.arange(64 * 64 * 3, dtype=np.uint64)
    return ((index * 2654435761 >> 13) % 256).reshape(64, 64, 3).astype(np.uint8)


def kept(name: str, geometry: gfx.Geometry, folder: Path) -> gfx.Geometry:
    """Return a geometry with the numbers of the first run, since NumPy's sines differ by CPU."""
    file = folder / f"{name}.npz"
    parts = {part: getattr(geometry, part).data for part in ("positions", "normals", "texcoords")}
    if not file.exists():
        np.savez(file, **parts)
    with np.load(file) as first:
        for part, data in parts.items():
            data[:] = first[part]
    return geometry


def scenes(folder: Path) -> Iterator[tuple[str, gfx.Scene]]:
    """Yield the scenes, with a name each; meshes are kept in the folder."""
    lit = gfx.Scene()
    knot = gfx.Mesh(
        kept("knot", gfx.torus_knot_geometry(1, 0.3, 96, 18), folder),
        gfx.MeshPhongMaterial(color="#447cff", shininess=40),
    )
    lit.add(knot, gfx.AmbientLight(intensity=0.4), gfx.DirectionalLight(intensity=2.5))
    yield "phong", lit

    physical = gfx.Scene()
    for number in range(3):
        ball = gfx.Mesh(
            kept("ball", gfx.sphere_geometry(0.6, 32, 16), folder),
            gfx.MeshStandardMaterial(color="#ff8844", roughness=0.2 + 0.3 * number, metalness=0.6),
        )
        ball.local.x = 1.4 * (number - 1)
        physical.add(ball)
    physical.add(gfx.AmbientLight(intensity=0.3), gfx.PointLight(intensity=20))
    yield "standard", physical

    textured = gfx.Scene()
    box = gfx.Mesh(
        gfx.box_geometry(2, 2, 2),
        gfx.MeshBasicMaterial(map=gfx.Texture(picture(), dim=2, colorspace="srgb")),
    )
    box.local.rotation = (0.2, 0.3, 0.1, 0.927)
    textured.add(gfx.Background.from_color("#224466", "#ffcc88"), box)
    yield "texture", textured

    image = gfx.Scene()
    values = np.linspace(0, 1, 64 * 64, dtype=np.float32).reshape(64, 64)
    shown = gfx.Image(
        gfx.Geometry(grid=gfx.Texture(values, dim=2)),
        gfx.ImageBasicMaterial(clim=(0, 1), map=gfx.cm.viridis, interpolation="linear"),
    )
    shown.local.scale = (0.05, 0.05, 1)
    shown.local.position = (-1.6, -1.6, 0)
    image.add(shown)
    yield "colormap", image

    curve = np.zeros((200, 3), np.float32)
    curve[:, 0] = np.linspace(-2, 2, 200)
    curve[:, 1] = (np.arange(200) * 37 % 101 - 50) / 50
    lines = gfx.Scene()
    lines.add(
        gfx.Line(gfx.Geometry(positions=curve), gfx.LineMaterial(thickness=3, color="#33ddaa")),
        gfx.Points(
            gfx.Geometry(positions=curve[::9]), gfx.PointsMaterial(size=12, color="#ffffff")
        ),
    )
    yield "lines", lines


def examples(folder: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the pictures of the examples that pygfx's tests compare, with a name each."""
    # As those tests have it. An offscreen canvas is chosen at the import.
    os.environ |= {"WGPU_FORCE_OFFSCREEN": "true", "PYGFX_DEFAULT_PPAA": "none"}
    # Some are animated, or have random numbers.
    time.time = lambda: 1.23456
    for file in sorted(folder.rglob("*.py")):
        if "pygfx_test = 'compare'" not in file.read_text():
            continue
        np.random.seed(0)  # noqa: NPY002  the examples' own
        spec = importlib.util.spec_from_file_location(file.stem, file)
        assert spec
        assert spec.loader
        module = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
            drawn = np.asarray(module.renderer.target.draw()).copy()
            if drawn.dtype == np.uint8:
                yield file.stem, drawn
        except Exception as error:
            # A package or a file of the network is missing.
            print(f"{file.stem}: {type(error).__name__}: {error}", file=sys.stderr, flush=True)


def main() -> None:
    """Write the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arrays", type=Path, required=True)
    parser.add_argument("--only", nargs="+", help="scenes, by name; by default all")
    parser.add_argument("--examples", type=Path, help="the examples of a checkout instead")
    options = parser.parse_args()
    if options.examples:
        np.savez(options.arrays, **dict(examples(options.examples)))
        return
    canvas = OffscreenRenderCanvas(size=SIZE, pixel_ratio=1)
    renderer = gfx.renderers.WgpuRenderer(canvas)
    camera = gfx.PerspectiveCamera(50, SIZE[0] / SIZE[1])
    camera.local.z = 5
    drawn = {}
    for name, scene in scenes(options.arrays.parent):
        if options.only is None or name in options.only:

            def draw(scene: gfx.Scene = scene) -> None:
                renderer.render(scene, camera)

            canvas.request_draw(draw)
            drawn[name] = np.asarray(canvas.draw()).copy()
    np.savez(options.arrays, **drawn)


if __name__ == "__main__":
    main()
