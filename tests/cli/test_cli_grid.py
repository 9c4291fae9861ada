"""``vkbloom grid``: axes in words, files of options, stores and image files, resumed."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import socket
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import vkbloom
from tests.exhaustive import witness
from tests.framebuffers import noise
from vkbloom import Pyramid, Renderer, Separable
from vkbloom.cli.axis_options import axis_values
from vkbloom.cli.grid import _loop_without_interrupts
from vkbloom.cli.program import program
from vkbloom.io.image_reading import load
from vkbloom.io.image_writing import save
from vkbloom.io.images import Picture

pytestmark = pytest.mark.usefixtures("kept_renderers")

pytest.importorskip("OpenImageIO")
xr = pytest.importorskip("xarray")


def run(*arguments: Any) -> Result:
    words = ["grid", *(str(argument) for argument in arguments)]
    return CliRunner().invoke(program, words)


def done(*arguments: Any) -> str:
    result = run(*arguments)
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


@pytest.fixture
def image_file(tmp_path: Path) -> Path:
    values = np.random.default_rng(5).random((9, 12, 3)).astype(np.float32)
    save(Picture.of_values(values, "float"), tmp_path / "a.exr")
    return tmp_path / "a.exr"


class TestAxes:
    @pytest.mark.parametrize(
        ("word", "expected"),
        [
            ("blur_scale=0.1:2:3", [0.1, 1.05, 2.0]),
            ("blur-scale=1:4:3:log", [1.0, 2.0, 4.0]),
            ("blur_scale=2", [2.0]),
            ("time=0,0.5", [0.0, 0.5]),
            ("loops=1,2", [1, 2]),
            ("tonemap=none,aces", ["none", "aces"]),
            ("threshold=none,0.5", [None, 0.5]),
            ("direct=off,on", [False, True]),
            ("bloom_size=none,64x32", [None, (64, 32)]),
            ("weights=0.5,0.25;1;", [(0.5, 0.25), (1.0,)]),
            ("layers=1:1,2:0.5;1:1", [((1.0, 1.0), (2.0, 0.5)), ((1.0, 1.0),)]),
        ],
    )
    def test_words(self, word: str, expected: list[Any]) -> None:
        (found,) = axis_values([word], Separable()).values()
        if word.endswith("log"):
            np.testing.assert_allclose(found, expected)
        else:
            assert list(found) == expected

    @pytest.mark.parametrize(
        ("word", "told"),
        [
            ("blur_scale", "NAME=FIRST:LAST:COUNT"),
            ("blur_sale=1", "has no field"),
            ("radius=1", "has no field"),
            ("method=separable,pyramid", "has no field"),
            ("blur_scale=1:2", "not a valid float"),
            ("blur_scale=1:2:0", "is not in 1..1000000"),
            ("blur_scale=0:2:3:log", "above 0"),
            ("blur_scale=0:2:3:lin", "is not NAME=FIRST:LAST:COUNT"),
            ("tonemap=nice", "is not one of"),
            ("blur_scale=1,99", "blur_scale: 99.0 is out of range"),
            ("loops=1:2:4", "is not an integer"),
            ("blur_scale=1:2", "a range is FIRST:LAST:COUNT"),
            ("preset=kino,fimalent", "unknown preset 'fimalent'; did you mean 'filament'?"),
            ("blur-sale=1", "has no field 'blur_sale'; did you mean 'blur_scale'?"),
        ],
    )
    def test_wrong_use_is_one_line(self, tmp_path: Path, word: str, told: str) -> None:
        result = run("--axis", word, "-o", tmp_path / "a.zarr")
        assert result.exit_code == 2
        assert told in result.stderr
        assert result.stderr.count("\n") == 1
        assert not (tmp_path / "a.zarr").exists()


class TestStores:
    def test_a_scene(self, tmp_path: Path, renderer: Renderer, scene: vkbloom.Scene) -> None:
        out = tmp_path / "a.zarr"
        told = done(
            "--axis", "time=0,0.25", "--axis", "blur_scale=1:2:2", "--size", "32x18",
            "--tonemap", "aces", "-o", out, "--reduce", "mean", "--reduce",
            "like=psnr:final@blur_scale=1", "--attachments", "final,depth",
            "--sheet", tmp_path / "s.png", "--curves", tmp_path / "c.svg", "--chunk", "time=2",
        )  # fmt: skip
        assert "4 points; passes run" in told
        found = xr.open_zarr(out)
        expected = renderer.render(
            scene, Separable(blur_scale=2, tonemap="aces"), (32, 18), time=0.25
        )
        np.testing.assert_array_equal(found["final"].values[1, 1], expected["final"])
        assert found["final"].chunks[0] == (2,)
        assert np.isinf(found["like"].values[:, 0]).all()
        assert load(tmp_path / "s.png").pixels.shape[2] == 3
        assert "<svg" in (tmp_path / "c.svg").read_text()

    def test_images_by_their_names(self, tmp_path: Path, image_file: Path) -> None:
        save(Picture.of_values(noise(9, 12, 3, dtype="float32"), "float"), tmp_path / "b.exr")
        done(
            image_file,
            tmp_path / "b.exr",
            "--axis",
            "radius=1,2",
            "--method",
            "pyramid",
            "--attachments",
            "none",
            "--reduce",
            f"psnr@{image_file}",
            "-o",
            tmp_path / "a.zarr",
        )
        found = xr.open_zarr(tmp_path / "a.zarr")
        assert set(found) == {"done", "psnr"}
        assert list(found["image"].values) == [str(image_file), str(tmp_path / "b.exr")]

    def test_resumed_by_the_same_call(self, tmp_path: Path, image_file: Path) -> None:
        words = [image_file, "--axis", "exposure=0,1", "-o", tmp_path / "a.zarr"]
        done(*words)
        (tmp_path / "a.zarr" / "final" / "c.0.0.0.0").write_bytes(b"")
        again = run(*words, "--no-resume")
        assert again.exit_code == 1
        assert "resume it" in again.stderr
        mended = run(*words)
        assert mended.exit_code == 0
        assert "c.0.0.0.0 was damaged" in mended.stderr
        assert "exposure=0..1" in mended.stderr
        other = run(*words, "--intensity", "0.5")
        assert other.exit_code == 1
        assert "settings.intensity: 0.15 in the store, 0.5 requested" in other.stderr

    def test_workers(self, tmp_path: Path, image_file: Path) -> None:
        words = [image_file, "--axis", "exposure=0:1:4"]
        # Dask's own port is often taken, by a notebook's cluster or another grid.
        with socket.socket() as other:
            with contextlib.suppress(OSError):
                other.bind(("", 8787))
                other.listen()
            told = done(*words, "-o", tmp_path / "a.zarr", "--workers", "1")
        assert "4 points" in told
        done(*words, "-o", tmp_path / "b.zarr")
        found, expected = (xr.open_zarr(tmp_path / name) for name in ("a.zarr", "b.zarr"))
        np.testing.assert_array_equal(found["final"].values, expected["final"].values)

    def test_no_interrupt_reaches_the_workers(self) -> None:
        """The thread that starts them has SIGINT blocked, which its child processes inherit."""
        with _loop_without_interrupts() as loop:
            seen: queue.Queue[str] = queue.Queue()
            show = ["grep", "SigBlk", "/proc/self/status"]
            loop.add_callback(lambda: seen.put(subprocess.check_output(show, text=True)))
            blocked = int(seen.get(timeout=60).split()[1], 16)
        assert blocked >> (signal.SIGINT - 1) & 1
        assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])

    @witness("a cluster takes 8 s to start; the test before this one has who gets the signal")
    def test_an_interrupt_of_all_processes(self, tmp_path: Path) -> None:
        """Ctrl-C on a terminal also reaches the workers."""
        out = tmp_path / "a.zarr"
        # 15 GB of pixels, so that no machine has finished when the signal arrives.
        image_file = tmp_path / "a.exr"
        values = np.random.default_rng(5).random((512, 512, 3), dtype=np.float32)
        save(Picture.of_values(values, "float"), image_file)
        words = [image_file, "-o", out, "--axis", "exposure=0:1:5000", "--workers", "1"]
        running = subprocess.Popen(
            [sys.executable, "-m", "vkbloom.cli", "grid", *map(str, words)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        while not (out / "zarr.json").exists() and running.poll() is None:
            time.sleep(0.05)
        os.killpg(running.pid, signal.SIGINT)
        stdout, stderr = running.communicate()
        assert (running.returncode, stdout, stderr) == (130, "", "\nvkbloom: interrupted\n")

    @pytest.mark.parametrize(
        ("words", "told"),
        [
            (["--workers", "1", "--scheduler", "tcp://localhost:1"], "give one of them"),
            (["--reduce", "median"], "'median' is not one of"),
            (["--reduce", "ssim"], "needs @REFERENCE"),
            (["--reduce", "mean@blur_scale=1"], "takes no @REFERENCE"),
            (["--reduce", "ssim@blur_scale=3"], "is not a value of the axis"),
            (["--chunk", "blur_scale"], "AXIS=COUNT"),
            (["--chunk", "exposure=1"], "'exposure' is not an axis of the grid"),
            (["--chunk", "blur_scale=0"], "0 is not an integer of at least 1"),
            (["--size", "3x3"], "the source is not a scene"),
            (["--attachments", "none"], "request some"),
            (["--sheet", "a.jpg"], "--sheet: a.jpg does not end in .png"),
            (["--curves", "a"], "--curves: a does not end in .png, .svg, .pdf"),
            (
                ["--sheet", "a.png", "--attachments", "none", "--reduce", "mean"],
                "needs framebuffers",
            ),
            (["--axis", "blur_scale=1"], "blur_scale is given twice"),
        ],
        ids=str,
    )
    def test_wrong_use(self, tmp_path: Path, image_file: Path, words: list[str], told: str) -> None:
        out = tmp_path / "a.zarr"
        result = run(
            image_file, "--method", "separable", "--axis", "blur_scale=1,2", "-o", out, *words
        )
        assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
        assert told in result.stderr
        assert not out.exists()

    def test_reference_frames_that_need_more_passes_than_are_saved(
        self, tmp_path: Path, image_file: Path
    ) -> None:
        words = ["--axis", "blur_scale=1,2", "--reduce", "psnr:bloom@blur_scale=2"]
        words += ["--attachments", "none", "--chunk", "blur_scale=1"]
        told = done(image_file, "--method", "separable", *words, "-o", tmp_path / "a.zarr")
        assert told.endswith(", saved 0\n")

    def test_curves_without_an_axis_to_plot(self, tmp_path: Path, image_file: Path) -> None:
        out = tmp_path / "a.zarr"
        words = ["--axis", "blur_scale=1", "--curves", "a.svg"]
        result = run(image_file, "--method", "separable", "-o", out, *words)
        assert result.exit_code == 2
        assert "more than one value" in result.stderr
        assert not out.exists()

    def test_a_reference_of_several_images(self, tmp_path: Path, image_file: Path) -> None:
        arrays = {"glow": noise(9, 12, 3, dtype="float32"), "final": load(image_file).pixels}
        file = tmp_path / "frames.exr"
        vkbloom.Frames(arrays, timings={}, settings=Separable(), info={}).save(file)
        words = ("--axis", "exposure=0", "--reduce", f"psnr@{file}")
        result = run(image_file, "-o", tmp_path / "a.zarr", *words)
        assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
        assert "frames.exr has several parts" in result.stderr

    @pytest.mark.parametrize("option", ["--sheet", "--curves"])
    def test_unwritable_drawing_fails(self, tmp_path: Path, image_file: Path, option: str) -> None:
        """Known before anything is rendered."""
        out = tmp_path / "a.zarr"
        (tmp_path / "folder.png").mkdir()
        for name, told in (("no/a.png", "there is no folder"), ("folder.png", "Is a directory")):
            file = tmp_path / name
            result = run(
                image_file,
                "--method",
                "separable",
                "--axis",
                "blur_scale=1,2",
                "-o",
                out,
                option,
                file,
            )
            assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
            assert result.stderr.startswith(f"vkbloom: {file}: {told}")
            assert not out.exists()


def test_presets_as_an_axis(tmp_path: Path, image_file: Path) -> None:
    words = ("--axis", "preset=kino,filament", "--axis", "intensity=0.5,1", "-o")
    result = run(image_file, *words, tmp_path / "a.zarr")
    assert result.exit_code == 0, result.stderr
    with xr.open_zarr(tmp_path / "a.zarr") as dataset:
        assert dict(dataset.sizes)["preset"] == 2
        assert list(dataset["preset"].values) == ["kino", "filament"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "there is no --axis; give one"),
        (("--axis", "preset=kino", "--intensity", "0.5"), "leave out options of settings"),
        (("--axis", "preset=kino,filament", "--axis", "levels=1,2"), "not all of these presets"),
        (("--axis", "exposure=0", "--axis", "exposure=1"), "exposure is given twice"),
        (("--glare", "dirt", "--axis", "glare.0.image=a.png"), "use Renderer.grid"),
    ],
)
def test_wrong_axes_are_refused(
    tmp_path: Path, image_file: Path, words: tuple[str, ...], told: str
) -> None:
    result = run(image_file, *words, "-o", tmp_path / "a.zarr")
    assert result.exit_code == 2
    assert told in result.stderr


def test_a_grid_without_bloom_says_so(tmp_path: Path, image_file: Path) -> None:
    words = ("--method", "pyramid", "--axis", "intensity=0.5,1", "--threshold")
    result = run(image_file, *words, "1000", "-o", tmp_path / "a.zarr")
    assert "no value is above the threshold 1000" in result.stderr
    assert run(image_file, *words, "0", "-o", tmp_path / "b.zarr").stderr == ""


class TestImageFiles:
    def test_one_a_point_in_the_colours_of_apply(self, tmp_path: Path, image_file: Path) -> None:
        out = tmp_path / "files"
        done(
            image_file,
            "--axis",
            "intensity=0,1",
            "--axis",
            "exposure=-1,0",
            "-o",
            out,
            "--attachments",
            "final,bloom",
        )
        assert sorted(path.name for path in out.iterdir()) == sorted(
            [
                f"00{i}_00{j}_{name}"
                for i in (0, 1)
                for j in (0, 1)
                for name in ("final.png", "bloom.exr")
            ]
            + ["grid.json"]
        )
        CliRunner().invoke(
            program,
            [
                "apply",
                str(image_file),
                str(tmp_path / "one.png"),
                "--exposure",
                "-1",
                "--intensity",
                "1",
            ],
        )
        np.testing.assert_array_equal(
            load(out / "001_000_final.png").pixels, load(tmp_path / "one.png").pixels
        )

    @pytest.mark.parametrize(
        ("axis", "points"),
        [
            ("intensity=0.5,1", [("--intensity", "0.5"), ("--intensity", "1")]),
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
            CliRunner().invoke(program, ["apply", str(photo), str(one), *words])
            found = load(tmp_path / "files" / f"00{index}_final.png").pixels
            np.testing.assert_array_equal(found, load(one).pixels)

    def test_exr_of_a_scene(self, tmp_path: Path, renderer: Renderer, scene: vkbloom.Scene) -> None:
        out = tmp_path / "files"
        done(
            "--axis",
            "blur_scale=1,2",
            "--size",
            "20x10",
            "-o",
            out,
            "--image-format",
            "exr",
            "--attachments",
            "final",
        )
        expected = renderer.render(scene, Separable(blur_scale=2), (20, 10))["final"]
        found = load(out / "001_final.exr").pixels
        np.testing.assert_array_equal(np.rint(found * np.float32(255)), expected)

    def test_resumed(self, tmp_path: Path, image_file: Path) -> None:
        out = tmp_path / "files"
        words = [image_file, "--axis", "exposure=0,1,2", "-o", out, "--image-format", "exr"]
        done(*words)
        names = sorted(path.name for path in out.iterdir())
        before = load(out / "001_final.exr").pixels
        (out / "001_final.exr").unlink()
        assert "already has a grid" in run(*words, "--no-resume").stderr
        assert "passes run 0" not in done(*words)
        assert sorted(path.name for path in out.iterdir()) == names
        # (Not the bytes of the file, which has the time of its writing in it.)
        np.testing.assert_array_equal(load(out / "001_final.exr").pixels, before)
        assert "passes run 0" in done(*words, "--resume")
        other = run(*words, "--knee", "0.5")
        assert other.exit_code == 1
        assert "settings.knee" in other.stderr

    def test_foreign_folder_is_refused_and_kept(self, tmp_path: Path, image_file: Path) -> None:
        (tmp_path / "files").mkdir()
        (tmp_path / "files" / "letter.txt").write_text("dear")
        result = run(image_file, "--axis", "exposure=0", "-o", tmp_path / "files", "--resume")
        assert result.exit_code == 1
        assert "its content is not a grid" in result.stderr

    @pytest.mark.parametrize(
        ("content", "told"),
        [
            (b"{", "grid.json: damaged"),
            (b"\xff", "grid.json: damaged"),
            (b"[" * 100_000, "grid.json: damaged"),
            (b"[]", "contains another grid"),
            (b'{"settings": 3}', "contains another grid"),
        ],
        ids=["half", "no text", "deep", "a list", "a number"],
    )
    def test_a_damaged_index(
        self, tmp_path: Path, image_file: Path, content: bytes, told: str
    ) -> None:
        out = tmp_path / "files"
        words = (image_file, "--axis", "exposure=0", "-o", out)
        done(*words)
        (out / "grid.json").write_bytes(content)
        before = {path: path.read_bytes() for path in out.iterdir()}
        result = run(*words, "--resume")
        assert result.exit_code == 1
        assert told in result.stderr
        assert {path: path.read_bytes() for path in out.iterdir()} == before

    def test_options_of_stores_are_refused_for_folders(
        self, tmp_path: Path, image_file: Path
    ) -> None:
        for words in (["--reduce", "mean"], ["--sheet", "a.png"], ["--chunk", "exposure=1"]):
            result = run(image_file, "--axis", "exposure=0", "-o", tmp_path / "files", *words)
            assert result.exit_code == 2
            assert "need a store" in result.stderr

    def test_a_folder_named_like_an_image(self, tmp_path: Path, image_file: Path) -> None:
        words = [image_file, "--axis", "exposure=0", "-o", tmp_path / "g.exr"]
        result = run(*words)
        assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
        assert "name a folder, and give --image-format exr" in result.stderr
        assert not (tmp_path / "g.exr").exists()
        # Such a folder may exist; nothing else would be there to resume.
        (tmp_path / "g.exr").mkdir()
        done(*words)

    def test_unknown_image_format_is_refused(self, tmp_path: Path, image_file: Path) -> None:
        out = tmp_path / "files"
        result = run(image_file, "--axis", "exposure=0", "-o", out, "--image-format", "no")
        assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
        assert "'.no' is not the extension of a writable" in result.stderr
        assert not out.exists()


TOML = """
out = "{out}"
images = ["{picture}"]
attachments = "final,bloom"

