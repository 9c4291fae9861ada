"""The pytest plugin on small projects: exact references, files of frames, options, reports."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from tests.plugin.projects import ONE, PROJECT, references, run, run_workers, write
from vkbloom import AdapterInfo
from vkbloom.testing import read_frame

pytest.importorskip("xdist")


def test_failures_show_the_test_alone(project: pytest.Pytester) -> None:
    """Each assertion, and the fixtures, hide their own frames."""
    write(
        project,
        """
import inspect
import numpy as np
import pytest
from vkbloom import testing

def bloom(image):
    return np.sqrt(np.roll(image, 3, axis=1) * 1.5) + image[:, ::-1] * 0.2

@pytest.mark.parametrize("name", [one for one in testing.__all__ if one.startswith("assert_")])
def test_law(name):
    parameters = list(inspect.signature(getattr(testing, name)).parameters.values())
    needed = [1.0 for one in parameters[1:] if one.default is one.empty]
    getattr(testing, name)(bloom, *needed)

def test_types():
    testing.assert_gain(bloom, "one")

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
    assert len(places) >= 13
    assert [line for line in places if not re.match(r"test_\w+\.py:", line)] == []


class TestExact:
    """The project's driver has the hash HASH, none without it; `check` gets ARGUMENTS."""

    TEXT = (
        PROJECT
        + """
def test_frames(frame_regression):
    info = {"adapter": "An engine"}
    if os.environ.get("HASH"):
        info["driver_sha256"] = os.environ["HASH"]
    arguments = eval(os.environ.get("ARGUMENTS", "{}"))
    frame_regression.check(frames(), info=info, exact=True, **arguments)
"""
    )
    # A hundredth of what the default tolerances allow, and a step of a half float.
    LEAST = "0.0000005"

    @pytest.fixture(autouse=True)
    def reference(self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("HASH", "aa11")
        write(project, self.TEXT)
        run(project, "--bloom-update").assert_outcomes(passed=1)
        file = project.path / "bloom_references" / "test_one" / "test_frames.json"
        (listed,) = json.loads(file.read_text())["references"]
        assert listed["origin"]["driver_sha256"] == "aa11"

    def test_equal_values_of_one_driver_pass(self, project: pytest.Pytester) -> None:
        run(project).assert_outcomes(passed=1)

    def test_the_least_difference_fails(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("SHIFT", self.LEAST)
        result = run(project)
        result.assert_outcomes(failed=1)
        result.stdout.fnmatch_lines(
            ["*  bloom: FAILED (exact): *", "*reference: An engine, SHA-256 aa11, *; now: *"]
        )

    @pytest.mark.parametrize(
        ("hash_now", "message"),
        [
            ("", "*exact: the driver of the frames has no hash (An engine, *"),
            ("bb22", "*test_frames.json has no reference of the frames' driver (*bb22*aa11*"),
        ],
    )
    def test_other_drivers_are_an_error(
        self,
        project: pytest.Pytester,
        monkeypatch: pytest.MonkeyPatch,
        hash_now: str,
        message: str,
    ) -> None:
        monkeypatch.setenv("HASH", hash_now)
        result = run(project)
        result.assert_outcomes(failed=1)
        result.stdout.fnmatch_lines(["*ValueError*" + message.lstrip("*")])

    def test_references_of_another_driver_are_replaced_or_kept(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("HASH", "bb22")
        monkeypatch.setenv("SHIFT", self.LEAST)
        run(project, "--bloom-add").assert_outcomes(passed=1)
        for hash_now, shift, outcome in (
            ("bb22", self.LEAST, "passed"),
            ("aa11", "0", "passed"),
            # The other driver's values.
            ("aa11", self.LEAST, "failed"),
        ):
            monkeypatch.setenv("HASH", hash_now)
            monkeypatch.setenv("SHIFT", shift)
            run(project).assert_outcomes(**{outcome: 1})
        monkeypatch.setenv("HASH", "cc33")
        run(project, "--bloom-update").assert_outcomes(passed=1)
        assert len(references(project)) == 4

    def test_no_hash_no_reference(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("HASH", "")
        run(project, "--bloom-update").assert_outcomes(failed=1)

    def test_tolerances_are_excluded(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("ARGUMENTS", "{'atol': 0.1, 'flip': 0.2}")
        result = run(project)
        result.assert_outcomes(failed=1)
        result.stdout.fnmatch_lines(["*exact: True excludes tolerances; leave out atol, flip"])
        monkeypatch.setenv("ARGUMENTS", "{'allow_nan': True}")
        run(project).assert_outcomes(passed=1)


class TestFrameFiles:
    @pytest.mark.parametrize(
        ("name", "dtype", "channels"),
        [("a.exr", "float16", 3), ("a.exr", "float32", 4), ("a.png", "uint8", 4)],
    )
    def test_values_are_as_stored(
        self, tmp_path: Path, name: str, dtype: str, channels: int
    ) -> None:
        image = np.arange(5 * 7 * channels).reshape(5, 7, channels).astype(dtype)
        buffer = oiio.ImageBuf(image)
        buffer.specmod().attribute("oiio:UnassociatedAlpha", 1)
        assert buffer.write(str(tmp_path / name))
        read = read_frame(tmp_path / name)
        assert read.dtype == image.dtype
        np.testing.assert_array_equal(read, image)

    def test_files_that_are_no_frames(self, tmp_path: Path) -> None:
        with pytest.raises(FileNotFoundError, match="nothing"):
            read_frame(tmp_path / "nothing.exr")
        file = tmp_path / "two.exr"
        buffer = oiio.ImageBuf(np.zeros((2, 2, 2), np.float32))
        buffer.specmod().channelnames = ("X", "Z")
        assert buffer.write(str(file))
        with pytest.raises(ValueError, match=r"two\.exr: the channels X, Z are not R, G, B"):
            read_frame(file)


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

    @pytest.mark.parametrize("option", ["--bloom-update", "--bloom-add"])
    def test_no_writing_by_workers(self, project: pytest.Pytester, option: str) -> None:
        write(project, ONE)
        result = run_workers(project, option)
        assert result.ret == pytest.ExitCode.USAGE_ERROR
        result.stderr.fnmatch_lines(["*--bloom-update and --bloom-add write files*without -n*"])
        assert not (project.path / "bloom_references").exists()
        run(project, option, "-p", "xdist", "-n", "0").assert_outcomes(passed=1)

    def test_wrong_use(self, project: pytest.Pytester) -> None:
        write(project, ONE)
        result = run(project, "--bloom-update", "--bloom-add")
        assert result.ret == pytest.ExitCode.USAGE_ERROR

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
        origin = json.loads(text)["references"][0]["origin"]
        assert software.name in origin["adapter"]
        assert software.driver_info in origin["driver"]
        wanted = software.name[:8].upper()
        run(project, f"--bloom-adapter={wanted}").assert_outcomes(passed=2)

    def test_a_missing_adapter_is_an_error(self, project: pytest.Pytester) -> None:
        write(project, self.RENDER)
        result = run(project, "--bloom-adapter=Voodoo")
        result.assert_outcomes(errors=2)

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


class TestReportOfWorkers:
    MANY = PROJECT + (
        "@pytest.mark.parametrize('n', range(6))\n"
        "def test_frames(frame_regression, n):\n"
        "    frame_regression.check(frames() if n % 2 else frames(0.0), f'name{n}')\n"
    )

    def test_is_one(self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
        write(project, self.MANY)
        run(project, "--bloom-update").assert_outcomes(passed=6)
        monkeypatch.setenv("SHIFT", "0.1")
        alone = run(project, "--bloom-report=alone")
        shared = run_workers(project, "--bloom-report=shared")
        outputs = []
        for result, folder in ((alone, "alone"), (shared, "shared")):
            result.assert_outcomes(passed=3, failed=3)
            files = sorted(file.name for file in (project.path / folder).iterdir())
            assert files == ["index.html", "report.json"]
            outputs.append([(project.path / folder / name).read_bytes() for name in files])
        assert outputs[0] == outputs[1]
        checks = json.loads(outputs[0][1])["checks"]
        assert [check["name"] for check in checks] == [f"name{n}" for n in range(6)]
        assert [check["first_failure"] for check in checks] == [None, "bloom"] * 3

    def test_figures(self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
        write(project, ONE)
        run(project, "--bloom-update")
        monkeypatch.setenv("SHIFT", "0.25")
        run(project, "--bloom-report=report").assert_outcomes(failed=1)
        (check,) = json.loads((project.path / "report" / "report.json").read_text())["checks"]
        assert check["outcome"] == "failed"
        glow, bloom, final = check["framebuffers"]
        assert (glow["outcome"], bloom["outcome"], final["outcome"]) == (
            "equal",
            "failed",
            "failed",
        )
        assert bloom["shape"] == [12, 16, 3]
        assert bloom["dtype"] == "float16"
        assert bloom["percent_over"] == 100.0
        # Half floats near 0.5 are 2**-11 apart.
        np.testing.assert_allclose(bloom["max_error"], 0.25, atol=2**-11)
        there = bloom["actual_there"] - bloom["expected_there"]
        np.testing.assert_allclose(there, bloom["max_error"])
