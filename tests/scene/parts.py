"""Parts of scenes: their classes, and what the package reads of files and arrays.

Scenes are made of files or of parts; users have the parts from the scenes that they load.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final

from vkbloom import Scene
from vkbloom._scene import Cubemap, Mesh
from vkbloom._scene.textures import WHITE, Material, Texture, mip_levels

__all__ = ["WHITE", "Cubemap", "Material", "Mesh", "Texture", "load_mesh", "load_sky", "mip_levels"]

_TRIANGLE: Final = Path(__file__).with_name("triangle.gltf")


def load_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Return the mesh of a glTF file."""
    return Scene.from_gltf(path).body


def load_sky(source: Any) -> Cubemap:
    """Return the sky of an array, of a file or of six files."""
    sky = Scene.from_gltf(_TRIANGLE, skybox=source).skybox
    assert sky is not None
    return sky
