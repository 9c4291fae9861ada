"""Damaged Zarr stores of a grid, which are checked and continued.

An input has a byte of flags and then records: the number of a key, the operation, the length of
the data (two bytes), and the data. The records change a valid store, and the call that wrote it is
repeated. Only the device is replaced: points are filled with numbers.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import json
import random
import shutil
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import google_crc32c
import numpy as np
from numcodecs.zstd import Zstd

import vkbloom
from vkbloom import check_grid, presets
from vkbloom._cli.grid import prepare
from vkbloom._grid import grid as zarr_grid
from vkbloom._grid import keys, store
from vkbloom._grid.filling import Tally
from vkbloom._grid.identity import identity
from vkbloom._grid.layout import Grid, Layout, Variable, ask
from vkbloom._grid.running import empty_arrays
from vkbloom._grid.store import GridStore

SETTINGS = presets["bevy_natural"]
AXES = {"exposure": [0.0, 1.0, 2.0], "threshold": [None, 0.5]}
CHUNKS = {"exposure": 2}
IMAGE = np.linspace(0, 1, 60, dtype=np.float32).reshape(4, 5, 3)
CHANNELS = np.array(["r", "g", "b", "a"])

#: That no grid has.
FOREIGN = ("letter.txt", "other/zarr.json", "final/c.9.9.9.9.9", "final/c.0.partial")
ROOT = "zarr.json"
EXPECTED_KEYS = store.expected_keys
KINDS = 8
#: What stands in for any value of metadata, as JSON; the last is for leaving it out.
VALUES = (
    *("null", "true", "0", "1", "3.0", "-1", "2", "1e308", "NaN", "1000000000", "1e30"),
    *("1099511627776", "1000000000000000000000000000000", "[1000000000, 1000000000]"),
    *('""', '"x"', '"../.."', '"float64"', '"string"', "[]", "[[]]", "[1]", "[1, 1]"),
    *("{}", '{"a": {}}', '{"name": "x"}', "[" * 600 + "]" * 600),
    "",
)
#: The flags.
VERIFY, CHUNKED, LOOK = 1, 2, 4


def _laid_out(grid: Grid) -> Layout:
    final = Variable(("y", "x", "rgba"), (4, 5, 4), np.dtype(np.float32), {"long_name": "final"})
    mean = Variable((), (), np.dtype(np.float64), {"units": "1"})
    return Layout(
        ranking=(0, 1),
        variables={"final": final, "mean": mean},
        coordinates={"rgba": (CHANNELS, {"long_name": "channel"})},
        ran=0,
        adapter="none",
        driver="none",
        version="0",
    )


def _rendered(
    grid: Grid, prepared: Callable[[Layout], GridStore], *_: object, **__: object
) -> Tally:
    """Replace `vkbloom._grid.rendering.render_grid`, without a device."""
    layout = _laid_out(grid)
    kept = prepared(layout)
    for block in list(kept.missing()):
        arrays = empty_arrays(layout, block)
        for name, array in arrays.items():
            array[...] = _value(name, kept.grid.shape)[block.slices]
        kept.writer.write(block, arrays)
        kept.writer.flush([block])
        kept.mark([block])
    return Tally()


def _value(name: str, shape: tuple[int, ...]) -> np.ndarray[Any, np.dtype[np.float64]]:
    trailing = (4, 5, 4) if name == "final" else ()
    count = int(np.prod(shape + trailing))
    return np.arange(count, dtype=np.float64).reshape(shape + trailing)


def _made(path: Path, **arguments: Any) -> Any:
    with mock.patch.object(zarr_grid, "render_grid", _rendered):
        return vkbloom.grid(IMAGE, SETTINGS, AXES, store=path, **arguments)


def _contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


async def _at_once(function: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
    return function(*arguments, **named)


@functools.cache
def _expected(chunk: tuple[int, ...]) -> dict[str, bytes]:
    grid = _asked()
    return EXPECTED_KEYS(grid, _laid_out(grid), chunk)


def _asked() -> Grid:
    return ask(
        IMAGE,
        SETTINGS,
        AXES,
        size=None,
        shading="forward",
        time=0.0,
        framebuffers="final",
        reduce=None,
    )


@contextlib.contextmanager
def _quick() -> Iterator[None]:
    """Turn off what only costs time: threads, waits for the disk, checks of known data."""
    with (
        mock.patch.object(asyncio, "to_thread", _at_once),
        mock.patch.object(keys, "_flush"),
        mock.patch.object(store, "expected_keys", lambda _, __, chunk: dict(_expected(chunk))),
    ):
        yield


class Stores:
    """A valid store, and tests of changed copies.

    Parameters
    ----------
    folder : Path
        The folder of the stores.
    """

    def __init__(self, folder: Path) -> None:
        self._changed = folder / "changed.zarr"
        complete = folder / "complete.zarr"
        _made(complete, chunks=CHUNKS)
        self._complete = _contents(complete)
        self._keys = [*self._complete, *FOREIGN]

    def seeds(self) -> list[bytes]:
        """Return inputs with one change each."""
        found = [bytes([flags]) for flags in range(5)]
        for number, key in enumerate(self._keys):
            content = self._complete.get(key, b"{}")
            if "/c." in key:
                # With a correct checksum, they are changed but not damaged.
                found.append(b"\1" + _record(number, 1, content[:-4]))
            else:
                found.append(b"\1" + _record(number, 0, content))
        for key in (ROOT, "done/c.0.0", "final/zarr.json", "final/c.0.0.0.0.0"):
            number = self._keys.index(key)
            found += [b"\1" + _record(number, kind, b"") for kind in (0, 2, 3)]
        wanted = ["attributes", "vkbloom_grid", "chunk", "grid", "axes", "variables"]
        for place, (inner, key) in enumerate(_places(json.loads(self._complete[ROOT]))):
            if key in wanted:
                wanted.remove(key)
                text = struct.pack("<H", place) + json.dumps(inner[key]).encode()
                found.append(b"\1" + _record(self._keys.index(ROOT), 4, text))
        # Chunks of another size with a correct checksum.
        zeros = Zstd(level=1).encode(bytes(1 << 22))
        for key in ("done/c.0.0", "mean/c.0.0", "final/c.0.0.0.0.0"):
            number = self._keys.index(key)
            found.append(b"\1" + _record(number, 1, zeros))
            found.append(b"\1" + _record(number, 7, bytes([0])))
            if not key.startswith("done"):
                # Marks are not compressed.
                found.append(b"\1" + _record(number, 6, self._decoded(key)))
        dice = random.Random(1)
        for name in (ROOT, "done/zarr.json", "final/zarr.json", "exposure/zarr.json"):
            for _ in range(4):
                found.append(b"\1" + _record(self._keys.index(name), 5, dice.randbytes(3)))
        return [*found, *(bytes([LOOK]) + one[1:] for one in found[5:])]

    def _decoded(self, key: str) -> bytes:
        return bytes(Zstd().decode(self._complete[key][:-4]))

    def run(self, data: bytes) -> None:
        """Check a changed store, or continue it."""
        self._change(data[1:])
        is_forged = any(kind % KINDS == 1 for _, kind, _ in _records(data[1:]))
        try:
            with _quick():
                self._gone_on((data[:1] or b"\0")[0])
        except MemoryError:
            # A chunk with a correct checksum is decompressed to the size that it declares.
            if not is_forged:
                raise

    def _gone_on(self, flags: int) -> None:
        path = self._changed
        before = _contents(path)
        try:
            if flags & LOOK:
                check_grid(path)
            else:
                chunks = CHUNKS if flags & CHUNKED else None
                _made(path, verify=bool(flags & VERIFY), chunks=chunks)
        except ValueError:
            assert _contents(path) == before, "a refused store was changed"
            return
        if flags & LOOK:
            assert _contents(path) == before, "looking through a store changed it"
        elif flags & VERIFY:
            report = check_grid(path)
            assert report.complete, str(report)
            assert report.points == 6, str(report)

    def _change(self, data: bytes) -> None:
        """Write the valid store with the changes of the records."""
        contents: dict[str, bytes | None] = dict(self._complete)
        for number, kind, payload in _records(data):
            key = self._keys[number % len(self._keys)]
            match kind % KINDS:
                case 0:
                    contents[key] = payload
                case 1:
                    contents[key] = _summed(payload)
                case 2:
                    contents.pop(key, None)
                case 3:
                    # The key is a folder.
                    contents[key] = None
                case 4:
                    contents[key] = _with_other_text(contents.get(key) or b"{}", payload)
                case 5:
                    contents[key] = _with_other_values(contents.get(key) or b"{}", payload)
                case 6:
                    contents[key] = _summed(bytes(Zstd(level=1).encode(payload or b"\0")))
                case _:
                    source = self._keys[(payload or b"\0")[0] % len(self._keys)]
                    contents[key] = self._complete.get(source, b"")
        shutil.rmtree(self._changed, ignore_errors=True)
        self._changed.mkdir()
        for key, content in contents.items():
            path = self._changed / key
            if content is None:
                path.mkdir(parents=True, exist_ok=True)
            else:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the lists and dicts within a value, with each of their indices or keys."""
    pending = [(value, 0)]
    for inner, depth in pending:
        if isinstance(inner, dict | list) and depth < 20:
            for key, part in inner.items() if isinstance(inner, dict) else enumerate(inner):
                yield inner, key
                pending.append((part, depth + 1))


