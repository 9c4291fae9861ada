"""Make options from the descriptions of fields, so that a new field needs no code here."""

from __future__ import annotations

import dataclasses
import inspect
import itertools
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click
from click.shell_completion import CompletionItem
from numpy.typing import NDArray

from vkbloom import psf
from vkbloom._cli.image_files import silence
from vkbloom._cli.program import is_given
from vkbloom._cli.sequences import as_file
from vkbloom._io.array_files import read
from vkbloom._io.glows import grey_mask
from vkbloom._psf.base import PSF, functions
from vkbloom._settings.antialiasing import Antialiasing, antialiasing
from vkbloom._settings.exposure import Exposure, exposures
from vkbloom._settings.fields import FieldInfo, Kind, fields_of
from vkbloom._settings.glare import Glare, glares
from vkbloom._settings.registry import EXPOSURES, METHODS, STAGES
from vkbloom._settings.settings import Settings, presets
from vkbloom._spelling import describe_unknown, did_you_mean, nearest

if TYPE_CHECKING:
    _ParamType = click.ParamType[Any]
else:
    # Only later versions of click make it generic.
    _ParamType = click.ParamType


class _Word(_ParamType):
    """The type of an option whose value is one word, such as 256x256."""

    def __init__(self, form: str, read: Callable[[str], Any]) -> None:
        self.name = form
        self._read = read

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """Return the placeholder of the value in the help."""
        return self.name

    def convert(
        self, value: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> object:
        """Parse the word."""
        try:
            return self._read(value)
        except (TypeError, ValueError, click.BadParameter) as error:
            self.fail(f"{value!r}{self._reason(error)}", param, ctx)

    def _reason(self, error: Exception) -> str:
        return f" is not {self.name}"


class _ExplainedWord(_Word):
    """A word of which an error says what the reader does, not only that it lacks the form."""

    def _reason(self, error: Exception) -> str:
        return f": {error}"


def _read_size(word: str) -> tuple[int, int]:
    width, height = word.lower().split("x")
    return int(width), int(height)


def _read_numbers(word: str, separator: str = ",") -> tuple[float, ...]:
    return tuple(float(number) for number in word.split(separator))


def _read_pairs(word: str) -> tuple[tuple[float, ...], ...]:
    return tuple(_read_numbers(pair, ":") for pair in word.split(","))


def _read_psf(word: str) -> PSF:
    """Parse a function with its parameters, such as spencer:state=scotopic, or an image file."""
    name, _, rest = word.partition(":")
    # A word has no space for a field of kernels.
    known = [one for one in functions() if one.islower()]
    if name.lower() in known:
        return PSF.from_dict({"psf": name.lower()} | _read_fields(rest))
    if not os.path.exists(word):
        near = did_you_mean(name, known)
        raise ValueError(f"is neither a file nor one of {', '.join(known)}{near}")
    return psf.samples(read_colours(word))


def read_colours(path: str) -> NDArray[Any]:
    """Read the colours of an image file, (H, W, 3), or raise OSError or click.ClickException."""
    try:
        with silence(), as_file(path) as file:
            return read(file)[..., :3]
    except ValueError as error:
        # The file is at fault, and not the use of the option.
        raise click.ClickException(str(error)) from error


def _read_fields(text: str) -> dict[str, object]:
    """Parse A=1,B=[2,3]: values by name. Lists are written as in JSON."""
    fields: dict[str, object] = {}
    for part in re.split(r",(?=[^=\[\]]*(?:=|$))", text) if text else ():
        name, sign, value = part.partition("=")
        if not sign:
            raise ValueError(f"{part!r} is not NAME=VALUE")
        fields[name.strip()] = _plain(value)
    return fields


def _plain(text: str) -> object:
    try:
        return json.loads(text)
    except ValueError:
        return text


#: The type of an option for (width, height).
SIZE: Final = _Word("WxH", _read_size)


def _read_glare(word: str) -> tuple[Glare, ...]:
    """Parse names of glares and stages with fields, as streaks:directions=4,angle=45+halo."""
    if word.lower() in ("", "none"):
        return ()
    results: list[Glare] = []
    for item in word.split("+"):
        name, sign, rest = item.partition(":")
        name = name.lower()
        if name in glares:
            if sign:
                raise ValueError(f"{name} is a published glare, which takes no fields")
            results += glares[name]
            continue
        if name not in STAGES:
            known = [*STAGES, *glares]
            raise ValueError(
                f"{name!r} is not one of {', '.join(known)}{did_you_mean(name, known)}"
            )
        fields = _read_fields(rest)
        if isinstance(file := fields.get("image"), str):
            fields["image"] = read_colours(file)
        results.append(Glare.from_dict({"stage": name} | fields))
    return tuple(results)


def _read_exposure(word: str) -> Exposure | float:
    """Parse stops, or the name of an exposure or of a class of them with fields."""
    with suppress(ValueError):
        return float(word)
    name, _, rest = word.partition(":")
    name, fields = name.lower(), _read_fields(rest)
    if isinstance(file := fields.get("mask"), str):
        fields["mask"] = grey_mask(read_colours(file), file)
    if name in exposures:
        with_names = exposures[name].to_dict() | fields
        return Exposure.from_dict(with_names) if fields else exposures[name]
    if name in EXPOSURES:
        return Exposure.from_dict({"engine": name} | fields)
    known = dict.fromkeys([*exposures, *EXPOSURES])
    raise ValueError(
        f"is neither a number of stops nor one of {', '.join(known)}{did_you_mean(name, known)}"
    )


#: The type of an option for the field `exposure` that takes a stage in time, too.
EXPOSURE: Final = _ExplainedWord("STOPS|NAME[:A=1,...]", _read_exposure)


def _read_antialiasing(word: str) -> Antialiasing:
    """Parse the name of temporal anti-aliasing, with fields."""
    name, _, rest = word.partition(":")
    name, fields = name.lower(), _read_fields(rest)
    if name not in antialiasing:
        known = [*antialiasing]
        raise ValueError(f"is not one of {', '.join(known)}{did_you_mean(name, known)}")
    return Antialiasing.from_dict(antialiasing[name].to_dict() | fields)


#: The type of an option for temporal anti-aliasing.
TAA: Final = _ExplainedWord("NAME[:A=1,...]", _read_antialiasing)

_OPTION_TYPES: Final[Mapping[Kind, _ParamType]] = {
    "psf": _ExplainedWord("NAME[:A=1,...]|FILE", _read_psf),
    "glare": _ExplainedWord("NAME[:A=1,...]+...", _read_glare),
    "flag": click.BOOL,
    "number": click.FLOAT,
    "integer": click.INT,
    "size": SIZE,
    "numbers": _Word("A,B,...", _read_numbers),
    "vector": _Word("X,Y,Z", _read_numbers),
    "pairs": _Word("A:B,C:D,...", _read_pairs),
}


def option_type(info: FieldInfo) -> _ParamType:
    """Return the option type of a field."""
    if info.kind == "choice":
        kind: _ParamType = click.Choice(info.choices, case_sensitive=False)
    else:
        if info.kind not in _OPTION_TYPES:
            raise ValueError(f"{info.name}: {info.kind} has no option; use vkbloom.grid in Python")
        kind = _OPTION_TYPES[info.kind]
    return or_none(kind) if info.optional else kind


def or_none(kind: _ParamType) -> _ParamType:
    """Return a type that also takes the word none."""

    def read(word: str) -> object:
        return None if word.lower() == "none" else kind.convert(word, None, None)

    choices = kind.choices if isinstance(kind, click.Choice) else [kind.name]
    return _Word("|".join([*choices, "none"]), read)


def _spell(value: object, separator: str = ",") -> str:
    """Write a default value in the syntax of its option."""
    match value:
        case bool():
            return "on" if value else "off"
        case float():
            return f"{value:.12g}"
        case PSF():
            return _spell_psf(value)
        case ():
            return "none"
        case tuple():
            return separator.join(_spell(part, ":") for part in value)
        case _:
            return str(value).lower()


def _spell_psf(psf: PSF) -> str:
    """Write a function in the syntax of its option; only its name if a value has no word there."""
    name = type(psf).__name__
    changed = {
        info.name: value
        for info in fields_of(type(psf)).values()
        if (value := getattr(psf, info.name)) != info.default
    }
    if not all(isinstance(value, int | float | str | tuple) for value in changed.values()):
        return name
    words = [f"{key}={json.dumps(value, separators=(',', ':'))}" for key, value in changed.items()]
    return f"{name}:{','.join(words)}" if words else name


class FieldOption(click.Option):
    """An option of a field, whose value `FieldOptions` collects.

    `Command` lists it under the labels of the classes that have it; None: with its own options.
    """

    def __init__(
        self,
        infos: Mapping[str, FieldInfo],
        into: str,
        prefix: str,
        kind: tuple[_ParamType, str] | None = None,
    ) -> None:
        first = next(iter(infos.values()))
        kinds = {(info.kind, info.choices) for info in infos.values()}
        if len(kinds) > 1:
            raise TypeError(f"{first.name} is {' as well as '.join(item for item, _ in kinds)}")
        # The option accepts none if one of the classes does.
        widest = next((info for info in infos.values() if info.optional), first)
        option = f"{prefix}{first.option}".replace("_", "-")
        is_flag = first.kind == "flag"
        more = [kind[1]] if kind else []
        super().__init__(
            [f"--{option}/--no-{option}" if is_flag else f"--{option}", option.replace("-", "_")],
            default=None,
            type=None if is_flag else kind[0] if kind else option_type(widest),
            help=" ".join([*(_help(label, info) for label, info in infos.items()), *more]),
            expose_value=False,
        )
        self.field = first.name
        self.into = into
        self.labels = None if prefix else tuple(filter(None, infos))

    def handle_parse_result(
        self, ctx: click.Context, opts: Mapping[str, Any], args: list[str]
    ) -> tuple[Any, list[str]]:
        """Add a value that the user gave to those of the other fields."""
        value, args = super().handle_parse_result(ctx, opts, args)
        if self.name is not None and is_given(self.name, ctx):
            ctx.params[self.into][self.field] = value
        return value, args


def _help(label: str, info: FieldInfo) -> str:
    default = f"{label and label + ', '}default {_spell(info.default)}"
    return f"{info.help} [{default}]".strip()


class FieldOptions(click.Option):
    """The place of the options of some classes' fields, which `Command` makes when it is called.

    - `param_decls`: The command's keyword argument that receives the values of the call: a dict of
      field name to value.
    - `kinds`: Dataclasses by their label in the help; "" for no label. A field that several
      dataclasses have is one option, whose help has the text of each. A registry is read at each
      call.
    - `base`: A dataclass whose fields get no options.
    - `prefix`: Of the options' names, as in "camera-".
    - `types`: Types of options by field, other than those of their fields, each with a sentence for
      the help.
    """

    def __init__(
        self,
        param_decls: Sequence[str],
        kinds: Mapping[str, type[Any]],
        base: type[Any] | None = None,
        prefix: str = "",
        types: Mapping[str, tuple[_ParamType, str]] = MappingProxyType({}),
    ) -> None:
        (self.into,) = param_decls
        super().__init__([f"--{self.into}-fields", self.into], hidden=True, expose_value=False)
        self._kinds, self._base, self._prefix, self.types = kinds, base, prefix, types
        self._make: tuple[dict[str, type[Any]], list[FieldOption]] = {}, []

    def options(self) -> list[FieldOption]:
        """Return the options of the classes that there are now."""
        kinds = dict(self._kinds)
        if kinds != self._make[0]:
            inherited = fields_of(self._base) if self._base else {}
            fields: dict[str, dict[str, FieldInfo]] = {}
            for label, kind in kinds.items():
                for name, info in fields_of(kind).items():
                    # (A value of a further kind has no spelling as a word.)
                    if name in inherited or info.kind == "object":
                        continue
                    if METHODS.is_added(label) and any(
                        (item.kind, item.choices) != (info.kind, info.choices)
                        for item in fields.get(info.option, {}).values()
                    ):
                        # A custom method was loaded for this call: its field has the option.
                        del fields[info.option]
                    fields.setdefault(info.option, {})[label] = info
            made = [
                FieldOption(infos, self.into, self._prefix, self.types.get(option))
                for option, infos in fields.items()
            ]
            self._make = kinds, made
        return self._make[1]


# Where a call keeps what its help is about: a title, and the settings with their values.
_STARTED: Final = "vkbloom.started"
# Whether a call asked for all options.
_ALL: Final = "vkbloom.all"
# Width of the options' names in the help of a method, which fits on a screen of 50 lines.
_NARROW: Final = 24
# Fields of everyday use that have no slider.
_EVERYDAY: Final = ("composite", "psf")


class _Started(NamedTuple):
    """What the settings of a help are called, and their values."""

    title: str
    settings: Settings


class Command(click.Command):
    """A command with options of fields; its help lists those of a method that the call names.

    `everyday`: The options that ``--help`` describes, in its order; ``--help-all`` then describes
    all. Empty: ``--help`` does. `begins`: The preset whose values ``--help`` shows if a call names
    none.
    """

    def __init__(
        self, *args: Any, everyday: Sequence[str] = (), begins: str = "", **given: Any
    ) -> None:
        super().__init__(*args, **given)
        self._everyday, self._begins = everyday, begins
        if everyday:
            self.params.append(
                click.Option(
                    ["--help-all"],
                    is_flag=True,
                    is_eager=True,
                    expose_value=False,
                    callback=_show_all,
                    help="Describe all options: files, colours, buffers and formats.",
                )
            )

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return the parameters, with the options of fields in the place of each `FieldOptions`."""
        results: list[click.Parameter] = []
        for param in super().get_params(ctx):
            results += param.options() if isinstance(param, FieldOptions) else [param]
        return results

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Begin with no values of fields."""
        ctx.meta[_STARTED] = _started_by(args)
        options = (param for param in self.params if isinstance(param, FieldOptions))
        ctx.params.update({option.into: {} for option in options})
        return super().parse_args(ctx, args)

    def _is_short(self, ctx: click.Context) -> bool:
        return bool(self._everyday) and not ctx.meta.get(_ALL)

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the description; with a method, or a short one, only its first paragraph."""
        if ctx.meta.get(_STARTED) or self._is_short(ctx):
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(inspect.cleandoc(self.help or "").partition("\n\n")[0])
        else:
            super().format_help_text(ctx, formatter)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the command's own options and the settings of every method.

        With --method or --preset the former by their names only, and the method's settings.
        """
        general: list[click.Option] = []
        shared: list[click.Option] = []
        for param in self.get_params(ctx):
            if isinstance(param, FieldOption) and param.labels is not None:
                shared += [] if param.labels else [param]
            elif isinstance(param, click.Option):
                general.append(param)
        if self._is_short(ctx):
            self._format_short(ctx, formatter, general)
            return
        started: _Started | None = ctx.meta.get(_STARTED)
        asked = "--help-all" if self._everyday else "--help"
        if started:
            with formatter.section(f"Options ({ctx.command_path} {asked} describes them)"):
                formatter.write_text(" ".join(max(item.opts, key=len) for item in general))
            with formatter.section(f"Settings of {started.title}"):
                formatter.write_dl(_records(ctx, self._options_of(started)), col_max=_NARROW)
            return
        with formatter.section("Options"):
            formatter.write_dl(_records(ctx, general))
        if shared:
            with formatter.section("Settings of every method"):
                formatter.write_dl(_records(ctx, shared))
        if any(item.type.name == "method" for item in general):
            call = f"{ctx.command_path} --method NAME {asked}"
            with formatter.section(f"{call} lists the settings of"):
                formatter.write_text(", ".join(METHODS))

    def _format_short(
        self, ctx: click.Context, formatter: click.HelpFormatter, general: Iterable[click.Option]
    ) -> None:
        """Write the options of everyday use, and the values of what the call starts from."""
        options = {max(item.opts, key=len).lstrip("-"): item for item in general}
        described = [options[name] for name in (*self._everyday, "help-all", "help")]
        with formatter.section("Options"):
            formatter.write_dl(_records(ctx, described), col_max=_NARROW)
        started: _Started = ctx.meta.get(_STARTED) or _of_preset(self._begins)
        with formatter.section(f"Settings of {started.title}"):
            formatter.write_dl(
                _records(ctx, self._options_of(started, _is_everyday)), col_max=_NARROW
            )
        named = ", ".join(name for name, engine in presets.engines() if engine == "vkbloom")
        with formatter.section("Presets for photographs (vkbloom presets describes all)"):
            formatter.write_text(named)

    def _options_of(
        self, started: _Started, is_wanted: Callable[[FieldInfo], bool] | None = None
    ) -> list[click.Option]:
        """Return options of what settings have, with their values; those of all methods last."""
        types: dict[str, tuple[_ParamType, str]] = {}
        # (All settings of a method are to fit on a screen.)
        for param in self.params if is_wanted else ():
            types |= param.types if isinstance(param, FieldOptions) else {}
        # A field with one value is none to choose.
        infos = [
            dataclasses.replace(info, default=getattr(started.settings, info.name))
            for info in fields_of(type(started.settings)).values()
            if not info.fixed and len(info.choices) != 1 and (not is_wanted or is_wanted(info))
        ]
        infos.sort(key=lambda info: info.name in fields_of(Settings))
        return [FieldOption({"": info}, "", "", types.get(info.option)) for info in infos]


def _show_all(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    """Print the help of all options."""
    if value and not ctx.resilient_parsing:
        ctx.meta[_ALL] = True
        click.echo(ctx.get_help())
        ctx.exit()


def _started_by(args: Sequence[str]) -> _Started | None:
    """Return what the words of a call start from, by --method or --preset."""
    for option, value in itertools.pairwise(args):
        if option == "--method" and (name := nearest(value, METHODS)):
            return _Started(f"the method {name}", METHODS[name]())
        if option == "--preset" and (name := nearest(value, presets)):
            return _of_preset(name)
    return None


def _of_preset(name: str) -> _Started:
    settings = presets[name]
    return _Started(f"the preset {name}, of the method {settings.method}", settings)


def _is_everyday(info: FieldInfo) -> bool:
    """Whether the short help describes a field."""
    is_own = info.name not in fields_of(Settings)
    if info.everyday is not None:
        return info.everyday != 0
    return info.name in _EVERYDAY or (is_own and (info.ends is not None or info.kind == "vector"))


def _records(ctx: click.Context, options: Iterable[click.Option]) -> list[tuple[str, str]]:
    return [record for option in options if (record := option.get_help_record(ctx)) is not None]


def options(
    kinds: Mapping[str, type[Any]],
    into: str,
    *,
    base: type[Any] | None = None,
    prefix: str = "",
    types: Mapping[str, tuple[_ParamType, str]] = MappingProxyType({}),
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds `FieldOptions` to a `Command`; `types`: as of it."""
    how = {"kinds": kinds, "base": base, "prefix": prefix, "types": types}
    return click.option(into, cls=FieldOptions, **how)


class NameOf(_ParamType):
    """The type of an option whose value is a published name; upper case makes no difference.

    - `kind`: What has the name, such as "preset".
    - `known`: The names, or what has them as keys. Registries are read at each call.
    """

    def __init__(self, kind: str, *known: Iterable[str]) -> None:
        self.name = kind
        self._known = known

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str | None:
        """Return the placeholder of the value in the help."""
        return "NAME"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name as it was published."""
        names = {name.lower(): name for names in self._known for name in names}
        if value.lower() not in names:
            self.fail(describe_unknown(f"unknown {self.name}", value, names.values()), param, ctx)
        return names[value.lower()]

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the names that begin with some letters."""
        return [
            CompletionItem(name)
            for names in self._known
            for name in names
            if name.startswith(incomplete.lower())
        ]
