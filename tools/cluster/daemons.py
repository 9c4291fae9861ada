"""Slurm with two nodes on this machine, which share nothing with an installed service.

Configuration, logs and state are below one folder; the ports are free ones. A node is a
daemon and what it runs. `end` ends a node as if its machine failed.
"""

from __future__ import annotations

import contextlib
import ctypes
import getpass
import os
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil

NODES = ("node1", "node2")
CORES = 4  # of each node, as the scripts ask for
PR_SET_CHILD_SUBREAPER = 36


def adopt() -> None:
    """Make this process the parent of all that it starts, daemons and their orphans, too."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def end(processes: list[psutil.Process]) -> None:
    """Kill processes."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()
    psutil.wait_procs(processes, timeout=30)


def end_all() -> None:
    """Kill everything that this process has started."""
    while found := [one for one in psutil.Process().children(recursive=True) if is_alive(one)]:
        end(found)


def is_alive(process: psutil.Process) -> bool:
    """Return whether a process runs."""
    with contextlib.suppress(psutil.NoSuchProcess):
        return bool(process.status() != psutil.STATUS_ZOMBIE)
    return False


def free_port() -> int:
    """Return a TCP port that nothing listens on."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def wait_until(find: Callable[[], Any], what: str, seconds: float = 60) -> Any:
    """Wait until a function returns something, and return it; TimeoutError names it."""
    latest = time.monotonic() + seconds
    while not (found := find()):
        if time.monotonic() > latest:
            raise TimeoutError(f"{what}: not within {seconds:.0f} s")
        time.sleep(0.02)
    return found


def output(*command: str | Path, **environ: str) -> str:
    """Return what a command prints."""
    environ = {**os.environ, **environ}
    return subprocess.run(command, env=environ, check=True, stdout=-1, text=True).stdout.strip()


class Cluster:
    """Daemons, each with a log below `folder`. `environ` is what clients need to reach them."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True)
        self.folder = folder
        self.environ: dict[str, str] = {}
        self._nodes: dict[str, psutil.Process] = {}

    def daemon(self, name: str, *command: str | Path, **environ: str) -> psutil.Process:
        """Start a daemon that stays in the foreground."""
        environ = {**os.environ, **self.environ, **environ}
        with (self.folder / f"{name}.log").open("wb") as log:
            return psutil.Popen(command, env=environ, stdout=log, stderr=log, stdin=-3)

    def start_node(self, name: str, **environ: str) -> None:
        """Start a node whose programs have these variables."""
        self._nodes[name] = self.start(name, NODE=name, **environ)

    def start(self, name: str, **environ: str) -> psutil.Process:
        """Start the daemon of a node."""
        raise NotImplementedError

    def restart_node(self, name: str, **environ: str) -> None:
        """End a node and start it again."""
        end(self.processes(name))
        self.start_node(name, **environ)
        self.wait()

    def wait(self) -> None:
        """Wait until all nodes take work."""

    def processes(self, name: str) -> list[psutil.Process]:
        """Return the daemon of a node and all that runs there."""
        found = []
        inside = {self._nodes[name].pid}
        for process in psutil.Process().children(recursive=True):
            with contextlib.suppress(psutil.Error):
                # A parent comes before its children. Slurm's jobs are no children of the daemon.
                if inside & {process.pid, process.ppid()} or process.environ().get("NODE") == name:
                    inside.add(process.pid)
                    found.append(process)
        return found

    def worker(self, name: str) -> psutil.Process | None:
        """Return the process of a node that renders; None if there is none yet."""
        for process in self.processes(name):
            with contextlib.suppress(psutil.Error):
                if "--multiprocessing-fork" in process.cmdline():
                    return process
        return None


class Slurm(Cluster):
    """munged, slurmctld, and a slurmd for each node."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        key = folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        munge = folder / "munge.socket"
        own = (f"--{name}-file={folder}/munge.{name}" for name in ("pid", "log", "seed"))
        places = (f"--key-file={key}", f"--socket={munge}", *own)
        self.daemon("munged", "munged", "--foreground", "--force", *places)
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
ReturnToService=2
SlurmdTimeout=10
{nodes}
PartitionName=main Nodes=ALL Default=YES
"""
        )
        # Jobs of on_slurm.py are Bash scripts, which begin with the file of their node.
        self.environ = {
            "SLURM_CONF": f"{folder}/slurm.conf",
            "BASH_ENV": f"{folder}/$SLURMD_NODENAME.sh",
            "VKBLOOM_INTERFACE": "lo",
        }
        wait_until(munge.exists, "munged")
        self.daemon("slurmctld", "slurmctld", "-D")
        for name in NODES:
            self.start_node(name)
        self.wait()

    def start(self, name: str, **environ: str) -> psutil.Process:
        """Start slurmd; its jobs do not inherit its environment."""
        lines = (f"export {key}='{value}'\n" for key, value in environ.items())
        (self.folder / f"{name}.sh").write_text("".join(lines))
        return self.daemon(name, "slurmd", "-D", "-N", name, **environ)

    def wait(self) -> None:
        """Wait until Slurm reports both nodes as idle."""

        def idle() -> bool:
            command = ("sinfo", "--noheader", "--Node", "--states=idle", "--format=%N")
            asked = subprocess.run(
                command, env={**os.environ, **self.environ}, capture_output=True, check=False
            )
            return len(asked.stdout.split()) == len(NODES)

        wait_until(idle, "idle nodes", 120)
