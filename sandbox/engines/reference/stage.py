"""Stage: the present state of a run, and the verbs that every detection scheme is spelled of.

    moved = stage.moved(h)              advance, freely
    contacts = stage.overlaps(moved)    detect
    stage.resolve(moved, contacts, h)   resolve, and take the result as the present state

Only `resolve` and `impact` change the present state.
"""

import math
from collections.abc import Callable

import numpy as np

from sandbox.engines.account import Account, Cause
from sandbox.engines.reference.books import Bookkeeper, Idle
from sandbox.engines.reference.contact_solver import ContactSolver
from sandbox.engines.reference.driven.drives import Drives
from sandbox.engines.reference.finder import Finder
from sandbox.engines.reference.finders import finder_of, suits
from sandbox.engines.reference.forces import forces_on
from sandbox.engines.reference.impulses import remembered, solve_overlaps
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.joints.field import Field
from sandbox.engines.reference.joints.solver import JointSolver, kick_pose
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import State, transition
from sandbox.engines.reference.penalty import Penalty
from sandbox.engines.reference.sieve import Sieve
from sandbox.engines.reference.tearing import Tearing
from sandbox.engines.reference.witness import Witness
from sandbox.engines.reference.zoned_roster import ZonedRoster
from sandbox.engines.roster import Roster
from sandbox.scene.settings import Settings
from sandbox.trajectory import FloatArray, IntArray


