"""The doctor: right about this machine, and about machines where something is missing or broken."""

from __future__ import annotations

import json
import os
import sys
import tomllib
from collections.abc import Iterable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import vkbloom
from tests.processes import python
from vkbloom import doctor
from vkbloom.cli.program import program
from vkbloom.doctor import caches, child, drivers, installation, trial
from vkbloom.doctor.finding import Finding
from vkbloom.io import pipeline_cache

linux_only = pytest.mark.skipif(sys.platform != "linux", reason="as the loader works on Linux")

# What makes the loader look elsewhere than on a machine where nothing is set.
VARIABLES = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES")
# A manifest that is not there, and an environment in which not all is well.
ABSENT = "/none/absent.json"
PROBLEMS = {"VKBLOOM_ADAPTER": "nonsense", "VKBLOOM_CACHE_DIR": "/dev/null/cache"}


def by_topic(findings: Iterable[Finding], topic: str) -> Finding:
    (found,) = (finding for finding in findings if finding.topic == topic)
    return found


def renders_of(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings of the test renders: one for each adapter."""
    return [finding for finding in findings if finding.topic == "test render"]


def examined(**changes: str) -> tuple[int, dict[str, Any], list[Finding]]:
    """Run ``vkbloom doctor --json``; return its status, its answer and its findings."""
    ended = CliRunner().invoke(program, ["doctor", "--json"], env=changes)
    assert ended.stderr == ""
    answer = json.loads(ended.stdout)
    return ended.exit_code, answer, [Finding(**entry) for entry in answer["findings"]]


def manifests() -> list[Finding]:
    """Return the findings about the manifests that the loader reads."""
    return drivers.examine(child.ask("adapters", environment=drivers.LOG).messages)


@pytest.fixture(scope="module")
def lavapipe() -> Path:
    """Return the manifest of lavapipe."""
    for finding in manifests():
        if finding.topic.startswith("driver lvp"):
            return Path(finding.found.partition(":")[0])
    pytest.skip("no manifest of lavapipe is here")


@pytest.fixture
def without_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)


# As a whole


@pytest.fixture(scope="module")
def answers() -> dict[object, child.Answer]:
    return {}


@pytest.fixture
def remembered(answers: dict[object, child.Answer], monkeypatch: pytest.MonkeyPatch) -> None:
    """A question that was asked in the same environment is not asked again."""
    ask = child.ask

    def once(*question: str, environment: Mapping[str, str] | None = None) -> child.Answer:
        variables = sorted(item for item in os.environ.items() if item[0].startswith("V"))
        key = (question, tuple(variables), tuple(sorted((environment or {}).items())))
        if key not in answers:
            answers[key] = ask(*question, environment=environment)
        return answers[key]

    monkeypatch.setattr(child, "ask", once)


@pytest.mark.usefixtures("remembered")
def test_this_machine_can_render() -> None:
    status, answer, findings = examined()
    assert status == 0
    chosen = by_topic(findings, "chosen adapter").found
    assert f"VKBLOOM_ADAPTER is {os.environ['VKBLOOM_ADAPTER']!r}" in chosen
    assert answer["can_render"] is True
    assert answer["version"] == vkbloom.__version__
    for topic in ("vkbloom", "Vulkan loader", "adapters", "chosen adapter"):
        assert by_topic(findings, topic).status == "ok"
    assert {found.status for found in renders_of(findings)} == {"ok"}
    for adapter in vkbloom.adapters():
        assert adapter.name in by_topic(findings, "adapters").found
    with vkbloom.Renderer() as renderer:
        assert chosen.startswith(renderer.info.summary)


@pytest.mark.usefixtures("remembered")
def test_finding_that_is_not_ok_has_advice_or_an_explanation() -> None:
    status, _, findings = examined(**PROBLEMS)
    assert status == 0
    chosen = by_topic(findings, "chosen adapter")
    assert chosen.status == "problem"
    assert "VKBLOOM_ADAPTER is 'nonsense'" in chosen.found
    assert {found.status for found in renders_of(findings)} == {"ok"}
    assert {finding.status for finding in findings} == {"ok", "note", "problem"}
    for finding in findings:
        assert finding.found
        assert finding.advice or finding.status != "problem"


@pytest.mark.usefixtures("remembered")
def test_the_table_has_a_line_for_each_finding() -> None:
    ended = CliRunner().invoke(program, ["doctor"], env=PROBLEMS)
    assert (ended.exit_code, ended.stderr) == (0, "")
    lines = ended.stdout.splitlines()
    chosen = next(index for index, line in enumerate(lines) if "chosen adapter" in line)
    assert lines[chosen].startswith("problem  ")
    assert lines[chosen + 1].strip() == "-> Correct or unset VKBLOOM_ADAPTER."
    assert lines[-1] == "This machine can render. Problems found: 1."


@linux_only
@pytest.mark.usefixtures("remembered", "without_variables")
def test_no_driver() -> None:
    status, answer, findings = examined(VK_DRIVER_FILES=ABSENT)
    assert (status, answer["can_render"]) == (1, False)
    assert by_topic(findings, "Vulkan loader").status == "ok"
    assert by_topic(findings, "driver absent.json").status == "problem"
    assert by_topic(findings, "adapters").status == "problem"
    assert f"VK_DRIVER_FILES={ABSENT}" in by_topic(findings, "environment").found
    assert "test render" not in {finding.topic for finding in findings}
    ended = CliRunner().invoke(program, ["doctor"], env={"VK_DRIVER_FILES": ABSENT})
    assert (ended.exit_code, ended.stderr) == (1, "")
    assert ended.stdout.endswith("\nThis machine cannot render. Problems found: 2.\n")


@linux_only
@pytest.mark.parametrize("variable", ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"])
def test_the_variable_of_a_manifest_is_named(
    without_variables: None, monkeypatch: pytest.MonkeyPatch, variable: str
) -> None:
    monkeypatch.setenv(variable, ABSENT)
    manifest = by_topic(manifests(), "driver absent.json")
    assert manifest.status == "problem"
    assert f"{ABSENT}, from {variable}, cannot be read: No such file" in manifest.found


@linux_only
def test_broken_manifests(without_variables: None, tmp_path: Path) -> None:
    damaged, missing = tmp_path / "damaged.json", tmp_path / "missing.json"
    damaged.write_text("{broken")
    missing.write_text(json.dumps({"ICD": {"library_path": str(tmp_path / "none.so")}}))
    status, _, findings = examined(VK_DRIVER_FILES=f"{damaged}:{missing}")
    assert status == 1
    assert f"{damaged} is damaged: line 1 is not JSON" in (
        by_topic(findings, "driver damaged.json").found
    )
    assert f"{tmp_path / 'none.so'}: cannot open shared object file" in (
        by_topic(findings, "driver missing.json").found
    )
    adapters = by_topic(findings, "adapters")
    assert "the loader says: " in adapters.found
    assert adapters.advice == "Solve the problems above first."


@linux_only
def test_a_broken_driver_beside_one_that_works(
    monkeypatch: pytest.MonkeyPatch, without_variables: None, tmp_path: Path, lavapipe: Path
) -> None:
    missing = tmp_path / "missing.json"
    library = {"library_path": str(tmp_path / "none.so")}
    missing.write_text(json.dumps({"file_format_version": "1.0.0", "ICD": library}))
    monkeypatch.setenv("VK_DRIVER_FILES", f"{missing}:{lavapipe}")
    listed = child.ask("adapters", environment=drivers.LOG)
    assert listed.value is not None
    assert listed.value["adapters"]
    findings = drivers.examine(listed.messages)
    assert by_topic(findings, "driver missing.json").status == "problem"
    assert by_topic(findings, f"driver {lavapipe.name}").status == "ok"


@pytest.fixture
def without_loader(tmp_path: Path) -> dict[str, str]:
    """Return an environment in which the loader does not open, because a damaged file comes
    first."""
    for name in ("libvulkan.so.1", "libvulkan.so"):
        (tmp_path / name).touch()
    return {"LD_LIBRARY_PATH": str(tmp_path)}


@linux_only
def test_the_package_works_without_a_loader(without_loader: dict[str, str]) -> None:
    program = """
import vkbloom
assert vkbloom.adapters() == ()
vkbloom.reference.gain(vkbloom.Separable())
try:
    vkbloom.Renderer()
except vkbloom.AdapterNotFoundError as error:
    print(error)
"""
    ended = python("-c", program, **without_loader)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "the Vulkan loader (libvulkan.so.1) is missing" in ended.stdout
    assert "apt install libvulkan1 mesa-vulkan-drivers" in ended.stdout


@linux_only
def test_no_loader(without_loader: dict[str, str]) -> None:
    status, answer, findings = examined(**without_loader)
    assert (status, answer["can_render"]) == (1, False)
    loader = by_topic(findings, "Vulkan loader")
    assert loader.status == "problem"
    assert loader.found.startswith("not found: ")
    assert "apt install libvulkan1" in loader.advice
    assert "loader (libvulkan.so.1) is missing" in by_topic(findings, "adapters").found


def validation() -> Finding:
    """Return the finding about the validation layer."""
    loader = child.ask("loader")
    assert loader.value is not None
    (finding,) = doctor._validation(loader.value["layers"], os.environ["VKBLOOM_ADAPTER"])
    return finding


@linux_only
def test_no_validation_layer(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("VK_LAYER_PATH", str(tmp_path))
    layer = validation()
    assert layer.status == "note"
    assert "is not installed" in layer.found
    assert "apt install vulkan-validationlayers" in layer.advice


@linux_only
def test_a_validation_layer_that_does_not_open(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    absent = tmp_path / "absent.so"
    (tmp_path / "layer.json").write_text(
        json.dumps(
            {
                "file_format_version": "1.2.0",
                "layer": {
                    "name": "VK_LAYER_KHRONOS_validation",
                    "type": "GLOBAL",
                    "library_path": str(absent),
                    "api_version": "1.3.0",
                    "implementation_version": "1",
                    "description": "none",
                },
            }
        )
    )
    monkeypatch.setenv("VK_LAYER_PATH", str(tmp_path))
    layer = validation()
    assert layer.status == "problem"
    assert "version 1.3.0 is installed, but the test render fails with it" in layer.found


def test_driver_without_adapters_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every process fails: the doctor still reports."""
    failed = child.Answer(None, "no answer within 60 s", ("driver says no",))
    monkeypatch.setattr(child, "ask", lambda *_, **__: failed)
    report = doctor.examine()
    assert not report.can_render
    assert by_topic(report.findings, "Vulkan loader").found == "not found: no answer within 60 s"
    assert "driver says no" in by_topic(report.findings, "adapters").found


@pytest.mark.usefixtures("remembered")
def test_wrong_pictures_are_no_rendering(monkeypatch: pytest.MonkeyPatch) -> None:
    ask = child.ask

    def tampered(*question: str, **options: Any) -> child.Answer:
        answer = ask(*question, **options)
        if question[0] == "render" and answer.value is not None:
            return child.Answer({**answer.value, "differences": ["bloom differs by up to 9"]})
        return answer

    monkeypatch.setattr(child, "ask", tampered)
    report = doctor.examine()
    assert not report.can_render
    assert renders_of(report.findings)
    for render in renders_of(report.findings):
        assert (render.status, "bloom differs by up to 9" in render.found) == ("problem", True)


# Manifests


@linux_only
@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "line 1 is not JSON"),
        (b'{"ICD":\n{]', "line 2 is not JSON"),
        (b"[" * 100_000, "nested too deeply"),
        (b"\xff\xfe\xff", "it is not text"),
        (b"[]", 'it has no object "ICD"'),
        (b'{"ICD": 1}', 'it has no object "ICD"'),
        (b'{"ICD": {}}', 'its "ICD" has no "library_path"'),
        (b'{"ICD": {"library_path": 5}}', 'its "ICD" has no "library_path"'),
        (b'{"ICD": {"library_path": "a\\u0000b"}}', 'its "ICD" has no "library_path"'),
        (b'{"ICD": {"library_path": "TMP/none.so"}}', "{tmp}/none.so: cannot open"),
        (b'{"ICD": {"library_path": "./none.so"}}', "{tmp}/none.so: cannot open"),
        (b'{"ICD": {"library_path": "libnone.so"}}', "libnone.so: cannot open"),
        (b'{"ICD": {"library_path": "./driver.json"}}', "{tmp}/driver.json: "),
        (b'{"ICD": {"library_path": "libc.so.6"}}', "undefined symbol: vk_icdGetInstanceProcAddr"),
    ],
)
def test_manifest_that_does_not_work_is_a_problem(
    tmp_path: Path, content: bytes, reason: str
) -> None:
    manifest = tmp_path / "driver.json"
    manifest.write_bytes(content.replace(b"TMP", bytes(tmp_path)))
    finding = drivers.manifest(manifest)
    assert (finding.topic, finding.status) == ("driver driver.json", "problem")
    assert finding.found.startswith(str(manifest))
    assert reason.replace("{tmp}", str(tmp_path)) in finding.found


