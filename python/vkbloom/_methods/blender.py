"""The Glare node of Blender's compositor."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Final, Literal, cast

import numpy as np
from numpy.typing import NDArray

from vkbloom._methods.convolution import PSFLike, read_psf
from vkbloom._psf.base import PSF
from vkbloom._psf.core_kernels import WithKernel
from vkbloom._psf.eye import spencer
from vkbloom._public import public
from vkbloom._settings.fields import (
    choice_field,
    flag_field,
    number_field,
    numbers_field,
    value_field,
)
from vkbloom._settings.pass_sentences import HALVED_BY_13
from vkbloom._settings.settings import PublishedSettings

GlareType = Literal["bloom", "ghosts", "streaks", "fog_glow", "simple_star", "sun_beams", "kernel"]
Quality = Literal["high", "medium", "low"]
Version = Literal["5.0", "5.2", "4.3"]

#: What the sides are divided by.
FACTORS: Final = {"high": 1, "medium": 2, "low": 4}


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class BlenderGlare(WithKernel, PublishedSettings):
    """The Glare node of Blender 5.0, as its compositor runs it on a CPU.

    ``glow`` is the node's output Highlights, `intensity` times ``bloom`` its Glare, ``final`` its
    Image.

    Parameters
    ----------
    type : {"bloom", "ghosts", "streaks", "fog_glow", "simple_star", "sun_beams", "kernel"}
        What is made of the highlights.
    quality : {"high", "medium", "low"}
        The glare is computed from the frame's size, half or a quarter of it, rounded up.
    threshold : float or None
        Brightest channel from which a colour glows.
    smoothness : float
        Width of the soft parts of the threshold and of the maximum, 0 to 1.
    maximum : float or None
        Largest brightness above the threshold, 0 to 65504. None: no limit.
    composite : {"add"}
        max(0, image) + glare.
    intensity : float
        The node's strength, 0 to 1.
    saturation : float
        Factor of the glare's saturation, 0 to 16.
    tint : (float, float, float)
        Factors of the glare's channels, 0 to 65504.
    size : float
        Size of "bloom", "fog_glow" and "sun_beams" as a share of the frame, 0 to 1.
    streaks : int
        Number of streaks, 1 to 16.
    streaks_angle : float
        Angle of the first streak in degrees, -360 to 360. A streak's light is on the side opposite
        to its angle, so that one of 0 is to the left of a light.
    iterations : int
        Length of "streaks" and "simple_star", and number of "ghosts", 2 to 5.
    fade : float
        What a streak or a star keeps with the distance, 0.75 to 1.
    color_modulation : float
        Strength of the colours of "streaks" and "ghosts", 0 to 1.
    diagonal : bool
        Whether the rays of "simple_star" are diagonals.
    sun_position : (float, float)
        Source of "sun_beams" as shares of the sides from the lower left, -16 to 16.
    jitter : float
        Share of the samples of "sun_beams" that is left out, 0 to 1. The others are at random.
    kernel : PSF, array-like, shape (h, w) or (h, w, 3), or None
        The image of "kernel", in pixels of the glare; None: a point. The glare of a point is the
        image turned by 180 degrees, as in Blender.
    version : {"5.0", "5.2", "4.3"}
        "5.2" reduces the kernel of "kernel" in "medium" and "low", and reads some texels beside
        their place. "4.3" has the kernel that "fog_glow" had before Blender 4.4.
    **settings
        The other fields of `Settings`; there is no knee.

    Notes
    -----
    All types start from the highlights. In "medium" and "low" a pixel of these is the mean of 2 x 2
    or 4 x 4 pixels, rows counted from the bottom, the last repeated. With v the brightest channel
    of a colour c, the highlight is c (v' - threshold) / v, or 0 if v <= 0, with
    v' = smooth_min(smooth_max(v, threshold), threshold + maximum). smooth_min(a, b) is
    min(a, b) - h^2 k / 4 with h = max(1 - abs(a - b) / k, 0), and smooth_max is its mirror image. k
    is the smoothness, but not more than the distance of the end from 0 and from the other end.

    - "bloom": n = floor(log2(size * shorter side)) levels, at least one. Each has half the size of
      the one before, floored, by the 13 taps of `Pyramid`. For ``down_1``, the four taps of each
      group are weighted by 1 / (1 + brightest channel). up_k = down_k + tent(up_k+1) with a tent of
      one pixel of the larger level, and the glare is up_0 / n.
    - "streaks": iteration i of a ray is (t_0 + f t_1 + f^2 t_2 + f^3 t_3) / 2 with taps 4^i pixels
      apart and f = fade^(4^i). Two channels of each but t_0 are multiplied by
      1 - color_modulation^(i + 1). The sum of the rays is divided by 6 - iterations.
    - "ghosts": the highlights are blurred by Gaussians of a radius of 16 and 32 pixels (a third of
      it is the standard deviation), scaled by 2.13 and -0.97 and added up. Each of the iterations
      but one adds four scaled images of the sum so far.
    - "fog_glow": the convolution with Spencer's function of daylight, for a field of view of
      180 - 170 size^(1/3) degrees over the longer side. The kernel's sum over all places of
      Blender's Fourier transform is 1.
    - "simple_star": along two lines, iteration i replaces each pixel in turn by
      (1 - fade) c + fade (p + n) / 2 with the pixels p and n that are i places before and after it,
      forwards from the left and from below, then backwards.
    - "sun_beams": the mean of the pixels towards the sun, at most size times the diagonal, with
      the weights (1 - place / number)^2.
    - "kernel": the convolution with an image, each channel divided by its sum.

    In 5.2, a kernel has sides of half or a quarter of the image's, rounded down, and its pixels are
    read from the image bilinearly, at their centres. Both texels between which a place u is are
    those of u and u + 1 in single floats. At u = -3e-8, which is a rounded 0 at widths of 41 and
    97, u + 1 is 1, so that the first column of the glare is its second one. The same is true for
    texels 2^k, for rows from the bottom, and for the taps of "streaks" along an axis.

    The glare is enlarged bilinearly. Its saturation s = (max - min) / max becomes
    clamp(saturation * s, 0, 1), so that a negative channel becomes 0, and it is multiplied by the
    tint.

    Source: the formulas of the compositor of Blender 5.0, source/blender/nodes/composite/nodes/
    node_composite_glare.cc, and of 5.2, blenlib/BLI_math_interp.hh, confirmed by Blender 5.0.1 and
    5.2.3 (``docs/evidence/engines.md``).
    """

    method: ClassVar[str] = "blender"
    _knobs: ClassVar[tuple[str, ...]] = ("threshold", "size")
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({"down": HALVED_BY_13})
    shaping: ClassVar[tuple[str, ...]] = ("type", "quality", "version", "size", "kernel")
    #: `glow` is the node's output Highlights.
    _has_threshold_pass: ClassVar[bool] = True
    _threshold_fields: ClassVar[tuple[str, ...]] = ("threshold", "smoothness")

    threshold: float | None = 1.0
    intensity: float = number_field(range=(0, 1))
    # On the command line, --size is the size of a frame, --version the program's, and --streaks a
    # stage of glare.
    type: GlareType = choice_field(option="glare-type")
    quality: Quality = choice_field(option="glare-quality")
    smoothness: float = number_field(everyday=0)
    maximum: float | None = number_field(default=None, slider=(0, 20), everyday=0)
    saturation: float = number_field(slider=(0, 1), everyday=0)
    tint: tuple[float, float, float] = numbers_field((1.0, 1.0, 1.0))
    size: float = number_field(option="glare-size", differentiable=False)
    streaks: int = number_field(option="glare-streaks")
    streaks_angle: float = number_field(unit="degree")
    iterations: int = number_field(default=3, range=(2, 5))
    fade: float = number_field()
    color_modulation: float = number_field()
    diagonal: bool = flag_field()
    sun_position: tuple[float, ...] = numbers_field((0.5, 0.5), -16.0, 16.0, differentiable=False)
    jitter: float = number_field(everyday=0, differentiable=False)
    kernel: PSFLike | None = value_field(None, kind="psf", read=read_psf)
    version: Version = choice_field(("5.0", "5.2", "4.3"), option="blender-version")

    @property
    def _is_transform(self) -> bool:
        # (The kernel of "kernel" is an image, and smaller than the frame.)
        return self.type == "fog_glow"

    def _hidden_stores(self, framebuffer: str) -> int:
        # The highlights are of the frame, which is an image of its own.
        return 1

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        return {"blender_5_2": self.version == "5.2"}

    def kernel_pixels(self, buffers: tuple[int, int]) -> NDArray[np.float64]:
        """Return the kernel of fog glow or of an image, (h, w, 3), with its point in the middle."""
        return kernel_of(self, buffers)

    def _kernel(self, frame: tuple[int, int], buffers: tuple[int, int]) -> NDArray[np.float64]:
        return kernel_of(self, buffers)

    def core_kernel_size(self, frame: tuple[int, int], buffers: tuple[int, int]) -> tuple[int, int]:
        """Return the kernel's width and height, without the kernel."""
        return kernel_sides(self, buffers)


def glare_size(buffers: tuple[int, int], quality: str) -> tuple[int, int]:
    """Return the size in which the glare is computed."""
    width, height = (-(-side // FACTORS[quality]) for side in buffers)
    return width, height


def kernel_of(settings: BlenderGlare, buffers: tuple[int, int]) -> NDArray[np.float64]:
    """Return the kernel in pixels of the glare, (h, w, 3), with its point at [h // 2, w // 2]."""
    size = glare_size(buffers, settings.quality)
    if settings.type == "kernel":
        psf = cast("PSF | None", settings.kernel)
        image = np.ones((1, 1, 3)) if psf is None else psf.kernel(size)
        if settings.version == "5.2" and settings.quality != "high":
            image = _reduce(image, FACTORS[settings.quality])
        return _rotate(_normalize(image))
    values = (_fog_glow_of_4_3 if settings.version == "4.3" else _fog_glow)(size, settings.size)
    return np.repeat(values[..., np.newaxis], 3, axis=2)


def kernel_sides(settings: BlenderGlare, buffers: tuple[int, int]) -> tuple[int, int]:
    """Return the kernel's width and height."""
    if settings.type == "kernel":
        height, width = kernel_of(settings, buffers).shape[:2]
        return width, height
    width, height = glare_size(buffers, settings.quality)
    if settings.version == "4.3":
        side = _side_of_4_3((width, height), settings.size)
        return side, side
    return 2 * width - 1, 2 * height - 1


def _even_length(least: int) -> int:
    """Return the next even number without a prime factor above 7."""
    length = least + least % 2
    while True:
        rest = length
        for factor in (2, 3, 5, 7):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return length
        length += 2


def _fog_glow(size: tuple[int, int], share: float) -> NDArray[np.float64]:
    """Return Spencer's function at the pixels' centres, over its sum in Blender's transform."""
    longer = max(size)
    degrees = (180 + share ** (1 / 3) * (10 - 180)) / longer
    # Blender's transform has room for an image and a kernel of the longer side.
    lengths = [_even_length(side + longer - 1) for side in size]
    around = [np.minimum(np.arange(n), n - np.arange(n)) for n in lengths]
    offsets = [np.arange(1 - side, side) for side in size]
    density = spencer().density

    def at(columns: Any, rows: Any) -> NDArray[np.float64]:
        values: NDArray[np.float64] = density(degrees * np.hypot(columns, rows[:, np.newaxis]))
        return values[..., 0]

    kernel: NDArray[np.float64] = at(*offsets) / at(*around).sum()
    return kernel


def _side_of_4_3(size: tuple[int, int], share: float) -> int:
    return int(max(size) * share) // 2 * 2 + 1


def _fog_glow_of_4_3(size: tuple[int, int], share: float) -> NDArray[np.float64]:
    """Return the kernel of `vkbloom.psf.fog_glow` with an odd side, over its sum."""
    side = _side_of_4_3(size, share)
    u = np.arange(-(side // 2), side // 2 + 1) / max(side // 2, 1)
    radius = (u**2 + u[:, np.newaxis] ** 2) * side / 4
    window = (1 + np.cos(np.pi * u)) / 2
    values = np.exp(-9 * radius**0.125) * window * window[:, np.newaxis]
    return _normalize(values)


def _normalize(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Divide each channel by its sum, if that is not 0."""
    sums = values.sum(axis=(0, 1))
    result: NDArray[np.float64] = values / np.where(sums == 0, 1, sums)
    return result


def _reduce(image: NDArray[np.float64], factor: int) -> NDArray[np.float64]:
    """Return the image bilinearly at the centres of fewer pixels; black, if there are none."""
    for length in image.shape[:2]:
        count = length // factor
        if count == 0:
            return np.zeros((1, 1, image.shape[2]))
        position = (np.arange(count) + 0.5) / count * length - 0.5
        low = position.astype(int)
        part = (position - low)[:, np.newaxis, np.newaxis]
        image = (1 - part) * image[low] + part * image[np.minimum(low + 1, length - 1)]
        image = image.swapaxes(0, 1)
    return image


def _rotate(kernel: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the image turned by 180 degrees.

    Blender counts rows from the bottom and takes the pixel [h // 2, w // 2] for the point. Turned,
    this is the pixel after the middle of an even width, for which a column of zeros makes room.
    """
    turned = kernel[::-1, ::-1]
    room = 1 - kernel.shape[1] % 2
    return np.pad(turned, ((0, 0), (room, 0), (0, 0)))
