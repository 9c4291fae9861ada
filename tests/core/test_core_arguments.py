"""The core checks what it is given, also where the package has checked it before."""

from __future__ import annotations

import contextlib
import gc
import threading
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.planned import scene_plan, scene_source
from vkbloom import Renderer, Scene, Separable, _core
from vkbloom._renderer.adapter import bundled_driver
from vkbloom._renderer.sources import scene_arguments
from vkbloom._settings.blocks import settings_block

METHODS = ("bevy", "kino", "filament", "urp", "hdrp", "unreal")


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


#: What the core says of a block that Python has made of values that no settings object takes.
OUT_OF_RANGES = "settings: the block has values out of their ranges"


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"blur_scale": -1.0}, "blur_scale: -1.0 is out of range, 0.0 to 16.0"),
        ({"blur_scale": float("nan")}, "blur_scale: nan is out of range"),
        ({"blur_scale": "1"}, "not supported"),
        ({"composite": "divide"}, "composite: 'divide' is not one of"),
        ({"composite": 5}, "composite: 5 is not one of"),
        ({"format": "bgra8unorm"}, "format: 'bgra8unorm' is not one of"),
        ({"format": "depth32float"}, OUT_OF_RANGES),
        ({"format": 5}, "format: 5 is not one of"),
        ({"bloom_size": (0, 5)}, OUT_OF_RANGES),
        ({"bloom_size": 5}, "cannot unpack"),
        ({"method": "gauss"}, "method: 'gauss' is not one of"),
        ({"method": None}, "method: None is not one of"),
        ({"weights": ()}, "weights: 0 numbers are out of range, 1 to"),
        ({"weights": (1.0,) * 100}, "weights: 100 numbers are out of range"),
        ({"weights": 5}, "len|sequence"),
        ({"weights": ("a",)}, "could not convert"),
        ({"weights": None}, OUT_OF_RANGES),
        ({"layers": None}, OUT_OF_RANGES),
        ({"layers": ()}, "layers: 0 numbers are out of range, 1 to"),
        ({"weights": (1.0, float("nan"))}, "weights: .* is out of range, finite numbers"),
        ({"weights": (-1e39,)}, "weights: .* is out of range, finite numbers"),
        ({"layers": ((1.0, float("inf")),)}, "layers: .* is out of range, finite numbers"),
        ({"layers": ((-1.0, 1.0),)}, OUT_OF_RANGES),
        ({"layers": ((16.5, 1.0),)}, OUT_OF_RANGES),
        ({"layers": ((1.0, 1.0), (1.0, -0.5))}, OUT_OF_RANGES),
        ({"layers": ((1.0, 1.0),) * 9}, "layers: 18 numbers are out of range, 1 to 16"),
        ({"glare": 5}, "has no len"),
        ({"glare": (5,)}, "'int' object has no attribute 'stage'"),
        ({"glare": (stage_with(stage="rain"),)}, "glare: 'rain' is not one of"),
        ({"glare": (stage_with(fade="1"),)}, "not supported"),
        ({"glare": (stage_with(stage="ghosts", ghosts=5),)}, "not iterable"),
        ({"glare": (stage_with(stage="ghosts", ghosts=((1.0, (1, 1, 1)),) * 17),)}, "broadcast"),
        ({"glare": (stage_with(),) * 6}, "glare: 6 stages are out of range, 0 to 5"),
    ],
)
def test_settings(fields: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError, AttributeError), match=message):
        scene_plan(settings_with(**fields), (16, 16))


class Block(NamedTuple):
    """Settings that give the core these bytes."""

    block: object

    def _core_block(self) -> object:
        return self.block


def test_blocks_of_another_size_or_type_are_refused() -> None:
    block = Separable()._core_block()
    for wrong in (block[:-1], block + b"0", b"", bytearray(block), None):
        with pytest.raises(TypeError, match=f"settings: a block of {len(block)} bytes is needed"):
            scene_plan(Block(wrong), (16, 16))
    with pytest.raises(AttributeError, match="_core_block"):
        scene_plan(object(), (16, 16))


