"""Blender's Glare node, run by its Python module (package bpy)."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

# The node's sockets by the fields of `vkbloom.BlenderGlare`.
_SOCKETS = {
    "threshold": "Highlights Threshold",
    "smoothness": "Highlights Smoothness",
    "intensity": "Strength",
    "saturation": "Saturation",
    "size": "Size",
    "streaks": "Streaks",
    "iterations": "Iterations",
    "fade": "Fade",
    "color_modulation": "Color Modulation",
    "diagonal": "Diagonal Star",
    "sun_position": "Sun Position",
    "jitter": "Jitter",
}
_OUTPUTS = {"glow": "Highlights", "glare": "Glare", "final": "Image"}


class Blender:
    """A scene whose compositor has an image, a kernel, a glare node and a file for each output."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        scene = bpy.context.scene
        scene.render.image_settings.file_format = "PNG"
        scene.render.filepath = str(Path(self._folder.name, "rest"))
        scene.render.compositor_device = "CPU"
        scene.render.compositor_precision = "FULL"
        tree = scene.compositing_node_group = bpy.data.node_groups.new(
            "glare", "CompositorNodeTree"
        )
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        self._tree = tree
        self._image, self._kernel = (tree.nodes.new("CompositorNodeImage") for _ in range(2))
        self._glare = tree.nodes.new("CompositorNodeGlare")
        values = {one.identifier: getattr(one, "default_value", 0) for one in self._glare.inputs}
        self._defaults = {
            name: tuple(values[socket]) if name == "sun_position" else values[socket]
            for name, socket in _SOCKETS.items()
        }
        tree.links.new(self._image.outputs["Image"], self._glare.inputs["Image"])
        group = tree.nodes.new("NodeGroupOutput")
        tree.links.new(self._glare.outputs["Image"], group.inputs[0])
        self._file = tree.nodes.new("CompositorNodeOutputFile")
        self._file.directory = self._folder.name
        self._file.file_name = ""
        self._file.format.media_type = "IMAGE"
        self._file.format.file_format = "OPEN_EXR"
        self._file.format.color_depth = "32"
        self._file.format.color_mode = "RGBA"
        self._file.save_as_render = False
        for name in _OUTPUTS.values():
            self._file.file_output_items.new("RGBA", name)
            tree.links.new(self._glare.outputs[name], self._file.inputs[name])

    def versions(self) -> dict[str, str]:
        """Return the version of Blender."""
        return {"Blender": bpy.app.version_string}

    def render(self, image: np.ndarray, parameters: dict[str, Any]) -> dict[str, np.ndarray]:
        """Return Highlights, Glare and Image of a frame, top row first: "glow", "glare", "final".

        `parameters` are fields of `vkbloom.BlenderGlare`; `kernel` is an array.
        """
        sockets = {socket.identifier: socket for socket in self._glare.inputs}
        for name, socket in _SOCKETS.items():
            sockets[socket].default_value = parameters.get(name, self._defaults[name])
        title = parameters["type"].replace("_", " ").title()
        sockets["Type"].default_value = title
        sockets["Quality"].default_value = parameters.get("quality", "high").title()
        sockets["Streaks Angle"].default_value = math.radians(parameters.get("streaks_angle", 0))
        maximum = parameters.get("maximum")
        sockets["Clamp Highlights"].default_value = maximum is not None
        sockets["Maximum Highlights"].default_value = maximum or 0.0
        sockets["Tint"].default_value = (*parameters.get("tint", (1, 1, 1)), 1)
        self._set(self._image, image)
        if (kernel := parameters.get("kernel")) is not None:
            sockets["Kernel Data Type"].default_value = "Color"
            self._set(self._kernel, np.asarray(kernel, np.float32))
            self._tree.links.new(self._kernel.outputs["Image"], sockets["Color Kernel"])
        bpy.ops.render.render(write_still=False)
        return {key: self._read(name) for key, name in _OUTPUTS.items()}

    def _set(self, node: Any, array: np.ndarray) -> None:
        if node.image:
            bpy.data.images.remove(node.image)
        height, width = array.shape[:2]
        rgba = np.ones((height, width, 4), np.float32)
        rgba[..., : array.shape[2] if array.ndim == 3 else 3] = np.atleast_3d(array)
        picture = bpy.data.images.new("input", width, height, alpha=True, float_buffer=True)
        picture.colorspace_settings.name = "Non-Color"
        picture.alpha_mode = "PREMUL"
        picture.pixels.foreach_set(np.ascontiguousarray(rgba[::-1]).ravel())
        picture.update()
        node.image = picture
        if node is self._image:
            render = bpy.context.scene.render
            render.resolution_x, render.resolution_y = width, height
            render.resolution_percentage = 100

    def _read(self, name: str) -> np.ndarray:
        (path,) = Path(self._folder.name).glob(f"{name}*.exr")
        picture = bpy.data.images.load(str(path))
        picture.colorspace_settings.name = "Non-Color"
        width, height = picture.size
        pixels = np.empty(width * height * 4, np.float32)
        picture.pixels.foreach_get(pixels)
        bpy.data.images.remove(picture)
        path.unlink()
        return pixels.reshape(height, width, 4)[::-1].copy()
