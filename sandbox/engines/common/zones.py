"""Zones: their effects on bodies whose centres are inside. The rules are the same on every engine."""

import math
from collections.abc import Iterable
from typing import Protocol

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.contact_log import ContactBatch
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import AWAY, HELD, INSIDE, RELEASED, mask_of
from sandbox.scene.geometry.shapes import middle_of


class ZoneHost(Protocol):
    """Operations that an engine provides for zones. Bodies and zones are addressed by their indices."""

    pending: set[int]
    """bodies that have entered or left a zone since the last `ZoneTracker.apply_effects`, or are to be checked"""

    def at(self, position: FloatArray) -> list[int]:
        """Return the zones that contain a position, m, in ascending order."""

    def inside(self, index: int) -> list[int]:
        """Return the zones that contained a body's centre at the end of the last substep, in ascending order."""

    def is_sensed(self, index: int) -> bool:
        """Return whether a body is in the engine and zones sense it."""

    @property
    def with_own_gravity(self) -> list[int]:
        """Bodies on which a zone's gravity acts."""

    def set_layer(self, index: int) -> None:
        """Apply a body's changed collision layer from now on. Its contacts on the old layer end."""

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m."""

    def hold(self, index: int) -> None:
        """Hold a body in place, whatever it collides with, until `release`."""

    def release(self, index: int) -> None:
        """Release a body that was held."""

    def set_gravity(self, index: int, gravity: Point | None) -> None:
        """Replace the world's gravity on a body by another, m/s²; None restores the world's."""


class ZoneTracker:
    """Zones of a running scene, and the state of every body with regard to each. It writes to the engine's arrays."""

    def __init__(self, scene: Scene, host: ZoneHost) -> None:
        self._zones, self._host = scene.zones, host
        self._masks = [mask_of(zone.layers, scene.layers) for zone in scene.zones]
        self._target_layers = [
            None if zone.to_layer is None else scene.layers.index(zone.to_layer) for zone in scene.zones
        ]
        self._collider_count = len(scene.fixed) + len(scene.pockets)
        self._entries: list[tuple[int, int, complex, complex]] = []

    def rebuild_arrays(
        self, position: FloatArray, velocity: FloatArray, spin: FloatArray, layer: IntArray, visits: IntArray
    ) -> None:
        """Use these arrays of all N bodies from now on."""
        self._position, self._velocity, self._spin = position, velocity, spin
        self.layer, self.visits = layer, visits

    def rebuild(self, matrix: ContactMatrix) -> None:
        """Update after a change of the scene's gravity, or of the set of bodies."""
        self._has_joint: BoolArray = matrix.held
        for index in self._host.with_own_gravity:
            self._apply_gravity(index, self._host.at(self._position[index]))

    @property
    def held(self) -> BoolArray:
        """(N,) whether each body is held."""
        return np.asarray((self.visits == HELD).any(axis=1))

    def begin(self, indices: Iterable[int], entering: bool) -> None:
        """Determine the zones of sensed bodies; with `entering`, bodies inside a zone enter it at this moment."""
        for index in indices:
            inside = self._host.at(self._position[index])
            if entering:
                self._enter(index, inside, np.zeros(2))
            if (self.visits[index] == HELD).any():
                self._host.hold(index)
            self._apply_gravity(index, inside)
            self._host.pending.add(index)  # it may have left by the end of the first substep

    def update_position(self, index: int) -> None:
        """Update after a change of a body's position. Zones at the new position are entered within the next substep."""
        if not self._host.is_sensed(index):
            return
        inside = self._host.at(self._position[index])
        self._leave(index, inside)
        self._apply_gravity(index, inside)
        self._host.pending.add(index)

    def release_body(self, index: int) -> None:
        """Release a body if it is held."""
        is_held = self.visits[index] == HELD
        if is_held.any():
            self.visits[index, is_held] = RELEASED
            self._host.release(index)

    def forget(self, indices: IntArray) -> None:
        """Reset the zone states of bodies that have left the scene."""
        self.visits[indices] = AWAY

    def apply_effects(self, ahead: FloatArray) -> None:
        """Apply the effects of zones that bodies entered during the last substep.

        Args:
            ahead: (2,) m/s, by which the stored velocities are ahead of time (half a kick).
        """
        host = self._host
        pending, host.pending = sorted(host.pending), set()
        for index in pending:
            inside = host.inside(index)
            self._enter(index, inside, ahead)
            self._apply_gravity(index, inside)

    def _leave(self, index: int, inside: list[int]) -> None:
        for zone in np.flatnonzero(self.visits[index]).tolist():
            if zone not in inside:
                self.visits[index, zone] = AWAY

    def _enter(self, index: int, inside: list[int], ahead: FloatArray) -> None:
        """Apply the zones that a body is inside of. Each acts once, until the body has left it."""
        self._leave(index, inside)
        candidates = [zone for zone in inside if self.visits[index, zone] == AWAY]
        while (zone := next((z for z in candidates if self._masks[z] >> self.layer[index] & 1), None)) is not None:
            candidates.remove(zone)
            self.visits[index, zone] = INSIDE
            self._record(index, zone, self._velocity[index] - ahead)
            layer = self._target_layers[zone]
            if layer is not None and layer != self.layer[index]:
                self.layer[index] = layer
                self._host.set_layer(index)
            if self._zones[zone].holds and self._can_hold(index, zone):
                self._hold(index, zone)
                return

    def _record(self, index: int, zone: int, velocity: FloatArray) -> None:
        velocity_vector, position = complex(*velocity), complex(*self._position[index])
        speed = abs(velocity_vector)
        direction = velocity_vector / speed if 0.0 < speed < math.inf else 1j
        self._entries.append((index, -1 - self._collider_count - zone, direction, position))

    def _can_hold(self, index: int, zone: int) -> bool:
        """Return whether a zone can hold a body: one body at a time, and none that is attached to a joint."""
        return (
            not self._has_joint[index]
            and not (self.visits[:, zone] == HELD).any()
            and not (self.visits[index] == HELD).any()
        )

    def _hold(self, index: int, zone: int) -> None:
        self.visits[index, zone] = HELD
        self._position[index] = middle_of(self._zones[zone])
        self._velocity[index], self._spin[index] = 0.0, 0.0
        self._host.set_position(index, self._position[index])
        self._host.hold(index)
        self._host.pending.add(index)  # the zone's centre may lie in other zones

    def _apply_gravity(self, index: int, inside: list[int]) -> None:
        """Apply the gravity of the last zone that contains a body, in place of the world's."""
        gravity = None
        for zone in inside:
            if self._masks[zone] >> self.layer[index] & 1 and self._zones[zone].gravity is not None:
                gravity = self._zones[zone].gravity
        self._host.set_gravity(index, gravity)

    def drain_entries(self, repeat: bool = False) -> ContactBatch | None:
        """Return the zone entries since the last call as contacts, or None; `repeat` keeps them for the next call."""
        if not self._entries:
            return None
        indices, zones, direction, position = zip(*self._entries, strict=True)
        if not repeat:
            self._entries = []
        no_impulse = np.zeros(len(indices), np.complex128)
        return ContactBatch(
            np.asarray(indices), np.asarray(zones), no_impulse, np.asarray(direction), np.asarray(position)
        )
