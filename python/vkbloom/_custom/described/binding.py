"""What the shaders of a pass are bound to: images, samplers, numbers, outputs, by their names."""

from __future__ import annotations

import dataclasses
import hashlib
import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from vkbloom._custom.described import slang
from vkbloom._custom.described.arithmetic import Source as ImageName
from vkbloom._custom.described.arithmetic import parse
from vkbloom._custom.described.layout import is_within, leaves, path_of, paths
from vkbloom._custom.described.lowering import TEXTURE, ImageKind, read_back, with_kinds
from vkbloom._custom.described.module import (
    INPUT,
    OUTPUT,
    SPEC_ID,
    UNIFORM_CONSTANT,
    Entry,
    Module,
    ModuleFault,
    Type,
    Variable,
    element_of,
)
from vkbloom._custom.described.placing import Places, place
from vkbloom._custom.described.programs import Program
from vkbloom._custom.described.schema import (
    DISCARD,
    GLOW,
    DescribedPass,
    Description,
    Output,
    Sampling,
    Texture,
    Value,
)
from vkbloom._custom.glsl import TARGET
from vkbloom._custom.passes import MAX_THREADS
from vkbloom._custom.rows import MAX_PARAMETERS, MAX_READS, CoreShader
from vkbloom._custom.spirv import shared_bytes
from vkbloom._spelling import did_you_mean, nearest

#: Of a fragment shader, and of a compute shader.
MAX_TARGETS: Final = 4
MAX_IMAGES: Final = 16
#: Locations of inputs that a fragment shader finds without a vertex shader of its own.
POSITIONS: Final = range(4)
MAX_BLOCK_BYTES: Final = 65536
#: Formats of storage images that a shader reads, in SPIR-V.
_READ_FORMATS: Final = {"rgba32float": 1, "rgba16float": 2, "rgba8unorm": 4}
MAX_BUFFER_BYTES: Final = 1 << 24
#: Of SPIR-V: what the core's devices have where their driver has it.
CAPABILITIES: Final = {
    *(0, 1, 9, 11, 22, 25, 49, 50, 51, 55, 56, 61, 62, 63, 64, 65, 66, 67, 68, 5379, 4427, 4433),
    *(5345, 4437, 5301, 5302),
}
#: What ShaderToy gives to each shader.
_SHADERTOY: Final = {
    "iResolution": ("width(target)", "height(target)", "1"),
    "iTime": ("index / 60",),
    "iTimeDelta": ("1 / 60",),
    "iFrameRate": ("60",),
    "iFrame": ("index",),
    "iMouse": ("0",),
    "iDate": ("0",),
    "iSampleRate": ("44100",),
    "iChannelTime": ("index / 60",),
}


#: What some capabilities of SPIR-V stand for that shaders cannot have here.
_UNKNOWN: Final = {
    2: " (geometry)",
    3: " (tessellation)",
    10: " (double)",
    34: " (cube arrays)",
    43: " (textures of one dimension)",
    44: " (images of one dimension)",
    46: ' (texel buffers: defines = { Buffer = "StructuredBuffer" })',
    47: ' (texel buffers: defines = { RWBuffer = "RWStructuredBuffer" })',
}


@dataclasses.dataclass(frozen=True)
class Number:
    """A value of a member: where it is in its block, and what it is."""

    key: str
    type: Type
    offset: int
    value: Value
    line: int


@dataclasses.dataclass(frozen=True)
class Block:
    """A uniform block or a buffer that is a resource of its own; `size` 0: as its data."""

    numbers: tuple[Number, ...]
    size: int
    storage: bool
    changes: bool


@dataclasses.dataclass(frozen=True)
class Read:
    """An image that a pass reads: what it is, how, and the number of an element of an array."""

    texture: Texture
    sampling: Sampling | None
    element: int | None
    is_history: bool


@dataclasses.dataclass(frozen=True)
class Written:
    """An image that a pass writes, and the number of an element of an array.

    `is_read`: Whether the shader also reads it.
    """

    output: Output
    element: int | None
    is_read: bool


@dataclasses.dataclass(frozen=True)
class Discarded(Written):
    """An image that a pass writes and nobody reads; `kind`: of its numbers."""

    kind: str
    variable: int


