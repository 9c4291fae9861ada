"""Files whose names hold the number of a frame: patterns, and the numbers that are missing."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

#: A file and its number, or None if it has none.
NumberedFile: TypeAlias = tuple[str, int | None]

# printf's %d and %04d; Nuke's ####; OpenImageIO's @@@@. One # or @ is a pattern only where it is
# all that stands between two separators, because names such as photo@2x.png have one as well.
_PRINTF: Final = re.compile(r"%(?P<zero>0?)(?P<width>[0-9]*)d")
_MARKS: Final = re.compile(r"#{2,}|@{2,}|(?:(?<=[._-])|^)[#@](?=[._-])")
# A minus sign after a letter or a digit is a separator.
_NUMBER: Final = re.compile(r"((?:(?<![0-9A-Za-z])-)?[0-9]+)")
#: The most numbers in a note.
_MAX_NUMBERS: Final = 5
# OpenImageIO and RV mean 4 digits by one #.
_DIGITS_OF_ONE_MARK: Final = 4


@dataclass(frozen=True)
class Pattern:
    """A name of a file with a place for a number, such as ``f.%04d.exr`` or ``f.####.exr``."""

    before: str
    after: str
    width: int
    fill: str

    def name_of(self, number: int) -> str:
        """Return the name of the file with this number, as printf does: -1 becomes -001."""
        return f"{self.before}{self._digits(number)}{self.after}"

    def _digits(self, number: int) -> str:
        return f"{number:{self.fill}{self.width or 1}d}"

    def number_of(self, name: str) -> int | None:
        """Return the number in a file name of this pattern, or None."""
        end = len(name) - len(self.after)
        digits = name[len(self.before) : end]
        if self.name_with(digits) != name or re.fullmatch("-?[0-9]+", digits) is None:
            return None
        number = int(digits)
        if digits == self._digits(number):
            return number
        if number < 0 or digits.startswith("-"):
            # Some programs pad the digits without the sign: -0001.
            is_sign = number < 0 and not self.before[-1:].isalnum()
            return number if is_sign and len(digits) > self.width else None
        return number if len(digits) >= self.width else None

    def name_with(self, digits: str) -> str:
        """Return the name of the file with this text in the place of the number."""
        return f"{self.before}{digits}{self.after}"


def pattern_of(name: str) -> Pattern | None:
    """Return the pattern of a file name without its folder, or None if it has none."""
    if (form := _PRINTF.search(name)) is not None:
        width, fill = int(form["width"] or 0), form["zero"]
    elif (form := _MARKS.search(name)) is not None:
        count = len(form[0])
        width, fill = _DIGITS_OF_ONE_MARK if form[0] == "#" else count, "0"
    else:
        return None
    return Pattern(name[: form.start()], name[form.end() :], width, fill)


def files_of(folder: str, pattern: Pattern) -> list[NumberedFile]:
    """Return the files of a pattern in a folder by their numbers.

    Raises
    ------
    ValueError
        If two of them have the same number.
    """
    with os.scandir(folder or ".") as entries:
        names = [entry.name for entry in entries if not entry.is_dir()]
    numbered = sorted(
        (number, name) for name in names if (number := pattern.number_of(name)) is not None
    )
    for (number, name), (following, other) in itertools.pairwise(numbered):
        if number == following:
            raise ValueError(f"{os.path.join(folder, name)}: {other} has the same number, {number}")
    return [(os.path.join(folder, name), number) for number, name in numbered]


def as_frames(files: Sequence[NumberedFile]) -> list[NumberedFile]:
    """Return the files in the order of their numbers.

    Files of a folder or a glob get numbers if their names differ in one number only; else they
    stay as they are.
    """
    if any(number is None for _, number in files):
        numbers = _varying_numbers([os.path.basename(path) for path, _ in files])
        if numbers is None:
            return [*files]
        files = [(path, number) for (path, _), number in zip(files, numbers, strict=True)]
    return sorted(files, key=lambda file: (file[1] or 0, file[0]))


def _varying_numbers(names: Sequence[str]) -> list[int] | None:
    """Return the number in which the names differ; None if they differ in more, or in text."""
    columns = [*itertools.zip_longest(*(_NUMBER.split(name) for name in names))]
    varying = [index for index, column in enumerate(columns) if len(set(column)) > 1]
    if len(varying) != 1 or varying[0] % 2 == 0 or None in columns[varying[0]]:
        return None
    numbers = [int(text) for text in columns[varying[0]]]
    return numbers if len(set(numbers)) == len(numbers) else None


def gaps(files: Iterable[NumberedFile]) -> list[range]:
    """Return the runs of numbers that are missing between the first and the last file's.

    `len` of a run fails beyond ``sys.maxsize``: use `missing_count`. There are no gaps in files
    without numbers.
    """
    numbers = sorted(number for _, number in files if number is not None)
    return [
        range(before + 1, after)
        for before, after in itertools.pairwise(numbers)
        if after > before + 1
    ]


def missing_count(files: Iterable[NumberedFile]) -> int:
    """Return how many numbers are missing between the first and the last file's."""
    return sum(gap.stop - gap.start for gap in gaps(files))


def gap_note(files: Sequence[NumberedFile]) -> str | None:
    """Return a note that names the missing numbers, or None if none is missing."""
    missing = gaps(files)
    if not missing:
        return None
    shown = list(itertools.islice(_format(missing), _MAX_NUMBERS + 1))
    names = ", ".join([*shown[:_MAX_NUMBERS], *["..."] * (len(shown) > _MAX_NUMBERS)])
    count = missing_count(files)
    total = count + sum(number is not None for _, number in files)
    return f"{count} of {total} frames {'is' if count == 1 else 'are'} missing: {names}"


def _format(missing: Iterable[range]) -> Iterator[str]:
    for gap in missing:
        last = gap.stop - 1
        yield str(gap.start) if gap.start == last else f"{gap.start} to {last}"
