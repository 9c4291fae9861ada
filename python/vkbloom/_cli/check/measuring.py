"""What `vkbloom check` measures of a bloom of settings or of a program."""

from __future__ import annotations

import dataclasses
import functools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from vkbloom import reference
from vkbloom._custom.method import CustomMethod
from vkbloom._custom.rounds import MAX_ROUNDS
from vkbloom._fit.translating import lights
from vkbloom._psf.sampled import samples
from vkbloom._psf.varying import Varying
from vkbloom._renderer.renderer import Renderer
from vkbloom._settings.exposure import Exposure
from vkbloom._settings.settings import Settings
from vkbloom._views.plain_values import plain
from vkbloom.testing._adaptation import NO_BLOOM
from vkbloom.testing._blooms import bloom_of, exact
from vkbloom.testing._law_report import LawReport
from vkbloom.testing._point_spread import border_share, veiling_glare_index
from vkbloom.testing._probe import Bloom, Probe
from vkbloom.testing._programs import CommandBloom, CommandMeter, levels_of
from vkbloom.testing._subject import Subject, fitting_probe

Array = NDArray[np.float64]
T = TypeVar("T")


class Exposed(NamedTuple):
    """An exposure of the package.

    - `settings`: Of the bloom that the picture has. None: it has none.
    """

    exposure: Exposure
    settings: Settings | None


