"""Captures of RenderDoc, by its in-application API, from a process that it is loaded in."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from vkbloom import _core

__all__ = ["capture"]

_VERSION: Final = 10102  # 1.1.2 of the API: RenderDoc 1.0
# Of the pointers in RENDERDOC_API_1_1_2 (renderdoc_app.h).
_SET_TEMPLATE, _COUNT, _GET, _START, _END = 11, 13, 14, 19, 21
_HOW: Final = (
    "RenderDoc is not loaded; start the program as `renderdoccmd capture -w PROGRAM ARGUMENT...`, "
    "or with LD_PRELOAD=librenderdoc.so and ENABLE_VULKAN_RENDERDOC_CAPTURE=1"
)


class _Api:
    """The functions of RenderDoc."""

    def __init__(self) -> None:
        loaded = getattr(os, "RTLD_NOLOAD", None)
        try:
            if loaded is None:
                raise OSError
            library = ctypes.CDLL("librenderdoc.so", mode=loaded | os.RTLD_NOW)
        except OSError:
            raise _core.Error(_HOW) from None
        table = ctypes.POINTER(ctypes.c_void_p)()
        if library.RENDERDOC_GetAPI(_VERSION, ctypes.byref(table)) != 1:
            raise _core.Error("RenderDoc is older than 1.0")
        self._table = table

    def __call__(self, index: int, *arguments: object) -> int:
        address = self._table[index]
        assert address is not None
        result: int = ctypes.CFUNCTYPE(ctypes.c_uint32, *map(type, arguments))(address)(*arguments)
        return result


@contextmanager
def capture(instance: int, path: str | os.PathLike[str]) -> Iterator[None]:
    """Write what the devices of an instance do meanwhile to a file.

    Parameters
    ----------
    instance : int
        The VkInstance.
    path : str or path-like

    Raises
    ------
    Error
        As `Renderer.capture`.
    """
    call = _Api()
    target = Path(path)
    # A device is known by the dispatch table to which its instance points.
    device = ctypes.c_void_p.from_address(instance)
    call(_SET_TEMPLATE, ctypes.c_char_p(os.fsencode(target.with_suffix("").absolute())))
    call(_START, device, ctypes.c_void_p(None))
    done = False
    try:
        yield
        done = True
    finally:
        # (RenderDoc 1.24 crashes where a capture is discarded.)
        written = _ended(call, device)
        if written and not done:
            written.unlink()
    if not written:
        raise _core.Error(f"RenderDoc made no capture. {_HOW}")
    written.replace(target)


def _ended(call: _Api, device: ctypes.c_void_p) -> Path | None:
    """End the capture; return its file, or None if it failed."""
    if call(_END, device, ctypes.c_void_p(None)) != 1:
        return None
    name = ctypes.create_string_buffer(4096)
    none = ctypes.c_void_p(None)
    last = ctypes.c_uint32(call(_COUNT) - 1)
    call(_GET, last, ctypes.cast(name, ctypes.c_char_p), none, none)
    return Path(os.fsdecode(name.value))
