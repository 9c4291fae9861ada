"""A program that reads and writes image files as a bloom or an exposure for the laws."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom._argument_types import check_arguments
from vkbloom._io.array_files import read, write
from vkbloom._numbers import check_number
from vkbloom._public import public
from vkbloom.testing._adaptation import Meter
from vkbloom.testing._levels import Levels
from vkbloom.testing._probe import Bloom

__tracebackhide__ = True

_PLACEHOLDERS: Final = ("{input}", "{output}")
_DT, _STATE = "{dt}", "{state}"
_PLACEHOLDER: Final = re.compile("|".join(map(re.escape, (*_PLACEHOLDERS, _DT, _STATE))))
#: Bits of the integers in a file, by OpenImageIO's name of the type.
_BITS: Final = {"uint8": 8, "uint16": 16}
_COARSE: Final = 8
#: Formats whose files are written with integers of 8 bits, and those that change more than that.
_INTEGERS: Final = (".bmp", ".jp2", ".png", ".sgi", ".tga")
_LOSSY: Final = (".gif", ".jpeg", ".jpg", ".webp")
#: Error of linear values in 8 bits: two levels, where the curve of sRGB is steepest.
COARSE_ERROR: Final = 0.018
_TRACEBACK: Final = "Traceback (most recent call last):"
_LAST_WORDS: Final = 300  # characters of a failed program's output that an error quotes


@public("vkbloom.testing")
@check_arguments
def command(argv: Sequence[str], *, suffix: str = ".exr", timeout: float = 60.0) -> Bloom | Meter:
    """Make a bloom, or an exposure, for the laws out of a program.

    For each image the program is run once. It reads a file and writes another one of the same size.

    Parameters
    ----------
    argv : sequence of str
        The program and its arguments. ``{input}`` and ``{output}`` in them stand for the files.
        With ``{dt}``, the seconds since the frame before, the program is an exposure, which writes
        the exposed picture. ``{state}`` stands for a file of any kind, in which it keeps what it
        has adapted to: it reads the file if there is one, and writes it anew. Without ``{state}``
        it keeps that elsewhere.
    suffix : str
        The type of both files. EXR files have linear floats. Files of integers, such as ".png",
        are written and read as sRGB.
    timeout : float
        Seconds that a run may take, above 0.

    Returns
    -------
    callable
        Takes an image (H, W, 3) or (H, W, 4), and returns an image in float32; an exposure as
        `report` calls it. Its errors name the
        program: TimeoutError if it hangs, ChildProcessError if it fails, FileNotFoundError if it
        does not exist or writes nothing, ValueError if its file cannot be read, has another size,
        or has NaN or infinity where the image has none. A file of 8 bits is a UserWarning, once.

    Examples
    --------
    >>> from vkbloom import testing
    >>> bloom = testing.command(["cp", "{input}", "{output}"])
    >>> testing.report(bloom, size=(32, 32)).assert_held("superposition", "gain", "symmetric")
    """
    return command_of(argv, suffix, timeout)


def command_of(argv: Sequence[str], suffix: str, timeout: float) -> CommandBloom | CommandMeter:
    """Return the callable of a program: an exposure, if its arguments have {dt}."""
    has_dt, has_state = (any(name in word for word in argv) for name in (_DT, _STATE))
    if has_state and not has_dt:
        raise ValueError(f"argv: {' '.join(argv)!r} has {_STATE} but no {_DT}")
    kind = CommandMeter if has_dt else CommandBloom
    return kind(argv, suffix, timeout)


class _Program:
    """A program that reads an image file and writes another one.

    `bits` is 8 or 16 if its files hold such integers, by the suffix; once it has run, by what it
    has written. `runs` counts its runs, and `on_run` is called before each.
    """

    def __init__(self, argv: Sequence[str], suffix: str, timeout: float) -> None:
        self._argv = tuple(argv)
        for placeholder in _PLACEHOLDERS:
            if not any(placeholder in word for word in argv):
                raise ValueError(f"argv: {' '.join(argv)!r} has no {placeholder}")
        if not suffix.startswith("."):
            raise ValueError(f"suffix: {suffix!r} does not begin with a dot")
        check_number("timeout", timeout, 1e-3, 1e6)
        self._suffix, self._timeout = suffix, timeout
        self._is_lossy = suffix.lower() in _LOSSY
        holds_integers = self._is_lossy or suffix.lower() in _INTEGERS
        self.bits: int | None = _COARSE if holds_integers else None
        self.runs = 0
        self.on_run: Callable[[int], None] = lambda _: None
        self._is_noted = False

    @property
    def levels(self) -> Levels | None:
        """What the files hold; None: floats."""
        return None if self.bits is None else Levels(bits=self.bits, is_lossy=self._is_lossy)

    def run(self, image: NDArray[Any], values: Mapping[str, str] = {}) -> NDArray[Any]:
        """Run the program once; `values`: of placeholders beside those of the images."""
        self.runs += 1
        self.on_run(self.runs)
        height, width = image.shape[:2]
        with tempfile.TemporaryDirectory(prefix="vkbloom-") as folder:
            source, target = (Path(folder) / f"{name}{self._suffix}" for name in ("in", "out"))
            write(source, np.ascontiguousarray(image, np.float32), premultiplied=True)
            self._run({**values, "{input}": str(source), "{output}": str(target)})
            if not target.exists():
                raise FileNotFoundError(f"{self._name}: it wrote no file for {_PLACEHOLDERS[1]}")
            result = self._read(target)
        if result.shape[1::-1] != (width, height):
            raise ValueError(
                f"{self._name}: it wrote {result.shape[1]} x {result.shape[0]} pixels for "
                f"{width} x {height}; both files must have the same size"
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
            last = _last_words(said.decode(errors="replace"))
            raise ChildProcessError(
                f"{self._name}: it {_end_text(running.returncode)}; it said: {last or 'nothing'}"
            )

    def _read(self, target: Path) -> NDArray[Any]:
        try:
            pixels, about = read(target, premultiplied=True, metadata=True)
        except (OSError, ValueError) as error:
            raise ValueError(f"{self._name}: its file cannot be read: {error}") from None
        # What it reads may have fewer bits than what it writes.
        written = _BITS.get(about["numbers"])
        self.bits = min((bits for bits in (self.bits, written) if bits), default=None)
        if written == _COARSE and not self._is_noted:
            self._is_noted = True
            warnings.warn(
                f"{self._name}: it writes {written} bits, which are clipped to 0..1 and rounded; "
                "testing.report and testing.assert_laws know; measure with "
                f"Probe(atol={COARSE_ERROR:g}), or let it write EXR",
                UserWarning,
                stacklevel=4,
            )
        return pixels


class CommandBloom(_Program):
    """A program as a bloom."""

    def __call__(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return what the program makes of an image."""
        result = self.run(image)
        wrong = ~np.isfinite(result)
        if wrong.any() and np.isfinite(image).all():
            y, x, channel = (int(position) for position in np.argwhere(wrong)[0])
            raise ValueError(
                f"{self._name}: it wrote {result[y, x, channel]} at x {x}, y {y}, channel "
                f"{channel} for an image of finite values ({int(wrong.sum())} such values)"
            )
        return result


