"""How far a framebuffer is from a target."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom.views.comparison import flip_map

__all__ = ["Loss", "LossName", "Measure", "light", "loss_named", "reduced"]

LossName = Literal["relative", "l2", "log", "flip"]
#: A loss by name, or a callable of two arrays (the framebuffer and the target) of float64.
Loss = LossName | Callable[[NDArray[np.float64], NDArray[np.float64]], float]

_NAMES: Final = get_args(LossName)
# Values under this share of the largest one count as it in "log".
_DARK: Final = 1e-4
_MOST_PIXELS: Final = 2**13


@dataclass(frozen=True)
class Measure:
    """A loss against one target.

    `target`: ndarray of float64, shape (H, W, 3).
    """

    target: NDArray[np.float64]
    loss: Loss

    def __post_init__(self) -> None:
        if self.loss in ("relative", "log") and not self.target.max() > 0:
            raise ValueError(
                f'target: it is black, so the loss {self.loss!r} is undefined; use "l2"'
            )

    @property
    def is_sum(self) -> bool:
        """Whether the loss is the norm of `residual`."""
        return self.loss in ("relative", "l2", "log")

    def residual(self, array: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return differences whose root of the sum of squares is the loss.

        Of large images those of boxes of pixels: a bloom is smooth, and derivatives of millions of
        values take longer than the renders.
        """
        factor = math.ceil(math.sqrt(array.shape[0] * array.shape[1] / _MOST_PIXELS))
        return self._differences(reduced(array, factor), reduced(self.target, factor))

    def differences(self, array: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the differences of all values, of the array's shape, whose norm is the loss."""
        return self._differences(array, self.target).reshape(array.shape)

    def scales(self, array: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivative of each difference by its value."""
        if self.loss == "relative":
            return np.full(array.shape, 1 / float(np.linalg.norm(self.target)))
        scales = np.full(array.shape, 1 / math.sqrt(array.size))
        if self.loss == "log":
            bright = array > _DARK * float(self.target.max())
            scales *= np.where(bright, 1 / (math.log(10) * np.where(bright, array, 1.0)), 0.0)
        return scales

    def _differences(
        self, array: NDArray[np.float64], target: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        if self.loss == "log":
            floor = _DARK * float(self.target.max())
            first, second = (np.log10(np.maximum(one, floor)) for one in (array, target))
            return np.ravel(first - second) / math.sqrt(array.size)
        scale = math.sqrt(array.size)
        if self.loss == "relative":
            scale = float(np.linalg.norm(target))
        return np.ravel(array - target) / scale

    def __call__(self, array: NDArray[np.float64]) -> float:
        """Return the loss of a framebuffer; what is not finite counts as the largest float."""
        if self.is_sum:
            with np.errstate(over="ignore"):
                value = float(np.linalg.norm(self._differences(array, self.target)))
        elif self.loss == "flip":
            value = float(flip_map(self.target, array).mean(dtype=np.float64))
        else:
            assert callable(self.loss)
            value = float(self.loss(array, self.target))
        return value if math.isfinite(value) else float(np.finfo(np.float64).max)


def loss_named(loss: Any) -> Loss:
    """Return a loss, or raise ValueError."""
    if callable(loss):
        return loss  # type: ignore[no-any-return]
    if not isinstance(loss, str) or loss not in _NAMES:
        raise ValueError(f"loss: {loss!r} is not one of {', '.join(_NAMES)}, or a callable")
    return loss  # type: ignore[return-value]


def light(array: NDArray[Any]) -> NDArray[np.float64]:
    """Return red, green and blue as float64; uint8 is scaled to 0..1, not finite ones are 0."""
    values = array[:, :, :3].astype(np.float64)
    if array.dtype.kind == "u":
        return values / np.iinfo(array.dtype).max
    return np.nan_to_num(values, copy=False, nan=0.0, posinf=0.0, neginf=0.0)


def reduced(array: NDArray[Any], factor: int) -> NDArray[Any]:
    """Return the means of boxes of factor x factor pixels, without what is left at the end."""
    if factor == 1:
        return array
    height, width = (side // factor for side in array.shape[:2])
    cut = array[: height * factor, : width * factor].astype(np.float64)
    boxes = cut.reshape(height, factor, width, factor, array.shape[2]).mean(axis=(1, 3))
    means: NDArray[Any] = np.rint(boxes) if array.dtype.kind == "u" else boxes
    return means.astype(array.dtype)
