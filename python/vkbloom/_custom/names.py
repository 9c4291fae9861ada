"""Names in custom methods."""

from __future__ import annotations

import re
from typing import Final

from vkbloom._custom.blocks import Directive

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


def check_name(directive: Directive) -> str:
    """Return the directive's value; raise ValueError if it is not a name in GLSL."""
    name = directive.value
    if not name:
        raise directive.fault("the name is missing")
    if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII):
        raise directive.refused("is not a name; it needs letters, digits and _")
    if name.startswith("gl_") or "__" in name:
        raise directive.refused("is reserved in GLSL")
    return name
