"""The identity of a save: which files hold framebuffers of the same `Frames`.

Each file says its save's identity, which follows from the contents, and all of its framebuffers.
Files get their names one after the other, in the order of the framebuffers. So files of two saves,
and those of a save that was killed meanwhile, are known.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from vkbloom._renderer.framebuffers import Framebuffers

#: The fact of a file that `fact_of` makes.
FACT: Final = "save"
# What differs between files of one save.
_OF_A_FILE: Final = (FACT, "dtype", "framebuffer", "place")
_MAX_NAMES: Final = 5


class Save(NamedTuple):
    """The save that wrote a file.

    - `identity`: Equal for all its files.
    - `suffix`: Of the path that was saved to, "" for a folder; None: not known, as in files of
      versions without identities.
    - `framebuffers`: All of them, in the order in which their files are written; () if not known.
    """

    identity: str
    suffix: str | None
    framebuffers: tuple[str, ...]


def fact_of(frames: Framebuffers, suffix: str) -> str:
    """Return the identity of a save of frames, as text for their files."""
    digest = hashlib.blake2b(digest_size=16)
    facts = [frames.settings.to_dict(), dict(frames.timings), {**frames.info}]
    digest.update(json.dumps(facts, default=str).encode())
    for name, array in frames.items():
        digest.update(f"{name} {array.dtype} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).data)
    return json.dumps(
        {"identity": digest.hexdigest(), "suffix": suffix, "framebuffers": list(frames)}
    )


def save_of(said: Mapping[str, str]) -> Save:
    """Return the save of a file from its facts."""
    with contextlib.suppress(KeyError, TypeError, ValueError, RecursionError):
        held = json.loads(said[FACT])
        return Save(str(held["identity"]), str(held["suffix"]), tuple(held["framebuffers"]))
    shared = {name: text for name, text in said.items() if name not in _OF_A_FILE}
    return Save(json.dumps(shared, sort_keys=True), None, ())


def is_of(target: Path, file: Path, said: Mapping[str, str]) -> bool:
    """Return whether a save to a path may have written a framebuffer to this file."""
    if "framebuffer" not in said:
        return False
    name = said["framebuffer"]
    return file.stem == (name if target.is_dir() else f"{target.stem}_{name}") or (
        file.stem == target.stem
    )


def choose_files(target: Path, facts: Mapping[Path, Mapping[str, str]]) -> list[Path]:
    """Return the files of the one save to a path; `facts`: of all that may be of it.

    Raises
    ------
    ValueError
        If they are of several saves, or of one that was killed.
    """
    saves = {file: save_of(said) for file, said in facts.items()}
    suffix = "" if target.is_dir() else target.suffix
    # A folder may have files that were saved under their matching names.
    matching = [file for file, save in saves.items() if save.suffix in (None, suffix)] or [*saves]
    if len({saves[file].identity for file in matching}) > 1:
        raise ValueError(_mixture(target, {file: saves[file] for file in matching}))
    # The last file to be written. (Users may have removed others.)
    last = [saves[file].framebuffers[-1] for file in matching[:1] if saves[file].suffix == suffix]
    if last and last[0] not in {facts[file]["framebuffer"] for file in matching}:
        raise ValueError(
            f"{target}: the file of {last[0]} is missing, which a save writes last; it may have "
            f"been interrupted: save again, or load {_list_files(matching)} by name"
        )
    return matching


def check_alone(target: Path, said: Mapping[str, str], others: Mapping[Path, Save]) -> None:
    """Raise ValueError for a file beside files of another save to the same path."""
    save = save_of(said)
    mixed = {
        file: other
        for file, other in others.items()
        if other.suffix == target.suffix and len(other.framebuffers) > 1
    }
    if mixed and save.suffix in (None, target.suffix) and len(save.framebuffers) < 2:
        raise ValueError(_mixture(target, {target: save, **mixed}))


def _mixture(target: Path, saves: Mapping[Path, Save]) -> str:
    """Return a message that names the files of each save, the newest save first."""
    groups: dict[str, list[Path]] = {}
    for file in sorted(saves, key=lambda file: file.stat().st_mtime_ns, reverse=True):
        groups.setdefault(saves[file].identity, []).append(file)
    newest, *older = (_list_files(files) for files in groups.values())
    return (
        f"{target}: holds files of {len(groups)} saves; the newest: {newest}; older: "
        f"{'; '.join(older)}; remove those of all saves but one"
    )


def _list_files(files: Iterable[Path]) -> str:
    names = sorted(file.name for file in files)
    return ", ".join([*names[:_MAX_NAMES], *["..."] * (len(names) > _MAX_NAMES)])


def obsolete_files(
    target: Path, written: Iterable[Path], facts: Mapping[Path, Mapping[str, str]]
) -> Iterator[Path]:
    """Yield files of earlier saves to a path, which a save that writes `written` replaces.

    Of a folder these are only saves that have a framebuffer of the same name.
    """
    new = {os.path.realpath(file): file.stem for file in written}
    suffix = "" if target.is_dir() else target.suffix
    saves = {
        file: save_of(said)
        for file, said in facts.items()
        if FACT in said and is_of(target, file, said)
    }
    saves = {file: save for file, save in saves.items() if save.suffix == suffix}
    replaced = {save.identity for file, save in saves.items() if file.stem in new.values()}
    for file, save in saves.items():
        is_replaced = not target.is_dir() or save.identity in replaced
        if is_replaced and os.path.realpath(file) not in new:
            yield file
