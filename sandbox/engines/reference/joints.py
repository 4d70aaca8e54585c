"""The joint solver, by one of four methods, and the breaking of joints.

JointSolver: the links of a running scene, held in one of four ways.

    x' = step(f, t, x, u, h)                          with `forces` among the external forces, then, by impulses:
    solver.prepare(kick_pose(x', fraction, h), h)     where the step's kick takes place
    solver.solve(x'[1])                               and positions follow by fraction·h·Δv
                                                      or, by positions, velocities with them:
    solver.project(x, x', h)

| method | order | energy | springs |
|---|---|---|---|
| impulses | 1 | lost, less than by the next two | forces |
| relaxation | 1 | lost | forces, and strings that cap their stretch |
| xpbd | 1 | lost | compliant links: stable at any stiffness |
| rattle | 2, with an integrator of 2 or more | in a band | forces |

RATTLE (Andersen 1983) is velocity Verlet with constraints: positions are corrected along the lines of the step's start,
and then velocities along those of its end. It must converge, and fails if a step turns lines by a right angle.
"""

import math

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.reference.integrators import State
from sandbox.engines.reference.joint_data import (
    CAP,
    HOLDS,
    SPRINGS,
    JointData,
    cap_stretch,
    damper_power,
    spring_forces,
    spring_loads,
    ties_of,
)
from sandbox.engines.reference.joint_rows import (
    VelocityConstraints,
    impulses_of,
    one_pass,
    prepare,
    row_work,
    rows_of,
    warm_start,
)
from sandbox.engines.reference.position_joints import project
from sandbox.scene.compile.joint_arrays import JointArrays, LinkKind

LACKING = (LinkKind.GROOVE, LinkKind.MOTOR, LinkKind.GEAR)
"""Kinds that are not modelled here."""

METHODS = ("impulses", "relaxation", "xpbd", "rattle")


def kick_pose(moved: State, fraction: float, h: float) -> FloatArray:
    """Return the poses (N, 3) at which a step's kick takes place: before its drift, after it, or in its middle.

    Rows that are prepared there ask for the right motion, for what the kick changes moves bodies from there on.

    Args:
        moved: the state after the step.
        fraction: of its integrator, `Integrator.fraction`.
        h: step, s.
    """
    return np.asarray(moved[0] - (fraction * h) * moved[1]) if fraction else moved[0]


