"""The Vulkan adapters of this machine."""

from __future__ import annotations

import dataclasses

from vkbloom import _core


@dataclasses.dataclass(frozen=True)
class AdapterInfo:
    """One adapter that can run vkbloom.

    Attributes
    ----------
    name : str
        As the driver calls the device.
    type : str
        "cpu", "integrated", "discrete", "virtual" or "other".
    driver, driver_info : str
        The driver and its version, in its own words; "" where it has none.
    api_version : str
        Of Vulkan.
    summary : str
        All of it on one line.
    """

    name: str
    type: str
    driver: str
    driver_info: str
    api_version: str

    @property
    def summary(self) -> str:
        """All of it on one line."""
        driver = self.driver_info or self.driver or "unnamed driver"
        return f"{self.name} ({self.type}, {driver}, Vulkan {self.api_version})"


def adapters() -> tuple[AdapterInfo, ...]:
    """List the adapters that can run vkbloom, in the system's order.

    Returns
    -------
    tuple of AdapterInfo
        Empty where no driver works, or where the Vulkan loader is missing.

    Raises
    ------
    Error
        The loader is there, but fails.
    """
    try:
        found = _core.adapters()
    except _core.AdapterNotFoundError:
        return ()
    return tuple(AdapterInfo(*adapter[:5]) for adapter in found)
