"""Custom methods as settings: the classes that `load_method` makes."""

from __future__ import annotations

import copy
import copyreg
import dataclasses
import keyword
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Final, Literal, Self

from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._argument_types import check_arguments
from vkbloom._custom.described.generate import is_shader, read_shaders
from vkbloom._custom.described.schema import Description
from vkbloom._custom.described.source import (
    DescribedSource,
    Programs,
    open_described,
    read_described,
)
from vkbloom._custom.file import CustomFile, read_file
from vkbloom._custom.names import TAKEN
from vkbloom._custom.params import RANGES, Param
from vkbloom._custom.planning import FrameValues, plan_rows
from vkbloom._custom.rows import Resources, changing_resources
from vkbloom._custom.shaders import Shaders
from vkbloom._custom.source import Source, read_source
from vkbloom._formats import MAX_FLOAT
from vkbloom._locks import ProcessLock
from vkbloom._public import public
from vkbloom._settings.blocks import settings_block
from vkbloom._settings.fields import choice_field, number_field
from vkbloom._settings.registry import METHODS
from vkbloom._settings.settings import Settings

Reference = Callable[[NDArray[Any], Settings], Mapping[str, NDArray[Any]]]

#: Fields that a file without BLOOM has not, since it composites by itself.
COMPOSITED: Final = ("intensity", "composite")

#: Held while a class is looked up and made, so that threads that load one text get one class.
_LOADING: Final = ProcessLock()


class CustomType(type):
    """The type of the classes, which are pickled as the text that they are made of."""

    method: str
    file: CustomFile | Description
    numpy_reference: Reference | None


@dataclasses.dataclass(frozen=True, kw_only=True)
class CustomMethod(Settings, metaclass=CustomType):
    """Base class of the settings of custom methods."""

    file: ClassVar[CustomFile | Description]
    shaders: ClassVar[Shaders | Programs]
    numpy_reference: ClassVar[Reference | None] = None
    _place: ClassVar[int] = 0
    _state: ClassVar[dict[Any, Any] | None] = None

    def _check_together(self) -> None:
        if not self.file.saves_bloom:
            for name in COMPOSITED:
                if getattr(self, name) != getattr(type(self), name):
                    raise ValueError(
                        f"{name}: {getattr(self, name)!r} is not {getattr(type(self), name)!r}; "
                        f"the method {self.method} composites by itself, since it saves no BLOOM"
                    )
            if self.glare and not any(stage._adds_light for stage in self.glare):
                raise ValueError(
                    f"glare: Dirt has no light that it multiplies, since the method {self.method} "
                    "saves no BLOOM; add a stage that gives light, or save BLOOM"
                )

    def numbers(self) -> dict[str, float]:
        """Return the number of each parameter."""
        return {param.name: param.plain(getattr(self, param.name)) for param in self.file.params}

    def _core_block(self) -> bytes:
        """Return the fields of all settings: others may have the names of other methods' fields."""
        shared = {field.name: getattr(self, field.name) for field in dataclasses.fields(Settings)}
        return settings_block("custom", shared)

    def core_passes(self, frame: tuple[int, int], buffers: tuple[int, int]) -> tuple[Any, ...]:
        """Return the passes of a frame, as the core takes them."""
        request = FrameValues(
            frame, buffers, self.numbers(), self.dither_seed, self._place, self._resources()
        )
        if isinstance(self.shaders, Programs):
            rows = self.shaders.plan(request)
        else:
            assert isinstance(self.file, CustomFile)
            rows = plan_rows(self.file, self.shaders, request)
        return tuple(row.pack() for row in rows)

    def _resources(self) -> Resources:
        """Return the textures and buffers of the file; those that passes change are new ones."""
        if not isinstance(self.file, CustomFile) or not isinstance(self.shaders, Shaders):
            return {}
        if self._state is None:
            changed = changing_resources(self.file)
        elif (changed := self._state.get(type(self), {})) == {}:
            changed = self._state[type(self)] = changing_resources(self.file)
        return {**self.shaders.resources, **changed}

    @property
    def _has_state(self) -> bool:
        """Whether passes change textures or buffers, so that frames depend on those before."""
        return any(block.storage for block in self.file.embedded.values())

    @property
    def _continues(self) -> bool:
        """Whether a call reads what an earlier one has left: a state, or framebuffers."""
        return self._has_state or bool(self.file.histories)

    def _in_sequence(self, index: int, state: dict[Any, Any]) -> Self:
        """Return a copy for a frame of a sequence, which counts the frames before it."""
        copied = copy.copy(self)
        object.__setattr__(copied, "_place", index)
        object.__setattr__(copied, "_state", state)
        return copied

    def to_dict(self) -> dict[str, Any]:
        """Return method, SHA-256 of the text, and the fields."""
        return {"method": self.method, "sha256": self.file.source.digest, **super().to_dict()}

    @classmethod
    def _check_stored(cls, values: dict[str, Any]) -> None:
        super()._check_stored(values)
        digest = values.pop("sha256", cls.file.source.digest)
        if digest != cls.file.source.digest:
            raise ValueError(
                f"sha256: the method {cls.method} that is loaded, {cls.file.source.name}, has "
                f"another text; load the file that has {digest} with vkbloom.load_method"
            )

    def __reduce__(self) -> tuple[Any, ...]:
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        # Not the class: cloudpickle, which Dask uses, would copy what the class holds.
        kind = type(self)
        return settings_of, (kind.method, kind.file.source, kind.numpy_reference, values)


