"""Jobs: one run each, with everything that it needs, and what is computed for it.

A job and its result are picklable: they travel by value to worker processes and to other machines, which need neither
the scene file nor the store.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any, Literal, Self

from sandbox.action import in_order
from sandbox.batch.observables import Observable, observed_columns
from sandbox.batch.run_row import ReplayResult, RunRow, details_of
from sandbox.batch.store import Store, run_id
from sandbox.batch.stored_run import StoredRun
from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.registry import engine_named
from sandbox.games.players import PlayerSpec
from sandbox.measure.run.bounded_run import RunTimeoutError
from sandbox.measure.run.runner import run, run_without_frames
from sandbox.progress import Progress
from sandbox.provenance import versions
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory

Values = tuple[tuple[str, Any], ...]
"""Keys of a scene and the values that they are set to."""
KeptParts = Literal["all", "summary", "end"]
"""What is stored of a run: its arrays too, its row only, or of the row only what follows from the start and the end."""
KEEP: tuple[KeptParts, ...] = ("all", "summary", "end")


@dataclass(frozen=True)
class Job:
    """One run to be made: a scene with all values set, and an engine."""

    label: str
    """the scene as the user named it"""
    scene: Scene
    engine: str
    actions: tuple[Any, ...] = ()
    point: Values = ()
    """the keys that are set, swept or sampled, with their values in this run"""
    recorded: bool = False
    """the job replays a recorded session"""
    state_hash: str | None = None
    """of the end of that session, if the run must reproduce it: same engine, nothing set"""
    player: PlayerSpec | None = None
    """player of the game; None if no game is played"""
    score: float | None = None
    """of that session, if the run must reproduce it"""
    seeds: int = 1
    """number of seeds that the job stands for: more than 1 if nothing in its scene is random"""
    plan_key: str | None = None
    """hash by which a plan finds the stored run again"""
    run_id: str | None = None
    """id of the run, if it is known already, which saves a worker half a millisecond"""

    def replay_of(self, stored: StoredRun) -> ReplayResult | None:
        """Return whether a replay ended as its recording, bit for bit; None if the job is no replay."""
        if not self.recorded:
            return None
        if self.state_hash is None or stored.state_hash is None:
            return ReplayResult(None)
        return ReplayResult(stored.state_hash == self.state_hash and self.score in (None, stored.score))


@dataclass(frozen=True)
class RunOptions:
    """How jobs are run and stored, and what their rows contain."""

    audit: bool = True
    """count the contacts that the engine misses"""
    ledger: bool = False
    """keep the energy ledger; a stored run without one is run again and replaced"""
    final: bool = True
    """rows contain the final state"""
    keep: KeptParts = "all"
    """`summary` stores rows without arrays, `end` also without contacts and work; a stored run that has less than is
    wanted is run again"""
    time_limit: float | None = None
    """s, computing time of a run, after which it is stopped and recorded as failed"""
    force: bool = False
    """run again what is stored already"""
    observable: Observable | None = None
    """function whose values are kept; a stored run without them is observed, or run again if it has no arrays"""


@dataclass(frozen=True)
class CompletedRun:
    """A run that was computed: what is stored of it."""

    stored: StoredRun
    arrays: bytes | None
    """content of its file; None if only the row is kept"""
    elapsed: float
    """s, of the whole run, with compilation and compression"""
    trajectory: Trajectory | None = None
    """the run itself; None if it was made in another process"""


@dataclass(frozen=True)
class RunRecord:
    """A completed run, computed or fetched from a store."""

    label: str
    """the scene as the user named it"""
    values: Values
    """the keys that are set, swept or sampled, with their values in this run"""
    stored: StoredRun
    path: Path | None
    """of the stored arrays"""
    repeated: bool
    """fetched from the store, not run"""
    damaged: str | None = None
    """file and fault of the damaged stored run that this one replaces"""
    computed: Trajectory | None = None
    """the run, if it was computed in this process"""
    replay: ReplayResult | None = None
    """comparison with the recording; None if the run is no replay"""
    has_game: bool = False
    """whether a player played a game"""

    @classmethod
    def of(cls, job: Job, stored: StoredRun, path: Path | None, **more: Any) -> Self:
        """Return the record of a job."""
        return cls(
            job.label, job.point, stored, path, replay=job.replay_of(stored), has_game=job.player is not None, **more
        )

    @property
    def id(self) -> str:
        """Id of the run."""
        return self.stored.id

    @property
    def is_plain(self) -> bool:
        """Whether the run is ok, and neither a replay, nor a game, nor in the place of a damaged one."""
        return self.stored.status == "ok" and self.damaged is None and self.replay is None and not self.has_game

    @property
    def has_trajectory(self) -> bool:
        """Whether the frames of the run are known: it was computed in this process, or its arrays are stored."""
        return self.computed is not None or self.path is not None

    @property
    def trajectory(self) -> Trajectory:
        """The run, read from its file unless it was computed in this process.

        Raises:
            ValueError: it was computed elsewhere and its arrays were not kept; or its file is damaged.
            OSError: its file cannot be read.
            TooLargeError: its arrays would not fit into memory.
        """
        if self.computed is not None:
            return self.computed
        if self.path is None:
            raise ValueError(f"run {self.id} was stored without arrays")
        return Trajectory.load(self.path)

    def row(self, final: bool = True, ledger: bool = False) -> RunRow:
        """Return the figures of the run.

        Args:
            final: include the final state.
            ledger: include the energy ledger.
        """
        return RunRow.of(
            self.stored,
            label=self.label,
            values=dict(self.values),
            path=None if self.path is None else str(self.path),
            final=final,
            ledger=ledger,
            replay=self.replay,
            repeated=self.repeated,
            damaged=self.damaged,
        )


def run_job(
    job: Job, options: RunOptions = RunOptions(), progress: Callable[[float], None] | None = None
) -> CompletedRun:
    """Run a job.

    Args:
        job: what to run.
        options: how to run it.
        progress: called with the fraction of the run that is done.

    Returns:
        The run; with the status `failed` if it exceeded the time limit.

    Raises:
        TooLargeError: the frames would not fit into memory.
        SceneError: the game of the scene cannot be played by the player.
        ObservableError: the observable cannot be computed.
    """
    began = perf_counter()
    bout = None if job.player is None else job.player.start_game(job.scene, job.label)

    def report(state: Progress) -> None:
        assert progress is not None
        progress(state.fraction or 0.0)

    limit = options.time_limit
    until = None if limit is None else clock_without_compilation() + limit

    def check_time(_steps: int, _work: Mapping[str, int]) -> None:
        if until is not None and clock_without_compilation() > until:
            raise RunTimeoutError

    try:
        trajectory = run(
            job.scene,
            job.engine,
            actions=job.actions,
            audit=options.audit,
            account=options.ledger,
            on_progress=None if progress is None else report,
            bout=bout,
            on_work=None if until is None else check_time,
        )
    except RunTimeoutError:
        assert limit is not None
        return failed_run(job, timeout_reason(limit))
    row = _stored(job, job.run_id or identify(job)[1], trajectory)
    if options.observable is not None:
        row = replace(row, details=options.observable.added_to(row.details, trajectory))
    if options.keep == "end":
        row = replace(row, contacts=None, first_contact=None, missed_contacts=None, work=None)
    arrays = trajectory.to_bytes() if options.keep == "all" else None
    return CompletedRun(row, arrays, perf_counter() - began, trajectory)


def failed_run(job: Job, reason: str) -> CompletedRun:
    """Return a failed run without frames, for a job that ended its process or its time; the next call runs it again."""
    settings, number = identify(job)
    trajectory = run_without_frames(job.scene, job.engine, settings, in_order(job.actions), "failed", reason)
    return CompletedRun(_stored(job, number, trajectory), None, 0.0, trajectory)


def timeout_reason(limit: float) -> str:
    """Return the reason of a run that exceeded the time limit, s."""
    return f"stopped at the time limit of {limit:g} s"


def fetch(job: Job, store: Store, options: RunOptions) -> RunRecord | str | None:
    """Return the stored run of a job; a text with the fault of its file if that is damaged; None if it must be run.

    Args:
        job: the job, whose `run_id` must be right if it is known.
        store: where the run is looked up.
        options: how it would be run.

    Raises:
        StoreError: the store cannot be used, or the file of this run cannot be opened.
        ObservableError: the observable cannot be computed.
        TooLargeError: the arrays of a run that is observed would not fit into memory.
    """
    found = store.find(job.run_id or identify(job)[1])
    if found is None or options.force:
        return None
    fault = store.fault_of_file(found)
    if fault is not None:
        return fault
    if found.details is None:
        return None
    if not is_sufficient(found, options):
        file = store.file(found)
        if options.observable is None or file is None or not is_sufficient(found, replace(options, observable=None)):
            return None
        found = replace(found, details=options.observable.added_to(found.details, Trajectory.load(file)))
        store.add_rows([(found, json.loads(found.set_values or "{}") | observed_columns(found.details))])
    if job.plan_key is not None and job.plan_key != found.plan_key:
        store.set_plan_key(found, job.plan_key)
    return RunRecord.of(job, found, store.file(found), repeated=True)


def is_sufficient(stored: StoredRun, options: RunOptions) -> bool:
    """Return whether a stored run has all that the options ask for."""
    if options.force or stored.is_recorded_failure:
        return False
    if stored.status == "refused":
        return True
    details = json.loads(stored.details or "{}")
    has_ledger = not options.ledger or details.get("ledger") is not None
    has_contacts = stored.contacts is not None or options.keep == "end"
    has_observed = options.observable is None or options.observable.has_observed(details)
    return has_ledger and has_contacts and has_observed and (stored.path is not None or options.keep != "all")


def is_audited(stored: StoredRun) -> bool:
    """Return whether the missed contacts of a stored run were counted."""
    return stored.missed_contacts is not None


def store_run(store: Store, job: Job, completed: CompletedRun, damaged: str | None = None) -> RunRecord:
    """Store a computed run, and return its record; a run with the same id is replaced.

    Raises:
        StoreError: the store cannot be used.
    """
    values = dict(job.point) | observed_columns(completed.stored.details)
    row = store.add(completed.stored, completed.arrays, values=values, replace_run=True)
    return RunRecord.of(job, row, store.file(row), repeated=False, damaged=damaged, computed=completed.trajectory)


def with_earlier_audit(job: Job, store: Store | None, options: RunOptions) -> RunOptions:
    """Return the options with an audit if the stored run that is replaced has one, so that no figure is lost."""
    if store is None or options.audit:
        return options
    found = store.find(job.run_id or identify(job)[1])
    return replace(options, audit=found is not None and is_audited(found))


def identify(job: Job) -> tuple[Settings, str]:
    """Return the resolved settings of a job, and the id of its run."""
    settings = engine_named(job.engine).resolve(job.scene, job.scene.solver)
    if job.player is None:
        game, deciding = None, versions(job.engine)
    else:  # a player may try its actions on another engine
        game, deciding = job.player.to_dict(job.scene), versions()
    return settings, run_id(job.scene, job.engine, settings, job.scene.world.seed, deciding, job.actions, game)


def _stored(job: Job, number: str, trajectory: Trajectory) -> StoredRun:
    return StoredRun.of(
        trajectory,
        number,
        scene=job.label,
        values=dict(job.point),
        plan_key=job.plan_key,
        details=details_of(trajectory, job.scene, job.player is not None),
    )
