"""`sandbox replay`: a stored run, or a recorded session, in the window."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from sandbox.cli.reading import gathering, refused
from sandbox.cli.showing import run_window, window_options
from sandbox.cli.stored import find_run, read_run
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import UnknownEngineError, engine_named
from sandbox.recording import Recording
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import Fault
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

if TYPE_CHECKING:
    from sandbox.window.playback.live import LiveView
    from sandbox.window.playback.recorded import RecordedView


@click.command(name="replay")
@click.argument("run")
@click.option(
    "--engine", metavar="NAME", help="compute the run again on this engine, and show the stored run as a ghost"
)
@window_options
def command(run: str, engine: str | None, **window: Any) -> int:
    """Show a stored run or a recorded session in the window.

    RUN is DIR/ID, a folder that holds one run, a .npz file, or a session (.json).
    """
    faults: list[Fault] = []
    if engine is not None:
        with gathering(faults, "--engine", (UnknownEngineError,)):
            engine_named(engine)
    source: Trajectory | Recording | None = None
    with gathering(faults):
        source = read_run(find_run(run), run)
    show: LiveView | RecordedView | None = None
    if source is not None and not faults:
        if isinstance(source, Trajectory) and not len(source.time):
            click.echo(f"{run}: {source.status}: {source.reason}; the run has no frames to show", err=True)
            return 1
        try:
            with gathering(faults, run, (UnknownEngineError,)):
                show = _shown(source, engine)
        except Refusal as refusal:
            click.echo(f"{run}: {refusal}", err=True)
            return 1
    if source is None or show is None:
        return refused(faults)

    from sandbox.window.app_state import AppState

    app_state, first, known = AppState(show.engine), show, source
    return run_window(
        app_state,
        lambda: app_state.show(first, None, first.scene, again=lambda: _shown(known, engine)),
        **window,
    )


def _shown(source: Trajectory | Recording, engine: str | None) -> "LiveView | RecordedView":
    return _computed(source, engine) if engine or isinstance(source, Recording) else _stored(source)


def _stored(run: Trajectory) -> "RecordedView":
    """Return a stored run to be looked at."""
    from sandbox.window.playback.recorded import RecordedRun, RecordedView

    return RecordedView(RecordedRun(run))


def _computed(source: Trajectory | Recording, engine: str | None) -> "LiveView":
    """Return a session that does again what was done; a stored run is seen beside it.

    Raises:
        UnknownEngineError: the session is of an engine that is not here.
        Refusal: the engine cannot run it.
    """
    from sandbox.games.registry import fitting_rules
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
    rules = fitting_rules(session.scene, "<run>")
    game = None if rules is None else GameSession(rules, session.presses)
    played = Session(session.scene, session.engine, session.settings, session.actions, game, session.duration)
    return LiveView(played, film, until=session.duration)


def _session_of(run: Trajectory, scene: Scene, duration: float) -> Recording:
    """Return what was done in a stored run."""
    import json

    from sandbox.action import actions_from_json
    from sandbox.recording import presses_from

    settings = Settings.model_validate(run.info["settings"])
    actions = actions_from_json(json.dumps(run.info.get("actions", [])))
    presses = presses_from((run.info.get("game") or {}).get("presses", []))
    return Recording(scene, run.info["engine"], settings, actions, duration, presses=presses)


def _fitting(settings: Settings, scene: Scene, engine: str) -> Settings:
    """Return the settings of a run as an engine takes them; what it does not know is left to it.

    The engine of the run, too, may refuse some of what it has filled in itself, such as a slop beside springs.
    """
    chosen, fitting = engine_named(engine), settings.common()
    for key in sorted(Settings.model_fields, key=lambda key: key != "response"):  # which some others go with
        tried = fitting.replace(**{key: getattr(settings, key)})
        if not chosen.missing(scene, tried):
            fitting = tried
    return fitting
