"""The build: what it compiles again, and its messages about what is missing or fails."""

from __future__ import annotations

import importlib.util
import json
import os
import struct
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.core.builds import ROOT


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """setup.py as a module that builds nothing, in an empty folder and without any tool."""
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr("setuptools.setup", lambda **_: None)
    spec = importlib.util.spec_from_file_location("vkbloom_setup", ROOT / "setup.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # Where NamedTuple's annotations look for their names.
    monkeypatch.setitem(sys.modules, spec.name, module)
    is_file = Path.is_file
    with monkeypatch.context() as patch:
        # `setup.py sdist` needs no volk: it is looked for by a build alone.
        patch.setattr(Path, "is_file", lambda self: self.stem != "volk" and is_file(self))
        spec.loader.exec_module(module)
    monkeypatch.setattr(module, "include_folders", lambda: [tmp_path / "include"])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    for variable in ("DEB_BUILD_OPTIONS", "NIX_BUILD_CORES"):
        monkeypatch.delenv(variable, raising=False)
    return module


def script(file: Path, text: str) -> Path:
    file.write_text(f"#!/bin/sh\n{text}\n")
    file.chmod(0o755)
    return file


@pytest.mark.parametrize(
    ("function", "missing", "package"),
    [
        ("check_vulkan_headers", "vulkan/vulkan.h", "libvulkan-dev"),
        ("volk_folder", "volk", "libvulkan-volk-dev"),
        ("compiler", "glslangValidator", "glslang-tools"),
        ("optimizer", "spirv-opt", "spirv-tools"),
    ],
)
def test_missing_build_tool_is_named_with_its_package(
    build: ModuleType, function: str, missing: str, package: str
) -> None:
    with pytest.raises(SystemExit) as caught:
        getattr(build, function)()
    text = str(caught.value)
    assert missing in text
    assert "missing; on Debian or Ubuntu: " in text
    assert text.endswith(f"apt install {package}")


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("kill -SEGV $$", "is ended by SIGSEGV (Segmentation fault):\nsaid"),
        ("/bin/sh -c 'kill -ABRT $$'", "is ended by SIGABRT (Aborted):\nsaid"),
        ("exit 3", "fails with status 3:\nsaid"),
    ],
    ids=["signal", "signal-below-a-shell", "status"],
)
def test_how_a_tool_fails(build: ModuleType, tmp_path: Path, command: str, reason: str) -> None:
    tool = script(tmp_path / "spirv-opt", f"echo said >&2\n{command}")
    with pytest.raises(SystemExit) as caught:
        build.run_tool(Path("bloom.comp"), str(tool))
    assert str(caught.value).startswith(f"bloom.comp: {tool} {reason}")


@pytest.mark.parametrize(
    ("asked", "environment", "expected"),
    [
        (None, {"DEB_BUILD_OPTIONS": "nocheck parallel=3"}, 3),
        (None, {"DEB_BUILD_OPTIONS": "nocheck", "NIX_BUILD_CORES": "5"}, 5),
        (2, {"DEB_BUILD_OPTIONS": "parallel=3", "NIX_BUILD_CORES": "5"}, 2),
        (None, {"NIX_BUILD_CORES": "0"}, len(os.sched_getaffinity(0))),
        (None, {}, len(os.sched_getaffinity(0))),
    ],
)
def test_processes_of_a_build(
    build: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    asked: int | None,
    environment: dict[str, str],
    expected: int,
) -> None:
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert build.processes(asked) == expected


@pytest.fixture
def table(build: ModuleType) -> Path:
    """The table of the modules of two shaders."""
    shaders = Path("shaders")
    shaders.mkdir()
    for name in ("a.frag", "b.comp", "c.glsl"):
        (shaders / name).touch()
    return shaders / "modules.txt"


def test_modules_are_those_of_the_table(build: ModuleType, table: Path) -> None:
    table.write_text(
        "# a comment\n\na.frag frag dispatch_layers\nb.comp loops final_packed_FORMAT\n"
    )
    linear = ("-DFINAL", "-DLINEAR_TEXELS")
    assert {one.name: one.options for one in build.all_modules()} == {
        "a_frag": (),
        "a_dispatch_layers": ("-DDISPATCH", "-DLAYERS"),
        "b_final_packed_rgba8unorm": (*linear, "-DCHANNEL_BYTES=1", "-DTARGET_CHANNELS=3"),
        "b_final_packed_rgba16float": (*linear, "-DCHANNEL_BYTES=2", "-DTARGET_CHANNELS=3"),
        "b_final_packed_rgba32float": (*linear, "-DCHANNEL_BYTES=4", "-DTARGET_CHANNELS=3"),
    }
    assert {one.shader.name for one in build.all_modules() if one.keeps_loops} == {"b.comp"}


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("a.frag frag\n", "b.comp has no row"),
        ("a.frag frag\nb.comp comp\nd.comp comp\n", "d.comp is no file, and has a row"),
        ("a.frag frag\nb.comp x_comp\n", "b.comp: the module x_comp has an unknown word, 'x'"),
    ],
)
def test_wrong_tables_of_modules(build: ModuleType, table: Path, rows: str, message: str) -> None:
    table.write_text(rows)
    with pytest.raises(SystemExit) as caught:
        build.all_modules()
    assert str(caught.value) == f"{table}: {table.parent}/{message}"


