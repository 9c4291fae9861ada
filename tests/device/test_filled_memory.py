"""Results do not depend on what new memory holds (filled_memory.c)."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from tests.core.builds import ROOT, build_layer, layer_variables
from tests.processes import output
from vkbloom import AdapterInfo

pytestmark = pytest.mark.skipif(
    "VKBLOOM_SANITIZED" in os.environ, reason="another process, whose core is not sanitized"
)


def test_no_pass_reads_what_was_never_written(tmp_path: Path, software: AdapterInfo) -> None:
    """Every forward and adjoint pass, in each variant."""
    layer = build_layer(Path(__file__).with_name("filled_memory.c"), tmp_path)
    variables = layer_variables(layer, "VK_LAYER_VKBLOOM_filled_memory")
    said = output("-m", "tests.device.filled_work", software.name, cwd=ROOT, **variables)
    result = json.loads(said.splitlines()[-1])
    assert result["wrong"] == []
    assert result["count"] > 300
