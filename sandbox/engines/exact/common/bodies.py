"""Body store of an event-driven simulation, which records the changes that actions make."""

import numpy as np

from sandbox.action import ActionError
from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.common.actions import has_same_bodies
from sandbox.engines.common.body_store import ALL, COLLISION_MASKS, FIXED, NOTHING, BodyStore
from sandbox.engines.common.colliders import static_colliders
from sandbox.engines.exact.common.requirements import overlap_message, overlapping_collider, touch_tolerance
from sandbox.engines.tabletop.requirements import pockets_at, unsupported_on_surface
from sandbox.scene.compile.demands import air_demands, curls, demands_of_body, on_floor
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec
from sandbox.scene.description.discs import Ball


class EventDrivenBodies(BodyStore):
    """Bodies of a running event-driven scene, and which of them the last action has changed."""

    def __init__(self, setup: Setup, h: float) -> None:
        super().__init__(setup, h)
        self.velocity_set: set[int] = set()
        """indices of bodies whose velocity or spin has been set"""
        self.position_set: set[int] = set()
        """indices of bodies whose position has been set"""
        self.scene_changed = False
        """whether gravity, coefficients, walls or the set of bodies have changed"""
        self.walls_changed = False
        """whether points of walls have changed"""

    def clear_changes(self) -> None:
        """Forget the changes of the last action."""
        self.velocity_set.clear()
        self.position_set.clear()
        self.scene_changed = self.walls_changed = False

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s.

        Raises:
            ActionError: it is in a pocket.
        """
        self._check_in_play(index)
        super().set_velocity(index, velocity)
        self.velocity_set.add(index)

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s.

        Raises:
            ActionError: it is in a pocket.
        """
        self._check_in_play(index)
        super().set_spin(index, spin)
        self.velocity_set.add(index)

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Refuse a constant force: events are found from closed forms of motion, which exist for uniform gravity only.

        Raises:
            ActionError: always, unless force and torque are zero.
        """
        if force.any() or torque:
            raise ActionError(
                f"exact does not model a constant force on one body, here on {self.bodies.names[index]!r}; "
                "pymunk and reference do"
            )

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m.

        Raises:
            ActionError: it would overlap another object.
        """
        others = np.arange(len(self.bodies)) != index
        kind, fixed = int(self.collision_mask[index]), bool(self.bodies.fixed[index])
        self._check_free(self.bodies.names[index], position, float(self.radius[index]), kind, fixed, others)
        super().move_body(index, position)
        self.position_set.add(index)

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Continue with a changed scene. Only gravity, coefficients, points of walls and solid flags may differ.

        Raises:
            ActionError: the scene has drag, lift, damping, curl, gravity along a `[surface]`, or too many different
                surfaces; or a ball overlaps a collider that has moved or become solid.
        """
        scene = setup.scene
        for demand in sorted(air_demands(scene.world, self.bodies, self.present)):
            raise ActionError(f"exact does not model {demand}")
        is_checked = scene.world is self.scene.world and has_same_bodies(scene, self.scene)
        if not is_checked and on_floor(setup) and (reason := next(unsupported_on_surface(setup, self.bodies), None)):
            raise ActionError(reason)
        if curls(setup):
            raise ActionError("exact does not model curl; pymunk does")
        candidates = np.flatnonzero((self.collision_mask != NOTHING) & self.moving)
        if len(candidates) and any(new is not old for new, old in zip(scene.fixed, self.scene.fixed, strict=True)):
            found = overlapping_collider(self.position[candidates], self.radius[candidates], static_colliders(scene))
            if found is not None:
                raise ActionError(
                    overlap_message(self.bodies.names[candidates[found[0]]], scene.fixed_names[found[1]], found[2])
                )
        walls_changed = [wall.points for wall in scene.walls] != [wall.points for wall in self.scene.walls]
        super().change(setup, spawned)
        self.scene_changed, self.walls_changed = True, walls_changed

    def add(self, single: BodySpec, name: str) -> int:
        """Add a validated body and return its index.

        Raises:
            ActionError: it overlaps another object, is not a ball, adds a demand that `exact` does not model, such as
                lift, is not supported on a `[surface]`, or the scene would have more different surfaces than allowed.
        """
        for demand in sorted(demands_of_body(single, self.scene)):
            raise ActionError(f"exact does not model {demand}")
        if isinstance(single, Ball):
            others = np.ones(len(self.bodies), dtype=np.bool_)
            position, kind = np.asarray(single.position), COLLISION_MASKS[single.collides]
            self._check_free(name, position, single.radius, kind, single.fixed, others)
            if on_floor(self.setup) and (
                reason := next(unsupported_on_surface(self.setup, self.bodies.joined_by(single, name)), None)
            ):
                raise ActionError(reason)
        elif single.collides != "none":
            raise ActionError(f"exact does not model polygons, such as {name!r}; pymunk and reference do")
        index = super().add(single, name)
        self.scene_changed = True
        return index

    def _check_in_play(self, index: int) -> None:
        """Refuse to set a ball in motion that is in a pocket. One that the same action has moved is not captured yet.

        Raises:
            ActionError: it is in a pocket.
        """
        if index in self.position_set or self.collision_mask[index] == NOTHING:
            return
        if pockets_at(self.scene, self.position[index : index + 1])[0] >= 0:
            raise ActionError(f"{self.bodies.names[index]!r} is in a pocket; move it back into play first")

    def _check_free(
        self, name: str, position: FloatArray, radius: float, kind: int, fixed: bool, others: BoolArray
    ) -> None:
        """Refuse a position at which a ball would overlap another or a static collider.

        Raises:
            ActionError: it would overlap.
        """
        if kind == NOTHING:
            return
        is_fixed = self.bodies.fixed
        if pockets_at(self.scene, position[None, :])[0] >= 0:
            return
        others = others & (pockets_at(self.scene, self.position) < 0)  # captured balls do not collide
        collides = others & (self.collision_mask == ALL) & ~is_fixed if kind == ALL else np.zeros_like(others)
        collides |= others & (self.collision_mask == FIXED) & ~is_fixed if fixed and kind == ALL else False
        collides |= others & (self.collision_mask == ALL) & is_fixed & (not fixed)
        offset = self.position - position
        depth = self.radius + radius - np.hypot(offset[:, 0], offset[:, 1])
        positions = np.broadcast_to(position, self.position.shape)
        overlapping = np.flatnonzero(collides & (depth > touch_tolerance(self.position, positions)))
        if len(overlapping):
            raise ActionError(overlap_message(name, self.bodies.names[overlapping[0]], float(depth[overlapping[0]])))
        if fixed:
            return
        found = overlapping_collider(position[None, :], np.array([radius]), self.static_colliders)
        if found is not None:
            raise ActionError(overlap_message(name, self.scene.fixed_names[found[1]], found[2]))
