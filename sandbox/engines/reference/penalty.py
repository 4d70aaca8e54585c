"""Penalty: contacts as stiff springs with dampers, part of the forces; no impulses are solved.

    F = k·overlap + c·closing speed, never pulling;   friction: min(μ F, γ·slip), against the slip

A pair's damping follows from its restitution, for a contact that ends when its force does (Schwager & Pöschel 2007,
Granular Matter 9, 465): of the damping ratio ζ alone, whatever the masses and the speed. Overlap is the price: speed
over √(k/m), and m g/k at rest. Friction creeps, as it needs a slip to act.
"""

import math

import numpy as np

from sandbox.engines.kernel import kernel
from sandbox.engines.reference.finder import Finder
from sandbox.engines.reference.integrators import Step
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import Inputs, State, transition
from sandbox.engines.roster import Roster
from sandbox.scene.settings import Settings
from sandbox.trajectory import FloatArray

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


class Penalty:
    """The contacts of a scene as forces. What each exchanges rides along in the state vector, as rows of its own:
    whatever weights an integrator gives to forces, it gives to them."""

    def __init__(self, roster: Roster, settings: Settings, finder: Finder) -> None:
        assert settings.stiffness is not None
        self._roster, self._finder, self._settings = roster, finder, settings
        self._stiffness = settings.stiffness
        self.population_changed()
        self._keys = np.empty(0, np.int64)
        self._given: tuple[Manifolds, FloatArray] = finder.overlaps(roster.position), np.zeros((0, 2))

    def population_changed(self) -> None:
        """Work out the damping of every pair of surfaces."""
        table = self._roster.restitution
        if self._settings.damping is not None:
            damping = np.full(table.shape, self._settings.damping)
        else:
            known = {e: damping_of(max(e, LEAST_RESTITUTION)) for e in np.unique(table).tolist()}
            damping = np.vectorize(known.__getitem__, otypes=[float])(table) if table.size else table
        self._finder.use(damping)

    def moved(self, step: Step, t: float, x: State, u: Inputs, h: float) -> State:
        """Return the state a time h, s, ahead, contacts acting all the way."""
        count = x.shape[1]
        fastest = float(np.sqrt((x[1, :, :2] ** 2).sum(axis=1)).max(initial=0.0))
        strongest = float(np.abs(u.steady[:, :2]).max(initial=0.0))
        margin = 4.0 * h * (fastest + h * strongest)
        near = self._finder.candidates(x[0], margin)
        self._keys = self._finder.manifolds(x[0], near, margin).key.copy()
        rows = len(self._keys)

        def forces(state: State) -> FloatArray:
            contacts = self._finder.manifolds(state[0, :count], near)
            acceleration = np.zeros((count + rows, x.shape[2]))
            if contacts.size:
                row = count + np.searchsorted(self._keys, contacts.key)
                known = self._known(contacts)
                self._push(contacts.of(known), row[known], state[1], acceleration)
            return acceleration

        wide = np.concatenate((x, np.zeros((2, rows, x.shape[2]))), axis=1)
        still = np.zeros((rows, x.shape[2]))
        mobile = None if u.mobile is None else np.concatenate((u.mobile, np.zeros((rows, 1))))
        wide_u = u._replace(steady=np.concatenate((u.steady, still)), mobile=mobile, contacts=forces)
        wide = step(transition, t, wide, wide_u, h)
        self._note(wide[:, :count], wide[1, count:, :2], near)
        return np.ascontiguousarray(wide[:, :count])

    def _known(self, contacts: Manifolds) -> FloatArray:
        """Tell which contacts were near at the start; only a diverging state has others."""
        row = np.minimum(np.searchsorted(self._keys, contacts.key), max(len(self._keys) - 1, 0))
        return self._keys[row] == contacts.key if len(self._keys) else np.zeros(contacts.size, np.bool_)

    def _push(self, contacts: Manifolds, row: FloatArray, rates: FloatArray, acceleration: FloatArray) -> None:
        roster = self._roster
        spin = rates[:, 2] if rates.shape[1] == 3 else np.zeros((len(rates), 3))[:, 2]
        turn = acceleration[:, 2] if rates.shape[1] == 3 else np.zeros((len(rates), 3))[:, 2]
        penalty_forces(
            contacts, row, rates, spin, roster.inverse_mass, roster.inverse_moment, self._stiffness, acceleration, turn
        )

    def _note(self, x: State, impulse: FloatArray, near: object) -> None:
        """Keep what was exchanged, for whoever asks: in the present contacts' own directions."""
        contacts = self._finder.manifolds(x[0], self._finder.candidates(x[0], self._reach(x)), self._reach(x))
        row = np.minimum(np.searchsorted(self._keys, contacts.key), max(len(self._keys) - 1, 0))
        held = self._known(contacts)
        given = np.zeros((contacts.size, 2))
        given[held] = impulse[row[held]]
        active = (contacts.separation < 0.0) | given.any(axis=1)
        contacts, given = contacts.of(active), given[active]
        nx, ny = contacts.normal[:, 0], contacts.normal[:, 1]
        along, across = given[:, 0] * nx + given[:, 1] * ny, given[:, 1] * nx - given[:, 0] * ny
        self._given = contacts, np.column_stack((along, across))

    def _reach(self, x: State) -> float:
        return 1e-3 * self._finder.widest

    def given(self) -> tuple[Manifolds, FloatArray]:
        """Return the contacts of the last step and what each gave (K, 2), along its normal and across, N·s."""
        return self._given


