"""Name the single cause of the difference of two images, such as a gain or a missing half texel."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom._io.picture import check_pixels
from vkbloom._io.srgb import decode_srgb, encode_srgb
from vkbloom._public import public
from vkbloom._views.comparison import pair_of
from vkbloom._views.shifts import MIN_SHIFT, find_shift, rms

Cause = Literal[
    "equal",
    "gain",
    "shift",
    "gamma",
    "channels",
    "flip",
    "alpha",
    "clamp",
    "nan",
    "size",
    "rounding",
]
_Image = NDArray[np.float64]
_Map = Callable[[_Image], _Image]

# What a value may be off by for reasons that are no cause: a level of integers, and for floats
# a few roundings to half of 2**-11 each.
_RELATIVE: Final = 2.0**-8
# A cause explains a difference if at most this share of it (root mean square) remains.
_REMAINS: Final = 0.5
# Rounding to the nearest value reaches half of the largest allowed error, unless few values differ.
_MIN_ROUNDING: Final = 0.3
_FEW: Final = 100


@public("vkbloom.testing")
@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The single cause of the difference of two images.

    Attributes
    ----------
    cause : str or None
        "equal", "gain", "shift", "gamma", "channels", "flip", "alpha", "clamp", "nan", "size" or
        "rounding". None: no single one of these causes explains the difference.
    value : object
        The figure of the cause. "gain": the factor. "shift": (x, y) in pixels, to the right and
        down. "gamma": the exponent. "channels": the order, such as "bgr", or the two numbers of
        channels. "flip": "x", "y" or "xy". "alpha": "premultiplied" or "straight". "clamp": the
        limit. "nan": the number of values. "size": (width, height) of `b`. "rounding": "half",
        "float", "8-bit" or "16-bit". None without a cause.
    residual : float
        Root mean square of what remains after the cause is undone, in real units (integers are
        scaled to 0..1).
    text : str
        What `str` returns.
    """

    cause: Cause | None
    value: Any = None
    residual: float = 0.0
    text: str = ""

    def __str__(self) -> str:
        return self.text

    @property
    def summary(self) -> str:
        """The text, and the residual."""
        return f"{self.text}; residual {self.residual:.3g}"


@dataclass(frozen=True)
class _Candidate:
    """An assumed cause: `of_a` maps the first image to what the second one would be."""

    cause: Cause
    value: Any
    text: str
    of_a: _Map
    is_of_b: bool = False  # it maps the second image to the first one


@public("vkbloom.testing")
def diagnose(a: NDArray[Any], b: NDArray[Any]) -> Diagnosis:
    """Name the single cause of the difference of `b` from `a`, with its figure.

    A cause is named only if it explains every value: within one level of the coarser integer type,
    within 0.4 % for floats, and so that at most half of the difference remains. For a shift, a
    tenth of the difference may remain, as its interpolation is unknown; it needs scikit-image.

    Parameters
    ----------
    a : ndarray, shape (H, W) or (H, W, C)
        The reference: uint8, uint16, float16, float32 or float64. Integers are scaled to 0..1.
    b : ndarray
        Such an image; another shape or dtype is allowed.

    Returns
    -------
    Diagnosis

    Examples
    --------
    >>> from vkbloom import testing
    >>> image = np.random.default_rng(0).random((16, 16, 3), dtype=np.float32)
    >>> print(testing.diagnose(image, np.float32(0.97) * image))
    gain: the second image is the first x 0.97
    >>> print(testing.diagnose(image, image[..., ::-1]))
    channels: the second image has the order bgr
    >>> testing.diagnose(image, np.roll(image, 3, 1)).value
    (3.0, 0.0)
    """
    a, b = check_pixels("a", a), check_pixels("b", b)
    if a.shape != b.shape:
        return _of_shapes(a, b)
    pair = pair_of(a, b)
    if not (pair.error.any() or pair.unequal.any()):
        return Diagnosis(cause="equal", text="equal: all values are the same")
    plain_a, plain_b = pair.a, pair.b
    step = max(_step(a), _step(b))
    # The least difference of two halves.
    tiny = 2.0**-24 if np.float16 in (a.dtype, b.dtype) else 0.0
    if unequal := int(pair.unequal.sum()):
        return _of_not_finite(plain_a, plain_b, unequal, step)
    # Large values of float64 would overflow when they are squared.
    scale = max(float(np.abs(plain_a).max()), float(np.abs(plain_b).max()))
    if scale > 1e150:
        plain_a, plain_b = plain_a / scale, plain_b / scale
    result = _of_rounding(a, b, plain_a, plain_b)
    if result is None:
        for candidate in _candidates(plain_a, plain_b):
            result = _judge(candidate, plain_a, plain_b, step, tiny)
            if result is not None:
                break
    return result or _of_shift(plain_a, plain_b, step)


