"""Scene cases: a scene file is loaded and run on every engine with actions, and the results are checked.

An error of the interface with a message of bounded length is a valid result. Any other exception leaves the case and is
a failure.
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
BUDGET = 0.5  # s of CPU time after which a run is stopped
COMPILE_TIME = 30  # s of additional CPU time for compiling one kernel
COMPILE_CLOCK.on_begin = lambda _: extend_cpu_limit(COMPILE_TIME)
EXPECTED = (
    SceneError, ValidationError, ActionError, Refusal, Divergence, Exhaustion, TooLargeError, UnknownEngineError,
    UnsuitableSceneError,
)  # fmt: skip
"""The errors of the interface."""


class _BudgetSpent(Exception):  # noqa: N818, stops a run after its budget
    pass


MAX_BODIES = 20_000
"""Larger scenes are only loaded and run: a session starts an engine several times, which takes seconds each time."""


def run_scene(argument: Mapping[str, Any]) -> str | None:
    """Load a scene and run it as described by the argument (keys: see the package).

    Returns:
        The name of the error that refused the scene, None if it loaded.

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
    actions = read_actions(argument.get("actions", []))
    for each in argument.get("runs") or [{"engine": engine, "steps": 10} for engine in ENGINES]:
        begin_stage()
        (run_publicly if each.get("public") else run_stepwise)(scene, actions, each)
    for extra in argument.get("also", []) if len(scene.bodies) <= MAX_BODIES else []:
        begin_stage()
        EXTRAS[extra](scene, actions)
    return None


def expanded(argument: Mapping[str, Any]) -> str:
    """Return the text of a case: `text` itself, or its joined parts, with part k repeated `times[k]` times."""
    text = argument["text"]
    if isinstance(text, str):
        return text
    times = argument.get("times", {})
    return "".join(part * times.get(str(k), 1) for k, part in enumerate(text))


def read_actions(values: list[Any]) -> tuple[Action, ...]:
    """Return the valid actions in order; of invalid ones only the errors are checked."""
    found: list[Action] = []
    for value in values:
        try:
            found += actions_from_json(json.dumps([value]))
        except ActionError as error:
            check_error(error)
    return in_order(tuple(found))


def check_error(error: Exception) -> None:
    """Check that an error has a message of limited length.

    Raises:
        Violation: the message is empty or too long.
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


def _attempt(call: Callable[[], Any]) -> Any:
    """Return the result of a call, None if an error of the interface ends it."""
    try:
        return call()
    except _BudgetSpent:
        return None
    except EXPECTED as error:
        check_error(error)
        return None


# --- runs -----------------------------------------------------------------------------------------------------------


def run_publicly(scene: Scene, actions: tuple[Action, ...], options: Mapping[str, Any]) -> None:
    """Run a scene with `sandbox.run` and check the result."""
    start_time = time.process_time()

    def watch(*_: Any) -> None:
        if time.process_time() - start_time > BUDGET:
            raise _BudgetSpent

    flags = {key: options[key] for key in ("audit", "account") if key in options}
    found = _attempt(lambda: run(scene, options["engine"], actions=actions, on_work=watch, **flags))
    if found is not None:
        check_run(found, scene)
        if flags.get("account") and found.info["status"] != "refused":
            _attempt(lambda: ledger_of(found, scene))


def check_run(found: Trajectory, scene: Scene) -> None:
    """Check that a run has a valid status and reason, and a finite final state if its status is ok.

    Raises:
        Violation: a check failed.
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


def run_stepwise(scene: Scene, actions: tuple[Action, ...], options: Mapping[str, Any]) -> None:
    """Step a scene on an engine and apply actions; check that refused actions change nothing."""
    simulation = _attempt(lambda: SwitchableSimulation(scene, options["engine"]))
    if simulation is None:
        return
    try:
        _attempt(lambda: step_through(simulation, actions, options))
        simulation.state_hash()
        simulation.bodies.names  # noqa: B018, computed at first use
    finally:
        simulation.close()


def step_through(simulation: SwitchableSimulation, actions: tuple[Action, ...], options: Mapping[str, Any]) -> None:
    """Make the steps of a run with its actions, and read frames, contacts and account.

    Raises:
        Divergence, Exhaustion: the simulation cannot continue.
        Violation: a state is not finite.
    """
    start_time, due = time.process_time(), list(actions)
    simulation.contacts()
    if options.get("account"):
        simulation.account()
    if options.get("audit"):
        simulation.watch(lambda *_: None)
    for step in range(options.get("steps", 10)):
        while due and due[0].time <= simulation.time + 1e-12:
            _apply(simulation, due.pop(0))
        simulation.step()
        if step % 5 == 0:
            _check_frame(simulation.frame(), simulation.bodies)
            simulation.contacts()
        if time.process_time() - start_time > BUDGET:
            return
    for action in due[:2]:  # actions of later times, at the end
        _apply(simulation, action)
    simulation.finish(0.5)
    _check_frame(simulation.frame(), simulation.bodies)
    simulation.contacts()
    if options.get("account"):
        simulation.account()


