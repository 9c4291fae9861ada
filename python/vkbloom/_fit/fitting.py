"""Settings that give a picture."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from functools import partial
from typing import Any, Final, Literal, overload

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._argument_types import check_arguments
from vkbloom._arrays import plain_array
from vkbloom._extras import import_extra
from vkbloom._fit.descent import Descent, check_derivatives
from vkbloom._fit.intervals import Intervals
from vkbloom._fit.likelihood import Likelihood, Noise
from vkbloom._fit.losses import Loss, Measure, find_loss, light, reduce
from vkbloom._fit.rendering import Rendering
from vkbloom._fit.result import FitResult, loss_text
from vkbloom._fit.search import CLOSE, ENOUGH, Search
from vkbloom._fit.space import Bounds, Point, Space, space_of, spaces_of_all
from vkbloom._fit.threads import one_thread
from vkbloom._gradients import pullback_of
from vkbloom._image_arguments import check_image
from vkbloom._numbers import check_above, check_index
from vkbloom._psf.base import PSF
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.image import Image
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.sources import Inputs, image_source
from vkbloom._settings.settings import Settings, check_settings, presets

# Longer side of the image of the first search in pixels, and its share of the calls.
_COARSE_SIDE: Final = 384
_COARSE_CALLS: Final = 0.6
# Share of the loss of an image without bloom that is close to a target.
_FAINT: Final = 0.02


@overload
def fit(  # type: ignore[overload-overlap]  # "all" is a str, too
    image: NDArray[Any] | Image,
    target: NDArray[Any],
    settings: Literal["all"],
    vary: str | Sequence[str],
    *,
    framebuffer: str = ...,
    loss: Loss = ...,
    bounds: Bounds | None = ...,
    renderer: Renderer | None = ...,
    max_calls: int = ...,
    gradient: bool = ...,
    noise: float | NDArray[Any] | None = ...,
    progress: bool = ...,
) -> list[FitResult]: ...
@overload
def fit(  # type: ignore[overload-overlap]  # a str is a sequence of str, too
    image: NDArray[Any] | Image,
    target: NDArray[Any],
    settings: Settings | str,
    vary: str | Sequence[str],
    *,
    framebuffer: str = ...,
    loss: Loss = ...,
    bounds: Bounds | None = ...,
    renderer: Renderer | None = ...,
    max_calls: int = ...,
    gradient: bool = ...,
    noise: float | NDArray[Any] | None = ...,
    progress: bool = ...,
) -> FitResult: ...
@overload
def fit(
    image: NDArray[Any] | Image,
    target: NDArray[Any],
    settings: Sequence[Settings | str],
    vary: str | Sequence[str],
    *,
    framebuffer: str = ...,
    loss: Loss = ...,
    bounds: Bounds | None = ...,
    renderer: Renderer | None = ...,
    max_calls: int = ...,
    gradient: bool = ...,
    noise: float | NDArray[Any] | None = ...,
    progress: bool = ...,
) -> list[FitResult]: ...
@public("vkbloom")
@check_arguments
def fit(
    image: NDArray[Any] | Image,
    target: NDArray[Any],
    settings: Settings | str | Sequence[Settings | str],
    vary: str | Sequence[str],
    *,
    framebuffer: str = "final",
    loss: Loss = "relative",
    bounds: Bounds | None = None,
    renderer: Renderer | None = None,
    max_calls: int = 1000,
    gradient: bool = False,
    noise: float | NDArray[Any] | None = None,
    progress: bool = False,
) -> FitResult | list[FitResult]:
    """Find the settings that make a given picture of an image.

    Parameters
    ----------
    image : ndarray, shape (H, W, 3) or (H, W, 4), or Image
        As for `Renderer.apply`. A handle of `Renderer.upload` needs its `renderer`.
    target : ndarray, shape (H, W, 3) or (H, W, 4)
        The picture that the framebuffer should be, of the same size; uint8 is scaled to 0..1.
        Alpha is not compared. With a target of 8 bits, such as a screenshot from `vkbloom.read`,
        framebuffers are clipped and rounded as it is, and its saturated pixels are left out.
    settings : Settings, str, sequence of these, or "all"
        Settings, or the name of a preset: where the search starts, and the fields that stay as
        they are. Of several, such as presets of several engines, each is searched by itself. "all":
        every preset; of a preset those of the varied fields vary that it has and that have an
        effect.
    vary : str or sequence of str
        The fields to find: numbers, integers, flags and choices, also of stages and point-spread
        functions: "glare.0.intensity", "psf.sigma".
    framebuffer : str
        The framebuffer to compare. ``final`` is the picture with its bloom, ``bloom`` the bloom
        alone before `intensity`.
    loss : {"relative", "l2", "log", "flip"} or callable
        "relative": norm(a - b) / norm(b). "l2": the root mean square of a - b. "log": the same of
        log10 of values from 1e-4 of the target's largest on, which weighs the faint parts of a
        bloom like the bright ones. "flip": mean FLIP, as `compare` has it. Or a callable of
        framebuffer and target, both (H, W, 3) of float64, that returns a number.
    bounds : mapping of str to (float, float), optional
        Narrower ranges of varied fields; of a choice, the values to try. Default: the ranges that
        the settings declare; a threshold ends at the brightest value of the image, and a size of
        buffers at the image's height.
    renderer : Renderer, optional
        Default: `default_renderer`.
    max_calls : int
        The most renders of a candidate.
    gradient : bool
        Whether to search by the derivatives of `vjp`: fewer renders for many fields, but
        pullbacks take longer than renders. The varied fields must have a derivative and the loss
        must be "relative", "l2" or "log".
    noise : float or ndarray, shape (H, W) or (H, W, 3), optional
        The standard deviation of the target's values, for the intervals of the result; it does not
        change what is found. Default: that of the residual, or that of rounding to 8 bits.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    FitResult or list of FitResult
        Of "all" and of a sequence of settings a list, the smallest loss first.

    Raises
    ------
    ValueError
        A candidate lacks a varied field, or the framebuffer; a field has no effect on it; the
        target has another size or is black; an argument is out of range; or, with `gradient`, a
        field or the loss has no derivative, or the image is an `Image`.

    Notes
    -----
    Images of more than 384 pixels are reduced first, by boxes. There,
    `scipy.optimize.differential_evolution` searches the whole space, and
    `scipy.optimize.least_squares` starts from the best of its points; "flip" and callables are
    minimized by `scipy.optimize.minimize`, with Nelder and Mead's simplex. Larger populations
    follow while the loss is not close to 0. The result is refined at the image's own size. With
    `gradient`, the derivatives of the least squares come from pullbacks, which are no calls. If
    that ends far from the target, the search without derivatives follows. The same arguments give
    the same result.

    A bloom may not tell its parameters: a threshold under all light, a knee without a threshold, or
    a product of two factors. Then the loss is small, and the parameters are some of those that
    have it. `FitResult.interval` and `FitResult.undetermined` say so.
    """
    is_all = isinstance(settings, str) and settings == "all"
    is_many = is_all or not isinstance(settings, Settings | str)
    candidates = _candidates(settings)
    names = _check_names(vary)
    check_index("max_calls", max_calls, 1, 10_000_000)
    if not isinstance(bounds, Mapping | None):
        raise TypeError(f"bounds: {bounds!r} is not a mapping of fields to their bounds")
    for name in bounds or {}:
        if name not in names:
            raise ValueError(f"bounds: {name!r} is not among the varied fields {', '.join(names)}")
    if renderer is None and isinstance(image, Image):
        raise ValueError("renderer: an uploaded image needs the renderer that has it")
    pixels = None if isinstance(image, Image) else check_image(image)
    wanted = check_image(target, "target")
    deviation = _check_noise(noise, wanted.shape[:2])
    measure = Measure.of(wanted, find_loss(loss))
    brightest = math.inf if pixels is None else float(light(pixels).max())
    limits = (bounds or {}, brightest, len(measure.target))
    if is_all:
        spaces = spaces_of_all(candidates, names, *limits)
    else:
        spaces = [space_of(each, names, *limits) for each in candidates]
    if gradient:
        check_derivatives(spaces, measure.loss, pixels)
    renderer = renderer or default_renderer()
    stages = _stages(renderer, framebuffer, image, pixels, measure)
    rendering = Rendering(renderer, stages[-1].image, pixels, framebuffer)
    # All of them before the first is searched: the most likely failures come at once.
    narrow = _drop_ineffective if is_all else _refuse_ineffective
    spaces = [narrow(stages[-1], space) for space in spaces]
    results = []
    for space in spaces:
        if not space.axes:
            continue
        bar: Any = contextlib.nullcontext(_ignore)
        if progress:
            bar = _bar(space.start.method, max_calls)
        with bar as on_loss:
            new_search = _descent_of if gradient else _search_of
            found, point = _fit_from(stages, space, max_calls, on_loss, new_search)
        if measure.is_sum:
            likelihood = Likelihood(space, measure, rendering, point, deviation)
            found = dataclasses.replace(found, _intervals=Intervals(likelihood))
        results.append(found)
    results.sort(key=lambda item: item.loss)
    return results if is_many else results[0]


def _candidates(settings: Settings | Sequence[Settings | str] | str) -> list[Settings]:
    """Return where the searches start."""
    if isinstance(settings, str) and settings == "all":
        return list(presets.values())
    if not isinstance(settings, Settings | str | Iterable) or isinstance(settings, Mapping | Set):
        raise TypeError(f"settings: {settings!r} is not a Settings or a sequence of them")
    some: list[Any] = [settings] if isinstance(settings, Settings | str) else list(settings)
    if not some:
        raise ValueError("settings: there are none; give at least one")
    return [check_settings(item) for item in some]


@dataclasses.dataclass(frozen=True)
class _Stage:
    """One size of the image, on the device, and the target of one of its framebuffers."""

    renderer: Renderer
    framebuffer: str
    image: Image
    pixels: NDArray[Any] | None
    measure: Measure
    factor: int

    def render(self, settings: Settings) -> NDArray[np.float64]:
        """Return the light of the framebuffer with settings for the image's own size."""
        smaller, names = _smaller(settings, self.factor), [self.framebuffer]
        frames = self.renderer.apply(self.image, smaller, framebuffers=names)
        return light(frames[self.framebuffer])


