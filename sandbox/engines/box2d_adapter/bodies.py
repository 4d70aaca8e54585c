"""Body stores of scenes on Box2D, which refuse changes that it does not support."""

from typing import NamedTuple

from sandbox.action import ActionError
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.box2d_adapter.limits import FARTHEST_LENGTHS, scale_for
from sandbox.engines.box2d_adapter.materials import mixing_faults
from sandbox.engines.box2d_adapter.requirements import shape_faults
from sandbox.engines.common.actions import derive_contacts
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.zoned_bodies import ZonedBodyStore
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec, Collides
from sandbox.scene.description.world import Settings


class Box2DBodies(BodyStore):
    """Body store that refuses changes which Box2D does not support."""

    scale: float
    """Box2D's lengths in a metre"""

    def check_place(self, position: tuple[float, float], radius: float, collides: Collides) -> None:
        """Refuse a position that is too far from the origin for 32-bit numbers.

        Raises:
            ActionError: it is.
        """
        del radius, collides
        if not max(map(abs, position)) * self.scale <= FARTHEST_LENGTHS:
            raise ActionError(f"{far_away(self.scale)}; the engine 'reference' has no such limit")

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Continue with a changed scene, as `BodyStore.change`.

        Raises:
            ActionError: Box2D cannot mix the coefficients of pairs, or the scene has too many different surfaces.
        """
        before, static = (self.setup, self.bodies, self.contact_matrix), self.static_colliders
        super().change(setup, spawned)
        reason = next(mixing_faults(self.setup.scene, self.contact_matrix), None)
        if reason is not None:
            self.static_colliders = static
            self._rebuild(*before)
            raise ActionError(f"box2d: {reason}")

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body and return its index, as `BodyStore.add`.

        Raises:
            ActionError: Box2D cannot represent its shape, or mix its coefficients with those of others.
        """
        bodies = self.bodies.joined_by(single, name)
        matrix = derive_contacts(self.setup, bodies)
        faults = [
            *shape_faults(bodies, self.scale, len(bodies) - 1),
            *mixing_faults(self.setup.scene, matrix),
        ]
        if faults:
            raise ActionError(f"box2d: {faults[0]}")
        return super().add(single, name)


class ZonedBox2DBodies(Box2DBodies, ZonedBodyStore):
    """Body store of a scene with zones, with the same refusals."""


def make_store(setup: Setup, settings: Settings) -> Box2DBodies:
    """Return the body store of a scene."""
    store = (ZonedBox2DBodies if setup.scene.zones else Box2DBodies)(setup, settings.h)
    store.scale = scale_for(settings)
    return store


class BodyState(NamedTuple):
    """State of N bodies before an action or zones change the body store."""

    position: FloatArray
    """(N, 2) m"""
    angle: FloatArray
    """(N,) rad"""
    velocity: FloatArray
    """(N, 2) m/s"""
    spin: FloatArray
    """(N,) rad/s"""
    layer: IntArray
    """(N,)"""
    held: BoolArray
    """(N,) whether a zone holds each"""

    @classmethod
    def of(cls, store: BodyStore) -> "BodyState":
        """Copy the state of a body store."""
        position, velocity, spin = store.position.copy(), store.velocity.copy(), store.angular_velocity.copy()
        return cls(position, store.angle.copy(), velocity, spin, store.layer.copy(), store.held_by_zone.copy())


def far_away(scale: float) -> str:
    """Return why a body is too far from the origin, for a number of Box2D's lengths in a metre."""
    return f"farther than {FARTHEST_LENGTHS / scale:g} m from the origin 32-bit numbers do not resolve the slop"
