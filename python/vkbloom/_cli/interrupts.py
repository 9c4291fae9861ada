"""Ctrl-C, from the first moment of the program on. The import of this module must be short."""

from __future__ import annotations

import os

TYPE_CHECKING = False

if TYPE_CHECKING:
    import signal
else:
    # The core of the module signal, whose own import takes longer than all of this module: the
    # shorter it is, the earlier Ctrl-C is answered.
    import _signal as signal

#: The status after Ctrl-C, as shells report it.
INTERRUPTED = 130


def answer() -> bool:
    """Let Ctrl-C end the process at once; return False for a process that ignores it."""
    # A job in the background goes on ignoring it.
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return False
    # KeyboardInterrupt can be raised inside an import, where C code prints or discards it.
    signal.signal(signal.SIGINT, leave)
    return True


def leave(*_: object) -> None:
    """End the process at once, as after Ctrl-C, while no file is open."""
    try:
        # The first line break ends the line on which a terminal shows ^C.
        os.write(2, b"\n" * os.isatty(2) + b"vkbloom: interrupted\n")
    finally:
        os._exit(INTERRUPTED)


def raise_interrupts() -> None:
    """Let Ctrl-C raise KeyboardInterrupt from now on, because files may be open."""
    if signal.getsignal(signal.SIGINT) is leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def ignore() -> None:
    """Ignore Ctrl-C when all is done: Python would end by the signal while it takes itself down."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
