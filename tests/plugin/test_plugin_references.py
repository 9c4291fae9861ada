"""References of the pytest plugin: written and compared."""

from __future__ import annotations

import shutil

import OpenImageIO as oiio
import pytest

from tests.plugin.projects import ONE, PROJECT, edit, references, run, write
from vkbloom.testing._regression import name_of_test

pytest.importorskip("xdist")


class TestReferences:
    def test_missing_fails_and_says_what_to_do(self, project: pytest.Pytester) -> None:
        write(project, ONE)
        result = run(project)
        result.assert_outcomes(failed=1)
        result.stdout.fnmatch_lines(
            ["*test_frames: there is no reference *test_one/test_frames.json*--bloom-update*"]
        )

    def test_update_writes_and_leaves_alone_what_passes(
        self, project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write(project, ONE)
        result = run(project, "--bloom-update")
        result.assert_outcomes(passed=1)
        result.stdout.fnmatch_lines(["written: bloom_references/test_one/test_frames.json"])
        names = ("bloom.exr", "final.png", "glow.exr", "json")
        assert references(project) == [f"test_frames.{name}" for name in names]
        run(project).assert_outcomes(passed=1)
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

    def test_an_update_leaves_no_file_behind(self, project: pytest.Pytester) -> None:
        for image in ("frames()", "{'bloom': frames()['final']}"):
            write(
                project,
                f"{PROJECT}def test_frames(frame_regression): frame_regression.check({image})\n",
            )
            run(project, "--bloom-update").assert_outcomes(passed=1)
        assert references(project) == ["test_frames.bloom.png", "test_frames.json"]

    def test_no_value_is_lost(self, project: pytest.Pytester) -> None:
        write(
            project,
            """
import numpy as np
import pytest
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32"])
@pytest.mark.parametrize("number", range(5))
def test_image(frame_regression, dtype, number):
    shape = [(5, 7), (5, 7, 1), (5, 7, 2), (1, 1, 3), (5, 7, 4)][number]
    generator = np.random.default_rng(1)
    dtype = np.dtype(dtype)
    # All bits, so that there are subnormals, NaN, infinities and colours under alpha 0.
    image = generator.integers(0, 256, (*shape, dtype.itemsize), np.uint8).view(dtype)[..., 0]
    if dtype.kind == "f":
        image.flat[:1] = -np.inf
    image = np.where(np.isnan(image), dtype.type(np.nan), image) if dtype.kind == "f" else image
    frame_regression.check(image, atol=0, allow_nan=True)
    frame_regression.check(image, f"named.{dtype}.{number}", atol=0, allow_nan=True)
""",
        )
        run(project, "--bloom-update").assert_outcomes(passed=20)
        run(project).assert_outcomes(passed=20)
        folder = project.path / "bloom_references" / "test_one"
        stored = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}
        for dtype, kind in stored.items():
            files = [*folder.glob(f"named.{dtype}.*.image.*")]
            assert len(files) == 5
            assert {str(oiio.ImageBuf(str(file)).spec().format) for file in files} == {kind}

    def test_wrong_reference_is_refused(self, project: pytest.Pytester) -> None:
        told = {
            "np.zeros((3, 4, 3))": "*image: float64 cannot be stored without loss*",
            "np.zeros((3, 4, 5), np.float32)": "*image: shape (3, 4, 5) is not*",
            "np.full((3, 4, 3), np.nan, np.float32)": "*image has NaN or infinity; set allow_nan*",
            "{'a/b': np.zeros((3, 4), np.float32)}": "*'a/b' cannot name a framebuffer*",
            "{}": "*TypeError: frames: {} is not Frames, a mapping*",
            "[[1.0]]": "*TypeError: frames: * is not Frames, a mapping*",
            "{'a': [[1.0]]}": "*TypeError: frames: a: list is not a NumPy array*",
        }
        write(
            project,
            "import numpy as np\n"
            + "".join(
                f"def test_{number}(frame_regression): frame_regression.check({image})\n"
                for number, image in enumerate(told)
            ),
        )
        result = run(project, "--bloom-update")
        result.assert_outcomes(failed=len(told))
        for message in told.values():
            result.stdout.fnmatch_lines([message])
        assert not (project.path / "bloom_references").exists()

    def test_damaged_files_are_named(self, project: pytest.Pytester) -> None:
        """Each of the tests finds other damage of its own reference."""
        listed = "not a list of references"
        # What the image of glow and the list become, or what is edited in the list; what is told.
        damages: list[tuple[str | bytes | tuple[str, str], str]] = [
            ("", "*-0.glow.exr*"),
            ("no", "*ValueError: *-1.glow.exr: is not a readable image*"),
            ("png", "*ValueError: *-2.glow.exr: holds uint8*, not float16*"),
            *((text, listed) for text in (b"{}", b"[1", b"\xff\xfe", b"[" * 100_000)),
            (('"name": "glow"', '"names": "glow"'), f"{listed}: no 'name'"),
            (('"name": "glow"', '"name": ["glow"]'), f"{listed}: expected string"),
            (('"name": "glow"', '"name": "a/b"'), f"{listed}: 'a/b' cannot name a framebuffer"),
            (('"frames-10.glow.exr"', '"../glow.exr"'), f"{listed}: '../glow.exr' is not in this"),
            (('"frames-11.glow.exr"', r'"\u0000"'), f"{listed}: '?x00' is not in this folder"),
        ]
        write(
            project,
            PROJECT
            + f"@pytest.mark.parametrize('number', range({len(damages)}))\n"
            + "def test_frames(frame_regression, number):\n"
            + "    frame_regression.check(frames(), f'frames-{number}')\n",
        )
        run(project, "--bloom-update").assert_outcomes(passed=len(damages))
        folder = project.path / "bloom_references" / "test_one"
        for number, (damage, _) in enumerate(damages):
            image, index = (folder / f"frames-{number}.{end}" for end in ("glow.exr", "json"))
            if isinstance(damage, tuple):
                edit(index, *damage)
            elif isinstance(damage, bytes):
                index.write_bytes(damage)
            elif damage == "png":
                shutil.copy(folder / f"frames-{number}.final.png", image)
            elif damage:
                image.write_text(damage)
            else:
                image.unlink()
        result = run(project)
        result.assert_outcomes(failed=len(damages))
        for number, (_, told) in enumerate(damages):
            is_whole = told.startswith("*")
            result.stdout.fnmatch_lines(
                [told if is_whole else f"*ValueError: *frames-{number}.json: {told}*"]
            )

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

    def test_a_name_of_two_pictures(self, project: pytest.Pytester) -> None:
        """Two tests, two parameters, one test; where both have the same picture, they share it."""
        write(
            project,
            PROJECT
            + """
def test_one(frame_regression):
    frame_regression.check(frames(), "before")

def test_equal(frame_regression):
    frame_regression.check(frames(), "before")

def test_two(frame_regression):
    frame_regression.check(np.zeros((4, 5, 3), np.uint8), "before")

@pytest.mark.parametrize("level", [1, 2])
def test_parameters(frame_regression, level):
    frame_regression.check(np.full((4, 5, 3), 90 * level, np.uint8), "parameters")

def test_twice(frame_regression):
    frame_regression.check(np.full((4, 5, 3), 3, np.uint8), "twice")
    frame_regression.check(np.full((4, 5, 3), 99, np.uint8), "twice")
""",
        )
        told = [
            "*before: the reference is that of the test test_one.py::test_one, too, and this one*",
            "*parameters: the reference is that of the test *test_parameters[[]1], too, and*",
            "*twice: the reference is that of an earlier check of this test, too, and this one*",
        ]
        # The second time, references are replaced that were used, not written.
        for arguments in (["--bloom-update"], ["--bloom-update"], []):
            result = run(project, *arguments)
            result.assert_outcomes(passed=3, failed=3)
            if arguments:
                result.stdout.fnmatch_lines(told)
        names = [name for name in references(project) if name.endswith(".json")]
        assert sorted(names) == ["before.json", "parameters.json", "twice.json"]

    def test_long_names_stay_apart(self) -> None:
        names = {name_of_test(f"test[{'x' * 200}{end}]") for end in "ab"}
        assert len(names) == 2
        assert all(len(name) <= 100 for name in names)


