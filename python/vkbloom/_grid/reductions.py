"""Reductions of frames to figures, for the argument ``reduce`` of grids.

A large grid then stores figures instead of frames. Besides these classes, ``reduce`` takes any
callable of `Frames` that returns a number or a small array. If it has an attribute
``framebuffers``, it gets only those framebuffers, otherwise all of them.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vkbloom._renderer.frames import Frames
from vkbloom._views.comparison import Metric, compare

__all__ = ["FLIP", "PSNR", "SSIM", "ColorVideoVDP", "EncircledEnergy", "Max", "Mean", "Reduction"]

# Luminance of linear colours with the primaries of Rec. ITU-R BT.709.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def _colours(frames: Frames, framebuffer: str) -> NDArray[np.float64]:
    """Return red, green and blue (or depth) as (H, W, C); 8-bit values are scaled to 0..1."""
    array = np.atleast_3d(frames[framebuffer])[:, :, :3]
    return array.astype(np.float64) / (255 if array.dtype == np.uint8 else 1)


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """Base class of the reductions.

    Parameters
    ----------
    framebuffer : str
        The framebuffer to reduce.
    """

    framebuffer: str = "final"

    #: Names of the dimensions of the returned array; empty for a number.
    dims: ClassVar[tuple[str, ...]] = ()
    units: ClassVar[str] = "1"

    @property
    def framebuffers(self) -> tuple[str, ...]:
        """The framebuffers that the reduction needs."""
        return (self.framebuffer,)

    @property
    def coordinates(self) -> Mapping[str, NDArray[Any]]:
        """Coordinates of the dimensions."""
        return {}

    @property
    def description(self) -> str:
        """The first line of the docstring, and the framebuffer."""
        text = (type(self).__doc__ or type(self).__name__).splitlines()[0].rstrip(".")
        return f"{text}, of {self.framebuffer}"

    def __call__(self, frames: Frames) -> Any:
        """Return the figure of one point."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Mean(Reduction):
    """Mean of red, green and blue over all pixels.

    Parameters
    ----------
    framebuffer : str
        The framebuffer to reduce. 8-bit values are scaled to 0..1. Alpha and values that are not
        finite are left out.

    Examples
    --------
    >>> from vkbloom._grid.reductions import Mean
    >>> final = np.full((16, 16, 4), 51, np.uint8)
    >>> frames = vkbloom.Frames(
    ...     {"final": final}, timings={}, settings=vkbloom.Separable(), info={}
    ... )
    >>> round(Mean()(frames), 3)
    0.2
    """

    def __call__(self, frames: Frames) -> float:
        """Return the mean; NaN if no value is finite."""
        values = _colours(frames, self.framebuffer)
        finite = np.isfinite(values)
        return float(values.mean(where=finite)) if finite.any() else math.nan


@dataclass(frozen=True, kw_only=True)
class Max(Reduction):
    """Maximum of red, green and blue over all pixels.

    Parameters
    ----------
    framebuffer : str
        The framebuffer to reduce. 8-bit values are scaled to 0..1. Alpha and values that are not
        finite are left out.
    """

    def __call__(self, frames: Frames) -> float:
        """Return the maximum; NaN if no value is finite."""
        values = _colours(frames, self.framebuffer)
        finite = np.isfinite(values)
        return float(values.max(where=finite, initial=-math.inf)) if finite.any() else math.nan


@dataclass(frozen=True, kw_only=True)
class EncircledEnergy(Reduction):
    """Share of the light within a distance of a centre.

    Parameters
    ----------
    radii : sequence of float
        Distances in pixels, above 0.
    centre : (float, float) or None
        x and y in pixels; the centre of the first pixel is (0, 0). None: the centroid of the
        light.
    framebuffer : str
        The framebuffer to reduce.

    Notes
    -----
    EE(r) is the sum of L over the pixels with (x - cx)^2 + (y - cy)^2 <= r^2, divided by the sum
    of L over all pixels. L = 0.2126 R + 0.7152 G + 0.0722 B (Rec. ITU-R BT.709), or the depth.
    This is the encircled energy that optics defines for point-spread functions. Negative values
    and values that are not finite count as 0. The result is NaN if the sum over all is 0.

    Examples
    --------
    Four pixels around a bright one; each has 1/8 of the light:

    >>> from vkbloom._grid.reductions import EncircledEnergy
    >>> bloom = np.zeros((5, 5, 4), np.float32)
    >>> bloom[2, 1:4] = bloom[1:4, 2] = 1
    >>> bloom[2, 2] = 4
    >>> frames = vkbloom.Frames(
    ...     {"bloom": bloom}, timings={}, settings=vkbloom.Separable(), info={}
    ... )
    >>> EncircledEnergy(radii=(0.5, 1.0))(frames).round(6)
    array([0.5, 1. ])
    """

    framebuffer: str = "bloom"
    radii: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
    centre: tuple[float, float] | None = None

    dims: ClassVar[tuple[str, ...]] = ("radius",)

    def __post_init__(self) -> None:
        radii = tuple(float(radius) for radius in self.radii)
        if not radii or not all(0 < radius < math.inf for radius in radii):
            raise ValueError(f"radii: {self.radii!r} is not a sequence of finite numbers above 0")
        object.__setattr__(self, "radii", radii)

    @property
    def coordinates(self) -> Mapping[str, NDArray[Any]]:
        """The radii, in pixels."""
        return {"radius": np.array(self.radii)}

    def __call__(self, frames: Frames) -> NDArray[np.float64]:
        """Return one share per radius."""
        colours = _colours(frames, self.framebuffer)
        light = colours @ _LUMINANCE if colours.shape[2] == 3 else colours[:, :, 0]
        light = np.where(np.isfinite(light), np.maximum(light, 0), 0)
        total = light.sum()
        if total == 0:
            return np.full(len(self.radii), math.nan)
        x, y = np.arange(light.shape[1]), np.arange(light.shape[0])
        if self.centre is None:
            across, down = light.sum(axis=0) @ x / total, light.sum(axis=1) @ y / total
        else:
            across, down = self.centre
        squared = (x - across) ** 2 + ((y - down) ** 2)[:, np.newaxis]
        bins = np.searchsorted(np.sort(np.square(self.radii)), squared.ravel(), side="left")
        sums = np.bincount(bins, light.ravel(), len(self.radii) + 1)[:-1].cumsum() / total
        shares = np.empty(len(self.radii))
        shares[np.argsort(self.radii, kind="stable")] = sums
        return shares


