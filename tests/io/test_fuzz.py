"""Readers of untrusted files: a short run of each fuzz target, and tests of earlier findings."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

from tests.exhaustive import EXHAUSTIVE
from tests.processes import output
from tests.scene.parts import load_sky

RUN = Path(__file__).resolve().parents[2] / "tools" / "fuzz" / "run.py"
GLSLANG = any(map(shutil.which, ("glslangValidator", "glslang")))
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="limits the address space of Linux")


@LINUX
@pytest.mark.skipif("VKBLOOM_SANITIZED" in os.environ, reason="a sanitizer needs the address space")
def test_a_short_run(tmp_path: Path) -> None:
    # In one process, since most of a short run would be imports.
    names = ["gltf", "ktx", "faces", "equirectangular", "headers", "pipelines"]
    # tests/custom tests mutations of custom methods without the compiler, which takes longest.
    names += ["custom", "described"] if EXHAUSTIVE and GLSLANG else []
    amount = ["--seconds", "2"] if EXHAUSTIVE else ["--seconds", "0.2", "--inputs", "10"]
    printed = output(RUN, *names, "--plain", *amount, cwd=tmp_path)
    assert printed.count("nothing found") == len(names)
    assert list(tmp_path.iterdir()) == []


# What was found


def test_a_small_file_that_promises_many_pixels(tmp_path: Path) -> None:
    # 8192 x 8192 pixels of three floats are 768 MiB; of more, OpenImageIO itself warns.
    path = tmp_path / "panorama.hdr"
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 8192\n")
    with pytest.raises(ValueError, match=r"panorama\.hdr: .*cannot hold 8192 x 8192 pixels"):
        load_sky(path)
