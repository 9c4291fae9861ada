"""pygfx: its bloom pass on the same adapter, with its own textures."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Bytes of a pixel in rgba16float.
_PIXEL = 8


class Bloom:
    """pygfx's pass after Jimenez 2014 on half-float images: NumPy in, NumPy out.

    Parameters
    ----------
    size : (int, int)
        Width and height.
    levels : int
        Levels of the mip chain.
    adapter : str
        Name of the Vulkan adapter.

    Raises
    ------
    RuntimeError
        wgpu does not find that adapter, or it lacks what pygfx needs.
    """

    def __init__(self, size: tuple[int, int], levels: int, adapter: str) -> None:
        self._wgpu = wgpu = importlib.import_module("wgpu")
        _select(wgpu, adapter)
        engine = importlib.import_module("pygfx.renderers.wgpu")
        # Strength 1: only the bloom.
        self._pass = engine.PhysicalBasedBloomPass(bloom_strength=1.0, max_mip_levels=levels)
        shared = importlib.import_module("pygfx.renderers.wgpu.engine.shared")
        self._device = shared.get_shared().device
        self._size = size
        usage = wgpu.TextureUsage
        self._source, self._target = (
            self._device.create_texture(size=(*size, 1), format="rgba16float", usage=bits)
            for bits in (
                usage.TEXTURE_BINDING | usage.COPY_DST | usage.COPY_SRC,
                usage.RENDER_ATTACHMENT | usage.COPY_SRC | usage.COPY_DST,
            )
        )

    @property
    def radius(self) -> float:
        """Distance of the tent's taps relative to the width."""
        return float(self._pass.filter_radius)

    @radius.setter
    def radius(self, radius: float) -> None:
        self._pass.filter_radius = radius

    @property
    def karis_average(self) -> bool:
        """Whether the first level is weighted against fireflies."""
        return bool(self._pass.use_karis_average)

    @karis_average.setter
    def karis_average(self, is_on: bool) -> None:
        self._pass.use_karis_average = is_on

    def bloom(self, image: NDArray[np.float16], strength: float = 1.0) -> NDArray[np.float16]:
        """Return image + (bloom - image) * strength, where the bloom is the sum of its levels."""
        self._pass.bloom_strength = strength
        return self._run(
            image,
            lambda encoder: self._pass.render(
                encoder, self._source.create_view(), None, self._target.create_view()
            ),
        )

    def copy(self, image: NDArray[np.float16]) -> NDArray[np.float16]:
        """Return the image by the same path, with a copy on the device in place of the bloom."""
        return self._run(
            image,
            lambda encoder: encoder.copy_texture_to_texture(
                {"texture": self._source}, {"texture": self._target}, (*self._size, 1)
            ),
        )

    def _run(self, image: NDArray[np.float16], record: Any) -> NDArray[np.float16]:
        width, height = self._size
        layout = {"bytes_per_row": width * _PIXEL}
        queue = self._device.queue
        queue.write_texture({"texture": self._source}, image, layout, (width, height, 1))
        encoder = self._device.create_command_encoder()
        record(encoder)
        queue.submit([encoder.finish()])
        pixels = queue.read_texture({"texture": self._target}, layout, (width, height, 1))
        return np.frombuffer(pixels, np.float16).reshape(height, width, 4)


def _select(wgpu: Any, adapter: str) -> None:
    """Make pygfx use the Vulkan adapter of that name; there is one for the process."""
    found = [
        each
        for each in wgpu.gpu.enumerate_adapters_sync()
        if each.info["backend_type"] == "Vulkan" and each.info["device"] == adapter
    ]
    if not found:
        raise RuntimeError(f"wgpu does not find {adapter}")
    importlib.import_module("pygfx").renderers.wgpu.select_adapter(found[0])
