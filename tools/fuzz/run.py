"""Fuzz readers: ``python tools/fuzz/run.py TARGET... [--seconds N] [--corpus FOLDER]``.

The run starts from the target's valid files and from ``corpus/TARGET.zip``, the inputs that earlier
runs saved. New inputs of this run are saved in FOLDER, if it is given.

With atheris the inputs are guided by the coverage of the package's Python code, of one target.
Without it, or with --plain, they are mutations of valid files. The run ends with a finding: an
exception that the reader does not document, or more than MIB of additional memory. The input is
then written to the folder as ``finding-TARGET``.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
import zipfile
from pathlib import Path


def limit_memory(more: int) -> None:
    """Limit the growth of the address space to this many bytes."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + more
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def kept(target: str) -> list[bytes]:
    """Return the inputs that earlier runs saved."""
    path = Path(__file__).parent / "corpus" / f"{target}.zip"
    if not path.exists():
        return []
    with zipfile.ZipFile(path) as archive:
        return [archive.read(name) for name in archive.namelist()]


def main() -> int:
    """Run one target; return 1 if there is a finding."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("targets", nargs="+", metavar="TARGET")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--inputs", type=int, help="the most to start from of each target")
    parser.add_argument("--memory", type=int, default=1024)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--plain", action="store_true")
    options = parser.parse_args()
    if not options.plain:
        try:
            import atheris
        except ImportError:
            options.plain = True
    if not options.plain:
        with atheris.instrument_imports(include=["vkbloom"]):
            import targets
    else:
        import targets
    import mutate

    if not options.plain and len(options.targets) > 1:
        parser.error("TARGET: atheris takes one; use --plain for several")

    def run(name: str, data: bytes) -> None:
        try:
            targets.run(targets.TARGETS[name], data)
        except BaseException:
            Path(f"finding-{name}").write_bytes(data)
            raise

    # Readers load libraries when they read the first file.
    inputs = {name: targets.TARGETS[name].seeds() + kept(name) for name in options.targets}
    # Evenly between the first and the last one.
    inputs = {
        name: seeds[:: -(-len(seeds) // (options.inputs or len(seeds)))]
        for name, seeds in inputs.items()
    }
    for name, seeds in inputs.items():
        for seed in seeds:
            run(name, seed)
    limit_memory(options.memory << 20)
    for name, seeds in inputs.items() if options.plain else ():
        end = time.monotonic() + options.seconds
        count = len(seeds)
        for data in mutate.inputs(seeds, options.seed):
            run(name, data)
            count += 1
            if time.monotonic() > end:
                break
        print(f"{name}: {count} executions in {options.seconds:g} s, nothing found")
    if options.plain:
        return 0
    ((name, seeds),) = inputs.items()
    corpus = options.corpus or targets.FOLDER / "corpus"
    corpus.mkdir(exist_ok=True)
    for number, seed in enumerate(seeds):
        (corpus / f"seed-{number}").write_bytes(seed)
    arguments = [f"-max_total_time={options.seconds:.0f}", f"-seed={options.seed}"]
    arguments += ["-rss_limit_mb=0", "-max_len=65536", "-len_control=0", "-keep_seed=1"]
    atheris.Setup([sys.argv[0], *arguments, str(corpus)], lambda data: run(name, data))
    atheris.Fuzz()
    return 0


if __name__ == "__main__":
    sys.exit(main())
