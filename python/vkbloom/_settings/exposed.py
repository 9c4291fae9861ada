"""Settings with the stages in time, as the core reads them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from vkbloom._settings.antialiasing import Antialiasing
from vkbloom._settings.blocks import antialiasing_block, exposure_block
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
    """Settings, an exposure, the seconds since the frame before, and temporal anti-aliasing.

    Everything else that a renderer asks settings for is that of the settings.
    """

    settings: Settings
    exposure: Exposure | None
    dt: float
    antialiasing: Antialiasing | None = None

    def __getattr__(self, name: str) -> Any:
        # copy and pickle ask for methods before there are fields.
        if name == "settings":
            raise AttributeError(name)
        return getattr(self.settings, name)

    def to_record(self, before: Mapping[str, Any] | None) -> dict[str, Any]:
        """Return the stages in time as JSON has them.

        - `before`: What the frame continued, as lists of numbers; None: it is not known.
        """
        stages = {"exposure": self.exposure, "taa": self.antialiasing}
        record: dict[str, Any] = {
            name: stage.to_dict() for name, stage in stages.items() if stage is not None
        }
        # A history is too long for a record.
        known = before if self.antialiasing is None else None
        return record | {"dt": self.dt, "state": known}

    @property
    def meter_mask(self) -> MeterMask | None:
        """The mask of the meter, for the core."""
        mask = getattr(self.exposure, "mask", None)
        return None if mask is None else MeterMask(mask)

    def _core_block(self) -> bytes:
        block, exposure, taa = self.settings._core_block(), self.exposure, self.antialiasing
        if exposure is not None:
            numbers, table = exposure._numbers_of_step(self.dt), exposure._core_table()
            block = exposure_block(block, exposure._core_engine, numbers, table)
        if taa is not None:
            numbers, weights = taa._core_numbers_of_frame(), taa.filter_weights()
            after = taa.order == "after"
            block = antialiasing_block(block, taa._core_engine, numbers, weights, after=after)
        return block

    @property
    def _continues(self) -> bool:
        """Whether a frame depends on those before."""
        adapts = self.exposure is not None and self.exposure._adapts
        return adapts or self.antialiasing is not None or self.settings._continues

    def _after(self, seconds: float) -> ExposedSettings:
        """Return the same with other seconds since the frame before."""
        return self if seconds == self.dt else dataclasses.replace(self, dt=seconds)

    def _in_sequence(self, index: int, state: dict[Any, Any]) -> ExposedSettings:
        return dataclasses.replace(self, settings=self.settings._in_sequence(index, state))


def expose(
    settings: Settings,
    exposure: Exposure | None,
    dt: float,
    taa: Antialiasing | None = None,
) -> Settings:
    """Return settings with stages in time, which renderers take for settings; None: without it."""
    if exposure is None and taa is None:
        return settings
    return cast("Settings", ExposedSettings(settings, exposure, dt, taa))


def keywords_of(settings: Settings) -> dict[str, Any]:
    """Return settings, and their stages in time, as keywords of a call that takes no steps."""
    if isinstance(settings, ExposedSettings):
        stages = {"exposure": settings.exposure, "taa": settings.antialiasing}
        return {"settings": settings.settings} | {
            name: stage for name, stage in stages.items() if stage is not None
        }
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
    if "taa" in record:
        keywords["taa"] = Antialiasing.from_dict(record["taa"])
    if "dt" in record:
        keywords["dt"] = check_seconds("dt", record["dt"])
    state = record.get("state")
    if state is not None:
        keywords["state"] = {
            name: np.array(values, np.float32) for name, values in dict(state).items()
        }
    return keywords
