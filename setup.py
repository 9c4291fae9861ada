"""Builds the C core, which embeds the shaders as SPIR-V.

A source distribution has the SPIR-V, and the versions of the programs that made it. So a build from
it needs neither glslang nor spirv-opt, unless a shader was changed.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import runpy
import shutil
import signal
import struct
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.sdist import sdist

SHADERS = Path("shaders")
# GLSL that users can include, too.
LIBRARY = Path("python/vkbloom/_custom/glsl")
SPIRV = Path("build/spirv")
# Where a source distribution has its modules.
SHIPPED = Path("spirv")
# Beside the modules: the digest of their sources, and the programs' versions.
MADE = "made.json"
STAGES = (".vert", ".frag", ".comp")
# Which modules each shader has.
TABLE = SHADERS / "modules.txt"
# What all shaders begin with.
PREAMBLE = """#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/block.glsl"
"""
# Python without the GIL has no stable ABI: a core for that version alone.
LIMITED = not sysconfig.get_config_var("Py_GIL_DISABLED")
# A wheel without the core, for systems that it is not built for.
PURE = os.environ.get("VKBLOOM_PURE") == "1"
LIMITED_API = [("Py_LIMITED_API", "0x030b0000")] if LIMITED else []
# Of the package itself, which cannot be imported before its core is built.
without_contraction = runpy.run_path("python/vkbloom/_custom/spirv.py")["without_contraction"]

# The passes of spirv-opt. Without them a CPU's driver spends most of the time of a first frame on
# the work that they do once, for all who use the package. Functions become one, variables values,
# and loops of known length their bodies: copies of operations, which need NoContraction again
# before the rest simplifies them.
TO_VALUES = """
    --eliminate-local-single-block --eliminate-local-single-store
    --eliminate-dead-code-aggressive --ssa-rewrite --eliminate-dead-code-aggressive
"""
SPLIT = f"--scalar-replacement=100 --convert-local-access-chains {TO_VALUES}"
ONE_FUNCTION = f"""
    --wrap-opkill --eliminate-dead-branches --merge-return --inline-entry-points-exhaustive
    --eliminate-dead-functions --private-to-local {SPLIT} --ccp --eliminate-dead-code-aggressive
""".split()
SIMPLER = f"""
    --eliminate-dead-branches --redundancy-elimination --combine-access-chains
    --simplify-instructions {SPLIT} --vector-dce --eliminate-dead-inserts
    --eliminate-dead-branches --simplify-instructions --if-conversion --copy-propagate-arrays
    --reduce-load-size --eliminate-dead-code-aggressive --merge-blocks --redundancy-elimination
    --eliminate-dead-branches --merge-blocks --simplify-instructions --compact-ids