@dataclasses.dataclass(frozen=True)
class BoundPass:
    """A pass whose shaders are in place.

    - `reads`: The images that it reads, in the order of their bindings.
    - `arrays`: The names of those that are arrays.
    - `numbers`: Those of its parameters, `size` bytes in all.
    - `outputs`: The images that it writes, in the order of its targets.
    """

    item: DescribedPass
    shader: CoreShader
    vertex: CoreShader | None
    positions: bool
    reads: tuple[Read, ...]
    arrays: frozenset[str]
    numbers: tuple[Number, ...]
    size: int
    blocks: tuple[Block, ...]
    outputs: tuple[Written, ...]
    discarded: tuple[Discarded, ...]
    group: tuple[int, int] | None


def bind(description: Description, item: DescribedPass, program: Program, name: str) -> BoundPass:
    """Bind a pass; raise ValueError with file and line where something is missing."""
    return _Binder(description, item, program).bind(name)


@dataclasses.dataclass
class _Stage:
    """An entry point, with what it uses."""

    code: bytes
    module: Module
    entry: Entry
    variables: list[Variable]
    places: Places
    # Storage images that are declared otherwise.
    kinds: dict[int, ImageKind] = dataclasses.field(default_factory=dict)


class _Binder:
    """Binds one pass."""

    def __init__(self, description: Description, item: DescribedPass, program: Program) -> None:
        self._description = description
        self._histories = description.histories
        self._item = item
        self._program = program
        self._slots: list[Read] = []
        self._arrays: set[str] = set()
        self._numbers: list[Number] = []
        self._size = 0
        self._blocks: list[tuple[Block, _Stage, int]] = []
        self._discarded: list[Discarded] = []
        self._used_keys: set[tuple[str, str]] = set()
        self._structs: set[int] = set()
        self._known: set[str] = set()

    def fault(self, cause: str, line: int | None = None) -> ValueError:
        """Return the error of a line, by default that of the pass's file."""
        source = self._description.source
        return source.fault(self._item.shader.line if line is None else line, cause)

    def bind(self, name: str) -> BoundPass:
        """Return the pass with its shaders in place."""
        item, program = self._item, self._program
        try:
            stage = self._open(program.code, program.entry, program.stage)
            if stage.entry.stage == "vertex":
                raise self.fault('entry: a vertex shader is no pass; name it vertex = "NAME"')
            if stage.entry.stage == "compute" and item.shader.vertex is not None:
                raise self.fault("vertex: a compute shader has no vertex shader")
            if stage.entry.stage == "compute" and item.blend is not None:
                cause = (
                    "blend: a compute shader writes storage images, which do not blend; let it read"
                    " the image and add it"
                )
                raise self.fault(cause, item.blend.line)
            vertex = None
            if program.vertex is not None:
                vertex = self._open(program.vertex, None, "vertex")
            self._bind_resources(stage, vertex)
            outputs = self._bind_outputs(stage)
            # Images that are discarded are resources, after the others.
            for number, each in enumerate(self._discarded):
                binding = len(self._slots) + len(self._blocks) + number + 1
                stage.places.bindings[each.variable] = binding
            positions = self._check_inputs(stage, vertex)
            self._check_keys()
            code = self._code(stage, name)
            group = None
            if stage.entry.stage == "compute":
                threads = stage.module.workgroup(stage.entry)
                if not 1 <= math.prod(threads) <= MAX_THREADS:
                    shown = " x ".join(map(str, threads))
                    raise ModuleFault(f"{shown} threads are out of range, 1 to {MAX_THREADS}")
                group = item.tile or threads[:2]
                words = struct.unpack(f"={len(code.code) // 4}I", code.code)
                code = CoreShader(*code[:3], threads[0], threads[1], shared_bytes(words))
            return BoundPass(
                item,
                code,
                None if vertex is None else self._code(vertex, name),
                positions,
                tuple(self._slots),
                frozenset(self._arrays),
                tuple(self._numbers),
                self._size,
                tuple(block for block, _, _ in self._blocks),
                outputs,
                tuple(self._discarded),
                group,
            )
        except ModuleFault as error:
            raise self.fault(f"{item.shader.file}: {error}") from None
        except (IndexError, KeyError, struct.error):
            raise self.fault(f"{item.shader.file}: the SPIR-V is not valid") from None

    def _open(self, code: bytes, entry: str | None, stage: str | None) -> _Stage:
        module = Module(code)
        if len(module.entries) == 1 and entry is not None:
            entry = module.entries[0].name
        found = module.entry(entry, stage)
        for number, name in self._program.names:
            rename(module, number, name)
        textures = {
            each.id
            for each in module.variables(found)
            if is_stored(each) and self._key(self._item.textures, each)
        }
        if textures:
            return self._open(with_kinds(code, dict.fromkeys(textures, TEXTURE)), entry, stage)
        unknown = module.capabilities - CAPABILITIES
        if unknown:
            least = min(unknown)
            known = _UNKNOWN.get(least, "")
            raise ModuleFault(f"the shader needs the capability {least}{known} of SPIR-V")
        if module.is_endless(found):
            what = "vertex shader" if stage == "vertex" else "shader"
            raise ModuleFault(f"the {what} has a loop that never ends, in {found.name}")
        places = Places(constants=self._constants(module))
        return _Stage(code, module, found, module.variables(found), places)

    def _constants(self, module: Module) -> dict[int, int]:
        """Return the words of the specialization constants that the pass names."""
        known = {}
        for identity, marks in module.decorations.items():
            if SPEC_ID in marks and identity in module.defined:
                known[module.names.get(identity, "")] = known[str(marks[SPEC_ID])] = identity
        made = {}
        if self._program.names:
            return {}  # naga has put them in their places
        for key, value in self._item.shader.constants:
            if key not in known:
                raise self._unknown("constants", key, known, self._item.shader.line)
            word = module.defined[known[key]]
            kind = module.type_of(word[1]).kind
            if kind != "float" and not -(2**31) <= value < 2**32:
                cause = f"constants: {key}: {value:g} does not fit into 32 bits"
                raise self.fault(cause, self._item.shader.line)
            data = (
                struct.pack("<f", value) if kind == "float" else struct.pack("<q", int(value))[:4]
            )
            made[known[key]] = struct.unpack("<I", data)[0]
        return made

    def _unknown(
        self, what: str, key: str, known: Sequence[str] | Mapping[str, object], line: int
    ) -> ValueError:
        names = ", ".join(each for each in known if each) or "none"
        near = did_you_mean(key, known)
        return self.fault(f"{what}: the shader has no {key!r}; it has {names}{near}", line)

    def _labels(self, variable: Variable) -> list[str]:
        """Return the names under which a description can mention a variable."""
        # Slang puts parameters of an entry point and of a file into structures.
        labels = [variable.name.removeprefix("entryPointParams."), variable.place]
        array = element_of(variable.binding)
        binding, suffix = (variable.binding, "") if array is None else (array[0], f"[{array[1]}]")
        if self._program.shift and variable.storage != 9:
            for kind, shift in slang.SHIFTS.items():
                if shift <= binding < shift + 100:
                    labels.append(f"{kind}{binding - shift}{suffix}")
        return [label for label in labels if label]

    def _array_labels(self, variable: Variable) -> list[str]:
        """Return the names of the array of which a variable is an element."""
        if variable.element is None:
            return []
        return [label.removesuffix(f"[{variable.element}]") for label in self._labels(variable)]

    def _key(self, keys: Mapping[str, object], variable: Variable) -> str | None:
        """Return the key that names a variable, or the array of which it is an element."""
        labels = (*self._labels(variable), *self._array_labels(variable))
        return next((label for label in labels if label in keys), None)

    def _find(self, what: str, keys: Mapping[str, object], variable: Variable) -> str | None:
        """Return the key that names a variable, and note that it is used."""
        self._known |= {*self._labels(variable), *self._array_labels(variable)}
        found = [key for key in self._labels(variable) if key in keys]
        if len(found) > 1:
            raise self.fault(f"{what}: {found[0]} and {found[1]} are the same one")
        key = self._key(keys, variable)
        if key:
            self._used_keys.add((what, key))
        if key and not found:
            self._arrays.add(key)
        return key

    def _show(self, variable: Variable) -> str:
        labels = self._labels(variable)
        return f"{labels[0]!r}" + (f" ({', '.join(labels[1:])})" if labels[1:] else "")

    def _bind_resources(self, stage: _Stage, vertex: _Stage | None) -> None:
        self._check_places(stage)
        for kind in ("sampled", "image"):
            for variable in stage.variables:
                if variable.storage == UNIFORM_CONSTANT and variable.type.kind == kind:
                    if is_stored(variable):
                        continue
                    self._bind_texture(stage, variable)
        for variable in stage.variables:
            if variable.storage == UNIFORM_CONSTANT and variable.type.kind == "sampler":
                self._bind_sampler(stage, variable)
            elif variable.storage == UNIFORM_CONSTANT and variable.type.kind not in (
                "sampled",
                "image",
            ):
                raise self.fault(f"{self._show(variable)}: it is neither a texture nor a sampler")
        self._order_slots(stage)
        for each in (stage, vertex) if vertex else (stage,):
            for variable in each.variables:
                if variable.is_block or variable.is_buffer:
                    self._bind_block(each, variable)
                elif each is vertex and variable.storage == UNIFORM_CONSTANT:
                    raise self.fault(f"the vertex shader reads {self._show(variable)}")
        # Resources come after the images read.
        for number, (_, owner, identity) in enumerate(self._blocks):
            owner.places.bindings[identity] = len(self._slots) + number + 1

    def _order_slots(self, stage: _Stage) -> None:
        """Put images of the frame before after the others, as in Row."""
        order = sorted(range(len(self._slots)), key=lambda slot: self._slots[slot].is_history)
        self._slots = [self._slots[slot] for slot in order]
        for identity, binding in stage.places.bindings.items():
            stage.places.bindings[identity] = order.index(binding - 1) + 1

    def _check_places(self, stage: _Stage) -> None:
        """Check that no two variables have one place."""
        seen: dict[str, Variable] = {}
        for variable in stage.variables:
            if variable.storage in (INPUT, OUTPUT, 9) or variable.storage not in (0, 2, 12):
                continue
            other = seen.setdefault(variable.place, variable)
            if other is not variable:
                raise self.fault(
                    f"{self._item.shader.file}: {other.name!r} and {variable.name!r} have the same "
                    f"binding, {variable.place}"
                )

    def _bind_texture(self, stage: _Stage, variable: Variable) -> None:
        kind = variable.type
        image = kind.of if kind.kind == "sampled" else kind
        assert image is not None
        if not _is_plain(image):
            raise self.fault(
                f"textures: {self._show(variable)} is no texture of two dimensions with floats"
            )
        key = self._find("textures", self._item.textures, variable)
        texture = self._item.textures[key] if key else self._default_texture(variable)
        if texture is None:
            name = self._labels(variable)[0]
            shown = name if name.isidentifier() else f'"{name}"'
            others = self._item.textures.keys() - {key for _, key in self._used_keys}
            near = nearest(name, others)
            line = None if near is None else self._item.textures[near].line
            raise self.fault(
                f"textures: the shader reads {self._show(variable)}, which the pass does not name"
                + (f"; it names {near!r}" if near else "")
                + f'; add {shown} = "glow", or another image, below [passes.textures]',
                line,
            )
        stage.places.bindings[variable.id] = len(self._slots) + 1
        how = texture.sampling if kind.kind == "sampled" else None
        is_history = texture.sources[0].name in self._histories
        self._slots.append(Read(texture, how, variable.element, is_history))
        if len(self._slots) > MAX_READS:
            raise self.fault(f"textures: the shader reads more than {MAX_READS}")

    def _default_texture(self, variable: Variable) -> Texture | None:
        if self._item.shader.language == "shadertoy" and variable.name == "iChannel0":
            return Texture((ImageName((GLOW, None)),), Sampling(), self._item.line)
        return None

    def _bind_sampler(self, stage: _Stage, variable: Variable) -> None:
        """Bind a sampler to an image whose own sampler is like it, or is not used."""
        key = self._find("samplers", self._item.samplers, variable)
        sampling = self._item.samplers[key][0] if key else Sampling()
        for number, read in enumerate(self._slots):
            if read.sampling in (None, sampling):
                self._slots[number] = dataclasses.replace(read, sampling=sampling)
                stage.places.bindings[variable.id] = number + 1
                return
        if not self._slots:
            raise self.fault(f"samplers: {self._show(variable)} samples no texture")
        self._slots.append(dataclasses.replace(self._slots[0], sampling=sampling))
        stage.places.bindings[variable.id] = len(self._slots)

    def _bind_block(self, stage: _Stage, variable: Variable) -> None:
        """Give a place to a block, and values to its members."""
        numbers = tuple(self._members(variable))
        kind, size = variable.type, variable.type.size
        begin = -(-self._size // 16) * 16
        most = MAX_BUFFER_BYTES if variable.is_buffer else MAX_BLOCK_BYTES
        if kind.kind != "struct" or size > most:
            cause = f"{size} bytes are more than {most}" if size > most else "it is no structure"
            raise self.fault(f"values: {self._show(variable)} cannot be bound: {cause}")
        if variable.is_block and kind.id not in self._structs and begin + size <= MAX_PARAMETERS:
            self._structs.add(kind.id)
            stage.places.bindings[variable.id] = 0
            stage.places.offsets[kind.id] = begin
            self._size = begin + size
            self._numbers += [
                dataclasses.replace(each, offset=each.offset + begin) for each in numbers
            ]
            return
        changes = variable.is_buffer and not variable.read_only
        if changes:
            size += _last_stride(kind)
        self._blocks.append((Block(numbers, size, variable.is_buffer, changes), stage, variable.id))

    def _members(self, variable: Variable) -> Iterator[Number]:
        """Return the values of a block's members; raise ValueError if one has none."""
        given = dict(self._given(variable))
        self._known |= {path for path, _, _ in paths(variable.type)}
        found = []
        for path, kind, offset in paths(variable.type):
            if path in given:
                found.append((path, _number(kind, offset, *given.pop(path))))
        if given:
            path, (_, _, line) = next(iter(given.items()))
            names = [each for each, _, _ in paths(variable.type) if each]
            raise self.fault(
                f"values: {self._show(variable)} has no {path!r}; it has {', '.join(names[:40])}"
                f"{did_you_mean(path, names)}",
                line,
            )
        if variable.is_buffer and not found:
            if variable.read_only:
                raise self.fault(
                    f"values: the shader reads the buffer {self._show(variable)}, which has no data"
                )
            return
        covered = [path for path, _ in found]
        for index, path, kind in leaves(variable.type):
            used = variable.members is None or any(
                index[: len(each)] == each[: len(index)] for each in variable.members
            )
            if used and not any(is_within(path, each) for each in covered):
                self._check_missing(variable, path, kind, covered)
        yield from (number for _, number in found)

    def _check_missing(self, variable: Variable, path: str, kind: Type, covered: list[str]) -> None:
        within = any(is_within(each, path) for each in covered)
        if within or not kind.size or path.rpartition(".")[2].lower().lstrip("_").startswith("pad"):
            return
        near = nearest(path, self._item.values.keys() - {key for _, key in self._used_keys})
        raise self.fault(
            f"values: the shader reads {path!r} of {self._show(variable)}, which the pass does not "
            "give" + (f"; it gives {near!r}" if near else "") + f"; add {path} = 1.0, or an "
            "expression, below [passes.values]",
            None if near is None else self._item.values[near][1],
        )

    def _given(self, variable: Variable) -> Iterator[tuple[str, tuple[str, Value, int]]]:
        """Return what the description gives of a block: path, key, value and line."""
        names = {path for path, _, _ in paths(variable.type)}
        if self._item.shader.language == "shadertoy":
            yield from self._shadertoy(names)
        for key, (value, line) in self._item.values.items():
            for label in self._labels(variable):
                if key == label or key.startswith((f"{label}.", f"{label}[")):
                    self._used_keys.add(("values", key))
                    yield key[len(label) :].lstrip("."), (key, value, line)
                    break
            else:
                path = path_of(key, names)
                if path:
                    if ("values", key) in self._used_keys:
                        raise self.fault(
                            f"values: {key!r} is in several blocks; say BLOCK.{key}", line
                        )
                    self._used_keys.add(("values", key))
                    yield path, (key, value, line)

    def _shadertoy(self, names: set[str]) -> Iterator[tuple[str, tuple[str, Value, int]]]:
        for key, texts in _SHADERTOY.items():
            if key in names and key not in self._item.values:
                yield key, (key, tuple(map(parse, texts)), self._item.line)
        if "iChannelResolution" in names and "iChannelResolution" not in self._item.values:
            parts: list[str] = []
            for number in range(4):
                texture = self._item.textures.get(f"iChannel{number}")
                image = texture.sources[0].name if texture else GLOW
                level = texture and texture.sources[0].level
                shown = image if level is None else GLOW
                parts += [f"width({shown})", f"height({shown})", "1"]
            key = "iChannelResolution"
            yield key, (key, tuple(map(parse, parts)), self._item.line)

    def _bind_outputs(self, stage: _Stage) -> tuple[Written, ...]:
        """Return the outputs in the order of the targets; place storage images."""
        compute = stage.entry.stage == "compute"
        targets = self._targets(stage)
        targets, outputs = self._without_discarded(targets, compute=compute)
        if not targets:
            raise self.fault("output: the shader writes no image")
        most = MAX_IMAGES if compute else MAX_TARGETS
        if len(targets) > most:
            raise self.fault(f"outputs: {len(targets)} are more than {most}")
        if "" in outputs:
            if len(targets) > 1:
                names = ", ".join(self._show(each) for each in targets)
                raise self.fault(
                    f"output: the shader writes {len(targets)} images, {names}; name all of them "
                    "below [passes.outputs]",
                    outputs[""].line,
                )
            found = [("", targets[0])]
        else:
            found = self._match_outputs(targets, outputs, compute=compute)
        made = []
        read = read_back(stage.module, stage.entry) if compute else set()
        for number, (key, target) in enumerate(found):
            output = outputs[key]
            if compute:
                stage.places.bindings[target.id] = TARGET + number
            elif (target.location or 0) != number:
                raise self.fault("outputs: their locations are not 0, 1, 2 without gaps")
            if target.id in read:
                # Few devices read storage images without a format.
                declared = {number: name for name, number in _READ_FORMATS.items()}
                format = output.format or declared.get(target.type.image[5], "rgba32float")
                stage.kinds[target.id] = ImageKind(2, _READ_FORMATS[format])
                output = dataclasses.replace(output, format=format)
            made.append(Written(output, target.element, target.id in read))
        return tuple(made)

    def _targets(self, stage: _Stage) -> list[Variable]:
        """Return the storage images of a compute shader, or the outputs of a fragment shader."""
        if stage.entry.stage != "compute":
            found = [
                each
                for each in stage.variables
                if each.storage == OUTPUT and each.location is not None
            ]
            return sorted(found, key=lambda each: each.location or 0)
        found = [each for each in stage.variables if is_stored(each)]
        for each in found:
            if not _is_plain(each.type) and self._discards(each) is None:
                raise self.fault(
                    f"outputs: {self._show(each)} is no image of two dimensions with floats"
                )
        return found

    def _without_discarded(
        self, targets: list[Variable], *, compute: bool
    ) -> tuple[list[Variable], dict[str, Output]]:
        """Return the targets and the outputs that are read; note the others."""
        outputs = {
            key: output
            for key, output in self._item.outputs.items()
            if output.image.name != DISCARD
        }
        kept = []
        for target in targets:
            key = self._discards(target) if compute else None
            if key is None:
                kept.append(target)
                continue
            assert target.type.of is not None
            output = self._item.outputs[key]
            self._discarded.append(
                Discarded(output, target.element, False, target.type.of.kind, target.id)
            )
        return kept, outputs

    def _discards(self, target: Variable) -> str | None:
        """Return the key of an output that is discarded."""
        key = self._key(self._item.outputs, target)
        return key if key and self._item.outputs[key].image.name == DISCARD else None

    def _match_outputs(
        self, targets: list[Variable], outputs: Mapping[str, Output], *, compute: bool
    ) -> list[tuple[str, Variable]]:
        """Return keys with their targets: in the order of locations, or of the description."""

        def labels(target: Variable) -> list[str]:
            if not compute:
                return [str(target.location), target.name]
            return [*self._labels(target), *self._array_labels(target)]

        found = []
        for target in targets:
            key = next((label for label in labels(target) if label in outputs), None)
            if key is None:
                raise self.fault(
                    f"outputs: the shader writes {labels(target)[0]!r}, which the pass does not "
                    "name"
                )
            found.append((key, target))
        order = list(outputs)
        for key, output in outputs.items():
            if key not in dict(found):
                known = {label: 0 for each in targets for label in labels(each)}
                raise self._unknown("outputs", key, known, output.line)
        if not compute:
            return sorted(found, key=lambda each: each[1].location or 0)
        return sorted(found, key=lambda each: (order.index(each[0]), each[1].element or 0))

    def _check_inputs(self, stage: _Stage, vertex: _Stage | None) -> bool:
        """Check that a fragment shader finds its inputs; return whether it reads positions."""
        wanted = {
            each.location: each
            for each in stage.variables
            if each.storage == INPUT and each.location is not None
        }
        if vertex is not None:
            given = {each.location for each in vertex.variables if each.storage == OUTPUT}
            attributes = [
                each
                for each in vertex.variables
                if each.storage == INPUT and each.location is not None
            ]
            if attributes:
                raise self.fault(
                    f"vertex: the vertex shader reads the attribute {attributes[0].name!r}, and "
                    "there are no vertices; leave vertex out: a triangle covers the target, and "
                    "inputs are the position in it"
                )
            for location, each in wanted.items():
                if location not in given:
                    raise self.fault(f"vertex: it does not write the input {each.name!r}")
            return False
        for location, each in wanted.items():
            kind = each.type.of if each.type.kind == "vector" else each.type
            if kind is not None and kind.kind in ("int", "uint"):
                # Such as the layer of an array, which there is not.
                stage.places.zeros.add(each.id)
                continue
            if location not in POSITIONS or kind is None or kind.kind != "float":
                name = f"{each.name!r}" if each.name else "an input"
                raise self.fault(
                    f"vertex: the shader reads {name} at location {location}; without "
                    'vertex = "NAME" there are positions at locations 0 to 3 alone'
                )
        return any(each.id not in stage.places.zeros for each in wanted.values())

    def _check_keys(self) -> None:
        """Check that the shaders have all that the description names."""
        for what in ("textures", "samplers", "values"):
            given: Mapping[str, object] = getattr(self._item, what)
            for key in given:
                if (what, key) not in self._used_keys:
                    entry = given[key]
                    line = entry.line if isinstance(entry, Texture) else entry[1]  # type: ignore[index]
                    near = did_you_mean(key, self._known)
                    raise self.fault(f"{what}: the shader does not use {key!r}{near}", line)

    def _code(self, stage: _Stage, name: str) -> CoreShader:
        module = stage.module
        if stage.kinds:
            module = Module(with_kinds(stage.code, stage.kinds))
            stage.places.formatted = range(stage.module.words[3], module.words[3])
        code = place(module, stage.entry, stage.places)
        return CoreShader(name, code, hashlib.sha256(code).digest()[:16])


def is_stored(variable: Variable) -> bool:
    """Whether a variable is a storage image."""
    kind = variable.type
    return variable.storage == UNIFORM_CONSTANT and kind.kind == "image" and kind.image[4] == 2


def _is_plain(image: Type) -> bool:
    """Whether an image has two dimensions, one layer, one sample, and floats."""
    if image.kind != "image" or image.of is None:
        return False
    dimensions, _, arrayed, multisampled = image.image[:4]
    return dimensions == 1 and not arrayed | multisampled and image.of.kind == "float"


def _last_stride(kind: Type) -> int:
    """Return the bytes of an element of an array without a length, at the end of a structure."""
    last = kind.members[-1].type if kind.members else kind
    return last.stride if last.kind == "array" and last.count == 0 else 0


def _number(kind: Type, offset: int, key: str, value: Value, line: int) -> Number:
    """Return the value of a part; of a structure around an array, its numbers are the array's."""
    while len(kind.members) == 1:
        offset += kind.members[0].offset
        kind = kind.members[0].type
    return Number(key, kind, offset, value, line)


def rename(module: Module, number: str, name: str) -> None:
    """Give a name to a variable, set.binding, or to a member of its block, set.binding.member."""
    parts = number.split(".")
    for identity, marks in module.decorations.items():
        if [str(marks.get(34)), str(marks.get(33))] != parts[:2] or identity not in module.defined:
            continue
        if len(parts) == 2:
            module.names[identity] = name
            continue
        word = module.defined.get(module.defined[identity][1], ())
        kind = word[3] if len(word) > 3 else 0
        for index in parts[2:-1]:
            kind = (*module.defined.get(kind, ()), *[0] * 64)[2 + int(index)]
        module.member_names[kind, int(parts[-1])] = name
