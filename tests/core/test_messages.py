"""Validation messages reach the renderer whose call caused them, also with others at work."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import ROOT, compiler, volk_folder
from vkbloom import AdapterInfo


@pytest.mark.skipif("VKBLOOM_SANITIZED" in os.environ, reason="has a core of its own, unsanitized")
def test_each_device_gets_its_own(tmp_path: Path, software: AdapterInfo) -> None:
    """In the core without Python, where a test can misuse Vulkan (messages.c)."""
    program = tmp_path / "messages"
    volk = volk_folder()
    subprocess.run(
        [
            *compiler(),
            *("-std=c11", "-Wall", "-Wextra", "-Werror", "-DVK_NO_PROTOTYPES"),
            *("-Icsrc", "-I.", f"-I{volk}", *map(str, ROOT.glob("csrc/vulkan/*.c"))),
            *("tests/core/messages.c", "-o", str(program), "-lm", "-ldl", "-lpthread"),
        ],
        cwd=ROOT,
        check=True,
    )
    done = subprocess.run([str(program)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "ok\n")
