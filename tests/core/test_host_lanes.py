"""Transforms on the host have the same bits for vectors of any length."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tests.core.builds import ROOT, compiler, volk_folder

SOURCES = ("passes/host_fft.c", "passes/host_lanes_4.c", "passes/host_lanes_8.c")
OTHERS = ("vulkan/parts.c", "vulkan/error.c")


def test_vectors_of_four_and_of_eight_floats_give_the_same_bits(tmp_path: Path) -> None:
    folders = (ROOT, ROOT / "csrc", ROOT / "build" / "spirv", Path(volk_folder()))
    program = tmp_path / "host_lanes"
    options = ("-std=c11", "-O1", "-DVK_NO_PROTOTYPES")
    included = [f"-I{folder}" for folder in folders]
    sources = [Path(__file__).with_name("host_lanes.c")]
    sources += [ROOT / "csrc" / name for name in (*SOURCES, *OTHERS)]
    libraries = ("-lm", "-lpthread", "-o", program)
    subprocess.run([*compiler(), *options, *included, *sources, *libraries], check=True)
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    assert done.stdout == "same\n"
