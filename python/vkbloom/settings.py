"""The settings of a bloom: frozen dataclasses whose parameters the C core declares.

Defaults and ranges are read from the core's tables, which come from ``shaders/params.h``: each is
declared once for the shaders, the core and Python.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Self, cast, get_args

from vkbloom import _core
from vkbloom.checks import as_float, check_floats, check_like, check_size
from vkbloom.glare import Glare, replaced_stages, stage_field_of
from vkbloom.glares import read_glare

Shading = Literal["forward", "deferred"]
Composite = Literal["add", "mix", "screen", "soft_light", "replace"]
ToneMap = Literal["none", "reinhard", "aces", "exponential", "khronos_neutral", "agx"]
Encoding = Literal["none", "gamma22", "srgb"]
Alpha = Literal["keep", "max", "blur"]
Texel = Literal["own", "x"]
BloomFormat = Literal["rgba8unorm", "rgba16float", "rgba32float", "rg11b10ufloat"]

SHADINGS: tuple[Shading, ...] = get_args(Shading)
BLOOM_FORMATS: tuple[BloomFormat, ...] = get_args(BloomFormat)

#: The half-kernel of the forward system: w0 at the centre, w1..w4 to both sides.
TUTORIAL: tuple[float, ...] = (0.227027, 0.1945946, 0.1216216, 0.054054, 0.016216)


def number_field(
    name: str,
    default: float | None = None,
    unit: str = "1",
    range: tuple[float, float] | None = None,
    option: str | None = None,
) -> Any:
    """Declare a field that is a number in the core's table, which gives its default and range.

    A method whose source has a narrower range declares it here. `option` is the field's name on the
    command line, if it differs.
    """
    initial, _, _ = _core.VALUES[name]
    return dataclasses.field(
        default=initial if default is None else default,
        metadata={"unit": unit, "range": range, "option": option or name},
    )


def field_range(field: dataclasses.Field[Any]) -> tuple[float, float]:
    """Return the least and the largest value of a field that is a number."""
    narrowed: tuple[float, float] | None = field.metadata.get("range")
    _, low, high = _core.VALUES[field.name]
    return narrowed or (low, high)


def flag_field(name: str) -> Any:
    """Declare a bool field, which is 0 or 1 in the core's table."""
    return dataclasses.field(default=bool(_core.VALUES[name][0]))


def choice_field(name: str) -> Any:
    """Declare a field whose value is one of the core's names; the first is the default."""
    return dataclasses.field(default=_core.CHOICES[name][0])


