"""The description of a method, bloom.toml: what an engine's CPU code does."""

from __future__ import annotations

import ast
import dataclasses
import functools
import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from vkbloom._custom.described.arithmetic import (
    ArithmeticFault,
    Expression,
    names_in,
    parse,
    source_of,
)
from vkbloom._custom.described.arithmetic import (
    Source as ImageName,
)
from vkbloom._custom.described.settings import (
    INDEX,
    LEVEL,
    check_name,
    read_number,
    read_settings,
)
from vkbloom._custom.described.tables import Table, read_tables
from vkbloom._custom.names import HISTORY
from vkbloom._custom.params import Param
from vkbloom._custom.source import Source
from vkbloom._spelling import did_you_mean

#: Images that every pass can read.
FRAME: Final = "frame"
GLOW: Final = "glow"
#: Images of one texel, which engines bind where there is nothing else.
PLAIN: Final = ("black", "white")
#: An output that nobody reads.
DISCARD: Final = "discard"
#: The number of an image in an array of the shader, in what is said of the whole array.
ELEMENT: Final = "element"
#: The target of the pass.
TARGET: Final = "target"

FILTERS: Final = ("linear", "nearest")
BORDERS: Final = ("clamp", "repeat", "mirror", "zero")
LANGUAGES: Final = {
    "glsl": (".glsl", ".frag", ".comp", ".vert", ".fs", ".fsh"),
    "shadertoy": (".shadertoy",),
    "hlsl": (".hlsl", ".fx", ".hlsli", ".cginc", ".compute", ".usf"),
    "slang": (".slang",),
    "shaderlab": (".shader",),
    "wgsl": (".wgsl",),
    "wesl": (".wesl",),
    "spirv": (".spv",),
}
#: Entry points of languages that have but one.
MAINS: Final = {"glsl": "main", "shadertoy": "mainImage"}
STAGES: Final = ("fragment", "compute")
#: Formats of outputs; "" is the setting `format`.
FORMATS: Final = ("", "rgba8unorm", "rgba16float", "rgba32float")
MAX_VERTICES: Final = 1 << 16
#: Options of slangc that say how it compiles, and what may follow them. Others name files that it
#: would write, and libraries that it would load.
OPTION: Final = re.compile(
    r"-(?:D\w+(?:=[^\n]*)?|U\w+|O[0-3]?|g[0-3]?|W[\w,-]*|profile|capability|stage-capability|std"
    r"|matrix-layout-(?:row|column)-major|fvk-[\w-]+|fspv-[\w-]+|emit-spirv-\w+|allow-glsl"
    r"|fp-mode|floating-point-mode|denorm(?:al)?-mode-fp(?:16|32|64)|no-mangle|HV|warnings-disable"
    r"|ignore-capabilities|restrictive-capability-check|minimum-slang-optimization"
    r"|preserve-params|zero-initialize|loop-inversion|unscoped-enum"
    r"|enable-experimental-\w+|disable-\w+[\w-]*|default-image-format-unknown"
    r"|force-glsl-scalar-layout|bindless-space-index)"
    r"|[\w+][\w+.,]*"
)
MAX_PASSES: Final = 64
MAX_NUMBERS: Final = 256
#: Entries of a list of numbers.
MAX_ENTRIES: Final = 4096

Value = Expression | float | tuple[Expression | float, ...]


@dataclasses.dataclass(frozen=True)
class Sampling:
    """How a sampler reads."""

    filter: str = "linear"
    border: str = "clamp"

    @property
    def core(self) -> int:
        """The core's number: VKB_SAMPLING_*."""
        return (self.filter == "nearest") + 2 * BORDERS.index(self.border)


@dataclasses.dataclass(frozen=True)
class Texture:
    """What a texture of a shader is: the first of some images that there is."""

    sources: tuple[ImageName, ...]
    sampling: Sampling
    line: int


@dataclasses.dataclass(frozen=True)
class Output:
    """An image that a pass writes. `size` is an expression, or a share of the frame.

    `when`: Where this is 0, the pass has a place to write to, and nobody reads it.
    """

    image: ImageName
    size: Value
    format: str
    line: int
    size_line: int
    when: Expression | None = None


