"""Scene cases: one scene file loaded, run on every engine with actions, and what comes out checked.

An error of the interface, with a message of bounded length, is a proper answer. Everything else that is raised leaves
the case, and is a failure.
"""

import json
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from sandbox.action import Action, ActionError, actions_from_json, in_order
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import ENGINES, UnknownEngineError, able
from sandbox.engines.switching import SwitchableSimulation
from sandbox.games.contract import UnsuitableSceneError
from sandbox.games.registry import rules_of
from sandbox.games.session import GameSession
from sandbox.measure.compare import compare
from sandbox.measure.metrics.energy import ledger_of
from sandbox.measure.preflight import FAILED, largest_safe_dt, notes, run_preflight
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import play_out, rerun
from sandbox.recording import Recording
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.demands import bill
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, loads
from sandbox.trajectory import Frame, Trajectory
from sandbox.window.playback.session import Session
from tools.fuzzing.isolated import Violation, begin_stage, extend_cpu_limit

MAX_MESSAGE = 4000  # characters of one fault or error
BUDGET = 0.5  # s of CPU time after which the steps of one run are ended
COMPILE_TIME = 30  # s of CPU time that compiling one kernel may take beside
COMPILE_CLOCK.on_begin = lambda _: extend_cpu_limit(COMPILE_TIME)
EXPECTED = (
    SceneError, ValidationError, ActionError, Refusal, Divergence, Exhaustion, TooLargeError, UnknownEngineError,
    UnsuitableSceneError,
)  # fmt: skip
"""The errors of the interface."""


class _BudgetSpent(Exception):  # noqa: N818, ends a run that has been tried for long enough
    pass


MAX_BODIES = 20_000
"""Beyond, a scene is only loaded and run: a session starts an engine several times, of which each takes seconds."""


def run_scene(argument: Mapping[str, Any]) -> str | None:
    """Load a scene and run it as a case says (keys: see the package).

    Returns:
        The name of the error that refused the scene, None where it loaded.

    Raises:
        Violation: a check failed.
    """
    try:
        scene = loads(expanded(argument))
    except SceneError as error:
        _check_faults(error)
        return "SceneError"
    if loads(dumps(scene)) != scene:
        raise Violation("round trip", "the scene that was written and read is another")
    acts = read_actions(argument.get("actions", []))
    for each in argument.get("runs") or [{"engine": engine, "steps": 10} for engine in ENGINES]:
        begin_stage()
        (run_publicly if each.get("public") else run_stepwise)(scene, acts, each)
    for extra in argument.get("also", []) if len(scene.bodies) <= MAX_BODIES else []:
        begin_stage()
        EXTRAS[extra](scene, acts)
    return None


def expanded(argument: Mapping[str, Any]) -> str:
    """Return the text of a case: `text` is a text, or its parts, of which part k is repeated `times[k]` times."""
    text = argument["text"]
    if isinstance(text, str):
        return text
    times = argument.get("times", {})
    return "".join(part * times.get(str(k), 1) for k, part in enumerate(text))


def read_actions(values: list[Any]) -> tuple[Action, ...]:
    """Return the actions that are valid, in order; of the others only the errors are checked."""
    found: list[Action] = []
    for value in values:
        try:
            found += actions_from_json(json.dumps([value]))
        except ActionError as error:
            check_error(error)
    return in_order(tuple(found))


def check_error(error: Exception) -> None:
    """Check that an error has a message, not too long.

    Raises:
        Violation: it has not.
    """
    text = str(error)
    kind = type(error).__name__
    if not text.strip():
        raise Violation("empty message", kind) from error
    if max(map(len, text.splitlines())) > MAX_MESSAGE:
        raise Violation("long message", f"{kind} of {len(text)} characters: {text[:300]}") from error


def _check_faults(error: SceneError) -> None:
    check_error(error)
    for fault in error.faults:
        if not fault.message.strip() or not fault.file:
            raise Violation("empty message", f"fault at {fault.path!r}") from error


def _attempt(do: Callable[[], Any]) -> Any:
    """Return what a call returns, None where an error of the interface ends it."""
    try:
        return do()
    except _BudgetSpent:
        return None
    except EXPECTED as error:
        check_error(error)
        return None


# --- runs -----------------------------------------------------------------------------------------------------------


def run_publicly(scene: Scene, acts: tuple[Action, ...], how: Mapping[str, Any]) -> None:
    """Run a scene by `sandbox.run`, and check what it returns."""
    began = time.process_time()

    def watch(*_: Any) -> None:
        if time.process_time() - began > BUDGET:
            raise _BudgetSpent

    flags = {key: how[key] for key in ("audit", "account") if key in how}
    found = _attempt(lambda: run(scene, how["engine"], actions=acts, on_work=watch, **flags))
    if found is not None:
        check_run(found, scene)
        if flags.get("account") and found.info["status"] != "refused":
            _attempt(lambda: ledger_of(found, scene))


