"""Glare beside the bloom: stages that read what glows and add light to the bloom.

Settings have a tuple of them, `Settings.glare`. The core declares their numbers
(``shaders/params.h``).
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, Final, Literal, Self, cast, get_args

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom.checks import check_floats, check_like, check_number

__all__ = ["Dirt", "Ghosts", "Glare", "GlareLight", "Halo", "Streaks", "check_glare", "stages"]

DirtMode = Literal["multiply", "lerp"]

#: Numbers of images that the core fills once: no two of a process have the same.
SERIALS: Final = itertools.count(1)


def stage_field(name: str, default: float | None = None, unit: str = "1") -> Any:
    """Declare a field that is a number in the core's table, which gives its default and range."""
    initial, _, _ = _core.GLARE_VALUES[name]
    return dataclasses.field(
        default=initial if default is None else default, metadata={"unit": unit}
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Glare:
    """Base class of the stages of glare; use a stage's class, such as `Streaks`.

    Stages are frozen and hashable. Their light is added to the bloom: with s the scene, b the
    bloom, i its intensity and g_k, i_k the framebuffer and the intensity of each stage, ``final``
    is made of s and i b + sum of i_k g_k in place of i b. `Dirt` multiplies this sum.

    Raises
    ------
    ValueError
        A field is out of its range.
    TypeError
        A field has the wrong type.

    See Also
    --------
    Ghosts, Halo, Streaks, Dirt : The stages.
    Settings : Takes stages as `glare`.

    Examples
    --------
    >>> settings = vkbloom.Pyramid(glare=(vkbloom.Streaks(), vkbloom.Streaks(directions=1)))
    >>> image = np.zeros((32, 32, 3), np.float16)
    >>> image[16, 16] = 100
    >>> with vkbloom.Renderer("software") as renderer:
    ...     frames = renderer.apply(image, settings)
    >>> list(frames)[:3]
    ['glow', 'streaks_0', 'streaks_1']
    """

    stage: ClassVar[str]

    def __post_init__(self) -> None:
        if not hasattr(self, "stage"):
            raise TypeError(f"{type(self).__name__} is abstract; use a stage, such as Streaks")
        for field in dataclasses.fields(self):
            if field.name in _core.GLARE_VALUES:
                _, low, high = _core.GLARE_VALUES[field.name]
                value = check_like(field.default, field.name, getattr(self, field.name), low, high)
                object.__setattr__(self, field.name, value)

    def to_dict(self) -> dict[str, Any]:
        """Return the fields by name, and ``stage``.

        Returns
        -------
        dict
            Values that JSON can represent.

        See Also
        --------
        from_dict : Makes a stage from the result.

        Examples
        --------
        >>> vkbloom.Streaks(directions=4).to_dict()["stage"]
        'streaks'
        """
        return {"stage": self.stage, **dataclasses.asdict(self)}

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any]) -> Self:
        """Make a stage from the result of `to_dict`.

        Parameters
        ----------
        fields : mapping of str to object
            Values by field. Missing fields have their defaults. ``stage`` names the class.

        Returns
        -------
        Glare

        Raises
        ------
        ValueError
            There is no such stage or field, or a value is out of range.
        TypeError
            A value has the wrong type.

        See Also
        --------
        to_dict : The fields by name.

        Examples
        --------
        >>> vkbloom.Streaks.from_dict({"stage": "streaks", "directions": 4}).directions
        4
        """
        values = dict(fields)
        name = values.pop("stage", getattr(cls, "stage", None))
        kinds = stages()
        if not isinstance(name, str) or name not in kinds:
            raise ValueError(f"stage: {name!r} is not one of {', '.join(kinds)}")
        known = [field.name for field in dataclasses.fields(kinds[name])]
        unknown = [field for field in values if field not in known]
        if unknown:
            raise ValueError(
                f"glare: {name} has no {', '.join(map(repr, unknown))}; it has {', '.join(known)}"
            )
        made: Any = kinds[name](**values)
        return cast("Self", made)


