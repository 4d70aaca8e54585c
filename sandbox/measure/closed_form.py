"""Closed forms: what a body does by formula, to hold a simulation against.

Two motions have one here: flight under uniform gravity and linear drag, and the bouncing of a ball on one
plane that gravity is square to. Nothing is stepped; every time is evaluated on its own.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.measure.lying import gap_above
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Plane, Scene, World
from sandbox.scene.surfaces import surfaces_of
from sandbox.trajectory import BoolArray, FloatArray, Trajectory

TOUCH = 1e-9
"""m: an overlap up to this still counts as touching."""
SQUARE = 1e-12
"""Directions whose sine is below this are taken as parallel: rounding, not a slope."""
_SERIES = tuple((-1) ** n / math.factorial(n + 2) for n in range(20))


class ClosedForm(NamedTuple):
    """What the formula says at each of the T recorded times."""

    position: FloatArray
    """(T, 2) m"""
    velocity: FloatArray
    """(T, 2) m/s; at the instant of a bounce, that after it"""
    valid: BoolArray
    """(T,) whether the formula holds at that time; elsewhere the other two mean nothing"""


def why_not(scene: Scene) -> str | None:
    """Return why free flight in this scene has no closed form, or None where it has one."""
    if scene.world.quadratic_drag > 0:
        return "world.quadratic_drag couples x and y: the flight has no closed form"
    if scene.attractions:
        return "an attraction draws every body: the flight has no closed form here"
    return None


def driven(scene: Scene, bodies: Bodies) -> BoolArray:
    """Return which bodies are joined to something or carry a thrust, (N,): no formula here is theirs."""
    found = scene.links.held(len(bodies))
    if scene.thrusts:
        found |= np.isin(bodies.names, [thrust.body for thrust in scene.thrusts])
    return found


def free_flight(
    time: FloatArray, position: FloatArray, velocity: FloatArray, world: World
) -> tuple[FloatArray, FloatArray]:
    """Return where a body is that nothing touches, under a = g − k (v − wind).

    With z = k t: v = v₀ e⁻ᶻ + (g + k·wind) t φ₁ and x = x₀ + v₀ t φ₁ + (g + k·wind) t² φ₂, where
    φ₁ = (1 − e⁻ᶻ)/z and φ₂ = (z − 1 + e⁻ᶻ)/z² tend to 1 and ½: no cancellation for small z, and at k = 0 the
    parabola itself.

    Args:
        time: (T,) s since the start.
        position: (2,) or (N, 2) m, at the start.
        velocity: of the same shape, m/s.
        world: gives gravity, linear drag and wind.

    Returns:
        Positions and velocities, (T, 2) or (T, N, 2).

    Raises:
        ValueError: the world has quadratic drag.
    """
    if world.quadratic_drag > 0:
        raise ValueError("free flight under quadratic drag has no closed form")
    x, v = np.asarray(position, dtype=np.float64), np.asarray(velocity, dtype=np.float64)
    t = np.asarray(time, dtype=np.float64).reshape(-1, *(1,) * x.ndim)
    z = world.linear_drag * t
    phi_1, phi_2 = _phi(z)
    pull, wind = np.asarray(world.gravity), np.asarray(world.wind)
    flown = x + v * (t * phi_1) + pull * (t * t * phi_2) + wind * (t * z * phi_2)
    return flown, v * np.exp(-z) + pull * (t * phi_1) + wind * -np.expm1(-z)


def _phi(z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (1 − e⁻ᶻ)/z and (z − 1 + e⁻ᶻ)/z² for z ≥ 0; below 1 the second is its Taylor series."""
    large = np.maximum(z, 1.0)
    small = np.minimum(z, 1.0)
    series = np.zeros_like(z)
    for coefficient in reversed(_SERIES):
        series = series * small + coefficient
    nonzero = np.where(z > 0, z, 1.0)
    first = np.where(z > 0, -np.expm1(-nonzero) / nonzero, 1.0)
    # Divided twice, as a square could overflow.
    return first, np.where(z < 1, series, (large + np.expm1(-large)) / large / large)