def test_modules_are_compiled_only_from_changed_sources_and_by_one_version(
    build: ModuleType, tmp_path: Path
) -> None:
    shipped, kept = Path("spirv"), Path("build/spirv")
    source = Path("shaders/a.comp")
    for file in (source, Path("setup.py"), Path("python/vkbloom/_custom/spirv.py")):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("one")
    built = [build.Module(name, source) for name in ("one", "two")]
    version, module, calls = (tmp_path / name for name in ("version", "module", "calls"))
    version.write_text("tool 1\n")
    # The least SPIR-V: its magic number, version 1.3, and no instruction.
    module.write_bytes(struct.pack("=5I", 0x07230203, 0x00010300, 0, 1, 0))
    asked = f'[ "$1" = --version ] && exec /bin/cat {version}'
    tools = {
        "glslangValidator": f'for target; do :; done\nexec /bin/cp {module} "$target"',
        "spirv-opt": f'echo "$*" >> {calls}',
    }

    def install() -> None:
        for name, text in tools.items():
            script(tmp_path / "bin" / name, f"{asked}\n{text}")

    def uninstall() -> None:
        for name in tools:
            (tmp_path / "bin" / name).unlink()

    def compile_from(folder: Path) -> list[str]:
        """Return the modules that spirv-opt got."""
        calls.write_text("")
        assert build.compile_modules(built, 1) == folder
        return sorted({Path(line.split()[-1]).stem for line in calls.read_text().splitlines()})

    # Nothing is there, and no tool to make it.
    with pytest.raises(SystemExit, match="glslangValidator is missing"):
        build.compile_modules(built, 1)
    install()
    assert compile_from(kept) == ["one", "two"]
    assert json.loads((kept / "made.json").read_text())["spirv-opt"] == "tool 1"
    assert compile_from(kept) == []
    # A build that was stopped goes on, unless a tool has changed meanwhile.
    (kept / "two.spv").unlink()
    assert compile_from(kept) == ["two"]
    (kept / "two.spv").unlink()
    version.write_text("tool 2\n")
    assert compile_from(kept) == ["one", "two"]
    # A changed source that gives the same module, as a comment does, is compiled by glslang alone.
    (kept / "made.json").write_text("{}")
    assert compile_from(kept) == []
    # Modules of a source distribution are taken without tools, until a source is changed.
    kept.rename(shipped)
    uninstall()
    assert compile_from(shipped) == []
    # (Of the same size.)
    source.write_text("two")
    module.write_bytes(struct.pack("=5I", 0x07230203, 0x00010300, 0, 2, 0))
    with pytest.raises(SystemExit, match="glslangValidator is missing"):
        build.compile_modules(built, 1)
    install()
    assert compile_from(kept) == ["one", "two"]


def test_headers_that_are_there(build: ModuleType, tmp_path: Path) -> None:
    for name in ("vulkan/vulkan.h", "volk/volk.h", "volk/volk.c"):
        file = tmp_path / "include" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    build.check_vulkan_headers()
    assert build.volk_folder() == str(tmp_path / "include" / "volk")


class Compiler:
    """Makes empty objects, and counts them."""

    include_dirs = ()

    def __init__(self) -> None:
        self.compiled: list[str] = []

    def object_filenames(self, sources: list[str], output_dir: str) -> list[str]:
        return [f"{output_dir}/{Path(source).stem}.o" for source in sources]

    def compile(self, sources: list[str], output_dir: str, **_: Any) -> None:
        self.compiled += sources
        for made in self.object_filenames(sources, output_dir):
            Path(made).touch()


def test_a_source_is_compiled_again_only_if_it_a_header_or_an_option_has_changed(
    build: ModuleType, tmp_path: Path
) -> None:
    one, other = sources = [str(tmp_path / name) for name in ("one.c", "other.c")]
    header = Path("build/spirv/spirv.h")
    volk = (f"include/volk/volk.{kind}" for kind in "ch")
    for name in (*sources, str(header), "shaders/params.h", *volk):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).touch()

    def compile_all(*options: str) -> list[str]:
        compiler = Compiler()
        objects = build.compiled_once(compiler, 1)(sources, str(tmp_path), extra_postargs=options)
        assert objects == [str(tmp_path / name) for name in ("one.o", "other.o")]
        return sorted(compiler.compiled)

    assert compile_all() == [one, other]
    assert compile_all() == []
    Path(other).write_text("changed")
    assert compile_all() == [other]
    header.write_text("changed")
    assert compile_all() == [one, other]
    assert compile_all("-O0") == [one, other]
    (tmp_path / "one.o").unlink()
    assert compile_all("-O0") == [one]