class CommandMeter(_Program):
    """A program as an exposure. Its state is what it writes into the file {state}."""

    @property
    def keeps_state(self) -> bool:
        """Whether the program keeps its state elsewhere."""
        return not any(_STATE in word for word in self._argv)

    def __call__(self, image: NDArray[Any], *, dt: float, state: bytes | None = None) -> Any:
        """Return what the program makes of a frame; with a state, also the next one."""
        with tempfile.TemporaryDirectory(prefix="vkbloom-") as folder:
            file = Path(folder) / "state"
            if state is not None:
                file.write_bytes(state)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                picture = self.run(image, {_DT: f"{dt:.9g}", _STATE: str(file)})
            if self.bits is not None:
                raise ValueError(
                    f"{self._name}: it writes integers, which end at 1; an exposure is measured in "
                    "files of floats, such as .exr"
                )
            if self.keeps_state:
                return picture
            if not file.exists():
                raise FileNotFoundError(f"{self._name}: it wrote no file for {_STATE}")
            return picture, file.read_bytes()


def levels_of(bloom: Bloom, size: tuple[int, int]) -> Levels | None:
    """Return what the files of a program hold, which is run once to see; None: floats.

    A bloom of another kind may declare it, too, as its attribute `levels`.
    """
    if isinstance(bloom, CommandBloom):
        bloom(np.zeros((size[1], size[0], 3), np.float32))
    levels = getattr(bloom, "levels", None)
    return levels if isinstance(levels, Levels) else None


def _last_words(said: str) -> str:
    """Return the end of what a program has said; of a traceback of Python, the error."""
    traceback = said.rpartition(_TRACEBACK)[2] if _TRACEBACK in said else ""
    # Frames are indented; the first line that is not has the error.
    errors = [line for line in traceback.splitlines() if line.strip() and not line[0].isspace()]
    if errors:
        return errors[0][:_LAST_WORDS]
    return " ".join(said.split())[-_LAST_WORDS:]


def _end_text(status: int) -> str:
    if status > 0:
        return f"failed with exit status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = f"signal {-status}"
    return f"was ended by {name}"
