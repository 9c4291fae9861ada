"""Textures of glTF materials: images, samplers, texture coordinates.

Section numbers are those of the "glTF 2.0 Specification", version 2.0.1, Khronos Group.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.readers import check_plausible, failure_of, open_image
from vkbloom._io.srgb import decode_srgb
from vkbloom._scene.arrays import MAX_SIDE
from vkbloom._scene.gltf_file import TEXTURE_TRANSFORM, Floats, GltfFile, Parsed
from vkbloom._scene.textures import AddressMode, Filter, Texture, mip_levels

# The image formats of glTF (3.8.3), by their first bytes.
_KINDS: Final = {b"\x89PNG\r\n\x1a\n": ".png", b"\xff\xd8\xff": ".jpg"}
# A limit for all textures of a file, since small images can decode to any amount of memory. This
# many texels take 1.4 GB with their mip levels.
MAX_TEXELS: Final = 2**27
# The numbers of samplers (5.26) as WebGPU's names. A minification filter has two parts: between
# texels, and between mip levels.
_ADDRESS_MODES: Final[dict[int, AddressMode]] = {
    33071: "clamp-to-edge",
    33648: "mirror-repeat",
    10497: "repeat",
}
_MAG_FILTERS: Final[dict[int, Filter]] = {9728: "nearest", 9729: "linear"}
_MIN_FILTERS: Final[dict[int, tuple[Filter, Filter | None]]] = {
    9728: ("nearest", None),
    9729: ("linear", None),
    9984: ("nearest", "nearest"),
    9985: ("linear", "nearest"),
    9986: ("nearest", "linear"),
    9987: ("linear", "linear"),
}


@dataclass(frozen=True)
class TextureUse:
    """A texture of a material, and its texture coordinates."""

    texture: Texture
    coordinates: str  # the attribute, TEXCOORD_0 and so on
    transform: Floats  # (2, 3): applied to (u, v, 1)

    def map_coordinates(self, coordinates: Floats) -> Floats:
        """Return the transformed texture coordinates ``(n, 2)``."""
        with np.errstate(over="ignore", invalid="ignore"):
            placed: Floats = coordinates @ self.transform[:, :2].T + self.transform[:, 2]
        return placed


class TextureReader:
    """Reads a file's textures, each once."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._textures: dict[tuple[object, object], Texture] = {}
        self._texels = 0

    def use(self, info: object, what: str) -> TextureUse | None:
        """Read the texture of a material's textureInfo, if there is one with a supported image."""
        if info is None:
            return None
        info = self._file.part(info, what)
        texture = self._file.item("textures", info.index, what)
        user = f"textures[{info.index}]"
        if texture.source is None:
            self._file.leave_out("textures whose image only an extension gives")
            return None
        coordinate_set = 0 if info.texCoord is None else info.texCoord
        transform = np.eye(3)[:2]
        given = self._file.extension(info, TEXTURE_TRANSFORM, what)
        if given is not None:
            transform = self._transform(given, what)
            coordinate_set = coordinate_set if given.texCoord is None else given.texCoord
        coordinate_set = self._file.integer(coordinate_set, f"{what}.texCoord", 0, 2**31 - 1)
        self._file.item("images", texture.source, user)
        if texture.sampler is not None:
            self._file.item("samplers", texture.sampler, user)
        key = (texture.source, texture.sampler)
        if key not in self._textures:
            self._textures[key] = self._texture(texture, user)
        return TextureUse(self._textures[key], f"TEXCOORD_{coordinate_set}", transform)

    def _transform(self, given: Parsed, what: str) -> Floats:
        """Return the matrix ``(2, 3)`` of KHR_texture_transform: offset * rotation * scale.

        With v pointing down, the rotation appears counter-clockwise, as in the example in the
        extension's specification.
        """
        what = f"{what}.{TEXTURE_TRANSFORM}"
        offset = self._file.floats(given.offset, f"{what}.offset", (0, 0))
        scale = self._file.floats(given.scale, f"{what}.scale", (1, 1))
        turned = 0.0 if given.rotation is None else given.rotation
        (angle,) = self._file.floats([turned], f"{what}.rotation", (0,))
        cosine, sine = math.cos(angle), math.sin(angle)
        return np.column_stack((np.array([[cosine, sine], [-sine, cosine]]) * scale, offset))

    def _texture(self, texture: Parsed, user: str) -> Texture:
        sampler, file = None, self._file
        if texture.sampler is not None:
            sampler = file.item("samplers", texture.sampler, user)

        def look_up(name: str, names: dict[int, Any], usual: int) -> Any:
            what = f"samplers[{texture.sampler}].{name}"
            value = getattr(sampler, name, None)
            value = file.integer(usual if value is None else value, what, 0, 2**31 - 1)
            if value not in names:
                file.fail(f"{what} is {value}; {', '.join(map(str, names))} are possible")
            return names[value]

        wraps = (look_up("wrapS", _ADDRESS_MODES, 10497), look_up("wrapT", _ADDRESS_MODES, 10497))
        mag_filter = look_up("magFilter", _MAG_FILTERS, 9729)
        # The default is the filter with the least aliasing.
        min_filter, mipmap_filter = look_up("minFilter", _MIN_FILTERS, 9987)
        picture = self._picture(texture.source, user)
        levels = (picture,) if mipmap_filter is None else mip_levels(picture)
        return Texture(levels, wraps, mag_filter, min_filter, mipmap_filter or "nearest")

    def _picture(self, index: object, user: str) -> NDArray[np.float16]:
        """Read an image as linear rgb, with an alpha of 1.

        Base colours and emission are sRGB-encoded, whatever colour space the image declares (3.8.3,
        3.9.2). The image's alpha is not used, as in alphaMode OPAQUE.
        """
        data = self._file.image_bytes(index, user)
        what = f"images[{index}]"
        suffix = next((end for start, end in _KINDS.items() if data.startswith(start)), None)
        if suffix is None:
            self._file.fail(f"{what} is neither PNG nor JPEG")
        stored = self._decode(data, suffix, what)
        scale = np.iinfo(stored.dtype).max
        # A table, since there are only a few values.
        table = decode_srgb(np.arange(scale + 1) / scale).astype(np.float16)
        picture = np.ones((*stored.shape[:2], 4), np.float16)
        picture[:, :, :3] = table[stored[:, :, :3] if stored.shape[2] > 2 else stored[:, :, :1]]
        return picture

    def _decode(self, data: bytes, suffix: str, what: str) -> NDArray[Any]:
        """Return an image's values ``(h, w, C)``: uint8 or uint16, C 1 to 4."""
        with tempfile.TemporaryDirectory(prefix="vkbloom-") as folder:
            # OpenImageIO's Python module can only read files.
            path = Path(folder) / f"image{suffix}"
            path.write_bytes(data)
            try:
                with open_image(path, "Reading textures") as reader:
                    spec = reader.spec()
                    width, height, channels = spec.width, spec.height, spec.nchannels
                    self._texels += width * height
                    if max(width, height) > MAX_SIDE or self._texels > MAX_TEXELS:
                        raise ValueError(
                            f"{width} x {height} texels are too many: {MAX_SIDE} a side and "
                            f"{MAX_TEXELS} in all of a file are possible"
                        )
                    check_plausible(spec, path)
                    kind = "uint16" if str(spec.format) == "uint16" else "uint8"
                    pixels = reader.read_image(0, 0, 0, channels, kind)
                    # For a truncated file, OpenImageIO returns the part that is there and reports
                    # an error.
                    reason = failure_of(reader)
            except ValueError as error:
                reason = str(error)
                pixels = None
            reason = reason.replace(str(path), what)
        if pixels is None or reason:
            self._file.fail(f"{what}: {reason or 'damaged: the texels cannot be read'}")
        return np.asarray(pixels).reshape(height, width, channels)
