"""Draw the same pictures on this CPU and on emulated ones, and print how far they differ.

Each program runs with Mesa's choice of instructions and with the frozen one. Emulated CPUs are
QEMU's (qemu-user). The driver is that of the wheel in dist/, or the system's. `make same-bits`.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Final

import numpy as np

ROOT: Final = Path(__file__).resolve().parents[1]
#: The programs, and the Python that has what they import.
PROGRAMS: Final = {
    "vkbloom": (ROOT / "packaging" / "same_bits.py", sys.executable),
    "pygfx": (
        ROOT / "packaging" / "pygfx_scenes.py",
        str(ROOT / "build" / "engines" / "pygfx" / "bin" / "python"),
    ),
}
#: Without AVX; with AVX2, FMA and F16C; the same of another vendor.
CPUS: Final = ("Nehalem", "Haswell", "EPYC-Rome")
#: As of vkbloom_lavapipe, for a driver that is not its own.
FROZEN: Final = {"GALLIUM_OVERRIDE_CPU_CAPS": "sse4.1", "LP_NATIVE_VECTOR_WIDTH": "128"}


def _variables(driver: str, frozen: bool, work: Path) -> dict[str, str]:
    """Return the environment of a run."""
    # OpenBLAS' kernels for this CPU would not run on others.
    own = {name: value for name, value in os.environ.items() if not name.startswith("OPENBLAS_")}
    found = {
        **own,
        # What another run has compiled is not used.
        "MESA_SHADER_CACHE_DISABLE": "true",
        "VKBLOOM_CACHE_DIR": str(work / "cache"),
        "VKBLOOM_DRIVER": "system",
    }
    if driver != "wheel":
        given = dict.fromkeys(("VK_DRIVER_FILES", "VK_ICD_FILENAMES"), driver)
        return {**found, **(FROZEN if frozen else {}), **(given if driver != "system" else {})}
    site = work / "site"
    if not site.exists():
        (wheel,) = (ROOT / "dist").glob("vkbloom_lavapipe-*_x86_64.whl")
        zipfile.ZipFile(wheel).extractall(site)
    command = [sys.executable, "-m", "vkbloom_lavapipe", "--json", *(["--frozen"] * frozen)]
    path = {**os.environ, "PYTHONPATH": str(site)}
    printed = subprocess.run(command, env=path, check=True, capture_output=True, text=True).stdout
    return {**found, **json.loads(printed)}


def _draw(program: str, words: list[str], cpu: str | None, variables: dict[str, str]) -> Path:
    """Run a program on a CPU, and return the file with its pictures.

    ChildProcessError: the program, or the emulator, failed.
    """
    script, python = PROGRAMS[program]
    file = Path(variables["VKBLOOM_CACHE_DIR"]).with_name(f"{program}-{cpu}.npz")
    emulator = []
    if cpu is not None:
        qemu = shutil.which("qemu-x86_64") or shutil.which("qemu-x86_64-static")
        if qemu is None:
            sys.exit("qemu-x86_64 is missing: apt install qemu-user")
        emulator = [qemu, "-cpu", cpu]
    shutil.rmtree(variables["VKBLOOM_CACHE_DIR"], ignore_errors=True)
    command = [*emulator, python, str(script), "--arrays", str(file), *words]
    done = subprocess.run(command, env=variables, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ChildProcessError(
            f"{' '.join(command)}: status {done.returncode}\n{done.stderr[-2000:]}"
        )
    return file


def differences(one: Path, other: Path) -> tuple[int, int, float, int]:
    """Compare two files of pictures.

    Returns how many there are, how many differ, by how much floats differ as a share of the largest
    value of their picture, and integers in levels.
    """
    share, levels, different = 0.0, 0, 0
    with np.load(one) as first, np.load(other) as second:
        for name in first.files:
            if np.array_equal(first[name], second[name], equal_nan=first[name].dtype.kind == "f"):
                continue
            different += 1
            expected, found = first[name].astype(float), second[name].astype(float)
            largest = float(np.nanmax(np.abs(found - expected)))
            if first[name].dtype.kind == "f":
                share = max(share, largest / float(np.nanmax(np.abs(expected))))
            else:
                levels = max(levels, round(largest))
        return len(first.files), different, share, levels


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--driver", default="wheel", help="wheel, system, or a driver's manifest")
    parser.add_argument("--program", choices=list(PROGRAMS), default="vkbloom")
    parser.add_argument("--cpus", nargs="+", default=list(CPUS))
    parser.add_argument("--words", nargs="*", default=[], help="options of the program")
    options = parser.parse_args()
    print("| code | CPU | framebuffers that differ | floats, share of the largest | levels |")
    print("|---|---|---|---|---|", flush=True)
    failed = False
    words = [f"--{word}" if word == "only" else word for word in options.words]
    with tempfile.TemporaryDirectory() as folder:
        for frozen in (False, True):
            variables = _variables(options.driver, frozen, Path(folder))
            native = _draw(options.program, words, None, variables)
            for cpu in options.cpus:
                try:
                    other = _draw(options.program, words, cpu, variables)
                except ChildProcessError as error:
                    # QEMU's AVX2 has faults, which frozen code avoids.
                    if frozen:
                        raise
                    print(f"| the CPU's | {cpu} | {str(error).splitlines()[0]} | | |", flush=True)
                    continue
                count, different, share, levels = differences(native, other)
                failed |= frozen and different > 0
                code = "frozen" if frozen else "the CPU's"
                print(
                    f"| {code} | {cpu} | {different} of {count} | {share:.2g} | {levels} |",
                    flush=True,
                )
    sys.exit(failed)


if __name__ == "__main__":
    main()
