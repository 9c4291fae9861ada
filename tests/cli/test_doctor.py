"""The doctor: right about this machine, and about machines where something is missing or broken."""

from __future__ import annotations

import json
import os
import platform
import re
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.cli.calls import run
from tests.docs.pages import ROOT
from vkbloom import _doctor as doctor
from vkbloom._doctor import child, drivers, installation, probe, self_test
from vkbloom._doctor.installation import Finding

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


def examine(**changes: str) -> tuple[int, dict[str, Any], list[Finding]]:
    """Run ``vkbloom doctor --json``; return its status, its answer and its findings."""
    ended = run("doctor", "--json", env=changes)
    assert ended.stderr == ""
    answer = json.loads(ended.stdout)
    return ended.exit_code, answer, [Finding(**entry) for entry in answer["findings"]]


def manifests() -> list[Finding]:
    """Return the findings about the manifests that the loader reads."""
    return drivers.examine(child.ask("adapters", "all", environment=drivers.LOG).messages)


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
    status, answer, findings = examine()
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
    status, _, findings = examine(**PROBLEMS)
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
    ended = run("doctor", env=PROBLEMS)
    assert (ended.exit_code, ended.stderr) == (0, "")
    lines = ended.stdout.splitlines()
    chosen = next(index for index, line in enumerate(lines) if "chosen adapter" in line)
    assert lines[chosen].startswith("problem  ")
    assert lines[chosen + 1].strip() == "-> Correct or unset VKBLOOM_ADAPTER."
    assert lines[-1] == "This machine can render. Problems found: 1."


@linux_only
@pytest.mark.usefixtures("remembered", "without_variables")
def test_no_driver() -> None:
    status, answer, findings = examine(VK_DRIVER_FILES=ABSENT)
    assert (status, answer["can_render"]) == (1, False)
    assert by_topic(findings, "Vulkan loader").status == "ok"
    manifest = by_topic(findings, "driver absent.json")
    assert manifest.status == "problem"
    assert f"{ABSENT} cannot be read: No such file" in manifest.found
    assert by_topic(findings, "adapters").status == "problem"
    assert by_topic(findings, "adapters").advice == "Solve the problems above first."
    assert f"VK_DRIVER_FILES={ABSENT}" in by_topic(findings, "environment").found
    assert "test render" not in {finding.topic for finding in findings}
    ended = run("doctor", env={"VK_DRIVER_FILES": ABSENT})
    assert (ended.exit_code, ended.stderr) == (1, "")
    assert ended.stdout.endswith("\nThis machine cannot render. Problems found: 2.\n")


@pytest.fixture
def without_loader(tmp_path: Path) -> dict[str, str]:
    """Return an environment in which the loader does not open, because a damaged file comes
    first."""
    for name in ("libvulkan.so.1", "libvulkan.so"):
        (tmp_path / name).touch()
    return {"LD_LIBRARY_PATH": str(tmp_path)}


@linux_only
def test_no_loader(without_loader: dict[str, str]) -> None:
    status, answer, findings = examine(**without_loader)
    assert (status, answer["can_render"]) == (1, False)
    loader = by_topic(findings, "Vulkan loader")
    assert loader.status == "problem"
    assert loader.found.startswith("not found: ")
    assert "apt install libvulkan1" in loader.advice
    assert "loader (libvulkan.so.1) is missing" in by_topic(findings, "adapters").found


def test_no_process_answers() -> None:
    """Every process fails, here as Python does not start: the doctor still reports."""
    status, answer, findings = examine(PYTHONHOME="/nowhere")
    assert (status, answer["can_render"]) == (1, False)
    found = by_topic(findings, "Vulkan loader").found
    assert found == "not found: the probe process ended without an answer, with exit status 1"
    assert "No module named 'encodings'" in by_topic(findings, "adapters").found


