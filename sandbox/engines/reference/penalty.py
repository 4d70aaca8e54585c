"""Penalty contacts: a spring and a damper at each overlap, and the largest stiffness that is stable.

Springs: contacts as stiff springs with dampers.

    F = k·overlap + c·closing speed, never pulling;   friction: min(μ F, γ·slip), against the slip

A pair's damping follows from its restitution, for a contact that ends when its force does (Schwager & Pöschel 2007,
Granular Matter 9, 465): the damping ratio ζ alone, whatever the masses and the speed. Overlap is the price: speed over
√(k/m) at impact, m g/k at rest. Friction creeps, as it needs a slip to act.
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
from sandbox.engines.reference.velocity_solver import ImpulseSolver, Motion, Solution
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.drives import mounts
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import MAX_STIFFNESS, Settings
from sandbox.scene.scene import Scene

LEAST_RESTITUTION = 0.02
"""Below, the damper would have to be stiffer than any step could bear."""


def restitution_of(damping: float) -> float:
    """Return the restitution of a spring contact with a damping ratio ζ ≥ 0 that ends when its force does."""
    z = damping
    if z < 1.0:
        root = math.sqrt(1.0 - z * z)
        # The angle at which force ends, π at no damping, falling to 0 at critical: one arc tangent, in two quadrants.
        return math.exp(-z / root * math.atan2(2.0 * z * root, 2.0 * z * z - 1.0))
    if z == 1.0:
        return math.exp(-2.0)
    root = math.sqrt(z * z - 1.0)
    return math.exp(-z / root * math.log((z + root) / (z - root)))


def damping_of(restitution: float) -> float:
    """Return the damping ratio of a restitution from `LEAST_RESTITUTION` to 1, by bisection."""
    low, high = 0.0, 8.0
    while high - low > 1e-15 * (1.0 + low):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if restitution_of(middle) > restitution else (low, middle)
    return low


@kernel
def _forces(
    now: Manifolds,
    k: int,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
    damping: FloatArray,
) -> tuple[float, float, float, float]:
    """Return contact k's force along its normal and across, N, and how fast it parts and slips, m/s."""
    i, j = now.first[k], now.second[k]
    nx, ny = now.normal[k, 0], now.normal[k, 1]
    a, b = now.arm[k, 0], now.arm[k, 1]
    a_off, b_off = now.offset[k, 0], now.offset[k, 1]
    mass = inverse_mass[i] + inverse_moment[i] * a_off * a_off
    turning = inverse_moment[i] * (a * a - a_off * a_off)
    vx, vy, slip_of_spin = -rates[i, 0], -rates[i, 1], -spin[i] * a
    roll = spin[i] * a_off
    if j >= 0:
        mass += inverse_mass[j] + inverse_moment[j] * b_off * b_off
        turning += inverse_moment[j] * (b * b - b_off * b_off)
        vx += rates[j, 0]
        vy += rates[j, 1]
        slip_of_spin -= spin[j] * b
        roll -= spin[j] * b_off
    if mass == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    damper = 2.0 * damping[now.surface_pair[k]] * math.sqrt(stiffness / mass)
    parting, slip = vx * nx + vy * ny + roll, vy * nx - vx * ny + slip_of_spin
    normal = max(-stiffness * now.separation[k] - damper * parting, 0.0)
    most = now.friction[k] * normal
    # A viscous slope that damps slip as fast as the spring swings, so that it asks for no smaller step.
    tangent = min(max(-math.sqrt(stiffness * mass) / (mass + turning) * slip, -most), most)
    return normal, tangent, parting, slip


@kernel
def penalty_losses(
    now: Manifolds,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
    damping: FloatArray,
) -> tuple[float, float]:
    """Return the power, W, of dampers, and of forces that were cut short, along normals and across; never above 0.

    Arguments as in `penalty_forces`.
    """
    along, across = 0.0, 0.0
    for k in range(len(now.key)):
        normal, tangent, parting, slip = _forces(now, k, rates, spin, inverse_mass, inverse_moment, stiffness, damping)
        along += (normal + stiffness * now.separation[k]) * parting
        across += tangent * slip
    return along, across


