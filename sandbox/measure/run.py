"""Run: compute a scene on an engine from start to end, with recording and audit."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from sandbox.action import Action, Spawn, actions_to_json, in_order
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Refusal, Simulation
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import engine_named
from sandbox.engines.switching import start
from sandbox.games.session import HeadlessGame
from sandbox.interrupt import heeded
from sandbox.measure.audit import Audit
from sandbox.measure.drive import Progress, Watch, drive
from sandbox.measure.energy import energies
from sandbox.measure.joint_error import joint_error
from sandbox.measure.recorder import Books, Recorder, TooLargeError
from sandbox.measure.schedule import schedule
from sandbox.measure.versions import versions
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import bits_of
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import MAX_STEPS
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import as_scene
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Trajectory

__all__ = ["Progress", "run"]


@heeded()
def run(
    scene: Scene | Setup | str | Path,
    engine: str = "pymunk",
    *,
    actions: Sequence[Action] = (),
    audit: bool = True,
    account: bool = False,
    progress: Progress | None = None,
    bout: HeadlessGame | None = None,
    watch: Watch | None = None,
    **settings: Any,
) -> Trajectory:
    """Run a scene from start to end.

    Args:
        scene: the scene, or its name or path, as `load` takes it; or a setup, to start from another state.
        engine: name of the engine.
        actions: actions applied during the run, each before the first step that starts at its time or later. Actions at
            the end of the run are applied after the last step.
        audit: count the contacts that the engine misses.
        account: record the energy account at every frame, which `measure.ledger` reads.
        progress: progress callback, called with the completed fraction of the run, 0 to 1.
        bout: game played during the run; the run ends with the game. Its actions are among those of the result.
        watch: callback with the steps done and the work counters. An exception that it raises ends the run without a
            result.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Returns:
        The recorded run up to its end or failure. Its `status` is `ok`; `diverged` if the state left the bounds of
        position or speed; `failed` if an action could not be applied, such as one for a removed body, or if the
        contacts exceeded memory; `refused`, without frames, if the engine does not support the scene or a setting.
        `reason` has the details.

    Raises:
        UnknownEngineError: no engine has that name.
        SceneError: the name or path is not that of a valid scene.
        TooLargeError: the frames would not fit into memory, or the number of steps exceeds the limit.
        pydantic.ValidationError: a setting is invalid.
        KeyboardInterrupt: Ctrl-C was pressed, even if a library converted it to another exception.
    """
    setup = scene if isinstance(scene, Setup) else Setup.of(as_scene(scene))
    scene = setup.scene
    chosen = engine_named(engine)
    wanted = scene.solver.replace(**settings) if settings else scene.solver
    actions = in_order(tuple(actions))
    stretches = schedule(scene.world.duration, wanted.dt, actions)
    substeps = sum(stretch.steps + stretch.part for stretch in stretches) * wanted.substeps
    if substeps > MAX_STEPS:
        raise TooLargeError(f"{substeps:.3g} steps in a run; the limit is {MAX_STEPS:g}")
    try:
        simulation = start(setup, engine, wanted)
    except Refusal as refusal:
        return run_without_frames(setup, engine, wanted, actions, "refused", str(refusal))
    resolved = chosen.resolve(setup, wanted)
    spawned = sum(isinstance(action, Spawn) for action in actions)
    books = _books(simulation) if account else None
    recorder = Recorder(scene, resolved, len(setup.bodies) + spawned, actions, books, len(Cause))
    auditor = Auditor(setup, simulation) if audit else None

    began, compiled = perf_counter(), COMPILE_CLOCK.seconds
    end = drive(scene.world.duration, simulation, stretches, actions, recorder, progress, bout, watch)
    seconds = perf_counter() - began - (auditor.seconds if auditor else 0.0) - (COMPILE_CLOCK.seconds - compiled)
    bodies, work = simulation.bodies, dict(simulation.work)
    state_hash = simulation.state_hash()
    simulation.close()

    retired = np.full(len(bodies), np.nan)
    for number, time in simulation.retired.items():
        retired[number] = time
    broken = np.full(len(setup.links), np.nan)
    broken[list(simulation.broken)] = list(simulation.broken.values())
    missed = auditor.missed if auditor else _no_misses()
    outcome = {"status": end.status, "reason": end.reason, "steps": end.steps, "seconds": seconds, "work": work}
    outcome |= {"audited": audit}
    outcome |= {"state_hash": state_hash, "broken": len(simulation.broken)}
    info = _info(scene, engine, resolved, end.done, **outcome)
    if bout is not None:
        info["game"] = bout.to_dict(scene.play.game or "")
    if account:
        info["causes"] = [cause.value for cause in Cause]
    trajectory = _trajectory(recorder.arrays(len(bodies)), bodies, end.contacts, retired, broken, missed, info)
    trajectory = replace(trajectory, layer=recorder.layers(len(bodies)))
    total = energies(trajectory.at([0, -1]), setup, bodies=bodies).total
    info |= {"energy_start": float(total[0]), "energy_end": float(total[-1])}
    info["joint_error"] = joint_error(trajectory, setup)
    return trajectory


def _books(simulation: Simulation) -> Books:
    """Return what tells the present energy of a simulation, J, and the entries of its account, in their order."""

    def books() -> tuple[float, list[float]]:
        return total_energy(simulation), list(simulation.account().values())

    return books


def _info(scene: Scene, engine: str, settings: Settings, actions: tuple[Action, ...], **outcome: Any) -> dict[str, Any]:
    return {
        "scene": to_document(scene),
        "engine": engine,
        "settings": settings.model_dump(mode="json"),
        "actions": actions_to_json(actions),
        "seed": scene.world.seed,
        "versions": dict(versions()),
        **outcome,
    }


def run_without_frames(
    start: Scene | Setup, engine: str, settings: Settings, actions: tuple[Action, ...], status: str, reason: str
) -> Trajectory:
    """Return the trajectory of a run of which nothing was recorded: its status, and why."""
    setup = Setup.of(start)
    scene, count = setup.scene, len(setup.bodies)
    outcome = {"status": status, "reason": reason, "steps": 0, "seconds": 0.0, "work": {}, "audited": False}
    outcome |= {"state_hash": None, "broken": 0}
    info = _info(scene, engine, settings, actions, **outcome, energy_start=None, energy_end=None, joint_error=None)
    shapes = {"position": (0, count, 2), "velocity": (0, count, 2), "angle": (0, count), "angular_velocity": (0, count)}
    frames = {"time": np.empty(0), "energy": np.empty(0), "account": np.empty((0, 0))} | {
        name: np.empty(shape) for name, shape in shapes.items()
    }
    whole = np.full(len(setup.links), np.nan)
    return _trajectory(frames, setup.bodies, Contacts.none(), np.full(count, np.nan), whole, _no_misses(), info)


def _trajectory(
    frames: dict[str, FloatArray],
    bodies: Bodies,
    contacts: Contacts,
    retired_time: FloatArray,
    broken_time: FloatArray,
    missed: tuple[FloatArray, IntArray],
    info: dict[str, Any],
) -> Trajectory:
    return Trajectory(
        time=frames["time"],
        position=frames["position"],
        velocity=frames["velocity"],
        angle=frames["angle"],
        angular_velocity=frames["angular_velocity"],
        names=np.asarray(bodies.names, dtype=np.str_),
        contact_time=contacts.time,
        contact_pair=contacts.pair,
        contact_point=contacts.point,
        contact_normal=contacts.normal,
        contact_impulse=contacts.impulse,
        retired_time=retired_time,
        missed_time=missed[0],
        missed_pair=missed[1],
        broken_time=broken_time,
        energy=frames["energy"],
        account=frames["account"],
        spin=frames.get("spin", np.empty((0, 0, 3))),
        info=info,
    )


def _no_misses() -> tuple[FloatArray, IntArray]:
    return np.empty(0), np.empty((0, 2), np.int64)


class Auditor:
    """An audit that times itself, so that a run's seconds are the engine's."""

    def __init__(self, start: Scene | Setup, simulation: Simulation) -> None:
        setup = Setup.of(start)
        self._audit = Audit(setup, simulation.bodies)
        self._simulation = simulation
        self._known, self._scene = len(simulation.bodies), simulation.scene
        self._on = self._layers() if len(setup.scene.layers) > 1 else None
        self.seconds = 0.0
        simulation.watch(self)

    def __call__(self, time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
        """Audit one substep."""
        began = perf_counter()
        if (now := self._simulation.scene) is not self._scene:
            if now.fixed != self._scene.fixed:
                self._audit.changed(now, self._simulation.bodies)
            self._scene = now
        if len(end) != self._known:
            self._audit.joined(self._simulation.bodies)
            self._known = len(end)
        self._audit(time, start, end, touching, self._shared())
        self.seconds += perf_counter() - began

    def _layers(self) -> IntArray:
        """Return the layers that bodies are on, as bits, (N,)."""
        frame = self._simulation.frame()
        return bits_of(frame.layer, len(frame.position))

    def _shared(self) -> IntArray | None:
        """Return the layers on which bodies were since the last substep, as bits: none for who has changed its own."""
        if self._on is None:
            return None
        before, self._on = self._on, self._layers()
        shared = self._on.copy()
        shared[: len(before)] &= before
        return shared

    @property
    def missed(self) -> tuple[FloatArray, IntArray]:
        """When, (M,) s, and between whom, (M, 2), contacts were missed."""
        return self._audit.missed()
