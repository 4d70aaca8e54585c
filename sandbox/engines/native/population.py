"""Population: who is in a running scene, and which half computes whom.

What can meet something lives in the pymunk space (`MeetingBodies`), what can meet nothing in arrays (`FreeFlight`);
both obey the same rule. A body joins the space when something that it can meet appears, and stays there.
"""

import math
from dataclasses import replace

import numpy as np

from sandbox.action import ActionError
from sandbox.engines.acting import derived, is_matter_same
from sandbox.engines.native.felt import Felt, State
from sandbox.engines.native.floors import of_floors, on_floor
from sandbox.engines.native.free import FreeFlight
from sandbox.engines.native.meeting import MeetingBodies
from sandbox.engines.native.overlaps import SKIN
from sandbox.engines.native.premises import NativePremises
from sandbox.engines.visiting import Visiting
from sandbox.scene.bodies import Bodies
from sandbox.scene.meetings import Meetings, meetings
from sandbox.scene.model import Scene, Single
from sandbox.scene.settings import Settings
from sandbox.scene.surfaced import Mover
from sandbox.trajectory import BoolArray, FloatArray, IntArray

UNCORRECTED = 1e9
"""m of overlap that pymunk leaves alone: on a floor that is the felt's."""

NOBODY: IntArray = np.empty(0, np.int64)


