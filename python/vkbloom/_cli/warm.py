"""``vkbloom warm``: fill the caches of pipelines and kernels before the first call needs them."""

from __future__ import annotations

import itertools
from typing import Any, Final

import click
import numpy as np
from tqdm import tqdm

from vkbloom._cli.fields import SIZE, NameOf
from vkbloom._cli.program import adapter_option
from vkbloom._cli.terminal import hides_progress, say
from vkbloom._formats import IMAGE_DTYPES
from vkbloom._renderer.interruptible import open_renderer
from vkbloom._scene import Scene
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import presets as known_presets

_USUAL_SIZE: Final = (1920, 1080)
# A single framebuffer may come from a fused pass.
_KEPT: Final[tuple[Any, ...]] = ("all", ("final",))


@click.command()
@click.option(
    "--preset",
    "presets",
    type=NameOf("preset", known_presets),
    multiple=True,
    help="Only this preset; repeat it for more.",
)
@click.option(
    "--method", "methods", type=NameOf("method", METHODS), multiple=True, help="Only this method."
)
@click.option(
    "--size", "sizes", type=SIZE, multiple=True, help="Of the images to come [default: 1920x1080]"
)
@adapter_option
def command(
    presets: tuple[str, ...],
    methods: tuple[str, ...],
    sizes: tuple[tuple[int, int], ...],
    adapter: str,
) -> None:
    """Compile the pipelines of presets and methods, so that later processes find them.

    Some pipelines are made for the size of the image: those of convolutions, and of small levels.

    Kernels of convolutions, which take up to a second to compute, are kept in the cache, too.

    The caches are vkbloom's and the driver's; vkbloom doctor shows their folders. Call it when a
    container's image is built, or in the step whose caches CI keeps. Mesa's software driver
    compiles for the CPU that it runs on: another type of CPU does not find these pipelines.
    """
    everything = not presets and not methods
    warmed = [known_presets[name] for name in (known_presets if everything else presets)]
    warmed += [METHODS[name]() for name in methods]
    calls = list(itertools.product(sizes or (_USUAL_SIZE,), IMAGE_DTYPES, (3, 4), warmed, _KEPT))
    with open_renderer(adapter) as renderer:
        if everything:
            scene = Scene.ufo()
            for shading in ("forward", "deferred"):
                for framebuffers in _KEPT:
                    renderer.render(scene, shading=shading, framebuffers=framebuffers)
        for size, dtype, channels, settings, framebuffers in tqdm(
            calls, unit="call", leave=False, disable=hides_progress()
        ):
            image = np.zeros((size[1], size[0], channels), dtype)
            renderer.apply(image, settings, framebuffers=framebuffers)
        name = renderer.info.summary
    say(f"{len(calls)} kinds of calls on {name}")