@dataclasses.dataclass(frozen=True)
class Blend:
    """Factors of what the shader gives and of what is there."""

    source: Value
    target: Value
    image: ImageName | None
    line: int


@dataclasses.dataclass(frozen=True)
class Shader:
    """A shader of a pass: what is compiled."""

    file: str
    language: str
    entry: str | None
    stage: str | None
    vertex: str | None
    include: tuple[str, ...]
    defines: tuple[tuple[str, str], ...]
    features: tuple[tuple[str, bool], ...]
    dependencies: tuple[tuple[str, str], ...]
    options: tuple[str, ...]
    constants: tuple[tuple[str, float], ...]
    number: int
    line: int


@dataclasses.dataclass(frozen=True)
class DescribedPass:
    """A pass."""

    shader: Shader
    textures: Mapping[str, Texture]
    samplers: Mapping[str, tuple[Sampling, int]]
    values: Mapping[str, tuple[Value, int]]
    outputs: Mapping[str, Output]
    blend: Blend | None
    when: tuple[Expression, int] | None
    tile: tuple[int, int] | None
    groups: tuple[Value, int] | None
    vertices: int
    line: int


@dataclasses.dataclass(frozen=True)
class Loop:
    """Passes that run for each of some levels. `step` is 1 down the levels, -1 up."""

    passes: tuple[DescribedPass, ...]
    first: Value
    last: Value
    step: int
    line: int


@dataclasses.dataclass(frozen=True)
class Description:
    """All of a description."""

    source: Source
    params: tuple[Param, ...]
    numbers: Mapping[str, tuple[Value, int]]
    steps: tuple[DescribedPass | Loop, ...]
    result: ImageName
    saves_bloom: bool
    result_line: int

    @property
    def passes(self) -> Iterator[DescribedPass]:
        """All passes, in order."""
        for step in self.steps:
            yield from step.passes if isinstance(step, Loop) else (step,)

    @functools.cached_property
    def histories(self) -> dict[str, str]:
        """The outputs that passes read as the frame before left them, by the name there."""
        read = {
            source.name
            for each in self.passes
            for texture in each.textures.values()
            for source in texture.sources
            if source.name not in self.outputs
        }
        return {name: name.removeprefix(HISTORY) for name in sorted(read) if HISTORY in name}

    @functools.cached_property
    def outputs(self) -> set[str]:
        """The names of all outputs that are read."""
        names = {out.image.name for each in self.passes for out in each.outputs.values()}
        return names - {DISCARD}

    def line_of(self, framebuffer: str) -> int:
        """Return the line of the first output that a framebuffer shows; else that of the result."""
        lines: dict[str, int] = {}
        for each in self.passes:
            for output in each.outputs.values():
                lines.setdefault(output.image.name, output.line)
        level = framebuffer.rpartition("_")
        name = level[0] if level[0] in lines and level[2].isdecimal() else framebuffer
        return lines.get(name, lines.get(self.result.name, self.result_line))

    #: A description has no textures and buffers of its own.
    embedded: Mapping[str, Any] = dataclasses.field(default_factory=dict)


def read_schema(source: Source) -> Description:
    """Read a description; raise ValueError with file and line if it is not valid."""
    table = read_tables(source)
    params = tuple(read_settings(table.table("settings")))
    numbers = _read_numbers(table.table("numbers"))
    shared = _read_shared(table)
    steps = tuple(_read_step(each, shared) for each in table.tables("passes"))
    if not steps:
        raise table.fault("passes: the description has none; a pass begins with [[passes]]")
    key = "bloom" if "bloom" in table else "picture"
    if ("bloom" in table) == ("picture" in table):
        raise table.fault(
            'give either bloom = "IMAGE", which is added to the picture, or picture = "IMAGE", '
            "which replaces it",
            key,
        )
    result = _image(table, key, table.text(key))
    line = table.line(key)
    table.finish("a description")
    made = Description(source, params, numbers, steps, result, key == "bloom", line)
    if len(list(made.passes)) > MAX_PASSES:
        raise source.fault(1, f"more than {MAX_PASSES} passes")
    _check_names(made)
    return made


