"""Many worlds of one scene, advanced by one compiled call: for environments that learn from many episodes at once."""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.base import BEYOND
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.frame_rows import FrameRows, no_rows
from sandbox.engines.common.kernel import bare_kernel
from sandbox.engines.common.state_bounds import first_beyond
from sandbox.engines.contract import Divergence, Members, WorldStates
from sandbox.engines.reference.collision import ConvexPipeline
from sandbox.engines.reference.compiled_stepper import CompiledStepper, step_scratch
from sandbox.engines.reference.piece_kernels import PieceColumns, advance_pieces
from sandbox.engines.reference.step import WorldState
from sandbox.engines.reference.step_kernels import (
    DONE,
    STOPPED,
    BodyColumns,
    CompiledJoints,
    SolverState,
    StepConstants,
    StepLog,
    StepScratch,
    WallColumns,
    copy_state,
)
from sandbox.scene.description.world import Settings

MAX_CONTACTS = 4096
"""Largest number of contacts that a scene may have at once: each world has memory for all that its shapes can make"""


class WorldColumns(NamedTuple):
    """States of M worlds with N bodies and F static elements, with memory for C contacts."""

    x: FloatArray
    """(M, 2, N, 3) poses, m and rad, and velocities"""
    previous: FloatArray
    """(M, 2, N, 3) before the last step"""
    key: IntArray
    """(M, C), as in `SolverState`"""
    impulse: FloatArray
    """(M, C, 2)"""
    pseudo_velocity: FloatArray
    """(M, N, 3)"""
    level: FloatArray
    """(M, T) of the thrusts that act"""
    counts: IntArray
    """(M, 7)"""
    steps: IntArray
    """(M,) steps made since the start"""
    code: IntArray
    """(M,) return code of the last step"""
    touched: BoolArray
    """(M, N, N + F), as in `WorldStates`"""
    open: BoolArray
    """(M, N, N + F) the same of the last substep"""


@bare_kernel
def advance_worlds(
    number: StepConstants,
    bodies: BodyColumns,
    pieces: PieceColumns,
    walls: WallColumns,
    joints: CompiledJoints,
    worlds: WorldColumns,
    scratch: StepScratch,
    frames: FrameRows,
    path: FloatArray,
    log: StepLog,
    steps: IntArray,
) -> None:
    """Advance worlds; a step with a contact, or after which a body is not within its bounds, is the last one.

    Args:
        number: numbers.
        bodies: constant arrays.
        pieces: likewise.
        walls: likewise.
        joints: none.
        worlds: states.
        scratch: memory.
        frames: no rows.
        path: no path.
        log: rows for the contacts of a step.
        steps: (M,) largest numbers of steps; replaced by the numbers made.
    """
    for m in range(len(steps)):
        # No broad phase is needed, whose order the empty keys stand for.
        state = SolverState(
            worlds.x[m],
            worlds.key[m],
            worlds.impulse[m],
            worlds.pseudo_velocity[m],
            worlds.key[m, :0],
            worlds.level[m],
            worlds.counts[m],
        )
        wanted, made, touches = steps[m], 0, False
        while made < wanted and worlds.code[m] == DONE and not touches:
            copy_state(state.x, worlds.previous[m])
            _, _, _, worlds.code[m] = advance_pieces(
                number,
                bodies,
                pieces,
                walls,
                joints,
                state,
                scratch,
                frames,
                path,
                log,
                worlds.steps[m],
                1,
                1.0,
                False,
            )
            made += 1
            worlds.steps[m] += 1
            touches = note_contacts(log, number.substeps, worlds.touched[m], worlds.open[m])
        steps[m] = made


@bare_kernel
def note_contacts(log: StepLog, substeps: int, touched: BoolArray, is_open: BoolArray) -> bool:
    """Write which bodies touched what in a step, and what was in contact at its end; return whether any did.

    Args:
        log: contacts of the step.
        substeps: of the step.
        touched: (N, N + F), replaced: contacts of all substeps, and those that were open before.
        is_open: (N, N + F), replaced: contacts of the last substep.
    """
    count, touches = len(touched), False
    for body in range(count):
        for other in range(touched.shape[1]):
            touched[body, other] = is_open[body, other]
            touches = touches or touched[body, other]
            is_open[body, other] = False
    for row in range(log.end[substeps]):
        first, second = log.pair[row, 0], log.pair[row, 1]
        other = second if second >= 0 else count - 1 - second
        touched[first, other] = touches = True
        if second >= 0:
            touched[second, first] = True
        if row >= log.end[substeps - 1]:
            is_open[first, other] = True
            if second >= 0:
                is_open[second, first] = True
    return touches


