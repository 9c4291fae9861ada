"""The parts of blocks and buffers: their paths, and the places of their numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from vkbloom._custom.described.module import ModuleFault, Type

#: Of arrays: entries that have names.
MAX_PATHS: Final = 1024


def path_of(key: str, names: set[str]) -> str:
    """Return the path that a key means: itself, or the only one that ends with it; "" for none."""
    if key in names:
        return key
    found = [name for name in names if name.endswith(f".{key}")]
    return found[0] if len(found) == 1 else ""


def is_within(path: str, outer: str) -> bool:
    """Whether a path is another one, or a part of it."""
    return outer in ("", path) or path.startswith((f"{outer}.", f"{outer}["))


def paths(
    kind: Type, path: str = "", offset: int = 0, most: int = MAX_PATHS
) -> Iterator[tuple[str, Type, int]]:
    """Return all parts of a type that a description can name, with their offsets.

    `most`: Those of arrays together; the entries of longer ones have no names.
    """
    yield path, kind, offset
    if kind.kind == "struct":
        for index, member in enumerate(kind.members):
            inner = _inner(path, member.name, index)
            yield from paths(member.type, inner, offset + member.offset, most)
    elif kind.kind == "array" and 0 < kind.count <= most:
        assert kind.of is not None
        for index in range(kind.count):
            inner = f"{path}[{index}]"
            yield from paths(kind.of, inner, offset + index * kind.stride, most // kind.count)


def leaves(
    kind: Type, index: tuple[int, ...] = (), path: str = ""
) -> Iterator[tuple[tuple[int, ...], str, Type]]:
    """Return the parts that are no structures, by the numbers of members that lead to them."""
    if kind.kind != "struct":
        yield index, path, kind
    for number, member in enumerate(kind.members):
        yield from leaves(member.type, (*index, number), _inner(path, member.name, number))


def _inner(path: str, name: str, number: int) -> str:
    """Return the path of a member; one that naga has added has no name of its own."""
    name = name or str(number)
    return path if name == "*" else f"{path}.{name}" if path else name


def scalars(kind: Type, offset: int = 0) -> Iterator[tuple[str, int, int]]:
    """Return kind, bits and offset of each number of a type, in order."""
    if kind.kind in ("bool", "int", "uint", "float"):
        yield kind.kind, kind.count, offset
        return
    if kind.kind == "struct":
        for member in kind.members:
            yield from scalars(member.type, offset + member.offset)
        return
    if kind.of is None:
        raise ModuleFault("a member of a block has no numbers")
    if kind.kind == "matrix" and kind.row_major:
        of = kind.of.of
        assert of is not None
        for column in range(kind.count):
            for row in range(kind.of.count):
                yield from scalars(of, offset + row * kind.stride + column * of.size)
        return
    step = kind.of.size if kind.kind == "vector" else kind.stride
    for index in range(kind.count):
        yield from scalars(kind.of, offset + index * step)
