"""Penalty contacts: a spring and a damper at each overlap, and the largest stiffness that is stable.

    F = max(k·overlap + c·closing speed, 0);   friction: min(μ F, γ·slip), against the slip

The damping ratio ζ of a pair follows from its restitution alone, independently of masses and speed, for a contact that
ends when its force becomes 0 (Schwager & Pöschel 2007, Granular Matter 9, 465). The overlap is speed/√(k/m) at impact
and m g/k at rest. Friction needs a slip, so that bodies at rest on a slope creep.
"""

import math

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.reference.broad_phase import CandidatePairs
from sandbox.engines.reference.collision import CollisionPipeline
from sandbox.engines.reference.drives import Drives
from sandbox.engines.reference.integrators import INTEGRATORS, Inputs, State, Step, amplification, transition
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.velocity_solver import ImpulseSolution, ImpulseSolver, Motion, SpringContacts
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.drives import mounts
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import MAX_STIFFNESS, Settings

MIN_RESTITUTION = 0.02
"""Smallest restitution: a smaller one needs a damping at which no practical step is stable"""


def restitution_of(damping: float) -> float:
    """Return the restitution of a spring contact with a damping ratio ζ ≥ 0 that ends when its force becomes 0."""
    z = damping
    if z < 1.0:
        root = math.sqrt(1.0 - z * z)
        # Phase at which the force becomes 0: π without damping, 0 at critical damping.
        return math.exp(-z / root * math.atan2(2.0 * z * root, 2.0 * z * z - 1.0))
    if z == 1.0:
        return math.exp(-2.0)
    root = math.sqrt(z * z - 1.0)
    return math.exp(-z / root * math.log((z + root) / (z - root)))


def damping_of(restitution: float) -> float:
    """Return the damping ratio of a restitution from `MIN_RESTITUTION` to 1, by bisection."""
    low, high = 0.0, 8.0
    while high - low > 1e-15 * (1.0 + low):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if restitution_of(middle) > restitution else (low, middle)
    return low


@kernel
def _forces(
    contacts: Manifolds,
    k: int,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
    damping: FloatArray,
) -> tuple[float, float, float, float]:
    """Return the normal and tangential force of contact k, N, and its separation rate and slip, m/s."""
    i, j = contacts.first[k], contacts.second[k]
    nx, ny = contacts.normal[k, 0], contacts.normal[k, 1]
    rn_a, rn_b = contacts.rn[k, 0], contacts.rn[k, 1]
    rt_a, rt_b = contacts.rt[k, 0], contacts.rt[k, 1]
    mass = inverse_mass[i] + inverse_moment[i] * rt_a * rt_a
    turning = inverse_moment[i] * (rn_a * rn_a - rt_a * rt_a)
    vx, vy, slip_of_spin = -rates[i, 0], -rates[i, 1], -spin[i] * rn_a
    roll = spin[i] * rt_a
    if j >= 0:
        mass += inverse_mass[j] + inverse_moment[j] * rt_b * rt_b
        turning += inverse_moment[j] * (rn_b * rn_b - rt_b * rt_b)
        vx += rates[j, 0]
        vy += rates[j, 1]
        slip_of_spin -= spin[j] * rn_b
        roll -= spin[j] * rt_b
    if mass == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    damper = 2.0 * damping[contacts.surface_pair[k]] * math.sqrt(stiffness / mass)
    separation_rate, slip = vx * nx + vy * ny + roll, vy * nx - vx * ny + slip_of_spin
    normal = max(-stiffness * contacts.separation[k] - damper * separation_rate, 0.0)
    max_friction = contacts.friction[k] * normal
    # Viscous friction with the time constant of the spring, so that it needs no smaller step.
    tangent = min(max(-math.sqrt(stiffness * mass) / (mass + turning) * slip, -max_friction), max_friction)
    return normal, tangent, separation_rate, slip