def _check_names(vary: str | Sequence[str]) -> tuple[str, ...]:
    names = (vary,) if isinstance(vary, str) else tuple(vary)
    if not names:
        raise ValueError("vary: there are no fields; name at least one")
    if len(set(names)) < len(names):
        raise ValueError(f"vary: {', '.join(names)} has a field twice")
    return names


def _check_noise(noise: Any, size: tuple[int, ...]) -> Noise | None:
    """Return the standard deviation of a target's values, or raise TypeError or ValueError."""
    if noise is None:
        return None
    if isinstance(noise, int | float):
        return check_above("noise", noise, 0)
    given = plain_array(noise, "noise")
    if given.dtype.kind not in "fiu":
        raise TypeError(f"noise: {given.dtype} is not a type of real numbers")
    deviations = given.astype(np.float64)
    if deviations.shape not in (size, (*size, 3)):
        raise ValueError(f"noise: shape {deviations.shape} is not {size} or {(*size, 3)}")
    if not (np.isfinite(deviations).all() and (deviations > 0).all()):
        raise ValueError("noise: some values are not finite numbers above 0")
    return deviations


def _stages(
    renderer: Renderer,
    framebuffer: str,
    image: NDArray[Any] | Image,
    pixels: NDArray[Any] | None,
    measure: Measure,
) -> list[_Stage]:
    """Return the image at its own size, and before it a smaller one where it is large."""
    handle = image if isinstance(image, Image) else renderer.upload(image)
    target = measure.target
    if handle.shape[:2] != target.shape[:2]:
        raise ValueError(
            f"target: {target.shape[1]} x {target.shape[0]} is not the image's size, "
            f"{handle.shape[1]} x {handle.shape[0]}"
        )
    stages = [_Stage(renderer, framebuffer, handle, pixels, measure, 1)]
    factor = 2 ** max(0, math.ceil(math.log2(max(target.shape) / _COARSE_SIDE)))
    if pixels is not None and factor > 1 and min(target.shape[:2]) >= 16 * factor:
        small, target_of_small = reduce(pixels, factor), measure.reduce(factor)
        on_device = renderer.upload(small)
        stages.insert(0, _Stage(renderer, framebuffer, on_device, small, target_of_small, factor))
    return stages