@pytest.mark.parametrize("method", ["separable", *METHODS])
def test_changed_blocks_are_refused_or_planned(method: str) -> None:
    """Whatever numbers a block has, no index or size follows that is out of bounds."""
    random = np.random.default_rng(5)
    glare = (stage_with(), stage_with(stage="ghosts", ghosts=((1.0, (1, 1, 1)),)))
    block = np.frombuffer(settings_with(method=method, glare=glare)._core_block(), np.uint32)
    for _ in range(100):
        changed = block.copy()
        where = random.integers(len(block), size=3)
        changed[where] = random.choice([0, 1, 7, 255, 2**31, 2**32 - 1, 0x7F800000], 3)
        with contextlib.suppress(ValueError):
            scene_plan(Block(changed.tobytes()), (16, 16))


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


def test_settings_that_raise() -> None:
    class Failing(Given):
        def _core_block(self) -> bytes:
            raise OSError("no disk")

    with pytest.raises(OSError, match="no disk"):
        scene_plan(Failing(), (16, 16))


BEYOND_32_BITS = [2**32, 2**32 + 16, 2**64 + 16, 2**128, -1, -(2**32) + 16]


@pytest.mark.parametrize("side", BEYOND_32_BITS)
def test_sizes_are_not_taken_modulo_2_to_the_32(scene: Scene, side: int) -> None:
    """Once 2**32 + 16 was a side of 16."""
    arrays, camera, _, *rest = scene_arguments(scene, (8, 8), "forward", 0.0)
    for size in ((side, 16), (16, side)):
        with pytest.raises(ValueError, match="is out of range, 0 to 4294967295"):
            scene_plan(Separable(), size)
        with pytest.raises(OverflowError, match=r"out of bounds|too large"):
            scene_plan(settings_with(bloom_size=size), (16, 16))
        with pytest.raises(ValueError, match="is out of range, 0 to 4294967295"):
            _core.scene_source(arrays, camera, size, *rest)
    serial, body, *others = arrays
    for surface in ((side, 0, 0), (0, side, 0), (0, 0, side)):
        wrong = (serial, (*body[:4], (surface,)), *others)
        with pytest.raises(ValueError, match="is out of range, 0 to 4294967295"):
            _core.scene_source(wrong, camera, (8, 8), *rest)


def test_sides_that_are_no_whole_numbers() -> None:
    with pytest.raises(TypeError, match="is not an integer"):
        scene_plan(Separable(), (16.5, 16))


@pytest.mark.parametrize("serial", [0, -1, 2**64, 2**64 + 1])
def test_serials_have_64_bits(scene: Scene, serial: int) -> None:
    (_, *others), *rest = scene_arguments(scene, (8, 8), "forward", 0.0)
    with pytest.raises((ValueError, OverflowError)):
        _core.scene_source((serial, *others), *rest)


def test_shadings_and_sizes() -> None:
    with pytest.raises(ValueError, match="shading: there is no toon"):
        scene_plan(Separable(), (16, 16), shading="toon")
    with pytest.raises(TypeError):
        scene_plan(Separable(), 16)


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((4, 4, 3)),
        np.zeros((4, 4, 3), np.int32),
        np.zeros((4, 4), np.uint8),
        np.zeros((4, 4, 2), np.uint8),
        np.zeros((0, 4, 3), np.uint8),
        "image",
    ],
    ids=str,
)
def test_images(array: Any) -> None:
    with pytest.raises((TypeError, ValueError)):
        _core.image_source(array)


IMAGE = np.zeros((4, 4, 3), np.uint8)


def planned(renderer: Renderer, *settings: object) -> tuple[_core.Source, tuple[_core.Plan, ...]]:
    source = _core.image_source(IMAGE)
    return source, tuple(renderer._core.plan(source, one, None) for one in settings)


def arrays_for(*plans: _core.Plan) -> tuple[tuple[np.ndarray[Any, Any], ...], ...]:
    return tuple(
        tuple(np.empty(shape, dtype) for _, shape, dtype in plan.outputs) for plan in plans
    )