def _image(table: Table, key: str, text: str | None) -> ImageName:
    try:
        return source_of(text or "")
    except ArithmeticFault as error:
        raise table.fault(f"{key}: {error}", key) from None


def _value(table: Table, key: str, value: object) -> Value:
    """Return a number, an expression, or several."""
    if isinstance(value, bool | int | float):
        return read_number(table, key, value)
    if isinstance(value, str):
        try:
            return parse(value)
        except ArithmeticFault as error:
            raise table.fault(f"{key}: {error}", key) from None
    if isinstance(value, list) and value:
        parts = [part for each in value for part in _parts(_value(table, key, each))]
        if len(parts) > MAX_ENTRIES:
            raise table.fault(f"{key}: {len(parts)} numbers are more than {MAX_ENTRIES}", key)
        return tuple(parts)
    table.refuse(key, value, "is not a number, an expression, or a list of them")


def _parts(value: Value) -> tuple[Expression | float, ...]:
    return value if isinstance(value, tuple) else (value,)


def _read_values(table: Table) -> dict[str, tuple[Value, int]]:
    return {key: (_value(table, key, table.get(key, object)), table.line(key)) for key in table}


def _read_numbers(table: Table) -> dict[str, tuple[Value, int]]:
    if len(list(table)) > MAX_NUMBERS:
        raise table.fault(f"numbers: more than {MAX_NUMBERS}")
    for name in table:
        check_name(table, "numbers", name)
    numbers = _read_values(table)
    for name in numbers:
        _check_cycle(table, numbers, name)
    return numbers


def _check_cycle(table: Table, numbers: Mapping[str, tuple[Value, int]], name: str) -> None:
    """Check that a number does not depend on itself."""
    waiting = [name]
    for each in waiting:
        value, _ = numbers[each]
        for part in _parts(value):
            needed = {*()} if isinstance(part, float) else names_in(part)[0] & numbers.keys()
            if name in needed:
                raise table.fault(f"numbers: {name!r} depends on itself", name)
            waiting += needed - {*waiting}


@dataclasses.dataclass(frozen=True)
class _Shared:
    """What a description says for all of its passes."""

    include: tuple[str, ...]
    defines: dict[str, str]
    features: dict[str, bool]
    dependencies: dict[str, str]
    options: tuple[str, ...]


def _read_shared(table: Table, above: _Shared | None = None) -> _Shared:
    known = above or _Shared((), {}, {}, {}, ())
    features = table.table("features")
    dependencies = table.table("dependencies")
    return _Shared(
        (*table.texts("include"), *known.include),
        {**known.defines, **_read_defines(table)},
        {**known.features, **{key: features.get(key, bool) for key in features}},
        {**known.dependencies, **{key: dependencies.text(key) or "" for key in dependencies}},
        (*known.options, *_read_options(table)),
    )


def _read_options(table: Table) -> tuple[str, ...]:
    """Return options of slangc: those that name no files."""
    options = table.texts("options")
    for each in options:
        if not OPTION.fullmatch(each):
            table.refuse("options", each, "is not an option that a shader may give to slangc")
    return options


def _read_defines(table: Table) -> dict[str, str]:
    made = {}
    defines = table.table("defines")
    for key in defines:
        value = defines.get(key, (str, int, float, bool))
        if not key.isidentifier() or not key.isascii():
            raise defines.fault(f"defines: {key!r} is not a name", key)
        text = str(int(value)) if isinstance(value, bool) else str(value)
        if "\n" in text or len(text) > 200:
            defines.refuse(key, value, "is not one line")
        made[key] = text
    return made


