"""pygfx's bloom pass, on single floats and as its stock renderer runs it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pygfx
import wgpu
from pygfx.renderers.wgpu.engine.bloom import PhysicalBasedBloomPass
from pygfx.renderers.wgpu.engine.shared import get_shared

# For the pass on single floats.
pygfx.renderers.wgpu.enable_wgpu_features("float32-filterable", "float32-blendable")


class _Pass(PhysicalBasedBloomPass):
    """The pass with a uniform buffer of its own for the first level.

    In pygfx 0.17 one buffer holds the switch of the Karis average for all levels: the last one,
    which is off, is what all of them read.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._first = self._DownsamplePass()
        self._first._uniform_data["use_karis_average"] = int(self._use_karis_average)
        self._others = self._downsample_pass

    def _perform_downsampling(self, encoder: Any, source: Any) -> None:
        for level in range(self._bloom_texture.mip_level_count):
            target = self._bloom_texture.create_view(base_mip_level=level, mip_level_count=1)
            made = self._first if level == 0 else self._others
            made.render(encoder, colorTex=source, targetTex=target)
            source = target


class Pygfx:
    """The pass between two textures; the stock renderer has "rgba8unorm-srgb"."""

    def versions(self) -> dict[str, str]:
        """Return the versions of pygfx, wgpu and the driver."""
        info = get_shared().adapter.info
        driver = f"{info['device']}, {info['description']}"
        return {"pygfx": pygfx.__version__, "wgpu": wgpu.__version__, "driver": driver}

    def render(self, image: np.ndarray, parameters: dict[str, Any]) -> dict[str, np.ndarray]:
        """Return the frame as the pass reads it, and its result, as "glow" and "final".

        `parameters` are fields of `vkbloom.PygfxBloom`.
        """
        device, format = get_shared().device, parameters["format"]
        height, width, _ = image.shape
        usage = wgpu.TextureUsage
        source, target = (
            device.create_texture(
                size=(width, height, 1),
                format=format,
                usage=usage.TEXTURE_BINDING
                | usage.RENDER_ATTACHMENT
                | usage.COPY_DST
                | usage.COPY_SRC,
            )
            for _ in range(2)
        )
        rgba = np.ones((height, width, 4), np.float32)
        rgba[..., :3] = image
        texels = rgba if format == "rgba32float" else _encode(rgba)
        layout = {"bytes_per_row": texels.strides[0], "rows_per_image": height}
        device.queue.write_texture({"texture": source}, texels, layout, (width, height, 1))
        made = _Pass(
            bloom_strength=parameters.get("intensity", 0.04),
            max_mip_levels=parameters.get("levels", 6),
            filter_radius=parameters.get("filter_radius", 0.005),
            use_karis_average=parameters.get("karis_average", False),
        )
        encoder = device.create_command_encoder()
        made.render(encoder, source.create_view(), None, target.create_view())
        device.queue.submit([encoder.finish()])
        data = device.queue.read_texture({"texture": target}, layout, (width, height, 1))
        result = np.frombuffer(data, texels.dtype).reshape(texels.shape)
        if format != "rgba32float":
            texels, result = _decode(texels), _decode(result)
        return {"glow": texels.copy(), "final": result.copy()}


def _encode(linear: np.ndarray) -> np.ndarray:
    """Return the 8-bit sRGB of linear values of 0 to 1, alpha unchanged."""
    kept = np.clip(linear, 0, 1)
    curve = np.where(kept <= 0.0031308, 12.92 * kept, 1.055 * kept ** (1 / 2.4) - 0.055)
    curve[..., 3] = kept[..., 3]
    return np.round(255 * curve).astype(np.uint8)


def _decode(levels: np.ndarray) -> np.ndarray:
    share = levels / 255
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    linear[..., 3] = share[..., 3]
    return linear.astype(np.float32)
