"""Settings with an exposure, as the core reads them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from vkbloom._settings.blocks import exposure_block
from vkbloom._settings.exposure import Exposure, check_seconds

if TYPE_CHECKING:
    from vkbloom._core_kernel import CoreKernel
    from vkbloom._settings.settings import Settings


class MeterMask:
    """The mask of a meter, which the core asks for its pixels."""

    def __init__(self, mask: Any) -> None:
        self._mask = mask

    def core_kernel(self, frame: object, buffers: object) -> CoreKernel:
        """Return the mask as the core reads a kernel."""
        from vkbloom._core_kernel import core_kernel  # noqa: PLC0415  costs start-up time

        return core_kernel(self._mask.array)


@dataclasses.dataclass(frozen=True)
class ExposedSettings:
    """Settings, an exposure, and the seconds since the frame before.

    Everything else that a renderer asks settings for is that of the settings.
    """

    settings: Settings
    exposure: Exposure
    dt: float

    def __getattr__(self, name: str) -> Any:
        # copy and pickle ask for methods before there are fields.
        if name == "settings":
            raise AttributeError(name)
        return getattr(self.settings, name)

    def to_record(self, before: Mapping[str, Any] | None) -> dict[str, Any]:
        """Return the stages in time as JSON has them.

        - `before`: What the frame continued, as lists of numbers; None: it is not known.
        """
        return {"exposure": self.exposure.to_dict(), "dt": self.dt, "state": before}

    @property
    def meter_mask(self) -> MeterMask | None:
        """The mask of the meter, for the core."""
        mask = getattr(self.exposure, "mask", None)
        return None if mask is None else MeterMask(mask)

    def _core_block(self) -> bytes:
        exposure = self.exposure
        numbers, table = exposure._numbers_of_step(self.dt), exposure._core_table()
        return exposure_block(self.settings._core_block(), exposure._core_engine, numbers, table)

    @property
    def _continues(self) -> bool:
        """Whether a frame depends on those before."""
        return self.exposure._adapts or self.settings._continues

    def _after(self, seconds: float) -> ExposedSettings:
        """Return the same with other seconds since the frame before."""
        return self if seconds == self.dt else dataclasses.replace(self, dt=seconds)

    def _in_sequence(self, index: int, state: dict[Any, Any]) -> ExposedSettings:
        return dataclasses.replace(self, settings=self.settings._in_sequence(index, state))


def expose(settings: Settings, exposure: Exposure | None, dt: float) -> Settings:
    """Return settings with an exposure, which renderers take for settings; None: as they are."""
    if exposure is None:
        return settings
    return cast("Settings", ExposedSettings(settings, exposure, dt))


def keywords_of(settings: Settings) -> dict[str, Any]:
    """Return settings, and their stages in time, as keywords of a call that takes no steps."""
    if isinstance(settings, ExposedSettings):
        return {"settings": settings.settings, "exposure": settings.exposure}
    return {"settings": settings}


def read_record(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords of a call from the result of `to_record`; raise TypeError or ValueError.

    Without a state that is not known.
    """
    if not isinstance(record, Mapping):
        raise TypeError(f"stages: {record!r} is not a mapping")
    keywords: dict[str, Any] = {}
    if "exposure" in record:
        keywords["exposure"] = Exposure.from_dict(record["exposure"])
    if "dt" in record:
        keywords["dt"] = check_seconds("dt", record["dt"])
    state = record.get("state")
    if state is not None:
        keywords["state"] = {
            name: np.array(values, np.float32) for name, values in dict(state).items()
        }
    return keywords
