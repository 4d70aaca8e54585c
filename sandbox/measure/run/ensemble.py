"""Ensembles: many runs of a scene from varied starts, whose states are returned as arrays.

    ends = sandbox.ensemble("billiards/break", 1000, vary={"ball.cue.velocity": 0.01}, engine="exact", threads=2)
    ends.position.std(axis=0)

Without frames and contacts, `exact` computes runs of balls in compiled code, and `reference` those of all bodies
without drives, zones and springs. That is many times faster than runs one after the other, with the same results bit
for bit. Each start depends on the seed and on the number of the run only, so that neither threads nor the number of
runs change a digit.
"""

import math
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from threading import Event, Lock
from typing import Literal, Unpack

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.echo import short_repr
from sandbox.engines.contract import MemberRunner, Members, Refusal
from sandbox.engines.registry import engine_named
from sandbox.engines.registry import start as start_engine
from sandbox.measure.run.recorder import require_memory
from sandbox.measure.run.runner import run
from sandbox.progress import Progress, ProgressCallback
from sandbox.resource_limits import FREE_FRACTION, TooLargeError, free_memory
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings, SettingsChanges
from sandbox.scene.files.load import as_scene
from sandbox.scene.random_streams import Stream, draws
from sandbox.schedule import frame_count
from sandbox.signals import reraise_interrupt
from sandbox.trajectory import Trajectory

Keep = Literal["end", "frames", "contacts"]
"""What is kept of each run: its end, also its frames, or also its contacts."""

FIELDS: Mapping[str, int] = {"position": 2, "velocity": 2, "angle": 1, "angular_velocity": 1}
"""Quantities that can be varied, with their number of components."""

MAX_RUNS = 10_000_000
"""Largest number of runs"""


@dataclass(frozen=True, eq=False)
class Ensemble:
    """M runs of a scene with N bodies from varied starts. States of runs that were refused or failed are nan.

    Bodies that events of the scene add are left out.
    """

    names: tuple[str, ...]
    """(N,) names of the bodies"""
    status: npt.NDArray[np.str_]
    """(M,) `ok`, `refused`, `diverged` or `failed`, as of a run"""
    start_position: FloatArray
    """(M, N, 2) m, at the start"""
    start_velocity: FloatArray
    """(M, N, 2) m/s, at the start"""
    position: FloatArray
    """(M, N, 2) m, at the end"""
    velocity: FloatArray
    """(M, N, 2) m/s, at the end"""
    angle: FloatArray
    """(M, N) rad, at the end"""
    angular_velocity: FloatArray
    """(M, N) rad/s, at the end"""
    time: FloatArray
    """(T,) s, of the frames; (0,) unless they were kept"""
    frames: FloatArray
    """(M, T, N, 2) m, positions in each frame; (0, 0, 0, 2) unless they were kept"""
    contact_run: IntArray
    """(C,) run of each contact; (0,) unless they were kept, as the following"""
    contact_time: FloatArray
    """(C,) s, time of the first touch"""
    contact_pair: IntArray
    """(C, 2) body indices, and −1 − k for the k-th fixed object"""
    contact_impulse: FloatArray
    """(C, 2) N·s, impulse on the second of the pair"""
    compiled: BoolArray
    """(M,) whether each run was computed by compiled code for ensembles; the results do not depend on it"""

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        """Return the number of runs, how many ended well, and the largest spread of a body at the end."""
        well = self.status == "ok"
        spread = ""
        if well.any() and self.names:
            deviation = self.position[well].std(axis=0)
            spread = f", largest spread at the end {float(np.hypot(*deviation.T).max()):.3g} m"
        runs = "1 run" if len(self) == 1 else f"{len(self):,} runs"
        bodies = "1 body" if len(self.names) == 1 else f"{len(self.names):,} bodies"
        return f"<Ensemble: {runs} of {bodies}, {int(well.sum()):,} ok{spread}>"


