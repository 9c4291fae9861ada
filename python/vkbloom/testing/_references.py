"""References of a test module: lossless images, and the adapter that made them.

A folder contains, for each name, ``<name>.json`` and the images that it lists:
``<name>.<framebuffer>.png`` for integers, and ``.exr`` for half and float.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._io import array_files, image_file, safe_writing

__tracebackhide__ = True

#: Allowed names of references and framebuffers: safe as file names on every system.
NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_+,=.-]{0,99}")
_FRAMEBUFFER: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,99}")
_FILE: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_+,=.-]*")
_FORMAT: Final = 2

# Extension by the array's dtype.
_FILES: Final = {"uint8": ".png", "uint16": ".png", "float16": ".exr", "float32": ".exr"}


@dataclass(frozen=True, kw_only=True)
class Origin:
    """The adapter, machine and version that made images.

    - `adapter`, `driver`: None if they are not known.
    - `version`: Version of vkbloom.
    """

    adapter: str | None
    driver: str | None
    version: str

    @property
    def summary(self) -> str:
        """All fields except the version on one line."""
        made_by = [text for text in (self.adapter, self.driver) if text]
        return ", ".join(made_by) or "arrays without an adapter"


@dataclass(frozen=True, eq=False, kw_only=True)
class StoredReference:
    """Images, of a reference or of a check, and their origin.

    `images`: Images by framebuffer, in the order of the data flow.
    """

    images: Mapping[str, NDArray[Any]]
    origin: Origin


class ReferenceFolder:
    """The references of one test module.

    `path`: It is created when the first reference is written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def file(self, name: str) -> Path:
        """Return the file that lists the images of a name."""
        return self.path / f"{name}.json"

    def load(self, name: str) -> StoredReference | None:
        """Read the reference of a name; None if there is none."""
        listed, file = self._read_list(name), self.file(name)
        if listed is None:
            return None
        images = {entry["name"]: self._image(entry, file) for entry in listed["framebuffers"]}
        return StoredReference(images=images, origin=Origin(**listed["origin"]))

    def write(self, name: str, images: Mapping[str, NDArray[Any]], origin: Origin) -> None:
        """Write a reference, and remove files of the one before."""
        check_name(name)
        for framebuffer, image in images.items():
            _check_image(framebuffer, image)
        before = (self._read_list(name) or {"framebuffers": []})["framebuffers"]
        self.path.mkdir(parents=True, exist_ok=True)
        entries = [
            self._write_image(name, framebuffer, image) for framebuffer, image in images.items()
        ]
        content = {"format": _FORMAT, "origin": asdict(origin), "framebuffers": entries}
        safe_writing.write_file(self.file(name), f"{json.dumps(content, indent=2)}\n".encode())
        for file in {entry["file"] for entry in before} - {entry["file"] for entry in entries}:
            (self.path / file).unlink(missing_ok=True)

    def _read_list(self, name: str) -> dict[str, Any] | None:
        file = self.file(name)
        try:
            stored = file.read_bytes()
        except FileNotFoundError:
            return None
        try:
            content: dict[str, Any] = json.loads(stored.decode())
            if content["format"] != _FORMAT:
                raise ValueError(f"format {content['format']!r} is not {_FORMAT}")
            Origin(**content["origin"])
            for entry in content["framebuffers"]:
                tuple(entry["shape"])
                np.dtype(entry["dtype"])
                if not _FRAMEBUFFER.fullmatch(entry["name"]):
                    raise ValueError(f"{entry['name']!r} cannot name a framebuffer")
                if not _FILE.fullmatch(entry["file"]):
                    raise ValueError(f"{entry['file']!r} is not in this folder")
        except KeyError as error:
            raise ValueError(f"{file}: not a list of references: no {error}") from error
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
            raise ValueError(f"{file}: not a list of references: {error}") from error
        return content

    def _image(self, entry: Mapping[str, Any], listed_in: Path) -> NDArray[Any]:
        file = self.path / entry["file"]
        pixels = image_file.read_stored(file).pixels
        shape = tuple(entry["shape"])
        if pixels.dtype != np.dtype(entry["dtype"]) or pixels.shape != _with_channels(shape):
            raise ValueError(
                f"{file}: holds {pixels.dtype} of shape {pixels.shape}, not "
                f"{entry['dtype']} of shape {shape}, as {listed_in.name} says"
            )
        return pixels.reshape(shape)

    def _write_image(self, name: str, framebuffer: str, image: NDArray[Any]) -> dict[str, Any]:
        suffix = _FILES[image.dtype.name]
        file = self.path / f"{name}.{framebuffer}{suffix}"
        # What each type of file has, so that no value changes.
        array_files.write(file, image, premultiplied=suffix == ".exr")
        entry = {
            "name": framebuffer,
            "file": file.name,
            "dtype": image.dtype.name,
            "shape": list(image.shape),
        }
        written = self._image(entry, self.file(name))
        if not np.array_equal(written, image, equal_nan=image.dtype.kind == "f"):
            raise OSError(f"{file}: the values read back differ from the values written")
        return entry


def check_name(name: str) -> None:
    """Raise TypeError or ValueError if the name is not allowed for a reference."""
    if not isinstance(name, str):
        raise TypeError(f"name: {name!r} is not a str")
    if not NAME.fullmatch(name):
        raise ValueError(
            f"name: {name!r} cannot name a reference; up to 100 letters, digits and _+,=.- are "
            "needed, the first a letter, a digit or _"
        )


def _check_image(framebuffer: str, image: NDArray[Any]) -> None:
    if not _FRAMEBUFFER.fullmatch(framebuffer):
        raise ValueError(
            f"{framebuffer!r} cannot name a framebuffer; up to 100 letters, digits, _ and - are "
            "needed, the first a letter or _"
        )
    if image.dtype.name not in _FILES:
        raise ValueError(
            f"{framebuffer}: {image.dtype} cannot be stored without loss; use {', '.join(_FILES)}"
        )
    if image.ndim not in (2, 3) or image.size == 0 or _with_channels(image.shape)[2] > 4:
        raise ValueError(
            f"{framebuffer}: shape {image.shape} is not (H, W) or (H, W, C) of up to 4 channels"
        )


def _with_channels(shape: tuple[int, ...]) -> tuple[int, ...]:
    return (*shape, 1) if len(shape) == 2 else shape
