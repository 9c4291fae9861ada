"""A second software driver, SwiftShader: another compiler, lower limits, looser functions.

`make test-devices` runs all tests with it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from tests.core.builds import ROOT
from tests.processes import output

#: As Debian's chromium-common installs it.
MANIFEST = Path("/usr/lib/chromium/vk_swiftshader_icd.json")


@pytest.mark.skipif(not MANIFEST.exists(), reason="SwiftShader is not here (chromium-common)")
@pytest.mark.skipif("VKBLOOM_SANITIZED" in os.environ, reason="another process, not sanitized")
def test_a_part_of_all_workloads() -> None:
    variables = dict.fromkeys(("VK_DRIVER_FILES", "VK_ICD_FILENAMES"), str(MANIFEST))
    said = output(
        *("-m", "tests.device.second_driver"),
        cwd=ROOT,
        VKBLOOM_DRIVER="system",
        VKBLOOM_CACHE_DIR="",
        **variables,
    )
    result = json.loads(said.splitlines()[-1])
    assert "SwiftShader" in result["adapter"]
    assert result["wrong"] == {}
