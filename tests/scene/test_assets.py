"""The built-in scene is what tools/make_scene.py makes.

The glTF files and images are read here with NumPy and OpenImageIO alone, so that a fault of the
package's own loaders cannot hide one of theirs. The package has the arrays that its loaders make of
these files.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from tests.exhaustive import witness
from vkbloom._scene import Scene

Array = npt.NDArray[Any]

ROOT = Path(__file__).resolve().parents[2]
FILES = ROOT / "examples" / "saucer"
PACKED = ROOT / "python" / "vkbloom" / "assets" / "ufo.npz"
MESHES = ("saucer", "saucer_glow")
FACES = ("px", "nx", "py", "ny", "pz", "nz")

# glTF 2.0, section 5.1: component types and the element sizes of accessors.
COMPONENTS: dict[int, np.dtype[Any]] = {5123: np.dtype("<u2"), 5126: np.dtype("<f4")}
WIDTHS = {"SCALAR": 1, "VEC3": 3}


WHOLE = witness("the script takes 18 s; its meshes and its sky are tested in part")


def read_json(path: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return document


def read_accessor(document: dict[str, Any], blob: bytes, index: int) -> Array:
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    dtype, width = COMPONENTS[accessor["componentType"]], WIDTHS[accessor["type"]]
    assert view.get("byteStride", dtype.itemsize * width) == dtype.itemsize * width
    start = view["byteOffset"] + accessor["byteOffset"]
    end = start + accessor["count"] * dtype.itemsize * width
    assert start % dtype.itemsize == 0
    assert end <= view["byteOffset"] + view["byteLength"] <= len(blob)
    values: Array = np.frombuffer(blob[start:end], dtype).reshape(-1, width)
    return values


def read_face(path: Path) -> Array:
    image = oiio.ImageBuf(str(path))
    pixels = image.get_pixels(oiio.UINT8)
    assert pixels is not None, image.geterror()
    return pixels


@pytest.fixture(scope="module")
def make_scene() -> Iterator[Any]:
    """The script, as a module."""
    spec = importlib.util.spec_from_file_location("make_scene", ROOT / "tools" / "make_scene.py")
    assert spec is not None
    assert spec.loader is not None
    # Dataclasses look up their module.
    module = sys.modules["make_scene"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    del sys.modules["make_scene"]


@pytest.fixture(scope="module")
def fresh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files made anew."""
    folder = tmp_path_factory.mktemp("saucer")
    script = ROOT / "tools" / "make_scene.py"
    subprocess.run([sys.executable, str(script), "--out", str(folder)], check=True)
    return folder


@pytest.fixture(scope="module")
def sky() -> dict[str, Array]:
    return {name: read_face(FILES / f"starfield_{name}.png") for name in FACES}


# ------------------------------------------------------------------- the script


@WHOLE
def test_script_writes_the_files_that_are_there(fresh: Path) -> None:
    made = {path.name for path in fresh.iterdir()}
    assert made == {path.name for path in (*FILES.iterdir(), PACKED)} - {"README.md"}


@pytest.mark.parametrize("name", MESHES)
def test_script_makes_the_same_mesh(make_scene: Any, tmp_path: Path, name: str) -> None:
    is_glow = name == "saucer_glow"
    meshes = make_scene.body_meshes() | ({"beam": make_scene.beam_mesh()} if is_glow else {})
    root = make_scene.saucer(with_beam=is_glow)
    make_scene.write_gltf(tmp_path / f"{name}.gltf", root, meshes, glow=is_glow)
    document = read_json(FILES / f"{name}.gltf")
    assert read_json(tmp_path / f"{name}.gltf") == document
    old, new = (folder / f"{name}.bin" for folder in (FILES, tmp_path))
    for index in range(len(document["accessors"])):
        # Half a unit of the last decimal that the script keeps of positions is 5e-6.
        np.testing.assert_allclose(
            read_accessor(document, new.read_bytes(), index),
            read_accessor(document, old.read_bytes(), index),
            rtol=0,
            atol=1e-5,
        )


def test_script_makes_the_same_gas(make_scene: Any, sky: dict[str, Array]) -> None:
    """Of the starfield some texels without its stars, which make a texel only brighter."""
    rng = np.random.Generator(np.random.PCG64(make_scene.SKY_SEED))
    pole = np.array([0.35, 0.78, 0.52])
    view = make_scene.face_directions(make_scene.FACE_SIZE)[:, ::16, ::16]
    gas = make_scene.nebula(view, rng, pole / np.linalg.norm(pole))
    faces = np.stack([sky[name][::16, ::16] for name in FACES])
    brighter = faces - (np.clip(gas, 0, 1) * 255 + 0.5).astype(np.int64)
    assert brighter.min() >= -1
    assert 0.8 < (brighter <= 1).mean() < 1


@WHOLE
@pytest.mark.parametrize("name", FACES)
def test_script_makes_the_same_starfield(fresh: Path, sky: dict[str, Array], name: str) -> None:
    made = read_face(fresh / f"starfield_{name}.png")
    assert made.shape == sky[name].shape
    # One level: a value halfway between two may round either way on another machine.
    assert np.abs(made.astype(np.int64) - sky[name]).max() <= 1


def arrays_of(scene: Scene) -> list[Array]:
    assert scene.glow is not None
    assert scene.glow.emission is not None
    assert scene.skybox is not None
    assert scene.body.emission is None
    assert scene.body.surfaces == scene.glow.surfaces == ()
    meshes = [a for mesh in (scene.body, scene.glow) for a in (mesh.vertices, mesh.indices)]
    return [*meshes, scene.glow.emission, *scene.skybox.levels]


def test_the_built_in_scene_is_that_of_the_files() -> None:
    faces = [FILES / f"starfield_{name}.png" for name in FACES]
    glow = FILES / "saucer_glow.gltf"
    loaded = Scene.from_gltf(FILES / "saucer.gltf", glow=glow, skybox=faces)
    for built_in, of_files in zip(arrays_of(Scene.ufo()), arrays_of(loaded), strict=True):
        np.testing.assert_array_equal(built_in, of_files, strict=True)


@WHOLE
def test_script_packs_the_same_arrays(fresh: Path) -> None:
    with np.load(PACKED) as old, np.load(fresh / PACKED.name) as new:
        assert old.files == new.files
        for name in old.files:
            # As above; the y of normals and positions is negated, indices are exact.
            step = {"f": 1e-5, "u": 1 if name == "sky" else 0}[old[name].dtype.kind]
            np.testing.assert_allclose(
                new[name].astype(np.float64), old[name].astype(np.float64), rtol=0, atol=step
            )


def test_the_built_in_scene_needs_no_extra() -> None:
    hide = "sys.modules.update(dict.fromkeys(('pygltflib', 'OpenImageIO'), None))"
    code = f"import sys; {hide}; import vkbloom; vkbloom.Scene.ufo()"
    subprocess.run([sys.executable, "-c", code], check=True)
