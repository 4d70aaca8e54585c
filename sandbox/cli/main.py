"""Entry point of the command line: the group of commands, each imported only when it is called."""

import difflib
import gc
import importlib
import os
import re
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from sandbox import resource_limits
from sandbox.cli.streams import OutputError, prepare_streams
from sandbox.echo import MAX_MESSAGE, printable, short_repr, shorten

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# Without this, pydantic searches every installed package for plugins, which takes 20 ms of each command.

COMMANDS = {
    "run": ("run:run_command", "run scenes without a window and print the results"),
    "runs": ("runs:runs_command", "list, filter, group and plot the stored runs of a folder"),
    "play": ("window:play_command", "open the window: play a scene, or pick one"),
    "serve": ("serve:serve_command", "serve a live scene to the browser: play, drag, sliders, engines"),
    "compare": ("compare:compare_command", "run a scene on several engines and measure the error of each"),
    "tradeoff": (
        "tradeoff:tradeoff_command",
        "find the cheapest setting within an error, or the most accurate within a budget",
    ),
    "advise": ("advise:advise_command", "tune a game: which dt, how many iterations, which engine, with the code"),
    "shots": ("shots:shots_command", "success odds, sensitivity and predictability horizon of a billiard shot"),
    "extremes": ("extremes:extremes_command", "find the limits of each engine: mass ratio, speed, stack height, …"),
    "report": ("report:report_command", "compare many scenes and write one HTML page: errors, costs, replays"),
    "record": ("record:record_command", "play a game that uses pymunk, and keep the session as a recording"),
    "rehearse": ("rehearse:rehearse_command", "run a recorded pymunk game again, with other settings of its physics"),
    "import": ("import_level:import_command", "convert a level (.svg of Inkscape, .tmx of Tiled) to a scene file"),
    "check": ("check:check_command", "validate scenes and predict numerical problems before a run"),
    "warm": ("warm:warm_command", "compile all functions in advance, so that nothing waits for it later"),
    "scenes": ("info:scenes_command", "list the shipped scenes"),
    "engines": ("info:engines_command", "list the engines and the physics that each models"),
    "schema": ("info:schema_command", "print the keys of a table of the scene file, or the whole JSON Schema"),
    "export": ("export:export_command", "export a stored run as csv, parquet, gif, mp4 or png"),
    "replay": ("window:replay_command", "show a stored run or a recorded session in the window"),
    "miss": ("games:miss_command", "measure how far a projectile lands off target, by engine, integrator and step"),
    "match": ("games:match_command", "play frames of billiards between bots and print the score"),
}
"""Each command: module of this package and function, and one line of help. Help is printed without importing them."""

COMPLETION = "_SANDBOX_COMPLETE"
"""Environment variable of shell completion, with the name that click uses."""

GREETING = """\
sandbox runs one physics scene on several engines and measures the error and the cost of each.

  sandbox run bounce          run a scene and print the results
  sandbox play 9-ball         play a scene in a window
  sandbox compare bounce      measure the error of every engine

All commands: sandbox --help. Shipped scenes: sandbox scenes."""
"""Output of `sandbox` without a command."""


