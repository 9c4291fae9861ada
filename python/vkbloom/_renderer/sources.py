"""The sources of frames: images and scenes, checked and converted for the core."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from vkbloom import _core
from vkbloom._image_arguments import (
    check_depth,
    check_emission,
    check_geometry,
    check_image,
    check_mask,
    check_motion,
)
from vkbloom._numbers import check_size, check_time
from vkbloom._renderer.device_arrays import ImportedArray, on_cuda, on_host, take
from vkbloom._renderer.image import Image
from vkbloom._settings.settings import check_shading

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from vkbloom._scene import Scene
    from vkbloom._settings.antialiasing import Antialiasing
    from vkbloom._settings.settings import Shading


#: The array of a state that says which frame of a scene it is of.
ANIMATION: Final = "animation"


class Moment(NamedTuple):
    """A frame of a scene's animation with temporal anti-aliasing, and what it continues.

    - `turns`: Its time. `before`: that of the frame before. Both are of one period.
    - `number`: How many frames there were before.
    """

    turns: float
    before: float
    number: int
    antialiasing: Antialiasing

    @classmethod
    def after(cls, state: Mapping[str, Any], time: float, antialiasing: Antialiasing) -> Moment:
        """Return the moment of a frame that continues a state."""
        turns = math.fmod(time, 1.0)
        if ANIMATION not in state:
            return cls(turns, turns, 0, antialiasing)
        numbers = np.asarray(state[ANIMATION], np.float64)
        if numbers.shape != (1, 1, 4) or not np.isfinite(numbers).all():
            raise ValueError(f"state: {ANIMATION} is not (1, 1, 4) finite numbers")
        before, number, _, _ = numbers[0, 0]
        return cls(turns, float(before), int(number), antialiasing)

    def offset(self, size: tuple[int, int]) -> tuple[float, float]:
        """Return by how much the picture is moved, in units of which it has two along each side."""
        own = getattr(self.antialiasing, "jitter", None)
        x, y = self.antialiasing.offset(self.number) if own is None else own
        return 2.0 * x / size[0], 2.0 * y / size[1]

    def array(self) -> NDArray[np.float32]:
        """Return what the next frame continues."""
        return np.array([[[self.turns, self.number + 1, 0.0, 1.0]]], np.float32)


#: Width and height of a scene's frame, where none are given.
SCENE_SIZE = (1280, 720)


class Geometry(NamedTuple):
    """What temporal anti-aliasing reads beside an image, as the caller gives it."""

    motion: Any = None
    depth: Any = None

    def check(self, size: tuple[int, int], core: _core.Renderer | None) -> Geometry:
        """Return the arrays for an image of that height and width, or copies on the device.

        The values of the latter are not known here: the device takes what is not finite as 0.
        """
        motion, depth = self
        if core and on_cuda(motion):
            motion = _take_geometry(motion, "motion", (*size, 2), core)
        elif motion is not None:
            motion = check_motion(motion, size)
        if core and on_cuda(depth):
            depth = _take_geometry(depth, "depth", size, core)
        elif depth is not None:
            depth = check_depth(depth, size)
        return Geometry(motion, depth)

    def refuse(self, reason: str) -> None:
        """Raise ValueError if there is a motion or a depth."""
        for name, given in self._asdict().items():
            if given is not None:
                raise ValueError(f"{name}: {reason}")

    def core_arguments(self) -> tuple[Any, ...]:
        """Return motion along x and y and depth."""
        motion, depth = self
        axes: tuple[Any, Any] = None, None
        if isinstance(motion, ImportedArray):
            axes = motion.plane(0).image(), motion.plane(1).image()
        elif motion is not None:
            axes = motion[..., 0], motion[..., 1]
        return *axes, depth.plane().image() if isinstance(depth, ImportedArray) else depth


def _take_geometry(
    given: Any, name: str, shape: tuple[int, ...], core: _core.Renderer
) -> ImportedArray:
    """Copy a motion or a depth on the device."""
    array = take(given, name, core, (len(shape),), shape[2:])
    check_geometry(name, array, shape, ("float16", "float32"))
    return array


NO_GEOMETRY: Final = Geometry()
#: Why motion and depth are refused beside a scene.
OF_SCENES: Final = "a scene has its own motion and depth; leave them out"


class Inputs(NamedTuple):
    """An image with its mask and emission, checked: arrays of the host, or copies on the device."""

    image: NDArray[Any] | ImportedArray
    emission: NDArray[Any] | ImportedArray | None = None
    mask: NDArray[np.float32] | None = None

    def by_name(self) -> dict[str, NDArray[Any] | ImportedArray]:
        """Return those that are there by name."""
        return {name: part for name, part in self._asdict().items() if part is not None}

    def freeze(self) -> Inputs:
        """Return inputs that the caller cannot change."""
        copies: list[Any] = [
            part if part is None or isinstance(part, ImportedArray) else part.copy()
            for part in self
        ]
        return Inputs(*copies)

    def on_host(self) -> dict[str, NDArray[Any]]:
        """Return the arrays by name, in the host's memory."""
        return {name: on_host(part) for name, part in self.by_name().items()}

    def source(
        self,
        levels: tuple[NDArray[Any] | ImportedArray, ...] = (),
        geometry: Geometry = NO_GEOMETRY,
    ) -> _core.Source:
        """Return the core's Source. The arrays must not change while it is used."""
        return _core.image_source(
            _import_image(self.image),
            _import_image(self.emission),
            self.mask,
            tuple(map(_import_image, levels)),
            *geometry.core_arguments(),
        )