class ConvexWorldBatch:
    """Worlds of convex bodies that cannot touch each other, as `WorldBatch`: ships above a landscape, for example."""

    def __init__(self, store: BodyStore, settings: Settings, count: int) -> None:
        """Create worlds of a scene for which `is_suitable` is true; `restart` starts each."""
        self._store, self._world = store, WorldState(store, settings)
        self._can_leave, self._bounds = store.present & ~store.bodies.fixed, store.scene.world.bounds
        n, contacts = len(store.radius), _max_contacts(self._world)
        self._constants = CompiledStepper(self._world, store, settings).constants
        self._scratch = step_scratch(n, contacts)
        rows = settings.substeps * (2 * contacts + 64)
        self._log = StepLog(
            np.zeros(settings.substeps + 1, np.int64),
            np.empty(settings.substeps, np.bool_),
            np.empty((rows, 2), np.int64),
            np.empty((rows, 6)),
        )
        self._thrusts = self._world.field.thrust_indices
        self.thrust_level = np.tile(store.throttles, (count, 1))
        """(M, T) level of each thrust of the scene in each world"""
        columns = n + len(store.scene.fixed)
        self._worlds = worlds = WorldColumns(
            x=np.zeros((count, 2, n, 3)),
            previous=np.zeros((count, 2, n, 3)),
            key=np.zeros((count, contacts), np.int64),
            impulse=np.zeros((count, contacts, 2)),
            pseudo_velocity=np.zeros((count, n, 3)),
            level=np.zeros((count, len(self._thrusts))),
            counts=np.zeros((count, 7), np.int64),
            steps=np.zeros(count, np.int64),
            code=np.zeros(count, np.int64),
            touched=np.zeros((count, n, columns), np.bool_),
            open=np.zeros((count, n, columns), np.bool_),
        )
        self.states = WorldStates(
            time=np.zeros(count),
            previous_time=np.zeros(count),
            now=_members(worlds.x),
            previous=_members(worlds.previous),
            present=np.tile(store.present, (count, 1)),
            touched=worlds.touched,
            diverged=np.zeros(count, np.bool_),
        )
        """as they are after the last call"""

    @staticmethod
    def is_suitable(world: WorldState, store: BodyStore, settings: Settings) -> bool:
        """Return whether a world has only bodies that touch nothing but static elements, and no joints."""
        return (
            CompiledStepper.is_suitable(world, store, settings)
            and isinstance(world.pipeline, ConvexPipeline)
            and not store.contact_matrix.mutual
            and not len(store.joints)
            and not store.has_lifetimes
            and world.x.shape[2] == 3
            and _max_contacts(world) <= MAX_CONTACTS
        )

    def restart(self, worlds: IntArray, start: Members) -> None:
        """Set worlds, by their (K,) indices, to time 0 and start states of K members."""
        columns = self._worlds
        for array in (columns.pseudo_velocity, columns.counts, columns.steps, columns.code):
            array[worlds] = 0
        columns.touched[worlds] = columns.open[worlds] = False
        columns.x[worlds, 0, :, :2], columns.x[worlds, 0, :, 2] = start.position, start.angle
        columns.x[worlds, 1, :, :2], columns.x[worlds, 1, :, 2] = start.velocity, start.angular_velocity
        columns.previous[worlds] = columns.x[worlds]
        self.thrust_level[worlds] = self._store.throttles
        self.states.present[worlds] = self._store.present
        for times in (self.states.time, self.states.previous_time):
            times[worlds] = 0.0
        self.states.diverged[worlds] = False

    def advance(self, steps: IntArray) -> IntArray:
        """Advance each world by at most so many steps, (M,), as `WorldBatch.advance`.

        Raises:
            ValueError: a world that has to be restarted is to be advanced.
        """
        worlds, made = self._worlds, steps.copy()
        if (worlds.code[steps > 0] != DONE).any():
            raise ValueError("a world whose body was removed or diverged cannot be advanced; restart it")
        worlds.level[:] = self.thrust_level[:, self._thrusts]
        with np.errstate(all="ignore"):
            advance_worlds(*self._constants, worlds, self._scratch, no_rows(), NO_PATH, self._log, made)
        assert not (worlds.code == STOPPED).any(), "there is memory for all contacts"
        states = self.states
        states.time[:] = worlds.steps * self._constants[0].dt
        states.previous_time[:] = np.maximum(worlds.steps - 1, 0) * self._constants[0].dt
        for world in np.flatnonzero((worlds.code != DONE) & (made > 0)).tolist():
            self._remove_outside(world)
        return made

    def divergence(self, world: int) -> Divergence:
        """Return the description of a diverged state."""
        return Divergence(float(self.states.time[world]), self._store.bodies.names[self._first_beyond(world)], BEYOND)

    def _remove_outside(self, world: int) -> None:
        """Note whether a world diverged, or else which bodies have left the bounds of the scene."""
        self.states.diverged[world] = self._first_beyond(world) >= 0
        if not self.states.diverged[world] and self._bounds is not None:
            low, high = self._bounds
            position = self.states.now.position[world]
            outside = ((position < low) | (position > high)).any(axis=1)
            removed = outside & self._can_leave
            self.states.present[world, removed] = False
            self.states.now.velocity[world, removed], self.states.now.angular_velocity[world, removed] = 0.0, 0.0

    def _first_beyond(self, world: int) -> int:
        now = self.states.now
        state = now.position[world], now.velocity[world], now.angle[world], now.angular_velocity[world]
        position, velocity, angle, spin = (array.copy() for array in state)
        return first_beyond(position, velocity, angle, spin, np.zeros((len(self._can_leave), 2)))


NO_PATH: FloatArray = np.empty((0, 0, 2))


def _members(x: FloatArray) -> Members:
    """Return views of states (M, 2, N, 3)."""
    return Members(x[:, 0, :, :2], x[:, 1, :, :2], x[:, 0, :, 2], x[:, 1, :, 2])


def _max_contacts(world: WorldState) -> int:
    """Return the largest number of contacts of pieces with planes and segments: two points of each pair."""
    pipeline = world.pipeline
    assert isinstance(pipeline, ConvexPipeline)
    return 2 * (pipeline.plane_tests + len(pipeline.segment_boxes.index) * len(pipeline.pieces.radius)) + 1
