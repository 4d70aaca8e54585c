"""Replaying: a recorded session run again without a window, on its own engine or another."""

from pathlib import Path

from pydantic import ValidationError

from sandbox.action import Switch
from sandbox.engines.registry import UnknownEngineError, engine_named
from sandbox.games.players import RECORDED
from sandbox.games.registry import rules_of
from sandbox.games.session import HeadlessGame
from sandbox.measure.run import Progress, run
from sandbox.recording import Recording
from sandbox.scene.errors import Fault, SceneError
from sandbox.trajectory import Trajectory


def read_session(path: str | Path) -> Recording:
    """Read a session whose engines and settings exist, those of its `switch` actions too.

    Raises:
        SceneError: the file cannot be read or is no session; or with every engine and setting that does not exist.
    """
    session = Recording.load(path)
    faults = []

    def check_engine(name: str, key: str) -> None:
        try:
            engine_named(name)
        except UnknownEngineError as error:
            faults.append(Fault(str(path), None, key, str(error)))

    check_engine(session.engine, "engine")
    for k, action in enumerate(session.actions):
        if not isinstance(action, Switch):
            continue
        if action.engine is not None:
            check_engine(action.engine, f"actions[{k}].engine")
        try:
            session.settings.replace(**action.settings)
        except ValidationError as error:
            for each in error.errors():
                key = ".".join(("settings", *map(str, each["loc"])))
                faults.append(Fault(str(path), None, f"actions[{k}].{key}", each["msg"]))
    if faults:
        raise SceneError(faults)
    return session


def rerun(
    recording: Recording, engine: str | None = None, *, audit: bool = True, progress: Progress | None = None
) -> Trajectory:
    """Run a session again.

    With its own engine and the same versions it ends in the same state, bit for bit: `info["state_hash"]` is the
    recording's. Another engine computes the whole session, also where the session changed engines.

    Of a game the rules look on: `info["game"]` says their score, and `otherwise` since when, s, they would have done
    something else than was recorded. On the same engine that is never.

    Args:
        recording: the session.
        engine: another engine's name; without, the session's own.
        audit: count the contacts that the engine misses.
        progress: who is told how far it is.

    Raises:
        UnknownEngineError: no engine has that name.
        TooLargeError: the frames would not fit into memory.
        UnfitError: the scene lacks what the game that it names needs.
    """
    chosen = recording if engine is None else recording.on(engine)
    rules = rules_of(chosen.scene, on_request=bool(chosen.presses))
    return run(
        chosen.whole_scene,
        chosen.engine,
        actions=chosen.actions,
        audit=audit,
        progress=progress,
        bout=None if rules is None else HeadlessGame(rules, None, RECORDED, chosen.presses),
        **chosen.settings.model_dump(),
    )
