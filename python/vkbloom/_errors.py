"""The package's own exceptions, which the core raises."""

from __future__ import annotations


class Error(Exception):
    """Something failed in the core; base of the package's own exceptions.

    Attributes
    ----------
    vk_call : str or None
        The Vulkan call that failed.
    vk_result : int or None
        The VkResult that it answered.
    """

    __module__ = "vkbloom"

    def __init__(
        self, message: str = "", vk_call: str | None = None, vk_result: int | None = None
    ) -> None:
        super().__init__(message)
        self.vk_call = vk_call
        self.vk_result = vk_result


class AdapterNotFoundError(Error, RuntimeError):
    """No adapter fits; says what was found, what is missing and what to install."""

    __module__ = "vkbloom"


class DeviceLostError(Error):
    """The device was lost or did not answer; the renderer can only be closed."""

    __module__ = "vkbloom"


class OutOfMemoryError(Error, MemoryError):
    """The host or the device has no memory left."""

    __module__ = "vkbloom"


class ValidationError(Error):
    """The validation layer objected to a Vulkan call."""

    __module__ = "vkbloom"


class ShaderError(Error):
    """The driver refused a shader."""

    __module__ = "vkbloom"
