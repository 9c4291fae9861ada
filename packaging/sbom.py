"""The SBOM of a wheel (PEP 770, CycloneDX 1.6): what is compiled or linked into its binary.

`add` takes the objects and the archives that the linker used from its map (-Wl,-Map), and their
Debian packages. What was compiled from source is given by `--source NAME VERSION FILE...`; the
version "-" is that of a HEADER_VERSION in the first file, and a file may be "NAME@SHA-256". It
fails if nm, or $NM, finds a library's symbols in `--symbols` that the SBOM does not list. The JSON
object of `--properties FILE` becomes properties of the wheel: what made its SPIR-V. `check`
validates the SBOMs of wheels by cyclonedx-python-lib, and compares the binaries' hashes.
"""

from __future__ import annotations

import argparse
import base64
import functools
import hashlib
import json
import os
import re
import subprocess
import time
import uuid
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from email.parser import Parser
from pathlib import Path
from typing import Any, Final, NamedTuple

Json = dict[str, Any]


class Library(NamedTuple):
    """A library's name, its licence (SPDX), and how names of its symbols begin."""

    name: str
    licence: str
    symbols: str


#: By Debian's source package without its series, or by the name of a source.
LIBRARIES: Final[Mapping[str, Library]] = {
    "gcc": Library(
        "GCC runtime",
        "GPL-3.0-or-later WITH GCC-exception-3.1",
        r"__do_global_dtors_aux$|__cxa_allocate_exception$|_Unwind_RaiseException$",
    ),
    "glibc": Library("glibc", "LGPL-2.1-or-later", r"_init$|_start$|(__pthread_)?atfork$"),
    "llvm-toolchain": Library("LLVM", "Apache-2.0 WITH LLVM-exception", r"llvm::|LLVM[A-Z]"),
    "zlib": Library("zlib", "Zlib", r"(de|in)flate(Init_|End)?$|adler32$"),
    "libzstd": Library("Zstandard", "BSD-3-Clause OR GPL-2.0-only", r"ZSTD_"),
    "numpy": Library("NumPy", "BSD-3-Clause", r"_?PyArray_|npy_"),
    "volk": Library("volk", "MIT", r"volk[A-Z]"),
    "Vulkan-Headers": Library("Vulkan-Headers", "Apache-2.0 OR MIT", r"$."),
    "Mesa": Library(
        "Mesa",
        "MIT AND Apache-2.0 AND BSL-1.0 AND SGI-B-2.0",
        r"lvp_|llvmpipe_|nir_|gallivm_",
    ),
    "glslang": Library(
        "glslang",
        "BSD-3-Clause AND BSD-2-Clause AND MIT AND Apache-2.0 AND "
        "GPL-3.0-or-later WITH Bison-exception-2.2 AND LicenseRef-NVIDIA-Preprocessor",
        r"glslang::|spv::",
    ),
}


# Debian's source packages of cross compilers that have the files of another one.
_SOURCES: Final = {"cross-toolchain-base": "glibc"}


class Component(NamedTuple):
    """A library in a binary: its key in LIBRARIES, its version, and the hashes of its files."""

    key: str
    version: str
    files: Mapping[str, str]
    purl: str

    def to_json(self) -> Json:
        """Return it as a component of CycloneDX.

        The hash of several files is that of their lines as `sha256sum` prints them.
        """
        library = LIBRARIES[self.key]
        lines = "".join(f"{digest}  {name}\n" for name, digest in self.files.items())
        alone = next(iter(self.files.values())) if len(self.files) == 1 else None
        files = [
            {"type": "file", "name": name, "hashes": _sha256(digest)}
            for name, digest in self.files.items()
        ]
        return {
            "type": "library",
            "bom-ref": self.purl,
            "name": library.name,
            "version": self.version,
            "licenses": [{"expression": library.licence}],
            "hashes": _sha256(alone or _digest(lines.encode())),
            "purl": self.purl,
            "components": [] if alone else files,
        }


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _sha256(digest: str) -> list[Json]:
    return [{"alg": "SHA-256", "content": digest}]


def from_source(key: str, version: str, files: Sequence[str]) -> Component:
    """Return what is compiled from source files."""
    if version == "-":
        version = _header_version(Path(files[0]).read_text())
    found = {}
    for file in files:
        name, _, digest = file.partition("@")
        found[Path(name).name] = digest or _digest(Path(name).read_bytes())
    return Component(key, version, found, f"pkg:generic/{key.lower()}@{version}")