@reraise_interrupt()
def ensemble(
    scene: Scene | Setup | str | Path,
    n: int,
    *,
    vary: Mapping[str, float],
    engine: str = "exact",
    keep: Keep = "end",
    threads: int = 1,
    seed: int | None = None,
    on_progress: ProgressCallback | None = None,
    **settings: Unpack[SettingsChanges],
) -> Ensemble:
    """Run a scene many times from normally distributed starts.

    Args:
        scene: the scene, or its name or path, as `load` takes it; or a setup, to start from another state.
        n: M, number of runs.
        vary: standard deviation of each varied quantity, by its path: `ball.*.velocity` for all balls, also those of
            generators; `grid.atom.velocity` for the bodies of one generator; `ball.cue.position` for one body;
            `*.*.angle` for all bodies. Quantities are `position` (m), `velocity` (m/s),
            `angle` (rad) and `angular_velocity` (rad/s); each component is varied independently. Bodies that are fixed
            or driven are not varied.
        engine: name of the engine.
        keep: `end` for the states at the end; `frames` for the positions in all frames too; `contacts` for the contacts
            too.
        threads: number of threads. They help where runs are compiled.
        seed: of the variations; default: that of the scene. The same seed gives the same starts.
        on_progress: progress callback.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Raises:
        ValueError: a path or an amount is invalid, or `n` or `threads` is not positive.
        UnknownEngineError: no engine has that name.
        SceneError: the name or path is not that of a valid scene.
        TooLargeError: the results would not fit into memory.
        SettingsError: a setting is invalid.

    Example:
        >>> ends = sandbox.ensemble("bounce", 3, vary={"ball.*.position": 0.001}, engine="pymunk", dt=0.01)
        >>> ends.position.shape
        (3, 1, 2)
    """
    setup = scene if isinstance(scene, Setup) else Setup.of(as_scene(scene))
    engine_named(engine)
    if keep not in ("end", "frames", "contacts"):
        raise ValueError(f"keep must be 'end', 'frames' or 'contacts', is {keep!r}")
    if not 1 <= n <= MAX_RUNS:
        raise ValueError(f"the number of runs must be from 1 to {MAX_RUNS:,}, is {short_repr(n)}")
    if threads < 1:
        raise ValueError(f"the number of threads must be at least 1, is {threads}")
    wanted = setup.scene.solver.replace(**settings) if settings else setup.scene.solver
    _check_memory(setup, wanted, n, keep)
    seed = setup.scene.world.seed if seed is None else seed
    runs = _Runs(setup, engine, wanted, varied_starts(setup, n, vary, seed), threads, on_progress)
    if keep == "end":
        runs.compute_compiled()
    runs.compute_rest(keep)
    return runs.collected(keep)


def varied_starts(start: Scene | Setup, n: int, vary: Mapping[str, float], seed: int) -> Members:
    """Return n start states of a scene, normally distributed about its own.

    The m-th depends on the seed, the varied paths and m only.

    Args:
        start: scene or setup.
        n: number of starts.
        vary: standard deviations by path, as `ensemble` takes them.
        seed: seed.

    Raises:
        ValueError: a path or an amount is invalid.
    """
    setup = Setup.of(start)
    bodies = setup.bodies
    if not vary:
        raise ValueError('nothing is varied; vary={"ball.*.velocity": 0.01} varies all balls by 0.01 m/s')
    columns = {name: np.repeat(np.asarray(getattr(bodies, name), np.float64)[None], n, axis=0) for name in FIELDS}
    for k, path in enumerate(sorted(vary)):
        amount, (indices, field) = _amount(path, vary[path]), _selected(setup, path)
        shape = (n, len(indices), 2) if FIELDS[field] == 2 else (n, len(indices))
        columns[field][:, indices] += amount * draws(Stream.ENSEMBLE, seed, k).standard_normal(shape)
    return Members(**columns)


