"""Scenes: meshes with materials, a camera and a sky; readers of glTF files and skies."""

from __future__ import annotations

from vkbloom.scene.mesh import Mesh
from vkbloom.scene.scene import Camera, Scene
from vkbloom.scene.skybox import Cubemap

__all__ = ["Camera", "Cubemap", "Mesh", "Scene"]
