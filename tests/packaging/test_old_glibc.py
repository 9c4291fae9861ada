"""What keeps the wheels loadable where glibc is older than where they are built."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.core.builds import ROOT, compiler

# The functions whose newest version is of glibc 2.29, on every machine.
SOURCE = """\
#include <math.h>
double all(double x) { return exp(x) + exp2(x) + log(x) + log2(x) + pow(x, x); }
"""


@pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc" or shutil.which("nm") is None,
    reason="needs glibc and nm",
)
@pytest.mark.parametrize("included", [False, True])
def test_old_versions_of_mathematical_functions(included: bool, tmp_path: Path) -> None:
    (tmp_path / "all.c").write_text(SOURCE)
    header = ["-include", str(ROOT / "packaging" / "glibc_2_28.h")] if included else []
    command = [*compiler(), *header, "-shared", "-fPIC", "all.c", "-o", "all.so", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    listed = subprocess.run(
        ["nm", "-D", "--undefined-only", tmp_path / "all.so"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    found = dict(re.findall(r" U (\w+)@GLIBC_([\d.]+)", listed))
    newer = {name for name, version in found.items() if version == "2.29"}
    assert newer == (set() if included else {"exp", "exp2", "log", "log2", "pow"})
    assert {"exp", "exp2", "log", "log2", "pow"} <= set(found)