@kernel
def penalty_forces(
    now: Manifolds,
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
        now: K contacts.
        row: (K,) where in `acceleration` each contact's own force goes.
        rates: (N + …, ≥ 2) velocities, m/s.
        spin: (N + …,) rad/s.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        stiffness: k, N/m.
        damping: (S·S,) damping ratio of each pair of surfaces.
        acceleration: (N + …, ≥ 2) added to, m/s²; in a contact's row, the force on its second, N.
        turn: (N + …,) added to, rad/s².
    """
    for k in range(len(now.key)):
        i, j = now.first[k], now.second[k]
        nx, ny = now.normal[k, 0], now.normal[k, 1]
        a, b = now.arm[k, 0], now.arm[k, 1]
        a_off, b_off = now.offset[k, 0], now.offset[k, 1]
        normal, tangent, _, _ = _forces(now, k, rates, spin, inverse_mass, inverse_moment, stiffness, damping)
        x, y = nx * normal - ny * tangent, nx * tangent + ny * normal
        acceleration[i, 0] -= inverse_mass[i] * x
        acceleration[i, 1] -= inverse_mass[i] * y
        turn[i] -= inverse_moment[i] * (a * tangent - a_off * normal)
        if j >= 0:
            acceleration[j, 0] += inverse_mass[j] * x
            acceleration[j, 1] += inverse_mass[j] * y
            turn[j] -= inverse_moment[j] * (b * tangent + b_off * normal)
        acceleration[row[k], 0] += x
        acceleration[row[k], 1] += y


class PenaltyContacts:
    """The contacts of a scene as forces.

    What each exchanges rides along in the state vector, as rows of its own: whatever weights an integrator gives to
    forces, it gives to them.
    """

    def __init__(self, store: BodyStore, settings: Settings, finder: CollisionPipeline) -> None:
        assert settings.stiffness is not None
        self._store, self._finder, self._settings = store, finder, settings
        self._stiffness = settings.stiffness
        self.rebuild(None)
        self._keys: IntArray = np.empty(0, np.int64)
        self._given: tuple[Manifolds, FloatArray] = finder.overlaps(store.position).of(slice(0)), np.zeros((0, 2))

    def rebuild(self, drives: Drives | None) -> None:
        """Derive the damping ratio of every pair of surfaces anew; take the drives of the driven bodies, if any."""
        self._drives = drives
        table = self._store.restitution
        if self._settings.damping is not None:
            damping = np.full(table.shape, self._settings.damping)
        else:
            known = {e: damping_of(max(e, LEAST_RESTITUTION)) for e in np.unique(table).tolist()}
            damping = np.vectorize(known.__getitem__, otypes=[float])(table) if table.size else table
        self._damping: FloatArray = damping.ravel()

    def moved(self, step: Step, t: float, x: State, u: Inputs, h: float) -> State:
        """Return the state a time h, s, ahead, with contacts acting during the whole step."""
        count = x.shape[1]
        fastest = float(np.sqrt((x[1, :, :2] ** 2).sum(axis=1)).max(initial=0.0))
        strongest = float(np.abs(u.steady[:, :2]).max(initial=0.0))
        margin = 4.0 * h * (fastest + h * strongest)
        near = self._finder.candidates(x[0], margin)
        self._keys = self._finder.manifolds(x[0], near, margin).key.copy()
        rows = len(self._keys)
        if not rows:
            self._given = self._given[0].of(slice(0)), self._given[1][:0]
            return step(transition, t, x, u, h)

        def forces(state: State) -> FloatArray:
            contacts = self._finder.manifolds(state[0, :count], near)
            acceleration = np.zeros((count + rows, x.shape[2]))
            if contacts.size:
                row, known = self._rows(contacts)
                self._add_forces(contacts.of(known), count + row[known], state[1], acceleration)
            return acceleration

        wide = np.concatenate((x, np.zeros((2, rows, x.shape[2]))), axis=1)
        still = np.zeros((rows, x.shape[2]))
        mobile = np.concatenate((np.broadcast_to(u.mobile, (count, 1)), np.zeros((rows, 1))))
        wide_u = u._replace(steady=np.concatenate((u.steady, still)), mobile=mobile, contacts=forces)
        wide = step(transition, t, wide, wide_u, h)
        self._note(wide[0, :count], wide[1, count:, :2], near, 3.0 * margin)
        return np.ascontiguousarray(wide[:, :count])

    def _rows(self, contacts: Manifolds) -> tuple[IntArray, BoolArray]:
        """Return each contact's row, and whether it has one: only in a diverging state do some have none."""
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

    def stored(self, pose: FloatArray) -> float:
        """Return the energy, J, stored in the springs of all contacts at poses (N, ≥ 2): ½ k overlap² each."""
        return 0.5 * self._stiffness * float(np.square(self._finder.overlaps(pose).separation).sum())

    def losses(self, x: State) -> tuple[float, float]:
        """Return the power, W, of all contacts in a state, along normals and across, less that of their springs."""
        contacts, store = self._finder.overlaps(x[0]), self._store
        spin = x[1, :, 2] if x.shape[2] == 3 else np.zeros((x.shape[1], 3))[:, 2]
        inverse = store.inverse_mass, self._inverse_moment
        return penalty_losses(contacts, x[1], spin, *inverse, self._stiffness, self._damping)

    def _note(self, position: FloatArray, impulse: FloatArray, near: CandidatePairs, reach: float) -> None:
        """Keep the impulses of the step (K, 2), also of contacts that have separated since."""
        contacts = self._finder.manifolds(position, near, reach)
        row, held = self._rows(contacts)
        given = np.zeros((contacts.size, 2))
        given[held] = impulse[row[held]]
        active = (contacts.separation < 0.0) | given.any(axis=1)
        contacts, given = contacts.of(active), given[active]
        nx, ny = contacts.normal[:, 0], contacts.normal[:, 1]
        along, across = given[:, 0] * nx + given[:, 1] * ny, given[:, 1] * nx - given[:, 0] * ny
        self._given = contacts, np.column_stack((along, across))

    def last_contacts(self) -> tuple[Manifolds, FloatArray]:
        """Return the contacts of the last step and their impulses (K, 2), N·s, normal and tangential."""
        return self._given


class PenaltySolver:
    """Solver with penalty contacts; its verbs are those of `ImpulseSolver`, which solves the joints.

    Contacts are forces, so that the integrator looks for them, and nothing corrects overlap.
    """

    def __init__(self, penalty: PenaltyContacts, impulses: ImpulseSolver) -> None:
        self._penalty, self._impulses = penalty, impulses

    def integrate(self, x: State, forces: Inputs, time: float, h: float) -> Motion:
        """Return the motion from a state at a time, s, over h, s, with contacts acting during the whole step."""
        return self._impulses.place(x, self._penalty.moved(self._impulses.scheme, time, x, forces, h), h)

    def detect(self, x: State) -> Manifolds:
        """Return the contacts of the last motion."""
        del x
        return self._penalty.last_contacts()[0]

    def solve(self, motion: Motion, contacts: Manifolds, h: float) -> Solution:
        """Return the state at the end of a motion over h, s, with joints and stops solved by impulses."""
        contacts, impulse = self._penalty.last_contacts()
        return self._impulses.solve(motion, contacts.of(slice(0)), h)._replace(contacts=contacts, impulse=impulse)

    def correct(self, solution: Solution, h: float) -> None:
        """Do nothing: springs need their overlap."""

    def finish(self, after: State) -> State:
        """Return the state to begin the next step with."""
        return self._impulses.finish(after)


class DrivenPenaltySolver(PenaltySolver):
    """Solver with penalty contacts and driven bodies, whose drives plan the motion."""

    def __init__(self, drives: Drives, penalty: PenaltyContacts, impulses: ImpulseSolver) -> None:
        super().__init__(penalty, impulses)
        self._drives = drives

    def integrate(self, x: State, forces: Inputs, time: float, h: float) -> Motion:
        """Return the motion from a state at a time, s, over h, s, with contacts acting during the whole step."""
        penalty, scheme = self._penalty, self._impulses.scheme

        def advance(start: State) -> tuple[State, Manifolds, FloatArray]:
            return penalty.moved(scheme, time, start, forces, h), *penalty.last_contacts()

        free = self._drives.advance_with_springs(x, h, advance)
        self._drives.place(free)
        return self._impulses.place(self._drives.start, free, h)


ROUNDING = 1e-9
"""Amplification above 1 that is rounding: a scheme that conserves energy has exactly 1."""

SPRING = 0.3
"""ω·h of a contact whose stiffness is left to the engine: ten substeps a contact."""

WORTH = 1e-3
"""ω·h below which a stable step is none worth the name: thousands of substeps a contact."""

DAMPER = 1.3
"""Times the damping ratio: by how much softer such a contact is where its damper is what limits the step."""


def lightest(start: Scene | Setup) -> float:
    """Return the smallest reduced mass, kg, of a pair that can collide: two equal balls have half the mass of one."""
    setup = Setup.of(start)
    scene, matrix, bodies = setup.scene, contact_matrix(setup), setup.bodies
    mass, moving, hinged = bodies.mass, ~bodies.fixed, False
    if scene.drives:
        mass, moving = mass.copy(), moving.copy()
        for name, mount in mounts(scene).items():
            if name in bodies.number_of:
                n = bodies.number_of[name]
                moving[n] = mount.drive.kind == "torque"
                hinged = hinged or bool(moving[n])
                arm = math.hypot(*mount.hinge)  # at its far end it is lightest: I / r²
                mass[n] = (bodies.moment[n] + bodies.mass[n] * arm * arm) / (bodies.radius[n] + arm) ** 2
    masses = mass[~matrix.free & moving]
    if not len(masses):
        return 1.0
    return float(masses.min()) * (0.5 if matrix.ball_ball or hinged else 1.0)


def suited(start: Scene | Setup, settings: Settings) -> float:
    """Return a stiffness, N/m, that goes with a step and the dampings that are asked for."""
    stiffest_damper = max(_dampings(contact_matrix(start), settings), default=0.0)
    own = lightest(start) * (SPRING / max(1.0, DAMPER * stiffest_damper) / settings.h) ** 2
    return min(own, MAX_STIFFNESS)


def _dampings(matrix: ContactMatrix, settings: Settings) -> list[float]:
    """Return the damping ratios of all contacts that can come about."""
    if settings.damping is not None:
        return [settings.damping]
    restitution = np.unique(matrix.surfaces.restitution[matrix.touching])
    return [damping_of(max(e, LEAST_RESTITUTION)) for e in restitution.tolist()]


def unstable(start: Scene | Setup, settings: Settings, stiffness_stated: bool = True) -> str | None:
    """Return why penalty springs cannot work as set, or None where they can.

    The stiffest case is a ball between several springs: two against static colliders, six in a close packing. There it
    oscillates √3 times as fast as a pair alone (the mode of shortest waves has ω² = 6 k/m; a pair, 2 k/m).
    """
    assert settings.stiffness is not None and settings.integrator is not None
    matrix = contact_matrix(start)
    if not matrix.touching.any():
        return None
    table = matrix.surfaces.restitution[matrix.touching]
    if settings.damping is None and table.min() < LEAST_RESTITUTION:
        return (
            f"penalty contacts cannot model restitution {table.min():g}, the smallest is "
            f"{LEAST_RESTITUTION:g}; use that, or "
            "set solver.damping (1 = critical) instead"
        )
    dampings = _dampings(matrix, settings)
    crowd = np.sqrt(3.0) if matrix.ball_ball else np.sqrt(2.0)
    frequency = crowd * np.sqrt(settings.stiffness / lightest(start))
    worst = max(dampings, key=lambda z: _growth(settings, frequency, crowd * z, settings.h))
    if _growth(settings, frequency, crowd * worst, settings.h) <= 1.0 + ROUNDING:
        return None
    bound = _largest(settings, frequency, crowd * worst)
    if not bound:
        remedy = "no step is stable; use integrator 'semi_implicit_euler' with a small step"
    else:
        # Only ω·h counts, so that a bound of the one is a bound of the other.
        softer = settings.stiffness * (bound / settings.h) ** 2
        remedy = f"use a solver.stiffness of at most {_rounded_down(softer):g} N/m"
        if stiffness_stated:  # the engine's own grows as h falls
            remedy += f", or h = dt / substeps of at most {_rounded_down(bound):g} s"
    return (
        f"penalty springs of {settings.stiffness:g} N/m would gain energy at h = {settings.h:g} s "
        f"with {settings.integrator}: {remedy}"
    )


def _rounded_down(value: float) -> float:
    """Return three digits of a value, no larger than it: a user may try just the bound of the message."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / unit) * unit


def _growth(settings: Settings, frequency: float, damping: float, h: float) -> float:
    assert settings.integrator is not None
    return amplification(INTEGRATORS[settings.integrator].step, frequency, damping, h)


def _largest(settings: Settings, frequency: float, damping: float) -> float:
    """Return the largest stable step, s, below the present one; 0 where there is none worth the name."""
    low, high = 0.0, settings.h
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _growth(settings, frequency, damping, middle) <= 1.0 + ROUNDING else (low, middle)
    return low if frequency * low > WORTH else 0.0
