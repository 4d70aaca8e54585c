"""Drives: the driven bodies of a scene in a pymunk space, by the numbers of their drives.

In each substep, before the space makes its own: levels lead to torques and ways (`hinge.py`, `strokes.py`), and each
driven body is put where it arrives at its place. After it: what it met has changed its speed.
"""

from collections.abc import Callable

import pymunk

from sandbox.engines.native.axle import Axle, Start, on_axle
from sandbox.engines.native.hinge import Hinge
from sandbox.engines.native.strokes import Plunger, Stroke
from sandbox.scene.bodies import Bodies
from sandbox.scene.driven import Mount, about_hinge, mounts
from sandbox.scene.drives import PlungerDrive, TorqueDrive
from sandbox.scene.model import Scene
from sandbox.trajectory import FloatArray


class Drives:
    """What drives hold."""

    def __init__(self, scene: Scene, space: pymunk.Space, h: float) -> None:
        self._space, self._h = space, h
        self._mounts: dict[str, Mount] = mounts(scene)
        self.state: FloatArray = scene.driven.copy()
        """(D, 3) of each drive, as a frame tells them; of those that hold somebody not up to date"""
        self._axles: dict[int, Axle] = {}
        self.axles: list[Axle] = []
        """the bodies that are held"""
        self._hinges: dict[int, Hinge] = {}  # by the ids of their bodies
        self._watched: set[int] = set()
        self._gravity = (0.0, 0.0), (0.0, 0.0)
        self._last: FloatArray | None = None

    def holds(self, name: str) -> bool:
        """Tell whether a body is driven."""
        return name in self._mounts

    def body(self, name: str, number: int, bodies: Bodies, state: list[float]) -> pymunk.Body:
        """Return the body of a drive, as it will be in the space.

        Args:
            name: of the body.
            number: its own.
            bodies: all.
            state: x, y, angle, vx, vy, spin.
        """
        mount = self._mounts[name]
        x, y, angle, *_ = state
        moment = about_hinge(mount, float(bodies.mass[number]), float(bodies.moment[number]))
        kind = pymunk.Body.DYNAMIC if isinstance(mount.drive, TorqueDrive) else pymunk.Body.KINEMATIC
        return on_axle(mount, angle, (x, y), kind, moment)

    def join(self, name: str, number: int, body: pymunk.Body, state: list[float]) -> None:
        """Take charge of a body that is in the space: state is x, y, angle, vx, vy, spin, mass."""
        mount = self._mounts[name]
        level, effort, pace = self.state[mount.number].tolist()
        x, y, angle, vx, vy, spin, mass, *_ = state
        own = level, effort, pace
        start = Start(number, mount, body, mass, (x, y), (vx, vy), angle, spin, own, self._h)
        if isinstance(mount.drive, TorqueDrive):
            hinge = Hinge(start, self._space.static_body)
            hinge.weigh(*self._gravity)
            self._space.add(hinge.limit)
            self._hinges[body.id] = hinge
            self._axles[mount.number] = hinge
        else:
            self._axles[mount.number] = Plunger(start) if isinstance(mount.drive, PlungerDrive) else Stroke(start)
        self.axles = list(self._axles.values())

    def leave(self, number: int) -> None:
        """Let go of a body, by its number, that leaves the space."""
        for k, axle in list(self._axles.items()):
            if axle.number == number:
                self.state[k] = axle.state
                del self._axles[k]
                if isinstance(axle, Hinge):
                    del self._hinges[axle.body.id]
                    self._space.remove(axle.limit)
        self.axles = list(self._axles.values())

    def watch(self, kind: Callable[[int], set[int]]) -> None:
        """Be told what bodies on hinges meet; `kind` gives the types of the shapes of a body by its number."""
        for hinge in self._hinges.values():
            for each in kind(hinge.number) - self._watched:
                self._watched.add(each)
                self._space.on_collision(each, None, pre_solve=self._met)

    def _met(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: object) -> None:
        if not arbiter.process_collision:  # it is let pass
            return
        for shape, first in zip(arbiter.shapes, (True, False), strict=True):
            hinge = self._hinges.get(shape.body.id) if shape.body is not None else None
            if hinge is not None:
                hinge.met(arbiter, first)

    def weigh(self, gravity: tuple[float, float], ground: tuple[float, float]) -> None:
        """Say which gravity acts from now on, m/s², and with which the space itself kicks all bodies."""
        self._gravity = gravity, ground
        for hinge in self._hinges.values():
            hinge.weigh(gravity, ground)

    def set(self, number: int, level: float) -> None:
        """Ask a drive for a level from now on."""
        self.state[number, 0] = level
        if number in self._axles:
            self._axles[number].set(level)

    def before(self) -> None:
        """Prepare the driven bodies for a substep."""
        for axle in self.axles:
            axle.before()

    def after(self) -> None:
        """Look what has become of them."""
        for axle in self.axles:
            axle.after()

    def write(
        self, position: FloatArray, velocity: FloatArray, angle: FloatArray, angular_velocity: FloatArray
    ) -> None:
        """Write the present state of driven bodies into arrays in scene order."""
        for axle in self._axles.values():
            axle.settle()
            n = axle.number
            position[n], velocity[n] = axle.place, axle.velocity
            angle[n], angular_velocity[n] = axle.angle, axle.spin

    def seat(self, position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray) -> None:
        """Put the centres of what turns about a hinge where their angles have them: between two states, on the arc.

        Of arrays in scene order, which were interpolated; places and velocities are written to.
        """
        for axle in self._axles.values():
            n = axle.number
            if not isinstance(axle, Plunger):
                position[n], velocity[n] = axle.seated(float(angle[n]), float(spin[n]))

    @property
    def numbers(self) -> list[int]:
        """Their numbers."""
        return [axle.number for axle in self.axles]

    def end(self, before: FloatArray, share: float) -> None:
        """Stand for good as it was a share of the last substep after its beginning, (D, 3)."""
        self._last = before + (self.told() - before) * share

    def told(self) -> FloatArray:
        """Return the drives as they are, (D, 3), as a frame tells them."""
        if self._last is not None:
            return self._last
        if self._axles:
            self.state[list(self._axles)] = [axle.state for axle in self._axles.values()]
        return self.state.copy()
