"""List the Vulkan adapters of this machine."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from types import ModuleType

from vkbloom import _core
from vkbloom._c_paths import in_utf8
from vkbloom._public import public


@public("vkbloom")
@dataclasses.dataclass(frozen=True)
class AdapterInfo:
    """An adapter that can run vkbloom.

    Attributes
    ----------
    name : str
        The device's name, from the driver.
    type : str
        "cpu", "integrated", "discrete", "virtual" or "other".
    driver, driver_info : str
        Name and version of the driver, as the driver reports them; "" if it reports none.
    api_version : str
        The Vulkan version of the device.
    bundled : bool
        Whether the driver comes from the package ``vkbloom-lavapipe`` or from VKBLOOM_DRIVER;
        otherwise the system's Vulkan loader found it.
    uuid : str
        The device's UUID, in lower case. NVIDIA's tools print it after "GPU-".
    pci : str
        The device's address on the PCI bus, such as "0000:3b:00.0"; "" if it is not on one.
    summary : str
        Name, type, driver and Vulkan version on one line.
    """

    name: str
    type: str
    driver: str
    driver_info: str
    api_version: str
    bundled: bool = False
    uuid: str = ""
    pci: str = ""

    @property
    def summary(self) -> str:
        """All attributes on one line."""
        driver = self.driver_info or self.driver or "unnamed driver"
        kind = f"{self.type}, bundled" if self.bundled else self.type
        return f"{self.name} ({kind}, {driver}, Vulkan {self.api_version})"


def bundled_driver() -> str:
    """Return the path of the driver that needs no Vulkan loader; "" if there is none.

    The environment variable VKBLOOM_DRIVER names one: the path of a driver's library or of its
    manifest (JSON), or "system" for none. Without it, the package ``vkbloom-lavapipe`` has one.
    """
    chosen = os.environ.get("VKBLOOM_DRIVER")
    if chosen == "system":
        return ""
    if chosen:
        return _library_of(chosen) if chosen.endswith(".json") else chosen
    package = _package()
    return "" if package is None else str(package.LIBRARY)


def bundled_hash() -> str:
    """Return the SHA-256 of the driver in ``vkbloom-lavapipe``; "" for other drivers.

    Two drivers with the same hash draw the same bits on every CPU. Other drivers have no hash here,
    since their results also depend on shared libraries and on the CPU.
    """
    package = None if os.environ.get("VKBLOOM_DRIVER") else _package()
    return "" if package is None else str(package.SHA256)


def _package() -> ModuleType | None:
    try:
        import vkbloom_lavapipe  # noqa: PLC0415  where it is installed
    except ModuleNotFoundError:
        return None
    return vkbloom_lavapipe  # type: ignore[no-any-return]


def _library_of(manifest: str) -> str:
    """Return the library that a driver's manifest names; a relative path starts at its folder."""
    import json  # noqa: PLC0415  costs start-up time

    try:
        with open(manifest, encoding="utf-8") as file:
            library: str = json.load(file)["ICD"]["library_path"]
        # The system searches for a name without a folder.
        return os.path.join(os.path.dirname(manifest), library) if "/" in library else library
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"VKBLOOM_DRIVER: {manifest} is not a driver's manifest") from error


@public("vkbloom")
def adapters() -> tuple[AdapterInfo, ...]:
    """List the adapters that can run vkbloom: the system's in its order, then the bundled ones.

    Returns
    -------
    tuple of AdapterInfo
        First those of the system's Vulkan loader, then those of the bundled driver. Empty if no
        driver works.

    Examples
    --------
    >>> for adapter in vkbloom.adapters():
    ...     print(adapter.name)  # doctest: +SKIP
    llvmpipe (LLVM 19.1.7, 256 bits)
    """
    listed: list[_core._AdapterTuple] = []
    for driver in dict.fromkeys(("", bundled_driver())):
        with contextlib.suppress(_core.AdapterNotFoundError):
            listed += _core.adapters(in_utf8(driver) or driver)
    return tuple(from_core(adapter) for adapter in listed)


def from_core(adapter: _core._AdapterTuple) -> AdapterInfo:
    """Make an AdapterInfo from the core's description of an adapter."""
    name, kind, driver, driver_info, api_version, _, bundled, uuid, pci, *_ = adapter
    return AdapterInfo(name, kind, driver, driver_info, api_version, bundled, uuid, pci)
