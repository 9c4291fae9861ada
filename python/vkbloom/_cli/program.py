"""The program: its commands, and the conversion of errors to one line and an exit status."""

from __future__ import annotations

import errno
import itertools
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, NoReturn

import click
from click.core import ParameterSource

from vkbloom._cli import terminal
from vkbloom._cli.interrupts import INTERRUPTED, raise_interrupts
from vkbloom._errors import Error
from vkbloom._free_memory import ADVICE, free_memory
from vkbloom._lazy_modules import own_module
from vkbloom._settings.registry import METHODS
from vkbloom._spelling import did_you_mean

#: What the commands do, by the modules of this package that have a click command `command`.
COMMANDS: Final = {
    "render": "Render a scene to image files",
    "apply": "Add bloom to an image file",
    "view": "Show the bloom of a scene or an image in a window",
    "explore": "Explore the bloom of an image or a scene in a browser",
    "grid": "Render all combinations of axis values to a Zarr store or image files",
    "fit": "Find the settings whose bloom matches a picture",
    "translate": "Find another method's parameters whose bloom comes closest to settings",
    "check": "Measure a bloom by every law",
    "flare": "Report the flare of a camera or a bloom by the standards",
    "describe": "Write the description of shaders, bloom.toml",
    "compare": "Measure the differences of two image files",
    "presets": "List the presets",
    "glares": "List the stages and published names of glare",
    "psfs": "List the point-spread functions",
    "exposures": "List the exposures of engines",
    "adapters": "List the Vulkan adapters that vkbloom can use",
    "doctor": "Check whether this machine can render, and explain what prevents it",
    "warm": "Fill the caches of pipelines and kernels before the first call needs them",
}

# Modules of several commands, and of a command's package.
_MODULES: Final = {
    "check": "check.command",
    **dict.fromkeys(("presets", "glares", "psfs", "exposures"), "listing"),
    **dict.fromkeys(("fit", "translate"), "search"),
    **dict.fromkeys(("view", "explore"), "live"),
    "adapters": "doctor",
}

_FAILURES: Final = (Error, OSError, ValueError, ImportError, MemoryError)


# How Python and OpenImageIO report that there is no memory for a thread's stack, and the dynamic
# linker that there is none for a library.
_NO_THREAD: Final = ("start new thread", "Resource temporarily unavailable")
_NO_LIBRARY: Final = ("failed to map segment", "cannot allocate memory")


class Program(click.Group):
    """A group that imports a command when it is called, and prints an error as one line.

    A command's return value is the exit status; None is 0.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command; None if there is no such command."""
        if cmd_name not in COMMANDS:
            return None
        module = own_module(__package__, _MODULES.get(cmd_name, cmd_name))
        command: click.Command = getattr(module, cmd_name if cmd_name in _MODULES else "command")
        raise_interrupts()
        if terminal.QUIET_OPTION not in command.params:
            command.params.append(terminal.QUIET_OPTION)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that a call names, or say which one was meant."""
        if args[0] not in COMMANDS and not args[0].startswith("-") and not ctx.resilient_parsing:
            if os.path.exists(args[0]):
                ctx.fail(f"{args[0]} is a file, not a command; did you mean {ctx.info_name} apply?")
            ctx.fail(f"No such command {args[0]!r}{did_you_mean(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what the commands do, without an import of them."""
        with formatter.section("Commands"):
            formatter.write_dl([*COMMANDS.items()])

    def make_context(
        self, info_name: str | None, args: list[str], *rest: Any, **extra: Any
    ) -> click.Context:
        """Parse the words of a call; Ctrl-C is click.Abort, before click prints an empty line."""
        try:
            return super().make_context(info_name, args, *rest, **extra)
        except KeyboardInterrupt:
            raise click.Abort from None

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; Ctrl-C is click.Abort."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise click.Abort from None

    def main(  # type: ignore[override]
        self, args: Sequence[str] | None = None, prog_name: str | None = None, **options: Any
    ) -> NoReturn:
        """Run the program and exit: 0 done, 1 failed, 2 wrong use, 130 interrupted."""
        options["standalone_mode"] = False
        terminal.print_as_usual()
        try:
            words = with_methods(sys.argv[1:] if args is None else args)
            status = super().main(words, prog_name, **options)
        except click.NoSuchOption as error:
            near = did_you_mean(error.option_name, error.possibilities or ())
            where = f" (see {error.ctx.command_path} --help)" if error.ctx else ""
            _exit(2, f"No such option {error.option_name!r}{near}{where}")
        except click.UsageError as error:
            where = f" (see {error.ctx.command_path} --help)" if error.ctx else ""
            _exit(2, error.format_message() + where)
        except click.ClickException as error:
            _exit(1, error.format_message())
        except click.Abort:
            if sys.stderr is not None and sys.stderr.isatty():
                # It ends the line on which a terminal shows ^C.
                click.echo(err=True)
            _exit(INTERRUPTED, "interrupted")
        except Exception as error:
            if _is_from_interrupt(error):
                _exit(INTERRUPTED, "interrupted")
            no_memory = {RuntimeError: _NO_THREAD, ImportError: _NO_LIBRARY}.get(type(error), ())
            if any(item in str(error) for item in no_memory):
                _exit(1, describe(MemoryError(str(error))))
            if isinstance(error, _FAILURES):
                _exit(1, describe(error))
            raise
        sys.exit(status)


