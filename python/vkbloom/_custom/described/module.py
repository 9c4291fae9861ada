"""SPIR-V of others: its declarations, and what an entry point uses of them."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Mapping
from typing import Final

from vkbloom._custom.instructions import (
    ACCESS_CHAINS,
    CONSTANTS,
    FUNCTION,
    FUNCTION_CALL,
    VARIABLE,
    Instruction,
    split,
)
from vkbloom._custom.loops import is_endless
from vkbloom._custom.spirv import HEADER_WORDS

MAGIC: Final = 0x07230203
MAX_BYTES: Final = 4 << 20
MAX_BOUND: Final = 1 << 20
#: Of arrays and structures within others.
MAX_DEPTH: Final = 8
#: Of an array, and of a vector; the bits of a number.
MAX_LENGTH: Final = 1 << 20
MAX_ROWS: Final = 4
BITS: Final = (8, 16, 32, 64)

STAGES: Final = {0: "vertex", 4: "fragment", 5: "compute"}

# Storage classes.
UNIFORM_CONSTANT, INPUT, UNIFORM, OUTPUT, PUSH_CONSTANT, STORAGE_BUFFER = 0, 1, 2, 3, 9, 12
RESOURCES: Final = (UNIFORM_CONSTANT, UNIFORM, PUSH_CONSTANT, STORAGE_BUFFER)
# Decorations.
SPEC_ID, BLOCK, BUFFER_BLOCK, ROW_MAJOR, ARRAY_STRIDE, MATRIX_STRIDE = 1, 2, 3, 4, 6, 7
BUILT_IN, NON_WRITABLE, LOCATION, BINDING, SET, OFFSET = 11, 24, 30, 33, 34, 35
WORKGROUP_SIZE: Final = 25
# Execution modes.
LOCAL_SIZE, LOCAL_SIZE_ID = 17, 38

NAME, MEMBER_NAME, ENTRY_POINT, EXECUTION_MODE, CAPABILITY = 5, 6, 15, 16, 17
TYPE_BOOL, TYPE_INT, TYPE_FLOAT, TYPE_VECTOR, TYPE_MATRIX = 20, 21, 22, 23, 24
TYPE_IMAGE, TYPE_SAMPLER, TYPE_SAMPLED_IMAGE = 25, 26, 27
TYPE_ARRAY, TYPE_RUNTIME_ARRAY, TYPE_STRUCT, TYPE_POINTER = 28, 29, 30, 32
CONSTANT, CONSTANT_COMPOSITE, SPEC_CONSTANT, SPEC_CONSTANT_COMPOSITE = 43, 44, 50, 51
DECORATE, MEMBER_DECORATE, EXECUTION_MODE_ID = 71, 72, 331
IMAGE_READ: Final = 98

#: Where instructions of functions name variables: their first operand that may, and whether all
#: that follow may, too.
_POINTERS: Final[Mapping[int, tuple[int, bool]]] = {
    12: (5, True),  # OpExtInst
    FUNCTION_CALL: (4, True),
    60: (3, False),  # OpImageTexelPointer
    61: (3, False),  # OpLoad
    62: (1, True),  # OpStore
    63: (1, True),  # OpCopyMemory
    65: (3, False),
    66: (3, False),
    67: (3, False),
    68: (3, False),  # OpArrayLength
    83: (3, False),  # OpCopyObject
    228: (1, False),  # OpAtomicStore
    **dict.fromkeys((227, *range(229, 243)), (3, False)),
}


#: The bindings of the elements of an array of textures, after it is split: from here on, a hundred
#: for each binding, and the number of the element.
FIRST_ELEMENT: Final = 100_000
MAX_ELEMENTS: Final = 100


def element_of(binding: int) -> tuple[int, int] | None:
    """Return the binding of an array and the number of its element; None: it is of none."""
    if binding < FIRST_ELEMENT:
        return None
    array, element = divmod(binding - FIRST_ELEMENT, MAX_ELEMENTS)
    return array, element


class ModuleFault(ValueError):
    """SPIR-V that is not valid, or that has what passes cannot have."""


@dataclasses.dataclass(frozen=True)
class Type:
    """A type of data, an image or a sampler.

    - `kind`: bool, int, uint, float, vector, matrix, array, struct, image, sampler, sampled, other.
    - `count`: bits of a number; entries of vectors, columns of matrices, length of arrays (0: as
      long as the buffer is).
    - `of`: The type of what it has; of a sampled image, the image's.
    - `stride`, `row_major`: Of arrays and matrices.
    - `members`: Of a struct.
    - `image`: Of an image: dimensions, depth, arrayed, multisampled, sampled (1: by a sampler, 2: a
      storage image), format.
    """

    id: int
    kind: str
    count: int = 0
    of: Type | None = None
    stride: int = 0
    row_major: bool = False
    members: tuple[Member, ...] = ()
    image: tuple[int, ...] = ()

    @property
    def size(self) -> int:  # noqa: PLR0911  one for each kind
        """The bytes up to the last one."""
        match self.kind:
            case "bool":
                return 4
            case "int" | "uint" | "float":
                return self.count // 8
            case "vector":
                assert self.of is not None
                return self.count * self.of.size
            case "matrix" if self.row_major:
                assert self.of is not None
                assert self.of.of is not None
                return self.stride * (self.of.count - 1) + self.count * self.of.of.size
            case "matrix" | "array":
                assert self.of is not None
                return self.stride * max(self.count - 1, 0) + (self.of.size if self.count else 0)
            case "struct":
                return max((member.offset + member.type.size for member in self.members), default=0)
        return 0


@dataclasses.dataclass(frozen=True)
class Member:
    """A member of a struct."""

    name: str
    offset: int
    type: Type


@dataclasses.dataclass(frozen=True)
class Variable:
    """A variable of a module.

    `members`: Those that the entry point uses, by the numbers that lead to them; None: all.
    """

    id: int
    name: str
    storage: int
    type: Type
    set: int
    binding: int
    location: int | None
    built_in: bool
    read_only: bool
    members: frozenset[tuple[int, ...]] | None

    @property
    def place(self) -> str:
        """Group and binding; of an element of an array those of the array, and its number."""
        array = element_of(self.binding)
        return (
            f"{self.set}.{self.binding}" if array is None else f"{self.set}.{array[0]}[{array[1]}]"
        )

    @property
    def element(self) -> int | None:
        """The number of an element of an array of textures; None: it is of none."""
        array = element_of(self.binding)
        return None if array is None else array[1]

    @property
    def is_block(self) -> bool:
        """Whether it is a uniform block or push constants."""
        return self.storage == PUSH_CONSTANT or (self.storage == UNIFORM and not self.is_buffer)

    @property
    def is_buffer(self) -> bool:
        """Whether it is a storage buffer."""
        return self.storage == STORAGE_BUFFER or (self.storage == UNIFORM and self._old_buffer)

    _old_buffer: bool = False


@dataclasses.dataclass(frozen=True)
class Entry:
    """An entry point."""

    name: str
    stage: str
    id: int


class Module:
    """The declarations of a module; ModuleFault if it is not valid."""

    def __init__(self, code: bytes) -> None:
        self.words = read_words(code)
        try:
            self.instructions = list(split(self.words))
        except ValueError as error:
            raise ModuleFault(str(error)) from None
        self.names: dict[int, str] = {}
        self.member_names: dict[tuple[int, int], str] = {}
        self.decorations: dict[int, dict[int, int]] = {}
        self.member_decorations: dict[tuple[int, int], dict[int, int]] = {}
        self.entries: list[Entry] = []
        self.defined: dict[int, Instruction] = {}
        self.functions: dict[int, list[Instruction]] = {}
        self.threads: dict[int, tuple[int, ...]] = {}
        self.capabilities: set[int] = set()
        self._types: dict[tuple[int, bool, int], Type] = {}
        self._read()

    def _read(self) -> None:  # noqa: PLR0912  one for each instruction
        body: list[Instruction] | None = None
        for word in self.instructions:
            opcode, length = word[0] & 0xFFFF, len(word)
            if opcode == FUNCTION and length == 5:
                body = self.functions[word[2]] = []
            if body is not None:
                body.append(word)
                continue
            match opcode:
                case 17 if length == 2:
                    self.capabilities.add(word[1])
                case 5 if length > 2:
                    self.names[word[1]] = read_text(word[2:])
                case 6 if length > 3:
                    self.member_names[word[1], word[2]] = read_text(word[3:])
                case 15 if length > 3:
                    stage = STAGES.get(word[1], "")
                    self.entries.append(Entry(read_text(word[3:]), stage, word[2]))
                case 16 if length == 6 and word[2] == LOCAL_SIZE:
                    self.threads[word[1]] = word[3:6]
                case 331 if length == 6 and word[2] == LOCAL_SIZE_ID:
                    self.threads[word[1]] = tuple(-each for each in word[3:6])
                case 71 if length > 2:
                    self.decorations.setdefault(word[1], {})[word[2]] = word[3] if length > 3 else 1
                case 72 if length > 3:
                    key = word[1], word[2]
                    value = word[4] if length > 4 else 1
                    self.member_decorations.setdefault(key, {})[word[3]] = value
                case _ if 19 <= opcode <= 38 and length > 1:
                    self.defined[word[1]] = word
                case _ if (opcode in CONSTANTS or opcode == VARIABLE) and length > 2:
                    self.defined[word[2]] = word

    def entry(self, name: str | None, stage: str | None) -> Entry:
        """Return the entry point of a name or a stage, if there is just one."""
        found = [
            each
            for each in self.entries
            if (name is None or each.name == name) and (stage is None or each.stage == stage)
        ]
        found = [each for each in found if each.stage] or found
        if len(found) == 1 and found[0].stage and found[0].id in self.functions:
            return found[0]
        known = ", ".join(f"{each.name} ({each.stage or 'other stage'})" for each in self.entries)
        wanted = f"the entry point {name!r}" if name else f"one entry point of the {stage} stage"
        raise ModuleFault(f"entry: the shader has not {wanted}; it has {known or 'none'}")

    def workgroup(self, entry: Entry) -> tuple[int, int, int]:
        """Return the threads of a workgroup of a compute shader."""
        for identity, decorations in self.decorations.items():
            if decorations.get(BUILT_IN) == WORKGROUP_SIZE and identity in self.defined:
                return self._three(self.defined[identity][3:6])
        found = self.threads.get(entry.id)
        if found is None:
            raise ModuleFault("the compute shader states no size of its workgroups")
        return (found[0], found[1], found[2]) if min(found) >= 0 else self._three(found)

    def _three(self, identities: tuple[int, ...]) -> tuple[int, int, int]:
        """Return three constants; their ids may be negative."""
        parts = [self.constant(abs(identity)) for identity in (*identities, 0, 0, 0)[:3]]
        return parts[0], parts[1], parts[2]

    def constant(self, identity: int) -> int:
        """Return the value of a constant integer."""
        word = self.defined.get(identity, ())
        if len(word) < 4 or word[0] & 0xFFFF not in (CONSTANT, SPEC_CONSTANT):
            raise ModuleFault("a length is not a constant")
        return word[3]

    def type_of(
        self, identity: int, *, row_major: bool = False, stride: int = 0, depth: int = 0
    ) -> Type:
        """Return a type."""
        key = identity, row_major, stride
        if key not in self._types:
            if depth > MAX_DEPTH:
                raise ModuleFault("types are nested too deeply")
            self._types[key] = self._read_type(identity, row_major, stride, depth + 1)
        return self._types[key]

    def _read_type(self, identity: int, row_major: bool, stride: int, depth: int) -> Type:  # noqa: PLR0911, PLR0912
        word = self.defined.get(identity, (0,))
        opcode, rest = word[0] & 0xFFFF, (*word[2:], 0, 0, 0)
        match opcode:
            case 20:
                return Type(identity, "bool", 32)
            case 21 | 22 if rest[0] not in BITS:
                raise ModuleFault(f"numbers of {rest[0]} bits")
            case 21:
                return Type(identity, "int" if rest[1] else "uint", rest[0])
            case 22:
                return Type(identity, "float", rest[0])
            case 23 | 24:
                kind = "vector" if opcode == TYPE_VECTOR else "matrix"
                of = self.type_of(rest[0], depth=depth)
                if not 2 <= rest[1] <= MAX_ROWS:
                    raise ModuleFault(f"a {kind} of {rest[1]} entries")
                return Type(identity, kind, rest[1], of, stride, row_major)
            case 25 if len(word) >= 9:
                return Type(
                    identity, "image", 0, self.type_of(rest[0], depth=depth), image=word[3:9]
                )
            case 26:
                return Type(identity, "sampler")
            case 27:
                return Type(identity, "sampled", 0, self.type_of(rest[0], depth=depth))
            case 28 | 29:
                of = self.type_of(rest[0], row_major=row_major, stride=stride, depth=depth)
                step = self.decorations.get(identity, {}).get(ARRAY_STRIDE, of.size)
                count = self.constant(rest[1]) if opcode == TYPE_ARRAY else 0
                if count > MAX_LENGTH or (of.size and step < of.size):
                    raise ModuleFault(f"an array of {count} entries, {step} bytes apart")
                return Type(identity, "array", count, of, step)
            case 30:
                members = []
                for index, member in enumerate(word[2:]):
                    marks = self.member_decorations.get((identity, index), {})
                    of_member = self.type_of(
                        member,
                        row_major=ROW_MAJOR in marks,
                        stride=marks.get(MATRIX_STRIDE, 0),
                        depth=depth,
                    )
                    name = self.member_names.get((identity, index), "")
                    members.append(Member(name, marks.get(OFFSET, 0), of_member))
                return Type(identity, "struct", members=tuple(members))
        return Type(identity, "other")

    def variables(self, entry: Entry) -> list[Variable]:
        """Return the global variables that an entry point uses, in the order of their places."""
        used = self._used(entry)
        found = []
        for identity, word in self.defined.items():
            if word[0] & 0xFFFF != VARIABLE or len(word) < 4 or identity not in used:
                continue
            pointer = self.defined.get(word[1], ())
            if len(pointer) != 4 or pointer[0] & 0xFFFF != TYPE_POINTER:
                raise ModuleFault("the type of a variable is not a pointer")
            found.append(self._variable(identity, word[3], pointer[3], used[identity]))
        return sorted(found, key=lambda each: (each.storage, each.set, each.binding))

    def _variable(
        self, identity: int, storage: int, kind: int, members: frozenset[tuple[int, ...]] | None
    ) -> Variable:
        marks = self.decorations.get(identity, {})
        kind_marks = self.decorations.get(kind, {})
        made = self.type_of(kind)
        name = self.names.get(identity, "")
        if made.kind == "struct" and (not name or name.startswith("_")):
            name = self.names.get(kind, name)
        read_only = NON_WRITABLE in marks or (
            bool(made.members)
            and all(
                NON_WRITABLE in self.member_decorations.get((kind, index), {})
                for index in range(len(made.members))
            )
        )
        location = marks.get(LOCATION)
        return Variable(
            identity,
            name,
            storage,
            made,
            marks.get(SET, 0),
            marks.get(BINDING, 0),
            location,
            BUILT_IN in marks
            or any(
                (kind, i) in self.member_decorations
                and BUILT_IN in self.member_decorations[kind, i]
                for i in range(len(made.members))
            ),
            read_only,
            members,
            BUFFER_BLOCK in kind_marks,
        )

    def _used(self, entry: Entry) -> dict[int, frozenset[tuple[int, ...]] | None]:
        """Return what the call tree of an entry point uses, with the members of blocks."""
        used: dict[int, set[tuple[int, ...]]] = {}
        # Pointers to parts of variables, by the members that lead there.
        parts: dict[int, tuple[int, tuple[int, ...]]] = {}
        for function in self.reached(entry):
            for word in self.functions[function]:
                opcode = word[0] & 0xFFFF
                first, more = _POINTERS.get(opcode, (len(word), False))
                for identity in word[first : len(word) if more else first + 1]:
                    base, path = parts.get(identity, (identity, ()))
                    if opcode in ACCESS_CHAINS:
                        known = self._constants(word[4:])
                        parts[word[2]] = base, path + known
                        used.setdefault(base, set())
                        if len(known) < len(word) - 4:
                            used[base].add(path + known)
                    else:
                        used.setdefault(base, set()).add(path)
        return {key: None if () in each else frozenset(each) for key, each in used.items()}

    def _constants(self, indices: Instruction) -> tuple[int, ...]:
        """Return the constants at the begin of the indices of an access chain."""
        path: list[int] = []
        for index in indices:
            try:
                path.append(self.constant(index))
            except ModuleFault:
                break
        return tuple(path)

    def reached(self, entry: Entry) -> list[int]:
        """Return the functions that an entry point calls, itself the first."""
        found = [entry.id]
        for function in found:
            for word in self.functions[function]:
                if word[0] & 0xFFFF == FUNCTION_CALL and len(word) > 3:
                    if word[3] not in self.functions:
                        raise ModuleFault("the shader calls a function that it has not")
                    if word[3] not in found:
                        found.append(word[3])
        return found

    def is_endless(self, entry: Entry) -> bool:
        """Whether it has a loop without an end."""
        return any(is_endless(self.defined, self.functions[each]) for each in self.reached(entry))


def read_words(code: bytes) -> tuple[int, ...]:
    """Return the words of a module in the order of this machine."""
    if len(code) > MAX_BYTES:
        raise ModuleFault(f"{len(code)} bytes of SPIR-V are more than {MAX_BYTES}")
    if len(code) % 4 or len(code) < 4 * HEADER_WORDS + 4:
        raise ModuleFault("the file is not SPIR-V")
    for order in "<>":
        words = struct.unpack(f"{order}{len(code) // 4}I", code)
        if words[0] == MAGIC:
            if words[3] > MAX_BOUND:
                raise ModuleFault(f"{words[3]} ids are more than {MAX_BOUND}")
            return words
    raise ModuleFault("the file is not SPIR-V")


def read_text(words: Instruction) -> str:
    """Return the text that begins with a word."""
    data = struct.pack(f"<{len(words)}I", *words)
    return data.split(b"\0", 1)[0].decode(errors="replace")
