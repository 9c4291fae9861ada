"""Random requests: a renderer that has drawn many others gives the bits of a new one, and both give
what the reference says.
"""

from __future__ import annotations

import random
from typing import Any, Final, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.conftest import SANITIZED
from tests.custom.test_names import (
    EVERY,
    IMAGE,
    check_frames,
    find_names,
    random_glare,
    random_passes,
    settings_of,
)
from tests.exhaustive import EXHAUSTIVE
from tests.images import choose_given, hdr_picture
from tests.tolerance import assert_matches_reference
from vkbloom import Frames, Renderer, Settings

Array = NDArray[Any]

#: Few, so that requests meet what the renderer has kept of others.
IMAGES: Final = (
    IMAGE,
    hdr_picture(30, 22, 3, "float32", seed=1),
    hdr_picture(30, 22, 4, "float16", seed=2),
    hdr_picture(41, 33, 3, "uint8", seed=3),
)
#: Values of settings. Some methods refuse some of them. An exposure above 0 would magnify the
#: rounding of 8 bits, which the limits are of.
CHANGES: Final[dict[str, tuple[Any, ...]]] = {
    "threshold": (None, 0.0, 0.3),
    "intensity": (0.25, 0.75),
    "exposure": (-1.0, -0.5),
    "tonemap": ("none", "reinhard"),
    "encoding": ("none", "gamma22"),
    "bloom_scale": (0.5, 0.75),
    "format": ("rgba16float", "rgba32float"),
}


class Request(NamedTuple):
    image: Array
    settings: Settings
    given: dict[str, Any]  # a mask and an emission, or one of them

    def draw(self, renderer: Renderer) -> Frames:
        return renderer.apply(self.image, self.settings, **self.given)

    def check(self, frames: Frames) -> None:
        """Compare with the reference."""
        if self.image is IMAGE:
            check_frames(frames, self.settings, **self.given)
        else:
            assert_matches_reference(frames, self.image, self.settings, **self.given)


def change(settings: Settings, chance: random.Random) -> Settings:
    """Change some settings to others that the method takes."""
    for name, values in CHANGES.items():
        if chance.random() < 0.25:
            try:
                settings = settings.replace(**{name: chance.choice(values)})
            except ValueError:
                continue
    return settings


def choose_inputs(chance: random.Random, image: Array) -> dict[str, Any]:
    return choose_given([name for name in ("mask", "emission") if chance.random() < 0.3], image)


def glow_of(image: Array, mask: Array | None = None, emission: Array | None = None) -> Array:
    """Return the glow of a request without a threshold."""
    glow = image if emission is None else emission
    return glow if mask is None else glow * mask[..., np.newaxis]


def random_request(chance: random.Random, names: list[str] | None) -> Request:
    """Return a request of a custom method that saves textures under some names; or without them
    of a method of the package. With glare the format is one in which it is compared closely.
    """
    glare = random_glare(chance)
    if names is not None:
        given = choose_inputs(chance, IMAGE)
        passes = random_passes(chance, names)
        return Request(IMAGE, settings_of(passes, "random", glare, glow_of(IMAGE, **given)), given)
    image = IMAGE if glare else chance.choice(IMAGES)
    settings = change(chance.choice(EVERY), chance)
    if image is IMAGE:
        # Its light may be near -1, where Reinhard's curve has a pole.
        settings = settings.replace(glare=glare, format="rgba32float", dither=False, tonemap="none")
    elif any(weight < 0 for weight in getattr(settings, "weights", None) or ()):
        # The limits are of the sum, in which these weights cancel rounded values.
        settings = settings.replace(format="rgba32float")
    return Request(image, settings, choose_inputs(chance, image))


def check_request(renderer: Renderer, request: Request) -> None:
    """Compare the frames of a renderer with those of a new one, and with the reference."""
    frames = request.draw(renderer)
    with Renderer(validation=not SANITIZED) as fresh:
        expected = request.draw(fresh)
    assert list(frames) == list(expected)
    for name, array in expected.items():
        assert frames[name].tobytes() == array.tobytes(), name
    request.check(frames)


@pytest.fixture(scope="module")
def known_names() -> list[str]:
    return find_names()


@pytest.mark.parametrize("seed", range(600 if EXHAUSTIVE else 3))
def test_random_requests(renderer: Renderer, seed: int) -> None:
    check_request(renderer, random_request(random.Random(seed), None))


@pytest.mark.usefixtures("glslang")
@pytest.mark.parametrize("seed", range(400 if EXHAUSTIVE else 2))
def test_random_requests_of_custom_methods(
    renderer: Renderer, known_names: list[str], seed: int
) -> None:
    names = [name for name in known_names if name.upper() not in ("RGB", "MAINPRESUB")]
    check_request(renderer, random_request(random.Random(seed), names))