class Commands(click.Group):
    """Group that imports a command when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002, click's signature
        """Return the names of all commands, in the order of their typical use."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Import a command."""
        if cmd_name not in COMMANDS:
            return None
        collecting = gc.isenabled()
        gc.disable()  # imports create many objects and no garbage: collections take a fifth of the time
        try:
            module, _, function = COMMANDS[cmd_name][0].partition(":")
            command: click.Command = getattr(importlib.import_module(f"sandbox.cli.{module}"), function)
            if COMPLETION in os.environ:
                importlib.import_module("sandbox.cli.completion").add_completions(command)
        finally:
            if collecting:
                gc.enable()
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command named by the first argument.

        Raises:
            click.UsageError: there is no such command; the message suggests the closest one.
        """
        name = args[0]
        if name in COMMANDS or name.startswith("-") or ctx.resilient_parsing:
            return super().resolve_command(ctx, args)
        close = difflib.get_close_matches(name, COMMANDS, n=1)
        if close:
            raise click.UsageError(f"unknown command {short_repr(name)}; did you mean {close[0]!r}?", ctx)
        if _is_scene(name):
            raise click.UsageError(
                f"{short_repr(name)} is a scene, not a command; use `sandbox run {shorten(name)}` or `sandbox "
                f"play {shorten(name)}`",
                ctx,
            )
        raise click.UsageError(f"unknown command {short_repr(name)}; commands: {', '.join(COMMANDS)}", ctx)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list["CompletionItem"]:
        """Return the commands that begin with the incomplete word, without importing them."""
        from click.shell_completion import CompletionItem

        found = click.Command.shell_complete(self, ctx, incomplete)
        names = (name for name in COMMANDS if name.startswith(incomplete))
        return [CompletionItem(name, help=COMMANDS[name][1]) for name in names] + found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


def _is_scene(text: str) -> bool:
    # Needed only for an unknown command
    from sandbox.scene.files.shipped_scenes import UnknownSceneError, find

    try:
        find(text)
    except UnknownSceneError:
        return False
    return True


def _show_version(context: click.Context, _: click.Parameter, is_given: bool) -> None:
    """Print the version with the digest of the sources, and those of the libraries that numbers depend on."""
    if not is_given or context.resilient_parsing:
        return
    from sandbox.provenance import versions

    own, *others = sorted(versions().items(), key=lambda each: each[0] != "sandbox")
    click.echo(f"sandbox, version {own[1]}\n{', '.join(f'{name} {version}' for name, version in others)}")
    context.exit()


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the versions of the sandbox and of its libraries.",
)
def cli() -> None:
    """2D game physics sandbox: run one scene file on several physics engines, and measure error and cost."""


def _hash_as_rehearsed() -> None:
    """Start `sandbox record` anew with fixed hashes of strings, if they are random.

    A set of strings is then in the same order in each later run of the game.
    """
    if sys.argv[1:2] == ["record"] and sys.flags.hash_randomization and "PYTHONHASHSEED" not in os.environ:
        if sys.platform == "win32":  # where a program that replaces another one leaves its console
            return
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], {**os.environ, "PYTHONHASHSEED": "0"})


def main(arguments: list[str] | None = None) -> None:
    """Run the command line, and exit.

    Exit status: 0 done; 1 done, with a negative answer or a failed run; 2 wrong input; 130 interrupted.
    """
    if arguments is None:
        _hash_as_rehearsed()
    prepare_streams()
    status = call(arguments)
    gc.freeze()  # prevents a useless garbage collection at exit
    sys.exit(status)


def call(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status. Errors in the input are one line each, never a traceback.

    Resource limits refuse work that does not fit into memory; if memory runs out nevertheless, the status is 1.
    """
    fault = _undecodable(sys.argv[1:] if arguments is None else arguments)
    if fault:
        click.echo(f"sandbox: {fault}", err=True)
        return 2
    try:
        resource_limits.check_environment()
        if COMPLETION in os.environ:
            importlib.import_module("sandbox.cli.completion").register_shells()
        status: Any = cli.main(arguments, prog_name="sandbox", standalone_mode=False)
        sys.stdout.flush()  # write errors are raised here, not at the exit of the interpreter
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(GREETING if error.ctx.command is cli else error.format_message(), err=True)
        return 2
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        where = context.command_path if context is not None else "sandbox"
        click.echo(f"{where}: {_bounded(error.format_message())}", err=True)
        return 2
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        return 130
    except OutputError as error:
        click.echo(f"standard output: cannot be written: {error}", err=True)
        return 1
    except resource_limits.LimitValueError as error:
        click.echo(f"sandbox: {error}", err=True)
        return 2
    except MemoryError:
        click.echo(
            "sandbox: out of memory; use fewer bodies, fewer frames (solver.record_every) or fewer workers", err=True
        )
        return 1
    except (BrokenPipeError, SystemExit):
        # The reader has closed the pipe, as `| head` does; click and rich then exit. Nothing may be left to flush.
        sys.stdout = None
        return 0
    return status if isinstance(status, int) else 0


def _undecodable(arguments: Sequence[str]) -> str:
    """Return the fault of the first argument that is not text; "" if all are."""
    for position, argument in enumerate(arguments, 1):
        try:
            argument.encode()
        except UnicodeEncodeError:
            return f"argument {position}, {short_repr(argument)}, is not UTF-8 text"
        if "\0" in argument:
            return f"argument {position}, {short_repr(argument)}, contains a NUL character"
    return ""


def _bounded(message: str) -> str:
    """Return a message of click, which may quote the command line, as one line of bounded length."""
    return shorten(printable(re.sub(r"\S{81,}", lambda word: shorten(word[0]), message)), MAX_MESSAGE)
