"""What the core is given: packed settings and scenes, and objects that it holds."""

from __future__ import annotations

import gc
import itertools
import re
import struct
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.planned import (
    SCENES,
    bundled_driver,
    change,
    contents_arguments,
    frame_block,
    scene_plan,
    scene_source,
)
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, Scene, Separable, _core
from vkbloom._custom.rows import CoreShader, Row
from vkbloom._settings.blocks import _CODES, settings_block

_SHORTEST = {"weights": (1.0,), "layers": ((1.0, 1.0),)}


class Given:
    """Settings as far as an object has them."""

    method = "separable"

    def _core_block(self) -> bytes:
        return settings_block(self.method, vars(self))


def settings_with(**fields: Any) -> Given:
    given = Given()
    vars(given).update(_SHORTEST | fields)
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


class Kernel(NamedTuple):
    """Settings of a convolution that give the core this kernel, and its size."""

    kernel: Any
    size: Any = (1, 1)
    field: Any = None

    def _core_block(self) -> bytes:
        return settings_block("convolution", {})

    def kept_kernel(self, frame: object, buffers: object) -> None:
        return None

    def core_kernel_size(self, frame: object, buffers: object) -> Any:
        return self.size

    def core_kernel(self, frame: object, buffers: object) -> Any:
        return self.kernel

    def core_field(self, frame: object, buffers: object) -> Any:
        return self.field


class Dirty(NamedTuple):
    """Settings whose only stage of glare is this."""

    glare: Any

    def _core_block(self) -> bytes:
        return settings_block("separable", {**_SHORTEST, "glare": (stage_with(stage="dirt"),)})


class Passes(NamedTuple):
    """Settings of a method that is given to the core as these passes."""

    passes: Any

    def _core_block(self) -> bytes:
        return settings_block("custom", {})

    def core_passes(self, frame: object, buffers: object) -> Any:
        return self.passes


def kernel(array: Any, serial: int = 1) -> Any:
    return Kernel((array, serial, (0.0, 0.0, 0.0), (9, 9)))


def field(*fields: Any, weights: Any = (2, 3, 4), places: Any = (2, 4, 4)) -> Any:
    """Return a convolution with two kernels of one pixel, with such weights and places."""
    rest = 1, (1.0, 0.0, 1.0), (9, 9)
    images = [(np.zeros(shape, np.float32), *rest) for shape in (weights, places)]
    kernels = np.ones((2, 1, 1), np.float32), *rest
    return Kernel(kernels, field=(*(fields or (2, 1, False, True, 3, 2)), *images))


#: SPIR-V of no instruction but one of a word.
SPIRV = np.array([0x07230203, 0x10300, 0, 1, 0, 1 << 16], np.uint32).tobytes()


def one_pass(code: bytes = SPIRV, resources: Any = (), digest: bytes = bytes(16), **at: int) -> Any:
    """Return a method of one pass, whose block has other numbers at some places."""
    block, *rest, _ = Row("bloom", CoreShader("one", code, digest), (4, 4), ("MAIN",)).pack()
    return Passes(((change(block, **at), *rest, resources),))


def resource(data: Any = None, owner: Any = None, **at: int) -> Any:
    """Return a texture of 4 bytes, whose block has other numbers at some places."""
    return change(struct.pack("=2Q8I", 1, 4, 0, 37, 2, 1, 1, 1, 0, 0), **at), data, owner


def edit(name: str, *numbers: float, table: Any = None, start: int = 0) -> Block:
    """Return settings whose block has other numbers at a member's place."""
    offset, code, _ = (_core.SETTINGS_BLOCK if table is None else table)[name]
    block = bytearray(settings_block("separable", {**_SHORTEST, "glare": (stage_with(),)}))
    struct.pack_into(f"={len(numbers)}{_CODES[code]}", block, start + offset, *numbers)
    return Block(bytes(block))


def edit_stage(name: str, *numbers: float) -> Block:
    """Return settings whose first stage of glare has other numbers at a member's place."""
    start = _core.SETTINGS_BLOCK["stages"][0]
    return edit(name, *numbers, table=_core.STAGE_BLOCK, start=start)


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


def triangle(
    at: Any = None, pictures: Any = None, sky: Any = None, textures: int = 0, **parts: Any
) -> _core.SceneContents:
    """Return the contents of a triangle; the block has other numbers at some places, other arrays.

    - `pictures`: Nine numbers of the sky and of each texture.
    - `sky`: The arrays of levels, those of textures after them.
    - `parts`: By name, None: none.
    """
    arrays = {
        "vertices": np.zeros((3, 3, 4), np.float32),
        "indices": np.arange(3, dtype=np.uint32),
        "texcoords": None,
        "surfaces": None,
        **parts,
    }
    block, _, _ = contents_arguments(SCENES[False])
    # No glow mesh, whose counts are after those of the body, at 2 to 4.
    none = {"at5": 0, "at6": 0, "at7": 0, "at9": textures}
    block = change(block, **(none | (at or {})))
    given = [array for array in arrays.values() if array is not None] + list(sky or ())
    numbers = np.array(pictures or [0] * 9, np.uint32)
    return _core.scene_contents(block, numbers.tobytes(), tuple(given))


