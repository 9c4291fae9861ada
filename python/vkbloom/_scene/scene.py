"""Scenes: meshes, the sky and the camera, as immutable values.

Loading needs no Vulkan. The data of a scene is read-only. So a renderer keeps its uploaded data as
long as the serial of the scene's contents stays the same.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import sys
import weakref
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from vkbloom._argument_types import check_arguments
from vkbloom._numbers import check_above, check_floats, check_number
from vkbloom._public import public
from vkbloom._scene import gltf
from vkbloom._scene import skybox as sky
from vkbloom._scene.arrays import Constructed
from vkbloom._scene.mesh import Mesh
from vkbloom._scene.skybox import Cubemap, SkyboxSource

if TYPE_CHECKING:
    from vkbloom import _core

_serials = itertools.count(1)


class _Contents:
    """What all living scenes with the same meshes and sky share.

    - `serial`: Their number.
    - `core`: What the core has checked and holds of them; None: no frame was rendered.
    """

    def __init__(self) -> None:
        self.serial = next(_serials)
        self.core: _core.SceneContents | None = None


#: By the ids of body, glow and sky. A scene refers to its contents and to these three, so that no
#: other object can have one of these ids while the entry exists.
_contents: weakref.WeakValueDictionary[tuple[int, int, int], _Contents] = (
    weakref.WeakValueDictionary()
)

# The arrays of the built-in scene, packed from the files in examples/saucer, as its README.md says.
_UFO: Final = Path(__file__).parents[1] / "assets" / "ufo.npz"


@public("vkbloom")
@dataclass(frozen=True)
class Camera:
    """A look-at camera: view = translate(position) rotate(x) rotate(y) rotate(z).

    Parameters
    ----------
    position : (float, float, float)
        Translation xyz of the world in view space, in scene units. The camera looks along -z and
        y points down.
    rotation : (float, float, float)
        Angles about x, y and z in degrees.
    fov : float
        Vertical field of view in degrees, over 0 and under 180.
    near, far : float
        Distances of the clip planes in scene units, 0 < near < far. They do not cut the sky.
    """

    position: tuple[float, float, float] = (0.0, 0.0, -10.25)
    rotation: tuple[float, float, float] = (7.5, -343.0, 0.0)
    fov: float = 45.0
    near: float = 0.1
    far: float = 256.0

    def __post_init__(self) -> None:
        for name in ("position", "rotation"):
            values = check_floats(name, getattr(self, name))
            if len(values) != 3:
                raise ValueError(f"{name}: {values!r} is not three numbers")
            object.__setattr__(self, name, values)
        for name in ("fov", "near", "far"):
            object.__setattr__(self, name, check_above(name, getattr(self, name)))
        check_above("far", self.far, self.near)
        if self.fov >= 180.0:
            raise ValueError(f"fov: {self.fov} is out of range, above 0 and below 180")


@public("vkbloom")
@dataclass(frozen=True, eq=False, repr=False)
class Scene(Constructed):
    """A body, a glow mesh, a sky, and the camera.

    Parameters
    ----------
    body : Mesh
        The mesh that is lit.
    glow : Mesh or None
        The mesh that glows. None: what the body emits glows.
    skybox : Cubemap or None
        The sky, or None for black.
    camera : Camera
        The camera from which the scene is seen.
    glow_intensity : float
        Factor of the glow mesh's colour as emitted radiance in the deferred system, 0 or more.

    Attributes
    ----------
    serial : int
        A number that no other scene of this process has.
    """

    body: Mesh
    glow: Mesh | None = None
    skybox: Cubemap | None = None
    camera: Camera = field(default_factory=Camera)
    glow_intensity: float = 1.0
    serial: int = field(init=False, default_factory=lambda: next(_serials))
    _contents: _Contents = field(init=False)

    def __post_init__(self) -> None:
        for name, kind, optional in (
            ("body", Mesh, False),
            ("glow", Mesh, True),
            ("skybox", Cubemap, True),
            ("camera", Camera, False),
        ):
            value = getattr(self, name)
            if not isinstance(value, kind) and not (optional and value is None):
                needed = f"{kind.__name__} or None" if optional else kind.__name__
                raise TypeError(f"{name}: {type(value).__name__} is not a {needed}")
        intensity = check_number("glow_intensity", self.glow_intensity, 0, sys.float_info.max)
        object.__setattr__(self, "glow_intensity", intensity)
        key = (id(self.body), id(self.glow), id(self.skybox))
        object.__setattr__(self, "_contents", _contents.setdefault(key, _Contents()))

    @property
    def contents_serial(self) -> int:
        """A number that only scenes with the same meshes and sky share, whatever their camera."""
        return self._contents.serial

    @classmethod
    def ufo(cls) -> Scene:
        """Return the built-in scene: a saucer, its glow mesh and a field of stars."""
        with np.load(_UFO) as arrays:
            body, glow = (
                Mesh(arrays[f"{name}_vertices"], arrays[f"{name}_indices"].astype(np.uint32))
                for name in ("body", "glow")
            )
            glow = dataclasses.replace(glow, emission=arrays["glow_emission"])
            return cls(body, glow, sky.from_array(arrays["sky"]))

    @classmethod
    @check_arguments
    def from_gltf(
        cls,
        base: str | os.PathLike[str],
        *,
        glow: str | os.PathLike[str] | None = None,
        skybox: SkyboxSource | None = None,
        glow_intensity: float = 1.0,
        camera: Camera | None = None,
    ) -> Scene:
        """Load a scene from glTF or GLB files.

        Parameters
        ----------
        base : str or path-like
            File of the mesh that is lit. `vkbloom._scene.gltf.load_mesh` lists what is read.
        glow : str or path-like, optional
            File of the mesh that glows. None: what the materials of `base` emit glows.
        skybox : str, path-like, sequence of these, ndarray or Cubemap, optional
            A path to a KTX 1 cubemap or to an equirectangular image, six paths to face images
            (+x, -x, +y, -y, +z, -z), an array ``(6, N, N, C)`` of uint8, float16 or float32 with C
            3 or 4, a Cubemap, or None.
        glow_intensity : float
            Factor of the glow mesh's colour in the deferred system, 0 or more.
        camera : Camera, optional
            None: ``Camera()``.

        Returns
        -------
        Scene
        """
        return cls(
            body=gltf.load_mesh(base),
            glow=None if glow is None else gltf.load_mesh(glow),
            skybox=None if skybox is None else sky.load(skybox),
            camera=Camera() if camera is None else camera,
            glow_intensity=glow_intensity,
        )

    def __repr__(self) -> str:
        camera, sky = self.camera, self.skybox
        size = f"{sky.size} x {sky.size} {sky.dtype}, levels: {len(sky.levels)}" if sky else "none"
        return (
            f"Scene(body: {self.body.summary}; glow: {self.glow.summary if self.glow else 'none'}; "
            f"glow intensity: {self.glow_intensity:g}; skybox: {size}; "
            f"camera: position {camera.position}, rotation {camera.rotation}, "
            f"fov {camera.fov:g}, near {camera.near:g}, far {camera.far:g})"
        )
