"""Member runs: runs of one scene from different starts, of which only the ends are kept, in one compiled call.

Of each task, the first run is an ordinary one. Its end must be that of the compiled call, bit for bit, and its row is
the model for the others; if it differs, or if the engine has no compiled code for the scene, all runs are ordinary
ones.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.batch.job import CompletedRun, Job, RunOptions, Values, identify, run_job
from sandbox.batch.run_row import state_documents
from sandbox.batch.start_states import StartStates
from sandbox.batch.store import id_of_document
from sandbox.batch.stored_run import StoredRun, dump_json, hash_of
from sandbox.engines.contract import Members
from sandbox.engines.switching import start
from sandbox.measure.metrics.energy import energies
from sandbox.measure.run.ensemble import run_members
from sandbox.provenance import versions
from sandbox.resource_limits import TooLargeError
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import Override, SceneText
from sandbox.trajectory import Contacts, Frame, Trajectory


@dataclass(frozen=True)
class Member:
    """A run of a member task."""

    where: Values
    """swept and sampled values, and the seed, as the scene is read with them"""
    values: Values
    """all values that are set"""
    plan_key: str


@dataclass(frozen=True)
class MemberTask:
    """Runs of one scene that differ in start values only, of which only the ends are kept. Picklable."""

    label: str
    """the scene as the user named it"""
    source: SceneText
    engine: str
    overrides: tuple[Override, ...]
    """set in every run"""
    keys: tuple[str, ...]
    """varied keys, for which `is_start_key` is true"""
    members: tuple[Member, ...]
    options: RunOptions
    versions: Mapping[str, str]
    """of the process that submits the task"""

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.members)

    def outcomes(self) -> Iterator[CompletedRun | None]:
        """Yield the outcome of each run; None if it must be an ordinary one."""
        first = self.members[0]
        rows: Iterator[CompletedRun | None] | None = None
        try:
            scene = self.source.scene((*self.overrides, *first.where))
            job = Job(self.label, scene, self.engine, (), first.values, plan_key=first.plan_key)
            pilot = run_job(job, self.options)
        except (SceneError, TooLargeError):  # the ordinary run reports it
            yield None
        else:
            yield replace(pilot, trajectory=None)
            states = StartStates.of(scene, self.keys)
            if states is not None and pilot.trajectory is not None:
                rows = _member_rows(self, states, job, pilot.stored, pilot.trajectory)
        yield from (None for _ in self.members[1:]) if rows is None else rows


def _member_rows(
    task: MemberTask, states: StartStates, job: Job, pilot: StoredRun, trajectory: Trajectory
) -> Iterator[CompletedRun | None] | None:
    """Return the runs of a task after the first one, of which it has the row and the trajectory; None without any."""
    if pilot.status != "ok" or len(task.members) < 2:
        return None
    began = perf_counter()
    setup = Setup.of(states.scene)
    starts, valid = states.members([member.where for member in task.members])
    ends = Members(*(array.copy() for array in starts))
    is_done = run_members(setup, task.engine, states.scene.solver, ends) & valid
    if not is_done[0]:
        return None
    simulation = start(setup, task.engine, states.scene.solver)
    frame = replace(simulation.frame(), time=float(trajectory.time[-1]))
    simulation.close()
    if _state_hash(frame, ends, 0) != pilot.state_hash:
        return None
    seconds = (perf_counter() - began) / len(task.members)
    return _ComputedMembers(task, states, pilot, starts, ends, frame, is_done, seconds).rows(identify(job)[0])


@dataclass(frozen=True, eq=False)
class _ComputedMembers:
    """The runs of a task, computed in one call."""

    task: MemberTask
    states: StartStates
    pilot: StoredRun
    """row of the first run, the model for the others"""
    starts: Members
    ends: Members
    frame: Frame
    """end of a run: its time, and what is the same for all"""
    is_done: BoolArray
    """(M,) whether each run was computed"""
    seconds: float
    """s, computing time of a run"""

    def rows(self, settings: Settings) -> Iterator[CompletedRun | None]:
        """Yield the runs after the first one; None for one that was not computed.

        Args:
            settings: settings as the engine resolves them.
        """
        setup, engine = Setup.of(self.states.scene), self.task.engine
        energy_start, energy_end = (_energies(setup, each).tolist() for each in (self.starts, self.ends))
        details = json.loads(self.pilot.details or "{}")
        for m, member in enumerate(self.task.members[1:], 1):
            if not self.is_done[m]:
                yield None
                continue
            document = self.states.scene_document(member.where)
            seed = int(document.get("world", {}).get("seed", 0))
            columns = {name: getattr(self.ends, name)[m] for name in Members._fields}
            row = replace(
                self.pilot,
                id=id_of_document(document, engine, settings, seed, versions(engine)),
                scene_hash=hash_of(document),
                seed=seed,
                seconds=self.seconds,
                energy_start=energy_start[m],
                energy_end=energy_end[m],
                set_values=dump_json(dict(member.values)),
                state_hash=_state_hash(self.frame, self.ends, m),
                plan_key=member.plan_key,
                details=dump_json({**details, "final": state_documents(setup.bodies.names, columns)}),
            )
            yield CompletedRun(row, None, self.seconds)


def _state_hash(frame: Frame, ends: Members, m: int) -> str:
    """Return the hash of the end of a run; `frame` has the time, and what is the same for all."""
    return replace(frame, **{name: getattr(ends, name)[m] for name in Members._fields}).state_hash()


def _energies(setup: Setup, states: Members) -> FloatArray:
    """Return the energy of each state, (M,) J."""
    count = len(states.position)
    none = np.full(len(setup.bodies), np.nan)
    frames = {"time": np.arange(count, dtype=np.float64), **states._asdict()}
    info: dict[str, Any] = {"status": "ok"}
    return energies(Trajectory.from_frames(frames, setup.bodies.names, Contacts.none(), none, info), setup).total
