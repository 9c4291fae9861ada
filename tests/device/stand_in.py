"""Builds the stand-in for libcuda, for this process or for others."""

from __future__ import annotations

import ctypes
import os
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import compiler
from vkbloom import AdapterInfo

SOURCE = Path(__file__).with_name("cuda_stand_in.c")


def build(folder: Path, *more: str) -> Path:
    """Build the library with more options; return its folder."""
    if os.name == "nt":
        pytest.skip("memory is exported as descriptors of files")
    options = ["-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    options += ["-fvisibility=hidden", "-Wl,-soname,libcuda.so.1"]
    subprocess.run(
        [*compiler(), *options, *more, SOURCE, "-o", folder / "libcuda.so.1"], check=True
    )
    return folder


def load(folder: Path, adapter: AdapterInfo) -> None:
    """Build it into this process, which must not have opened CUDA yet."""
    os.environ["STAND_IN_UUID"] = adapter.uuid
    ctypes.CDLL(str(build(folder) / "libcuda.so.1"))


def variables(folder: Path, adapter: AdapterInfo) -> dict[str, str]:
    """Return the environment in which the adapter is a GPU of the stand-in."""
    paths = (str(folder), os.environ.get("LD_LIBRARY_PATH", ""))
    return {
        "LD_LIBRARY_PATH": os.pathsep.join(filter(None, paths)),
        "STAND_IN_UUID": adapter.uuid,
        "STAND_IN_LOG": str(folder / "left"),
    }
