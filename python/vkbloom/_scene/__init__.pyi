# The names of `vkbloom._scene`; lazy_loader reads them, and imports what is asked for.
from .mesh import Mesh
from .scene import Camera, Scene
from .skybox import Cubemap

__all__ = [
    "Camera",
    "Cubemap",
    "Mesh",
    "Scene",
]
