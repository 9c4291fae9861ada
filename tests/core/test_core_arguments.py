"""The core checks what it is given, also where the package has checked it before."""

from __future__ import annotations

import gc
import sys
import threading
import weakref
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from tests.planned import scene_plan, scene_source
from tests.refusals import assert_refused, rows
from vkbloom import Renderer, Scene, Separable, _core
from vkbloom._renderer.adapter import bundled_driver
from vkbloom._renderer.sources import scene_arguments

METHODS = ("bevy", "kino", "filament", "urp", "hdrp", "unreal")


class Given:
    """Settings as far as an object has them; objects of this type have different attributes."""


#: The value of an attribute that an object has not.
LACKING = object()


def settings_with(**fields: Any) -> object:
    given = Given()
    complete = {"method": "separable", "weights": (1.0,), "layers": ((1.0, 1.0),), **fields}
    vars(given).update({name: value for name, value in complete.items() if value is not LACKING})
    return given


def stage_with(**fields: Any) -> object:
    given = Given()
    vars(given).update({"stage": "streaks", **fields})
    return given


class Failing(Given):
    method = "pyramid"

    @property
    def levels(self) -> int:
        return self.nowhere  # type: ignore[attr-defined,no-any-return]


class Raising(Given):
    method = "separable"

    @property
    def blur_scale(self) -> float:
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