@dataclasses.dataclass(frozen=True, kw_only=True)
class Settings:
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
    encoding : {"none", "gamma22", "srgb"}
        Applied to rgb after the curve.
    dither : bool
        Whether to add noise before ``final`` is rounded to 8 bits, so that dark gradients show
        grain instead of bands. The noise of each channel is uniform over one level, +-1/2. The
        mean over pixels is then the unrounded value (Roberts, "Picture Coding Using Pseudo-Random
        Noise", IRE Transactions on Information Theory, 1962). Values that 8 bits represent
        exactly, such as 0 and 1, do not change. A float ``final`` is not dithered.
    dither_seed : int
        Seed of the noise, 0 to 65535. The noise is a hash of the pixel's position and the seed,
        so that it is the same on every adapter.
    bloom_size : (int, int) or None
        Width and height of the bloom buffers in pixels.
    bloom_scale : float
        The same as a fraction of the frame, 0.001 to 4, if `bloom_size` is None. Sides are rounded
        down, but at least 1. A forward scene with neither (a scale of 1) has 256 x 256.
    format : {"rgba8unorm", "rgba16float", "rgba32float", "rg11b10ufloat"} or None
        Format of the bloom buffers. None: "rgba8unorm" for forward scenes and uint8 images,
        "rgba16float" for deferred scenes, the image's own for float images. "rg11b10ufloat" has 6
        bits of mantissa, 5 for blue, and no negative values. Stored values are rounded to the
        nearest one; negative values and NaN become 0; values above 65024 (64512 for blue) become
        this limit. Its arrays are float32. Published methods store only their levels in it:
        ``glow`` and ``bloom``, which are the frame before and after in an engine, are not rounded.
    glare : sequence of Glare, or a name of `vkbloom.glares`
        Up to 5 stages, such as `Streaks`, that read what glows and add light to the bloom. Each has
        a framebuffer of its name, with a number if there are several of a kind. In ``final``,
        i b + sum of i_k g_k stands in place of i b, with framebuffer g_k and intensity i_k of each.

    Raises
    ------
    ValueError
        A field is out of its range; the message names the field, the value and the range.
    TypeError
        A field has the wrong type.

    See Also
    --------
    Separable, Pyramid, DualKawase : The methods.
    presets : Published settings by name.
    Renderer.apply, Renderer.render : Use settings.

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

    method: ClassVar[str]
    #: The composites that the method has.
    composites: ClassVar[tuple[Composite, ...]] = ("add", "mix", "screen")

    bloom: bool = flag_field("bloom")
    threshold: float | None = None
    knee: float = number_field("knee")
    composite: Composite = choice_field("composite")
    intensity: float = number_field("intensity")
    alpha: Alpha = choice_field("alpha")
    tonemap: ToneMap = choice_field("tonemap")
    exposure: float = number_field("exposure", unit="stop")
    encoding: Encoding = choice_field("encoding")
    dither: bool = flag_field("dither")
    dither_seed: int = number_field("dither_seed")
    bloom_size: tuple[int, int] | None = dataclasses.field(default=None, metadata={"unit": "pixel"})
    bloom_scale: float = number_field("bloom_scale")
    format: BloomFormat | None = None
    glare: tuple[Glare, ...] = ()

    def __post_init__(self) -> None:
        if type(self) is Settings:
            raise TypeError("Settings is abstract; use a method, such as Separable")
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            optional = str(field.type).endswith("None")
            if field.name in _core.VALUES and not (value is None and optional):
                self._check_value(field, value)
            elif field.name in _core.CHOICES:
                self._check_name(field.name, _core.CHOICES[field.name])
        self._check_name("composite", self.composites, f", which the method {self.method} has")
        if self.format is not None:
            self._check_name("format", BLOOM_FORMATS)
        if self.bloom_size is not None:
            object.__setattr__(self, "bloom_size", check_size("bloom_size", self.bloom_size))
        object.__setattr__(self, "glare", read_glare(self.glare))

    def _check_value(self, field: dataclasses.Field[Any], value: Any) -> None:
        """Check a number and store it as a Python number; NumPy scalars print differently."""
        number = check_like(field.default, field.name, value, *field_range(field))
        object.__setattr__(self, field.name, number)

    def _check_name(self, field: str, names: tuple[str, ...], of: str = "") -> None:
        """Check a name and store it as a plain str, also from a subclass of str."""
        value = getattr(self, field)
        # An array compares with a name element by element.
        if not isinstance(value, str) or value not in names:
            raise ValueError(f"{field}: {value!r} is not one of {', '.join(names)}{of}")
        # Not with str(), which returns an enum's own name.
        object.__setattr__(self, field, names[names.index(value)])

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed, as `dataclasses.replace` does.

        Parameters
        ----------
        **changes
            New values by field. Those of a stage of `glare` have names such as
            "glare.0.intensity": ``replace(**{"glare.0.intensity": 2})``.

        Returns
        -------
        Settings
            Settings of the same method.

        Raises
        ------
        ValueError
            A value is out of its field's range.
        TypeError
            The method has no such field, or a value has the wrong type.

        See Also
        --------
        to_dict : The fields by name.

        Examples
        --------
        >>> vkbloom.Separable(loops=2).replace(blur_scale=4).blur_scale
        4.0
        """
        nested = {name: changes.pop(name) for name in [*changes] if "." in name}
        if nested:
            changes["glare"] = replaced_stages(read_glare(changes.get("glare", self.glare)), nested)
        return dataclasses.replace(self, **changes)

    def value_of(self, name: str) -> Any:
        """Return the value of a field, or of a stage's field, such as "glare.0.intensity".

        See Also
        --------
        replace : Takes the same names.

        Examples
        --------
        >>> vkbloom.Pyramid(glare=vkbloom.Streaks(fade=0.9)).value_of("glare.0.fade")
        0.9
        """
        if "." not in name:
            return getattr(self, name)
        place, field = stage_field_of(self.glare, name)
        return getattr(self.glare[place], field)

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by name, and ``method``.

        Returns
        -------
        dict
            Values that JSON can represent, with lists instead of tuples.

        See Also
        --------
        from_dict : Makes settings from the result.

        Examples
        --------
        >>> vkbloom.Pyramid(levels=3).to_dict()["levels"]
        3
        """
        values = dataclasses.asdict(self)
        values["glare"] = [stage.to_dict() for stage in self.glare]
        return {"method": self.method, **values}

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Make settings from the result of `to_dict`.

        Parameters
        ----------
        fields : mapping of str to object
            Values by field. Missing fields have their defaults. ``method`` names the class; it may
            be missing in calls on a method's class, such as ``Separable.from_dict``.

        Returns
        -------
        Settings
            Settings of this method.

        Raises
        ------
        ValueError
            There is no such method or field, the method is not that of the class, or a value is out
            of range.
        TypeError
            `fields` is not a mapping, or a value has the wrong type.

        See Also
        --------
        to_dict : The fields by name.

        Examples
        --------
        >>> Settings.from_dict({"method": "pyramid", "levels": 3})  # doctest: +SKIP
        Pyramid(bloom=True, ..., levels=3, ...)
        """
        if not isinstance(fields, Mapping):
            raise TypeError(f"fields: a mapping is needed, not {type(fields).__name__}")
        own = getattr(cls, "method", None)
        method = fields.get("method", own)
        kinds = methods()
        if not isinstance(method, str) or method not in kinds:
            raise ValueError(f"method: {method!r} is not one of {', '.join(kinds)}")
        if own not in (None, method):
            raise ValueError(f"method: {method!r} is not the {own!r} of {cls.__name__}")
        values = {name: value for name, value in fields.items() if name != "method"}
        known = [field.name for field in dataclasses.fields(kinds[method])]
        unknown = [name for name in values if name not in known]
        if unknown:
            raise ValueError(
                f"fields: {method} has no {', '.join(map(repr, unknown))}; it has "
                f"{', '.join(known)}"
            )
        made: Any = kinds[method](**values)
        return cast("Self", made)

    def to_json(self) -> str:
        """Return `to_dict` as JSON text.

        See Also
        --------
        from_json : Makes settings from the result.

        Examples
        --------
        >>> text = vkbloom.Pyramid(levels=3).to_json()
        >>> vkbloom.Pyramid.from_json(text).levels
        3
        """
        import json  # noqa: PLC0415  costs start-up time

        return json.dumps(self.to_dict())

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Make settings from the result of `to_json`.

        Parameters
        ----------
        text : str
            An object with the keys of `from_dict`.

        Returns
        -------
        Settings

        Raises
        ------
        ValueError, TypeError
            The text is not a JSON object, or as for `from_dict`.

        See Also
        --------
        to_json : Returns the text.

        Examples
        --------
        >>> from vkbloom import Settings
        >>> Settings.from_json('{"method": "pyramid", "levels": 3}').levels
        3
        """
        import json  # noqa: PLC0415  costs start-up time

        try:
            fields = json.loads(text)
        except RecursionError:
            raise ValueError("text: lists and objects stand too deep in each other") from None
        return cls.from_dict(fields)

    def _repr_html_(self) -> str:
        """Return the table of `display.fields_html`."""
        # Imported here because only notebooks need it.
        from vkbloom.views import display  # noqa: PLC0415

        return display.fields_html(self)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Separable(Settings):
    """A blur by a symmetric kernel, first vertical, then horizontal.

    One pass computes w0 c(0) + strength * sum of w_i (c(+i) + c(-i)) over i = 1..n. Its taps are
    ``blur_scale`` texels of the bloom buffer apart, filtered bilinearly and clamped to the edge.
    All passes but the last run at the size of the bloom buffers; the last is evaluated at every
    pixel of ``final``.

    Parameters
    ----------
    blur_scale : float
        Distance of the taps in texels, 0 to 16.
    blur_strength : float
        Factor of all taps except the centre, 0 to 16.
    weights : sequence of float
        Half-kernel w0..wn, 1 to 65 of them.
    loops : int
        How often the vertical and horizontal passes are repeated, 1 to 16 times.
    layers : sequence of (float, float)
        (scale, strength), 1 to 8 of them, each number 0 to 16. Each layer is a complete blur at
        blur_scale * scale; the blurs are added with their strengths.
    first_tap : {1, 0}
        First index of the sum, 0 or 1. 0: the sum includes the centre, whose weight becomes
        w0 (1 + 2 strength).
    texel : {"own", "x"}
        Step of the vertical pass. "own": 1 / height of the texture; "x": 1 / width, as in the
        horizontal pass.
    direct : bool
        Whether to apply the kernel as one pass of N x N taps instead of two of N.
    **settings
        The fields of `Settings`.

    See Also
    --------
    gaussian_weights : Makes `weights`.
    Pyramid, DualKawase : Methods for wide blurs.

    Notes
    -----
    Source: the forward system and the outline system, which differ in `first_tap` and `texel`.

    Examples
    --------
    >>> settings = vkbloom.Separable(weights=vkbloom.gaussian_weights(1.0), blur_strength=1.0)
    >>> image = np.zeros((9, 9, 4), np.float32)
    >>> image[4, 4] = 1
    >>> with vkbloom.Renderer("software") as renderer:
    ...     bloom = renderer.apply(image, settings)["bloom"]
    >>> bloom[4, 1:8, 0].round(3)
    array([0.002, 0.022, 0.097, 0.159, 0.097, 0.022, 0.002], dtype=float32)
    """

    method: ClassVar[str] = "separable"

    blur_scale: float = number_field("blur_scale", unit="texel")
    blur_strength: float = number_field("blur_strength")
    weights: tuple[float, ...] = TUTORIAL
    loops: int = number_field("loops")
    layers: tuple[tuple[float, float], ...] = ((1.0, 1.0),)
    first_tap: int = number_field("first_tap")
    texel: Texel = choice_field("texel")
    direct: bool = flag_field("direct")

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "weights", check_floats("weights", self.weights))
        if not 1 <= len(self.weights) <= _core.MAX_WEIGHTS:
            raise ValueError(
                f"weights: {len(self.weights)} weights are out of range, 1 to {_core.MAX_WEIGHTS}"
            )
        try:
            pairs = tuple(tuple(layer) for layer in self.layers)
        except TypeError:
            raise TypeError(
                f"layers: {self.layers!r} is not a sequence of pairs (scale, strength)"
            ) from None
        layers = tuple(check_floats("layers", layer) for layer in pairs)
        if not 1 <= len(layers) <= _core.MAX_LAYERS:
            raise ValueError(
                f"layers: {len(layers)} layers are out of range, 1 to {_core.MAX_LAYERS}"
            )
        if any(len(layer) != 2 for layer in layers):
            raise ValueError(
                f"layers: {self.layers!r} is not a sequence of pairs (scale, strength)"
            )
        if any(not 0 <= number <= 16 for layer in layers for number in layer):
            raise ValueError(f"layers: {self.layers!r} has a number out of range, 0 to 16")
        object.__setattr__(self, "layers", layers)