def _read_step(table: Table, shared: _Shared) -> DescribedPass | Loop:
    """Read a pass, or a loop of one or several."""
    keys = [key for key in ("down", "up") if key in table]
    if not keys:
        if "steps" in table:
            raise table.fault(
                "steps: they need down = [first, last] or up = [first, last]", "steps"
            )
        return _read_pass(table, shared)
    if len(keys) == 2:
        raise table.fault("a pass goes either down or up", "up")
    key = keys[0]
    ends = table.get(key, list)
    if len(ends) != 2:
        table.refuse(key, ends, "is not [first level, last level]")
    first, last = (_value(table, key, end) for end in ends)
    line = table.line(key)
    if "steps" in table:
        passes = tuple(_read_pass(each, shared) for each in table.tables("steps"))
        if not passes:
            raise table.fault("steps: the loop has none", "steps")
        table.finish("a loop")
    else:
        passes = (_read_pass(table, shared),)
    return Loop(passes, first, last, 1 if key == "down" else -1, line)


def _read_pass(table: Table, above: _Shared) -> DescribedPass:
    shared = _read_shared(table, above)
    shader = _read_shader(table, shared)
    samplers = table.table("samplers")
    tile = table.get("tile", list)
    if tile is not None and (
        len(tile) != 2 or not all(type(each) is int and 1 <= each <= 16384 for each in tile)
    ):
        table.refuse("tile", tile, "is not the two sides in pixels that a workgroup covers")
    when, groups = _when(table), table.get("groups", list)
    made = DescribedPass(
        shader,
        _read_textures(table.table("textures")),
        {key: (_read_sampler(samplers, key), samplers.line(key)) for key in samplers},
        _read_values(table.table("values")),
        _read_outputs(table),
        _read_blend(table),
        None if when is None else (when, table.line("when")),
        None if tile is None else (tile[0], tile[1]),
        None if groups is None else (_value(table, "groups", groups), table.line("groups")),
        _vertices(table, shader),
        table.line(),
    )
    table.get("name", str)
    table.finish("a pass", "down", "up", "steps")
    return made


def _vertices(table: Table, shader: Shader) -> int:
    """Read how many vertices are drawn: three of each triangle; 0 for the package's own."""
    count: int = table.get("vertices", int, 0)
    if "vertices" in table and (count % 3 or not 3 <= count <= MAX_VERTICES):
        table.refuse("vertices", count, f"is not a multiple of 3, 3 to {MAX_VERTICES}")
    if count and shader.vertex is None:
        raise table.fault("vertices: the pass has no vertex shader of its own", "vertices")
    return count


def _when(table: Table) -> Expression | None:
    text = table.text("when")
    try:
        return None if text is None else parse(text)
    except ArithmeticFault as error:
        raise table.fault(f"when: {error}", "when") from None


def _read_shader(table: Table, shared: _Shared) -> Shader:
    file = table.text("file")
    if file is None:
        raise table.fault("file: the pass has none; give the file of its shader")
    suffix = "." + file.rpartition(".")[2].lower()
    language = next((name for name, suffixes in LANGUAGES.items() if suffix in suffixes), "")
    if "language" in table or not language:
        if "language" not in table:
            table.refuse("file", file, 'does not tell its language; give language = "hlsl"')
        language = table.choice("language", LANGUAGES, language)
    stage = table.choice("stage", STAGES, "") if "stage" in table else None
    if stage is None and suffix in (".frag", ".comp"):
        stage = "fragment" if suffix == ".frag" else "compute"
    entry = table.text("entry")
    if entry is not None and entry != MAINS.get(language, entry):
        table.refuse("entry", entry, f"is not {MAINS[language]}, the only one of this language")
    constants = table.table("constants")
    number = table.get("program", int, 0)
    if not 0 <= number < 100:
        table.refuse("program", number, "is not the number of a pass in the file, 0 to 99")
    return Shader(
        file,
        language,
        entry,
        stage,
        table.text("vertex"),
        shared.include,
        tuple(shared.defines.items()),
        tuple(shared.features.items()),
        tuple(shared.dependencies.items()),
        shared.options,
        tuple(
            (key, read_number(constants, key, constants.get(key, (int, float, bool))))
            for key in constants
        ),
        number,
        table.line("file"),
    )