TABLE = """
plan(blur_scale=-1.0) -> ValueError: blur_scale: -1.0 is out of range, 0.0 to 16.0
plan(blur_scale=np.nan) -> ValueError: blur_scale: nan is out of range, 0.0 to 16.0
plan(blur_scale="1") -> TypeError: must be real number, not str
plan(composite="divide") -> ValueError: composite: unknown value 'divide'
plan(composite=5) -> ValueError: composite: unknown value 5
plan(format="bgra8unorm") -> ValueError: format: 'bgra8unorm' is not a format of bloom buffers
plan(format="depth32float") -> ValueError: format: 'depth32float' is not a format of bloom buffers
plan(format=5) -> ValueError: format: 5 is not a format of bloom buffers
plan(bloom_size=(0, 5)) -> ValueError: bloom_size: (0, 5) is out of range, sides of at least 1
plan(bloom_size=5) -> TypeError: bloom_size: a tuple is needed, not 5
plan(method="gauss") -> ValueError: method: unknown method 'gauss'
plan(method=None) -> ValueError: method: unknown method None
plan(weights=()) -> ValueError: weights: 0 weights are out of range, 1 to 65
plan(weights=(1.0,) * 100) -> ValueError: weights: 100 weights are out of range, 1 to 65
plan(weights=5) -> TypeError: object of type 'int' has no len()
plan(weights=("a",)) -> TypeError: must be real number, not str
plan(layers=()) -> ValueError: layers: 0 layers are out of range, 1 to 8
plan(weights=(1.0, np.nan)) -> ValueError: weights: nan is out of range, -3.4028234663852886e+...
plan(weights=(np.inf,)) -> ValueError: weights: inf is out of range, -3.4028234663852886e+38 t...
plan(weights=(-1e39,)) -> ValueError: weights: -1e+39 is out of range, -3.4028234663852886e+38 t...
plan(layers=((1.0, np.inf),)) -> ValueError: layers: (1.0, inf) is out of range, 0.0 to 16.0
plan(layers=((np.nan, 1.0),)) -> ValueError: layers: (nan, 1.0) is out of range, 0.0 to 16.0
plan(layers=((-1.0, 1.0),)) -> ValueError: layers: (-1.0, 1.0) is out of range, 0.0 to 16.0
plan(layers=((16.5, 1.0),)) -> ValueError: layers: (16.5, 1.0) is out of range, 0.0 to 16.0
plan(layers=((1.0, 1.0), (1.0, -0.5))) -> ValueError: layers: (1.0, -0.5) is out of range, 0.0 t...
plan(layers=((1.0, 1.0),) * 9) -> ValueError: layers: 9 layers are out of range, 1 to 8
plan(layers=(1.0,)) -> TypeError: layers: a tuple is needed, not 1.0
plan(layers=5) -> TypeError: object of type 'int' has no len()
plan(weights=LACKING) -> ValueError: weights: a separable blur needs them
plan(layers=LACKING) -> ValueError: layers: a separable blur needs them
plan(loops=17) -> ValueError: loops: 17 is out of range, 1.0 to 16.0
plan(glare=5) -> TypeError: glare: a tuple is needed, not 5
plan(glare=(5,)) -> AttributeError: 'int' object has no attribute 'stage'
plan(glare=(stage_with(stage="rain"),)) -> ValueError: glare: unknown stage 'rain'
plan(glare=(stage_with(stage=5),)) -> ValueError: glare: unknown stage 5
plan(glare=(stage_with(fade="1"),)) -> TypeError: must be real number, not str
plan(glare=(stage_with(stage="ghosts"),)) -> AttributeError: ... has no attribute 'ghosts'
plan(glare=(stage_with(stage="ghosts", ghosts=5),)) -> TypeError: ghosts: a tuple is needed, not 5
plan(glare=(ghosts((1,)),)) -> TypeError: ghosts: a tuple is needed, not 1
plan(glare=(ghosts(((17.0, (1, 1, 1)),)),)) -> ValueError: ghosts: (17.0, (1, 1, 1)) is out of r...
plan(glare=(ghosts(((1.0, (1, np.nan, 1)),)),)) -> ValueError: ghosts: (1.0, (1, nan, 1)) is o...
plan(glare=(ghosts(((1.0, (1, 1, 1)),) * 17),)) -> ValueError: ghosts: 17 ghosts are out of rang...
plan(glare=(stage_with(),) * 6) -> ValueError: glare: 6 stages are out of range, 0 to 5
plan(bloom_size=(2**32 + 16, 16)) -> ValueError: 4294967312 is out of range, 0 to 4294967295
plan(bloom_size=(16, -1)) -> ValueError: -1 is out of range, 0 to 4294967295
scene_plan(object(), (16, 16)) -> AttributeError: 'object' object has no attribute 'method'
scene_plan(Raising(), (16, 16)) -> OSError: no disk
scene_plan(Failing(), (16, 16)) -> AttributeError: 'Failing' object has no attribute 'nowhere'
scene_plan(Separable(), (16.5, 16)) -> TypeError: 16.5 is not an integer
scene_plan(Separable(), (2**32 + 16, 16)) -> ValueError: 4294967312 is out of range, 0 to 429496...
scene_plan(Separable(), (16, 2**64 + 16)) -> ValueError: 18446744073709551632 is out of range, 0...
scene_plan(Separable(), (16, -(2**32) + 16)) -> ValueError: -4294967280 is out of range, 0 to 42...
scene_plan(Separable(), (0, 1)) -> ValueError: size: a size of 0 x 1 is out of this adapter's ra...
scene_plan(Separable(), (1, 0)) -> ValueError: size: a size of 1 x 0 is out of this adapter's ra...
scene_plan(Separable(), (16, 16), shading="toon") -> ValueError: shading: there is no toon
scene_plan(Separable(), 16) -> TypeError: scene_source() argument 3 must be 2-item sequence, not...
_core.image_source(np.zeros((4, 4, 3))) -> TypeError: image: elements of the format "d" are not...
_core.image_source(np.zeros((4, 4, 3), np.int32))
    -> TypeError: image: elements of the format "i" are not uint8, float16 or float32 in this mac...
_core.image_source(u8(4, 4)) -> ValueError: image: a shape of (H, W, 3) or (H, W, 4) is needed
_core.image_source(u8(4, 4, 2)) -> ValueError: image: a shape of (H, W, 3) or (H, W, 4) is needed
_core.image_source(u8(0, 4, 3)) -> ValueError: image: a shape of (H, W, 3) or (H, W, 4) is needed
_core.image_source("image") -> TypeError: a bytes-like object is required, not 'str'
_core.plan(source, Separable(), None, "quick")
    -> ValueError: VKBLOOM_VARIANT: quick is not one of auto, fragment, cpu, gpu
core.plan(source, Separable(), ["final"]) -> TypeError: framebuffers: a tuple is needed, not ['f...
core.plan(source, Separable(), "final") -> TypeError: framebuffers: a tuple is needed, not 'final'
core.plan(source, Separable(), 5) -> TypeError: framebuffers: a tuple is needed, not 5
core.run(source, plans, ((np.zeros(3, np.uint8), *arrays[0][1:]),))
    -> ValueError: glow: the array has the wrong size
core.run(source, plans, (arrays[0][1:],)) -> ValueError: arrays: 3 arrays do not match 4 framebu...
core.run(source, plans, ((*arrays[0], arrays[0][0]),))
    -> ValueError: arrays: 5 arrays do not match 4 framebuffers
core.run(source, plans, ()) -> ValueError: arrays: 0 tuples do not match 1 plans
core.run(source, plans, (arrays[0], arrays[0])) -> ValueError: arrays: 2 tuples do not match 1 p...
core.run(source, (), ()) -> ValueError: arrays: 0 tuples do not match 0 plans
core.run(source, plans, (list(arrays[0]),)) -> TypeError: arrays: a tuple is needed, not [array...
core.run(source, (Separable(),), arrays) -> TypeError: plans: a tuple of Plans is needed
core.run(source, plans, ((read_only, *arrays[0][1:]),))
    -> ValueError: buffer source array is read-only
core.run(_core.scene_source(*of_scene), plans, arrays)
    -> ValueError: plans: a plan was made for another source
core.run(_core.image_source(u8(4, 5, 3)), plans, arrays)
    -> ValueError: plans: a plan was made for another source
core.run(scene_source((4, 4), has_sky=False), scene_plans, arrays_for(*scene_plans))
    -> ValueError: plans: a plan was made for another source
other.run(source, plans, arrays) -> ValueError: plans: a plan was made for another renderer
core.run(source, (looked_at,), arrays_for(looked_at))
    -> ValueError: plans: a plan was made for another renderer
core.run(source, unlike, arrays_for(*unlike)) -> ValueError: plans: their images differ
plans[0].shares_images(source) -> TypeError: shares_images: a Plan is needed, not <vkbloom._core...
plans[0].is_of_image(plans[0]) -> TypeError: is_of_image: a Source is needed, not <vkbloom._core...
core.pages(0) -> ValueError: pages: a size of 0 bytes is not above 0
core.pages(-1) -> ValueError: pages: a size of -1 bytes is not above 0
core.pages(2**62)
    -> OutOfMemoryError: memory is short: the host has no 4.398e+12 MiB more. Smaller bloom buffe...
type(source)() -> TypeError: cannot create 'vkbloom._core.Source' instances
type(plans[0])() -> TypeError: cannot create 'vkbloom._core.Plan' instances
type(core.pages(5))() -> TypeError: cannot create 'vkbloom._core.Pages' instances
_core.dry_run([]) -> TypeError: dry_run: a tuple is needed, not []
_core.dry_run(((1, 2),)) -> TypeError: dry_run() argument 1 must be vkbloom._core.Source, not int
_core.dry_run((5,)) -> TypeError: dry_run: a tuple is needed, not 5
_core.Renderer("auto", validation=True) -> TypeError: Renderer takes no keyword arguments
_core.Renderer("auto", driver, True, "auto", 0.0, _no_cache)
    -> ValueError: frame_seconds: a number above 0 is needed
_core.Renderer("auto", driver, True, "auto", -1.0, _no_cache)
    -> ValueError: frame_seconds: a number above 0 is needed
_core.Renderer("auto", driver, True, "auto", np.nan, _no_cache)
    -> ValueError: frame_seconds: a number above 0 is needed
_core.Renderer("auto", driver, True, "auto", 1.0, _no_cache) -> OSError: no cache
_core.Renderer("auto", driver, True, "auto", 1.0, lambda uuid: "text")
    -> TypeError: expected bytes, str found
raw(serial=0) -> ValueError: scene: the serial 0 is reserved
raw(serial=-1) -> OverflowError: can't convert negative int to unsigned
raw(serial=2**64) -> OverflowError: int too big to convert
raw(size=(2**32 + 16, 16)) -> ValueError: 4294967312 is out of range, 0 to 4294967295
raw(size=(16, -1)) -> ValueError: -1 is out of range, 0 to 4294967295
raw(body=5) -> TypeError: scene: mesh: a tuple is needed, not 5
raw(body=(body[0].astype(float), *body[1:])) -> TypeError: scene: vertices is an array of the wr...
raw(body=(body[0], body[1].astype(np.int8), *body[2:]))
    -> TypeError: scene: indices is an array of the wrong type, "b"
raw(body=(*body[:2], np.zeros((1, 3), np.float32), *body[3:]))
    -> ValueError: scene: emission must have the mesh's 17220 rows of 3
raw(body=(*body[:4], ((3, 0, 0),))) -> ValueError: scene: surface 0 is not within the textures o...
raw(body=(*body[:4], (5,))) -> TypeError: scene: surface: a tuple is needed, not 5
raw(body=(*body[:4], ((2**32, 0, 0),))) -> ValueError: 4294967296 is out of range, 0 to 4294967295
raw(body=(*body[:4], ((0, 2**32, 0),))) -> ValueError: 4294967296 is out of range, 0 to 4294967295
raw(body=(*body[:4], ((0, 0, -1),))) -> ValueError: -1 is out of range, 0 to 4294967295
raw(body=(body[0], many_indices, *body[2:])) -> ValueError: scene: 4294967299 indices are out of...
raw(sky=sky[:1] * 20) -> ValueError: skybox: 20 mip levels are out of range, 0 to 16
raw(sky=sky[:1] * 2) -> ValueError: skybox: level 1 is not 6 times 256 x 256
raw(sky=(u8(6, 2, 4, 4),)) -> ValueError: skybox: level 0 is not 6 times 4 x 2
raw(sky=(u8(6, 1, 1, 4),) * 2) -> ValueError: skybox: level 1 is not 6 times 1 x 1
raw(textures=(((), "repeat", "repeat", "linear", "linear", "linear"),))
    -> ValueError: texture: there are no levels
raw(textures=((sky, "repeat", "tile", "linear", "linear", "linear"),))
    -> ValueError: texture: unknown tile
raw(textures=(5,)) -> TypeError: texture: a tuple is needed, not 5
"""


