"""Hands: what pointing, dragging and keys do to the bodies of a session. Places are in the world, m."""

import math

from sandbox.action import Impulse, Move, Pull, Remove, Spawn
from sandbox.play.picking import picked
from sandbox.play.running.live import Live
from sandbox.play.running.stored import Stored
from sandbox.scene.model import Ball

Place = tuple[float, float]

NUDGE = 1.0
"""m/s that a nudge adds, or in a small scene, a few radii a second"""


class Hands:
    """What is held, and what was picked last."""

    def __init__(self) -> None:
        self.picked: int | None = None
        """number of the body whose figures are shown"""
        self._held: str | None = None
        self._grip: Place = (0.0, 0.0)
        self._moving = False
        self._hand: Place = (0.0, 0.0)

    @property
    def holding(self) -> bool:
        """Whether a body is held."""
        return self._held is not None

    def picked_of(self, live: Live) -> int | None:
        """Return the picked body's number, unless that body has not come yet: the session may have gone back."""
        return self.picked if self.picked is not None and self.picked < len(live.bodies) else None

    def look(self, show: Stored, place: Place, reach: float) -> bool:
        """Pick the body at a place of a stored run; return whether there is one."""
        self.picked = picked(show.bodies, show.frame, place, reach)
        return self.picked is not None

    def grasp(self, live: Live, place: Place, reach: float, paused: bool) -> bool:
        """Pick the body at a place, and take hold of it; return whether there is one.

        While paused a held body is moved, else it is pulled by a spring.

        Raises:
            ActionError: it cannot be held; it is picked all the same.
        """
        self.picked = number = picked(live.bodies, live.frame, place, reach)
        if number is None:
            return False
        frame, name = live.frame, live.bodies.names[number]
        x, y = frame.position[number].tolist()
        offset = place[0] - x, place[1] - y
        self._moving, self._hand = paused, place
        if paused:
            self._held, self._grip = name, offset
            return True
        if live.bodies.fixed[number]:
            return True
        cos, sin = math.cos(float(frame.angle[number])), math.sin(float(frame.angle[number]))
        self._grip = cos * offset[0] + sin * offset[1], cos * offset[1] - sin * offset[0]
        live.act(Pull(time=0.0, body=name, grip=self._grip, target=place))
        self._held = name
        return True

    def drag(self, live: Live, place: Place) -> None:
        """Move the hand.

        Raises:
            ActionError: what is held cannot go there.
        """
        self._hand = place
        if self._held is None:
            return
        if self._moving:
            there = place[0] - self._grip[0], place[1] - self._grip[1]
            live.act(Move(time=0.0, body=self._held, position=there))
        else:
            live.act(Pull(time=0.0, body=self._held, grip=self._grip, target=place))

    def let_go(self, live: Live) -> None:
        """Open the hand.

        Raises:
            ActionError: the session has ended.
        """
        held, self._held = self._held, None
        if held is not None and not self._moving:
            live.act(Pull(time=0.0, body=held))

    def drop(self) -> None:
        """Let go without telling the session, which cannot be told; what was picked stays so."""
        self._held = None

    def forget(self) -> None:
        """Let go without telling a session, which has gone or will be told by another way; nothing is picked."""
        self._held = self.picked = None

    def line(self, live: Live) -> tuple[Place, Place] | None:
        """Return from where a body is held to the hand, while one is pulled."""
        if self._held is None or self._moving or self._held not in live.bodies.names:
            return None
        number = live.bodies.names.index(self._held)
        frame = live.frame
        if number >= len(frame.position) or not frame.present[number]:
            return None
        cos, sin = math.cos(float(frame.angle[number])), math.sin(float(frame.angle[number]))
        x, y = frame.position[number].tolist()
        held = x + cos * self._grip[0] - sin * self._grip[1], y + sin * self._grip[0] + cos * self._grip[1]
        return held, self._hand

    def remove(self, live: Live) -> None:
        """Take the picked body out.

        Raises:
            ActionError: it cannot be.
        """
        number = self.picked_of(live)
        if number is not None:
            live.act(Remove(time=0.0, body=live.bodies.names[number]))
            self.forget()

    def nudge(self, live: Live) -> None:
        """Kick the picked body upwards and to the right.

        Raises:
            ActionError: it cannot be.
        """
        number = self.picked_of(live)
        if number is None:
            return
        mass, radius = float(live.bodies.mass[number]), float(live.bodies.radius[number])
        kick = mass * min(NUDGE, 10.0 * radius)
        live.act(Impulse(time=0.0, body=live.bodies.names[number], impulse=(0.6 * kick, 0.8 * kick)))

    def add(self, live: Live, place: Place, size: float) -> None:
        """Put a new ball at a place: like the picked one, or like the first, else of a size that suits the view.

        Args:
            live: where.
            place: m.
            size: of what is in sight, m.

        Raises:
            ActionError: there is no room, or the engine cannot.
        """
        bodies = live.bodies
        picked = self.picked_of(live)
        like = picked if picked is not None else (0 if len(bodies) else None)
        if like is None:
            ball = Ball(position=place, radius=min(max(size / 40.0, 1e-9), 1e9), restitution=0.5, friction=0.5)
        else:
            element = bodies.elements[int(bodies.element[like])]
            ball = Ball(
                position=place,
                radius=element.radius,
                mass=element.mass,
                density=element.density,
                material=element.material,
                restitution=element.restitution,
                friction=element.friction,
                collides=element.collides,
            )
        live.act(Spawn(time=0.0, ball=ball))

    def shift(self, live: Live, body: str, by: Place) -> None:
        """Put a body a little elsewhere, at rest, as the arrow keys do.

        Raises:
            ActionError: there is none, or no room.
        """
        if body in live.bodies.names:
            x, y = live.frame.position[live.bodies.names.index(body)].tolist()
            live.act(Move(time=0.0, body=body, position=(x + by[0], y + by[1]), velocity=(0.0, 0.0)))
