"""NativeSimulation: a scene running in a pymunk space, and beside it, as arrays, what can meet nothing."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from sandbox.action import Action
from sandbox.engines.account import Account, Cause
from sandbox.engines.acting import perform
from sandbox.engines.booked import booked
from sandbox.engines.contract import Divergence, Observer
from sandbox.engines.expiry import Expiry
from sandbox.engines.native.books import Books
from sandbox.engines.native.cast import NativeCast
from sandbox.engines.native.notes import Notes
from sandbox.engines.native.population import Population
from sandbox.engines.running import Running
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, FloatArray, Frame, IntArray


class NativeSimulation(Running):
    """A running scene.

    Scheme: drift–kick, explicit Euler for free motion (position error +g·h·T/2, velocity exact). With `half_kick`
    velocities start g·h/2 ahead, and are reported that much back: positions under gravity are then exact to
    rounding until the first contact. In contact the correction goes on being reported, and means nothing there.

    Contacts are found at the end of a substep, with no time of impact: a body that passes a thin thing within one
    substep is not seen to touch it.

    On a floor balls slide and roll as `felt.py` has it: exactly while they meet nothing, and hits are taken back to
    when the two touched.
    """

    def __init__(self, scene: Scene, settings: Settings) -> None:
        super().__init__(settings)
        self._population = Population(scene, settings)
        self._h = settings.h
        self._notes: Notes | None = None
        self._observer: Observer | None = None
        self._books: Books | None = None
        self._retired: dict[int, float] = {}
        self._broken: dict[int, float] = {}
        self._joint_iterations = 0
        self._expiry = Expiry(scene.bodies, scene.began, settings.h)
        self._still: tuple[FloatArray, FloatArray] | None = None  # angles and spins, which frames share if they can

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self._population.scene

    @property
    def bodies(self) -> Bodies:
        """The bodies by number, as they started; spawned ones join at the end."""
        return self._population.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """When each body that is no longer there was gone: number → s."""
        return MappingProxyType(self._retired)

    @property
    def broken(self) -> Mapping[int, float]:
        """When each joint broke that did: its number in `scene.links` → s."""
        return MappingProxyType(self._broken)

    @property
    def work(self) -> Mapping[str, int]:
        """What was done so far; pymunk does not tell how many pairs it looks at.

        Its contacts, and with them `contact_iterations`, count only from the first call of `contacts` or `watch` on:
        until then nobody asks pymunk for them.
        """
        contacts = 0 if self._notes is None else self._notes.contacts
        return {
            "substeps": self.substeps,
            "contacts": contacts,
            "contact_iterations": contacts * self._settings.iterations,
            "joint_iterations": self._joint_iterations,
        }

    @property
    def flying(self) -> int:
        """How many bodies are advanced as arrays, outside of pymunk."""
        return len(self._population.free)

    def step(self) -> None:
        """Advance by one dt.

        Raises:
            Divergence: a body is no longer finite, or beyond all bounds. The state can still be read.
        """
        with self._turn:
            self._check_running()
            self._advance(self._settings.substeps)
            self._steps += 1
            self._guard()
            self._retire()

    def finish(self, part: float) -> None:
        """Advance by a last part of dt, 0 < part < 1.

        Whole substeps first. The state within the substep that is cut is interpolated, which for positions is
        the scheme's own path.

        Raises:
            Divergence: as `step`.
            ValueError: there is no such part.
        """
        self._check_part(part)
        with self._turn:
            self._check_running()
            self._finish(part)

    def _finish(self, part: float) -> None:
        whole, rest = divmod(part * self._settings.substeps, 1.0)
        self._advance(int(whole))
        if self._population.felt is not None:  # which can take a shorter step, with its contacts
            if rest:
                self._substep(int(whole), self.time, share=rest)
            self._part = part
            self._guard()
            self._retire()
            self._population.end()
            return
        before, drives = [array.copy() for array in self._state()], self._population.meeting.drives
        driven = drives.told()
        self._substep(int(whole), self.time, look=False, share=rest)  # its contacts lie beyond the end
        self._part = part
        self._guard()
        for now, old in zip(self._state(), before, strict=True):
            now[...] = old + (now - old) * rest
        position, velocity, angle, spin = self._state()
        drives.seat(position, velocity, angle, spin)
        drives.end(driven, rest)
        self._retire()
        self._population.end()

    def apply(self, action: Action) -> None:
        """Do what an action says, now.

        Raises:
            ActionError: it cannot be done. Nothing has changed then.
        """
        with self._turn:
            self._check_running()
            self._still = None
            with booked(self._outside, Cause.ACTIONS, self):
                leaving = perform(action, NativeCast(self._population))
                self._population.changed()
                self._still = None
            self._population.meeting.extend_planes()
            self._population.capture()
            if self._notes is not None:
                self._notes.changed()
            if leaving is not None:
                self._take_out(np.asarray([leaving]))

    def frame(self) -> Frame:
        """Return the present state."""
        population = self._population
        position, velocity, angle, angular_velocity = self._state()
        position, velocity = position.copy(), velocity.copy()
        if self._settings.half_kick:
            velocity[population.moving] -= population.ahead
        if population.turns or population.felt is not None or self._still is None:
            self._still = angle.copy(), angular_velocity.copy()
        angle, angular_velocity = self._still
        roll = None if population.felt is None else population.roll.copy()
        scene, present = population.scene, population.present.copy()
        layer = population.layer.copy() if len(scene.layers) > 1 else None
        visits = population.visits.copy() if scene.zones else None
        drives = population.meeting.drives.told() if scene.drives else None
        passing = population.meeting.passing()
        return Frame(
            self.time, position, velocity, angle, angular_velocity, present, roll, layer, visits, drives, passing
        )

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording."""
        if self._notes is None:
            self._notes = Notes(self._population, self.time)
        return self._notes.take()

    def account(self) -> Mapping[Cause, float]:
        """Return the energy that each cause has brought since the first call, J; that call opens the account."""
        felt = self._population.felt
        if felt is not None:  # it books as it goes
            felt.account = felt.account or Account()
            return felt.account.entries()
        if self._books is None:
            self._books = Books(self._population)
        return self._books.account.entries()

    @property
    def _outside(self) -> Account | None:
        felt = self._population.felt
        if felt is not None:
            return felt.account
        return None if self._books is None else self._books.account

    def watch(self, observer: Observer) -> None:
        """Have an observer called after every substep; this records contacts too."""
        if self._notes is None:
            self.contacts()
        self._observer = observer

    def close(self) -> None:
        """End the simulation. What it holds goes with it."""
        self._population.end()
        super().close()

    def _check_running(self) -> None:
        if self._population.ended:
            raise RuntimeError("the simulation has ended; it can be read, but not go on")

    def _advance(self, substeps: int) -> None:
        """Advance by some substeps from the beginning of a step: both halves apart, as they never meet."""
        # An observer is told of all bodies after each substep, and the books are of all.
        together = self._observer is not None or self._books is not None
        if not together:
            self._population.free.step(substeps)
        if together or self._notes is not None or len(self._population.meeting):
            time = self.time
            for k in range(substeps):
                self._substep(k, time, fly=together)

    def _substep(self, k: int, time: float, look: bool = True, fly: bool = True, share: float = 1.0) -> None:
        """Advance by h, the k-th time in the step that began at a time, s; those in flight may have done so already.

        A share of it is booked: what lies beyond is cut off afterwards.
        """
        population, h = self._population, self._h
        start = time + k * h
        before = self._seen() if self._observer is not None else None
        opening = self._books.opening() if self._books is not None else None
        if fly:
            population.free.step()
        if population.felt is None:
            population.meeting.step(start)
        else:
            if self._notes is None:
                population.felt.told()  # who fell before contacts were asked for is nobody's concern
            population.felt.step(population.meeting, start, share)
            population.capture()
        if population.meeting.tethers.count:
            self._joint_iterations += population.meeting.joined * self._settings.iterations
        population.changed()
        if self._books is not None:
            self._books.substep(opening, share)
        if population.meeting.tethers.breakable and look:
            self._come_apart(population.torn(), self._after(k + 1))
        if population.stirred and look:
            self._settle()
        if self._notes is not None and look:
            self._notes.record(start + h * share)
            if self._observer is not None and before is not None:
                self._observer(start, before, self._seen(), self._notes.pairs())

    def _settle(self) -> None:
        """Let zones note who came in, and do what they do."""
        with booked(self._outside, Cause.DRIVES, self):
            self._population.settle()
        visiting = self._population.visiting
        if self._notes is None and visiting is not None:
            visiting.told()  # who came in before contacts were asked for is nobody's concern

    def _seen(self) -> FloatArray:
        """Return the centres, (N, 2) m, as an observer is told; of balls that lie in pockets nan."""
        position, felt = self._state()[0].copy(), self._population.felt
        if felt is not None:
            position[felt.pocket >= 0] = np.nan
        return position

    def _come_apart(self, numbers: IntArray, time: float) -> None:
        """Note that joints, by their numbers, have come apart."""
        self._broken |= dict.fromkeys(numbers.tolist(), time)
        if self._books is not None and len(numbers):
            self._books.parted(numbers)

    def _state(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the present arrays in scene order; they belong to the population."""
        population = self._population
        population.refresh()
        return population.position, population.velocity, population.angle, population.angular_velocity

    def _guard(self) -> None:
        """Stop what is no longer finite and bounded, or farther out than half-planes can reach."""
        population = self._population
        for half in (population.free, population.meeting, *(() if population.felt is None else (population.felt,))):
            beyond = half.beyond()
            if beyond is not None:
                self._population.end()
                number, what = beyond
                raise Divergence(self.time, self.bodies.names[number], what)

    def _retire(self) -> None:
        """Take out whose life is over, and who has left world.bounds."""
        population, bounds = self._population, self._population.scene.world.bounds
        if bounds is not None:
            population.refresh()
        going = self._expiry.going(self.time, population.position, population.present, population.bodies.fixed, bounds)
        if len(going):
            self._take_out(going)

    def _take_out(self, numbers: IntArray) -> None:
        with booked(self._outside, Cause.RETIRED, self):
            self._still = None
            self._population.take_out(numbers)
        self._still = None
        self._retired |= dict.fromkeys(numbers.tolist(), self.time)
