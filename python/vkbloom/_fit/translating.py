"""One method's bloom in another method's parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import checked
from vkbloom._checks import check_size
from vkbloom._fit.fitting import fit
from vkbloom._fit.losses import Loss
from vkbloom._fit.result import FitResult
from vkbloom._fit.space import Bounds, varied_as
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.fields import fields_of
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import Settings, check_settings

#: A function of an image, such as `vkbloom.testing.command` makes of a program.
Maker = Callable[[NDArray[Any]], NDArray[Any]]

# What a user of a method turns; other fields of `to` stay as they are.
_KNOBS: Final[Mapping[str, tuple[str, ...]]] = {
    "separable": ("blur_scale", "blur_strength"),
    "pyramid": ("levels", "radius"),
    "dual_kawase": ("levels", "offset"),
    "bevy": ("low_frequency_boost", "max_mip_dimension"),
    "kino": ("threshold", "radius"),
    "filament": ("levels", "resolution"),
    "urp": ("threshold", "scatter"),
    "hdrp": ("scatter",),
    "three": ("threshold", "radius"),
    "post_processing": ("threshold", "diffusion"),
    "unreal": ("size_scale",),
    "halation": ("pixel_size",),
    "pmndrs": ("threshold", "radius"),
    "babylon": ("threshold", "kernel"),
    "playcanvas": ("threshold", "blur_level"),
    "darktable": ("threshold", "blur_size", "strength"),
    "godot": ("threshold", "strength", "glow_bloom"),
    "blender": ("threshold", "size"),
    "pygfx": ("levels", "filter_radius"),
}
# Values of the lights, and their places as shares of width and height, where no texel of a chain
# begins.
_VALUES: Final = (0.5, 1.5, 6.0, 40.0)
_PLACES: Final = ((0.13, 0.21), (0.43, 0.29), (0.22, 0.73), (0.71, 0.61))
# Side of a light as a share of the height, and the least in pixels: smaller ones are taken for
# fireflies, or fall under a threshold that comes after a reduction.
_SIDE: Final = 1 / 30
_MIN_SIDE: Final = 3


@checked
def translate(
    settings: Settings | Maker,
    to: Settings | type[Settings],
    *,
    size: tuple[int, int] = (640, 360),
    renderer: Renderer | None = None,
    vary: Sequence[str] | None = None,
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
    settings : Settings or callable
        The bloom to come close to; a callable takes an image and returns it with its bloom, as
        those do that `vkbloom.testing.command` makes of programs.
    to : Settings or a class of them
        The other method: where the search starts, and its fields that do not vary.
    size : (int, int)
        Width and height of the picture. Methods that blur by pixels differ from those that blur
        by shares of the frame at every size but this.
    renderer : Renderer, optional
        Default: `default_renderer`.
    vary : sequence of str, optional
        The fields of `to` to find. Default: those that set width and strength of its blur, its
        intensity, and its threshold where it has one.
    loss, bounds, max_calls, progress
        As for `fit`. With "log" the loss is in decades: 0.3 is a factor of two.

    Returns
    -------
    FitResult
        `settings` are those of the method `to`; ``final`` was compared, without tone curve and
        encoding.

    """
    start = to() if isinstance(to, type) and issubclass(to, Settings) else to
    if not isinstance(start, Settings):
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
    return dataclasses.replace(result, settings=result.settings.replace(**look))


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
    names = _KNOBS.get(settings.method, ())
    if METHODS.is_added(settings.method):
        shared = fields_of(Settings)
        names = tuple(
            name
            for name, info in fields_of(type(settings)).items()
            if name not in shared and varied_as(info) is not None
        )
    threshold = ("threshold",) if settings.threshold is not None else ()
    return tuple(dict.fromkeys((*threshold, *names, "intensity")))


def _plain(settings: Settings) -> Settings:
    """Return the settings without what develops the picture."""
    return settings.replace(tonemap="none", encoding="none", exposure=0.0)