def _header_version(text: str) -> str:
    """Return the version of volk's header, or of the Vulkan headers with the version of Vulkan."""
    (patch,) = re.findall(r"^#define \w*HEADER_VERSION +(\d+)$", text, re.MULTILINE)
    api = re.findall(r"VK_MAKE_API_VERSION\(0, (\d+), (\d+), VK_HEADER_VERSION\)", text)
    return ".".join([*(api[0] if api else ()), patch])


def used_files(linker_map: str) -> list[Path]:
    """Return the objects and archives outside of the build's folder that a linker used."""
    members = re.findall(r"^(/\S+?\.a)\(\S+\)(?:\s|$)", linker_map, re.MULTILINE)
    objects = re.findall(r"^LOAD (/\S+\.o)$", linker_map, re.MULTILINE)
    return sorted({Path(os.path.realpath(file)) for file in (*members, *objects)})


def of_packages(files: Iterable[Path], own: Path, sysroot: Path) -> list[Component]:
    """Return the Debian packages of files, except those in the folder `own`.

    The files of a sysroot are in dpkg's database there.
    """
    found: dict[tuple[str, ...], dict[str, str]] = {}
    foreign = {file for file in files if not file.is_relative_to(own)}
    inside = {file for file in foreign if sysroot != Path("/") and file.is_relative_to(sysroot)}
    for root, those in ((Path("/"), foreign - inside), (sysroot, inside)):
        query = ("dpkg-query", f"--admindir={root / 'var/lib/dpkg'}")
        names = sorted(str("/" / file.relative_to(root)) for file in those)
        owners = _output(*query, "--search", *names) if names else ""
        for line in owners.splitlines():
            package, _, name = line.partition(": ")
            form = "${source:Package} ${source:Version} ${Version}"
            about = tuple(_output(*query, "-W", f"-f={form}", package).split())
            content = (root / name.lstrip("/")).read_bytes()
            found.setdefault(about, {})[Path(name).name] = _digest(content)
    components = []
    for (source, of_source, version), digests in sorted(found.items()):
        key = re.sub(r"-\d+(-cross)?$", "", _SOURCES.get(source, source))
        if key not in LIBRARIES:
            raise SystemExit(
                f"{source}: its licence is not known; add it to LIBRARIES in {__file__}"
            )
        purl = f"pkg:deb/debian/{source}@{of_source.replace(':', '%3A')}?arch=source"
        components.append(Component(key, version, digests, purl))
    return components


def _output(*command: str) -> str:
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: {result.stderr.strip()}")
    return result.stdout


def libraries_in(binaries: Iterable[Path]) -> set[str]:
    """Return the keys of the libraries whose symbols nm finds in binaries."""
    nm = os.environ.get("NM", "nm")
    symbols = _output(nm, "--demangle", "--defined-only", *map(str, binaries))
    names = re.findall(r"^[0-9a-f]+ [A-Za-z] (.+)$", symbols, re.MULTILINE)
    return {
        key
        for key, library in LIBRARIES.items()
        if any(map(re.compile(library.symbols).match, names))
    }


def document(
    wheel: zipfile.ZipFile,
    member: str,
    components: Sequence[Component],
    properties: Mapping[str, str],
) -> Json:
    """Return the SBOM of a wheel's binary."""
    said = Parser().parsestr(wheel.read(_in_dist_info(wheel, "METADATA")).decode())
    purl = f"pkg:pypi/{said['Name']}@{said['Version']}"
    main = {
        "type": "library",
        "bom-ref": purl,
        "name": said["Name"],
        "version": said["Version"],
        "licenses": [{"expression": said["License-Expression"]}],
        "purl": purl,
        "components": [
            {"type": "file", "name": member, "hashes": _sha256(_digest(wheel.read(member)))}
        ],
    }
    if properties:
        main["properties"] = [
            {"name": f"vkbloom:spirv:{key}", "value": value} for key, value in properties.items()
        ]
    listed = [one.to_json() for one in components]
    made = time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", time.time())))
    name = uuid.uuid5(uuid.NAMESPACE_URL, json.dumps([main, listed]))
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{name}",
        "version": 1,
        "metadata": {"timestamp": time.strftime("%Y-%m-%dT%H:%M:%SZ", made), "component": main},
        "components": listed,
        "dependencies": [{"ref": purl, "dependsOn": [one["bom-ref"] for one in listed]}],
    }


