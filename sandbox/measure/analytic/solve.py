"""Choice of the analytic solution of a whole scene, or of one body at the times of a recorded run."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.measure.analytic.ballistic_collisions import ballistic_collisions
from sandbox.measure.analytic.bouncing import Bouncing, bouncing, bouncing_on_only_plane
from sandbox.measure.analytic.incline import incline_motion
from sandbox.measure.analytic.kepler import kepler
from sandbox.measure.analytic.model import (
    TOUCH_TOLERANCE,
    Assembler,
    BodyMotion,
    BodySolution,
    CoupledSolution,
    Recogniser,
    SceneFacts,
    free_flight,
    normal_of,
    thrust_on,
    unsupported_reason,
)
from sandbox.measure.analytic.oscillator import oscillator
from sandbox.measure.analytic.pendulum import pendulum
from sandbox.measure.analytic.pulley import atwood_machine
from sandbox.measure.analytic.static_stack import static_stack
from sandbox.measure.metrics.clearance import plane_clearance
from sandbox.scene.compile.ballistics import free_rotation
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.demands import OWN_MOTION, Demand, demands, on_floor
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import ContactEvent, Contacts, Trajectory

BODY_SOLUTIONS: tuple[Recogniser, ...] = (
    incline_motion,
    bouncing_on_only_plane,
    oscillator,
    pendulum,
    atwood_machine,
    kepler,
)
"""Solutions of one body, tried in this order, if no two moving bodies can collide."""
COUPLED_SOLUTIONS: tuple[Assembler, ...] = (ballistic_collisions, static_stack)
"""Solutions of all bodies, tried in this order, if some can collide."""
FLIGHT = "free flight"

CHUNK = 1_000_000
"""Frames × bodies that are evaluated at once."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Analytic solution of a scene: one of each moving body, or one of all bodies together."""

    scene: Scene
    flying: IntArray
    """indices of the bodies in free flight"""
    alone: dict[int, BodySolution]
    together: CoupledSolution | None = None

    @property
    def about(self) -> str:
        """Names of the formulas."""
        if self.together is not None:
            return self.together.name
        names = dict.fromkeys([FLIGHT] * bool(len(self.flying)) + [form.name for form in self.alone.values()])
        return ", ".join(names) or "nothing moves"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return the motion of all N bodies at T times."""
        if self.together is not None:
            return self.together.at(time)
        bodies = self.scene.bodies
        spins = np.where(bodies.fixed, 0.0, bodies.angular_velocity)
        position = np.repeat(bodies.position[None], len(time), axis=0)
        velocity = np.where(bodies.fixed[:, None], 0.0, np.repeat(bodies.velocity[None], len(time), axis=0))
        angle, spin = free_rotation(time, bodies.angle, spins, self.scene.world)
        chunks = max(1, len(self.flying) * len(time) // CHUNK)
        for part in np.array_split(self.flying, chunks) if len(self.flying) else ():
            start = bodies.position[part], bodies.velocity[part]
            turning = bodies.lift[part] * spins[part]
            position[:, part], velocity[:, part] = free_flight(time, *start, self.scene.world, turning)
        for number, form in self.alone.items():
            position[:, number], velocity[:, number], angle[:, number], spin[:, number] = form.at(time)
        return BodyMotion(position, velocity, angle, spin)

    def contacts(self, until: FloatArray, shortest: float) -> Contacts:
        """Return the contacts in the order of time.

        Args:
            until: end of the contacts of each body and of the sums of impulses, (N,) s.
            shortest: s; from the first flight on that would be shorter, contacts are one row that lasts.
        """
        if self.together is not None:
            return _arrays(self.together.contacts(float(until.max())))
        rows = [row for k, form in self.alone.items() for row in form.contacts(float(until[k]), shortest)]
        return _arrays(sorted(rows, key=lambda row: (row.time, row.pair)))


def solution(scene: Scene) -> Solution | None:
    """Return the analytic solution of a scene, or None if the formulas do not cover all of it.

    It is never an approximation. If no two moving bodies can collide or are joined, each body is solved separately;
    otherwise all are solved together.
    """
    has_filters = len(scene.layers) > 1 or scene.categories or scene.bodies.groups
    changes = scene.zones or scene.events or scene.bodies.kinematic.any()
    if on_floor(scene) or changes or has_filters:  # no formula includes them
        return None
    if demands(scene) & (OWN_MOTION | {Demand.ROLLING}):  # nor these
        return None
    facts = SceneFacts.of(scene)
    if facts.matrix.mutual:
        found = next((form for form in (assemble(facts) for assemble in COUPLED_SOLUTIONS) if form is not None), None)
        return None if found is None else Solution(scene, np.empty(0, np.int64), {}, found)
    free = ~facts.bodies.fixed & facts.matrix.free & ~facts.thrust
    if unsupported_reason(scene) is not None:
        free &= False
    alone: dict[int, BodySolution] = {}
    for number in np.flatnonzero(~facts.bodies.fixed & ~free).tolist():
        form = next(
            (form for form in (recognise(facts, number) for recognise in BODY_SOLUTIONS) if form is not None), None
        )
        if form is None:
            return None
        alone[number] = form
    return Solution(scene, np.flatnonzero(free), alone)


def _arrays(rows: list[ContactEvent]) -> Contacts:
    if not rows:
        return Contacts.none()
    time, pair, point, normal, impulse = (np.asarray(column) for column in zip(*rows, strict=True))
    return Contacts(time, pair.astype(np.int64), point, normal, impulse)


class ClosedForm(NamedTuple):
    """Solution of one body at the T times of a run."""

    position: FloatArray
    """(T, 2) m"""
    velocity: FloatArray
    """(T, 2) m/s; after the impact at the time of an impact"""
    valid: BoolArray
    """(T,) whether the formula holds; other values are meaningless"""
    spin: FloatArray | None = None
    """(T,) rad/s; None if the body does not rotate"""


def valid_until(trajectory: Trajectory, number: int) -> float:
    """Return the end of the free flight of a body, s: its first contact, found or missed, or its retirement, or inf."""
    return min(_first_contact(trajectory, number), _retired(trajectory, number))


def closed_form(trajectory: Trajectory, scene: Scene, number: int) -> ClosedForm | None:
    """Return the best closed form of a body at the times of a run, or None if it has none.

    It is taken from a solution of the whole scene if the body does more than fly and bounce; it then holds to the end
    of the run. Otherwise it is the bouncing of a ball on the only plane, which holds until the ball collides with
    anything else.
    Otherwise it is free flight up to the first contact: a recorded one, or the time at which the formula reaches a
    plane. Missed contacts count if the run was audited; a missed bounce does not end the bouncing.

    A run with actions, and one in a scene with events or with zones that act on bodies, has none; entering a zone that
    only detects bodies ends a closed form as a contact does.
    """
    bodies = scene.bodies
    acted = trajectory.info.get("actions") or scene.events
    if acted or trajectory.names.tolist() != list(bodies.names) or bodies.fixed[number]:
        return None
    if any(zone.moves_bodies for zone in scene.zones) or _moves_its_own_way(bodies, number):
        return None
    form = _solved(trajectory, scene, number)
    if Demand.ROLLING not in demands(scene):
        form = form or _bouncing(trajectory, scene, number)
    form = form or _flying(trajectory, scene, bodies, number)
    return form if form is not None and np.count_nonzero(form.valid) > 1 else None


def _moves_its_own_way(bodies: Bodies, number: int) -> bool:
    """Return whether a body scales gravity, is damped, or has a limit of its speed, which no formula includes."""
    damped = bodies.linear_damping[number] + bodies.angular_damping[number] > 0.0
    return bool(damped or bodies.gravity_scale[number] != 1.0 or bodies.limited[number])


def _is_driven(scene: Scene, bodies: Bodies) -> BoolArray:
    """Return which bodies are joined or have a thrust, (N,), so that no formula here applies."""
    return np.asarray(scene.joint_arrays.held(len(bodies)) | thrust_on(scene, bodies))


def _solved(trajectory: Trajectory, scene: Scene, number: int) -> ClosedForm | None:
    """Return the solution of a body within that of its scene, if it neither flies freely nor bounces."""
    found = solution(scene)
    if found is None:
        return None
    form = found.alone.get(number)
    if found.together is not None:
        position, velocity, _, spin = (each[:, number] for each in found.together.at(trajectory.time))
    elif form is not None and not isinstance(form, Bouncing):
        position, velocity, _, spin = form.at(trajectory.time)
    else:
        return None
    return ClosedForm(position, velocity, trajectory.time < _retired(trajectory, number), spin)


def _flying(trajectory: Trajectory, scene: Scene, bodies: Bodies, number: int) -> ClosedForm | None:
    if unsupported_reason(scene) is not None or _is_driven(scene, bodies)[number]:
        return None
    start = bodies.position[number], bodies.velocity[number]
    turning = bodies.lift[number] * bodies.angular_velocity[number]
    position, velocity = free_flight(trajectory.time, *start, scene.world, turning)
    valid = trajectory.time < valid_until(trajectory, number)
    if bodies.elements[bodies.element[number]].collides != "none":
        angle, _ = free_rotation(trajectory.time, bodies.angle[number], bodies.angular_velocity[number], scene.world)
        for plane in scene.planes:
            point, normal = np.asarray(plane.point), normal_of(plane)
            gap = plane_clearance(bodies, number, position, angle, point, normal)
            noise = TOUCH_TOLERANCE + 4.0 * np.finfo(np.float64).eps * float(np.abs((start[0], point)).max())
            valid &= ~np.logical_or.accumulate(gap < -noise)
    return ClosedForm(position, velocity, valid)


def _bouncing(trajectory: Trajectory, scene: Scene, number: int) -> ClosedForm | None:
    form = bouncing(SceneFacts.of(scene), number)
    if form is None:
        return None
    until = min(_first_contact(trajectory, number, besides=-1), _retired(trajectory, number))
    motion = form.at(trajectory.time)
    return ClosedForm(motion.position, motion.velocity, valid=trajectory.time < until)


def _first_contact(trajectory: Trajectory, number: int, besides: int | None = None) -> float:
    """Return the time of the first contact of a body, found or missed, s; inf if there is none.

    Contacts with the index `besides` do not count.
    """
    first = np.inf
    for time, pair in (
        (trajectory.contact_time, trajectory.contact_pair),
        (trajectory.missed_time, trajectory.missed_pair),
    ):
        is_own = (pair == number).any(axis=1)
        if besides is not None:
            is_own &= (pair != besides).all(axis=1)
        first = min(first, float(np.min(time[is_own], initial=np.inf)))
    return first


def _retired(trajectory: Trajectory, number: int) -> float:
    time = float(trajectory.retired_time[number])
    return math.inf if math.isnan(time) else time
