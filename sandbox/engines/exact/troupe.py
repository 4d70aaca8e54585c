"""Troupe: a roster that keeps track of what an action touches, and refuses what has no closed form."""

import numpy as np

from sandbox.action import ActionError
from sandbox.engines.acting import is_matter_same
from sandbox.engines.exact.overlap import allowed, overlapping_things, told
from sandbox.engines.fixtures import fixtures_of
from sandbox.engines.floor.level import unlevel
from sandbox.engines.floor.pockets import caught
from sandbox.engines.roster import ALL, FIXED, MEETS, NOTHING, Roster
from sandbox.scene.demands import curls, on_floor
from sandbox.scene.model import Ball, Scene, Single
from sandbox.scene.surfaced import Mover
from sandbox.trajectory import BoolArray, FloatArray


class Troupe(Roster):
    """The bodies of a running exact scene."""

    def __init__(self, scene: Scene, h: float) -> None:
        super().__init__(scene, h)
        self.kicked: set[int] = set()
        """whose velocity or spin an action has set"""
        self.moved: set[int] = set()
        """whose place it has"""
        self.renewed = False
        """whether it has changed gravity, coefficients, walls or who there is"""
        self.reshaped = False
        """whether it has changed walls"""

    def settled(self) -> None:
        """Forget what the last action did."""
        self.kicked.clear()
        self.moved.clear()
        self.renewed = self.reshaped = False

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        self._check_in_play(number)
        super().set_velocity(number, velocity)
        self.kicked.add(number)

    def set_spin(self, number: int, spin: float) -> None:
        """Give a body an angular velocity, rad/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        self._check_in_play(number)
        super().set_spin(number, spin)
        self.kicked.add(number)

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Refuse a steady force: only uniform gravity has the closed forms that events are found from.

        Raises:
            ActionError: always, but for the end of a force that is not there.
        """
        if force.any() or torque:
            raise ActionError(
                f"exact models no steady force on one body, here on {self.bodies.names[number]!r}; "
                "pymunk and reference do"
            )

    def put(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m.

        Raises:
            ActionError: something stands there.
        """
        others = np.arange(len(self.bodies)) != number
        kind, fixed = int(self.meets[number]), bool(self.bodies.fixed[number])
        self._check_free(self.bodies.names[number], position, float(self.radius[number]), kind, fixed, others)
        super().put(number, position)
        self.moved.add(number)

    def change(self, scene: Scene, spawned: tuple[Mover, ...] | None = None) -> None:
        """Go on with a scene that differs alone in gravity, coefficients, the course of walls, or in what is solid.

        Raises:
            ActionError: it has drag, or gravity along a floor, or more surfaces than a scene may have; or a ball
                stands where something becomes solid.
        """
        if scene.world.linear_drag or scene.world.quadratic_drag:
            raise ActionError("exact does not model drag; pymunk and reference do")
        checked = scene.world is self.scene.world and is_matter_same(scene, self.scene)
        if not checked and on_floor(scene) and (lacks := next(unlevel(scene, self.bodies), None)):
            raise ActionError(lacks)
        if curls(scene):
            raise ActionError("exact models no curl; pymunk does")
        meets = np.flatnonzero((self.meets != NOTHING) & self.moving)
        if len(meets) and any(new is not old for new, old in zip(scene.fixed, self.scene.fixed, strict=True)):
            found = overlapping_things(self.position[meets], self.radius[meets], fixtures_of(scene))
            if found is not None:
                raise ActionError(told(self.bodies.names[meets[found[0]]], scene.fixed_names[found[1]], found[2]))
        reshaped = [wall.points for wall in scene.walls] != [wall.points for wall in self.scene.walls]
        super().change(scene, spawned)
        self.renewed, self.reshaped = True, reshaped

    def add(self, single: Single, name: str) -> int:
        """Add a body that was checked, and return its number.

        Raises:
            ActionError: something stands there, it is no ball, or not like those on a floor, or it makes more surfaces
                than a scene may have.
        """
        if isinstance(single, Ball):
            others = np.ones(len(self.bodies), dtype=np.bool_)
            place, kind = np.asarray(single.position), MEETS[single.collides]
            self._check_free(name, place, single.radius, kind, single.fixed, others)
            if on_floor(self.scene) and (lacks := next(unlevel(self.scene, self.bodies.joined_by(single, name)), None)):
                raise ActionError(lacks)
        elif single.collides != "none":
            raise ActionError(f"exact models no polygons, such as {name!r}; pymunk and reference do")
        number = super().add(single, name)
        self.renewed = True
        return number

    def _check_in_play(self, number: int) -> None:
        """Refuse to set a ball in motion that lies in a pocket; one that is being put there is yet to fall.

        Raises:
            ActionError: it does.
        """
        if number in self.moved or self.meets[number] == NOTHING:
            return
        if caught(self.scene, self.position[number : number + 1])[0] >= 0:
            raise ActionError(f"{self.bodies.names[number]!r} lies in a pocket; move it back into play first")

    def _check_free(
        self, name: str, position: FloatArray, radius: float, kind: int, fixed: bool, others: BoolArray
    ) -> None:
        """Refuse a place where a ball would stand in another or in a fixed thing.

        Raises:
            ActionError: it would.
        """
        if kind == NOTHING:
            return
        still = self.bodies.fixed
        if caught(self.scene, position[None, :])[0] >= 0:
            return
        others = others & (caught(self.scene, self.position) < 0)  # what lies in a pocket meets nothing
        meet = others & (self.meets == ALL) & ~still if kind == ALL else np.zeros_like(others)
        meet |= others & (self.meets == FIXED) & ~still if fixed and kind == ALL else False
        meet |= others & (self.meets == ALL) & still & (not fixed)
        apart = self.position - position
        depth = self.radius + radius - np.hypot(apart[:, 0], apart[:, 1])
        here = np.broadcast_to(position, self.position.shape)
        deep = np.flatnonzero(meet & (depth > allowed(self.position, here)))
        if len(deep):
            raise ActionError(told(name, self.bodies.names[deep[0]], float(depth[deep[0]])))
        if fixed:
            return
        found = overlapping_things(position[None, :], np.array([radius]), self.fixtures)
        if found is not None:
            raise ActionError(told(name, self.scene.fixed_names[found[1]], found[2]))