def check_level_weights(weights: Sequence[float], count: int) -> tuple[float, ...]:
    """Return the weights as floats; TypeError or ValueError unless they are `count` numbers."""
    numbers = check_floats("level_weights", weights)
    if len(numbers) != count:
        raise ValueError(
            f"level_weights: {len(numbers)} weights are out of range, {count}, one for each level"
        )
    return numbers


@dataclasses.dataclass(frozen=True, kw_only=True)
class Pyramid(Settings):
    """A mip chain: 13 taps down, a 3 x 3 tent up, the levels added on the way.

    Parameters
    ----------
    levels : int
        Number of levels, 1 to 16. ``down_0`` has half of the bloom size, each next level half of
        the previous one, floored and at least 1. The chain ends before a level of 1 x 1, unless
        that is the first.
    radius : float
        Distance of the tent's taps in texels of the smaller level, 0 to 16.
    firefly_filter : bool
        In the first downsample the five 2 x 2 groups are weighted by 1 / (1 + luminance of the
        group's mean) and renormalized.
    level_weights : sequence of float or None
        As many finite numbers w_0, w_1, ... as `levels`; they may be negative. If the chain ends
        early, only the first ones are used. None: the mean of the levels.
    scale_x, scale_y : float
        Factors of the distances of all taps, 0 to 16. scale_x=4 stretches the bloom along x, as an
        anamorphic lens does.
    **settings
        The fields of `Settings`.

    See Also
    --------
    DualKawase : A chain without additions.
    BevyBloom, KinoBloom, FilamentBloom, UrpBloom, HdrpBloom : Pyramids of engines.

    Notes
    -----
    Weights of the downsample: centre 0.125; four diagonals 1 texel away 0.125 each; four axials
    2 texels away 0.0625 each; four diagonals 2 texels away 0.03125 each. Upsample: (1 2 1)^2 / 16,
    up_k = down_k + tent(up_k+1). ``bloom`` is tent(up_0) at every pixel of ``final``, divided by
    the number of levels, so that a flat image keeps its value. In "rgba8unorm", whose largest value
    is 1, the images up_k hold the mean of their levels instead of the sum; the bloom is the same.

    With weights up_k = w_k down_k + tent(up_k+1), where the smallest level is w_N-1 down_N-1, and
    ``bloom`` = tent(up_0) is not divided: a flat image becomes the sum of the weights. In
    "rgba8unorm" up_k is divided by the sum of the weights' sizes, ``|w_k|`` + ... + ``|w_N-1|``.

    Source: Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare",
    SIGGRAPH 2014.

    Examples
    --------
    >>> image = np.zeros((32, 32, 3), np.float16)
    >>> image[16, 16] = 100
    >>> with vkbloom.Renderer("software") as renderer:
    ...     frames = renderer.apply(image, vkbloom.Pyramid(levels=3, composite="mix"))
    >>> list(frames)
    ['glow', 'down_0', 'down_1', 'down_2', 'up_1', 'up_0', 'bloom', 'final']
    >>> frames["down_2"].shape
    (4, 4, 4)
    """

    method: ClassVar[str] = "pyramid"

    levels: int = number_field("levels")
    radius: float = number_field("radius", unit="texel")
    firefly_filter: bool = flag_field("firefly_filter")
    level_weights: tuple[float, ...] | None = None
    scale_x: float = number_field("scale_x")
    scale_y: float = number_field("scale_y")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.level_weights is not None:
            weights = check_level_weights(self.level_weights, self.levels)
            object.__setattr__(self, "level_weights", weights)