@pytest.fixture(scope="module")
def names(renderer: Renderer, scene: Scene) -> dict[str, Any]:
    """The names that the table uses."""
    source, plans = planned(renderer, Separable())
    read_only = np.empty((4, 4, 4), np.uint8)
    read_only.flags.writeable = False
    contents = contents_arguments(scene)
    given = dict(zip(("scene_block", "pictures", "parts"), contents, strict=True))

    def raw(**changes: Any) -> _core.SceneContents:
        return _core.scene_contents(*(given | changes).values())

    return {
        **globals(),
        **given,
        "raw": raw,
        "change": change,
        "scene_source": scene_source,
        "plan": lambda **fields: scene_plan(settings_with(**fields), (16, 16)),
        "ghosts": lambda given: stage_with(stage="ghosts", ghosts=given),
        "u8": lambda *shape: np.zeros(shape, np.uint8),
        "f4": lambda *shape: np.zeros(shape, np.float32),
        "planned": lambda *settings: planned(renderer, *settings)[1],
        "any_plan": _core.plan(source, Separable(), None),
        "uploaded": renderer._core.upload(source, None, False),
        "triangle": triangle,
        "core": renderer._core,
        "source": source,
        "plans": plans,
        "arrays": arrays_for(plans[0]),
        "read_only": read_only,
        "frame": frame_block(scene, (8, 8), "forward", 0.0),
        "draw": lambda frame: _core.scene_source(raw(), frame),
        "block": Separable()._core_block(),
        "driver": bundled_driver(),
    }


@pytest.mark.parametrize(("call", "error"), rows(__file__, "arguments of the core"))
def test_a_wrong_value_is_refused(names: dict[str, Any], call: str, error: str) -> None:
    assert_refused(call, error, names)


@pytest.mark.parametrize("name", sorted(_core.VALUES))
def test_every_number_of_a_block_is_checked(name: str) -> None:
    default, low, high = _core.VALUES[name]
    wrong = [low - 1, 2 * high + 1]
    if _core.SETTINGS_BLOCK[name][1] != "i4":
        wrong += [np.nan, np.inf, -np.inf]
    for number in wrong:
        value = number if isinstance(number, float) else int(number)
        with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
            scene_plan(edit(name, value), (16, 16))
    for number in (default, low, high):
        scene_plan(edit(name, number), (16, 16))


@pytest.mark.parametrize("name", sorted(_core.GLARE_VALUES))
def test_every_number_of_a_stage_is_checked(name: str) -> None:
    _, low, high = _core.GLARE_VALUES[name]
    for number in (low - 1, 2 * high + 1):
        with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
            scene_plan(edit_stage(name, number), (16, 16))


@pytest.mark.parametrize("name", sorted(_core.CHOICES))
def test_every_choice_is_checked(name: str) -> None:
    for number in (-1, len(_core.CHOICES[name])):
        with pytest.raises(ValueError, match=f"{name}: .* is out of range"):
            scene_plan(edit(name, number), (16, 16))


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


class Ends(Given):
    """Settings of any method, with a kernel for those that need one."""

    def kept_kernel(self, frame: object, buffers: object) -> None:
        return None

    def core_kernel_size(self, frame: object, buffers: object) -> tuple[int, int]:
        return 5, 5

    def core_kernel(self, frame: object, buffers: object) -> Any:
        return np.ones((5, 5, 4), np.float32), 1, (0.0, 0.0, 0.0), (2, 2)

    def core_field(self, frame: object, buffers: object) -> None:
        return None


#: Some fields at an end, and one value of one choice.
CHOSEN = [{}, *({name: one} for name, names in _core.CHOICES.items() for one in names)]


@pytest.mark.parametrize("method", [name for name in _core.METHODS if name != "custom"])
@pytest.mark.parametrize("side", [1, 16, 32768])
def test_the_ends_of_all_ranges_together(method: str, side: int) -> None:
    """Every number at its least or its most: no index or size follows that is out of bounds."""
    refused = "out of this adapter's range|iterations: .* is out of range, 2 to 5"
    for end, chosen in itertools.product((1, 2), CHOSEN):
        settings = Ends()
        fields = {name: row[end] for name, row in _core.VALUES.items()}
        lists = {"weights": (1.0,) * 65, "layers": ((1.0, 1.0),) * 8, "level_weights": (1.0,) * 7}
        vars(settings).update({"method": method, **lists, **fields, "bloom": 1, **chosen})
        # All sizes only where no choice is made, since it takes no part in sizes.
        for size in ((side, side),) if chosen else ((side, side), (side, 1), (1, side)):
            try:
                scene_plan(settings, size, shading="deferred")
            except ValueError as error:
                assert re.search(refused, str(error))  # noqa: PT017


def test_plans_of_an_image(renderer: Renderer, scene: Scene) -> None:
    source, (plan,) = planned(renderer, Separable())
    assert plan.is_of(source)
    assert not plan.is_of(_core.image_source(np.zeros((4, 5, 3), np.uint8)))


def test_plans_of_a_frame(renderer: Renderer) -> None:
    """What a plan has of a frame: all but the contents of the scene."""
    first = scene_source((4, 4))
    plan = renderer._core.plan(first, Separable(), None)
    assert plan.is_of(first)
    assert plan.is_of(scene_source((4, 4)))
    others = [scene_source((4, 5)), scene_source((4, 4), shading="deferred")]
    others += [scene_source((4, 4), has_sky=False), _core.image_source(IMAGE)]
    contents = _core.scene_contents(*contents_arguments(SCENES[True]))
    block = frame_block(SCENES[True], (4, 4), "forward", 0.0)
    assert plan.is_of(_core.scene_source(contents, block))
    # The intensity of the glow, and the numbers of all matrices.
    for place in (1, *range(2, 46)):
        number = np.frombuffer(block, np.uint32)[place] ^ 1
        others.append(_core.scene_source(contents, change(block, **{f"at{place}": number})))
    assert not any(plan.is_of(other) for other in others)


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
