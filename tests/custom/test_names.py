"""Names of images: random graphs of all methods with several stages of glare, and of custom
methods that save textures under any legal name, also under those of the package's images.
"""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.exhaustive import EXHAUSTIVE, examples
from tests.images import hdr_picture
from tests.methods.cases import METHODS, OTHERS, presets_of_low_levels
from tests.planned import scene_source
from tests.tolerance import assert_close, real, tolerance
from tests.variants import VARIANTS, open_variant
from vkbloom import (
    BlenderGlare,
    Dirt,
    Frames,
    Ghosts,
    Glare,
    Halo,
    Pyramid,
    Renderer,
    Settings,
    Streaks,
    _core,
    load_method,
    reference,
)
from vkbloom._custom.shaders import BLACK, package_shader
from vkbloom.reference._compositing import composite_without_store
from vkbloom.reference._glare import light as total

Array = NDArray[Any]

IMAGE = hdr_picture(30, 22, 4, "float32")
#: Framebuffers of the package have these names in some frame.
RESERVED: Final = {
    *("image", "emission", "mask", "glow", "final", "scene", "hdr", "depth", "main", "bloom")
}
EVERY: Final[list[Settings]] = [
    *METHODS.values(),
    *OTHERS.values(),
    *presets_of_low_levels(32).values(),
    *(BlenderGlare(type=kind) for kind in ("ghosts", "streaks", "simple_star", "sun_beams")),
]
STAGES: Final = (
    Streaks(directions=2, iterations=2, base=2),
    Streaks(directions=1, halvings=3),
    Ghosts(scales=(-1.5, 0.5)),
    Ghosts(halvings=1),
    Halo(halvings=0),
)


def sources() -> dict[str, _core.Source]:
    mask = np.ones(IMAGE.shape[:2], np.float32)
    return {
        "image": _core.image_source(IMAGE),
        "masked": _core.image_source(IMAGE, IMAGE.copy(), mask),
        "forward": scene_source((64, 36)),
        "deferred": scene_source((64, 36), shading="deferred"),
    }


def random_glare(chance: random.Random) -> tuple[Glare, ...]:
    """Return up to five stages, several of one kind."""
    stages = chance.choices(STAGES, k=chance.randint(0, 4))
    dirt = [Dirt(seed=1)] if stages and chance.random() < 0.3 else []
    return (*stages, *dirt)


class Pass(NamedTuple):
    """Computes `share` times a texture, plus `added`. `save` is empty for the picture."""

    read: str
    save: str
    share: float
    added: float

    def text(self) -> str:
        save = f"//!SAVE {self.save}\n" if self.save else ""
        value = f"{self.share} * {self.read}_texOff(0).rgb + {self.added}"
        return (
            f"//!HOOK OUTPUT\n//!BIND {self.read}\n{save}"
            f"vec4 hook() {{ return vec4({value}, 1.0); }}\n"
        )


def random_passes(chance: random.Random, names: list[str]) -> list[Pass]:
    """Return passes that save textures, and at the end BLOOM or the picture."""
    passes: list[Pass] = []
    for save in [*chance.choices(names, k=chance.randint(1, 5)), chance.choice(["BLOOM", ""])]:
        read = chance.choice(["HOOKED", "GLOW", *(one.save for one in passes)])
        shares = chance.sample([0.25, 0.5, 0.75, 1.25], 2)
        passes.append(Pass(read, save, shares[0], shares[1]))
    return passes


def textures_of(passes: list[Pass], glow: Array = IMAGE) -> dict[str, Array]:
    """Return what the passes write, by the names that they save; the picture under ''."""
    textures = {"HOOKED": IMAGE[..., :3], "GLOW": glow[..., :3]}
    for one in passes:
        textures[one.save] = one.share * textures[one.read].astype(np.float64) + one.added
    return {one.save: textures[one.save] for one in passes}


def names_of(saved: set[str], others: set[str]) -> dict[str, str]:
    """Return the framebuffers of saved textures; the package has those of `others`."""
    spelled = saved - {"", "BLOOM"}
    counts = Counter(name.lower() for name in spelled)
    given = {name: name.lower() if counts[name.lower()] == 1 else name for name in spelled}
    names = {}
    for name, label in given.items():
        if label in RESERVED | others:
            is_saved = f"saved_{label}" in given.values() or f"saved_{label}" in others
            names[name] = f"saved{'__' if is_saved else '_'}{label}"
        else:
            names[name] = label
    return names


