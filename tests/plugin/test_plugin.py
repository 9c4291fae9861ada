"""The pytest plugin on small projects: its options, and what failures show."""

from __future__ import annotations

import itertools
import json
import re

import numpy as np
import pytest

import vkbloom
from tests.plugin.projects import ONE, run, run_workers, write
from vkbloom import AdapterInfo

pytest.importorskip("xdist")


def test_failures_show_the_test_alone(project: pytest.Pytester) -> None:
    """Assertions and fixtures hide their own frames."""
    write(
        project,
        """
import inspect
import numpy as np
import pytest
from vkbloom import testing

def bloom(image):
    return np.sqrt(np.roll(image, 3, axis=1) * 1.5) + image[:, ::-1] * 0.2

@pytest.mark.parametrize("name", ["superposition", "gain", "border", "finite"])
def test_law(name):
    testing.assert_laws(bloom, name, size=(32, 32))

def test_report():
    testing.report(bloom, size=(32, 32)).assert_held()

def test_types():
    testing.assert_laws(bloom, "gain", gain="one")

def test_figures():
    testing.assert_laws(bloom, "gain", limits={"gain": {"of": 1}})

def test_command():
    testing.command(["false", "{input}", "{output}"])(np.zeros((16, 16, 3), np.float32))

def test_frame(frame_regression):
    frame_regression.check({"final": np.zeros((4, 4, 3), np.float32)}, name="a/b")

def test_adapter(bloom_renderer):
    pass
""",
    )
    result = run(project, "--bloom-adapter", "no such adapter")
    lines = result.outlines
    places = [line for line in lines if re.match(r"\S+\.py:\d+: ", line)]
    assert len(places) >= 9
    assert [line for line in places if not re.match(r"test_\w+\.py:", line)] == []


class TestOptions:
    def test_without_the_plugin(self, project: pytest.Pytester) -> None:
        write(project, "def test_one(): pass\ndef test_two(bloom_renderer): pass")
        options = ("no:cacheprovider", "no:hypothesispytest", "no:vkbloom")
        result = project.runpytest_inprocess(*(word for one in options for word in ("-p", one)))
        result.assert_outcomes(passed=1, errors=1)
        result.stdout.fnmatch_lines(["*fixture 'bloom_renderer' not found*"])

    def test_unused_it_imports_nothing(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write(
            project,
            "import sys\n"
            "def test_one():\n"
            "    assert 'pytest_vkbloom' in sys.modules\n"
            "    assert not {'vkbloom', 'numpy', 'OpenImageIO', 'skimage'} & set(sys.modules)",
        )
        # A process of its own, as this one has imported all of them, without other plugins, which
        # may do the same.
        monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
        result = project.runpytest_subprocess("-p", "no:cacheprovider", "-p", "vkbloom")
        result.assert_outcomes(passed=1)

    def test_no_writing_by_workers(self, project: pytest.Pytester) -> None:
        write(project, ONE)
        result = run_workers(project, "--bloom-update")
        assert result.ret == pytest.ExitCode.USAGE_ERROR
        result.stderr.fnmatch_lines(["*--bloom-update writes files*without -n*"])
        assert not (project.path / "bloom_references").exists()
        run(project, "--bloom-update", "-p", "xdist", "-n", "0").assert_outcomes(passed=1)

    RENDER = """
import vkbloom
def test_render(bloom_renderer, frame_regression):
    image = vkbloom.Scene.ufo()
    frames = bloom_renderer.render(image, size=(32, 18), framebuffers=("final",))
    frame_regression.check(frames)
def test_again(bloom_renderer):
    assert not bloom_renderer.closed
"""

    def test_renders(self, project: pytest.Pytester, software: AdapterInfo) -> None:
        write(project, self.RENDER)
        run(project, "--bloom-adapter=software", "--bloom-update").assert_outcomes(passed=2)
        text = (project.path / "bloom_references" / "test_one" / "test_render.json").read_text()
        origin = json.loads(text)["origin"]
        assert software.name in origin["adapter"]
        assert software.driver_info in origin["driver"]
        wanted = software.name[:8].upper()
        run(project, f"--bloom-adapter={wanted}").assert_outcomes(passed=2)

    def test_images_need_no_vulkan(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write(project, ONE)
        monkeypatch.setenv("VK_DRIVER_FILES", "/dev/null")
        monkeypatch.setenv("VK_ICD_FILENAMES", "/dev/null")
        run(project, "--bloom-update").assert_outcomes(passed=1)
        run(project).assert_outcomes(passed=1)

    def test_no_adapter_is_an_error(self, project: pytest.Pytester) -> None:
        write(project, self.RENDER)
        result = run(project, "--bloom-adapter=no such device")
        result.assert_outcomes(errors=2)
        result.stdout.fnmatch_lines(['no Vulkan adapter for "no such device"*'])


def test_images_of_failed_checks_are_saved(
    project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also by workers, and of images that a test made; what no format holds is named."""
    write(
        project,
        ONE
        + "def test_made(frame_regression): frame_regression.compare(frames(), frames(0.0))\n"
        + "def test_doubles(frame_regression):\n"
        + "    frame_regression.compare(np.ones((2, 2)), np.zeros((2, 2)))\n",
    )
    run(project, "--bloom-update", "-k", "frames").assert_outcomes(passed=1, deselected=2)
    monkeypatch.setenv("SHIFT", "0.1")
    for result in (run(project, "--bloom-save=out"), run_workers(project, "--bloom-save=out")):
        result.assert_outcomes(failed=3)
        result.stdout.fnmatch_lines(["*images are not saved: image: float64 cannot be stored*"])
    for name, kind in itertools.product(("test_frames", "test_made"), ("expected", "actual")):
        folder = project.path / "out" / kind / "test_one"
        bloom = vkbloom.read(folder / f"{name}.bloom.exr")
        assert bloom.max() == np.float16(0.5 + 0.1 * (kind == "actual"))
        assert (folder / f"{name}.final.png").is_file()
