"""Copies past the caches: those of SSE2, and those of processors without it."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import ROOT, compiler

SIZE = 80


@pytest.mark.parametrize("options", [(), ("-U__SSE2__",)], ids=["native", "portable"])
def test_every_place_and_length(tmp_path: Path, options: tuple[str, ...]) -> None:
    library = tmp_path / "streams.so"
    flags = ("-std=c11", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-Icsrc", *options)
    subprocess.run(
        [*compiler(), *flags, "csrc/transfer/streams.c", "-o", str(library)], cwd=ROOT, check=True
    )
    core = ctypes.CDLL(str(library))
    core.vkb_stream.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
    source = (ctypes.c_ubyte * SIZE)(*range(1, SIZE + 1))
    place = (ctypes.c_ubyte * (SIZE + 32))()
    for start in range(17):
        for size in range(SIZE - 3):
            ctypes.memset(place, 0, len(place))
            core.vkb_stream(ctypes.addressof(place) + start, ctypes.addressof(source) + 3, size)
            core.vkb_end_streaming()
            copied = bytes(source)[3 : 3 + size]
            assert bytes(place) == bytes(start) + copied + bytes(len(place) - start - size)
