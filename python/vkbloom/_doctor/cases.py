"""The cases of ``vkbloom doctor --self-test``: requests, each compared with `vkbloom.reference`.

The tests run the same cases under validation.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, Final, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom import psf, reference
from vkbloom._doctor.deviations import Deviation, deviation, deviations, tolerance
from vkbloom._formats import FORMATS_BY_DTYPE, IMAGE_DTYPES
from vkbloom._glare.streaks import Streaks
from vkbloom._gradients import vjp
from vkbloom._methods.convolution import Convolution
from vkbloom._methods.mip_chain import DualKawase, Pyramid
from vkbloom._methods.separable import Separable, gaussian_weights
from vkbloom._renderer.renderer import Renderer
from vkbloom._scene import Scene, skybox
from vkbloom._settings.fields import fields_of
from vkbloom._settings.glare import glares
from vkbloom._settings.settings import Encoding, Settings, ToneMap, presets

# No colour of an 8-bit image has this luminance, since it is not a multiple of 1e-4 / 255. So
# rounding cannot move a pixel across the threshold.
HARD_THRESHOLD: Final = 0.30001

METHODS: Final[dict[str, Settings]] = {
    "tutorial": Separable(),
    "outline": Separable(first_tap=0, texel="x", blur_strength=0.5),
    "fractional": Separable(blur_scale=1.7),
    "still": Separable(blur_scale=0.0),
    "deferred": presets["deferred"],
    "layers": Separable(layers=((1.0, 1.0), (2.0, 0.5), (4.0, 0.25)), blur_strength=0.5),
    "loops-layers": Separable(layers=((1.0, 0.5), (2.5, 0.5)), loops=2, blur_strength=0.75),
    "one-weight": Separable(weights=(0.75,)),
    "longest": Separable(weights=gaussian_weights(20, 64), blur_strength=1.0),
    "direct": Separable(direct=True),
    "direct-loops-layers": Separable(
        direct=True, loops=2, layers=((1.0, 0.5), (1.5, 0.5)), blur_strength=0.75, texel="x"
    ),
    "half-size": Separable(bloom_scale=0.5),
    "double-size": Separable(bloom_scale=2.0, blur_scale=1.3),
    "fixed-size": Separable(bloom_size=(31, 23), blur_scale=0.7),
    "direct-half-size": Separable(bloom_scale=0.5, direct=True, weights=gaussian_weights(1.5)),
    "hard-threshold": Separable(threshold=HARD_THRESHOLD),
    "knee": Separable(threshold=0.3, knee=0.5, bloom_scale=0.5, intensity=0.5),
    "pyramid": Pyramid(),
    "pyramid-one-level": Pyramid(levels=1),
    "pyramid-radius": Pyramid(levels=4, radius=1.6),
    "pyramid-firefly": Pyramid(firefly_filter=True, threshold=0.2, knee=1.0),
    "pyramid-sixteen": Pyramid(levels=16, bloom_scale=0.5),
    "dual-kawase": DualKawase(),
    "dual-kawase-offset": DualKawase(levels=2, offset=2.3, threshold=HARD_THRESHOLD),
    "dual-kawase-deep": DualKawase(levels=7, bloom_size=(64, 48), intensity=0.3),
}
COMPOSITES: Final = fields_of(Settings)["composite"].choices
TONEMAPS: Final = get_args(ToneMap)
ENCODINGS: Final = get_args(Encoding)
# Those whose derivatives have no kink that noise meets.
_SMOOTH: Final = ("tutorial", "fractional", "layers", "half-size", "pyramid", "dual-kawase")
# Those whose derivatives divide by a brightness, which at black is 0.
_DIVIDING: Final[dict[str, Settings]] = {
    "filament": presets["filament"].replace(resolution=16),
    "filament-alpha": presets["filament"].replace(resolution=16, alpha="blur"),
    "streaks": Pyramid(levels=2, glare=(Streaks(threshold=0.1, halvings=1, iterations=2),)),
}
_SIZE: Final = (61, 43)
#: Of scenes.
FRAME: Final = (96, 54)

Check = Callable[[Renderer], Iterable[Deviation]]


class Case(NamedTuple):
    """A request and its comparison; `variant`: what VKBLOOM_VARIANT has to be."""

    group: str
    name: str
    check: Check
    variant: str = "auto"


def presets_of_low_levels(height: int) -> dict[str, Settings]:
    """Return the presets; levels whose height does not follow from the image's have this one.

    Of small images, levels of the engines' heights take seconds and show nothing more.
    """
    return {name: of_low_levels(each, height) for name, each in presets.items()}


def of_low_levels(settings: Settings, height: int) -> Settings:
    """Return the settings, with levels of this height if theirs does not follow from the image."""
    field = settings._level_height
    return settings.replace(**{field: height}) if field else settings


def picture(size: tuple[int, int], channels: int, dtype: str, seed: int = 0) -> NDArray[Any]:
    """Return random values, few of them high; floats reach from -0.5 to 7.5."""
    values = np.random.default_rng(seed).random((size[1], size[0], channels)) ** 2
    if dtype == "uint8":
        return np.rint(255 * values).astype(np.uint8)
    # Beyond what 8 bits hold, and below 0.
    return (8 * values - 0.5).astype(dtype)


def _apply(
    renderer: Renderer,
    size: tuple[int, int],
    dtype: str,
    settings: Settings,
    given: tuple[str, ...] = (),
) -> Iterator[Deviation]:
    image = picture(size, 3 + size[0] % 2, dtype)
    mask = np.random.default_rng(3).random(image.shape[:2], np.float32)
    every = {"mask": mask, "emission": np.abs(image[::-1])}
    arrays: dict[str, Any] = {name: every[name] for name in given}
    frames = renderer.apply(image, settings, **arrays)
    yield from _with_passes(
        deviations(frames, image, settings, **arrays), renderer, image, settings
    )


def _with_passes(
    results: Iterable[Deviation], renderer: Renderer, image: NDArray[Any], settings: Settings
) -> Iterator[Deviation]:
    """Add to what is wrong the shader and the variant of the pass that writes it."""
    for item in results:
        writers = [
            f"{row.shader} ({row.variant})"
            for row in (renderer.plan(image, settings).passes if item.wrong else ())
            if item.name in row.writes
        ]
        by = f"; written by {', '.join(dict.fromkeys(writers))}" if writers else ""
        yield item._replace(wrong=item.wrong + by)


def _final(renderer: Renderer, parts: tuple[Any, ...]) -> Iterator[Deviation]:
    """Compare the last pass with what the reference makes of the renderer's own bloom."""
    composite, tonemap, encoding, dtype = parts
    # Away from black, where the encodings are so steep that half a level of bloom is several.
    values = 0.1 + 0.8 * np.random.default_rng(3).random((14, 19, 4))
    image = np.rint(255 * values).astype(np.uint8) if dtype == "uint8" else values.astype(dtype)
    settings = Separable(
        composite=composite, tonemap=tonemap, encoding=encoding, intensity=0.3, exposure=0.5
    )
    frames = renderer.apply(image, settings, framebuffers=("bloom", "final"))
    expected = reference.composite(image, frames["bloom"], settings)
    final = deviation("final", frames["final"], expected, tolerance(dtype, expected))
    yield from _with_passes([final], renderer, image, settings)


