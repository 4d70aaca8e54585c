"""Books: the account of a pymunk run, substep by substep."""

import numpy as np

from sandbox.engines.account import Account, Cause
from sandbox.engines.native.hauls import Hauls, Momenta, motors, springs
from sandbox.engines.native.kicks import Kicks, kicks_of
from sandbox.engines.native.population import Population
from sandbox.engines.native.states import State
from sandbox.engines.native.strides import meant, worked
from sandbox.engines.native.tension import spring_forces
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.potential import Potential
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class Books:
    """The energy that each cause has brought since the books were opened.

    All that acts within a substep acts at once: an impulse's work is the impulse times the mean of the velocities at
    the substep's beginning and end, where it acts. These works add up to what kinetic energy changes by, exactly. So a
    body at rest has no entries, though each substep kicks it down and its contact kicks it back; and a contact takes
    ½ μ (1 − e²) v² of an impact, but for a part of the kick that comes on top. What the time step does is the
    integrator's: positions move by the old velocity, so that gravity's work and the height lost do not agree.

    Of contacts, springs and motors the impulses are pymunk's own figures. Of other joints pymunk tells only how large
    they are: theirs are what changed their bodies' momenta besides, so that in scenes with joints the residual tells
    less. pymunk mends a joint by velocities, which gives energy: that is phantom, not position correction.

    The residual is rounding, of pymunk's sums and of those here. Over the first 0.1 to 1 s of the shipped scenes it was
    6e-13 at most of the most energy that was in motion or turned over by one cause: in the pyramid, whose height holds
    2,000 times as much. Where things move it was below 1e-13.
    """

    def __init__(self, population: Population) -> None:
        """Open the books of a population."""
        self.account = Account()
        self._population = population
        self._breaks = np.full(len(population.scene.links), np.inf)
        self._potential: tuple[tuple[Scene, Bodies], Potential] | None = None
        population.meeting.field.told = {}
        population.meeting.encounters.points()  # from now on what contacts begin with is remembered

    def opening(self) -> State | None:
        """Return the state that a substep is booked from; none while gravity alone acts on all that moves."""
        p = self._population
        return None if p.free.even and not len(p.meeting) else self._state()

    def _state(self) -> State:
        p = self._population
        p.refresh()
        return State(p.position.copy(), p.angle.copy(), p.velocity.copy(), p.angular_velocity.copy())

    def substep(self, before: State | None, share: float = 1.0) -> None:
        """Book the substep that has just been made or, where it is cut, a first share of it."""
        p, account = self._population, self.account
        if p.free.even:
            account.enter(Cause.INTEGRATOR, self._fallen(share))
        if before is None:
            return
        counts = p.yielding
        if p.free.even:
            counts[p.free.numbers] = False
        axles = p.meeting.drives.axles
        counts[p.meeting.drives.numbers] = False  # whose motion is booked for itself
        whole = self._state()
        now = before.towards(whole, share)
        if now is not whole:
            p.meeting.drives.seat(now.position, now.velocity, now.angle, now.spin)
        velocity, spin = self._mean(before, now, counts)
        meant(axles, before, now, velocity, spin)
        held = p.meeting.tethers.held
        drawn = spring_forces(held.springs, whole.position, whole.angle) if len(held.springs) else None
        kicks = kicks_of(p, before.velocity, counts, drawn, p.h * share)
        kicks.twisted[~self._turnable()] = 0.0
        hauls = springs(p.meeting.tethers, whole.position, whole.angle, p.h) if held else ((), ())
        stiff, damped = (tuple(each.times(share) for each in some) for some in hauls)
        points = p.meeting.encounters.points().times(share)

        self._move(before, now, counts, share, kicks, (velocity, spin))
        for each in stiff:
            account.add(Cause.INTEGRATOR, each.work(velocity, spin))
        account.enter(Cause.DRAG, float(np.sum(kicks.dragged * velocity[:-1])))
        account.enter(Cause.DRIVES, float(np.sum(kicks.driven * velocity[:-1]) + kicks.twisted @ spin[:-1]))
        account.enter(Cause.DAMPING, sum(each.work(velocity, spin) for each in damped))
        along, across, by_kicks = points.work(velocity, spin)
        account.touch(along, across)
        account.enter(Cause.KICKS, by_kicks)
        if axles:
            gravity = p.scene.world.gravity
            work = worked(axles, (before, now), (velocity, spin), points, p.bodies, gravity, p.h, share)
            account.enter(Cause.DRIVES, work.driven)
            account.enter(Cause.INTEGRATOR, work.weight + work.lifted)

        if len(held.rigid):
            given = self._given(before, now, counts, kicks)
            for haul in (*stiff, *damped, points.hauls):
                given.less(haul)
            self._joints(given, whole, share, velocity, spin)

    def parted(self, numbers: IntArray) -> None:
        """Book that joints, by their numbers, have come apart."""
        now = self._state()
        before = self._stored(now)
        self._breaks[numbers], self._potential = -np.inf, None
        self.account.enter(Cause.PARTED, float(self._stored(now)[0] - before[0]))

    def _fallen(self, share: float) -> float:
        """Return what explicit Euler gives to bodies on which gravity alone acts: ½ m (g h)² in each substep."""
        p = self._population
        kick = p.h * np.asarray(p.scene.world.gravity)
        ahead = 1.0 if p.ahead.any() else 0.0  # which is right but for a substep that is cut
        mass = float(p.bodies.mass[p.free.numbers].sum())
        return 0.5 * mass * float(kick @ kick) * share * (share - ahead)

    def _mean(self, before: State, now: State, counts: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Return mean velocities (N + 1, 2), as reported, and spins (N + 1,); of what never moves, and the world, 0."""
        velocity = 0.5 * (before.velocity + now.velocity) - self._population.ahead
        spin = 0.5 * (before.spin + now.spin)
        velocity[~counts], spin[~counts] = 0.0, 0.0
        return np.vstack((velocity, np.zeros((1, 2)))), np.append(spin, 0.0)

    def _move(
        self,
        before: State,
        now: State,
        counts: BoolArray,
        share: float,
        kicks: Kicks,
        mean: tuple[FloatArray, FloatArray],
    ) -> None:
        """Book what weight gave to velocities and took by height: along the old velocities, and beyond that way."""
        p = self._population
        h = p.h * share
        drift = np.where(counts[:, None], before.position + before.velocity * h, now.position)
        turned = np.where(counts, before.angle + before.spin * h, now.angle)
        heavy = np.where(counts, p.bodies.mass, 0.0)[:, None] * np.asarray(p.scene.world.gravity)
        fallen = float(np.sum(heavy * np.where(counts[:, None], drift - before.position, 0.0)))
        shifted = float(np.sum(heavy * (now.position - drift)))
        start, middle, end = self._stored(before, State(drift, turned, *now[2:]), now).tolist()
        worked = float(np.sum(kicks.weight * mean[0][:-1]))
        self.account.enter(Cause.INTEGRATOR, worked - fallen + (middle - start))
        self.account.enter(Cause.CORRECTION, (end - middle) - shifted)

    def _stored(self, *states: State) -> FloatArray:
        """Return what springs and attraction store in some states, (S,) J."""
        p = self._population
        key = p.scene, p.bodies
        if self._potential is None or any(a is not b for a, b in zip(key, self._potential[0], strict=True)):
            self._potential = key, Potential(p.scene, p.bodies, breaks=self._breaks)
        potential = self._potential[1]
        if not potential:
            return np.zeros(len(states))
        there = np.broadcast_to(p.present, (len(states), len(p.present)))
        places, angles = np.stack([s.position for s in states]), np.stack([s.angle for s in states])
        return potential.at(np.zeros(len(states)), places, angles, there)

    def _turnable(self) -> BoolArray:
        """Tell which bodies a torque turns, (N,): in the space those that something can turn have moments."""
        p = self._population
        turnable = np.ones(len(p.position), np.bool_)
        for number in p.meeting.steady:
            turnable[number] = np.isfinite(p.meeting.moment(number))
        return turnable

    def _given(self, before: State, now: State, counts: BoolArray, kicks: Kicks) -> Momenta:
        """Return what bodies were given besides kicks."""
        p = self._population
        mass, moment = np.where(counts, p.bodies.mass, 0.0), np.where(counts, p.bodies.moment, 0.0)
        gained = mass[:, None] * (now.velocity - before.velocity) - kicks.weight - kicks.driven - kicks.dragged
        twisted = moment * (now.spin - before.spin) - kicks.twisted
        rigid = p.meeting.tethers.held.rigid
        return Momenta(np.vstack((gained, np.zeros((1, 2)))), np.append(twisted, 0.0), np.union1d(rigid.a, rigid.b))

    def _joints(self, given: Momenta, whole: State, share: float, velocity: FloatArray, spin: FloatArray) -> None:
        """Book what joints gave, motors apart."""
        driven: Hauls = motors(self._population.meeting.tethers, whole.position, whole.angle, given).times(share)
        given.less(driven)
        self.account.enter(Cause.DRIVES, driven.work(velocity, spin))
        self.account.enter(Cause.JOINTS, given.work(velocity, spin))
