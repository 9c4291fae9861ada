"""The base classes of the stages of glare, and functions for the field `Settings.glare`."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, Final

from vkbloom import _core
from vkbloom._public import public
from vkbloom._settings.fields import CoreNumbers, fields_of, number_field
from vkbloom._settings.named import Named
from vkbloom._settings.records import Record
from vkbloom._settings.registry import NAMED_STAGES, STAGES


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Glare(Record):
    """Base class of the stages of glare; use a stage's class, such as `Streaks`.

    Stages are frozen and hashable. Their light is added to the bloom: the composite adds
    i b + sum of i_k g_k instead of i b. Here b is the bloom and i its intensity; g_k and i_k are
    the framebuffer and the intensity of stage k. `Dirt` multiplies this sum.
    """

    _class_key: ClassVar[str] = "stage"
    _subject: ClassVar[str] = "glare"
    _example: ClassVar[str] = "a stage, such as Streaks"
    _core_numbers: ClassVar[CoreNumbers] = _core.GLARE_VALUES
    stage: ClassVar[str]
    #: Whether the stage adds light of its own; the other kind changes the sum, and is there once.
    _adds_light: ClassVar[bool] = False

    @classmethod
    def _classes(cls) -> Mapping[str, type[Glare]]:
        return STAGES


@dataclasses.dataclass(frozen=True, kw_only=True)
class GlareLight(Glare):
    """Base class of the stages that add light; use a stage's class, such as `Streaks`.

    Parameters
    ----------
    intensity : float
        Factor of the stage's light, 0 to 65504.
    threshold : float
        Subtracted from each channel that the stage reads, 0 to 65504. Negative differences become
        0. It is subtracted after the halvings, in which small highlights become dark and vanish:
        one, two or three halvings leave at most 1/16, 1/68 or 1/276 of a single pixel's value. If
        alpha is blurred, it is multiplied by the factor of the brightest channel.
    halvings : int
        Number of times that the stage's input is halved, 0 to 4, by the 13 taps of `Pyramid`. Each
        halving makes the stage four times as fast, and its light coarser.

    Notes
    -----
    A stage reads what glows: ``glow``, with threshold, mask and emission. Published methods apply
    threshold and mask in a later pass. With them, the stages have a threshold pass of their own,
    which uses the formulas of `Settings`. Texels outside of the picture are black. The framebuffers
    of stages are "rgba32float" if the bloom buffers are, and otherwise "rgba16float".
    """

    _adds_light: ClassVar[bool] = True

    intensity: float = number_field(slider=(0, 4))
    threshold: float = number_field(slider=(0, 16))
    halvings: int = number_field()


#: Name to stages, for ``glare=vkbloom.glares[name]``, or ``glare=name``. ``vkbloom glares`` and
#: ``docs/glare.md`` list what they are, with their sources.
glares: Final[Named[tuple[Glare, ...]]] = NAMED_STAGES


def check_glare(glare: object) -> tuple[Glare, ...]:
    """Return the stages of settings."""
    if isinstance(glare, Glare | Mapping):
        glare = (glare,)
    if isinstance(glare, str | bytes) or not isinstance(glare, Iterable):
        raise TypeError(f"glare: {glare!r} is not a sequence of stages")
    stages = []
    for part in glare:
        stage = Glare.from_dict(part) if isinstance(part, Mapping) else part
        if not isinstance(stage, Glare):
            raise TypeError(f"glare: {part!r} is not a stage, such as Streaks()")
        stages.append(stage)
    others = [stage for stage in stages if not stage._adds_light]
    if len(others) > 1:
        name = type(others[0]).__name__
        raise ValueError(f"glare: there is more than one {name}; give one")
    if len(stages) > _core.MAX_STAGES:
        raise ValueError(f"glare: {len(stages)} stages are out of range, 0 to {_core.MAX_STAGES}")
    return tuple(stages)


def stage_field_of(glare: tuple[Glare, ...], name: str) -> tuple[int, str]:
    """Return the stage and the field of a name such as "glare.0.intensity"."""
    parts = name.split(".")
    if len(parts) == 3 and parts[0] == "glare" and parts[1].isdecimal():
        index = int(parts[1])
        if index < len(glare) and parts[2] in fields_of(type(glare[index])):
            return index, parts[2]
    known = [
        f"glare.{index}.{field}"
        for index, stage in enumerate(glare)
        for field in fields_of(type(stage))
    ]
    raise ValueError(
        f"glare: {name!r} is not a field of a stage: {', '.join(known) or 'no stages'}"
    )


def replace_stages(glare: tuple[Glare, ...], changes: Mapping[str, Any]) -> tuple[Glare, ...]:
    """Return stages with some fields changed, by names such as "glare.0.intensity"."""
    stages_now = list(glare)
    for name, value in changes.items():
        index, field = stage_field_of(glare, name)
        changed: Any = dataclasses.replace(stages_now[index], **{field: value})
        stages_now[index] = changed
    return tuple(stages_now)
