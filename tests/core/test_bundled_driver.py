"""A driver that is entered without the Vulkan loader: the system's lavapipe serves as one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vkbloom import AdapterNotFoundError, Error, Pyramid, Renderer, adapters

MANIFESTS = ("/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d")


def library() -> str:
    """Find the library of the system's lavapipe by its manifest."""
    for folder in MANIFESTS:
        for manifest in sorted(Path(folder).glob("lvp_icd*.json")):
            named: str = json.loads(manifest.read_text())["ICD"]["library_path"]
            if Path(named).is_file():
                return named
    pytest.skip("the system's lavapipe, by its absolute path, is not here")


@pytest.fixture
def driver(monkeypatch: pytest.MonkeyPatch) -> str:
    path = library()
    monkeypatch.setenv("VKBLOOM_DRIVER", path)
    return path


def test_it_is_listed_after_the_systems(driver: str) -> None:
    found = adapters()
    assert [adapter.bundled for adapter in found] == sorted(adapter.bundled for adapter in found)
    assert [adapter.type for adapter in found if adapter.bundled] == ["cpu"]
    assert "bundled" in found[-1].summary


@pytest.mark.parametrize("choice", ["software", "llvmpipe"])
def test_it_is_taken_before_the_systems_software(driver: str, choice: str) -> None:
    with Renderer(choice) as renderer:
        assert renderer.info.bundled
        assert renderer.info in adapters()


def test_it_draws_what_it_draws_through_the_loader(
    driver: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    image = np.random.default_rng(0).random((37, 53, 4), dtype=np.float32)
    with Renderer("software") as direct:
        monkeypatch.setenv("VKBLOOM_DRIVER", "system")
        with Renderer("software") as loaded:
            # Two instances of two kinds, at work at the same time.
            assert direct.info.bundled
            assert not loaded.info.bundled
            for name, array in loaded.apply(image, Pyramid()).items():
                np.testing.assert_array_equal(direct.apply(image, Pyramid())[name], array)


def test_frames_record_the_hash_of_the_packages_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    package = SimpleNamespace(LIBRARY=library(), SHA256="ab" * 32)
    monkeypatch.setitem(sys.modules, "vkbloom_lavapipe", package)
    image = np.zeros((8, 8, 4), np.float32)
    # Another library's hash is not known, nor are the libraries that the system's driver loads.
    for chosen, expected in ((None, package.SHA256), (package.LIBRARY, None), ("system", None)):
        if chosen is None:
            monkeypatch.delenv("VKBLOOM_DRIVER", raising=False)
        else:
            monkeypatch.setenv("VKBLOOM_DRIVER", chosen)
        with Renderer("software") as renderer:
            assert renderer.info.bundled == (chosen != "system")
            assert renderer.apply(image).info.get("driver_sha256") == expected


def test_system_leaves_it_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VKBLOOM_DRIVER", "system")
    found = adapters()
    if not found:
        pytest.skip("the system has no driver")
    assert not any(adapter.bundled for adapter in found)


def test_a_manifest_names_its_library(
    driver: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "libvulkan_lvp.so").symlink_to(driver)
    manifest = tmp_path / "driver.json"
    monkeypatch.setenv("VKBLOOM_DRIVER", os.fspath(manifest))
    for named in (driver, "./libvulkan_lvp.so"):
        manifest.write_text(json.dumps({"ICD": {"library_path": named}}))
        with Renderer("software") as renderer:
            assert renderer.info.bundled
    for damaged in ("{", "[]", '{"ICD": {}}'):
        manifest.write_text(damaged)
        with pytest.raises(ValueError, match=r"VKBLOOM_DRIVER: .*driver\.json"):
            Renderer("software")


def test_file_that_is_not_a_driver_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("VKBLOOM_DRIVER", str(tmp_path / "absent.so"))
    with pytest.raises(AdapterNotFoundError, match=r"absent\.so does not open"):
        Renderer("software")
    monkeypatch.setenv("VKBLOOM_DRIVER", "libm.so.6")
    with pytest.raises(AdapterNotFoundError, match=r"libm\.so\.6 is no Vulkan driver"):
        Renderer("software")
    monkeypatch.setenv("VKBLOOM_DRIVER", "x" * 5000)
    with pytest.raises(Error, match="longer than"):
        Renderer("software")


ALONE = """
import json, vkbloom
found = vkbloom.adapters()
with vkbloom.Renderer() as renderer:
    chosen = renderer.info
try:
    vkbloom.Renderer(validation=True).close()
    refusal = ""
except vkbloom.Error as error:
    refusal = str(error)
print(json.dumps([[a.bundled for a in found], chosen.bundled, refusal]))
"""


def test_no_system_driver_is_needed(driver: str, tmp_path: Path) -> None:
    """Nothing that the system's loader finds works; the bundled driver is all there is."""
    environment = {**os.environ, "VK_DRIVER_FILES": str(tmp_path / "none.json")}
    environment["VK_ICD_FILENAMES"] = environment["VK_DRIVER_FILES"]
    del environment["VKBLOOM_ADAPTER"]
    done = subprocess.run(
        [sys.executable, "-c", ALONE], env=environment, capture_output=True, text=True, check=True
    )
    bundled, chosen, refusal = json.loads(done.stdout)
    answer: Any = (bundled, chosen)
    assert answer == ([True], True)
    # A loader that opens single drivers validates it; another is named.
    assert refusal == "" or "VK_LUNARG_direct_driver_loading" in refusal
