"""`sandbox …`: the commands, each loaded only when it is called."""

import difflib
import gc
import importlib
import os
import sys
from typing import Any

import click

os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# Else pydantic searches every installed package for plugins, 20 ms of each command.

COMMANDS = {
    "run": "run scenes headless and print the results",
    "play": "the window: play a scene, or pick one",
    "compare": "one scene on several engines, against the best known truth",
    "tradeoff": "error against cost over engines and settings, and the setting to take",
    "shots": "success odds, sensitivity and predictability horizon of a billiard shot",
    "extremes": "how far each engine and setting goes before it breaks",
    "report": "one page over many scenes: errors, costs, replays",
    "check": "check scenes: faults, the physics they need, the engines that can run them, what would go wrong",
    "scenes": "list the scenes that ship",
    "engines": "list the engines",
    "schema": "print the JSON Schema of a scene file",
    "export": "a stored run as csv, parquet, gif, mp4 or png",
    "replay": "a stored run or a recorded session in the window",
    "miss": "by how much a shot misses, by engine, integrator and step",
    "match": "frames of billiards between bots, and the score",
}
"""Each command's line of help stands here, so that help needs to import none of them."""


class Commands(click.Group):
    """A group whose commands live in modules of their names."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002, click's signature
        """Return the commands in the order of use."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Import a command."""
        if cmd_name not in COMMANDS:
            return None
        collecting = gc.isenabled()
        gc.disable()  # imports make many objects and no garbage: looking for some takes a fifth of the time
        try:
            command: click.Command = importlib.import_module(f"sandbox.cli.{cmd_name}").command
        finally:
            if collecting:
                gc.enable()
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command of the first argument; of one that is none, say which was likely meant.

        Raises:
            click.UsageError: there is no such command.
        """
        name = args[0]
        if name in COMMANDS or name.startswith("-"):
            return super().resolve_command(ctx, args)
        close = difflib.get_close_matches(name, COMMANDS, n=1)
        if close:
            raise click.UsageError(f"no command {name!r}; did you mean {close[0]!r}?", ctx)
        if _is_scene(name):
            raise click.UsageError(f"{name!r} is a scene; `sandbox run {name}` or `sandbox play {name}`", ctx)
        raise click.UsageError(f"no command {name!r}; commands: {', '.join(COMMANDS)}", ctx)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


def _is_scene(text: str) -> bool:
    from sandbox.scene.shipped import UnknownSceneError, find  # only what is no command needs it

    try:
        find(text)
    except UnknownSceneError:
        return False
    return True


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="sandbox2d", prog_name="sandbox")
def cli() -> None:
    """A 2D game physics sandbox: a scene is a file, the engine a choice, and every price is measured."""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line, and exit.

    Status: 0 done; 1 done, and something failed the question asked; 2 wrong input; 130 interrupted.
    """
    status = call(arguments)
    gc.freeze()  # nor is there garbage worth finding at exit
    sys.exit(status)


def call(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status. A fault of the user's is one line, never a traceback."""
    try:
        status: Any = cli.main(arguments, prog_name="sandbox", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return 2
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        where = context.command_path if context is not None else "sandbox"
        click.echo(f"{where}: {error.format_message()}", err=True)
        return 2
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        return 130
    except (BrokenPipeError, SystemExit):
        # The reader has gone, as `| head` does, and click and rich answer by an exit; leave nothing to flush.
        sys.stdout = None
        return 0
    return status if isinstance(status, int) else 0