def _in_dist_info(wheel: zipfile.ZipFile, name: str) -> str:
    (found,) = (one for one in wheel.namelist() if re.fullmatch(rf"[^/]+\.dist-info/{name}", one))
    return found


def rewrite(path: Path, added: Mapping[str, bytes]) -> None:
    """Write a wheel again with more files in its .dist-info.

    Names are sorted, RECORD is the last, and times are SOURCE_DATE_EPOCH.
    """
    with zipfile.ZipFile(path) as wheel:
        record = _in_dist_info(wheel, "RECORD")
        folder = record.removesuffix("RECORD")
        content = {one: wheel.read(one) for one in wheel.namelist() if not one.endswith("/")}
        modes = {one.filename: one.external_attr >> 16 & 0o111 for one in wheel.infolist()}
    content.update({folder + name: data for name, data in added.items()})
    del content[record]
    lines = []
    for name, data in sorted(content.items()):
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        lines.append(f"{name},sha256={digest},{len(data)}\n")
    files = [*sorted(content.items()), (record, "".join([*lines, f"{record},,\n"]).encode())]
    made = time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", time.time())))[:6]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as wheel:
        for name, data in files:
            info = zipfile.ZipInfo(name, made)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (0o100755 if modes.get(name) else 0o100644) << 16
            wheel.writestr(info, data)


def add(wheel: Path, options: argparse.Namespace) -> None:
    """Add the SBOM to a wheel."""
    used = used_files(options.map.read_text(errors="replace"))
    components = [from_source(key, version, files) for key, version, *files in options.source]
    components += of_packages(used, options.own.resolve(), options.sysroot.resolve())
    found = libraries_in(options.symbols)
    if left_out := found - {one.key for one in components}:
        raise SystemExit(f"{wheel}: nm finds {', '.join(sorted(left_out))}, not in the SBOM")
    with zipfile.ZipFile(wheel) as opened:
        properties = json.loads(options.properties.read_text()) if options.properties else {}
        made = document(opened, options.member, components, properties)
    name = made["metadata"]["component"]["name"]
    rewrite(wheel, {f"sboms/{name}.cdx.json": f"{json.dumps(made, indent=1)}\n".encode()})
    print(f"{wheel.name}: {', '.join(LIBRARIES[one.key].name for one in components)}")


@functools.cache
def _schema() -> Any:
    """Return CycloneDX' own schema; it takes a second to load."""
    from cyclonedx.schema import SchemaVersion  # noqa: PLC0415  (the build root has none)
    from cyclonedx.validation.json import JsonStrictValidator  # noqa: PLC0415

    return JsonStrictValidator(SchemaVersion.V1_6)


def check(path: Path) -> None:
    """Validate a wheel's SBOM, and compare its hash of the binary."""
    with zipfile.ZipFile(path) as wheel:
        text = wheel.read(_in_dist_info(wheel, r"sboms/[^/]+\.cdx\.json")).decode()
        if error := _schema().validate_str(text):
            raise SystemExit(f"{path}: {error}")
        for file in json.loads(text)["metadata"]["component"]["components"]:
            if file["hashes"] != _sha256(_digest(wheel.read(file["name"]))):
                raise SystemExit(f"{path}: {file['name']} has another hash than in the SBOM")
    print(f"{path.name}: its SBOM is valid")


def main() -> None:
    """Run a command."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(required=True)
    adding = commands.add_parser("add")
    adding.add_argument("wheel", type=Path, help="the wheel, which is written again")
    adding.add_argument("member", help="the binary in it")
    adding.add_argument("map", type=Path, help="the linker's map of it")
    adding.add_argument("--own", type=Path, default=Path(), help="the build's folder")
    adding.add_argument("--sysroot", type=Path, default=Path("/"), help="another system's packages")
    adding.add_argument("--symbols", type=Path, nargs="+", required=True)
    adding.add_argument("--source", nargs="+", action="append", default=[])
    adding.add_argument("--properties", type=Path, help="what made the SPIR-V")
    adding.set_defaults(run=lambda options: add(options.wheel, options))
    checking = commands.add_parser("check")
    checking.add_argument("wheels", type=Path, nargs="+")
    checking.set_defaults(run=lambda options: [check(one) for one in options.wheels])
    options = parser.parse_args()
    options.run(options)


if __name__ == "__main__":
    main()