class Stage:
    """State x of N bodies at `time`, and what acts on them."""

    def __init__(self, roster: Roster, settings: Settings) -> None:
        assert settings.integrator and settings.broad_phase and settings.slop is not None and settings.bias is not None
        self._roster, self._settings = roster, settings
        self.books = Idle()
        self._slop, self._bias = settings.slop, settings.bias
        self._integrator = INTEGRATORS[settings.integrator]
        self._links = roster.scene.links
        self._joints = self._joint_solver()
        self._tearing = Tearing(self._links)
        self._field = Field(roster)
        self._sieve = Sieve(roster) if Sieve.needed(roster.scene) else None
        self.drives: Drives | None = None
        self.finder = self._new_finder()
        self._fixtures = roster.fixtures
        self.penalty = Penalty(roster, settings, self.finder) if settings.response == "penalty" else None
        self.time = 0.0
        self.witness: Witness | None = None
        self._memory: tuple[IntArray, FloatArray, float] = np.empty(0, np.int64), np.empty((0, 2)), settings.h
        self.push: FloatArray = np.zeros((0, 3))
        """(N, 3) m/s and rad/s, by which overlap is undone in the next substep"""
        self.enter()

    def open_account(self) -> Account:
        """Return the account of energy, opened by the first call."""
        if not isinstance(self.books, Bookkeeper):
            self.books = Bookkeeper(self._roster, self._field, self._integrator.share)
            self._tell_books()
        return self.books.account

    def _tell_books(self) -> None:
        """Let the books know who is there. What looks for contacts on their behalf is no work of the stage's."""
        own = None if self.penalty is None else Penalty(self._roster, self._settings, self._new_finder())
        if own is not None:
            own.drives = self.drives
        self.books.population_changed(self.u, self._joints, own, self.drives)

    def _new_finder(self) -> Finder:
        assert self._settings.broad_phase
        return finder_of(self._roster, self._settings.broad_phase, self._sieve)

    def _joint_solver(self) -> JointSolver | None:
        """Return what holds the scene's links, if it has any."""
        how, roster = self._settings.joints, self._roster
        if not len(self._links):
            return None
        assert how is not None
        inverse = roster.inverse_mass, roster.inverse_moment
        cap = math.inf if self._settings.stretch is None else self._settings.stretch
        return JointSolver(self._links, *inverse, self._bias, self._settings.iterations, how, cap)

    def enter(self) -> None:
        """Take the state from the roster, whose bodies may have been changed."""
        roster = self._roster
        posed = len(self._links) > 0 or not self._field.empty or bool(roster.held)
        turns = posed or bool(roster.inverse_moment.any() or roster.angular_velocity.any())
        parts = [roster.position, roster.velocity]
        if turns:
            parts = [
                np.column_stack(p)
                for p in ((roster.position, roster.angle), (roster.velocity, roster.angular_velocity))
            ]
        self.x: State = np.stack(parts)
        if self._sieve is not None:
            self._sieve.population_changed(self.x[0])  # centres, until drives put hinges in their places
        self.drives = Drives.of(roster, self.drives)
        if self.drives is not None:
            self.drives.enter(self.x)
        # Overlap goes on being corrected, except for who is gone.
        kept = np.zeros((len(roster.position), 3))
        kept[: len(self.push)] = self.push
        self.push = np.where(roster.moving[:, None], kept, 0.0)
        self._pushes = bool(self.push.any())
        if not suits(self.finder, roster):  # keys mean other pairs from now on
            work, self.finder = self.finder.work, self._new_finder()
            self.finder.work = work
            self._memory = np.empty(0, np.int64), np.empty((0, 2)), self._settings.h
            if self._settings.response == "penalty":
                self.penalty = Penalty(roster, self._settings, self.finder)
        if roster.fixtures is not self._fixtures:  # other things may be solid now, and keys mean other segments
            self._fixtures = roster.fixtures
            self._memory = np.empty(0, np.int64), np.empty((0, 2)), self._settings.h
        self.finder.population_changed()
        times = self._settings.iterations
        dissipative = self._settings.impact == "dissipative"
        self._solver = ContactSolver(roster, times, self._joints, self.drives, self.finder.work, dissipative)
        if self._sieve is not None and self._sieve.gates is not None:
            overlaps = self.finder.at_gates(self.x[0])
            self._sieve.gates.begin(overlaps, self.closing(overlaps, self.x))
        if self._solver.parting is not None:
            self.finder.use(self._solver.parting.codes)
        if self.penalty is not None:
            self.penalty.drives = self.drives
            self.penalty.population_changed()
        if self._joints is not None:
            self._joints.use(roster.inverse_mass, roster.inverse_moment, roster.linked())
        self.apply_forces()

    @property
    def passing(self) -> IntArray | None:
        """Who is being let through a one-way wall, and which, −1 − k, (P, 2); none where nobody is."""
        return None if self._sieve is None or self._sieve.gates is None else self._sieve.gates.passing

    def visit(self, roster: ZonedRoster) -> None:
        """Let the zones of the roster note who came in during the substep that has ended, and do what they do."""
        if roster.look(self.centres(self.x)):
            self.leave()
            with self.books.doing(Cause.DRIVES):
                if roster.settle():
                    self.enter()

    def tear(self, h: float, time: float) -> None:
        """Break what gave more than its strength, on average over a substep of h, s, that ended at a time, s."""
        if not self._tearing.any:
            return
        broken = self._tearing.torn(h)
        if len(broken):
            self.leave()
            with self.books.doing(Cause.PARTED):
                self._roster.part(broken, time)
                self.enter()

    def leave(self) -> None:
        """Write the state into the roster."""
        roster = self._roster
        roster.position[:], roster.velocity[:] = self.x[0, :, :2], self.x[1, :, :2]
        if self.x.shape[2] == 3:
            roster.angle[:], roster.angular_velocity[:] = self.x[0, :, 2], self.x[1, :, 2]
        if self.drives is not None:
            self.drives.leave(self.x)

    def centres(self, x: State) -> FloatArray:
        """Return where the centres of all bodies are in a state, (N, 2) m."""
        return x[0, :, :2] if self.drives is None else self.drives.centred(x)

    def apply_forces(self) -> None:
        """Gather what acts: gravity, steady forces, air."""
        self.u = forces_on(self._roster, self._field, self._joints, self.x.shape[2])
        if isinstance(self.books, Bookkeeper):
            self._tell_books()

    def moved(self, h: float) -> State:
        """Return the state a time h, s, ahead, as if nothing were hit on the way. Nothing is changed."""
        x = self.x
        if self.drives is not None:
            x, moved = self._driven(self.drives, h)
        elif self.penalty is not None:
            moved = self.penalty.moved(self._integrator.step, self.time, x, self.u, h)
        else:
            moved = self._integrator.step(transition, self.time, x, self.u, h)
        shift = h * self.push[:, : moved.shape[2]] if self._pushes else None
        self.books.flown(x, moved, shift)
        if shift is not None:
            moved[0] += shift
        if self._joints is not None and self._joints.how != "impulses":
            self._joints.project(self.x, moved, h)
            self.finder.work["joint_iterations"] += self._joints.visits
        return moved

    def _driven(self, drives: Drives, h: float) -> tuple[State, State]:
        """Return from where on and to where the state goes in h, s, where some of it is led by drives."""
        penalty, step = self.penalty, self._integrator.step
        if penalty is None:
            moved = step(transition, self.time, drives.begin(self.x, h), self.u, h)
        else:
            moved = drives.spring(self.x, h, lambda x: (penalty.moved(step, self.time, x, self.u, h), *penalty.given()))
        drives.place(moved)
        return drives.start, moved

    def overlaps(self, x: State) -> Manifolds:
        """Return the contacts in a state; they are good until the next look. Springs have looked while they moved."""
        return self.finder.overlaps(x[0]) if self.penalty is None else self.penalty.given()[0]

    def resolve(self, moved: State, contacts: Manifolds, h: float) -> None:
        """Part what overlaps after a step of h, s, and take the result as the present state.

        The rebound is e times the approach before the step's forces, as in Munk2D: what rests does not bounce by
        the kick of gravity. Positions follow a change of velocity as far as the scheme moves them within the step.
        """
        if self.penalty is not None:
            contacts, given = self.penalty.given()
            self._held(moved, contacts.of(slice(0)), h)  # joints alone
            self._done(moved, contacts, given, h)
            return
        impulse = self._held(moved, contacts, h)
        self._pushes = False
        self.push[:] = 0.0
        if contacts.size:
            # The share of an overlap beyond the slop that one substep undoes; by the next one's motion.
            target = -(1.0 - self._bias**h) / h * np.minimum(contacts.separation + self._slop, 0.0)
            self._pushes = bool(target.any())
            if self._pushes:
                self.finder.work["contact_iterations"] += contacts.size * self._settings.iterations
                turning = self._roster.inverse_moment if self.drives is None else self.drives.firm
                inverse = self._roster.inverse_mass, turning
                solve_overlaps(contacts, target, self.push, *inverse, np.zeros_like(target), self._settings.iterations)
        self._memory = contacts.key.copy(), impulse, h
        self._done(moved, contacts, impulse, h)

    def impact(self, moved: State, clash: Manifolds, lasting: Manifolds, h: float) -> None:
        """Take a state a time h, s, ahead as the present one, in which some have just met; part them at once.

        What touched all the while is held up as in `resolve`: else gravity's kick would make it bounce.
        """
        held = self._held(moved, lasting, h)
        struck = np.zeros((clash.size, 2))
        bounce = self._solver.bounce(clash, moved[1])
        self._solver.resolve(clash, bounce, moved[1].copy(), moved[1], struck, settled=True)
        self.books.struck(moved, clash, struck, bounce.worth)
        self._done(moved, lasting.joined(clash), np.concatenate((held, struck)), h)

    def _held(self, moved: State, contacts: Manifolds, h: float) -> FloatArray:
        """Solve what touches at the end of h, s; return the impulses (K, 2), N·s.

        Both the state and the separations are brought up to date.
        """
        self.books.met(moved)
        impulse = np.zeros((contacts.size, 2))
        joined = self._joints is not None and self._joints.how == "impulses"
        if not (contacts.size or joined or self.drives is not None):
            return impulse
        share = self._integrator.share
        if self._joints is not None and joined:
            self._joints.prepare(kick_pose(moved, share, h), h)
        bounce = self._solver.bounce(contacts, self.x[1] if self.drives is None else self.drives.start[1])
        key, old, old_h = self._memory
        remembered(contacts.key, key, old, impulse)
        # What rests takes impulses in proportion to the time. Never more: a blow does not grow with it.
        impulse *= min(h / old_h, 1.0)
        kicked = moved[1].copy()
        self._solver.resolve(contacts, bounce, self.x[1], moved[1], impulse, joined)
        self.books.held(moved, contacts, impulse, bounce.worth)
        if share:
            change = moved[1] - (kicked if self.drives is None else self.drives.released(kicked))
            moved[0] += (share * h) * change
            contacts.separation[:] += (share * h) * self._solver.approach(contacts, change)
        return impulse

    def gentle(self, h: float) -> float:
        """Return the closing speed, m/s, that the forces of a substep or two bring about: of what rests, not hits."""
        return 2.0 * h * float(np.abs(self.u.steady[:, :2]).max(initial=0.0))

    def closing(self, contacts: Manifolds, x: State) -> FloatArray:
        """Return how fast each contact closes in a state, (K,) m/s."""
        return -self._solver.approach(contacts, x[1])

    def _done(self, after: State, contacts: Manifolds, impulse: FloatArray, h: float) -> None:
        before, self.x = self.x, after
        start, self.time = self.time, self.time + h
        if self.drives is not None:
            self.drives.done(after)
            self.books.led(before, after, h, contacts, impulse)
        self.books.done(start, after, h)
        if self._joints is not None and self._tearing.any:
            self._tearing.note(h * self._joints.load(after))
        if self.witness is not None:
            self.witness(start, self.time, before, after, contacts, impulse)
        if self._sieve is not None and self._sieve.gates is not None:
            self._sieve.gates.settle(self.finder.at_gates(after[0]), self.centres(after))


Detection = Callable[[Stage, float], None]
