"""Bodies of stroke and plunger drives: kinematic bodies of Box2D that follow their prescribed motion.

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
