"""Render a grid on the processes of this machine: ``python on_this_machine.py``."""

from __future__ import annotations

import os

from dask.distributed import Client, LocalCluster
from workload import render

WORKERS = 2


def main() -> None:
    """Start the workers, each with its share of the cores, and render."""
    # Lavapipe would use all cores in each worker.
    os.environ.setdefault("LP_NUM_THREADS", str(max(1, (os.cpu_count() or 1) // WORKERS)))
    with (
        LocalCluster(n_workers=WORKERS, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        render(client, "local.zarr")


# Workers are new processes, which import this file: without this line, each would start a cluster.
if __name__ == "__main__":
    main()
