"""SPIR-V of others, lowered to what passes have: images of one layer, each at its own binding.

All functions take and return the code of a module; what they need not change they return as it is.
"""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from vkbloom._custom.described.module import (
    ARRAY_STRIDE,
    BINDING,
    BUILT_IN,
    CAPABILITY,
    CONSTANT,
    DECORATE,
    FIRST_ELEMENT,
    IMAGE_READ,
    MATRIX_STRIDE,
    MAX_ELEMENTS,
    MEMBER_DECORATE,
    OFFSET,
    SPEC_CONSTANT,
    TYPE_ARRAY,
    TYPE_FLOAT,
    TYPE_IMAGE,
    TYPE_INT,
    TYPE_POINTER,
    TYPE_SAMPLED_IMAGE,
    TYPE_VECTOR,
    UNIFORM_CONSTANT,
    Entry,
    Module,
    ModuleFault,
)
from vkbloom._custom.instructions import (
    CONSTANTS,
    FUNCTION,
    FUNCTION_CALL,
    LOAD,
    VARIABLE,
    Instruction,
)
from vkbloom._custom.spirv import HEADER_WORDS

#: Capabilities of arrays that are indexed by numbers that are not constant.
_INDEXED: Final = range(28, 32)

# Instructions of images: OpImageFetch, OpImageWrite, OpImageQuerySizeLod, OpImageQuerySize.
_FETCH, _WRITE, _SIZE_LOD, _SIZE = 95, 99, 103, 104
#: Those whose coordinate has the layer: OpImageSampleImplicitLod to OpImageSampleDrefExplicitLod,
#: OpImageFetch to OpImageWrite.
_WITH_LAYER: Final = {*range(87, 91), *range(_FETCH, _WRITE + 1)}
_STORE: Final = 62
_CONVERT, _BITCAST, _COPY = 115, 124, 83
#: Capabilities of floats of 16 bits: in general, and in what is bound.
_OF_HALVES: Final = {9, *range(4433, 4437)}
_EXTRACT, _INSERT, _SHUFFLE, _CONSTRUCT, _NEGATE = 81, 82, 79, 80, 127
_POSITION: Final = 0
#: Of an image type: Dim2D.
TWO_DIMENSIONS: Final = 1
#: Decorations of storage images that a texture has not: Restrict to NonReadable.
_OF_STORED: Final = range(19, 26)
_LOD: Final = 2
#: What else is done with storage images, and the first operand that may be one: OpFunctionCall,
#: OpImageTexelPointer, OpCopyObject, OpImageWrite.
_OTHER_USES: Final = {FUNCTION_CALL: 4, 60: 3, _COPY: 3, _WRITE: 1}


def has_arrays(code: bytes) -> bool:
    """Whether a module has arrays of images or samplers."""
    return bool(_arrays(Module(code)))


def _arrays(module: Module) -> set[int]:
    found = set()
    for identity, word in module.defined.items():
        if word[0] & 0xFFFF != VARIABLE or word[3] != UNIFORM_CONSTANT:
            continue
        pointed = module.defined.get(module.defined.get(word[1], (0,) * 4)[3], (0, 0))
        if pointed[0] & 0xFFFF == TYPE_ARRAY:
            if module.constant(pointed[3]) > MAX_ELEMENTS:
                raise ModuleFault(f"an array of more than {MAX_ELEMENTS} textures")
            found.add(identity)
    return found


def split_arrays(code: bytes, optimize: Callable[[bytes], bytes]) -> bytes:
    """Return a module without arrays of images: each element is a variable of its own.

    `optimize`: SPIRV-Tools, which gives the element i of an array the binding i after the first.
    """
    module = Module(code)
    arrays = _arrays(module)

    def moved(word: Instruction) -> Iterable[Instruction]:
        if word[0] & 0xFFFF == DECORATE and word[1] in arrays and word[2] == BINDING:
            yield (*word[:3], FIRST_ELEMENT + MAX_ELEMENTS * word[3])
        elif not (word[0] & 0xFFFF == CAPABILITY and word[1] in _INDEXED):
            yield word

    made = optimize(_rewrite(module, moved))
    if has_arrays(made):
        raise ModuleFault("SPIRV-Tools left an array of textures")
    return made


def _rewrite(
    module: Module,
    change: Callable[[Instruction], Iterable[Instruction]],
    types: _Types | None = None,
) -> bytes:
    """Return the code with each instruction as it is changed to, and with new declarations."""
    words = list(module.words[:HEADER_WORDS])
    rest = [each for word in module.instructions for each in change(word)]
    declared = [] if types is None else types.added
    for word in rest:
        if word[0] & 0xFFFF == FUNCTION:
            for added in declared:
                words += added
            declared = []
        words += word
    words[3] += 0 if types is None else types.count
    return struct.pack(f"={len(words)}I", *words)


