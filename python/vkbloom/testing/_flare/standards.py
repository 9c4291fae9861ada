"""The standards of a flare report.

None of the texts was seen: they are sold. `STANDARDS` says, of each, which public descriptions the
formulas are from, and what they leave open.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Final

_IMATEST: Final = "https://www.imatest.com/docs/stray-light-flare"


@dataclasses.dataclass(frozen=True, kw_only=True)
class About:
    """A standard: its title, where the formulas are from, and what of its text was not seen."""

    title: str
    sources: tuple[str, ...]
    not_seen: str


STANDARDS: Final[Mapping[str, About]] = {
    "iso18844": About(
        title="ISO 18844:2017, Photography, Digital cameras, Image flare measurement",
        sources=(
            "D. Wueller, Image Flare measurement according to ISO 18844, Electronic Imaging 2016 "
            "(abstract): three measurements, by one or several exposures; flare over the field",
            "plusstd.com/standard/8494120/iso-18844-2017 (a summary): type A with 8 times the "
            "exposure, contrasts of 40:1 (A, B) and 3000:1 (C), white at 225 +- 25, black below "
            "5 % of the picture, quantization of 0.04 % (B) and 0.005 % (A), which are a level of "
            "sRGB near black beside that white, and an eighth of it",
            "A public program (leopardiq, flare/type_flare.py): the formulas of the three types, "
            "white areas at two radii of a spot, areas smaller by 1/70 of the diagonal",
        ),
        not_seen=(
            "The text of the standard was not seen. Open: the positions of the nine spots (here "
            "the middles of nine equal parts), the patterns with a window, the second chart (here "
            "the black of the first one, without white), the weights of Y (here those of Rec. 709 "
            "on linear light, in place of 0.299, 0.587, 0.114 on encoded values: the same for "
            "grey), the conditions of illumination, and the report's form."
        ),
    ),
    "iso9358": About(
        title="ISO 9358:1994, Veiling glare of image forming systems",
        sources=(
            "standards.iteh.ai/catalog/standards/iso/6777b96b-06b6-40f0-bd47-5cd1a549a9d4 (the "
            "abstract): the veiling glare index and the glare spread function",
            "Labsphere, on the integral method (tnrvse.com/a/fuwuzhichi/remenyingyong/2017/0806): "
            "the index is the irradiance in the image of a small black area divided by that in the "
            "image of the extended source around it",
            "Glare characteristics of lenses and optical instruments in the visible region (the "
            "abstract, discovery.researcher.life): the concept of a glare spread function, which "
            "depends on the system alone, from the light of an elementary source",
        ),
        not_seen=(
            "The text of the standard was not seen. Open: the size of the black area, the extent "
            "of the source (here the picture), and what the glare spread function is divided by "
            "(here the flux of the source's own image, inside the mask)."
        ),
    ),
    "ieee2020": About(
        title="IEEE Std 2020-2024, Automotive system image quality, flare (2.8)",
        sources=(
            f"Imatest, {_IMATEST}/standards: flare intensity (2.8.1) is normalized by a picture of "
            "a Lambertian diffuser, and has heritage to the flare attenuation of the pre-release, "
            "in dB of power; normalized flare (2.8.3) by the direct image of the source, as a "
            "linear transmission; the standard is said to subtract no dark level",
            f"Imatest, {_IMATEST}/calculations: dark level, clipping at 0, division by the "
            "normalization factor",
            "Imatest, https://www.imatest.com/schema/25-1/straylight-settings-normalization-"
            "lambertian-light-measurement: the diffuser's luminance in cd/m2 and the illuminance "
            "at the camera in lux; and the schemas of masks, compensation of exposures, "
            "saturation, and summaries",
        ),
        not_seen=(
            "The text of the standard was not seen. Open: the factor between the illuminance and "
            "the diffuser's luminance (here pi: a white diffuser where the camera is has the "
            "luminance E / pi), whether flare intensity is a share or in dB (here a share; dB are "
            "beside it), the size and the angles of the source, the size of the mask, the "
            "channels, and which summary is the result (here the mean; the others are beside it). "
            "What is subtracted as dark level is reported."
        ),
    ),
}

#: The names that `flare` takes.
NAMES: Final = tuple(STANDARDS)
