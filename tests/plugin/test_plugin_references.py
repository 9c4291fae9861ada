"""References of the pytest plugin: written, compared, unused."""

from __future__ import annotations

import json
import shutil
from typing import Any

import OpenImageIO as oiio
import pytest

from tests.plugin.projects import ONE, PROJECT, edit, references, run, run_workers, write
from vkbloom.testing.references import cpu_vendor
from vkbloom.testing.regression import name_of_test

pytest.importorskip("xdist")


class TestReferences:
    def test_missing_fails_and_says_what_to_do(self, project: pytest.Pytester) -> None:
        write(project, ONE)
        result = run(project)
        result.assert_outcomes(failed=1)
        result.stdout.fnmatch_lines(
            ["*test_frames: there is no reference *test_one/test_frames.json*--bloom-update*"]
        )
        result.stdout.fnmatch_lines(["missing: bloom_references/test_one/test_frames.json"])

    def test_missing_may_be_allowed(self, project: pytest.Pytester) -> None:
        write(project, ONE)
        result = run(project, "--bloom-allow-missing")
        result.assert_outcomes(passed=1)
        result.stdout.fnmatch_lines(["missing: bloom_references/test_one/test_frames.json"])

    def test_update_writes_and_the_next_run_passes(self, project: pytest.Pytester) -> None:
        write(project, ONE)
        result = run(project, "--bloom-update")
        result.assert_outcomes(passed=1)
        result.stdout.fnmatch_lines(["written: bloom_references/test_one/test_frames.json"])
        assert references(project) == [
            "test_frames.bloom.exr",
            "test_frames.final.png",
            "test_frames.glow.exr",
            "test_frames.json",
        ]
        run(project).assert_outcomes(passed=1)

    def test_says_who_made_it(self, project: pytest.Pytester) -> None:
        write(
            project,
            PROJECT + "def test_frames(frame_regression):\n"
            "    frame_regression.check(frames(), info={'adapter': 'An <engine>', 'driver': '7'})",
        )
        run(project, "--bloom-update").assert_outcomes(passed=1)
        file = project.path / "bloom_references" / "test_one" / "test_frames.json"
        (reference,) = json.loads(file.read_text())["references"]
        assert reference["origin"]["adapter"] == "An <engine>"
        assert reference["origin"]["driver"] == "7"
        assert reference["origin"]["cpu_vendor"] == cpu_vendor()
        assert [each["name"] for each in reference["framebuffers"]] == ["glow", "bloom", "final"]

    def test_update_leaves_alone_what_passes(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write(project, ONE)
        run(project, "--bloom-update")
        folder = project.path / "bloom_references" / "test_one"
        before = {file.name: file.read_bytes() for file in folder.iterdir()}
        monkeypatch.setenv("SHIFT", "0.00005")
        result = run(project, "--bloom-update")
        result.assert_outcomes(passed=1)
        result.stdout.no_fnmatch_line("written:*")
        assert {file.name: file.read_bytes() for file in folder.iterdir()} == before
        monkeypatch.setenv("SHIFT", "0.1")
        run(project, "--bloom-update").stdout.fnmatch_lines(["written:*"])
        run(project).assert_outcomes(passed=1)
        monkeypatch.delenv("SHIFT")
        run(project).assert_outcomes(failed=1)

    def test_one_of_several_is_enough(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write(
            project,
            PROJECT + "def test_frames(frame_regression):\n"
            "    info = {'adapter': os.environ.get('SHIFT', '0')}\n"
            "    frame_regression.check(frames(), info=info)",
        )
        run(project, "--bloom-update").assert_outcomes(passed=1)
        monkeypatch.setenv("SHIFT", "0.1")
        run(project).assert_outcomes(failed=1)
        run(project, "--bloom-add").assert_outcomes(passed=1)
        assert "test_frames.bloom.2.exr" in references(project)
        for shift, outcome in (("0.1", "passed"), ("0", "passed"), ("0.05", "failed")):
            monkeypatch.setenv("SHIFT", shift)
            run(project).assert_outcomes(**{outcome: 1})
        # Replacing all of them leaves no file behind.
        run(project, "--bloom-update").assert_outcomes(passed=1)
        assert "test_frames.bloom.2.exr" not in references(project)

    def test_the_same_machine_replaces_its_own(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write(project, ONE)
        for shift in ("0", "0.1", "0.2"):
            monkeypatch.setenv("SHIFT", shift)
            run(project, "--bloom-add").assert_outcomes(passed=1)
        assert len(references(project)) == 4

    @pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32"])
    @pytest.mark.parametrize(
        "shape", ["(5, 7)", "(5, 7, 1)", "(5, 7, 2)", "(1, 1, 3)", "(5, 7, 4)"]
    )
    def test_no_value_is_lost(self, project: pytest.Pytester, dtype: str, shape: str) -> None:
        write(
            project,
            f"""
import numpy as np
def test_image(frame_regression):
    generator = np.random.default_rng(1)
    dtype, shape = np.dtype({dtype!r}), {shape}
    # All bits, so that there are subnormals, NaN, infinities and colours under alpha 0.
    image = generator.integers(0, 256, (*shape, dtype.itemsize), np.uint8).view(dtype)[..., 0]
    if dtype.kind == "f":
        image.flat[:1] = -np.inf
    image = np.where(np.isnan(image), dtype.type(np.nan), image) if dtype.kind == "f" else image
    frame_regression.check(image, atol=0, allow_nan=True)
    frame_regression.check(image, "named.one", atol=0, allow_nan=True)
""",
        )
        run(project, "--bloom-update").assert_outcomes(passed=1)
        result = run(project, "--bloom-report=report")
        result.assert_outcomes(passed=1)
        checks = json.loads((project.path / "report" / "report.json").read_text())["checks"]
        assert [each["framebuffers"][0]["outcome"] for each in checks] == ["equal", "equal"]
        folder = project.path / "bloom_references" / "test_one"
        (file,) = folder.glob("named.one.image.*")
        assert str(oiio.ImageBuf(str(file)).spec().format) == {
            "float16": "half",
            "float32": "float",
        }.get(dtype, dtype)

    @pytest.mark.parametrize(
        ("image", "message"),
        [
            ("np.zeros((3, 4, 3))", "*image: float64 cannot be stored without loss*"),
            ("np.zeros((3, 4, 5), np.float32)", "*image: shape (3, 4, 5) is not*"),
            (
                "np.full((3, 4, 3), np.nan, np.float32)",
                "*image has NaN or infinity; set allow_nan*",
            ),
            ("{'a/b': np.zeros((3, 4), np.float32)}", "*'a/b' cannot name a framebuffer*"),
            ("{}", "*TypeError: frames: * is not Frames, a mapping*"),
            ("[[1.0]]", "*TypeError: frames: * is not Frames, a mapping*"),
            ("{'a': [[1.0]]}", "*TypeError: frames: a: list is not a NumPy array*"),
        ],
    )
    def test_wrong_reference_is_refused(
        self, project: pytest.Pytester, image: str, message: str
    ) -> None:
        write(
            project,
            "import numpy as np\n"
            f"def test_image(frame_regression): frame_regression.check({image})",
        )
        result = run(project, "--bloom-update")
        result.assert_outcomes(failed=1)
        result.stdout.fnmatch_lines([message])
        assert not (project.path / "bloom_references").exists()

    @pytest.mark.parametrize(
        ("damage", "message"),
        [
            (lambda folder: (folder / "test_frames.glow.exr").unlink(), "*test_frames.glow.exr*"),
            (
                lambda folder: (folder / "test_frames.glow.exr").write_bytes(b"no"),
                "*ValueError: *test_frames.glow.exr: is not a readable image*",
            ),
            (
                lambda folder: shutil.copy(
                    folder / "test_frames.final.png", folder / "test_frames.glow.exr"
                ),
                "*ValueError: *test_frames.glow.exr: holds uint8*, not float16*",
            ),
            (
                lambda folder: (folder / "test_frames.json").write_text("{}"),
                "*ValueError: *test_frames.json: not a list of references*",
            ),
            *(
                (
                    lambda folder, content=content: (folder / "test_frames.json").write_bytes(
                        content
                    ),
                    "*ValueError: *test_frames.json: not a list of references*",
                )
                for content in (b"[1", b"\xff\xfe", b"[" * 100_000)
            ),
            *(
                (
                    lambda folder, was=was, now=now: edit(folder / "test_frames.json", was, now),
                    f"*ValueError: *test_frames.json: not a list of references: {told}*",
                )
                for was, now, told in (
                    ('"name": "glow"', '"names": "glow"', "no 'name'"),
                    ('"name": "glow"', '"name": ["glow"]', "expected string"),
                    ('"name": "glow"', '"name": "a/b"', "'a/b' cannot name a framebuffer"),
                    ('"test_frames.glow.exr"', '"../glow.exr"', "'../glow.exr' is not in this"),
                    ('"test_frames.glow.exr"', r'"\u0000"', "'?x00' is not in this folder"),
                )
            ),
        ],
    )
    def test_damaged_files_are_named(
        self, project: pytest.Pytester, damage: Any, message: str
    ) -> None:
        write(project, ONE)
        run(project, "--bloom-update")
        damage(project.path / "bloom_references" / "test_one")
        result = run(project)
        result.assert_outcomes(failed=1)
        result.stdout.fnmatch_lines([message])

    def test_names(self, project: pytest.Pytester) -> None:
        write(
            project,
            PROJECT
            + """
class TestAll:
    @pytest.mark.parametrize("text", ["a", "a b", "a/b", "a<b"])
    def test_names(self, frame_regression, text):
        frame_regression.check(frames())

def test_second_needs_a_name(frame_regression):
    frame_regression.check(frames())
    frame_regression.check(frames(), "own")
    with pytest.raises(ValueError, match="name: the test already has a check"):
        frame_regression.check(frames())
    for name in ("", ".hidden", "a/b", "a" * 101):
        with pytest.raises(ValueError, match="name: .* cannot name a reference"):
            frame_regression.check(frames(), name)
""",
        )
        run(project, "--bloom-update").assert_outcomes(passed=5)
        names = [name for name in references(project) if name.endswith(".json")]
        assert len(names) == 6
        assert {"own.json", "TestAll.test_names-a.json"} <= set(names)

    def test_long_names_stay_apart(self) -> None:
        names = {name_of_test(f"test[{'x' * 200}{end}]") for end in "ab"}
        assert len(names) == 2
        assert all(len(name) <= 100 for name in names)


class TestUnused:
    TWO = PROJECT + (
        "def test_frames(frame_regression): frame_regression.check(frames())\n"
        "def test_other(frame_regression):\n"
        "    if not os.environ.get('IDLE'): frame_regression.check(frames(), 'other')\n"
    )
    LINE = "unused: bloom_references/test_one/other.json"

    @pytest.fixture(autouse=True)
    def idle(self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
        write(project, self.TWO)
        run(project, "--bloom-update").assert_outcomes(passed=2)
        monkeypatch.setenv("IDLE", "1")

    def test_is_listed(self, project: pytest.Pytester) -> None:
        run(project).stdout.fnmatch_lines([self.LINE])

    def test_is_listed_of_workers(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        result = run_workers(project, monkeypatch)
        result.assert_outcomes(passed=2)
        result.stdout.fnmatch_lines([self.LINE])

    @pytest.mark.parametrize("arguments", [("-k", "other"), ("test_one.py::test_other",)])
    def test_not_where_tests_were_left_out(
        self, project: pytest.Pytester, arguments: tuple[str, ...]
    ) -> None:
        run(project, *arguments).stdout.no_fnmatch_line("unused:*")

    def test_not_where_a_test_failed_before(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("SHIFT", "0.5")
        run(project).stdout.no_fnmatch_line("unused:*")

    def test_a_module_that_is_gone(self, project: pytest.Pytester) -> None:
        folder = project.path / "bloom_references"
        shutil.copytree(folder / "test_one", folder / "test_gone")
        run(project).stdout.fnmatch_lines(["unused: bloom_references/test_gone"])


class TestChecks:
    """What is compared, in which order."""

    @pytest.mark.parametrize(
        ("change", "arguments", "message"),
        [
            ("image[:5]", "", "*(shape and dtype): its shape is (5, 16, 3), not (12, 16, 3)*"),
            ("image.astype(np.float32)", "", "*(shape and dtype): its dtype is float32, not*"),
            ("image[:, :, 0]", "", "*(shape and dtype): its shape is (12, 16), not (12, 16, 3)*"),
            (
                "np.where(image == image.max(), np.nan, image).astype(image.dtype)",
                "atol=9, fail_percent=100",
                "*(finiteness): NaN or infinity in one image only, 1 values, *x 15, y 11*",
            ),
            ("image + np.float16(0.01)", "atol=0", "*(exact): 100 % of the pixels differ; *"),
            (
                "image + np.float16(0.01)",
                "",
                "*(tolerances): * differ by more than 0.0001 + 0.002 |reference|; largest "
                "difference 0.01* at x *, y *, channel *: *, not *",
            ),
            ("image * np.float16(1.01)", "rtol=0.005", "*(tolerances): * differ by more than 0 +*"),
            ("spot", "atol=0.1, fail_percent=0.2", "*(tolerances): 0.5208 % *, 0.2 % allowed;*"),
            (
                "spot",
                "atol=0.1, fail_percent=1, hard_fail=0.4",
                "*(tolerances): largest difference 0.5* at x 3, y 2,*, over 0.4, the most allowed*",
            ),
            ("np.flip(image, 0)", "atol=9, ssim=0.9", "*(SSIM): SSIM * is under 0.9*"),
            ("np.flip(image, 0)", "atol=9, flip=0.01", "*(FLIP): FLIP * is over 0.01*"),
        ],
    )
    def test_fails(
        self, project: pytest.Pytester, change: str, arguments: str, message: str
    ) -> None:
        write(project, self.text(change, arguments))
        run(project, "--bloom-update", "-k", "right").assert_outcomes(passed=1, deselected=1)
        result = run(project, "-k", "changed")
        result.assert_outcomes(failed=1, deselected=1)
        result.stdout.fnmatch_lines(
            ["*one: the first framebuffer that differs is image", "*image: FAILED " + message]
        )

    @pytest.mark.parametrize(
        ("change", "arguments"),
        [
            ("image + np.float16(0.01)", "atol=0.02"),
            ("image * np.float16(1.01)", "rtol=0.02"),
            ("spot", "atol=0.1, fail_percent=1, hard_fail=0.6"),
            ("image + np.float16(0.01)", "atol=0.02, ssim=0.9, flip=0.2"),
            ("np.flip(image, 0)", "atol=float('inf')"),
            # Equal images need no figure: this is too small for SSIM's window.
            ("image", "ssim=1.0, flip=0.0"),
        ],
    )
    def test_passes(self, project: pytest.Pytester, change: str, arguments: str) -> None:
        write(project, self.text(change, arguments))
        run(project, "--bloom-update", "-k", "right").assert_outcomes(passed=1, deselected=1)
        run(project, "-k", "changed").assert_outcomes(passed=1, deselected=1)

    @staticmethod
    def text(change: str, arguments: str) -> str:
        return (
            PROJECT
            + f"""
def test_right(frame_regression):
    frame_regression.check(frames()["glow"], "one")

def test_changed(frame_regression):
    image = frames()["glow"]
    spot = image.copy()
    spot[2, 3, 1] += 0.5
    frame_regression.check({change}, "one", {arguments})
"""
        )

    def test_names_the_first_in_the_order_of_the_data(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write(project, ONE)
        run(project, "--bloom-update")
        monkeypatch.setenv("SHIFT", "0.1")
        result = run(project)
        result.stdout.fnmatch_lines(
            [
                "*test_frames: the first framebuffer that differs is bloom (glow: right)",
                "*  glow: equal",
                "*  bloom: FAILED (tolerances): *",
                "*  final: FAILED (tolerances): *",
            ]
        )

    def test_framebuffers_that_come_and_go(self, project: pytest.Pytester) -> None:
        write(
            project,
            PROJECT
            + """
def test_right(frame_regression):
    frame_regression.check(frames(), "one")

def test_fewer(frame_regression):
    frame_regression.check({"glow": frames()["glow"], "final": frames()["final"]}, "one")

def test_more(frame_regression):
    frame_regression.check({**frames(), "extra": frames()["glow"]}, "one")
""",
        )
        run(project, "--bloom-update", "-k", "right")
        result = run(project)
        result.assert_outcomes(passed=1, failed=2)
        result.stdout.fnmatch_lines(["*  bloom: FAILED (shape and dtype): it is missing"])
        result.stdout.fnmatch_lines(["*  extra: FAILED (shape and dtype): the reference does not*"])

    def test_warns(self, project: pytest.Pytester) -> None:
        write(project, self.text("image + np.float16(0.01)", "atol=0.02, warn=0.005"))
        run(project, "--bloom-update", "-k", "right")
        # Else the outer run's filter makes an error of it.
        result = run(project, "-k", "changed", "-W", "default")
        result.assert_outcomes(passed=1, deselected=1, warnings=1)
        result.stdout.fnmatch_lines(["*FrameDifferenceWarning: one: image: largest difference*"])

    def test_compares_what_a_test_has_made(self, project: pytest.Pytester) -> None:
        write(
            project,
            PROJECT
            + """
def test_same(frame_regression):
    frame_regression.compare(frames(), frames(0.00005))

def test_other(frame_regression):
    names = {"info": {"adapter": "My engine"}, "expected_info": {"driver": "Mesa 25"}}
    frame_regression.compare(frames(0.1), frames(), **names)

def test_unnamed(frame_regression):
    frame_regression.compare(frames(0.1), frames())
""",
        )
        result = run(project, "--bloom-report=report")
        result.assert_outcomes(passed=1, failed=2)
        # In any order of the tests.
        for name, adapters in (
            ("other", f"Mesa 25, {cpu_vendor()}; now: My engine, {cpu_vendor()}"),
            ("unnamed", "arrays without an adapter, *; now: arrays without an adapter, *"),
        ):
            result.stdout.fnmatch_lines(
                [
                    f"*test_{name}: the first framebuffer that differs is bloom *",
                    f"*reference: {adapters}",
                ]
            )
        assert not (project.path / "bloom_references").exists()

    @pytest.mark.parametrize("folder", ["", "file", "file/below"])
    def test_reports_that_cannot_be_written(self, project: pytest.Pytester, folder: str) -> None:
        write(project, ONE)
        (project.path / "file").write_text("kept")
        result = run(project, f"--bloom-report={folder}")
        assert result.ret == pytest.ExitCode.USAGE_ERROR
        result.stderr.fnmatch_lines([f"ERROR: --bloom-report*{folder}: *"])
        assert (project.path / "file").read_text() == "kept"
        assert not (project.path / "index.html").exists()

    def test_a_report_that_cannot_be_written_in_the_end(self, project: pytest.Pytester) -> None:
        write(project, "def test_it(frame_regression): assert False, 'told'")
        (project.path / "report" / "index.html").mkdir(parents=True)
        result = run(project, "--bloom-report=report")
        result.assert_outcomes(failed=1)
        assert result.ret == pytest.ExitCode.INTERNAL_ERROR
        result.stdout.fnmatch_lines(["*told*", "report: report is not written: *index.html'"])

    @pytest.mark.parametrize(
        "argument",
        ["atol=-1", "rtol=float('nan')", "fail_percent=101", "hard_fail=-1", "ssim=2", "flip=-1"],
    )
    def test_wrong_arguments(self, project: pytest.Pytester, argument: str) -> None:
        write(
            project,
            PROJECT + "def test_frames(frame_regression):\n"
            f"    with pytest.raises(ValueError, match={argument.split('=', maxsplit=1)[0]!r}):\n"
            f"        frame_regression.check(frames(), {argument})",
        )
        run(project).assert_outcomes(passed=1)
