"""The bloom that laws are tested on, and what more than one law measures of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from vkbloom._locks import cached_property
from vkbloom._psf.varying import Varying
from vkbloom.testing._last_pixel import LastPixel, last_pixel
from vkbloom.testing._moving_light import Stability, stability
from vkbloom.testing._point_spread import measure_spread, point_spread, sum_error
from vkbloom.testing._probe import Bloom, Error, Image, Probe, guard, takes
from vkbloom.testing._scaled_scene import ResolutionResponse, resolution_response

# A threshold of 1, the usual one, lets nothing of an image of 1 through.
_BRIGHT: Final = 16.0
# Sum of a light that is above thresholds where it falls on four pixels.
_LAMP: Final = 1000.0
# The longest path of the moving light in pixels, and its positions for each pixel: positions inside
# of pixels and between them, on even and on odd ones.
TEXEL: Final = 8
_STEPS: Final = 2.0
_SCENE: Final = (128, 128)


# Values of flat images that are tried in files of integers, twice which is not clipped; and the
# largest value that is surely not.
_LEVELS: Final = (0.49, 0.24, 0.12, 0.06)
_UNCLIPPED: Final = 0.995


@dataclass(eq=False, kw_only=True)
class Subject:
    """A bloom under test, and what is known of it.

    - `bloom`: The bloom alone; or the picture with it, where the bloom is not known apart.
    - `picture`: The picture with its bloom, if both are known.
    - `toned`: The same after the tone curve "reinhard", where there is one to choose.
    - `intensity`: The factor of the bloom in `picture`; None: it is not simply added.
    - `gain`: What flat images should get. None: it is not promised.
    - `field`: The kernels of all places that lights should show. None: they are not promised.
    - `highest`: The largest value of an image that the bloom can be given.
    - `differences`: Returns the difference from a reference by framebuffer, as a share of its
      largest value. None: there is no reference.
    """

    bloom: Bloom
    probe: Probe
    picture: Bloom | None = None
    toned: Bloom | None = None
    intensity: float | None = None
    gain: float | None = None
    field: Varying | None = None
    highest: float = 1024.0
    differences: Callable[[], Mapping[str, float]] | None = None

    def __post_init__(self) -> None:
        """Tell errors of the blooms from those of the report."""
        self.bloom = guard(self.bloom)
        if self.picture is not None:
            self.picture = guard(self.picture)
        if self.toned is not None:
            self.toned = guard(self.toned)

    @cached_property
    def measured_gain(self) -> float:
        """The gain of a flat image, in its middle."""
        flat = self.probe.apply(self.bloom, self.probe.flat(self.probe.value))[0]
        x, y = self.probe.centre
        return max(0.0, float(flat[y, x].mean()) / self.probe.value)

    @property
    def untaken(self) -> tuple[str, ...]:
        """What the bloom does not take of what laws can give."""
        return tuple(name for name in ("region", "time") if not takes(self.bloom, name))

    def try_once(self) -> None:
        """Run the bloom, so that one that cannot run at all fails."""
        _ = self.measured_gain

    def check_visible(self) -> None:
        """Raise ValueError if a bloom that needs values above 1 cannot be given any."""
        levels = self.probe.levels
        if levels is not None and self.measured_gain <= self.gain_error:
            raise ValueError(
                f"cannot be tested in {levels.reason}: the bloom of values up to 1 is black"
            )

    def check_spread_visible(self) -> None:
        """Raise ValueError if the bloom of a pixel is black."""
        spread, error = self.light
        if not spread.max(axis=(0, 1)).min() > np.min(error):
            raise ValueError("the bloom of a pixel is black, as after a median or a threshold")

    @property
    def gain_error(self) -> float:
        """The error of the measured gain, where values have few levels."""
        probe = self.probe
        if probe.levels is None:
            return 0.0
        value = np.full((1, 1, 1), probe.value)
        error = probe.levels.error(value * self.measured_gain, value)
        return float(error.max()) / probe.value

    @property
    def picture_probe(self) -> Probe:
        """The probe of the picture with its bloom."""
        levels = self.probe.levels
        if self.picture is None or levels is None:
            return self.probe
        picture = dataclasses.replace(levels, is_difference=False)
        return dataclasses.replace(self.probe, levels=picture)

    @cached_property
    def lamp(self) -> Probe:
        """The probe of a light that a threshold lets through wherever it falls."""
        probe = self.probe
        if probe.dtype.kind == "u" or probe.levels is not None or self.highest <= probe.value:
            return probe
        # Between four pixels, each of them gets a quarter.
        quarter = dataclasses.replace(probe, value=probe.value / 4)
        dim = probe.value > 1 or not point_spread(self.bloom, quarter).max() > 0
        return dataclasses.replace(probe, value=_LAMP) if dim else probe

    @cached_property
    def dark(self) -> tuple[Image, Error]:
        """The bloom of a black image, and the error of its values."""
        return self.probe.apply(self.bloom, self.probe.flat(0.0))

    @cached_property
    def pixel(self) -> tuple[Image, Error]:
        """The point spread of the probe's brightest value, and the error of its values."""
        return measure_spread(self.bloom, self.probe, dark=self.dark)

    @cached_property
    def light(self) -> tuple[Image, Error]:
        """The same of a light whose bloom has many levels: a square where levels are few."""
        side = self.probe.light_side
        if side == 1:
            return self.pixel
        return measure_spread(self.bloom, self.probe, dark=self.dark, side=side)

    @property
    def energy(self) -> tuple[float, tuple[float, float]]:
        """The light of the bloom of a light, as a share of it, and its errors by `sum_error`."""
        spread, error = self.light
        area = self.probe.light_side**2
        energy = float(spread.sum(axis=(0, 1)).mean()) / area
        if self.probe.levels is None:
            return energy, (0.0, 0.0)
        lit, black = sum_error(spread, error)
        return energy, (lit / area, black / area)

    @cached_property
    def spread(self) -> Image:
        """The point spread of the lamp."""
        lamp = self.lamp
        if lamp is self.probe:
            return self.pixel[0]
        return measure_spread(self.bloom, lamp, dark=self.dark)[0]

    @cached_property
    def last_pixel(self) -> LastPixel:
        """The bloom of the last pixel of an image with odd sides."""
        return last_pixel(self.bloom, self.lamp, is_dark=not self.dark[0].any())

    @cached_property
    def stability(self) -> Stability:
        """The figures of the moving lamp."""
        return stability(self.bloom, texel=TEXEL, steps=_STEPS, probe=self.lamp)

    @cached_property
    def resolution(self) -> ResolutionResponse:
        """The figures of one scene at four sizes."""
        probe = dataclasses.replace(self.probe, size=_SCENE)
        return resolution_response(self.bloom, probe=probe)

    @cached_property
    def reference(self) -> Mapping[str, float]:
        """The differences from the reference; empty without one."""
        return {} if self.differences is None else self.differences()


def fitting_probe(bloom: Bloom, probe: Probe) -> Probe:
    """Return the probe with a value whose bloom is neither black nor clipped."""
    if probe.levels is not None:
        return _avoid_clipping(bloom, probe)
    if probe.dtype.kind == "u" or probe.apply(bloom, probe.noise(0, probe.value))[0].any():
        return probe
    return dataclasses.replace(probe, value=_BRIGHT * probe.value)


def _avoid_clipping(bloom: Bloom, probe: Probe) -> Probe:
    """Return the probe with a value up to a half whose flat image has a bloom below 1.

    With 1, if the bloom of a half is black.
    """
    for value in _LEVELS:
        image = probe.quantize(probe.flat(value))
        result, error = probe.apply(bloom, image)
        if not (np.abs(result) > error).any():
            return dataclasses.replace(probe, value=1.0 if value == _LEVELS[0] else 2 * value)
        shown = result + image if probe.levels and probe.levels.is_difference else result
        if shown.max() < _UNCLIPPED:
            return dataclasses.replace(probe, value=float(image.max()))
    return dataclasses.replace(probe, value=_LEVELS[-1])
