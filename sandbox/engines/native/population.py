"""Population: who is in a running scene, and which half computes whom.

What can meet something lives in the pymunk space (`MeetingBodies`), what can meet nothing in arrays (`FreeFlight`);
both obey the same rule. A body joins the space when something that it can meet appears, and stays there.
"""

import math
from dataclasses import replace

import numpy as np

from sandbox.action import ActionError
from sandbox.engines.native.free import FreeFlight
from sandbox.engines.native.meeting import MeetingBodies
from sandbox.scene.bodies import Bodies
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Ball, Scene, default_name
from sandbox.scene.part import BACKING, MAX_BODIES
from sandbox.scene.settings import Settings
from sandbox.trajectory import BoolArray, FloatArray, IntArray

CROWD = 100
"""Balls that may be put on one spot: pymunk takes minutes to part a thousand."""


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
        self._half_kick = 0.5 * settings.h if settings.half_kick else 0.0
        self.velocity[~self.bodies.fixed] += self.ahead
        self.free = FreeFlight(scene.world, settings.h)
        self.meeting = MeetingBodies(scene, settings)
        self._meet = meetings(scene, self.bodies)
        self.meeting.renew(scene, self._meet)
        self._place(np.arange(len(self.bodies)))

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

    def number(self, name: str) -> int:
        """Return the number of a body that is there.

        Raises:
            ActionError: there is none of that name.
        """
        try:
            number = self.bodies.names.index(name)
        except ValueError:
            raise ActionError(f"no body is named {name!r}") from None
        if not self.present[number]:
            raise ActionError(f"{name!r} is no longer there")
        return number

    def mover(self, name: str) -> tuple[int, FreeFlight | MeetingBodies]:
        """Return a body that can move, and the half that moves it.

        Raises:
            ActionError: there is none of that name, or it is fixed.
        """
        number = self.number(name)
        if self.bodies.fixed[number]:
            raise ActionError(f"{name!r} is fixed; nothing can move it")
        return number, self.free if number in self.free.numbers else self.meeting

    def changed(self) -> None:
        """Note that the halves have moved on from the arrays."""
        self._fresh = self.ended

    def end(self) -> None:
        """Let the arrays stand as they are, for good."""
        self.ended = self._fresh = True

    def refresh(self) -> None:
        """Bring the arrays in scene order up to date."""
        if self._fresh:
            return
        self._fresh = True
        for half in (self.free, self.meeting):
            half.write(self.position, self.velocity, self.angle, self.angular_velocity)

    def _place(self, numbers: IntArray) -> None:
        """Give each body to the half that it belongs to, and its surface, as things now stand."""
        meet, bodies = self._meet, self.bodies
        flying = meet.free[numbers]
        # What contacts cannot turn gets no moment in the space; in flight it keeps it, for the torques of actions.
        turned = np.where(meet.turnable, bodies.moment, math.inf)
        state = self.position, self.velocity, self.angle, self.angular_velocity
        for half, chosen, moment in (
            (self.free, numbers[flying & ~bodies.fixed[numbers]], bodies.moment),
            (self.meeting, numbers[~flying], turned),
        ):
            position, velocity, angle, spin = (array[chosen] for array in state)
            half.join(chosen, bodies, position, velocity, angle, spin, moment[chosen])
        self.free.live_in(*state)

    def change(self, scene: Scene) -> None:
        """Go on with a scene that differs in air, gravity or coefficients alone."""
        self.refresh()
        self.velocity[self.moving] -= self.ahead
        spawned = self.bodies.elements[len(self.scene.bodies.elements) :]
        self.scene = scene
        self.bodies = replace(self.bodies, elements=(*scene.bodies.elements, *spawned))
        self.velocity[self.moving] += self.ahead
        if self._half_kick:
            for number in np.flatnonzero(self.moving).tolist():
                self.mover(self.bodies.names[number])[1].set_velocity(number, self.velocity[number])
        self.free.world = scene.world
        self.free.forces_changed()
        self._meet = meetings(scene, self.bodies)
        self.meeting.renew(scene, self._meet)

    def add(self, ball: Ball) -> int:
        """Add a ball and return its number.

        Raises:
            ActionError: its name is taken, its material unknown, or its place is no place.
        """
        name = ball.name or default_name("spawned", len(self.bodies))
        if name in self.bodies.names or name in self.scene.fixed_names:
            raise ActionError(f"a body or fixed thing is called {name!r} already")
        if ball.material is not None and ball.material not in {m.name for m in self.scene.materials}:
            raise ActionError(f"no material is named {ball.material!r}")
        if len(self.bodies) >= MAX_BODIES:
            raise ActionError(f"the scene holds {MAX_BODIES:,} bodies already")
        self.check_place(ball.position, ball.radius, ball.collides != "none")
        self.refresh()
        number = len(self.bodies)
        self.bodies = self.bodies.joined_by(ball, name)
        ahead = np.zeros(2) if ball.fixed else self.ahead
        self.position = np.vstack((self.position, self.bodies.position[-1:]))
        self.velocity = np.vstack((self.velocity, self.bodies.velocity[-1:] + ahead))
        self.angle = np.append(self.angle, self.bodies.angle[-1])
        self.angular_velocity = np.append(self.angular_velocity, self.bodies.angular_velocity[-1])
        self.present = np.append(self.present, True)

        self._meet = meetings(self.scene, self.bodies)
        self.meeting.renew(self.scene, self._meet)
        awoken = self.free.numbers[~self._meet.free[self.free.numbers]]
        self._promote(awoken)
        self._place(np.asarray([number]))
        return number

    def _promote(self, numbers: IntArray) -> None:
        steady = {n: self.free.steady(n) for n in numbers.tolist()}
        self.free.leave(numbers)
        self._place(numbers)
        for number, (force, torque) in steady.items():
            if force.any() or torque:
                self.meeting.push(number, force, torque)

    def take_out(self, number: int) -> None:
        """Remove a body. It stays where it is in the arrays, with no velocity."""
        self.refresh()
        half = self.free if number in self.free.numbers else self.meeting
        half.leave(np.asarray([number]))
        self.present[number] = False
        self.velocity[number], self.angular_velocity[number] = 0.0, 0.0

    def check_place(self, position: tuple[float, float], radius: float, touches: bool) -> None:
        """Refuse a place that an engine cannot start from.

        Raises:
            ActionError: it lies too deep behind a plane, or on a spot that is crowded already.
        """
        if not touches:
            return
        place = np.asarray(position)
        for plane, name in zip(self.scene.planes, self.scene.fixed_names, strict=False):
            normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
            depth = float((np.asarray(plane.point) - place) @ normal)
            if depth > BACKING:
                raise ActionError(f"{depth:g} m behind the plane {name!r}; at most {BACKING:g}")
        self.refresh()
        near = np.abs(self.position - place).max(axis=1, initial=0.0) < 0.01 * radius
        if int((near & self.present).sum()) >= CROWD:
            raise ActionError(f"{CROWD} bodies are on that spot already")
