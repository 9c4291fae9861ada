"""Descriptions with their compiled shaders: what a class is made of, and travels as."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import os
from pathlib import Path

from vkbloom._custom.described.binding import BoundPass, bind
from vkbloom._custom.described.planning import Plan
from vkbloom._custom.described.programs import Program, compile_all
from vkbloom._custom.described.schema import Description, Shader, read_schema
from vkbloom._custom.planning import FrameValues
from vkbloom._custom.rows import Row
from vkbloom._custom.source import Source, read_source

#: The frame, and its bloom buffers, for which a description is planned when it is loaded.
_TRIAL_SIZE = (640, 360)


@dataclasses.dataclass(frozen=True)
class DescribedSource(Source):
    """The text of a description, and its compiled shaders."""

    programs: tuple[tuple[Shader, Program], ...] = ()
    read: tuple[str, ...] = dataclasses.field(default=(), compare=False)

    @property
    def shaders(self) -> tuple[str, ...]:
        """The paths of the passes' shaders, as they are given."""
        return tuple(dict.fromkeys(shader.file for shader, _ in self.programs))

    @property
    def files(self) -> tuple[str, ...]:
        """The paths of all files that it was read from."""
        return (*super().files, *self.read)

    @property
    def digest(self) -> str:
        """The SHA-256 of the text and of the shaders."""
        known = hashlib.sha256(self.text.encode())
        for _, program in self.programs:
            known.update(program.code)
            known.update(program.vertex or b"")
        return known.hexdigest()


def read_described(source: str | os.PathLike[str]) -> DescribedSource:
    """Read a description and compile its shaders; raise an error that names file and line."""
    read = read_source(source)
    return compile_described(read, Path(read.name).parent)


def compile_described(read: Source, home: Path) -> DescribedSource:
    """Compile the shaders of a description, whose paths begin in a folder."""
    description = read_schema(read)
    programs, files = compile_all(description, home)
    return DescribedSource(read.name, read.text, tuple(programs.items()), tuple(files))


class Programs:
    """The passes of a description, whose shaders are in place."""

    def __init__(self, name: str, description: Description, source: DescribedSource) -> None:
        programs = dict(source.programs)
        self._description = description
        self._passes: list[BoundPass] = [
            bind(description, item, programs[item.shader], f"{name}_{number}")
            for number, item in enumerate(description.passes)
        ]
        self.resources: dict[str, object] = {}

    def plan(self, request: FrameValues) -> tuple[Row, ...]:
        """Return the rows of a frame."""
        plan = Plan(self._description, self._passes, request, {})
        rows = plan.run()
        if not self._description.histories:
            return rows
        # What the frame before has left has the sizes that this one turns out to have.
        return Plan(self._description, self._passes, request, plan.images).run()

    def try_plan(self) -> None:
        """Plan a frame with the defaults; raise ValueError where that fails."""
        values = {param.name: param.default for param in self._description.params}
        self.plan(FrameValues(_TRIAL_SIZE, _TRIAL_SIZE, values, 0, 0, {}))


@functools.lru_cache(maxsize=16)
def open_described(name: str, source: DescribedSource) -> tuple[Description, Programs]:
    """Return the description of a source, and its passes."""
    description = read_schema(source)
    programs = Programs(name, description, source)
    programs.try_plan()
    return description, programs
