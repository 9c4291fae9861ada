"""Render a grid on all GPUs of this machine: ``python on_gpus.py``.

Each GPU has a worker, a process that sees no other GPU. ``LocalCUDACluster`` of dask-cuda starts
such workers, too.
"""

from __future__ import annotations

from dask.distributed import Client, Nanny, Scheduler, SpecCluster
from workload import render

import vkbloom


def main() -> None:
    """Start the workers and render."""
    gpus = [adapter.uuid for adapter in vkbloom.adapters() if adapter.type == "discrete"]
    if not gpus:
        raise SystemExit("vkbloom finds no discrete GPU")
    workers = {
        number: {
            "cls": Nanny,
            "options": {"nthreads": 1, "env": {"CUDA_VISIBLE_DEVICES": f"GPU-{uuid}"}},
        }
        for number, uuid in enumerate(gpus)
    }
    scheduler = {"cls": Scheduler, "options": {"dashboard": False}}
    with SpecCluster(workers=workers, scheduler=scheduler) as cluster, Client(cluster) as client:
        render(client, "gpus.zarr")


# Workers are new processes, which import this file: without this line, each would start a cluster.
if __name__ == "__main__":
    main()
