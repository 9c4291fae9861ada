"""Test blurs and blooms of other packages against the laws of `vkbloom.testing`.

``python -m tools.laws`` writes docs/evidence/laws_table.md. It needs the packages of
benchmarks/peers.txt and a Vulkan driver, as pygfx's bloom runs through wgpu.
"""

from __future__ import annotations

import argparse
import dataclasses
import re
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import vkbloom
from vkbloom import testing
from vkbloom.testing import Probe
from vkbloom.testing._probe import Bloom

TARGET = Path(__file__).parents[1] / "docs" / "evidence" / "laws_table.md"
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
    picture: bool = False  # the picture with its bloom, not the bloom alone


def opencv() -> Iterator[Subject]:
    """Yield OpenCV's Gaussian and median."""
    import cv2

    def gaussian(image: NDArray[Any]) -> NDArray[Any]:
        return cv2.GaussianBlur(image, (0, 0), SIGMA)

    name = f"OpenCV {version('opencv-python-headless')}"
    yield Subject(f"{name} `GaussianBlur`, float32", gaussian, SMALL, 1.0)
    eight = dataclasses.replace(SMALL, dtype="uint8")
    yield Subject(f"{name} `GaussianBlur`, uint8", gaussian, eight, 1.0)
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
    )
    yield Subject(
        f'{name} `gaussian_filter`, `mode="constant"`',
        lambda image: ndimage.gaussian_filter(image, (SIGMA, SIGMA, 0), mode="constant"),
        SMALL,
        1.0,
    )
    yield Subject(
        f"{name} `uniform_filter` of 5",
        lambda image: ndimage.uniform_filter(image, (5, 5, 0)),
        SMALL,
        1.0,
    )
    yield Subject(
        f"{name} `uniform_filter` of 4",
        lambda image: ndimage.uniform_filter(image, (4, 4, 0)),
        SMALL,
        1.0,
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


#: The laws of the columns.
LAWS = (
    "superposition",
    "gain",
    "symmetric",
    "transposed",
    "centroid_kept",
    "separable",
    "no_ringing",
    "bounded_fireflies",
    "additive",
)
#: Those of the bloom alone.
OF_A_BLOOM = {"centroid_kept", "separable", "bounded_fireflies"}


def applies(law: str, subject: Subject) -> bool:
    """Return whether a law is one of the subject: of a picture, or of the bloom alone."""
    if law == "gain":
        return subject.gain is not None
    return law != "additive" if not subject.picture else law not in OF_A_BLOOM


def measure(subject: Subject) -> str:
    """Return gain and standard deviation of the point spread as a short text."""
    spread = testing.point_spread(subject.bloom, subject.probe)[:, :, 0]
    gain, outside = spread.sum(), np.abs(spread).sum() - np.abs(spread[1:-1, 1:-1]).sum()
    sigmas = []
    for axis in (0, 1):
        shares = spread.sum(axis=axis) / gain
        places = np.arange(len(shares))
        sigmas.append(np.sqrt(shares @ (places - shares @ places) ** 2))
    share = outside / np.abs(spread).sum()
    border = f", {100 * share:.1g} % at the border" * bool(share > 1e-3)
    return f"gain {gain:.4g}, sigma {sigmas[0]:.3g} and {sigmas[1]:.3g} pixels{border}"


def table(subjects: list[Subject], device: str) -> str:
    """Return the table: what each blur breaks, and by how much."""
    rows = []
    for subject in subjects:
        chosen = [law for law in LAWS if applies(law, subject)]
        report = testing.report(subject.bloom, laws=chosen, gain=subject.gain, probe=subject.probe)
        broken, untested = [], [law for law in LAWS if law not in chosen]
        for row in report.rows:
            figure = row.message.split("\n  law: ")[0]
            if row.held is False:
                broken.append(f"{row.name}: {re.split(' at x|, channel', figure)[0]}")
            elif row.held is None:
                untested.append(f"{row.name} ({row.message})")
        point = "" if subject.picture else measure(subject)
        rows.append(f"| {subject.name} | {point} | {'; '.join(broken)} | {', '.join(untested)} |")
    heads = ["| blur | one lit pixel | breaks | not tested |", "|---|---|---|---|"]
    return "\n".join([f"The adapter, where one is used: {device}.", "", *heads, *rows, ""])


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=TARGET)
    target = parser.parse_args().out
    with vkbloom.Renderer("software") as renderer:
        subjects = [*opencv(), *scipy(), *skimage(), *pygfx(renderer.info.name)]
        target.write_text(table(subjects, renderer.info.summary), encoding="utf-8")
    print(target)


if __name__ == "__main__":
    main()