def test_arrays_of_the_wrong_size_or_number(renderer: Renderer) -> None:
    source, plans = planned(renderer, Separable())
    (right,) = arrays_for(*plans)
    with pytest.raises(ValueError, match="glow: the array has the wrong size"):
        renderer._core.run(source, plans, ((np.zeros(3, np.uint8), *right[1:]),))
    for wrong in (right[1:], (*right, right[0])):
        with pytest.raises(ValueError, match=f"{len(wrong)} arrays do not match 4 framebuffers"):
            renderer._core.run(source, plans, (wrong,))
    for arrays in ((), (right, right)):
        with pytest.raises(ValueError, match="do not match"):
            renderer._core.run(source, plans, arrays)
    with pytest.raises(ValueError, match="do not match"):
        renderer._core.run(source, (), ())
    with pytest.raises(TypeError, match="arrays: a tuple is needed"):
        renderer._core.run(source, plans, (list(right),))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="a tuple of Plans"):
        renderer._core.run(source, (Separable(),), (right,))  # type: ignore[arg-type]
    read_only = np.empty_like(right[0])
    read_only.flags.writeable = False
    with pytest.raises(ValueError, match="read-only"):
        renderer._core.run(source, plans, ((read_only, *right[1:]),))


def test_plans_of_another_source_or_renderer(renderer: Renderer, scene: Scene) -> None:
    """Whatever the graph is for must be there when it runs."""
    source, plans = planned(renderer, Separable())
    arrays = arrays_for(*plans)
    of_scene = _core.scene_source(*scene_arguments(scene, (4, 4), "forward", 0.0))
    for other in (of_scene, _core.image_source(np.zeros((4, 5, 3), np.uint8))):
        with pytest.raises(ValueError, match="made for another source"):
            renderer._core.run(other, plans, arrays)
    without_sky = scene_source((4, 4), has_sky=False)
    plan = renderer._core.plan(of_scene, Separable(), None)
    with pytest.raises(ValueError, match="made for another source"):
        renderer._core.run(without_sky, (plan,), arrays_for(plan))
    with Renderer() as other_renderer, pytest.raises(ValueError, match="another renderer"):
        other_renderer._core.run(source, plans, arrays)
    looked_at = _core.plan(source, Separable(), None, "fragment")
    with pytest.raises(ValueError, match="another renderer"):
        renderer._core.run(source, (looked_at,), arrays_for(looked_at))


def test_plans_with_other_images(renderer: Renderer) -> None:
    source, plans = planned(renderer, Separable(), Separable(bloom_size=(3, 3)))
    assert not plans[0].shares_images(plans[1])
    with pytest.raises(ValueError, match="their images differ"):
        renderer._core.run(source, plans, arrays_for(*plans))
    with pytest.raises(TypeError, match="a Plan is needed"):
        plans[0].shares_images(source)  # type: ignore[arg-type]


def test_plans_of_an_image(renderer: Renderer, scene: Scene) -> None:
    source, (plan,) = planned(renderer, Separable())
    assert plan.is_of_image(source)
    assert not plan.is_of_image(_core.image_source(np.zeros((4, 5, 3), np.uint8)))
    # The camera is part of a scene's plan.
    of_scene = _core.scene_source(*scene_arguments(scene, (4, 4), "forward", 0.0))
    plan = renderer._core.plan(of_scene, Separable(), None)
    assert not plan.is_of_image(of_scene)
    with pytest.raises(TypeError, match="a Source is needed"):
        plan.is_of_image(plan)  # type: ignore[arg-type]


@pytest.mark.parametrize("names", [["final"], "final", 5], ids=str)
def test_names_of_another_type_are_refused(renderer: Renderer, names: Any) -> None:
    with pytest.raises(TypeError, match="framebuffers: a tuple is needed"):
        renderer._core.plan(_core.image_source(IMAGE), Separable(), names)


def test_settings_that_close_the_renderer() -> None:
    renderer = Renderer()

    class Closing(Given):
        def _core_block(self) -> bytes:
            renderer.close()
            return Separable()._core_block()

    with pytest.raises(ValueError, match="closed"):
        renderer._core.plan(_core.image_source(IMAGE), Closing(), None)


def test_unknown_variant_is_refused() -> None:
    with pytest.raises(ValueError, match="quick is not one of auto, fragment, cpu, gpu"):
        _core.plan(_core.image_source(IMAGE), Separable(), None, "quick")


@pytest.mark.parametrize("size", [0, -1, 2**62])
def test_pages_of_size_0_are_refused(renderer: Renderer, size: int) -> None:
    with pytest.raises((ValueError, MemoryError)):
        renderer._core.pages(size)


