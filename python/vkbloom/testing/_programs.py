"""A program that reads and writes image files as a bloom for the laws."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import checked
from vkbloom._checks import check_number
from vkbloom._io.array_files import read, write
from vkbloom.testing._probe import Bloom

__tracebackhide__ = True

_PLACEHOLDERS: Final = ("{input}", "{output}")
_PLACEHOLDER: Final = re.compile("|".join(map(re.escape, _PLACEHOLDERS)))
#: Bits of the integers in a file, by OpenImageIO's name of the type.
_BITS: Final = {"uint8": 8, "uint16": 16}
_COARSE: Final = 8
#: Error of linear values in 8 bits: two levels, where the curve of sRGB is steepest.
COARSE_ERROR: Final = 0.018
_LAST_WORDS: Final = 300  # characters of a failed program's output that an error quotes


@checked
def command(argv: Sequence[str], *, suffix: str = ".exr", timeout: float = 60.0) -> Bloom:
    """Make a bloom for the laws out of a program.

    For each image the program is run once. It reads a file and writes another one of the same size.

    Parameters
    ----------
    argv : sequence of str
        The program and its arguments. ``{input}`` and ``{output}`` in them stand for the files.
    suffix : str
        The type of both files. EXR files have linear floats. Files of integers, such as ".png",
        are written and read as sRGB.
    timeout : float
        Seconds that a run may take, above 0.

    Returns
    -------
    callable
        Takes an image (H, W, 3) or (H, W, 4), and returns an image in float32. Its errors name the
        program: TimeoutError if it hangs, ChildProcessError if it fails, FileNotFoundError if it
        does not exist or writes nothing, ValueError if its file cannot be read, has another size,
        or has NaN or infinity where the image has none. A file of 8 bits is a UserWarning, once.

    Examples
    --------
    >>> from vkbloom import testing
    >>> bloom = testing.command(["cp", "{input}", "{output}"])
    >>> testing.report(bloom, size=(32, 32)).assert_held("superposition", "gain", "symmetric")
    """
    return Program(argv, suffix, timeout)


class Program:
    """The callable of `command`. `bits` is 8 or 16 once the program has written such integers."""

    def __init__(self, argv: Sequence[str], suffix: str, timeout: float) -> None:
        self._argv = tuple(argv)
        for placeholder in _PLACEHOLDERS:
            if not any(placeholder in word for word in argv):
                raise ValueError(f"argv: {' '.join(argv)!r} has no {placeholder}")
        if not suffix.startswith("."):
            raise ValueError(f"suffix: {suffix!r} does not begin with a dot")
        check_number("timeout", timeout, 1e-3, 1e6)
        self._suffix, self._timeout = suffix, timeout
        self.bits: int | None = None

    def __call__(self, image: NDArray[Any]) -> NDArray[Any]:
        """Run the program once."""
        height, width = image.shape[:2]
        with tempfile.TemporaryDirectory(prefix="vkbloom-") as folder:
            source, target = (Path(folder) / f"{name}{self._suffix}" for name in ("in", "out"))
            write(source, np.ascontiguousarray(image, np.float32), premultiplied=True)
            self._run(dict(zip(_PLACEHOLDERS, (str(source), str(target)), strict=True)))
            if not target.exists():
                raise FileNotFoundError(f"{self._name}: it wrote no file for {_PLACEHOLDERS[1]}")
            result = self._read(target)
        if result.shape[1::-1] != (width, height):
            raise ValueError(
                f"{self._name}: it wrote {result.shape[1]} x {result.shape[0]} pixels for "
                f"{width} x {height}; both files must have the same size"
            )
        wrong = ~np.isfinite(result)
        if wrong.any() and np.isfinite(image).all():
            y, x, channel = (int(position) for position in np.argwhere(wrong)[0])
            raise ValueError(
                f"{self._name}: it wrote {result[y, x, channel]} at x {x}, y {y}, channel "
                f"{channel} for an image of finite values ({int(wrong.sum())} such values)"
            )
        return result

    @property
    def _name(self) -> str:
        return f"command {Path(self._argv[0]).name!r}"

    def _run(self, values: Mapping[str, str]) -> None:
        words = [_PLACEHOLDER.sub(lambda match: values[match[0]], word) for word in self._argv]
        # A session of its own, so that what the program started ends with it.
        with subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        ) as running:
            try:
                said, _ = running.communicate(timeout=self._timeout)
            except subprocess.TimeoutExpired:
                raise TimeoutError(
                    f"{self._name}: it did not end within {self._timeout:g} s"
                ) from None
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(running.pid, signal.SIGKILL)
        if running.returncode:
            last = " ".join(said.decode(errors="replace").split())[-_LAST_WORDS:]
            raise ChildProcessError(
                f"{self._name}: it {_ended(running.returncode)}; it said: {last or 'nothing'}"
            )

    def _read(self, target: Path) -> NDArray[Any]:
        try:
            pixels, about = read(target, premultiplied=True, metadata=True)
        except (OSError, ValueError) as error:
            raise ValueError(f"{self._name}: its file cannot be read: {error}") from None
        if about["numbers"] in _BITS and self.bits is None:
            self.bits = _BITS[about["numbers"]]
            if self.bits == _COARSE:
                warnings.warn(
                    f"{self._name}: it writes {self.bits} bits, which are clipped to 0..1 and "
                    f"rounded; test it with Probe(atol={COARSE_ERROR:g}), or let it write EXR",
                    UserWarning,
                    stacklevel=3,
                )
        return pixels


def _ended(status: int) -> str:
    if status > 0:
        return f"failed with exit status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = f"signal {-status}"
    return f"was ended by {name}"