@dataclasses.dataclass(frozen=True, kw_only=True)
class GlareLight(Glare):
    """Base class of the stages that have light; use a stage's class, such as `Streaks`.

    Parameters
    ----------
    intensity : float
        Factor of the stage's light, 0 to 65504.
    threshold : float
        What is subtracted from each channel of what the stage reads, 0 to 65504; negative
        differences become 0. If alpha is blurred, it is multiplied by the factor of the brightest
        channel.
    halvings : int
        How often the size of the bloom buffers is halved for the stage, 0 to 4, by the 13 taps of
        `Pyramid`. Each halving makes the stage four times as fast, and its light coarser.

    See Also
    --------
    Ghosts, Halo, Streaks : The stages.

    Notes
    -----
    A stage reads what glows: ``glow``, with threshold, mask and emission. Published methods apply
    threshold and mask later than that, so that for the stages they are applied by themselves, by
    the formulas of `Settings`. Outside of the picture there is no light. The framebuffers of stages
    are "rgba32float" if the bloom buffers are, and otherwise "rgba16float".

    Examples
    --------
    >>> vkbloom.Streaks(intensity=2, threshold=1).halvings
    1
    """

    intensity: float = stage_field("intensity")
    threshold: float = stage_field("threshold")
    halvings: int = stage_field("halvings")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Streaks(GlareLight):
    """Rays from what glows, as of a star filter, or with one direction an anamorphic streak.

    Parameters
    ----------
    directions : int
        Number of rays, 1 to 16, evenly over the full turn. 1: one line, with a ray to each side.
    angle : float
        Direction of the first ray in degrees, -360 to 360, counter-clockwise from the right.
    length : float
        Distance of neighbouring taps in texels, 0 to 16. A ray is length * base**iterations texels
        long.
    fade : float
        What is left of the light from one tap to the next, 0 to 1.
    base : int
        Number of taps of each iteration, 2 to 8.
    iterations : int
        1 to 6.
    colour_shift : float
        How much less two channels of a tap are, 0 to 1, so that rays are coloured.
    **glare
        The fields of `GlareLight`.

    See Also
    --------
    GlareLight : The fields of all stages with light.

    Notes
    -----
    With b the base and d a step of `length` texels along the ray, iteration i is

        c_i+1(x) = sum over k < b of f_i^k m_k c_i(x - k b^i d) / sum over k < b of f_i^k

    with f_i = fade^(b^i), so that all iterations together are the exponential fade^n over b^N taps.
    ``streaks`` is the mean of the rays; without a colour shift, a flat image keeps its value far
    from the border. m_k is 1 for the first tap; with a colour shift s, of the others two channels
    are multiplied by 1 - s^(i + 1): all but red, blue and green, in turn.

    Source: Kawase, "Frame Buffer Postprocessing Effects in DOUBLE-S.T.E.A.L", GDC 2003; the colours
    as in the node Glare of Blender (blender/blender,
    source/blender/nodes/composite/nodes/node_composite_glare.cc).

    Examples
    --------
    >>> image = np.zeros((1, 9, 3), np.float32)
    >>> image[0, 4] = 15
    >>> streaks = vkbloom.Streaks(directions=1, fade=0.5, base=2, iterations=2, halvings=0)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     frames = renderer.apply(image, vkbloom.Pyramid(glare=streaks))
    >>> frames["streaks"][0, :, 0]
    array([0. , 0.5, 1. , 2. , 8. , 2. , 1. , 0.5, 0. ], dtype=float32)
    """

    stage: ClassVar[str] = "streaks"

    directions: int = stage_field("directions")
    angle: float = stage_field("angle", unit="degree")
    length: float = stage_field("length", unit="texel")
    fade: float = stage_field("fade")
    base: int = stage_field("base")
    iterations: int = stage_field("iterations")
    colour_shift: float = stage_field("colour_shift")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ghosts(GlareLight):
    """Pictures of what glows, mirrored and scaled about the centre, as reflections in a lens make.

    Parameters
    ----------
    scales : sequence of float
        Up to 16 scales s_k, -16 to 16. Negative ones mirror; sizes above 1 make ghosts smaller.
    tints : sequence of (float, float, float)
        Red, green and blue factor of each ghost, or one for all.
    maximum : float
        Largest value of a channel that a ghost reads, after the threshold, 0 to 65504.
    falloff : float
        Exponent of the fall towards the border of what a ghost shows, 0 to 64; 0: none.
    radius : float
        Where this fall ends, as a share of the picture's sides, 0.001 to 4.
    vignette : float
        How much the ghosts are kept out of the middle, 0 to 1.
    aberration : float
        How far red and blue are moved along the radius, 0 to 0.5 of the picture's sides.
    **glare
        The fields of `GlareLight`.

    See Also
    --------
    Halo : A ring around the centre.

    Notes
    -----
    With p the place of a pixel, 0 to 1 along both sides, and c what glows,

        q_k = 1/2 + s_k (p - 1/2)
        ghosts(p) = v(p) sum over k of tint_k w(q_k) min(max(c(q_k) - threshold, 0), maximum)

    with w(q) = max(0, 1 - abs(q - 1/2) / radius)^falloff, and for (x, y) = 2 p - 1
    v(p) = 1 + vignette (min((x^2 + y^2)^2, 1) - 1). Red is read at q + a, blue at q - a, with a of
    the length `aberration` towards the centre.

    Source: Chapman, "Pseudo Lens Flare", 2013; the weights as in three.js (LensflareNode.js),
    Blender and Unity (LensFlareScreenSpaceCommon.hlsl), the aberration as in Filament (flare.mat).

    Examples
    --------
    >>> image = np.zeros((9, 9, 3), np.float32)
    >>> image[4, 7] = 1
    >>> ghosts = vkbloom.Ghosts(scales=(-1,), tints=((1, 0.5, 0),), falloff=0, halvings=0)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     frames = renderer.apply(image, vkbloom.Pyramid(glare=(ghosts,)))
    >>> frames["ghosts"][4, 1]
    array([1. , 0.5, 0. , 1. ], dtype=float32)
    """

    stage: ClassVar[str] = "ghosts"

    scales: tuple[float, ...] = (-0.5, -1.0, -2.0, 3.0, 1.5)
    tints: tuple[tuple[float, float, float], ...] = ((1.0, 1.0, 1.0),)
    maximum: float = stage_field("maximum")
    falloff: float = stage_field("falloff", default=2.0)
    radius: float = stage_field("radius", default=0.75)
    vignette: float = stage_field("vignette")
    aberration: float = stage_field("aberration")
    halvings: int = stage_field("halvings", default=2)

    def __post_init__(self) -> None:
        super().__post_init__()
        scales = check_floats("scales", self.scales)
        if not 1 <= len(scales) <= _core.MOST_GHOSTS:
            raise ValueError(f"scales: {len(scales)} are out of range, 1 to {_core.MOST_GHOSTS}")
        for scale in scales:
            check_number("scales", scale, -16, 16)
        try:
            tints = tuple(check_floats("tints", tuple(tint)) for tint in self.tints)
        except TypeError:
            raise TypeError(f"tints: {self.tints!r} is not a sequence of (r, g, b)") from None
        if len(tints) not in (1, len(scales)) or any(len(tint) != 3 for tint in tints):
            raise ValueError(
                f"tints: {self.tints!r} is not one (r, g, b), or one for each of the "
                f"{len(scales)} scales"
            )
        for tint in tints:
            for factor in tint:
                check_number("tints", factor, 0, 65504)
        object.__setattr__(self, "scales", scales)
        object.__setattr__(self, "tints", tints)

    @property
    def ghosts(self) -> tuple[tuple[float, tuple[float, float, float]], ...]:
        """The scale and the tint of each."""
        tints = self.tints if len(self.tints) > 1 else self.tints * len(self.scales)
        return tuple(zip(self.scales, tints, strict=True))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Halo(GlareLight):
    """A ring around the centre of the picture, from what glows near the centre.

    Parameters
    ----------
    radius : float
        Of the ring, in heights of the picture, 0.001 to 4.
    width : float
        From the middle of the ring to where it ends, in heights of the picture, 0.001 to 4.
    maximum : float
        Largest value of a channel that the halo reads, after the threshold, 0 to 65504.
    aberration : float
        How far red and blue are moved along the radius, 0 to 0.5 of the picture's sides.
    **glare
        The fields of `GlareLight`.

    See Also
    --------
    Ghosts : Mirrored and scaled pictures.

    Notes
    -----
    With p the place of a pixel and d its distance from the centre, in heights of the picture, and u
    the direction from p to the centre, halo(p) is

        (1 - smoothstep(0, 1, abs(d - radius) / width)) c'(p + radius u)

    with c' = min(max(c - threshold, 0), maximum). Red and blue are moved as in `Ghosts`.

    Source: google/filament, flare.mat @ 523a261b1052.

    Examples
    --------
    >>> image = np.zeros((33, 33, 3), np.float32)
    >>> image[16, 16] = 1
    >>> halo = vkbloom.Halo(radius=0.25, width=0.1, halvings=0)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     light = renderer.apply(image, vkbloom.Pyramid(glare=(halo,)))["halo"][16, :, 0]
    >>> np.flatnonzero(light > 0.4)
    array([ 8, 24])
    """

    stage: ClassVar[str] = "halo"

    radius: float = stage_field("radius", default=0.4)
    width: float = stage_field("width")
    maximum: float = stage_field("maximum")
    aberration: float = stage_field("aberration")
    halvings: int = stage_field("halvings", default=2)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Dirt(Glare):
    """A picture of dirt on the lens, by which bloom and glare are multiplied.

    Parameters
    ----------
    image : array-like, shape (H, W) or (H, W, 3), or None
        Linear and finite; it is copied, as float32, and enlarged bilinearly to the frame. None: a
        picture of 480 x 270 that is made from the seed.
    seed : int
        0 to 65535.
    strength : float
        The s of the formulas, 0 to 16; with "lerp" 0 to 1.
    mode : {"multiply", "lerp"}
        With the light L and the dirt D, L D s or L (1 + s (D - 1)).

    Raises
    ------
    ValueError
        A field is out of its range.
    TypeError
        A field has the wrong type.

    See Also
    --------
    Settings : Takes it among `glare`, once at the most.

    Notes
    -----
    Source: "multiply" as in google/filament, colorGrading.mat @ 263d042924de; "lerp" as in
    godotengine/godot, tonemap.glsl @ 001c8c9c24dc (the glow map).

    Examples
    --------
    >>> image = np.ones((4, 4, 3), np.float32)
    >>> dirt = vkbloom.Dirt(image=[[0.5, 1]], mode="lerp", strength=0.5)
    >>> with vkbloom.Renderer("software") as renderer:
    ...     final = renderer.apply(image, vkbloom.Pyramid(glare=(dirt,)))["final"]
    >>> final[0, :, 0]
    array([1.75  , 1.8125, 1.9375, 2.    ], dtype=float32)
    """

    stage: ClassVar[str] = "dirt"

    image: Any = None
    seed: int = stage_field("seed")
    strength: float = stage_field("strength")
    mode: DirtMode = "multiply"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mode not in get_args(DirtMode):
            raise ValueError(f"mode: {self.mode!r} is not one of {', '.join(get_args(DirtMode))}")
        if self.mode == "lerp":
            check_number("strength", self.strength, 0, 1)
        if self.image is not None:
            # Imported here, since settings are used without point-spread functions, too.
            from vkbloom.psf.sampled import check_values  # noqa: PLC0415

            object.__setattr__(self, "image", check_values("image", self.image))

    def to_dict(self) -> dict[str, Any]:  # noqa: D102  as of Glare
        image = None if self.image is None else self.image.to_plain()
        return {**super().to_dict(), "image": image}

    @property
    def lerp(self) -> int:
        """Whether the mode is "lerp", for the core."""
        return int(self.mode == "lerp")

    @property
    def pixels(self) -> NDArray[np.float32]:
        """The picture, shape (H, W) or (H, W, 3)."""
        return _made_dirt(self.seed) if self.image is None else self.image.array

    def core_kernel(self, frame: object, buffers: object) -> tuple[Any, ...]:
        """Return the picture as the core reads a kernel."""
        return (*_core_dirt(self.replace_look()), False, (1.0, 0.0, 1.0))

    def replace_look(self) -> Dirt:
        """Return the dirt with the defaults of all that its picture does not depend on."""
        return Dirt(image=self.image, seed=self.seed)