""".split()
# Larger modules keep their loops: those of many filters, of which their constants leave little.
# Those of shaders that the table says this of are not unrolled to find it out again.
MAX_UNROLLED = 260_000
KEEPS_LOOPS = "loops"


# What a word of a module defines (shaders/modules.txt).
WORDS = {
    **dict.fromkeys(("frag", "vert", "comp"), ""),
    "dispatch": "-DDISPATCH",
    "layers": "-DLAYERS",
    "textured": "-DTEXTURED",
    "final": "-DFINAL",
    "mixed": "-DMIXED=1",
    "transposed": "-DTRANSPOSED=1",
    "sums": "-DSUMS",
    "linear": "-DLINEAR_TEXELS -DCHANNEL_BYTES={bytes}",
    "packed": "-DLINEAR_TEXELS -DCHANNEL_BYTES={bytes} -DTARGET_CHANNELS=3",
    "rgb": "-DRGB",
    "stored": "-DLINEAR_TEXELS -DCHANNEL_BYTES=4 -DTARGET_BYTES={bytes}",
    "image": "-DSOURCE_FORMAT={glsl}",
    "spectra": "-DSOURCE_FORMAT=rg32f",
}
# The formats that a shader can be compiled for: their names in GLSL, and bytes of a channel.
FORMATS = {"rgba8unorm": ("rgba8", 1), "rgba16float": ("rgba16f", 2), "rgba32float": ("rgba32f", 4)}


class Module(NamedTuple):
    """One SPIR-V module: `dispatch` of `blur.frag` is `blur_dispatch` in C."""

    name: str
    shader: Path
    options: tuple[str, ...] = ()
    keeps_loops: bool = False


def module_of(shader: Path, text: str, keeps_loops: bool) -> Module:
    """Return a module of a shader, with the options of its words."""
    words = text.split("_")
    if unknown := [word for word in words if word not in WORDS and word not in FORMATS]:
        raise SystemExit(
            f"{TABLE}: {shader}: the module {text} has an unknown word, {unknown[0]!r}"
        )
    glsl, size = next((FORMATS[word] for word in words if word in FORMATS), ("", 0))
    options = " ".join(WORDS.get(word, "") for word in words).format(glsl=glsl, bytes=size)
    return Module(f"{shader.stem}_{text}", shader, tuple(options.split()), keeps_loops)


def all_modules() -> list[Module]:
    """Return the modules of all shaders, as the table says."""
    rows = [line.split() for line in TABLE.read_text().splitlines() if line and line[0] != "#"]
    named = {SHADERS / name: modules for name, *modules in rows}
    there = {path for path in SHADERS.rglob("*.*") if path.suffix in STAGES}
    if odd := sorted(there ^ named.keys()):
        lack = "has no row" if odd[0] in there else "is no file, and has a row"
        raise SystemExit(f"{TABLE}: {odd[0]} {lack}")
    return [
        module_of(path, text.replace("FORMAT", form), KEEPS_LOOPS in named[path])
        for path in sorted(named, key=lambda path: path.name)
        for text in named[path]
        if text != KEEPS_LOOPS
        for form in (FORMATS if "FORMAT" in text else ("",))
    ]


def tool(*names: str, package: str) -> str:
    """Return the path of a program, or end with the package that is missing."""
    for name in names:
        if path := shutil.which(name):
            return path
    raise SystemExit(f"{names[0]} is missing; on Debian or Ubuntu: apt install {package}")


def run_tool(what: object, *command: str, given: str = "") -> str:
    """Return what a program prints about a shader; end with its output if it fails."""
    piped = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    result = subprocess.run(command, **piped, input=given, text=True, check=False)
    status = result.returncode
    if status == 0:
        return result.stdout
    # A shell that started the program has 128 and the signal as its status.
    number = -status if status < 0 else status - 128
    if number in set(signal.Signals):
        reason = f"is ended by {signal.Signals(number).name} ({signal.strsignal(number)})"
    else:
        reason = f"fails with status {status}"
    raise SystemExit(f"{what}: {command[0]} {reason}:\n{result.stdout}".rstrip(":\n"))


def compiler() -> str:
    """Return the path of glslang."""
    return tool("glslangValidator", "glslang", package="glslang-tools")


def optimizer() -> str:
    """Return the path of spirv-opt."""
    return tool("spirv-opt", package="spirv-tools")


def compile_shader(module: Module, target: Path) -> None:
    """Compile one module, as glslang does, to a file."""
    options = ["-V", "--target-env", "vulkan1.1", f"-I{SHADERS}", f"-I{LIBRARY}", "--stdin"]
    stage = "comp" if "-DDISPATCH" in module.options else module.shader.suffix.removeprefix(".")
    text = f'{PREAMBLE}#include "{module.shader.relative_to(SHADERS).as_posix()}"\n'
    command = (compiler(), *options, "-S", stage, *module.options, "-o", str(target))
    run_tool(module.shader, *command, given=text)


def decorate(target: Path) -> None:
    """Give the operations of a module in a file NoContraction."""
    code = target.read_bytes()
    words = without_contraction(struct.unpack(f"={len(code) // 4}I", code))
    target.write_bytes(struct.pack(f"={len(words)}I", *words))


def optimize(module: Module, target: Path, passes: list[str]) -> None:
    """Run spirv-opt on a module in a file."""
    options = ["--target-env=vulkan1.1", "--scalar-block-layout", *passes]
    run_tool(module.shader, optimizer(), *options, str(target), "-o", str(target))


def build_module(module: Module, target: Path, recipe: str) -> None:
    """Write a module to a file, as the package contains it.

    A file stays if the digest beside it is that of what glslang has compiled, and of the recipe.
    """
    part, note = target.with_suffix(".part"), target.with_suffix(".sha256")
    compile_shader(module, part)
    digest = hashlib.sha256(recipe.encode() + part.read_bytes()).hexdigest()
    if not (target.exists() and note.exists() and note.read_text() == digest):
        decorate(part)
        optimize(module, part, ONE_FUNCTION)
        if not module.keeps_loops and part.stat().st_size <= MAX_UNROLLED:
            rolled = part.read_bytes()
            optimize(module, part, ["--loop-unroll"])
            if part.stat().st_size > MAX_UNROLLED:
                part.write_bytes(rolled)
            decorate(part)
        optimize(module, part, SIMPLER)
        part.replace(target)
        note.write_text(digest)
    part.unlink(missing_ok=True)


def sources() -> list[Path]:
    """Return what the modules are made of, and by."""
    files = [*SHADERS.rglob("*.*"), *LIBRARY.rglob("*.glsl")]
    return [Path("setup.py"), Path("python/vkbloom/_custom/spirv.py"), *sorted(files)]


def made_with(folder: Path) -> dict[str, str]:
    """Return what a folder says about its modules."""
    file = folder / MADE
    return dict(json.loads(file.read_text())) if file.exists() else {}


def compile_modules(built: list[Module], jobs: int) -> Path:
    """Return the folder that has all modules, compiled now if those at hand have other sources."""
    digest = hashlib.sha256()
    for source in sources():
        digest.update(f"{source.as_posix()} {source.stat().st_size}\n".encode())
        digest.update(source.read_bytes())
    wanted = {"sources": digest.hexdigest()}
    for folder in (SHIPPED, SPIRV):
        there = all((folder / f"{module.name}.spv").exists() for module in built)
        if there and wanted.items() <= made_with(folder).items():
            return folder
    programs = {"glslang": compiler(), "spirv-opt": optimizer()}
    versions = {
        name: run_tool(name, program, "--version").splitlines()[0]
        for name, program in programs.items()
    }
    # How modules are made: by these programs, as the first two files say.
    recipe = "\n".join([*versions.values(), *(path.read_text() for path in sources()[:2])])
    SPIRV.mkdir(parents=True, exist_ok=True)
    (SPIRV / MADE).unlink(missing_ok=True)

    def build(module: Module) -> None:
        build_module(module, SPIRV / f"{module.name}.spv", recipe)

    with ThreadPoolExecutor(jobs) as threads:
        list(threads.map(build, built))
    (SPIRV / MADE).write_text(f"{json.dumps(wanted | versions, indent=1)}\n")
    return SPIRV


def write_spirv(jobs: int) -> None:
    """Write spirv.h and spirv.c: a shader object for each module (csrc/graph/shader.h)."""
    SPIRV.mkdir(parents=True, exist_ok=True)
    built = all_modules()
    folder = compile_modules(built, jobs)
    codes = [(folder / f"{module.name}.spv").read_bytes() for module in built]
    names = {module.name for module in built}
    arrays = declared = objects = ""
    for module, code in zip(built, codes, strict=True):
        # A string, which compilers read in a third of the time of a list. It ends with a 0 more.
        words = "".join(f"\\x{word:x}" for word in struct.unpack(f"={len(code) // 4}I", code))
        arrays += f'static const uint32_t {module.name}[] = U"{words}";\n'
        hashed = ", ".join(map(str, hashlib.sha256(code).digest()[:16]))
        siblings = (
            re.sub("_frag$", "_dispatch", module.name),
            module.name.replace("_linear_", "_packed_"),
            module.name.replace("_linear_", "_linear_rgb_"),
            f"{module.name}_layers",
        )
        pointers = ", ".join(
            f"&vkb_shader_{sibling}" if sibling in names - {module.name} else "NULL"
            for sibling in siblings
        )
        declared += f"extern const struct vkb_shader vkb_shader_{module.name};\n"
        objects += (
            f'const struct vkb_shader vkb_shader_{module.name} = {{"{module.name}", {module.name}, '
            f"{len(code)}, {{{{{hashed}}}}}, {pointers}, {{0, 0}}, 0}};\n"
        )
    (SPIRV / "spirv.h").write_text(
        "// Made by setup.py from shaders/.\n#ifndef VKB_SPIRV_H\n#define VKB_SPIRV_H\n\n"
        f'#include "graph/shader.h"\n\n{declared}\n#endif\n'
    )
    (SPIRV / "spirv.c").write_text(f'#include "spirv.h"\n\n{arrays}\n{objects}')


def compiled_once(compiler: Any, jobs: int) -> Callable[..., list[str]]:
    """Return a compiler's method that compiles sources in threads, and keeps equal objects.

    An object is kept if the digest beside it is that of its source, all headers and the options.
    """
    compile_all = compiler.compile
    volk = Path(volk_folder())
    read = [*sorted(Path("csrc").rglob("*.h")), SHADERS / "params.h", SPIRV / "spirv.h"]
    read += [volk / "volk.h", volk / "volk.c"]
    headers = b"".join(path.read_bytes() for path in read)
    program = (getattr(compiler, "compiler_so", ""), compiler.include_dirs, sys.version)

    def compile_one(source: str, output_dir: str, options: dict[str, Any]) -> str:
        (made,) = compiler.object_filenames([source], output_dir=output_dir)
        note = Path(f"{made}.sha256")
        # (The order of `depends` is that of the folder on the disk.)
        asked = [(name, value) for name, value in options.items() if name != "depends"]
        text = repr((program, asked)).encode() + headers + Path(source).read_bytes()
        digest = hashlib.sha256(text).hexdigest()
        if not (Path(made).exists() and note.exists() and note.read_text() == digest):
            note.unlink(missing_ok=True)
            compile_all([source], output_dir=output_dir, **options)
            note.write_text(digest)
        return str(made)

    def compile_each(sources: list[str], output_dir: str, **options: Any) -> list[str]:
        with ThreadPoolExecutor(jobs) as threads:
            return list(threads.map(lambda one: compile_one(one, output_dir, options), sources))

    return compile_each


def processes(asked: int | None = None) -> int:
    """Return how many processes may run: -j, or the package builder's limit, or the processors."""
    debian = re.search(r"\bparallel=(\d+)", os.environ.get("DEB_BUILD_OPTIONS", ""))
    nix = re.fullmatch(r"(\d+)", os.environ.get("NIX_BUILD_CORES", ""))
    limits = [asked or 0, *(int(limit[1]) for limit in (debian, nix) if limit)]
    return next((limit for limit in limits if limit > 0), len(os.sched_getaffinity(0)))