def _none(a: _Image, b: _Image) -> Diagnosis:
    return Diagnosis(
        cause=None, residual=rms(b - a), text="no single known cause explains the difference"
    )


def _of_shapes(a: NDArray[Any], b: NDArray[Any]) -> Diagnosis:
    """Return the diagnosis of another size or number of channels."""
    count = min(a.shape[2], b.shape[2])
    height, width = a.shape[:2]
    rows = ((np.arange(height) + 0.5) * b.shape[0] / height).astype(np.intp)
    columns = ((np.arange(width) + 0.5) * b.shape[1] / width).astype(np.intp)
    scaled = b[rows[:, np.newaxis], columns, :count]
    residual = rms(pair_of(a[:, :, :count], scaled).error)
    if a.shape[:2] == b.shape[:2]:
        text = f"channels: {a.shape[2]} against {b.shape[2]}"
        value = (a.shape[2], b.shape[2])
        return Diagnosis(cause="channels", value=value, residual=residual, text=text)
    sizes = " against ".join(f"{image.shape[1]} x {image.shape[0]}" for image in (a, b))
    value = (b.shape[1], b.shape[0])
    return Diagnosis(cause="size", value=value, residual=residual, text=f"size: {sizes}")


def _of_not_finite(a: _Image, b: _Image, count: int, step: float) -> Diagnosis:
    """Return the diagnosis of images of which one has NaN or infinity where the other has not."""
    if (np.abs(b - a) > step + _RELATIVE * np.abs(a)).any():
        return _none(a, b)
    values = "1 value is" if count == 1 else f"{count} values are"
    return Diagnosis(
        cause="nan",
        value=count,
        residual=rms(b - a),
        text=f"nan: {values} NaN or infinite in one image only",
    )


def _of_rounding(
    a: NDArray[Any], b: NDArray[Any], real_a: _Image, real_b: _Image
) -> Diagnosis | None:
    """Return the diagnosis if the images differ by the rounding of one of them, or None."""
    error = np.abs(real_b - real_a)
    largest = np.maximum(np.abs(real_a), np.abs(real_b))
    for name, allowed, is_stored in (
        ("float", 2.0**-20 * largest, a.dtype.kind == b.dtype.kind == "f"),
        ("16-bit", 1 / 65535, _has_levels(real_a, 65535) or _has_levels(real_b, 65535)),
        ("half", 2.0**-10 * largest + 2.0**-24, _is_half(real_a) or _is_half(real_b)),
        ("8-bit", 1 / 255, _has_levels(real_a, 255) or _has_levels(real_b, 255)),
    ):
        if not is_stored or (error > allowed * (1 + 1e-9)).any():
            continue
        # Noise that is much smaller than the steps of one image is not their rounding.
        is_small = name != "float" and (error <= _MIN_ROUNDING * allowed).all()
        if not is_small or np.count_nonzero(error) < _FEW:
            return Diagnosis(
                cause="rounding",
                value=name,
                residual=rms(error),
                text=f"rounding: {name}; the values differ by {float(error.max()):.3g} at most",
            )
    return None


def _candidates(a: _Image, b: _Image) -> Iterator[_Candidate]:
    """Yield the assumed causes: those without a parameter first, as they explain more."""
    for name, axes in (("x", (1,)), ("y", (0,)), ("xy", (0, 1))):
        words = {"x": "left and right", "y": "top and bottom", "xy": "both axes"}[name]
        yield _Candidate("flip", name, f"{words} are swapped", partial(np.flip, axis=axes))
    colours = min(a.shape[2], 3)
    if colours == 3:
        for order in itertools.permutations(range(3)):
            if order != (0, 1, 2):
                name = "".join("rgb"[index] for index in order)
                channels = (*order, *range(3, a.shape[2]))
                text = f"the second image has the order {name}"
                yield _Candidate("channels", name, text, partial(np.take, indices=channels, axis=2))
    if a.shape[2] == 4:
        text = "the second image is multiplied by alpha"
        yield _Candidate("alpha", "premultiplied", text, _multiply)
        yield _Candidate("alpha", "straight", "the second image is divided by alpha", _divide)
    yield from _limits(a, b)
    yield from _curves(a, b, colours)


def _limits(a: _Image, b: _Image) -> Iterator[_Candidate]:
    """Yield clamps of either image at its own largest or smallest value."""
    for name, image, other in (("second", b, a), ("first", a, b)):
        high, low = float(image.max()), float(image.min())
        for limit, beyond, text, bound in (
            (high, other > high, f"clamped at {high:.4g}", np.minimum),
            (low, other < low, f"clamped at {low:.4g} from below", np.maximum),
        ):
            # The change of a single pixel is no clamp.
            if np.count_nonzero(beyond.any(axis=2)) > 1:
                yield _Candidate(
                    "clamp",
                    limit,
                    f"the {name} image is {text}",
                    partial(bound, limit),
                    is_of_b=name == "first",
                )