@linux_only
def test_manifest_of_another_architecture_is_a_note(tmp_path: Path) -> None:
    manifest = tmp_path / "driver.json"
    bits = 32 if sys.maxsize > 2**32 else 64
    library = {"library_path": str(tmp_path / "none.so"), "library_arch": str(bits)}
    manifest.write_text(json.dumps({"ICD": library}))
    finding = drivers.manifest(manifest)
    assert finding.status == "note"
    assert f"for {bits}-bit programs" in finding.found


@linux_only
def test_a_folder_of_manifests(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, lavapipe: Path
) -> None:
    (tmp_path / "b.json").write_text("{")
    (tmp_path / "a.json").symlink_to(lavapipe)
    (tmp_path / "readme.txt").touch()
    monkeypatch.setenv("VK_DRIVER_FILES", str(tmp_path))
    first, *found = [(finding.topic, finding.status) for finding in manifests()]
    assert first == ("drivers", "note")
    # In the loader's order, which is that of the file system.
    assert sorted(found) == [("driver a.json", "ok"), ("driver b.json", "problem")]


@linux_only
def test_the_search_follows_the_loaders_order(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, without_variables: None
) -> None:
    names = ("XDG_CONFIG_HOME", "XDG_CONFIG_DIRS", "XDG_DATA_HOME", "XDG_DATA_DIRS")
    for name in reversed(names):
        folder = tmp_path / name / "vulkan/icd.d"
        folder.mkdir(parents=True)
        (folder / f"{name}.json").write_text("{")
        monkeypatch.setenv(name, str(tmp_path / name))
    added = tmp_path / "added.json"
    added.write_text("{")
    monkeypatch.setenv("VK_ADD_DRIVER_FILES", str(added))
    topics = [finding.topic for finding in manifests()]
    ours = [topic for topic in topics if topic.startswith(("driver XDG", "driver added"))]
    assert ours == ["driver added.json", *(f"driver {name}.json" for name in names)]

    monkeypatch.setenv("VK_DRIVER_FILES", str(tmp_path / "absent.json"))
    assert [finding.topic for finding in manifests()] == ["drivers", "driver absent.json"]


