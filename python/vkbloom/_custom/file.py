"""The file of a custom method: all of its blocks, checked as far as this needs no image."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from vkbloom._custom import hints
from vkbloom._custom.blocks import Directive, read_blocks
from vkbloom._custom.buffers import Buffer, read_buffer
from vkbloom._custom.expressions import ExpressionError, Values, check_syntax
from vkbloom._custom.names import BLOOM, GLOW, HISTORY, HOOKED, STAGES, stage_of
from vkbloom._custom.params import Param, read_param
from vkbloom._custom.passes import CustomPass, read_pass
from vkbloom._custom.source import Source
from vkbloom._custom.textures import FileTexture, read_texture

#: Sizes that every expression may name, beside those of stages and saved textures.
KNOWN_SIZES = (HOOKED, GLOW, "OUTPUT", "NATIVE_CROPPED")


@dataclasses.dataclass(frozen=True)
class CustomFile:
    """The blocks of a file."""

    source: Source
    params: tuple[Param, ...]
    textures: tuple[FileTexture, ...]
    buffers: tuple[Buffer, ...]
    passes: tuple[CustomPass, ...]

    @property
    def embedded(self) -> dict[str, FileTexture | Buffer]:
        """The textures and buffers whose data is in the file, by name."""
        blocks: dict[str, FileTexture | Buffer] = {block.name: block for block in self.textures}
        return {**blocks, **{block.name: block for block in self.buffers}}

    @property
    def histories(self) -> dict[str, str]:
        """The saved textures that passes read as the frame before left them, by bound name.

        A texture that is itself saved, or given, under such a name is what it says.
        """
        saved = {item.result_at(stage) for stage, item in self.runs()}
        bound = {binding.value for item in self.passes for binding in item.bindings}
        return {
            f"{HISTORY}{name}": name
            for name in sorted(saved - {None}, key=str)
            if name and f"{HISTORY}{name}" in bound - saved - self.embedded.keys()
        }

    @property
    def saves_bloom(self) -> bool:
        """Whether the file gives the bloom, and leaves the composite to the package."""
        return any(item.result_at(stage) == BLOOM for stage, item in self.runs())

    def runs(self) -> Iterator[tuple[str, CustomPass]]:
        """Return each pass with its stage, in the order in which they run."""
        for stage in STAGES:
            for item in self.passes:
                if stage in item.stages:
                    yield stage, item

    def line_of(self, framebuffer: str) -> int:
        """Return the line of the first pass that saves a framebuffer; else of the last pass."""
        lines = [
            item.line
            for item in self.passes
            if item.save is not None and item.save.value.lower() == framebuffer
        ]
        return [*lines, self.passes[-1].line][0]

    def words(self, values: dict[str, float]) -> dict[str, float]:
        """Return what the words of expressions mean, for some values of the parameters."""
        indices = {
            name: float(index) for param in self.params for index, name in enumerate(param.names)
        }
        return {**indices, **values}


def read_file(source: Source) -> CustomFile:
    """Read a file; raise ValueError if it is not valid."""
    params: list[Param] = []
    textures: list[FileTexture] = []
    buffers: list[Buffer] = []
    passes: list[CustomPass] = []
    for block in read_blocks(source):
        if block.kind == "PARAM":
            params.append(read_param(block))
        elif block.kind == "TEXTURE":
            textures.append(read_texture(block))
        elif block.kind == "BUFFER":
            buffers.append(read_buffer(block))
        else:
            passes.append(read_pass(block))
    if not passes:
        raise source.fault(1, "the file has no pass; a pass begins with //!HOOK")
    file = CustomFile(source, tuple(params), tuple(textures), tuple(buffers), tuple(passes))
    check_unique(file)
    check_names(file)
    check_picture(file)
    return file


def check_unique(file: CustomFile) -> None:
    """Check that no two blocks have the same name."""
    seen: dict[str, int] = {}
    blocks: list[Param | FileTexture | Buffer] = [*file.params, *file.textures, *file.buffers]
    for block in blocks:
        if block.name in seen:
            raise file.source.fault(
                block.line,
                f"{block.name!r} is the name of another block, in line {seen[block.name]}",
            )
        seen[block.name] = block.line


def check_names(file: CustomFile) -> None:
    """Check that each name of a pass is known when the pass runs, whatever the image."""
    known: set[str] = set()
    words = file.words({param.name: param.default for param in file.params})
    for number, (stage, item) in enumerate(file.runs()):
        reached = {*STAGES[: STAGES.index(stage) + 1], *known}
        for binding in item.bindings:
            name = stage_of(binding.value)
            if name not in {*reached, *file.embedded, *file.histories, HOOKED, GLOW}:
                raise binding.fault(unknown_texture(file, number, stage, binding.value))
        sizes = dict.fromkeys({*reached, *KNOWN_SIZES, "MAINPRESUB"}, (7, 5))
        if "MAIN" not in reached:
            del sizes["MAINPRESUB"]
        for expression in (item.when, item.width, item.height):
            check_expression(expression, Values(sizes, words))
        if saved := item.result_at(stage):
            known.add(saved)


def unknown_texture(file: CustomFile, index: int, stage: str, name: str) -> str:
    """Return why a texture is not known to a pass."""
    later = [item for at, item in list(file.runs())[index:] if item.result_at(at) == stage_of(name)]
    if later:
        return f"{name!r} is saved only by a later pass, in line {later[0].line}"
    if name.startswith(HISTORY):
        return f"{name!r} is not a texture here: no pass saves {name.removeprefix(HISTORY)!r}"
    if stage_of(name) in STAGES:
        return f"the stage {name} comes after the pass's own, {stage}"
    saved = [item.save.value for _, item in list(file.runs())[:index] if item.save]
    known = dict.fromkeys([HOOKED, GLOW, *saved, *file.embedded])
    return f"{name!r} is not a texture here; known are {', '.join(known)} and the stages"


def check_expression(expression: Directive | None, values: Values) -> None:
    """Check words and operands of an expression; its numbers are checked when it runs."""
    if expression is None:
        return
    try:
        check_syntax(expression.value, values)
    except ExpressionError as error:
        raise expression.fault(f"{error}{hints.for_expression(expression.value)}") from None


def check_picture(file: CustomFile) -> None:
    """Check that the file gives a bloom or a picture."""
    if not any(item.result_at(stage) in (None, BLOOM) for stage, item in file.runs()):
        raise file.source.fault(
            file.passes[-1].line,
            "no pass writes the picture or saves BLOOM; let the last pass replace the picture "
            "(no //!SAVE), or give it //!SAVE BLOOM",
        )