class Population:
    """The bodies of a running scene: their state as arrays in scene order, and the two halves that move them."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        self.scene = scene
        self.bodies: Bodies = scene.bodies
        self.position, self.velocity = self.bodies.position.copy(), self.bodies.velocity.copy()
        self.angle, self.angular_velocity = self.bodies.angle.copy(), self.bodies.angular_velocity.copy()
        self.present: BoolArray = np.ones(len(self.bodies), dtype=np.bool_)
        self.ended = False
        self._fresh = True
        self.h = settings.h
        self._half_kick = 0.5 * settings.h if settings.half_kick else 0.0
        self.velocity[~self.bodies.fixed] += self.ahead
        self.roll = self.bodies.roll.copy()
        self.layer, self.visits = self.bodies.layer.copy(), self.bodies.visits.copy()
        self.felt = Felt(scene, settings) if on_floor(scene) else None
        """what moves balls where there is a floor"""
        floored = settings.replace(slop=UNCORRECTED), SKIN
        self.meeting = MeetingBodies(scene, *(floored if self.felt is not None else (settings,)))
        self.free = FreeFlight(scene.world, settings.h, self.meeting.field)
        self._premises = NativePremises(self.meeting)
        self.visiting = Visiting(scene, self._premises) if scene.zones else None
        """what zones do, where there are some"""
        self._renew(scene, meetings(scene, self.bodies))
        self._live()
        self.place(np.arange(len(self.bodies)))
        self.capture()
        if self.visiting is not None:
            self.visiting.begin(np.flatnonzero(self._meet.noted), anew=scene.began == 0.0)

    def _renew(self, scene: Scene, meet: Meetings, same: bool = False) -> None:
        """Go on with a scene, and with what can meet what in it, which may be the same as before."""
        self._meet = meet
        if self.felt is not None:  # hits are the felt's, not pymunk's
            self.felt.renew(scene, meet)
            nothing = np.zeros_like(meet.surfaces.restitution)
            meet = replace(meet, surfaces=replace(meet.surfaces, restitution=nothing, friction=nothing))
        if same:
            self.meeting.renew_air(scene)
        else:
            self.meeting.renew(scene, meet)
        if self.visiting is not None:
            self._premises.renew(scene, self.bodies)
            self.visiting.renew(meet)

    def _live(self) -> None:
        """Let the felt and zones, if there are some, go on with the present arrays."""
        self.meeting.layer = self.layer
        if self.visiting is not None:
            self.visiting.live_in(self.position, self.velocity, self.angular_velocity, self.layer, self.visits)
        if self.felt is not None:
            state = State(self.position, self.velocity, self.roll, self.angular_velocity, self.angle)
            self.felt.live_in(state, self.bodies, self.present)

    def capture(self) -> bool:
        """Let balls fall into pockets; tell whether some did."""
        fell = self.felt.capture() if self.felt is not None else NOBODY
        if len(fell):
            self.meeting.leave(fell)
        return len(fell) > 0

    @property
    def stirred(self) -> bool:
        """Whether somebody has come into a zone, or left one."""
        return self.visiting is not None and bool(self.meeting.probes.stirred)

    def settle(self) -> None:
        """Let zones do what they do."""
        if self.visiting is not None:
            self.refresh()
            self.visiting.settle(self.ahead)

    @property
    def yielding(self) -> BoolArray:
        """(N,) which bodies are there, not fixed, and held by no zone."""
        return self.moving if self.visiting is None else self.moving & ~self.visiting.held

    @property
    def ahead(self) -> FloatArray:
        """How far velocities run ahead of time, (2,) m/s: half a kick, or nothing."""
        return np.asarray(self.scene.world.gravity) * self._half_kick

    @property
    def moving(self) -> BoolArray:
        """(N,) which bodies are there and not fixed."""
        return self.present & ~self.bodies.fixed

    @property
    def turns(self) -> bool:
        """Whether some angle may change."""
        return self.free.turns or len(self.meeting) > 0

    def half_of(self, number: int) -> FreeFlight | MeetingBodies | None:
        """Return the half that holds a body; none holds a fixed one that nothing can meet."""
        if self.free.holds(number):
            return self.free
        return self.meeting if self.meeting.holds(number) else None

    def changed(self) -> None:
        """Note that the halves have moved on from the arrays."""
        self._fresh = self.ended or self.felt is not None

    def end(self) -> None:
        """Let the arrays stand as they now are, for good."""
        self.refresh()
        self.ended = True

    def refresh(self) -> None:
        """Bring the arrays in scene order up to date."""
        if self._fresh:
            return
        self._fresh = True
        self.meeting.write(self.position, self.velocity, self.angle, self.angular_velocity)

    def torn(self) -> IntArray:
        """Let go of joints that gave more than their strength in the last substep; return their numbers."""
        self.refresh()
        return self.meeting.tethers.torn(self.position, self.velocity, self.angle, self.angular_velocity, self.h)

    def place(self, numbers: IntArray) -> None:
        """Give each body to the half that it belongs to, and its surface, as things now stand."""
        meet, bodies = self._meet, self.bodies
        flying = meet.free[numbers] & ~self._driven[numbers]
        state = self.position, self.velocity, self.angle, self.angular_velocity
        self.free.live_in(*state, bodies)
        self.free.join(numbers[flying & ~bodies.fixed[numbers]])
        # What nothing can turn gets no moment in the space; in flight it keeps it, for the torques of actions.
        turned = np.where(meet.turnable, bodies.moment, math.inf)
        chosen = numbers[~flying]
        position, velocity, angle, spin = (array[chosen] for array in state)
        self.meeting.join(chosen, bodies, position, velocity, angle, spin, turned[chosen])
        self.meeting.link(self.scene.links)

    @property
    def _driven(self) -> BoolArray:
        """(N,) which only the space can move: with thrusts or drives; all where bodies attract, or on a floor."""
        field, drives = self.meeting.field, self.scene.drives
        if field.between_bodies or self.felt is not None:
            return np.ones(len(self.bodies), dtype=np.bool_)
        if not (field.level or drives):
            return np.zeros(len(self.bodies), dtype=np.bool_)
        driven = self.meeting.drives.holds
        return np.asarray([field.thrusted(name) or driven(name) for name in self.bodies.names], dtype=np.bool_)

    def change(self, scene: Scene, spawned: tuple[Mover, ...] | None = None) -> None:
        """Go on with a scene that differs alone in air, gravity, coefficients, courses of walls, or in what is solid.

        Raises:
            ActionError: it asks for what the settings or the engine cannot go on with.
        """
        if self._half_kick and (scene.world.linear_drag or scene.world.quadratic_drag):
            raise ActionError("drag cannot come up in a run that was started with half_kick, which knows none")
        bodies, meet = self.bodies, self._meet
        same = spawned is None and is_matter_same(scene, self.scene)
        checked = same and scene.world is self.scene.world
        if self.felt is not None and not checked and (lacks := next(of_floors(scene), None)):
            raise ActionError(lacks)
        if not same:
            spawned = bodies.elements[len(self.scene.elements) :] if spawned is None else spawned
            bodies = replace(bodies, elements=(*scene.elements, *spawned))
            meet = derived(scene, bodies)
        self.refresh()
        self.velocity[self.moving] -= self.ahead
        self.scene, self.bodies = scene, bodies
        self.velocity[self.moving] += self.ahead
        if self._half_kick:
            for number in self.meeting.movers():
                self.meeting.set_velocity(number, self.velocity[number])
        self.free.world = scene.world
        self.free.forces_changed()
        self._renew(scene, meet, same)
        self._live()

    def pocketed(self, number: int) -> bool:
        """Tell whether a body lies in a pocket."""
        return self.felt is not None and bool(self.felt.pocket[number] >= 0)

    def add(self, single: Single, name: str) -> int:
        """Add a body and return its number.

        Raises:
            ActionError: it makes more surfaces than a scene may have, or is nothing for this floor.
        """
        scene = self.scene
        bodies = self.bodies.joined_by(single, name)
        if self.felt is not None and (lacks := next(of_floors(scene, bodies), None)):
            raise ActionError(lacks)
        meet = derived(scene, bodies)
        self.refresh()
        number = len(self.bodies)
        self.bodies = bodies
        ahead = np.zeros(2) if single.fixed else self.ahead
        self.position = np.vstack((self.position, self.bodies.position[-1:]))
        self.velocity = np.vstack((self.velocity, self.bodies.velocity[-1:] + ahead))
        self.angle = np.append(self.angle, self.bodies.angle[-1])
        self.angular_velocity = np.append(self.angular_velocity, self.bodies.angular_velocity[-1])
        self.roll = np.vstack((self.roll, self.bodies.roll[-1:]))
        self.present = np.append(self.present, True)
        self.layer = np.append(self.layer, self.bodies.layer[-1])
        self.visits = np.vstack((self.visits, self.bodies.visits[-1:]))

        self._renew(scene, meet)
        self._live()
        self.meeting.touched(bodies)
        out = [n for n in np.flatnonzero(self.present & ~meet.free).tolist() if not self.meeting.holds(n)]
        self._promote(np.asarray([n for n in out if n != number and not self.pocketed(n)], np.int64))
        self.place(np.asarray([number]))
        if self.visiting is not None:
            self.visiting.put(number)
        return number

    def _promote(self, numbers: IntArray) -> None:
        """Let bodies that so far met nothing join the space."""
        if not len(numbers):
            return
        flying = numbers[np.isin(numbers, self.free.numbers)]
        steady = {n: self.free.steady(n) for n in flying.tolist()}
        self.free.leave(numbers)
        self.place(numbers)
        for number, (force, torque) in steady.items():
            if torque:
                self.meeting.give_moment(number, float(self.bodies.moment[number]))
            if force.any() or torque:
                self.meeting.push(number, force, torque)

    def take_out(self, numbers: IntArray) -> None:
        """Remove bodies. They stay where they are in the arrays, with no velocity."""
        self.refresh()
        self.free.leave(numbers)
        self.meeting.leave(np.asarray([n for n in numbers.tolist() if self.meeting.holds(n)], np.int64))
        self.present[numbers] = False
        self.velocity[numbers], self.angular_velocity[numbers], self.roll[numbers] = 0.0, 0.0, 0.0
        if self.felt is not None:
            self.felt.leave(numbers)
        if self.visiting is not None:
            self.visiting.gone(numbers)
