"""Stage: the present state of a run, and the verbs that every detection scheme is spelled of.

    moved = stage.moved(h)              advance, freely
    contacts = stage.overlaps(moved)    detect
    stage.resolve(moved, contacts, h)   resolve, and take the result as the present state

Only `resolve` and `impact` change the present state.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from sandbox.engines.reference.finder import Finder
from sandbox.engines.reference.impulses import approach, remembered, solve_overlaps, solve_velocities
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import Inputs, State, transition
from sandbox.engines.reference.penalty import Penalty
from sandbox.engines.roster import Roster
from sandbox.scene.settings import Settings
from sandbox.trajectory import FloatArray, IntArray


class Witness(Protocol):
    """Who is told of every piece of a substep that is done."""

    def __call__(
        self, start: float, end: float, before: State, after: State, contacts: Manifolds, impulse: FloatArray
    ) -> None:
        """See the times, s, the states, and the contacts with their impulses (K, 2), normal and tangential, N·s."""


class Stage:
    """State x of N bodies at `time`, and what acts on them."""

    def __init__(self, roster: Roster, settings: Settings) -> None:
        assert settings.integrator and settings.broad_phase and settings.slop is not None and settings.bias is not None
        self._roster, self._settings = roster, settings
        self._slop, self._bias = settings.slop, settings.bias
        self._integrator = INTEGRATORS[settings.integrator]
        self.finder = Finder(roster, settings.broad_phase)
        self.penalty = Penalty(roster, settings, self.finder) if settings.response == "penalty" else None
        self.time = 0.0
        self.witness: Witness | None = None
        self._memory: tuple[IntArray, FloatArray, float] = np.empty(0, np.int64), np.empty((0, 2)), settings.h
        self.push: FloatArray = np.zeros((0, 2))
        self.enter()

    def enter(self) -> None:
        """Take the state from the roster, whose bodies may have been changed."""
        roster = self._roster
        turns = bool(roster.inverse_moment.any() or roster.angular_velocity.any())
        parts = [roster.position, roster.velocity]
        if turns:
            parts = [
                np.column_stack(p)
                for p in ((roster.position, roster.angle), (roster.velocity, roster.angular_velocity))
            ]
        self.x: State = np.stack(parts)
        # Overlap goes on being corrected, except for who is gone.
        kept = np.zeros((len(roster.position), 2))
        kept[: len(self.push)] = self.push
        self.push = np.where(roster.moving[:, None], kept, 0.0)
        self._pushes = bool(self.push.any())
        self._no_spin: FloatArray = np.zeros((len(roster.position), 3))
        self.finder.population_changed()
        if self.penalty is not None:
            self.penalty.population_changed()
        self.apply_forces()

    def leave(self) -> None:
        """Write the state into the roster."""
        roster = self._roster
        roster.position[:], roster.velocity[:] = self.x[0, :, :2], self.x[1, :, :2]
        if self.x.shape[2] == 3:
            roster.angle[:], roster.angular_velocity[:] = self.x[0, :, 2], self.x[1, :, 2]

    def apply_forces(self) -> None:
        """Gather what acts: gravity, steady forces, air."""
        roster, world = self._roster, self._roster.scene.world
        moving = roster.moving[:, None]
        steady = np.zeros_like(self.x[1])
        steady[:, :2] = np.where(moving, world.gravity, 0.0) + roster.force * roster.inverse_mass[:, None]
        if steady.shape[1] == 3:
            steady[:, 2] = roster.torque * roster.inverse_moment
        self.u = Inputs(steady, world.linear_drag, world.quadratic_drag, world.wind, moving.astype(np.float64))

    def moved(self, h: float) -> State:
        """Return the state a time h, s, ahead, as if nothing were hit on the way. Nothing is changed."""
        if self.penalty is not None:
            moved = self.penalty.moved(self._integrator.step, self.time, self.x, self.u, h)
        else:
            moved = self._integrator.step(transition, self.time, self.x, self.u, h)
        if self._pushes:
            moved[0, :, :2] += h * self.push
        return moved

    def overlaps(self, x: State) -> Manifolds:
        """Return the contacts in a state; they are good until the next look. Springs have looked while they moved."""
        return self.finder.overlaps(x[0]) if self.penalty is None else self.penalty.given()[0]

    def resolve(self, moved: State, contacts: Manifolds, h: float) -> None:
        """Part what overlaps after a step of h, s, and take the result as the present state.

        The rebound is e times the approach before the step's forces, as in Munk2D: what rests does not bounce by
        the kick of gravity. Positions follow a change of velocity as far as the scheme moves them within the step.
        """
        if self.penalty is not None:
            self._done(moved, *self.penalty.given(), h)
            return
        impulse = self._held(moved, contacts, h)
        self._pushes = False
        self.push[:] = 0.0
        if contacts.size:
            # The share of an overlap beyond the slop that one substep undoes; by the next one's motion.
            target = -(1.0 - self._bias**h) / h * np.minimum(contacts.separation + self._slop, 0.0)
            self._pushes = bool(target.any())
            if self._pushes:
                solve_overlaps(contacts, target, self.push, self._roster.inverse_mass, self._settings.iterations)
        self._memory = contacts.key.copy(), impulse, h
        self._done(moved, contacts, impulse, h)

    def impact(self, moved: State, clash: Manifolds, lasting: Manifolds, h: float) -> None:
        """Take a state a time h, s, ahead as the present one, in which some have just met; part them at once.

        What touched all the while is held up as in `resolve`: else gravity's kick would make it bounce.
        """
        held = self._held(moved, lasting, h)
        struck = np.zeros((clash.size, 2))
        bounce = self._approach(clash, moved[1]) * clash.coefficient[:, 0]
        self._solve(clash, bounce, moved[1], struck)
        self._done(moved, lasting.joined(clash), np.concatenate((held, struck)), h)

    def _held(self, moved: State, contacts: Manifolds, h: float) -> FloatArray:
        """Solve what touches at the end of h, s; return the impulses (K, 2), N·s.

        Both the state and the separations are brought up to date.
        """
        impulse = np.zeros((contacts.size, 2))
        if not contacts.size:
            return impulse
        share = self._integrator.share
        bounce = self._approach(contacts, self.x[1]) * contacts.coefficient[:, 0]
        key, old, old_h = self._memory
        remembered(contacts.key, key, old, impulse)
        # What rests takes impulses in proportion to the time. Never more: a blow does not grow with it.
        impulse *= min(h / old_h, 1.0)
        kicked = moved[1].copy()
        self._solve(contacts, bounce, moved[1], impulse)
        if share:
            change = moved[1] - kicked
            moved[0] += (share * h) * change
            contacts.separation[:] += (share * h) * self._approach(contacts, change)
        return impulse

    def _approach(self, contacts: Manifolds, velocity: FloatArray) -> FloatArray:
        out = np.empty(contacts.size)
        approach(contacts, velocity, out)
        return out

    def gentle(self, h: float) -> float:
        """Return the closing speed, m/s, that the forces of a substep or two bring about: of what rests, not hits."""
        return 2.0 * h * float(np.abs(self.u.steady[:, :2]).max(initial=0.0))

    def closing(self, contacts: Manifolds, x: State) -> FloatArray:
        """Return how fast each contact closes in a state, (K,) m/s."""
        return -self._approach(contacts, x[1])

    def _solve(self, contacts: Manifolds, bounce: FloatArray, velocity: FloatArray, impulse: FloatArray) -> None:
        inverse = self._roster.inverse_mass, self._roster.inverse_moment
        spin = (velocity if velocity.shape[1] == 3 else self._no_spin)[:, 2]
        solve_velocities(contacts, bounce, velocity, spin, *inverse, impulse, self._settings.iterations)

    def _done(self, after: State, contacts: Manifolds, impulse: FloatArray, h: float) -> None:
        before, self.x = self.x, after
        start, self.time = self.time, self.time + h
        if self.witness is not None:
            self.witness(start, self.time, before, after, contacts, impulse)


Detection = Callable[[Stage, float], None]
