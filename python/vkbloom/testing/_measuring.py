"""What `vkbloom check` measures of a bloom of settings or of a program."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import reference
from vkbloom._custom.method import CustomMethod
from vkbloom._fit.translating import lights
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.settings import Settings
from vkbloom._views.plain_values import plain
from vkbloom.psf._sampled import samples
from vkbloom.testing._law_report import LawReport
from vkbloom.testing._point_spread import border_share, veiling_glare_index
from vkbloom.testing._probe import Bloom, Probe
from vkbloom.testing._programs import COARSE_ERROR, Program
from vkbloom.testing._subject import Subject, fitting_probe

Array = NDArray[np.float64]

VIEW: Final = (256, 144)
#: The `sketch` of each preset's bloom, as `python -m tools.preset_blooms` writes them.
PRESET_BLOOMS: Final = Path(__file__).with_name("preset_blooms.npz")


# What the values of a bloom hold of a law, of the moving light, and of the response to the size.
_OF_A_LAW: Final = ("held", "off", "limit", "figures", "law", "message", "why")
_OF_STABILITY: Final = ("ripple", "jitter", "flicker", "shimmer", "growth")
_OF_RESOLUTION: Final = ("sizes", "r50", "r90", "peak")


def values_of(
    subject: Subject, report: LawReport, settings: Settings | None, **about: Any
) -> dict[str, Any]:
    """Return all that is measured as plain values; what is not a number is None.

    `about`: "name", "adapter", "size", and "passes", in seconds.
    """
    probe = subject.probe
    veil = veiling_glare_index(
        subject.picture or subject.bloom,
        size=probe.size,
        patch=max(1, min(probe.size) // 8),
        value=probe.value,
    )
    near, difference = nearest_preset(about["name"], subject.bloom)
    passes = [{"name": name, "seconds": time} for name, time in about.pop("passes").items()]
    values: dict[str, Any] = plain(
        about
        | spread_of(subject.spread, subject.lamp)
        | {
            "settings": None if settings is None else exact(settings).to_dict(),
            "passes": passes,
            "laws": {
                row.name: {name: getattr(row, name) for name in _OF_A_LAW} for row in report.rows
            },
            "untaken": report.untaken,
            "gain": report.gain,
            "stability": {name: getattr(subject.stability, name) for name in _OF_STABILITY},
            "resolution": {name: getattr(subject.resolution, name) for name in _OF_RESOLUTION},
            "veiling_glare_index": veil,
            "reference": subject.reference or None,
            "nearest_preset": {"name": near or None, "difference": difference},
            "required": report.required,
            "passed": all(row.held for row in report.rows if row.name in report.required),
        }
    )
    return values


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

    def difference(image: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(program(image)[..., :3] - image[..., :3])

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


def spread_of(array: Array, probe: Probe) -> dict[str, Any]:
    """Return the figures of a point spread: its energy, radii of shares of it, and its curve."""
    psf = samples(array)
    energy = float(psf.energy().mean())
    radii = np.concatenate([[0.0], np.geomspace(1.0, max(probe.size), 33)])
    fine = np.arange(0.0, max(probe.size), 0.5)
    shares = psf.encircled_energy(fine).mean(axis=1) / energy if energy > 0 else np.zeros(len(fine))

    def radius(share: float) -> float:
        inside = fine[shares >= share]
        return float(inside[0]) if inside.size else math.nan

    of_psf = {
        "r50": radius(0.5),
        "r90": radius(0.9),
        "peak": float(array.max()),
        "at_border": border_share(array),
        "radii": radii,
        "encircled": psf.encircled_energy(radii).mean(axis=1),
    }
    return {"energy": energy, "psf": of_psf}


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


def sketch(bloom: Bloom) -> Array:
    """Return the bloom of four lights as means of 4 x 4 pixels."""
    light = np.asarray(bloom(lights(VIEW)))[..., :3].astype(np.float64)
    boxes = light.reshape(VIEW[1] // 4, 4, VIEW[0] // 4, 4, 3)
    return np.asarray(boxes.mean(axis=(1, 3)))


def nearest_preset(excluded: str, bloom: Bloom) -> tuple[str, float]:
    """Return the other preset whose bloom of four lights is nearest, at its best intensity."""
    target = sketch(bloom)
    length = float(np.linalg.norm(target))
    if not length > 0:
        return "", math.nan
    results = {}
    with np.load(PRESET_BLOOMS) as blooms:
        for name in blooms.keys() - {excluded}:
            light = blooms[name].astype(np.float64)
            factor = max(0.0, float((light * target).sum()) / float((light * light).sum()))
            results[name] = float(np.linalg.norm(target - factor * light)) / length
    best = min(results, key=lambda name: results[name])
    return best, results[best]
