"""Generate options from the fields of dataclasses, so that a new field needs no code here."""

from __future__ import annotations

import dataclasses
import functools
import json
import os
import re
import types
import typing
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, Protocol

import click
from numpy.typing import NDArray

import vkbloom
from vkbloom import psf
from vkbloom.cli.image_files import silenced
from vkbloom.cli.program import given
from vkbloom.glare.base import STAGES, Glare
from vkbloom.methods.convolution import PSFLike
from vkbloom.named_glares import glares
from vkbloom.psf.base import PSF
from vkbloom.views.descriptions import described_parameters

if TYPE_CHECKING:
    _ParamType = click.ParamType[Any]
else:
    # Only later versions of click make it generic.
    _ParamType = click.ParamType


class _Word(_ParamType):
    """The type of an option whose value is one word, such as 256x256.

    An error says that the word does not have the form, or with `explains` the reader's reason.
    """

    def __init__(self, form: str, read: Callable[[str], Any], *, explains: bool = False) -> None:
        self.name = form
        self._read = read
        self._explains = explains

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
            reason = f": {error}" if self._explains else f" is not {self.name}"
            self.fail(f"{value!r}{reason}", param, ctx)


def _read_size(word: str) -> tuple[int, int]:
    width, height = word.lower().split("x")
    return int(width), int(height)


def _read_numbers(word: str, separator: str = ",") -> tuple[float, ...]:
    return tuple(float(number) for number in word.split(separator))


def _read_pairs(word: str) -> tuple[tuple[float, ...], ...]:
    return tuple(_read_numbers(pair, ":") for pair in word.split(","))


_PSFS: Final = [
    name
    for name, kind in vars(psf).items()
    if isinstance(kind, type) and issubclass(kind, PSF) and kind is not PSF
]


def _read_psf(word: str) -> PSF:
    """Parse a function with its parameters, such as spencer:state=scotopic, or an image file."""
    name, _, rest = word.partition(":")
    if name in _PSFS:
        return PSF.from_dict({"psf": name} | _read_fields(rest))
    if not os.path.exists(word):
        raise ValueError(f"is neither a file nor one of {', '.join(_PSFS)}")
    return psf.samples(read_colours(word))


def read_colours(path: str) -> NDArray[Any]:
    """Read the colours of an image file, (H, W, 3), or raise OSError or click.ClickException."""
    try:
        with silenced():
            return vkbloom.read(path)[..., :3]
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
    found: list[Glare] = []
    for one in word.split("+"):
        name, sign, rest = one.partition(":")
        if name in glares:
            if sign:
                raise ValueError(f"{name} is a published glare, which takes no fields")
            found += glares[name]
            continue
        if name not in STAGES:
            known = ", ".join([*STAGES, *glares])
            raise ValueError(f"{name!r} is not one of {known}")
        found.append(Glare.from_dict({"stage": name} | _read_fields(rest)))
    return tuple(found)


_OPTION_TYPES: Final[Mapping[object, _ParamType]] = {
    PSFLike: _Word("NAME[:A=1,...]|FILE", _read_psf, explains=True),
    tuple[Glare, ...]: _Word("NAME[:A=1,...]+...", _read_glare, explains=True),
    float: click.FLOAT,
    int: click.INT,
    tuple[int, int]: SIZE,
    tuple[float, ...]: _Word("A,B,...", _read_numbers),
    tuple[float, float, float]: _Word("X,Y,Z", _read_numbers),
    tuple[tuple[float, float], ...]: _Word("A:B,C:D,...", _read_pairs),
}


def option_type(annotation: object) -> _ParamType:
    """Return the option type of a field's annotation.

    Raises
    ------
    TypeError
        The annotation has no option type.
    """
    if annotation in _OPTION_TYPES:
        return _OPTION_TYPES[annotation]
    if isinstance(annotation, types.UnionType) or typing.get_origin(annotation) is typing.Union:
        (inner,) = (part for part in typing.get_args(annotation) if part is not types.NoneType)
        return _or_none(option_type(inner))
    if typing.get_origin(annotation) is Literal:
        return click.Choice(typing.get_args(annotation))
    raise TypeError(f"annotation: {annotation!r} has no option type; add one to _OPTION_TYPES")


def _or_none(kind: _ParamType) -> _Word:
    def read(word: str) -> object:
        return None if word.lower() == "none" else kind.convert(word, None, None)

    choices = kind.choices if isinstance(kind, click.Choice) else [kind.name]
    return _Word("|".join([*choices, "none"]), read)


