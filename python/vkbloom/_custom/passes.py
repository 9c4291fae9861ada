"""Passes: the blocks of a file that draw."""

from __future__ import annotations

import dataclasses
import re
from typing import Final

from vkbloom._custom.blocks import Block, Directive
from vkbloom._custom.expressions import ExpressionError, tokens
from vkbloom._custom.names import GLOW, HOOKED, MAX_NAME_LENGTH, STAGES, stage_of

MAX_STAGES: Final = 16
MAX_BINDINGS: Final = 16
#: Threads of a workgroup: what every device of Vulkan has.
MAX_THREADS: Final = 1024
MAX_BLOCK_SIDE: Final = 16384


@dataclasses.dataclass(frozen=True)
class Compute:
    """The pixels and the threads of a workgroup."""

    block: tuple[int, int]
    threads: tuple[int, int]


@dataclasses.dataclass(frozen=True)
class CustomPass:
    """A pass as the file states it. `save` is None if the result replaces the picture."""

    title: str
    stages: tuple[str, ...]
    bindings: tuple[Directive, ...]
    save: Directive | None
    width: Directive | None
    height: Directive | None
    when: Directive | None
    compute: Compute | None
    body: str
    body_line: int
    line: int

    def result_at(self, stage: str) -> str | None:
        """Return the name of the result at a stage; None if it replaces the picture."""
        if self.save is None or stage_of(self.save.value) in (HOOKED, stage):
            return None
        return stage_of(self.save.value)


def read_pass(block: Block) -> CustomPass:
    """Read a pass."""
    save = block.last("SAVE")
    if save:
        name = save.identifier()
        if stage_of(name) == GLOW:
            raise save.fault("GLOW is what glows; save under another name")
        if len(name) > MAX_NAME_LENGTH:
            raise save.refusal(f"is longer than {MAX_NAME_LENGTH} characters")
    check_ignored(block)
    bindings = block.all("BIND")
    if len(bindings) > MAX_BINDINGS:
        raise bindings[MAX_BINDINGS].fault(f"a pass has at most {MAX_BINDINGS}")
    for binding in bindings:
        binding.identifier()
    title = block.last("DESC")
    return CustomPass(
        title.value if title else "",
        read_stages(block),
        tuple(bindings),
        save,
        read_expression(block, "WIDTH"),
        read_expression(block, "HEIGHT"),
        read_expression(block, "WHEN"),
        read_compute(block),
        block.body,
        block.body_line,
        block.line,
    )


def read_stages(block: Block) -> tuple[str, ...]:
    """Return the stages of a pass, in the order in which they run."""
    hooks = block.all("HOOK")
    if not hooks:
        raise block.head.source.fault(block.line, "the pass has no //!HOOK, so it never runs")
    if len(hooks) > MAX_STAGES:
        raise hooks[MAX_STAGES].fault(f"a pass has at most {MAX_STAGES}")
    for hook in hooks:
        if stage_of(hook.value) not in STAGES:
            raise hook.fault(
                f"the stage {hook.value} is never reached, since pictures are linear RGB; it is "
                f"not one of {', '.join(STAGES)}"
            )
    named = {stage_of(hook.value) for hook in hooks}
    return tuple(stage for stage in STAGES if stage in named)


def read_expression(block: Block, name: str) -> Directive | None:
    """Read an expression; an empty one counts as none."""
    directive = block.last(name)
    if directive is None or not directive.value:
        return None
    try:
        tokens(directive.value)
    except ExpressionError as error:
        raise directive.fault(error) from None
    return directive


def numbers(directive: Directive) -> list[int] | None:
    """Return the directive's value as integers; None if it is something else."""
    words = directive.value.split()
    if not all(re.fullmatch(r"[+-]?\d{1,9}", word, re.ASCII) for word in words):
        return None
    return [int(word) for word in words]


def read_compute(block: Block) -> Compute | None:
    """Read //!COMPUTE: two or four numbers."""
    directive = block.last("COMPUTE")
    if directive is None:
        return None
    given = numbers(directive)
    if given is None or len(given) not in (2, 4):
        raise directive.refusal("is not two or four numbers")
    width, height = given[:2]
    threads = (given[-2], given[-1])
    if not (1 <= width <= MAX_BLOCK_SIDE and 1 <= height <= MAX_BLOCK_SIDE):
        cause = f"pixels are out of range, 1 to {MAX_BLOCK_SIDE}"
        raise directive.fault(f"{width} x {height} {cause}")
    if min(threads) < 1 or threads[0] * threads[1] > MAX_THREADS:
        cause = f"threads are out of range, 1 to {MAX_THREADS}"
        raise directive.fault(f"{threads[0]} x {threads[1]} {cause}")
    return Compute((width, height), threads)


def check_ignored(block: Block) -> None:
    """Check the directives that change no pixel here: OFFSET and COMPONENTS."""
    for directive in block.all("COMPONENTS"):
        given = numbers(directive)
        if given is None or len(given) != 1 or not 1 <= given[0] <= 4:
            raise directive.refusal("is not a number, 1 to 4")
    for directive in block.all("OFFSET"):
        words = directive.value.split()
        number = r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?"
        if words != ["ALIGN"] and not (
            len(words) == 2 and all(re.fullmatch(number, word, re.ASCII) for word in words)
        ):
            raise directive.refusal("is not two numbers or ALIGN")
