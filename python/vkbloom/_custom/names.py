"""Names in custom methods."""

from __future__ import annotations

import re
from typing import Final

from vkbloom._custom.blocks import Directive
from vkbloom._custom.source import Source

#: The stages that fire, in this order. MAINPRESUB is another name of MAIN.
STAGES: Final = (
    "RGB",
    "NATIVE",
    "MAIN",
    "LINEAR",
    "PREKERNEL",
    "POSTKERNEL",
    "SCALED",
    "PREOUTPUT",
    "OUTPUT",
)
#: Those at which the picture may get another size.
RESIZING: Final = ("RGB", "NATIVE", "MAIN")
HOOKED: Final = "HOOKED"
GLOW: Final = "GLOW"
BLOOM: Final = "BLOOM"
#: The longest name that a framebuffer has.
LONGEST: Final = 31


def stage_of(name: str) -> str:
    """Return the stage of a name: MAIN for MAINPRESUB."""
    return "MAIN" if name == "MAINPRESUB" else name


def check_name(source: Source, directive: Directive, what: str) -> str:
    """Return the directive's value; raise ValueError if it is not a name in GLSL."""
    name = directive.value
    if not name:
        raise source.fault(directive.line, f"{what}: the name is missing")
    if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII):
        raise source.fault(
            directive.line, f"{what}: {name!r} is not a name; it needs letters, digits and _"
        )
    if name.startswith("gl_") or "__" in name:
        raise source.fault(directive.line, f"{what}: {name!r} is reserved in GLSL")
    return name