@kernel
def penalty_losses(
    contacts: Manifolds,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
    damping: FloatArray,
) -> tuple[float, float]:
    """Return the power of dampers and of clamped forces, W, along the normals and tangential; at most 0.

    The arguments are those of `penalty_forces`.
    """
    along, across = 0.0, 0.0
    for k in range(len(contacts.key)):
        normal, tangent, separation_rate, slip = _forces(
            contacts, k, rates, spin, inverse_mass, inverse_moment, stiffness, damping
        )
        along += (normal + stiffness * contacts.separation[k]) * separation_rate
        across += tangent * slip
    return along, across


@kernel
def penalty_forces(
    contacts: Manifolds,
    row: IntArray,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
    damping: FloatArray,
    acceleration: FloatArray,
    turn: FloatArray,
) -> None:
    """Add the accelerations of spring contacts.

    Args:
        contacts: K contacts.
        row: (K,) row of `acceleration` for the force of each contact.
        rates: (N + …, ≥ 2) velocities, m/s.
        spin: (N + …,) rad/s.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        stiffness: k, N/m.
        damping: (S·S,) damping ratio of each pair of surfaces.
        acceleration: (N + …, ≥ 2) added to, m/s²; in the row of a contact the force on its second body, N.
        turn: (N + …,) added to, rad/s².
    """
    for k in range(len(contacts.key)):
        i, j = contacts.first[k], contacts.second[k]
        nx, ny = contacts.normal[k, 0], contacts.normal[k, 1]
        rn_a, rn_b = contacts.rn[k, 0], contacts.rn[k, 1]
        rt_a, rt_b = contacts.rt[k, 0], contacts.rt[k, 1]
        normal, tangent, _, _ = _forces(contacts, k, rates, spin, inverse_mass, inverse_moment, stiffness, damping)
        x, y = nx * normal - ny * tangent, nx * tangent + ny * normal
        acceleration[i, 0] -= inverse_mass[i] * x
        acceleration[i, 1] -= inverse_mass[i] * y
        turn[i] -= inverse_moment[i] * (rn_a * tangent - rt_a * normal)
        if j >= 0:
            acceleration[j, 0] += inverse_mass[j] * x
            acceleration[j, 1] += inverse_mass[j] * y
            turn[j] -= inverse_moment[j] * (rn_b * tangent + rt_b * normal)
        acceleration[row[k], 0] += x
        acceleration[row[k], 1] += y


