"""Motion of one body on an inclined plane: rest, sliding with Coulomb friction, or rolling of a ball.

The acceleration along the plane is piecewise constant. With the speed v along it, the angular velocity ω and the slip
velocity u = v + r ω − s at the contact, friction F drives both: v̇ = g_t + F/m, u̇ = g_t + (1 + β) F/m with β = m r²/I, 2
for a disc and 0 for a body that does not rotate; s is the speed of the surfaces, as of a belt. While the body slips, F
is μ N against the slip. Afterwards F maintains u = 0, −m g_t/(1 + β), as long as friction allows it.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.analytic.bouncing import PLANE
from sandbox.measure.analytic.model import (
    PARALLEL_SINE,
    TOUCH_TOLERANCE,
    BodyMotion,
    SceneFacts,
    normal_of,
    perpendicular,
)
from sandbox.measure.metrics.clearance import posed_pieces
from sandbox.trajectory import ContactEvent

EDGE_FRACTION = 1e-9
"""Relative margin: friction this close to the value that prevents slipping is refused, and so is a body this close to
tipping over, relative to its footprint.
"""


class Phase(NamedTuple):
    """Interval of constant acceleration."""

    begin: float
    """s"""
    displacement: float
    """m, displacement along the plane since time 0"""
    speed: float
    """along the plane, m/s"""
    tangential_accel: float
    """m/s², acceleration along the plane"""
    rotation: float
    """rad, rotation since time 0"""
    spin: float
    """rad/s"""
    angular_accel: float
    """rad/s², angular acceleration"""
    friction_accel: float
    """m/s², acceleration by friction along the plane"""
    slips: bool


class Footprint(NamedTuple):
    """Support of a body that does not rotate, relative to its centre of mass."""

    left: float
    """m along the plane"""
    right: float
    """m along the plane"""
    depth: float
    """m below"""


@dataclass(frozen=True, eq=False)
class InclineMotion:
    """Motion of one body on the only plane of a scene."""

    number: int
    start: FloatArray
    """(2,) m"""
    point: FloatArray
    """(2,) m, middle of the contact at time 0"""
    along: FloatArray
    """(2,) of length 1, along the plane"""
    normal: FloatArray
    """(2,) of length 1, out of it"""
    normal_accel: float
    """m/s², gravity into the plane"""
    mass: float
    """kg"""
    angle: float
    """at time 0, rad"""
    phases: tuple[Phase, ...]
    surface_speed: float = 0.0
    """m/s, speed of both surfaces along the plane"""

    @property
    def name(self) -> str:
        """Name of the motion."""
        if self.surface_speed:
            return "motion on a belt"
        last = self.phases[-1]
        if len(self.phases) == 1 and not last.slips and last.speed == last.tangential_accel == 0.0:
            return "rest on a plane"
        rolls = any(phase.spin or phase.angular_accel for phase in self.phases)
        return "rolling on a plane" if rolls else "sliding on a plane"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return its motion at T times."""
        which = np.searchsorted([phase.begin for phase in self.phases], time, side="right") - 1
        begin, displacement, speed, tangential_accel, rotation, spin, angular_accel, _, _ = np.asarray(
            self.phases, dtype=np.float64
        )[which].T
        t = time - begin
        displacement, speed = displacement + t * (speed + 0.5 * tangential_accel * t), speed + tangential_accel * t
        angle, spin = self.angle + rotation + t * (spin + 0.5 * angular_accel * t), spin + angular_accel * t
        return BodyMotion(self.start + displacement[:, None] * self.along, speed[:, None] * self.along, angle, spin)

    def contacts(self, until: float, _shortest: float) -> list[ContactEvent]:
        """Return the single contact, which lasts."""
        friction_speed = 0.0
        for phase, end in zip(self.phases, (*(p.begin for p in self.phases[1:]), until), strict=True):
            friction_speed += phase.friction_accel * max(min(end, until) - phase.begin, 0.0)
        facts = -self.mass * (self.normal_accel * until * self.normal + friction_speed * self.along)
        return [
            ContactEvent(
                0.0,
                (self.number, PLANE),
                (float(self.point[0]), float(self.point[1])),
                (-float(self.normal[0]), -float(self.normal[1])),
                (float(facts[0]), float(facts[1])),
            )
        ]


