"""Tables of the presets and methods: laws, figures, costs, stability, resolution, derivatives."""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Callable, Iterable
from statistics import median
from typing import Any

import numpy as np
from cells import format_figure, shown_presets, table
from click.testing import CliRunner
from numpy.typing import NDArray
from tqdm import tqdm

import vkbloom
from vkbloom import testing
from vkbloom._cli.program import program
from vkbloom._doctor.cases import of_low_levels
from vkbloom._gradients import on_device
from vkbloom._presets.named_settings import PRESETS
from vkbloom._settings.fields import fields_of
from vkbloom._settings.registry import METHODS
from vkbloom.reference._derivatives import differentiable

FRAME = (1280, 720)
# Above every threshold, and below the values that Filament compresses. 3 x 3 pixels, since
# KinoBloom removes a single pixel as a firefly.
VALUE = 100.0
FLAT = 10.0
SHARES = (0.5, 0.9)
# The moving light: half, full and double size; its sum is above every threshold on four pixels.
SIZES = ((160, 90), (320, 180), (640, 360))
PATH, STEPS, LIGHT = 16, 1.5, 1000.0
# 720p, 1080p, 4K; a lamp of four pixels at 720p.
SCALES = (1.0, 1.5, 3.0)
LAMP, LAMP_SIDE = 100.0, 1 / 180
# Change of both radii, as a share of their mean, that a preset keeps its look with.
KEPT = 0.1