def _read_sampler(table: Table, key: str) -> Sampling:
    value = table.get(key, (str, dict))
    if isinstance(value, str):
        return Sampling(table.choice(key, FILTERS, "linear"))
    each = table.table(key)
    made = _sampling(each)
    each.finish("a sampler")
    return made


def _sampling(table: Table) -> Sampling:
    return Sampling(
        table.choice("filter", FILTERS, "linear"), table.choice("border", BORDERS, "clamp")
    )


def _read_textures(table: Table) -> dict[str, Texture]:
    made = {}
    for key in table:
        value = table.get(key, (str, list, dict))
        sampling = Sampling()
        names = table.texts(key) if not isinstance(value, dict) else ()
        if isinstance(value, dict):
            each = table.table(key)
            names = each.texts("source")
            sampling = _sampling(each)
            each.finish("a texture")
        if not names:
            raise table.fault(f"{key}: the texture has no source", key)
        sources = tuple(_image(table, key, name) for name in names)
        made[key] = Texture(sources, sampling, table.line(key))
    return made


def _read_outputs(table: Table) -> dict[str, Output]:
    """Read `output`, or `outputs`: what the shader's targets are. The key "" stands for one."""
    if ("output" in table) == ("outputs" in table):
        raise table.fault(
            'output: the pass has none; give output = "IMAGE"'
            if "output" not in table
            else "output: give output or outputs",
        )
    size = _size(table, parse(f"size({FRAME})"))
    format = table.choice("format", FORMATS, "")
    if "output" in table:
        image = _image(table, "output", table.text("output"))
        line = table.line("output")
        size_line = table.line("size" if "size" in table else "output")
        return {"": Output(_writable(table, "output", image), size, format, line, size_line)}
    outputs = table.table("outputs")
    made = {}
    for key in outputs:
        value = outputs.get(key, (str, dict))
        if isinstance(value, str):
            image = _image(outputs, key, value)
            line = outputs.line(key)
            size_line = table.line("size") if "size" in table else line
            made[key] = Output(_writable(outputs, key, image), size, format, line, size_line)
            continue
        each = outputs.table(key)
        if "image" not in each:
            raise outputs.fault(f"{key}: the output has no image", key)
        image = _image(each, "image", each.text("image"))
        made[key] = Output(
            _writable(each, "image", image),
            _size(each, size),
            each.choice("format", FORMATS, format),
            outputs.line(key),
            (each if "size" in each else table).line("size"),
            _when(each),
        )
        each.finish("an output")
    if not made:
        raise table.fault("outputs: the pass has none", "outputs")
    seen = set()
    for key, output in made.items():
        name, level = output.image
        place = name, level and ast.dump(level)
        if place in seen and name != DISCARD:
            raise outputs.fault(f"outputs: {name!r} is the image of two outputs", key)
        seen.add(place)
    return made


def _writable(table: Table, key: str, image: ImageName) -> ImageName:
    name = image.name
    if (
        name in (FRAME, GLOW, TARGET, *PLAIN)
        or "__" in name
        or len(name) > 24
        or not name.isascii()
    ):
        table.refuse(key, name, "is not possible as the name of an output; it is up to 24 letters")
    return image


def _size(table: Table, default: Value) -> Value:
    if "size" not in table:
        return default
    value = table.get("size", (int, float, str, list))
    made = _value(table, "size", value)
    for part in _parts(made):
        if isinstance(part, float) and part <= 0:
            table.refuse("size", value, "is not greater than 0")
        if isinstance(part, float) and isinstance(made, tuple) and part < 1:
            table.refuse("size", value, "is less than a pixel; a share of the frame is one number")
    return made


def _read_blend(table: Table) -> Blend | None:
    value = table.get("blend", (str, dict))
    if value is None:
        return None
    line = table.line("blend")
    if isinstance(value, str):
        table.choice("blend", ("add",), "add")
        return Blend(1.0, 1.0, None, line)
    each = table.table("blend")
    image = each.text("image")
    made = Blend(
        _value(each, "source", each.get("source", object, 1)),
        _value(each, "target", each.get("target", object, 1)),
        None if image is None else _image(each, "image", image),
        line,
    )
    each.finish("blend")
    return made


