"""Names in custom methods."""

from __future__ import annotations

from typing import Final

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
#: Before the name of a saved texture: what the frame before has saved under it.
HISTORY: Final = "HISTORY_"
#: The longest name that a framebuffer has.
MAX_NAME_LENGTH: Final = 31
#: Names that classes of settings have beside their attributes.
TAKEN: Final = {"method", "sha256", "threshold", "self"}


def stage_of(name: str) -> str:
    """Return the stage of a name: MAIN for MAINPRESUB."""
    return "MAIN" if name == "MAINPRESUB" else name
