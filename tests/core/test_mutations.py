"""One pass changed on purpose: the check fails, and the report names that pass as the first.

Each mutation is an edit of a shader, compiled into a core of its own, so that everything after the
changed pass differs as it would in an engine. The cores differ in that shader's modules alone: the
rest is compiled once.
"""

from __future__ import annotations

import dataclasses
import json
import shutil
import sys
from pathlib import Path

import pytest

from tests.core.builds import compiler, core_with_faults, succeed
from tests.device.abilities import has_linear_texels
from tests.exhaustive import some
from tests.processes import output
from vkbloom import Renderer

# Its levels are not exactly twice as large as the next, for which the shaders have variants.
IMAGE = """
import numpy as np
import vkbloom

def test_bloom(bloom_renderer, frame_regression):
    image = np.random.default_rng(7).random((50, 70, 3), dtype=np.float32) ** 8
    frame_regression.check(bloom_renderer.apply(image, vkbloom.{settings}))
"""
SCENE = """
import vkbloom

def test_bloom(bloom_renderer, frame_regression):
    frame_regression.check(bloom_renderer.render(vkbloom.Scene.ufo(), size=(64, 36)))
"""


@dataclasses.dataclass(frozen=True)
class Mutation:
    """A change, the test that finds it, and the first framebuffer that differs."""

    shader: str
    original: str
    mutated: str
    test: str
    equal: tuple[str, ...]  # before the change, or beside it
    different: tuple[str, ...]  # the first one is what the mutated pass writes
    cases: str  # of the self-test, one of which is in this variant


MUTATIONS = {
    # The centre of the tent, on the way up: 0.25 becomes 0.255.
    "weight wrong by 2 %": Mutation(
        shader="filter.frag",
        original="    if (ADDS_IMAGE != 0)\n",
        mutated="    if (KERNELS == 1)\n"
        "        sum += 0.005 * params.coarse * fetch_clamped(source, PLACE_IN(source).texel);\n"
        "    if (ADDS_IMAGE != 0)\n",
        test=IMAGE.format(settings="Pyramid(levels=3)"),
        equal=("glow", "down_0", "down_1", "down_2"),
        different=("up_1", "up_0", "bloom", "final"),
        cases=": pyramid, ",
    ),
    # In the vertical pass of two, of a scene.
    "rows flipped": Mutation(
        shader="blur.frag",
        original="    Place place = PLACE_IN(source);\n",
        mutated="    Place place = PLACE_IN(source);\n    if (DIRECTION == DIRECTION_VERTICAL)\n"
        "        place.texel.y = textureSize(source, 0).y - 1 - place.texel.y;\n",
        test=SCENE,
        equal=("glow", "glow_depth", "scene", "depth"),
        different=("blur_vertical", "bloom", "final"),
        cases=": tutorial, ",
    ),
}


# Compiles one shader of the tree anew, takes the others of a folder, and writes all of them into
# build/spirv/spirv.c.
SPIRV = """
import shutil
import sys
from pathlib import Path
import setuptools
setuptools.setup = lambda **_: None
import setup

build_module = setup.build_module

def build_changed(module, target, recipe):
    if module.shader.name == sys.argv[1]:
        build_module(module, target, recipe)
    else:
        shutil.copyfile(Path(sys.argv[2]) / f"{module.name}.spv", target)

setup.build_module = build_changed
setup.write_spirv(setup.processes())
"""


# Prints what some cases of the self-test find.
SELF_TEST = """
import json, sys
from vkbloom._doctor import self_test
done = [one for one in self_test.run("software", sys.argv[1]) if "group" in one]
assert len(done) > 3, done
print(json.dumps({f"{one['group']}: {one['name']}": one["wrong"] for one in done if one["wrong"]}))
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tree with a complete build without a mutation. Its fault injection is not used."""
    return core_with_faults(tmp_path_factory.getbasetemp())


def build(mutation: Mutation, whole: Path, tree: Path) -> Path:
    """Build a core with the mutation; return the folder to import it from."""
    shutil.copytree(whole, tree)
    (shader,) = (tree / "shaders").rglob(mutation.shader)
    text = shader.read_text()
    assert text.count(mutation.original) == 1
    shader.write_text(text.replace(mutation.original, mutation.mutated))
    succeed(tree, sys.executable, "-c", SPIRV, mutation.shader, whole / "build" / "spirv")
    (core,) = (tree / "python").rglob("_core*.so")
    (spirv,) = (tree / "build").rglob("spirv.o")
    objects = sorted((tree / "build").rglob("*.o"))
    succeed(tree, *compiler(), "-fPIC", "-Icsrc", "-c", "build/spirv/spirv.c", "-o", spirv)
    succeed(tree, *compiler(), "-shared", *objects, "-o", core, "-lm", "-ldl")
    return tree / "python"


@pytest.mark.parametrize("name", some(MUTATIONS, 1))
def test_is_found_and_named(
    name: str,
    whole: Path,
    pytester: pytest.Pytester,
    tmp_path_factory: pytest.TempPathFactory,
    request: pytest.FixtureRequest,
) -> None:
    monkeypatch: pytest.MonkeyPatch = request.getfixturevalue("monkeypatch")
    renderer: Renderer = request.getfixturevalue("renderer")
    mutation = MUTATIONS[name]
    pytester.makepyfile(test_one=mutation.test)
    # Without other plugins, which take most of such a short run's time.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    # The variant whose shaders the mutations change.
    monkeypatch.setenv("VKBLOOM_VARIANT", "fragment")
    options = ("-p", "no:cacheprovider", "-p", "vkbloom", "--bloom-adapter=software")
    pytester.runpytest_subprocess(*options, "--bloom-update").assert_outcomes(passed=1)

    mutant = build(mutation, whole, tmp_path_factory.mktemp("mutant") / "tree")
    monkeypatch.setenv("PYTHONPATH", str(mutant))
    # The pipelines of the right shaders must not be taken for these.
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path_factory.mktemp("pipelines")))
    result = pytester.runpytest_subprocess(*options)

    result.assert_outcomes(failed=1)
    first = mutation.different[0]
    result.stdout.fnmatch_lines([f"*test_bloom: the first framebuffer that differs is {first} (*"])
    lines = [f"*  {name}: equal" for name in mutation.equal]
    lines += [f"*  {name}: FAILED (*" for name in mutation.different]
    result.stdout.fnmatch_lines_random(lines)

    # On this device, whose other variants are right.
    monkeypatch.delenv("VKBLOOM_VARIANT")
    wrong = json.loads(output("-c", SELF_TEST, mutation.cases, cwd=mutant))
    named = f"; written by {mutation.shader.replace('.', '_')} ("
    assert all(named in words for words in wrong.values()), wrong
    (case,) = (case for case in wrong if case.startswith("fragment shaders: "))
    assert f"{named}fragment)" in wrong[case]
    assert len(wrong) == 1 or not has_linear_texels(renderer), wrong
