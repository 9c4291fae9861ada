"""Plans: a call does what its plan states, and planning makes no device call."""

from __future__ import annotations

import dataclasses
import itertools
import math
import operator
import pickle
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.exhaustive import examples, some
from tests.images import picture
from tests.planned import Inputs, frame_of, image_source
from vkbloom import (
    BlenderGlare,
    Convolution,
    DualKawase,
    Plan,
    Pyramid,
    Renderer,
    Scene,
    Separable,
    Settings,
    _core,
    glares,
    presets,
)
from vkbloom._renderer.new_arrays import new_arrays

SIZE = (96, 54)

METHODS: dict[str, Settings] = {
    # One convolution stands for all: they have the same passes.
    **{
        name: settings
        for name, settings in presets.items()
        if name == "iris_6" or not isinstance(settings, Convolution)
    },
    "layers": Separable(layers=((1.0, 0.5), (2.0, 0.5))),
    "loops": Separable(loops=2, bloom_scale=0.5),
    "direct": Separable(direct=True),
    "off": Separable(bloom=False),
    "kawase": DualKawase(levels=2),
}


def assert_planned(plan: Plan, frames: Any) -> None:
    """The plan has the framebuffers of the frames, and the passes that ran for them."""
    assert list(plan.framebuffers) == list(frames)
    for name, array in frames.items():
        assert plan.framebuffers[name] == (array.shape, array.dtype)
    assert list(dict.fromkeys(one.name for one in plan.passes)) == list(frames.timings)
    # Every image is written before it is read, and every requested one is written.
    made = {"image"} if plan.source == "image" else set()
    # A convolution's kernel comes from the host.
    made |= {"kernel"}
    for one in plan.passes:
        assert set(one.reads) <= made
        made |= set(one.writes)
    assert set(plan.framebuffers) <= made


def test_the_last_plan_is_used_again_only_for_the_same_call() -> None:
    """Calls that differ from the one before in one thing return what a new renderer returns."""
    image, mask = picture(16, 12, 4, dtype="float32"), picture(16, 12, 4, dtype="float32")[..., 0]
    scene = Scene.ufo()
    lamp = dataclasses.replace(
        scene.body, emission=np.ascontiguousarray(scene.body.vertices[:, 6:])
    )
    first, second = (Pyramid(levels=2, threshold=threshold) for threshold in (0.1, 0.9))
    calls: list[Callable[[Renderer], Mapping[str, Any]]] = [
        lambda renderer: renderer.apply(image, first),
        lambda renderer: renderer.apply(image[::-1], first),
        lambda renderer: renderer.apply(image, second),
        lambda renderer: renderer.apply(image[:8], second),
        lambda renderer: renderer.apply(image[:8, :, :3], second),
        lambda renderer: renderer.apply(image[:8, :, :3].astype(np.float16), second),
        lambda renderer: renderer.apply(image, second, mask=mask),
        lambda renderer: renderer.apply(image, second, mask=mask, emission=image),
        lambda renderer: renderer.apply(image, second, framebuffers="bloom"),
        lambda renderer: renderer.render(scene, second, (16, 12), framebuffers="bloom"),
        lambda renderer: renderer.render(scene, second, (16, 12), time=0.3, framebuffers="bloom"),
        lambda renderer: renderer.render(Scene(scene.body), second, (16, 12)),
        lambda renderer: renderer.render(Scene(lamp), second, (16, 12)),
    ]
    with Renderer() as renderer:
        for call in calls:
            frames = call(renderer)
            with Renderer() as other:
                alone = call(other)
            assert list(frames) == list(alone)
            for name, array in alone.items():
                assert np.array_equal(frames[name], array)