class TestChecks:
    """What is compared, in which order."""

    def test_fails(self, project: pytest.Pytester) -> None:
        cases = [
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
        ]
        write(project, self.text([case[:2] for case in cases]))
        run(project, "--bloom-update", "-k", "right").assert_outcomes(
            passed=len(cases), deselected=len(cases)
        )
        result = run(project, "-k", "changed")
        result.assert_outcomes(failed=len(cases), deselected=len(cases))
        for number, (_, _, message) in enumerate(cases):
            result.stdout.fnmatch_lines(
                [
                    f"*one-{number}: the first framebuffer that differs is image",
                    "*image: FAILED " + message,
                ]
            )

    def test_passes(self, project: pytest.Pytester) -> None:
        cases = [
            ("image + np.float16(0.01)", "atol=0.02"),
            ("image * np.float16(1.01)", "rtol=0.02"),
            ("spot", "atol=0.1, fail_percent=1, hard_fail=0.6"),
            ("image + np.float16(0.01)", "atol=0.02, ssim=0.9, flip=0.2"),
            ("np.flip(image, 0)", "atol=float('inf')"),
            # Equal images need no figure: this is too small for SSIM's window.
            ("image", "ssim=1.0, flip=0.0"),
        ]
        write(project, self.text(cases))
        run(project, "--bloom-update", "-k", "right").assert_outcomes(
            passed=len(cases), deselected=len(cases)
        )
        run(project, "-k", "changed").assert_outcomes(passed=len(cases), deselected=len(cases))

    @staticmethod
    def text(cases: list[tuple[str, str]]) -> str:
        """Return a project with two tests of each case, which are of one reference."""
        return PROJECT + "".join(
            f"""
def test_right_{number}(frame_regression):
    frame_regression.check(frames()["glow"], "one-{number}")

def test_changed_{number}(frame_regression):
    image = frames()["glow"]
    spot = image.copy()
    spot[2, 3, 1] += 0.5
    frame_regression.check({change}, "one-{number}", {arguments})
"""
            for number, (change, arguments) in enumerate(cases)
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
        result = run(project)
        result.assert_outcomes(passed=1, failed=2)
        # In any order of the tests.
        for name, adapters in (
            ("other", "Mesa 25; now: My engine"),
            ("unnamed", "arrays without an adapter; now: arrays without an adapter"),
        ):
            result.stdout.fnmatch_lines(
                [
                    f"*test_{name}: the first framebuffer that differs is bloom *",
                    f"*reference: {adapters}",
                ]
            )
        assert not (project.path / "bloom_references").exists()
