"""A pyramid of five levels against pygfx's bloom pass and a Gaussian of the same spread.

NumPy array in, new NumPy array out, another image in each round; wall-clock time. pygfx runs its
`PhysicalBasedBloomPass`, the same chain after Jimenez 2014, with five levels, on the same adapter
and the same number of pixels. Its tent has one radius for all levels, relative to the width. Ours
has a radius in texels of each level. So the pictures differ; pygfx's radius is set so that both
have the same spread.

The Gaussian has the same spread, too. OpenCV converts half floats itself.
"""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom
from benchmarks import peers
from benchmarks.inputs import COUNT, pictures
from benchmarks.ours import OURS, contest, prepare_call, ratios
from benchmarks.plan import Plan
from benchmarks.results import Agreement, Section, Table
from benchmarks.spread import spread
from benchmarks.timing import Contender

__all__ = ["run"]

LEVELS: Final = 5
SETTINGS: Final = vkbloom.Pyramid(levels=LEVELS)
SIZE: Final = (1920, 1080)
ROUNDS: Final = 15
FRAGMENT: Final = "vkbloom, fragment variant"
GAUSSIAN: Final = "OpenCV GaussianBlur"
PYGFX: Final = "pygfx"
PYGFX_COPY: Final = "pygfx, upload and readback alone"


def run(plan: Plan, section: Section) -> None:
    """Time ``Pyramid(levels=5)`` of half-float RGBA images."""
    size = plan.size(*SIZE)
    section.title = f"Pyramid(levels=5) at {size[0]} x {size[1]}, float16 RGBA"
    images = pictures(size, np.float16)
    with ExitStack() as stack:
        ours, source = (
            stack.enter_context(plan.renderer(variant)) for variant in ("auto", "fragment")
        )
        sigma, gain = spread(
            lambda image: ours.apply(image, SETTINGS, framebuffers=("bloom",))["bloom"], size
        )
        spreads = {OURS: (sigma, gain)}
        whole, fragments = (prepare_call(one, images, SETTINGS) for one in (ours, source))
        contenders = [Contender(OURS, whole), Contender(FRAGMENT, fragments)]
        contenders += _pygfx(section, images, size, ours.info.name, spreads)
        contenders += _gaussian(plan, section, images, spreads)
        wrong = {found.what.partition(":")[0] for found in section.agreements if not found.agrees}
        times = contest(
            plan,
            section,
            "float16, RGBA",
            [each for each in contenders if each.name not in wrong],
            ROUNDS,
            pictures=[(FRAGMENT, whole(0)["final"], fragments(0)["final"])],
            allowed=(8e-3, "nine roundings to half of values up to 2"),
        )
    rows = tuple((name, f"{sigma:.2f}", f"{gain:.4f}") for name, (sigma, gain) in spreads.items())
    section.tables.append(
        Table("Spread: standard deviation of the blur alone", ("", "pixels", "gain"), rows)
    )
    ratios(section, "pyramid", times, (PYGFX, OURS, 3.8, False), (GAUSSIAN, OURS, 7.0, False))


def _pygfx(
    section: Section,
    images: list[NDArray[Any]],
    size: tuple[int, int],
    adapter: str,
    spreads: dict[str, tuple[float, float]],
) -> list[Contender]:
    """Fit pygfx's radius to our spread, and return its contenders."""
    made = peers.gather(
        (PYGFX,), lambda peer: {PYGFX: peer.Bloom(size, LEVELS, adapter)}, section.missing
    )
    if PYGFX not in made:
        return []
    peer = made[PYGFX]
    sigma, _ = spreads[OURS]
    peer.radius = radius = _fitting_radius(peer, size, sigma)
    found, gain = spread(peer.bloom, size)
    spreads[f"{PYGFX}, filter_radius {radius:.5f}"] = (found, gain)
    reason = "the radius is fitted to a third of a pixel"
    section.agreements += [
        Agreement(f"{PYGFX}: spread, relative", abs(found / sigma - 1), 0.02, reason),
        # pygfx adds its levels without dividing by their number.
        Agreement(f"{PYGFX}: gain, relative", abs(gain / LEVELS - 1), 0.01, "sums of small halves"),
    ]
    return [
        Contender(PYGFX, lambda turn: peer.bloom(images[turn % COUNT], 1 / LEVELS)),
        Contender(PYGFX_COPY, lambda turn: peer.copy(images[turn % COUNT])),
    ]


def _fitting_radius(peer: Any, size: tuple[int, int], sigma: float) -> float:
    """Return the radius at which pygfx's bloom has the given spread."""
    # Relative to the width. 40 pixels are more than twice our distance at the last level.
    low, high = 0.0, 40 / size[0]
    for _ in range(7):
        peer.radius = middle = (low + high) / 2
        if spread(peer.bloom, size)[0] < sigma:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def _gaussian(
    plan: Plan,
    section: Section,
    images: list[NDArray[Any]],
    spreads: dict[str, tuple[float, float]],
) -> list[Contender]:
    sigma, _ = spreads[OURS]
    made = peers.gather(
        ("OpenCV",),
        lambda peer: peer.gaussian_bloom(images[0], sigma, plan.threads),
        section.missing,
    )
    if GAUSSIAN not in made:
        return []
    bloom = made[GAUSSIAN]
    size = (images[0].shape[1], images[0].shape[0])
    found, gain = spread(lambda image: bloom(image).astype(np.float32) - image, size)
    spreads[f"{GAUSSIAN}, sigma {sigma:.2f}"] = (found, gain)
    section.agreements += [
        Agreement(
            f"{GAUSSIAN}: spread, relative", abs(found / sigma - 1), 0.02, "the kernel is truncated"
        ),
        Agreement(f"{GAUSSIAN}: gain, relative", abs(gain - 1), 0.01, "sums of small halves"),
    ]
    return [Contender(GAUSSIAN, lambda turn: bloom(images[turn % COUNT]))]