def _instruction(opcode: int, *operands: int) -> Instruction:
    return ((len(operands) + 1) << 16 | opcode, *operands)


class _Types:
    """The types of a module's values, and new types and constants, before its functions."""

    def __init__(self, module: Module) -> None:
        self._module = module
        self._vectors = {
            word[2:]: identity
            for identity, word in module.defined.items()
            if word[0] & 0xFFFF == TYPE_VECTOR
        }
        types = {key for key, word in module.defined.items() if word[0] & 0xFFFF < CONSTANTS.start}
        self.of_value = {
            word[2]: word[1]
            for word in module.instructions
            # No instruction without a result begins with a type.
            if len(word) > 2 and word[1] in types and word[0] & 0xFFFF >= CONSTANTS.start
        }
        self.added: list[Instruction] = []
        self._next = module.words[3]

    @property
    def count(self) -> int:
        """The number of new ids."""
        return self._next - self._module.words[3]

    def new(self) -> int:
        """Return a new id."""
        self._next += 1
        return self._next - 1

    def constant(self, kind: int, value: int) -> int:
        """Return a new constant."""
        made = self.new()
        self.added.append(_instruction(CONSTANT, kind, made, value))
        return made

    def pair(self, vector: int) -> int:
        """Return the vector of two entries of those of another one."""
        key = self.component(vector), 2
        if key not in self._vectors:
            self._vectors[key] = self.new()
            self.added.append(_instruction(TYPE_VECTOR, self._vectors[key], *key))
        return self._vectors[key]

    def component(self, vector: int) -> int:
        """Return the type of a vector's entries."""
        word = self._module.defined.get(vector, (0, 0, 0))
        if word[0] & 0xFFFF != TYPE_VECTOR:
            raise ModuleFault("a coordinate of an image is not a vector")
        return word[2]


def without_halves(code: bytes) -> bytes:
    """Return a module whose floats of 16 bits have 32: HLSL's half is no other one on desktops.

    One that takes bits of such floats, as f32tof16 does, keeps them.
    """
    module = Module(code)
    halves = {
        identity
        for identity, word in module.defined.items()
        if word[0] & 0xFFFF == TYPE_FLOAT and word[2] == 16
    }
    if not halves:
        return code
    types = _Types(module)

    def is_half(value: int) -> bool:
        kind = module.type_of(types.of_value.get(value, 0))
        return (kind.of or kind).id in halves

    casts = [word for word in module.instructions if word[0] & 0xFFFF == _BITCAST]
    if any(is_half(word[2]) or is_half(word[3]) for word in casts):
        return code

    def is_double(value: int) -> bool:
        kind = module.type_of(types.of_value.get(value, 0))
        return (kind.of or kind).count == 64

    def changed(word: Instruction) -> Iterator[Instruction]:
        opcode = word[0] & 0xFFFF
        if opcode == TYPE_FLOAT and word[1] in halves:
            yield (*word[:2], 32, *word[3:])
        elif opcode in (CONSTANT, SPEC_CONSTANT) and word[1] in halves:
            (value,) = struct.unpack("<e", struct.pack("<H", word[3] & 0xFFFF))
            yield (*word[:3], *struct.unpack("<I", struct.pack("<f", value)))
        elif opcode == _CONVERT and not is_double(word[2]) and not is_double(word[3]):
            yield _instruction(_COPY, *word[1:])
        elif opcode == MEMBER_DECORATE and word[3] in (OFFSET, MATRIX_STRIDE):
            # There must be room for numbers of twice the size.
            yield (*word[:4], 2 * word[4])
        elif opcode == DECORATE and word[2] == ARRAY_STRIDE:
            yield (*word[:3], 2 * word[3])
        elif not (opcode == CAPABILITY and word[1] in _OF_HALVES):
            yield word

    return _rewrite(module, changed, types)


