"""Measures a bloom: laws, stability, resolution, energy, veiling glare, its twin, its likes."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import reference
from vkbloom.fits.translating import lights
from vkbloom.named_settings import presets
from vkbloom.own.method import OwnMethod
from vkbloom.psf.sampled import samples
from vkbloom.renderer import Renderer
from vkbloom.settings import Settings
from vkbloom.testing import laws
from vkbloom.testing.deviations import compare_with_law, fail, is_within
from vkbloom.testing.law_report import LawReport, LawRow, fitting_probe, law_report, law_row
from vkbloom.testing.moving_light import Stability, stability
from vkbloom.testing.point_spread import border_share, point_spread
from vkbloom.testing.probe import Bloom, Probe
from vkbloom.testing.scaled_scene import ResolutionResponse, resolution_response
from vkbloom.testing.veiling_glare import veiling_glare_index
from vkbloom.verdicts.subjects import Subject, exact, shown

Array = NDArray[np.float64]

#: Why a bloom that is no fault may break the laws that only a check tests.
WHY: Final = {
    "energy": "Light is lost where taps skip pixels, weights do not add up to 1, or the border "
    "reads black; with a threshold, a small light is another share of what is above it.",
    "colour": "A threshold or a clamp of each channel alone changes the hue. A tint or a coloured "
    "kernel does so on purpose.",
    "stability": "A chain of halved images whose filter skips pixels gives a small light another "
    "brightness at each position: it shimmers. The peak of a narrow bloom changes with the share "
    "of the light that its pixel gets.",
    "resolution": "A width in pixels, or a fixed number of levels, is another share of the picture "
    "at each size.",
    "finite": "NaN and infinity spread through every average; a pass that reads them must replace "
    "them first.",
    "reference": "The twin computes something else, rounds differently, or reads other pixels at "
    "the border.",
}
#: Limits of the figures of a moving light, as in `testing.assert_stable`.
STEADY: Final = {"ripple": 0.02, "jitter": 0.1, "flicker": 0.1, "growth": 0.05}
#: Allowed share of the light that is lost or gained.
LOST: Final = 0.02
#: Allowed changes over four sizes, as in `testing.assert_resolution_independent`.
CHANGED: Final = {"r50": 0.1, "r90": 0.1, "peak": 0.2}
#: Allowed difference from the twin, as a share of the framebuffer's largest value.
OF_TWIN: Final = 1e-3
#: Sum of a light that is above thresholds where it falls on four pixels.
LAMP: Final = 1000.0
#: Share of the light that may lie in the outermost pixels if its sum is to mean anything.
AT_BORDER: Final = 1e-3
TEXEL: Final = 8
COLOUR: Final = (1.0, 0.5, 0.25)
VIEW: Final = (256, 144)


@dataclass(frozen=True, kw_only=True)
class Spread:
    """The point spread: energy, radii of shares of it in pixels, and its curve."""

    array: Array
    energy: float
    at_border: float
    r50: float
    r90: float
    peak: float
    radii: Array
    encircled: Array


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """All that was measured of a bloom. `passes`: seconds; `twin`: differences, by framebuffer."""

    name: str
    device: str
    settings: Settings | None
    size: tuple[int, int]
    passes: Mapping[str, float]
    report: LawReport
    rows: tuple[LawRow, ...]
    spread: Spread
    stability: Stability
    resolution: ResolutionResponse
    veiling_glare_index: float
    twin: Mapping[str, float]
    nearest: tuple[str, float]

    def row(self, name: str) -> LawRow | None:
        """Return the row of a law; None if there is none."""
        return next((row for row in self.rows if row.name == name), None)


def measured(
    subject: Subject,
    renderer: Renderer,
    *,
    device: str,
    passes: Mapping[str, float],
    frame: tuple[int, int],
    progress: Callable[[str], None],
) -> Verdict:
    """Measure a bloom."""
    progress("laws")
    probe = fitting_probe(subject.bloom, subject.probe)

    def additive() -> None:
        if subject.settings is not None and subject.settings.composite == "add":
            laws.assert_additive(subject.picture, subject.bloom, subject.intensity, probe)
        else:
            laws.assert_additive(subject.picture, probe=probe)

    report = law_report(subject.bloom, probe, gain=subject.gain, additive=additive)
    # A light that a threshold lets through wherever it falls.
    lamp = probe if probe.value <= 1 else dataclasses.replace(probe, value=LAMP)
    progress("stability")
    steady = stability(subject.bloom, texel=TEXEL, steps=subject.steps, probe=lamp)
    progress("resolution")
    response = resolution_response(subject.bloom, probe=dataclasses.replace(probe, size=(128, 128)))
    spread = spread_of(point_spread(subject.bloom, lamp), lamp)
    twin, reference_row = twin_differences(subject, renderer)
    rows = [
        *report.rows,
        law_row("energy", lambda: energy(spread, report.gain), WHY["energy"]),
        law_row("colour", lambda: colour(subject.bloom, probe), WHY["colour"]),
        law_row("stability", lambda: steadiness(steady), WHY["stability"]),
        law_row("resolution", lambda: same_response(response), WHY["resolution"]),
        law_row("finite", lambda: finite(subject.picture, probe), WHY["finite"]),
    ]
    progress("presets")
    return Verdict(
        name=subject.name,
        device=device,
        settings=subject.settings,
        size=frame,
        passes=passes,
        report=report,
        rows=(*rows, reference_row) if reference_row else tuple(rows),
        spread=spread,
        stability=steady,
        resolution=response,
        veiling_glare_index=veiling_glare_index(
            subject.picture, size=probe.size, patch=max(1, min(probe.size) // 8), value=probe.value
        ),
        twin=twin,
        nearest=nearest_preset(subject, renderer),
    )


def pass_times(
    renderer: Renderer, settings: Settings, size: tuple[int, int], repeats: int = 5
) -> dict[str, float]:
    """Return the shortest time of each pass in seconds, for an image of 16-bit floats."""
    images = [noise(size, seed).astype(np.float16) for seed in (0, 1)]
    found: dict[str, float] = {}
    for turn in range(repeats + 1):
        timings = renderer.apply(images[turn % 2], settings, attachments=("final",)).timings
        if turn:
            found = {name: min(time, found.get(name, time)) for name, time in timings.items()}
    return found


def run_time(program: Bloom, size: tuple[int, int]) -> dict[str, float]:
    """Return the time of one run of a program in seconds, with reading and writing of files."""
    image = noise(size, 0).astype(np.float32)
    begun = time.perf_counter()
    program(image)
    return {"program": time.perf_counter() - begun}


def noise(size: tuple[int, int], seed: int) -> Array:
    """Return a dark picture with bright pixels, (H, W, 3)."""
    random = np.random.default_rng(seed)
    return np.asarray(random.random((size[1], size[0], 3)) ** 8 * 20)


def spread_of(array: Array, probe: Probe) -> Spread:
    """Return the figures of a point spread."""
    psf = samples(array)
    energy = float(psf.energy().mean())
    radii = np.concatenate([[0.0], np.geomspace(1.0, max(probe.size), 33)])
    encircled = psf.encircled_energy(radii).mean(axis=1)
    fine = np.arange(0.0, max(probe.size), 0.5)
    shares = psf.encircled_energy(fine).mean(axis=1) / energy if energy > 0 else np.zeros(len(fine))

    def radius(share: float) -> float:
        inside = np.flatnonzero(shares >= share)
        return float(fine[inside[0]]) if inside.size else math.nan

    return Spread(
        array=array,
        energy=energy,
        at_border=border_share(array),
        r50=radius(0.5),
        r90=radius(0.9),
        peak=float(array.max()),
        radii=radii,
        encircled=encircled,
    )


def energy(spread: Spread, gain: float) -> None:
    """Assert that a lit pixel keeps the share of its light that a flat image keeps."""
    if spread.at_border > AT_BORDER:
        raise ValueError(
            f"of the light of a pixel, {100 * spread.at_border:.3g} % lies in the outermost "
            "pixels; a larger size is needed"
        )
    law = "the bloom of a lit pixel has the light of the pixel, times the gain of flat images"
    off, allowed = abs(spread.energy - gain), LOST * max(gain, spread.energy)
    if not is_within(law, off, allowed):
        fail(
            "assert_energy",
            law,
            f"{spread.energy:.4g} instead of {gain:.4g}: off by {off:.3g}, {allowed:.3g} allowed",
        )


def colour(bloom: Bloom, probe: Probe) -> None:
    """Assert that all channels of a flat coloured image get the same gain."""
    image = probe.flat(probe.value) * np.array(COLOUR)
    result, error = probe.apply(bloom, image)
    compare_with_law(
        "assert_colour",
        "all channels of a coloured image get the same gain",
        result,
        image * (result.mean() / image.mean()),
        error,
    )


def steadiness(found: Stability) -> None:
    """Assert that a light that moves by parts of a pixel neither flickers nor jumps."""
    if not found.energy.max() > 0:
        raise ValueError("the bloom of a small light is black")
    judged(
        "assert_stability",
        "while a light smaller than a pixel moves, its bloom keeps energy, place, peak and radius",
        {name: (getattr(found, name), limit) for name, limit in STEADY.items()},
    )


def same_response(found: ResolutionResponse) -> None:
    """Assert that the bloom is the same share of the picture at all sizes."""
    figures = {"r50": found.r50, "r90": found.r90, "peak": found.peak}
    if not all(values.mean() > 0 for values in figures.values()):
        raise ValueError("the bloom of a light is black at some size")
    judged(
        "assert_resolution",
        "radii and peak are the same share of the picture at all sizes",
        {name: (float(np.ptp(v) / v.mean()), CHANGED[name]) for name, v in figures.items()},
    )


def judged(assertion: str, law: str, figures: Mapping[str, tuple[float, float]]) -> None:
    """Assert that figures are within their limits; the message names those that are not."""
    # Without a figure, such as the radius of a negative variance, there is nothing to judge.
    known = {name: one for name, one in figures.items() if math.isfinite(one[0])}
    over = [name for name, (off, limit) in known.items() if not is_within(law, off, limit)]
    if over:
        told = ", ".join(
            f"{name} changes by {known[name][0]:.3g}, {known[name][1]:g} allowed" for name in over
        )
        fail(assertion, law, told.replace("jitter changes by", "jitter in pixels is"))


def finite(picture: Bloom, probe: Probe) -> None:
    """Assert that NaN and infinity stay at their own pixel."""
    law = "NaN and infinity of a pixel do not reach others"
    x, y = probe.centre
    for value in (math.nan, math.inf):
        image = probe.noise(0, probe.value)
        image[y, x] = value
        result = np.atleast_3d(np.asarray(picture(probe.given(image))))
        reached = ~np.isfinite(result).all(axis=2)
        reached[y, x] = False
        count = int(reached.sum())
        if not is_within(law, count, 0):
            fail(
                "assert_finite",
                law,
                f"{value} at x {x}, y {y} reaches {count} other pixels: 0 allowed",
            )


def twin_differences(
    subject: Subject, renderer: Renderer
) -> tuple[dict[str, float], LawRow | None]:
    """Return the difference from the reference by framebuffer, as a share of its largest value."""
    settings = subject.settings
    if settings is None or (isinstance(settings, OwnMethod) and type(settings).twin is None):
        return {}, None
    image = noise((96, 64), 2).astype(np.float32)
    expected = reference.apply(image, settings)
    frames = renderer.apply(image, settings)
    found = {}
    for name, array in expected.items():
        wanted, got = np.atleast_3d(array)[..., :3], np.atleast_3d(frames[name])[..., :3]
        if wanted.shape != got.shape:
            raise ValueError(f"the twin's {name} has the shape {wanted.shape}, not {got.shape}")
        largest = float(np.abs(wanted).max()) or 1.0
        found[name] = float(np.abs(got.astype(np.float64) - wanted).max()) / largest

    def test() -> None:
        law = "each framebuffer is that of the twin"
        over = [name for name, off in found.items() if not is_within(law, off, OF_TWIN)]
        if over:
            told = ", ".join(f"{name} is off by {found[name]:.3g}" for name in over)
            fail("assert_reference", law, f"{told} of its largest value, {OF_TWIN:g} allowed")

    return found, law_row("reference", test, WHY["reference"])


def nearest_preset(subject: Subject, renderer: Renderer) -> tuple[str, float]:
    """Return the other preset whose bloom of four lights is nearest, at its best intensity."""
    image = lights(VIEW)
    target = np.asarray(subject.bloom(image))[..., :3].astype(np.float64)
    if not np.linalg.norm(target) > 0:
        return "", math.nan
    found = {}
    for name, preset in presets.items():
        if subject.name == name:
            continue
        light = shown(renderer, exact(preset), "bloom")(image).astype(np.float64)
        power = float((light * light).sum())
        factor = max(0.0, float((light * target).sum()) / power) if power > 0 else 0.0
        found[name] = float(np.linalg.norm(target - factor * light) / np.linalg.norm(target))
    best = min(found, key=lambda name: found[name])
    return best, found[best]


def plain(value: Any) -> Any:
    """Return a value for JSON, which has neither NaN nor infinity."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
