"""Captures of RenderDoc: written, and opened again with the names of passes and images."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

import vkbloom
from tests.core.builds import ROOT
from tests.processes import output
from vkbloom import Renderer

# Prints the passes of a plan, then captures them; and that an exception leaves no file.
PROGRAM = """
import sys
import vkbloom
scene = vkbloom.Scene.ufo()
with vkbloom.Renderer("software") as renderer:
    plan = renderer.plan(scene, None, (64, 36))
    with vkbloom.capture(sys.argv[1] + "/bloom.rdc", renderer=renderer):
        renderer.render(scene, size=(64, 36))
    try:
        with vkbloom.capture(sys.argv[1] + "/failed.rdc", renderer=renderer):
            raise KeyError
    except KeyError:
        pass
"""
# For Debian's Python, which has RenderDoc's module.
OPEN = """
import sys
import renderdoc
renderdoc.InitialiseReplay(renderdoc.GlobalEnvironment(), [])
file = renderdoc.OpenCaptureFile()
file.OpenFile(sys.argv[1], "", None)
result, replay = file.OpenCapture(renderdoc.ReplayOptions(), None)
names = replay.GetStructuredFile()
def show(action):
    if action.flags & renderdoc.ActionFlags.PushMarker:
        print("pass", action.GetName(names))
    for child in action.children:
        show(child)
for action in replay.GetRootActions():
    show(action)
for resource in replay.GetResources():
    print("resource", resource.name)
replay.Shutdown()
"""


def test_without_renderdoc_the_error_says_how(renderer: Renderer) -> None:
    with (
        pytest.raises(vkbloom.Error, match=r"RenderDoc is not loaded; .* LD_PRELOAD="),
        vkbloom.capture("bloom.rdc", renderer=renderer),
    ):
        pass
    with Renderer() as closed:
        pass
    with pytest.raises(ValueError, match="the renderer is closed"):
        vkbloom.capture("bloom.rdc", renderer=closed)


def test_a_capture_names_the_passes_in_their_order(tmp_path: Path) -> None:
    library = Path("/usr/lib/librenderdoc.so")
    if not library.exists():
        pytest.skip("RenderDoc is not here (Debian: librenderdoc, python3-renderdoc)")
    if "VKBLOOM_SANITIZED" in os.environ:
        pytest.skip("two libraries would have to be loaded first")
    variables = {
        "LD_PRELOAD": str(library),
        "ENABLE_VULKAN_RENDERDOC_CAPTURE": "1",
        "VKBLOOM_DRIVER": "system",
        "VKBLOOM_CACHE_DIR": "",
    }
    output("-c", PROGRAM, tmp_path, cwd=ROOT, **variables)
    assert [path.name for path in tmp_path.iterdir()] == ["bloom.rdc"]
    python = "/usr/bin/python3"
    found = [python, "-c", "import renderdoc"]
    if (
        not Path(python).exists()
        or subprocess.run(found, capture_output=True, check=False).returncode
    ):
        pytest.skip("RenderDoc's module for Python is not here (Debian: python3-renderdoc)")
    done = subprocess.run(
        [python, "-c", OPEN, tmp_path / "bloom.rdc"], capture_output=True, text=True, check=False
    )
    lines = done.stdout.splitlines()
    passes = [line.removeprefix("pass ") for line in lines if line.startswith("pass ")]
    with Renderer() as renderer:
        plan = renderer.plan(vkbloom.Scene.ufo(), None, (64, 36))
    # The sky is drawn in the scene's render pass, whose name the plan says.
    found = ["scene" if name == "skybox" else name for name in passes]
    assert found == [one.name for one in plan.passes], done.stdout + done.stderr
    resources = {line.removeprefix("resource ") for line in lines}
    assert {*plan.framebuffers, "skybox", "uniforms", "vertices", "readback"} <= resources
