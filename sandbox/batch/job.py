"""One job: run it, or fetch its stored run, and describe the run as a row."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandbox.action import actions_to_json, in_order
from sandbox.batch.plan import Job
from sandbox.batch.run_row import FinalBodyState, GameResult, ReplayResult, RunLedger, RunRow
from sandbox.batch.store import Store, StoreError, run_id
from sandbox.engines.registry import engine_named
from sandbox.jsonable import finite
from sandbox.measure.metrics.contacts import collisions, first_collision
from sandbox.measure.metrics.energy import LedgerDocument, ledger_of
from sandbox.measure.run.runner import run, run_without_frames
from sandbox.progress import Progress
from sandbox.provenance import versions
from sandbox.resource_limits import TooLargeError
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.signals import defer_interrupt, reraise_interrupt
from sandbox.trajectory import Trajectory

GAME = ("score", "over", "player", "otherwise")
"""Keys of `info["game"]` in a stored run, in the order of the fields of `GameResult`."""


@dataclass(frozen=True)
class RunOptions:
    """How jobs are run, and what their rows contain. Picklable: it travels to the workers."""

    store: Path | None = None
    """folder of the store"""
    audit: bool = True
    """count the contacts that the engine misses"""
    ledger: bool = False
    """keep the energy ledger; a stored run without one is run again and replaced"""
    final: bool = True
    """rows contain the final state"""


@dataclass(frozen=True)
class RunRecord:
    """A completed run."""

    job: Job
    id: str
    trajectory: Trajectory
    path: Path | None
    """of the stored arrays"""
    repeated: bool
    """fetched from the store, not run"""
    damaged: str | None = None
    """file and fault of the damaged stored run that this one replaces"""

    @property
    def replayed(self) -> bool | None:
        """Whether a session ended in its recorded state, bit for bit, and score; None if no state was recorded."""
        wanted, found = self.job.state_hash, self.trajectory.info.get("state_hash")
        if wanted is None or found is None:
            return None
        return bool(wanted == found) and self.job.score in (None, self.score)

    @property
    def _game(self) -> dict[str, Any]:
        return self.trajectory.info.get("game") or {}

    @property
    def score(self) -> float | None:
        """Final score of the game; None if none was played."""
        return self._game.get("score")

    def row(self, final: bool = True, ledger: bool = False) -> RunRow:
        """Return the figures of the run.

        Args:
            final: include the final state.
            ledger: include the energy ledger.
        """
        run, info = self.trajectory, self.trajectory.info
        seconds, steps = info["seconds"], info["steps"]
        simulated = float(run.time[-1]) if len(run.time) else 0.0
        return RunRow(
            id=self.id,
            scene=self.job.label,
            title=self.job.scene.title,
            engine=self.job.engine,
            settings=info["settings"],
            seed=info["seed"],
            set=dict(self.job.point),
            status=run.status,
            reason=run.reason,
            seconds=finite(seconds),
            steps=steps,
            steps_per_second=finite(steps / seconds if seconds else None),
            work=info.get("work", {}),
            realtime_factor=finite(simulated / seconds if seconds else None),
            energy_start=finite(info["energy_start"]),
            energy_end=finite(info["energy_end"]),
            joint_error=finite(info.get("joint_error")),
            broken_joints=info.get("broken", 0),
            contacts=collisions(run),
            first_contact=first_collision(run),
            missed_contacts=run.missed_contacts,
            retired={
                str(name): time for name, time in zip(run.names, run.retired_time.tolist(), strict=True) if time == time
            },
            pocketed=self._pocketed(),
            state_hash=info.get("state_hash"),
            replay=ReplayResult(self.replayed) if self.job.recorded else None,
            game=GameResult(*map(self._game.get, GAME)) if self.job.player is not None else None,
            account=RunLedger(self._ledger()) if ledger else None,
            final=self._final() if final else None,
            path=None if self.path is None else str(self.path),
            repeated=self.repeated,
            damaged=self.damaged,
        )

    def _ledger(self) -> LedgerDocument | None:
        if not len(self.trajectory.energy):
            return None
        return ledger_of(self.trajectory, self.job.scene).document()

    def _final(self) -> dict[str, FinalBodyState]:
        run = self.trajectory
        if not len(run.time):
            return {}
        spins = map(tuple, run.spin[-1].tolist()) if len(run.spin) else [None] * len(run.names)
        states = zip(
            map(tuple, run.position[-1].tolist()),
            map(tuple, run.velocity[-1].tolist()),
            run.angle[-1].tolist(),
            run.angular_velocity[-1].tolist(),
            spins,
            strict=True,
        )
        return {name: FinalBodyState(*state) for name, state in zip(run.names.tolist(), states, strict=True)}

    def _pocketed(self) -> dict[str, str]:
        """Return the pocket of each captured ball, which lies exactly at the centre of the pocket."""
        run, scene = self.trajectory, self.job.scene
        if not len(run.time):
            return {}
        names = scene.fixed_names[len(scene.fixed) :]
        holes = {pocket.position: name for pocket, name in zip(scene.pockets, names, strict=False)}  # zones follow
        places = zip(run.names.tolist(), run.position[-1].tolist(), strict=True)
        return {name: holes[x, y] for name, (x, y) in places if (x, y) in holes}


@reraise_interrupt()
def run_or_fetch(
    job: Job,
    store: Store | None = None,
    options: RunOptions = RunOptions(),
    progress: Callable[[float], None] | None = None,
    done: Callable[[RunRecord], None] | None = None,
) -> RunRecord:
    """Fetch the stored run of a job, or run the job and store the run.

    A stored run that is damaged, or does not belong to its id, is run again and replaced.

    Args:
        job: what to run.
        store: where the run is looked up and stored; `options.store` is ignored.
        options: how to run it.
        progress: called with the fraction of the run that is done.
        done: called with the record; no interrupt comes between storing the run and this call.

    Raises:
        TooLargeError: the frames would not fit into memory, or those of the stored run do not.
        StoreError: the store cannot be used, or the file of this run cannot be opened.
        SceneError: the game of the scene cannot be played by the player.
    """
    settings, number = _identified(job)
    audit = options.audit
    found = store.find(number) if store is not None else None
    damaged: str | None = None
    if store is not None and found is not None:
        try:
            stored = _stored(store.file(found), job, settings)
        except TooLargeError:
            raise
        except ValueError as error:
            damaged = str(error)
        else:
            has_ledger = len(stored.energy) or not options.ledger or stored.status == "refused"
            if has_ledger and not _is_recorded_failure(stored):
                record = RunRecord(job, number, stored, store.file(found), repeated=True)
                if done is not None:
                    done(record)
                return record
            audit = audit or bool(stored.info["audited"])  # the new run has all that the replaced one had
    bout = None if job.player is None else job.player.start_game(job.scene, job.label)

    def report(state: Progress) -> None:
        if progress is not None:
            progress(state.fraction or 0.0)

    trajectory = run(
        job.scene, job.engine, actions=job.actions, audit=audit, account=options.ledger, on_progress=report, bout=bout
    )
    with defer_interrupt():
        path = None if store is None else store.file(store.add(trajectory, number, replace=found is not None))
        record = RunRecord(job, number, trajectory, path, repeated=False, damaged=damaged)
        if done is not None:
            done(record)
    return record


def _stored(file: Path, job: Job, settings: Settings) -> Trajectory:
    """Read the stored run of a job.

    Args:
        file: file of its arrays.
        job: the job.
        settings: its resolved settings.

    Raises:
        StoreError: the file cannot be opened.
        TooLargeError: its arrays would not fit into memory.
        ValueError: it is damaged, or the run of another job; `str()` names the file and the fault.
    """
    try:
        run = Trajectory.load(file)
    except TooLargeError as error:
        raise TooLargeError(f"{error}; delete the file to repeat the run") from None
    except OSError as error:
        raise StoreError(f"{file}: {error.strerror or error}; the file must be readable") from None
    scene, stated = to_document(job.scene), dict(run.info["scene"])
    for table in ("solver", "play") if job.player is None else ("solver",):  # they do not affect the run
        scene.pop(table, None)
        stated.pop(table, None)
    wanted: dict[str, Any] = {"engine": job.engine, "seed": job.scene.world.seed, "versions": dict(versions())}
    if run.status != "refused":  # an engine that refuses a scene need not have resolved its settings
        wanted["settings"] = settings.model_dump(mode="json")
    if job.player is None:  # otherwise the actions of the game are among them
        wanted["actions"] = actions_to_json(in_order(job.actions))
    different = [] if scene == stated else ["scene"]
    different += [key for key, value in wanted.items() if run.info.get(key) != value]
    if len(run.time) and bool(run.info.get("game")) != (job.player is not None):
        different.append("game")
    if different:
        raise ValueError(f"{file} is not the run of its id: its info.{different[0]} is different")
    return run


def record_failure(job: Job, store: Store | None, reason: str) -> RunRecord:
    """Return, and store, a failed run without frames, for a job that ends its process; the next call runs it again.

    Raises:
        StoreError: the store cannot be used.
    """
    settings, number = _identified(job)
    trajectory = run_without_frames(job.scene, job.engine, settings, in_order(job.actions), "failed", reason)
    with defer_interrupt():
        path = store.file(store.add(trajectory, number)) if store is not None else None
    return RunRecord(job, number, trajectory, path, repeated=False)


def _is_recorded_failure(trajectory: Trajectory) -> bool:
    """Tell whether a run is one of `record_failure`: a run that failed by itself has at least its first frame."""
    return trajectory.status == "failed" and not len(trajectory.time)


def _identified(job: Job) -> tuple[Settings, str]:
    """Return the settings of a job, resolved if its engine can run it, and the id of its run."""
    engine = engine_named(job.engine)
    settings = job.scene.solver
    if not engine.missing(job.scene, settings):
        settings = engine.resolve(job.scene, settings)
    game = None if job.player is None else job.player.to_dict(job.scene)
    return settings, run_id(job.scene, job.engine, settings, job.scene.world.seed, versions(), job.actions, game)
