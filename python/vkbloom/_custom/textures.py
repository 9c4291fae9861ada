"""Blocks TEXTURE: images whose data is in the file."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from typing import Final, Literal, TypeVar, get_args

import numpy as np

from vkbloom._custom.blocks import Block
from vkbloom._custom.params import Number

Filter = Literal["NEAREST", "LINEAR"]
Border = Literal["CLAMP", "REPEAT", "MIRROR"]

Word = TypeVar("Word", bound=str)

FILTERS: Final[tuple[Filter, ...]] = get_args(Filter)
BORDERS: Final[tuple[Border, ...]] = get_args(Border)
#: Of a side, in each number of dimensions: what every device of Vulkan 1.1 has.
MAX_SIDES: Final = {1: 4096, 2: 4096, 3: 256}


@dataclasses.dataclass(frozen=True)
class TextureFormat:
    """A format: its number in Vulkan, its name in GLSL, and how the file's data becomes texels.

    `layout`: "" for a format that images of shaders cannot have.
    `file_bytes`: Those of a texel in the file.
    """

    vulkan: int
    layout: str
    scalar: Number
    channels: int
    file_bytes: int
    read: Callable[[bytes], np.ndarray]


def as_channels(
    kind: str, channels: int, to: str, order: str = ""
) -> Callable[[bytes], np.ndarray]:
    """Return a function that reads texels; three channels become four, with the largest alpha."""

    def read(data: bytes) -> np.ndarray:
        texels = np.frombuffer(data, np.dtype(kind).newbyteorder("<")).reshape(-1, channels)
        if order == "bgra":
            texels = texels[:, [2, 1, 0, 3]]
        texels = texels.astype(to)
        if channels == 3:
            whole = 1 if to[0] == "f" else np.iinfo(to).max
            texels = np.concatenate([texels, np.full((len(texels), 1), whole, to)], axis=1)
        return np.ascontiguousarray(texels)

    return read


def unpack_565(data: bytes) -> np.ndarray:
    """Read texels of 16 bits with red in the upper 5 as floats."""
    words = np.frombuffer(data, "<u2").astype(np.uint32)
    channels = [(words >> 11) / 31, (words >> 5 & 63) / 63, (words & 31) / 31, np.ones(len(words))]
    return np.stack(channels, axis=1).astype("f4")


def unpack_10(data: bytes) -> np.ndarray:
    """Read texels of 32 bits, 10 for each colour with red in the lower ones, as floats."""
    words = np.frombuffer(data, "<u4")
    channels = [(words & 1023) / 1023, (words >> 10 & 1023) / 1023, (words >> 20 & 1023) / 1023]
    return np.stack([*channels, (words >> 30) / 3], axis=1).astype("f4")


#: For 1, 2 and 4 channels, the number of Vulkan's format: by bits and kind.
NUMBERS: Final = {
    (8, ""): (9, 16, 37),
    (8, "s"): (10, 17, 38),
    (8, "u"): (13, 20, 41),
    (8, "i"): (14, 21, 42),
    (16, ""): (70, 77, 91),
    (16, "s"): (71, 78, 92),
    (16, "u"): (74, 81, 95),
    (16, "i"): (75, 82, 96),
    (16, "f"): (76, 83, 97),
    (32, "u"): (98, 101, 107),
    (32, "i"): (99, 102, 108),
    (32, "f"): (100, 103, 109),
}
LAYOUT_KINDS: Final = {"": "", "s": "_snorm", "u": "ui", "i": "i", "f": "f"}
SCALARS: Final[dict[str, Number]] = {"u": "uint", "i": "int"}
RGBA32_FLOAT: Final = 109


def numeric_format(bits: int, kind: str, channels: int, file: str) -> TextureFormat:
    """Return a format of the table; `file` is the type of a channel in the file."""
    index = {1: 0, 2: 1, 3: 2, 4: 2}[channels]
    letter = {"": "u", "s": "i"}.get(kind, kind) + str(bits // 8)
    return TextureFormat(
        NUMBERS[bits, kind][index],
        f"{('r', 'rg', 'rgba')[index]}{bits}{LAYOUT_KINDS[kind]}" if channels != 3 else "",
        SCALARS.get(kind, "float"),
        channels,
        channels * int(file[1:]),
        as_channels(file, channels, letter),
    )


def make_formats() -> dict[str, TextureFormat]:
    """Return the formats by the names that files use."""
    formats = {}
    for bits, kind in NUMBERS:
        for channels, names in ((1, "r"), (2, "rg"), (3, "rgb"), (4, "rgba")):
            if channels == 3 and (bits, kind) not in {(8, ""), (16, ""), (32, "f")}:
                continue
            letter = {"": "u", "s": "i"}.get(kind, kind)
            formats[f"{names}{bits}{kind}"] = numeric_format(
                bits, kind, channels, f"{letter}{bits // 8}"
            )
    # Of half floats the file has single ones, unless the name says otherwise.
    for channels, names in ((1, "r"), (2, "rg"), (4, "rgba")):
        formats[f"{names}16f"] = numeric_format(16, "f", channels, "f4")
        formats[f"{names}16hf"] = numeric_format(16, "f", channels, "f2")
    formats["bgra8"] = dataclasses.replace(
        formats["rgba8"], layout="", read=as_channels("u1", 4, "u1", "bgra")
    )
    formats["rgb565"] = TextureFormat(RGBA32_FLOAT, "", "float", 3, 2, unpack_565)
    formats["rgb10a2"] = TextureFormat(RGBA32_FLOAT, "", "float", 4, 4, unpack_10)
    return formats


FORMATS: Final = make_formats()


@dataclasses.dataclass(frozen=True, eq=False)
class FileTexture:
    """A texture: one to three sides, and texels (None: zero)."""

    name: str
    sides: tuple[int, ...]
    format: TextureFormat
    filter: Filter
    border: Border
    storage: bool
    texels: bytes | None
    line: int

    @property
    def declaration(self) -> str:
        """The type of the sampler or image in GLSL."""
        prefix = {"float": "", "int": "i", "uint": "u"}[self.format.scalar]
        return f"{prefix}{'image' if self.storage else 'sampler'}{len(self.sides)}D"


def read_texture(block: Block) -> FileTexture:
    """Read a block TEXTURE."""
    name = block.head.identifier()
    storage = block.last("STORAGE") is not None
    sides = read_sides(block)
    directive = block.last("FORMAT")
    if directive is None:
        raise block.fault(block.line, "the block has no //!FORMAT")
    if directive.value not in FORMATS:
        raise directive.refusal(f"is not one of {', '.join(FORMATS)}")
    texels = FORMATS[directive.value]
    if storage and not texels.layout:
        raise directive.fault(f"{directive.value} has no STORAGE; use rgba8 or rgba32f")
    filtering = read_word(block, "FILTER", FILTERS)
    if filtering == "LINEAR" and texels.scalar != "float":
        wrong = block.all("FILTER")[-1]
        raise wrong.fault(f"LINEAR is not possible with integers ({directive.value})")
    data = read_hex(block)
    size = texels.file_bytes * int(np.prod(sides))
    if len(data) != size and not (storage and not data):
        wanted = f"{' x '.join(map(str, sides))} texels of {texels.file_bytes} ({directive.value})"
        cause = f"the data has {len(data)} bytes, not {size}: {wanted}"
        raise block.fault(block.body_line, cause)
    return FileTexture(
        name,
        sides,
        texels,
        filtering,
        read_word(block, "BORDER", BORDERS),
        storage,
        texels.read(data).tobytes() if data else None,
        block.line,
    )


def read_sides(block: Block) -> tuple[int, ...]:
    """Read //!SIZE: one to three numbers."""
    directive = block.last("SIZE")
    if directive is None:
        return (1, 1)
    words = directive.value.split()
    if not 1 <= len(words) <= 3 or not all(re.fullmatch(r"\d+", word, re.ASCII) for word in words):
        raise directive.refusal("is not one, two or three numbers")
    sides = tuple(int(word) for word in words)
    largest = MAX_SIDES[len(sides)]
    if not all(1 <= side <= largest for side in sides):
        cause = f"is out of range, 1 to {largest} in {len(sides)} dimensions"
        raise directive.fault(f"{directive.value} {cause}")
    return sides


def read_word(block: Block, name: str, words: tuple[Word, ...]) -> Word:
    """Read a directive whose value is one of some words; the first is the default."""
    directive = block.last(name)
    if directive is None:
        return words[0]
    for word in words:
        if directive.value == word:
            return word
    raise directive.refusal(f"is not one of {', '.join(words)}")


def read_hex(block: Block) -> bytes:
    """Read the body's data: hexadecimal digits, with blanks and line breaks anywhere."""
    wrong = re.search(r"[^0-9a-fA-F\s]", block.body)
    if wrong:
        line = block.body_line + block.body.count("\n", 0, wrong.start())
        raise block.fault(line, f"{wrong[0]!r} is not a hexadecimal digit; the body is data only")
    digits = "".join(block.body.split())
    if len(digits) % 2:
        cause = f"{len(digits)} hexadecimal digits are not full bytes"
        raise block.fault(block.body_line, cause)
    return bytes.fromhex(digits)
