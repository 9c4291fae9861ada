"""What a fit found, and its report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom._fit.intervals import Intervals
from vkbloom._fit.losses import Loss
from vkbloom._fit.threads import one_thread
from vkbloom._locks import cached_property
from vkbloom._numbers import check_number
from vkbloom._public import public
from vkbloom._renderer.frames import Frames
from vkbloom._settings.settings import Settings
from vkbloom._views import pictures
from vkbloom._views.markup import element

NOTHING_FOUND: Final = "no bloom was found"
# A bloom explains more than changes of colours do: its difference is at most this share of theirs.
_BEYOND_COLOURS: Final = 0.8
# The least share of the difference that a wrong bloom explains of another one, the least that a
# change of colours explains where there is no other change, and the least that is added light.
_SOME, _MAX_COLOUR_SHARE, _LIGHTER = 0.2, 0.9, 0.2
# Fewer values that differ from the image do not tell where a threshold is.
_FEW_VALUES: Final = 64
# A target is clipped if at least this share of its pixels has its largest value.
_CLIPPED: Final = 1e-3
_PIXELS: Final = 2**16
# Powers of fields that differ by less are equal.
_ROUND: Final = 0.1

Array = NDArray[np.float64]
#: Whether a search came close to its target.
Verdict = Literal["good", "fair", "poor"]


def is_found(target: Array, residual: Array, plain: Array) -> bool:
    """Return whether a bloom explains the target better than a change of each pixel's colour."""
    if np.count_nonzero(target != plain) < _FEW_VALUES:
        return False
    remaining = float(np.linalg.norm(residual)) / _BEYOND_COLOURS
    changed = float(np.linalg.norm(target - plain))
    return remaining < changed and remaining < _distance_after_recolouring(plain, target)


def _distance_after_recolouring(image: Array, target: Array) -> float:
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
    is_recoloured = _distance_after_recolouring(plain, target) < (1 - _MAX_COLOUR_SHARE) * changed
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


# The smallest shares of the loss without bloom that a good and a fair fit explain.
_GOOD, _FAIR = 0.95, 0.8


