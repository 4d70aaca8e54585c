"""Bodies of stroke and plunger drives, and bodies on paths: kinematic bodies of Box2D with a prescribed motion.

During a step of Box2D such a body has the constant velocity that leads to the end of its motion, which its contacts
see; afterwards it is placed there exactly.
"""

from typing import NamedTuple

from sandbox.engines.box2d_adapter.world import Box2DWorld
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.motors import (
    advance_plunger,
    centre_about_pivot,
    plunger_state,
    stroke_direction,
    turn_at_rate,
)
from sandbox.scene.compile.drives import Mount
from sandbox.scene.compile.paths import PathPose
from sandbox.scene.description.base import Point
from sandbox.scene.description.forces import PlungerDrive, StrokeDrive


class PlannedMotion(NamedTuple):
    """End of the motion of a driven body in a step."""

    position: Point
    """m"""
    velocity: Point
    """m/s, after the step: 0 once it has arrived"""
    angle: float
    """rad"""
    spin: float
    """rad/s, likewise"""
    pull: float
    """m, of a plunger"""
    rate: float
    """m/s, of the pull"""


class KinematicDrives:
    """The driven bodies of a simulation."""

    def __init__(self, store: BodyStore, world: Box2DWorld) -> None:
        self._store, self._world = store, world
        self._planned: dict[int, PlannedMotion] = {}

    def plan(self, h: float) -> None:
        """Give each driven body the velocity that leads to the end of its motion over h, s."""
        store, self._planned = self._store, {}
        for index, mount in store.mounts.items():
            end = self._end_of(index, mount, h)
            (x, y), (end_x, end_y) = store.position[index].tolist(), end.position
            turned = end.angle - float(store.angle[index])
            is_at_rest = not (store.velocity[index].any() or store.angular_velocity[index])
            if is_at_rest and (end_x, end_y) == (x, y) and not turned and not end.rate:
                continue
            self._planned[index] = end
            self._world.set_velocity(index, ((end_x - x) / h, (end_y - y) / h), turned / h)

    def place(self) -> None:
        """Place the driven bodies that have moved at the end of their motion."""
        store = self._store
        for index, end in self._planned.items():
            store.position[index], store.velocity[index] = end.position, end.velocity
            store.angle[index], store.angular_velocity[index] = end.angle, end.spin
            store.drives[store.mounts[index].number, 1:] = end.pull, end.rate
            self._world.set_pose(index)
            self._world.set_motion(index)

    def _end_of(self, index: int, mount: Mount, h: float) -> PlannedMotion:
        store, drive = self._store, mount.drive
        level, pull, rate = store.drives[mount.number].tolist()
        if isinstance(drive, PlungerDrive):
            pull, rate, arrives = advance_plunger(drive, level, pull, rate, h)
            rate = 0.0 if arrives else rate
            position, velocity = plunger_state(mount.home, stroke_direction(drive), pull, rate)
            return PlannedMotion(position, velocity, float(store.angle[index]), 0.0, pull, rate)
        assert isinstance(drive, StrokeDrive)
        angle, spin, arrives = turn_at_rate(drive, level, float(store.angle[index]), h)
        spin = 0.0 if arrives else spin
        position, velocity = centre_about_pivot(mount.hinge, drive.pivot, angle, spin)
        return PlannedMotion(position, velocity, angle, spin, pull, rate)


class PathStep(NamedTuple):
    """Motion of a body on a path in a step."""

    end: PathPose
    velocity: Point
    """m/s"""
    spin: float
    """rad/s"""

    @property
    def is_at_rest(self) -> bool:
        """Whether the body does not move."""
        return not (any(self.velocity) or self.spin)


class KinematicPaths:
    """Bodies of a simulation that follow paths."""

    def __init__(self, store: BodyStore, world: Box2DWorld) -> None:
        self._store, self._world, self._began = store, world, store.setup.time
        self._steps: dict[int, PathStep] = {
            index: PathStep(motion.pose(self._began), (0.0, 0.0), 0.0) for index, motion in store.bodies.paths.items()
        }
        self._moving: list[int] = []

    def plan(self, time: float, h: float) -> None:
        """Give each body the velocity that leads from its pose at a time of the simulation, s, to the one h, s, later.

        A body that stays at rest is left out.
        """
        store, self._moving = self._store, []
        for index, last in self._steps.items():
            if not store.present[index]:
                continue
            (x, y, angle), end = last.end, store.bodies.paths[index].pose(self._began + time + h)
            step = PathStep(end, ((end.x - x) / h, (end.y - y) / h), (end.angle - angle) / h)
            self._steps[index] = step
            if not (step.is_at_rest and last.is_at_rest):
                self._moving.append(index)
                self._world.set_velocity(index, step.velocity, step.spin)

    def place(self) -> None:
        """Place the bodies at the end of their motion, which Box2D has rounded to 32 bits."""
        store = self._store
        for index, step in self._steps.items():
            if store.present[index]:
                store.position[index], store.angle[index] = step.end[:2], step.end.angle
                store.velocity[index], store.angular_velocity[index] = step.velocity, step.spin
        for index in self._moving:
            self._world.set_pose(index)