@pytest.mark.usefixtures("remembered")
def test_wrong_pictures_are_no_rendering(monkeypatch: pytest.MonkeyPatch) -> None:
    ask = child.ask

    def tamper(*question: str, **options: Any) -> child.Answer:
        answer = ask(*question, **options)
        if question[0] == "render" and answer.value is not None:
            return child.Answer({**answer.value, "differences": ["bloom differs by up to 9"]})
        return answer

    monkeypatch.setattr(child, "ask", tamper)
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
        (b"", "is damaged: JSONDecodeError: "),
        (b'{"ICD":\n{]', "line 2"),
        (b"[" * 100_000, "is damaged: RecursionError: "),
        (b"\xff\xfe\xff", "is damaged: Unicode"),
        (b"[]", "is damaged: "),
        (b'{"ICD": 1}', "is damaged: "),
        (b'{"ICD": {}}', "is damaged: KeyError: 'library_path'"),
        (b'{"ICD": {"library_path": 5}}', "is damaged: "),
        (b'{"ICD" : {"library_path": "libc.so.6"}}', "have a 'file_format_version' field"),
        (b'{"ICD": {"library_path": "TMP/none.so"}}', "{tmp}/none.so: cannot open"),
        (b'{"ICD": {"library_path": "./none.so"}}', "none.so: cannot open"),
        (b'{"ICD": {"library_path": "libnone.so"}}', "libnone.so: cannot open"),
        (b'{"ICD": {"library_path": "./driver.json"}}', "driver.json: "),
        (b'{"ICD": {"library_path": "libc.so.6"}}', "libc.so.6"),
    ],
)
def test_manifest_that_does_not_work_is_a_problem(
    tmp_path: Path, content: bytes, reason: str
) -> None:
    manifest = tmp_path / "driver.json"
    # The loader wants the versions of the manifest and of Vulkan.
    content = content.replace(b'{"ICD": {', b'{"file_format_version": "1.0.1", "ICD": {')
    content = content.replace(b'{"library_path"', b'{"api_version": "1.3.0", "library_path"')
    manifest.write_bytes(content.replace(b"TMP", bytes(tmp_path)))
    finding = drivers.manifest(str(manifest))
    assert (finding.topic, finding.status) == ("driver driver.json", "problem")
    assert finding.found.startswith(str(manifest))
    assert reason.replace("{tmp}", str(tmp_path)) in finding.found


def finding_of(folder: Path, **icd: str) -> Finding:
    """Return the finding about a manifest of a driver."""
    manifest = folder / "driver.json"
    icd["api_version"] = "1.3.0"
    manifest.write_text(json.dumps({"file_format_version": "1.0.1", "ICD": icd}))
    return drivers.manifest(str(manifest))


@linux_only
def test_manifest_of_another_architecture_is_a_note(tmp_path: Path) -> None:
    bits = 32 if sys.maxsize > 2**32 else 64
    finding = finding_of(tmp_path, library_path=f"{tmp_path}/none.so", library_arch=str(bits))
    assert finding.status == "note"
    assert "of another architecture" in finding.found


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


def log_of(*lines: str, prefix: str = "") -> list[str]:
    """Return a log of the loader, of which only the part on drivers counts."""
    log = [
        "LAYER:            Searching for layer manifest files",
        "LAYER:               In following locations:",
        "LAYER:                  /layers",
        "DRIVER:           Searching for driver manifest files",
        *(f"DRIVER:               {line}" for line in lines),
        "DRIVER:           Found ICD manifest file /none.json, version 1.0.0",
    ]
    return [f"{prefix}{line}" for line in log]


@linux_only
@pytest.mark.parametrize("prefix", ["", "[Vulkan Loader] "])
def test_missing_manifests_are_a_problem(without_variables: None, prefix: str) -> None:
    lines = ("In following locations:", "/a/icd.d", "/b/icd.d", "Found no files")
    log = log_of(*lines, prefix=prefix)
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


# Processes of their own


