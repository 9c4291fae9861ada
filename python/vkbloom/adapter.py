"""List the Vulkan adapters of this machine."""

from __future__ import annotations

import dataclasses

from vkbloom import _core


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
    summary : str
        All of these on one line.

    See Also
    --------
    adapters : Lists the adapters.
    Renderer : Chooses an adapter by type or name.

    Examples
    --------
    >>> info = vkbloom.AdapterInfo("llvmpipe", "cpu", "llvmpipe", "Mesa 25.0.7", "1.4.305")
    >>> info.summary
    'llvmpipe (cpu, Mesa 25.0.7, Vulkan 1.4.305)'
    """

    name: str
    type: str
    driver: str
    driver_info: str
    api_version: str

    @property
    def summary(self) -> str:
        """All attributes on one line."""
        driver = self.driver_info or self.driver or "unnamed driver"
        return f"{self.name} ({self.type}, {driver}, Vulkan {self.api_version})"


def adapters() -> tuple[AdapterInfo, ...]:
    """List the adapters that can run vkbloom, in the system's order.

    Returns
    -------
    tuple of AdapterInfo
        Empty if no driver works, or if the Vulkan loader is missing.

    Raises
    ------
    Error
        The Vulkan loader fails.

    See Also
    --------
    AdapterInfo : Describes an adapter.
    Renderer : Chooses an adapter by type or name.

    Examples
    --------
    >>> any(adapter.type == "cpu" for adapter in vkbloom.adapters())
    True
    """
    try:
        found = _core.adapters()
    except _core.AdapterNotFoundError:
        return ()
    return tuple(AdapterInfo(*adapter[:5]) for adapter in found)
