"""Scenes as values: validation, identity, and how they show themselves."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from tests.processes import output
from tests.refusals import assert_refused, rows
from tests.scene.parts import Cubemap, Mesh
from vkbloom import Camera, Scene


def mesh(**changes: Any) -> Mesh:
    arrays = {
        "vertices": np.arange(27, dtype=np.float32).reshape(3, 9),
        "indices": np.array([0, 1, 2], np.uint32),
    }
    return Mesh(**{**arrays, **changes})


def scene(**changes: Any) -> Scene:
    return Scene(**{"body": mesh(), **changes})


# Mesh


def test_a_mesh_keeps_its_own_read_only_arrays() -> None:
    vertices = np.ones((3, 9), np.float32)
    emission = np.ones((3, 3), np.float32)
    indices = np.array([0, 1, 2], np.uint32)
    made = Mesh(vertices, indices, emission)
    vertices[...], indices[...], emission[...] = 0, 0, 0
    assert made.emission is not None
    for array in (made.vertices, made.indices, made.emission):
        assert array.any()
        assert array.flags.c_contiguous
        assert not array.flags.writeable


def test_a_mesh_does_not_trust_a_read_only_view() -> None:
    owner = np.ones((3, 9), np.float32)
    view = owner.view()
    view.flags.writeable = False
    made = mesh(vertices=view)
    owner[...] = 0
    assert (made.vertices == 1).all()


def test_a_mesh_copies_no_read_only_owner() -> None:
    vertices = np.ones((3, 9), np.float32)
    vertices.flags.writeable = False
    assert mesh(vertices=vertices).vertices is vertices


@pytest.mark.parametrize(("call", "error"), rows(__file__, "meshes, cameras and scenes"))
def test_a_wrong_value_is_refused(call: str, error: str) -> None:
    assert_refused(call, error, globals())


# Camera


def test_the_default_camera_is_the_one_of_the_forward_system() -> None:
    camera = Camera()
    assert (camera.position, camera.rotation) == ((0.0, 0.0, -10.25), (7.5, -343.0, 0.0))
    assert (camera.fov, camera.near, camera.far) == (45.0, 0.1, 256.0)


def test_a_camera_takes_any_numbers_and_is_a_value() -> None:
    camera = Camera(position=np.array([1, 2, 3]), rotation=[0, 0, 0], fov=np.float32(60))  # type: ignore[arg-type]
    assert camera == Camera((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), 60.0)
    assert hash(camera) == hash(Camera((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), 60.0))
    assert type(camera.position[0]) is float


# Scene


def test_every_scene_has_a_serial_of_its_own() -> None:
    first = scene()
    others = [
        scene(),
        dataclasses.replace(first, camera=first.camera),
        dataclasses.replace(first, glow_intensity=2.0),
        copy.copy(first),
        pickle.loads(pickle.dumps(first)),
    ]
    assert len({first.serial, *(other.serial for other in others)}) == 6


def test_a_changed_camera_changes_nothing_else() -> None:
    first = scene(glow=mesh(), skybox=Cubemap((np.zeros((6, 1, 1, 4), np.uint8),)))
    second = dataclasses.replace(first, camera=Camera(fov=60))
    assert second.camera.fov == 60.0
    assert first.camera.fov == 45.0
    assert second.body is first.body
    assert second.glow is first.glow
    assert second.skybox is first.skybox


def test_a_pickled_scene_is_the_same_and_read_only() -> None:
    emission = np.ones((3, 3), np.float32)
    first = scene(glow=mesh(emission=emission), camera=Camera(fov=60), glow_intensity=3)
    second = pickle.loads(pickle.dumps(first))
    np.testing.assert_array_equal(second.body.vertices, first.body.vertices)
    np.testing.assert_array_equal(second.glow.emission, emission)
    assert not second.body.indices.flags.writeable
    assert (second.camera, second.glow_intensity) == (first.camera, 3.0)


def test_a_scene_shows_what_it_holds() -> None:
    sky = Cubemap((np.zeros((6, 2, 2, 4), np.uint8), np.zeros((6, 1, 1, 4), np.uint8)))
    shown = scene(glow=mesh(), skybox=sky)
    for part in ("1 triangles, 3 vertices", "2 x 2 uint8", "levels: 2", "fov 45", "-10.25"):
        assert part in repr(shown)
    assert "array" not in repr(shown)
    assert "glow: none" in repr(scene())
    assert "skybox: none" in repr(scene())


def test_the_built_in_scene() -> None:
    ufo = Scene.ufo()
    assert ufo.glow is not None
    assert ufo.skybox is not None
    assert ufo.camera == Camera()
    assert ufo.skybox.dtype == np.uint8
    # All of the saucer lies within the default frame's depth range and near its centre.
    assert np.abs(ufo.body.vertices[:, :3]).max() < 10.0
    assert Scene.ufo().serial != ufo.serial


def test_a_scene_from_files(shared_data: Path) -> None:
    folder = shared_data / "retroufo"
    loaded = Scene.from_gltf(
        folder / "retroufo.gltf",
        glow=str(folder / "retroufo_glow.gltf"),
        skybox=folder / "cubemap_space.ktx",
        glow_intensity=2,
        camera=Camera(fov=30),
    )
    assert loaded.glow is not None
    assert loaded.skybox is not None
    assert len(loaded.body.indices) != len(loaded.glow.indices)
    assert (loaded.skybox.size, loaded.glow_intensity, loaded.camera.fov) == (512, 2.0, 30.0)
    # The beam of light hangs below the saucer: y points down.
    assert loaded.glow.vertices[:, 1].max() > 5.0 > -loaded.glow.vertices[:, 1].min()


def test_a_scene_of_one_file_has_neither_glow_nor_sky(shared_data: Path) -> None:
    folder = shared_data / "retroufo"
    loaded = Scene.from_gltf(folder / "cube.gltf")
    assert (loaded.glow, loaded.skybox, loaded.camera) == (None, None, Camera())
    with pytest.raises(FileNotFoundError, match=r"gone\.gltf"):
        Scene.from_gltf(folder / "cube.gltf", glow=folder / "gone.gltf")


def test_scenes_that_differ_in_the_camera_alone_share_their_contents() -> None:
    first = Scene.ufo()
    turned = dataclasses.replace(first, camera=Camera(rotation=(1.0, 2.0, 3.0)))
    brighter = dataclasses.replace(first, glow_intensity=2.0)
    other = dataclasses.replace(first, glow=None)
    serials = [scene.contents_serial for scene in (first, turned, brighter, other, Scene.ufo())]
    assert serials[0] == serials[1] == serials[2]
    assert len(set(serials)) == 3


def test_contents_that_are_gone_are_not_taken_for_new_ones() -> None:
    body = Scene.ufo().body
    serials = set()
    for _ in range(50):
        # Each sky may lie where the one before lay.
        sky = Cubemap((np.zeros((6, 1, 1, 4), np.uint8),))
        serials.add(Scene(body, skybox=sky).contents_serial)
    assert len(serials) == 50


# The built-in scene


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
    hide = "sys.modules['OpenImageIO'] = None"
    output("-c", f"import sys; {hide}; import vkbloom; vkbloom.Scene.ufo()")
