"""One method's bloom in another method's parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._fit.fitting import fit
from vkbloom._fit.losses import DARK, Loss
from vkbloom._fit.result import FitResult, Verdict
from vkbloom._fit.space import Bounds, variation_of
from vkbloom._locks import cached_property
from vkbloom._numbers import check_size
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.fields import fields_of
from vkbloom._settings.settings import Settings, check_settings

#: A function of an image, such as `vkbloom.testing.command` makes of a program.
Maker = Callable[[NDArray[Any]], NDArray[Any]]

# Values of the lights, and their places as shares of width and height, where no texel of a chain
# begins.
_VALUES: Final = (0.5, 1.5, 6.0, 40.0)
_PLACES: Final = ((0.13, 0.21), (0.43, 0.29), (0.22, 0.73), (0.71, 0.61))
# Side of a light as a share of the height, and the least in pixels: smaller ones are taken for
# fireflies, or fall under a threshold that comes after a reduction.
# Below this factor, a deviation is said in percent; a halo is too weak or strong if the mean of its
# decades is this share of their root mean square.
_TWICE, _BIASED = 2, 0.7
_SIDE: Final = 1 / 30
_MIN_SIDE: Final = 3


# The largest losses of a good and of a fair translation: of "log" in decades, of others as a share.
_DECADES: Final = (0.1, 0.3)
_SHARES: Final = (0.05, 0.2)


class Translation(FitResult):
    """What `translate` found: judged by the loss that was minimized, and by nothing else.

    `is_found`, by which `fit` tells a bloom from a change of colours, weighs the bright pixels. At
    the lights a method may differ whose halo is right.
    """

    @cached_property
    def verdict(self) -> Verdict:
        """How close the bloom comes."""
        good, fair = _DECADES if self.loss_name == "log" else _SHARES
        loss = self._share if self.loss_name != "log" else self.loss
        return "good" if loss <= good else "fair" if loss <= fair else "poor"

    @property
    def _share(self) -> float:
        """The loss as a share: of the target, or of the loss of the picture without bloom."""
        if self.loss_name == "relative":
            return self.loss
        if self.loss_name == "l2":
            return self.loss / float(np.sqrt(np.mean(self.target**2)))
        return 1 - self.explained

    @cached_property
    def cause(self) -> str:
        """What differs: the halo around the lights, and the light at the lights."""
        said = describe_difference(self.target, self.target + self.residual, self.plain)
        if self.verdict != "poor":
            return said
        return (
            f"{said}; the method {self.settings.method} comes no closer with "
            f"{', '.join(self.vary)}: vary more fields, start from another preset, or raise "
            "max_calls"
        )


def describe_difference(
    target: NDArray[np.float64], result: NDArray[np.float64], plain: NDArray[np.float64]
) -> str:
    """Return how far a bloom is from another one around the lights of `plain`, and at them."""
    is_light = plain > 0
    floor = DARK * float(target.max())
    around = ~is_light & (np.maximum(target, result) > floor)
    halo = "no halo"
    if around.any():
        decades = np.log10(np.maximum(result, floor) / np.maximum(target, floor))[around]
        spread, mean = float(np.sqrt(np.mean(decades**2))), float(decades.mean())
        is_biased = abs(mean) > _BIASED * spread
        halo = _off("halo", 10**spread, ("too weak" if mean < 0 else "too strong") * is_biased)
    added, wanted = (float((one - plain)[is_light].sum()) for one in (result, target))
    if added * wanted > 0:
        ratio = added / wanted
        at_lights = _off("", max(ratio, 1 / ratio), "too weak" if ratio < 1 else "too strong")
        return f"{halo}, {at_lights} at the lights"
    # One of the two darkens the lights, as "mix" does: there is no ratio of what they add.
    made, given = (max(float(one[is_light].sum()), floor) for one in (result, target))
    word = "too dark" if made < given else "too bright"
    return f"{halo}, {_off('lights', max(made / given, given / made), word)}"


def _off(what: str, factor: float, word: str) -> str:
    """Return a deviation by a factor of at least 1: in percent below 2."""
    if factor < _TWICE:
        text = f"within {100 * (factor - 1):.4g} %"
    elif word:
        text = f"{factor:.4g} times {word}"
    else:
        text = f"off by a factor of {factor:.4g}"
    return f"{what} {text}".strip()


@public("vkbloom")
@check_arguments
def translate(
    settings: Settings | str | Maker,
    to: Settings | str | type[Settings],
    *,
    size: tuple[int, int] = (640, 360),
    renderer: Renderer | None = None,
    vary: str | Sequence[str] | None = None,
    loss: Loss = "log",
    bounds: Bounds | None = None,
    max_calls: int = 300,
    progress: bool = False,
) -> FitResult:
    """Find another method's parameters whose bloom comes closest to that of some settings.

    The point spreads are compared: both methods get a black picture with four small lights, of
    0.5, 1.5, 6 and 40, at places where the texels of their chains fall differently. So thresholds,
    compression of bright lights and the way from small to large blurs all count.

    Parameters
    ----------
    settings : Settings, str or callable
        The bloom to come close to: settings, or the name of a preset. A callable takes an image
        and returns it with its bloom, as those do that `vkbloom.testing.command` makes of programs.
    to : Settings, str or a class of settings
        The other method, or the name of a preset: where the search starts, and its fields that do
        not vary.
    size : (int, int)
        Width and height of the picture. Methods that blur by pixels differ from those that blur
        by shares of the frame at every size but this.
    renderer : Renderer, optional
        Default: `default_renderer`.
    vary : str or sequence of str, optional
        The fields of `to` to find. Default: those that set width and strength of its blur, its
        intensity, and its threshold where it has one.
    loss, bounds, max_calls, progress
        As for `fit`. With "log" the loss is in decades: 0.3 is a factor of two.

    Returns
    -------
    FitResult
        `settings` are those of the method `to`; ``final`` was compared, without tone curve and
        encoding. `verdict` depends on the loss alone. With "log": "good" up to 0.1 decades, a
        factor of 1.26, "fair" up to 0.3, a factor of 2. With "relative", and "l2" as a share of the
        target's root mean square: 0.05 and 0.2. With "flip" or a callable: 0.05 and 0.2 of the loss
        of the picture without bloom. `cause` says what differs, of every verdict.
    """
    if isinstance(to, type) and issubclass(to, Settings):
        start = to()
    elif isinstance(to, Settings | str):
        start = check_settings(to, "to")
    else:
        raise TypeError(f"to: {to!r} is not a Settings or a class of settings")
    image = lights(check_size("size", size))
    names = _knobs(start) if vary is None else vary
    renderer = renderer or default_renderer()
    if callable(settings):
        target = settings(image)
    else:
        plain = _plain(check_settings(settings))
        target = renderer.apply(image, plain, framebuffers=["final"])["final"]
    result = fit(
        image,
        target,
        _plain(start),
        names,
        framebuffer="final",
        loss=loss,
        bounds=bounds,
        renderer=renderer,
        max_calls=max_calls,
        progress=progress,
    )
    look = {name: getattr(start, name) for name in ("tonemap", "encoding", "exposure")}
    facts = {field.name: getattr(result, field.name) for field in dataclasses.fields(result)}
    return Translation(**{**facts, "settings": result.settings.replace(**look)})


def lights(size: tuple[int, int]) -> NDArray[np.float32]:
    """Return the picture of four lights."""
    width, height = size
    image = np.zeros((height, width, 3), np.float32)
    side = max(_MIN_SIDE, round(_SIDE * height))
    for value, (x, y) in zip(_VALUES, _PLACES, strict=True):
        left, top = int(x * width), int(y * height)
        image[top : top + side, left : left + side] = value
    return image


def _knobs(settings: Settings) -> tuple[str, ...]:
    """Return the fields that vary by default; others of `to` stay as they are."""
    fields = fields_of(type(settings))
    names = (name for name in settings._knobs if variation_of(fields[name]) is not None)
    threshold = ("threshold",) if settings.threshold is not None else ()
    return tuple(dict.fromkeys((*threshold, *names, "intensity")))


def _plain(settings: Settings) -> Settings:
    """Return the settings without what develops the picture."""
    return settings.replace(tonemap="none", encoding="none", exposure=0.0)