def settings_of(
    name: str, source: Source, reference: Reference | None, values: dict[str, Any]
) -> CustomMethod:
    """Return settings of the class of a text; for pickle."""
    return class_of(name, source, reference)(**values)


def class_of(name: str, source: Source, reference: Reference | None) -> type[CustomMethod]:
    """Return the class of a text: the one that is registered, or a new one; for pickle."""
    with _LOADING:
        if name in METHODS:
            known = METHODS[name]
            if isinstance(known, CustomType) and known.file.source == source:
                return known
        return register(name, source, reference)


def reduce(kind: CustomType) -> Any:
    """Return how a class is made again; for pickle."""
    if kind is CustomMethod:
        return kind.__name__
    return class_of, (kind.method, kind.file.source, kind.numpy_reference)


copyreg.pickle(CustomType, reduce)


@public("vkbloom")
@check_arguments
def load_method(
    source: str | os.PathLike[str],
    *,
    name: str | None = None,
    reference: Reference | None = None,
) -> type[Settings]:
    """Load a method from a file of passes in the syntax of mpv's user shaders, or a description.

    Parameters
    ----------
    source : path or str
        The file, or its text, which contains a line feed. A file ``.toml`` is a description of
        shaders in GLSL, HLSL, Slang, WGSL, WESL or SPIR-V; a shader needs none if it tells all.
    name : str, optional
        The method's name, an identifier that no method of the package has. Default: the file's stem
        with _ for other characters, "custom" for a text. A method that was loaded under this
        name is replaced.
    reference : callable, optional
        A reference in NumPy: ``reference(image, settings)`` gets an array (H, W, 4) in float64 and
        returns framebuffers by name, with ``bloom`` or ``final``. `reference.apply` calls it.

    Returns
    -------
    type
        A class of settings with the fields of all settings, and one for each ``//!PARAM`` or table
        ``settings``. An ENUM is a choice of its names.

    Raises
    ------
    ValueError
        The file is not valid; the message names file and line, and quotes the line. Or the name is
        not possible, or a PARAM has the name of a field of all settings.
    ShaderError
        A pass does not compile; the message names file and line. Or the compiler is missing: the
        message says how to install it.
    OSError
        The file cannot be read.

    Notes
    -----
    Passes can bind ``MAIN`` (the frame), ``GLOW`` (what glows), and what they saved. Saved textures
    are framebuffers under their lower-case names, with the prefix ``saved_`` where the package has
    a framebuffer of that name. A file that saves ``BLOOM`` leaves the composite to the package; any
    other file replaces the picture, to which only glare is added.

    Examples
    --------
    >>> text = '''//!PARAM gain
    ... //!TYPE float
    ... //!MINIMUM 0
    ... //!MAXIMUM 4
    ... 2
    ... //!HOOK MAIN
    ... //!BIND GLOW
    ... //!SAVE BLOOM
    ... vec4 hook() { return gain * GLOW_tex(GLOW_pos); }
    ... '''
    >>> Gained = vkbloom.load_method(text, name="gained")
    >>> Gained(gain=3).gain
    3.0
    """
    read = read_method(source)
    if name is None:
        name = identifier_of(Path(read.name).stem if read.name != "<text>" else "custom")
    elif not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
        raise ValueError(f"name: {name!r} is not an identifier")
    with _LOADING:
        known = class_of(name, read, reference)
        return known if known.numpy_reference is reference else register(name, read, reference)


def read_method(source: str | os.PathLike[str]) -> Source:
    """Read the file of a method: of passes; a description, whose shaders it compiles; a shader."""
    if isinstance(source, str) and "\n" in source:
        return read_source(source)
    if Path(source).suffix.lower() == ".toml":
        return read_described(source)
    return read_shaders([source]) if is_shader(source) else read_source(source)


