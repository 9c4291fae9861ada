"""The passes of a described method for one frame, as rows for the core."""

from __future__ import annotations

import functools
import itertools
import struct
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from typing import Any, Final

from vkbloom import _core
from vkbloom._custom.described.arithmetic import (
    ArithmeticFault,
    Numbers,
    evaluate,
)
from vkbloom._custom.described.arithmetic import Source as ImageName
from vkbloom._custom.described.binding import (
    Block,
    BoundPass,
    Discarded,
    Number,
    Read,
    Written,
)
from vkbloom._custom.described.layout import scalars
from vkbloom._custom.described.module import Type
from vkbloom._custom.described.schema import (
    ELEMENT,
    FRAME,
    GLOW,
    MAX_ENTRIES,
    PLAIN,
    TARGET,
    Description,
    Loop,
    Output,
    Sampling,
    Value,
)
from vkbloom._custom.described.settings import INDEX, LEVEL
from vkbloom._custom.names import MAX_NAME_LENGTH
from vkbloom._custom.planning import (
    BLOOM_IMAGE,
    MAX_SIDE,
    PICTURE,
    TAKEN,
    TURNS,
    FrameValues,
    PassImage,
    package_row,
)
from vkbloom._custom.rows import IMAGE, SERIALS, STORAGE, UNIFORM, Resource, Row
from vkbloom._custom.shaders import BLACK, COPY, DIFFERENCE, WHITE, package_blend
from vkbloom._custom.textures import FORMATS
from vkbloom._locks import ProcessLock

#: Of one frame.
MAX_RUNS: Final = 256
MAX_LEVELS: Final = 64
MAX_GROUPS: Final = 65535

Key = tuple[str, int | None]

#: Blocks that are too large for the parameters, by their content.
_KEPT_BLOCKS: Final = 64
_BLOCKS: OrderedDict[bytes, Resource] = OrderedDict()
_BLOCKS_LOCK: Final = ProcessLock()


