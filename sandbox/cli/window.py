"""Commands `play` and `replay`, and the options of the window."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sandbox.batch.find_run import find_run, read_run
from sandbox.cli.common import collect_errors, engine_advice, exit_with_errors, reasons_not_writable, scene_path
from sandbox.cli.options import CommandFunction, FiniteRange, set_option
from sandbox.cli.recordings import report_remarks
from sandbox.cli.streams import OutputError
from sandbox.echo import MAX_NAMED, short_repr, shorten
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import USUAL, UnknownEngineError, able, engine_named, usual
from sandbox.games.contract import UnsuitableSceneError
from sandbox.games.registry import has_rules, rules_in_window, rules_of
from sandbox.recording import Recording
from sandbox.recording_remarks import remarks_on
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.play import MAX_PLAYBACK_SPEED, MIN_PLAYBACK_SPEED
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import load
from sandbox.trajectory import Trajectory
from sandbox.window.playback.snapshot import OVERLAYS

if TYPE_CHECKING:
    from sandbox.window.app_state import AppState
    from sandbox.window.playback.live import LiveView
    from sandbox.window.playback.recorded import RecordedView


MAX_SIZE = 16384
"""px, the largest texture of common graphics hardware"""


class SizeType(click.ParamType):  # type: ignore[type-arg]  # generic in newer versions of click alone
    """`WIDTHxHEIGHT`, px."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        """Return width and height."""
        width, _, height = str(value).lower().partition("x")
        digits = len(str(MAX_SIZE))  # int() rejects very long texts
        if not all(n.isdecimal() and len(n) <= digits and 1 <= int(n) <= MAX_SIZE for n in (width, height)):
            self.fail(
                f"{short_repr(value)} is not a size in pixels, such as 1280x800 (1 to {MAX_SIZE:,} each)", param, ctx
            )
        return int(width), int(height)


def window_options(command: CommandFunction) -> CommandFunction:
    """Add the options of commands that open the window."""
    options = (
        click.option("--size", type=SizeType(), metavar="WxH", help="size of the window in pixels"),
        click.option("--paused", is_flag=True, help="start paused"),
        click.option(
            "--speed",
            type=FiniteRange(MIN_PLAYBACK_SPEED, MAX_PLAYBACK_SPEED),
            metavar="X",
            help="playback speed at the start, as a multiple of real time; default: that of the scene, else 1, or less "
            "so that it lasts at least 3 s",
        ),
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


@dataclass(frozen=True)
class WindowOptions:
    """The options of `window_options`; None for an option that was left out."""

    size: tuple[int, int] | None
    """px"""
    paused: bool
    speed: float | None
    film: str
    overlays: tuple[str, ...]
    ghost: bool
    record: Path | None


def run_window(
    app_state: "AppState",
    begin: Callable[[], object],
    options: WindowOptions,
    has_scene_list: bool = False,
    edits: bool = False,
) -> int:
    """Open the window, run it until it is closed, and return the exit status.

    Args:
        app_state: state of the window.
        begin: called after the window has opened, to open the first scene.
        options: the options of the window.
        has_scene_list: start with the list of scenes.
        edits: start with the editor.
    """
    from sandbox.window.app import App
    from sandbox.window.display import NoDisplayError

    record = options.record
    reasons = [] if record is None else reasons_not_writable(record)
    if reasons:
        return exit_with_errors([Fault.of("--record", f"{shorten(str(record), MAX_NAMED)}: {reasons[0]}")])
    app_state.paused, app_state.saves_at_end = options.paused, record is not None
    failures: list[OutputError] = []

    def print_message(message: str) -> None:
        try:
            click.echo(message)
        except OutputError as error:  # reported at the end; the window stays open
            failures.append(error)

    try:
        window = App(app_state, size=options.size, film=f".{options.film}", say=print_message)
    except NoDisplayError as error:
        click.echo(f"{error}; `sandbox run` and `sandbox export` work without a display", err=True)
        return 1
    try:
        begin()
        window.context.gui.overlays |= set(options.overlays)
        if options.ghost:
            app_state.toggle_ghost()
        if edits:
            window.start_editing()
        if has_scene_list:
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
    """Save the current session; return whether it was saved."""
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


@click.command(name="play")
@click.argument("scene", required=False)
@click.option("--engine", metavar="NAME", help="engine to start with; default: exact for billiards, otherwise pymunk")
@set_option()
@click.option("--edit", "edits", is_flag=True, help="start with the editor; without SCENE, with a new scene")
@window_options
def play_command(scene: str | None, engine: str | None, overrides: tuple[str, ...], edits: bool, **window: Any) -> int:
    """Play a scene in a window.

    SCENE is a file or the name of a shipped scene. Without it, the window opens with a list of scenes.
    """
    faults: list[Fault] = []
    with collect_errors(faults, "--engine", (UnknownEngineError,)):
        engine_named(engine or USUAL)
    path: Path | None = None
    with collect_errors(faults):
        if scene is not None:
            path = Path(scene_path(scene))
            found = load(path, overrides)
            rules_of(found, str(path))
            first = engine or usual(found)
            missing = engine_named(first).missing(found, found.solver) if not faults else ()
            if missing:
                click.echo(
                    f"{scene}: {Refusal(first, missing, able(found))}{engine_advice(found, engine is not None)}",
                    err=True,
                )
                return 1
        elif overrides:
            raise SceneError([Fault.of("--set", "needs a SCENE to change; name one")])
    if faults:
        return exit_with_errors(faults)

    from sandbox.window.app_state import AppState

    options = WindowOptions(**window)
    app_state = AppState(engine, overrides, options.speed)
    has_list = path is None and not edits
    return run_window(app_state, lambda: path is None or app_state.open(path), options, has_list, edits)


@click.command(name="replay")
@click.argument("run")
@click.option(
    "--engine", metavar="NAME", help="compute the run again on this engine, and show the stored run as a ghost"
)
@window_options
def replay_command(run: str, engine: str | None, **window: Any) -> int:
    """Show a stored run or a recorded session in the window.

    RUN is DIR/ID, a folder that holds one run, a .npz file, or a session (.json).
    """
    faults: list[Fault] = []
    if engine is not None:
        with collect_errors(faults, "--engine", (UnknownEngineError,)):
            engine_named(engine)
    source: Trajectory | Recording | None = None
    with collect_errors(faults):
        source = read_run(find_run(run), run)
    show: LiveView | RecordedView | None = None
    if source is not None and not faults:
        if isinstance(source, Trajectory) and not len(source.time):
            click.echo(f"{run}: {source.status}: {source.reason}; the run has no frames to show", err=True)
            return 1
        try:
            with collect_errors(faults, run, (UnknownEngineError,)):
                show = _shown(source, engine)
        except Refusal as refusal:
            click.echo(f"{run}: {refusal}", err=True)
            return 1
    if source is None or show is None:
        return exit_with_errors(faults)

    if isinstance(source, Recording):
        report_remarks(run, remarks_on(source))
    from sandbox.window.app_state import AppState

    options = WindowOptions(**window)
    app_state, first, known = AppState(show.engine, speed=options.speed), show, source
    return run_window(
        app_state,
        lambda: app_state.show(first, None, first.scene, again=lambda: _shown(known, engine)),
        options,
    )


def _shown(source: Trajectory | Recording, engine: str | None) -> "LiveView | RecordedView":
    return _computed(source, engine) if engine or isinstance(source, Recording) else _stored(source)


def _stored(run: Trajectory) -> "RecordedView":
    """Return the view of a stored run."""
    from sandbox.window.playback.recorded import RecordedRun, RecordedView

    return RecordedView(RecordedRun(run))


def _computed(source: Trajectory | Recording, engine: str | None) -> "LiveView":
    """Return the view of a session that is computed again, with a stored run as its ghost.

    Raises:
        UnknownEngineError: the engine of the session is not installed.
        Refusal: the engine cannot run it.
    """
    from sandbox.games.session import GameSession
    from sandbox.window.playback.live import LiveView
    from sandbox.window.playback.recorded import RecordedRun
    from sandbox.window.playback.session import Session

    film = None
    if isinstance(source, Recording):
        session = source if engine is None else source.on(engine)
    else:
        film = RecordedRun(source)
        session = _session_of(source, film.scene, film.duration)
        if engine is not None and engine != session.engine:
            session = session.on(engine)
        session = replace(session, settings=_fitting(session.settings, session.scene, session.engine))
    try:
        rules = rules_in_window(session.scene)
    except UnsuitableSceneError as error:
        if session.has_game or has_rules(session.scene):
            raise SceneError([Fault("<run>", None, "play.game", str(error))]) from None
        rules = None  # the window plays such a scene without rules, too
    game = None if rules is None else GameSession(rules, session.presses)
    return LiveView(Session.of_recording(session, game), film, until=session.duration)


def _session_of(run: Trajectory, scene: Scene, duration: float) -> Recording:
    """Return the session of a stored run: its scene, settings and actions."""
    import json

    from sandbox.action import actions_from_json
    from sandbox.recording import presses_from

    settings = Settings.model_validate(run.info["settings"])
    actions = actions_from_json(json.dumps(run.info.get("actions", [])))
    presses = presses_from((run.info.get("game") or {}).get("presses", []))
    return Recording(scene, run.info["engine"], settings, actions, duration, presses=presses)


def _fitting(settings: Settings, scene: Scene, engine: str) -> Settings:
    """Return the settings of a run that an engine accepts; others have the default of the engine.

    Even the engine of the run may reject a setting that it has resolved itself, such as a slop beside springs.
    """
    chosen, fitting = engine_named(engine), settings.common()
    for key in sorted(Settings.model_fields, key=lambda key: key != "response"):  # others require it, so it comes first
        candidate = fitting.replace(**{key: getattr(settings, key)})
        if not chosen.missing(scene, candidate):
            fitting = candidate
    return fitting