def _convolve(renderer: Renderer, size: tuple[int, int]) -> Iterator[Deviation]:
    """Compare transforms of all radices, whose error is relative to the largest value."""
    image, settings = np.abs(picture(size, 3, "float32")), Convolution(psf.spencer())
    frames, expected = renderer.apply(image, settings), reference.apply(image, settings)
    results = (
        deviation(name, frames[name], expected[name], 1e-5 * float(np.abs(expected[name]).max()))
        for name in ("bloom", "final")
    )
    yield from _with_passes(results, renderer, image, settings)


def _not_finite(renderer: Renderer, settings: Settings, dtype: str) -> Iterator[Deviation]:
    image = picture(_SIZE, 4, dtype)
    if dtype != "uint8":
        image[4, 5, 0], image[10, 20, 1], image[20, 0, 2] = np.nan, np.inf, -np.inf
    frames = renderer.apply(image, settings)
    yield from _with_passes(deviations(frames, image, settings), renderer, image, settings)


def compare_scene(
    scene: Scene, shading: Any, format: Any, renderer: Renderer
) -> Iterator[Deviation]:
    """Compare the passes after the glow, and the light of a deferred scene."""
    method = "pyramid" if shading == "forward" else "tutorial"
    settings, size = METHODS[method].replace(format=format), FRAME
    frames = renderer.render(scene, settings, size, shading=shading)
    glow = "glow" if shading == "forward" else "brightness"
    for name in (glow, "scene"):
        if not frames[name][..., :3].any():
            yield Deviation(name, np.nan, 0.0, f"{name}: nothing is drawn")
    if shading == "deferred":
        gbuffer = (frames[name] for name in ("albedo", "normal", "position", "brightness"))
        lit = reference.shade(*gbuffer)
        yield deviation("scene", frames["scene"], lit, 2**-9 + 2**-10 * np.abs(lit))
    for name, expected in reference.passes(frames[glow], settings, size, format).items():
        limit = tolerance(frames[name].dtype, expected, stages_of_8_bits=2, stages=8)
        yield deviation(name, frames[name], expected, limit)
    final = reference.composite(frames["scene"], frames["bloom"], settings, np.uint8)
    yield deviation("final", frames["final"], final, 1.01 / 255)