def find_names() -> list[str]:
    """Return names of all images of the package, as textures may be saved, and some others."""
    found = {"foo", "Foo", "FOO", "x", "y1", "MAINPRESUB", "RGB", "n" * 31}
    for settings in EVERY:
        glare = (*STAGES[:3], Halo(), Dirt())
        for variant in ("fragment", "cpu", "gpu"):
            for one in (settings, settings.replace(glare=glare)):
                plan = _core.plan(_core.image_source(IMAGE), one, None, variant)
                found |= {name for row in plan.passes for name in (row[0], *row[2], *row[3])}
    for kind in ("forward", "deferred"):
        plan = _core.plan(sources()[kind], Pyramid(glare=STAGES), None)
        found |= {name for row in plan.passes for name in (*row[2], *row[3])}
    found |= {f"{kind}_{i}" for kind in ("streaks", "ghosts", "halo", "adjoint") for i in range(3)}
    found |= {
        "by_image",
        "cotangents_0",
        "adjoint_weights",
        "probed_texels",
        "bloom_buffer",
        "main",
    }
    legal = {name.lstrip(".") for name in found}
    legal = {name for name in legal if re.fullmatch(r"[A-Za-z]\w*", name) and "__" not in name}
    legal |= {f"saved_{name}" for name in legal if len(name) < 20}
    assert len(legal) > 100
    return sorted({change(name) for name in legal for change in (str.lower, str.upper)} - {"GLOW"})


@pytest.fixture(scope="module")
def known_names() -> list[str]:
    return find_names()


