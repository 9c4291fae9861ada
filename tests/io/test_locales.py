"""Names of files in locales whose encoding is not UTF-8."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import vkbloom
from tests.processes import python

# Without Python's own changes to UTF-8.
STRICT = {
    "PYTHONUTF8": "0",
    "PYTHONCOERCECLOCALE": "0",
    "PYTHONIOENCODING": "ascii:backslashreplace",
}
CODE = """
import os, sys
import vkbloom
image = vkbloom.read(sys.argv[1])
vkbloom.write(sys.argv[2], image)
frames = vkbloom.apply(image, "kino")
frames.save(sys.argv[3])
assert list(vkbloom.Frames.load(sys.argv[3])) == list(frames)
print(sys.getfilesystemencoding(), os.path.getsize(sys.argv[2]))
for path in sys.argv[4:]:
    try:
        vkbloom.read(path)
    except (OSError, ValueError) as error:
        print(ascii(error))
"""


def compile_locale(name: str, folder: Path) -> dict[str, str]:
    """Return the environment of a locale: ``language.ENCODING``."""
    if name == "C":
        return {"LC_ALL": "C", **STRICT}
    language, _, encoding = name.partition(".")
    charmap = {"eucJP": "EUC-JP"}.get(encoding, encoding)
    try:
        # (It warns that these are not ASCII.)
        subprocess.run(
            ["localedef", "-i", language, "-f", charmap, folder / name],
            check=False,
            capture_output=True,
        )
    except FileNotFoundError:
        pytest.skip("the system has no localedef")
    if not (folder / name).is_dir():
        pytest.skip("the system has no sources of locales (Debian: locales)")
    return {"LC_ALL": name, "LOCPATH": str(folder), **STRICT}


@pytest.mark.parametrize(
    ("locale", "letter", "encoding"),
    [
        # Names in UTF-8, as on a disk of another user, and in the locale's encoding.
        ("C", "ü", "utf-8"),
        ("de_DE.ISO-8859-1", "ü", "utf-8"),
        ("de_DE.ISO-8859-1", "ü", "latin-1"),
        ("ja_JP.eucJP", "日本", "euc-jp"),
    ],
)
def test_files_are_found(tmp_path: Path, locale: str, letter: str, encoding: str) -> None:
    environment = compile_locale(locale, tmp_path)
    word = letter.encode(encoding)
    folder = os.fsencode(tmp_path) + b"/" + word
    os.mkdir(folder)
    vkbloom.write(tmp_path / "a.png", np.full((32, 32, 3), 0.5, np.float32))
    names = [
        folder + b"/" + word + end for end in (b".png", b"2.png", b"3.png", b"4.png", b"5.png")
    ]
    os.rename(tmp_path / "a.png", names[0])
    with open(names[4], "wb") as damaged:
        damaged.write(b"nothing")
    done = python("-c", CODE, *map(os.fsdecode, names), **environment)
    assert done.returncode == 0, done.stderr
    first, missing, unreadable = done.stdout.splitlines()
    assert first.split()[0] in ("ascii", "iso8859-1", "euc_jp")
    assert os.path.getsize(names[1]) == int(first.split()[1])
    assert len(os.listdir(folder)) > 4
    assert missing.startswith("FileNotFoundError")
    assert "is not a readable image" in unreadable
    assert "/vkbloom-" not in unreadable