def without_layers(code: bytes) -> bytes:
    """Return a module whose images of several layers have one, so that no coordinate has it."""
    module = Module(code)
    images = {
        identity
        for identity, word in module.defined.items()
        if word[0] & 0xFFFF == TYPE_IMAGE and word[3] == TWO_DIMENSIONS and word[5] and not word[6]
    }
    if not images:
        return code
    kinds = images | {
        identity
        for identity, word in module.defined.items()
        if word[0] & 0xFFFF == TYPE_SAMPLED_IMAGE and word[2] in images
    }
    types = _Types(module)
    values = {value for value, kind in types.of_value.items() if kind in kinds}

    def changed(word: Instruction) -> Iterator[Instruction]:
        opcode = word[0] & 0xFFFF
        place = 2 if opcode == _WRITE else 4
        if opcode == TYPE_IMAGE and word[1] in images:
            yield (*word[:5], 0, *word[6:])
        elif opcode in _WITH_LAYER and word[place - 1] in values:
            vector = types.pair(types.of_value.get(word[place], 0))
            cut = types.new()
            yield _instruction(_SHUFFLE, vector, cut, word[place], word[place], 0, 1)
            yield (*word[:place], cut, *word[place + 1 :])
        elif opcode in (_SIZE_LOD, _SIZE) and word[3] in values:
            size, one = types.new(), types.constant(types.component(word[1]), 1)
            yield (word[0], types.pair(word[1]), size, *word[3:])
            yield _instruction(_CONSTRUCT, word[1], word[2], size, one)
        else:
            yield word

    return _rewrite(module, changed, types)


@dataclasses.dataclass(frozen=True)
class ImageKind:
    """How a storage image is declared: `sampled` 1 as a texture, 2 as it was, with a format."""

    sampled: int
    format: int


TEXTURE: Final = ImageKind(1, 0)


def with_kinds(code: bytes, kinds: Mapping[int, ImageKind]) -> bytes:
    """Return a module in which some storage images are declared otherwise.

    The module must only read those that become textures. What is new has ids beyond its bound.
    """
    module = Module(code)
    types = _Types(module)
    textures = {key for key, kind in kinds.items() if kind.sampled == TEXTURE.sampled}
    integer = next(
        (
            key
            for key, word in module.defined.items()
            if word[0] & 0xFFFF == TYPE_INT and word[2] == 32
        ),
        0,
    )
    # Values that were loaded, and their variables; of variables the new types.
    loaded: dict[int, int] = {}
    images: dict[int, int] = {}

    def changed(word: Instruction) -> Iterator[Instruction]:
        opcode = word[0] & 0xFFFF
        if opcode == DECORATE and word[1] in textures and word[2] in _OF_STORED:
            return
        if opcode == VARIABLE and word[2] in kinds:
            kind, (image, pointer) = kinds[word[2]], (types.new(), types.new())
            images[word[2]] = image
            was = module.defined[module.defined[word[1]][3]]
            yield _instruction(TYPE_IMAGE, image, *was[2:7], kind.sampled, kind.format)
            yield _instruction(TYPE_POINTER, pointer, UNIFORM_CONSTANT, image)
            yield (word[0], pointer, *word[2:])
        elif opcode == LOAD and word[3] in kinds:
            loaded[word[2]] = word[3]
            yield (word[0], images[word[3]], *word[2:])
        elif opcode == IMAGE_READ and loaded.get(word[3]) in textures:
            yield _instruction(_FETCH, *word[1:5], _LOD, types.constant(integer, 0))
        elif opcode == _SIZE and loaded.get(word[3]) in textures:
            yield _instruction(_SIZE_LOD, *word[1:4], types.constant(integer, 0))
        elif opcode in _OTHER_USES:
            operands = word[_OTHER_USES[opcode] :]
            used = {loaded.get(each, each) for each in operands} & textures
            if used:
                name = module.names.get(used.pop(), "a storage image")
                cause = f"textures: the shader does not only read {name!r}; it is an output"
                raise ModuleFault(cause)
            yield word
        else:
            yield word

    return _rewrite(module, changed, types)


def read_back(module: Module, entry: Entry) -> set[int]:
    """Return the storage images that an entry point reads."""
    loaded = {}
    found = set()
    for function in module.reached(entry):
        for word in module.functions[function]:
            if word[0] & 0xFFFF == LOAD:
                loaded[word[2]] = word[3]
            elif word[0] & 0xFFFF == IMAGE_READ:
                found.add(loaded.get(word[3], 0))
    return found


def with_y_down(code: bytes) -> bytes:
    """Return a vertex shader whose positions have y downwards, of one that has it upwards."""
    module = Module(code)
    positions = {
        identity
        for identity, marks in module.decorations.items()
        if marks.get(BUILT_IN, -1) == _POSITION
    }
    types = _Types(module)

    def changed(word: Instruction) -> Iterator[Instruction]:
        if word[0] & 0xFFFF == _STORE and word[1] in positions:
            vector = types.of_value[word[2]]
            number = types.component(vector)
            height, down, made = types.new(), types.new(), types.new()
            yield _instruction(_EXTRACT, number, height, word[2], 1)
            yield _instruction(_NEGATE, number, down, height)
            yield _instruction(_INSERT, vector, made, down, word[2], 1)
            yield (*word[:2], made, *word[3:])
        else:
            yield word

    return _rewrite(module, changed, types)