def read_again(source: Source) -> Source:
    """Read the files of a source again, as they are now."""
    if isinstance(source, DescribedSource) and Path(source.name).suffix.lower() != ".toml":
        return read_shaders(source.shaders)
    return read_method(source.name)


def load_shaders(files: Sequence[str]) -> type[CustomMethod]:
    """Load a method from shaders that together tell all that a description says."""
    with _LOADING:
        return class_of(identifier_of(Path(files[0]).stem), read_shaders(files), None)


def identifier_of(stem: str) -> str:
    """Return an identifier for a file's stem."""
    name = re.sub(r"\W", "_", stem)
    return name if name.isidentifier() and not keyword.iskeyword(name) else f"_{name}"


def register(name: str, source: Source, reference: Reference | None) -> type[CustomMethod]:
    """Make the class of a text, and register it; with the lock of loading."""
    if name in METHODS and not isinstance(METHODS[name], CustomType):
        raise ValueError(f"name: {name!r} is a method of vkbloom; give another name=")
    file: CustomFile | Description
    shaders: Shaders | Programs
    if isinstance(source, DescribedSource):
        file, shaders = open_described(name, source)
    else:
        file = read_file(source)
        shaders = Shaders(name, file)
        shaders.compile_all({param.name: param.default for param in file.params})
    fields = [(param.name, *field_of(file, param)) for param in file.params]
    kind: Any = dataclasses.make_dataclass(
        class_name(name),
        fields,
        bases=(CustomMethod,),
        namespace={
            "__doc__": f"The method {name}, loaded from {source.name}.",
            "__module__": __name__,
            "method": name,
            "file": file,
            "shaders": shaders,
            "_knobs": tuple(param.name for param in file.params if param.name != SHARED),
            "numpy_reference": None if reference is None else staticmethod(reference),
        },
        frozen=True,
        kw_only=True,
    )
    METHODS.register(kind)
    made: type[CustomMethod] = kind
    return made


def class_name(name: str) -> str:
    """Return the name of a method's class: soft_bloom is SoftBloom."""
    joined = "".join(part[:1].upper() + part[1:] for part in name.split("_"))
    return joined if joined.isidentifier() else f"Custom{joined}"


def field_of(file: CustomFile | Description, param: Param) -> tuple[Any, Any]:
    """Return type and declaration of a parameter's field."""
    low, high = max(param.low, -MAX_FLOAT), min(param.high, MAX_FLOAT)
    shared = param.name == SHARED and param.number == "float"
    if shared:
        _, least, most = _core.VALUES[SHARED]
        low, high = max(low, least), min(high, most)
    elif hasattr(CustomMethod, param.name) or keyword.iskeyword(param.name) or param.name in TAKEN:
        owner = "Python reserves" if keyword.iskeyword(param.name) else "all settings have"
        kind = "PARAM" if isinstance(file, CustomFile) else "settings"
        raise file.source.fault(
            param.line, f"{kind}: {param.name!r} is a name that {owner}; rename it"
        )
    if param.names:
        read = EnumReader(param.name, param.names)
        return Literal[param.names], choice_field(param.names, read=read, text=param.description)
    whole = param.number != "float"
    default = int(param.default) if whole else param.default
    return (int if whole else float), number_field(
        default=default,
        # Finite, since a range that ends at infinity does not contain its beginning.
        range=(low, high),
        slider=() if shared else slider_of(param),
        text=param.description,
    )


def slider_of(param: Param) -> tuple[float, float] | tuple[()]:
    """Return the ends of a slider: the file's limits, where one is missing twice the default."""
    low, high = RANGES[param.number]
    start = param.low if param.low != low else min(0.0, 2 * param.default)
    end = param.high if param.high != high else max(start + 1, 2 * param.default)
    if param.low == param.high:
        return ()
    return (start if start < end else end - 1), end


#: The setting that a PARAM can be: the file gives its default and narrows its range, the body and
#: the encoding get its value. Published files of tone curves have it with the same meaning.
SHARED: Final = "reference_white"


@dataclasses.dataclass(frozen=True)
class EnumReader:
    """Reads the value of an ENUM: one of its names, or the index of one."""

    name: str
    names: tuple[str, ...]

    def __call__(self, value: object) -> str:
        """Return the name."""
        if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < len(self.names):
            return self.names[value]
        if isinstance(value, str) and value in self.names:
            return self.names[self.names.index(value)]
        raise ValueError(f"{self.name}: {value!r} is not one of {', '.join(self.names)}")