def _curves(a: _Image, b: _Image, colours: int) -> Iterator[_Candidate]:
    """Yield a gain and the curves that map the colours best, alpha kept or mapped, too."""
    maps: list[tuple[Cause, float, str, _Map]] = []
    x, y = a[:, :, :colours], b[:, :, :colours]
    # Values at the limit of integers may be clamped.
    inside = (y < y.max()) & (x < x.max())
    if not inside.any():
        inside = np.ones(x.shape, np.bool_)
    power = float((x * x)[inside].sum())
    if power:
        gain = float((x * y)[inside].sum()) / power
        text = f"the second image is the first x {gain:.4g}"
        maps.append(("gain", gain, text, partial(np.multiply, gain)))
    lit = inside & (x > 0.02 * x.max(initial=0)) & (y > 0) & (np.abs(x - 1) > 1e-3)
    if lit.any():
        logs = np.log(x[lit]), np.log(y[lit])
        exponent = float((logs[0] * logs[1]).sum()) / float((logs[0] ** 2).sum())
        text = f"the second image is the first to the power of {exponent:.4g}"
        maps.append(("gamma", exponent, text, partial(_to_the_power, exponent)))
    maps.append(("gamma", 1 / 2.2, "the second image is encoded as sRGB", encode_srgb))
    maps.append(("gamma", 2.2, "the second image is decoded from sRGB", decode_srgb))
    for cause, value, text, curve in maps:
        yield _Candidate(cause, value, text, curve)
        if a.shape[2] > colours:
            yield _Candidate(cause, value, text, partial(_of_colours, curve, colours))


def _to_the_power(exponent: float, image: _Image) -> _Image:
    power: _Image = np.maximum(image, 0 if exponent > 0 else 1e-6) ** exponent
    return power


def _of_colours(curve: _Map, colours: int, image: _Image) -> _Image:
    return np.concatenate([curve(image[:, :, :colours]), image[:, :, colours:]], axis=2)


def _judge(
    candidate: _Candidate, a: _Image, b: _Image, step: float, tiny: float
) -> Diagnosis | None:
    """Return the diagnosis if the cause explains the difference."""
    if candidate.is_of_b:
        a, b = b, a
    mapped = candidate.of_a(a)
    if step:
        mapped = np.clip(mapped, 0, 1)
    residual = b - mapped
    allowed = step + tiny + _RELATIVE * np.maximum(np.abs(b), np.abs(mapped))
    if step:
        # The level of `a` that was rounded becomes larger where the map is steep.
        lower, upper = np.maximum(a - step / 2, 0), a + step / 2
        allowed += np.abs(candidate.of_a(upper) - candidate.of_a(lower))
    if (np.abs(residual) > allowed).any() or rms(residual) > _REMAINS * rms(b - a):
        return None
    return Diagnosis(
        cause=candidate.cause,
        value=candidate.value,
        residual=rms(residual),
        text=f"{candidate.cause}: {candidate.text}",
    )


def _of_shift(a: _Image, b: _Image, step: float) -> Diagnosis:
    """Return the diagnosis of a shift by any number of pixels, or of no known cause."""
    result = find_shift(a, b, step)
    if result is None:
        return _none(a, b)
    shift, residual = result
    return Diagnosis(
        cause="shift",
        value=(round(shift[0], 3) + 0.0, round(shift[1], 3) + 0.0),
        residual=residual,
        text=f"shift: the second image is {_direction(shift)} of the first",
    )


def _direction(shift: tuple[float, float]) -> str:
    parts = [
        f"{abs(round(value, 2)):g} px {words[value < 0]}"
        for value, words in zip(shift, (("right", "left"), ("below", "above")), strict=True)
        if abs(value) >= MIN_SHIFT
    ]
    return " and ".join(parts)


def _multiply(image: _Image) -> _Image:
    return np.concatenate([image[:, :, :3] * image[:, :, 3:], image[:, :, 3:]], axis=2)


def _divide(image: _Image) -> _Image:
    alpha = image[:, :, 3:]
    colours = np.where(alpha > 0, image[:, :, :3] / np.where(alpha > 0, alpha, 1), image[:, :, :3])
    return np.concatenate([colours, alpha], axis=2)


def _step(image: NDArray[Any]) -> float:
    return 1 / float(np.iinfo(image.dtype).max) if image.dtype.kind == "u" else 0.0


def _has_levels(image: _Image, largest: int) -> bool:
    """Whether all values are levels of an integer type, as a half float stores them, too."""
    levels = image * largest
    return bool((np.abs(levels - np.rint(levels)) <= 0.07 * largest / 255).all())


def _is_half(image: _Image) -> bool:
    with np.errstate(over="ignore"):
        return bool((image.astype(np.float16) == image).all())
