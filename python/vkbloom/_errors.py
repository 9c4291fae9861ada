"""The package's own exceptions, which the core raises."""

from __future__ import annotations

from typing import Any, Self

from vkbloom._public import public


@public("vkbloom")
class Error(Exception):
    """Something failed in the core; base of the package's own exceptions.

    Attributes
    ----------
    vk_call : str or None
        The Vulkan call that failed.
    vk_result : int or None
        The VkResult that it answered.
    """

    def __init__(
        self, message: str = "", vk_call: str | None = None, vk_result: int | None = None
    ) -> None:
        super().__init__(message)
        self.vk_call = vk_call
        self.vk_result = vk_result


@public("vkbloom")
class AdapterNotFoundError(Error, RuntimeError):
    """No adapter fits; says what was found, what is missing and what to install."""


@public("vkbloom")
class DeviceLostError(Error):
    """The device was lost or did not answer; the renderer can only be closed."""


@public("vkbloom")
class OutOfMemoryError(Error, MemoryError):
    """The host or the device has no memory left."""

    def __new__(cls, *args: Any, **_: Any) -> Self:
        # MemoryError's refuses subclasses of two classes. Dask calls it for a worker's exception.
        return Exception.__new__(cls, *args)


@public("vkbloom")
class ValidationError(Error):
    """The validation layer objected to a Vulkan call."""


@public("vkbloom")
class ShaderError(Error):
    """The driver refused a shader."""
