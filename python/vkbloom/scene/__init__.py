"""Scenes: meshes with materials, a camera, a sky; glTF files and skies are read here."""

from __future__ import annotations

from vkbloom.scene.mesh import Mesh
from vkbloom.scene.scene import Camera, Scene
from vkbloom.scene.skybox import Cubemap

__all__ = ["Camera", "Cubemap", "Mesh", "Scene"]
