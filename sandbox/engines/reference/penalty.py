"""Penalty: contacts as part of the forces, for any integrator; no impulses are solved."""

import numpy as np

from sandbox.engines.reference.candidates import Candidates
from sandbox.engines.reference.driven.drives import Drives
from sandbox.engines.reference.finder import Finder
from sandbox.engines.reference.integrators import Step
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import Inputs, State, transition
from sandbox.engines.reference.springs import LEAST_RESTITUTION, damping_of, penalty_forces, penalty_losses
from sandbox.engines.roster import Roster
from sandbox.scene.settings import Settings
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class Penalty:
    """The contacts of a scene as forces.

    What each exchanges rides along in the state vector, as rows of its own: whatever weights an integrator gives to
    forces, it gives to them.
    """

    def __init__(self, roster: Roster, settings: Settings, finder: Finder) -> None:
        assert settings.stiffness is not None
        self._roster, self._finder, self._settings = roster, finder, settings
        self._stiffness = settings.stiffness
        self.drives: Drives | None = None
        self.population_changed()
        self._keys: IntArray = np.empty(0, np.int64)
        self._given: tuple[Manifolds, FloatArray] = finder.overlaps(roster.position).of(slice(0)), np.zeros((0, 2))

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
        if not rows:
            self._given = self._given[0].of(slice(0)), self._given[1][:0]
            return step(transition, t, x, u, h)

        def forces(state: State) -> FloatArray:
            contacts = self._finder.manifolds(state[0, :count], near)
            acceleration = np.zeros((count + rows, x.shape[2]))
            if contacts.size:
                row, known = self._rows(contacts)
                self._push(contacts.of(known), count + row[known], state[1], acceleration)
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

    def _push(self, contacts: Manifolds, row: IntArray, rates: FloatArray, acceleration: FloatArray) -> None:
        roster = self._roster
        spin = rates[:, 2] if rates.shape[1] == 3 else np.zeros((len(rates), 3))[:, 2]
        turn = acceleration[:, 2] if rates.shape[1] == 3 else np.zeros((len(rates), 3))[:, 2]
        inverse = roster.inverse_mass, self._inverse_moment
        penalty_forces(contacts, row, rates, spin, *inverse, self._stiffness, acceleration, turn)

    @property
    def _inverse_moment(self) -> FloatArray:
        return self._roster.inverse_moment if self.drives is None else self.drives.yielding

    def stored(self, pose: FloatArray) -> float:
        """Return what the springs of all contacts at (N, ≥ 2) poses store, ½ k overlap² each, J."""
        return 0.5 * self._stiffness * float(np.square(self._finder.overlaps(pose).separation).sum())

    def losses(self, x: State) -> tuple[float, float]:
        """Return the power, W, of all contacts in a state, along normals and across, less that of their springs."""
        contacts, roster = self._finder.overlaps(x[0]), self._roster
        spin = x[1, :, 2] if x.shape[2] == 3 else np.zeros((x.shape[1], 3))[:, 2]
        inverse = roster.inverse_mass, self._inverse_moment
        return penalty_losses(contacts, x[1], spin, *inverse, self._stiffness)

    def _note(self, position: FloatArray, impulse: FloatArray, near: Candidates, reach: float) -> None:
        """Keep what was exchanged (K, 2) for whoever asks, also by those that have parted since."""
        contacts = self._finder.manifolds(position, near, reach)
        row, held = self._rows(contacts)
        given = np.zeros((contacts.size, 2))
        given[held] = impulse[row[held]]
        active = (contacts.separation < 0.0) | given.any(axis=1)
        contacts, given = contacts.of(active), given[active]
        nx, ny = contacts.normal[:, 0], contacts.normal[:, 1]
        along, across = given[:, 0] * nx + given[:, 1] * ny, given[:, 1] * nx - given[:, 0] * ny
        self._given = contacts, np.column_stack((along, across))

    def given(self) -> tuple[Manifolds, FloatArray]:
        """Return the contacts of the last step and what each gave (K, 2), along its normal and across, N·s."""
        return self._given
