"""Adapters: the list, the selection, and the errors if none fits."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import vkbloom
from tests.conftest import ADAPTER
from tests.core.builds import compiler
from tests.planned import bundled_driver
from tests.processes import output, python
from vkbloom import AdapterInfo, AdapterNotFoundError, Renderer, _core, adapters

VK_ERROR_INCOMPATIBLE_DRIVER = -9

TYPES = {"cpu", "integrated", "discrete", "virtual", "other"}

# Prints the adapters of a process in another environment.
PROGRAM = """
import json, vkbloom
result = {"adapters": [adapter.name for adapter in vkbloom.adapters()]}
try:
    with vkbloom.Renderer() as renderer:
        result["type"] = renderer.info.type
except vkbloom.AdapterNotFoundError as error:
    result.update(error=str(error), call=error.vk_call, result=error.vk_result)
print(json.dumps(result))
"""


def run(**environment: str) -> Any:
    """Run PROGRAM with these environment variables, and return what it printed."""
    return json.loads(output("-c", PROGRAM, **environment))


def test_the_list() -> None:
    found = adapters()
    assert isinstance(found, tuple)
    for adapter in found:
        assert adapter.name
        assert adapter.type in TYPES
        assert int(adapter.api_version.split(".")[0]) >= 1
        for part in (adapter.name, adapter.type, adapter.driver_info, adapter.api_version):
            assert part in adapter.summary
        assert "\n" not in adapter.summary
    assert found == adapters()


def test_info_and_repr() -> None:
    with Renderer(ADAPTER) as renderer:
        info = renderer.info
        assert info in adapters()
        assert repr(renderer) == f"<vkbloom.Renderer on {info.summary}>"
        assert not renderer.closed
    assert renderer.closed
    assert repr(renderer) == f"<vkbloom.Renderer on {info.summary}, closed>"
    assert renderer.info == info


@pytest.mark.parametrize("change", [str, str.upper, str.lower, lambda name: name[2:7]])
def test_a_part_of_a_name_in_any_case(change: Any) -> None:
    name = adapters()[-1].name
    with Renderer(change(name)) as renderer:
        assert renderer.info.name == name


def test_auto_prefers_hardware() -> None:
    order = ["discrete", "integrated", "virtual", "cpu", "other"]
    best = min((adapter.type for adapter in adapters()), key=order.index)
    with Renderer() as renderer:
        assert renderer.info.type == best


def test_hardware_is_not_software() -> None:
    if any(adapter.type != "cpu" for adapter in adapters()):
        with Renderer("hardware") as renderer:
            assert renderer.info.type != "cpu"
    else:
        with pytest.raises(AdapterNotFoundError, match="hardware"):
            Renderer("hardware")


def test_an_unknown_adapter_lists_what_was_found() -> None:
    with pytest.raises(AdapterNotFoundError) as caught:
        Renderer("no such adapter")
    message = str(caught.value)
    assert '"no such adapter"' in message
    for adapter in adapters():
        assert adapter.name in message
    assert "apt install" in message
    assert caught.value.vk_call is None
    assert caught.value.vk_result is None
    assert isinstance(caught.value, RuntimeError)
    assert isinstance(caught.value, vkbloom.Error)


@pytest.mark.parametrize("start", ["", "x"])
def test_a_message_is_cut_between_or_in_characters(
    monkeypatch: pytest.MonkeyPatch, start: str
) -> None:
    name = start + "\xe9" * 2000
    with pytest.raises(AdapterNotFoundError, match=r"no Vulkan adapter for .*\xe9\xe9"):
        Renderer(name)
    monkeypatch.setenv("VKBLOOM_VARIANT", name)
    with pytest.raises(ValueError, match=r"VKBLOOM_VARIANT: .*\xe9\xe9") as caught:
        Renderer(ADAPTER)
    assert type(caught.value) is ValueError


def test_the_environment_replaces_auto(
    monkeypatch: pytest.MonkeyPatch, software: AdapterInfo
) -> None:
    monkeypatch.setenv("VKBLOOM_ADAPTER", "no such adapter")
    for arguments in ([], ["auto"]):
        with pytest.raises(AdapterNotFoundError, match="no such adapter"):
            Renderer(*arguments)
    # And nothing else.
    with Renderer("software") as renderer:
        assert renderer.info.type == "cpu"
    monkeypatch.setenv("VKBLOOM_ADAPTER", "")
    with Renderer() as renderer:
        assert renderer.info in adapters()


def test_no_driver_at_all(tmp_path: Path) -> None:
    nothing = str(tmp_path / "nothing.json")
    result = run(VK_ICD_FILENAMES=nothing, VK_DRIVER_FILES=nothing)
    assert result["adapters"] == []
    assert result["call"] == "vkCreateInstance"
    assert result["result"] == VK_ERROR_INCOMPATIBLE_DRIVER
    assert "apt install" in result["error"]
    assert "mesa-vulkan-drivers" in result["error"]


def test_a_damaged_manifest_beside_a_good_one(tmp_path: Path) -> None:
    """Debian 12's loader reports that there is no memory; other loaders ignore the damaged
    manifest."""
    damaged = tmp_path / "damaged.json"
    damaged.write_text("{ no JSON")
    icds = [str(damaged), *map(str, Path("/usr/share/vulkan/icd.d").glob("lvp_icd*.json"))]
    files = os.pathsep.join(icds)
    done = python("-c", PROGRAM, VK_ICD_FILENAMES=files, VK_DRIVER_FILES=files)
    if done.returncode == 0:
        assert json.loads(done.stdout)["type"] == "cpu"
        return
    last = done.stderr.splitlines()[-1]
    assert last.startswith("vkbloom.OutOfMemoryError: vkCreateInstance failed with VK_ERROR_OUT_OF")
    assert "manifest" in last
    assert "`vkbloom doctor`" in last


@pytest.mark.skipif(sys.platform != "linux", reason="hides the loader as Linux finds it")
def test_no_loader(tmp_path: Path) -> None:
    # A file that is not a library ends the loader's search for this name.
    for name in ("libvulkan.so.1", "libvulkan.so"):
        (tmp_path / name).write_text("no library")
    result = run(LD_LIBRARY_PATH=str(tmp_path))
    assert result["adapters"] == []
    assert result["call"] is None
    assert "libvulkan.so.1" in result["error"]
    assert "apt install libvulkan1" in result["error"]


def test_validation_without_its_layer(tmp_path: Path) -> None:
    program = """
