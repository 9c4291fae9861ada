"""Scenes: meshes, the sky and the camera, as immutable values.

Loading needs no Vulkan. What a scene holds is read-only, so a renderer may keep what it uploaded
for as long as the scene's serial stays the same.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import resources
from numbers import Real
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.scene import skybox as sky
from vkbloom.scene.skybox import Cubemap, SkyboxSource, read_only
from vkbloom.scene.textures import WHITE, Surface

_serials = itertools.count(1)
_FACE_SUFFIXES: Final = ("px", "nx", "py", "ny", "pz", "nz")


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """Triangles with normals and colours, some of them with textures.

    Parameters
    ----------
    vertices
        ``(N, 9)`` float32, all finite: position xyz, normal xyz, linear colour rgb of each vertex.
        y points down, as the renderer expects it.
    indices
        ``(M,)`` uint32, M a positive multiple of 3, each under N: the triangles.
    emission
        ``(N, 3)`` float32, finite, or None where nothing emits: radiance rgb of each vertex, which
        the deferred system adds to `brightness`.
    texcoords
        ``(N, 4)`` float32, finite, or None where there are no surfaces: where in the base texture
        each vertex lies, then where in the emission's; (0, 0) is the top left corner of a texture,
        (1, 1) the bottom right one.
    surfaces
        The textures of the last triangles: each `Surface` takes its `index_count` entries of
        `indices`, one after the other, the last one to the end. Triangles before the first have
        none.

    Arrays are copied unless they are read-only, C-contiguous owners of their memory.

    Raises
    ------
    TypeError
        An array has another type or dtype, or a surface another type.
    ValueError
        An array has another shape, or holds values out of range; surfaces take more indices than
        there are, or have no texture coordinates.
    """

    vertices: NDArray[np.float32]
    indices: NDArray[np.uint32]
    emission: NDArray[np.float32] | None = None
    texcoords: NDArray[np.float32] | None = None
    surfaces: tuple[Surface, ...] = ()

    def __post_init__(self) -> None:
        _check_array("vertices", self.vertices, np.float32, 9)
        count = len(self.vertices)
        if not 0 < count <= 2**32 - 1:
            raise ValueError(f"vertices has {count} rows; 1..{2**32 - 1} are needed")
        _check_array("indices", self.indices, np.uint32, None)
        if len(self.indices) == 0 or len(self.indices) % 3:
            raise ValueError(
                f"indices has {len(self.indices)} entries; a positive multiple of 3 is needed"
            )
        if (highest := int(self.indices.max())) >= count:
            raise ValueError(f"indices has {highest}; there are {count} vertices")
        object.__setattr__(self, "vertices", read_only(self.vertices))
        object.__setattr__(self, "indices", read_only(self.indices))
        for name, columns in (("emission", 3), ("texcoords", 4)):
            array = getattr(self, name)
            if array is not None:
                _check_array(name, array, np.float32, columns)
                if len(array) != count:
                    raise ValueError(f"{name} has {len(array)} rows; {count} are needed")
                object.__setattr__(self, name, read_only(array))
        self._check_surfaces()

    def _check_surfaces(self) -> None:
        object.__setattr__(self, "surfaces", tuple(self.surfaces))
        for surface in self.surfaces:
            if not isinstance(surface, Surface):
                raise TypeError(f"surfaces must hold Surfaces, not {surface!r}")
        taken = sum(surface.index_count for surface in self.surfaces)
        if taken > len(self.indices):
            raise ValueError(f"surfaces take {taken} indices; there are {len(self.indices)}")
        if self.surfaces and self.texcoords is None:
            raise ValueError("texcoords is None; surfaces need texture coordinates")

    def __reduce__(self) -> tuple[type[Mesh], tuple[Any, ...]]:
        # Through the constructor, because NumPy pickles do not keep arrays read-only.
        arrays = (self.vertices, self.indices, self.emission, self.texcoords)
        return Mesh, (*arrays, self.surfaces)

    def __repr__(self) -> str:
        return f"Mesh({self.summary})"

    @property
    def summary(self) -> str:
        """Its size in words."""
        size = f"{len(self.indices) // 3} triangles, {len(self.vertices)} vertices"
        if not self.surfaces:
            return size
        textures = {texture for part in self.surfaces for texture in (part.base, part.emission)}
        return f"{size}, textures: {len(textures - {WHITE})}"


@dataclass(frozen=True)
class Camera:
    """A look-at camera: view = translate(position) rotate(x) rotate(y) rotate(z).

    Parameters
    ----------
    position : (float, float, float)
        Translation xyz of the world in view space, in scene units. The camera looks along -z and
        y points down.
    rotation : (float, float, float)
        Degrees about x, y and z.
    fov : float
        Vertical field of view in degrees, over 0 and under 180.
    near, far : float
        Distances of the clip planes in scene units, 0 < near < far. They do not cut the sky.

    Raises
    ------
    TypeError
        A field is no number, or no three numbers.
    ValueError
        A field is not finite or out of range.
    """

    position: tuple[float, float, float] = (0.0, 0.0, -10.25)
    rotation: tuple[float, float, float] = (7.5, -343.0, 0.0)
    fov: float = 45.0
    near: float = 0.1
    far: float = 256.0

    def __post_init__(self) -> None:
        for name in ("position", "rotation"):
            value: Any = getattr(self, name)
            if isinstance(value, (str, bytes)) or not isinstance(value, (Sequence, np.ndarray)):
                raise TypeError(f"{name} must be three numbers, not {value!r}")
            if len(value) != 3:
                raise ValueError(f"{name} has {len(value)} entries; three are needed")
            triple = tuple(_number(f"{name}[{i}]", entry) for i, entry in enumerate(value))
            object.__setattr__(self, name, triple)
        for name in ("fov", "near", "far"):
            object.__setattr__(self, name, _number(name, getattr(self, name)))
        if not 0.0 < self.fov < 180.0:
            raise ValueError(f"fov is {self.fov}; over 0 and under 180 degrees is needed")
        if not self.near > 0.0:
            raise ValueError(f"near is {self.near}; over 0 is needed")
        if not self.far > self.near:
            raise ValueError(f"far is {self.far}; over near ({self.near}) is needed")


@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """What is rendered: a body, a glow mesh, a sky, and the camera that looks at them.

    Parameters
    ----------
    body : Mesh
        The mesh that is lit.
    glow : Mesh or None
        The mesh that glows, or None.
    skybox : Cubemap or None
        The sky, or None for black.
    camera : Camera
        Where it is seen from.
    glow_intensity : float
        Factor of the glow mesh's colour as emitted radiance in the deferred system, 0 or more.

    Attributes
    ----------
    serial : int
        A number that no other scene of this process has.

    Raises
    ------
    TypeError
        A field has another type.
    ValueError
        `glow_intensity` is negative or not finite.
    """

    body: Mesh
    glow: Mesh | None = None
    skybox: Cubemap | None = None
    camera: Camera = field(default_factory=Camera)
    glow_intensity: float = 1.0
    serial: int = field(init=False, default_factory=lambda: next(_serials))

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
                raise TypeError(f"{name} must be a {needed}, not {type(value).__name__}")
        intensity = _number("glow_intensity", self.glow_intensity)
        if intensity < 0.0:
            raise ValueError(f"glow_intensity is {intensity}; 0 or more is needed")
        object.__setattr__(self, "glow_intensity", intensity)

    def __reduce__(self) -> tuple[type[Scene], tuple[Any, ...]]:
        # A copy gets a serial of its own: in another process this one's may be taken.
        return Scene, (self.body, self.glow, self.skybox, self.camera, self.glow_intensity)

    @classmethod
    def ufo(cls) -> Scene:
        """Return the built-in scene: a saucer, its glow mesh and a field of stars.

        Returns
        -------
        Scene
            A new scene on every call; the files are read again.

        Raises
        ------
        ModuleNotFoundError
            pygltflib or OpenImageIO is not installed.
        """
        # The folder as a whole, because the glTF files refer to others in it.
        with resources.as_file(resources.files("vkbloom") / "assets") as assets:
            return cls.from_gltf(
                assets / "saucer.gltf",
                glow=assets / "saucer_glow.gltf",
                skybox=[assets / f"starfield_{suffix}.png" for suffix in _FACE_SUFFIXES],
            )

    @classmethod
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
            File of the mesh that is lit; see `vkbloom.scene.gltf.load_mesh` for what is read.
        glow : str or path-like, optional
            File of the mesh that glows, or None.
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

        Raises
        ------
        TypeError
            An argument has another type.
        OSError
            A file is not there or cannot be read.
        ValueError
            A file is damaged or holds no triangles, or an argument is out of range.
        ModuleNotFoundError
            pygltflib, or OpenImageIO for an image, is not installed.
        """
        # Imported late because gltf.py makes the Mesh defined here.
        from vkbloom.scene import gltf  # noqa: PLC0415

        for name, path in (("base", base), ("glow", "" if glow is None else glow)):
            if not isinstance(path, str | os.PathLike):
                raise TypeError(f"{name}: a path is needed, not {path!r}")
        return cls(
            body=gltf.load_mesh(base),
            glow=None if glow is None else gltf.load_mesh(glow),
            skybox=None if skybox is None else sky.load(skybox),
            camera=Camera() if camera is None else camera,
            glow_intensity=glow_intensity,
        )

    def with_camera(self, camera: Camera) -> Scene:
        """Return a scene that shares everything with this one but the camera.

        `dataclasses.replace` does the same for any field.

        Parameters
        ----------
        camera : Camera

        Returns
        -------
        Scene

        Raises
        ------
        TypeError
            `camera` is none.
        """
        return dataclasses.replace(self, camera=camera)

    def _rows(self) -> list[tuple[str, str]]:
        camera = self.camera
        sky_levels = (
            "none"
            if self.skybox is None
            else f"{self.skybox.size} x {self.skybox.size} {self.skybox.dtype}, "
            f"levels: {len(self.skybox.levels)}"
        )
        return [
            ("body", self.body.summary),
            ("glow", "none" if self.glow is None else self.glow.summary),
            ("glow intensity", f"{self.glow_intensity:g}"),
            ("skybox", sky_levels),
            (
                "camera",
                (
                    f"position {camera.position}, rotation {camera.rotation}, "
                    f"fov {camera.fov:g}, near {camera.near:g}, far {camera.far:g}"
                ),
            ),
        ]

    def __repr__(self) -> str:
        return f"Scene({'; '.join(f'{name}: {value}' for name, value in self._rows())})"

    def _repr_html_(self) -> str:
        """Return the page of `display.scene_html`."""
        # Late: pictures are of no use where nobody looks.
        from vkbloom.views import display  # noqa: PLC0415

        return display.scene_html(self)


def _number(name: str, value: object) -> float:
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError(f"{name} must be a number, not {value!r}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{name} is {number}; a finite number is needed")
    return number


def _check_array(name: str, array: object, kind: type[np.generic], columns: int | None) -> None:
    """Check the dtype, the shape ``(n,)`` or ``(n, columns)``, and that all is finite."""
    if not isinstance(array, np.ndarray) or array.dtype != np.dtype(kind):
        given = array.dtype if isinstance(array, np.ndarray) else type(array).__name__
        raise TypeError(f"{name} must be an array of {np.dtype(kind)}, not {given}")
    fits = array.ndim == 1 if columns is None else array.ndim == 2 and array.shape[1] == columns
    if not fits:
        needed = "(n,)" if columns is None else f"(n, {columns})"
        raise ValueError(f"{name} has shape {array.shape}; {needed} is needed")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} holds NaN or infinity; finite values are needed")
