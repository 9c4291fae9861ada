"""Large images in bands: rows are uploaded as they are read, and results are read back by rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vkbloom import _core

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vkbloom.settings import Settings

__all__ = ["BandedImage"]


class BandedImage:
    """An image on the device, of which the host has only one band at a time.

    The device has the complete image and the complete result. The bloom is the same as for the
    image in one array.

    Parameters
    ----------
    core : Renderer of the core
    rows : ndarray, shape (N, W, 3) or (N, W, 4)
        The first rows, as for `vkbloom.Renderer.apply`.
    height : int
        Height of the image in rows.

    Raises
    ------
    ValueError, OutOfMemoryError, Error
        As `vkbloom.Renderer.upload`.
    """

    def __init__(self, core: _core.Renderer, rows: NDArray[Any], height: int) -> None:
        self._core = core
        self._source = core.upload(_core.image_source(rows), None, False, height)
        self._filled = len(rows)

    def add(self, rows: NDArray[Any]) -> None:
        """Add the next rows, which have the same width, channels and dtype."""
        self._core.fill(self._source, _core.image_source(rows), self._filled)
        self._filled += len(rows)

    def final(self, settings: Settings, first: int, count: int) -> NDArray[Any]:
        """Return rows of the framebuffer `final`. The first call renders it."""
        plan = self._core.plan(self._source, settings, ("final",))
        ((_, (_, *rest), dtype),) = plan.outputs
        array = np.empty((count, *rest), dtype)
        self._core.run(self._source, (plan,), ((array,),), first, count).wait()
        return array
