"""What the core is given: packed settings and scenes, and objects that it holds."""

from __future__ import annotations

import gc
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.planned import changed, scene_plan, scene_source
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, Scene, Separable, _core
from vkbloom._renderer.adapter import bundled_driver
from vkbloom._scene.blocks import scene_arguments
from vkbloom._settings.blocks import settings_block

METHODS = ("bevy", "kino", "filament", "urp", "hdrp", "three")


class Given:
    """Settings as far as an object has them."""

    method = "separable"

    def _core_block(self) -> bytes:
        return settings_block(self.method, vars(self))


def settings_with(**fields: Any) -> Given:
    given = Given()
    vars(given).update({"weights": (1.0,), "layers": ((1.0, 1.0),), **fields})
    return given


def stage_with(**fields: Any) -> object:
    given = Given()
    vars(given).update({"stage": "streaks", **fields})
    return given


class Block(NamedTuple):
    """Settings that give the core these bytes."""

    block: object

    def _core_block(self) -> object:
        return self.block


class Raising(Given):
    def _core_block(self) -> bytes:
        raise OSError("no disk")


def _no_cache(uuid: bytes) -> bytes | None:
    raise OSError("no cache")


IMAGE = np.zeros((4, 4, 3), np.uint8)


def planned(renderer: Renderer, *settings: object) -> tuple[_core.Source, tuple[_core.Plan, ...]]:
    source = _core.image_source(IMAGE)
    return source, tuple(renderer._core.plan(source, one, None) for one in settings)


def arrays_for(*plans: _core.Plan) -> tuple[tuple[np.ndarray[Any, Any], ...], ...]:
    return tuple(
        tuple(np.empty(shape, dtype) for _, shape, dtype in plan.outputs) for plan in plans
    )


@pytest.fixture(scope="module")
def names(renderer: Renderer, scene: Scene) -> dict[str, Any]:
    """The names that the table uses."""
    source, plans = planned(renderer, Separable())
    read_only = np.empty((4, 4, 4), np.uint8)
    read_only.flags.writeable = False
    of_scene = scene_arguments(scene, (8, 8), "forward", 0.0)
    given = dict(zip(("scene_block", "pictures", "parts"), of_scene, strict=True))

    def raw(**changes: Any) -> _core.Source:
        return _core.scene_source(*(given | changes).values())

    return {
        **globals(),
        **given,
        "raw": raw,
        "changed": changed,
        "scene_source": scene_source,
        "plan": lambda **fields: scene_plan(settings_with(**fields), (16, 16)),
        "ghosts": lambda given: stage_with(stage="ghosts", ghosts=given),
        "u8": lambda *shape: np.zeros(shape, np.uint8),
        "core": renderer._core,
        "source": source,
        "plans": plans,
        "arrays": arrays_for(plans[0]),
        "read_only": read_only,
        "of_scene": of_scene,
        "block": Separable()._core_block(),
        "driver": bundled_driver(),
    }


@pytest.mark.parametrize(("call", "error"), rows(__file__, "arguments of the core"))
def test_a_wrong_value_is_refused(names: dict[str, Any], call: str, error: str) -> None:
    assert_refused(call, error, names)


@pytest.mark.parametrize("name", sorted(_core.VALUES))
def test_every_number_has_a_range(name: str) -> None:
    _, low, high = _core.VALUES[name]
    for wrong in (low - 1, high + 1, np.nextafter(low, -np.inf), np.inf, -np.inf, np.nan, 1e300):
        with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
            scene_plan(settings_with(**{name: float(wrong)}), (16, 16))


@pytest.mark.parametrize("name", sorted(_core.GLARE_VALUES))
def test_every_number_of_glare_has_a_range(name: str) -> None:
    _, low, high = _core.GLARE_VALUES[name]
    for wrong in (low - 1, high + 1, np.inf, np.nan, 1e300):
        glare = (stage_with(**{name: float(wrong)}),)
        with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
            scene_plan(settings_with(glare=glare), (16, 16))
    for end in (low, high):
        scene_plan(settings_with(glare=(stage_with(**{name: end}),)), (16, 16))


@pytest.mark.parametrize("method", ["pyramid", "dual_kawase", *METHODS])
@pytest.mark.parametrize("side", [1, 16, 32768])
def test_the_ends_of_all_ranges_together(method: str, side: int) -> None:
    """Every number at its least or its most: no index or size follows that is out of bounds."""
    for end in (1, 2):
        fields = {name: row[end] for name, row in _core.VALUES.items()}
        settings = settings_with(method=method, **{**fields, "bloom": 1})
        for size in ((side, side), (side, 1), (1, side)):
            try:
                scene_plan(settings, size, shading="deferred")
            except ValueError as error:
                assert "out of this adapter's range" in str(error)  # noqa: PT017


def test_plans_of_an_image(renderer: Renderer, scene: Scene) -> None:
    source, (plan,) = planned(renderer, Separable())
    assert plan.is_of_image(source)
    assert not plan.is_of_image(_core.image_source(np.zeros((4, 5, 3), np.uint8)))
    # The camera is part of a scene's plan.
    of_scene = _core.scene_source(*scene_arguments(scene, (4, 4), "forward", 0.0))
    plan = renderer._core.plan(of_scene, Separable(), None)
    assert not plan.is_of_image(of_scene)


def test_settings_that_close_the_renderer() -> None:
    renderer = Renderer()

    class Closing(Given):
        def _core_block(self) -> bytes:
            renderer.close()
            return Separable()._core_block()

    with pytest.raises(ValueError, match="closed"):
        renderer._core.plan(_core.image_source(IMAGE), Closing(), None)


def test_the_collector_sees_what_is_held(renderer: Renderer) -> None:
    """Each type tells the collector what it refers to."""
    source, plans = planned(renderer, Separable())
    arrays = arrays_for(*plans)
    submission = renderer._core.run(source, plans, arrays)
    assert any(held is IMAGE for held in gc.get_referents(source))
    assert plans[0].outputs in gc.get_referents(plans[0])
    held = gc.get_referents(submission)
    assert renderer._core in held
    assert plans in held
    assert sum(any(array is one for one in held) for array in arrays[0]) == 4
    for made in (renderer._core, source, *plans, submission):
        assert gc.is_tracked(made)
    submission.wait()