def bounces(
    time: FloatArray, height: float, velocity: float, gravity: float, restitution: float
) -> tuple[FloatArray, FloatArray]:
    """Return the height and velocity of a ball that bounces straight up and down without drag.

    The first impact, at t₁ and speed V, starts flights of 2 V eⁿ/g, n = 1, 2, …; their sum is geometric, so
    the flight that a time falls into is a logarithm. The infinitely many bounces are over at
    t₁ + 2 V e/(g (1 − e)), for a ball dropped from rest t₁ (1 + e)/(1 − e); then it rests.

    Args:
        time: (T,) s.
        height: between ball and plane at time 0, m, ≥ 0.
        velocity: away from the plane at time 0, m/s.
        gravity: towards the plane, m/s², ≥ 0; without any, the ball bounces at most once.
        restitution: 0…1.

    Returns:
        Heights above contact, (T,) m, and velocities, (T,) m/s.

    Raises:
        ValueError: height, gravity or restitution is out of range.
    """
    if not (height >= 0 and gravity >= 0 and 0 <= restitution <= 1):
        raise ValueError("bounces need height >= 0, gravity >= 0 and restitution 0…1")
    t, e = np.asarray(time, dtype=np.float64), restitution
    if gravity == 0.0:
        return _one_bounce(t, height, velocity, e)
    impact = math.sqrt(velocity * velocity + 2.0 * gravity * height)
    # The two forms of one root, each free of cancellation for its sign.
    up = velocity > 0 or impact == 0
    first = (velocity + impact) / gravity if up else 2.0 * height / (impact - velocity)
    falling = t < first
    if impact == 0.0 or e == 0.0:
        above, speed = np.zeros_like(t), np.zeros_like(t)
    else:
        tau = np.maximum(t - first, 0.0) * (gravity / (2.0 * impact))
        since, launch = _flight(tau, e)
        above = (2.0 * impact * impact / gravity) * since * (launch - since)
        speed = impact * (launch - 2.0 * since)
    fallen = np.maximum(height + velocity * t - 0.5 * gravity * t * t, 0.0)
    return np.where(falling, fallen, above), np.where(falling, velocity - gravity * t, speed)


def _one_bounce(time: FloatArray, height: float, velocity: float, restitution: float) -> tuple[FloatArray, FloatArray]:
    if velocity >= 0.0:
        return height + velocity * time, np.full_like(time, velocity)
    impact = height / -velocity
    coming, rebound = time < impact, restitution * -velocity
    above = np.where(coming, np.maximum(height + velocity * time, 0.0), rebound * (time - impact))
    return above, np.where(coming, velocity, rebound)


def _flight(tau: FloatArray, e: float) -> tuple[FloatArray, FloatArray]:
    """Return the time into the present flight and that flight's length, both 0 at rest; flight n lasts eⁿ."""
    if e == 1.0:
        return tau - np.floor(tau), np.ones_like(tau)
    end, log_e = e / (1.0 - e), math.log(e)
    flying = tau < end
    share = np.where(flying, tau, 0.0) / end
    done = np.floor(np.log1p(-share) / log_e)
    # The logarithm may round into a neighbouring flight.
    done -= tau < -end * np.expm1(done * log_e)
    done += tau >= -end * np.expm1((done + 1.0) * log_e)
    length = np.where(flying, np.exp((done + 1.0) * log_e), 0.0)
    return np.clip(tau + end * np.expm1(done * log_e), 0.0, length), length


def valid_until(trajectory: Trajectory, number: int) -> float:
    """Return until when a body flew free, s: its first contact, seen or missed, or its retirement, or inf."""
    return min(_first_contact(trajectory, number), _retired(trajectory, number))


def closed_form(trajectory: Trajectory, scene: Scene, number: int) -> ClosedForm | None:
    """Return the best closed form of a body at a run's times, or None where it has none.

    Bouncing, where the scene has one plane, gravity is square to it or 0, there is no drag, and nothing rubs:
    friction is 0, or the ball neither spins nor moves along the plane. It holds until the ball meets anything
    else. Otherwise free flight up to the first contact, by what the run recorded or because the formula itself
    reaches a plane. Contacts that the engine missed count where the run was audited; a missed bounce does not
    end the bouncing, which is right then.

    A run that actions interfered with has none, nor has a body that is joined to something, attracted or thrust. Only
    a ball bounces by formula; other shapes have theirs up to the first contact.
    """
    bodies = scene.bodies
    if trajectory.info.get("actions") or trajectory.names.tolist() != list(bodies.names) or bodies.fixed[number]:
        return None
    form = _bouncing(trajectory, scene, bodies, number) or _flying(trajectory, scene, bodies, number)
    return form if form is not None and np.count_nonzero(form.valid) > 1 else None


