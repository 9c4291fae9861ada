"""What a renderer does on a lesser device, of which test_lesser_devices.py tells; prints JSON.

Arguments: the first words of the cases to try; all without.
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

import vkbloom
from tests import tolerance
from tests.custom import COUNTER
from tests.exhaustive import EXHAUSTIVE
from tests.images import DTYPES, picture
from tests.scene.parts import Texture, load_sky
from tests.screens import CAMERA, panel
from vkbloom import DualKawase, Frames, Pyramid, Renderer, Scene, Separable, ThreeBloom, psf

# One of each variant: lines, strips and tiles, levels half and twice as large, sums of all levels.
SETTINGS = {
    "whole": Separable(threshold=0.4),
    "smaller": Separable(bloom_scale=0.5),
    "layers": Separable(layers=((1.0, 0.5), (2.0, 0.5))),
    "pyramid": Pyramid(levels=3, threshold=0.4, knee=0.5),
    "kawase": DualKawase(levels=2),
    "gathered": ThreeBloom(),
}

#: From this size on, images are read back without staging memory, if the device supports it.
LARGE = (600, 500)
#: The same with three channels: the last pass stores words of three channels.
LARGE_RGB = (704, 500)


def custom(bindings: str = "", names: str = "", threads: str = "8 8", shared: int = 1) -> str:
    """Return a file of one compute pass that needs these."""
    binds = "".join(f"//!BIND {name}\n" for name in names.split())
    return f"""{bindings}//!HOOK MAIN
//!BIND GLOW
{binds}//!COMPUTE {threads}
//!SAVE BLOOM
shared vec4 kept[{shared}];
void hook() {{
    kept[gl_LocalInvocationIndex % {shared}] = GLOW_tex(GLOW_pos);
    barrier();
    imageStore(out_image, ivec2(gl_GlobalInvocationID), kept[0]);
}}
"""


BUFFER = "//!BUFFER b{0}\n//!VAR float v{0}\n//!STORAGE\n\n"
IMAGE = "//!TEXTURE t{0}\n//!SIZE 4 4\n//!FORMAT r32f\n//!STORAGE\n\n"
#: Methods from files; the first one needs no more than every device has.
CUSTOM = {
    "small": custom("".join(map(BUFFER.format, range(4))), "b0 b1 b2 b3", "16 8", 1024),
    "buffers": custom("".join(map(BUFFER.format, range(5))), "b0 b1 b2 b3 b4"),
    "images": custom("".join(map(IMAGE.format, range(4))), "t0 t1 t2 t3"),
    "threads": custom(threads="16 16"),
    "shared": custom(shared=1025),
}


#: What the device lacks.
TAKEN = {*os.environ["VKBLOOM_LESSER"].split(",")}

#: Passes of a frame of `final` alone, by method.
PASSES: dict[str, int] = {}


def use_handles(renderer: Renderer) -> None:
    """One of each size and dtype, more than have memory at once, each used twice."""
    images = [picture(28 + i, 20, 3 + i % 2, dtype) for dtype in DTYPES for i in range(3)]
    handles = [renderer.upload(image) for image in images]
    for _ in range(2):
        for image, handle in zip(images, handles, strict=True):
            np.testing.assert_array_equal(
                renderer.apply(handle, Pyramid(levels=2))["final"],
                renderer.apply(image, Pyramid(levels=2))["final"],
            )
    for _ in range(2):
        for image, frames in zip(images, renderer.map(iter(images), Separable()), strict=True):
            tolerance.assert_matches_reference(frames, image, Separable())


def draw_surfaces(renderer: Renderer) -> None:
    """A body of emissive surfaces, more than a pool has sets; the forward system draws it twice."""
    one = panel((8, 6), Texture((picture(4, 4, 4, "float16"),)), radiance=(1.0, 2.0, 1.0))
    body = dataclasses.replace(one, indices=np.tile(one.indices, 70), surfaces=70 * one.surfaces)
    expected = renderer.render(Scene(body=one, camera=CAMERA), size=(8, 6))
    frames = renderer.render(Scene(body=body, camera=CAMERA), size=(8, 6))
    np.testing.assert_array_equal(frames["final"], expected["final"])


def count_frames(renderer: Renderer) -> None:
    """Frames of a method with state, whose memory is freed after each."""
    counter = vkbloom.load_method(COUNTER, name="counter")(format="rgba32float")
    for number in range(30):
        frames = renderer.apply(picture(8, 6), counter.replace(exposure=number / 32))
        assert frames["bloom"][0, 0, 0] == 1


def apply_wide(renderer: Renderer, settings: vkbloom.Settings) -> None:
    """Apply a bloom whose first level is as wide as the device's limit."""
    # Here, since it imports asyncio, which most runs of this program do not need.
    from unittest import mock

    image = picture(330, 1, 3, "float32")
    frames = renderer.apply(image, settings)
    width = frames["down_0"].shape[1]
    assert width >= 4096
    name = settings.method
    with mock.patch(f"vkbloom.reference._{name}.WIDEST_LEVEL", width):
        tolerance.assert_matches_reference(frames, image, settings)


