"""Why a fit is not good."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

NOTHING_FOUND: Final = "no bloom was found"
# A bloom explains more than changes of colours do: its difference is at most this share of theirs.
_BEYOND_COLOURS: Final = 0.8
# The least share of the difference that a wrong bloom explains of another one, the least that a
# change of colours explains where there is no other change, and the least that is added light.
_SOME, _MOST, _LIGHTER = 0.2, 0.9, 0.2
# Fewer values that differ from the image do not tell where a threshold is.
_FEW_VALUES: Final = 64
# A target is clipped if at least this share of its pixels has its largest value.
_CLIPPED: Final = 1e-3
_PIXELS: Final = 2**16

Array = NDArray[np.float64]


def is_found(target: Array, residual: Array, plain: Array) -> bool:
    """Return whether a bloom explains the target better than a change of each pixel's colour."""
    if np.count_nonzero(target != plain) < _FEW_VALUES:
        return False
    remaining = float(np.linalg.norm(residual)) / _BEYOND_COLOURS
    changed = float(np.linalg.norm(target - plain))
    return remaining < changed and remaining < _recoloured(plain, target)


def _recoloured(image: Array, target: Array) -> float:
    """Return how far an image is from a target after the best change of each pixel's colour.

    Least squares over polynomials of the square roots of red, green and blue, which have
    brightness, contrast, gamma, white balance and saturation: Finlayson et al., "Color Correction
    Using Root-Polynomial Regression", IEEE Transactions on Image Processing 24(5), 2015.
    """
    # Saturated pixels are not compared: there both are equal, whatever the colours were.
    is_saturated = (target >= 1).any(axis=-1) & (target == image).all(axis=-1)
    image, target = image[~is_saturated], target[~is_saturated]
    roots = np.sqrt(np.maximum(image, 0))
    red, green, blue = roots.T
    products = (red * green, green * blue, blue * red)
    powers = (roots**power for power in range(1, 5))
    terms = np.column_stack([np.ones(len(roots)), *powers, *products])
    step = -(-len(terms) // _PIXELS)
    weights = np.linalg.lstsq(terms[::step], target[::step], rcond=None)[0]
    return float(np.linalg.norm(terms @ weights - target))


def likely_cause(
    target: Array, residual: Array, plain: Array, method: str, vary: Sequence[str]
) -> str:
    """Return why a fit is not good."""
    if not (target - plain).any():
        return f"{NOTHING_FOUND}; the target is equal to the image"
    result = target + residual
    peak = float(target.max())
    share = float((target >= peak).any(axis=2).mean())
    if share >= _CLIPPED and result.max() > 1.05 * peak:
        return (
            f"the target is clipped at {peak:.4g} ({100 * share:.2g} % of its pixels); fit a "
            "target of floats, or an image that is clipped alike"
        )
    is_bloom = _is_bloom(target, residual, plain)
    encoding = _other_encoding(target, result)
    if encoding or not is_bloom:
        return "; ".join(filter(None, ("" if is_bloom else NOTHING_FOUND, encoding)))
    return (
        f"the method {method} does not reach it with {', '.join(vary)}; vary more fields, start "
        "from another preset, or raise max_calls"
    )


def _is_bloom(target: Array, residual: Array, plain: Array) -> bool:
    """Return whether a target may have a bloom, though not the one that was found."""
    if is_found(target, residual, plain):
        return True
    added = target - plain
    changed = float(np.linalg.norm(added))
    is_lighter = np.maximum(added, 0).sum() > _LIGHTER * np.abs(added).sum()
    explains_some = np.linalg.norm(residual) < (1 - _SOME) * changed
    is_recoloured = _recoloured(plain, target) < (1 - _MOST) * changed
    return bool(is_lighter and explains_some and not is_recoloured)


def _other_encoding(target: Array, result: Array) -> str:
    """Return what the target's exponent is, "" if it is about 1."""
    lit = (target > 0.01 * target.max()) & (result > 0.01 * result.max())
    lit &= target < target.max()
    if np.count_nonzero(lit) <= 100:
        return ""
    x, y = np.log(result[lit]), np.log(target[lit])
    exponent = float(np.cov(x, y)[0, 1] / max(np.var(x), 1e-12))
    if float(np.corrcoef(x, y)[0, 1]) <= 0.9 or 0.75 < exponent < 1.3:
        return ""
    return (
        f"the target has another encoding: about the power of {exponent:.2g}; decode it to linear "
        "light (vkbloom.read, --input-colour)"
    )