def log_of(*lines: str) -> list[str]:
    """Return a log of the loader, of which only the part on drivers counts."""
    return [
        "LAYER:            Searching for layer manifest files",
        "LAYER:               In following locations:",
        "LAYER:                  /layers",
        "DRIVER:           Searching for driver manifest files",
        *(f"DRIVER:               {line}" for line in lines),
        "DRIVER:           Found ICD manifest file /none.json, version 1.0.0",
    ]


@linux_only
def test_missing_manifests_are_a_problem(without_variables: None) -> None:
    log = log_of("In following locations:", "/a/icd.d", "/b/icd.d", "Found no files")
    (finding,) = drivers.examine(log)
    assert finding.status == "problem"
    assert finding.found.endswith("was found in /a/icd.d, /b/icd.d")
    assert "apt install mesa-vulkan-drivers" in finding.advice


@linux_only
def test_log_without_a_search_is_a_note(without_variables: None) -> None:
    assert [finding.status for finding in drivers.examine([])] == ["note"]


@linux_only
def test_empty_variable_hides_every_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "")
    finding = by_topic(manifests(), "drivers")
    assert finding.status == "problem"
    assert finding.advice.startswith("Unset VK_DRIVER_FILES")


@linux_only
@pytest.mark.parametrize("known", ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"])
def test_variable_that_an_old_loader_ignores_is_a_note(
    monkeypatch: pytest.MonkeyPatch, without_variables: None, known: str
) -> None:
    monkeypatch.setenv("VK_DRIVER_FILES", "/VK_DRIVER_FILES.json")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/VK_ICD_FILENAMES.json")
    file = f"/{known}.json"
    findings = drivers.examine(
        log_of("In following locations:", file, "Found the following files:", file)
    )
    assert findings[0].found.startswith(f"{known} is set: the loader uses its 1 manifest")
    assert findings[-1].topic == f"driver {known}.json"
    advice = {finding.advice for finding in findings}
    assert ("Set VK_ICD_FILENAMES to the same value." in advice) == (known != "VK_DRIVER_FILES")


# Processes of their own


@linux_only
def test_a_driver_that_crashes_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    crash = "import os; os.kill(os.getpid(), 11)"
    monkeypatch.setattr(child, "_OPEN_DRIVER", crash)
    assert child.why_driver_does_not_open("any.so") == (
        "the probe process was ended by signal 11 (SIGSEGV)"
    )


def test_a_driver_that_never_returns_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child, "_OPEN_DRIVER", "import time; time.sleep(60)")
    monkeypatch.setattr(child, "TIMEOUT", 0.25)
    assert child.why_driver_does_not_open("any.so") == "no answer within 0.25 s"


