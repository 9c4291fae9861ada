"""What `vkbloom check` measures of a bloom of settings or of a program."""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import reference
from vkbloom._custom.method import CustomMethod
from vkbloom._fit.translating import lights
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.registry import presets
from vkbloom._settings.settings import Settings
from vkbloom.psf._sampled import samples
from vkbloom.testing._law_report import LawReport
from vkbloom.testing._point_spread import border_share
from vkbloom.testing._probe import Bloom, Probe
from vkbloom.testing._programs import COARSE_ERROR, Program
from vkbloom.testing._subject import Subject, fitting_probe
from vkbloom.testing._veiling_glare import veiling_glare_index

Array = NDArray[np.float64]

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
class Measured:
    """All that is measured of a bloom; figures are measured when they are read.

    `passes`: seconds at `size`.
    """

    name: str
    device: str
    settings: Settings | None
    size: tuple[int, int]
    passes: Mapping[str, float]
    subject: Subject
    report: LawReport
    renderer: Renderer

    @functools.cached_property
    def spread(self) -> Spread:
        """The point spread of the lamp."""
        return spread_of(self.subject.spread, self.subject.lamp)

    @functools.cached_property
    def veiling_glare_index(self) -> float:
        """The index of the picture, or of the bloom alone."""
        probe, bloom = self.subject.probe, self.subject.picture or self.subject.bloom
        patch = max(1, min(probe.size) // 8)
        return veiling_glare_index(bloom, size=probe.size, patch=patch, value=probe.value)

    @functools.cached_property
    def nearest(self) -> tuple[str, float]:
        """The preset whose bloom is nearest, and its difference."""
        return nearest_preset(self.name, self.subject.bloom, self.renderer)


def exact(settings: Settings) -> Settings:
    """Return the settings with buffers of floats, and nothing after the composite."""
    plain = settings.replace(tonemap="none", encoding="none", exposure=0.0, dither=False)
    return plain if plain.format is not None else plain.replace(format="rgba32float")


def shown(renderer: Renderer, settings: Settings, framebuffer: str) -> Bloom:
    """Return the colours of a framebuffer as a function of the image."""

    def bloom(image: NDArray[Any]) -> NDArray[Any]:
        result = renderer.apply(image, settings, framebuffers=framebuffer)[framebuffer]
        return result[..., : image.shape[2]]

    return bloom


def of_settings(
    renderer: Renderer, settings: Settings, size: tuple[int, int], gain: float | None
) -> Subject:
    """Return the bloom of settings.

    A file that saves BLOOM is expected to keep the light of flat images, other methods to have the
    gain that a flat image gets in its middle.
    """
    used = exact(settings)
    bloom = shown(renderer, used, "bloom")
    subject = Subject(
        bloom=bloom,
        probe=fitting_probe(bloom, Probe(size=size)),
        picture=shown(renderer, used, "final"),
        intensity=used.intensity if used.composite == "add" else None,
        gain=gain,
        differences=lambda: differences(renderer, used),
    )
    if gain is None:
        keeps_light = isinstance(used, CustomMethod) and used.file.saves_bloom
        subject.gain = 1.0 if keeps_light else subject.measured_gain
    return subject


def of_program(
    program: Program, size: tuple[int, int], gain: float | None, *, less_input: bool
) -> Subject:
    """Return the bloom of a program, which is run once to see what it writes."""
    probe = Probe(size=size)
    program(probe.given(probe.flat(0.0)))
    if program.bits is not None:
        probe = Probe(size=size, atol=COARSE_ERROR)

    @functools.wraps(program)
    def difference(image: NDArray[Any], **options: Any) -> NDArray[Any]:
        result = program(image, **options)[..., :3]
        x, y, *_ = options.get("region") or (0, 0)
        if result.shape[:2] == image.shape[:2]:
            x, y = 0, 0
        height, width = result.shape[:2]
        return np.asarray(result - image[y : y + height, x : x + width, :3])

    bloom: Bloom = difference if less_input else program
    subject = Subject(
        bloom=bloom,
        probe=fitting_probe(bloom, probe),
        picture=program if less_input else None,
        gain=1.0 if gain is None else gain,
    )
    if program.bits is not None:
        subject.highest = 1.0
    return subject


def pass_times(
    renderer: Renderer, settings: Settings, size: tuple[int, int], repeats: int = 5
) -> dict[str, float]:
    """Return the shortest time of each pass in seconds, for an image of 16-bit floats."""
    images = [noise(size, seed).astype(np.float16) for seed in (0, 1)]
    results: dict[str, float] = {}
    for turn in range(repeats + 1):
        timings = renderer.apply(images[turn % 2], settings, framebuffers=("final",)).timings
        if turn:
            results = {name: min(time, results.get(name, time)) for name, time in timings.items()}
    return results


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


def differences(renderer: Renderer, settings: Settings) -> dict[str, float]:
    """Return the difference from the reference by framebuffer, as a share of its largest value."""
    if isinstance(settings, CustomMethod) and type(settings).numpy_reference is None:
        return {}
    image = noise((96, 64), 2).astype(np.float32)
    expected = reference.apply(image, settings)
    frames = renderer.apply(image, settings)
    results = {}
    for name, array in expected.items():
        wanted, got = np.atleast_3d(array)[..., :3], np.atleast_3d(frames[name])[..., :3]
        if wanted.shape != got.shape:
            raise ValueError(f"reference: the shape of {name}, {wanted.shape}, is not {got.shape}")
        largest = float(np.abs(wanted).max()) or 1.0
        results[name] = float(np.abs(got.astype(np.float64) - wanted).max()) / largest
    return results


def nearest_preset(excluded: str, bloom: Bloom, renderer: Renderer) -> tuple[str, float]:
    """Return the other preset whose bloom of four lights is nearest, at its best intensity."""
    image = lights(VIEW)
    target = np.asarray(bloom(image))[..., :3].astype(np.float64)
    if not np.linalg.norm(target) > 0:
        return "", math.nan
    results = {}
    for name in presets:
        if excluded == name:
            continue
        light = preset_bloom(renderer, name).astype(np.float64)
        power = float((light * light).sum())
        factor = max(0.0, float((light * target).sum()) / power) if power > 0 else 0.0
        results[name] = float(np.linalg.norm(target - factor * light) / np.linalg.norm(target))
    best = min(results, key=lambda name: results[name])
    return best, results[best]


#: Blooms of presets by the adapter and their name: most of the time goes into their pipelines.
_BLOOMS: Final[dict[tuple[str, str], NDArray[Any]]] = {}


def preset_bloom(renderer: Renderer, name: str) -> NDArray[Any]:
    """Return the bloom that a preset gives to four lights, rendered once."""
    key = (renderer.info.summary, name)
    if key not in _BLOOMS:
        _BLOOMS[key] = shown(renderer, exact(presets[name]), "bloom")(lights(VIEW))
    return _BLOOMS[key]
