"""The level weights of a pyramid that approximates a point-spread function."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._extras import import_extra
from vkbloom._fit.losses import Measure, light
from vkbloom._fit.result import FitResult
from vkbloom._methods.mip_chain import Pyramid
from vkbloom._numbers import check_index, check_size
from vkbloom._psf.base import PSF
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.renderer import Renderer

PyramidLoss = Literal["relative", "log"]
# Rows of the matrix are not weighted by more than 1 over this share of the peak.
_DARK: Final = 1e-4


@public("vkbloom")
@check_arguments
def fit_pyramid(
    psf: PSF,
    levels: int = 8,
    *,
    size: tuple[int, int] = (512, 512),
    pixels_per_degree: float | None = None,
    radius: float = 1.0,
    direct: bool = False,
    loss: PyramidLoss = "relative",
    renderer: Renderer | None = None,
) -> FitResult:
    """Find the level weights of a pyramid whose point spread is closest to a given one.

    Without a threshold and a firefly filter a pyramid is linear in its `level_weights`. So the
    bloom of a point is measured for each level alone, and the weights are the non-negative ones
    with the smallest sum of squared differences (`scipy.optimize.nnls`).

    Parameters
    ----------
    psf : PSF
        The target; the mean of its channels is used.
    levels : int
        Number of levels, 1 to 16.
    size : (int, int)
        Width and height of the frame in pixels. The point is in the middle.
    pixels_per_degree : float, optional
        As for `PSF.array`.
    radius : float
        Radius of the pyramid's tent, 0 to 16.
    direct : bool
        Whether to keep a share of the light unblurred. ``composite`` is "mix" then, and
        ``intensity`` is the share that is blurred. Use it for functions with a sharp peak that
        describe all light, such as those of the eye. False: the bloom approximates the function.
    loss : {"relative", "log"}
        "relative": of the differences; the peak dominates. "log": of the differences divided by
        the function, or by 1e-4 of its peak where the function is smaller.
    renderer : Renderer, optional
        Default: `default_renderer`.

    Returns
    -------
    FitResult
        `settings` is a `Pyramid` whose buffers are floats. `calls` is the number of renders: one
        for each level and two for the losses.

    Notes
    -----
    Lawson and Hanson, "Solving Least Squares Problems", 1974, chapter 23, on non-negative least
    squares (https://doi.org/10.1137/1.9781611971217). With "log" the rows are divided by the
    function: log(a / b) is nearly (a - b) / b.
    """
    check_index("levels", levels, 1, 16)
    if loss not in get_args(PyramidLoss):
        raise ValueError(f"loss: {loss!r} is not one of {', '.join(get_args(PyramidLoss))}")
    width, height = check_size("size", size)
    wanted = psf.array((width, height), pixels_per_degree).mean(axis=2, keepdims=True)
    measure = Measure(np.repeat(wanted, 3, axis=2), loss)
    point = np.zeros((height, width, 3), np.float32)
    point[height // 2, width // 2] = 1
    begun = Pyramid(levels=levels, radius=radius, format="rgba32float")
    renderer = renderer or default_renderer()
    image = renderer.upload(point)
    sole = [begun.replace(level_weights=tuple(row)) for row in np.eye(levels)]
    _check_levels(levels, renderer.plan(image, sole[-1]).framebuffers, (width, height))
    columns: list[NDArray[np.float64]] = [
        light(frames["bloom"])[:, :, 0].ravel()
        for frames in renderer.sweep(image, sole, framebuffers=["bloom"])
    ]
    if direct:
        columns.append(point[:, :, 0].ravel().astype(np.float64))
    weights = _nonnegative(np.stack(columns, axis=1), wanted.ravel(), loss)
    settings = _pyramid(begun, weights[:levels], float(weights[-1]) if direct else None)
    frames = renderer.apply(image, settings)
    start = renderer.apply(image, begun, framebuffers=["bloom"])["bloom"]
    framebuffer = "final" if direct else "bloom"
    fitted = light(frames[framebuffer])
    losses = measure(light(start)), measure(fitted)
    plain = light(point) if direct else np.zeros_like(measure.target)
    return FitResult(
        settings=settings,
        loss=losses[1],
        start_loss=losses[0],
        calls=levels + 2,
        history=np.array(losses),
        framebuffer=framebuffer,
        loss_name=loss,
        vary=("level_weights", "intensity") if direct else ("level_weights",),
        frames=frames,
        target=measure.target,
        residual=fitted - measure.target,
        plain=plain,
        explained=measure.explained_share(losses[1], plain),
    )


def _check_levels(levels: int, outputs: Iterable[str], size: tuple[int, int]) -> None:
    """Raise ValueError if a frame is too small for so many levels."""
    count = sum(name.startswith("down_") for name in outputs)
    if count < levels:
        raise ValueError(
            f"levels: {levels} is out of range, 1 to {count} for {size[0]} x {size[1]} pixels"
        )


def _nonnegative(
    columns: NDArray[np.float64], wanted: NDArray[np.float64], loss: PyramidLoss
) -> NDArray[np.float64]:
    """Return the non-negative weights of columns whose sum is closest."""
    nnls = import_extra("scipy.optimize", "fit", "Fitting a pyramid").nnls
    if loss == "log":
        scale = 1 / np.maximum(wanted, _DARK * wanted.max())
        columns, wanted = columns * scale[:, np.newaxis], wanted * scale
    # The triangle of the decomposition has the same solution as its millions of rows.
    triangle = np.asarray(np.linalg.qr(np.column_stack([columns, wanted]), mode="r"))
    weights: NDArray[np.float64] = nnls(triangle[:, :-1], triangle[:, -1])[0]
    return weights


def _pyramid(begun: Pyramid, weights: NDArray[np.float64], stays: float | None) -> Pyramid:
    """Return the settings; `stays` is the share of the light that does not bloom."""
    if stays is None:
        return begun.replace(level_weights=tuple(map(float, weights)))
    changes: dict[str, Any] = {"composite": "mix", "intensity": max(1 - stays, 0.0)}
    # Mixed in by the intensity, the bloom is the sum of the weights again.
    scaled = weights / changes["intensity"] if changes["intensity"] else weights
    return begun.replace(level_weights=tuple(map(float, scaled)), **changes)