class PenaltyContacts:
    """The contacts of a scene as forces.

    The impulse of each contact is integrated in rows of its own in the state vector, so that the integrator weights it
    exactly as the forces on the bodies.
    """

    def __init__(self, store: BodyStore, settings: Settings, pipeline: CollisionPipeline) -> None:
        assert settings.stiffness is not None
        self._store, self._pipeline, self._settings = store, pipeline, settings
        self._stiffness = settings.stiffness
        self.rebuild(None)
        self._keys: IntArray = np.empty(0, np.int64)
        self.last = SpringContacts(pipeline.overlaps(store.position).of(slice(0)), np.zeros((0, 2)))
        """contacts of the last motion"""

    def rebuild(self, drives: Drives | None) -> None:
        """Update after a change of the surfaces or of the driven bodies; `drives` is None if no body is driven."""
        self._drives = drives
        table = self._store.restitution
        if self._settings.damping is not None:
            damping = np.full(table.shape, self._settings.damping)
        else:
            known = {e: damping_of(max(e, MIN_RESTITUTION)) for e in np.unique(table).tolist()}
            damping = np.vectorize(known.__getitem__, otypes=[float])(table) if table.size else table
        self._damping: FloatArray = damping.ravel()

    def advance(self, step: Step, t: float, x: State, u: Inputs, h: float) -> tuple[State, SpringContacts]:
        """Return the state after h, s, and the contacts that acted as forces within it."""
        count = x.shape[1]
        fastest = float(np.sqrt((x[1, :, :2] ** 2).sum(axis=1)).max(initial=0.0))
        strongest = float(np.abs(u.constant[:, :2]).max(initial=0.0))
        margin = 4.0 * h * (fastest + h * strongest)
        pairs = self._pipeline.candidates(x[0], margin)
        self._keys = self._pipeline.manifolds(x[0], pairs, margin).key.copy()
        rows = len(self._keys)
        if not rows:
            self.last = SpringContacts(self.last.contacts.of(slice(0)), self.last.impulse[:0])
            return step(transition, t, x, u, h), self.last

        def forces(state: State) -> FloatArray:
            contacts = self._pipeline.manifolds(state[0, :count], pairs)
            acceleration = np.zeros((count + rows, x.shape[2]))
            if contacts.size:
                row, known = self._rows(contacts)
                self._add_forces(contacts.of(known), count + row[known], state[1], acceleration)
            return acceleration

        extended = np.concatenate((x, np.zeros((2, rows, x.shape[2]))), axis=1)
        no_forces = np.zeros((rows, x.shape[2]))
        mobile = np.concatenate((np.broadcast_to(u.mobile, (count, 1)), np.zeros((rows, 1))))
        constant, air = np.concatenate((u.constant, no_forces)), u.air.for_rows(count + rows)
        extended_u = u._replace(constant=constant, air=air, mobile=mobile, contacts=forces)
        extended = step(transition, t, extended, extended_u, h)
        self.last = self._active_contacts(extended[0, :count], extended[1, count:, :2], pairs, 3.0 * margin)
        return np.ascontiguousarray(extended[:, :count]), self.last

    def _rows(self, contacts: Manifolds) -> tuple[IntArray, BoolArray]:
        """Return the row of each contact, and whether it has one; only in a diverging state contacts have none."""
        row = np.minimum(np.searchsorted(self._keys, contacts.key), len(self._keys) - 1)
        return row, np.asarray(self._keys[row] == contacts.key)

    def _add_forces(self, contacts: Manifolds, row: IntArray, rates: FloatArray, acceleration: FloatArray) -> None:
        store = self._store
        spin = rates[:, 2] if rates.shape[1] == 3 else np.zeros((len(rates), 3))[:, 2]
        turn = acceleration[:, 2] if rates.shape[1] == 3 else np.zeros((len(rates), 3))[:, 2]
        inverse = store.inverse_mass, self._inverse_moment
        penalty_forces(contacts, row, rates, spin, *inverse, self._stiffness, self._damping, acceleration, turn)

    @property
    def _inverse_moment(self) -> FloatArray:
        return self._store.inverse_moment if self._drives is None else self._drives.inverse_moment_forces

    def stored_energy(self, pose: FloatArray) -> float:
        """Return the energy stored in the springs of all contacts at poses (N, ≥ 2), J: ½ k overlap² each."""
        return 0.5 * self._stiffness * float(np.square(self._pipeline.overlaps(pose).separation).sum())

    def losses(self, x: State) -> tuple[float, float]:
        """Return the power of all contacts in a state without their springs, W, along the normals and tangential."""
        contacts, store = self._pipeline.overlaps(x[0]), self._store
        spin = x[1, :, 2] if x.shape[2] == 3 else np.zeros((x.shape[1], 3))[:, 2]
        inverse = store.inverse_mass, self._inverse_moment
        return penalty_losses(contacts, x[1], spin, *inverse, self._stiffness, self._damping)

    def _active_contacts(
        self, position: FloatArray, impulse: FloatArray, pairs: CandidatePairs, max_separation: float
    ) -> SpringContacts:
        """Return the contacts of a step with their impulses (K, 2), also those that have separated within it."""
        contacts = self._pipeline.manifolds(position, pairs, max_separation)
        row, has_row = self._rows(contacts)
        given = np.zeros((contacts.size, 2))
        given[has_row] = impulse[row[has_row]]
        active = (contacts.separation < 0.0) | given.any(axis=1)
        contacts, given = contacts.of(active), given[active]
        nx, ny = contacts.normal[:, 0], contacts.normal[:, 1]
        normal, tangent = given[:, 0] * nx + given[:, 1] * ny, given[:, 1] * nx - given[:, 0] * ny
        return SpringContacts(contacts, np.column_stack((normal, tangent)))


