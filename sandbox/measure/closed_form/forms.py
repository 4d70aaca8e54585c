"""Solution: a whole scene by formula, where the scene alone guarantees one for every body from start to end."""

from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.measure.closed_form.bouncing import bouncing_alone
from sandbox.measure.closed_form.flight import free_flight, why_not
from sandbox.measure.closed_form.form import Assembler, Form, Motion, Recogniser, Together
from sandbox.measure.closed_form.given import Given
from sandbox.measure.closed_form.impacts import impacts
from sandbox.measure.closed_form.kepler import kepler
from sandbox.measure.closed_form.on_plane import on_plane
from sandbox.measure.closed_form.oscillator import oscillator
from sandbox.measure.closed_form.pendulum import pendulum
from sandbox.measure.closed_form.standing import standing
from sandbox.scene.compile.demands import on_floor
from sandbox.scene.scene import Scene
from sandbox.trajectory import ContactEvent, Contacts

ALONE: tuple[Recogniser, ...] = (on_plane, bouncing_alone, oscillator, pendulum, kepler)
"""Forms of one body, tried in this order, where no two that move can meet."""
TOGETHER: tuple[Assembler, ...] = (impacts, standing)
"""Forms of all bodies, tried in this order, where some can meet."""
FLIGHT = "free flight"

CHUNK = 1_000_000
"""Frames × bodies evaluated at once."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The formulas of a scene: every body that moves flies free, or has a form of its own, or all have one together."""

    scene: Scene
    flying: IntArray
    """numbers of the bodies that fly free"""
    alone: dict[int, Form]
    together: Together | None = None

    @property
    def about(self) -> str:
        """Which formulas, in a few words."""
        if self.together is not None:
            return self.together.name
        names = dict.fromkeys([FLIGHT] * bool(len(self.flying)) + [form.name for form in self.alone.values()])
        return ", ".join(names) or "nothing moves"

    def at(self, time: FloatArray) -> Motion:
        """Return the motion of all N bodies at T times."""
        if self.together is not None:
            return self.together.at(time)
        bodies = self.scene.bodies
        spins = np.where(bodies.fixed, 0.0, bodies.angular_velocity)
        position = np.repeat(bodies.position[None], len(time), axis=0)
        velocity = np.where(bodies.fixed[:, None], 0.0, np.repeat(bodies.velocity[None], len(time), axis=0))
        angle, spin = bodies.angle + time[:, None] * spins, np.repeat(spins[None], len(time), axis=0)
        chunks = max(1, len(self.flying) * len(time) // CHUNK)
        for part in np.array_split(self.flying, chunks) if len(self.flying) else ():
            start = bodies.position[part], bodies.velocity[part]
            position[:, part], velocity[:, part] = free_flight(time, *start, self.scene.world)
        for number, form in self.alone.items():
            position[:, number], velocity[:, number], angle[:, number], spin[:, number] = form.at(time)
        return Motion(position, velocity, angle, spin)

    def contacts(self, until: FloatArray, shortest: float) -> Contacts:
        """Return the contacts in the order of time.

        Args:
            until: (N,) s, up to when each body's count and their impulses add up.
            shortest: s; from the bounce on after which a flight would be shorter, contacts are one row that lasts.
        """
        if self.together is not None:
            return _arrays(self.together.contacts(float(until.max())))
        rows = [row for k, form in self.alone.items() for row in form.contacts(float(until[k]), shortest)]
        return _arrays(sorted(rows, key=lambda row: (row.time, row.pair)))


def solution(scene: Scene) -> Solution | None:
    """Return the formulas of a scene, or None where they do not cover all of it. Never an approximation.

    Where no two bodies that move can meet or are joined, each needs a form of its own; else all need one together.
    """
    if on_floor(scene) or scene.zones or len(scene.layers) > 1:  # of notes and layers no formula knows
        return None
    given = Given.of(scene)
    if given.meet.mutual:
        found = next((form for form in (assemble(given) for assemble in TOGETHER) if form is not None), None)
        return None if found is None else Solution(scene, np.empty(0, np.int64), {}, found)
    free = ~given.bodies.fixed & given.meet.free & ~given.thrust
    if why_not(scene) is not None:
        free &= False
    alone: dict[int, Form] = {}
    for number in np.flatnonzero(~given.bodies.fixed & ~free).tolist():
        form = next((form for form in (recognise(given, number) for recognise in ALONE) if form is not None), None)
        if form is None:
            return None
        alone[number] = form
    return Solution(scene, np.flatnonzero(free), alone)


def _arrays(rows: list[ContactEvent]) -> Contacts:
    if not rows:
        return Contacts.none()
    time, pair, point, normal, impulse = (np.asarray(column) for column in zip(*rows, strict=True))
    return Contacts(time, pair.astype(np.int64), point, normal, impulse)