def incline_motion(facts: SceneFacts, number: int) -> InclineMotion | None:
    """Return the motion of a body on the only static object, a plane; None if it does not apply.

    Gravity presses the body into the plane. No joint, attraction, thrust or drive acts on it, and there is no drag. It
    starts in contact, with a velocity along the plane. A ball may spin. Any other body lies flat, does not rotate, and
    does not tip over by friction.
    """
    bodies, plane = facts.bodies, facts.only_plane()
    if plane is None or not facts.matrix.touches[number] or facts.matrix.held[number] or facts.thrust[number]:
        return None
    if bodies.fixed[number] or facts.scene.attractions or not facts.has_no_air:
        return None
    normal = normal_of(plane)
    along, point = perpendicular(normal), np.asarray(plane.point)
    start, velocity = bodies.position[number], bodies.velocity[number]
    tangential_accel, normal_accel = float(facts.gravity @ along), -float(facts.gravity @ normal)
    speed, spin = float(velocity @ along), float(bodies.angular_velocity[number])
    if normal_accel <= 0.0 or abs(float(velocity @ normal)) > PARALLEL_SINE * math.hypot(*velocity):
        return None
    if abs(tangential_accel) <= PARALLEL_SINE * normal_accel:
        tangential_accel = 0.0
    pair = _surface_pair(facts, number)
    if pair is None:
        return None
    friction = float(facts.matrix.surfaces.friction[pair])
    surfaces = facts.matrix.surfaces
    slip = float(surfaces.slip_velocity[pair] @ along) + float(surfaces.slip_target[pair])
    surface_speed = -slip if friction > 0.0 else 0.0
    height = float((start - point) @ normal)
    if bodies.round[number]:
        radius, foot = float(bodies.radius[number]), None
        if abs(height - radius) > TOUCH_TOLERANCE:
            return None
        inertia = float(bodies.mass[number]) * radius / float(bodies.moment[number])
    else:
        radius, inertia, foot = 0.0, 0.0, _footprint(facts, number, point, normal)
        if foot is None or spin != 0.0:
            return None
    phases = phases_of(tangential_accel, normal_accel, friction, speed, spin, radius, inertia, surface_speed)
    if phases is None or (
        foot is not None and not all(_is_stable(foot, phase.friction_accel / normal_accel) for phase in phases)
    ):
        return None
    middle = start - height * normal + (0.0 if foot is None else 0.5 * (foot.left + foot.right)) * along
    mass, angle = float(bodies.mass[number]), float(bodies.angle[number])
    return InclineMotion(number, start, middle, along, normal, normal_accel, mass, angle, phases, surface_speed)


def phases_of(
    tangential_accel: float,
    normal_accel: float,
    friction: float,
    speed: float,
    spin: float,
    radius: float,
    inertia: float,
    surface_speed: float = 0.0,
) -> tuple[Phase, ...] | None:
    """Return the phases of the motion along a plane; None if friction is at the limit of slipping.

    Args:
        tangential_accel: gravity along the plane, m/s².
        normal_accel: gravity into the plane, m/s².
        friction: coefficient of friction μ.
        speed: speed along the plane, m/s.
        spin: angular velocity, rad/s.
        radius: radius of a ball, m; 0 for a body that does not rotate.
        inertia: m r/I of a ball, 1/m; 0 for a body that does not rotate.
        surface_speed: speed of the surfaces along the plane, m/s.
    """
    inertia_factor, max_friction = 1.0 + inertia * radius, friction * normal_accel
    time = displacement = rotation = 0.0
    slip = speed + radius * spin - surface_speed
    if abs(slip) <= PARALLEL_SINE * (abs(speed) + abs(radius * spin) + abs(surface_speed)):
        slip = 0.0
    phases: list[Phase] = []
    while True:
        required = abs(tangential_accel) / inertia_factor
        if slip == 0.0 and required != 0.0 and abs(required - max_friction) <= EDGE_FRACTION * required:
            return None
        slips = slip != 0.0 or required > max_friction
        friction_accel = (
            -math.copysign(max_friction, slip if slip != 0.0 else tangential_accel)
            if slips
            else -tangential_accel / inertia_factor
        )
        a, angular_accel = tangential_accel + friction_accel, inertia * friction_accel
        phases.append(Phase(time, displacement, speed, a, rotation, spin, angular_accel, friction_accel, slips))
        change = tangential_accel + friction_accel * inertia_factor
        if slip == 0.0 or slip * change >= 0.0:
            return tuple(phases)
        t = -slip / change
        time += t
        displacement, rotation = (
            displacement + t * (speed + 0.5 * a * t),
            rotation + t * (spin + 0.5 * angular_accel * t),
        )
        # Exactly no slip: a ball then rolls, any other body has the speed of the surface.
        speed = speed + a * t if radius > 0.0 else surface_speed
        spin = (surface_speed - speed) / radius if radius > 0.0 else 0.0
        slip = 0.0


def _surface_pair(facts: SceneFacts, number: int) -> tuple[int, int] | None:
    """Return the surfaces of a body and the plane; None if the pieces of the body have different ones."""
    surfaces = facts.matrix.surfaces
    surface = surfaces.of_body[number]
    if not facts.bodies.round[number]:
        begin, end = np.searchsorted(facts.bodies.shapes.body, (number, number + 1)).tolist()
        if (surfaces.of_shape[begin:end] != surface).any():
            return None
    return int(surface), int(surfaces.of_fixed[0])


def _footprint(facts: SceneFacts, number: int, point: FloatArray, normal: FloatArray) -> Footprint | None:
    """Return the footprint of a body; None if it does not touch the plane or overlaps it."""
    bodies = facts.bodies
    centre = bodies.position[number]
    height_parts, offset_parts = [], []
    for corners, radius in posed_pieces(bodies, number, centre[None], bodies.angle[[number]]):
        height_parts.append((corners[0] - point) @ normal - radius)
        offset_parts.append((corners[0] - centre) @ perpendicular(normal))
    height, offset = np.concatenate(height_parts), np.concatenate(offset_parts)
    if abs(height.min()) > TOUCH_TOLERANCE:
        return None
    touching = offset[height <= height.min() + TOUCH_TOLERANCE]
    return Footprint(float(touching.min()), float(touching.max()), float((centre - point) @ normal))


def _is_stable(foot: Footprint, slope: float) -> bool:
    """Return whether the resultant of pressure and friction through the centre of mass passes inside the footprint."""
    through, spare = -foot.depth * slope, EDGE_FRACTION * (foot.right - foot.left)
    return foot.left + spare < through < foot.right - spare
