"""Fuzz readers: ``python tools/fuzz/run.py TARGET... [--seconds N] [--corpus FOLDER]``.

The run starts from the target's valid files and from ``corpus/TARGET.zip``, the inputs that earlier
runs saved. New inputs of this run are saved in FOLDER, if it is given.

With atheris the inputs are guided by the coverage of the package's Python code, of one target.
Without it, or with --plain, they are mutations of valid files. The run ends with a finding: an
exception that the reader does not document, more than MIB of additional memory, or with --plain
an input that takes more than two minutes. The input is then written to the folder as
``finding-TARGET-SEED``.

``python tools/fuzz/run.py custom --plain --jobs 0 --executions 1000000 --forks`` tries a million
sources of custom methods on all cores. The compiler of --forks is built from ``forks.cpp``, or
given.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

Run = Callable[[str, bytes], None]


#: Seconds after which an input counts as one that hangs.
MAX_SECONDS = 120


def limit_memory(more: int) -> None:
    """Limit the growth of the address space to this many bytes."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + more
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def saved_inputs(target: str) -> list[bytes]:
    """Return the inputs that earlier runs saved."""
    path = Path(__file__).parent / "corpus" / f"{target}.zip"
    if not path.exists():
        return []
    with zipfile.ZipFile(path) as archive:
        return [archive.read(name) for name in archive.namelist()]


def overdue(*_: object) -> None:
    """End an input that hangs."""
    # (Readers may raise TimeoutError, which is an OSError.)
    raise AssertionError(f"the input takes more than {MAX_SECONDS} s")


def spread(options: argparse.Namespace) -> int:
    """Run the targets in several processes, each from its own seed; return 1 with a finding."""
    jobs = options.jobs or os.cpu_count() or 1
    arguments = [*options.targets, "--plain", f"--seconds={options.seconds}"]
    arguments += [f"--memory={options.memory}"]
    arguments += [f"--inputs={options.inputs}"] if options.inputs else []
    arguments += [f"--forks={options.forks}"] if options.forks else []
    if options.executions:
        arguments += [f"--executions={-(-options.executions // jobs)}"]
    started = [
        subprocess.Popen([sys.executable, __file__, *arguments, f"--seed={options.seed + number}"])
        for number in range(jobs)
    ]
    statuses = [process.wait() for process in started]
    return int(any(statuses))


def read_options() -> argparse.Namespace:
    """Read the options of the command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("targets", nargs="+", metavar="TARGET")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--inputs", type=int, help="the most to start from of each target")
    parser.add_argument("--memory", type=int, default=1024)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--executions", type=int, help="--plain: how many, in place of --seconds")
    parser.add_argument("--jobs", type=int, default=1, help="--plain: processes; 0: all cores")
    parser.add_argument(
        "--forks", nargs="?", const="", help="custom: compile by forks.cpp, as built"
    )
    options = parser.parse_args()
    if not options.plain:
        options.plain = importlib.util.find_spec("atheris") is None
    if not options.plain and len(options.targets) > 1:
        parser.error("TARGET: atheris takes one; use --plain for several")
    return options


def run_plain(options: argparse.Namespace, inputs: dict[str, list[bytes]], run: Run) -> None:
    """Try mutations of the inputs of each target."""
    import mutate

    for name, seeds in inputs.items():
        start = time.monotonic()
        count = len(seeds)
        for data in mutate.inputs(seeds, options.seed):
            run(name, data)
            count += 1
            seconds = time.monotonic() - start
            if count >= options.executions if options.executions else seconds > options.seconds:
                break
        print(f"{name}: {count} executions in {seconds:.0f} s, nothing found", flush=True)


def run_guided(options: argparse.Namespace, name: str, seeds: list[bytes], run: Run) -> None:
    """Try inputs that atheris chooses by coverage."""
    import atheris
    import targets

    corpus = options.corpus or targets.FOLDER / "corpus"
    corpus.mkdir(exist_ok=True)
    for number, seed in enumerate(seeds):
        (corpus / f"seed-{number}").write_bytes(seed)
    arguments = [f"-max_total_time={options.seconds:.0f}", f"-seed={options.seed}"]
    arguments += ["-rss_limit_mb=0", "-max_len=65536", "-len_control=0", "-keep_seed=1"]
    atheris.Setup([sys.argv[0], *arguments, str(corpus)], lambda data: run(name, data))
    atheris.Fuzz()


def main() -> int:
    """Run the targets; return 1 if there is a finding."""
    options = read_options()
    if options.forks == "":
        import forks

        options.forks = str(forks.built(Path(tempfile.mkdtemp(prefix="vkbloom-fuzz-"))))
    if options.plain and options.jobs != 1:
        return spread(options)
    if options.plain:
        import targets
    else:
        import atheris

        with atheris.instrument_imports(include=["vkbloom"]):
            import targets
    if options.forks:
        import forks

        from vkbloom._custom import compiler

        compiler.run_limited = forks.Forks(Path(options.forks)).run_limited

    def run(name: str, data: bytes) -> None:
        signal.alarm(MAX_SECONDS if options.plain else 0)
        try:
            targets.run(targets.TARGETS[name], data)
        except BaseException:
            Path(f"finding-{name}-{options.seed}").write_bytes(data)
            raise
        finally:
            if options.plain:
                signal.alarm(0)

    signal.signal(signal.SIGALRM, overdue)
    # Readers load libraries when they read the first file.
    inputs = {name: targets.TARGETS[name].seeds() + saved_inputs(name) for name in options.targets}
    # Evenly between the first and the last one.
    inputs = {
        name: seeds[:: -(-len(seeds) // (options.inputs or len(seeds)))]
        for name, seeds in inputs.items()
    }
    for name, seeds in inputs.items():
        for seed in seeds:
            run(name, seed)
    limit_memory(options.memory << 20)
    if options.plain:
        run_plain(options, inputs, run)
        return 0
    ((name, seeds),) = inputs.items()
    run_guided(options, name, seeds, run)
    return 0


if __name__ == "__main__":
    sys.exit(main())
