"""The joint solver, by one of four methods, and the breaking of joints.

    x' = step(f, t, x, u, h)                          with `forces` among the external forces; then by impulses:
    solver.prepare(kick_pose(x', fraction, h), h)     at the poses of the step's kick
    solver.solve(x'[1])                               positions follow by fraction·h·Δv
                                                      or by positions, and velocities from them:
    solver.project(x, x', h)

| method | order | energy | springs |
|---|---|---|---|
| impulses | 1 | lost, less than by the next two | forces |
| relaxation | 1 | lost | forces, with slide joints that limit their stretch |
| xpbd | 1 | lost | compliant joints: stable at any stiffness |
| rattle | 2, with an integrator of order 2 or more | bounded error | forces |

RATTLE (Andersen 1983) is velocity Verlet with constraints: positions are corrected along the axes at the start of the
step, then velocities along those at its end. It must converge, and fails if an axis turns by 90° or more in a step.
"""

import math

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.reference.integrators import State
from sandbox.engines.reference.joint_data import (
    CONSTRAINTS,
    GROOVE_ENDS,
    MAX_STRETCH,
    SPRINGS,
    JointData,
    add_spring_forces,
    damper_power,
    select_joints,
    stretch_limits,
    write_spring_loads,
)
from sandbox.engines.reference.joint_rows import (
    VelocityConstraints,
    joint_work,
    make_velocity_constraints,
    prepare,
    solve_joints,
    warm_start_joints,
    write_joint_impulses,
)
from sandbox.engines.reference.position_joints import project
from sandbox.scene.compile.joint_arrays import MOTORS, JointArrays, JointKind

LIMITS = (JointKind.SLIDE, JointKind.ROTARY_LIMIT, JointKind.PULLEY, GROOVE_ENDS)
"""Kinds that act at a limit only"""

METHODS = ("impulses", "relaxation", "xpbd", "rattle")


def kick_pose(moved: State, fraction: float, h: float) -> FloatArray:
    """Return the poses (N, 3) at which the step changes velocities: before its drift, after it, or in its middle.

    Constraints must be prepared at these poses, because a change of velocity displaces bodies from there on.

    Args:
        moved: the state after the step.
        fraction: of its integrator, `Integrator.fraction`.
        h: step, s.
    """
    return np.asarray(moved[0] - (fraction * h) * moved[1]) if fraction else moved[0]