def _apply(simulation: SwitchableSimulation, action: Action) -> None:
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
    """Do the same as `sandbox check`; a forecast that fails internally is a failure too."""
    bill(scene)
    largest_safe_dt(scene)
    notes(scene)
    preflight = run_preflight(scene, cover=1.0 if _is_small(scene) else 0.0)
    for warning in preflight.warnings:
        if warning.kind == FAILED:
            raise Violation("failed forecast", f"{warning.details['forecast']}: {warning.message[:2000]}")
        if not 0 < len(warning.message) <= MAX_MESSAGE:
            raise Violation("long message", warning.message[:300])
    _attempt(lambda: rules_of(scene))


MAX_COMPARED_STEPS = 30
"""Compare makes dozens of runs; for the ground truth it halves dt up to 8 times: some 750 times as many steps, of
0.5 ms on the reference with swept detection, within the 20 s of processor time of a case."""


def _compare(scene: Scene, _: tuple[Action, ...]) -> None:
    """Compare the engines over the first steps of a small scene."""
    if len(scene.bodies) > 30 or scene.world.duration / scene.solver.h > 300:
        return
    duration = min(scene.world.duration, MAX_COMPARED_STEPS * scene.solver.h)
    world = scene.world.model_copy(update={"duration": duration})
    _attempt(lambda: compare(scene.model_copy(update={"world": world})))


def _record(scene: Scene, actions: tuple[Action, ...]) -> None:
    """Play, record, write, read and replay a session; check that the replay ends in the same state."""
    session = _played(scene, actions, 12)
    if session is None or session.ended is not None:
        return
    recording = session.recording()
    text = recording.to_json()
    loaded = Recording.from_json(text)
    if loaded != recording:
        raise Violation("recording", "what was written and read is another")
    if recording.duration == 0.0:
        return
    found = rerun(loaded, audit=False)
    if found.info["state_hash"] != recording.state_hash and found.info["status"] != "failed":
        raise Violation("replay", f"another state on {recording.engine}; status {found.info['status']}")


def _play(scene: Scene, actions: tuple[Action, ...]) -> None:
    """Play a session on each engine that models the scene."""
    for engine in able(scene):
        _played(scene, actions, 6, engine)


def _played(scene: Scene, actions: tuple[Action, ...], steps: int, engine: str | None = None) -> Session | None:
    """Return a session after a number of steps, with actions and inputs of its game."""
    engine = engine or _engine_for(scene)
    if engine is None:
        return None
    begin_stage()
    return _attempt(lambda: _session(scene, actions, steps, engine))  # type: ignore[no-any-return]


def _session(scene: Scene, actions: tuple[Action, ...], steps: int, engine: str) -> Session:
    rules = rules_of(scene)
    session = Session(scene, engine, game=None if rules is None else GameSession(rules))
    session.simulation.patience = 2.0
    due, start_time = list(actions), time.process_time()
    controls = () if rules is None else rules.controls
    for step in range(steps):
        if due and session.ended is None:
            try:
                session.apply(due.pop(0))
            except ActionError as error:
                check_error(error)
        if session.game is not None and controls and session.ended is None:
            _attempt(partial(session.apply_input, controls[step % len(controls)].name, float(step % 3 != 0)))
        if session.ended is not None or session.advance() == 0 or time.process_time() - start_time > BUDGET:
            break
    return session


def _rewind(scene: Scene, actions: tuple[Action, ...]) -> None:
    """Seek backwards and forwards in a session, and retract an action."""
    session = _played(scene, actions, 10)
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


def _resume(scene: Scene, actions: tuple[Action, ...]) -> None:
    """Resume from a checkpoint on each engine."""
    engine = _engine_for(scene)
    simulation = None if engine is None else _attempt(lambda: SwitchableSimulation(scene, engine))
    if simulation is None:
        return
    try:
        _attempt(lambda: step_through(simulation, actions, {"steps": 4}))
    finally:
        simulation.close()
    checkpoint = simulation.checkpoint()
    for each in ENGINES:
        resumed = _attempt(partial(SwitchableSimulation.resumed, replace(checkpoint, engine=each)))
        if resumed is not None:
            _attempt(resumed.step)
            resumed.close()


def _store(scene: Scene, actions: tuple[Action, ...]) -> None:
    """Run on each engine, write the run to a file and read it, including refused and failed runs."""
    if not _is_small(scene):
        return
    for engine in ENGINES:
        found = _attempt(partial(run, scene, engine, actions=actions, audit=False))
        if found is None:
            continue
        with tempfile.TemporaryDirectory() as folder:
            file = found.save(Path(folder) / "run.npz")
            try:
                loaded = Trajectory.load(file)
            except ValueError as error:
                raise Violation("stored run", f"{found.status} on {engine}: {error}") from error
        if json.dumps(loaded.info) != json.dumps(found.info) or not np.array_equal(loaded.time, found.time):
            raise Violation("stored run", f"what was written and read is another, on {engine}")


def _play_game(scene: Scene, _: tuple[Action, ...]) -> None:
    """Play the game of a scene, if any, with a random player."""
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
"""Additional checks of a scene, by name."""
