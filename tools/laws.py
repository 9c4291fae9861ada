"""Test blurs and blooms of other packages against the laws of `vkbloom.testing`.

``python -m tools.laws`` writes docs/laws.md. It needs the packages of benchmarks/peers.txt and a
Vulkan driver, as pygfx's bloom runs through wgpu.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom
from vkbloom import testing
from vkbloom.testing import Probe
from vkbloom.testing._probe import Bloom

TARGET = Path(__file__).parents[1] / "docs" / "laws.md"
SIGMA = 2.0

# Small kernels end far from the border; the widest level of a chain does not.
SMALL = Probe(size=(65, 65))
CHAIN = Probe(size=(256, 256))
# For methods whose result has half floats for every input.
HALF = dataclasses.replace(CHAIN, dtype="float16")


@dataclasses.dataclass(frozen=True)
class Subject:
    """A blur or bloom to test, and what it promises."""

    name: str
    bloom: Bloom
    probe: Probe
    gain: float | None = None  # None: no promise
    sigma: float | None = None  # in pixels; None: no promise
    picture: bool = False  # the picture with its bloom, not the bloom alone


def opencv() -> Iterator[Subject]:
    """Yield OpenCV's Gaussian and median."""
    import cv2

    def gaussian(image: NDArray[Any]) -> NDArray[Any]:
        return cv2.GaussianBlur(image, (0, 0), SIGMA)

    name = f"OpenCV {version('opencv-python-headless')}"
    yield Subject(f"{name} `GaussianBlur`, float32", gaussian, SMALL, 1.0, SIGMA)
    eight = dataclasses.replace(SMALL, dtype="uint8")
    yield Subject(f"{name} `GaussianBlur`, uint8", gaussian, eight, 1.0, SIGMA)
    yield Subject(f"{name} `medianBlur` of 5", lambda image: cv2.medianBlur(image, 5), SMALL, 1.0)


def scipy() -> Iterator[Subject]:
    """Yield SciPy's Gaussian and box."""
    from scipy import ndimage

    name = f"SciPy {version('scipy')}"
    yield Subject(
        f"{name} `gaussian_filter`",
        lambda image: ndimage.gaussian_filter(image, (SIGMA, SIGMA, 0)),
        SMALL,
        1.0,
        SIGMA,
    )
    yield Subject(
        f'{name} `gaussian_filter`, `mode="constant"`',
        lambda image: ndimage.gaussian_filter(image, (SIGMA, SIGMA, 0), mode="constant"),
        SMALL,
        1.0,
        SIGMA,
    )
    # The variance of n equal weights at integer distances is (n^2 - 1) / 12.
    yield Subject(
        f"{name} `uniform_filter` of 5",
        lambda image: ndimage.uniform_filter(image, (5, 5, 0)),
        SMALL,
        1.0,
        ((5**2 - 1) / 12) ** 0.5,
    )
    yield Subject(
        f"{name} `uniform_filter` of 4",
        lambda image: ndimage.uniform_filter(image, (4, 4, 0)),
        SMALL,
        1.0,
        ((4**2 - 1) / 12) ** 0.5,
    )


def skimage() -> Iterator[Subject]:
    """Yield scikit-image's Gaussian and, as an example that rings, its unsharp mask."""
    from skimage import filters

    name = f"scikit-image {version('scikit-image')}"
    yield Subject(
        f"{name} `gaussian`",
        lambda image: filters.gaussian(image, SIGMA, channel_axis=-1),
        SMALL,
        1.0,
        SIGMA,
    )
    yield Subject(
        f"{name} `unsharp_mask`",
        # With -1 it fills three rows of its result and leaves the rest uninitialized.
        lambda image: filters.unsharp_mask(image, SIGMA, channel_axis=2, preserve_range=True),
        SMALL,
        1.0,
    )


def pygfx(adapter: str) -> Iterator[Subject]:
    """Yield pygfx's bloom alone, and the picture with its default bloom."""
    from benchmarks.peers.pygfx import Bloom as Peer

    name = f"pygfx {version('pygfx')} `PhysicalBasedBloomPass`"
    levels = 4

    peer = Peer(HALF.size, levels, adapter)

    def bloom(*, strength: float = 1.0, karis_average: bool = False) -> Bloom:
        def apply(image: NDArray[Any]) -> NDArray[Any]:
            peer.karis_average = karis_average
            return peer.bloom(np.dstack([image, np.ones_like(image[..., 0])]), strength)

        return apply

    for karis in (False, True):
        yield Subject(
            f"{name}, {levels} levels, `bloom_strength=1`" + ", `use_karis_average`" * karis,
            bloom(karis_average=karis),
            HALF,
            float(levels),
        )
    yield Subject(
        f"{name}, `bloom_strength=0.04`, the picture with it",
        bloom(strength=0.04),
        HALF,
        1.0,
        picture=True,
    )


Law = Callable[[Subject], None]


