"""Blocks BUFFER: uniform and storage buffers whose variables the file declares."""

from __future__ import annotations

import dataclasses
import re
from typing import Final, Literal, TypeAlias, get_args

from vkbloom._custom.blocks import Block, Directive
from vkbloom._custom.params import Number
from vkbloom._custom.textures import read_hex

#: Rows and columns of each type; all numbers have 4 bytes.
TYPES: Final = {
    **dict.fromkeys(get_args(Number), (1, 1)),
    **{f"{kind}vec{n}": (n, 1) for kind in ("", "i", "u") for n in (2, 3, 4)},
    **{f"mat{n}": (n, n) for n in (2, 3, 4)},
    **{f"mat{c}x{r}": (r, c) for c in (2, 3, 4) for r in (2, 3, 4)},
}
#: What every device of Vulkan 1.1 allows for a uniform buffer.
MAX_UNIFORM_BYTES: Final = 16384
MAX_STORAGE_BYTES: Final = 1 << 27

#: Rules of GLSL for the places of variables in a buffer.
Packing: TypeAlias = Literal["std140", "std430"]


@dataclasses.dataclass(frozen=True)
class BufferVariable:
    """A variable of a buffer; `count` is None if it is no array."""

    type: str
    name: str
    count: int | None

    @property
    def declaration(self) -> str:
        """The declaration in GLSL."""
        return f"{self.type} {self.name}" + ("" if self.count is None else f"[{self.count}]")


@dataclasses.dataclass(frozen=True, eq=False)
class Buffer:
    """A buffer with its size in bytes, and its data (None: zero)."""

    name: str
    variables: tuple[BufferVariable, ...]
    storage: bool
    size: int
    data: bytes | None
    line: int


def packed_size(variables: tuple[BufferVariable, ...], packing: Packing) -> int:
    """Return the size of a buffer up to its last number."""
    end = 0
    for variable in variables:
        rows, columns = TYPES[variable.type]
        align = 4 * (4 if rows == 3 else rows)
        repeated = columns > 1 or variable.count is not None
        if repeated and packing == "std140":
            align = 16
        count = columns * (1 if variable.count is None else variable.count)
        end = -(-end // align) * align + (align * count if repeated else 4 * rows)
    return end


def read_buffer(block: Block) -> Buffer:
    """Read a block BUFFER."""
    name, line = block.head.identifier(), block.line
    storage = block.last("STORAGE") is not None
    variables = tuple(read_variable(directive) for directive in block.all("VAR"))
    if not variables:
        raise block.fault(line, "the block has no //!VAR")
    size = packed_size(variables, "std430" if storage else "std140")
    largest = MAX_STORAGE_BYTES if storage else MAX_UNIFORM_BYTES
    if size > largest:
        raise block.fault(line, f"{size} bytes are more than {largest}")
    data = read_hex(block)
    if len(data) != size and not (storage and not data):
        raise block.fault(block.body_line, f"the data has {len(data)} bytes, not {size}")
    return Buffer(name, variables, storage, size, data or None, line)


def read_variable(directive: Directive) -> BufferVariable:
    """Read a directive VAR: a type, a name, and for an array its length."""
    match = re.fullmatch(r"(\S+)\s+([A-Za-z_]\w*)\s*(\[\s*(\S*?)\s*\])?", directive.value, re.ASCII)
    if not match:
        raise directive.refusal("is not 'type name' or 'type name[count]'")
    kind, name, array, length = match.groups()
    if kind not in TYPES:
        raise directive.fault(f"{kind!r} is not one of {', '.join(TYPES)}")
    if array is None:
        return BufferVariable(kind, name, None)
    if not re.fullmatch(r"\d{1,9}", length or "", re.ASCII) or int(length) < 1:
        raise directive.fault(f"{length!r} is not an array's length, 1 or more")
    return BufferVariable(kind, name, int(length))