@pytest.fixture
def uncompiled(glslang: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Plans need no shader of a pass: each has the same one."""
    code = package_shader(BLACK).code
    monkeypatch.setattr("vkbloom._custom.shaders.cached_code", lambda shader: code)


def check_plan(plan: _core.Plan, expected: set[str]) -> None:
    """Check the framebuffers; that no two images have one name the core itself has checked."""
    outputs = Counter(name for name, _, _ in plan.outputs)
    assert set(outputs.values()) == {1}
    assert set(outputs) == expected


def framebuffers_of(source: _core.Source, settings: Settings) -> set[str]:
    return {name for name, _, _ in _core.plan(source, settings, None).outputs}


@pytest.mark.usefixtures("uncompiled")
def test_a_thousand_random_graphs(known_names: list[str]) -> None:
    """Each graph has the framebuffers of its parts, and the core refuses none."""
    given = sources()
    for seed in range(1000):
        chance = random.Random(seed)
        source = given[chance.choice(list(given))]
        variant = chance.choice(["fragment", "cpu", "gpu"])
        glare = random_glare(chance)
        if seed % 2:
            passes = random_passes(chance, known_names)
            text = "\n".join(one.text() for one in passes)
            settings = load_method(text, name="random")(glare=glare)
            alone = load_method(Pass("HOOKED", "BLOOM", 1, 0).text(), name="alone")(glare=glare)
            others = framebuffers_of(source, alone)
            saved = {"MAIN" if one.save == "MAINPRESUB" else one.save for one in passes}
            expected = others | set(names_of(saved, others).values())
        else:
            method = chance.choice(EVERY)
            settings = method.replace(glare=glare)
            stages = framebuffers_of(source, Pyramid(glare=glare)) - framebuffers_of(
                source, Pyramid()
            )
            expected = framebuffers_of(source, method) | stages
        check_plan(_core.plan(source, settings, None, variant), expected)


@pytest.mark.parametrize("seed", range(examples(8)))
def test_methods_with_several_stages_are_rendered(renderer: Renderer, seed: int) -> None:
    chance = random.Random(seed)
    settings = chance.choice(EVERY).replace(
        glare=random_glare(chance), format="rgba32float", tonemap="none", dither=False
    )
    check_frames(renderer.apply(IMAGE, settings), settings)


def test_stages_beside_images_of_the_same_name(renderer: Renderer) -> None:
    glare = (Ghosts(), Ghosts(scales=(-1.5,), intensity=0.5))
    settings = BlenderGlare(type="ghosts", threshold=0.3, glare=glare, format="rgba32float")
    frames = renderer.apply(IMAGE, settings)
    check_frames(frames, settings)
    assert {"ghosts_0", "ghosts_1", ".ghosts_1"} <= set(frames.timings)


@pytest.mark.usefixtures("uncompiled")
def test_derivatives_beside_textures_of_their_names(renderer: Renderer) -> None:
    names = ("by_image", "COTANGENTS_0", "adjoint_0", "adjoint_weights")
    passes = [Pass("GLOW", name, 1, 0) for name in (*names, "BLOOM")]
    settings = load_method("\n".join(one.text() for one in passes), name="derived")()
    source = _core.image_source(IMAGE, None, None, (np.zeros_like(IMAGE),))
    plan = renderer._core.plan(source, settings, None, ("glow",), "images")
    assert plan is not None
    assert [name for name, _, _ in plan.outputs] == [".by_image"]


def reference_of(
    passes: list[Pass], glow: Array = IMAGE
) -> Callable[[Array, Settings], Mapping[str, Array]]:
    textures = textures_of(passes, glow)
    names = {**names_of(set(textures), set()), "BLOOM": "bloom", "": "final"}
    is_bloom = "BLOOM" in textures

    def render(image: Array, settings: Settings) -> dict[str, Array]:
        return {name: np.dstack([part, np.ones(part.shape[:2])]) for name, part in parts()}

    def parts() -> Iterator[tuple[str, Array]]:
        for name, part in textures.items():
            if name or not is_bloom:
                yield names[name], part

    return render


#: Names, and glare beside them, in whose graphs images of one name met.
CUSTOM: Final[dict[str, tuple[list[str], tuple[Glare, ...]]]] = {
    "light": (["LIGHT", "DIRT", "GLARE_DOWN_0"], (STAGES[1], Dirt(seed=1))),
    "stages": (["STREAKS", "GHOSTS_1", "HALO"], (STAGES[0], *STAGES[2:])),
    "saved": (["SAVED_STREAKS", "STREAKS", "SAVED_GLOW", "glow"], STAGES[:1]),
    "case": (["Foo", "FOO", "bloom", "Final"], ()),
    "stage_names": (["streaks_0", "streaks_1", "RGB"], STAGES[:2]),
}


@pytest.mark.usefixtures("glslang")
@pytest.mark.parametrize("end", ["BLOOM", ""])
@pytest.mark.parametrize("case", CUSTOM)
def test_custom_methods_are_rendered(renderer: Renderer, case: str, end: str) -> None:
    names, glare = CUSTOM[case]
    reads = ["HOOKED", *names]
    passes = [
        Pass(read, save, 0.5, 0.25 * number)
        for number, (read, save) in enumerate(zip(reads, [*names, end], strict=True))
    ]
    check_rendered(renderer, passes, glare, name=case)


@pytest.mark.usefixtures("glslang")
@pytest.mark.parametrize("seed", range(100 if EXHAUSTIVE else 4))
def test_random_custom_methods_are_rendered(
    renderer: Renderer, known_names: list[str], seed: int
) -> None:
    chance = random.Random(seed)
    names = [name for name in known_names if name not in ("RGB", "MAINPRESUB", "mainpresub")]
    check_rendered(renderer, random_passes(chance, names), random_glare(chance), name="random")


def check_rendered(
    renderer: Renderer, passes: list[Pass], glare: tuple[Glare, ...], name: str
) -> None:
    settings = settings_of(passes, name, glare)
    check_frames(renderer.apply(IMAGE, settings), settings)


def settings_of(
    passes: list[Pass], name: str, glare: tuple[Glare, ...], glow: Array = IMAGE
) -> Settings:
    """Return settings of a method with these passes and a reference, for IMAGE with this glow."""
    text = "\n".join(one.text() for one in passes)
    method = load_method(text, name=name, reference=reference_of(passes, glow))
    return method(glare=glare, format="rgba32float")


@pytest.mark.usefixtures("glslang")
@pytest.mark.parametrize("dtype", ["uint8", "float16"])
def test_glare_is_added_to_a_picture_in_each_variant(dtype: str) -> None:
    """Exposure, tone map and encoding come after it; alpha is that of the picture."""
    image = hdr_picture(30, 22, 4, dtype)
    method = load_method(Pass("HOOKED", "", 0.5, 0.0625).text(), name="half")
    glare = (Streaks(halvings=1), Dirt(seed=1), Ghosts(intensity=0.5))
    settings = method(glare=glare, exposure=-1, tonemap="reinhard", threshold=0.5)
    # The same picture as a frame of its own, to which a bloom of 0 and the same glare are added.
    halved = np.dstack([0.5 * real(image)[..., :3] + 0.0625, np.ones(image.shape[:2])])
    plain = Pyramid(**{name: getattr(settings, name) for name in ("glare", "exposure", "tonemap")})
    stages = reference.apply(image, Pyramid(glare=glare, threshold=0.5))
    light = total(np.zeros_like(halved), 0.0, [stages["streaks"], stages["ghosts"]], glare)
    expected = composite_without_store(halved, light, plain, np.dtype(dtype))
    for variant in VARIANTS:
        with open_variant(variant) as renderer:
            got = renderer.apply(image, settings)["final"]
        limit = tolerance(
            got.dtype, expected, stages_of_8_bits=2, magnitude=np.abs(halved) + np.abs(light)
        )
        assert_close(variant, got, expected, limit)


def check_frames(frames: Frames, settings: Settings, **given: Any) -> None:
    """Compare all framebuffers of IMAGE with the reference."""
    expected = reference.apply(IMAGE, settings, **given)
    assert set(frames) == {"glow", *expected}
    for framebuffer, part in expected.items():
        got = frames[framebuffer]
        assert_close(framebuffer, got, part, tolerance(got.dtype, part, stages=8))