def _refuse_ineffective(stage: _Stage, space: Space) -> Space:
    """Return the space; raise ValueError if one of its fields has no effect."""
    for axis, has_effect in zip(space.axes, _effects(stage, space), strict=True):
        if not has_effect:
            raise ValueError(
                f"vary: {axis.name} has no effect on {stage.framebuffer}"
                + ("; give framebuffer='final'" if stage.framebuffer != "final" else "")
            )
    return space


def _drop_ineffective(stage: _Stage, space: Space) -> Space:
    """Return the space of the fields that have an effect."""
    effective = itertools.compress(space.axes, _effects(stage, space))
    return dataclasses.replace(space, axes=tuple(effective))


def _effects(stage: _Stage, space: Space) -> list[bool]:
    """Return for each field whether it has an effect on the framebuffer that is compared."""
    framebuffer = stage.framebuffer
    plan = stage.renderer.plan(stage.image, space.start, framebuffers=[framebuffer])
    shape = plan.framebuffers[framebuffer][0]
    if len(shape) != 3 or shape[:2] != stage.image.shape[:2]:
        raise ValueError(
            f"framebuffer: {framebuffer} of the method {space.start.method} has the shape {shape}, "
            f"not the size of the target; it can be bloom or final"
        )
    return [_has_effect(stage, space, index) for index in range(len(space.axes))]


def _has_effect(stage: _Stage, space: Space, index: int) -> bool:
    """Return whether passes run after a change of one varied field."""
    source, steps = image_source(stage.image), []
    # From several values: at one of them a field may be without effect.
    for coordinate in (space.origin[index], 0.02, 0.98, 0.3, 0.6):
        point = space.origin.copy()
        point[index] = coordinate
        steps.append((source, _core.plan(source, space.settings(point), (stage.framebuffer,))))
    return any(_core.dry_run(tuple(steps))[1:])


