"""A progress bar of a grid: rate, remaining time, and passes run."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from typing import Any

from vkbloom._checks import import_extra
from vkbloom._grid.filling import Tally


def _is_watched() -> bool:
    """Return whether standard error is a terminal, or this process a notebook's kernel."""
    if sys.stderr is not None and sys.stderr.isatty():
        return True
    kernel = sys.modules.get("IPython")
    shell = kernel.get_ipython() if kernel else None
    return shell is not None and "IPKernelApp" in shell.config


class Progress:
    """Count points and passes, and show them as a progress bar.

    - `total`: Number of points of the grid.
    - `done`: Number of points that were done before.
    - `shown`: True: shown in a terminal or a notebook, but not elsewhere. None: the same if tqdm is
      installed. False: not shown.
    """

    def __init__(self, total: int, done: int = 0, *, shown: bool | None = None) -> None:
        self.tally = Tally()
        self._bar: Any = None
        if shown is not None and not isinstance(shown, bool):
            raise TypeError(f"progress: {shown!r} is not True, False or None")
        if shown is False or (shown is None and find_spec("tqdm") is None):
            return
        tqdm = import_extra("tqdm.auto", "grid", "A progress bar").tqdm
        if _is_watched():
            self._bar = tqdm(total=total, initial=done, unit="point", mininterval=0.2)

    def add(self, tally: Tally) -> None:
        """Add points and passes that are done."""
        self.tally.add(tally)
        if self._bar is not None:
            self._bar.set_postfix_str(f"passes run {self.tally.ran}", refresh=False)
            self._bar.update(tally.points)

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._bar is not None:
            self._bar.close()
