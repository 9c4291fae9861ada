"""Scenes: meshes with materials, a camera and a sky; readers of glTF files and skies."""

from __future__ import annotations

from vkbloom._scene.mesh import Mesh
from vkbloom._scene.scene import Camera, Scene
from vkbloom._scene.skybox import Cubemap

__all__ = ["Camera", "Cubemap", "Mesh", "Scene"]