def _import_image(array: Any) -> Any:
    return array.image() if isinstance(array, ImportedArray) else array


def _take(image: object, name: str, core: _core.Renderer | None) -> Any:
    return take(image, name, core) if core and on_cuda(image) else check_image(image, name)


def check_inputs(
    image: object,
    mask: object | None = None,
    emission: Any = None,
    core: _core.Renderer | None = None,
    name: str = "image",
) -> Inputs:
    """Check the arrays of an image, and copy those that are on the renderer's device."""
    pixels = _take(image, name, core)
    glowing = emission
    if emission is not None:
        glowing = check_emission(_take(emission, "emission", core), pixels)
    if core and on_cuda(mask):
        # Its values are checked on the host; it has one channel of the image's three or four.
        mask = take(mask, "mask", core, (2,)).numpy()
    height, width, _ = pixels.shape
    return Inputs(pixels, glowing, None if mask is None else check_mask(mask, (height, width)))


def image_source(
    image: object,
    mask: object | None = None,
    emission: object | None = None,
    core: _core.Renderer | None = None,
    name: str = "image",
    *,
    geometry: Geometry = NO_GEOMETRY,
) -> _core.Source:
    """Return the core's Source of an image. Its arrays must not change while it is used.

    With a renderer, arrays may be on its device; these are copied. Errors of the image start with
    `name`.
    """
    if isinstance(image, Image):
        for what, given in (("mask", mask), ("emission", emission)):
            if given is not None:
                raise ValueError(
                    f"{what}: the image was uploaded already; upload it together with its {what}"
                )
        geometry.refuse("the image was uploaded already; give the array instead")
        return image._source
    inputs = check_inputs(image, mask, emission, core, name)
    height, width, _ = inputs.image.shape
    return inputs.source(geometry=geometry.check((height, width), core))


def uploaded_inputs(image: Image, pixels: Callable[[], NDArray[Any]]) -> Inputs:
    """Return an uploaded image with its mask and emission; `pixels` reads it from the device."""
    given = image._inputs
    return Inputs(**given) if "image" in given else Inputs(pixels(), **given)


def take_batch(images: Any, core: _core.Renderer) -> ImportedArray:
    """Copy a batch on the device at once."""
    return take(images, "images", core, (4,))


def batch_sources(batch: ImportedArray, first: int = 0) -> Iterator[_core.Source]:
    """Yield the Source of each image of a batch on the device, from `first` on."""
    for index in range(first, batch.shape[0]):
        yield Inputs(batch.at(index)).source()


def is_image(source: object) -> bool:
    """Return whether a source is an image, or an object that NumPy can view."""
    return isinstance(source, Image | memoryview) or any(
        hasattr(source, name) for name in ("__array__", "__array_interface__", "__dlpack__")
    )


def any_source(
    source: Scene | NDArray[Any] | Image,
    size: tuple[int, int] | None,
    shading: Shading,
    time: float,
    core: _core.Renderer | None = None,
    *,
    geometry: Geometry = NO_GEOMETRY,
    moment: Moment | None = None,
) -> _core.Source:
    """Return the core's Source of an image, or of a scene's frame of a size, shading and time."""
    if not is_image(source):
        wanted = SCENE_SIZE if size is None else size
        geometry.refuse(OF_SCENES)
        return scene_source(cast("Scene", source), wanted, shading, time, "source", moment=moment)
    for name, is_given in (
        ("size", size is not None),
        ("shading", check_shading(shading) != "forward"),
        ("time", time != 0),
    ):
        if is_given:
            raise ValueError(f"{name}: the source is not a scene; leave the argument out")
    return image_source(source, core=core, name="source", geometry=geometry)


def scene_source(
    scene: Scene,
    size: tuple[int, int],
    shading: Shading,
    time: float,
    name: str = "scene",
    *,
    moment: Moment | None = None,
) -> _core.Source:
    """Return the core's Source of a scene's frame. Errors of the scene start with `name`."""
    check_shading(shading)
    turns = check_time(time)
    from vkbloom._scene import Scene  # noqa: PLC0415  loading scenes costs start-up time

    if not isinstance(scene, Scene):
        raise TypeError(f"{name}: {type(scene).__name__} is not a Scene")
    # Imported here, for the same reason.
    from vkbloom._scene import blocks  # noqa: PLC0415
    from vkbloom._scene.view import ALONE, Step  # noqa: PLC0415

    pixels = check_size("size", size)
    step = ALONE if moment is None else Step(moment.before, moment.offset(pixels))
    return blocks.scene_source(scene, pixels, shading, turns, step)