[settings]
method = "pyramid"
levels = 3
firefly_filter = true
bloom_size = [16, 8]

[axes]
radius = "0.5:2:2"
intensity = [0.25, 1]
tonemap = ["none", "aces"]

[reduce]
mean = "mean"
energy = "encircled_energy:bloom"

[chunks]
intensity = 2
"""

YAML = """
out: "{out}"
images: "{picture}"
attachments: final,bloom
settings: {{method: pyramid, levels: 3, firefly_filter: true, bloom_size: [16, 8]}}
axes:
  radius: 0.5:2:2
  intensity: [0.25, 1]
  tonemap: [none, aces]
reduce: {{mean: mean, energy: "encircled_energy:bloom"}}
chunks: {{intensity: 2}}
"""


#: Lists in lists, 50 at a time, each within the next.
CHAIN = "a0: &a0 1\n" + "".join(
    f"a{i + 1}: &a{i + 1} {'[' * 50}*a{i}{']' * 50}\n" for i in range(40)
)


class TestOptionFiles:
    @pytest.mark.parametrize(("suffix", "text"), [("toml", TOML), ("yaml", YAML)])
    def test_holds_options(self, tmp_path: Path, image_file: Path, suffix: str, text: str) -> None:
        file = tmp_path / f"a.{suffix}"
        file.write_text(text.format(out=tmp_path / "a.zarr", picture=image_file))
        done("--from", file)
        found = xr.open_zarr(tmp_path / "a.zarr")
        settings = json.loads(found.attrs["settings"])
        assert (settings["levels"], settings["bloom_size"]) == (3, [16, 8])
        assert settings["firefly_filter"] is True
        assert dict(found.sizes)["radius"] == 2
        assert list(found["tonemap"].values) == ["none", "aces"]
        assert found["final"].chunks[1] == (2,)
        assert {"mean", "energy"} <= set(found)
        image = load(image_file).pixels
        with Renderer() as renderer:
            expected = renderer.apply(
                image,
                Pyramid(
                    levels=3,
                    firefly_filter=True,
                    radius=2,
                    bloom_size=(16, 8),
                    intensity=0.25,
                    tonemap="aces",
                ),
            )
        np.testing.assert_array_equal(found["final"].values[1, 0, 1], expected["final"])

    def test_the_command_line_comes_on_top(self, tmp_path: Path, image_file: Path) -> None:
        file = tmp_path / "a.toml"
        file.write_text(TOML.format(out=tmp_path / "a.zarr", picture=image_file))
        done(f"--from={file}", "--levels", "2", "-o", tmp_path / "b.zarr")
        settings = json.loads(xr.open_zarr(tmp_path / "b.zarr").attrs["settings"])
        assert settings["levels"] == 2
        assert not (tmp_path / "a.zarr").exists()

    def test_lists_in_lists(self, tmp_path: Path, image_file: Path) -> None:
        file = tmp_path / "a.toml"
        file.write_text(
            '[settings]\nmethod = "separable"\nlayers = [[1, 1], [2, 0.5]]\n'
            "[axes]\nbloom_size = [[4, 4], [8, 8]]\n"
            "weights = [[0.5, 0.25], [1.0]]\n"
        )
        done(image_file, "--from", file, "-o", tmp_path / "a.zarr")
        found = xr.open_zarr(tmp_path / "a.zarr")
        assert list(found["bloom_size"].values) == ["[4, 4]", "[8, 8]"]
        assert list(found["weights"].values) == ["[0.5, 0.25]", "[1.0]"]
        assert json.loads(found.attrs["settings"])["layers"] == [[1.0, 1.0], [2.0, 0.5]]

    @pytest.mark.parametrize(
        ("name", "text", "status", "told"),
        [
            ("a.toml", "a = ", 1, "a.toml: "),
            ("a.yaml", "a: [", 1, "a.yaml: "),
            ("a.yaml", "3", 1, "not a mapping of option names to values"),
            ("a.txt", "", 1, "is not .toml"),
            ("a.toml", "axes = 3", 1, "axes is not a table"),
            ("a.toml", "nonsense = 3", 2, "--nonsense"),
            ("missing.toml", None, 1, "missing.toml: No such file"),
            ("a.toml", 'from = "b.toml"', 1, "a.toml: from cannot be used inside a file"),
            ("a.toml", '"" = 1', 1, "a.toml: '' is not the name of an option"),
            # Found by fuzzing, or while its targets were written.
            ("a.yaml", "images:", 1, "a.yaml: images is not a list"),
            ("a.toml", "images = 3", 1, "a.toml: images is not a list"),
            ("a.toml", 'resume = "yes"', 1, "a.toml: resume: 'yes' is not true or false"),
            ("a.toml", "settings = {bloom = 1}", 1, "a.toml: bloom: 1 is not true or false"),
            ("a.yaml", "axes: {1: [[1, 2]]}", 2, "--axis: the method separable has no field '1'"),
            ("a.yaml", "a: !!bool x", 1, "a.yaml: a value does not fit its tag"),
            ("a.yaml", "a: !!timestamp x", 1, "a.yaml: a value does not fit its tag"),
            ("a.yaml", "a: !!float ''", 1, "a.yaml: a value does not fit its tag"),
            ("a.yaml", "a: 2001-99-99", 1, "a.yaml: month must be"),
            ("a.yaml", "a: &a [*a]", 1, "a.yaml: its values are too many, nested too deeply"),
            ("a.yaml", "axes: &a {b: *a}", 1, "a.yaml: its values are too many, nested"),
            ("a.yaml", CHAIN, 1, "a.yaml: its values are too many, nested too deeply"),
            ("a.yaml", "a: " + "[" * 5000, 1, "a.yaml: its values are too many"),
            ("a.toml", "a = " + "[" * 5000, 1, "a.toml: its values are too many"),
            ("a.toml", "a" + ".a" * 500 + " = 1", 1, "a.toml: its values are too many"),
            (
                "a.toml",
                "a = 0x" + "f" * 6000,
                1,
                "a.toml: it contains an integer of more than 64 bits",
            ),
            ("a.toml", 'axes = {exposure = ";"}', 2, "--axis exposure=;: there are no values"),
            (
                "a.toml",
                'reduce = {p = "psnr@exposure=;"}\naxes = {exposure = [1]}',
                2,
                "--axis exposure=;: there are no values",
            ),
            ("a.toml", f"chunks = {{exposure = '{'9' * 5000}'}}", 2, "is not AXIS=COUNT"),
            (
                "a.toml",
                'axes = {exposure = "0:1:600000", knee = "0:1:600000"}',
                2,
                "count 600000 is not in 1..400000",
            ),
        ],
        ids=lambda value: str(value)[:40],
    )
    def test_option_file_that_does_not_load_is_refused(
        self, tmp_path: Path, name: str, text: str | None, status: int, told: str
    ) -> None:
        if text is not None:
            (tmp_path / name).write_text(text)
        result = run("--from", tmp_path / name, "-o", tmp_path / "a.zarr")
        assert (result.exit_code, result.stderr.count("\n")) == (status, 1)
        assert told in result.stderr

    def test_option_file_that_is_not_text_is_refused(self, tmp_path: Path) -> None:
        (tmp_path / "a.toml").write_bytes(b"\xff")
        result = run("--from", tmp_path / "a.toml", "-o", tmp_path / "a.zarr")
        assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
        assert "a.toml: 'utf-8'" in result.stderr

    @pytest.mark.parametrize("sequence", ["[{}]", "!!pairs [x: {}]"])
    def test_yaml_aliases_do_not_multiply_memory(self, tmp_path: Path, sequence: str) -> None:
        # 9**12 letters, were they spelled.
        lines = ["a0: &a0 lol"]
        separator = ", x: " if "pairs" in sequence else ", "
        for number in range(12):
            listed = sequence.format(separator.join([f"*a{number}"] * 9))
            lines.append(f"a{number + 1}: &a{number + 1} {listed}")
        (tmp_path / "a.yaml").write_text("\n".join(lines))
        tracemalloc.start()
        try:
            result = run("--from", tmp_path / "a.yaml", "-o", tmp_path / "a.zarr")
            _, most = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert result.exit_code == 1
        assert "a.yaml: its values are too many, nested too deeply" in result.stderr
        # The file's text, and modules that the first call loads, take some MB.
        assert most < 64 << 20

    def test_flag_that_is_false_in_a_file_is_off(self, tmp_path: Path, image_file: Path) -> None:
        (tmp_path / "a.toml").write_text("resume = false\nraw = false\n[settings]\nbloom = false")
        words = ("--axis", "exposure=0", "-o", tmp_path / "a.zarr")
        done(image_file, "--from", tmp_path / "a.toml", *words)
        settings = json.loads(xr.open_zarr(tmp_path / "a.zarr").attrs["settings"])
        assert settings["bloom"] is False
