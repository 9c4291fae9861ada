"""Diffraction of apertures of any shape, in colour."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vkbloom._array_cache import keep
from vkbloom._numbers import check_size
from vkbloom._psf.base import PSF, Array, check_wavelengths, crop_or_pad
from vkbloom._psf.sampled import SampledPSF
from vkbloom._psf.values import ArrayValue
from vkbloom._public import public
from vkbloom._settings.fields import check_fields, number_field, value_field

# Samples of the diffraction pattern per period of its highest frequency.
_PADDING = 4
# Rows that are computed at a time: of masks, and of sums.
_BAND = 256
_BLOCK = 32
_SPECTRUM = tuple(range(390, 731, 10))
# XYZ to linear sRGB (IEC 61966-2-1).
_SRGB = np.array(
    [
        [3.2406, -1.5372, -0.4986],
        [-0.9689, 1.8758, 0.0415],
        [0.0557, -0.2040, 1.0570],
    ]
)


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class iris:
    """The mask of a camera's iris, for `aperture`.

    Parameters
    ----------
    blades : int
        Number of straight blades, 3 to 64.
    rotation : float
        In degrees, counter-clockwise. With 0, a corner is on the right.
    roundness : float
        Shape of the edges, 0 (straight) to 1 (a circle).
    dust : int
        Number of opaque specks, 0 to 10000.
    scratches : int
        Number of thin opaque lines, 0 to 10000.
    seed : int
        Seed of the positions of dust and scratches.
    size : int
        Side of the mask in samples, 8 to 4096. The aperture's circle touches all sides.

    Notes
    -----
    NumPy converts it to an array of float32, shape (size, size): 1 where light passes, 0 elsewhere.
    Edges are the mean of 4 x 4 samples. With a radius of 1, the distance of a polygon's edge from
    the centre is cos(pi / n) / cos(angle to the middle of the edge). `roundness` interpolates
    between this distance and 1.
    """

    blades: int = number_field(default=6, range=(3, 64), slider=(3, 16))
    rotation: float = number_field(default=0.0, range=(-360, 360), unit="degree", slider=(0, 180))
    roundness: float = number_field(default=0.0, range=(0, 1))
    dust: int = number_field(default=0, range=(0, 10000), slider=(0, 100))
    scratches: int = number_field(default=0, range=(0, 10000), slider=(0, 100))
    seed: int = number_field(default=0, range=(0, 2**32 - 1), slider=(0, 100))
    size: int = number_field(default=512, range=(8, 4096), slider=())

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def shape(self) -> tuple[int, int]:
        """The shape of the mask, (size, size)."""
        return self.size, self.size

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(_mask(self), dtype=dtype, copy=copy)

    def to_dict(self) -> dict[str, Any]:
        """Return the parameters by name."""
        return dataclasses.asdict(self)


@keep
def _mask(made: iris) -> NDArray[np.float32]:
    fine = 4 * made.size
    positions = (np.arange(fine) + 0.5) * 2 / fine - 1
    # Rows count downwards.
    x, y = positions, -positions[:, np.newaxis]
    open_ = np.empty((fine, fine), np.bool_)
    bands = [slice(first, first + _BAND) for first in range(0, fine, _BAND)]
    step = 2 * math.pi / made.blades
    inside = math.cos(step / 2)
    for band in bands:
        squares = x * x + y[band] * y[band]
        np.less(squares, inside**2, out=open_[band])
        # Only between the circles inside and around the polygon the edge decides.
        edges = np.nonzero((squares > inside**2 - 1e-9) & (squares < 1 + 1e-9))
        across, up = x[edges[1]], y[band][edges[0], 0]
        angle = np.mod(np.arctan2(up, across) - math.radians(made.rotation), step) - step / 2
        edge = inside / np.cos(angle)
        within = np.hypot(across, up) <= edge + made.roundness * (1 - edge)
        open_[band][edges] = within
    generator = np.random.default_rng(made.seed)
    for _ in range(made.dust):
        (centre_x, centre_y), radius = generator.uniform(-1, 1, 2), generator.uniform(0.002, 0.02)
        rows, columns = (_near(centre, radius, fine) for centre in (-centre_y, centre_x))
        open_[rows, columns] &= np.hypot(x[columns] - centre_x, y[rows] - centre_y) > radius
    for _ in range(made.scratches):
        (centre_x, centre_y), turn = generator.uniform(-1, 1, 2), generator.uniform(0, math.pi)
        length, width = generator.uniform(0.1, 0.8), generator.uniform(0.001, 0.003)
        for band in bands:
            along = (x - centre_x) * math.cos(turn) + (y[band] - centre_y) * math.sin(turn)
            across = (y[band] - centre_y) * math.cos(turn) - (x - centre_x) * math.sin(turn)
            open_[band] &= (np.abs(along) > length / 2) | (np.abs(across) > width)
    # Four samples of a row are one word, whose bytes are their sum after three additions of rows.
    words = open_.view(np.uint32).reshape(made.size, 4, made.size).sum(axis=1, dtype=np.uint32)
    counts = words.view(np.uint8).reshape(made.size, made.size, 4).sum(axis=2, dtype=np.uint8)
    mask: NDArray[np.float32] = counts / np.float32(16)
    mask.flags.writeable = False
    return mask


def _near(centre: float, radius: float, count: int) -> slice:
    """Return the samples of -1..1 whose distance from the centre is at most the radius."""
    first, last = ((position + 1) * count / 2 for position in (centre - radius, centre + radius))
    return slice(max(0, math.floor(first)), min(count, math.ceil(last)))


def _check_mask(mask: Any) -> iris | ArrayValue:
    if isinstance(mask, iris):
        return mask
    if isinstance(mask, dict) and "blades" in mask:
        return iris(**mask)
    held = ArrayValue(mask, "mask")
    array = held.array
    if array.ndim != 2 or array.shape[0] != array.shape[1] or array.size == 0:
        raise ValueError(f"mask: shape {array.shape} is not (n, n)")
    if not ((array >= 0) & (array <= 1)).all() or not array.any():
        raise ValueError("mask: its values are not between 0 and 1, or all of them are 0")
    return held


def _check_wavelengths(wavelengths: Any) -> tuple[float, ...]:
    lengths = check_wavelengths(wavelengths)
    if not lengths or not (_colours(lengths).sum(axis=0) > 0).all():
        raise ValueError(
            f"wavelengths: the sum of {wavelengths!r} is not above 0 in each channel of sRGB; give "
            "one wavelength, or add others"
        )
    return lengths


@public("vkbloom.psf")
@dataclasses.dataclass(frozen=True)
class aperture(SampledPSF):
    """Diffraction of an aperture of any shape, in white light or single wavelengths, in pixels.

    Parameters
    ----------
    mask : iris, or array-like, shape (n, n)
        Transmission, 0 to 1, of the square around the aperture.
    f_number : float
        Focal length divided by the side of the mask, above 0.
    pixel_pitch : float
        Distance of the pixels on the sensor in um, above 0.
    wavelengths : sequence of float or None
        In nm, 380 to 780. A single wavelength is shown in grey. None: 390 to 730 in steps of 10.

    Notes
    -----
    A is the mask's Fourier transform, and P(u) = ``|A(u)|^2``. At the position r and the wavelength
    w, the intensity is P(r / (w f_number)) / w^2. It is integrated over each pixel. The wavelengths
    have equal energy. They are summed with the CIE 1931 colour matching functions and converted to
    linear sRGB. Each channel is divided by its sum, so that white light stays white. Saturated
    spectral colours are outside of sRGB, so single values can be negative. The pattern of n samples
    ends n / 2 periods from the centre.

    Source of the colour matching functions: the fits of Wyman, Sloan, Shirley, "Simple Analytic
    Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013.
    """

    mask: Any = value_field(read=_check_mask)
    f_number: float = number_field(default=8.0, range=(0, math.inf), slider=(2, 64))
    pixel_pitch: float = number_field(default=4.0, range=(0, math.inf), unit="um", slider=(1, 20))
    wavelengths: tuple[float, ...] | None = value_field(None, unit="nm", read=_check_wavelengths)

    def _in_larger_pixels(self, factor: float) -> PSF:
        return dataclasses.replace(self, pixel_pitch=self.pixel_pitch * factor)

    def native_array(self) -> Array:
        return _pattern(self, _reach(self), _reach(self))

    def array(self, size: tuple[int, int], pixels_per_degree: float | None = None) -> Array:
        # Patterns of small apertures are much larger than frames.
        width, height = check_size("size", size)
        reach = _reach(self)
        return crop_or_pad(_pattern(self, min(reach, height // 2), min(reach, width // 2)), size)


def _lengths(psf: aperture) -> tuple[float, ...]:
    return _SPECTRUM if psf.wavelengths is None else psf.wavelengths


def _scale(psf: aperture, length: float) -> float:
    """Return the pixels per period of the pattern's lowest frequency, at a wavelength."""
    return length * psf.f_number / (1000 * psf.pixel_pitch)


