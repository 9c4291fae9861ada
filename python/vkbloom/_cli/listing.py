"""Commands that list what has a published name, and draw a sheet of a picture with each of them."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

import click
import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.table import Table
from rich.text import Text
from tqdm import tqdm

import vkbloom
from vkbloom._cli.device_options import device_options
from vkbloom._cli.image_files import is_photograph, layer_option, read_picture
from vkbloom._cli.sequences import check_drawing
from vkbloom._cli.settings_options import PRESET_OF_IMAGES, PRESET_OF_PHOTOS
from vkbloom._cli.terminal import hides_progress, note, say, show, tell_device
from vkbloom._io import safe_writing
from vkbloom._io.expansion import PHOTO_EXPANSION
from vkbloom._renderer.interruptible import opened_renderer
from vkbloom._settings.settings import Settings
from vkbloom._views import pictures

__all__ = ["Entry", "base_settings", "listing_command"]

# Longer side of the picture in pixels: larger ones are reduced before the bloom.
_LARGEST_SIDE: Final = 1280
_COLUMNS: Final = 4
_WIDTH: Final = 480
# What highlights are expanded to for a glare that shows nothing otherwise.
_MORE_LIGHT: Final = (16, 64, 256, 1024)
# Levels by which pixels differ visibly, and the least shares of such pixels.
_SEEN, _SEEN_SHARE, _SEEN_DIRT = 16, 2e-3, 0.15


@dataclasses.dataclass(frozen=True)
class Entry:
    """What has a published name.

    - `what`: What it looks like.
    - `whose`: Its source.
    - `composite`: How its light comes into the picture: "add", "mix", ...
    - `needs_hdr`: Whether only values above 1 glow.
    - `values`: Further keys of the JSON.
    """

    name: str
    what: str
    whose: str
    composite: str
    needs_hdr: bool
    values: dict[str, Any] = dataclasses.field(default_factory=dict)


#: Settings that show an entry on a picture, in the place of those that the picture starts from;
#: None for an entry that a picture cannot show.
Shown = Callable[[Entry, Settings], Settings | None]


def listing_command(text: str, entries: Callable[[], Iterable[Entry]], shown: Shown) -> Any:
    """Return the command that lists entries, with the help `text`."""

    @click.command(help=text)
    @click.option("--json", "as_json", is_flag=True, help="Print a list of objects.")
    @click.option(
        "--sheet",
        "image",
        metavar="IMAGE",
        type=click.Path(),
        help="Render this picture with each of them, and write all to the file of --out. A "
        f"picture of more than {_LARGEST_SIDE} pixels is reduced before.",
    )
    @click.option("-o", "--out", metavar="FILE", type=click.Path(), help="The sheet: a PNG.")
    @layer_option
    @device_options
    def command(
        *,
        as_json: bool,
        image: str | None,
        out: str | None,
        layer: str | None,
        adapter: str,
        validation: bool,
    ) -> None:
        if (image is None) != (out is None):
            raise click.UsageError("--sheet IMAGE and --out FILE need each other")
        listed = list(entries())
        if image is not None and out is not None:
            check_drawing("--out", out, (".png",))
            sheet = _sheet(image, layer, listed, shown, (adapter, validation))
            safe_writing.write_file(Path(out), sheet)
            say(f"wrote {out}")
        elif as_json:
            objects = [
                {key: value for key, value in dataclasses.asdict(one).items() if key != "values"}
                | one.values
                for one in listed
            ]
            click.echo(json.dumps(objects, indent=2))
        else:
            show(_table(listed))

    return command


def _table(entries: Iterable[Entry]) -> Table:
    """Return a table of one line for each entry; a narrow terminal cuts the last two columns."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("name", "composite", "needs HDR"):
        table.add_column(title, no_wrap=True)
    # Columns that rich makes narrower, with texts that it does not wrap.
    table.add_column("what")
    table.add_column("whose")
    for one in entries:
        texts = (Text(text, no_wrap=True, overflow="ellipsis") for text in (one.what, one.whose))
        table.add_row(one.name, one.composite, "yes" if one.needs_hdr else "no", *texts)
    return table


def base_settings(is_photo: bool) -> Settings:
    """Return the settings that a picture starts from."""
    return vkbloom.presets[PRESET_OF_PHOTOS if is_photo else PRESET_OF_IMAGES]