@linux_only
@pytest.mark.parametrize(
    ("executable", "failure"),
    [
        ("", "sys.executable is empty"),
        ("{tmp}/absent", "{tmp}/absent does not start: No such file"),
        ("/bin/true", "ended without an answer"),
        ("/bin/false", "exit 1"),
    ],
)
def test_a_process_that_gives_no_answer(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, executable: str, failure: str
) -> None:
    monkeypatch.setattr(sys, "executable", executable.format(tmp=tmp_path))
    answer = child.ask("loader")
    assert answer.value is None
    assert failure.format(tmp=tmp_path) in answer.failure


def test_a_question_that_fails_is_answered() -> None:
    answer = child.ask("render", "no such adapter", "plain")
    assert answer.value is None
    # Without the advice for those who do not ask the doctor.
    assert answer.failure.startswith('no Vulkan adapter for "no such adapter"; found: ')
    assert "apt install" not in answer.failure


# The test render


@pytest.fixture(scope="module")
def frames(renderer: vkbloom.Renderer) -> vkbloom.Frames:
    return trial.render(renderer)


def test_a_right_render_has_no_differences(frames: vkbloom.Frames) -> None:
    assert trial.differences(frames) == []


@pytest.mark.parametrize("name", ["glow", "blur_vertical", "bloom", "depth", "final"])
def test_a_wrong_framebuffer_is_found(frames: vkbloom.Frames, name: str) -> None:
    arrays = {key: array.copy() for key, array in frames.items()}
    arrays[name][5, 7] = np.where(arrays[name][5, 7] > 0.5, 0, 1) * (1 if name == "depth" else 99)
    tampered = vkbloom.Frames(arrays, timings={}, settings=frames.settings, info={})
    found = trial.differences(tampered)
    assert any(sentence.startswith(f"{name} differs by up to ") for sentence in found)


