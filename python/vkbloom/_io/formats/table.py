"""The formats of which more must be known than OpenImageIO says, by its names of them.

The readers are asked not to convert anything, so colours come as they are stored, with exceptions:

============================== ============================ ======================================
format                         the reader returns           the file means
============================== ============================ ======================================
OpenEXR                        as stored                    light times alpha; straight colours
                                                            with ``oiio:UnassociatedAlpha``
TIFF, ExtraSamples 1           as stored                    integers: encoded colours times alpha;
                                                            floats: light times alpha
TIFF, ExtraSamples 2 or none   as stored                    straight colours
TIFF, ExtraSamples 0           a channel without a name     no alpha
TIFF whose 0 is white          inverts numbers of 8 bits    grey whose 0 is black
                               with their alpha, and no
                               others
Targa 2.0, attributes type     as stored                    0, 1: no alpha; 2, 3: straight colours;
                                                            4: encoded colours times alpha
BMP with masks                 four bytes for blue, green,  straight colours, if the mask of alpha
                               red, alpha                   is not 0
BMP of 32 bits without masks,  as stored                    straight colours; but where alpha is 0
ICO, Targa without a type,                                  everywhere, it means nothing
DDS without an alpha mode
DDS DXT2, DXT4                 colours divided by alpha     encoded colours times alpha
DDS with an alpha mode         as stored                    1: straight; 2: encoded colours times
                                                            alpha; 3, 4: no alpha
FITS with BSCALE and BZERO     numbers without them         their product and sum
JPEG 2000, channel definition  as stored                    0, 1: straight; 2: encoded colours
                                                            times alpha
JPEG 2000                      adds a wrong offset to       the numbers on the canvas, as red,
                               signed numbers; sizes that   green, blue
                               are rounded up for
                               subsampled channels;
                               luminance and colour
                               differences without a name
                               as red, green, blue
JPEG XL, alpha channel         as stored                    straight, or encoded colours times alpha
PSD of grey, all layers        as stored                    colours over white; without its share,
                                                            encoded colours times alpha
PSD of RGB, all layers         straight colours             the same
JPEG (Ultra HDR)               1                            no alpha
all others                     as stored                    straight colours
============================== ============================ ======================================
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from vkbloom._io.formats import (
    bitmaps,
    film,
    fits,
    jpeg,
    jpeg_2000,
    jpeg_xl,
    openexr,
    photoshop,
    png,
    radiance,
    tiff,
    webp,
)
from vkbloom._io.formats.facts import FindFacts

#: Functions that return what is known of a part of a file. Of other formats, OpenImageIO's header
#: says all.
FORMATS: Final[Mapping[str, FindFacts]] = {
    "bmp": bitmaps.find_bmp_facts,
    "cineon": film.find_facts,
    "dds": bitmaps.find_dds_facts,
    "dpx": film.find_facts,
    "fits": fits.find_facts,
    "hdr": radiance.find_facts,
    "ico": bitmaps.find_ico_facts,
    "jpeg": jpeg.find_facts,
    "jpeg2000": jpeg_2000.find_facts,
    "jpegxl": jpeg_xl.find_facts,
    "openexr": openexr.find_facts,
    "png": png.find_facts,
    "psd": photoshop.find_facts,
    "targa": bitmaps.find_targa_facts,
    "tiff": tiff.find_facts,
    "webp": webp.find_facts,
}
#: Formats in which two channels are grey and alpha; OpenImageIO calls them red and green.
GREY_AND_ALPHA: Final = ("targa", "sgi", "jpeg2000", "jpegxl", "pnm", "psd", "rla", "fits")