@linux_only
@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("__builtin_trap();", "signal 4 "),
        ("*(volatile int *)0 = 1;", "signal 11 "),
        ("for (;;) usleep(1000);", "no answer within 3 s"),
        ("no_such_symbol_of_llvm();", "no_such_symbol_of_llvm"),
    ],
)
def test_a_driver_that_fails_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, body: str, reason: str
) -> None:
    """A driver crashes, hangs, or finds none of its symbols, as with another LLVM."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("a driver to be broken needs a C compiler")
    source, library = tmp_path / "driver.c", tmp_path / "driver.so"
    declared = "int usleep(unsigned); void no_such_symbol_of_llvm(void);"
    source.write_text(f"{declared} void *vk_icdGetInstanceProcAddr(void) {{ {body} return 0; }}")
    # All symbols are looked up as the library opens, as Mesa's build asks for.
    command = [compiler, "-shared", "-fPIC", "-Wl,-z,now", str(source), "-o", str(library)]
    subprocess.run(command, check=True)
    monkeypatch.setattr(child, "TIMEOUT", 3.0)
    finding = finding_of(tmp_path, library_path=str(library))
    assert finding.status == "problem"
    assert reason in finding.found


@linux_only
@pytest.mark.parametrize(
    ("executable", "failure"),
    [
        ("", "'' does not start: "),
        ("{tmp}/absent", "{tmp}/absent' does not start: No such file"),
        ("/bin/true", "ended without an answer"),
        ("/bin/false", "with exit status 1"),
    ],
)
def test_a_process_that_gives_no_answer(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, executable: str, failure: str
) -> None:
    monkeypatch.setattr(sys, "executable", executable.format(tmp=tmp_path))
    answer = child.ask("adapters", "all")
    assert answer.value is None
    assert failure.format(tmp=tmp_path) in answer.failure


def test_a_question_that_fails_is_answered() -> None:
    answer = child.ask("render", "no such adapter")
    assert answer.value is None
    # Without the advice for those who do not ask the doctor.
    assert answer.failure.startswith('no Vulkan adapter for "no such adapter"; found: ')
    assert "apt install" not in answer.failure


# The test render


@pytest.fixture(scope="module")
def frames(renderer: vkbloom.Renderer) -> vkbloom.Frames:
    return renderer.apply(probe.IMAGE, probe.SETTINGS)


def tamper(frames: vkbloom.Frames, change: Callable[[str, Any], Any]) -> list[str]:
    """Return the differences that are found in framebuffers after a change."""
    arrays = {name: change(name, array.copy()) for name, array in frames.items()}
    return probe.differences(vkbloom.Frames(arrays, timings={}, settings=frames.settings, info={}))


@pytest.mark.parametrize(
    "change", [np.fliplr, np.flipud, lambda array: np.full_like(array, np.nan, np.float32)]
)
def test_wrong_framebuffers_are_found(frames: vkbloom.Frames, change: Callable[..., Any]) -> None:
    found = tamper(frames, lambda _, array: change(array))
    assert [sentence.split()[0] for sentence in found] == [*frames]


@pytest.mark.parametrize("wrong", ["glow", "blur_vertical", "bloom", "final"])
def test_a_wrong_framebuffer_is_found(frames: vkbloom.Frames, wrong: str) -> None:
    def change(name: str, array: Any) -> Any:
        array[5, 7] = np.where(array[5, 7] > 99, 0, 199) if name == wrong else array[5, 7]
        return array

    (found,) = tamper(frames, change)
    assert found.startswith(f"{wrong} differs by up to ")


# The installation


def test_extras_are_those_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    # The others are for work on the package, or stand for several.
    declared = metadata.metadata("vkbloom").get_all("Provides-Extra", [])
    of_users = {*declared} - {"all", "test", "docs", "lint"}
    findings = {finding.topic.removeprefix("extra "): finding for finding in installation.extras()}
    assert findings.keys() == of_users
    assert all(finding.found for finding in findings.values())


@pytest.mark.parametrize(
    ("extra", "absent", "advice"),
    [
        ("images", "OpenImageIO", "pip install 'vkbloom[images]'"),
        # These two are in no registry.
        ("software", "vkbloom-lavapipe", "make wheels, then pip install dist/vkbloom_lavapipe-*"),
        ("shaders", "vkbloom-glslang", "make wheels, then pip install dist/vkbloom_glslang-*"),
    ],
)
def test_a_missing_extra_says_what_can_be_installed(
    monkeypatch: pytest.MonkeyPatch, extra: str, absent: str, advice: str
) -> None:
    present = metadata.distributions
    monkeypatch.setattr(
        metadata, "distributions", lambda name: [] if name == absent else present(name=name)
    )
    finding = by_topic(installation.extras(), f"extra {extra}")
    assert (finding.status, finding.found) == ("note", f"missing: {absent}")
    assert advice in finding.advice
    assert f"vkbloom[{extra}]" not in finding.advice or extra == "images"


def test_what_messages_name_exists() -> None:
    """Packages of Debian, extras, targets of make, files and variables in advice of all modules."""
    sources = [*(ROOT / "python").rglob("*.py"), ROOT / "setup.py"]
    # Texts are broken into lines.
    text = "\n".join(re.sub(r'" *\n *f?"', "", source.read_text()) for source in sources)
    system = (ROOT / "tools" / "setup_system.sh").read_text()
    named = set(re.findall(r"apt install ([\w-]+)", text)) | {*installation._UNPUBLISHED.values()}
    assert len(named) >= 5
    assert {package for package in named if not re.search(rf"\b{package}\b", system)} == set()
    extras = set(re.findall(r"vkbloom\[([\w,]+)\]", text))
    assert {*",".join(extras).split(",")} <= {
        *metadata.metadata("vkbloom").get_all("Provides-Extra", [])
    }
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"\bmake (wheels|demo|test)\b", text):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
    for name in installation._UNPUBLISHED:
        folder = ROOT / "packaging" / name.removeprefix("vkbloom-")
        assert f'name = "{name}"' in (folder / "pyproject.toml").read_text()
        wheel = f"dist/{name.replace('-', '_')}-*_{platform.machine()}.whl"
        assert installation.install_wheel(name).endswith(wheel)
    pages = set(re.findall(r"\bdocs/[\w/-]+\.(?:md|rst)\b", text))
    assert {page for page in pages if not (ROOT / page).exists()} == set()


@linux_only
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("/dev/null", ("note", "no Vulkan adapter that uses it")),
        # A file that nobody can open, also not a user who may open any.
        ("/dev/dri/renderD999", ("problem", "this user cannot open it")),
        (None, None),
    ],
)
def test_gpus(
    monkeypatch: pytest.MonkeyPatch, name: str | None, expected: tuple[str, str] | None
) -> None:
    nodes = [] if name is None else [Path(name)]
    monkeypatch.setattr(Path, "glob", lambda _, pattern: nodes if "render" in pattern else [])
    assert installation.gpu_nodes([{"type": "discrete"}]) == []
    found = [(one.status, one.found) for one in installation.gpu_nodes([{"type": "cpu"}])]
    assert len(found) == (expected is not None)
    for (status, text), (wanted, part) in zip(found, [expected] if expected else [], strict=True):
        assert status == wanted
        assert text.startswith(f"{name}, but no Vulkan adapter that uses it")
        assert part in text


@pytest.mark.parametrize(
    ("variable", "value", "expected"),
    [
        ("VKBLOOM_CACHE_DIR", "{tmp}/new", ("ok", "{tmp}/new")),
        ("VKBLOOM_CACHE_DIR", "", ("note", "off: the variable is empty")),
        ("VKBLOOM_CACHE_DIR", "/dev/null", ("note", "not writable")),
        ("VKBLOOM_CACHE_DIR", "/dev/null/far/below", ("note", "not writable")),
        # Permissions do not stop root, but no folder can be made here.
        ("XDG_CACHE_HOME", "/proc/self", ("note", "not writable")),
        ("MESA_SHADER_CACHE_DIR", "{tmp}", ("ok", "{tmp}")),
        ("MESA_SHADER_CACHE_DIR", "/proc/self/none", ("note", "/proc/self/none")),
        ("__GL_SHADER_DISK_CACHE_PATH", "{tmp}", ("ok", "{tmp}")),
    ],
)
def test_caches(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    variable: str,
    value: str,
    expected: tuple[str, str],
) -> None:
    """A folder that is not there is not made either."""
    if variable == "XDG_CACHE_HOME":
        monkeypatch.delenv("VKBLOOM_CACHE_DIR", raising=False)
    monkeypatch.setenv(variable, value.format(tmp=tmp_path))
    name = "VKBLOOM_CACHE_DIR" if variable == "XDG_CACHE_HOME" else variable
    finding = by_topic(installation.caches(), f"cache {name}")
    status, message = expected
    assert (finding.status, message.format(tmp=tmp_path) in finding.found) == (status, True)
    assert name in finding.advice or "not writable" not in finding.found
    assert list(tmp_path.iterdir()) == []


def test_modules_of_the_current_folder_are_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("json", "numpy", "vkbloom"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a module of the folder')")
    monkeypatch.chdir(tmp_path)
    answer = child.ask("adapters", "all")
    assert answer.failure == ""
    assert answer.value
    first = next(self_test.run("software", "no case"))
    assert "device" in first


@pytest.mark.parametrize("words", [[], ["--self-test"]])
def test_the_file_of_the_findings_is_checked_first(tmp_path: Path, words: list[str]) -> None:
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = run("doctor", *words, "--json", tmp_path / "missing" / "device.json")
    assert (done.exit_code, "there is no folder" in done.stderr) == (1, True)
    # Both examine in other processes.
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime == before