def _reach(psf: aperture) -> int:
    """Return the pixels from the centre to the end of the pattern."""
    return max(1, math.ceil(_scale(psf, max(_lengths(psf))) * int(np.shape(psf.mask)[0]) / 2))


@keep
def _pattern(psf: aperture, up: int, across: int) -> Array:
    """Return the sum over the wavelengths, as far as some rows and columns from the centre."""
    lengths = _lengths(psf)
    # The pattern of a real mask is point-symmetric: the upper half, with all cells of the pixels on
    # the axis and of the spline there, is enough.
    below = math.ceil(_PADDING / _scale(psf, min(lengths)) / 2) + 3
    sums = _sums(np.asarray(psf.mask, np.float64), below)
    end = _reach(psf) + 0.5
    half, total = np.zeros((3, up + 1, 2 * across + 1)), np.zeros(3)
    for length, colour in zip(lengths, _colours(lengths), strict=True):
        scale = _PADDING / _scale(psf, length)
        # Where this wavelength's pattern ends, two cells beyond its last one.
        reach = math.ceil((sums.shape[1] / 2 + 1) / scale)
        high, wide = min(up, reach), min(across, reach)
        rows: Array = np.arange(-high, 2, dtype=np.float64) - 0.5
        columns: Array = np.arange(-wide, wide + 2, dtype=np.float64) - 0.5
        energies = _energies(sums, rows * scale, columns * scale)
        for channel, weight in zip(half, colour, strict=True):
            channel[up - high :, across - wide : across + wide + 1] += energies * weight
        above, middle = _energies(
            sums, np.array([-end, -0.5, 0.5]) * scale, np.array([-end, end]) * scale
        )
        total += (2 * above + middle) * colour
    whole = np.empty((2 * up + 1, 2 * across + 1, 3))
    whole[: up + 1] = np.moveaxis(half, 0, -1) / total
    whole[up + 1 :] = whole[up - 1 :: -1, ::-1] if up else 0
    whole.flags.writeable = False
    return whole