def _search_of(_: _Stage) -> type[Search]:
    return Search


def _descent_of(stage: _Stage) -> Callable[..., Descent]:
    return partial(Descent, partial(_derivatives, stage))


def _fit_from(
    stages: list[_Stage],
    space: Space,
    max_calls: int,
    on_loss: Callable[[float], None],
    new_search: Callable[[_Stage], Any],
) -> tuple[FitResult, Point]:
    """Return what is found from one start, and its coordinates.

    `new_search` gives the class of search of a stage.
    """
    history: list[float] = []
    best = None
    for stage in stages:
        is_last = stage is stages[-1]
        search = new_search(stage)(
            space,
            stage.measure,
            stage.render,
            max_calls=max_calls - len(history) if is_last else round(_COARSE_CALLS * max_calls),
            on_loss=on_loss,
            close=_close(stage),
        )
        with one_thread():
            if best is None:
                search.run()
            else:
                search.refine(best)
        history += search.history
        best = search.best
    return _result(stages[-1], space, search, history), search.best


def _result(stage: _Stage, space: Space, last: Search, history: list[float]) -> FitResult:
    """Return what a search found, judged at the image's own size."""
    settings = space.settings(last.best)
    renderer, framebuffer, measure = stage.renderer, stage.framebuffer, stage.measure
    frames = renderer.apply(stage.image, settings)
    plain = np.zeros_like(measure.target)
    if framebuffer == "final":
        bare = settings.replace(bloom=False, glare=())
        plain = light(renderer.apply(stage.image, bare, framebuffers=["final"])["final"])
    with one_thread():
        explained = measure.explained_share(last.loss, plain)
    return FitResult(
        settings=settings,
        loss=last.loss,
        start_loss=last.history[0],
        calls=len(history),
        history=np.array(history),
        framebuffer=framebuffer,
        loss_name=loss_text(measure.loss),
        vary=tuple(axis.name for axis in space.axes),
        frames=frames,
        target=measure.target,
        residual=measure.as_target(light(frames[framebuffer])) - measure.target,
        plain=measure.as_target(plain),
        explained=explained,
    )


def _close(stage: _Stage) -> float:
    """Return the loss below which a search only polishes, less for a faint bloom."""
    if stage.framebuffer != "final" or stage.pixels is None:
        return CLOSE
    with one_thread():
        return float(np.clip(_FAINT * stage.measure(light(stage.pixels)), ENOUGH, CLOSE))


def _derivatives(stage: _Stage, settings: Settings) -> Callable[[NDArray[np.float64]], Any]:
    """Return the function from a cotangent to the derivatives by each field."""
    assert stage.pixels is not None
    pullback = pullback_of(stage.renderer, Inputs(stage.pixels), _smaller(settings, stage.factor))
    # The shape of a framebuffer of four channels, such as "bloom", differs from the image's.
    channels = stage.pixels.shape[2] if stage.framebuffer == "final" else 4

    def back(cotangent: NDArray[np.float64]) -> Any:
        whole = np.zeros((*cotangent.shape[:2], channels))
        whole[..., :3] = cotangent
        gradients = pullback({stage.framebuffer: whole})
        if stage.factor == 1 or "blur_scale" not in gradients:
            return gradients
        # `_smaller` has divided the scale.
        return {**gradients, "blur_scale": gradients["blur_scale"] / np.float32(stage.factor)}

    return back


def _smaller(settings: Any, factor: int) -> Any:
    """Return settings that blur a reduced image as far as a share of its size."""
    if factor == 1:
        return settings
    changes: dict[str, Any] = {}
    if hasattr(settings, "blur_scale"):
        changes["blur_scale"] = settings.blur_scale / factor
    if isinstance(psf := getattr(settings, "psf", None), PSF):
        changes["psf"] = psf._in_larger_pixels(factor)
    if getattr(settings, "pixels_per_degree", None) is not None:
        changes["pixels_per_degree"] = settings.pixels_per_degree / factor
    if getattr(settings, "kernel_size", None) is not None:
        changes["kernel_size"] = tuple(max(1, side // factor) for side in settings.kernel_size)
    if settings.bloom_size is not None:
        changes["bloom_size"] = tuple(max(1, side // factor) for side in settings.bloom_size)
    return settings.replace(**changes)


def _ignore(_: float) -> None:
    """Show no progress."""


@contextlib.contextmanager
def _bar(method: str, total: int) -> Iterator[Callable[[float], None]]:
    """Show a progress bar, and give the function that gets each loss and counts the calls."""
    tqdm = import_extra("tqdm.auto", "cli", "A progress bar").tqdm
    with tqdm(total=total, desc=method, unit="call", leave=False) as bar:
        yield lambda loss: bar.update()
