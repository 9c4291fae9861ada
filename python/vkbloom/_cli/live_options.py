"""The arguments of commands that show an IMAGE or a scene with live controls."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Final

import click

from vkbloom._cli.image_files import expand_option, layer_option, read_picture, subimage_option
from vkbloom._cli.program import adapter_option, given
from vkbloom._cli.scene_options import scene_options
from vkbloom._cli.settings_options import settings_options
from vkbloom._cli.streams import is_stream

#: Options of a scene, by the names of their parameters.
_OF_SCENE: Final = {"base": "--scene", "shading": "--shading", "size": "--size"}


def live_options(*, image_has_size: bool) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add IMAGE and its options, and those of the device, the scene and the settings.

    The command gets the pixels of IMAGE as `image`, which is None for a scene, and as `origin` the
    arguments `file` and `expand` of a `Viewer`. `image_has_size`: ``--size`` may be given with an
    IMAGE.
    """

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        @click.argument("source", metavar="[IMAGE]", required=False, type=click.Path())
        @subimage_option
        @layer_option
        @expand_option
        @adapter_option
        @scene_options
        @settings_options
        @functools.wraps(command)
        def run(
            *,
            source: str | None,
            subimage: int,
            layer: str | None,
            expand: float | None,
            **arguments: Any,
        ) -> Any:
            if source is None:
                if given("expand"):
                    raise click.UsageError("--expand is only for an IMAGE")
                return command(image=None, origin={}, **arguments)
            for name, option in _OF_SCENE.items():
                if given(name) and not (name == "size" and image_has_size):
                    raise click.UsageError(
                        f"{option} is only for scenes; leave it out with an IMAGE"
                    )
            picture = read_picture(source, subimage, None, layer=layer, expand=expand)
            is_expanded = picture.numbers.startswith("uint") and expand not in (None, 1)
            origin: dict[str, Any] = {"file": "" if is_stream(source) else source}
            origin |= {"expand": expand} if is_expanded else {}
            return command(image=picture.pixels, origin=origin, **arguments)

        return run

    return add