def convolve(renderer: Renderer) -> None:
    image, settings = picture(28, 20, 3), vkbloom.Convolution(psf.gaussian(3))
    variants = [one.variant for one in renderer.plan(image, settings).passes]
    PASSES["lines"] = variants.count("lines")
    tolerance.assert_matches_reference(renderer.apply(image, settings), image, settings)


def try_all(renderer: Renderer) -> dict[str, str]:
    """Return the errors by workload."""
    wrong: dict[str, str] = {}

    def attempt(name: str, call: Callable[[], object]) -> None:
        if sys.argv[1:] and name.split(maxsplit=1)[0] not in sys.argv[1:]:
            return
        try:
            call()
        except Exception as error:
            wrong[name] = f"{type(error).__name__}: {error}"

    def apply(image: Any, settings: vkbloom.Settings) -> None:
        tolerance.assert_matches_reference(renderer.apply(image, settings), image, settings)
        last = settings.replace(exposure=0.5)
        alone = renderer.apply(image, last, framebuffers=("final",))["final"]
        np.testing.assert_array_equal(alone, renderer.apply(image, last)["final"])

    def apply_alone(image: Any, settings: vkbloom.Settings) -> None:
        alone = renderer.apply(image, settings, framebuffers=("final",))["final"]
        np.testing.assert_array_equal(alone, renderer.apply(image, settings)["final"])

    def fuse() -> None:
        """Compare fused passes, which keep what an image would hold, with those of the method."""
        # Half of an odd level more, which is between two: the last bit of a level decides.
        between = Separable(weights=(1.0,), blur_strength=1.0, intensity=0.5)
        image = np.tile(np.arange(170, dtype=np.uint8)[:, np.newaxis], (20, 1, 4))
        for settings in (between, Separable(threshold=0.3), Pyramid(levels=2)):
            whole = renderer.apply(image, settings)["final"]
            renderer.apply(image[::-1, ::-1], settings)
            alone = renderer.apply(image, settings, framebuffers=("final",))
            np.testing.assert_array_equal(alone["final"], whole)
            PASSES[type(settings).__name__] = len(alone.timings)

    scene = Scene.ufo()
    for number, (name, settings) in enumerate(SETTINGS.items()):
        # The first with all types of pixels, the others by turns, of which layers need float32.
        one = ("float32", "uint8", "float32", "float16")[number % 4 :][:1]
        for dtype in DTYPES if name == "whole" or EXHAUSTIVE else one:
            image = picture(28, 20, 3, dtype)
            attempt(f"{name} {dtype}", lambda: apply(image, settings))  # noqa: B023  called here
        for shading in ("forward", "deferred") if name in ("whole", "gathered") else ():
            attempt(
                f"{name} {shading}",
                lambda: renderer.render(scene, settings, (40, 30), shading=shading),  # noqa: B023
            )
    attempt("fuse", fuse)
    attempt("convolve", lambda: convolve(renderer))
    attempt("handles", lambda: use_handles(renderer))
    attempt("surfaces", lambda: draw_surfaces(renderer))
    if "state" in sys.argv:
        attempt("state", lambda: count_frames(renderer))
    attempt("large", lambda: apply(picture(*LARGE, 4, "uint8"), Separable()))
    # A GPU gets its first rows while the others are packed.
    attempt("bands", lambda: apply(picture(*LARGE, 4, "float32"), Separable()))
    attempt("large RGB", lambda: apply_alone(picture(*LARGE_RGB, 3, "uint8"), Separable()))
    for dtype in DTYPES:
        sky = load_sky(picture(4, 24, 4, dtype).reshape(6, 4, 4, 4))
        with_sky = dataclasses.replace(scene, skybox=sky)
        attempt(f"sky {dtype}", lambda: renderer.render(with_sky, None, (40, 30)))  # noqa: B023
    methods = (vkbloom.BevyBloom(max_mip_dimension=16), vkbloom.FilamentBloom(resolution=16))
    for method in methods if {"limits", "wide", "high"} & TAKEN else ():
        attempt("wide", lambda: apply_wide(renderer, method))  # noqa: B023  called here
    for label, text in CUSTOM.items() if "custom" in sys.argv else ():
        loaded = vkbloom.load_method(text, name=label)
        attempt(f"custom {label}", lambda: renderer.apply(picture(28, 20, 3), loaded()))  # noqa: B023
    for size in ((6000, 1), (1, 6000)):
        attempt(f"{size[0]} x {size[1]}", lambda: renderer.render(scene, None, size))  # noqa: B023
    return wrong


def has_timings(frames: Frames) -> bool:
    return not any(math.isnan(seconds) for seconds in frames.timings.values())


def main() -> None:
    renderer = Renderer(os.environ["VKBLOOM_TEST_NAME"], validation=True)
    wrong = try_all(renderer)
    # Other settings than before, so that passes run.
    frames = renderer.apply(picture(9, 9, 3, "uint8"), Separable(blur_strength=0.125))
    about = {"type": renderer.info.type, "timed": has_timings(frames), "passes": PASSES}
    print(json.dumps({**about, "wrong": wrong}))
    renderer.close()


if __name__ == "__main__":
    main()