@dataclasses.dataclass(frozen=True, kw_only=True)
class DualKawase(Settings):
    """A chain of halved images: downsampled with 5 taps, upsampled with 8, nothing added.

    Parameters
    ----------
    levels : int
        Number of levels, 1 to 16; their sizes are those of `Pyramid`.
    offset : float
        Factor of the distances of all taps, 0 to 16.
    **settings
        The fields of `Settings`.

    See Also
    --------
    Pyramid : A chain whose levels are added.

    Notes
    -----
    Downsample: (4 c + the four diagonals at half a texel of the source) / 8. Upsample: (the four
    axials at one texel of the smaller level + 2 times the four diagonals at half a texel of it)
    / 12.

    Source: Bjorge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015.

    Examples
    --------
    >>> image = np.full((16, 16, 3), 0.25, np.float32)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     frames = renderer.apply(image, vkbloom.DualKawase(levels=2))
    >>> bool(np.allclose(frames["bloom"][..., :3], 0.25, atol=1e-5))
    True
    """

    method: ClassVar[str] = "dual_kawase"

    levels: int = number_field("levels", default=4)
    offset: float = number_field("offset")


def gaussian_weights(sigma: float, radius: int | None = None) -> tuple[float, ...]:
    """Make a normalized Gaussian half-kernel.

    Parameters
    ----------
    sigma : float
        Standard deviation in taps, above 0.
    radius : int, optional
        Number of taps on each side, 0 to 64. Default: ceil(3 sigma), at most 64.

    Returns
    -------
    tuple of float
        w0..w_radius with w_i proportional to exp(-i^2 / (2 sigma^2)) and
        w0 + 2 (w1 + ... + w_radius) = 1.

    Raises
    ------
    ValueError
        `sigma` or `radius` is out of range.
    TypeError
        `sigma` is not a number, or `radius` not an integer.

    See Also
    --------
    Separable : Takes the weights.

    Examples
    --------
    >>> weights = vkbloom.gaussian_weights(1.0, radius=2)
    >>> [round(weight, 4) for weight in weights]
    [0.4026, 0.2442, 0.0545]
    """
    limit = _core.MAX_WEIGHTS - 1
    deviation = as_float("sigma", sigma)
    if not 0 < deviation < math.inf:
        raise ValueError(f"sigma: {sigma!r} is out of range, above 0")
    if radius is None:
        radius = math.ceil(min(3 * deviation, limit))
    try:
        radius = operator.index(radius)
    except TypeError:
        raise TypeError(f"radius: {radius!r} is not an integer") from None
    if not 0 <= radius <= limit:
        raise ValueError(f"radius: {radius!r} is out of range, 0 to {limit}")
    # A product becomes infinity where the operator ** would raise OverflowError.
    distances = [tap / deviation for tap in range(radius + 1)]
    weights = [math.exp(-0.5 * distance * distance) for distance in distances]
    total = weights[0] + 2 * sum(weights[1:])
    return tuple(weight / total for weight in weights)


def methods() -> dict[str, type[Settings]]:
    """Return the settings class of each method, by the method's name."""
    return {kind.method: kind for kind in Settings.__subclasses__()}


def check_shading(shading: str) -> Shading:
    """Return the shading; raise ValueError if there is no shading of that name."""
    if shading not in SHADINGS:
        raise ValueError(f"shading: {shading!r} is not one of {', '.join(SHADINGS)}")
    return shading


def check_settings(settings: Settings | None) -> Settings:
    """Return the settings, `Separable()` for None; raise TypeError for anything else."""
    if settings is None:
        return Separable()
    if not isinstance(settings, Settings):
        raise TypeError(f"settings: {settings!r} is not a Settings")
    return settings
