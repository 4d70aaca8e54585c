"""Showing: what the commands with a window have in common."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from sandbox.cli.output import reasons_against
from sandbox.cli.reading import refused
from sandbox.cli.streams import OutputError
from sandbox.echo import MAX_NAMED, short_repr, shorten
from sandbox.scene.errors import Fault
from sandbox.window.playback.snapshot import OVERLAYS

if TYPE_CHECKING:
    from sandbox.window.app_state import AppState

Command = TypeVar("Command", bound=Callable[..., Any])
LARGEST = 16384
"""px"""


class SizeType(click.ParamType):  # type: ignore[type-arg]  # generic in newer versions of click alone
    """`WIDTHxHEIGHT`, px."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Read a size."""
        width, _, height = str(value).lower().partition("x")
        digits = len(str(LARGEST))  # of more, int() may refuse to read them
        if not all(n.isdecimal() and len(n) <= digits and 1 <= int(n) <= LARGEST for n in (width, height)):
            self.fail(
                f"{short_repr(value)} is not a size in pixels, such as 1280x800 (1 to {LARGEST:,} each)", param, ctx
            )
        return int(width), int(height)


def window_options(command: Command) -> Command:
    """Add the options of every window."""
    options = (
        click.option("--size", type=SizeType(), metavar="WxH", help="size of the window in pixels"),
        click.option("--paused", is_flag=True, help="start paused"),
        click.option(
            "--film",
            type=click.Choice(["gif", "mp4"]),
            default="gif",
            help="format of films recorded with Ctrl+R; default: gif",
        ),
        click.option(
            "--overlay",
            "overlays",
            multiple=True,
            type=click.Choice(OVERLAYS),
            metavar="NAME",
            help=f"overlay to switch on at the start; may be repeated: {', '.join(OVERLAYS)}",
        ),
        click.option("--ghost", is_flag=True, help="start with the ghost of the reference solution on"),
        click.option(
            "--record",
            type=click.Path(path_type=Path, dir_okay=False),
            metavar="FILE",
            help="save the session as JSON when the window closes",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def run_window(
    app_state: "AppState",
    begin: Callable[[], object],
    *,
    size: tuple[int, int] | None,
    paused: bool,
    film: str,
    overlays: tuple[str, ...],
    ghost: bool,
    record: Path | None,
    pick: bool = False,
) -> int:
    """Open the window, play, and return the exit status.

    Args:
        app_state: what is played.
        begin: called once the window is open; what it puts on is seen first.
        size: px.
        paused: begin so.
        film: `gif` or `mp4`.
        overlays: to begin with.
        ghost: begin with it.
        record: where the session is saved at the end.
        pick: begin with the picker.
    """
    from sandbox.window.app import App
    from sandbox.window.display import NoDisplayError

    reasons = [] if record is None else reasons_against(record)
    if reasons:
        return refused([Fault("--record", None, "", f"{shorten(str(record), MAX_NAMED)}: {reasons[0]}")])
    app_state.paused, app_state.saves_at_end = paused, record is not None
    failures: list[OutputError] = []

    def say(message: str) -> None:
        try:
            click.echo(message)
        except OutputError as error:  # no reason to close the window: it is reported at the end
            failures.append(error)

    try:
        window = App(app_state, size=size, film=f".{film}", say=say)
    except NoDisplayError as error:
        click.echo(f"{error}; `sandbox run` and `sandbox export` work without a display", err=True)
        return 1
    try:
        begin()
        window.context.gui.overlays |= set(overlays)
        if ghost:
            app_state.toggle_ghost()
        if pick:
            window.context.gui.open_scene_browser(None)
        status = window.run()
        if record is not None and not _saved(app_state, record):
            status = status or 1
        if failures:
            raise failures[0]
        return status
    finally:
        window.close()


def _saved(app_state: "AppState", record: Path) -> bool:
    """Save the session that is on, and say so; return whether that could be done."""
    if app_state.live is None:
        click.echo(f"--record: {record}: there is no session to save", err=True)
        return False
    try:
        app_state.live.finish_seek()
        app_state.live.session.recording().save(record)
    except OSError as error:
        click.echo(f"--record: {record}: {error.strerror or error}", err=True)
        return False
    click.echo(f"session: {record}")
    return True