@kernel
def penalty_forces(
    now: Manifolds,
    row: FloatArray,
    rates: FloatArray,
    spin: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    stiffness: float,
    acceleration: FloatArray,
    turn: FloatArray,
) -> None:
    """Add the accelerations of spring contacts.

    Args:
        now: K contacts; their first coefficient is the damping ratio.
        row: (K,) where in `acceleration` each contact's own force goes.
        rates: (N + …, ≥ 2) velocities, m/s.
        spin: (N + …,) rad/s.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        stiffness: k, N/m.
        acceleration: (N + …, ≥ 2) added to, m/s²; in a contact's row, the force on its second, N.
        turn: (N + …,) added to, rad/s².
    """
    for k in range(len(now.key)):
        i, j = now.first[k], now.second[k]
        nx, ny = now.normal[k, 0], now.normal[k, 1]
        a, b = now.arm[k, 0], now.arm[k, 1]
        mass, turning = inverse_mass[i], inverse_moment[i] * a * a
        vx, vy, rub = -rates[i, 0], -rates[i, 1], -spin[i] * a
        if j >= 0:
            mass += inverse_mass[j]
            turning += inverse_moment[j] * b * b
            vx += rates[j, 0]
            vy += rates[j, 1]
            rub -= spin[j] * b
        if mass == 0.0:
            continue
        damper = 2.0 * now.coefficient[k, 0] * math.sqrt(stiffness / mass)
        normal = max(-stiffness * now.separation[k] - damper * (vx * nx + vy * ny), 0.0)
        slip = vy * nx - vx * ny + rub
        most = now.coefficient[k, 1] * normal
        # A viscous slope that damps slip as fast as the spring swings, so that it asks for no smaller step.
        tangent = min(max(-math.sqrt(stiffness * mass) / (mass + turning) * slip, -most), most)
        x, y = nx * normal - ny * tangent, nx * tangent + ny * normal
        acceleration[i, 0] -= inverse_mass[i] * x
        acceleration[i, 1] -= inverse_mass[i] * y
        turn[i] -= inverse_moment[i] * a * tangent
        if j >= 0:
            acceleration[j, 0] += inverse_mass[j] * x
            acceleration[j, 1] += inverse_mass[j] * y
            turn[j] -= inverse_moment[j] * b * tangent
        acceleration[row[k], 0] += x
        acceleration[row[k], 1] += y