@functools.lru_cache(maxsize=4)
def _core_dirt(dirt: Dirt) -> tuple[NDArray[np.float32], int]:
    """Return (H, W, 4), the mean of the channels as alpha, and a number of its own."""
    values = dirt.pixels
    pixels = np.empty((*values.shape[:2], 4), np.float32)
    pixels[..., :3] = values if values.ndim == 3 else values[..., np.newaxis]
    pixels[..., 3] = pixels[..., :3].mean(axis=2)
    return pixels, next(SERIALS)


@functools.lru_cache(maxsize=4)
def _made_dirt(seed: int) -> NDArray[np.float32]:
    """Return soft discs and specks of 0 to 1, (270, 480)."""
    random = np.random.default_rng(seed)
    y, x = np.indices((270, 480), np.float32)
    picture = np.full(x.shape, 0.1, np.float32)
    for radius, light in ((20.0, 0.25), (8.0, 0.4), (2.5, 0.6)):
        for _ in range(40):
            size = radius * random.uniform(0.5, 1.5)
            distance = np.hypot(x - random.uniform(0, 480), y - random.uniform(0, 270)) / size
            picture += light * random.random() * np.clip(4 * (1 - distance), 0, 1)
    made: NDArray[np.float32] = np.minimum(picture, 1).astype(np.float32)
    made.flags.writeable = False
    return made


