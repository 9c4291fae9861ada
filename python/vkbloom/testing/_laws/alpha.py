"""A law of glow over transparent ground."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom.testing._deviations import judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._probe import Bloom, Image, NotTaken, Probe, call, small_probe
from vkbloom.testing._subject import Subject

__tracebackhide__ = True

# Below common thresholds, since a threshold is not linear.
_BACKDROPS = (0.0, 0.25)


def _test_alpha(subject: Subject, limits: Limits) -> None:
    """Compare glow over transparent ground with the glow of the flattened picture.

    Images are premultiplied. The picture over any backdrop looks as if it had been flattened first,
    less the bloom of the backdrop itself. For the bloom alone, its colours do not depend on alpha.
    """
    bloom, probe, limit = subject.picture or subject.bloom, subject.probe, limits["alpha"]
    if probe.levels is not None:
        raise ValueError(
            f"cannot be tested in {probe.levels.reason}: files of integers hold no light without "
            "alpha"
        )
    if probe.dtype.kind == "u" or probe.colours < 3:
        raise NotTaken(f"probe: {probe.colours} channels of {probe.dtype} hold no sum with alpha")
    probe = small_probe(probe)
    colours, alpha = _lights(probe)
    glow, opaque, is_picture = _colours_alike(bloom, probe, colours, alpha, limit)
    if not is_picture:
        return
    law = "the picture over any backdrop looks as if it had been flattened first"
    for level in _BACKDROPS:
        behind = (1 - alpha) * level * np.ones(3)
        seen = glow[..., :3] + (1 - glow[..., 3:]) * level
        flattened = _apply(bloom, probe, colours + behind, np.ones_like(alpha))[..., :3]
        backdrop = _apply(bloom, probe, behind, np.ones_like(alpha))[..., :3]
        off = seen - (flattened - backdrop + behind)
        # A threshold of an average of light and backdrop is not linear, whatever the alpha.
        bend = np.abs(flattened - backdrop - opaque)
        off = np.sign(off) * np.maximum(np.abs(off) - bend, 0)
        _judge(law, off, colours.max(), limit, f"over a backdrop of {level:g}, ")


def _lights(probe: Probe) -> tuple[Image, Image]:
    """Return the colours and the alpha of two lights, one opaque and one half transparent."""
    width, height = probe.size
    alpha = np.zeros((height, width, 1))
    colours = np.zeros((height, width, 3))
    x, y = probe.centre
    for share, left, top in ((1.0, x - 8, y - 8), (0.5, x + 4, y + 2)):
        window = np.s_[max(0, top) : top + 5, max(0, left) : left + 5]
        alpha[window] = share
        colours[window] = share * probe.value * np.array([1.0, 0.5, 0.75])
    return colours, alpha


def _colours_alike(
    bloom: Bloom, probe: Probe, colours: Image, alpha: Image, limit: float
) -> tuple[Image, Image, bool]:
    """Return the results over transparent ground and with an alpha of 1.

    And whether they are pictures with alpha.
    """
    try:
        result = _apply(bloom, probe, colours, alpha)
    except Exception as error:
        # A bloom that fails for these colours without alpha, too, fails for another reason.
        probe.apply(bloom, colours)
        raise NotTaken(f"bloom: it takes no image of four channels ({error})") from None
    opaque = _apply(bloom, probe, colours, np.ones_like(alpha))[..., :3]
    law = "the colours of a premultiplied bloom do not depend on alpha"
    _judge(law, result[..., :3] - opaque, colours.max(), limit, "")
    # A picture contains its image; the bloom alone has another light.
    contains = bool((result[..., :3] >= colours - limit * colours.max()).all())
    return result, opaque, contains and result.shape[2] == 4


def _apply(bloom: Bloom, probe: Probe, colours: Image, alpha: Image) -> Image:
    given: NDArray[Any] = np.concatenate([colours, alpha], axis=2).astype(probe.dtype)
    outcome = np.asarray(call(bloom, given))
    if outcome.ndim != 3 or outcome.shape[:2] != given.shape[:2] or outcome.shape[2] not in (3, 4):
        raise ValueError(f"it returns shape {outcome.shape} for {given.shape}")
    result: Image = outcome.astype(np.float64)
    return result


def _judge(law: str, off: Image, largest: float, limit: float, where: str) -> None:
    """Compare differences with the limit."""
    position = np.unravel_index(int(np.abs(off).argmax()), off.shape)
    share = abs(float(off[position])) / largest
    y, x, channel = position
    text = (
        f"{where}x {x}, y {y}, channel {channel} is too "
        f"{'bright' if off[position] > 0 else 'dark'} by {share:.3g} of the brightest value: "
        f"{limit:g} allowed"
    )
    judge(law, ("alpha", share, limit, text))


ALPHA: Final = Law(
    name="alpha",
    test=_test_alpha,
    formula="F(a) + (1 - A) b = F(a + (1 - alpha) b) - F((1 - alpha) b) + (1 - alpha) b, "
    "premultiplied, for backdrops b of 0 and 1/4",
    figures={"alpha": Figure("largest difference, as a share of the brightest value", 0.01)},
    why="A glow with an alpha of its own covers the backdrop instead of adding to it.",
)
