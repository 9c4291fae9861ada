"""What computes the frames of a sequence: the calls of a renderer for images and for scenes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from vkbloom._renderer.frames import Frames
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.settings import Settings

if TYPE_CHECKING:
    from vkbloom._scene import Scene


class Work(NamedTuple):
    """What computes frames.

    - `all`: Those of a sequence, from its settings, their images, the seconds before each, a state,
      and the number of the first one.
    - `one`: A frame alone.
    - `stages`: Keywords of a call for its stages in time; None: a stage that it lacks.
    """

    all: Callable[
        [Settings, Iterator[Any], Iterator[float | None], Mapping[str, Any] | None, int],
        Iterator[Frames],
    ]
    one: Callable[[Settings, Any], Frames]
    stages: Mapping[str, Any]

    @property
    def has_stages(self) -> bool:
        """Whether there is a stage in time."""
        return any(stage is not None for stage in self.stages.values())

    @property
    def continues(self) -> str:
        """What hands something on to the next frame; "": nothing does."""
        for name, stage in self.stages.items():
            if stage is not None and getattr(stage, "_adapts", True):
                return name
        return ""


def work_of_images(
    renderer: Callable[[], Renderer],
    glow_of: Callable[[Any], Mapping[str, Any]],
    how: Mapping[str, Any],
    stages: Mapping[str, Any],
    geometry: Mapping[str, Any] = MappingProxyType({}),
) -> Work:
    """Return what adds bloom to images; `glow_of`: the mask and the emission of each.

    - `geometry`: Motions and depths of all, as for `Renderer.map`.
    """

    def upload_glow(image: Any) -> Any:
        glow = glow_of(image)
        return renderer().upload(image, **glow) if glow else image

    def compute_all(
        settings: Settings,
        images: Iterator[Any],
        steps: Iterator[float | None],
        state: Mapping[str, Any] | None,
        first: int,
    ) -> Iterator[Frames]:
        given = {**how, **stages, **geometry, "state": state, "first": first}
        return renderer()._map(map(upload_glow, images), settings, dt=steps, **given)

    def compute_one(settings: Settings, image: Any) -> Frames:
        return renderer().apply(image, settings, **glow_of(image), **how, **stages)

    return Work(compute_all, compute_one, stages)


def work_of_scene(
    renderer: Callable[[], Renderer],
    scene: Scene,
    how: Mapping[str, Any],
    stages: Mapping[str, Any],
) -> Work:
    """Return what renders a scene at periods of its animation."""

    def compute_all(
        settings: Settings,
        turns: Iterator[float],
        steps: Iterator[float | None],
        state: Mapping[str, Any] | None,
        first: int,
    ) -> Iterator[Frames]:
        for number, time in enumerate(turns, first):
            chosen = settings._in_sequence(number, {})
            given = {**how, **stages, "dt": next(steps), "state": state}
            frames = renderer().render(scene, chosen, time=time, **given)
            state = frames.state
            yield frames

    def compute_one(settings: Settings, turns: float) -> Frames:
        return renderer().render(scene, settings, time=turns, **how, **stages)

    return Work(compute_all, compute_one, stages)
