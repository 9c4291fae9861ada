"""Render a grid on Ray: ``python on_ray.py``.

RAY_ADDRESS names the cluster; without it, Ray starts one on this machine. All nodes need the same
Python with vkbloom, and a shared file system that has the current folder. Each task renders a part
of the grid. A task whose worker or node dies runs again.
"""

from __future__ import annotations

from pathlib import Path

import ray
from workload import render

PARTS = 8
CORES = 4


# Lavapipe uses as many threads as the task has cores.
@ray.remote(
    num_cpus=CORES, max_retries=-1, runtime_env={"env_vars": {"LP_NUM_THREADS": str(CORES)}}
)
def part(number: int, store: str) -> None:
    """Render one part, in a worker."""
    render(None, store, (number, PARTS))


def main() -> None:
    """Render all parts, each in a task."""
    ray.init()
    store = str(Path("ray.zarr").resolve())
    # It creates the store. A node with another driver or version then refuses the others.
    ray.get(part.remote(1, store))
    ray.get([part.remote(number, store) for number in range(2, PARTS + 1)])


if __name__ == "__main__":
    main()
