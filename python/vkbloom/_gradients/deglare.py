"""Removal of a known glare."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._gradients.pulling import vjp
from vkbloom._image_arguments import check_image
from vkbloom._methods.convolution import Convolution, PSFLike, read_psf
from vkbloom._numbers import check_number
from vkbloom._psf.varying import Varying
from vkbloom._public import public
from vkbloom._renderer.default import default_renderer
from vkbloom._renderer.renderer import Renderer


@public("vkbloom")
@check_arguments
def deglare(
    image: NDArray[Any],
    psf: PSFLike,
    *,
    share: float | None = None,
    pixels_per_degree: float | None = None,
    iterations: int = 50,
    renderer: Renderer | None = None,
) -> NDArray[np.float32]:
    """Remove the glare of a known lens from a picture.

    Parameters
    ----------
    image : array-like, shape (H, W, 3) or (H, W, 4)
        The picture with glare, in linear light. uint8 is read as value / 255. Alpha is kept.
    psf : PSF or array-like, shape (h, w) or (h, w, 3)
        How the light of a point is spread, as for `Convolution`, which normalizes it, but for a
        `psf.Varying`.
    share : float, optional
        The share of the light that is spread, 0 to 1; the rest stays at its pixel. Default: the
        energy of the PSF, at most 1; of a `psf.Varying`, 1.
    pixels_per_degree : float, optional
        Scale of a PSF whose unit is "degree", as of `Convolution`. Default: the picture's longer
        side spans 50 degrees.
    iterations : int
        At most so many steps, which take two convolutions each.
    renderer : Renderer, optional
        Default: `default_renderer`.

    Returns
    -------
    ndarray of float32, shape of `image`
        The x >= 0 for which the sum of ``(A x - image)**2`` is least, where A adds the glare, by
        conjugate gradients that start anew where a value reaches 0. Outside of the picture is no
        light.

    Raises
    ------
    ValueError, TypeError
        A value of the image is not finite, an argument is out of range, or as for `apply`.
    OutOfMemoryError, DeviceLostError, ValidationError, Error
        The device failed.

    Examples
    --------
    >>> truth = np.zeros((32, 32, 3), np.float32)
    >>> truth[16, 16] = 100
    >>> psf = vkbloom.psf.gaussian(sigma=3)
    >>> lens = vkbloom.Convolution(psf, composite="mix", intensity=0.3)
    >>> picture = vkbloom.apply(truth, lens)["final"]
    >>> clean = vkbloom.deglare(picture, psf, share=0.3)
    >>> [round(float(abs(one - truth).mean()), 4) for one in (picture, clean)]
    [0.0576, 0.0]
    """
    renderer, psf = renderer or default_renderer(), read_psf(psf)
    if share is None:
        # A field's kernels are taken as they are.
        share = 1.0 if isinstance(psf, Varying) else min(float(psf.energy().mean()), 1.0)
    share = check_number("share", share, 0, 1)
    check_number("iterations", iterations, 1, 100_000)
    given = check_image(image)
    levels = 255 if given.dtype == np.uint8 else 1
    picture = np.divide(given[..., :3], levels, dtype=np.float32)
    if not np.isfinite(picture).all():
        raise ValueError("image: a value is not finite")
    lens = Convolution(
        psf,
        composite="mix",
        intensity=share,
        pixels_per_degree=pixels_per_degree,
        format="rgba32float",
    )
    # A is linear: its pullback is the same for each image.
    _, pullback = vjp(picture, lens, renderer=renderer)

    def spread(values: NDArray[Any]) -> NDArray[np.float32]:
        result: NDArray[np.float32] = renderer.apply(
            values.astype(np.float32), lens, framebuffers="final"
        )["final"]
        return result

    estimate = np.maximum(picture, 0).astype(np.float64)
    residual = picture - spread(estimate)
    direction, last, first = np.zeros_like(estimate), np.inf, 0.0
    for _ in range(iterations):
        slope = pullback({"final": residual})["image"].astype(np.float64)
        slope[(estimate == 0) & (slope < 0)] = 0
        square = float(np.vdot(slope, slope))
        first = max(first, square)
        # Further steps only follow the rounding of single floats.
        if square <= 1e-14 * first:
            break
        direction = np.where(slope == 0, 0, slope + square / last * direction)
        moved = spread(direction)
        length = float(np.vdot(slope, direction)) / float(np.vdot(moved, moved))
        ahead = estimate + length * direction
        estimate = np.maximum(ahead, 0)
        is_inside = (ahead >= 0).all()
        residual = (
            residual - np.float32(length) * moved if is_inside else picture - spread(estimate)
        )
        last = square if is_inside else np.inf
    return np.concatenate([estimate, given[..., 3:] / levels], axis=2, dtype=np.float32)