class Plan:
    """Goes through the passes of a description for one frame."""

    def __init__(
        self,
        description: Description,
        passes: list[BoundPass],
        request: FrameValues,
        before: Mapping[Key, PassImage],
    ) -> None:
        self._description = description
        self._request = request
        self._passes = iter(passes)
        self._images: dict[Key, PassImage] = {}
        # Those that the frame before has left, with the keys of images that are read of these.
        self._before = before
        self._histories: dict[str, tuple[Key, int]] = {}
        self._level: int | None = None
        # Of an array of textures of the pass, while its images are found.
        self._element: int | None = None
        self._target: tuple[int, int] | None = None
        # The textures of the pass, by their names in its shader.
        self._bound: dict[str, PassImage] = {}
        self._plain: dict[str, PassImage] = {}
        self._numbered = itertools.count()
        # The values of the description's numbers, until the level or an image is another one.
        self._known: dict[str, Numbers] = {}
        self._owner: Any = None
        self._line = 1
        self._by_item = {id(each.item): each for each in passes}
        self.rows: list[Row] = []

    # The scope of expressions.

    def number(self, name: str) -> Numbers:
        """Return the value of a name."""
        if name == LEVEL:
            if self._level is None:
                raise ArithmeticFault("'level' has a value in loops alone")
            return (float(self._level),)
        if name == ELEMENT and name not in self._request.values:
            if self._element is None:
                raise ArithmeticFault("'element' has a value in arrays of textures alone")
            return (float(self._element),)
        if name == INDEX:
            return (float(self._request.index),)
        if name in self._description.numbers:
            if name not in self._known:
                value, line = self._description.numbers[name]
                try:
                    self._known[name] = self._numbers(value)
                except ArithmeticFault as error:
                    error.line = error.line or line
                    raise
            return self._known[name]
        return (float(self._request.values[name]),)

    def size(self, source: ImageName) -> tuple[int, int]:
        """Return the size of an image."""
        if source.name == TARGET and self._target is not None:
            return self._target
        if source.level is None and source.name in self._bound:
            return self._bound[source.name].size
        found = self._find(source)
        if found is None:
            raise ArithmeticFault(f"{self._shown(source)} is not written before this")
        return found.size

    def _numbers(self, value: Value) -> Numbers:
        if isinstance(value, float):
            return (value,)
        if isinstance(value, tuple):
            found: list[float] = []
            for each in value:
                found += self._numbers(each)
                if len(found) > MAX_ENTRIES:
                    raise ArithmeticFault(f"{len(found)} numbers are more than {MAX_ENTRIES}")
            return tuple(found)
        return evaluate(value, self)

    def _value(self, value: Value, line: int) -> Numbers:
        try:
            return self._numbers(value)
        except ArithmeticFault as error:
            needed = "" if error.line in (None, line) else f"; line {line} needs it"
            raise self._description.source.fault(error.line or line, f"{error}{needed}") from None

    def _whole(self, value: Value, line: int) -> int:
        found = self._value(value, line)
        if len(found) != 1:
            raise self._description.source.fault(line, f"{len(found)} numbers are not one")
        return int(found[0] // 1)

    def _shown(self, source: ImageName) -> str:
        level = "" if source.level is None else f"[{self._index(source)}]"
        return f"{source.name}{level}"

    def _index(self, source: ImageName) -> int | None:
        if source.level is None:
            return None
        found = evaluate(source.level, self)
        return int(found[0] // 1)

    def _find(self, source: ImageName) -> PassImage | None:
        """Return an image; None if it was not written."""
        if source.name == FRAME:
            return PassImage("MAIN", self._request.frame)
        if source.name == GLOW:
            return PassImage("GLOW", self._request.buffers)
        if source.name in PLAIN and source.name not in self._plain:
            image = PassImage(f"{next(self._numbered)}.{source.name}", (1, 1))
            shader = BLACK if source.name == "black" else WHITE
            self.rows.append(package_row(shader, image.name, image.size, ()))
            self._plain[source.name] = image
        if source.name in PLAIN:
            return self._plain[source.name]
        if source.name in self._description.histories:
            return self._find_before(source)
        return self._images.get((source.name, self._index(source)))

    def _find_before(self, source: ImageName) -> PassImage:
        """Return what the frame before has left, with the size that it has in this frame, too."""
        key = self._description.histories[source.name], self._index(source)
        size = self._before[key].size if key in self._before else self._request.frame
        name = f"{source.name}[{key[1]}]"
        self._histories[name] = key, self._line
        return PassImage(name, size)

    # The passes.

    @property
    def images(self) -> Mapping[Key, PassImage]:
        """The images that the outputs are at the end."""
        return self._images

    def run(self) -> tuple[Row, ...]:
        """Return the rows."""
        for step in self._description.steps:
            if not isinstance(step, Loop):
                self._run(self._by_item[id(step)])
                continue
            for level in self._levels(step):
                self._level = level
                self._known = {}
                for item in step.passes:
                    self._run(self._by_item[id(item)])
            self._level = None
            self._known = {}
        return self._finish()

    def _levels(self, loop: Loop) -> range:
        first, last = (self._whole(each, loop.line) for each in (loop.first, loop.last))
        count = (last - first) * loop.step + 1
        if count > MAX_LEVELS:
            cause = f"{count} levels are more than {MAX_LEVELS}"
            raise self._description.source.fault(loop.line, cause)
        return range(first, last + loop.step, loop.step)

    def _run(self, each: BoundPass) -> None:
        item = each.item
        self._target, self._bound, self._known = None, {}, {}
        if item.when is not None and not any(self._value(*item.when)):
            return
        if len(self.rows) >= MAX_RUNS:
            cause = f"the passes run more than {MAX_RUNS} times in a frame"
            raise self._description.source.fault(item.line, cause)
        self._bound = {
            key: self._read(texture.sources, texture.line)
            for key, texture in item.textures.items()
            if key not in each.arrays
        }
        self._known = {}
        sizes = [self._side(written) for written in each.outputs]
        self._target, self._known = sizes[0], {}
        reads = [(self._read_element(read).name, read.is_history) for read in each.reads]
        params = self._pack(each.numbers, each.size)
        resources = [self._resource(block) for block in each.blocks]
        resources += [self._scratch(written) for written in each.discarded]
        changes = each.discarded or any(block.changes for block in each.blocks)
        turn = next(TURNS) if changes else 0
        made = [self._image(w.output, s) for w, s in zip(each.outputs, sizes, strict=True)]
        self.rows.append(
            Row(
                made[0].name,
                each.shader,
                made[0].size,
                tuple(name for name, is_history in reads if not is_history),
                params=params,
                histories=tuple(name for name, is_history in reads if is_history),
                group=each.group,
                groups=self._groups(each),
                resources=tuple(resources),
                turn=turn,
                sampling=tuple((read.sampling or Sampling()).core for read in each.reads),
                format=_format(each.outputs[0].output),
                vertex=each.vertex,
                vertices=item.vertices,
                positions=each.positions,
            )
        )
        for written, image in zip(each.outputs[1:], made[1:], strict=True):
            format = _format(written.output)
            self.rows.append(Row(image.name, each.shader, image.size, format=format, joined=True))
        for number, written in enumerate(each.outputs):
            image = made[number]
            if item.blend is not None and number == 0:
                image = self._blended(each, written.output, image)
            self._keep(written, image)

    def _keep(self, written: Written, image: PassImage) -> None:
        """Note the image that an output now is."""
        self._element = written.element
        output = written.output
        if output.when is None or any(self._value(output.when, output.line)):
            level = self._index_at(output.image, output.line)
            if level is not None and not 0 <= level < MAX_LEVELS:
                cause = f"{output.image.name}: the level {level} is out of range, "
                raise self._description.source.fault(output.line, f"{cause}0 to {MAX_LEVELS - 1}")
            key = output.image.name, level
            if written.is_read and key in self._images:
                cause = (
                    f"outputs: the shader reads {self._shown(output.image)}, which an earlier pass "
                    "wrote and this one writes anew; write another image, and name this one among "
                    "the textures"
                )
                raise self._description.source.fault(output.line, cause)
            self._images[key] = image
        self._element = None

    def _index_at(self, source: ImageName, line: int) -> int | None:
        try:
            return self._index(source)
        except ArithmeticFault as error:
            raise self._description.source.fault(line, str(error)) from None

    def _read_element(self, read: Read) -> PassImage:
        self._element = read.element
        found = self._read(read.texture.sources, read.texture.line)
        self._element = None
        return found

    def _groups(self, each: BoundPass) -> tuple[int, int] | None:
        """Return how many workgroups a pass has; None: as many as cover its first output."""
        if each.item.groups is None:
            return None
        value, line = each.item.groups
        found = self._value(value, line)
        if len(found) != 2 or not all(1 <= number <= MAX_GROUPS for number in found):
            numbers = ", ".join(f"{number:g}" for number in found)
            cause = f"groups: {numbers} are not two numbers, 1 to {MAX_GROUPS}"
            raise self._description.source.fault(line, cause)
        return int(found[0]), int(found[1])

    def _side(self, written: Written) -> tuple[int, int]:
        """Return the size of an output: a share of the frame, or one or two numbers of pixels."""
        output = written.output
        self._element = written.element
        if isinstance(output.size, float):
            found: Numbers = tuple(output.size * side for side in self._request.frame)
        else:
            found = self._value(output.size, output.size_line)
        self._element = None
        if len(found) not in (1, 2):
            cause = f"size: {len(found)} numbers are not width and height"
            raise self._description.source.fault(output.size_line, cause)
        if min(found) < 0:
            cause = f"size: a side of {min(found):g} pixels is out of range, 1 to {MAX_SIDE}"
            raise self._description.source.fault(output.size_line, cause)
        sides = tuple(max(int(each // 1), 1) for each in found)
        if max(sides) > MAX_SIDE:
            cause = f"size: a side of {max(sides)} pixels is out of range, 1 to {MAX_SIDE}"
            raise self._description.source.fault(output.size_line, cause)
        return sides[0], sides[-1]

    def _read(self, sources: tuple[ImageName, ...], line: int) -> PassImage:
        self._line = line
        try:
            for source in sources:
                if (found := self._find(source)) is not None:
                    return found
            shown = " and ".join(self._shown(source) for source in sources)
        except ArithmeticFault as error:
            raise self._description.source.fault(line, str(error)) from None
        names = {source.name for source in sources}
        written = [f"{name}[{at}]" for name, at in self._images if name in names and at is not None]
        cause = f"{shown} is not written before this pass"
        if written:
            cause += f"; written are {', '.join(written)}"
        raise self._description.source.fault(line, cause)

    def _image(self, output: Output, size: tuple[int, int]) -> PassImage:
        name = f"{next(self._numbered)}.{output.image.name}"
        return PassImage(name[:MAX_NAME_LENGTH], size)

    def _blended(self, each: BoundPass, output: Output, drawn: PassImage) -> PassImage:
        """Return what blending makes of what a pass drew, and of what is there."""
        blend = each.item.blend
        assert blend is not None
        there = self._read((blend.image or output.image,), blend.line)
        if there.size != drawn.size:
            cause = f"blend: {there.size} is not the size of the output, {drawn.size}"
            raise self._description.source.fault(blend.line, cause)
        factors = [self._value(part, blend.line) for part in (blend.source, blend.target)]
        image = self._image(output, drawn.size)
        shader, params = package_blend(*(_four(each) for each in factors))
        self.rows.append(
            Row(
                image.name,
                shader,
                image.size,
                (drawn.name, there.name),
                params=params,
                format=_format(output),
            )
        )
        return image

    def _pack(self, numbers: tuple[Number, ...], size: int) -> bytes:
        data = bytearray(size)
        for number in numbers:
            self._write(data, number)
        return bytes(data)

    def _write(self, data: bytearray, number: Number) -> None:
        given = self._value(number.value, number.line)
        places = _places(number.type) if number.type.count or number.type.kind == "struct" else ()
        if number.type.kind == "array" and number.type.count == 0:
            assert number.type.of is not None
            places = _runtime_places(number.type, len(given))
        if len(given) == 1:
            given *= len(places)
        if len(given) != len(places):
            raise self._description.source.fault(
                number.line, f"{number.key}: it takes {len(places)} numbers, not {len(given)}"
            )
        for (kind, bits, offset), value in zip(places, given, strict=True):
            try:
                packed = _packed(kind, bits, value)
            except (OverflowError, struct.error):
                cause = f"{number.key}: {value:g} does not fit into {bits} bits"
                raise self._description.source.fault(number.line, cause) from None
            at = number.offset + offset
            if at + len(packed) > len(data):
                data.extend(bytes(at + len(packed) - len(data)))
            data[at : at + len(packed)] = packed

    def _resource(self, block: Block) -> Resource:
        if block.changes:
            if self._owner is None:
                self._owner = _core.resource_owner()
            data = self._data(block, 16)
            header = struct.pack("=2Q8I", next(SERIALS), len(data), STORAGE, *(0,) * 7)
            return Resource(header, data, self._owner)
        data = self._data(block, 16)
        kind = STORAGE if block.storage else UNIFORM
        key = bytes([kind]) + data
        with _BLOCKS_LOCK:
            if key not in _BLOCKS:
                header = struct.pack("=2Q8I", next(SERIALS), len(data), kind, *(0,) * 7)
                _BLOCKS[key] = Resource(header, data)
                if len(_BLOCKS) > _KEPT_BLOCKS:
                    _BLOCKS.popitem(last=False)
            _BLOCKS.move_to_end(key)
            return _BLOCKS[key]

    def _scratch(self, written: Discarded) -> Resource:
        """Return a new image that nobody reads."""
        if self._owner is None:
            self._owner = _core.resource_owner()
        width, height = self._side(written)
        bits, name = (32, {"int": "i", "uint": "u"}.get(written.kind, "f"))
        layout = FORMATS[f"rgba{bits}{name}"].vulkan
        header = struct.pack(
            "=2Q8I", next(SERIALS), 16 * width * height, IMAGE, layout, 2, width, height, 1, 0, 2
        )
        return Resource(header, None, self._owner)

    def _data(self, block: Block, least: int) -> bytes:
        data = self._pack(block.numbers, block.size)
        return data.ljust(max(-(-len(data) // 16) * 16, least), b"\0")

    # The names of the images.

    def _finish(self) -> tuple[Row, ...]:
        """Return the rows with the names of framebuffers, of the bloom, and of the picture."""
        description, frame = self._description, self._request.frame
        result = self._read((description.result,), description.result_line)
        names = {result.name: BLOOM_IMAGE if description.saves_bloom else PICTURE}
        if not description.saves_bloom and result.size != frame:
            cause = f"the picture's size is {result.size} at the end, not the frame's, {frame}"
            raise description.source.fault(description.result_line, cause)
        taken = set(TAKEN)
        for (name, level), image in self._images.items():
            label = name.lower() if level is None else f"{name.lower()}_{level}"
            label = f"saved_{label}" if label in TAKEN else label
            if image.name not in names and label not in taken and image.name != "MAIN":
                names[image.name] = label[:MAX_NAME_LENGTH]
                taken.add(label)
        names |= self._names_before(names)
        rows = [
            row._replace(
                name=names.get(row.name, row.name),
                reads=tuple(names.get(read, read) for read in row.reads),
                histories=tuple(names[read] for read in row.histories),
                framebuffer=row.name in names and names[row.name] != PICTURE,
            )
            for row in self.rows
        ]
        if result.name in ("MAIN", "GLOW"):
            name = names[result.name]
            rows.append(package_row(COPY, name, result.size, (result.name,)))
        if not description.saves_bloom:
            rows.append(package_row(DIFFERENCE, BLOOM_IMAGE, frame, (PICTURE, "MAIN")))
        return tuple(rows)

    def _names_before(self, names: Mapping[str, str]) -> dict[str, str]:
        """Return the names of the framebuffers that are read of the frame before."""
        made = {}
        for name, (key, line) in self._histories.items():
            shown = f"{key[0]}[{key[1]}]" if key[1] is not None else key[0]
            image = self._images.get(key)
            if image is None:
                raise self._description.source.fault(line, f"{shown} is not written in this frame")
            made[name] = names.get(image.name, PICTURE)
            if made[name] == PICTURE:
                cause = (
                    f"{shown} is the picture, of which the frame before leaves none; write it twice"
                )
                raise self._description.source.fault(line, cause)
        return made


def _format(output: Output) -> int:
    return _core.FORMATS.index(output.format) if output.format else 0


def _four(value: Numbers) -> tuple[float, float, float, float]:
    """Return four factors: one for all, three with the last one for alpha as 1, or four."""
    if len(value) == 1:
        value *= 4
    return (*value, 1.0, 1.0, 1.0)[:4]  # type: ignore[return-value]


@functools.lru_cache(maxsize=256)
def _places(kind: Type) -> tuple[tuple[str, int, int], ...]:
    return tuple(scalars(kind))


def _runtime_places(kind: Type, count: int) -> tuple[tuple[str, int, int], ...]:
    """Return the places of so many numbers in an array that is as long as they need."""
    assert kind.of is not None
    each = _places(kind.of)
    rows: Iterator[tuple[str, int, int]] = (
        (name, bits, offset + index * kind.stride)
        for index in range(-(-count // len(each)))
        for name, bits, offset in each
    )
    return tuple(rows)


def _packed(kind: str, bits: int, value: float) -> bytes:
    """Return a number as it is in a buffer."""
    if kind == "float":
        return struct.pack({16: "=e", 32: "=f", 64: "=d"}[bits], value)
    whole = int(value)
    if kind == "int" and whole >= 1 << (bits - 1):
        raise OverflowError
    return whole.to_bytes(bits // 8, "little", signed=whole < 0)