def with_methods(words: Sequence[str]) -> list[str]:
    """Load the files of custom methods after --method or --to; put the names there.

    These options and their values are words of their own then.
    """
    changed: list[str] = []
    for word in words:
        option, sign, value = word.partition("=")
        is_joined = sign and option in ("--method", "--to", "--preset")
        changed += [option, value] if is_joined else [word]
    for index, (option, value) in enumerate(itertools.pairwise(changed), 1):
        if option in ("--method", "--to") and value not in METHODS and os.path.isfile(value):
            from vkbloom._custom.method import load_method  # noqa: PLC0415  costs start-up time

            changed[index] = load_method(value).method
    return changed


def _is_from_interrupt(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error, as when it ends a cluster that is starting."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def describe(error: BaseException) -> str:
    """Return an error in one sentence, with the name of its file."""
    if isinstance(error, click.ClickException):
        return error.format_message()
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        folder = os.path.dirname(os.fsdecode(error.filename))
        if error.errno == errno.ENOENT and folder and not os.path.lexists(folder):
            while (above := os.path.dirname(folder)) and not os.path.lexists(above):
                folder = above
            return f"{error.filename}: there is no folder {folder}"
        return f"{error.filename}: {error.strerror}"
    text = str(error) or type(error).__name__
    if isinstance(error, MemoryError) and "memory is short" not in text:
        left = free_memory()
        free = "" if left is None else f" ({left >> 20} MiB are free)"
        return f"memory is short{free}: {text}; {ADVICE}"
    return text


def _exit(status: int, message: str) -> NoReturn:
    terminal.complain(message)
    sys.exit(status)


@contextmanager
def as_wrong_use() -> Iterator[None]:
    """Convert a TypeError or ValueError of an argument to click.UsageError, exit status 2."""
    try:
        yield
    except (TypeError, ValueError) as error:
        raise click.UsageError(str(error)) from error


def is_given(name: str, context: click.Context | None = None) -> bool:
    """Return whether the user set a parameter of the running command, or of another context's."""
    source = (context or click.get_current_context()).get_parameter_source(name)
    return source not in (None, ParameterSource.DEFAULT, ParameterSource.DEFAULT_MAP)


#: ``--adapter``, the argument of `vkbloom.Renderer`.
adapter_option: Final = click.option(
    "--adapter", default="auto", help="auto, software, hardware, or a part of an adapter's name."
)


@click.group(
    cls=Program,
    # A call without a command prints one line instead of the help text.
    no_args_is_help=False,
    context_settings={"help_option_names": ["-h", "--help"], "show_default": True},
    params=[terminal.QUIET_OPTION],
)
@click.version_option(
    None, "-V", "--version", package_name="vkbloom", message="%(prog)s %(version)s"
)
def program() -> None:
    """Render bloom and inspect each of its framebuffers."""
