"""How far a framebuffer is from a target."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.srgb import decode_srgb, encode_srgb
from vkbloom._views.comparison import flip_map

LossName = Literal["relative", "l2", "log", "flip"]
#: A loss by name, or a callable of two arrays (the framebuffer and the target) of float64.
Loss = LossName | Callable[[NDArray[np.float64], NDArray[np.float64]], float]

_NAMES: Final = get_args(LossName)
#: Values under this share of the largest one count as it in "log".
DARK: Final = 1e-4
_MAX_PIXELS: Final = 2**13
# How far decoded levels may be from those computed here: curves of profiles have 16 bits.
_LEVEL: Final = 2e-5


class Curve(NamedTuple):
    """The levels of 8 bits; without a decoder, all values."""

    encode: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    decode: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None

    def quantize(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values of 0 to 1 at their nearest levels."""
        if self.decode is None:
            return values
        return self.decode(np.rint(255 * self.encode(values)) / 255)


_CONTINUOUS: Final = Curve(np.asarray, None)
_CURVES: Final = (
    Curve(np.asarray, np.asarray),
    Curve(encode_srgb, decode_srgb),
    Curve(lambda values: values ** (1 / 2.2), lambda values: values**2.2),
)


@dataclass(frozen=True)
class Measure:
    """A loss against one target.

    - `target`: ndarray of float64, shape (H, W, 3).
    - `curve`: Of a target of 8 bits, the curve of its levels. Framebuffers are clipped and rounded
      to them, as the target was: where a bloom is less than half a level, the target has none.
    - `saturated`: ndarray of bool, shape (H, W): pixels that are not compared. A saturated pixel
      tells only that the light is at least 1, and each program clips its colour in its own way.
    """

    target: NDArray[np.float64]
    loss: Loss
    curve: Curve | None = None
    saturated: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        if self.loss in ("relative", "log") and not self.target.max() > 0:
            raise ValueError(
                f'target: it is black, so the loss {self.loss!r} is undefined; use "l2"'
            )

    @classmethod
    def of(cls, target: NDArray[Any], loss: Loss) -> Measure:
        """Return the measure for an array as it was given."""
        values = light(target)
        curve = _curve_of(target)
        whole = cls(values, loss, curve)
        return whole if curve is None else whole._without(values.max(axis=2) >= 1)

    def reduce(self, factor: int) -> Measure:
        """Return the measure for an image that is reduced by boxes."""
        # Means of levels are not levels, but they are still at most 1.
        curve = None if self.curve is None else _CONTINUOUS
        target = reduce(self.target, factor)
        smaller = dataclasses.replace(self, target=target, curve=curve, saturated=None)
        if self.saturated is None:
            return smaller
        shares = reduce(self.saturated[:, :, np.newaxis].astype(np.float64), factor)
        return smaller._without(shares[:, :, 0] > 0)

    def in_floats(self) -> Measure:
        """Return the measure of framebuffers that are clipped like the target, but not rounded."""
        return self if self.curve is None else dataclasses.replace(self, curve=_CONTINUOUS)

    def level_deviations(self) -> NDArray[np.float64] | None:
        """Return the standard deviation of each value of a target of 8 bits by its rounding.

        The error of rounding is uniform over a level, so its variance is 1/12 of the level's
        square: Bennett, "Spectra of Quantized Signals", Bell System Technical Journal 27(3), 1948.
        """
        if self.curve is None or self.curve.decode is None:
            return None
        level = self.curve.encode(np.clip(self.target, 0.0, 1.0))
        ends = (np.clip(level + half / 255, 0.0, 1.0) for half in (-0.5, 0.5))
        low, high = (self.curve.decode(end) for end in ends)
        return np.asarray((high - low) / math.sqrt(12))

    def _without(self, saturated: NDArray[np.bool_]) -> Measure:
        """Return the measure without some pixels, or with all if nothing else would be left."""
        is_partial = saturated.any() and not saturated.all()
        return dataclasses.replace(self, saturated=saturated) if is_partial else self

    def as_target(self, array: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a framebuffer as a target of 8 bits has it, equal to it where it is saturated."""
        if self.curve is None:
            return array
        held = self.curve.quantize(np.clip(array, 0.0, 1.0))
        if self.saturated is not None:
            held[self.saturated] = self.target[self.saturated]
        return held

    @property
    def is_rounded(self) -> bool:
        """Whether framebuffers are rounded to levels of 8 bits."""
        return self.curve is not None and self.curve.decode is not None

    @property
    def is_sum(self) -> bool:
        """Whether the loss is the norm of `residual`."""
        return self.loss in ("relative", "l2", "log")

    def residual(self, array: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return differences whose root of the sum of squares is the loss.

        Of large images those of boxes of pixels: a bloom is smooth, and derivatives of millions of
        values take longer than the renders.
        """
        factor = math.ceil(math.sqrt(array.shape[0] * array.shape[1] / _MAX_PIXELS))
        return self._differences(reduce(self.as_target(array), factor), reduce(self.target, factor))

    def differences(self, array: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the differences of all values, of the array's shape, whose norm is the loss."""
        return self._differences(self.as_target(array), self.target).reshape(array.shape)

    def scales(self, array: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivative of each difference by its value."""
        scales = np.full(array.shape, 1 / math.sqrt(array.size))
        if self.loss == "relative":
            scales[:] = 1 / float(np.linalg.norm(self.target))
        elif self.loss == "log":
            bright = array > DARK * float(self.target.max())
            scales *= np.where(bright, 1 / (math.log(10) * np.where(bright, array, 1.0)), 0.0)
        if self.curve is not None:
            scales[(array < 0) | (array > 1)] = 0
            if self.saturated is not None:
                scales[self.saturated] = 0
        return scales

    def _differences(
        self, array: NDArray[np.float64], target: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        if self.loss == "log":
            floor = DARK * float(self.target.max())
            first, second = (np.log10(np.maximum(item, floor)) for item in (array, target))
            return np.ravel(first - second) / math.sqrt(array.size)
        scale = math.sqrt(array.size)
        if self.loss == "relative":
            scale = float(np.linalg.norm(target))
        return np.ravel(array - target) / scale

    def __call__(self, array: NDArray[np.float64]) -> float:
        """Return the loss of a framebuffer; what is not finite counts as the largest float."""
        array = self.as_target(array)
        if self.is_sum:
            with np.errstate(over="ignore"):
                value = float(np.linalg.norm(self._differences(array, self.target)))
        elif self.loss == "flip":
            value = float(flip_map(self.target, array).mean(dtype=np.float64))
        else:
            assert callable(self.loss)
            value = float(self.loss(array, self.target))
        return value if math.isfinite(value) else float(np.finfo(np.float64).max)

    def explained_share(self, loss: float, plain: NDArray[np.float64]) -> float:
        """Return the share of the loss of a picture without bloom that is gone."""
        without = self(plain)
        return 1 - loss / without if without > 0 else 0.0


def find_loss(loss: Any) -> Loss:
    """Return a loss, or raise ValueError."""
    if callable(loss):
        return loss  # type: ignore[no-any-return]
    if not isinstance(loss, str) or loss not in _NAMES:
        raise ValueError(f"loss: {loss!r} is not one of {', '.join(_NAMES)}, or a callable")
    return loss  # type: ignore[return-value]


def _curve_of(target: NDArray[Any]) -> Curve | None:
    """Return the curve of an array of 8-bit levels, also if `vkbloom.read` has decoded them."""
    if target.dtype.kind == "u":
        return _CURVES[0]
    values = target[:, :, :3].astype(np.float64)
    if not (values.min() >= 0 and values.max() <= 1):  # also NaN
        return None
    return next(
        (item for item in _CURVES if np.abs(item.quantize(values) - values).max() < _LEVEL), None
    )


def light(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return red, green and blue as float64; uint8 is scaled to 0..1, not finite ones are 0."""
    values = array[:, :, :3].astype(np.float64)
    if array.dtype.kind == "u":
        return values / np.iinfo(array.dtype).max
    return np.nan_to_num(values, copy=False, nan=0.0, posinf=0.0, neginf=0.0)


def reduce(array: NDArray[Any], factor: int) -> NDArray[Any]:
    """Return the means of boxes of factor x factor pixels, without what is left at the end."""
    if factor == 1:
        return array
    height, width = (side // factor for side in array.shape[:2])
    cut = array[: height * factor, : width * factor].astype(np.float64)
    boxes = cut.reshape(height, factor, width, factor, array.shape[2]).mean(axis=(1, 3))
    means: NDArray[Any] = np.rint(boxes) if array.dtype.kind == "u" else boxes
    return means.astype(array.dtype)
