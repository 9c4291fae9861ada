"""Scenes that show given images, so that a test chooses every pixel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.scene.parts import WHITE, Material, Mesh, Texture
from vkbloom import Camera, Frames, Renderer, Scene, Settings

# The model matrix of time 0 moves a mesh by (0, -1, 0.25); this camera takes that back and stands
# DISTANCE away from the plane z = 0, looking straight at it.
DISTANCE = 10.0
CAMERA = Camera(position=(0.0, 1.0, -DISTANCE - 0.25), rotation=(0.0, 0.0, 0.0), fov=45.0)

# A triangle without an area: a body must be there, but nothing of it is drawn.
NOTHING = Mesh(np.zeros((3, 9), np.float32), np.arange(3, dtype=np.uint32))

# Two triangles a square, once in each winding, one of which is culled.
SQUARE = np.array([0, 1, 2, 0, 2, 3, 2, 1, 0, 3, 2, 0], np.uint32)


def screen(image: NDArray[Any], frame: tuple[int, int]) -> Scene:
    """Return a scene whose glow, at time 0, is the image over a whole frame of that aspect.

    Bloom buffers of the image's size get its very pixels; larger ones see them as squares. Black
    pixels are left out, which looks the same and is quicker.

    Parameters
    ----------
    image : ndarray, shape (H, W, 3)
        Linear colours, 0 or more.
    frame : (int, int)
        Width and height of the frame that the scene is for.
    """
    height, width, _ = image.shape
    top = DISTANCE * math.tan(math.radians(CAMERA.fov / 2))
    right = top * frame[0] / frame[1]
    xs, ys = np.linspace(-right, right, width + 1), np.linspace(-top, top, height + 1)
    rows, columns = np.nonzero(image.any(axis=2))
    vertices = np.zeros((len(rows), 4, 9), np.float32)
    for corner, (down, across) in enumerate([(0, 0), (0, 1), (1, 1), (1, 0)]):
        vertices[:, corner, 0] = xs[columns + across]
        vertices[:, corner, 1] = ys[rows + down]
    vertices[:, :, 5] = 1.0
    vertices[:, :, 6:] = image[rows, columns][:, np.newaxis]
    indices = np.arange(len(rows), dtype=np.uint32)[:, np.newaxis] * 4 + SQUARE
    return Scene(body=NOTHING, glow=Mesh(vertices.reshape(-1, 9), indices.ravel()), camera=CAMERA)


def panel(
    frame: tuple[int, int],
    base: Texture = WHITE,
    emission: Texture = WHITE,
    *,
    places: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0),
    across: tuple[float, float] = (0.0, 1.0),
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0),
    radiance: tuple[float, float, float] | None = None,
) -> Mesh:
    """Return a mesh that shows textures over a whole frame of that size, at time 0.

    Parameters
    ----------
    places
        u and v at the top left corner, u and v at the bottom right one.
    across
        The part of the frame's width that it covers, 0..1 being all of it.
    """
    top = DISTANCE * math.tan(math.radians(CAMERA.fov / 2))
    right = top * frame[0] / frame[1]
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    vertices = np.zeros((4, 9), np.float32)
    vertices[:, 0] = (2 * np.array(across)[corners[:, 0]] - 1) * right
    vertices[:, 1] = (2 * corners[:, 1] - 1) * top
    vertices[:, 5] = 1.0
    vertices[:, 6:] = colour
    u, v = np.array(places)[[0, 2]][corners[:, 0]], np.array(places)[[1, 3]][corners[:, 1]]
    return Mesh(
        vertices,
        SQUARE,
        None if radiance is None else np.tile(np.array(radiance, np.float32), (4, 1)),
        np.stack((u, v, u, v), axis=1).astype(np.float32),
        (Material(len(SQUARE), base, emission),),
    )


def noise(size: tuple[int, int], highest: float = 1.0) -> NDArray[np.float64]:
    """Return random colours of (width, height), half of the pixels black, 0 to `highest`."""
    generator = np.random.default_rng(size)
    colours = generator.random((size[1], size[0], 3)) * highest
    colours[generator.random(colours.shape[:2]) < 0.5] = 0.0
    # Never all black: a mesh needs a triangle.
    colours[0, 0] = highest
    return colours


SIZE = (320, 180)
GBUFFER = ["albedo", "normal", "position", "brightness", "depth"]
BLURRED = ["blur_vertical", "bloom"]


def render_deferred(
    renderer: Renderer,
    scene: Scene,
    settings: Settings | None = None,
    size: tuple[int, int] = SIZE,
    **more: Any,
) -> Frames:
    return renderer.render(scene, settings, size, shading="deferred", **more)


def rgb(image: NDArray[Any]) -> NDArray[np.float64]:
    return image[..., :3].astype(np.float64)
