"""References as hashes: of the framebuffers of a test, for drivers that draw equal bits."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom._io import safe_writing

# Hashes of framebuffers by name, by the hash of the driver that drew them.
Hashes = dict[str, dict[str, str]]


def hashes_of(images: Mapping[str, NDArray[Any]]) -> dict[str, str]:
    """Return the SHA-256 of each image: of its dtype, its shape and its values."""
    results = {}
    for name, image in images.items():
        digest = hashlib.sha256(f"{image.dtype.name} {image.shape} ".encode())
        little = image.astype(image.dtype.newbyteorder("<"), copy=False)
        digest.update(np.ascontiguousarray(little).data)
        results[name] = digest.hexdigest()
    return results


def load(file: Path) -> Hashes:
    """Read the references of a name; an empty dict if there are none."""
    try:
        listed = json.loads(file.read_text())
        return {driver: {**hashes} for driver, hashes in listed.items()}
    except FileNotFoundError:
        return {}
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"{file}: not a list of hashes: {error}") from error


def save(file: Path, hashes: Hashes) -> None:
    """Write the references of a name."""
    file.parent.mkdir(parents=True, exist_ok=True)
    safe_writing.write_file(file, f"{json.dumps(hashes, indent=1)}\n".encode())


def difference(expected: Mapping[str, str], actual: Mapping[str, str]) -> str | None:
    """Return the first framebuffer that differs, is missing or is new, in words; None if none."""
    for name, digest in actual.items():
        if name not in expected:
            return f"{name} is not in the reference"
        if expected[name] != digest:
            return f"{name} is the first framebuffer whose values are not the reference's"
    lost = [name for name in expected if name not in actual]
    return f"{lost[0]} is missing" if lost else None
