"""The blooms that are measured: settings of any method, and programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom.own.method import OwnMethod
from vkbloom.renderer import Renderer
from vkbloom.settings import Settings
from vkbloom.testing.probe import Bloom, Probe
from vkbloom.testing.programs import COARSE_ERROR, Program

Image = NDArray[Any]


@dataclass(frozen=True)
class Subject:
    """A bloom, and what is known of it.

    - `bloom`: The bloom alone; of a program what it writes, or that less the image.
    - `picture`: The picture with its bloom.
    - `settings`: None for programs.
    - `gain`: What a flat image should get. None: what it gets in its middle.
    - `steps`: Positions per pixel of the moving light.
    """

    name: str
    bloom: Bloom
    picture: Bloom
    probe: Probe
    settings: Settings | None = None
    gain: float | None = None
    steps: float = 2.0

    @property
    def intensity(self) -> float:
        """The bloom's factor in the picture."""
        return 1.0 if self.settings is None else self.settings.intensity


def exact(settings: Settings) -> Settings:
    """Return the settings with buffers of floats, and nothing after the composite."""
    plain = settings.replace(tonemap="none", encoding="none", exposure=0.0, dither=False)
    return plain if plain.format is not None else plain.replace(format="rgba32float")


def shown(renderer: Renderer, settings: Settings, framebuffer: str) -> Callable[[Image], Image]:
    """Return the colours of a framebuffer as a function of the image."""

    def bloom(image: Image) -> Image:
        return renderer.apply(image, settings, attachments=framebuffer)[framebuffer][..., :3]

    return bloom


def of_settings(
    name: str, renderer: Renderer, settings: Settings, size: tuple[int, int], gain: float | None
) -> Subject:
    """Return the bloom of settings. An own bloom is expected to keep the light of flat images."""
    used = exact(settings)
    if gain is None and isinstance(used, OwnMethod) and used.file.saves_bloom:
        gain = 1.0
    return Subject(
        name,
        shown(renderer, used, "bloom"),
        shown(renderer, used, "final"),
        Probe(size=size),
        used,
        gain,
    )


def of_program(
    name: str, program: Program, size: tuple[int, int], gain: float | None, *, less_input: bool
) -> Subject:
    """Return the bloom of a program, which is run once to see what it writes."""
    probe = Probe(size=size)
    program(probe.given(probe.flat(0.0)))
    if program.bits is not None:
        probe = Probe(size=size, atol=COARSE_ERROR)

    def difference(image: Image) -> Image:
        return np.asarray(program(image)[..., :3] - image)

    return Subject(
        name, difference if less_input else program, program, probe, gain=gain, steps=0.5
    )
