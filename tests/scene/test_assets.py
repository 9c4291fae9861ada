"""The built-in scene is that of the files in examples/saucer, and needs no extra."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.processes import output
from vkbloom._scene import Scene

FILES = Path(__file__).resolve().parents[2] / "examples" / "saucer"


def arrays_of(scene: Scene) -> list[npt.NDArray[Any]]:
    assert scene.glow is not None
    assert scene.glow.emission is not None
    assert scene.skybox is not None
    assert scene.body.emission is None
    assert scene.body.surfaces == scene.glow.surfaces == ()
    meshes = [a for mesh in (scene.body, scene.glow) for a in (mesh.vertices, mesh.indices)]
    return [*meshes, scene.glow.emission, *scene.skybox.levels]


def test_the_built_in_scene_is_that_of_the_files() -> None:
    faces = [FILES / f"starfield_{name}.png" for name in ("px", "nx", "py", "ny", "pz", "nz")]
    glow = FILES / "saucer_glow.gltf"
    loaded = Scene.from_gltf(FILES / "saucer.gltf", glow=glow, skybox=faces)
    for built_in, of_files in zip(arrays_of(Scene.ufo()), arrays_of(loaded), strict=True):
        np.testing.assert_array_equal(built_in, of_files, strict=True)


def test_the_built_in_scene_needs_no_extra() -> None:
    hide = "sys.modules.update(dict.fromkeys(('pygltflib', 'OpenImageIO'), None))"
    output("-c", f"import sys; {hide}; import vkbloom; vkbloom.Scene.ufo()")