def _check_names(made: Description) -> None:
    """Check the names in all expressions: settings, numbers and images."""
    known = {param.name for param in made.params} | made.numbers.keys()
    outputs = made.outputs
    images = outputs | {FRAME, GLOW, *PLAIN}
    for name in (param.name for param in made.params):
        if name in made.numbers:
            line = made.numbers[name][1]
            raise made.source.fault(line, f"numbers: {name!r} is also a setting")
    check = _NameCheck(
        made.source, known | {INDEX}, images, {f"{HISTORY}{name}" for name in outputs}
    )
    for value, line in made.numbers.values():
        check.value(value, line, level=True)
    for step in made.steps:
        is_loop = isinstance(step, Loop)
        if isinstance(step, Loop):
            check.value(step.first, step.line)
            check.value(step.last, step.line)
        for each in step.passes if isinstance(step, Loop) else (step,):
            check.check_pass(each, level=is_loop)
    check.image(made.result, made.result_line)
    if made.result.name not in outputs:
        raise made.source.fault(made.result_line, f"no pass writes {made.result.name!r}")


@dataclasses.dataclass(frozen=True)
class _NameCheck:
    """Checks that names are known."""

    source: Source
    numbers: set[str]
    images: set[str]
    histories: set[str]

    def value(
        self, value: Value | None, line: int, *, level: bool = False, element: bool = False
    ) -> None:
        """Check a value; `level`, `element`: whether it can have that of a loop, of an array."""
        for part in _parts(value) if value is not None else ():
            if isinstance(part, float):
                continue
            numbers, images = names_in(part)
            known = self.numbers | ({LEVEL} if level else set())
            known |= {ELEMENT} if element else set()
            for name in sorted(numbers - known):
                self._fail(name, known, "a number", line)
            for name in sorted(images - self.images - {TARGET}):
                self._fail(name, self.images, "an image", line)

    def _fail(self, name: str, known: set[str], what: str, line: int) -> None:
        where = "; only loops have levels" if name == LEVEL else did_you_mean(name, known)
        raise self.source.fault(
            line, f"{name!r} is not {what} here{where}; known are {', '.join(sorted(known))}"
        )

    def image(
        self, image: ImageName, line: int, *, level: bool = False, element: bool = False
    ) -> None:
        """Check the name of an image and its level."""
        if image.name not in self.images:
            self._fail(image.name, self.images, "an image", line)
        self.value(image.level, line, level=level, element=element)

    def _texture(self, texture: Texture, *, level: bool) -> None:
        """Check the sources of a texture: several, or what the frame before has left."""
        known = dataclasses.replace(self, images=self.images | self.histories)
        for source in texture.sources:
            known.image(source, texture.line, level=level, element=True)
            if source.name in self.histories - self.images and len(texture.sources) > 1:
                raise self.source.fault(
                    texture.line, f"{source.name!r} is always there, and so the only source"
                )

    def check_pass(self, each: DescribedPass, *, level: bool) -> None:
        """Check all names of a pass; sizes can be those of its textures."""
        inner = dataclasses.replace(self, images=self.images | each.textures.keys())
        for texture in each.textures.values():
            self._texture(texture, level=level)
        for value, line in each.values.values():
            inner.value(value, line, level=level)
        for output in each.outputs.values():
            if output.image.name != DISCARD:
                self.image(output.image, output.line, level=level, element=True)
            inner.value(output.size, output.size_line, level=level, element=True)
            inner.value(output.when, output.line, level=level, element=True)
        if each.blend is not None:
            inner.value(each.blend.source, each.blend.line, level=level)
            inner.value(each.blend.target, each.blend.line, level=level)
            if each.blend.image is not None:
                self.image(each.blend.image, each.blend.line, level=level)
        if each.when is not None:
            self.value(*each.when, level=level)
        if each.groups is not None:
            inner.value(*each.groups, level=level)
