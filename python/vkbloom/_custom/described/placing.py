"""SPIR-V of others, rewritten to the bindings that the core gives to passes."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Mapping
from typing import Final

from vkbloom._custom.described.module import (
    BINDING,
    CAPABILITY,
    DECORATE,
    ENTRY_POINT,
    EXECUTION_MODE,
    EXECUTION_MODE_ID,
    IMAGE_READ,
    MEMBER_DECORATE,
    OFFSET,
    PUSH_CONSTANT,
    RESOURCES,
    SET,
    SPEC_CONSTANT,
    SPEC_ID,
    TYPE_IMAGE,
    TYPE_POINTER,
    UNIFORM,
    Entry,
    Module,
    ModuleFault,
)
from vkbloom._custom.instructions import (
    FUNCTION,
    LOAD,
    VARIABLE,
    Instruction,
)
from vkbloom._custom.limits import limit_shader
from vkbloom._custom.spirv import HEADER_WORDS, without_contraction

#: Instructions that only help to debug: OpSourceContinued, OpSource, OpName, OpMemberName, OpLine,
#: OpNoLine.
_DEBUG: Final = {2, 3, 5, 6, 8, 317}
#: Storage images without a format: what reads and writes them needs these capabilities.
_READ_ANY, _WRITE_ANY = 55, 56
#: OpSpecConstantTrue to OpSpecConstantComposite become constants.
_SPECIALIZED: Final = {48: 41, 49: 42, 50: 43, 51: 44}
#: Types of which a module has each but once.
#: The storage class of a module's own variables, and OpConstantNull.
PRIVATE: Final = 6
CONSTANT_NULL: Final = 46
_UNIQUE: Final = (22, 23, 24, TYPE_IMAGE, 27, TYPE_POINTER, 33)


@dataclasses.dataclass
class Places:
    """Where an entry point finds what it uses.

    - `bindings`: By variable.
    - `offsets`: Bytes before the members of a structure, by its type.
    - `constants`: Words of specialization constants, by id.
    - `zeros`: Inputs that are 0.
    - `formatted`: The types of storage images that keep their format, by id.
    """

    bindings: dict[int, int] = dataclasses.field(default_factory=dict)
    offsets: dict[int, int] = dataclasses.field(default_factory=dict)
    constants: dict[int, int] = dataclasses.field(default_factory=dict)
    zeros: set[int] = dataclasses.field(default_factory=set)
    formatted: range = range(0)


def place(module: Module, entry: Entry, places: Places) -> bytes:
    """Return the SPIR-V of an entry point, named main, with all that it uses in its place."""
    made: list[int] = list(module.words[:HEADER_WORDS])
    replaced: dict[int, int] = {}
    known: dict[Instruction, int] = {}
    unused = _unused(module, entry)
    if module.words[1] < 0x10400:
        # Before version 1.4 of SPIR-V an interface has inputs and outputs alone.
        unused |= places.zeros
    for capability in _needed(module, entry, places) - module.capabilities:
        made += [2 << 16 | CAPABILITY, capability]
    in_functions = decorated = False
    for word in module.instructions:
        in_functions = in_functions or word[0] & 0xFFFF == FUNCTION
        if in_functions:
            if word[0] & 0xFFFF not in _DEBUG:
                made += _retyped(word, replaced)
            continue
        if not decorated and 19 <= word[0] & 0xFFFF <= 39:
            # Decorations come before all types.
            decorated = True
            for identity, binding in places.bindings.items():
                made += [4 << 16 | DECORATE, identity, SET, 0]
                made += [4 << 16 | DECORATE, identity, BINDING, binding]
        if word[0] & 0xFFFF == VARIABLE and word[2] in places.zeros:
            # A variable of its own, with the value 0: three new ids and instructions.
            pointer, null, kind = made[3], made[3] + 1, module.defined[word[1]][3]
            made[3] += 2
            made += [4 << 16 | TYPE_POINTER, pointer, PRIVATE, kind]
            made += [3 << 16 | CONSTANT_NULL, kind, null]
            made += [5 << 16 | VARIABLE, pointer, word[2], PRIVATE, null]
            continue
        written = _declaration(word, entry, places, unused)
        if not written:
            continue
        written = _retyped(written, replaced)
        if written[0] & 0xFFFF in _UNIQUE:
            key = (written[0], *written[2:])
            if key in known:
                replaced[written[1]] = known[key]
                continue
            known[key] = written[1]
        made += written
    try:
        words = without_contraction(limit_shader(tuple(made)))
    except ValueError as error:
        raise ModuleFault(str(error)) from None
    return struct.pack(f"={len(words)}I", *words)


def _needed(module: Module, entry: Entry, places: Places) -> set[int]:
    """Return the capabilities that storage images without a format need."""
    stored = {
        identity
        for identity, word in module.defined.items()
        if word[0] & 0xFFFF == TYPE_IMAGE and len(word) > 8 and word[7] == 2
    }
    loaded = {}
    reads = False
    for function in module.reached(entry):
        for word in module.functions[function]:
            if word[0] & 0xFFFF == LOAD:
                loaded[word[2]] = word[1]
            elif word[0] & 0xFFFF == IMAGE_READ:
                reads = reads or loaded.get(word[3], 0) not in places.formatted
    needed = {_WRITE_ANY} if stored else set()
    return needed | {_READ_ANY} if stored and reads else needed


def _unused(module: Module, entry: Entry) -> set[int]:
    """Return the resources that an entry point does not use."""
    used = {variable.id for variable in module.variables(entry)}
    return {
        identity
        for identity, word in module.defined.items()
        if word[0] & 0xFFFF == VARIABLE and word[3] in RESOURCES and identity not in used
    }


def _retyped(word: Instruction, replaced: Mapping[int, int]) -> Instruction:
    """Return an instruction with the types that were replaced."""
    if not replaced:
        return word
    opcode = word[0] & 0xFFFF
    if 19 <= opcode <= 38:
        first = 3 if opcode == TYPE_POINTER else 2
        last = 3 if opcode in (23, 24, 25, 28) else len(word)
        changed = [replaced.get(each, each) for each in word[first:last]]
        return (*word[:first], *changed, *word[last:])
    if len(word) > 1 and word[1] in replaced:
        word = (word[0], replaced[word[1]], *word[2:])
    if opcode == FUNCTION:
        word = (*word[:4], replaced.get(word[4], word[4]))
    return word


def _declaration(  # noqa: PLR0911  one for each kind
    word: Instruction, entry: Entry, places: Places, unused: set[int]
) -> Instruction:
    """Return a declaration as it is in the new module; empty if it is left out."""
    opcode = word[0] & 0xFFFF
    if opcode in _DEBUG:
        return ()
    if opcode == ENTRY_POINT:
        return _entry_point(word, entry, unused)
    if opcode in (EXECUTION_MODE, EXECUTION_MODE_ID):
        return word if word[1] == entry.id else ()
    if opcode == DECORATE:
        return _decoration(word, places)
    if opcode == MEMBER_DECORATE and word[3] == OFFSET:
        return (*word[:4], word[4] + places.offsets.get(word[1], 0))
    if opcode == TYPE_IMAGE and len(word) > 8 and word[7] == 2 and word[1] not in places.formatted:
        return (9 << 16 | TYPE_IMAGE, *word[1:8], 0)
    if opcode == TYPE_POINTER and word[2] == PUSH_CONSTANT:
        return (word[0], word[1], UNIFORM, word[3])
    if opcode == VARIABLE and word[3] == PUSH_CONSTANT:
        return (*word[:3], UNIFORM, *word[4:])
    if opcode in _SPECIALIZED:
        return _constant(word, places)
    return word


def _entry_point(word: Instruction, entry: Entry, unused: set[int]) -> Instruction:
    """Return an entry point under the name main, without what it does not use."""
    if word[2] != entry.id:
        return ()
    end = 3
    # A text ends with the word that has a byte of zero.
    while all(word[end] >> shift & 0xFF for shift in (0, 8, 16, 24)):
        end += 1
    name = struct.unpack("<2I", b"main\0\0\0\0")
    interface = [each for each in word[end + 1 :] if each not in unused]
    length = 3 + len(name) + len(interface)
    return (length << 16 | ENTRY_POINT, word[1], word[2], *name, *interface)


def _decoration(word: Instruction, places: Places) -> Instruction:
    target, kind = word[1], word[2]
    if kind == SPEC_ID or target in places.zeros:
        return ()
    return () if target in places.bindings and kind in (SET, BINDING) else word


def _constant(word: Instruction, places: Places) -> Instruction:
    """Return a specialization constant as a constant with the value that it was given."""
    opcode = word[0] & 0xFFFF
    given = places.constants.get(word[2])
    changed = _SPECIALIZED[opcode]
    if given is not None and opcode in (48, 49):
        changed = 41 if given else 42
    if given is not None and opcode == SPEC_CONSTANT:
        word = (*word[:3], given, *word[4:])
    return (word[0] & 0xFFFF0000 | changed, *word[1:])