@dataclass(frozen=True, kw_only=True)
class Comparing(Reduction):
    """Base class of the reductions that compare with a reference.

    Parameters
    ----------
    against : ndarray or mapping of str to object
        The reference: a frame of the same shape, or a point of the grid by the values of some of
        its axes, such as ``{"blur_scale": 1.0}``. Along axes that are not named, a point is
        compared with the reference at its own value.
    framebuffer : str
        The framebuffer to compare.
    data_range : float, optional
        Data range of the metric. Default: 1 for integers; for floats the range of the values, 0
        and 1.
    nits_per_unit : float, optional
        Luminance of a linear value of 1 in cd/m2, as for `vkbloom._views.comparison.compare`.
    pixels_per_degree : float, optional
        Pixels for each degree of the observer's view; FLIP's default is 67.02.
    """

    against: NDArray[Any] | Mapping[str, Any]
    data_range: float | None = None
    nits_per_unit: float | None = None
    pixels_per_degree: float | None = None

    metric: ClassVar[Metric]

    def __post_init__(self) -> None:
        if not isinstance(self.against, np.ndarray | Mapping):
            raise TypeError(
                f"against: {type(self.against).__name__} is not an array or a mapping of axis "
                "names to values"
            )

    def __call__(self, frames: Frames) -> float:
        """Return the figure; NaN if it cannot be computed."""
        if not isinstance(self.against, np.ndarray):
            raise TypeError("against: a mapping is not a frame; only a grid can resolve a point")
        found = compare(
            self.against,
            frames[self.framebuffer],
            allow_nan=True,
            data_range=self.data_range,
            metrics=[self.metric],
            nits_per_unit=self.nits_per_unit,
            pixels_per_degree=self.pixels_per_degree,
        )
        if found.percent_over is None:
            raise ValueError(f"against: {'; '.join(found.mismatches)}")
        value = getattr(found, self.metric)
        return math.nan if value is None else float(value)


@dataclass(frozen=True, kw_only=True)
class SSIM(Comparing):
    """Structural similarity to a reference (scikit-image, window of 7 x 7).

    Parameters
    ----------
    against, framebuffer, data_range
        As for `Comparing`.
    """

    metric: ClassVar[Metric] = "ssim"


@dataclass(frozen=True, kw_only=True)
class PSNR(Comparing):
    """Peak signal-to-noise ratio to a reference; infinite if nothing differs.

    Parameters
    ----------
    against, framebuffer, data_range
        As for `Comparing`.

    Examples
    --------
    Every point of a grid against the one with `blur_scale` 1:

    >>> image = np.zeros((16, 16, 4), np.uint8)
    >>> image[8, 8] = 255
    >>> with vkbloom.Renderer("software") as renderer:
    ...     grid = vkbloom.grid(
    ...         image,
    ...         vkbloom.Separable(),
    ...         {"blur_scale": [1.0, 2.0]},
    ...         reduce={"psnr": PSNR(against={"blur_scale": 1.0})},
    ...         renderer=renderer,
    ...     )
    >>> np.isinf(grid["psnr"].values)
    array([ True, False])
    """

    metric: ClassVar[Metric] = "psnr"
    units: ClassVar[str] = "dB"


@dataclass(frozen=True, kw_only=True)
class FLIP(Comparing):
    """Mean FLIP against a reference (OpenImageIO; HDR-FLIP for floats).

    Parameters
    ----------
    against, framebuffer, data_range
        As for `Comparing`.
    """

    metric: ClassVar[Metric] = "flip"


@dataclass(frozen=True, kw_only=True)
class ColorVideoVDP(Comparing):
    """Visible differences to a reference by ColorVideoVDP, in just-objectionable differences.

    10 where no difference is visible, less by one for each step that an observer objects to. The
    figure is of a display that shows `nits_per_unit` for a linear value of 1, seen with
    `pixels_per_degree`; without these it means nothing, and both are needed. Where the package is
    missing (``pip install vkbloom[cvvdp]``, which brings PyTorch), the figure is NaN, with a
    warning.

    Parameters
    ----------
    against, framebuffer, data_range, nits_per_unit, pixels_per_degree
        As for `Comparing`.

    Raises
    ------
    ValueError
        `nits_per_unit` or `pixels_per_degree` is missing.
    """

    metric: ClassVar[Metric] = "cvvdp"
    units: ClassVar[str] = "JOD"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("nits_per_unit", "pixels_per_degree"):
            if getattr(self, name) is None:
                raise ValueError(f"{name}: None is not a number; ColorVideoVDP needs one")
        if find_spec("pycvvdp") is None:
            warnings.warn(
                "ColorVideoVDP is left out: it needs pycvvdp, pip install vkbloom[cvvdp]",
                stacklevel=3,
            )
