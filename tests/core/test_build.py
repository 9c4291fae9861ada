"""The build's messages: what is missing, and the package that has it."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """setup.py as a module that builds nothing, on a machine that lacks what it looks for."""
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr("setuptools.setup", lambda **_: None)
    spec = importlib.util.spec_from_file_location("vkbloom_setup", ROOT / "setup.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # Where NamedTuple's annotations look for their names.
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "include_folders", lambda: [tmp_path / "include"])
    monkeypatch.setattr(shutil, "which", lambda name: None)
    return module


@pytest.mark.parametrize(
    ("function", "arguments", "missing", "package"),
    [
        ("check_vulkan_headers", (), "vulkan/vulkan.h", "libvulkan-dev"),
        ("volk_folder", (), "volk", "libvulkan-volk-dev"),
        ("compile_shader", ("module", Path("a.spv")), "glslangValidator", "glslang-tools"),
        ("optimize", ("module", Path("a.spv"), []), "spirv-opt", "spirv-tools"),
    ],
)
def test_missing_build_tool_is_named_with_its_package(
    build: ModuleType, function: str, arguments: tuple[Any, ...], missing: str, package: str
) -> None:
    with pytest.raises(SystemExit) as caught:
        getattr(build, function)(*arguments)
    text = str(caught.value)
    assert missing in text
    assert "missing; on Debian or Ubuntu: " in text
    assert text.endswith(f"apt install {package}")


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
    build: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "SPIRV", tmp_path)
    monkeypatch.setattr(build, "volk_folder", lambda: str(tmp_path))
    one, other = sources = [str(tmp_path / name) for name in ("one.c", "other.c")]
    for name in (*sources, "spirv.h", "volk.h", "volk.c"):
        (tmp_path / name).touch()

    def compiled(*options: str) -> list[str]:
        compiler = Compiler()
        objects = build.compiled_once(compiler)(sources, str(tmp_path), extra_postargs=options)
        assert objects == [str(tmp_path / name) for name in ("one.o", "other.o")]
        return sorted(compiler.compiled)

    assert compiled() == [one, other]
    assert compiled() == []
    Path(other).write_text("changed")
    assert compiled() == [other]
    (tmp_path / "spirv.h").write_text("changed")
    assert compiled() == [one, other]
    assert compiled("-O0") == [one, other]
    (tmp_path / "one.o").unlink()
    assert compiled("-O0") == [one]