def _spelled(value: object, separator: str = ",") -> str:
    """Write a default value in the syntax of its option."""
    match value:
        case bool():
            return "on" if value else "off"
        case float():
            return f"{value:.12g}"
        case PSF():
            return type(value).__name__
        case ():
            return "none"
        case tuple():
            return separator.join(_spelled(part, ":") for part in value)
        case _:
            return str(value).lower()


class _Dataclass(Protocol):
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]


class FieldOption(click.Option):
    """An option of a field. `Command` lists it under the labels of the classes that have it."""

    labels: tuple[str, ...] = ()


class Command(click.Command):
    """A command whose help groups the options of fields by the classes that have them."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the command's own options, then those of each group."""
        groups: dict[tuple[str, ...] | None, list[tuple[str, str]]] = {None: []}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None and isinstance(parameter, click.Option):
                labels = parameter.labels if isinstance(parameter, FieldOption) else None
                groups.setdefault(labels, []).append(record)
        # Fields of many classes come first.
        order = sorted((labels for labels in groups if labels), key=lambda labels: -len(labels))
        shared = [labels for labels in order if len(labels) > 1]
        with formatter.section("Options"):
            formatter.write_dl(groups[None])
        if () in groups:
            with formatter.section("Settings of every method"):
                formatter.write_dl(groups[()])
        if shared:
            with formatter.section("Settings of several methods"):
                formatter.write_dl([record for labels in shared for record in groups[labels]])
        for labels in order:
            if len(labels) == 1:
                with formatter.section(f"Settings of the method {labels[0]}"):
                    formatter.write_dl(groups[labels])


@dataclasses.dataclass
class _Field:
    """A field for which an option is made: its annotation, help texts and classes' labels."""

    annotation: Any
    helps: list[str]
    option: str
    labels: list[str]


def _collect(
    kinds: Mapping[str, type[_Dataclass]], base: type[_Dataclass] | None
) -> dict[str, _Field]:
    """Return the fields of several dataclasses by name, except those of their base."""
    inherited = {field.name for field in dataclasses.fields(base)} if base else set()
    found: dict[str, _Field] = {}
    for label, kind in kinds.items():
        annotations = typing.get_type_hints(kind)
        texts = described_parameters(kind)
        for declaration in dataclasses.fields(kind):
            name = declaration.name
            if name in inherited:
                continue
            annotation = annotations[name]
            option = declaration.metadata.get("option", name)
            field = found.setdefault(name, _Field(annotation, [], option, []))
            # The option accepts none if one of the classes does.
            wider = field.annotation | annotation
            if wider not in (field.annotation, annotation):
                raise TypeError(f"{name} is {field.annotation} as well as {annotation}")
            field.annotation = wider
            default = f"{label and label + ', '}default {_spelled(declaration.default)}"
            field.helps.append(f"{texts.get(name, '')} [{default}]".strip())
            field.labels += [label] if label else []
    return found


def _option_class(labels: tuple[str, ...] | None) -> type[click.Option]:
    """Return the option class of fields with these labels; None: the options have no group."""
    if labels is None:
        return click.Option
    return type("FieldOption", (FieldOption,), {"labels": labels})


def options(
    kinds: Mapping[str, type[_Dataclass]],
    into: str,
    *,
    base: type[_Dataclass] | None = None,
    prefix: str = "",
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds an option to a command for each field of the dataclasses.

    Parameters
    ----------
    kinds : mapping of str to type
        Dataclasses by their label in the help; "" for no label. A field that several dataclasses
        have becomes one option, and its help has the text of each.
    into : str
        The command's keyword argument that receives the options given by the user: a dict of
        field name to value.
    base : type, optional
        A dataclass whose fields get no options.
    prefix : str
        Prefix of the options' names, as in "camera-".

    Raises
    ------
    TypeError
        A field's annotation has no option type, or fields of the same name differ in type.
    """
    fields = _collect(kinds, base)
    parameters = {
        name: f"{prefix}{field.option}".replace("-", "_") for name, field in fields.items()
    }

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def run(**values: object) -> object:
            every = {name: values.pop(parameter) for name, parameter in parameters.items()}
            chosen = {name: every[name] for name in every if given(parameters[name])}
            return command(**values, **{into: chosen})

        for name, field in reversed(fields.items()):
            option = f"{prefix}{field.option}".replace("_", "-")
            is_flag = field.annotation is bool
            run = click.option(
                f"--{option}/--no-{option}" if is_flag else f"--{option}",
                parameters[name],
                default=None,
                type=None if is_flag else option_type(field.annotation),
                help=" ".join(field.helps),
                cls=_option_class(None if prefix else tuple(field.labels)),
            )(run)
        return run

    return decorate
