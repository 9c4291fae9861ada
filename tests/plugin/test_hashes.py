"""--bloom-hash: references as hashes; and what the plugin tells CI systems about its report."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import pytest

from tests.plugin.projects import PROJECT, references, run, write

TEST = (
    PROJECT
    + """
DRIVER = os.environ.get("DRIVER", "ab" * 32)

def test_frames(frame_regression):
    frame_regression.check(frames(), info={"driver_sha256": DRIVER}, atol=0.5)
"""
)


def test_equal_bits_pass_and_others_fail(
    project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(project, TEST)
    missing = run(project, "--bloom-hash")
    missing.assert_outcomes(failed=1)
    missing.stdout.fnmatch_lines(["*there is no reference of *test_frames.hashes*--bloom-update*"])
    written = run(project, "--bloom-hash", "--bloom-update")
    written.assert_outcomes(passed=1)
    written.stdout.fnmatch_lines(["written: bloom_references/test_one/test_frames.hashes"])
    assert references(project) == ["test_frames.hashes"]
    run(project, "--bloom-hash").assert_outcomes(passed=1)
    # Far within the tolerance of the test.
    monkeypatch.setenv("SHIFT", "0.001")
    changed = run(project, "--bloom-hash")
    changed.assert_outcomes(failed=1)
    changed.stdout.fnmatch_lines(["*bloom is the first framebuffer whose values are not the*"])


def test_each_driver_has_hashes_of_its_own(
    project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(project, TEST)
    run(project, "--bloom-hash", "--bloom-update").assert_outcomes(passed=1)
    monkeypatch.setenv("DRIVER", "cd" * 32)
    run(project, "--bloom-hash").assert_outcomes(failed=1)
    run(project, "--bloom-hash", "--bloom-allow-missing").assert_outcomes(passed=1)
    run(project, "--bloom-hash", "--bloom-add").assert_outcomes(passed=1)
    file = project.path / "bloom_references" / "test_one" / "test_frames.hashes"
    assert json.loads(file.read_text()).keys() == {"ab" * 32, "cd" * 32}
    monkeypatch.setenv("DRIVER", "")
    unknown = run(project, "--bloom-hash")
    unknown.stdout.fnmatch_lines(["*--bloom-hash: the driver of the frames has no hash*"])
    file.write_text("[1]")
    monkeypatch.setenv("DRIVER", "ab" * 32)
    run(project, "--bloom-hash").stdout.fnmatch_lines(["*hashes: not a list of hashes*"])


def test_junit_reports_name_the_page(
    project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(project, TEST.replace("atol=0.5", "atol=0") + "def test_other(): pass\n")
    run(project, "--bloom-update")
    monkeypatch.setenv("SHIFT", "0.1")
    run(project, "--bloom-report=out", "--junitxml=junit.xml", "-o", "junit_logging=all")
    page = project.path / "out" / "index.html"
    assert page.is_file()
    cases = {one.get("name"): one for one in ElementTree.parse("junit.xml").iter("testcase")}
    (found,) = cases["test_frames"].iter("property")
    assert (found.get("name"), found.get("value")) == ("bloom_report", str(page))
    assert f"[[ATTACHMENT|{page}]]" in str(cases["test_frames"].findtext("system-out"))
    assert not [*cases["test_other"].iter("property")]
