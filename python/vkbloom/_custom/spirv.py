"""SPIR-V modules as words. Building the package loads this file by its path: it imports nothing."""

from __future__ import annotations

# Of SPIR-V: words of a module's header; the opcodes of types and of arithmetic on floats (FNegate
# to FMod, VectorTimesScalar to Dot); the instruction OpDecorate, of three words; NoContraction.
HEADER_WORDS = 5
TYPES = range(19, 40)
FLOAT_ARITHMETIC = {127, 129, 131, 133, 136, 140, 141, *range(142, 149)}
DECORATE = 3 << 16 | 71
NO_CONTRACTION = 42
# Storage classes: memory that a workgroup shares, and that of an invocation or a function.
WORKGROUP, PRIVATE, LOCAL = 4, 6, 7


def without_contraction(words: tuple[int, ...]) -> tuple[int, ...]:
    """Return the module with NoContraction on the result of each operation on floats.

    Else a compiler may make one operation of a product and a sum, which rounds once, in one shader
    and not in another that has the same expression: variants of a pass would differ in the last
    bit. GLSL's `precise` does the same for a variable, but where it is forgotten only some GPUs
    show it. Results that have it keep it.
    """
    decorations = []
    decorated = set()
    first_type = 0
    position = HEADER_WORDS
    while position < len(words):
        opcode, count = words[position] & 0xFFFF, words[position] >> 16
        if opcode in TYPES and not first_type:
            first_type = position
        if words[position] == DECORATE and words[position + 2] == NO_CONTRACTION:
            decorated.add(words[position + 1])
        if opcode in FLOAT_ARITHMETIC and words[position + 2] not in decorated:
            decorations += [DECORATE, words[position + 2], NO_CONTRACTION]
        position += count
    # Decorations come before all types.
    return (*words[:first_type], *decorations, *words[first_type:])


def shared_bytes(words: tuple[int, ...]) -> int:
    """Return the size of what a workgroup shares, without padding."""
    return sum(_bytes(words, {WORKGROUP}))


def private_bytes(words: tuple[int, ...]) -> list[int]:
    """Return the sizes of the variables that each invocation has, without padding."""
    return _bytes(words, {PRIVATE, LOCAL})


def _bytes(words: tuple[int, ...], storage: set[int]) -> list[int]:
    """Return the sizes of the variables of some storage classes."""
    sizes: dict[int, int] = {}
    pointed: dict[int, int] = {}
    lengths: dict[int, int] = {}
    found = []
    position = HEADER_WORDS
    while position < len(words):
        opcode, end = words[position] & 0xFFFF, position + (words[position] >> 16)
        a, b, c = (*words[position + 1 : position + 4], 0, 0, 0)[:3]
        match opcode:
            case 20:  # OpTypeBool
                sizes[a] = 4
            case 21 | 22:  # OpTypeInt, OpTypeFloat
                sizes[a] = b // 8
            case 23 | 24:  # OpTypeVector, OpTypeMatrix
                sizes[a] = sizes.get(b, 0) * c
            case 28:  # OpTypeArray
                sizes[a] = sizes.get(b, 0) * lengths.get(c, 0)
            case 30:  # OpTypeStruct
                sizes[a] = sum(sizes.get(member, 0) for member in words[position + 2 : end])
            case 32:  # OpTypePointer
                pointed[a] = c
            case 43 | 50:  # OpConstant, OpSpecConstant
                lengths[b] = c
            case 59 if c in storage:  # OpVariable
                found.append(sizes.get(pointed.get(a, 0), 0))
        position = end
    return found
