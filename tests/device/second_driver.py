"""A part of all workloads on the driver that the environment names; prints the wrong ones as JSON.

Every method, preset, variant, dtype and kind of scene has its turn, under validation.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable

import numpy as np

import vkbloom
from tests import tolerance
from tests.exhaustive import EXHAUSTIVE
from tests.images import picture
from tests.methods.cases import DTYPES, METHODS, presets_of_low_levels
from tests.screens import CAMERA, panel
from vkbloom import Convolution, Pyramid, Renderer, Scene, Separable, Settings, psf, reference
from vkbloom._scene import skybox
from vkbloom._scene.textures import Texture

VARIANTS = ("fragment", "cpu", "gpu")
SIZE, FRAME = (24, 17), (48, 32)


def compare(renderer: Renderer, settings: Settings, dtype: str, seed: int) -> None:
    image = picture(*SIZE, 3 + seed % 2, dtype, seed=seed)
    tolerance.assert_matches_reference(renderer.apply(image, settings), image, settings)


def compare_given(renderer: Renderer, dtype: str) -> None:
    """An image with a mask and an emission, uploaded, and its derivatives."""
    image, emission = (picture(*SIZE, 3, dtype, seed=seed) for seed in (1, 2))
    mask = picture(*SIZE, 1, dtype, seed=3)[..., 0]
    settings = Pyramid(levels=3, threshold=0.3, knee=0.5)
    frames = renderer.apply(
        renderer.upload(image, mask=mask, emission=emission), settings, framebuffers="all"
    )
    tolerance.assert_matches_reference(frames, image, settings, mask=mask, emission=emission)
    if dtype != "float32":
        return
    _, pullback = vkbloom.vjp(image, settings, renderer=renderer)
    cotangent = np.ones(image.shape, np.float32)
    expected = reference.vjp(image, settings)[1]({"final": cotangent})["image"]
    np.testing.assert_allclose(pullback({"final": cotangent})["image"], expected, atol=1e-4)


def compare_convolution(renderer: Renderer, size: tuple[int, int]) -> None:
    """Transforms of all radices, whose angles a loose sine would show."""
    image = picture(*size, 3, "float32")
    settings = Convolution(psf.spencer())
    found, expected = renderer.apply(image, settings), reference.apply(image, settings)
    for name in ("bloom", "final"):
        limit = 1e-5 * float(np.abs(expected[name]).max())
        np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=limit)


def compare_scene(renderer: Renderer, scene: Scene, format: str) -> None:
    settings = Separable(bloom_size=FRAME, format=format)  # type: ignore[arg-type]
    frames = renderer.render(scene, settings, FRAME)
    glow = frames["glow"][..., :3]
    assert glow.any()
    assert frames["scene"][..., :3].any()
    limit = 2.5 / 255 if format == "rgba8unorm" else 2**-9 * float(glow.max())
    expected = reference.blur(glow, settings)
    np.testing.assert_allclose(tolerance.colours(frames["bloom"]), expected, atol=limit)
    shown = renderer.render(scene, settings, FRAME, shading="deferred")
    gbuffer = [shown[name] for name in ("albedo", "normal", "position", "brightness")]
    lit = reference.shade(*gbuffer)
    np.testing.assert_allclose(shown["scene"], lit, rtol=2**-10, atol=2**-9)


def scenes() -> dict[str, Scene]:
    texture = Texture((picture(6, 5, 4, "float16"),))
    sky = skybox.load(picture(4, 24, 4, "uint8").reshape(6, 4, 4, 4))
    lamp = panel(FRAME, texture, texture, radiance=(1.0, 0.5, 2.0))
    return {
        "ufo": Scene.ufo(),
        "sky": dataclasses.replace(Scene.ufo(), skybox=sky),
        "textures": Scene(lamp, panel(FRAME, texture), camera=CAMERA),
        "emission": Scene(lamp, camera=CAMERA),
        "plain emission": Scene(dataclasses.replace(lamp, surfaces=()), camera=CAMERA),
    }


def main() -> None:
    wrong: dict[str, str] = {}

    def attempt(name: str, call: Callable[[], None]) -> None:
        try:
            call()
        except Exception as error:
            wrong[name] = f"{type(error).__name__}: {error}"

    for turn, variant in enumerate(VARIANTS):
        os.environ["VKBLOOM_VARIANT"] = variant
        with Renderer("software", validation=True) as renderer:
            methods = METHODS | presets_of_low_levels(32)
            for number, (name, settings) in enumerate(methods.items()):
                if EXHAUSTIVE or number % len(VARIANTS) == turn:
                    dtype = DTYPES[number // len(VARIANTS) % len(DTYPES)]
                    attempt(
                        f"{name} {variant} {dtype}",
                        lambda: compare(renderer, settings, dtype, number),  # noqa: B023
                    )
            sizes = ((8, 11), (15, 30), (45, 77), (64, 33), (90, 7))
            for size in sizes if EXHAUSTIVE else sizes[turn::3]:
                attempt(
                    f"convolution {size} {variant}",
                    lambda: compare_convolution(renderer, size),  # noqa: B023
                )
            attempt(f"given {variant}", lambda: compare_given(renderer, DTYPES[turn]))  # noqa: B023
            for number, (name, scene) in enumerate(scenes().items()):
                format = ("rgba8unorm", "rgba16float", "rgba32float")[(number + turn) % 3]
                if EXHAUSTIVE or (number + turn) % 2 == 0:
                    attempt(
                        f"scene {name} {variant} {format}",
                        lambda: compare_scene(renderer, scene, format),  # noqa: B023
                    )
            about = renderer.info.name
    print(json.dumps({"adapter": about, "wrong": wrong}))


if __name__ == "__main__":
    main()
