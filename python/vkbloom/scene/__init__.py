"""Scenes: meshes with materials, a camera, a sky; glTF files and skies are read here."""

from __future__ import annotations

from vkbloom.scene.scene import Camera, Mesh, Scene
from vkbloom.scene.skybox import Cubemap

__all__ = ["Camera", "Cubemap", "Mesh", "Scene"]