def _amount(path: str, value: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not (math.isfinite(value) and value >= 0.0):
        raise ValueError(f"{path}: a standard deviation is a finite number of at least 0, not {short_repr(value)}")
    return float(value)


def _selected(setup: Setup, path: str) -> tuple[IntArray, str]:
    """Return the indices of the bodies that a path selects, and the name of the quantity."""
    bodies, parts = setup.bodies, path.split(".")
    if len(parts) < 3 or parts[-1] not in FIELDS:
        raise ValueError(
            f"{path!r} does not name a quantity of bodies; a path is such as ball.*.velocity, with one of "
            f"{', '.join(FIELDS)}"
        )
    kind, name, field = parts[0], ".".join(parts[1:-1]), parts[-1]
    headings = np.asarray(_headings(setup))[bodies.element] if len(bodies) else np.empty(0, "<U1")
    is_kind = (headings == kind) | (kind == "*") | (bodies.round & (kind == "ball"))
    if not is_kind.any():
        known = ", ".join(dict.fromkeys(headings.tolist())) or "none"
        raise ValueError(f"{path!r}: the scene has no bodies of {kind!r}; it has {known}")
    found = is_kind & _has_name(bodies, name)
    if not found.any():
        raise ValueError(f"{path!r}: no body is named {name!r}; bodies: {', '.join(bodies.names[:9])}")
    movable = found & ~bodies.fixed & ~is_driven(setup.scene, bodies)
    if not movable.any():
        raise ValueError(f"{path!r}: these bodies are fixed or driven, and cannot be varied")
    return np.flatnonzero(movable), field


def _headings(setup: Setup) -> list[str]:
    """Return the heading of the table of each element, as in a scene file; empty for bodies added during a run."""
    scene = setup.scene
    tables = {
        id(element): str(field.alias)
        for key, field in type(scene).model_fields.items()
        if isinstance(value := getattr(scene, key), tuple)
        for element in value
    }
    return [tables.get(id(element), "") for element in setup.bodies.elements]


def _has_name(bodies: Bodies, name: str) -> BoolArray:
    """Return which bodies, (N,), have a name, or belong to an element of that name."""
    if name == "*":
        return np.ones(len(bodies), np.bool_)
    elements = np.asarray([getattr(element, "name", None) == name for element in bodies.elements], np.bool_)
    return np.asarray([each == name for each in bodies.names], np.bool_) | elements[bodies.element]


def _check_memory(setup: Setup, settings: Settings, n: int, keep: Keep) -> None:
    """Check that the results fit into memory.

    Raises:
        TooLargeError: they do not.
    """
    bodies = max(len(setup.bodies), 1)
    size, free = n * bodies * 16 * 8, free_memory() * FREE_FRACTION  # states at both ends, and copies
    if keep == "frames":
        size += n * require_memory(setup.scene, settings, bodies) * bodies * 2 * 8
    if size > free:
        raise TooLargeError(f"{n:,} runs take {size / 1e9:.3g} GB, but only {free / 1e9:.3g} GB are available")


def run_members(
    setup: Setup,
    engine: str,
    settings: Settings,
    members: Members,
    threads: int = 1,
    report: Callable[[int], None] = lambda _: None,
) -> BoolArray:
    """Run a scene from many starts in compiled code, and write the end states in their place.

    Args:
        setup: start of the scene; `members` replace the state of its bodies.
        engine: name of the engine.
        settings: settings of the runs.
        members: (M, …) start states; replaced by those at the end.
        threads: number of threads.
        report: called with the number of runs that were computed since the last call, by several threads.

    Returns:
        (M,) whether each was computed. The others need an ordinary run: their states are the start states.
    """
    is_done = np.zeros(len(members.position), np.bool_)
    if setup.scene.events:  # they happen between steps
        return is_done
    try:
        simulation = start_engine(setup, engine, settings)
    except Refusal:  # of the scene's own start; each varied one is tried
        return is_done
    if isinstance(simulation, MemberRunner):
        runner, duration = simulation, sum(frame_count(setup.scene, simulation.settings))

        def compute(begin: int, end: int, stop: Event) -> None:
            rows = slice(begin, end)
            is_done[rows] = runner.run_members(Members(*(array[rows] for array in members)), duration, stop.is_set)
            report(int(is_done[rows].sum()))

        _in_threads(compute, len(is_done), threads)
    simulation.close()
    return is_done


class _Runs:
    """The runs of an ensemble, while they are computed."""

    def __init__(
        self,
        setup: Setup,
        engine: str,
        settings: Settings,
        starts: Members,
        threads: int,
        on_progress: ProgressCallback | None,
    ) -> None:
        self._setup, self._engine, self._settings, self._starts = setup, engine, settings, starts
        self._threads, self._on_progress = threads, on_progress
        count = len(starts.position)
        self._ends = Members(*(array.copy() for array in starts))
        self._compiled = np.zeros(count, np.bool_)
        self._status = np.full(count, "ok", dtype="<U8")
        self._trajectories: dict[int, Trajectory] = {}
        """ordinary runs, if more than their ends is kept"""
        self._computed, self._lock = 0, Lock()

    def compute_compiled(self) -> None:
        """Compute those runs that the engine has compiled code for."""
        if not self._setup.time:
            self._compiled = run_members(
                self._setup, self._engine, self._settings, self._ends, self._threads, self._report
            )

    def compute_rest(self, keep: Keep) -> None:
        """Compute the other runs one by one."""
        rest, settings = np.flatnonzero(~self._compiled).tolist(), self._settings
        if keep != "frames":  # only the first and the last frame of each
            settings = settings.replace(record_every=max(frame_count(self._setup.scene, settings)[0], 1))

        def compute(begin: int, end: int, stop: Event) -> None:
            for m in rest[begin:end]:
                if stop.is_set():
                    return
                columns = {name: getattr(self._starts, name)[m] for name in FIELDS}
                varied = replace(self._setup, bodies=replace(self._setup.bodies, **columns))
                found = run(varied, self._engine, audit=False, **settings.model_dump()).of_first(len(varied.bodies))
                self._status[m] = found.status
                if keep != "end":
                    self._trajectories[m] = found
                for name in FIELDS:
                    getattr(self._ends, name)[m] = getattr(found, name)[-1] if found.status == "ok" else np.nan
                self._report(1)

        if rest:
            _in_threads(compute, len(rest), self._threads)

    def _report(self, runs: int) -> None:
        with self._lock:  # threads report too
            self._computed += runs
            if self._on_progress is not None:
                self._on_progress(Progress(fraction=self._computed / len(self._status)))

    def collected(self, keep: Keep) -> Ensemble:
        """Return the ensemble of all runs."""
        runs = sorted(self._trajectories.items())
        time, frames = np.empty(0), np.empty((0, 0, 0, 2))
        if keep == "frames":
            time = next((found.time for _, found in runs if found.status == "ok"), time)
            frames = np.full((len(self._status), len(time), len(self._setup.bodies), 2), np.nan)
            for m, found in runs:
                if found.status == "ok":
                    frames[m] = found.position
        contacts = runs if keep == "contacts" else []
        numbers = [np.full(len(found.contact_time), m) for m, found in contacts]
        return Ensemble(
            names=tuple(self._setup.bodies.names),
            status=self._status,
            start_position=self._starts.position,
            start_velocity=self._starts.velocity,
            position=self._ends.position,
            velocity=self._ends.velocity,
            angle=self._ends.angle,
            angular_velocity=self._ends.angular_velocity,
            time=time,
            frames=frames,
            contact_run=np.concatenate([np.empty(0, np.int64), *numbers]),
            contact_time=np.concatenate([np.empty(0), *(found.contact_time for _, found in contacts)]),
            contact_pair=np.concatenate([np.empty((0, 2), np.int64), *(found.contact_pair for _, found in contacts)]),
            contact_impulse=np.concatenate([np.empty((0, 2)), *(found.contact_impulse for _, found in contacts)]),
            compiled=self._compiled,
        )


def _in_threads(compute: Callable[[int, int, Event], None], count: int, threads: int) -> None:
    """Call a function for ranges of runs, on several threads. The event is set once they must end early."""
    stop = Event()
    bounds = np.linspace(0, count, min(threads, count) + 1).astype(int).tolist()
    if len(bounds) == 2:
        compute(0, count, stop)
        return
    with ThreadPoolExecutor(len(bounds) - 1) as pool:
        futures = [pool.submit(compute, begin, end, stop) for begin, end in pairwise(bounds)]
        try:
            for future in futures:
                future.result()
        finally:  # also on Ctrl-C: threads that are waited for must end
            stop.set()