def _derivatives(renderer: Renderer, settings: Settings, given: bool) -> Iterator[Deviation]:
    values = np.random.default_rng(1).random((4, 11, 14, 3), np.float32)
    arrays: dict[str, Any] = {"mask": values[1, ..., 0], "emission": values[2]} if given else {}
    yield from _pull(renderer, settings, values[0], values[3], **arrays)


def _derivatives_of_a_lamp(renderer: Renderer, settings: Settings) -> Iterator[Deviation]:
    image, cotangent = np.zeros((2, 11, 14, 4), np.float32)
    image[5, 7], image[..., 3] = (4, 2, 1, 1), 1
    cotangent[:] = np.random.default_rng(1).random(cotangent.shape)
    yield from _pull(renderer, settings, image, cotangent)


def _pull(
    renderer: Renderer,
    settings: Settings,
    image: NDArray[Any],
    cotangent: NDArray[Any],
    **arrays: Any,
) -> Iterator[Deviation]:
    _, pullback = vjp(image, settings, renderer=renderer, **arrays)
    gradients = pullback({"final": cotangent})
    _, of_reference = reference.vjp(image, settings, **arrays)
    for name, part in of_reference({"final": cotangent}).items():
        limit = 1e-5 * max(float(np.abs(part).max()), 1e-3)
        yield deviation(
            f"derivative by {name}", np.asarray(gradients[name]), np.asarray(part), limit
        )


def _map(renderer: Renderer, dtype: str, settings: Settings) -> Iterator[Deviation]:
    images = [picture((28 + i, 20), 3 + i % 2, dtype, i) for i in range(4)]
    for image, frames in zip(images, renderer.map(images, settings), strict=True):
        yield from deviations(frames, image, settings)


def _sweep(renderer: Renderer, dtype: str, settings: Settings) -> Iterator[Deviation]:
    image = picture((40, 24), 3, dtype)
    several = [settings.replace(intensity=i / 2, exposure=-(i % 2)) for i in range(4)]
    for changed, frames in zip(several, renderer.sweep(image, several), strict=True):
        yield from deviations(frames, image, changed)


