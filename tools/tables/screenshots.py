"""Pairs of 8-bit screenshots with and without bloom, and what a fit finds of each.

The photographs are scikit-image's, made smaller. Both pictures of a pair are rounded to 8 bits in
sRGB. Blooms have known settings; the other pairs differ by what is no bloom.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from skimage import data, transform

import vkbloom
from vkbloom._io.srgb import decode_srgb, encode_srgb

WIDTH: Final = 192
Pixels = NDArray[np.uint8]


class Bloom(NamedTuple):
    """A screenshot whose settings are known."""

    photograph: str
    preset: str
    threshold: float
    intensity: float


BLOOMS: Final = (
    Bloom("rocket", "kino", 0.5, 0.6),
    Bloom("coffee", "unity_urp", 0.5, 0.6),
    Bloom("chelsea", "bevy_natural", 0.3, 0.3),
    Bloom("astronaut", "unity_urp", 0.4, 0.1),
    Bloom("hubble_deep_field", "kino", 0.2, 0.8),
    Bloom("retina", "jimenez2014", 0.3, 0.2),
    Bloom("immunohistochemistry", "photo", 0.6, 0.2),
    Bloom("clock", "deferred", 0.4, 0.3),
    Bloom("moon", "filament", 0.2, 0.4),
    Bloom("astronaut", "blender_bloom", 0.6, 0.5),
)


def decode(levels: Pixels) -> NDArray[np.float32]:
    """Return sRGB levels as linear light."""
    return decode_srgb((levels / 255).astype(np.float32))


def levels_of(values: NDArray[Any]) -> Pixels:
    """Return linear light as levels of sRGB."""
    clipped = np.clip(values[..., :3].astype(np.float32), 0, 1)
    return np.rint(255 * encode_srgb(clipped)).astype(np.uint8)


def photograph(name: str, width: int = WIDTH) -> Pixels:
    """Return a small photograph of scikit-image."""
    image = getattr(data, name)()
    image = np.repeat(image[..., np.newaxis], 3, axis=2) if image.ndim == 2 else image[..., :3]
    size = round(image.shape[0] * width / image.shape[1]), width
    small = transform.resize(image / 255, size, anti_aliasing=True)
    return np.rint(255 * small).astype(np.uint8)


def with_bloom(renderer: vkbloom.Renderer, pair: Bloom) -> tuple[Pixels, Pixels]:
    """Return a photograph, and a screenshot of it with bloom."""
    image = photograph(pair.photograph)
    settings = vkbloom.presets[pair.preset].replace(
        threshold=pair.threshold, intensity=pair.intensity
    )
    return image, levels_of(renderer.apply(decode(image), settings)["final"])


def _noise(image: Pixels) -> NDArray[Any]:
    return image + np.random.default_rng(0).normal(0, 3, image.shape)


def _jpeg(image: Pixels) -> NDArray[Any]:
    file = io.BytesIO()
    Image.fromarray(image).save(file, "JPEG", quality=60)
    return np.asarray(Image.open(file))


def _saturate(image: Pixels) -> NDArray[Any]:
    grey = image.mean(axis=2, keepdims=True)
    return grey + 1.3 * (image - grey)


def _vignette(image: Pixels) -> NDArray[Any]:
    down, across = (np.linspace(-1, 1, side) for side in image.shape[:2])
    return image * (1 - 0.3 * np.hypot(down[:, np.newaxis], across))[..., np.newaxis] ** 0.5


#: What is no bloom, by the name of a photograph.
OTHERS: Final[dict[tuple[str, str], Callable[[Pixels], NDArray[Any]]]] = {
    ("rocket", "equal"): lambda image: image,
    ("coffee", "noise of 3 levels"): _noise,
    ("chelsea", "JPEG of quality 60"): _jpeg,
    ("astronaut", "brighter by a fifth"): lambda image: 1.2 * image,
    ("hubble_deep_field", "brighter by 20 levels"): lambda image: image + 20.0,
    ("retina", "more contrast"): lambda image: 128 + 1.3 * (image - 128.0),
    ("immunohistochemistry", "shifted by a pixel"): lambda image: np.roll(image, 1, axis=1),
    ("clock", "a gamma of 0.8"): lambda image: 255 * (image / 255) ** 0.8,
    ("coffee", "more saturation"): _saturate,
    ("moon", "vignette"): _vignette,
}


def without_bloom(name: str, change: str) -> tuple[Pixels, Pixels]:
    """Return a photograph, and a changed one without bloom."""
    image = photograph(name)
    changed = OTHERS[name, change](image)
    return image, np.rint(np.clip(changed, 0, 255)).astype(np.uint8)


def fit_preset(
    renderer: vkbloom.Renderer, pair: tuple[Pixels, Pixels], preset: str, max_calls: int = 1000
) -> vkbloom.FitResult:
    """Return what is found from a preset's settings."""
    image, target = map(decode, pair)
    return vkbloom.fit(
        image,
        target,
        vkbloom.presets[preset],
        ["threshold", "intensity"],
        renderer=renderer,
        max_calls=max_calls,
    )


def row(name: str, what: str, target: Pixels, found: vkbloom.FitResult) -> list[str]:
    """Return a row of the table."""
    saturated = (target == 255).any(axis=2).mean()
    values = f"{found.settings.threshold:.3f}, {found.settings.intensity:.3f}"
    if found.cause.startswith("no bloom"):
        values = ""
    share = f"{100 * max(0.0, found.explained):.1f} %"
    return [name.replace("_", " "), what, f"{100 * saturated:.1f} %", values, share, found.words]


def rows(renderer: vkbloom.Renderer, quick: bool) -> Iterator[list[str]]:
    """Yield the rows of all pairs, or of two; of others, what is found from two presets."""
    for bloom in BLOOMS[: 1 if quick else None]:
        image, target = with_bloom(renderer, bloom)
        truth = f"`{bloom.preset}`, {bloom.threshold:g}, {bloom.intensity:g}"
        found = fit_preset(renderer, (image, target), bloom.preset)
        yield row(bloom.photograph, truth, target, found)
    for name, change in [*OTHERS][: 1 if quick else None]:
        image, target = without_bloom(name, change)
        founds = [
            fit_preset(renderer, (image, target), one) for one in ("bevy_natural", "unity_urp")
        ]
        both = [row(name, change, target, found) for found in founds]
        yield [" / ".join(dict.fromkeys(cells)) for cells in zip(*both, strict=True)]