@public("vkbloom")
@dataclass(frozen=True, eq=False, kw_only=True)
class FitResult:
    """The settings that a fit found.

    Attributes
    ----------
    settings : Settings
    loss : float
        Of these settings, at the size of the image.
    start_loss : float
        Of the settings that the search started from.
    calls : int
        Number of renders, at all sizes.
    history : ndarray of float64, shape (calls,)
        The loss of each; the first ones may be of a smaller image.
    framebuffer : str
        Name of the framebuffer that was compared.
    loss_name : str
    vary : tuple of str
        The varied fields.
    frames : Frames
        With these settings.
    target : ndarray of float64, shape (H, W, 3)
    residual : ndarray of float64, shape (H, W, 3)
        The framebuffer less the target, in real units. With a target of 8 bits the framebuffer is
        clipped to 0..1, and saturated pixels of the target are not compared: they are 0.
    plain : ndarray of float64, shape (H, W, 3)
        The picture without bloom, compared like the framebuffer; black if the framebuffer is not
        ``final``.
    explained : float
        The share of the difference between target and `plain` that the bloom explains: 1 less the
        ratio of `loss` to the loss of `plain`. At most 1, and 0 or less if it explains nothing.
    covariance : ndarray of float64, shape (n, n)
        Of the n varied fields in the order of `vary`: infinite variances of those that are not
        determined, NaN for flags, choices and integers. It and what follows take some renders when
        they are asked for, by the default renderer if that of the fit is closed.
    correlation : ndarray of float64, shape (n, n)
        1 or -1 for fields of which only a combination is determined.
    undetermined : tuple of dict of str to float
        Combinations of fields that can change without a change of the picture. The weights are
        relative changes of fields that are searched on logarithmic scales, such as 1 and -1 where
        only the product of two counts; of others, changes as a share of their range.
    summary : str
        The intervals of 95 % and what is not determined in words.
    verdict : {"good", "fair", "poor"}
        Good: at least 0.95 are explained. Fair: 0.8. Poor: less, or no more than a change of each
        pixel's colour explains, such as brightness or contrast.
    cause : str
        What the likely cause is if the verdict is not good: no bloom in the target; a target that
        is clipped or encoded; or another method. `translate` says what differs instead, and has a
        verdict that depends on the loss alone.
    """

    settings: Settings
    loss: float
    start_loss: float
    calls: int
    history: NDArray[np.float64]
    framebuffer: str
    loss_name: str
    vary: tuple[str, ...]
    frames: Frames
    target: NDArray[np.float64]
    residual: NDArray[np.float64]
    plain: NDArray[np.float64]
    explained: float
    _intervals: Intervals | None = None

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={_format(self.settings.value_of(name))}" for name in self.vary)
        return (
            f"<vkbloom.FitResult of {self.settings.method}: {values}; loss {self.loss:.4g} after "
            f"{self.calls} calls; {self.verdict}>"
        )

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the search found the picture."""
        if self.explained < _FAIR or not is_found(self.target, self.residual, self.plain):
            return "poor"
        return "good" if self.explained >= _GOOD else "fair"

    @cached_property
    def cause(self) -> str:
        """The likely cause of a verdict that is not good; empty if it is good."""
        if self.verdict == "good":
            return ""
        return likely_cause(self.target, self.residual, self.plain, self.settings.method, self.vary)

    @cached_property
    def covariance(self) -> NDArray[np.float64]:
        """The covariance of the varied fields, in the order of `vary`."""
        with one_thread():
            return self._known_intervals.covariance()

    @cached_property
    def correlation(self) -> NDArray[np.float64]:
        """The correlation of the varied fields, -1 to 1, in the order of `vary`."""
        with one_thread():
            return self._known_intervals.correlation()

    @cached_property
    def undetermined(self) -> tuple[dict[str, float], ...]:
        """The combinations of fields that the picture does not determine."""
        with one_thread():
            return self._known_intervals.undetermined()

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Return the values of a varied field that the picture allows.

        Parameters
        ----------
        name : str
            A number or an integer of `vary`.
        level : float
            The share of pictures with other noise whose interval has the true value, between 0 and
            1.

        Returns
        -------
        (float, float)
            An end is infinite if the picture does not determine it.

        Raises
        ------
        ValueError
            The field was not varied, or is a flag or a choice; the loss is "flip" or a callable,
            which have no likelihood; or the image was an `Image` of a renderer that is closed.

        Notes
        -----
        The estimate plus and minus quantiles of Student's distribution times the standard
        deviation, where the sum of squares has that form. Elsewhere, as near the end of a range,
        the profile likelihood: the values for which the least sum of squares over the other fields
        is at most the quantile's square, in variances of the noise, above the least of all. Venzon
        and Moolgavkar, Applied Statistics 37(1), 1988.
        """
        if name not in self.vary:
            raise ValueError(f"name: {name!r} was not varied; these were: {', '.join(self.vary)}")
        level = check_number("level", level, 0, 1)
        if not 0 < level < 1:
            raise ValueError(f"level: {level:g} is not between 0 and 1")
        with one_thread():
            return self._known_intervals.interval(name, level)

    @cached_property
    def summary(self) -> str:
        """The intervals of 95 % of the varied fields, and what is not determined, as one line.

        Where there are none, why.
        """
        try:
            numbers = [name for name in self.vary if not self._known_intervals.is_choice(name)]
            ends = {name: self.interval(name) for name in numbers}
            groups = [group for group in self.undetermined if len(group) > 1]
        except ValueError as error:
            return str(error)
        parts = [f"{name} {_interval_text(*pair)}" for name, pair in ends.items()]
        free = [name for name, pair in ends.items() if not any(map(math.isfinite, pair))]
        combined = {name for group in groups for name in group}
        words = [name for name in free if name not in combined] + [*map(_product, groups)]
        known = ", ".join(part for part, name in zip(parts, ends, strict=True) if name not in free)
        texts = [f"95 %: {known}"] if known else []
        return "; ".join([*texts, f"not determined: {', '.join(words)}"] if words else texts)

    @property
    def _known_intervals(self) -> Intervals:
        if self._intervals is None:
            raise ValueError(
                f"loss: {self.loss_name!r} has no likelihood, so there are no intervals; fit with "
                "'relative', 'l2' or 'log'"
            )
        return self._intervals

    @property
    def words(self) -> str:
        """The verdict with its cause."""
        return f"{self.verdict}: {self.cause}" if self.cause else self.verdict

    def _repr_html_(self) -> str:
        """Return a report with pictures."""
        fitted = self.target + self.residual
        peak = float(np.percentile(self.target.max(axis=2), 99.9)) or 1.0
        largest = float(np.abs(self.residual).max()) or 1.0
        size = pictures.thumbnail_size(self.target)
        shown = (
            (name, pictures.picture((values / unit).astype(np.float32), size=size), unit)
            for name, values, unit in (
                (self.framebuffer, fitted, peak),
                ("target", self.target, peak),
                ("difference", np.abs(self.residual), largest),
            )
        )
        summary = f", from a loss ({self.loss_name}) of {self.start_loss:.4g}"
        report = element(
            "div",
            element("div", element("b", repr(self)[1:-1]), summary),
            element("div", self.words),
            element("div", self.summary),
            pictures.thumbnails((name, pixels, f"1 is {unit:.4g}") for name, pixels, unit in shown),
            element("code", repr(self.settings), style=pictures.CODE),
            style="color:inherit;font-size:13px;max-width:68em",
        )
        return str(report)


def loss_text(loss: Loss) -> str:
    """Return the name of a loss."""
    return loss if isinstance(loss, str) else getattr(loss, "__name__", type(loss).__name__)


def _interval_text(low: float, high: float) -> str:
    if math.isinf(high):
        return f"at least {low:.4g}"
    return f"at most {high:.4g}" if math.isinf(low) else f"{low:.4g} to {high:.4g}"


def _product(group: dict[str, float]) -> str:
    """Return the powers of fields that can change together, as a product."""
    least = min(map(abs, group.values()))
    powers = {name: weight / least for name, weight in group.items()}
    text = ""
    for name, power in sorted(powers.items(), key=lambda item: item[1] < 0):
        exponent = "" if abs(abs(power) - 1) < _ROUND else f"^{abs(power):.2g}"
        sign = " * " if power > 0 else " / "
        text += f"{sign if text else ''}{name}{exponent}"
    return text


def _format(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else repr(value)
