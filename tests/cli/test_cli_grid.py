"""``vkbloom grid``: axes in words, stores and image files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result

import vkbloom
from tests.cli import calls
from tests.framebuffers import write_image
from tests.images import noise
from tests.io.parts import reread
from vkbloom import Renderer, Separable
from vkbloom._cli.grid import axis_values

pytestmark = pytest.mark.usefixtures("kept_renderers")

xr = pytest.importorskip("xarray")


def run(*arguments: Any) -> Result:
    words = (word for argument in arguments for word in str(argument).split())
    return calls.run("grid", *words)


def succeed(*arguments: Any) -> str:
    result = run(*arguments)
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


@pytest.fixture
def image_file(tmp_path: Path) -> Path:
    values = np.random.default_rng(5).random((9, 12, 3)).astype(np.float32)
    vkbloom.write(tmp_path / "a.exr", values)
    return tmp_path / "a.exr"


class TestAxes:
    @pytest.mark.parametrize(
        ("word", "expected"),
        [
            ("blur_scale=0.1:2:3", [0.1, 1.05, 2.0]),
            ("blur-scale=1:4:2", [1.0, 4.0]),
            ("blur_scale=2", [2.0]),
            ("time=0,0.5", [0.0, 0.5]),
            ("loops=1,2", [1, 2]),
            ("tonemap=none,aces", ["none", "aces"]),
            ("threshold=none,0.5", [None, 0.5]),
            ("exposure=-1:1:3", [-1, 0, 1]),
            ("exposure=bevy,2", [vkbloom.exposures["bevy"], 2]),
            (
                "exposure=bevy:speed_brighten=1,speed_darken=2;godot",
                [
                    vkbloom.BevyExposure(speed_brighten=1, speed_darken=2),
                    vkbloom.exposures["godot"],
                ],
            ),
            ("dt=0.1,1", [0.1, 1]),
            (
                "taa=bevy;o3de:gamma=2",
                [vkbloom.antialiasing["bevy"], vkbloom.O3deAntialiasing(gamma=2)],
            ),
            ("direct=off,on", [False, True]),
            ("bloom_size=none,64x32", [None, (64, 32)]),
            ("weights=0.5,0.25;1;", [(0.5, 0.25), (1.0,)]),
            ("layers=1:1,2:0.5;1:1", [((1.0, 1.0), (2.0, 0.5)), ((1.0, 1.0),)]),
        ],
    )
    def test_words(self, word: str, expected: list[Any]) -> None:
        (found,) = axis_values([word], Separable()).values()
        assert list(found) == expected


class TestStores:
    def test_a_scene(self, tmp_path: Path, renderer: Renderer, scene: vkbloom.Scene) -> None:
        out = tmp_path / "a.zarr"
        words = "--axis time=0,0.25 --axis blur_scale=1:2:2 --size 32x18 --tonemap aces"
        message = succeed(words, "--framebuffers final,depth -o", out)
        assert "4 points" in message
        found = xr.open_zarr(out)
        expected = renderer.render(
            scene, Separable(blur_scale=2, tonemap="aces"), (32, 18), time=0.25
        )
        np.testing.assert_array_equal(found["final"].values[1, 1], expected["final"])
        assert set(found) == {"done", "final", "depth"}

    def test_resumed_by_the_same_call(self, tmp_path: Path, image_file: Path) -> None:
        words = [image_file, "--axis", "exposure=0,1", "-o", tmp_path / "a.zarr"]
        succeed(*words)
        succeed(*words)
        other = run(*words, "--intensity", "0.5")
        assert other.exit_code == 1
        assert "settings.intensity: 0.15 in the store, 0.5 requested" in other.stderr


def test_a_grid_without_bloom_says_so(tmp_path: Path, image_file: Path) -> None:
    words = ("--method", "pyramid", "--axis", "intensity=0.5,1", "--threshold")
    result = run(image_file, *words, "1000", "-o", tmp_path / "a.zarr")
    assert "no value is above the threshold 1000" in result.stderr
    assert run(image_file, *words, "0", "-o", tmp_path / "b.zarr").stderr == ""


class TestImageFiles:
    def test_one_a_point_in_the_colours_of_apply(self, tmp_path: Path, image_file: Path) -> None:
        out = tmp_path / "files"
        words = "--axis intensity=0,1 --axis exposure=-1,0 --framebuffers final,bloom -o"
        succeed(image_file, words, out)
        assert sorted(path.name for path in out.iterdir()) == sorted(
            f"00{i}_00{j}_{name}"
            for i in (0, 1)
            for j in (0, 1)
            for name in ("final.png", "bloom.exr")
        )
        one = tmp_path / "one.png"
        calls.run("apply", image_file, one, "--exposure", -1, "--intensity", 1)
        np.testing.assert_array_equal(reread(out / "001_000_final.png")[1], reread(one)[1])

    @pytest.mark.parametrize(
        ("axis", "points"),
        [
            ("intensity=0.5,1", [("--intensity", "0.5"), ("--intensity", "1")]),
            ("encoding=none,srgb", [("--encoding", "none"), ("--encoding", "srgb")]),
            ("preset=Kino,photo", [("--preset", "kino"), ("--preset", "photo", "--expand", "1")]),
        ],
    )
    def test_photographs_as_apply_has_them(
        self, tmp_path: Path, axis: str, points: list[tuple[str, ...]]
    ) -> None:
        image = np.full((12, 16, 3), 20, np.uint8)
        image[4:8, 5:9] = 255
        photo = vkbloom.write(tmp_path / "photo.png", image)
        assert run(photo, "--axis", axis, "-o", tmp_path / "files").exit_code == 0
        for index, words in enumerate(points):
            one = tmp_path / "one.png"
            calls.run("apply", photo, one, *words)
            found = reread(tmp_path / "files" / f"00{index}_final.png")[1]
            np.testing.assert_array_equal(found, reread(one)[1])

    def test_masks_and_emissions_as_apply_has_them(self, tmp_path: Path, image_file: Path) -> None:
        mask = vkbloom.write(tmp_path / "mask.png", np.eye(9, 12, dtype=np.uint8)[..., None] * 255)
        emission = vkbloom.write(tmp_path / "emission.png", noise(9, 12, 3, dtype="uint8"))
        words = ("--mask", mask, "--emission", emission)
        succeed(image_file, "--axis intensity=1", *words, "-o", tmp_path / "files")
        calls.run("apply", image_file, tmp_path / "one.png", "--intensity", 1, *words)
        found = reread(tmp_path / "files" / "000_final.png")[1]
        np.testing.assert_array_equal(found, reread(tmp_path / "one.png")[1])
        scene = run("--axis time=0 --mask", mask, "-o", tmp_path / "scene")
        assert (scene.exit_code, "the source is a scene" in scene.stderr) == (2, True)

    def test_a_grey_file_stays_grey(self, tmp_path: Path) -> None:
        write_image(tmp_path / "a.png", noise(9, 12, 1, dtype="uint8"))
        assert run(tmp_path / "a.png", "--axis", "exposure=0", "-o", tmp_path / "g").exit_code == 0
        assert len(reread(tmp_path / "g" / "000_final.png")[0].channelnames) == 1

    def test_exr_of_a_scene(self, tmp_path: Path, renderer: Renderer, scene: vkbloom.Scene) -> None:
        out = tmp_path / "files"
        words = "--axis blur_scale=1,2 --size 20x10 --image-format exr --framebuffers final -o"
        succeed(words, out)
        expected = renderer.render(scene, Separable(blur_scale=2), (20, 10))["final"]
        found = reread(out / "001_final.exr")[1]
        np.testing.assert_array_equal(np.rint(found * np.float32(255)), expected)

    def test_a_folder_named_like_an_image(self, tmp_path: Path, image_file: Path) -> None:
        words = [image_file, "--axis", "exposure=0", "-o", tmp_path / "g.exr"]
        # Such a folder may exist.
        (tmp_path / "g.exr").mkdir()
        succeed(*words)


def test_points_have_anti_aliasing(tmp_path: Path, image_file: Path) -> None:
    """The first frame of an engine, which HDRP sharpens."""
    out = tmp_path / "a.zarr"
    succeed(image_file, "--taa hdrp --axis intensity=0.1,0.2 --preset kino -o", out)
    found = xr.open_zarr(out)["final"].sel(intensity=0.2)
    expected = vkbloom.apply(image_file, "kino", intensity=0.2, taa="hdrp")["final"]
    np.testing.assert_array_equal(found, expected)


def test_exposures_are_in_the_records_of_files(tmp_path: Path, image_file: Path) -> None:
    axis = "--axis exposure=bevy;hdrp:limit_min=-3"
    succeed(image_file, "-o", tmp_path / "g", axis, "--dt 0.5 --image-format exr")
    made = tmp_path / "g" / "001_final.exr"
    calls.succeed("apply", image_file, "-o", tmp_path / "b.exr", "-q", "--settings", made)
    np.testing.assert_array_equal(vkbloom.read(tmp_path / "b.exr"), vkbloom.read(made))
