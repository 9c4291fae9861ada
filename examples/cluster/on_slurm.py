"""Render a grid on a SLURM cluster: ``python on_slurm.py`` on a login node.

It needs dask-jobqueue. Each worker is one job. The folder that this is started in must be on a file
system that all nodes share, and vkbloom must be installed there.
"""

from __future__ import annotations

import os
from pathlib import Path

from dask.distributed import Client
from dask_jobqueue import SLURMCluster
from workload import render

CORES = 4


def main() -> None:
    """Submit the jobs, render, and cancel them."""
    with (
        SLURMCluster(
            queue=os.environ.get("SLURM_PARTITION"),
            cores=CORES,
            processes=1,
            memory="4GB",
            walltime="01:00:00",
            # The name of the network that the nodes reach each other by.
            interface=os.environ.get("VKBLOOM_INTERFACE"),
            worker_extra_args=["--nthreads", "1"],
            # Lavapipe uses as many threads as the job has cores.
            job_script_prologue=[f"export LP_NUM_THREADS={CORES}", f"cd {Path.cwd()}"],
        ) as cluster,
        Client(cluster) as client,
    ):
        cluster.scale(jobs=2)
        # Those that start later get their share.
        client.wait_for_workers(1)
        render(client, str(Path("slurm.zarr").resolve()))


if __name__ == "__main__":
    main()
