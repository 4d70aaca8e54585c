"""`sandbox play`: the window."""

from pathlib import Path
from typing import Any

import click

from sandbox.cli.naming import with_other_engine
from sandbox.cli.reading import gathering, path_of, refused
from sandbox.cli.showing import run_window, window_options
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import USUAL, UnknownEngineError, able, engine_named, usual
from sandbox.games.registry import fitting_rules
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import load


@click.command(name="play")
@click.argument("scene", required=False)
@click.option("--engine", metavar="NAME", help="engine to start with; default: exact for billiards, otherwise pymunk")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@window_options
def command(scene: str | None, engine: str | None, overrides: tuple[str, ...], **window: Any) -> int:
    """Play a scene in a window.

    SCENE is a file or the name of a shipped scene. Without it, the window opens with a list of scenes.
    """
    faults: list[Fault] = []
    with gathering(faults, "--engine", (UnknownEngineError,)):
        engine_named(engine or USUAL)
    path: Path | None = None
    with gathering(faults):
        if scene is not None:
            path = Path(path_of(scene))
            found = load(path, overrides)
            fitting_rules(found, str(path))
            first = engine or usual(found)
            missing = engine_named(first).missing(found, found.solver) if not faults else ()
            if missing:
                click.echo(
                    f"{scene}: {Refusal(first, missing, able(found))}{with_other_engine(found, engine is not None)}",
                    err=True,
                )
                return 1
        elif overrides:
            raise SceneError([Fault("--set", None, "", "needs a SCENE to change; name one")])
    if faults:
        return refused(faults)

    from sandbox.window.app_state import AppState

    app_state = AppState(engine, overrides)
    return run_window(app_state, lambda: path is None or app_state.open(path), **window, pick=path is None)
