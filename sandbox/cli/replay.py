"""`sandbox replay`: a stored run, or a recorded session, in the window."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sandbox.cli.reading import gathering
from sandbox.cli.showing import show_stage, window_options
from sandbox.cli.stored import find_run, read_run
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import UnknownEngineError, engine_named
from sandbox.recording import Recording
from sandbox.scene.faults import Fault, SceneError
from sandbox.trajectory import Trajectory

if TYPE_CHECKING:
    from sandbox.play.running.live import Live
    from sandbox.play.running.stored import Stored


@click.command(name="replay")
@click.argument("run")
@click.option("--engine", metavar="NAME", help="compute it again on this engine; a stored run is then its ghost")
@window_options
def command(
    run: str,
    engine: str | None,
    size: tuple[int, int] | None,
    paused: bool,
    film: str,
    overlays: tuple[str, ...],
    ghost: bool,
    record: Path | None,
) -> int:
    """Look at a stored run or a recorded session. RUN is DIR/<id>, a folder of one run, or a recording."""
    faults: list[Fault] = []
    if engine is not None:
        with gathering(faults, "--engine", (UnknownEngineError,)):
            engine_named(engine)
    source: Trajectory | Recording | None = None
    with gathering(faults):
        source = read_run(find_run(run), run)
    show: Live | Stored | None = None
    if source is not None and not faults:
        if isinstance(source, Trajectory) and not len(source.time):
            click.echo(f"{run}: {source.status}: {source.reason}; there is nothing to show", err=True)
            return 1
        try:
            with gathering(faults, run, (UnknownEngineError,)):
                show = _computed(source, engine) if engine or isinstance(source, Recording) else _stored(source)
        except Refusal as refusal:
            click.echo(f"{run}: {refusal}", err=True)
            return 1
    if show is None:
        for fault in faults:
            click.echo(str(fault), err=True)
        return 2

    from sandbox.play.stage import Stage

    stage, put_on = Stage(show.engine), show
    return show_stage(
        stage,
        lambda: stage.put_on(put_on, None, put_on.scene),
        size=size,
        paused=paused,
        film=film,
        overlays=overlays,
        ghost=ghost,
        record=record,
    )


def _stored(run: Trajectory) -> "Stored":
    """Return a stored run to be looked at.

    Raises:
        SceneError: it is damaged.
    """
    from pydantic import ValidationError

    from sandbox.play.footage.film import Film
    from sandbox.play.running.stored import Stored

    try:
        return Stored(Film(run))
    except ValidationError as error:
        raise SceneError([Fault("<run>", None, "settings", f"they are none: {error.errors()[0]['msg']}")]) from None


def _computed(source: Trajectory | Recording, engine: str | None) -> "Live":
    """Return a session that does again what was done; a stored run is seen beside it.

    Raises:
        SceneError: what is stored is damaged.
        UnknownEngineError: the session is of an engine that is not here.
        Refusal: the engine cannot run it.
    """
    import json

    from sandbox.action import ActionError, actions_from_json
    from sandbox.play.footage.film import Film
    from sandbox.play.running.live import Live
    from sandbox.play.running.session import Session

    if isinstance(source, Recording):
        session = source if engine is None else source.on(engine)
        played = Session(session.scene, session.engine, session.settings, session.actions)
        return Live(played, until=source.duration)
    film = Film(source)
    try:
        actions = actions_from_json(json.dumps(source.info.get("actions", [])))
    except ActionError as error:
        raise SceneError([Fault("<run>", None, "actions", line) for line in str(error).splitlines()]) from None
    name = engine or str(source.info["engine"])
    return Live(Session(film.scene, name, actions=actions), film, until=film.duration)
