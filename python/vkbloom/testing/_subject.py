"""The bloom that laws are tested on, and what more than one law measures of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from vkbloom._locks import cached_property
from vkbloom.testing._moving_light import Stability, stability
from vkbloom.testing._point_spread import measured_spread, point_spread
from vkbloom.testing._probe import Bloom, Image, Probe
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


@dataclass(eq=False, kw_only=True)
class Subject:
    """A bloom under test, and what is known of it.

    - `bloom`: The bloom alone; or the picture with it, where the bloom is not known apart.
    - `picture`: The picture with its bloom, if both are known.
    - `intensity`: The factor of the bloom in `picture`; None: it is not simply added.
    - `gain`: What flat images should get. None: it is not promised.
    - `highest`: The largest value of an image that the bloom can be given.
    - `differences`: Returns the difference from a reference by framebuffer, as a share of its
      largest value. None: there is no reference.
    """

    bloom: Bloom
    probe: Probe
    picture: Bloom | None = None
    intensity: float | None = None
    gain: float | None = None
    highest: float = 1024.0
    differences: Callable[[], Mapping[str, float]] | None = None

    @cached_property
    def measured_gain(self) -> float:
        """The gain of a flat image, in its middle."""
        flat = self.probe.apply(self.bloom, self.probe.flat(self.probe.value))[0]
        x, y = self.probe.centre
        return max(0.0, float(flat[y, x].mean()) / self.probe.value)

    @cached_property
    def lamp(self) -> Probe:
        """The probe of a light that a threshold lets through wherever it falls."""
        probe = self.probe
        if probe.dtype.kind == "u" or self.highest <= probe.value:
            return probe
        # Between four pixels, each of them gets a quarter.
        quarter = dataclasses.replace(probe, value=probe.value / 4)
        dim = probe.value > 1 or not point_spread(self.bloom, quarter).max() > 0
        return dataclasses.replace(probe, value=_LAMP) if dim else probe

    @cached_property
    def dark(self) -> tuple[Image, float]:
        """The bloom of a black image, and the error of its values."""
        return self.probe.apply(self.bloom, self.probe.flat(0.0))

    @cached_property
    def pixel(self) -> tuple[Image, float]:
        """The point spread of the probe's brightest value, and the error of its values."""
        return measured_spread(self.bloom, self.probe, dark=self.dark)

    @cached_property
    def spread(self) -> Image:
        """The point spread of the lamp."""
        lamp = self.lamp
        if lamp is self.probe:
            return self.pixel[0]
        return measured_spread(self.bloom, lamp, dark=self.dark)[0]

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
    """Return the probe with a higher value if a bloom of its own value is black."""
    if probe.dtype.kind == "u" or probe.apply(bloom, probe.noise(0, probe.value))[0].any():
        return probe
    return dataclasses.replace(probe, value=_BRIGHT * probe.value)