def laws() -> dict[str, Law]:
    """Return the laws by column; a law that does not apply raises LookupError."""

    def of_the_bloom(law: Callable[[Bloom, Probe], None]) -> Law:
        def check(subject: Subject) -> None:
            if subject.picture:
                raise LookupError("of the bloom alone")
            law(subject.bloom, subject.probe)

        return check

    def gain(subject: Subject) -> None:
        if subject.gain is None:
            raise LookupError("none promised")
        testing.assert_gain(subject.bloom, subject.gain, subject.probe)

    def spread(subject: Subject) -> None:
        if subject.sigma is None:
            raise LookupError("none promised")
        testing.assert_spread(subject.bloom, subject.sigma, subject.probe)

    def additive(subject: Subject) -> None:
        if not subject.picture:
            raise LookupError("of a picture with its bloom")
        testing.assert_additive(subject.bloom, probe=subject.probe)

    return {
        "superposition": lambda s: testing.assert_superposition(s.bloom, s.probe),
        "gain": gain,
        "mirrored": lambda s: testing.assert_symmetric(s.bloom, s.probe),
        "transposed": lambda s: testing.assert_symmetric(s.bloom, s.probe, axes=("xy",)),
        "centroid kept": of_the_bloom(testing.assert_centroid_kept),
        "separable": of_the_bloom(testing.assert_separable),
        "spread": spread,
        "no ringing": lambda s: testing.assert_no_ringing(s.bloom, s.probe),
        "bounded fireflies": of_the_bloom(fireflies),
        "additive": additive,
    }


def fireflies(bloom: Bloom, probe: Probe) -> None:
    """Try all positions that differ in a chain of two halvings."""
    if probe.dtype.kind == "u":
        raise LookupError("nothing is brighter than 1")
    testing.assert_bounded_fireflies(bloom, probe=probe, period=4)


def measured(subject: Subject) -> str:
    """Return gain and standard deviation of the point spread as a short text."""
    found = testing.response(lambda image, _: subject.bloom(image), "_", [None], subject.probe)
    sigma_x, sigma_y = found.sigma[0]
    border = f", {100 * found.at_border[0]:.1g} % at the border" * bool(found.at_border[0] > 1e-3)
    return f"gain {found.gain[0]:.4g}, sigma {sigma_x:.3g} and {sigma_y:.3g} pixels{border}"


def page(subjects: list[Subject], device: str) -> str:
    """Return the page."""
    columns = laws()
    rows, notes = [], []
    for subject in subjects:
        cells, broken = [], []
        for name, law in columns.items():
            try:
                law(subject)
            except LookupError:
                cells.append("")
            except AssertionError as error:
                cells.append("**no**")
                figure, promise = str(error).split("\n  law: ")
                broken.append(f"  - {name}: {figure.partition(': ')[2]} ({promise})")
            except ValueError as error:
                cells.append("?")
                broken.append(f"  - {name}: {error}")
            else:
                cells.append("yes")
        rows.append(f"| {subject.name} | {' | '.join(cells)} |")
        head = f"- {subject.name}"
        if not subject.picture:
            head += f" ({measured(subject)})"
        notes += [head, *broken]
    heads = " | ".join(columns)
    return TEXT.format(
        device=device,
        table="\n".join([f"| | {heads} |", "|---" * (len(columns) + 1) + "|", *rows]),
        notes="\n".join(notes),
        sigma=SIGMA,
    )


TEXT = """# Which laws blurs and blooms keep

Written by `tools/laws.py`. It tests blurs and blooms of other packages against
the assertions of `vkbloom.testing` (see [testing.md](testing.md)). The adapter, where one is used:
{device}.

Gaussians have a sigma of {sigma:g} pixels. Images are float32 of 65 x 65 pixels with values up to
1. Chains of halved images have 256 x 256 pixels. Tolerances are the defaults. The presets of this
package are tested by [`vkbloom check`](check.md).
An empty cell means that the law does not apply. A question mark means that the premise of the law
does not hold. "Mirrored" is `assert_symmetric` for left and right and for top and bottom;
"transposed" is `assert_symmetric` for rows and columns. The limit for fireflies is 1: a bright
pixel may raise its neighbours by at most 1.

A broken law is a fault only if the method promises this law. A median is not linear. A threshold
breaks superposition on purpose. A linear blur spreads fireflies. A chain that halves by 2 x 2
pixels moves the light of a pixel to the centre of its square.

{table}

## Deviations

Each blur has the gain and the standard deviation of its point spread, and the largest deviation
from each broken law, with its position.

{notes}

## Notes

- pygfx's bloom is the sum of its levels. So its gain is the number of levels, and the bloom makes
  the picture brighter everywhere. Its `use_karis_average` has no effect in this version: one
  uniform buffer holds the switch for all levels, all writes to it come before the first pass
  runs, and the last write turns it off.
- `unsharp_mask` of this scikit-image is called with `channel_axis=2` here. With -1 it filters
  three rows and leaves the rest of its result uninitialized. These assertions found that.
- A `uniform_filter` of even size shifts the image by half a pixel, as an even number of taps has
  no middle tap.
- PyTorch is not tested here: its wheel for Linux has 539 MB.
"""


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=TARGET)
    target = parser.parse_args().out
    with vkbloom.Renderer("software") as renderer:
        subjects = [*opencv(), *scipy(), *skimage(), *pygfx(renderer.info.name)]
        target.write_text(page(subjects, renderer.info.summary), encoding="utf-8")
    print(target)


if __name__ == "__main__":
    main()