@pytest.mark.parametrize(("turn", "variant"), [(0, "fragment"), (1, "cpu"), (2, "gpu")])
def test_a_plan_of_an_image_is_what_runs(
    monkeypatch: pytest.MonkeyPatch, turn: int, variant: str
) -> None:
    monkeypatch.setenv("VKBLOOM_VARIANT", variant)
    with Renderer() as renderer:
        for number, (name, method) in some(enumerate(METHODS.items()), 9):
            # All framebuffers or `final` alone, by turns of methods and variants.
            framebuffers: str | Sequence[str] = ("final",) if (number + turn) % 2 else "all"
            dtype = ("uint8", "float16", "float32")[number % 3]
            image = picture(SIZE[0], SIZE[1], 3 + number % 2, dtype=dtype, seed=number)
            plan = renderer.plan(image, method, framebuffers=framebuffers)
            frames = renderer.apply(image, method, framebuffers=framebuffers)
            assert_planned(plan, frames)
            assert (plan.source, plan.size, plan.dtype) == ("image", SIZE, image.dtype), name
            if variant == "fragment":
                # Fourier transforms are compute shaders in every column.
                assert {one.variant for one in plan.passes} <= {"fragment", "dispatch"}


@pytest.mark.parametrize("shading", ["forward", "deferred"])
def test_a_plan_of_a_scene_is_what_runs(scene: Scene, shading: Any) -> None:
    # Each method in one of both; the passes of a scene do not follow from it.
    for method in some(list(METHODS.values())[shading == "deferred" :: 2], 4):
        # A renderer that has rendered nothing.
        with Renderer() as renderer:
            plan = renderer.plan(scene, method, SIZE, shading=shading)
            assert_planned(plan, renderer.render(scene, method, SIZE, shading=shading))
            assert (plan.source, plan.dtype, plan.channels) == (shading, None, None)


@pytest.fixture
def plain() -> np.ndarray[Any, Any]:
    return np.zeros((9, 16, 4), np.float32)


def test_plans_that_are_equal(renderer: Renderer, scene: Scene, plain: Any) -> None:
    plan = renderer.plan(plain, Pyramid(levels=2))
    same = renderer.plan(plain + 1, Pyramid(levels=2))
    assert plan == same
    assert hash(plan) == hash(same)
    assert renderer.plan(plain, Pyramid(levels=2), framebuffers=list(plan.framebuffers)) == plan
    assert pickle.loads(pickle.dumps(plan)) == plan
    assert pickle.loads(pickle.dumps(plan)).passes == plan.passes
    others = [
        renderer.plan(plain, Pyramid(levels=3)),
        renderer.plan(plain[:8], Pyramid(levels=2)),
        renderer.plan(plain[..., :3], Pyramid(levels=2)),
        renderer.plan(plain.astype(np.float16), Pyramid(levels=2)),
        renderer.plan(plain, Pyramid(levels=2), framebuffers="final"),
        renderer.plan(scene, Pyramid(levels=2), (16, 9)),
        renderer.plan(scene, Pyramid(levels=2), (16, 9), shading="deferred"),
    ]
    assert len({plan, *others}) == 1 + len(others)


def test_a_plan_cannot_be_changed(renderer: Renderer, plain: Any) -> None:
    plan: Any = renderer.plan(plain)
    with pytest.raises(AttributeError):
        plan.size = (1, 1)
    with pytest.raises(TypeError):
        plan.framebuffers["final"] = None


def test_defaults(renderer: Renderer, scene: Scene, plain: Any) -> None:
    assert renderer.plan(plain).settings == presets["bevy_natural"]
    assert renderer.plan(scene).settings == presets["tutorial"]
    assert renderer.plan(scene).size == (1280, 720)


def test_planning_waits_for_no_other_call(new_renderer: Callable[[], Renderer]) -> None:
    renderer = new_renderer()
    image = picture(64, 64)
    slow = Separable(weights=(1 / 65,) * 33, direct=True, blur_scale=0.5, format="rgba32float")
    renderer.apply(image, slow)
    # A GPU may be done with a small image before anything is planned.
    for side in (64, 256, 1024, 4096):
        thread = threading.Thread(target=renderer.apply, args=(picture(side, side), slow))
        thread.start()
        time.sleep(0.05)
        for _ in range(3):
            renderer.plan(image)
        did_not_wait = thread.is_alive()
        thread.join()
        if did_not_wait:
            break
    assert did_not_wait