import vkbloom
try:
    vkbloom.Renderer("software", validation=True)
except vkbloom.Error as error:
    print(type(error).__name__, error)
"""
    environment = {
        name: str(tmp_path)
        for name in ("VK_LAYER_PATH", "XDG_DATA_DIRS", "XDG_DATA_HOME", "XDG_CONFIG_DIRS")
    }
    icds = [str(path) for path in Path("/usr/share/vulkan/icd.d").glob("lvp_icd*.json")]
    printed = output("-c", program, VK_DRIVER_FILES=":".join(icds), **environment)
    assert printed.startswith("Error ")
    assert "VK_LAYER_KHRONOS_validation is not installed" in printed
    assert "apt install" in printed


#: A library that is loaded until a file is there, or for five seconds.
SLOW = """
#include <stdlib.h>
#include <unistd.h>
__attribute__((constructor)) static void load(void)
{
    rmdir(getenv("VKBLOOM_TEST_SLOW"));
    for (int turns = 0; turns < 5000 && access(getenv("VKBLOOM_TEST_SLOW"), F_OK); ++turns)
        usleep(1000);
}
"""


def test_others_go_on_while_a_driver_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library, there = tmp_path / "slow.so", tmp_path / "there"
    command = [*compiler(), "-shared", "-fPIC", "-x", "c", "-", "-o", str(library)]
    subprocess.run(command, input=SLOW, text=True, check=True)
    monkeypatch.setenv("VKBLOOM_TEST_SLOW", str(there))
    there.mkdir()
    known = _core.adapters(bundled_driver())

    def open_driver() -> None:
        with pytest.raises(AdapterNotFoundError, match="is no Vulkan driver"):
            _core.adapters(str(library))

    with ThreadPoolExecutor(1) as pool:
        opened = pool.submit(open_driver)
        while there.exists():
            time.sleep(0.001)
        assert _core.adapters(bundled_driver()) == known
        assert not opened.done()
        there.mkdir()
        opened.result()
