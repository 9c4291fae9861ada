"""Attributes of a file that are also valid for the result.

Those of all formats are about colours and pixels, the size in print, and who took the picture where
and how. OpenEXR keeps all that bloom does not change: time code, frame rate, a program's own ones.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

from vkbloom._io.picture import Attributes

if TYPE_CHECKING:
    import OpenImageIO

_KEPT_ATTRIBUTES: Final = frozenset(
    (
        *("chromaticities", "ICCProfile", "PixelAspectRatio"),
        *("XResolution", "YResolution", "ResolutionUnit", "jpeg:subsampling"),
        *("Artist", "Copyright", "DateTime", "ImageDescription", "Make", "Model", "Keywords"),
        *("ExposureTime", "FNumber"),
    )
)
_KEPT_GROUPS: Final = ("Exif:", "GPS:", "IPTC:")
# Attributes that a conversion or rotation makes wrong.
_LOST_ATTRIBUTES: Final = frozenset(
    ("Exif:ColorSpace", "Exif:Gamma", "Exif:PixelXDimension", "Exif:PixelYDimension")
)
# What bloom, or another choice of channels, parts and tiles, makes untrue: checksums, previews,
# lists of channels and views, mattes of channels that are left out, and what vkbloom says itself.
_UNTRUE: Final = re.compile(
    r"vkbloom:|cryptomatte/|thumbnail_|oiio:(?!subimagename$)"
    r"|(?:multiView|Orientation|Software|acesImageContainerFlag|type|version|chunkCount|tiles)$"
    r"|openexr:(?!lineOrder$)"
    r"|(?:.*[^a-z])?(?:md5|sha-?(?:1|224|256|384|512)|crc-?(?:16|32|64)?|checksum"
    r"|(?:node|file|image|pixel)[_-]?hash)(?:[^a-z].*)?$",
    re.IGNORECASE,
)
# What describes colours, besides chromaticities.
_OF_COLOURS: Final = ("adoptedNeutral", "colorInteropID", "lookModTransform", "renderingTransform")
# Textures are tiled, which the result is not; environments are still such.
_TEXTURE: Final = "textureformat"
_COMPRESSION: Final = "compression"
_DWA_LEVEL: Final = "openexr:dwaCompressionLevel"


def kept_attributes(spec: OpenImageIO.ImageSpec) -> dict[str, tuple[Any, Any]]:
    """Return the attributes of a part that are valid for the result in every format."""
    return {
        attribute.name: (attribute.type, attribute.value)
        for attribute in spec.extra_attribs
        if _is_kept(attribute.name)
    }


def _is_kept(attribute: str) -> bool:
    return attribute not in _LOST_ATTRIBUTES and (
        attribute in _KEPT_ATTRIBUTES or attribute.startswith(_KEPT_GROUPS)
    )


def exr_attributes(spec: OpenImageIO.ImageSpec) -> dict[str, tuple[Any, Any]]:
    """Return the attributes of a part that are only written to OpenEXR, and stay true there."""
    found = {
        attribute.name: (attribute.type, attribute.value)
        for attribute in spec.extra_attribs
        if attribute.value is not None
        and not _is_kept(attribute.name)
        and _UNTRUE.match(attribute.name) is None
        and (attribute.name != _TEXTURE or "Environment" in str(attribute.value))
        and (attribute.name != "openexr:lineOrder" or attribute.value != "randomY")
    }
    if (level := spec.get_float_attribute(_DWA_LEVEL)) and "dwa" in str(found.get(_COMPRESSION)):
        kind, name = found[_COMPRESSION]
        # OpenImageIO reads the level as an attribute, and writes it by the compression's name.
        found[_COMPRESSION] = kind, f"{name}:{level:g}"
    return found


def without_colours(attributes: Attributes) -> Attributes:
    """Return attributes without those of colours, which a conversion makes untrue."""
    return {name: value for name, value in attributes.items() if name not in _OF_COLOURS}


def write_exr_attributes(spec: OpenImageIO.ImageSpec, attributes: Attributes) -> None:
    """Set attributes of `exr_attributes`."""
    for name, (kind, value) in attributes.items():
        spec.attribute(name, kind, value)
