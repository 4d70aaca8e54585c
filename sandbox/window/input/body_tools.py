"""Mouse tools on the bodies of a session: select, drag, nudge, add, remove. Positions are in world coordinates, m."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from sandbox.action import Action, ActionError, Impulse, Move, Pull, Remove, SetParameter, Spawn
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball, Disc
from sandbox.scene.geometry.shapes import geometry_of
from sandbox.window.hit_test import Hull, hull_area, is_free, pick_body
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedView

Position = tuple[float, float]

NUDGE_SPEED = 1.0
"""m/s that a nudge adds to a body; in small scenes 10 radii/s"""


class BodyTools:
    """Selection and dragging of a body."""

    def __init__(self) -> None:
        self.picked: int | None = None
        """index of the selected body"""
        self.held: str | None = None
        """name of the dragged body"""
        self._pick_position: Position = (0.0, 0.0)
        self._offset: Position = (0.0, 0.0)  # from the body's centre to the picked point, at the time of picking
        self._angle = 0.0  # rad, angle of the body at the time of picking
        self._grip: Position = (0.0, 0.0)  # picked point: in the body frame; while paused, relative to the centre
        self._moving = False  # dragged while paused: moved directly, not pulled by a spring
        self._target: Position = (0.0, 0.0)

    @property
    def is_holding(self) -> bool:
        """Whether a body is being dragged."""
        return self.held is not None

    def picked_index(self, live: LiveView) -> int | None:
        """Return the index of the selected body; None if it does not exist at the present time."""
        return self.picked if self.picked is not None and self.picked < len(live.bodies) else None

    def pick(self, view: LiveView | RecordedView, position: Position, tolerance: float) -> bool:
        """Select the body at a position, within a tolerance in m; return whether there is one."""
        frame = view.frame
        self.picked = index = pick_body(view.bodies, frame, position, tolerance)
        if index is None:
            return False
        x, y = frame.position[index].tolist()
        self._pick_position, self._offset = position, (position[0] - x, position[1] - y)
        self._angle = float(frame.angle[index])
        return True

    def grab(self, live: LiveView, paused: bool) -> None:
        """Start to drag the selected body at its picked point, which may have moved since.

        While paused, dragging moves the body; otherwise a spring pulls it. Fixed and kinematic bodies cannot be pulled.

        Raises:
            ActionError: the body cannot be dragged.
        """
        index = self.picked_index(live)
        if index is None:
            return
        name = live.bodies.names[index]
        if any(drive.body == name for drive in live.scene.drives):
            raise ActionError(f"{name} cannot be dragged; its key moves it (H: help)")
        self._moving, self._target = paused, self._pick_position
        if paused:
            self._grip = _rotated(self._offset, float(live.frame.angle[index]) - self._angle)
        elif live.bodies.immovable[index]:
            return
        else:
            self._grip = _rotated(self._offset, -self._angle)
            live.apply(Pull(time=0.0, body=name, grip=self._grip, target=self._pick_position))
        self.held = name

    def drag(self, live: LiveView, position: Position) -> None:
        """Drag the held body to a position.

        Raises:
            ActionError: the body cannot be moved there.
        """
        self._target = position
        if self.held is None:
            return
        if self._moving:
            centre = position[0] - self._grip[0], position[1] - self._grip[1]
            live.apply(Move(time=0.0, body=self.held, position=centre))
        else:
            live.apply(Pull(time=0.0, body=self.held, grip=self._grip, target=position))

    def release(self, live: LiveView) -> None:
        """Release the held body.

        Raises:
            ActionError: the session has ended.
        """
        held, self.held = self.held, None
        if held is not None and not self._moving:
            live.apply(Pull(time=0.0, body=held))

    def drop(self) -> None:
        """End the drag without an action on the session; the selection stays."""
        self.held = None

    def reset(self) -> None:
        """Clear the drag and the selection."""
        self.held = self.picked = None

    def spring_line(self, live: LiveView) -> tuple[Position, Position] | None:
        """Return both ends of the mouse spring, m; None if no body is pulled."""
        if self.held is None or self._moving or self.held not in live.bodies.names:
            return None
        index = live.bodies.names.index(self.held)
        frame = live.frame
        if index >= len(frame.position) or not frame.present[index]:
            return None
        right, up = _rotated(self._grip, float(frame.angle[index]))
        x, y = frame.position[index].tolist()
        return (x + right, y + up), self._target

    def remove(self, live: LiveView) -> None:
        """Remove the selected body.

        Raises:
            ActionError: no body is selected, or the engine refuses.
        """
        live.apply(Remove(time=0.0, body=live.bodies.names[self._require_picked(live)]))
        self.reset()

    def _require_picked(self, live: LiveView) -> int:
        index = self.picked_index(live)
        if index is None:
            raise ActionError("select a body first: click it")
        return index

    def nudge(self, live: LiveView) -> None:
        """Apply an impulse up and to the right to the selected body.

        Raises:
            ActionError: no body is selected, or the engine refuses.
        """
        index = self._require_picked(live)
        mass, radius = float(live.bodies.mass[index]), float(live.bodies.radius[index])
        kick = mass * min(NUDGE_SPEED, 10.0 * radius)
        live.apply(Impulse(time=0.0, body=live.bodies.names[index], impulse=(0.6 * kick, 0.8 * kick)))

    def add(self, live: LiveView, position: Position, view_size: float, *, box: bool = False) -> None:
        """Add a ball or box modelled on the selected body, else on the first one; without bodies, sized to the view.

        If the model has another shape, the new body has its area and density.

        Args:
            live: session to add to.
            position: of the new body, m.
            view_size: shorter side of the visible area, m.
            box: add a box instead of a ball.

        Raises:
            ActionError: there is no free space, or the engine refuses.
        """
        bodies = live.bodies
        picked = self.picked_index(live)
        like = picked if picked is not None else (0 if len(bodies) else None)
        if like is None:
            made = _new_body(position, min(max(view_size / 40.0, 1e-9), 1e9), box, restitution=0.5, friction=0.5)
        else:
            made = _new_body_like(bodies, like, position, box)
        made = _find_free_position(live, made)
        live.apply(Spawn(time=0.0, box=made) if isinstance(made, Box) else Spawn(time=0.0, ball=made))

    def shift(self, live: LiveView, body: str, by: Position) -> None:
        """Displace a body by an offset, m, and set its velocity to zero, as the arrow keys do.

        Raises:
            ActionError: the engine refuses.
        """
        if body in live.bodies.names:
            x, y = live.frame.position[live.bodies.names.index(body)].tolist()
            live.apply(Move(time=0.0, body=body, position=(x + by[0], y + by[1]), velocity=(0.0, 0.0)))


MAX_RINGS, RING_POSITIONS = 24, 16
"""Candidate positions around the cursor: number of rings, half a body radius apart, and positions per ring."""


def _find_free_position(live: LiveView, body: Ball | Box) -> Ball | Box:
    """Return a new body moved to the nearest free position.

    Raises:
        ActionError: there is no free position nearby.
    """
    if body.collides == "none":
        return body
    form = geometry_of(body)
    hulls = [Hull(np.asarray(piece.corners), piece.radius) for piece in form.pieces]
    step = 0.5 * max(float(np.hypot(*hull.corners.T).max()) + hull.radius for hull in hulls)
    x, y = body.position
    for ring in range(MAX_RINGS):
        for k in range(RING_POSITIONS if ring else 1):
            turn = math.tau * k / RING_POSITIONS
            position = x - ring * step * math.sin(turn), y + ring * step * math.cos(turn)
            moved_hulls = [Hull(hull.corners + np.asarray(position), hull.radius) for hull in hulls]
            if is_free(live.scene, live.bodies, live.frame, moved_hulls, body.layer):
                return body.model_copy(update={"position": position})
    raise ActionError("no room here; point at an empty spot")


def count_changes(actions: Iterable[Action], moved_by_keys: str | None = None) -> int:
    """Return the number of manual changes: bodies added, removed, moved, pulled and nudged, parameters set.

    Args:
        actions: of a session.
        moved_by_keys: name of the body that the arrow keys move as part of the scene; its moves do not count.
    """
    count, last = 0, ""
    for action in actions:
        match action:
            case Spawn() | Remove() | Impulse():
                now = ""
            case Pull(target=None):  # the release of a pull
                last = ""
                continue
            case Pull():
                now = f"pull {action.body}"
            case Move():
                now = "" if action.body == moved_by_keys else f"move {action.body}"
            case SetParameter():
                now = f"set {action.path}"
            case _:
                last = ""
                continue
        moved_so = isinstance(action, Move) and not now
        count += not moved_so and (not now or now != last)  # a drag consists of many moves or pulls
        last = now
    return count


def describe_loss(count: int, how: str, kept: int = 0) -> str:
    """Return the confirmation question for the loss of `count` manual changes, while `kept` others remain."""
    changes = "1 hand-made change" if count == 1 else f"{count:,} hand-made changes"
    rest = "" if not kept else " (1 setting stays)" if kept == 1 else f" ({kept:,} settings stay)"
    return f"{changes} will be lost{rest}: {how}, Ctrl+S saves the session"


def _new_body_like(bodies: Bodies, index: int, position: Position, box: bool) -> Ball | Box:
    """Return a ball or box with the surface properties, area and density of a body."""
    element = bodies.elements[int(bodies.element[index])]
    surface = {
        key: getattr(element, key) for key in ("material", "restitution", "restitution_falloff", "friction", "collides")
    }
    if not box and isinstance(element, Disc):
        return Ball(position=position, radius=element.radius, mass=element.mass, density=element.density, **surface)
    if box and isinstance(element, Box):
        return Box(position=position, size=element.size, mass=element.mass, density=element.density, **surface)
    area = sum(hull_area(Hull(np.asarray(piece.corners), piece.radius)) for piece in geometry_of(element).pieces)
    radius = math.sqrt(area / math.pi)
    density = float(bodies.mass[index]) / area
    return _new_body(position, radius, box, density=density, **surface)


def _new_body(position: Position, radius: float, box: bool, **more: Any) -> Ball | Box:
    """Return a ball, or a square box of the same area."""
    if not box:
        return Ball(position=position, radius=radius, **more)
    side = math.sqrt(math.pi) * radius
    return Box(position=position, size=(side, side), **more)


def _rotated(vector: Position, angle: float) -> Position:
    """Return a vector rotated by an angle, rad."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1]
