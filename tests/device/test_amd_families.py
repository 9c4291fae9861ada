"""AMD's compiler without its hardware, on one family; `make test-devices` has all requests of seven
families, on two versions of Mesa."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.core.builds import build_layer
from tests.device.amd_families import INSTALLED, SOURCE, try_family


@pytest.mark.skipif(not INSTALLED.exists(), reason="RADV is not here (mesa-vulkan-drivers)")
@pytest.mark.skipif("VKBLOOM_SANITIZED" in os.environ, reason="another process, not sanitized")
def test_a_family_compiles_and_records(tmp_path: Path) -> None:
    """Under validation; a shader that needs all of a compute unit's shared memory is found.

    Regression: it was refused where lavapipe's threads would not have had room.
    """
    layers = build_layer(SOURCE, tmp_path)
    words = ("few", "planted", "validated", "short")
    found = try_family("navi21", INSTALLED, layers, *words, LP_NUM_THREADS="32")
    assert found["wrong"] == {"shared memory": "65536 bytes, 32768 allowed"}
    assert "RADV NAVI21" in found["adapter"]
    assert found["count"] > 60
    assert found["shaders"] > 200
    assert found["vgprs_spilled"] == 0
