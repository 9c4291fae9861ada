"""The options of a scene: its files and its camera."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Final

import click

from vkbloom._cli import fields
from vkbloom._cli.program import as_wrong_use
from vkbloom._cli.sequences import as_file
from vkbloom._scene import Camera, Scene, gltf, skybox

_BUILT_IN: Final = "ufo"
_FACES: Final = 6


def scene_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of a scene to a command; its argument `scene` is a function that loads it.

    The function raises OSError or ValueError if a file does not load, and click.UsageError if an
    option is out of range.
    """

    @click.option(
        "--scene", "base", default=_BUILT_IN, metavar="ufo|PATH", help="The lit mesh, a glTF file."
    )
    @click.option(
        "--glow", type=click.Path(), help="The glowing mesh; without it, materials that emit glow."
    )
    @click.option(
        "--skybox",
        "sky",
        type=click.Path(),
        multiple=True,
        help="A KTX 1 cubemap or an equirectangular image; or six times a face, +x to -z.",
    )
    @click.option(
        "--glow-intensity", type=float, default=1.0, help="Factor of the glow in deferred shading."
    )
    @fields.options({"": Camera}, "camera", prefix="camera-")
    @functools.wraps(command)
    def run(
        base: str,
        glow: str | None,
        sky: tuple[str, ...],
        glow_intensity: float,
        camera: dict[str, Any],
        **rest: object,
    ) -> object:
        if len(sky) not in (0, 1, _FACES):
            raise click.UsageError(f"--skybox: given {len(sky)} times; give it once or six times")
        return command(scene=lambda: _load(base, glow, sky, glow_intensity, camera), **rest)

    return run


def _load(
    base: str, glow: str | None, sky: tuple[str, ...], glow_intensity: float, camera: dict[str, Any]
) -> Scene:
    with ExitStack() as stack:
        files = [stack.enter_context(as_file(face)) for face in sky]
        scene = Scene.ufo()
        if base != _BUILT_IN:
            scene = Scene.from_gltf(stack.enter_context(as_file(base)))
        changes: dict[str, Any] = {"glow_intensity": glow_intensity}
        if glow is not None:
            changes["glow"] = gltf.load_mesh(stack.enter_context(as_file(glow)))
        if files:
            changes["skybox"] = skybox.load(files[0] if len(files) == 1 else files)
    with as_wrong_use():
        changes["camera"] = dataclasses.replace(scene.camera, **camera)
        return dataclasses.replace(scene, **changes)