def test_planning_makes_nothing(new_renderer: Callable[[], Renderer], plain: Any) -> None:
    renderer = new_renderer()
    for method in METHODS.values():
        renderer.plan(plain, method)
    assert renderer._core.pipeline_count == 0
    assert renderer._core.cached == (0, 0, 0)


# The dry run

CHANGES = st.sampled_from(
    [
        Separable(),
        Separable(exposure=1.0),
        Separable(blur_strength=0.5),
        Separable(threshold=0.5),
        Separable(loops=2),
        Separable(bloom_size=(12, 7)),
        Separable(bloom=False),
        Pyramid(levels=2),
        Pyramid(levels=3),
        presets["kino"],
    ]
)
IMAGES = [picture(20, 14, seed=1), picture(20, 14, seed=2), picture(9, 14, 3, seed=3)]
NAMES = st.sampled_from([None, ("final",), ("final",), ()])
CALLS = st.lists(st.tuples(st.integers(0, len(IMAGES) - 1), CHANGES, NAMES), max_size=12)


def dry_run(steps: tuple[tuple[_core.Source, _core.Plan], ...]) -> list[list[str]]:
    """Return the names of the passes that would run."""
    return [list(dict.fromkeys(name for name, *_ in ran)) for ran in _core.dry_run(steps)]


@given(calls=CALLS)
@example(calls=[(0, method, None) for method in (Separable(), Separable(bloom=False), Separable())])
@settings(max_examples=examples(10), deadline=None)
def test_a_dry_run_of_images_is_what_runs(
    calls: list[tuple[int, Settings, tuple[str, ...] | None]],
) -> None:
    with Renderer() as renderer:
        sources = [image_source(image) for image in IMAGES]
        steps = tuple(
            (sources[number], renderer._core.plan(sources[number], method, names))
            for number, method, names in calls
        )
        ran = [
            list(
                renderer.apply(
                    IMAGES[number], method, framebuffers="all" if names is None else names
                ).timings
            )
            for number, method, names in calls
        ]
        assert dry_run(steps) == ran