def test_a_mirrored_picture_is_found(frames: vkbloom.Frames) -> None:
    arrays = {key: array[:, ::-1].copy() for key, array in frames.items()}
    tampered = vkbloom.Frames(arrays, timings={}, settings=frames.settings, info={})
    assert any(sentence.startswith("glow ") for sentence in trial.differences(tampered))


def test_an_upside_down_picture_is_found(frames: vkbloom.Frames) -> None:
    arrays = {key: array[::-1].copy() for key, array in frames.items()}
    tampered = vkbloom.Frames(arrays, timings={}, settings=frames.settings, info={})
    assert any(sentence.startswith("depth ") for sentence in trial.differences(tampered))


def test_nan_is_found(frames: vkbloom.Frames) -> None:
    arrays = {key: array.copy() for key, array in frames.items()}
    arrays["depth"][0, 0] = np.nan
    tampered = vkbloom.Frames(arrays, timings={}, settings=frames.settings, info={})
    assert [sentence.split()[0] for sentence in trial.differences(tampered)] == ["depth"]


# The installation


def test_the_cache_of_a_render_is_whole(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path))
    assert caches.pipelines([]) == Finding("pipeline cache", "ok", f"{tmp_path}; no file yet")
    with vkbloom.Renderer() as renderer:
        trial.render(renderer)
    (file,) = tmp_path.iterdir()
    uuid = file.stem.removeprefix("pipelines-")
    here = f"{file.name} ({file.stat().st_size} bytes, intact, of "
    finding = caches.pipelines([uuid])
    assert (finding.status, f"{here}an installed driver)" in finding.found) == ("ok", True)
    assert f"{here}a driver that is not installed)" in caches.pipelines([]).found


