"""The source of a grid: a scene or an image."""

from __future__ import annotations

import dataclasses
import hashlib
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from vkbloom import _core
from vkbloom._framebuffers import check_framebuffers
from vkbloom._grid.order import Index
from vkbloom._locks import cached_property
from vkbloom._numbers import check_size, check_time
from vkbloom._renderer.device_arrays import ImportedArray
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.image import Image
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.requests import Request
from vkbloom._renderer.sources import (
    ANIMATION,
    NO_GEOMETRY,
    OF_SCENES,
    SCENE_SIZE,
    Geometry,
    Inputs,
    Moment,
    check_inputs,
    image_source,
    is_image,
    scene_source,
)
from vkbloom._renderer.state import Continued
from vkbloom._scene import Scene
from vkbloom._scene.arrays import Constructed
from vkbloom._settings.exposed import keywords_of
from vkbloom._settings.settings import Settings, check_shading

if TYPE_CHECKING:
    from vkbloom._renderer.plans import Plan
    from vkbloom._scene import Scene
    from vkbloom._settings.settings import Shading


@dataclass(frozen=True)
class Point:
    """A point of a grid: its index, its settings and the time.

    - `moment`: Of a scene with temporal anti-aliasing; else None.
    """

    index: Index
    settings: Settings
    time: float
    moment: Moment | None = None


def visit(
    renderer: Renderer,
    source: ImageSource | SceneSource,
    points: Iterable[Point],
    framebuffers: str | Sequence[str],
    before: Continued | None,
) -> Iterator[tuple[Index, Frames]]:
    """Render points in the given order; `before`: what each of them continues."""
    drawn: deque[Point] = deque()

    def work() -> Iterator[Request]:
        for point in points:
            drawn.append(point)
            yield Request(source.on(renderer, point), point.settings)

    names = check_framebuffers(framebuffers)
    for frames in renderer._run_requests(work(), names, before=before):
        point = drawn.popleft()
        if point.moment is not None:
            frames._state = frames._state.replace(ANIMATION, point.moment.array())
        yield point.index, frames


@dataclass(eq=False)
class ImageSource(Constructed):
    """An image with its mask and emission: arrays, or an uploaded image.

    - `geometry`: What temporal anti-aliasing reads beside it.
    """

    has_time: ClassVar = False
    time: ClassVar = 0.0

    image: Inputs | Image
    geometry: Geometry = NO_GEOMETRY
    _uploaded: tuple[_core.Renderer, _core.Source] | None = dataclasses.field(
        default=None, init=False
    )

    def on(self, renderer: Renderer, point: Point) -> _core.Source:
        """Return the image on a renderer's device, where it is kept."""
        if isinstance(self.image, Image):
            return self.for_core(point)
        if self._uploaded is None or self._uploaded[0] is not renderer._core:
            core = renderer._core
            self._uploaded = core, core.upload(self.for_core(point), None, True)
        return self._uploaded[1]

    def plan(self, renderer: Renderer, settings: Settings) -> Plan:
        """Return the plan of the image."""
        pixels: Any = self.image if isinstance(self.image, Image) else self.image.image
        return renderer.plan(pixels, **keywords_of(settings))

    def for_core(self, point: Point) -> _core.Source:
        """Return the core's Source of the image."""
        if isinstance(self.image, Image):
            return image_source(self.image)
        return self.image.source(geometry=self.geometry)

    @cached_property
    def description(self) -> dict[str, Any]:
        """The identity of the source: shape, dtype and digests."""
        parts = self.geometry._asdict().items()
        beside = {name: digest(part) for name, part in parts if part is not None}
        return {"kind": "image", "images": [_describe(self.image) | beside]}


