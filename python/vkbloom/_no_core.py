"""What stands in for the core where it cannot be loaded: its tables and errors, and no device.

Laws, comparisons and the reference need no more. All that needs a device raises
AdapterNotFoundError.
"""

from __future__ import annotations

import json
import sys
from importlib.resources import files
from types import ModuleType
from typing import Any

from vkbloom import _errors


def stand_in(reason: ImportError) -> ModuleType:
    """Return a module with the names of the core, which is also `vkbloom._core` from now on."""
    module = ModuleType("vkbloom._core", __doc__)
    text = files("vkbloom").joinpath("_core_tables.json").read_text()
    for name, value in json.loads(text).items():
        setattr(module, name, _as_tuples(value))

    for name, value in vars(_errors).items():
        if name.endswith("Error"):
            setattr(module, name, value)

    def refuse(*_: object, **__: object) -> Any:
        raise _errors.AdapterNotFoundError(
            f"vkbloom's core cannot be loaded: {reason}. Without it, vkbloom.reference and "
            "vkbloom.testing work, and nothing renders. Wheels with the core are for Linux on "
            "x86-64 and aarch64; elsewhere, or for a newer core, build it from the source"
        )

    types = ("Renderer", "Source", "SceneContents", "Plan", "Submission", "Exported", "Pages")
    for name in types:
        setattr(module, name, type(name, (), {"__module__": "vkbloom._core", "__new__": refuse}))
    # All else are functions.
    module.__getattr__ = lambda name: refuse  # type: ignore[method-assign]
    module.absence = str(reason)  # type: ignore[attr-defined]
    sys.modules["vkbloom._core"] = module
    return module


def _as_tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _as_tuples(part) for name, part in value.items()}
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value
