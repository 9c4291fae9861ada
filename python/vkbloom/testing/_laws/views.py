"""A law of pictures with two views: no light crosses their seam."""

from __future__ import annotations

from typing import Final

import numpy as np

from vkbloom.testing._deviations import judge
from vkbloom.testing._laws.law import Figure, Law, Limits
from vkbloom.testing._probe import NotTaken, call, takes
from vkbloom.testing._subject import Subject

__tracebackhide__ = True


def _test_views(subject: Subject, limits: Limits) -> None:
    """Compare a view beside a black one with the same view beside noise.

    The picture has two views, side by side and then one above the other, as for the two eyes of a
    headset, each of the probe's size. The bloom takes `region`, (x, y, width, height) in pixels,
    and returns an image of the picture's size, or of that of the region.
    """
    bloom, probe, limit = subject.bloom, subject.probe, limits["crosstalk"]
    if not takes(bloom, "region"):
        raise NotTaken("bloom: it takes no keyword region, so views are not told apart")
    noise = [probe.noise(index, probe.value) for index in (0, 1)]
    law = "the bloom of a view depends on the pixels of that view alone"
    for side, name in enumerate(("left", "right", "upper", "lower")):
        axis, second = 1 - side // 2, side % 2
        corner = second * np.array(probe.size) * (axis == 1, axis == 0)
        results = []
        for other in (probe.flat(0.0), noise[1 - second]):
            views = [other, noise[second]] if second else [noise[second], other]
            given = probe.as_input(np.concatenate(views, axis=axis))
            region = (*map(int, corner), *probe.size)
            result = np.asarray(call(bloom, given, region=region))
            if result.shape[:2] == given.shape[:2]:
                result = np.split(result, 2, axis=axis)[second]
            results.append(probe.values(result, probe.as_input(noise[second])))
        (alone, error), (beside, _) = results
        off = np.abs(beside - alone)
        largest = float(np.abs(alone).max()) or 1.0
        share = max(0.0, float((off - 2 * error).max())) / largest
        y, x, _ = np.unravel_index(int(off.argmax()), off.shape)
        text = (
            f"the other view changes the {name} one by {share:.3g} of its largest value, most at "
            f"x {x}, y {y}: {limit:g} allowed"
        )
        judge(law, ("crosstalk", share, limit, text))


VIEWS: Final = Law(
    name="views",
    test=_test_views,
    formula="B(a, region=r) inside of r depends on the pixels inside of r alone",
    figures={
        "crosstalk": Figure(
            "largest change of a view by the other one, as a share of its largest value", 1e-3
        ),
    },
    why="A bloom of a picture with two views reads across their seam, unless each view is blurred "
    "by itself.",
)