def check(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Return the laws and the figures of `vkbloom check` for each preset."""
    size = "128x128" if quick else "256x256"  # wide blooms need larger images, and minutes
    laws, figures = [], []
    for name in tqdm(shown_presets()):
        words = ["check", "--preset", name, "--json", "--measure-size", size]
        done = CliRunner().invoke(
            program, [*words, "--adapter", renderer.info.name], catch_exceptions=False
        )
        found = json.loads(done.stdout)
        verdicts = {law: verdict["held"] for law, verdict in found["laws"].items()}
        broken = list_as_code(law for law, held in verdicts.items() if held is False)
        untested = list_as_code(law for law, held in verdicts.items() if held is None)
        laws.append([f"`{name}`", broken, untested])
        border = found["laws"]["border"]["figures"]
        spread, steady, near = found["psf"], found["stability"], found["nearest_preset"]
        figures.append(
            [
                f"`{name}`",
                format_figure(found["gain"]),
                format_figure(found["energy"]),
                *(format_figure(border.get(f"energy_{place}")) for place in ("left", "corner")),
                *(format_figure(spread[key]) for key in ("r50", "r90")),
                format_figure(steady["ripple"], 100),
                format_figure(steady["jitter"]),
                format_figure(steady["shimmer"], 100),
                format_figure(found["veiling_glare_index"]),
                f"{max(found['reference'].values()):.1g}",
                f"`{near['name']}`, {format_figure(near['difference'], 100)} %",
            ]
        )
    heads = "preset|gain|energy|at an edge|in a corner|50 % within, pixels|90 % within, pixels|"
    heads += (
        "ripple, %|jitter, pixels|shimmer, %|veiling glare, %|from its reference|nearest preset"
    )
    of_laws = table(["preset", "breaks", "could not be tested"], laws)
    return f"{of_laws}\n{table(heads.split('|'), figures)}"


def spread(bloom: NDArray[np.float64], light: float) -> tuple[float, list[float]]:
    """Return the share of a light that is in its bloom, and the radii that contain parts of it."""
    height, width = bloom.shape
    y, x = np.mgrid[:height, :width]
    radius = np.hypot(y - height // 2, x - width // 2).ravel()
    order = np.argsort(radius)
    # What is negative around a star's rays becomes 0 when it is added.
    held = np.cumsum(np.maximum(bloom.ravel(), 0)[order])
    radii = [float(radius[order][np.searchsorted(held, share * held[-1])]) for share in SHARES]
    return float(bloom.sum() / light), radii


def _cost(renderer: vkbloom.Renderer, settings: vkbloom.Settings, rounds: int) -> float:
    """Return the processor seconds of one call; each has another image than the one before."""
    generator = np.random.default_rng(0)
    shape = (2, FRAME[1], FRAME[0], 3)
    images = (generator.random(shape) ** 8 * 10).astype(np.float16)
    seconds = []
    for index in range(rounds + 3):
        began = time.process_time()
        renderer.apply(images[index % 2], settings, framebuffers=["final"])
        seconds.append(time.process_time() - began)
    return median(seconds[3:])


def measure(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Return gain, spread, corner and cost of each preset at 1280 x 720, in half floats."""
    rows = []
    point = np.zeros((FRAME[1], FRAME[0], 3), np.float32)
    y, x = FRAME[1] // 2, FRAME[0] // 2
    point[y - 1 : y + 2, x - 1 : x + 2] = VALUE
    for name in shown_presets():
        item = PRESETS[name]
        settings = item.make()
        exact = settings.replace(format="rgba32float")
        bloom = renderer.apply(point, exact)["bloom"]
        share, radii = spread(bloom[:, :, 0].astype(np.float64), 9 * VALUE)
        # Another image before, so that every pass runs and is counted.
        flat = renderer.apply(np.full_like(point, FLAT), exact)
        gain = float(flat["bloom"][y, x, 0]) / FLAT
        adds = settings.composite == "add"
        (border,) = testing.report(
            lambda image, settings=settings: renderer.apply(image, settings)["bloom"][..., :3],
            laws=["border"],
        ).rows
        rows.append(
            [
                f"`{name}`",
                item.confirmed,
                f"{gain:.3g}",
                f"{settings.intensity * gain:.3g}" if adds else settings.composite,
                f"{share:.3g}",
                format_figure(border.figures.get("corner")),
                *(f"{radius:.0f}" for radius in radii),
                str(len(flat.timings)),
                f"{1e3 * _cost(renderer, settings, 1 if quick else 15):.1f}",
            ]
        )
    within = (f"{share:.0%} within" for share in SHARES)
    heads = ["preset", "confirmed by", "gain", "added", "light of a point", "corner", *within]
    return table([*heads, "passes", "ms"], rows)


def list_as_code(names: Iterable[str]) -> str:
    """Return names as code."""
    return ", ".join(f"`{name}`" for name in names)


def _bloom_of(
    renderer: vkbloom.Renderer, settings: vkbloom.Settings
) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """Return the bloom alone, as a callable of grey images, which the probe makes faster."""

    def bloom(image: NDArray[Any]) -> NDArray[Any]:
        grey = np.repeat(image, 3, axis=2)
        return renderer.apply(grey, settings, framebuffers="bloom")["bloom"][:, :, :1]

    return bloom


def stability(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Return the figures of moving lights."""
    units = {"ripple": 100, "jitter": 1, "flicker": 100, "growth": 100}
    rows = []
    for name in tqdm(shown_presets(), "stability"):
        settings = vkbloom.presets[name]
        bloom = _bloom_of(renderer, settings.replace(format="rgba32float"))
        found = [
            testing.stability(
                bloom,
                texel=PATH,
                steps=STEPS,
                probe=testing.Probe(size=size, channels=1, value=LIGHT),
            )
            for size in SIZES[: 1 if quick else None]
        ]
        cells = (
            " / ".join(format_figure(getattr(one, figure), unit) for one in found)
            for figure, unit in units.items()
        )
        rows.append([f"`{name}`", *cells])
    return table(["preset", "ripple, %", "jitter, pixels", "flicker, %", "growth, %"], rows)


def resolution(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Return the figures of one scene at several sizes."""
    size = (320, 180) if quick else FRAME
    probe = testing.Probe(size=size, channels=1, dtype="float16", value=LAMP)
    rows = []
    for name in tqdm(shown_presets(), "resolution"):
        settings = vkbloom.presets[name]
        bloom = _bloom_of(renderer, settings)
        scales = list(SCALES)
        # A convolution needs as much memory at 4K as some adapters have.
        while True:
            try:
                found = testing.resolution_response(bloom, scales, light=LAMP_SIDE, probe=probe)
                break
            except vkbloom.OutOfMemoryError:
                scales.pop()
        cells = (
            " / ".join([format_figure(value, 100) for value in values] + ["memory"] * missing)
            for values in (found.r50, found.r90, found.peak)
            for missing in (len(SCALES) - len(scales),)
        )
        kept = all(np.ptp(radii) < KEPT * radii.mean() for radii in (found.r50, found.r90))
        is_known = np.isfinite([found.r50, found.r90]).all()
        rows.append([f"`{name}`", *cells, ("yes" if kept else "no") if is_known else "none"])
    return table(["preset", "50 % within, %", "90 % within, %", "peak, %", "keeps"], rows)


def _with_threshold(name: str) -> vkbloom.Settings:
    """Return settings of a method with a threshold."""
    kind = METHODS[name]
    fields = fields_of(kind)
    kernel = np.random.default_rng(1).random((5, 5))
    settings: Any = of_low_levels(kind(psf=kernel) if "psf" in fields else kind(), 32)
    if "level_weights" in fields and settings.level_weights is None:
        settings = settings.replace(level_weights=(1.0,) * settings.levels)
    if settings.threshold is None and not fields["threshold"].fixed:
        settings = settings.replace(threshold=0.4)
    return settings if fields["knee"].fixed else settings.replace(knee=0.5)


def _is_linear(settings: vkbloom.Settings, name: str) -> bool:
    """Whether the final image is an affine function of the field, and not a constant."""
    if name == "threshold":  # of each pixel at another value
        return False
    if name == "reference_white":  # of one encoding alone
        settings = settings.replace(encoding="pq")
    image = np.random.default_rng(0).random((32, 40, 4)) * 2
    middle = np.asarray(getattr(settings, name), np.float64)
    step = 0.05 * np.maximum(np.abs(middle), 0.1)
    finals = []
    for offset in (1, 2, 3):
        try:
            changed = settings.replace(**{name: _as_field(middle + offset * step)})
        except ValueError:  # at the upper end of the range
            changed = settings.replace(**{name: _as_field(middle - offset * step)})
        finals.append(vkbloom.reference.apply(image, changed)["final"])
    bend = finals[0] - 2 * finals[1] + finals[2]
    moves = np.abs(finals[2] - finals[0]).max() > 0
    return bool(moves and np.abs(bend).max() <= 1e-12 * max(1.0, np.abs(finals[1]).max()))


def _as_field(value: Any) -> Any:
    return tuple(map(_as_field, value)) if np.ndim(value) else float(value)


def derivatives(renderer: vkbloom.Renderer, quick: bool) -> str:
    """Return which fields have a derivative, method by method."""
    rows = []
    for method in [*METHODS][: 2 if quick else None]:
        settings = _with_threshold(method)
        known = differentiable(settings)
        linear = list(filter(functools.partial(_is_linear, settings), known))
        columns = (
            linear,
            [name for name in known if name not in linear],
            [name for name in fields_of(type(settings)) if name not in known],
        )
        by_image = "device" if on_device(renderer, settings) else "reference"
        rows.append((f"`{type(settings).__name__}`", by_image, columns))
    # Those of all methods are listed once.
    always = [[n for n in rows[0][2][i] if all(n in row[2][i] for row in rows)] for i in range(3)]
    cells = [
        [
            name,
            by_image,
            *(
                list_as_code(n for n in column if n not in every)
                for column, every in zip(columns, always, strict=True)
            ),
        ]
        for name, by_image, columns in rows
    ]
    cells.insert(0, ["every method", "", *map(list_as_code, always)])
    return table(["method", "by the image", "linear", "curved or piecewise", "none"], cells)
