"""Images that a blur or bloom is probed with, and what comes back of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vkbloom.checks import check_number, check_size

__all__ = ["Bloom", "Image", "Probe"]

#: Real units: 0 to 1 for what is stored as integers.
Image: TypeAlias = NDArray[np.float64]

#: What is tested: takes an image and returns one of the same height and width.
Bloom: TypeAlias = Callable[[NDArray[Any]], NDArray[Any]]

#: (atol, rtol) of a result's dtype, rtol of its largest value. Integers: two levels, half a level
#: for each rounding of a result that went through up to four buffers. Half: four roundings of
#: 2**-11. Float: the accuracy of lavapipe's linear filter; filters by hand are a hundred times as
#: exact.
_ERRORS: Final[Mapping[str, tuple[float, float]]] = {
    "uint8": (2 / 255, 0.0),
    "uint16": (2 / 65535, 0.0),
    "float16": (0.0, 2e-3),
    "float32": (0.0, 1e-4),
    "float64": (0.0, 1e-4),
}


@dataclass(frozen=True, kw_only=True)
class Probe:
    """The kind of image that the laws are tried on, and how exact the results have to be.

    Parameters
    ----------
    size : (int, int)
        Width and height in pixels. A response must not reach the border, where a law is about the
        whole of it.
    channels : int or None
        1 to 4; None: images of shape (H, W). Of 4, the last is alpha: it is 1 in all images, and
        it is not looked at.
    dtype : str or dtype
        Of the images: "uint8", "uint16" (both 0 to 1 in real units), "float16", "float32" or
        "float64".
    value : float
        The brightest value of an image in real units, 1 at most for integers. A method that
        clamps, or that has a threshold, is linear on one side of it only.
    atol, rtol : float or None
        By how much a value of a result may be off, absolutely and relative to the largest value of
        that result. None: by the result's dtype, as of `None` for both, two levels of an integer,
        2e-3 of half and 1e-4 of float.
    seed : int
        Of the noise in images of noise.

    Raises
    ------
    ValueError, TypeError
        A field is out of range or of another type.

    See Also
    --------
    assert_superposition : One of the laws that take a probe.

    Examples
    --------
    >>> from vkbloom import testing
    >>> probe = testing.Probe(size=(32, 24), dtype="float16", value=4.0)
    >>> probe.centre
    (16, 12)
    >>> testing.assert_gain(lambda image: image, 1.0, probe)
    """

    size: tuple[int, int] = (65, 65)
    channels: int | None = 3
    dtype: Any = "float32"
    value: float = 1.0
    atol: float | None = None
    rtol: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", check_size("size", self.size))
        if self.channels not in (None, 1, 2, 3, 4):
            raise ValueError(f"channels: {self.channels!r} is out of range, 1 to 4 or None")
        dtype = np.dtype(self.dtype)
        if dtype.name not in _ERRORS:
            raise ValueError(f"dtype: {dtype} is not one of {', '.join(_ERRORS)}")
        object.__setattr__(self, "dtype", dtype)
        largest = 1.0 if dtype.kind == "u" else float(np.finfo(dtype).max)
        check_number("value", self.value, math.ulp(0.0), largest)
        for name in ("atol", "rtol"):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name), 0.0, math.inf)

    @property
    def centre(self) -> tuple[int, int]:
        """X and y of the pixel in the middle."""
        return self.size[0] // 2, self.size[1] // 2

    @property
    def colours(self) -> int:
        """How many channels are looked at."""
        return 1 if self.channels is None else min(self.channels, 3)

    def flat(self, value: float) -> Image:
        """Return an image of one value."""
        return np.full((self.size[1], self.size[0], self.colours), value)

    def point(self, place: tuple[int, int], value: float) -> Image:
        """Return a black image with one lit pixel at (x, y)."""
        image = self.flat(0.0)
        image[place[1], place[0]] = value
        return image

    def noise(self, index: int, highest: float) -> Image:
        """Return random values, 0 to `highest`, rounded to what the dtype holds."""
        generator = np.random.default_rng((self.seed, index))
        image = generator.random((self.size[1], self.size[0], self.colours)) * highest
        return self._real(self._stored(image))

    def apply(
        self, bloom: Bloom, image: Image, *, exempt: tuple[int, int] | None = None
    ) -> tuple[Image, float]:
        """Return what the bloom makes of an image, and by how much each value may be off.

        Parameters
        ----------
        bloom : callable
        image : ndarray of float64, shape (H, W, C)
            In real units, C as in `colours`.
        exempt : (int, int), optional
            x and y of a pixel that is not looked at: it is 0 in what is returned.

        Returns
        -------
        result : ndarray of float64, shape (H, W, C)
            In real units. Of a result with alpha, its colours.
        error : float

        Raises
        ------
        TypeError
            The bloom is not callable, or returns no array of numbers.
        ValueError
            What it returns has another height, width or number of channels.
        AssertionError
            What it returns is not finite.
        """
        __tracebackhide__ = True
        result, dtype = self._called(bloom, image)
        if exempt is not None:
            result[exempt[1], exempt[0]] = 0
        if not np.isfinite(result).all():
            y, x, channel = (int(index) for index in np.argwhere(~np.isfinite(result))[0])
            raise AssertionError(
                f"the result is {result[y, x, channel]} at x {x}, y {y}, channel {channel}\n"
                "  law: what a bloom makes of finite values is finite"
            )
        atol, rtol = _ERRORS[dtype]
        if self.atol is not None or self.rtol is not None:
            atol, rtol = self.atol or 0.0, self.rtol or 0.0
        return result, atol + rtol * float(np.abs(result).max())

    def _called(self, bloom: Bloom, image: Image) -> tuple[Image, str]:
        if not callable(bloom):
            raise TypeError(f"bloom: a callable is needed, not {bloom!r}")
        stored = self._stored(image)
        if self.channels == 4:
            opaque = np.iinfo(self.dtype).max if self.dtype.kind == "u" else 1
            alpha = np.full((*stored.shape[:2], 1), opaque, self.dtype)
            stored = np.concatenate([stored, alpha], axis=2)
        given = np.ascontiguousarray(stored[:, :, 0] if self.channels is None else stored)
        result = bloom(given)
        if isinstance(result, Mapping):
            raise TypeError(
                "bloom: it returns a mapping; name the framebuffer, for example "
                "lambda image: renderer.apply(image, settings)['bloom']"
            )
        array = np.asarray(result)
        if array.dtype.name not in _ERRORS:
            raise TypeError(f"bloom: it returns {array.dtype}, not one of {', '.join(_ERRORS)}")
        whole = array[:, :, np.newaxis] if array.ndim == 2 else array
        if whole.ndim != 3 or whole.shape[:2] != image.shape[:2]:
            raise ValueError(f"bloom: it returns shape {array.shape} for {given.shape}")
        if whole.shape[2] < self.colours:
            raise ValueError(f"bloom: it returns {whole.shape[2]} channels for {self.colours}")
        return self._real(whole[:, :, : self.colours]), array.dtype.name

    def _stored(self, image: Image) -> NDArray[Any]:
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
