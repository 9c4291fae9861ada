"""Framebuffers with what they were made with: what `Frames` is for the modules that it uses."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from vkbloom._settings.settings import Settings


class Framebuffers(Mapping[str, NDArray[Any]]):
    """Framebuffers by name, in the order of the data flow; see `Frames`."""

    @property
    @abc.abstractmethod
    def timings(self) -> Mapping[str, float]:
        """Seconds on the device by pass name."""

    @property
    @abc.abstractmethod
    def settings(self) -> Settings:
        """The settings of the request."""

    @property
    @abc.abstractmethod
    def info(self) -> dict[str, Any]:
        """Adapter, driver and version, and the numbers of "nan" and "inf" values in the input."""

    def _stages(self) -> dict[str, str]:
        """Return the stages in time of a call that had some, as JSON by the key "stages"."""
        return {name: text for name, text in self.info.items() if name == "stages"}
