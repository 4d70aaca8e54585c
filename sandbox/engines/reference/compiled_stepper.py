"""Many steps of a world by compiled steps: arrays in and out, contacts into the log, runs from many starts."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from sandbox.arrays import ComplexArray, FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.contact_log import ContactBatch, ContactLog
from sandbox.engines.common.frame_rows import FrameRows, no_rows
from sandbox.engines.common.kernel import OptionalKernel
from sandbox.engines.common.workload import CONTACTS_PER_BODY, DETECTION_COST
from sandbox.engines.contract import PairRuns
from sandbox.engines.reference.ball_kernels import BALL_KERNEL, BallColumns, advance_balls
from sandbox.engines.reference.broad_phase import SegmentBoxes
from sandbox.engines.reference.collision import CollisionPipeline, ConvexPipeline, empty_manifolds
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.joint_data import select_joints
from sandbox.engines.reference.joint_rows import make_velocity_constraints
from sandbox.engines.reference.piece_kernels import PIECE_KERNEL, PieceColumns, advance_pieces
from sandbox.engines.reference.polygon_contacts import excluded_pair_keys
from sandbox.engines.reference.step import WorldState
from sandbox.engines.reference.step_kernels import (
    BROAD_PHASE_CODES,
    BROAD_TESTS,
    HAS_PSEUDO_VELOCITY,
    INTEGRATOR_CODES,
    KEYS,
    NO_PAIRS,
    STOPPED,
    UNCHECKED,
    BodyColumns,
    CompiledJoints,
    SolverState,
    StepConstants,
    StepLog,
    StepScratch,
    WallColumns,
)
from sandbox.engines.reference.velocity_solver import ImpulseSolver
from sandbox.scene.compile.joint_arrays import JointArrays
from sandbox.scene.description.world import Settings

OPTIONAL_KERNELS = (BALL_KERNEL, PIECE_KERNEL)
"""Kernels that are compiled only where that saves time"""

CAPACITY = 1 << 15
"""Contacts in the log of a call"""

MAX_SUBSTEPS = 1 << 14
"""Substeps of a call"""

MAX_WORK = 10_000_000
"""Contacts and joints × (iterations + `DETECTION_COST`) × substeps of a call: at 10 to 20 ns each, Ctrl-C and limits of
time act within some 0.2 s, but for a single step that takes longer"""

MAX_PATH = 1 << 17
"""Centres in the path of a call, for an observer"""


class CompiledSteps(NamedTuple):
    """Result of a call."""

    steps: int
    """whole steps"""
    substeps: int
    """substeps made of a step that is not complete"""
    frames: int
    """frames written"""
    code: int
    """`DONE`, `STOPPED` or `UNCHECKED`"""
    log: StepLog
    """valid until the next call"""
    path: FloatArray
    """(B + 1, N, 2)"""


class CompiledStepper:
    """Advances a world by compiled steps, as long as its forces and solver stay the same."""

    def __init__(self, world: WorldState, store: BodyStore, settings: Settings) -> None:
        """Prepare the arrays of a world for which `is_suitable` is true."""
        pipeline, solver = world.pipeline, world.impulses
        assert settings.integrator and settings.broad_phase and settings.slop is not None and settings.bias is not None
        self._world, self._pipeline, self.forces, self._store = world, pipeline, world.forces, store
        self._substeps = settings.substeps
        h, boxes, matrix = settings.h, pipeline.segment_boxes, store.contact_matrix
        bounds = store.scene.world.bounds
        low, high = ((-math.inf, -math.inf), (math.inf, math.inf)) if bounds is None else bounds
        has_pieces = isinstance(pipeline, ConvexPipeline)
        has_pairs = matrix.mutual if has_pieces else matrix.ball_ball
        self._numbers = StepConstants(
            h=h,
            dt=settings.dt,
            substeps=settings.substeps,
            iterations=settings.iterations,
            integrator=INTEGRATOR_CODES[settings.integrator],
            fraction=INTEGRATORS[settings.integrator].fraction,
            slop=settings.slop,
            bias=settings.bias,
            correction=solver.correction_rate(h),
            broad_phase=BROAD_PHASE_CODES[settings.broad_phase] if has_pairs else NO_PAIRS,
            max_tests=pipeline.max_pairs,
            max_contacts=solver.max_contacts,
            segment_width=boxes.max_width,
            segment_top=boxes.max_top,
            plane_tests=pipeline.plane_tests,
            began=store.setup.time,
            left=float(low[0]),
            bottom=float(low[1]),
            right=float(high[0]),
            top=float(high[1]),
        )
        self._bodies, self._walls = _body_columns(world, store), _wall_columns(store, pipeline.segment_boxes)
        self._kernel: Callable[..., tuple[int, int, int, int]] = advance_balls
        self._shapes: BallColumns | PieceColumns
        if isinstance(pipeline, ConvexPipeline):
            self._kernel, self._shapes = advance_pieces, _piece_columns(pipeline)
        else:
            self._shapes = _ball_columns(pipeline, store)
        self._log = StepLog(
            np.zeros(MAX_SUBSTEPS + self._substeps + 1, np.int64),
            np.empty(MAX_SUBSTEPS + self._substeps, np.bool_),
            np.empty((CAPACITY, 2), np.int64),
            np.empty((CAPACITY, 6)),
        )
        self._allocate(64)

    @staticmethod
    def is_suitable(world: WorldState, store: BodyStore, settings: Settings) -> bool:
        """Return whether a world needs nothing that compiled steps lack."""
        solver = world.solver
        return (
            settings.detection == "discrete"
            and type(solver) is ImpulseSolver
            and solver.is_plain
            and world.pipeline.filter is None
            and (world.joints is None or not world.joints.has_forces)
            and not world.field.attracting
            and world.field.tyres is None
            and world.limits is None
            and settings.broad_phase in BROAD_PHASE_CODES
            and settings.integrator in INTEGRATOR_CODES
            and not (world.records_work or world.records_joint_load)
            and len(store.radius) > 0
        )

    @staticmethod
    def kernel_for(world: WorldState) -> OptionalKernel:
        """Return the kernel that a world uses."""
        return PIECE_KERNEL if isinstance(world.pipeline, ConvexPipeline) else BALL_KERNEL

    def _joints(self) -> CompiledJoints:
        """Return the joints; a call changes the arrays of their rows."""
        solver = self._world.joints
        if solver is None:
            return CompiledJoints(_NO_JOINTS, make_velocity_constraints(_NO_JOINTS), np.array([math.inf]))
        return CompiledJoints(solver.constraints, solver.rows, np.array([solver.h]))

    def _allocate(self, contacts: int) -> None:
        """Allocate memory for a number of contacts in a substep."""
        self._capacity, self._scratch = contacts, step_scratch(len(self._bodies.mobile), contacts)

    @property
    def constants(self) -> tuple[StepConstants, BodyColumns, Any, WallColumns, CompiledJoints]:
        """First arguments of the kernel: what does not change from step to step, and the joints.

        The third are the `BallColumns` or `PieceColumns` that the kernel of the world takes.
        """
        return self._numbers, self._bodies, self._shapes, self._walls, self._joints()

    @property
    def is_full(self) -> bool:
        """Whether there is memory for no more contacts, so that the readable step has to be used."""
        return self._capacity >= MAX_CAPACITY

    def max_steps(self, *, observed: bool) -> int:
        """Return the largest number of steps of a call, at least 1."""
        bodies, joints = len(self._bodies.mobile), self._world.joints
        rows = max(CONTACTS_PER_BODY * bodies, len(self._world.memory.key))
        rows += 0 if joints is None else len(joints.rows.kind)
        substeps = min(MAX_SUBSTEPS, MAX_WORK // (rows * (self._numbers.iterations + DETECTION_COST)))
        if observed:
            substeps = min(substeps, MAX_PATH // bodies)
        return max(substeps // self._substeps, 1)

    def advance(
        self,
        begin: int,
        steps: int,
        frames: FrameRows,
        *,
        records: bool,
        observed: bool,
        until_contact: bool = False,
    ) -> CompiledSteps:
        """Make at most so many steps; the state of the world is that after them, and after the substeps beyond.

        Args:
            begin: number of steps made before.
            steps: largest number of steps, at most `max_steps`.
            frames: rows for the frames.
            records: whether to record contacts.
            observed: whether to record the path of the bodies.
            until_contact: whether the first step with contacts is the last one; only if they are recorded.
        """
        world, memory, pipeline, numbers = self._world, self._world.memory, self._pipeline, self._numbers
        known, substeps = len(memory.key), steps * numbers.substeps
        if known > self._capacity:
            self._allocate(2 * known)
        # The kernel computes angles even if nothing turns; they do not change then.
        turns, count, capacity = world.x.shape[2] == 3, world.x.shape[1], self._capacity
        x = np.empty((2, count, 3))
        x[:, :, : world.x.shape[2]] = world.x
        if not turns:
            x[0, :, 2], x[1, :, 2] = self._store.angle, 0.0
        key, impulse = np.empty(capacity, np.int64), np.empty((capacity, 2))
        key[:known], impulse[:known] = memory.key, memory.impulse
        order = pipeline.broad_phase_memory(x[0]) if numbers.broad_phase != NO_PAIRS else NO_ORDER
        counts = np.array([known, memory.has_pseudo_velocity, 0, 0, 0, 0, 0], np.int64)
        level = self._store.throttles[world.field.thrust_indices]
        state = SolverState(x, key, impulse, memory.pseudo_velocity, order, level, counts)
        log = self._log if records else NO_LOG
        path = np.empty((substeps + 1, count, 2) if observed else (0, 0, 2))
        if observed:
            path[0] = x[0, :, :2]
        warm_start = min(numbers.h / memory.h, 1.0)
        made, rest, written, code = self._kernel(
            *self.constants,
            state,
            self._scratch,
            frames,
            path,
            log,
            begin,
            steps,
            warm_start,
            until_contact,
        )
        substeps = (made + (code == UNCHECKED)) * numbers.substeps + rest
        if substeps:
            world.x = x if turns else x[:, :, :2].copy()
            memory.key, memory.impulse = key[: counts[KEYS]].copy(), impulse[: counts[KEYS]].copy()
            memory.has_pseudo_velocity, memory.h = bool(counts[HAS_PSEUDO_VELOCITY]), numbers.h
            names = "broad_tests", "pair_tests", "contacts", "contact_iterations", "joint_iterations"
            for name, amount in zip(names, counts[BROAD_TESTS:].tolist(), strict=True):
                world.work[name] += amount
            if world.joints is not None:
                world.joints.h = numbers.h
        if code == STOPPED and capacity < MAX_CAPACITY:
            self._allocate(4 * capacity)
        return CompiledSteps(made, rest, written, code, _first(log, substeps), path[: substeps + 1])


def step_scratch(bodies: int, contacts: int) -> StepScratch:
    """Return memory for a substep with so many bodies and contacts."""
    shape = (2, bodies, 3)
    return StepScratch(
        placed=np.empty(shape),
        after=np.empty(shape),
        change=np.empty(shape[1:]),
        pose=np.empty(shape[1:]),
        pair_keys=np.empty(4 * contacts, np.int64),
        segment_keys=np.empty(4 * contacts, np.int64),
        out=empty_manifolds(contacts),
        bounce=np.empty(contacts),
        impulse=np.empty((contacts, 2)),
        target=np.empty(contacts),
        total=np.empty(contacts),
    )


_NO_JOINTS = select_joints(JointArrays.none())

Cell = TypeVar("Cell", bound=np.generic)


def _own(array: npt.NDArray[Cell]) -> npt.NDArray[Cell]:
    """Return a copy, so that kernels are compiled for one kind of arrays: not for read-only or strided ones too."""
    return np.array(array, order="C")


def _body_columns(world: WorldState, store: BodyStore) -> BodyColumns:
    forces = world.forces
    turning = forces.constant[:, 2] if forces.constant.shape[1] == 3 else np.zeros(len(store.radius))
    return BodyColumns(
        constant=np.column_stack((forces.constant[:, :2], turning)),
        mobile=_own(np.broadcast_to(forces.mobile[:, 0], len(store.radius))),
        can_leave=store.present & ~store.bodies.fixed,
        inverse_mass=_own(store.inverse_mass),
        inverse_moment=_own(store.inverse_moment),
        restitution=_own(store.restitution.ravel()),
        tangential=_own(store.tangential),
        air=forces.air,
        thrusts=world.field.thrusts,
    )


def _wall_columns(store: BodyStore, boxes: SegmentBoxes) -> WallColumns:
    static = store.static_colliders
    return WallColumns(
        planes=_own(static.planes),
        plane_collider=_own(static.plane_collider),
        collider_surface=_own(store.fixed_surface),
        segments=_own(static.segments),
        segment_joints=_own(static.joints),
        segment_collider=_own(static.segment_collider),
        segment_box=_own(boxes.box),
        segment_index=_own(boxes.index),
    )


def _ball_columns(pipeline: CollisionPipeline, store: BodyStore) -> BallColumns:
    return BallColumns(
        radius=_own(store.radius),
        surface=_own(store.surface),
        mask=_own(store.collision_mask),
        moves=_own(pipeline.moves),
        can_touch=_own(pipeline.can_touch),
        owner=np.arange(len(store.radius)),
        excluded=_own(excluded_pair_keys(store.joints)),
        group=_own(store.bodies.group),
    )


def _piece_columns(pipeline: ConvexPipeline) -> PieceColumns:
    pieces = pipeline.pieces
    return PieceColumns(
        corner=_own(pieces.corner),
        first=_own(pieces.first),
        radius=_own(pieces.radius),
        body=_own(pieces.body),
        surface=_own(pieces.surface),
        local=_own(pieces.local),
        local_middle=_own(pieces.local_middle),
        middle=_own(pieces.middle),
        bounding_radius=_own(pieces.bounding_radius),
        mask=_own(pieces.collision_mask),
        moves=_own(pieces.moves),
        can_touch=_own(pieces.can_touch),
        excluded=_own(pieces.excluded),
        group=_own(pieces.group),
        points=np.empty((2, 6)),
    )


NO_LOG = StepLog(np.zeros(0, np.int64), np.empty(0, np.bool_), np.empty((0, 2), np.int64), np.empty((0, 6)))

MAX_CAPACITY = CAPACITY
"""Contacts of a substep beyond which the readable step is used; it costs little beside so many contacts"""

NO_ORDER: IntArray = np.empty(0, np.int64)


def _first(log: StepLog, substeps: int) -> StepLog:
    """Return the used rows of a log."""
    if not len(log.end):
        return log
    rows = int(log.end[substeps])
    return StepLog(log.end[: substeps + 1], log.same[:substeps], log.pair[:rows], log.vectors[:rows])


def record_contacts(target: ContactLog, log: StepLog, times: FloatArray, wants_pairs: bool) -> PairRuns:
    """Enter the contacts of many substeps into a contact log, as if each had been recorded after its substep.

    Args:
        target: the contact log.
        log: the contacts.
        times: (B,) s, end of each substep.
        wants_pairs: whether to return the pairs.

    Returns:
        The pairs of the substeps; none unless they are wanted.
    """
    impulse, normal, point = (_complex(log.vectors[:, k : k + 2]) for k in (0, 2, 4))
    impulse = -(normal * impulse)
    a, b = np.ascontiguousarray(log.pair[:, 0]), np.ascontiguousarray(log.pair[:, 1])
    row: list[int] = log.end.tolist()
    begins = np.flatnonzero(~log.same).tolist()
    pairs = []

    def batch(begin: int, end: int) -> ContactBatch:
        some = slice(row[begin], row[end])
        return ContactBatch(a[some], b[some], impulse[some], normal[some], point[some])

    for begin, end in pairwise([*begins, len(log.same)]):
        target.record(float(times[begin]), batch(begin, begin + 1))
        lasting, count = batch(begin + 1, end), end - begin - 1
        if count and target.has_distinct_rows:
            target.add_impulse_rows(lasting.impulse.reshape(count, -1))
        elif count:
            target.add_batches(lasting, count)
        if wants_pairs:
            pairs.append((end, target.pairs()))
    return pairs


def _complex(vectors: FloatArray) -> ComplexArray:
    """Return rows (K, 2) as complex numbers (K,)."""
    return np.asarray(vectors[:, 0] + 1j * vectors[:, 1])  # with the sign of zero that the readable step gets


class MemberStepper:
    """Runs one world from many starts."""

    def __init__(self, store: BodyStore, settings: Settings) -> None:
        """Take over a body store, which no other simulation may use."""
        self._store, self._settings = store, settings
        self._world = WorldState(store, settings)
        self._stepper = CompiledStepper(self._world, store, settings)
        self._frames = no_rows()

    def run(
        self,
        position: FloatArray,
        velocity: FloatArray,
        angle: FloatArray,
        angular_velocity: FloatArray,
        *,
        steps: int,
        is_stopped: Callable[[], bool],
    ) -> bool:
        """Run the world from a start, (N, …) each, and write the end state in its place.

        Return false without writing if the compiled steps cannot make the run, or if it is to be stopped.
        """
        store = self._store
        state = store.position, store.velocity, store.angle, store.angular_velocity
        start = position, velocity, angle, angular_velocity
        for own, given in zip(state, start, strict=True):
            own[:] = given
        if not self._world.restart():
            self._world.rebuild()
            self._stepper = CompiledStepper(self._world, store, self._settings)
        stepper, made = self._stepper, 0
        while made < steps:
            if is_stopped():
                return False
            count = min(steps - made, stepper.max_steps(observed=False))
            result = stepper.advance(made, count, self._frames, records=False, observed=False)
            made += result.steps
            if result.code == UNCHECKED or result.substeps or (result.code == STOPPED and stepper.is_full):
                return False
        self._world.write_state()
        for own, given in zip(state, start, strict=True):
            given[:] = own
        return True