def _requests() -> Iterator[tuple[str, str, Settings, dict[str, Any]]]:
    """Return what is applied to an image: group, name, settings, and arguments of `_apply`."""
    for size in (_SIZE, (97, 60)):
        yield from (("methods", name, each, {"size": size}) for name, each in METHODS.items())
    yield from (
        # (A threshold magnifies what half floats round, and a transform spreads it.)
        ("presets", name, each.replace(format="rgba32float") if "fog" in name else each, {})
        for name, each in presets_of_low_levels(64).items()
    )
    for name in ("tutorial", "loops-layers", "knee", "direct", "pyramid-firefly", "dual-kawase"):
        for format in FORMATS_BY_DTYPE.values():
            yield "formats", f"{name} {format}", METHODS[name].replace(format=format), {}
    three = ("tutorial", "pyramid", "dual-kawase")
    for size in ((1, 1), (1, 7), (7, 1), (13, 17), (211, 317), (320, 240)):
        yield from (("sizes", name, METHODS[name], {"size": size}) for name in three)
    for given in (("mask",), ("emission",), ("mask", "emission")):
        for name in ("knee", "pyramid", "dual-kawase"):
            yield "masks", f"{name} {' '.join(given)}", METHODS[name], {"given": given}
    for name, stages in glares.items():
        yield "glares", name, Pyramid(threshold=0.5, glare=stages), {}
    for name in (*_SMOOTH, "knee", "direct", "longest"):
        # 8 bits would hide a weight that is wrong by a hundredth.
        yield "fragment shaders", name, METHODS[name], {"dtype": "float32"}


def cases() -> Iterator[Case]:
    """Return all cases, by group."""
    for number, (group, name, settings, kept) in enumerate(_requests()):
        dtype = kept.pop("dtype", IMAGE_DTYPES[(number + number // 3) % 3])
        width, height = size = kept.pop("size", _SIZE)
        check = partial(_apply, size=size, dtype=dtype, settings=settings, **kept)
        variant = "fragment" if group == "fragment shaders" else "auto"
        yield Case(group, f"{name}, {dtype}, {width} x {height}", check, variant)
    for number, (tonemap, encoding) in enumerate(itertools.product(TONEMAPS, ENCODINGS)):
        parts = (COMPOSITES[number % 3], tonemap, encoding, IMAGE_DTYPES[number // 3 % 3])
        yield Case("last pass", " ".join(parts), partial(_final, parts=parts))
    for size in ((8, 11), (15, 30), (45, 77), (64, 33), (90, 7)):
        yield Case("convolutions", f"{size[0]} x {size[1]}", partial(_convolve, size=size))
    for name, given in itertools.product(_SMOOTH, (False, True)):
        label = f"{name}{' with mask and emission' * given}"
        check = partial(_derivatives, settings=METHODS[name], given=given)
        yield Case("derivatives", label, check)
    for name, settings in _DIVIDING.items():
        check = partial(_derivatives_of_a_lamp, settings=settings)
        yield Case("derivatives", f"{name}, a lamp", check)
    for dtype in IMAGE_DTYPES:
        of_pyramid: Any = {"dtype": dtype, "settings": METHODS["pyramid"]}
        yield Case("NaN and infinity", f"pyramid, {dtype}", partial(_not_finite, **of_pyramid))
        yield Case("map and sweep", f"map, {dtype}", partial(_map, **of_pyramid))
        yield Case("map and sweep", f"sweep, {dtype}", partial(_sweep, **of_pyramid))
    ufo = Scene.ufo()
    sky = skybox.load(picture((4, 24), 4, "uint8").reshape(6, 4, 4, 4))
    named = {"ufo": ufo, "ufo with sky": dataclasses.replace(ufo, skybox=sky)}
    for each in itertools.product(named, ("forward", "deferred"), FORMATS_BY_DTYPE.values()):
        check = partial(compare_scene, named[each[0]], *each[1:])
        yield Case("scenes", ", ".join(each), check)
