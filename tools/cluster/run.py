"""Run the scripts of examples/cluster under Slurm with two nodes on this machine.

``python tools/cluster/run.py FOLDER EXAMPLES``. Each script renders a grid of 2,000 points; the
store must have the bytes of a local grid. Prints the times. tests/grid kills workers and processes,
and lets a worker have another driver or version.
"""

from __future__ import annotations

import getpass
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from workload import IMAGE

import vkbloom

NODES = ("node1", "node2")
CORES = 4  # of each node, as the scripts ask for
LOCAL = "from workload import render; render(None, 'alone.zarr')"


@contextmanager
def daemon(folder: Path, *command: str | Path) -> Iterator[None]:
    """Run a daemon in the foreground, with a log, and end it."""
    with (folder / f"{command[0]} {command[-1]}.log".replace("/", "_")).open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.terminate()
        process.wait(30)


def free_port() -> int:
    """Return a TCP port that nothing listens on."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


def wait_until(condition: Callable[[], bool], what: str) -> None:
    """Wait until a condition holds; TimeoutError names it."""
    latest = time.monotonic() + 120
    while not condition():
        if time.monotonic() > latest:
            raise TimeoutError(f"{what}: not within 120 s")
        time.sleep(0.1)


def idle_nodes() -> int:
    """Return how many nodes Slurm reports as idle."""
    command = ("sinfo", "--noheader", "--Node", "--states=idle", "--format=%N")
    asked = subprocess.run(command, capture_output=True, check=False)
    return len(asked.stdout.split())


@contextmanager
def slurm(folder: Path) -> Iterator[None]:
    """Run munged, slurmctld and a slurmd for each node; all their files are in the folder."""
    folder.mkdir()
    key, munge = folder / "munge.key", folder / "munge.socket"
    key.write_bytes(os.urandom(128))
    key.chmod(0o400)
    host = socket.gethostname().partition(".")[0]
    nodes = "\n".join(
        f"NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={free_port()} "
        f"CPUs={CORES} RealMemory=8000"
        for name in NODES
    )
    (folder / "slurm.conf").write_text(
        f"""ClusterName=vkbloom
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={free_port()}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmUser={getpass.getuser()}
SlurmdUser={getpass.getuser()}
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmdSpoolDir={folder}/spool.%n
StateSaveLocation={folder}/state
AuthInfo=socket={munge}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
# The nodes claim more cores than this machine may have.
SlurmdParameters=config_overrides
{nodes}
PartitionName=main Nodes=ALL Default=YES
"""
    )
    os.environ |= {"SLURM_CONF": f"{folder}/slurm.conf", "VKBLOOM_INTERFACE": "lo"}
    with ExitStack() as stack:
        files = [f"--{name}-file={folder}/munge.{name}" for name in ("pid", "log", "seed")]
        files += [f"--key-file={key}", f"--socket={munge}"]
        stack.enter_context(daemon(folder, "munged", "--foreground", "--force", *files))
        wait_until(munge.exists, "munged")
        stack.enter_context(daemon(folder, "slurmctld", "-D"))
        for name in NODES:
            stack.enter_context(daemon(folder, "slurmd", "-D", "-N", name))
        wait_until(lambda: idle_nodes() == len(NODES), "idle nodes")
        yield


def time_command(what: str, *command: str) -> None:
    """Run a command, and print how long it took."""
    begun = time.perf_counter()
    subprocess.run(command, check=True)
    print(f"{what}: {time.perf_counter() - begun:.1f} s", flush=True)


def compare(store: str, whole: str) -> None:
    """Raise an error unless two stores have the same files with the same bytes."""
    actual, expected = (
        {path.relative_to(base): path.read_bytes() for path in base.rglob("*") if path.is_file()}
        for base in (Path(store), Path(whole))
    )
    if actual != expected:
        other = sorted(map(str, dict(actual.items() ^ expected.items())))
        raise RuntimeError(f"{store}: other bytes than in {whole}: {other}")
    print(f"{store}: {len(actual)} files, byte for byte those of {whole}", flush=True)


def main() -> None:
    """Run all scripts."""
    work, examples = Path(sys.argv[1]).resolve() / "work", Path(sys.argv[2])
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(examples, work)
    shutil.copy(Path(__file__).with_name("workload.py"), work)
    os.chdir(work)
    os.environ["PATH"] = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    vkbloom.write("picture.exr", IMAGE)
    # The number of parts sets the chunks, which must be equal.
    script = Path("parts.sbatch").read_text().replace("$SLURM_ARRAY_TASK_ID/16", "$part/16")
    script = script.replace("parts.zarr", "whole.zarr")
    time_command("whole", sys.executable, "-c", LOCAL)
    time_command("two workers", sys.executable, "on_this_machine.py")
    compare("local.zarr", "alone.zarr")
    parts = f"SLURM_CPUS_PER_TASK=4; for part in $(seq 16); do\n{script}\ndone"
    time_command("parts, local", "sh", "-c", parts)
    with slurm(work / "slurm.daemons"):
        time_command("slurm", sys.executable, "on_slurm.py")
        compare("slurm.zarr", "alone.zarr")
        time_command("job array", "sbatch", "--wait", "--array=1-16", "parts.sbatch")
        compare("parts.zarr", "whole.zarr")


if __name__ == "__main__":
    main()