def _describe(image: Inputs | Image) -> dict[str, Any]:
    """Return the identity of an image; of an uploaded one what is on the host: mask, emission."""
    pixels: Any = image if isinstance(image, Image) else image.image
    if isinstance(image, Image):
        arrays = image._inputs
    else:
        arrays = {
            "sha256" if name == "image" else name: part for name, part in image.by_name().items()
        }
    return {
        "shape": list(pixels.shape),
        "dtype": pixels.dtype.name,
        **{
            name: digest(part.numpy() if isinstance(part, ImportedArray) else part)
            for name, part in arrays.items()
        },
    }


@dataclass(eq=False)
class SceneSource(Constructed):
    """A scene, rendered at one size in one shading."""

    has_time: ClassVar = True

    scene: Scene
    size: tuple[int, int]
    shading: Shading
    time: float = 0.0
    _latest: tuple[object, _core.Source] | None = dataclasses.field(default=None, init=False)

    def on(self, renderer: Renderer, point: Point) -> _core.Source:
        """Return the scene at a point. The renderer keeps its data on the device."""
        # One object for each time, so that requests of the same time share submissions.
        time = point.time, point.moment
        if self._latest is None or self._latest[0] != time:
            self._latest = time, self.for_core(point)
        return self._latest[1]

    def plan(self, renderer: Renderer, settings: Settings) -> Plan:
        """Return the plan of the scene."""
        given = keywords_of(settings)
        return renderer.plan(self.scene, size=self.size, shading=self.shading, **given)

    def for_core(self, point: Point) -> _core.Source:
        """Return the core's Source of the scene at a point."""
        how = self.size, self.shading, point.time
        return scene_source(self.scene, *how, moment=point.moment)

    @cached_property
    def description(self) -> dict[str, Any]:
        """The identity of the source: size, shading, time and a digest of the scene."""
        return {
            "kind": "scene",
            "sha256": digest(self.scene),
            "size": list(self.size),
            "shading": self.shading,
            "time": self.time,
        }


Source: TypeAlias = ImageSource | SceneSource


def read_source(
    source: object,
    size: tuple[int, int] | None,
    shading: str,
    time: float,
    *,
    mask: object = None,
    emission: object = None,
    geometry: Geometry = NO_GEOMETRY,
) -> Source:
    """Check the source of a grid."""
    if isinstance(source, Scene):
        geometry.refuse(OF_SCENES)
        for name, array in (("mask", mask), ("emission", emission)):
            if array is not None:
                raise ValueError(f"{name}: the source is not an image; leave the argument out")
        frame = check_size("size", size or SCENE_SIZE)
        return SceneSource(source, frame, check_shading(shading), check_time(time))
    for name, is_given in (
        ("size", size is not None),
        ("shading", check_shading(shading) != "forward"),
        ("time", check_time(time) != 0.0),
    ):
        if is_given:
            raise ValueError(f"{name}: the source is not a scene; leave the argument out")
    if not is_image(source):
        raise TypeError(f"source: {type(source).__name__} is not a Scene or an image")
    if isinstance(source, Image):
        # Raises if there is a mask, an emission, a motion or a depth, too.
        image_source(source, mask, emission, geometry=geometry)
        return ImageSource(source)
    inputs = check_inputs(source, mask, emission, name="source")
    height, width, _ = inputs.image.shape
    return ImageSource(inputs, geometry.check((height, width), None))


def digest(value: object) -> str:
    """Return the SHA-256 of plain values, arrays, and dataclasses and sequences of them."""
    hashed = hashlib.sha256()

    def add(part: object) -> None:
        if isinstance(part, np.ndarray):
            hashed.update(f"{part.dtype.str}{part.shape}".encode())
            hashed.update(np.ascontiguousarray(part).data)
        elif dataclasses.is_dataclass(part):
            for field in dataclasses.fields(part):
                # Fields that are not arguments, such as a serial number, are not content.
                if field.init:
                    hashed.update(f"{field.name}:".encode())
                    add(getattr(part, field.name))
        elif isinstance(part, tuple | list):
            hashed.update(f"[{len(part)}]".encode())
            for item in part:
                add(item)
        else:
            hashed.update(repr(part).encode())

    add(value)
    return hashed.hexdigest()
