"""Dirt on the lens."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from vkbloom._array_cache import keep
from vkbloom._core_kernel import CoreKernel
from vkbloom._numbers import check_number
from vkbloom._psf.core_kernels import WithKernel
from vkbloom._psf.sampled import check_values
from vkbloom._public import public
from vkbloom._settings.fields import number_field, value_field
from vkbloom._settings.glare import Glare

DirtMode = Literal["multiply", "lerp"]


def _read_image(image: Any) -> Any:
    return check_values("image", image)


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Dirt(WithKernel, Glare):
    """A picture of dirt on the lens, which multiplies bloom and glare.

    Parameters
    ----------
    image : array-like, shape (H, W) or (H, W, 3), or None
        The dirt D: linear and finite values, which are copied to float32 and enlarged bilinearly to
        the frame. None: a picture of 480 x 270 pixels, made from `seed`.
    seed : int
        Seed of the picture that is made, 0 to 65535.
    strength : float
        The s of the formulas, 0 to 16; with the mode "lerp" 0 to 1.
    mode : {"multiply", "lerp"}
        The light L becomes L D s, or L (1 + s (D - 1)).

    Notes
    -----
    Source: "multiply" from google/filament, colorGrading.mat @ 263d042924de; "lerp" from
    godotengine/godot, tonemap.glsl @ 001c8c9c24dc (the glow map).
    """

    stage: ClassVar[str] = "dirt"
    shaping: ClassVar[tuple[str, ...]] = ("image", "seed")

    image: Any = value_field(None, optional=True, read=_read_image)
    seed: int = number_field(slider=(0, 100))
    strength: float = number_field(slider=(0, 1))
    mode: DirtMode = "multiply"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mode == "lerp":
            check_number("strength", self.strength, 0, 1)

    @property
    def lerp(self) -> int:
        """Whether the mode is "lerp", for the core."""
        return int(self.mode == "lerp")

    @property
    def pixels(self) -> NDArray[np.float32]:
        """The picture, shape (H, W) or (H, W, 3)."""
        return _make_dirt(self.seed) if self.image is None else self.image.array

    def core_kernel(self, frame: object, buffers: object) -> CoreKernel:
        """Return the picture as the core reads a kernel."""
        return super().core_kernel((0, 0), (0, 0))

    def _kernel(self, frame: object, buffers: object) -> NDArray[np.float32]:
        return self.pixels


@keep
def _make_dirt(seed: int) -> NDArray[np.float32]:
    """Return soft discs and specks of 0 to 1, (270, 480)."""
    random = np.random.default_rng(seed)
    y, x = np.indices((270, 480), np.float32)
    picture = np.full(x.shape, 0.1, np.float32)
    for radius, light in ((20.0, 0.25), (8.0, 0.4), (2.5, 0.6)):
        for _ in range(40):
            size = radius * random.uniform(0.5, 1.5)
            distance = np.hypot(x - random.uniform(0, 480), y - random.uniform(0, 270)) / size
            picture += light * random.random() * np.clip(4 * (1 - distance), 0, 1)
    made: NDArray[np.float32] = np.minimum(picture, 1).astype(np.float32)
    made.flags.writeable = False
    return made
