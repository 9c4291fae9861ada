"""SBOMs of wheels (packaging/sbom.py): what the linker used is listed, and agrees with nm."""

from __future__ import annotations

import hashlib
import importlib
import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

from vkbloom import _core

ROOT = Path(__file__).parents[2]
METADATA = """\
Metadata-Version: 2.4
Name: tiny
Version: 1.0
License-Expression: MIT
"""
SOURCE = """\
#include <zlib.h>
int main(void) { z_stream s = {0}; return inflateInit(&s) + inflateEnd(&s); }
"""

pytestmark = pytest.mark.skipif(
    any(shutil.which(tool) is None for tool in ("cc", "nm", "dpkg-query"))
    or not Path("/usr/include/zlib.h").is_file(),
    reason="needs a C compiler, zlib's archive and dpkg",
)


@pytest.fixture(scope="module")
def sbom() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "packaging")
        return importlib.import_module("sbom")


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program with zlib linked statically, its map, and a wheel of it."""
    folder = tmp_path_factory.mktemp("build")
    (folder / "tiny.c").write_text(SOURCE)
    (folder / "volk.h").write_text("#define VOLK_HEADER_VERSION 7\n")
    for command in ("cc -c tiny.c", "cc tiny.o -o tiny -l:libz.a -Wl,-Map=map"):
        subprocess.run(command.split(), cwd=folder, check=True)
    with zipfile.ZipFile(folder / "tiny-1.0-py3-none-any.whl", "w") as wheel:
        wheel.write(folder / "tiny", "tiny/tiny")
        wheel.writestr("tiny-1.0.dist-info/METADATA", METADATA)
        wheel.writestr("tiny-1.0.dist-info/RECORD", "")
    return folder


def add_sbom(sbom: Any, build: Path, folder: Path, *options: str) -> Path:
    """Return a wheel with its SBOM."""
    wheel = shutil.copy(build / "tiny-1.0-py3-none-any.whl", folder)
    arguments = ["sbom.py", "add", str(wheel), "tiny/tiny", str(build / "map")]
    arguments += ["--own", str(build), "--symbols", str(build / "tiny"), *options]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", arguments)
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        sbom.main()
    return Path(wheel)


def test_what_the_linker_used_is_listed(sbom: Any, build: Path, tmp_path: Path) -> None:
    made = build / "made.json"
    made.write_text('{"spirv-opt": "v2023.1"}')
    volk = ("--source", "volk", "-", str(build / "volk.h"), "--properties", str(made))
    wheel = add_sbom(sbom, build, tmp_path, *volk)
    with zipfile.ZipFile(wheel) as opened:
        assert opened.testzip() is None
        said = json.loads(opened.read("tiny-1.0.dist-info/sboms/tiny.cdx.json"))
        record = opened.read("tiny-1.0.dist-info/RECORD").decode()
    assert record.splitlines()[-1] == "tiny-1.0.dist-info/RECORD,,"
    assert "tiny-1.0.dist-info/sboms/tiny.cdx.json,sha256=" in record
    what_made_spirv = [{"name": "vkbloom:spirv:spirv-opt", "value": "v2023.1"}]
    assert said["metadata"]["component"]["properties"] == what_made_spirv
    listed = {one["name"]: one for one in said["components"]}
    assert listed.keys() == {"volk", "zlib", "GCC runtime", "glibc"}
    archive = Path(subprocess.check_output(["cc", "-print-file-name=libz.a"], text=True).strip())
    assert listed["zlib"]["hashes"] == [
        {"alg": "SHA-256", "content": hashlib.sha256(archive.read_bytes()).hexdigest()}
    ]
    assert listed["zlib"]["licenses"] == [{"expression": "Zlib"}]
    version = subprocess.check_output(
        ["dpkg-query", "-W", "-f=${Version}", "zlib1g-dev"], text=True
    )
    assert listed["zlib"]["version"] == version
    assert listed["volk"]["version"] == "7"
    # Two builds in two folders give the same bytes.
    (tmp_path / "again").mkdir()
    assert add_sbom(sbom, build, tmp_path / "again", *volk).read_bytes() == wheel.read_bytes()


def test_another_systems_packages(sbom: Any, tmp_path: Path) -> None:
    """Of a sysroot, which has a database of dpkg."""
    database, archive = tmp_path / "var/lib/dpkg", tmp_path / "usr/lib/libz.a"
    for folder in (database / "info", database / "updates", archive.parent):
        folder.mkdir(parents=True)
    archive.write_bytes(b"archive")
    (database / "status").write_text(
        "Package: zlib1g-dev\nStatus: install ok unpacked\nMaintainer: nobody\nMulti-Arch: same\n"
        "Architecture: arm64\nSource: zlib (7)\nVersion: 7+b1\nDescription: zlib\n"
    )
    (database / "info/format").write_text("1\n")
    (database / "info/zlib1g-dev:arm64.list").write_text("/usr/lib/libz.a\n")
    (found,) = sbom.of_packages([archive], Path("/none"), tmp_path)
    digest = hashlib.sha256(b"archive").hexdigest()
    purl = "pkg:deb/debian/zlib@7?arch=source"
    assert found == sbom.Component("zlib", "7+b1", {"libz.a": digest}, purl)


def test_it_is_valid(sbom: Any, build: Path, tmp_path: Path) -> None:
    """By CycloneDX' own schema; a changed binary is found."""
    pytest.importorskip("cyclonedx.validation.json")
    (build / "made.json").write_text('{"glslang": "12"}')
    wheel = add_sbom(sbom, build, tmp_path, "--properties", str(build / "made.json"))
    sbom.check(wheel)
    with zipfile.ZipFile(wheel) as opened:
        content = {one: opened.read(one) for one in opened.namelist()}
    name = "tiny-1.0.dist-info/sboms/tiny.cdx.json"
    for changed, data, message in (
        ("tiny/tiny", b"other", "tiny/tiny has another hash than in the SBOM"),
        (name, content[name].replace(b'"library"', b'"libary"'), "libary"),
    ):
        with zipfile.ZipFile(wheel, "w") as opened:
            for one, kept in {**content, changed: data}.items():
                opened.writestr(one, kept)
        with pytest.raises(SystemExit, match=message):
            sbom.check(wheel)


def test_a_library_that_only_nm_finds(sbom: Any, build: Path, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sbom, "used_files", lambda _: [])
        with pytest.raises(SystemExit, match=r"nm finds gcc, glibc, zlib, not in the SBOM"):
            add_sbom(sbom, build, tmp_path)


def test_the_core(sbom: Any) -> None:
    """Nm finds volk and the compiler's start files, none of NumPy or of other libraries."""
    assert sbom.libraries_in([Path(_core.__file__)]) <= {"volk", "gcc", "glibc"}
    assert "volk" in sbom.libraries_in([Path(_core.__file__)])
