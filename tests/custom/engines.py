"""Programs that read and write files, whose work a function in this process does.

They start in a few milliseconds, where one of Python takes half a second.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import vkbloom

#: Writes its two arguments into a pipe, and ends with the status that the other pipe says.
_SCRIPT: Final = """\
#!/bin/sh
echo "$1|$2" > "$0.asked"
read status < "$0.done"
exit "$status"
"""


@contextmanager
def engine(folder: Path, bloom: Callable[[NDArray[Any]], NDArray[Any]]) -> Iterator[str]:
    """Yield a command that applies a bloom; it fails where the bloom raises ArithmeticError."""
    program, *pipes = (folder / name for name in ("engine", "engine.asked", "engine.done"))
    program.write_text(_SCRIPT)
    program.chmod(0o755)
    for pipe in pipes:
        os.mkfifo(pipe)

    def work() -> None:
        while files := pipes[0].read_text().rstrip("\n"):
            source, _, target = files.partition("|")
            try:
                made = bloom(vkbloom.read(source, premultiplied=True))
                vkbloom.write(target, np.asarray(made, np.float32), premultiplied=True)
                status = 0
            except ArithmeticError:
                status = 1
            pipes[1].write_text(f"{status}\n")

    worker = threading.Thread(target=work)
    worker.start()
    try:
        yield f"{program} {{input}} {{output}}"
    finally:
        pipes[0].write_text("\n")
        worker.join()