def _sheet(
    file: str,
    layer: str | None,
    entries: list[Entry],
    shown: Shown,
    device: tuple[str, bool],
) -> bytes:
    """Return a PNG of a picture, then the picture with each entry."""
    is_photo = is_photograph(file)
    base = base_settings(is_photo)
    plain = _reduced(read_picture(file, 0, None, layer=layer).pixels)
    # As by vkbloom apply with the preset photo, and for what would show nothing otherwise.
    expanded = plain
    if is_photo:
        with_lights = read_picture(file, 0, None, layer=layer, expand=PHOTO_EXPANSION)
        expanded = _reduced(with_lights.pixels)
    height, width = plain.shape[:2]
    cell = pictures.scaled(width, height, _WIDTH / max(height, width))
    tiles = [(_tile(plain, cell), "without bloom", Path(file).name)]
    with opened_renderer(*device) as renderer:
        tell_device(renderer)

        def tile_of(image: NDArray[Any], settings: Settings) -> NDArray[Any]:
            return _tile(renderer.apply(image, settings, framebuffers=["final"])["final"], cell)

        def brighter(limit: float) -> NDArray[Any]:
            return _reduced(read_picture(file, 0, None, layer=layer, expand=limit).pixels)

        for one in tqdm(entries, unit="picture", leave=False, disable=hides_progress()):
            settings = shown(one, base)
            if settings is None:
                continue
            for_photos = settings.replace(glare=()) == base_settings(is_photo=True)
            image = expanded if one.needs_hdr or for_photos else plain
            words = f"{one.composite}{', needs HDR' * one.needs_hdr}"
            if is_photo and one.needs_hdr:
                words += f": --expand {PHOTO_EXPANSION:g}"
            tile = tile_of(image, settings)
            if settings.glare and not _is_seen(
                one, tile, tile_of(image, settings.replace(glare=()))
            ):
                tried = _with_more_light(one, settings, brighter if is_photo else None, tile_of)
                tile, words = tried or (tile, f"{one.composite}: shows nothing here")
                if tried is None:
                    note(f"{one.name} shows nothing on {file}{_above(one)}")
            tiles.append((tile, one.name, words))
    return pictures.sheet_png(tiles, _COLUMNS, cell)


def _with_more_light(
    entry: Entry,
    settings: Settings,
    brighter: Callable[[float], NDArray[Any]] | None,
    tile_of: Callable[[NDArray[Any], Settings], NDArray[Any]],
) -> tuple[NDArray[Any], str] | None:
    """Return the tile of a glare that needs brighter lights, and its line; None: none shows it.

    - `brighter`: Returns the picture with highlights that are expanded to a value.
    """
    for limit in _MORE_LIGHT if brighter is not None else ():
        assert brighter is not None
        image = brighter(limit)
        if entry.composite == "multiply":
            lit = settings
        else:
            # The bloom of brighter lights would cover the glare.
            lit = settings.replace(intensity=settings.intensity * PHOTO_EXPANSION / limit)
        tile = tile_of(image, lit)
        if _is_seen(entry, tile, tile_of(image, lit.replace(glare=()))):
            return tile, f"{entry.composite}: --expand {limit:g} --intensity {lit.intensity:.2g}"
    return None


def _is_seen(entry: Entry, tile: NDArray[Any], bare: NDArray[Any]) -> bool:
    """Whether an eye sees a glare; dirt only in a large part of the picture."""
    share = float((np.abs(tile.astype(int) - bare) > _SEEN).any(axis=2).mean())
    return share >= (_SEEN_DIRT if entry.composite == "multiply" else _SEEN_SHARE)


def _above(entry: Entry) -> str:
    """Return what the values must be above for a glare to show something, as words."""
    limits = [stage.get("threshold", 0) for stage in entry.values.get("glare", ())]
    return f": it takes values above {max(limits):g}" if any(limits) else ""


def _reduced(image: NDArray[Any]) -> NDArray[Any]:
    """Return the colours of an image, its longer side at most that of the sheet's renders."""
    return np.ascontiguousarray(pictures.reduced(image[:, :, :3], (_LARGEST_SIDE, _LARGEST_SIDE)))


def _tile(final: NDArray[Any], cell: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a picture in the size of a cell, with the colours of a file of integers."""
    return pictures.picture(final, "final", size=cell)