class PenaltySolver:
    """Solver with penalty contacts; it has the verbs of `ImpulseSolver`, which solves the joints.

    The integrator applies contacts as forces, and no overlap is corrected.
    """

    def __init__(self, penalty: PenaltyContacts, impulses: ImpulseSolver) -> None:
        self._penalty, self._impulses = penalty, impulses

    def integrate(self, x: State, forces: Inputs, time: float, h: float) -> Motion:
        """Return the motion from a state at a time, s, over h, s, with contacts acting as forces."""
        free, springs = self._penalty.advance(self._impulses.scheme, time, x, forces, h)
        return self._impulses.complete_motion(x, free, h, springs)

    def detect(self, motion: Motion) -> Manifolds:
        """Return the contacts that acted as forces in a motion."""
        assert motion.springs is not None
        return motion.springs.contacts

    def solve(self, motion: Motion, contacts: Manifolds, h: float) -> ImpulseSolution:
        """Return the state at the end of a motion over h, s, with joints and stops solved by impulses."""
        assert motion.springs is not None
        solution = self._impulses.solve(motion, contacts.of(slice(0)), h)
        return solution._replace(contacts=contacts, impulse=motion.springs.impulse)

    def correct(self, solution: ImpulseSolution, h: float) -> None:
        """Do nothing: springs need their overlap."""

    def finish(self, after: State) -> State:
        """Return the state with which the next step begins."""
        return self._impulses.finish(after)


class DrivenPenaltySolver(PenaltySolver):
    """Solver with penalty contacts and driven bodies, whose drives plan the motion."""

    def __init__(self, drives: Drives, penalty: PenaltyContacts, impulses: ImpulseSolver) -> None:
        super().__init__(penalty, impulses)
        self._drives = drives

    def integrate(self, x: State, forces: Inputs, time: float, h: float) -> Motion:
        """Return the motion from a state at a time, s, over h, s, with contacts acting as forces."""
        penalty, scheme = self._penalty, self._impulses.scheme
        free, springs = self._drives.advance_with_springs(
            x, time, h, lambda start: penalty.advance(scheme, time, start, forces, h)
        )
        self._drives.place(free)
        return self._impulses.complete_motion(self._drives.start, free, h, springs)


ROUNDING = 1e-9
"""Amplification above 1 that counts as rounding: a scheme that conserves energy has exactly 1"""

DEFAULT_FREQUENCY = 0.3
"""ω·h of a contact with the default stiffness: ten substeps a contact"""

MIN_USEFUL_FREQUENCY = 1e-3
"""ω·h below which a stable step is of no practical use: thousands of substeps a contact"""

DAMPER = 1.3
"""Factor of the damping ratio by which ω·h is divided if the damper limits the step"""


def smallest_reduced_mass(setup: Setup) -> float:
    """Return the smallest reduced mass, kg, of a pair that can collide; for two equal balls half the mass."""
    scene, matrix, bodies = setup.scene, contact_matrix(setup), setup.bodies
    mass, moving, hinged = bodies.mass, ~(bodies.fixed | bodies.kinematic), False
    if scene.drives:
        mass, moving = mass.copy(), moving.copy()
        for name, mount in mounts(scene).items():
            if name in bodies.number_of:
                n = bodies.number_of[name]
                moving[n] = mount.drive.kind == "torque"
                hinged = hinged or bool(moving[n])
                anchor = math.hypot(*mount.hinge)  # the effective mass is smallest at the far end: I / r²
                mass[n] = (bodies.moment[n] + bodies.mass[n] * anchor * anchor) / (bodies.radius[n] + anchor) ** 2
    masses = mass[~matrix.free & moving]
    if not len(masses):
        return 1.0
    return float(masses.min()) * (0.5 if matrix.ball_ball or hinged else 1.0)