@pytest.fixture(scope="module")
def names(
    renderer: Renderer, scene: Scene, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, Any]]:
    """The names that the table uses."""
    source, plans = planned(renderer, Separable(), Separable(bloom_size=(3, 3)))
    read_only = np.empty((4, 4, 4), np.uint8)
    read_only.flags.writeable = False
    of_scene = scene_arguments(scene, (8, 8), "forward", 0.0)
    parts, camera, size, *rest = of_scene
    given = dict(zip(("serial", "body", "glow", "sky", "textures"), parts, strict=True))
    # A file of a hole takes no room. In 32 bits there would be three indices.
    file = tmp_path_factory.mktemp("indices") / "indices"

    def raw(size: Any = size, **changes: Any) -> _core.Source:
        return _core.scene_source(tuple((given | changes).values()), camera, size, *rest)

    with Renderer() as other:
        yield {
            **globals(),
            **given,
            "raw": raw,
            "scene_source": scene_source,
            "plan": lambda **fields: scene_plan(settings_with(**fields), (16, 16)),
            "ghosts": lambda given: stage_with(stage="ghosts", ghosts=given),
            "u8": lambda *shape: np.zeros(shape, np.uint8),
            "core": renderer._core,
            "other": other._core,
            "source": source,
            "plans": plans[:1],
            "unlike": plans,
            "arrays": arrays_for(plans[0]),
            "read_only": read_only,
            "of_scene": of_scene,
            "scene_plans": (renderer._core.plan(_core.scene_source(*of_scene), Separable(), None),),
            "looked_at": _core.plan(source, Separable(), None, "fragment"),
            "driver": bundled_driver(),
            "many_indices": np.memmap(file, np.uint32, "w+", shape=(2**32 + 3,)),
        }


@pytest.mark.parametrize(("call", "error"), rows(TABLE))
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


@pytest.mark.skipif(
    sys.version_info < (3, 14) and not getattr(sys, "_is_gil_enabled", lambda: True)(),
    reason="Python 3.13 without the GIL keeps every type once a thread has been started",
)
def test_types_of_settings_are_not_kept() -> None:
    class Passing(Given):
        method = "pyramid"

    scene_plan(Passing(), (16, 16))
    kept = weakref.ref(Passing)
    del Passing
    gc.collect()
    assert kept() is None


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


def test_settings_that_close_the_renderer() -> None:
    renderer = Renderer()

    class Closing(Given):
        method = "pyramid"

        @property
        def exposure(self) -> float:
            renderer.close()
            return 0.0

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