def _flying(trajectory: Trajectory, scene: Scene, bodies: Bodies, number: int) -> ClosedForm | None:
    if why_not(scene) is not None or driven(scene, bodies)[number]:
        return None
    start = bodies.position[number], bodies.velocity[number]
    position, velocity = free_flight(trajectory.time, *start, scene.world)
    valid = trajectory.time < valid_until(trajectory, number)
    if bodies.elements[bodies.element[number]].collides != "none":
        angle = bodies.angle[number] + trajectory.time * bodies.angular_velocity[number]
        for plane in scene.planes:
            point, normal = np.asarray(plane.point), _unit(plane)
            gap = gap_above(bodies, number, position, angle, point, normal)
            noise = TOUCH + 4.0 * np.finfo(np.float64).eps * float(np.abs((start[0], point)).max())
            valid &= ~np.logical_or.accumulate(gap < -noise)
    return ClosedForm(position, velocity, valid)


class Bouncing(NamedTuple):
    """A ball that bounces straight on the one plane there is, and what its formula needs."""

    start: FloatArray
    """(2,) m"""
    along: FloatArray
    """(2,) m/s along the plane, which nothing changes"""
    normal: FloatArray
    """(2,) of the plane, of length 1"""
    height: float
    """above contact at time 0, m"""
    speed: float
    """away from the plane at time 0, m/s"""
    gravity: float
    """towards the plane, m/s²"""
    restitution: float

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions and velocities, (T, 2) each, at T times."""
        above, rising = bounces(time, self.height, self.speed, self.gravity, self.restitution)
        position = self.start + (above - self.height)[:, None] * self.normal + time[:, None] * self.along
        return position, rising[:, None] * self.normal + self.along


def bouncing(scene: Scene, bodies: Bodies, number: int) -> Bouncing | None:
    """Return the bouncing of a ball, as long as it meets nothing but the plane; None where it is no such case.

    Nothing holds, draws or drives it. The scene has one plane, gravity is square to it or 0, there is no drag, and
    nothing rubs: friction is 0, or the ball neither spins nor moves along the plane.
    """
    world, collides = scene.world, bodies.elements[bodies.element[number]].collides
    if not bodies.round[number] or scene.attractions or driven(scene, bodies)[number]:
        return None
    if len(scene.planes) != 1 or world.linear_drag > 0 or world.quadratic_drag > 0 or collides == "none":
        return None
    normal, pull = _unit(scene.planes[0]), np.asarray(world.gravity)
    start, velocity = bodies.position[number], bodies.velocity[number]
    down = -float(pull @ normal)
    if down < 0.0 or not _parallel(pull, normal):
        return None

    # Planes come first among the fixed things: the only plane is fixed thing 0, in contacts −1.
    surfaces = surfaces_of(scene, bodies)
    sides = surfaces.of_body[number], surfaces.of_fixed[0]
    slides = bodies.angular_velocity[number] != 0 or not _parallel(velocity, normal)
    if slides and surfaces.friction[sides] > 0:
        return None

    gap = float((start - np.asarray(scene.planes[0].point)) @ normal - bodies.radius[number])
    if gap < -TOUCH:
        return None
    speed = float(velocity @ normal)
    restitution = float(surfaces.restitution[sides])
    return Bouncing(start, velocity - speed * normal, normal, max(gap, 0.0), speed, down, restitution)


def _bouncing(trajectory: Trajectory, scene: Scene, bodies: Bodies, number: int) -> ClosedForm | None:
    form = bouncing(scene, bodies, number)
    if form is None:
        return None
    until = min(_first_contact(trajectory, number, besides=-1), _retired(trajectory, number))
    return ClosedForm(*form.at(trajectory.time), valid=trajectory.time < until)


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


def _unit(plane: Plane) -> FloatArray:
    # Scaled first: the square of a very long or short normal would leave the range of doubles.
    normal = np.asarray(plane.normal) / np.abs(plane.normal).max()
    return np.asarray(normal / math.hypot(*normal))


def _parallel(vector: FloatArray, unit: FloatArray) -> bool:
    return bool(abs(vector[0] * unit[1] - vector[1] * unit[0]) <= SQUARE * math.hypot(*vector))