def default_stiffness(setup: Setup, settings: Settings) -> float:
    """Return the default stiffness, N/m, for the step and damping of the settings."""
    stiffest_damper = max(_dampings(contact_matrix(setup), settings), default=0.0)
    own = smallest_reduced_mass(setup) * (DEFAULT_FREQUENCY / max(1.0, DAMPER * stiffest_damper) / settings.h) ** 2
    return min(own, MAX_STIFFNESS)


def _dampings(matrix: ContactMatrix, settings: Settings) -> list[float]:
    """Return the damping ratios of all possible contacts."""
    if settings.damping is not None:
        return [settings.damping]
    restitution = np.unique(matrix.surfaces.restitution[matrix.touching])
    return [damping_of(max(e, MIN_RESTITUTION)) for e in restitution.tolist()]


def instability(setup: Setup, settings: Settings, stiffness_stated: bool = True) -> str | None:
    """Return why penalty springs are unstable or impossible with the settings; None if they are stable.

    The stiffest case is a ball between several springs: two to static colliders, six in a close packing. There its
    frequency is √3 times that of a pair (ω² = 6 k/m in the mode of the shortest waves; 2 k/m for a pair).
    """
    assert settings.stiffness is not None and settings.integrator is not None
    matrix = contact_matrix(setup)
    if not matrix.touching.any():
        return None
    table = matrix.surfaces.restitution[matrix.touching]
    if settings.damping is None and table.min() < MIN_RESTITUTION:
        return (
            f"penalty contacts cannot model restitution {table.min():g}, the smallest is "
            f"{MIN_RESTITUTION:g}; use that, or "
            "set solver.damping (1 = critical) instead"
        )
    dampings = _dampings(matrix, settings)
    neighbours = np.sqrt(3.0) if matrix.ball_ball else np.sqrt(2.0)
    frequency = neighbours * np.sqrt(settings.stiffness / smallest_reduced_mass(setup))
    worst = max(dampings, key=lambda z: _amplification(settings, frequency, neighbours * z, settings.h))
    if _amplification(settings, frequency, neighbours * worst, settings.h) <= 1.0 + ROUNDING:
        return None
    bound = _largest_stable_step(settings, frequency, neighbours * worst)
    if not bound:
        remedy = "no step is stable; use integrator 'semi_implicit_euler' with a small step"
    else:
        # Stability depends on ω·h only, so that a bound of h is also a bound of ω.
        softer = settings.stiffness * (bound / settings.h) ** 2
        remedy = f"use a solver.stiffness of at most {_rounded_down(softer):g} N/m"
        if stiffness_stated:  # the default stiffness grows as h falls
            remedy += f", or h = dt / substeps of at most {_rounded_down(bound):g} s"
    return (
        f"penalty springs of {settings.stiffness:g} N/m would gain energy at h = {settings.h:g} s "
        f"with {settings.integrator}: {remedy}"
    )


def _rounded_down(value: float) -> float:
    """Return a value rounded down to three digits, so that the bound in a message satisfies the check."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / unit) * unit


def _amplification(settings: Settings, frequency: float, damping: float, h: float) -> float:
    assert settings.integrator is not None
    return amplification(INTEGRATORS[settings.integrator].step, frequency, damping, h)


def _largest_stable_step(settings: Settings, frequency: float, damping: float) -> float:
    """Return the largest stable step, s, below the present one; 0 if there is none of practical use."""
    low, high = 0.0, settings.h
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if _amplification(settings, frequency, damping, middle) <= 1.0 + ROUNDING else (low, middle)
        )
    return low if frequency * low > MIN_USEFUL_FREQUENCY else 0.0
