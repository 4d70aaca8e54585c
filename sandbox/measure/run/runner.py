"""Runner: computes a scene on an engine from start to end, with recording and audit."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Unpack, cast

import numpy as np

from sandbox.action import Action, Spawn, actions_to_json, in_order
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import PairRuns, Refusal, Simulation
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import engine_named
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.games.players import RECORDED
from sandbox.games.registry import rules_of
from sandbox.games.session import HeadlessGame
from sandbox.measure.metrics.energy import energies
from sandbox.measure.metrics.invariants import joint_error
from sandbox.measure.missed_contacts import Audit
from sandbox.measure.missed_contacts.slender_bodies import with_slender_passages
from sandbox.measure.run.loop import RunCallbacks, RunEnd, WorkCallback, run_loop
from sandbox.measure.run.recorder import EnergyReader, Recorder, TooLargeError
from sandbox.measure.run.run_warnings import run_warnings
from sandbox.progress import ProgressCallback
from sandbox.provenance import versions
from sandbox.recording import Recording
from sandbox.scene.compile.filters import bits_of_layers
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import MAX_STEPS
from sandbox.scene.description.world import Settings, SettingsChanges
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import as_scene
from sandbox.schedule import ROUNDING, Stretch, schedule
from sandbox.signals import reraise_interrupt
from sandbox.trajectory import Contacts, SensorVisit, Trajectory


@reraise_interrupt()
def run(
    scene: Scene | Setup | Recording | str | Path,
    engine: str | None = None,
    *,
    actions: Sequence[Action] = (),
    audit: bool = True,
    account: bool = False,
    on_progress: ProgressCallback | None = None,
    bout: HeadlessGame | None = None,
    on_work: WorkCallback | None = None,
    strict: bool = False,
    **settings: Unpack[SettingsChanges],
) -> Trajectory:
    """Run a scene or a recording from start to end.

    A recording is run with its actions, settings and duration, and the rules of its game; on its own engine with the
    same versions it ends in the same state, bit for bit.

    Args:
        scene: the scene, or its name or path, as `load` takes it; a setup, to start from another state; or a recording.
        engine: name of the engine; default: pymunk, or that of the recording. Another engine computes the whole
            recording, even if it switched engines.
        actions: actions applied during the run, besides those of a recording, each before the first step that starts
            at its time or later. Actions at the end of the run are applied after the last step.
        audit: count the contacts that the engine misses.
        account: record the energy account at every frame, which `measure.metrics.energy.ledger_of` reads.
        on_progress: progress callback; its fraction is the completed part of the run.
        bout: game played during the run; the run ends with the game. Its actions are among those of the result.
        on_work: callback with the steps done and the work counters. An exception that it raises ends the run without a
            result.
        strict: raise `RunFailedError` unless the status of the run is `ok`, as `Trajectory.raise_if_failed`.
        settings: changes to the scene's `[solver]`, or to the settings of the recording, such as `dt=0.001`.

    Returns:
        The recorded run up to its end or failure. Its `status` is `ok`; `diverged` if the state left the bounds of
        position or speed; `failed` if an action could not be applied, such as one for a removed body, or if the
        contacts exceeded memory; `refused`, without frames, if the engine does not support the scene or a setting.
        `reason` has the details.

    Raises:
        UnknownEngineError: no engine has that name.
        RunFailedError: with `strict`, the run was refused, diverged or failed.
        SceneError: the name or path is not that of a valid scene.
        TooLargeError: the frames would not fit into memory, or the number of steps exceeds the limit.
        SettingsError: a setting is invalid.
        UnsuitableSceneError: the scene of a recording lacks an element that its game needs.
        KeyboardInterrupt: Ctrl-C was pressed, even if a library converted it to another exception.

    Example:
        >>> run = sandbox.run("bounce", dt=0.01)
        >>> run.status, run.position.shape
        ('ok', (601, 1, 2))
    """
    if isinstance(scene, Recording):
        recording = scene if engine is None else scene.on(engine)
        scene, engine = recording.whole_scene, recording.engine
        actions = (*recording.actions, *actions)
        settings = {**cast("SettingsChanges", recording.settings.model_dump()), **settings}
        bout = bout or _recorded_game(recording)
    engine = engine or "pymunk"
    setup = scene if isinstance(scene, Setup) else Setup.of(as_scene(scene))
    scene = setup.scene
    engine_named(engine)
    wanted = scene.solver.replace(**settings) if settings else scene.solver
    actions = in_order(tuple(actions))
    stretches = _schedule(scene, wanted, actions)
    try:
        simulation = start(setup, engine, wanted)
        if account:
            simulation.account()
    except Refusal as refusal:
        refused = run_without_frames(setup, engine, wanted, actions, "refused", str(refusal))
        return refused.raise_if_failed() if strict else refused
    resolved = simulation.settings
    bodies = len(setup.bodies) + scene.spawned_by_events + sum(isinstance(action, Spawn) for action in actions)
    simulation.sensor_visits()  # recorded from now on
    recorder = Recorder(scene, resolved, bodies, actions, _energy_reader(simulation) if account else None, len(Cause))
    timed_audit = TimedAudit(setup, simulation) if audit else None

    began = clock_without_compilation()
    callbacks = RunCallbacks(on_progress, on_work)
    end = run_loop(scene.world.duration, simulation, stretches, actions, recorder, bout, callbacks)
    seconds = clock_without_compilation() - began - (timed_audit.seconds if timed_audit else 0.0)
    work, state_hash = dict(simulation.work), simulation.state_hash()

    outcome = {"status": end.status, "reason": end.reason, "steps": end.steps, "seconds": seconds, "work": work}
    outcome |= {
        "audited": audit,
        "state_hash": state_hash,
        "broken": simulation.setup.joints.count_among(simulation.broken),
    }
    info = _info(scene, engine, resolved, end.done, **outcome)
    if bout is not None:
        info["game"] = bout.to_dict(scene.play.game or "")
    if account:
        info["causes"] = [cause.value for cause in Cause]
    trajectory = _recorded_run(setup, simulation, recorder, end, timed_audit, info)
    simulation.close()
    return trajectory.raise_if_failed() if strict else trajectory


def _visit_ends(contacts: Contacts, visits: Sequence[SensorVisit], simulation: SwitchableSimulation) -> FloatArray:
    """Return the end of each contact that is a visit of a sensor, (C,) s; nan for others, and for visits that last."""
    ends = {(each.object, each.sensor, each.begin): each.end for each in visits}
    names = (*simulation.bodies.names, *reversed(simulation.scene.fixed_names))  # −1 − k counts from the end
    pairs = [(names[a], names[b]) for a, b in contacts.pair.tolist()]
    found = [ends.get((*pair, time), np.nan) for pair, time in zip(pairs, contacts.time.tolist(), strict=True)]
    return np.asarray(found, np.float64)


def _recorded_game(recording: Recording) -> HeadlessGame | None:
    """Return the game of a recording, whose rules are evaluated without acting; None if it has none."""
    rules = rules_of(recording.scene, on_request=recording.has_game)
    return None if rules is None else HeadlessGame(rules, None, RECORDED, recording.presses)


def _schedule(scene: Scene, settings: Settings, actions: tuple[Action, ...]) -> list[Stretch]:
    """Return the step schedule of a run, after checking the number of steps."""
    stretches = schedule(scene.world.duration, settings.dt, actions)
    substeps = sum(stretch.steps + stretch.part for stretch in stretches) * settings.substeps
    if substeps > MAX_STEPS:
        raise TooLargeError(f"{substeps:.3g} steps in a run; the limit is {MAX_STEPS:g}")
    return stretches


def _energy_reader(simulation: Simulation) -> EnergyReader:
    """Return a function that reads the present energy of a simulation, J, and the entries of its account in order."""

    def read_energy() -> tuple[float, list[float]]:
        return total_energy(simulation), list(simulation.account().values())

    return read_energy


def _recorded_run(
    setup: Setup,
    simulation: SwitchableSimulation,
    recorder: Recorder,
    end: RunEnd,
    audit: "TimedAudit | None",
    info: dict[str, Any],
) -> Trajectory:
    """Return the trajectory of a run that has ended; `info` gets its energies and joint error."""
    bodies = simulation.bodies
    retired = np.full(len(bodies), np.nan)
    for number, time in simulation.retired.items():
        retired[number] = time
    broken = np.full(len(setup.joints), np.nan)  # without the joints that actions added
    for row, time in simulation.broken.items():
        if row < len(broken):
            broken[row] = time
    missed_time, missed_pair = audit.missed if audit else (None, None)
    visits = simulation.sensor_visits() if setup.scene.sensors else None
    trajectory = Trajectory.from_frames(
        {**recorder.arrays(len(bodies)), "layer": recorder.layers(len(bodies))},
        bodies.names,
        end.contacts,
        retired,
        info,
        missed_time=missed_time,
        missed_pair=missed_pair,
        broken_time=broken,
        contact_end=None if visits is None else _visit_ends(end.contacts, visits, simulation),
    )
    trajectory = trajectory if audit is None else audit.with_slender_passages(trajectory)
    total = energies(trajectory.at([0, -1]), setup, bodies=bodies).total
    if (
        simulation.joined or simulation.scene.world != setup.scene.world
    ):  # actions have added springs, or changed gravity
        total[-1] = total_energy(simulation)
    info |= {"energy_start": float(total[0]), "energy_end": float(total[-1])}
    worst = joint_error(trajectory, setup)
    info["joint_error"] = None if worst is None else worst.relative
    info["worst_joint"] = None if worst is None else {"name": worst.name, "error": worst.error, "unit": worst.unit}
    is_ok = end.status == "ok"
    info["warnings"] = [*run_warnings(trajectory, setup.scene, (float(total[0]), float(total[-1])))] if is_ok else []
    return trajectory


def run_without_frames(
    start: Scene | Setup, engine: str, settings: Settings, actions: tuple[Action, ...], status: str, reason: str
) -> Trajectory:
    """Return the trajectory of a run that recorded nothing.

    Args:
        start: scene or setup of the run.
        engine: name of the engine.
        settings: settings of the run.
        actions: actions of the run.
        status: status of the run, `refused` or `failed`.
        reason: reason for the status.
    """
    setup = Setup.of(start)
    scene, count = setup.scene, len(setup.bodies)
    outcome = {"status": status, "reason": reason, "steps": 0, "seconds": 0.0, "work": {}, "audited": False}
    outcome |= {"state_hash": None, "broken": 0}
    outcome |= {"warnings": [], "energy_start": None, "energy_end": None, "joint_error": None, "worst_joint": None}
    info = _info(scene, engine, settings, actions, **outcome)
    shapes = {"position": (0, count, 2), "velocity": (0, count, 2), "angle": (0, count), "angular_velocity": (0, count)}
    frames = {"time": np.empty(0)} | {name: np.empty(shape) for name, shape in shapes.items()}
    unbroken = np.full(len(setup.joints), np.nan)
    return Trajectory.from_frames(
        frames, setup.bodies.names, Contacts.none(), np.full(count, np.nan), info, broken_time=unbroken
    )


def _info(scene: Scene, engine: str, settings: Settings, actions: tuple[Action, ...], **outcome: Any) -> dict[str, Any]:
    return {
        "scene": to_document(scene),
        "engine": engine,
        "settings": settings.model_dump(mode="json"),
        "actions": actions_to_json(actions),
        "seed": scene.world.seed,
        "versions": dict(versions(engine)),
        **outcome,
    }


class TimedAudit:
    """Audit of a simulation that measures its own time, so that the time of a run is the engine's."""

    def __init__(self, start: Scene | Setup, simulation: Simulation) -> None:
        """Watch every substep of a simulation.

        Args:
            start: scene or setup of the simulation.
            simulation: the simulation, before its first step.
        """
        setup = Setup.of(start)
        self._audit = Audit(setup, simulation.bodies)
        self._simulation = simulation
        self._known, self._scene = len(simulation.bodies), simulation.scene
        self._layers_before = self._layers() if len(setup.scene.layers) > 1 else None
        self._removed: list[int] = []
        """indices of the bodies that were removed before the last substep"""
        self.seconds = 0.0
        """s, time spent in the audit, without compilation"""
        simulation.watch(self)

    def __call__(self, time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
        """Audit one substep."""
        began = clock_without_compilation()
        self._update(len(end))
        self._audit(time, self._without_removed(start, time), end, touching, self._shared_layers())
        self.seconds += clock_without_compilation() - began

    def observe_path(self, times: FloatArray, path: FloatArray, pairs: PairRuns) -> None:
        """Audit many substeps, as `Audit.observe_path`; bodies that change their layer are not passed in this way."""
        began = clock_without_compilation()
        self._update(path.shape[1])
        self._audit.observe_path(times, self._without_removed(path, times[0]), pairs, self._shared_layers())
        self.seconds += clock_without_compilation() - began

    def _update(self, bodies: int) -> None:
        """Include changes of the scene since the last substep, and bodies that were added."""
        if (now := self._simulation.scene) is not self._scene:
            if now.fixed != self._scene.fixed:
                self._audit.changed(now, self._simulation.bodies)
            self._scene = now
        if bodies != self._known:
            self._audit.joined(self._simulation.bodies)
            self._known = bodies

    def _without_removed(self, position: FloatArray, time: float) -> FloatArray:
        """Return positions (..., N, 2), m, with nan for bodies that were removed before a time, s."""
        if not self._audit.has_bodies:
            return position
        retired = self._simulation.retired
        if len(retired) != len(self._removed):  # some were removed since, perhaps at the end of this substep
            self._removed = [body for body, when in retired.items() if when <= time * (1.0 + ROUNDING)]
        if self._removed:
            position = position.copy()
            position[..., self._removed, :] = np.nan
        return position

    def _layers(self) -> IntArray:
        """Return the layer of each body as a bit, (N,)."""
        frame = self._simulation.frame()
        return bits_of_layers(frame.layer, len(frame.position))

    def _shared_layers(self) -> IntArray | None:
        """Return the layer of each body throughout the last substep as a bit; 0 for a body that changed its layer."""
        if self._layers_before is None:
            return None
        before, self._layers_before = self._layers_before, self._layers()
        shared = self._layers_before.copy()
        shared[: len(before)] &= before
        return shared

    @property
    def missed(self) -> tuple[FloatArray, IntArray]:
        """Times, (M,) s, and pairs, (M, 2), of the missed contacts."""
        return self._audit.missed()

    def with_slender_passages(self, run: Trajectory) -> Trajectory:
        """Return a run of the simulation with the passages through slender bodies among its missed contacts."""
        return with_slender_passages(run, self._simulation.bodies, self._audit.can_collide)