def stages() -> dict[str, type[Glare]]:
    """Return the class of each stage, by the stage's name."""
    kinds: list[type[Glare]] = [*GlareLight.__subclasses__(), Dirt]
    return {kind.stage: kind for kind in kinds}


def check_glare(glare: object) -> tuple[Glare, ...]:
    """Return the stages of settings.

    Parameters
    ----------
    glare : Glare, mapping, a sequence of them, or None
        A mapping is what `Glare.to_dict` gave; None is no stage.

    Raises
    ------
    ValueError
        There are too many stages, or a mapping does not describe a stage.
    TypeError
        Something else is among them.
    """
    if glare is None:
        return ()
    if isinstance(glare, Glare | Mapping):
        glare = (glare,)
    if isinstance(glare, str) or not isinstance(glare, Iterable):
        raise TypeError(f"glare: {glare!r} is not a sequence of stages")
    found = []
    for one in glare:
        stage = Glare.from_dict(one) if isinstance(one, Mapping) else one
        if not isinstance(stage, Glare):
            raise TypeError(f"glare: {one!r} is not a stage, such as Streaks()")
        found.append(stage)
    if sum(isinstance(stage, Dirt) for stage in found) > 1:
        raise ValueError("glare: there is more than one stage of dirt")
    if len(found) > _core.MAX_STAGES:
        raise ValueError(f"glare: {len(found)} stages are out of range, 0 to {_core.MAX_STAGES}")
    return tuple(found)


def stage_field_of(glare: tuple[Glare, ...], name: str) -> tuple[int, str]:
    """Return the stage and the field of a name such as "glare.0.intensity".

    Raises
    ------
    ValueError
        There is no such stage, or it has no such field.
    """
    parts = name.split(".")
    if len(parts) == 3 and parts[0] == "glare" and parts[1].isdecimal():
        place = int(parts[1])
        if place < len(glare) and parts[2] in glare[place].__dataclass_fields__:
            return place, parts[2]
    known = [
        f"glare.{place}.{field.name}"
        for place, stage in enumerate(glare)
        for field in dataclasses.fields(stage)
    ]
    raise ValueError(
        f"glare: {name!r} is not a field of a stage: {', '.join(known) or 'no stages'}"
    )


def replaced_stages(glare: tuple[Glare, ...], changes: Mapping[str, Any]) -> tuple[Glare, ...]:
    """Return stages with some fields changed, by names such as "glare.0.intensity"."""
    stages_now = list(glare)
    for name, value in changes.items():
        place, field = stage_field_of(glare, name)
        changed: Any = dataclasses.replace(stages_now[place], **{field: value})
        stages_now[place] = changed
    return tuple(stages_now)
