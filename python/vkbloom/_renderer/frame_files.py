"""Write framebuffers to image files without loss: all files, or none if one fails."""

from __future__ import annotations

import contextlib
import errno
import glob
import itertools
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._extras import import_extra
from vkbloom._formats import IMAGE_DTYPES
from vkbloom._framebuffers import leading
from vkbloom._io import safe_writing
from vkbloom._io.hdr_curves import HDR_CURVES
from vkbloom._io.image_writing import Part, describe_as, put
from vkbloom._io.picture import PIXEL_TYPES, Picture, is_exr
from vkbloom._io.readers import check_name, check_plausible, complete, open_image
from vkbloom._renderer.frame_saves import (
    FACT,
    check_alone,
    choose_files,
    fact_of,
    is_of,
    obsolete_files,
    save_of,
)
from vkbloom._renderer.framebuffers import Framebuffers
from vkbloom._settings.settings import Settings
from vkbloom._version import installed_version

if TYPE_CHECKING:
    import OpenImageIO

# The text before the JSON in a description.
_DESCRIBED = ", all of it: "
# Extensions of files in a folder.
_IN_FOLDERS = (".png", ".exr")
# Entries of `info` that are numbers.
_NUMBERS: Mapping[str, type[int | float]] = {
    "nan": int,
    "inf": int,
    "expand": float,
    "time": float,
}
# Attributes that `_attributes` writes in addition to the entries of `info`.
_OWN = ("settings", "timings", "dtype", "framebuffer", "place", FACT)


def save(
    frames: Framebuffers, path: str | os.PathLike[str], *, to_path: str | None = None
) -> list[Path]:
    """Write framebuffers to image files, as `Frames.save` documents.

    `to_path`: the framebuffer of several that is written to the path itself, without its name.
    """
    if not frames:
        raise ValueError("frames: there is no framebuffer to save")
    oiio = import_extra("OpenImageIO", "images", "Frames.save")
    check_name(path)
    if os.fspath(path) == "":
        # An empty name is usually an unset shell variable, and must not mean the current folder.
        raise ValueError("path: '' is not the name of a file or a folder; use '.' for this folder")
    target = Path(path)
    plan: dict[Path, list[str]]
    if target.is_dir() or not target.suffix or os.fspath(path).endswith(("/", os.sep)):
        target.mkdir(parents=True, exist_ok=True)
        plan = {target / f"{name}.png": [name] for name in frames}
    else:
        safe_writing.writer_of(target)
        if is_exr(target) or len(frames) == 1:
            plan = {target: list(frames)}
        else:
            plan = {
                target
                if name == to_path
                else target.with_name(f"{target.stem}_{name}{target.suffix}"): [name]
                for name in frames
            }
    files: dict[Path, list[Part]] = {}
    saved = fact_of(frames, "" if target.is_dir() else target.suffix)
    for planned, names in plan.items():
        image = None if is_exr(planned) else _image_part(oiio, frames, names[0], planned, saved)
        file = planned if image or is_exr(planned) else planned.with_suffix(".exr")
        files[file] = [image] if image else [_exr_part(frames, name, file, saved) for name in names]
    sizes = {file: sum(part.values.nbytes for part in parts) for file, parts in files.items()}
    obsolete: list[Path] = []
    with safe_writing.replacing(oiio, sizes, obsolete) as temporaries:
        for temporary, (file, parts) in zip(temporaries, files.items(), strict=True):
            put(oiio, parts, temporary, file)
        obsolete += obsolete_files(target, files, _facts_of_all(_beside(target, files)))
    return list(files)


def _beside(target: Path, files: Iterable[Path]) -> list[Path]:
    """Return existing files that an earlier save to a path may have written."""
    if not target.is_dir():
        exact = [file for file in (target, target.with_suffix(".exr")) if file.is_file()]
        return [*exact, *_split_files_of(target)]
    replaced = _facts_of_all(_find_files(target, (file.stem for file in files)))
    saves = map(save_of, replaced.values())
    return [*replaced, *_find_files(target, (name for save in saves for name in save.framebuffers))]


def _find_files(folder: Path, names: Iterable[str]) -> list[Path]:
    """Return the files of framebuffers that exist in a folder."""
    files = (folder / f"{name}{suffix}" for name in dict.fromkeys(names) for suffix in _IN_FOLDERS)
    return [file for file in files if file.is_file()]