class JointSolver:
    """Solver of J joints among N bodies."""

    def __init__(
        self,
        joints: JointArrays,
        inverse_mass: FloatArray,
        inverse_moment: FloatArray,
        bias: float,
        iterations: int,
        method: str,
        max_stretch: float = MAX_STRETCH,
    ) -> None:
        """Create the solver.

        Args:
            joints: of the scene.
            inverse_mass: (N,) 1/kg, 0 for fixed bodies.
            inverse_moment: (N,) 1/(kg·m²), 0 for bodies that do not turn.
            bias: fraction of a joint's error that remains after one second of correction, 0 to 1.
            iterations: passes over all joints in a step.
            method: one of `METHODS`. With xpbd springs are compliant joints, else forces.
            max_stretch: with relaxation, largest stretch of springs as a fraction of their rest length; inf for no
                limit.

        Raises:
            ValueError: `method` is unknown.
        """
        if method not in METHODS:
            raise ValueError(f"the method of joints must be one of {METHODS}, is {method!r}")
        self.joints, self.method = joints, method
        self._bias, self._iterations, self._max_stretch = bias, iterations, max_stretch
        self.h = math.inf
        """s, step in which the present impulses were found"""
        self.rebuild(inverse_mass, inverse_moment, np.arange(len(joints)))

    def rebuild(self, inverse_mass: FloatArray, inverse_moment: FloatArray, unbroken: IntArray) -> None:
        """Update after a change of the bodies, or after joints broke. The other joints keep their impulses.

        Args:
            inverse_mass: (N,) 1/kg.
            inverse_moment: (N,) 1/(kg·m²).
            unbroken: indices of the intact joints.
        """
        memory = np.zeros((2, len(self.joints), 2))  # the second constraints of grooves have their own
        if math.isfinite(self.h):
            memory[self._is_second(), self.constraints.joint] = self.rows.impulse
        self.inverse_mass, self.inverse_moment = inverse_mass, inverse_moment
        self._springs: JointData = select_joints(self.joints, *SPRINGS, among=unbroken)
        self.constraints: JointData = select_joints(
            self.joints, *(CONSTRAINTS + SPRINGS if self.method == "xpbd" else CONSTRAINTS), among=unbroken
        )
        """joints of the rows"""
        if self.method == "relaxation":
            self.constraints = self.constraints.joined(stretch_limits(self._springs, self._max_stretch))
        self._acts_both_ways: BoolArray = ~np.isin(self.constraints.kind, LIMITS)
        self.rows: VelocityConstraints = make_velocity_constraints(self.constraints)
        self.rows.impulse[:] = memory[self._is_second(), self.constraints.joint]
        self._impulse = np.zeros((len(self.joints), 2))

    def _is_second(self) -> IntArray:
        """Return 1 for rows that are the second constraint of a groove, otherwise 0, (K,)."""
        return np.asarray(self.constraints.kind == GROOVE_ENDS, dtype=np.int64)

    def forget(self) -> None:
        """Forget the impulses of the last step."""
        self.h = math.inf
        self.rows.impulse[:] = 0.0

    @property
    def has_forces(self) -> bool:
        """Whether there are springs that are forces."""
        return self.method != "xpbd" and len(self._springs.kind) > 0

    @property
    def visits_per_step(self) -> int:
        """Number of joints that a step visits, over all passes; RATTLE's second stage doubles it."""
        return len(self.constraints.kind) * self._iterations * (2 if self.method == "rattle" else 1)

    def forces(self, x: State) -> FloatArray:
        """Return the accelerations (N, 3) by springs in a state, m/s² and rad/s²; zeros with xpbd."""
        out: FloatArray = np.zeros_like(x[1])
        if self.method != "xpbd":
            add_spring_forces(self._springs, x[0], x[1], self.inverse_mass, self.inverse_moment, out)
        return out

    def forces_at(self, _: float, x: State) -> FloatArray:
        """Return the accelerations by springs, which do not depend on time, in a state, as one of `Inputs.forces`."""
        return self.forces(x)

    def prepare(self, pose: FloatArray, h: float) -> VelocityConstraints:
        """Update the rows for poses (N, 3) and a step h, s; return them, for callers that also solve contacts."""
        prepare(self.rows, self.constraints, pose, h, self.h, self._bias, self.inverse_mass, self.inverse_moment)
        self.h = h
        return self.rows

    def warm_start(self, velocity: FloatArray) -> None:
        """Apply the impulses of the last step to velocities (N, 3)."""
        warm_start_joints(self.rows, velocity, self.inverse_mass, self.inverse_moment)

    def solve(self, velocity: FloatArray) -> None:
        """Solve the prepared rows alone, without contacts; velocities (N, 3) are changed."""
        self.warm_start(velocity)
        self._iterate(velocity)

    def _iterate(self, velocity: FloatArray) -> None:
        solve_joints(self.rows, self._iterations, velocity, self.inverse_mass, self.inverse_moment)

    def project(self, start: State, moved: State, h: float) -> None:
        """Correct positions, and change velocities accordingly.

        With relaxation and xpbd, a body hanging at rest keeps the velocity (1 − fraction)·h·a: the part of a kick that
        the positions of its integrator do not include yet. It is 0 after a kick-drift step, whose fraction is 1.

        Args:
            start: (2, N, 3) at the start of the step.
            moved: (2, N, 3) after it, changed.
            h: step, s.
        """
        shift, shake = np.empty_like(moved[0]), self.method == "rattle"
        inverse = self.inverse_mass, self.inverse_moment
        sums = self.rows.impulse, self.rows.normal, self.rows.jacobian
        project(self.constraints, moved[0], start[0], h, self._iterations, shake, *inverse, shift, *sums)
        self.rows.impulse[:] /= h
        moved[1] += shift / h
        self.h = h
        if shake:
            self._align(moved)

    def _align(self, moved: State) -> None:
        """Remove the velocities that would separate the corrected anchors: the second stage of RATTLE."""
        impulse, bound, h = self.rows.impulse.copy(), self.rows.bound, self.h
        # No bias: positions are already corrected. A row with an impulse is active, at whichever limit.
        prepare(self.rows, self.constraints, moved[0], h, h, 1.0, self.inverse_mass, self.inverse_moment)
        either = self._acts_both_ways
        bound[:, 0] = np.where(either | (impulse[:, 0] < 0.0), -h * self.constraints.max_force, 0.0)
        bound[:, 1] = np.where(either | (impulse[:, 0] > 0.0), h * self.constraints.max_force, 0.0)
        self.rows.impulse[:] = impulse  # applied already, but part of the accumulated impulse
        self.rows.target[~np.isin(self.constraints.kind, MOTORS)] = 0.0
        self._iterate(moved[1])

    def work(self, velocity: FloatArray) -> tuple[float, float]:
        """Return the work of the impulses of joints but motors, and that of motors, J.

        Args:
            velocity: (N, 3) mean of the velocities before and after the impulses.
        """
        work: tuple[float, float] = joint_work(self.rows, self.constraints, velocity)
        return work

    def damper_power(self, x: State) -> float:
        """Return the power of the dampers of springs in a state, W."""
        return damper_power(self._springs, x[0], x[1])

    def impulse(self) -> FloatArray:
        """Return the impulse of each joint on its second body in the last step (J, 2): x and y, N·s, or N·m·s and 0.

        Springs that are forces have zeros; see `load`.
        """
        write_joint_impulses(self.rows, self.constraints, self._impulse)
        return self._impulse

    def load(self, x: State) -> FloatArray:
        """Return the force of each joint on its second body (J, 2): x and y, N, or a torque, N·m, and 0.

        Args:
            x: (2, N, 3) state at which springs are evaluated; the forces of other joints are means over the last step.
        """
        load: FloatArray = np.zeros((len(self.joints), 2))
        if self.method != "xpbd":
            write_spring_loads(self._springs, x[0], x[1], load)
        return load + self.impulse() / self.h


class JointBreaker:
    """Finds the joints that break: those whose mean force over a substep exceeds their strength.

    The mean is over the whole substep, also if impacts divide it: forces grow as the pieces get shorter.
    """

    def __init__(self, joints: JointArrays) -> None:
        self._joints, self._strength = joints, joints.strength
        self._breakable: IntArray = np.flatnonzero(np.isfinite(joints.strength))
        self._impulse: FloatArray = np.zeros((len(joints), 2))  # N·s or N·m·s, in this substep

    @property
    def any_breakable(self) -> bool:
        """Whether any joint can still break."""
        return len(self._breakable) > 0

    def add(self, impulse: FloatArray) -> None:
        """Add the impulses of all joints in a piece of a substep, (L, 2) N·s or N·m·s."""
        self._impulse += impulse

    def find_broken(self, h: float) -> IntArray:
        """Return the rows of the joints that break at the end of a substep of h, s."""
        force = np.hypot(*self._impulse[self._breakable].T) / h
        self._impulse[:] = 0.0
        broken: IntArray = self._breakable[force > self._strength[self._breakable]]
        if len(broken):
            broken = self._joints.whole(broken)
            self._breakable = np.setdiff1d(self._breakable, broken)
        return broken
