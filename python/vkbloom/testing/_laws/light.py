"""Laws of the light of a bloom: its energy, and what becomes of each channel."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from vkbloom.testing._deviations import compare_with_law, figure, judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._point_spread import border_share, check_inside
from vkbloom.testing._probe import Probe
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

_COLOUR: Final = (1.0, 0.5, 0.25)
_OFF: Final = "largest difference of a value"


def _test_energy(subject: Subject, limits: Limits) -> None:
    if subject.measured_gain > 0:
        subject.check_spread_visible()
    probe, limit = subject.probe, limits["off"]
    check_inside(border_share(subject.light[0]), probe.size)
    energy, (error, rounded_to_black) = subject.energy
    figure("energy", energy)
    promised = 1.0 if subject.gain is None else subject.gain
    off = abs(energy - promised)
    # Infinity times no light is not a number.
    allowed = limit if math.isinf(limit) else limit * max(promised, energy)
    # Light that is missing may lie below the first level.
    if energy < promised and off > allowed - error:
        error += rounded_to_black
    law = f"the bloom of a lit pixel has {promised:.4g} times the light of the pixel"
    text = f"{energy:.4g} instead of {promised:.4g}: off by {off:.3g}, {allowed:.3g} allowed"
    judge(law, ("off", off, allowed, text, error), probe=probe)


ENERGY: Final = Law(
    name="energy",
    test=_test_energy,
    formula="the bloom of a lit pixel has the light of the pixel, times the gain that is promised; "
    "1 if none is",
    figures={
        "energy": Figure("light of the bloom, as a share of that of the pixel"),
        "off": Figure(
            "difference from the promised light; the limit is a share of the larger", 0.02
        ),
    },
    why="Light is lost where taps skip pixels, weights do not add up to 1, or the border reads "
    "black; with a threshold, a small light is another share of what is above it. A bloom of "
    "another strength promises another gain.",
)


def _check_coloured(probe: Probe) -> None:
    if probe.colours < len(_COLOUR):
        raise ValueError(f"probe: {probe.colours} channel has no colour; 3 channels are needed")


def _test_colour(subject: Subject, limits: Limits) -> None:
    probe = subject.probe
    _check_coloured(probe)
    image = probe.quantize(probe.flat(probe.value) * np.array(_COLOUR))
    result, error = probe.apply(subject.bloom, image)
    expected = image * (result.mean() / image.mean())
    # The mean has an error of its own, where values have few levels.
    errors = error if probe.levels is None else error + image / image.mean() * np.mean(error)
    law = "all channels of a flat coloured image get the same gain"
    compare_with_law(probe, law, result, expected, errors, limit=limits["off"])


COLOUR: Final = Law(
    name="colour",
    test=_test_colour,
    formula="all channels of a flat coloured image get the same gain",
    figures={"off": Figure(_OFF, 0.0)},
    why="A threshold or a clamp of each channel alone changes the hue. A tint or a coloured kernel "
    "does so on purpose.",
)


def _test_grey(subject: Subject, limits: Limits) -> None:
    probe = subject.probe
    _check_coloured(probe)
    image = probe.noise(0, probe.value)[..., :1].repeat(3, axis=2)
    result, error = probe.apply(subject.bloom, image)
    expected = np.broadcast_to(result.mean(axis=2, keepdims=True), result.shape)
    law = "the bloom of a grey image is grey: all channels spread alike"
    compare_with_law(probe, law, result, expected, 2 * error, limit=limits["off"])


GREY: Final = Law(
    name="grey",
    test=_test_grey,
    formula="the bloom of a grey image is grey",
    figures={"off": Figure("largest difference of a value from the mean of the channels", 0.0)},
    why="A coloured kernel, a tint and chromatic dispersion spread each channel differently on "
    "purpose.",
)


def _test_channels(subject: Subject, limits: Limits) -> None:
    probe = subject.probe
    _check_coloured(probe)
    dark, dark_error = subject.dark
    for channel in range(3):
        image = probe.noise(0, probe.value) * (np.arange(3) == channel)
        result, error = probe.apply(subject.bloom, image)
        expected = np.where(np.arange(3) == channel, result, dark)
        law = f"the bloom of light in channel {channel} is in channel {channel}"
        errors = error + dark_error
        compare_with_law(probe, law, result, expected, errors, limit=limits["off"])


CHANNELS: Final = Law(
    name="channels",
    test=_test_channels,
    formula="the bloom of light in one channel is in that channel",
    figures={"off": Figure("largest difference of a value from black", 0.0)},
    why="A tint by a luminance, or a change of colour space, mixes channels on purpose.",
)