def test_a_damaged_cache_is_noted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path))
    uuid = bytes(range(16))
    pipeline_cache.write(uuid, b"pipelines")
    file = tmp_path / f"pipelines-{uuid.hex()}.bin"
    file.write_bytes(file.read_bytes()[:-1])
    (tmp_path / "pipelines-of-mine.bin").touch()
    finding = caches.pipelines([])
    assert finding.status == "note"
    assert f"{file.name} is damaged" in finding.found
    assert "pipelines-of-mine.bin is not a file of vkbloom" in finding.found


def test_a_cache_file_that_cannot_be_read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path))
    # A folder, as permissions do not stop root.
    (tmp_path / f"pipelines-{'00' * 16}.bin").mkdir()
    assert "is damaged or cannot be read" in caches.pipelines([]).found


@pytest.mark.parametrize("below", ["", "/below", "/far/below"])
def test_a_cache_folder_that_cannot_be(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, below: str
) -> None:
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", f"{file}{below}")
    finding = caches.pipelines([])
    assert finding.status == "note"
    assert "not writable" in finding.found
    assert "VKBLOOM_CACHE_DIR" in finding.advice


def test_a_cache_folder_of_the_system_that_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VKBLOOM_CACHE_DIR", raising=False)
    # Permissions do not stop root, but no folder can be made here.
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/self")
    finding = caches.pipelines([])
    assert (finding.status, "not writable" in finding.found) == ("note", True)


def test_no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", "")
    finding = caches.pipelines([])
    assert finding.found == "off: VKBLOOM_CACHE_DIR is empty"


def test_examining_the_cache_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path / "new"))
    assert caches.pipelines([]).status == "ok"
    assert list(tmp_path.iterdir()) == []


