"""Test images for a blur or bloom, and the check of the returned images."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import check_dtype, copy_to_host, plain_array
from vkbloom._numbers import check_index, check_number, check_size
from vkbloom._public import public
from vkbloom.testing._levels import Levels

__tracebackhide__ = True

#: An image in real units: integers are scaled to 0..1.
Image: TypeAlias = NDArray[np.float64]

#: Errors of values: one for all of an image, or one for each.
Error: TypeAlias = float | Image

#: The bloom under test: takes an image and returns one of the same height and width.
Bloom: TypeAlias = Callable[[NDArray[Any]], NDArray[Any]]

#: (atol, rtol) by a result's dtype; rtol is relative to the largest value. Integers: two levels,
#: half a level for each rounding in up to four buffers. Half: four roundings of 2**-11. Float: the
#: accuracy of lavapipe's linear filter; filters in shader code are a hundred times as exact.
_ERRORS: Final[Mapping[str, tuple[float, float]]] = {
    "uint8": (2 / 255, 0.0),
    "uint16": (2 / 65535, 0.0),
    "float16": (0.0, 2e-3),
    "float32": (0.0, 1e-4),
    "float64": (0.0, 1e-4),
}


# Where levels are coarse, noise is squares of this share of the shorter side.
_BLOCKS: Final = 8
# And lights have this side in pixels.
_LIGHT: Final = 9


class NotTaken(ValueError):
    """A bloom does not take what a law needs, such as a region or alpha; so it is not tested."""


class BloomError(Exception):
    """A bloom under test raised an error, or returned no image; the cause is that error."""


def call(bloom: Bloom, given: NDArray[Any], **options: Any) -> NDArray[Any]:
    """Return the bloom of a copy of an image: a bloom may work in place.

    An array of another library becomes NumPy's.
    """
    result: NDArray[Any] = copy_to_host(bloom(given.copy(), **options))
    return result


def check_result(result: object, given: NDArray[Any], colours: int) -> NDArray[Any]:
    """Return the result of a bloom for an image as (H, W, C), after a check of dtype and shape."""
    if isinstance(result, Mapping):
        raise TypeError(
            "bloom: it returns a mapping; name the framebuffer, for example "
            "lambda image: renderer.apply(image, settings)['bloom']"
        )
    array = plain_array(copy_to_host(result), "bloom: its result")
    if array.dtype.name not in _ERRORS:
        raise TypeError(f"bloom: it returns {array.dtype}, not one of {', '.join(_ERRORS)}")
    whole = array[:, :, np.newaxis] if array.ndim == 2 else array
    if whole.ndim != 3 or whole.shape[:2] != given.shape[:2]:
        raise ValueError(f"bloom: it returns shape {array.shape} for {given.shape}")
    if whole.shape[2] < colours:
        raise ValueError(f"bloom: it returns {whole.shape[2]} channels for {colours}")
    return whole


def guard(bloom: Bloom) -> Bloom:
    """Return a bloom whose errors, and results that are no image of the same size, are BloomErrors.

    So a report tells them from its own, such as a probe that a law cannot be tested with.
    """

    @functools.wraps(bloom)
    def guard(given: NDArray[Any], **options: Any) -> NDArray[Any]:
        try:
            result = bloom(given, **options)
            if not options.get("region"):
                check_result(result, given, 1)
        except Exception as error:
            raise BloomError(f"the bloom raised {type(error).__name__}: {error}") from error
        return result

    return guard


def takes(bloom: object, name: str) -> bool:
    """Return whether a callable takes a keyword of this name."""
    try:
        parameters = inspect.signature(bloom).parameters.values()  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return False
    return any(
        parameter.name == name or parameter.kind is parameter.VAR_KEYWORD
        for parameter in parameters
    )


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True)
class Probe:
    """The kind of test image for the laws, and the allowed errors of the results.

    Parameters
    ----------
    size : (int, int)
        Width and height in pixels. For laws of the complete point spread, no light may reach the
        border of the image.
    channels : int or None
        1 to 4; None: images of shape (H, W). A fourth channel is alpha: it is 1 in all test images
        and ignored in results.
    dtype : str or dtype
        Dtype of the images: "uint8", "uint16" (both 0 to 1 in real units), "float16", "float32" or
        "float64".
    value : float
        The brightest value of an image in real units, at most 1 for integers. A method that clamps
        or has a threshold is linear only on one side of it.
    atol, rtol : float or None
        Allowed error of a value, absolute and relative to the largest value of the result. If both
        are None, they follow from the result's dtype: two levels for integers, 2e-3 for half, 1e-4
        for float.
    seed : int
        Seed of the noise images.
    levels : Levels or None
        What the files of a program hold that reads and writes integers; `report` sets it for such
        a program. Test images then have values that the files hold, and the error of a value
        follows from them, in place of `atol` and `rtol`. In 8 bits, noise is squares of two values.
    """

    size: tuple[int, int] = (65, 65)
    channels: int | None = 3
    dtype: Any = "float32"
    value: float = 1.0
    atol: float | None = None
    rtol: float | None = None
    seed: int = 0
    levels: Levels | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", check_size("size", self.size))
        if self.channels is not None:
            check_index("channels", self.channels, 1, 4)
        dtype = check_dtype("dtype", self.dtype)
        if dtype.name not in _ERRORS:
            raise ValueError(f"dtype: {dtype} is not one of {', '.join(_ERRORS)}")
        object.__setattr__(self, "dtype", dtype)
        largest = 1.0 if dtype.kind == "u" else float(np.finfo(dtype).max)
        check_number("value", self.value, math.ulp(0.0), largest)
        for name in ("atol", "rtol"):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name), 0.0, math.inf)
        check_index("seed", self.seed, 0, 2**63 - 1)

    @property
    def centre(self) -> tuple[int, int]:
        """X and y of the middle pixel."""
        return self.size[0] // 2, self.size[1] // 2

    @property
    def colours(self) -> int:
        """Number of channels without alpha."""
        return 1 if self.channels is None else min(self.channels, 3)

    @property
    def is_coarse(self) -> bool:
        """Whether values have few levels, as in files of 8 bits."""
        return self.levels is not None and self.levels.is_coarse

    @property
    def light_side(self) -> int:
        """The side of a light whose bloom has many levels, in pixels; 1 where all values have."""
        return min(_LIGHT, (min(self.size) // 4) | 1) if self.is_coarse else 1

    def check_fine(self, needed: str) -> None:
        """Raise ValueError if values have few levels; `needed`: what a law would need."""
        if self.is_coarse and self.levels is not None:
            raise ValueError(f"cannot be tested in {self.levels.reason}: {needed}; use .exr")

    def flat(self, value: float) -> Image:
        """Return an image of one value."""
        return np.full((self.size[1], self.size[0], self.colours), value)

    def point(
        self, position: tuple[int, int], value: float, sides: tuple[int, int] = (1, 1)
    ) -> Image:
        """Return a black image with one lit pixel at (x, y), or a rectangle from there on."""
        (x, y), (width, height) = position, sides
        image = self.flat(0.0)
        image[y : y + height, x : x + width] = value
        return image

    def noise(self, index: int, highest: float) -> Image:
        """Return random values of 0 to `highest`, rounded to what the bloom can be given."""
        generator = np.random.default_rng((self.seed, index))
        if self.is_coarse:
            return self.quantize(self._squares(generator) * highest)
        image = generator.random((self.size[1], self.size[0], self.colours)) * highest
        return self.quantize(image)

    def _squares(self, generator: np.random.Generator) -> Image:
        """Return squares of 0 and 1, since a blur of noise has few levels."""
        side = max(4, min(self.size) // _BLOCKS)
        counts = (-(-self.size[1] // side), -(-self.size[0] // side), self.colours)
        squares = generator.integers(0, 2, counts).repeat(side, axis=0).repeat(side, axis=1)
        return np.asarray(squares[: self.size[1], : self.size[0]], np.float64)

    def quantize(self, image: Image) -> Image:
        """Return the values that the bloom is given for an image, in real units."""
        return self._real(self._store(image))

    def apply(
        self, bloom: Bloom, image: Image, *, exempt: tuple[int, int] | None = None
    ) -> tuple[Image, Error]:
        """Return the bloom of an image in real units, without alpha, and the error of its values.

        The pixel `exempt`, x and y, is ignored; it is 0 in the result.
        """
        if not callable(bloom):
            raise TypeError(f"bloom: {bloom!r} is not callable")
        given = self.as_input(image)
        return self.values(call(bloom, given), given, exempt=exempt)

    def as_input(self, image: Image) -> NDArray[Any]:
        """Return an image in the probe's dtype and number of channels, as input of a bloom."""
        stored = self._store(image)
        if self.levels is not None and self.levels.is_lossy and np.ptp(stored, axis=(0, 1)).any():
            raise ValueError(
                "cannot be tested in lossy files, which change every image but a flat one; use "
                ".png or .exr"
            )
        if self.channels == 4:
            opaque = np.iinfo(self.dtype).max if self.dtype.kind == "u" else 1
            alpha = np.full((*stored.shape[:2], 1), opaque, self.dtype)
            stored = np.concatenate([stored, alpha], axis=2)
        return np.ascontiguousarray(stored[:, :, 0] if self.channels is None else stored)

    def values(
        self, result: object, given: NDArray[Any], *, exempt: tuple[int, int] | None = None
    ) -> tuple[Image, Error]:
        """Check the result of a bloom for the input `as_input`, and return the same as `apply`."""
        whole = check_result(result, given, self.colours)
        real = self._real(whole[:, :, : self.colours])
        if exempt is not None:
            real[exempt[1], exempt[0]] = 0
        if not np.isfinite(real).all():
            y, x, channel = (int(index) for index in np.argwhere(~np.isfinite(real))[0])
            raise AssertionError(
                f"the result is {real[y, x, channel]} at x {x}, y {y}, channel {channel}\n"
                "  law: the bloom of finite values is finite"
            )
        if self.levels is not None:
            return real, self.levels.error(real, self.values_of(given))
        atol, rtol = _ERRORS[whole.dtype.name]
        if self.atol is not None or self.rtol is not None:
            atol, rtol = self.atol or 0.0, self.rtol or 0.0
        return real, atol + rtol * float(np.abs(real).max())

    def values_of(self, given: NDArray[Any]) -> Image:
        """Return an image that the bloom is given in real units, without alpha."""
        whole = given[:, :, np.newaxis] if given.ndim == 2 else given
        return self._real(whole[:, :, : self.colours])

    def _store(self, image: Image) -> NDArray[Any]:
        if self.levels is not None:
            image = self.levels.quantize(image)
        if self.dtype.kind == "u":
            largest = np.iinfo(self.dtype).max
            rounded: NDArray[Any] = np.rint(np.clip(image, 0, 1) * largest).astype(self.dtype)
            return rounded
        with np.errstate(over="ignore"):
            return image.astype(self.dtype)

    @staticmethod
    def _real(array: NDArray[Any]) -> Image:
        values: Image = array.astype(np.float64)
        return values / np.iinfo(array.dtype).max if array.dtype.kind == "u" else values


#: The probe of measurements that are given none.
DEFAULT: Final = Probe()


def small_probe(probe: Probe) -> Probe:
    """Return the probe with an image of at most 64 x 64 pixels, where the size does not matter."""
    width, height = probe.size
    return replace(probe, size=(min(width, 64), min(height, 64)))


def beside_multiple(side: int) -> int:
    """Return a multiple of 16 up to a side that is no power of 2, at least 48."""
    multiple = max(3, side // 16)
    return 16 * (multiple - (multiple & (multiple - 1) == 0))