def check_run(found: Trajectory, scene: Scene) -> None:
    """Check that a run ended with a status and a reason, and in finite numbers unless it diverged.

    Raises:
        Violation: it did not.
    """
    status, reason = found.info["status"], found.info["reason"]
    if status not in ("ok", "diverged", "failed", "refused"):
        raise Violation("status", repr(status))
    if (status == "ok") != (reason is None):
        raise Violation("reason", f"{status}: {reason!r}")
    if reason is not None and not 0 < len(reason) <= MAX_MESSAGE:
        raise Violation("long message", reason[:300])
    json.dumps(found.info)
    if status == "ok":
        bodies = scene.bodies
        for name in ("position", "velocity", "angle", "angular_velocity"):
            values = getattr(found, name)[-1][: len(bodies)]
            if not np.isfinite(values).all():
                raise Violation("finite state", f"{name} of an ok run on {found.info['engine']}")


def run_stepwise(scene: Scene, acts: tuple[Action, ...], how: Mapping[str, Any]) -> None:
    """Step a scene on an engine, and try actions, of which those that cannot be done change nothing."""
    simulation = _attempt(lambda: SwitchableSimulation(scene, how["engine"]))
    if simulation is None:
        return
    try:
        _attempt(lambda: step_through(simulation, acts, how))
        simulation.state_hash()
        simulation.bodies.names  # noqa: B018, may be laid out at first use
    finally:
        simulation.close()


def step_through(simulation: SwitchableSimulation, acts: tuple[Action, ...], how: Mapping[str, Any]) -> None:
    """Make the steps of a run, with its actions, and read all that can be read of it.

    Raises:
        Divergence, Exhaustion: the physics cannot go on.
        Violation: a state is not finite.
    """
    began, due = time.process_time(), list(acts)
    simulation.contacts()
    if how.get("account"):
        simulation.account()
    if how.get("audit"):
        simulation.watch(lambda *_: None)
    for step in range(how.get("steps", 10)):
        while due and due[0].time <= simulation.time + 1e-12:
            _act(simulation, due.pop(0))
        simulation.step()
        if step % 5 == 0:
            _check_frame(simulation.frame(), simulation.bodies)
            simulation.contacts()
        if time.process_time() - began > BUDGET:
            return
    for action in due[:2]:  # those of later times, at the end
        _act(simulation, action)
    simulation.finish(0.5)
    _check_frame(simulation.frame(), simulation.bodies)
    simulation.contacts()
    if how.get("account"):
        simulation.account()


def _act(simulation: SwitchableSimulation, action: Action) -> None:
    before = simulation.state_hash()
    try:
        simulation.apply(action)
    except ActionError as error:
        check_error(error)
        if simulation.state_hash() != before:
            raise Violation("refused action", f"{action.kind} has changed the state") from error


def _check_frame(frame: Frame, bodies: Bodies) -> None:
    if len(frame.position) != len(bodies):
        raise Violation("frame", f"{len(frame.position)} positions of {len(bodies)} bodies")
    for name in ("position", "velocity", "angle", "angular_velocity"):
        if not np.isfinite(getattr(frame, name)).all():
            raise Violation("finite state", name)


# --- the rest of the interface --------------------------------------------------------------------------------------


def _engine_for(scene: Scene) -> str | None:
    return next(iter(able(scene)), None)


def _is_small(scene: Scene) -> bool:
    return len(scene.bodies) <= 500 and scene.world.duration / scene.solver.dt * scene.solver.substeps <= 2000


def _check(scene: Scene, _: tuple[Action, ...]) -> None:
    """Do what `sandbox check` does; a forecast that fails inside is a failure too."""
    bill(scene)
    largest_safe_dt(scene)
    notes(scene)
    answer = run_preflight(scene, cover=1.0 if _is_small(scene) else 0.0)
    for warning in answer.warnings:
        if warning.kind == FAILED:
            raise Violation("failed forecast", f"{warning.details['forecast']}: {warning.message[:2000]}")
        if not 0 < len(warning.message) <= MAX_MESSAGE:
            raise Violation("long message", warning.message[:300])
    _attempt(lambda: rules_of(scene))


def _compare(scene: Scene, _: tuple[Action, ...]) -> None:
    steps = scene.world.duration / scene.solver.h
    if len(scene.bodies) <= 30 and steps <= 300:  # it makes dozens of runs, for the truth of which dt is divided
        _attempt(lambda: compare(scene))


