"""Figures of frames, so that a big grid need not be stored: what ``reduce`` takes, ready made.

Any callable of `Frames` that returns a number or a small array will do. One that has an attribute
``attachments`` is given those framebuffers only; any other gets all of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vkbloom.frames import Frames
from vkbloom.views.comparison import Metric, compare

__all__ = ["FLIP", "PSNR", "SSIM", "EncircledEnergy", "Max", "Mean", "Reduction"]

# Of linear colours with the primaries of Rec. ITU-R BT.709.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def _colours(frames: Frames, attachment: str) -> NDArray[np.float64]:
    """Return red, green and blue (or depth) as (H, W, C), 8-bit values as 0 to 1."""
    array = np.atleast_3d(frames[attachment])[:, :, :3]
    return array.astype(np.float64) / (255 if array.dtype == np.uint8 else 1)


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """What the ready reductions share.

    Parameters
    ----------
    attachment : str
        The framebuffer that is looked at.
    """

    attachment: str = "final"

    #: Dimensions of what the reduction returns, none for a number.
    dims: ClassVar[tuple[str, ...]] = ()
    units: ClassVar[str] = "1"

    @property
    def attachments(self) -> tuple[str, ...]:
        """The framebuffers that the reduction needs."""
        return (self.attachment,)

    @property
    def coordinates(self) -> Mapping[str, NDArray[Any]]:
        """Coordinates of the dimensions."""
        return {}

    @property
    def description(self) -> str:
        """The first line of the documentation, and the framebuffer."""
        text = (type(self).__doc__ or type(self).__name__).splitlines()[0].rstrip(".")
        return f"{text}, of {self.attachment}"

    def __call__(self, frames: Frames) -> Any:
        """Return the figure of one point."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Mean(Reduction):
    """Mean of red, green and blue over all pixels.

    Parameters
    ----------
    attachment : str
        8-bit values count as 0 to 1; values that are not finite are left out, and so is alpha.
    """

    def __call__(self, frames: Frames) -> float:
        """Return the mean, NaN where no value is finite."""
        values = _colours(frames, self.attachment)
        finite = np.isfinite(values)
        return float(values.mean(where=finite)) if finite.any() else math.nan


@dataclass(frozen=True, kw_only=True)
class Max(Reduction):
    """Largest of all values of red, green and blue.

    Parameters
    ----------
    attachment : str
        8-bit values count as 0 to 1; values that are not finite are left out, and so is alpha.
    """

    def __call__(self, frames: Frames) -> float:
        """Return the largest value, NaN where none is finite."""
        values = _colours(frames, self.attachment)
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
        x and y, pixel centres being whole numbers. None: the centroid of the light.
    attachment : str

    Notes
    -----
    EE(r) = sum of L over the pixels with (x - cx)^2 + (y - cy)^2 <= r^2, by the sum of L over all;
    L = 0.2126 R + 0.7152 G + 0.0722 B (Rec. ITU-R BT.709), or the depth. As in optics, where the
    energy of a point-spread function is measured so. Values that are not finite count as 0, and so
    do negative ones. NaN where there is no light.
    """

    attachment: str = "bloom"
    radii: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
    centre: tuple[float, float] | None = None

    dims: ClassVar[tuple[str, ...]] = ("radius",)

    def __post_init__(self) -> None:
        radii = tuple(float(radius) for radius in self.radii)
        if not radii or not all(0 < radius < math.inf for radius in radii):
            raise ValueError(f"radii: {self.radii!r} is out of range, finite and above 0")
        object.__setattr__(self, "radii", radii)

    @property
    def coordinates(self) -> Mapping[str, NDArray[Any]]:
        """The radii, in pixels."""
        return {"radius": np.array(self.radii)}

    def __call__(self, frames: Frames) -> NDArray[np.float64]:
        """Return the shares, one a radius."""
        colours = _colours(frames, self.attachment)
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
    """What SSIM, PSNR and FLIP share.

    Parameters
    ----------
    against : ndarray or mapping of str to object
        The reference: a frame of the same shape, or a point of the grid by some of its axes, such
        as ``{"blur_scale": 1.0}``. Along axes that are not named, every point is compared with the
        one at its own place.
    attachment : str
    data_range : float, optional
        As in ``vkbloom compare``: by default 1 for integers, and for floats what the values span
        together with 0 and 1.
    """

    against: NDArray[Any] | Mapping[str, Any]
    data_range: float | None = None

    metric: ClassVar[Metric]

    def __post_init__(self) -> None:
        if not isinstance(self.against, np.ndarray | Mapping):
            raise TypeError(
                "against: a frame or a point of the grid is needed, not "
                f"{type(self.against).__name__}"
            )

    def __call__(self, frames: Frames) -> float:
        """Return the figure, NaN where it cannot be computed."""
        if not isinstance(self.against, np.ndarray):
            raise TypeError("against: a point is known to a grid only, a frame is needed here")
        found = compare(
            self.against,
            frames[self.attachment],
            allow_nan=True,
            data_range=self.data_range,
            metrics=[self.metric],
        )
        if found.percent_over is None:
            raise ValueError(f"against: {'; '.join(found.mismatches)}")
        value = getattr(found, self.metric)
        return math.nan if value is None else float(value)


@dataclass(frozen=True, kw_only=True)
class SSIM(Comparing):
    """Structural similarity to a reference (scikit-image's, window of 7 x 7)."""

    metric: ClassVar[Metric] = "ssim"


@dataclass(frozen=True, kw_only=True)
class PSNR(Comparing):
    """Peak signal-to-noise ratio to a reference; infinite where nothing differs."""

    metric: ClassVar[Metric] = "psnr"
    units: ClassVar[str] = "dB"


@dataclass(frozen=True, kw_only=True)
class FLIP(Comparing):
    """Mean FLIP against a reference (OpenImageIO's; HDR-FLIP for floats)."""

    metric: ClassVar[Metric] = "flip"
