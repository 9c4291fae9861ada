"""An image that stays on a renderer's device."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn

from vkbloom._public import public

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from vkbloom import _core


@public("vkbloom")
class Image:
    """A copy of an image on a renderer's device, made by `Renderer.upload`.

    The renderer that made it accepts it in place of an image, in `apply`, `sweep`,
    `map`, `vjp`, `plan` and `grid`. Its pixels are uploaded once and are not compared with
    other images. Its memory is released when this object is collected or the renderer is closed.

    Attributes
    ----------
    shape : (int, int, int)
        (H, W, 3) or (H, W, 4), the shape of the original array.
    dtype : numpy.dtype
        uint8, float16 or float32.
    mask, emission : bool
        Whether it was uploaded with a mask or an emission, which are used in all calls.
    """

    __slots__ = ("__weakref__", "_inputs", "_source", "dtype", "emission", "mask", "shape")

    def __init__(
        self,
        source: _core.Source,
        shape: tuple[int, int, int],
        dtype: np.dtype[Any],
        inputs: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self._source = source
        self.shape = shape
        self.dtype = dtype
        self.mask = "mask" in inputs
        self.emission = "emission" in inputs
        # Mask and emission, and of an image of CUDA its copy. They do not change.
        self._inputs = inputs

    def __reduce__(self) -> NoReturn:
        raise TypeError("an Image cannot be copied or pickled; it is on one renderer's device")

    def __repr__(self) -> str:
        height, width, channels = self.shape
        return f"<vkbloom.Image of {width} x {height} pixels, {channels} channels, {self.dtype}>"
