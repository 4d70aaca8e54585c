"""Drives: the driven bodies of a stage, and how contacts find them.

A body on a hinge has its moment about that, and is held by its stops as by one-sided joints. Where all that it meets
presses it onto its stop as well, it is immovable for that substep: contact and stop in turn would not get there in
10 iterations. What a stroke or a plunger leads is moved by nothing, and has its velocity all through a substep.
"""

from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np

from sandbox.engines.reference.driven.lead import Hinge, Lead, lead_of
from sandbox.engines.reference.joints.rows import Rows, rows_of
from sandbox.engines.reference.joints.ties import ties_of
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import State
from sandbox.engines.reference.together import Stops, solve_together
from sandbox.engines.roster import Roster
from sandbox.trajectory import FloatArray, IntArray


class Work(NamedTuple):
    """What a substep did to driven bodies, J."""

    gained: float
    """kinetic energy, and the height of what nothing stops"""
    weight: float
    """by the weight of what is on a hinge, as the step has it"""
    lifted: float
    """the potential energy that this gained"""


class Drives:
    """The driven bodies that are there."""

    def __init__(self, roster: Roster) -> None:
        self._roster = roster
        self.leads: list[Lead] = [lead_of(roster, number, mount) for number, mount in roster.held.items()]
        self._hinges = [lead for lead in self.leads if isinstance(lead, Hinge)]
        self._numbers: IntArray = np.asarray([lead.number for lead in self.leads], np.int64)
        self._turning = not roster.led[self._numbers].all()
        self.firm: FloatArray = roster.inverse_moment.copy()
        """(N,) 1/(kg·m²), with which overlaps are undone: driven bodies stay where they have to be"""
        self.firm[self._numbers] = 0.0
        self.yielding: FloatArray = roster.inverse_moment
        """(N,) 1/(kg·m²), as forces find them in the planned substep: what stands on a stop does not give way"""
        self._no_rows: Rows = rows_of(ties_of(roster.scene.links, among=np.empty(0, np.int64)))

    @classmethod
    def of(cls, roster: Roster, old: Self | None) -> Self | None:
        """Return those of a roster, who go on from old ones; none where none is driven."""
        if not roster.held:
            return None
        new = cls(roster)
        stopped = {} if old is None else {hinge.number: hinge for hinge in old._hinges}
        for hinge in new._hinges:
            if hinge.number in stopped:
                hinge.follow(stopped[hinge.number])
        return new

    def enter(self, x: State) -> None:
        """Write hinges into a state (2, N, 3) in the place of centres."""
        for lead in self.leads:
            lead.enter(x)

    def leave(self, x: State) -> None:
        """Write the centres of a state into the roster."""
        roster = self._roster
        for lead in self.leads:
            roster.position[lead.number], roster.velocity[lead.number] = lead.centre(*x)

    def centred(self, x: State) -> FloatArray:
        """Return where all centres are in a state, (N, 2) m."""
        position = x[0, :, :2].copy()
        for lead in self.leads:
            position[lead.number] = lead.centre(*x)[0]
        return position

    def begin(self, x: State, h: float) -> State:
        """Plan a substep of h, s, from a state; return that with the velocities that the led have through it."""
        self.start = x.copy()
        """(2, N, 3) where the planned substep begins"""
        for lead in self.leads:
            lead.plan(x, h)
            lead.begin(self.start)
        return self.start

    def spring(self, x: State, h: float, spring: Callable[[State], tuple[State, Manifolds, FloatArray]]) -> State:
        """Return the state h, s, ahead, under contacts that are forces all the way.

        What stands on a stop stands still as long as they, too, press it there, or less off than its drive presses.
        Whatever else is on a hinge goes evenly, and they turn it besides; how far, with stops, is its drive's matter.

        Args:
            x: (2, N, 3) the state.
            h: s.
            spring: the way of all bodies from a state, with the contacts and what each gave, (K, 2) N·s.
        """
        self.begin(x, h)
        for lead in self.leads:
            lead.glide(self.start, h)
        self.yielding = self._roster.inverse_moment.copy()
        standing = [hinge for hinge in self._hinges if hinge.stands]
        self.yielding[[hinge.number for hinge in standing]] = 0.0
        while True:  # at most once for each of them
            moved, contacts, given = spring(self.start)
            loose = [each for each in standing if not each.sprung(self._turn(each, contacts, given))]
            if not loose:
                break
            for hinge in loose:
                hinge.plan(x, h)
                self.yielding[hinge.number] = 1.0 / hinge.moment
            standing = [hinge for hinge in standing if hinge not in loose]
            for hinge in standing:
                hinge.plan(x, h)
        for hinge in self._hinges:
            if hinge not in standing:
                n = hinge.number
                hinge.sprung(float(moved[1, n, 2] - self.start[1, n, 2]))
        return moved

    def _turn(self, hinge: Hinge, contacts: Manifolds, impulse: FloatArray) -> float:
        """Return by how much impulses (K, 2), N·s, would change the spin of a body on a hinge, rad/s."""
        turn = 0.0
        for who, side, sign in ((contacts.first, 0, -1.0), (contacts.second, 1, 1.0)):
            which = who == hinge.number
            turn -= float(contacts.arm[which, side] @ impulse[which, 1])
            turn -= sign * float(contacts.offset[which, side] @ impulse[which, 0])
        return turn / hinge.moment

    def place(self, moved: State) -> None:
        """Write the end of the planned substep into a state."""
        for lead in self.leads:
            lead.place(moved)

    def released(self, rates: FloatArray) -> FloatArray:
        """Return rates (N, 3) after the planned substep, without what presses onto stops."""
        rates = rates.copy()
        for hinge in self._hinges:
            rates[hinge.number, 2] = hinge.turned.spin
        return rates

    def solve(
        self,
        contacts: Manifolds,
        bounce: FloatArray,
        rows: Rows | None,
        velocity: FloatArray,
        impulse: FloatArray,
        iterations: int,
    ) -> None:
        """Give contacts, joints and stops their impulses; the arguments are those of `solve_together`."""
        inverse_moment, stopped = self._roster.inverse_moment.copy(), list[Hinge]()
        for hinge in self._hinges:
            if hinge.way and _presses(contacts, hinge.number, hinge.way):
                inverse_moment[hinge.number] = velocity[hinge.number, 2] = 0.0
            elif hinge.way:
                stopped.append(hinge)
        stops = Stops(
            np.asarray([hinge.number for hinge in stopped], np.int64),
            np.asarray([hinge.way for hinge in stopped]),
            np.asarray([hinge.given for hinge in stopped]),
        )
        rows = self._no_rows if rows is None else rows
        inverse = self._roster.inverse_mass, inverse_moment
        solve_together(contacts, bounce, rows, stops, velocity, *inverse, impulse, iterations)
        given = dict(zip(stops.body.tolist(), stops.given.tolist(), strict=True))
        for hinge in self._hinges:
            hinge.hold(given.get(hinge.number, 0.0))

    def done(self, after: State) -> None:
        """Take the planned substep as done."""
        for lead in self.leads:
            lead.done(after)

    def taken(self, contacts: Manifolds, impulse: FloatArray, mean: FloatArray) -> float:
        """Return the work of impulses (K, 2), N·s, on driven bodies, J; at mean rates (N, 3)."""
        if not contacts.size:
            return 0.0
        along, across = impulse.T
        push = contacts.normal * along[:, None] + _left(contacts.normal) * across[:, None]
        work = 0.0
        for who, side, sign in ((contacts.first, 0, -1.0), (contacts.second, 1, 1.0)):
            which = np.isin(who, self._numbers)
            rate = mean[who[which]]
            lever = contacts.arm[which, side] * across[which] + sign * contacts.offset[which, side] * along[which]
            work += sign * float((push[which] * rate[:, :2]).sum()) - float(lever @ rate[:, 2])
        return work

    def work(self, before: State, after: State, h: float) -> Work:
        """Return what a substep of h, s, did, between two states."""
        gained = weight = lifted = 0.0
        for lead in self.leads:
            gained += lead.kinetic(after[1]) - lead.kinetic(before[1])
            rise = lead.height(after[0]) - lead.height(before[0])
            if isinstance(lead, Hinge):
                n = lead.number
                weight += lead.fall * h * 0.5 * float(before[1, n, 2] + after[1, n, 2])
                lifted += rise
            else:
                gained += rise
        return Work(gained, weight, lifted)


def _left(normal: FloatArray) -> FloatArray:
    """Return normals (K, 2) turned left."""
    return np.column_stack((-normal[:, 1], normal[:, 0]))


def _presses(contacts: Manifolds, number: int, way: float) -> bool:
    """Tell whether a body meets something, and all of it turns it in one sense, or not at all."""
    first, second = contacts.first == number, contacts.second == number
    if not (first.any() or second.any()):
        return False
    return bool((way * contacts.offset[first, 0] >= 0.0).all() and (way * contacts.offset[second, 1] <= 0.0).all())
