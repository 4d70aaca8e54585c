"""Recorded: what the formula of a body says at the times of a run, and how far it holds there."""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.closed_form.bouncing import Bouncing, bouncing
from sandbox.measure.closed_form.flight import free_flight, why_not
from sandbox.measure.closed_form.forms import solution
from sandbox.measure.closed_form.given import TOUCH, Given, normal_of, thrust_on
from sandbox.measure.lying import gap_above
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory


class ClosedForm(NamedTuple):
    """What the formula says at each of the T recorded times."""

    position: FloatArray
    """(T, 2) m"""
    velocity: FloatArray
    """(T, 2) m/s; at the instant of a bounce, that after it"""
    valid: BoolArray
    """(T,) whether the formula holds at that time; elsewhere the others mean nothing"""
    spin: FloatArray | None = None
    """(T,) rad/s; None where nothing turns the body"""


def valid_until(trajectory: Trajectory, number: int) -> float:
    """Return until when a body flew free, s: its first contact, seen or missed, or its retirement, or inf."""
    return min(_first_contact(trajectory, number), _retired(trajectory, number))


def closed_form(trajectory: Trajectory, scene: Scene, number: int) -> ClosedForm | None:
    """Return the best closed form of a body at a run's times, or None where it has none.

    Bouncing, where the scene has one plane, gravity is square to it or 0, there is no drag, and nothing rubs:
    friction is 0, or the ball neither spins nor moves along the plane. It holds until the ball meets anything
    else. Otherwise free flight up to the first contact, by what the run recorded or because the formula itself
    reaches a plane. Contacts that the engine missed count where the run was audited; a missed bounce does not
    end the bouncing, which is right then. Before either, what a formula of the whole scene says of a body that does
    more than fly and bounce: that holds to its end.

    A run that actions or zones interfered with has none; what zones only note ends a form as a contact does. Only a
    ball bounces by formula; other shapes have their flight up to the first contact.
    """
    bodies = scene.bodies
    if trajectory.info.get("actions") or trajectory.names.tolist() != list(bodies.names) or bodies.fixed[number]:
        return None
    if any(zone.holds or zone.gravity is not None for zone in scene.zones):
        return None
    form = _solved(trajectory, scene, number) or _bouncing(trajectory, scene, number)
    form = form or _flying(trajectory, scene, bodies, number)
    return form if form is not None and np.count_nonzero(form.valid) > 1 else None


def _driven(scene: Scene, bodies: Bodies) -> BoolArray:
    """Return which bodies are joined to something or carry a thrust, (N,): no formula here is theirs."""
    return np.asarray(scene.links.held(len(bodies)) | thrust_on(scene, bodies))


def _solved(trajectory: Trajectory, scene: Scene, number: int) -> ClosedForm | None:
    """Return a body's part in the solution of its scene, where it neither flies free nor bounces."""
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
    if why_not(scene) is not None or _driven(scene, bodies)[number]:
        return None
    start = bodies.position[number], bodies.velocity[number]
    position, velocity = free_flight(trajectory.time, *start, scene.world)
    valid = trajectory.time < valid_until(trajectory, number)
    if bodies.elements[bodies.element[number]].collides != "none":
        angle = bodies.angle[number] + trajectory.time * bodies.angular_velocity[number]
        for plane in scene.planes:
            point, normal = np.asarray(plane.point), normal_of(plane)
            gap = gap_above(bodies, number, position, angle, point, normal)
            noise = TOUCH + 4.0 * np.finfo(np.float64).eps * float(np.abs((start[0], point)).max())
            valid &= ~np.logical_or.accumulate(gap < -noise)
    return ClosedForm(position, velocity, valid)


def _bouncing(trajectory: Trajectory, scene: Scene, number: int) -> ClosedForm | None:
    form = bouncing(Given.of(scene), number)
    if form is None:
        return None
    until = min(_first_contact(trajectory, number, besides=-1), _retired(trajectory, number))
    motion = form.at(trajectory.time)
    return ClosedForm(motion.position, motion.velocity, valid=trajectory.time < until)


def _first_contact(trajectory: Trajectory, number: int, besides: int | None = None) -> float:
    """Return when a body first touched, or should have touched, anything but `besides`; inf for never."""
    first = np.inf
    for time, pair in (
        (trajectory.contact_time, trajectory.contact_pair),
        (trajectory.missed_time, trajectory.missed_pair),
    ):
        own = (pair == number).any(axis=1)
        if besides is not None:
            own &= (pair != besides).all(axis=1)
        first = min(first, float(np.min(time[own], initial=np.inf)))
    return first


def _retired(trajectory: Trajectory, number: int) -> float:
    time = float(trajectory.retired_time[number])
    return math.inf if math.isnan(time) else time