def test_a_dry_run_of_scenes_is_what_runs(
    new_renderer: Callable[[], Renderer], scene: Scene
) -> None:
    renderer = new_renderer()
    calls = [(Separable(exposure=step % 3), step // 3 % 2 / 4, step // 6) for step in range(12)]
    steps, ran = [], []
    for method, turns, which in calls:
        shading: Any = ("forward", "deferred")[which]
        source = frame_of(scene, SIZE, shading, turns)
        steps.append((source, renderer._core.plan(source, method, None)))
        frames = renderer.render(scene, method, SIZE, shading=shading, time=turns)
        ran.append(list(frames.timings))
    assert dry_run(tuple(steps)) == ran
    assert ran[1] == ["final"]


# Shown


def test_mermaid_has_every_pass_and_image(renderer: Renderer, scene: Scene) -> None:
    plan = renderer.plan(scene, Pyramid(levels=2), SIZE, shading="deferred")
    lines = plan.to_mermaid().splitlines()
    arrows = [line for line in lines if "-->" in line]
    assert len(arrows) == len(plan.passes)
    for number, (one, arrow) in enumerate(zip(plan.passes, arrows, strict=True)):
        parts = [part.strip().split(" & ") for part in arrow.split("-->")]
        reads = [list(one.reads)] if one.reads else []
        assert parts == [*reads, [f"pass{number}"], list(one.writes)]
    for name, (shape, dtype) in plan.framebuffers.items():
        assert f'    {name}["{name}<br>{shape[1]} x {shape[0]}, {dtype}"]' in lines


def test_html_and_repr(renderer: Renderer, plain: Any) -> None:
    plan = renderer.plan(plain, Separable(threshold=1.0))
    table = plan._repr_html_()
    assert ">keeps the light that will glow: what is above the threshold</td>" in table
    assert table.count("<tr>") == 1 + len(plan.passes)
    for one in plan.passes:
        assert f">{one.shader}</td>" in table
    assert repr(plan) == (
        "<vkbloom.Plan of float32 image, 16 x 9, separable: 4 passes, 4 framebuffers>"
    )


def test_every_pass_has_a_sentence(renderer: Renderer, plain: Any, scene: Scene) -> None:
    image = np.zeros((270, 480, 3), np.float32)
    settings = [*presets.values(), *(Pyramid(glare=glare) for glare in glares.values())]
    plans = [renderer.plan(image, one) for one in settings]
    plans += [renderer.plan(scene, Separable(), shading=one) for one in ("forward", "deferred")]
    missing = {name for plan in plans for name, text in plan.sentences.items() if not text}
    assert missing == set()
    for plan in plans:
        assert list(plan.sentences) == list(dict.fromkeys(one.name for one in plan.passes))
        # The explorer shows that of the pass which writes a framebuffer; none writes a kernel.
        written = {name for one in plan.passes for name in one.writes}
        assert {*plan.framebuffers} <= written | {"kernel"}
    # By the method, by the source, and of passes that have a number in their name.
    for one, name, text in (
        (Pyramid(), "down_1", "halves the size with 13 taps, so that small lights do not flicker"),
        (DualKawase(), "down_1", "halves the size with five taps"),
        (presets["unity_urp_dual"], "down_1", "halves the size with five taps"),
        (Separable(direct=True), "bloom", "blurs along rows and columns at once, with N x N taps"),
        (Pyramid(), "glow", "takes the complete frame: without a threshold all of it glows"),
    ):
        assert renderer.plan(image, one).sentences[name] == text
    before = renderer.plan(image, presets["kino"]).sentences["glow"]
    assert before == "takes the complete frame; the method applies its threshold later"
    drawn = renderer.plan(scene, presets["kino"]).sentences["glow"]
    assert drawn == "draws the lights of the scene, which will glow"


def test_a_plan_is_not_refused_for_its_memory(renderer: Renderer) -> None:
    """It takes none; lavapipe tells of a heap of 2 GiB on any machine."""
    image = np.broadcast_to(np.float32(1), (4320, 7680, 4))
    plan = renderer.plan(image, Pyramid(levels=8, format="rgba32float"))
    shapes = [image.shape, *(shape for shape, _ in plan.framebuffers.values())]
    assert sum(4 * math.prod(shape) for shape in shapes) > 2 << 30


STEPS: dict[str, Settings] = {
    "separable": Separable(threshold=0.3, knee=0.2),
    "pyramid": Pyramid(levels=3, threshold=0.3, knee=0.2),
    "kino": presets["kino"],
    "edge": Convolution(np.random.default_rng(1).random((5, 4, 3)), boundary="edge"),
    "mirror": BlenderGlare(type="kernel", kernel=np.ones((3, 3))),
}


def plan_derivatives(
    renderer: Renderer, settings: Settings, size: tuple[int, int], results: str | None = None
) -> tuple[Any, Any]:
    """Return a source and its plan: of frames, or of derivatives by images or by fields."""
    pixels = picture(*size, 3, dtype="float32")
    floats = settings.replace(format="rgba32float")
    if results is None:
        source = Inputs(pixels).source()
        return source, renderer._core.plan(source, floats, None)
    source = Inputs(pixels).source((pixels,))
    sums = ("threshold",) if results == "sums" else ()
    return source, renderer._core.plan(source, floats, None, ("final",), results, sums)


@pytest.mark.parametrize("name", STEPS)
def test_a_training_step_computes_no_transposes_again(renderer: Renderer, name: str) -> None:
    """Also with other settings, after another size."""
    settings, counts = STEPS[name], []
    for size, intensity in (((37, 22), 0.5), ((37, 22), 0.6), ((22, 37), 0.6), ((37, 22), 0.7)):
        plan_derivatives(renderer, settings.replace(intensity=intensity), size, "images")
        counts.append(renderer._core.transposes[0])
    assert counts[0] == counts[1]
    assert counts[2] == counts[3]


def test_transposes_that_are_kept_are_few(renderer: Renderer) -> None:
    """Of many sizes, until the oldest ones are dropped; a closed renderer has none."""
    with Renderer(renderer.info.name) as own:
        sizes: list[int] = []
        for width in range(16_000, 16_040):
            plan_derivatives(own, Pyramid(levels=12), (width, 1), "images")
            sizes.append(own._core.transposes[1])
        assert max(sizes) <= 32 << 20
        assert any(after < before for before, after in itertools.pairwise(sizes))
    assert own._core.transposes[1] == 0


def test_plans_of_derivatives_are_kept(renderer: Renderer) -> None:
    """For the same settings and kind of image; frames, derivatives and sums have one each."""
    settings, plans = Separable(threshold=0.3, knee=0.2), []
    with Renderer(renderer.info.name) as own:
        for size in ((9, 8), (9, 8), (8, 9)):
            pixels = picture(*size, 3, dtype="float32")
            sources = Inputs(pixels).source(), Inputs(pixels).source((pixels,))
            plans.append(
                [
                    own._plan_of(sources[0], settings, None),
                    own._plan_derivatives(sources[1], settings, ("bloom",), "images", ()),
                    own._plan_derivatives(sources[1], settings, ("bloom",), "sums", ("threshold",)),
                ]
            )
        assert all(map(operator.is_, plans[0], plans[1]))
        assert not any(map(operator.is_, plans[1], plans[2]))
        other = own._plan_derivatives(sources[1], settings, ("final",), "images", ())
        assert other is not plans[2][1]


def passes_of(renderer: Renderer, settings: Settings, results: str | None = None) -> set[str]:
    """Run a plan of plan_derivatives(); return the names of the passes that ran."""
    source, plan = plan_derivatives(renderer, settings, (19, 12), results)
    arrays = new_arrays(renderer._core, plan, "host")
    return {*renderer._core.run(source, (plan,), (arrays,), True).wait()[0][0]}


def test_sums_that_do_not_exist_are_refused(renderer: Renderer) -> None:
    image = np.zeros((9, 8, 4), np.float32)
    source, settings = Inputs(image).source((image,)), Pyramid(levels=2, threshold=0.3, knee=0.2)

    def plan(sums: Any) -> Any:
        return renderer._core.plan(source, settings, None, ("final",), "sums", sums)

    assert [name for name, *_ in plan(("intensity", "threshold")).outputs] == [".by_light"]
    with pytest.raises(ValueError, match="sums: there is none named 'threshod'"):
        plan(("intensity", "threshod"))
    with pytest.raises(TypeError, match="tuple"):
        plan("intensity")


@pytest.mark.parametrize("boundary", ["zero", "edge", "wrap", "wrap_x"])
def test_a_convolution_and_its_transpose_have_one_spectrum(
    renderer: Renderer, boundary: Any
) -> None:
    """The kernel is transformed for frames, and not again for derivatives."""
    kernel = np.random.default_rng(1).random((5, 4, 3))
    settings = Convolution(kernel, boundary=boundary, tonemap="reinhard")
    assert "kernel" in passes_of(renderer, settings)
    ran = passes_of(renderer, settings, "images")
    assert "spectrum" in ran
    assert "kernel" not in ran


def test_sums_find_the_cotangents_of_images(renderer: Renderer) -> None:
    """What the derivatives by images need is not computed again for those by fields."""
    settings = Pyramid(levels=3, threshold=0.3, knee=0.2)
    images, sums = (passes_of(renderer, settings, wanted) for wanted in ("images", "sums"))
    added = ("by_", "adjoint_sum_")
    assert any(name.startswith("adjoint_") for name in images)
    # On GPUs they are named by what is added up.
    assert any(name.startswith(added) for name in sums)
    assert not any(name.startswith("adjoint_") and not name.startswith(added) for name in sums)
