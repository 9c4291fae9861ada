"""Render a grid on machines that SSH reaches: ``python on_ssh.py HOST HOST ...``.

It needs asyncssh, which takes users, ports and keys from ~/.ssh/config. The scheduler runs on the
first host and a worker on each of the others. Keys must open them without a password. All need the
same Python with vkbloom, and a shared file system that has the current folder.
"""

from __future__ import annotations

import sys
from pathlib import Path

from dask.distributed import Client, SSHCluster
from workload import render


def main() -> None:
    """Start scheduler and workers over SSH, and render."""
    hosts = sys.argv[1:]
    if len(hosts) < 2:
        raise SystemExit("usage: python on_ssh.py SCHEDULER WORKER [WORKER ...]")
    with (
        SSHCluster(
            hosts,
            worker_options={"nthreads": 1},
            remote_python=sys.executable,
        ) as cluster,
        Client(cluster) as client,
    ):
        client.wait_for_workers(len(hosts) - 1)
        render(client, str(Path("ssh.zarr").resolve()))


if __name__ == "__main__":
    main()
