"""Hands: what pointing, dragging and keys do to the bodies of a session. Places are in the world, m."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from sandbox.action import Action, ActionError, Impulse, Move, Pull, Remove, SetParameter, Spawn
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball, Disc
from sandbox.scene.geometry.shapes import form_of
from sandbox.window.hit_test import Hull, hull_area, is_free, pick_body
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedView

Place = tuple[float, float]

NUDGE = 1.0
"""m/s that a nudge adds, or in a small scene, a few radii a second"""


class BodyTools:
    """What is held, and what was picked last."""

    def __init__(self) -> None:
        self.picked: int | None = None
        """number of the body whose figures are shown"""
        self._held: str | None = None
        self._spot: Place = (0.0, 0.0)
        self._offset: Place = (0.0, 0.0)
        self._angle = 0.0
        self._grip: Place = (0.0, 0.0)
        self._moving = False
        self._hand: Place = (0.0, 0.0)

    @property
    def holding(self) -> bool:
        """Whether a body is held."""
        return self._held is not None

    def picked_of(self, live: LiveView) -> int | None:
        """Return the picked body's number, unless that body has not come yet: the session may have gone back."""
        return self.picked if self.picked is not None and self.picked < len(live.bodies) else None

    def look(self, show: LiveView | RecordedView, place: Place, reach: float) -> bool:
        """Pick the body at a place, and do nothing to it; return whether there is one."""
        frame = show.frame
        self.picked = number = pick_body(show.bodies, frame, place, reach)
        if number is None:
            return False
        x, y = frame.position[number].tolist()
        self._spot, self._offset, self._angle = place, (place[0] - x, place[1] - y), float(frame.angle[number])
        return True

    def hold(self, live: LiveView, paused: bool) -> None:
        """Take hold of the picked body, at the point of it that was looked at, however far it has gone since.

        While paused a held body is moved, else it is pulled by a spring; a fixed one cannot be pulled, and stays.

        Raises:
            ActionError: it cannot be held.
        """
        number = self.picked_of(live)
        if number is None:
            return
        name = live.bodies.names[number]
        if any(drive.body == name for drive in live.scene.drives):
            raise ActionError(f"{name} cannot be dragged; its key moves it (H: help)")
        self._moving, self._hand = paused, self._spot
        if paused:
            self._grip = _turned(self._offset, float(live.frame.angle[number]) - self._angle)
        elif live.bodies.fixed[number]:
            return
        else:
            self._grip = _turned(self._offset, -self._angle)
            live.act(Pull(time=0.0, body=name, grip=self._grip, target=self._spot))
        self._held = name

    def drag(self, live: LiveView, place: Place) -> None:
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

    def let_go(self, live: LiveView) -> None:
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

    def line(self, live: LiveView) -> tuple[Place, Place] | None:
        """Return from where a body is held to the hand, while one is pulled."""
        if self._held is None or self._moving or self._held not in live.bodies.names:
            return None
        number = live.bodies.names.index(self._held)
        frame = live.frame
        if number >= len(frame.position) or not frame.present[number]:
            return None
        right, up = _turned(self._grip, float(frame.angle[number]))
        x, y = frame.position[number].tolist()
        return (x + right, y + up), self._hand

    def remove(self, live: LiveView) -> None:
        """Take the picked body out.

        Raises:
            ActionError: it cannot be, or none is picked.
        """
        live.act(Remove(time=0.0, body=live.bodies.names[self._chosen(live)]))
        self.forget()

    def _chosen(self, live: LiveView) -> int:
        number = self.picked_of(live)
        if number is None:
            raise ActionError("select a body first: click it")
        return number

    def nudge(self, live: LiveView) -> None:
        """Kick the picked body upwards and to the right.

        Raises:
            ActionError: it cannot be, or none is picked.
        """
        number = self._chosen(live)
        mass, radius = float(live.bodies.mass[number]), float(live.bodies.radius[number])
        kick = mass * min(NUDGE, 10.0 * radius)
        live.act(Impulse(time=0.0, body=live.bodies.names[number], impulse=(0.6 * kick, 0.8 * kick)))

    def add(self, live: LiveView, place: Place, size: float, *, box: bool = False) -> None:
        """Put a new ball or box at a place: like the picked body, or like the first, else as suits the view.

        What is like a body of another shape is about as large as it, and of its density.

        Args:
            live: where.
            place: m.
            size: of what is in sight, m.
            box: instead of a ball.

        Raises:
            ActionError: there is no room, or the engine cannot.
        """
        bodies = live.bodies
        picked = self.picked_of(live)
        like = picked if picked is not None else (0 if len(bodies) else None)
        if like is None:
            made = _made(place, min(max(size / 40.0, 1e-9), 1e9), box, restitution=0.5, friction=0.5)
        else:
            made = _like(bodies, like, place, box)
        made = _beside_others(live, made)
        live.act(Spawn(time=0.0, box=made) if isinstance(made, Box) else Spawn(time=0.0, ball=made))

    def shift(self, live: LiveView, body: str, by: Place) -> None:
        """Put a body a little elsewhere, at rest, as the arrow keys do.

        Raises:
            ActionError: there is none, or no room.
        """
        if body in live.bodies.names:
            x, y = live.frame.position[live.bodies.names.index(body)].tolist()
            live.act(Move(time=0.0, body=body, position=(x + by[0], y + by[1]), velocity=(0.0, 0.0)))


