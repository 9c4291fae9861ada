"""Captures of RenderDoc, by its in-application API, from a process that it is loaded in."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, Final

from vkbloom import _core
from vkbloom._argument_types import check_arguments
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.renderer import Renderer

_VERSION: Final = 10102  # 1.1.2 of the API: RenderDoc 1.0
# Of the pointers in RENDERDOC_API_1_1_2 (renderdoc_app.h).
_SET_TEMPLATE, _COUNT, _GET, _START, _END = 11, 13, 14, 19, 21
_HOW: Final = (
    "RenderDoc is not loaded; start the program as `renderdoccmd capture -w PROGRAM ARGUMENT...`, "
    "or with LD_PRELOAD=librenderdoc.so and ENABLE_VULKAN_RENDERDOC_CAPTURE=1"
)


def _functions() -> Callable[..., int]:
    """Return what calls the function of RenderDoc at an index with arguments of ctypes."""
    table = ctypes.POINTER(ctypes.c_void_p)()
    try:
        # Only Linux has the library by this name.
        library = ctypes.CDLL("librenderdoc.so", mode=getattr(os, "RTLD_NOLOAD", 0))
    except OSError:
        raise _core.Error(_HOW) from None
    if library.RENDERDOC_GetAPI(_VERSION, ctypes.byref(table)) != 1:
        raise _core.Error("RenderDoc is older than 1.0")

    def call(index: int, *arguments: Any) -> int:
        function: Any = ctypes.CFUNCTYPE(ctypes.c_uint32, *map(type, arguments))
        return int(function(table[index])(*arguments))

    return call


@public("vkbloom")
@check_arguments
def capture(
    path: str | os.PathLike[str], *, renderer: Renderer | None = None
) -> AbstractContextManager[None]:
    """Capture the work of a renderer's device inside the context as one frame of RenderDoc.

    Without a window, RenderDoc cannot detect where frames begin and end.

    Parameters
    ----------
    path : str or path-like
        The file to write, ``name.rdc``. An existing file is replaced.
    renderer : Renderer, optional
        Default: `default_renderer`.

    Returns
    -------
    context manager
        The file is written when the context ends. If it ends with an exception, no file is
        written.

    Notes
    -----
    The names of `Renderer.plan` are the labels of passes and the names of images and buffers.
    Messages of the validation layer have them, too. RenderDoc hides VK_EXT_external_memory_host, so
    results are copied through staging memory.

    Examples
    --------
    Under RenderDoc, such as ``renderdoccmd capture python program.py``:

    >>> with vkbloom.capture("bloom.rdc"):  # doctest: +SKIP
    ...     vkbloom.apply("photo.jpg")
    """
    return _capture_to((renderer or default_renderer())._core.instance, path)


@contextmanager
def _capture_to(instance: int, path: str | os.PathLike[str]) -> Iterator[None]:
    """Write what the devices of an instance do meanwhile to a file."""
    call = _functions()
    target = Path(path)
    # A device is known by the dispatch table to which its instance points.
    device, null = ctypes.c_void_p.from_address(instance), ctypes.c_void_p(None)
    call(_SET_TEMPLATE, ctypes.c_char_p(os.fsencode(target.with_suffix("").absolute())))
    call(_START, device, null)
    done = False
    try:
        yield
        done = True
    finally:
        # (RenderDoc 1.24 crashes where a capture is discarded.)
        captured = call(_END, device, null) == 1
        if captured:
            name = ctypes.create_string_buffer(4096)
            last = ctypes.c_uint32(call(_COUNT) - 1)
            call(_GET, last, ctypes.cast(name, ctypes.c_char_p), null, null)
            file = Path(os.fsdecode(name.value))
            if done:
                file.replace(target)
            else:
                file.unlink()
    if not captured:
        raise _core.Error(f"RenderDoc made no capture. {_HOW}")