def test_types_that_only_the_core_makes(renderer: Renderer) -> None:
    source, plans = planned(renderer, Separable())
    submission = renderer._core.run(source, plans, arrays_for(*plans))
    for made in (source, *plans, submission, renderer._core.pages(5)):
        with pytest.raises(TypeError, match="cannot create"):
            type(made)()
    submission.wait()


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


def test_a_submission_is_waited_for_by_one_thread(renderer: Renderer) -> None:
    image = np.random.default_rng(3).random((80, 80, 4), np.float32)
    # So that all threads wait for the renderer at once: 65 x 65 taps a pixel take a while.
    slow = Separable(weights=(1 / 65,) * 33, direct=True, blur_scale=0.5)

    def wait(submission: _core.Submission, counts: list[int]) -> None:
        try:
            counts.append(len(submission.wait()[0]))
        except RuntimeError:
            counts.append(0)

    source = _core.image_source(image)
    for exposure in range(2):
        plan = renderer._core.plan(source, Separable(exposure=exposure), None)
        submission = renderer._core.run(source, (plan,), arrays_for(plan))
        counts: list[int] = []
        threads = [threading.Thread(target=renderer.apply, args=(image + exposure, slow))]
        threads += [threading.Thread(target=wait, args=(submission, counts)) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(counts) == [0, 0, 1]


def test_scenes(scene: Scene) -> None:
    arrays, *rest = scene_arguments(scene, (8, 8), "forward", 0.0)
    serial, body, glow, sky, textures = arrays
    wrong = [
        (serial, (body[0].astype(np.float64), *body[1:]), glow, sky, textures),
        (serial, (body[0], body[1].astype(np.int8), *body[2:]), glow, sky, textures),
        (serial, (*body[:2], np.zeros((1, 3), np.float32), *body[3:]), glow, sky, textures),
        (serial, (*body[:4], ((3, 0, 0),)), glow, sky, textures),
        (serial, body, glow, sky[:1] * 20, textures),
        (serial, body, glow, sky[:1] * 2, textures),
        (serial, body, glow, (np.zeros((6, 2, 4, 4), np.uint8),), textures),
        (serial, body, glow, (np.zeros((6, 1, 1, 4), np.uint8),) * 2, textures),
        (serial, body, glow, sky, (((), "repeat", "repeat", "linear", "linear", "linear"),)),
        (serial, body, glow, sky, ((sky, "repeat", "tile", "linear", "linear", "linear"),)),
        (serial, body, glow, sky),
        (serial, 5, glow, sky, textures),
        (serial, (*body[:4], (5,)), glow, sky, textures),
        (serial, body, glow, sky, (5,)),
    ]
    for given in wrong:
        with pytest.raises((TypeError, ValueError)):
            _core.scene_source(given, *rest)


def test_more_indices_than_32_bits_count(scene: Scene, tmp_path: Path) -> None:
    arrays, *rest = scene_arguments(scene, (8, 8), "forward", 0.0)
    serial, body, glow, sky, textures = arrays
    # A file of a hole takes no room. In 32 bits there would be three indices.
    indices = np.memmap(tmp_path / "indices", np.uint32, "w+", shape=(2**32 + 3,))
    with pytest.raises(ValueError, match="scene: 4294967299 indices are out of range"):
        _core.scene_source((serial, (body[0], indices, *body[2:]), glow, sky, textures), *rest)


def test_a_renderer_takes_no_keywords() -> None:
    make: Any = _core.Renderer
    driver = bundled_driver()
    with pytest.raises(TypeError, match="keyword"):
        make("auto", validation=True)
    for seconds in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="frame_seconds: a number above 0 is needed"):
            _core.Renderer("auto", driver, True, "auto", seconds, _no_cache)
    with pytest.raises(OSError, match="no cache"):
        _core.Renderer("auto", driver, True, "auto", 1.0, _no_cache)
    with pytest.raises(TypeError):
        _core.Renderer("auto", driver, True, "auto", 1.0, lambda uuid: "text")  # type: ignore[arg-type,return-value]


def _no_cache(uuid: bytes) -> bytes | None:
    raise OSError("no cache")
