"""Files of options, read by the command up to the point where it would render.

Other targets test the images and meshes that such files name; here only one image exists.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import click
import numpy as np

import vkbloom
from vkbloom.cli import axis_options, scene_options
from vkbloom.cli import grid as command
from vkbloom.io.images import Picture, StoredImage

IMAGE = np.linspace(0, 1, 60, dtype=np.float32).reshape(4, 5, 3)

TOML = b"""
out = "a.zarr"
images = ["picture"]
method = "pyramid"
attachments = ["final", "bloom"]
time = 0.0
workers = 2
resume = false
[settings]
levels = 3
firefly_filter = true
threshold = "none"
[axes]
radius = "0.5:2:3:log"
intensity = [0.25, 1]
tonemap = ["none", "aces"]
bloom_size = [[16, 8], [4, 4]]
[reduce]
mean = "mean"
energy = "encircled_energy:bloom"
close = "psnr@intensity=1"
[chunks]
intensity = 2
"""
SCENE = b"""
out = "a.zarr"
size = [64, 32]
shading = "deferred"
glow_intensity = 2
camera = { fov = 60.0, position = [1, 2, 3] }
axes = { time = "0:1:5", dither = [true, false], threshold = ["none", 0.5], bloom_size = [[4, 4]] }
"""
YAML = b"""
out: a.zarr
images: [picture]
method: pyramid
settings: {levels: 3, firefly_filter: true, bloom-size: [16, 8], threshold: ~}
axes:
  radius: 0.5:2:3:log
  intensity: &i [0.25, 1]
  knee: *i
  tonemap: [none, aces]
reduce: {mean: mean, energy: "encircled_energy:bloom"}
chunks: {intensity: 2}
"""


def _read_picture(path: str, *_: object, **__: object) -> Picture:
    if path != "picture":
        raise FileNotFoundError(path)
    return Picture.of_values(IMAGE, "linear")


def _read(path: str, *_: object) -> StoredImage:
    raise FileNotFoundError(path)


@contextlib.contextmanager
def _no_client(*_: object) -> Iterator[None]:
    yield None


class Options:
    """Files of options of one format.

    Parameters
    ----------
    path : Path
        Where they are put; its suffix is the format's.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._ufo = vkbloom.Scene.ufo()

    def seeds(self) -> list[bytes]:
        """Return valid files, with which the command would render."""
        seeds = [TOML, SCENE] if self._path.suffix == ".toml" else [YAML]
        for seed in seeds:
            assert self._gets_through(seed), seed
        return seeds

    def run(self, data: bytes) -> None:
        """Run the command with a file."""
        with contextlib.suppress(click.ClickException, vkbloom.Error):
            self._gets_through(data)

    def _gets_through(self, data: bytes) -> bool:
        self._path.write_bytes(data)
        scene = mock.Mock(ufo=lambda: self._ufo, from_gltf=_read)
        with (
            mock.patch.object(scene_options, "Scene", scene),
            mock.patch.object(scene_options.gltf, "load_mesh", _read),
            mock.patch.object(scene_options.skybox, "load", _read),
            mock.patch.object(axis_options, "read", _read),
            mock.patch.object(command, "read_picture", _read_picture),
            mock.patch.object(command, "_client", _no_client),
            mock.patch.object(command, "render_grid", side_effect=click.Abort),
            mock.patch.object(vkbloom, "grid_to_zarr", side_effect=click.Abort),
            contextlib.redirect_stdout(io.StringIO()),
        ):
            try:
                words = ["-o", "a.zarr", "--from", str(self._path)]
                command.command.main(words, "grid", standalone_mode=False)
            except click.Abort:
                return True
        # With --help only.
        return False
