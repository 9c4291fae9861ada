"""The settings of a bloom: the fields that all methods share.

Defaults and ranges are read from the core's tables, which come from ``shaders/params.h``: each is
declared once for the shaders, the core and Python.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Final, Literal, Self, get_args

from vkbloom import _core
from vkbloom._formats import Curve
from vkbloom._public import public
from vkbloom._settings.blocks import settings_block
from vkbloom._settings.fields import (
    CoreNumbers,
    FieldInfo,
    check_fields,
    choice_field,
    fields_of,
    flag_field,
    number_field,
    value_field,
)
from vkbloom._settings.glare import Glare, check_glare, glares, replace_stages, stage_field_of
from vkbloom._settings.records import Record
from vkbloom._settings.registry import METHODS, NAMED_SETTINGS, Presets
from vkbloom._spelling import describe_unknown, did_you_mean

Shading = Literal["forward", "deferred"]
Composite = Literal["add", "mix", "screen", "soft_light", "replace"]
ToneMap = Literal["none", "reinhard", "aces", "exponential", "khronos_neutral", "agx"]
Encoding = Literal["none", Curve]
Alpha = Literal["keep", "max", "blur"]
BloomFormat = Literal[
    "rgba8unorm", "rgba16float", "rgba32float", "rg11b10ufloat", "rgba8unorm-srgb"
]

#: Keys of stored settings: what the highlights of their picture were expanded up to, and the stages
#: in time of a frame, as `ExposedSettings.to_record` has them.
EXPANDED: Final = "vkbloom:expand"
STAGES_IN_TIME: Final = "vkbloom:stages"
#: How the names of a point-spread function's fields begin.
_PSF: Final = "psf."
SHADINGS: tuple[Shading, ...] = get_args(Shading)


def _read_glare(glare: object) -> tuple[Glare, ...]:
    """Return the stages of a name in `glares`, or of `check_glare`."""
    if not isinstance(glare, str):
        return check_glare(glare)
    if glare not in glares:
        near = did_you_mean(glare, glares)
        raise ValueError(f"glare: {glare!r} is not one of {', '.join(glares)}{near}")
    return glares[glare]


@public("vkbloom")
@dataclasses.dataclass(frozen=True, kw_only=True)
class Settings(Record):
    """Base class of the settings of all methods; use a method's class, such as `Separable`.

    Settings are frozen and hashable; `replace` returns a changed copy.

    Parameters
    ----------
    bloom : bool
        Whether to run the bloom passes. False: ``final`` is the tone-mapped scene without bloom
        and without the scene's glow mesh.
    threshold : float or None
        Brightness above which a colour contributes to the bloom, 0 to 65504; None: every colour
        does. In a scene the threshold applies to the glow, with deferred shading to the
        brightness.
    knee : float
        Softness of the threshold, 0 to 1. 0: colours whose luminance is above the threshold pass
        unchanged. Otherwise, with b = max(r, g, b), k = threshold * knee and
        q = clamp(b - threshold + k, 0, 2k)^2 / (4k + 1e-5), the colour is scaled by
        max(q, b - threshold) / max(b, 1e-5).
    composite : {"add", "mix", "screen"}
        s + i b; s + (b - s) i; 1 - (1 - s)(1 - i b) with both clamped to 0..1. `GodotBloom` has two
        more.
    intensity : float
        The i of the composite, 0 to 65504.
    alpha : {"keep", "max", "blur"}
        Treatment of the alpha a of an RGBA image. "max" and "blur" need premultiplied colours.
        "keep": a does not change. "max": max(a, clamp(max over r, g, b of i b, 0, 1)), for every
        `composite`. "blur": alpha is blurred like a colour, with the weights of the colours, and is
        ``bloom[..., 3]``; the result is 1 - (1 - a)(1 - clamp(i b_a, 0, 1)). If a threshold
        subtracts instead of scaling (`FilamentBloom`), alpha is multiplied by the factor of the
        brightest channel. Scenes ignore it.
    tonemap : {"none", "reinhard", "aces", "exponential", "khronos_neutral", "agx"}
        The tone curve that is applied to the composite.
    exposure : float
        In stops, -32 to 32: the composite is multiplied by 2**exposure before the curve.
    encoding : {"none", "gamma22", "srgb", "pq", "hlg"}
        Applied to rgb after the curve. "pq" and "hlg" are those of Rec. ITU-R BT.2100: the inverse
        EOTF of c * reference_white cd/m2, clamped to 0..10000; and the OETF of
        clamp(0.26496 c, 0, 1), without an OOTF, so that 1 gives the signal 0.75.
    reference_white : float
        Luminance of a value of 1 with "pq", 1 to 10000 cd/m2. 203 is that of Report ITU-R BT.2408.
    dither : bool
        Whether to add noise before ``final`` is rounded to 8 bits, so that dark gradients show
        grain instead of bands. The noise of each channel is uniform over one level, +-1/2. The
        mean over pixels is then the unrounded value (Roberts, "Picture Coding Using Pseudo-Random
        Noise", IRE Transactions on Information Theory 8(2), 1962,
        https://doi.org/10.1109/TIT.1962.1057702). Values that 8 bits represent exactly, such as 0
        and 1, do not change. A float ``final`` is not dithered.
    dither_seed : int
        Seed of the noise, 0 to 65535. The noise is a hash of the pixel's position and the seed,
        so that it is the same on every adapter.
    bloom_size : (int, int) or None
        Width and height of the bloom buffers in pixels.
    bloom_scale : float
        The same as a fraction of the frame, 0.001 to 4, if `bloom_size` is None. Sides are rounded
        down, but at least 1. A forward scene with neither (a scale of 1) has 256 x 256.
    format : str or None
        Format of the bloom buffers, "rgba8unorm", "rgba16float", "rgba32float", "rg11b10ufloat" or
        "rgba8unorm-srgb". None: "rgba8unorm" for forward scenes and uint8 images,
        "rgba16float" for deferred scenes, the image's own for float images. "rg11b10ufloat" has 6
        bits of mantissa, 5 for blue, and no negative values. Stored values are rounded to the
        nearest one; negative values and NaN become 0; values above 65024 (64512 for blue) become
        this limit. Its arrays are float32. Published methods store only their levels in it:
        ``glow`` and ``bloom``, which are the frame before and after in an engine, are not rounded.
        "rgba8unorm-srgb" has 8-bit levels of sRGB: values are clamped to 0..1, encoded and rounded
        when they are stored, and decoded when they are read. Its arrays are float32 light.
        Published methods do not round their ``bloom`` to it.
    glare : sequence of Glare, or a name of `vkbloom.glares`
        Up to 5 stages, such as `Streaks`, that read what glows and add light to the bloom. Each has
        a framebuffer of its name, with a number if there are several of a kind. In ``final``,
        i b + sum of i_k g_k stands in place of i b, with framebuffer g_k and intensity i_k of each.

    Examples
    --------
    >>> settings = vkbloom.Pyramid(levels=5, threshold=1.0, composite="mix")
    >>> settings.replace(intensity=0.04).intensity
    0.04
    >>> settings.replace(knee=2)
    Traceback (most recent call last):
        ...
    ValueError: knee: 2 is out of range, 0 to 1
    """

    _class_key: ClassVar[str] = "method"
    _subject: ClassVar[str] = "fields"
    _example: ClassVar[str] = "a method, such as Separable"
    _core_numbers: ClassVar[CoreNumbers] = _core.VALUES
    method: ClassVar[str]
    #: What a user of the method turns beside the intensity: the fields that `translate` finds by
    #: default. They set width and strength of the blur, and its threshold.
    _knobs: ClassVar[tuple[str, ...]]
    #: Whether the method starts from the complete frame: it reduces it and thresholds it itself.
    published: ClassVar[bool] = False
    #: The field with the height of the first level, if that does not follow from the frame's.
    _level_height: ClassVar[str] = ""
    #: The fields of the composite that other passes read, too, but for shares of levels.
    _fields_before_composite: ClassVar[frozenset[str]] = frozenset()
    #: The fields that the threshold of a published method reads, in the order of the core's sums.
    _threshold_fields: ClassVar[tuple[str, ...]] = ()
    #: Whether `glow` is what has passed the threshold; other methods apply it in a later pass.
    _has_threshold_pass: ClassVar[bool] = True
    #: What the method's passes do, where that differs from `PASS_SENTENCES`.
    _pass_sentences: ClassVar[Mapping[str, str]] = MappingProxyType({})

    bloom: bool = flag_field(everyday=-3)
    threshold: float | None = number_field(default=None, slider=(0, 4), everyday=-1)
    knee: float = number_field(everyday=0)
    composite: Composite = choice_field(("add", "mix", "screen"))
    intensity: float = number_field(slider=(0, 4), everyday=-2)
    alpha: Alpha = choice_field()
    tonemap: ToneMap = choice_field(everyday=2)
    exposure: float = number_field(unit="stop", slider=(-8, 8), everyday=1)
    encoding: Encoding = choice_field()
    reference_white: float = number_field(unit="cd/m2", everyday=0)
    dither: bool = flag_field()
    dither_seed: int = number_field(slider=(0, 100), everyday=0)
    bloom_size: tuple[int, int] | None = value_field(None, unit="pixel")
    bloom_scale: float = number_field(slider=(0.05, 1), everyday=0, differentiable=False)
    format: BloomFormat | None = None
    glare: tuple[Glare, ...] = value_field((), kind="glare", read=_read_glare)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_together()

    def _check_together(self) -> None:
        """Check together fields that were checked one by one."""

    def _pass_sentence(self, stem: str) -> str:
        """Return what passes of a name do where that differs from `PASS_SENTENCES`; else ""."""
        return self._pass_sentences.get(stem, "")

    @property
    def glow_note(self) -> str:
        """What `glow` shows if it is not the light above the threshold; empty if it is."""
        is_frame = not self._has_threshold_pass and self.threshold is not None
        return "the frame before its threshold" if is_frame else ""

    def _facts(self, frame: tuple[int, int]) -> dict[str, float]:
        """Return what `Frames.info` says about the settings for a frame's size."""
        return {}

    @property
    def _is_transform(self) -> bool:
        """Whether light passes a transform, whose error is relative to the largest value."""
        return False

    @property
    def _bloom_error(self) -> float:
        """How far the passes may be from the formula, as a share of the bloom's largest value."""
        return 0.0

    @property
    def _first_stages(self) -> tuple[str, ...]:
        """The framebuffers in which the rounding of one 8-bit store arrives, or of `glow`, too."""
        return "glow", "down_0"

    def _hidden_stores(self, framebuffer: str) -> int:
        """Return how many of the images before a framebuffer are not framebuffers themselves."""
        return 0

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed, as `dataclasses.replace` does.

        Parameters
        ----------
        **changes
            New values by field. Those of a stage of `glare` have names such as
            "glare.0.intensity": ``replace(**{"glare.0.intensity": 2})``. Those of a point-spread
            function have names such as "psf.sigma".
        """
        return dataclasses.replace(self, **self._own_fields(changes))

    def _replaced(self, changes: Mapping[str, Any]) -> Self:
        """As `replace`, of real numbers, in 5 us in place of 10, for loops that learn these.

        Dynamo of PyTorch 2.11 cannot follow it.
        """
        changes, own = self._own_fields(changes), vars(self)
        made = object.__new__(type(self))
        vars(made).update({name: own[name] for name in fields_of(type(self))}, **changes)
        vars(made)["_first"] = self._origin
        check_fields(made, changes)
        made._check_together()
        return made

    def _own_fields(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return changes with those of stages and functions as values of `glare` and `psf`."""
        own = {name: value for name, value in changes.items() if "." not in name}
        if len(own) == len(changes):
            return own
        nested = {name: value for name, value in changes.items() if "." in name}
        of_psf = {name: nested.pop(name) for name in [*nested] if name.startswith(_PSF)}
        if of_psf:
            given: Any = own.get("psf", getattr(self, "psf", None))
            values = {_field_of_psf(given, name): value for name, value in of_psf.items()}
            own["psf"] = dataclasses.replace(given, **values)
        if nested:
            own["glare"] = replace_stages(_read_glare(own.get("glare", self.glare)), nested)
        return own

    def value_of(self, name: str) -> Any:
        """Return the value of a field, also of a stage's or a function's: "glare.0.intensity"."""
        return getattr(*_owner_of(self, name))

    def _repr_html_(self) -> str:
        """Return a table of the fields that differ from the method's defaults."""
        from vkbloom._views import markup  # noqa: PLC0415  of notebooks alone

        rows = [
            (name, repr(getattr(self, name)))
            for name, info in fields_of(type(self)).items()
            if getattr(self, name) != info.default
        ]
        title = f"{type(self).__name__}" + ("" if rows else ": all fields are the defaults")
        return str(markup.table(rows, caption=title, name={"style": "text-align:left"}))

    def _core_block(self) -> bytes:
        """Return the settings as the core reads them."""
        return self._block

    # A step of a training loop plans three times, each step with new settings.
    @functools.cached_property
    def _block(self) -> bytes:
        # What stages of glare read has passed this threshold, however the method counts its own.
        # (Unreal's may be below 0, which changes nothing.)
        is_set = self.threshold is not None and self.threshold >= 0
        stages = (self.threshold, self.knee) if is_set else None
        return settings_block(
            self.method, vars(self) | {"stage_threshold": stages} | self._core_values()
        )

    @property
    def _origin(self) -> Settings:
        """Settings from which these differ in real numbers alone.

        What does not depend on these numbers is kept for them.
        """
        first: Settings = vars(self).get("_first", self)
        return first

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields, without what was computed from them."""
        return {name: getattr(self, name) for name in fields_of(type(self))}

    def _core_values(self) -> dict[str, Any]:
        """Return what the core names or counts otherwise."""
        return {}

    def _threshold_slopes(self) -> dict[str, float]:
        """Return the slopes of what the core reads in place of `_threshold_fields`, by these.

        0: the bloom does not change.
        """
        return dict.fromkeys(self._threshold_fields, 1.0)

    @property
    def _has_state(self) -> bool:
        """Whether frames depend on those before; only custom methods can."""
        return False

    @property
    def _continues(self) -> bool:
        """Whether a call reads what an earlier one has left; only custom methods can."""
        return False

    def _after(self, seconds: float) -> Self:
        """Return the settings for a frame so many seconds after the one before: these."""
        return self

    def _in_sequence(self, index: int, state: dict[Any, Any]) -> Self:
        """Return the settings for a frame of a sequence, whose frames share the state."""
        return self

    @classmethod
    def _classes(cls) -> Mapping[str, type[Settings]]:
        return METHODS

    @classmethod
    def _check_stored(cls, values: dict[str, Any]) -> None:
        # Of the picture, not of the settings.
        for key in (EXPANDED, STAGES_IN_TIME):
            values.pop(key, None)


@dataclasses.dataclass(frozen=True, kw_only=True)
class PublishedSettings(Settings):
    """Base class of the settings of published methods, with what most of them have."""

    published: ClassVar[bool] = True
    _has_threshold_pass: ClassVar[bool] = False

    knee: float = number_field(fixed="the threshold of this method has no knee")
    composite: Composite = choice_field(("add",))
    format: BloomFormat | None = "rgba16float"


#: Name to settings. ``vkbloom presets`` and ``docs/presets.md`` list what they are, with their
#: sources.
presets: Final[Presets[Settings]] = NAMED_SETTINGS


def field_info(settings: Settings, name: str) -> FieldInfo:
    """Return the description of a field, also of a stage's or a function's: "psf.sigma"."""
    owner, field = _owner_of(settings, name)
    return fields_of(type(owner))[field]


def _owner_of(settings: Settings, name: str) -> tuple[Any, str]:
    """Return the settings, stage or point-spread function that has a field, and its name there."""
    if "." not in name:
        return settings, name
    if name.startswith(_PSF):
        psf = getattr(settings, "psf", None)
        return psf, _field_of_psf(psf, name)
    index, field = stage_field_of(settings.glare, name)
    return settings.glare[index], field


def _field_of_psf(psf: Any, name: str) -> str:
    """Return the field of a name such as "psf.sigma", or raise ValueError."""
    field = name.removeprefix(_PSF)
    known = fields_of(type(psf)) if isinstance(psf, Record) else {}
    if field not in known:
        near = did_you_mean(field, known) or f": {', '.join(known) or 'none'}"
        of = type(psf).__name__ if known else "the method, which has no function"
        raise ValueError(f"psf: {name!r} is not a field of {of}{near}")
    return field


def expansion_of_final(settings: Settings, expand: float | None) -> float:
    """Return what `final` is compressed from, for a picture that was expanded up to `expand`.

    It is 1, nothing, where a tone mapping or an encoding has put the values into 0..1.
    """
    is_light = (settings.tonemap, settings.encoding) == ("none", "none")
    return 1.0 if expand is None or not is_light else expand


def check_shading(shading: str) -> Shading:
    """Return the shading; raise ValueError if there is no shading of that name."""
    if not isinstance(shading, str) or shading not in SHADINGS:
        raise ValueError(f"shading: {shading!r} is not one of {', '.join(SHADINGS)}")
    return shading


def check_settings(
    settings: Settings | str | None, name: str = "settings", *, of_image: bool = False
) -> Settings:
    """Return the settings, or those of a preset; raise TypeError for what is neither.

    None: those that scenes start from, or images with `of_image`.
    """
    if isinstance(settings, Settings):
        return settings
    if settings is None:
        # Always the same object, since a renderer keeps the plan of the last one.
        return presets[presets.start("images" if of_image else "scenes")]
    if not isinstance(settings, str):
        raise TypeError(f"{name}: {settings!r} is not a Settings{_hint(settings)}")
    if settings in presets:
        return presets[settings]
    if settings in METHODS:
        given = METHODS[settings].__name__
        package = "" if METHODS.is_added(settings) else "vkbloom."
        raise ValueError(f"{name}: {settings!r} is a method; give {package}{given}()")
    raise ValueError(describe_unknown(f"{name}: unknown preset", settings, presets))


def resolve_settings(settings: Settings | str, name: str = "settings") -> Settings:
    """Return the settings, or those of a preset, of a function that has no default for them."""
    if settings is None:
        raise TypeError(f"{name}: None is not a Settings")
    return check_settings(settings, name)


def _hint(settings: object) -> str:
    """Return what to give instead of an object that is not a Settings; "" if that is unknown."""
    if isinstance(settings, type) and issubclass(settings, Settings):
        return f"; give {settings.__name__}(), an object of the class"
    if isinstance(settings, Mapping):
        return "; give vkbloom.Settings.from_dict(...) of it"
    return ""