#: About how often a program is run, in files of floats and in those of 8 bits; as an exposure.
RUNS: Final = {False: 240, True: 90}
RUNS_OF_EXPOSURE: Final = 850
#: A picture, in which each pixel of a pass may run to the limit of its loops.
_SMALL: Final = (32, 24)

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

    `about`: "name", "adapter", "size", and the times of `times_of`.
    """
    probe, levels = subject.probe, subject.probe.levels
    veil = _figure(
        lambda: veiling_glare_index(
            subject.picture or subject.bloom,
            size=probe.size,
            patch=max(1, min(probe.size) // 8),
            value=probe.value,
        )
    )
    highest = None if levels is None else probe.value
    near = _figure(lambda: nearest_preset(about["name"], subject.bloom, highest))
    name, difference = near or ("", math.nan)
    # In few levels, the bloom of a light smaller than a pixel is rounding.
    stability = None if probe.is_coarse else _figure(lambda: subject.stability)
    resolution = _figure(lambda: subject.resolution)
    spread = _figure(lambda: spread_of(subject.spread, subject.lamp))
    if spread is not None and probe.is_coarse:
        spread["energy"] = _figure(lambda: subject.energy[0])
    reference = _figure(lambda: subject.reference)
    values: dict[str, Any] = plain(
        about
        | (spread or {"energy": None, "psf": None})
        | {
            "settings": None if settings is None else exact(settings).to_dict(),
            "bits": None if levels is None else levels.bits,
            "laws": _laws_of(report),
            "untaken": report.untaken,
            "gain": report.gain,
            "stability": stability and {name: getattr(stability, name) for name in _OF_STABILITY},
            "resolution": resolution
            and {name: getattr(resolution, name) for name in _OF_RESOLUTION},
            "veiling_glare_index": veil,
            "reference": reference or None,
            "nearest_preset": {"name": name or None, "difference": difference},
            "required": report.required,
            "passed": _is_passed(report),
        }
    )
    return values


def values_of_exposure(report: LawReport, exposed: Exposed | None, **about: Any) -> dict[str, Any]:
    """Return all that is measured of an exposure as plain values, as `values_of` does.

    - `exposed`: None: a program.
    """
    exposure, settings = exposed or (None, None)
    values: dict[str, Any] = plain(
        about
        | {
            "exposure": None if exposure is None else exposure.to_dict(),
            "settings": None if settings is None else settings.to_dict(),
            "laws": _laws_of(report),
            "untaken": report.untaken,
            "required": report.required,
            "passed": _is_passed(report),
        }
    )
    return values


def _laws_of(report: LawReport) -> dict[str, Any]:
    return {row.name: {name: getattr(row, name) for name in _OF_A_LAW} for row in report.rows}


def _is_passed(report: LawReport) -> bool:
    return all(row.held for row in report.rows if row.name in report.required)


def _figure(measure: Callable[[], T]) -> T | None:
    """Return a figure; None if the bloom fails, as the law that needs the figure says."""
    try:
        return measure()
    except Exception:
        return None


def of_settings(
    renderer: Renderer, settings: Settings, size: tuple[int, int], gain: float | None
) -> Subject:
    """Return the bloom of settings.

    A file that saves BLOOM is expected to keep the light of flat images, other methods to have the
    gain that a flat image gets in its middle.
    """
    used = exact(settings)
    if isinstance(used, CustomMethod):
        _check_finite(renderer, used)
    bloom = bloom_of(renderer, used, "bloom")
    subject = Subject(
        bloom=bloom,
        probe=fitting_probe(bloom, Probe(size=size)),
        picture=bloom_of(renderer, used, "final"),
        toned=bloom_of(renderer, used.replace(tonemap="reinhard"), "final"),
        intensity=used.intensity if used.composite == "add" else None,
        gain=gain,
        field=_field_of(used),
        differences=None if _lacks_reference(used) else lambda: differences(renderer, used),
    )
    if gain is None:
        keeps_light = isinstance(used, CustomMethod) and used.file.saves_bloom
        subject.gain = 1.0 if keeps_light else subject.measured_gain
    return subject


def _check_finite(renderer: Renderer, settings: CustomMethod) -> None:
    """Raise AssertionError with file and line for a pass that makes NaN or infinity of a picture.

    The picture is small: a loop that ran to its limit in each pixel takes long in a larger one.
    """
    try:
        frames = renderer.apply(noise(_SMALL, 0).astype(np.float32), settings)
    except ValueError:
        return  # such as sizes that are 0 there
    for name, array in frames.items():
        bad = np.argwhere(~np.isfinite(np.atleast_3d(array)))
        if len(bad):
            y, x, channel = (int(index) for index in bad[0])
            cause = (
                f"the framebuffer {name!r} is {np.atleast_3d(array)[y, x, channel]} at x {x}, y {y}"
                f", channel {channel} of a finite picture; loops that run more than {MAX_ROUNDS:,} "
                "rounds give nan"
            )
            raise AssertionError(
                f"{settings.file.source.name}:{settings.file.line_of(name)}: {cause}"
            )


def _field_of(settings: Settings) -> Varying | None:
    """Return the field of kernels that each light shows; None: there is none."""
    found = getattr(settings, "psf", None)
    return found if isinstance(found, Varying) and not found.gathers else None


def of_program(
    program: CommandBloom, size: tuple[int, int], gain: float | None, *, less_input: bool
) -> Subject:
    """Return the bloom of a program, which is run once to see what it writes."""
    levels = levels_of(program, size)
    if levels is not None and less_input:
        levels = dataclasses.replace(levels, is_difference=True)

    def difference(image: NDArray[Any]) -> NDArray[Any]:
        return np.asarray(program(image)[..., :3] - image[..., :3])

    bloom: Bloom = difference if less_input else program
    return Subject(
        bloom=bloom,
        probe=fitting_probe(bloom, Probe(size=size, levels=levels)),
        picture=program if less_input else None,
        gain=1.0 if gain is None else gain,
    )


def pass_times(
    renderer: Renderer, source: Settings | Exposed, size: tuple[int, int], repeats: int = 1
) -> dict[str, float]:
    """Return the shortest time of each pass in seconds, for an image of 16-bit floats.

    The first run, of another image, is not counted.
    """
    how: dict[str, Any] = {}
    if isinstance(source, Exposed):
        how = {"exposure": source.exposure, "dt": 1 / 60}
        settings: Settings = source.settings or NO_BLOOM
    else:
        settings = source
    images = _images(size)
    results: dict[str, float] = {}
    for turn in range(repeats + 1):
        image = images[turn % 2]
        timings = renderer.apply(image, settings, framebuffers=("final",), **how).timings
        if turn:
            results = {name: min(time, results.get(name, time)) for name, time in timings.items()}
    return results


@functools.lru_cache(maxsize=1)
def _images(size: tuple[int, int]) -> tuple[NDArray[np.float16], NDArray[np.float16]]:
    first, second = (noise(size, seed).astype(np.float16) for seed in (0, 1))
    return first, second


def run_time(program: CommandBloom | CommandMeter, size: tuple[int, int]) -> dict[str, float]:
    """Return the time of one run of a program in seconds, with reading and writing of files."""
    image = noise(size, 0).astype(np.float32)
    begun = time.perf_counter()
    if isinstance(program, CommandMeter):
        program(image, dt=1 / 60)
    else:
        program(image)
    return {"program": time.perf_counter() - begun}


def times_of(runs: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """Return the shortest time of each pass, and the spread of all passes together."""
    passes = [
        {"name": name, "seconds": min(run[name] for run in runs if name in run)}
        for name in dict.fromkeys(name for run in runs for name in run)
    ]
    sums = [math.fsum(run.values()) for run in runs]
    together = {"runs": len(runs), "shortest": min(sums), "longest": max(sums)}
    return {"passes": passes, "together": together}


def in_turns(
    timers: Sequence[Callable[[], Mapping[str, float]]], runs: int
) -> list[dict[str, Any]]:
    """Return the times of each timer; they run in turns, so that a busy moment slows all."""
    found: list[list[Mapping[str, float]]] = [[] for _ in timers]
    for _ in range(runs):
        for timer, kept in zip(timers, found, strict=True):
            kept.append(timer())
    return [times_of(each) for each in found]


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


def _lacks_reference(settings: Settings) -> bool:
    return isinstance(settings, CustomMethod) and type(settings).numpy_reference is None


def differences(renderer: Renderer, settings: Settings) -> dict[str, float]:
    """Return the difference from the reference by framebuffer, as a share of its largest value."""
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


def sketch(bloom: Bloom, highest: float | None = None) -> Array:
    """Return the bloom of four lights, the brightest of `highest`, as means of 4 x 4 pixels."""
    scene = lights(VIEW)
    if highest is not None:
        scene *= highest / scene.max()
    light = np.asarray(bloom(scene))[..., :3].astype(np.float64)
    boxes = light.reshape(VIEW[1] // 4, 4, VIEW[0] // 4, 4, 3)
    return np.asarray(boxes.mean(axis=(1, 3)))


def nearest_preset(excluded: str, bloom: Bloom, highest: float | None = None) -> tuple[str, float]:
    """Return the other preset whose bloom of four lights is nearest, at its best intensity."""
    target = sketch(bloom, highest)
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