def _facts_of_all(files: Iterable[Path]) -> dict[Path, dict[str, str]]:
    """Return the facts of those files that can be read."""
    found: dict[Path, dict[str, str]] = {}
    for file in files:
        with contextlib.suppress(OSError, ValueError):
            found[file] = facts_of(file)
    return found


def load(path: str | os.PathLike[str]) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read framebuffers from files that `save` wrote, as `Frames.load` documents."""
    frames: dict[str, tuple[int, NDArray[Any], Path]] = {}
    facts: dict[str, Any] = {}
    target = Path(check_name(path))
    # In a folder, files without the attributes of `save` are ignored.
    is_one = target.is_file()
    if is_one:
        said, others = facts_of(target), _facts_of_all(_split_files_of(target))
        saves = {
            file: save_of(facts) for file, facts in others.items() if is_of(target, file, facts)
        }
        check_alone(target, said, saves)
        # The command `render` writes the picture to the path, and the others beside it.
        named = save_of(said)
        beside = [
            file for file, save in saves.items() if save == named and named.suffix is not None
        ]
        files = [target, *beside]
    else:
        listed = {file: facts_of(file) for file in _files_of(target)}
        files = choose_files(
            target, {f: said for f, said in listed.items() if is_of(target, f, said)}
        )
    for file in files:
        for pixels, said in _parts_of(file, None if is_one else target):
            try:
                facts = {
                    "settings": Settings.from_json(said["settings"]),
                    "timings": json.loads(said["timings"]),
                    "info": {
                        name: _NUMBERS[name](text) if name in _NUMBERS else text
                        for name, text in said.items()
                        if name not in _OWN
                    },
                }
                name, array = said["framebuffer"], _as_dtype(pixels, said["dtype"])
                if name in frames:
                    raise ValueError(
                        f"{name} is in {frames[name][2]} as well; remove the older one"
                    )
                frames[name] = int(said["place"]), array, file
            except KeyError as error:
                raise ValueError(f"{file}: not written by Frames.save: no {error}") from error
            except (TypeError, ValueError) as error:
                raise ValueError(f"{file}: {error}") from error
    if not frames:
        raise ValueError(f"{target}: not written by Frames.save: no file has its attributes")
    ordered = sorted(frames.items(), key=lambda item: item[1][0])
    return {name: array for name, (_, array, _) in ordered}, facts


def _parts_of(file: Path, target: Path | None) -> Iterator[tuple[NDArray[Any], dict[str, str]]]:
    """Yield the pixels of each part without the padding of its window, and its attributes."""
    with open_image(file, "Frames.load") as reader:
        for index in itertools.count():
            if not reader.seek_subimage(index, 0):
                return
            spec = reader.spec()
            said = _facts(spec)
            if target is not None and not is_of(target, file, said):
                continue
            check_plausible(spec, file)
            pixels = reader.read_image(index, 0, 0, spec.nchannels, spec.format)
            pixels = complete(pixels, reader, file)
            yield pixels.reshape(spec.height, spec.width, spec.nchannels), said


def facts_of(path: str | os.PathLike[str]) -> dict[str, str]:
    """Return what vkbloom wrote into an image file: "settings" and others, as text."""
    with open_image(path, "Reading settings") as reader:
        return _facts(reader.spec())


def settings_facts(
    settings: Settings, expand: float | None, frames: Framebuffers | None = None
) -> dict[str, str]:
    """Return what an image file holds of the settings that made it, for `facts_of`.

    - `frames`: The call's, whose stages in time the file holds as well.
    """
    facts = {
        "Software": f"vkbloom {installed_version()}",
        "vkbloom:settings": json.dumps(settings.to_dict()),
    }
    if frames is not None:
        facts |= {f"vkbloom:{name}": text for name, text in frames._stages().items()}
    return facts if expand is None else {**facts, "vkbloom:expand": f"{expand:g}"}


def _facts(spec: OpenImageIO.ImageSpec) -> dict[str, str]:
    return {
        attribute.name.removeprefix("vkbloom:"): str(attribute.value)
        for attribute in spec.extra_attribs
        if attribute.name.startswith("vkbloom:")
    } or _describe(spec.get_string_attribute("ImageDescription"))


def _describe(text: str) -> dict[str, str]:
    """Return the attributes from a description, for formats without other attributes (TIFF)."""
    with contextlib.suppress(ValueError, AttributeError):
        return {
            str(name): str(value)
            for name, value in json.loads(text.partition(_DESCRIBED)[2]).items()
        }
    return {}


def _files_of(path: Path) -> list[Path]:
    """Return the files that `save` may have written for a path."""
    if path.is_dir():
        files = sorted(
            file
            for file in path.iterdir()
            if file.suffix in _IN_FOLDERS
            and file.is_file()
            # Of a process that was killed.
            and not safe_writing.is_temporary(file)
        )
    else:
        files = [path.with_suffix(".exr")] if path.with_suffix(".exr").exists() else []
        files += _split_files_of(path)
    if not files:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    return files


def _split_files_of(path: Path) -> list[Path]:
    """Return the files named ``<stem>_<name>`` that `save` may have written for a file name."""
    before = len(path.stem) + 1
    return [
        file
        for suffix in dict.fromkeys((path.suffix, ".exr"))
        for file in sorted(path.parent.glob(f"{glob.escape(path.stem)}_*{suffix}"))
        if file.stem[before:].isidentifier() and file.is_file()
    ]


def _as_dtype(pixels: NDArray[Any], dtype: str) -> NDArray[Any]:
    """Return pixels in their original dtype, depth without a channel."""
    if dtype not in IMAGE_DTYPES:
        raise ValueError(f"{dtype!r} is no dtype of a framebuffer")
    if dtype == "uint8" and pixels.dtype != np.uint8:
        pixels = np.rint(pixels.astype(np.float32) * 255)
    made = pixels.astype(dtype, copy=False)
    return made[:, :, 0] if made.shape[2] == 1 else made


def _image_part(
    oiio: ModuleType, frames: Framebuffers, name: str, file: Path, saved: str
) -> Part | None:
    """Return a framebuffer for a file of any format; None if the format cannot hold it."""
    pixels = np.atleast_3d(frames[name])
    writer = oiio.ImageOutput.create(f"image{file.suffix}")
    if pixels.shape[2] == 4 and not safe_writing.has_alpha(writer):
        opaque = 255 if pixels.dtype == np.uint8 else 1.0
        if not (pixels[:, :, 3] == opaque).all():
            return None
        pixels = pixels[:, :, :3]
    numbers = PIXEL_TYPES[pixels.dtype.name]
    if not safe_writing.holds(file.suffix, pixels.shape[2], numbers):
        return None
    picture = Picture.of_values(pixels, numbers)
    encoding = frames.settings.encoding
    if name == "final" and encoding in HDR_CURVES and writer.supports("cicp"):
        picture = describe_as(oiio, picture, file, ("rec709", encoding))
    return Part(pixels, picture, _attributes(frames, name, file, saved))


def _exr_part(frames: Framebuffers, name: str, file: Path, saved: str) -> Part:
    """Return a framebuffer for a part of an OpenEXR file, in the display window of the frame."""
    pixels = np.atleast_3d(frames[name])
    if pixels.dtype == np.uint8:
        pixels = (pixels / np.float32(255)).astype(np.float16)
    height, width = frames[leading(frames)].shape[:2]
    picture = Picture.of_values(pixels, PIXEL_TYPES[pixels.dtype.name])
    header = replace(picture.header, display=(0, 0, width, height))
    if pixels.shape[2] == 1:
        header = replace(header, channels=("Z",))
    # The name of the OpenEXR part.
    attributes = {**_attributes(frames, name, file, saved), "oiio:subimagename": name}
    return Part(pixels, replace(picture, header=header), attributes)


def _attributes(frames: Framebuffers, name: str, file: Path, saved: str) -> dict[str, str | int]:
    """Return what a file says of a framebuffer; `saved`: of `fact_of`."""
    settings = json.dumps(frames.settings.to_dict())
    adapter = frames.info.get("adapter", "an unnamed adapter")
    facts = {
        **{key: str(value) for key, value in frames.info.items()},
        **frames._stages(),
        "settings": settings,
        "timings": json.dumps(dict(frames.timings)),
        "dtype": str(frames[name].dtype),
        "framebuffer": name,
        FACT: saved,
        "place": str(list(frames).index(name)),
    }
    description = f"vkbloom on {adapter}, settings {settings}"
    # TIFF and JPEG cannot store attributes with other names.
    if file.suffix.lower() in (".tif", ".tiff", ".jpg", ".jpeg"):
        description += _DESCRIBED + json.dumps(facts)
    return {
        "Software": f"vkbloom {frames.info.get('version', '')}".rstrip(),
        **{f"vkbloom:{key}": value for key, value in facts.items()},
        "ImageDescription": description,
    }
