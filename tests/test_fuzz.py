"""Readers of outside data under changed files: a short run of each target, and what was found."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from vkbloom import skybox

RUN = Path(__file__).resolve().parents[1] / "tools" / "fuzz" / "run.py"
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="limits the address space of Linux")


@LINUX
@pytest.mark.skipif("VKBLOOM_SANITIZED" in os.environ, reason="a sanitizer needs the address space")
@pytest.mark.parametrize("target", ["gltf", "ktx", "faces", "equirectangular", "pipelines"])
def test_a_short_run(target: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(RUN), target, "--plain", "--seconds", "2"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr[-4000:]
    assert "nothing found" in done.stdout
    assert list(tmp_path.iterdir()) == []


# What was found


def test_a_small_file_that_promises_many_pixels(tmp_path: Path) -> None:
    # A TIFF of 16384 x 16384 pixels of four floats, 4 GiB, all of them in one strip of no bytes.
    path = tmp_path / "panorama.tif"
    entries = [
        (256, 4, 1, 16384),  # width
        (257, 4, 1, 16384),  # height
        (258, 3, 1, 32),  # bits
        (259, 3, 1, 8),  # deflate
        (262, 3, 1, 1),  # black is zero
        (273, 4, 1, 8),  # where the strip is
        (277, 3, 1, 1),  # samples a pixel
        (278, 4, 1, 16384),  # rows a strip
        (279, 4, 1, 0),  # bytes of the strip
        (339, 3, 1, 3),  # floats
    ]
    rows = b"".join(struct.pack("<HHII", *entry) for entry in entries)
    header = struct.pack("<2sHIH", b"II", 42, 8, len(entries))
    path.write_bytes(header + rows + bytes(4))
    with pytest.raises(ValueError, match=r"panorama\.tif: .*cannot hold 16384 x 16384 pixels"):
        skybox.from_equirectangular(path)