def _record(scene: Scene, acts: tuple[Action, ...]) -> None:
    """Play, record, write, read and replay; it ends in the same state."""
    session = _played(scene, acts, 12)
    if session is None or session.ended is not None:
        return
    recording = session.recording()
    text = recording.to_json()
    back = Recording.from_json(text)
    if back != recording:
        raise Violation("recording", "what was written and read is another")
    if recording.duration == 0.0:
        return
    found = rerun(back, audit=False)
    if found.info["state_hash"] != recording.state_hash and found.info["status"] != "failed":
        raise Violation("replay", f"another state on {recording.engine}; status {found.info['status']}")


def _play(scene: Scene, acts: tuple[Action, ...]) -> None:
    """Play a session on each engine that can."""
    for engine in able(scene):
        _played(scene, acts, 6, engine)


def _played(scene: Scene, acts: tuple[Action, ...], steps: int, engine: str | None = None) -> Session | None:
    """Return a session after some steps, with actions and presses of its game."""
    engine = engine or _engine_for(scene)
    if engine is None:
        return None
    begin_stage()
    return _attempt(lambda: _session(scene, acts, steps, engine))  # type: ignore[no-any-return]


def _session(scene: Scene, acts: tuple[Action, ...], steps: int, engine: str) -> Session:
    rules = rules_of(scene)
    session = Session(scene, engine, game=None if rules is None else GameSession(rules))
    session.simulation.patience = 2.0
    due, began = list(acts), time.process_time()
    controls = () if rules is None else rules.controls
    for step in range(steps):
        if due and session.ended is None:
            try:
                session.apply(due.pop(0))
            except ActionError as error:
                check_error(error)
        if session.game is not None and controls and session.ended is None:
            _attempt(partial(session.press, controls[step % len(controls)].name, float(step % 3 != 0)))
        if session.ended is not None or session.advance() == 0 or time.process_time() - began > BUDGET:
            break
    return session


def _rewind(scene: Scene, acts: tuple[Action, ...]) -> None:
    """Go back in a session, forth again, and take an action back."""
    session = _played(scene, acts, 10)
    if session is None or session.ended is not None:
        return
    last, state = session.step_number, session.frame.state_hash()
    for step in (last // 2, 0, last):
        for _ in session.seek(step):
            pass
    if session.frame.state_hash() != state:
        raise Violation("rewind", f"another state after step {last}")
    if session.actions:
        step = session.retract(len(session.actions) - 1)
        for _ in session.seek(step):
            pass
    Recording.from_json(session.recording().to_json())


def _resume(scene: Scene, acts: tuple[Action, ...]) -> None:
    """Go on from a checkpoint on each engine, whichever it was made on."""
    engine = _engine_for(scene)
    simulation = None if engine is None else _attempt(lambda: SwitchableSimulation(scene, engine))
    if simulation is None:
        return
    try:
        _attempt(lambda: step_through(simulation, acts, {"steps": 4}))
    finally:
        simulation.close()
    point = simulation.checkpoint()
    for each in ENGINES:
        again = _attempt(partial(SwitchableSimulation.resumed, replace(point, engine=each)))
        if again is not None:
            _attempt(again.step)
            again.close()


def _store(scene: Scene, acts: tuple[Action, ...]) -> None:
    """Run on each engine, write the run to a file and read it; refused and failed runs too."""
    if not _is_small(scene):
        return
    for engine in ENGINES:
        found = _attempt(partial(run, scene, engine, actions=acts, audit=False))
        if found is None:
            continue
        with tempfile.TemporaryDirectory() as folder:
            file = found.save(Path(folder) / "run.npz")
            try:
                back = Trajectory.load(file)
            except ValueError as error:
                raise Violation("stored run", f"{found.status} on {engine}: {error}") from error
        if json.dumps(back.info) != json.dumps(found.info) or not np.array_equal(back.time, found.time):
            raise Violation("stored run", f"what was written and read is another, on {engine}")


def _play_game(scene: Scene, _: tuple[Action, ...]) -> None:
    """Let a random player play the game of a scene that has one."""
    if _is_small(scene) and scene.play.game is not None:
        engine = _engine_for(scene)
        if engine is not None:
            _attempt(partial(play_out, scene, "random", engine))


EXTRAS: dict[str, Callable[[Scene, tuple[Action, ...]], None]] = {
    "check": _check,
    "compare": _compare,
    "session": _play,
    "recording": _record,
    "resume": _resume,
    "rewind": _rewind,
    "store": _store,
    "game": _play_game,
}
"""What is done beside running."""