class BuildCore(build_ext):
    """build_ext with the shaders compiled first and the compiler's options set."""

    def initialize_options(self) -> None:
        """Keep objects for the next build, in a folder that is the same for all ways to build."""
        super().initialize_options()
        self.build_temp = "build/objects"

    def build_extension(self, ext: Extension) -> None:
        """Build one extension, with the embedded shaders as one more source."""
        check_vulkan_headers()
        jobs = processes(self.parallel)
        write_spirv(jobs)
        ext.include_dirs += [volk_folder(), str(SPIRV)]
        # First, since it takes longest.
        ext.sources.insert(0, str(SPIRV / "spirv.c"))
        ext.extra_compile_args += ["-std=c11", "-fvisibility=hidden"]
        # Warnings are errors in CI only: a newer compiler must not stop a user's build.
        ext.extra_compile_args += os.environ.get("VKBLOOM_CFLAGS", "").split()
        ext.extra_link_args += os.environ.get("VKBLOOM_LDFLAGS", "").split()
        self.compiler.compile = compiled_once(self.compiler, jobs)
        super().build_extension(ext)


class DistributeSpirv(sdist):
    """sdist with the modules."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """Add them where a build looks first."""
        super().make_release_tree(base_dir, files)
        built = all_modules()
        folder = compile_modules(built, processes())
        shipped = Path(base_dir) / SHIPPED
        shipped.mkdir()
        for name in (MADE, *(f"{module.name}.spv" for module in built)):
            shutil.copyfile(folder / name, shipped / name)


def include_folders() -> list[Path]:
    """Return where headers may be: the Vulkan SDK's, the compiler's, the system's."""
    places = [Path("/usr/include"), Path("/usr/local/include")]
    for variable in ("CPATH", "C_INCLUDE_PATH"):
        places[:0] = [Path(one) for one in os.environ.get(variable, "").split(os.pathsep) if one]
    if sdk := os.environ.get("VULKAN_SDK"):
        places.insert(0, Path(sdk) / "include")
    return places