class JointSolver:
    """J links among N bodies."""

    def __init__(
        self,
        links: JointArrays,
        inverse_mass: FloatArray,
        inverse_moment: FloatArray,
        bias: float,
        iterations: int,
        method: str,
        cap: float = CAP,
    ) -> None:
        """Hold all links.

        Args:
            links: none of a kind in `LACKING`.
            inverse_mass: (N,) 1/kg, 0 for fixed bodies.
            inverse_moment: (N,) 1/(kg·m²), 0 for bodies that do not turn.
            bias: the fraction of a joint's error that impulses leave after a second, 0 to 1.
            iterations: passes over all links.
            method: one of `METHODS`. In xpbd springs are compliant links, else forces.
            cap: under relaxation, the most stretch of springs as a part of their rest length; inf for none.

        Raises:
            ValueError: a link is of a kind that is lacking, or `method` is unknown.
        """
        lacking = [kind.name.lower() for kind in LACKING if (links.kind == kind).any()]
        if lacking or method not in METHODS:
            raise ValueError(f"cannot hold {lacking or 'links'} by {method!r}")
        self.links, self.method = links, method
        self._bias, self._iterations, self._cap = bias, iterations, cap
        self._h = math.inf
        self.rebuild(inverse_mass, inverse_moment, np.arange(len(links)))

    def rebuild(self, inverse_mass: FloatArray, inverse_moment: FloatArray, whole: IntArray) -> None:
        """Go on with other bodies or fewer links; those that go on keep their impulses.

        Args:
            inverse_mass: (N,) 1/kg.
            inverse_moment: (N,) 1/(kg·m²).
            whole: numbers of the links that still hold.
        """
        memory = np.zeros((len(self.links), 2))
        if math.isfinite(self._h):
            memory[self._held.link] = self.rows.impulse
        self.inverse_mass, self.inverse_moment = inverse_mass, inverse_moment
        self._springs: JointData = ties_of(self.links, *SPRINGS, among=whole)
        self._held: JointData = ties_of(self.links, *(HOLDS + SPRINGS if self.method == "xpbd" else HOLDS), among=whole)
        if self.method == "relaxation":
            self._held = self._held.joined(cap_stretch(self._springs, self._cap))
        self.rows: VelocityConstraints = rows_of(self._held)
        self.rows.impulse[:] = memory[self._held.link]
        self._given = np.zeros((len(self.links), 2))

    @property
    def visits(self) -> int:
        """How often a step looks at a joint, over all passes; RATTLE's second stage passes over all again."""
        return len(self._held.kind) * self._iterations * (2 if self.method == "rattle" else 1)

    def forces(self, x: State) -> FloatArray:
        """Return the accelerations (N, 3) by springs in a state, m/s² and rad/s²; in xpbd there are none."""
        out: FloatArray = np.zeros_like(x[1])
        if self.method != "xpbd":
            spring_forces(self._springs, x[0], x[1], self.inverse_mass, self.inverse_moment, out)
        return out

    def prepare(self, pose: FloatArray, h: float) -> VelocityConstraints:
        """Update the rows for poses (N, 3) and a step h, s; return them, for a caller that interleaves passes."""
        prepare(self.rows, self._held, pose, h, self._h, self._bias, self.inverse_mass, self.inverse_moment)
        self._h = h
        return self.rows

    def warm_start(self, velocity: FloatArray) -> None:
        """Apply the impulses of the last step to velocities (N, 3)."""
        warm_start(self.rows, velocity, self.inverse_mass, self.inverse_moment)

    def one_pass(self, velocity: FloatArray) -> None:
        """Fulfil every row once; velocities (N, 3) are changed."""
        one_pass(self.rows, velocity, self.inverse_mass, self.inverse_moment)

    def solve(self, velocity: FloatArray) -> None:
        """Fulfil the prepared rows by impulses, with nothing in between; velocities (N, 3) are changed."""
        self.warm_start(velocity)
        for _ in range(self._iterations):
            self.one_pass(velocity)

    def project(self, start: State, moved: State, h: float) -> None:
        """Move bodies into place, and change their velocities accordingly.

        With relaxation and xpbd, a body that hangs at rest keeps the velocity (1 − fraction)·h·a of the part of a kick
        that its integrator's positions have yet to follow: none after a kick-drift step, whose fraction is 1.

        Args:
            start: (2, N, 3) at the start of the step.
            moved: (2, N, 3) after it, changed.
            h: step, s.
        """
        shift, lagged = np.empty_like(moved[0]), self.method == "rattle"
        inverse = self.inverse_mass, self.inverse_moment
        sums = self.rows.impulse, self.rows.normal
        project(self._held, moved[0], start[0], h, self._iterations, lagged, *inverse, shift, *sums)
        self.rows.impulse[:] /= h
        moved[1] += shift / h
        self._h = h
        if lagged:
            self._align(moved)

    def _align(self, moved: State) -> None:
        """Remove the velocity components that would separate the corrected joint ends: the second stage of RATTLE."""
        given, bound, h = self.rows.impulse.copy(), self.rows.bound, self._h
        # No bias: positions are already corrected. A row with an impulse is active, on whichever side of its bound.
        prepare(self.rows, self._held, moved[0], h, h, 1.0, self.inverse_mass, self.inverse_moment)
        either = np.isin(self._held.kind, (LinkKind.ROD, LinkKind.PIVOT))
        bound[:, 0] = np.where(either | (given[:, 0] < 0.0), -h * self._held.most_force, 0.0)
        bound[:, 1] = np.where(either | (given[:, 0] > 0.0), h * self._held.most_force, 0.0)
        self.rows.impulse[:], self.rows.target[:] = given, 0.0  # applied already; the sum counts
        for _ in range(self._iterations):
            self.one_pass(moved[1])

    def work(self, velocity: FloatArray) -> float:
        """Return the work of the rows' impulses, J, at the mean (N, 3) of the velocities before and after them."""
        return row_work(self.rows, velocity)

    def damper_power(self, x: State) -> float:
        """Return the power of the dampers of springs in a state, W."""
        return damper_power(self._springs, x[0], x[1])

    def impulse(self) -> FloatArray:
        """Return the impulse of each joint on its second body in the last step (J, 2): x and y, N·s, or N·m·s and 0.

        Of springs that act as forces there is nothing here: see `load`.
        """
        impulses_of(self.rows, self._held, self._given)
        return self._given

    def load(self, x: State) -> FloatArray:
        """Return the force of each link on its second body (J, 2): x and y, N, or a torque, N·m, and 0.

        Args:
            x: (2, N, 3) the state that springs are looked at in; of the others, it is the mean over the last step.
        """
        load: FloatArray = np.zeros((len(self.links), 2))
        if self.method != "xpbd":
            spring_loads(self._springs, x[0], x[1], load)
        return load + self.impulse() / self._h


class JointBreaker:
    """Finds the joints that break: those whose mean force over a substep exceeds their strength.

    The mean is not taken over the pieces that impacts cut a substep into: the shorter a piece, the larger its forces.
    """

    def __init__(self, links: JointArrays) -> None:
        self._strength = links.strength
        self._breakable: IntArray = np.flatnonzero(np.isfinite(links.strength))
        self._given: FloatArray = np.zeros((len(links), 2))  # N·s or N·m·s, in this substep

    @property
    def any_breakable(self) -> bool:
        """Whether a joint may still break."""
        return len(self._breakable) > 0

    def add(self, given: FloatArray) -> None:
        """Add the impulses of all joints in a piece of a substep, (L, 2) N·s or N·m·s."""
        self._given += given

    def find_broken(self, h: float) -> IntArray:
        """Return the indices of the joints that break at the end of a substep of h, s."""
        force = np.hypot(*self._given[self._breakable].T) / h
        self._given[:] = 0.0
        broken: IntArray = self._breakable[force > self._strength[self._breakable]]
        if len(broken):
            self._breakable = np.setdiff1d(self._breakable, broken)
        return broken
