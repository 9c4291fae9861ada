"""Render a grid on Kubernetes: ``python on_kubernetes.py IMAGE s3://BUCKET/grid.zarr``.

It needs dask-kubernetes, and its operator in the cluster. IMAGE is a container with vkbloom, its
extra grid and a Vulkan driver (vkbloom-lavapipe is one). A Zarr store in an object storage needs
no shared file system: fsspec's package for it (s3fs, gcsfs) goes into IMAGE, and its keys into the
environment of the workers.
"""

from __future__ import annotations

import sys

from dask.distributed import Client
from dask_kubernetes.operator import KubeCluster
from workload import render


def main() -> None:
    """Start the workers as pods, render, and remove them."""
    if len(sys.argv) != 3:
        raise SystemExit("usage: python on_kubernetes.py IMAGE STORE")
    image, store = sys.argv[1:]
    with (
        KubeCluster(
            name="vkbloom",
            image=image,
            n_workers=4,
            resources={"requests": {"cpu": "2", "memory": "2Gi"}, "limits": {"cpu": "2"}},
            env={"LP_NUM_THREADS": "2"},
            worker_command=["dask-worker", "--nthreads", "1"],
        ) as cluster,
        Client(cluster) as client,
    ):
        client.wait_for_workers(1)
        render(client, store)


if __name__ == "__main__":
    main()
