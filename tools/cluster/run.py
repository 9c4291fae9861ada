"""Try the scripts of examples/cluster.

Slurm with two nodes on this machine renders a grid of 2,000 points. A worker is killed, then a node
with its daemon; the store must have the bytes of a local grid. Then a node has another version of
vkbloom, then another driver if one is given; the grid must refuse it and name both. Prints the
times.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from pathlib import Path

import psutil
from daemons import NODES, Cluster, Slurm, adopt, end, end_all, output, wait_until
from workload import IMAGE

import vkbloom

CHUNKS = 200
KILLED_PARTS = ("3", "7")
ORIGIN = "import vkbloom; print(vkbloom.Renderer().info.driver_info)"


class Trials:
    """The scripts in a folder, and the times that they took."""

    def __init__(self, folder: Path, examples: Path) -> None:
        self.folder = folder
        self.times: list[tuple[str, float]] = []
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(examples, folder)
        shutil.copy(Path(__file__).with_name("workload.py"), folder)

    def say(self, what: str, seconds: float) -> None:
        """Add a row to the table."""
        self.times.append((what, seconds))
        print(f"{what}: {seconds:.1f} s", flush=True)

    def start(self, *command: str | Path, cluster: Cluster | None = None) -> psutil.Popen:
        """Start a command in the folder."""
        environ = {**psutil.Process().environ(), **(cluster.environ if cluster else {})}
        environ["PATH"] = f"{Path(sys.executable).parent}:{environ['PATH']}"
        with (self.folder / "output.log").open("wb") as log:
            return psutil.Popen(command, cwd=self.folder, env=environ, stdout=log, stderr=log)

    def finish(self, process: psutil.Popen, *, fails: bool = False) -> str:
        """Wait for a command and return what it printed."""
        failed = process.wait(600) != 0
        text = (self.folder / "output.log").read_text(errors="replace")
        if failed != fails:
            what = "it failed" if failed else "it did not fail"
            raise RuntimeError(f"{process}: {what}\n{text[-8000:]}")
        return text

    def compare(self, store: str, whole: str) -> None:
        """Raise an error unless two stores have the same files with the same bytes."""
        found, expected = (
            {
                path.relative_to(base): path.read_bytes()
                for path in base.rglob("*")
                if path.is_file()
            }
            for base in (self.folder / store, self.folder / whole)
        )
        if found != expected:
            other = sorted(map(str, dict(found.items() ^ expected.items())))
            raise RuntimeError(f"{store}: other bytes than in {whole}: {other}")
        print(f"{store}: {len(found)} files, byte for byte those of {whole}", flush=True)

    def local(self) -> None:
        """Render the grid here."""
        begun = time.perf_counter()
        code = "from workload import render; render(None, 'local.zarr')"
        self.finish(self.start(sys.executable, "-c", code))
        self.say("local", time.perf_counter() - begun)

    def killed(self, cluster: Cluster, name: str, *command: str) -> None:
        """Run a script on a cluster, kill a worker and a node, and compare."""
        store = self.folder / f"{name}.zarr"
        begun = time.perf_counter()
        process = self.start(sys.executable, *command, cluster=cluster)

        def done(share: float) -> bool:
            if process.poll() is not None:
                self.finish(process, fails=True)
                raise RuntimeError(f"{name}: ended before anything was killed")
            return len(list(store.glob("done/c.*"))) >= share * CHUNKS

        end([wait_until(lambda: done(0.05) and cluster.worker(NODES[0]), f"{name}: points", 120)])
        wait_until(lambda: done(0.2), f"{name}: more points", 120)
        end(cluster.processes(NODES[1]))
        at = len(list(store.glob("done/c.*")))
        self.finish(process)
        self.say(
            f"{name}: worker and node killed ({at} of {CHUNKS} chunks)", time.perf_counter() - begun
        )
        self.compare(store.name, "local.zarr")
        cluster.restart_node(NODES[1])
        shutil.rmtree(store)
        begun = time.perf_counter()
        self.finish(self.start(sys.executable, *command, cluster=cluster))
        self.say(f"{name}: undisturbed", time.perf_counter() - begun)
        self.compare(store.name, "local.zarr")

    def refused(
        self, cluster: Cluster, name: str, *command: str, named: tuple[str, str], **environ: str
    ) -> None:
        """Run a script while a node differs; both origins must be named."""
        shutil.rmtree(self.folder / f"{name}.zarr")
        cluster.restart_node(NODES[1], **environ)
        begun = time.perf_counter()
        text = self.finish(self.start(sys.executable, *command, cluster=cluster), fails=True)
        found = [line for line in text.splitlines() if all(one in line for one in named)]
        if not found:
            raise RuntimeError(f"{name}: no line names {named}\n{text[-8000:]}")
        self.say(f"{name}: refused {named[1]}", time.perf_counter() - begun)
        print(f"    {found[-1].strip()}", flush=True)

    def parts(self, slurm: Slurm) -> None:
        """Run the job array, kill two of its tasks, and repeat them."""
        vkbloom.write(self.folder / "picture.exr", IMAGE)
        script = (self.folder / "parts.sbatch").read_text()
        # The number of parts sets the chunks, which must be equal.
        each = script.replace("$SLURM_ARRAY_TASK_ID/16", "$part/16").replace(
            "parts.zarr", "whole.zarr"
        )
        whole = f"SLURM_CPUS_PER_TASK=4; for part in $(seq 16); do\n{each}\ndone"
        begun = time.perf_counter()
        self.finish(self.start("sh", "-c", whole))
        self.say("job array: the whole, local", time.perf_counter() - begun)
        begun = time.perf_counter()
        environ = slurm.environ
        job = self.submit(slurm, "--array=1-16")

        def tasks(*states: str) -> list[str]:
            asked = ("squeue", "--noheader", "--array", f"--jobs={job}", "--format=%K", *states)
            return output(*asked, **environ).split()

        for number in KILLED_PARTS:
            wait_until(lambda n=number: n in tasks("--states=running"), f"task {number}", 300)
            time.sleep(0.5)
            output("scancel", "--signal=KILL", "--full", f"{job}_{number}", **environ)
        wait_until(lambda: not tasks(), "the job array", 600)
        if (report := vkbloom.check_grid(self.folder / "parts.zarr")).complete or report.problems:
            raise RuntimeError(f"after killed parts: {report}")
        self.submit(slurm, f"--array={','.join(KILLED_PARTS)}", "--wait")
        self.say(f"job array: {KILLED_PARTS} killed and repeated", time.perf_counter() - begun)
        self.compare("parts.zarr", "whole.zarr")

    def submit(self, slurm: Slurm, *options: str) -> str:
        """Submit parts.sbatch and return its number."""
        return self.finish(
            self.start("sbatch", "--parsable", *options, "parts.sbatch", cluster=slurm)
        ).strip()


def others(folder: Path, driver: str | None) -> list[tuple[tuple[str, str], dict[str, str]]]:
    """Return what is tried as another origin: the two names, and the environment that has it."""
    metadata = folder / "other" / "vkbloom-0.0.1.dist-info" / "METADATA"
    metadata.parent.mkdir(parents=True, exist_ok=True)
    metadata.write_text("Metadata-Version: 2.1\nName: vkbloom\nVersion: 0.0.1\n")
    found = [((vkbloom.__version__, "0.0.1"), {"PYTHONPATH": str(metadata.parents[1])})]
    if driver:
        names = [output(sys.executable, "-c", ORIGIN, **more) for more in ({}, driver_of(driver))]
        found.append(((names[0], names[1]), driver_of(driver)))
    return found


def driver_of(manifest: str) -> dict[str, str]:
    """Return the environment that selects a Vulkan driver."""
    return {"VK_DRIVER_FILES": manifest}


def main() -> None:
    """Try all, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("examples", type=Path)
    parser.add_argument("--driver", help="manifest of another driver")
    asked = parser.parse_args()
    folder = asked.folder.resolve()
    adopt()
    trials = Trials(folder / "work", asked.examples)
    try:
        trials.local()
        begun = time.perf_counter()
        slurm = Slurm(folder / "work" / "slurm.daemons")
        trials.say("slurm: daemons started", time.perf_counter() - begun)
        trials.killed(slurm, "slurm", "on_slurm.py")
        trials.parts(slurm)
        for named, environ in others(folder, asked.driver):
            trials.refused(slurm, "slurm", "on_slurm.py", named=named, **environ)
    finally:
        end_all()
    print("\n| | seconds |\n|---|---:|")
    for what, seconds in trials.times:
        print(f"| {what} | {seconds:.1f} |")


if __name__ == "__main__":
    main()