def check_vulkan_headers() -> None:
    """End with the package that is missing where there are no Vulkan headers."""
    if not any((place / "vulkan" / "vulkan.h").is_file() for place in include_folders()):
        raise SystemExit(
            "the Vulkan headers (vulkan/vulkan.h) are missing; on Debian or Ubuntu: "
            "apt install libvulkan-dev"
        )


def volk_folder() -> str:
    """Find volk.h and volk.c (Debian: libvulkan-volk-dev, elsewhere the Vulkan SDK)."""
    for place in include_folders():
        for folder in (place, place / "volk", place / "Volk"):
            if (folder / "volk.c").is_file() and (folder / "volk.h").is_file():
                return str(folder)
    raise SystemExit("volk is missing; on Debian or Ubuntu: apt install libvulkan-volk-dev")


setup(
    ext_modules=[]
    if PURE
    else [
        Extension(
            "vkbloom._core",
            sources=sorted(str(path) for path in Path("csrc").rglob("*.c")),
            depends=[
                *(str(path) for path in Path("csrc").rglob("*.h")),
                *map(str, sources()),
            ],
            include_dirs=["csrc", "."],
            define_macros=[("VK_NO_PROTOTYPES", None), *LIMITED_API],
            libraries=["m", "dl"],
            py_limited_api=LIMITED,
        )
    ],
    cmdclass={"build_ext": BuildCore, "sdist": DistributeSpirv},
    options={"bdist_wheel": {"py_limited_api": "cp311"}} if LIMITED and not PURE else {},
)
