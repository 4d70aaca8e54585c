"""Outcomes: runs made, or found in the store, and the row that tells of each."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandbox.action import actions_to_json, in_order
from sandbox.batch.plan import Job
from sandbox.batch.store import Store, StoreError, run_id
from sandbox.engines.registry import engine_named
from sandbox.interrupt import heeded, uninterrupted
from sandbox.measure.collisions import collisions, first_collision
from sandbox.measure.finite import finite
from sandbox.measure.ledger import ledger_of
from sandbox.measure.run import Progress, run, run_without_frames
from sandbox.measure.versions import versions
from sandbox.resource_limits import TooLargeError
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.trajectory import Trajectory

GAME = ("score", "over", "player", "otherwise")
"""What a row tells of a game."""


@dataclass(frozen=True)
class Outcome:
    """A run that is over."""

    job: Job
    id: str
    trajectory: Trajectory
    path: Path | None
    """of the stored arrays"""
    repeated: bool
    """It was in the store already, and was not run again."""
    damaged: str | None = None
    """file and fault of the stored run that this one replaces; None where there was no such file"""

    @property
    def replayed(self) -> bool | None:
        """Whether a recorded session ended in its own state, bit for bit, and score; None where none is known."""
        wanted, found = self.job.state_hash, self.trajectory.info.get("state_hash")
        if wanted is None or found is None:
            return None
        return bool(wanted == found) and self.job.score in (None, self.score)

    @property
    def _game(self) -> dict[str, Any]:
        return self.trajectory.info.get("game") or {}

    @property
    def score(self) -> float | None:
        """Of the game, where one was played."""
        return self._game.get("score")

    def row(self, final: bool = True, ledger: bool = False) -> dict[str, Any]:
        """Return the run as one JSON object; figures that are not finite are null.

        Args:
            final: with the final state.
            ledger: with where energy went, null where no account was kept.
        """
        run, info = self.trajectory, self.trajectory.info
        seconds, steps = info["seconds"], info["steps"]
        simulated = float(run.time[-1]) if len(run.time) else 0.0
        return {
            "id": self.id,
            "scene": self.job.label,
            "title": self.job.scene.title,
            "engine": self.job.engine,
            "settings": info["settings"],
            "seed": info["seed"],
            "set": dict(self.job.point),
            "status": run.status,
            "reason": run.reason,
            "seconds": finite(seconds),
            "steps": steps,
            "steps_per_second": finite(steps / seconds if seconds else None),
            "work": info.get("work", {}),
            "realtime_factor": finite(simulated / seconds if seconds else None),
            "energy_start": finite(info["energy_start"]),
            "energy_end": finite(info["energy_end"]),
            "joint_error": finite(info.get("joint_error")),
            "broken_joints": info.get("broken", 0),
            "contacts": collisions(run),
            "first_contact": first_collision(run),
            "missed_contacts": run.missed_contacts,
            "retired": {
                str(name): time for name, time in zip(run.names, run.retired_time.tolist(), strict=True) if time == time
            },
            "pocketed": self._pocketed(),
            "state_hash": info.get("state_hash"),
            **({"replayed": self.replayed} if self.job.recorded else {}),
            **({key: self._game.get(key) for key in GAME} if self.job.player is not None else {}),
            **({"ledger": self._ledger()} if ledger else {}),
            **({"final": self._final()} if final else {}),
            "path": None if self.path is None else str(self.path),
            "repeated": self.repeated,
            **({} if self.damaged is None else {"damaged": self.damaged}),
        }

    def _ledger(self) -> dict[str, Any] | None:
        return ledger_of(self.trajectory, self.job.scene).document() if len(self.trajectory.energy) else None

    def _final(self) -> dict[str, Any]:
        run = self.trajectory
        if not len(run.time):
            return {}
        columns = zip(
            run.names.tolist(),
            run.position[-1].tolist(),
            run.velocity[-1].tolist(),
            run.angle[-1].tolist(),
            run.angular_velocity[-1].tolist(),
            run.spin[-1].tolist() if len(run.spin) else [None] * len(run.names),
            strict=True,
        )
        return {
            name: {
                "position": [finite(x) for x in position],
                "velocity": [finite(v) for v in velocity],
                "angle": finite(angle),
                "angular_velocity": finite(rate),
                **({} if spin is None else {"spin": [finite(w) for w in spin]}),
            }
            for name, position, velocity, angle, rate, spin in columns
        }

    def _pocketed(self) -> dict[str, str]:
        """Return which balls lie in which pockets in the end: at their centres, to the bit."""
        run, scene = self.trajectory, self.job.scene
        if not len(run.time):
            return {}
        names = scene.fixed_names[len(scene.fixed) :]
        holes = {pocket.position: name for pocket, name in zip(scene.pockets, names, strict=False)}  # zones follow
        places = zip(run.names.tolist(), run.position[-1].tolist(), strict=True)
        return {name: holes[x, y] for name, (x, y) in places if (x, y) in holes}


@heeded()
def execute(
    job: Job,
    store: Store | None = None,
    progress: Progress | None = None,
    audit: bool = True,
    account: bool = False,
    done: Callable[[Outcome], None] | None = None,
) -> Outcome:
    """Make a run, and store it where there is a store; one that is stored already is read, not repeated.

    A stored run that is damaged, or is another run than its id says, is made again and replaced.

    Args:
        job: what to run.
        store: where to look it up and put it.
        progress: who is told how far it is.
        audit: count the contacts that the engine misses.
        account: keep the account of energy; a run that was stored without one is made again, and put in its place.
        done: who is told of the outcome, with no interrupt between storing and telling.

    Raises:
        TooLargeError: the frames would not fit into memory, or those of the stored run do not.
        StoreError: the store cannot be used, or the file of this run cannot be opened.
        SceneError: the game of the scene cannot be played so.
    """
    settings, number = _identified(job)
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
            accounted = len(stored.energy) or not account or stored.status == "refused"
            if accounted and not _was_given_up(stored):
                outcome = Outcome(job, number, stored, store.file(found), repeated=True)
                if done is not None:
                    done(outcome)
                return outcome
            audit = audit or bool(stored.info["audited"])  # what was known stays known
    bout = None if job.player is None else job.player.start_game(job.scene, job.label)
    trajectory = run(
        job.scene, job.engine, actions=job.actions, audit=audit, account=account, progress=progress, bout=bout
    )
    with uninterrupted():
        path = None if store is None else store.file(store.add(trajectory, number, replace=found is not None))
        outcome = Outcome(job, number, trajectory, path, repeated=False, damaged=damaged)
        if done is not None:
            done(outcome)
    return outcome


def _stored(file: Path, job: Job, settings: Settings) -> Trajectory:
    """Read the stored run of a job.

    Args:
        file: of its arrays.
        job: what was run.
        settings: the resolved ones.

    Raises:
        StoreError: the file cannot be opened.
        TooLargeError: its arrays would not fit into memory.
        ValueError: it is damaged, or another run; `str()` names the file and the fault.
    """
    try:
        run = Trajectory.load(file)
    except TooLargeError as error:
        raise TooLargeError(f"{error}; delete the file to repeat the run") from None
    except OSError as error:
        raise StoreError(f"{file}: {error.strerror or error}; the file must be readable") from None
    scene, stated = to_document(job.scene), dict(run.info["scene"])
    for table in ("solver", "play") if job.player is None else ("solver",):  # which do not decide how a run goes
        scene.pop(table, None)
        stated.pop(table, None)
    wanted: dict[str, Any] = {"engine": job.engine, "seed": job.scene.world.seed, "versions": dict(versions())}
    if run.status != "refused":  # an engine that refuses a run need not have resolved its settings
        wanted["settings"] = settings.model_dump(mode="json")
    if job.player is None:  # else the actions of the game are among them
        wanted["actions"] = actions_to_json(in_order(job.actions))
    different = [] if scene == stated else ["scene"]
    different += [key for key, value in wanted.items() if run.info.get(key) != value]
    if len(run.time) and bool(run.info.get("game")) != (job.player is not None):
        different.append("game")
    if different:
        raise ValueError(f"{file} is not the run of its id: its info.{different[0]} is different")
    return run


def give_up(job: Job, store: Store | None, reason: str) -> Outcome:
    """Return a failed run without frames, for a job that its process does not survive; the next call makes it again.

    Raises:
        StoreError: the store cannot be used.
    """
    settings, number = _identified(job)
    trajectory = run_without_frames(job.scene, job.engine, settings, in_order(job.actions), "failed", reason)
    with uninterrupted():
        path = store.file(store.add(trajectory, number)) if store is not None else None
    return Outcome(job, number, trajectory, path, repeated=False)


def _was_given_up(trajectory: Trajectory) -> bool:
    """Tell whether a stored run is one of `give_up`: a run that failed by itself has its first frame at least."""
    return trajectory.status == "failed" and not len(trajectory.time)


def _identified(job: Job) -> tuple[Settings, str]:
    """Return the settings that a job is run with, resolved where its engine can run it, and the id of its run."""
    engine = engine_named(job.engine)
    settings = job.scene.solver
    if not engine.missing(job.scene, settings):
        settings = engine.resolve(job.scene, settings)
    game = None if job.player is None else job.player.to_dict(job.scene)
    return settings, run_id(job.scene, job.engine, settings, job.scene.world.seed, versions(), job.actions, game)