def _energies(sums: Array, rows: Array, columns: Array) -> Array:
    """Return the energies between rows and columns, in cells from the centre."""
    middle = (sums.shape[1] - 3) / 2 + 0.5
    bands = np.ascontiguousarray(_between(sums, middle + rows).T)
    return _between(bands, middle + columns).T


def _sums(mask: Array, below: int) -> Array:
    """Return the integrals of the diffraction pattern over rectangles that start at its corner.

    They end some rows below its centre. The first and the last are repeated for the spline. The
    pattern is band-limited. So the integrals over the cells of the Fourier transform are exact:
    a product with a sinc in the domain of the autocorrelation.
    """
    count = len(mask)
    # All lags of the autocorrelation.
    both = 2 * count
    correlation = np.fft.irfft2(np.abs(np.fft.rfft2(mask, (both, both))) ** 2, (both, both))
    side = _PADDING * count
    lags = np.sinc(np.fft.fftfreq(both) * both / side)
    correlation *= lags
    correlation *= lags[:, np.newaxis]
    rows = np.zeros((both, side))
    rows[:, :count], rows[:, -count:] = correlation[:, :count], correlation[:, count:]
    # The other half of the real, point-symmetric transform has the same values.
    waves = np.fft.rfft(rows)
    columns = np.zeros((side, waves.shape[1]), np.complex128)
    columns[:count], columns[-count:] = waves[:count], waves[count:]
    half = np.fft.fft(columns, axis=0).real
    middle = side // 2
    positions = np.arange(-middle, min(middle, below))
    sums = np.zeros((len(positions) + 3, side + 3))
    sums[2:-1, middle + 2 : -1] = half[positions, :middle]
    sums[2:-1, 2 : middle + 2] = half[-positions, middle:0:-1]
    return sums.cumsum(axis=0, out=sums).cumsum(axis=1, out=sums)


def _between(sums: Array, positions: Array) -> Array:
    """Return the differences of the sums between neighbouring places along the first axis.

    The sums are interpolated by cubics between the cells, and constant outside of them.
    """
    at = np.clip(positions, 0, len(sums) - 3)
    lower = np.minimum(at.astype(np.intp), len(sums) - 4)
    t = at - lower
    # Catmull and Rom's spline.
    weights = (
        ((2 - t) * t - 1) * t / 2,
        ((3 * t - 5) * t * t + 2) / 2,
        ((4 - 3 * t) * t + 1) * t / 2,
        (t - 1) * t * t / 2,
    )
    values = np.empty((len(positions), sums.shape[1]))
    products = np.empty((_BLOCK, sums.shape[1]))
    # Blocks that stay in the processor's cache.
    for first in range(0, len(positions), _BLOCK):
        block = slice(first, first + _BLOCK)
        rows = values[block]
        np.take(sums, lower[block], axis=0, out=rows, mode="clip")
        rows *= weights[0][block, np.newaxis]
        for offset, weight in enumerate(weights[1:], 1):
            product = products[: len(rows)]
            np.take(sums, lower[block] + offset, axis=0, out=product, mode="clip")
            product *= weight[block, np.newaxis]
            rows += product
    return np.diff(values, axis=0)


def _colours(lengths: tuple[float, ...] | tuple[int, ...]) -> Array:
    """Return the linear sRGB of each wavelength, (N, 3). A single wavelength is grey."""
    if len(lengths) == 1:
        return np.ones((1, 3))
    nm = np.array(lengths, np.float64)

    def lobe(middle: float, below: float, above: float) -> Array:
        return np.exp(-(((nm - middle) / np.where(nm < middle, below, above)) ** 2) / 2)

    x = 1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7)
    x -= 0.065 * lobe(501.1, 20.4, 26.2)
    y = 0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1)
    z = 1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8)
    return np.asarray(np.stack([x, y, z], axis=-1) @ _SRGB.T)