RINGS, DIRECTIONS = 24, 16
"""Places around the one that is pointed at that are tried, half a radius from ring to ring."""


def _beside_others(live: LiveView, made: Ball | Box) -> Ball | Box:
    """Return a new body at the nearest place where it overlaps nothing.

    Raises:
        ActionError: there is none nearby.
    """
    if made.collides == "none":
        return made
    form = form_of(made)
    hulls = [Hull(np.asarray(piece.corners), piece.radius) for piece in form.pieces]
    step = 0.5 * max(float(np.hypot(*hull.corners.T).max()) + hull.radius for hull in hulls)
    x, y = made.position
    for ring in range(RINGS):
        for k in range(DIRECTIONS if ring else 1):
            turn = math.tau * k / DIRECTIONS
            place = x - ring * step * math.sin(turn), y + ring * step * math.cos(turn)
            there = [Hull(hull.corners + np.asarray(place), hull.radius) for hull in hulls]
            if is_free(live.scene, live.bodies, live.frame, there, made.layer):
                return made.model_copy(update={"position": place})
    raise ActionError("no room here; point at an empty spot")


def count_changes(actions: Iterable[Action], moved_by_keys: str | None = None) -> int:
    """Count what hands have changed of a scene: bodies added, removed and moved, values set.

    Args:
        actions: of a session.
        moved_by_keys: a body whose moves are part of the scene, which gives it the arrow keys.
    """
    count, last = 0, ""
    for action in actions:
        match action:
            case Spawn() | Remove():
                now = ""
            case Move():
                now = "" if action.body == moved_by_keys else f"move {action.body}"
            case SetParameter():
                now = f"set {action.path}"
            case _:
                last = ""
                continue
        moved_so = isinstance(action, Move) and not now
        count += not moved_so and (not now or now != last)  # a drag is many moves
        last = now
    return count


def describe_loss(count: int, how: str) -> str:
    """Return the question before so many hand-made changes are lost."""
    changes = "1 hand-made change" if count == 1 else f"{count:,} hand-made changes"
    return f"{changes} will be lost: {how}, Ctrl+S saves the session"


def _like(bodies: Bodies, number: int, place: Place, box: bool) -> Ball | Box:
    """Return a ball or box at a place that is like a body."""
    element = bodies.elements[int(bodies.element[number])]
    surface = {
        key: getattr(element, key) for key in ("material", "restitution", "restitution_falloff", "friction", "collides")
    }
    if not box and isinstance(element, Disc):
        return Ball(position=place, radius=element.radius, mass=element.mass, density=element.density, **surface)
    if box and isinstance(element, Box):
        return Box(position=place, size=element.size, mass=element.mass, density=element.density, **surface)
    area = sum(hull_area(Hull(np.asarray(piece.corners), piece.radius)) for piece in form_of(element).pieces)
    radius = math.sqrt(area / math.pi)
    density = float(bodies.mass[number]) / area
    return _made(place, radius, box, density=density, **surface)


def _made(place: Place, radius: float, box: bool, **more: Any) -> Ball | Box:
    """Return a ball, or a square box of about its area."""
    if not box:
        return Ball(position=place, radius=radius, **more)
    side = math.sqrt(math.pi) * radius
    return Box(position=place, size=(side, side), **more)


def _turned(way: Place, angle: float) -> Place:
    """Return a vector turned by an angle, rad."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * way[0] - sin * way[1], sin * way[0] + cos * way[1]
