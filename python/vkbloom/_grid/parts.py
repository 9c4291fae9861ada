"""Parts of a grid, for job arrays: each process renders one, and none waits for another."""

from __future__ import annotations

import os
from typing import Any, Final, TypeAlias

__all__ = ["WHOLE", "Part", "read_part"]

#: The number of a part, from 1, and the number of parts.
Part: TypeAlias = tuple[int, int]

WHOLE: Final[Part] = (1, 1)

_AUTO: Final = "auto"
# Variables of schedulers: the number of a task of an array, and where one tells it, of the last
# one or of all. Sources: the manuals of Slurm, Grid Engine, LSF, OpenPBS, TORQUE, AWS Batch,
# Kubernetes (indexed Jobs) and Cloud Run.
_ARRAYS: Final = {
    "SLURM_ARRAY_TASK_ID": "SLURM_ARRAY_TASK_COUNT",
    "SGE_TASK_ID": "SGE_TASK_LAST",
    "LSB_JOBINDEX": "LSB_JOBINDEX_END",
    "PBS_ARRAY_INDEX": None,
    "PBS_ARRAYID": None,
    "AWS_BATCH_JOB_ARRAY_INDEX": "AWS_BATCH_JOB_ARRAY_SIZE",
    "JOB_COMPLETION_INDEX": None,
    "CLOUD_RUN_TASK_INDEX": "CLOUD_RUN_TASK_COUNT",
}


def read_part(part: Any) -> Part:
    """Check a part: (i, n), or text such as "3/16", "auto/16" and "auto"; None is the whole.

    i is 1 to n. 0 is the same as n, so that arrays that count from 0 have all parts, too.
    """
    if part is None:
        return WHOLE
    given = part
    if isinstance(part, str):
        task, _, parts = part.partition("/")
        if task == _AUTO:
            task, tasks = _task()
            parts = parts or tasks
        if not all(word.isascii() and word.isdecimal() for word in (task, parts)):
            raise ValueError(f"part: {given!r} is not I/N, such as 3/16 or auto/16")
        part = (int(task), int(parts))
    if not isinstance(part, tuple | list) or len(part) != 2:
        raise TypeError(f"part: {given!r} is not a pair (i, n), such as (3, 16)")
    if any(isinstance(number, bool) or not hasattr(number, "__index__") for number in part):
        raise TypeError(f"part: {given!r} is not a pair of integers")
    number, count = (value.__index__() for value in part)
    if not 0 <= number <= count or count < 1:
        hint = "; write auto/N if not all tasks of the array run" if given == _AUTO else ""
        raise ValueError(f"part: {number} of {count} is not 1 to {max(count, 1)}{hint}")
    return number or count, count


def _task() -> tuple[str, str]:
    """Return the number of this process in its job array, and the number of tasks or ""."""
    for name, count in _ARRAYS.items():
        found = os.environ.get(name, "")
        # Grid Engine and LSF set "undefined" and "0" in jobs that are not arrays.
        if found.isdecimal() and (name, found) != ("LSB_JOBINDEX", "0"):
            return found, os.environ.get(count, "") if count else ""
    raise ValueError(
        f"part: this process is not a task of a job array; none of {', '.join(_ARRAYS)} is set"
    )
