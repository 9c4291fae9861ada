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