def test_the_cache_of_kernels(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", str(tmp_path))
    (empty,) = caches.kernels()
    assert (empty.status, empty.found) == ("ok", f"{tmp_path / 'kernels'}; no file yet")
    (tmp_path / "kernels").mkdir()
    (tmp_path / "kernels" / "one.bin").write_bytes(bytes(12))
    (filled,) = caches.kernels()
    assert filled.found == f"{tmp_path / 'kernels'}; 1 files, 12 bytes"
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", "")
    assert [*caches.kernels()] == []


def test_caches_of_drivers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    adapter = {"name": "llvmpipe", "driver_info": "Mesa 25.0.7 (LLVM 19)"}
    monkeypatch.delenv("MESA_SHADER_CACHE_DISABLE", raising=False)
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    (empty,) = caches.drivers([adapter])
    assert (empty.topic, empty.status) == ("Mesa's cache", "ok")
    assert "vkbloom warm" in empty.advice
    (tmp_path / "mesa_shader_cache_db").mkdir()
    (tmp_path / "mesa_shader_cache_db" / "index").write_bytes(bytes(12))
    (filled,) = caches.drivers([adapter])
    assert filled.found == f"{tmp_path}; 1 files, 12 bytes"
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", "/proc/self/none")
    (closed,) = caches.drivers([adapter])
    assert (closed.status, "not writable" in closed.found) == ("note", True)
    monkeypatch.setenv("MESA_SHADER_CACHE_DISABLE", "true")
    (off,) = caches.drivers([adapter])
    assert "off" in off.found
    assert [one.topic for one in caches.drivers([{"name": "NVIDIA H100", "driver_info": "580"}])]


def test_extras_are_those_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    # The others are for work on the package, or stand for several.
    of_users = {*project["optional-dependencies"]} - {"all", "test", "docs", "lint"}
    findings = {finding.topic.removeprefix("extra "): finding for finding in installation.extras()}
    assert findings.keys() == of_users
    # What an extra needs is that of the version that is installed, which may be an older one.
    for name in of_users & {*metadata.metadata("vkbloom").get_all("Provides-Extra", [])}:
        assert findings[name].found.partition(";")[0], "it needs something"

    version = metadata.version

    def without_openimageio(name: str) -> str:
        if name == "OpenImageIO":
            raise metadata.PackageNotFoundError(name)
        return version(name)

    monkeypatch.setattr(metadata, "version", without_openimageio)
    finding = by_topic(installation.extras(), "extra images")
    assert finding.status == "note"
    assert finding.found.startswith("missing: OpenImageIO; needed for ")
    assert "pip install vkbloom[images]" in finding.advice


@linux_only
@pytest.mark.parametrize(
    ("accessible", "has_adapter", "status", "text"),
    [
        (True, True, "ok", "an adapter that uses it"),
        (True, False, "note", "no Vulkan adapter that uses it"),
        (False, False, "problem", "cannot be opened by this user"),
        (False, True, "ok", "cannot be opened by this user"),
    ],
)
def test_gpus(
    monkeypatch: pytest.MonkeyPatch, accessible: bool, has_adapter: bool, status: str, text: str
) -> None:
    node = Path("/dev/dri/renderD128")
    monkeypatch.setattr(Path, "glob", lambda _, pattern: [node] if "render" in pattern else [])
    monkeypatch.setattr(os, "access", lambda *_: accessible)
    (finding,) = installation.gpu_nodes(has_adapter)
    assert (finding.status, str(node) in finding.found, text in finding.found) == (
        status,
        True,
        True,
    )


def test_no_gpu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "glob", lambda *_: [])
    assert installation.gpu_nodes(False) == []


@pytest.mark.parametrize(
    ("driver_info", "status"),
    [
        ("Mesa 22.3.6 (LLVM 15.0.6)", "ok"),
        ("Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)", "ok"),
        ("Mesa 22.3.60 (LLVM 15.0.6)", "note"),
        ("Mesa 24.2.8-1ubuntu1 (LLVM 19.1.1)", "note"),
        ("", "note"),
        ("git-12af", "note"),
    ],
)
def test_lavapipe_versions(driver_info: str, status: str) -> None:
    adapter = {"type": "cpu", "driver_info": driver_info, "bundled": False, "name": "Swift"}
    finding = doctor._software([adapter])
    assert finding.status == status
    assert "22.3.6 and 25.0.7" in finding.found
    assert ("is Swift, not lavapipe" in finding.found) is ("Mesa" not in driver_info)
