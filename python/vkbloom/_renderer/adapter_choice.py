"""Which adapter a name selects.

A name is "auto", "software", "hardware", "uuid:" with the beginning of a UUID, "pci:" with an
address, or a part of an adapter's name. Where CUDA_VISIBLE_DEVICES is set, of NVIDIA's GPUs only
the first that it lists is selected, unless the name is a UUID or an address.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from vkbloom import _core
from vkbloom._c_paths import in_utf8
from vkbloom._renderer.adapter import AdapterInfo, from_core

# For "auto", from the best to the last.
_TYPES: Final = ("discrete", "integrated", "virtual", "cpu", "other")
_NVIDIA: Final = 0x10DE
_ADDRESS: Final = re.compile(r"(?:([\da-f]{1,8}):)?([\da-f]{1,2}):([\da-f]{1,2})\.([\da-f])", re.I)


class _Adapter(NamedTuple):
    """An adapter, with its driver and its number among the driver's adapters."""

    driver: str
    number: int
    info: AdapterInfo
    vendor: int
    is_conformant: bool

    @property
    def rank(self) -> tuple[bool, int]:
        """Its rank for "auto"; lower is better."""
        return not self.is_conformant, _TYPES.index(self.info.type)

    def fits(self, choice: str) -> bool:
        """Whether a name selects this adapter, or several with it."""
        if _is_device(choice):
            key, value = choice.split(":", 1)
            return self.has_uuid(value) if key.lower() == "uuid" else self.has_address(value)
        if choice in ("software", "hardware"):
            return (self.info.type == "cpu") is (choice == "software")
        return choice == "auto" or choice.lower() in self.info.name.lower()

    def has_uuid(self, text: str) -> bool:
        """Whether its UUID begins so: with or without "GPU-" before it and dashes in it."""
        digits = text.lower().removeprefix("gpu-").replace("-", "")
        return bool(digits) and self.info.uuid.replace("-", "").startswith(digits)

    def has_address(self, text: str) -> bool:
        """Whether its address on the PCI bus is this one, whose domain may be missing."""
        given, address = _ADDRESS.fullmatch(text), _ADDRESS.fullmatch(self.info.pci)
        if not given or not address:
            return False
        return [int(a or "0", 16) for a in given.groups()] == [int(a, 16) for a in address.groups()]

    def describe(self, choice: str) -> str:
        """Return name, type and what selects it, for messages."""
        parts = [self.info.type, *["bundled"] * self.info.bundled]
        if self.info.type != "cpu" or _is_device(choice):
            parts += [f"uuid:{self.info.uuid}", *[f"pci:{self.info.pci}"] * bool(self.info.pci)]
        return f"{self.info.name} ({', '.join(parts)})"


def _is_device(choice: str) -> bool:
    return choice.lower().startswith(("uuid:", "pci:"))


def _list_adapters(driver: str) -> list[_Adapter]:
    return [
        _Adapter(driver, number, from_core(adapter), adapter[9], adapter[10])
        for number, adapter in enumerate(_core.adapters(in_utf8(driver) or driver))
    ]


def _visible(gpus: list[_Adapter], listed: str) -> list[_Adapter]:
    """Return the GPU that CUDA_VISIBLE_DEVICES lists first, if it is there.

    CUDA counts different GPUs by address only where CUDA_DEVICE_ORDER is PCI_BUS_ID.
    """
    first = re.split("[, ]", listed.lstrip(" "))[0]
    if first.isdecimal():
        return sorted(gpus, key=lambda gpu: gpu.info.pci)[int(first) :][:1]
    return [gpu for gpu in gpus if first.lower().startswith("gpu-") and gpu.has_uuid(first)][:1]


def _limiting(choice: str) -> str | None:
    is_limited = choice != "software" and not _is_device(choice)
    return os.environ.get("CUDA_VISIBLE_DEVICES") if is_limited else None


def _best(choice: str, adapters: Sequence[_Adapter]) -> _Adapter | None:
    """Return the adapter that a name selects. ValueError: it fits several equal GPUs."""
    fitting = [adapter for adapter in adapters if adapter.fits(choice)]
    gpus = [adapter for adapter in adapters if adapter.vendor == _NVIDIA]
    listed = _limiting(choice)
    if gpus and listed is not None:
        for gpu in _visible(gpus, listed):
            if gpu in fitting:
                return gpu
        fitting = [adapter for adapter in fitting if adapter.vendor != _NVIDIA]
    best = min(fitting, key=lambda adapter: adapter.rank, default=None)
    if best is None or choice in ("auto", "software", "hardware") or _is_device(choice):
        return best
    equal = [adapter for adapter in fitting if adapter.info.name == best.info.name]
    # Two drivers may offer one device.
    uuids = {adapter.info.uuid for adapter in equal if adapter.info.type != "cpu"}
    if uuids - {best.info.uuid}:
        names = ", ".join(adapter.describe(choice) for adapter in equal)
        raise ValueError(
            f'adapter: "{choice}" fits several equal GPUs: {names}. Name one, such as '
            f'"uuid:{best.info.uuid}", or set CUDA_VISIBLE_DEVICES'
        )
    return best


def choose_adapter(choice: str, driver: str) -> tuple[int, str]:
    """Return the number of the adapter that a name selects, and the path of its driver.

    `driver` is that of a bundled driver, "" for none; "" is returned for the system's. A bundled
    software adapter takes precedence over the system's; for "software" those are then not listed.
    """
    adapters: list[_Adapter] = []
    best: _Adapter | None = None
    if not driver or choice != "software":
        try:
            adapters = _list_adapters("")
        except _core.AdapterNotFoundError:
            if not driver:
                raise
        best = _best(choice, adapters)
    if driver and (best is None or best.rank >= (False, _TYPES.index("cpu"))):
        bundled = _list_adapters(driver)
        adapters += bundled
        best = _best(choice, bundled) or best
    if best is not None:
        return best.number, in_utf8(best.driver) or best.driver
    names = ", ".join(adapter.describe(choice) for adapter in adapters) or "none"
    is_limited = _limiting(choice) is not None
    among = " among the GPUs that CUDA_VISIBLE_DEVICES names" * is_limited
    _core.fail_without_adapter(f'no Vulkan adapter for "{choice}"{among}; found: {names}')