def _read(metadata: bytes) -> Any:
    try:
        return json.loads(metadata)
    except (ValueError, RecursionError):
        return {}


def _written(value: Any) -> bytes:
    try:
        return json.dumps(value).encode()
    except RecursionError:
        # Deeper nested lists than any reader accepts.
        return b"[" * 5000


def _with_other_values(metadata: bytes, payload: bytes) -> bytes:
    """Return metadata with replaced values: two bytes select a place, one an item of `VALUES`."""
    found = _read(metadata)
    for place, value in struct.iter_unpack("<HB", payload[: min(len(payload) // 3, 8) * 3]):
        places = list(_places(found))
        if places:
            inner, key = places[place % len(places)]
            text = VALUES[value % len(VALUES)]
            if text:
                inner[key] = json.loads(text)
            else:
                del inner[key]
    return _written(found)


def _with_other_text(metadata: bytes, payload: bytes) -> bytes:
    """Return metadata with other text in one place, which the first two bytes select."""
    found = _read(metadata)
    places = list(_places(found))
    if not places:
        return payload
    inner, key = places[int.from_bytes(payload[:2], "little") % len(places)]
    inner[key] = "@"
    return _written(found).replace(b'"@"', payload[2:])


def _record(number: int, kind: int, payload: bytes) -> bytes:
    return struct.pack("<BBH", number, kind, len(payload)) + payload


def _records(data: bytes) -> Iterator[tuple[int, int, bytes]]:
    while len(data) >= 4:
        number, kind, length = struct.unpack_from("<BBH", data)
        yield number, kind, data[4 : 4 + length]
        data = data[4 + length :]


def _summed(content: bytes) -> bytes:
    return content + struct.pack("<I", google_crc32c.value(content))


class Folders:
    """A grid's folder of image files with another ``grid.json``.

    Parameters
    ----------
    folder : Path
        The parent folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder / "images"
        grid = _asked()
        self._identity = {**identity(grid, _laid_out(grid), ()), "suffix": ".png"}
        prepare(self._folder, self._identity, resume=False)
        self._index = self._folder / "grid.json"

    def seeds(self) -> list[bytes]:
        """Return the content of the file."""
        return [self._index.read_bytes()]

    def run(self, data: bytes) -> None:
        """Continue the folder."""
        self._index.write_bytes(data)
        try:
            prepare(self._folder, self._identity, resume=True)
        finally:
            assert self._index.read_bytes() == data, "what was there was changed"
