"""Write a sheet of photographs with each look, and how much of each it changes.

python -m tools.look_sheet OUT PHOTO ... [--looks mist,star4] [--amount 1]

Below each picture stand the share of pixels that an eye sees changed, and the shares that became
white and that were cut off. A look that is invisible, clips or flattens skies is named at the end,
with the exit status 1.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from click.testing import CliRunner
from numpy.typing import NDArray

import vkbloom
from vkbloom._cli.program import program
from vkbloom._presets.named_settings import PRESETS
from vkbloom._views import pictures

#: Of the presets, those that are made for photographs; photo is the default.
LOOKS: Final = [name for name, one in PRESETS.items() if one.engine == "vkbloom"]
#: Looks that are seen where small lights are, and nowhere else.
WITH_RAYS: Final = ("star4", "star6", "anamorphic")
#: Looks that lights get: a photograph without any stays as it is, or nearly so.
OF_LIGHTS: Final = ("photo", "film_halation", *WITH_RAYS)
#: With this share of bright pixels, a photograph has lights. Small ones are enough for stars.
MIN_LIGHTS: Final = 0.001
MAX_WHITE: Final = 0.02
#: With more, a sky or a flower gets an outline where it is cut off.
MAX_CUT: Final = 0.03
#: A window of stained glass that keeps this much still shows its glass, in a strong glow.
MIN_CONTRAST: Final = 0.35
_BRIGHT: Final = 200
_LIT: Final = 240
_BLOCK: Final = 8
#: Of a picture with lights, narrow rays and the glow of small lights change less.
MIN_SEEN: Final = 0.05
MIN_SEEN_AT_LIGHTS: Final = 0.005
CELL: Final = (240, 160)
Pixels = NDArray[Any]


class Change(NamedTuple):
    """What a look does to an 8-bit picture, in shares of its pixels.

    - `seen`: A component differs by more than 4 levels, which an eye finds beside the picture.
    - `white`: All components have become 250 or more, less those that were.
    - `cut`: The largest component has become 255 of one below 250: what was there is lost.
    - `contrast`: What is kept of the local contrast of bright areas, such as skies: of the mean
      deviation of the largest components in blocks of 8 x 8 that were all above 200. 1 for pictures
      with less than 1 % of such blocks.
    - `lights`: The largest component was 240 or more.
    """

    seen: float
    white: float
    cut: float
    contrast: float
    lights: float

    @property
    def words(self) -> str:
        """The first in percent, and the others where they are not as before."""
        white = f", white {self.white:.1%}" if self.white >= 0.0005 else ""
        cut = f", cut {self.cut:.1%}" if self.cut >= 0.0005 else ""
        sky = f", sky {self.contrast:.0%}" if self.contrast < 0.95 else ""
        return f"{self.seen:.0%}{white}{cut}{sky}"

    def fault(self, look: str) -> str:
        """Return what is wrong with a look; "" if nothing is."""
        if self.white > MAX_WHITE:
            return "clips to white"
        if self.cut > MAX_CUT:
            return "cuts off highlights"
        if self.contrast < MIN_CONTRAST:
            return "flattens skies"
        if look in OF_LIGHTS and self.lights < MIN_LIGHTS:
            return ""
        is_narrow = look in ("photo", *WITH_RAYS)
        return "invisible" if self.seen < (MIN_SEEN_AT_LIGHTS if is_narrow else MIN_SEEN) else ""


def measure(before: Pixels, after: Pixels) -> Change:
    """Return what has changed between two 8-bit pictures (H, W, 3)."""
    difference = np.abs(after.astype(int) - before.astype(int)).max(axis=2)
    white = (after.min(axis=2) >= 250).mean() - (before.min(axis=2) >= 250).mean()
    peaks = before.max(axis=2), after.max(axis=2)
    cut = (peaks[0] < 250) & (peaks[1] == 255)
    blocks = [_blocks(one) for one in peaks]
    is_bright = blocks[0].min(axis=1) > _BRIGHT
    contrasts = [one[is_bright].std(axis=1).sum() for one in blocks]
    has_sky = is_bright.mean() > 0.01 and contrasts[0] > 0
    kept = contrasts[1] / contrasts[0] if has_sky else 1.0
    lights = (peaks[0] >= _LIT).mean()
    return Change(*map(float, ((difference > 4).mean(), white, cut.mean(), kept, lights)))


def _blocks(levels: Pixels) -> Pixels:
    """Return the complete blocks of (H, W) levels, each as a row."""
    rows, columns = (side // _BLOCK for side in levels.shape)
    whole = levels[: rows * _BLOCK, : columns * _BLOCK].reshape(rows, _BLOCK, columns, _BLOCK)
    return whole.swapaxes(1, 2).reshape(-1, _BLOCK * _BLOCK)


def levels_of(path: Path) -> Pixels:
    """Return an image file as 8-bit levels in sRGB, (H, W, 3)."""
    return pictures.picture(vkbloom.read(path)[..., :3])


def tile_of(levels: Pixels) -> Pixels:
    """Return a picture reduced to a cell, in its middle."""
    small = pictures.reduce(levels, CELL)
    tile = np.full((CELL[1], CELL[0], 3), 34, np.uint8)
    top, left = (CELL[1] - small.shape[0]) // 2, (CELL[0] - small.shape[1]) // 2
    tile[top : top + small.shape[0], left : left + small.shape[1]] = small
    return tile


def apply_look(files: Sequence[Path], look: str, folder: Path, amount: float = 1) -> list[Path]:
    """Add a look to photographs, as the command does, and return the files."""
    words = ["apply", *map(str, files), "-o", f"{folder}/", "--preset", look, "-q", "--overwrite"]
    words += ["--adapter", "software", "--amount", str(amount)]
    done = CliRunner().invoke(program, words)
    if done.exit_code:
        raise RuntimeError(f"{look}: {done.output}")
    return [folder / file.name for file in files]


def main() -> None:
    """Write the sheet, and print what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("photographs", nargs="+", type=Path)
    parser.add_argument("--looks", default=",".join(LOOKS))
    parser.add_argument("--amount", type=float, default=1)
    arguments = parser.parse_args()
    files, looks = arguments.photographs, arguments.looks.split(",")
    before = [levels_of(file) for file in files]
    rows = [[(tile_of(levels), file.stem)] for file, levels in zip(files, before, strict=True)]
    faults = []
    for look in looks:
        with tempfile.TemporaryDirectory() as folder:
            made = apply_look(files, look, Path(folder), arguments.amount)
            for file, levels, row, name in zip(made, before, rows, files, strict=True):
                after = levels_of(file)
                change = measure(levels, after)
                row.append((tile_of(after), f"{look}: {change.words}"))
                if fault := change.fault(look):
                    faults.append(f"{name}: {look}: {fault}")
    from tools.picture_sheet import write_sheet

    write_sheet(arguments.out, [tile for row in rows for tile in row], 1 + len(looks))
    print("\n".join((*faults, str(arguments.out))))
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
