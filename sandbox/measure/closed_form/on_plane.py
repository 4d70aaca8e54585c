"""On a plane: a body that lies on it and rests, slides with Coulomb friction, or, being a ball, slips and rolls.

Along the plane everything is piecewise uniformly accelerated. With v the speed along it, ω the spin and u = v + r ω the
slip where they touch, friction F drives both: v̇ = g_t + F/m, u̇ = g_t + (1 + β) F/m with β = m r²/I, 2 for a disc and
nothing for what does not turn. While it slips, F is μ N against the slip; once that is over, F is whatever keeps it so,
−m g_t/(1 + β), as long as friction can give that.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.closed_form.bouncing import PLANE
from sandbox.measure.closed_form.form import Motion
from sandbox.measure.closed_form.given import SQUARE, TOUCH, Given, across, normal_of
from sandbox.measure.lying import pieces_over_time
from sandbox.trajectory import ContactEvent

EDGE = 1e-9
"""Friction this close, as a share, to what is needed to stick may or may not hold: refused. So is a body that stands
this close, as a share of its foot, to tipping over."""


class Phase(NamedTuple):
    """A time of constant acceleration, until the next."""

    begin: float
    """s"""
    way: float
    """along the plane since time 0, m"""
    speed: float
    """along the plane, m/s"""
    pull: float
    """along the plane, m/s²"""
    turned: float
    """since time 0, rad"""
    spin: float
    """rad/s"""
    turning: float
    """rad/s²"""
    rub: float
    """friction along the plane, N/kg"""
    slips: bool


class Foot(NamedTuple):
    """Where a body that does not turn stands, as seen from its centre of mass."""

    left: float
    """m along the plane"""
    right: float
    """m along the plane"""
    depth: float
    """m below"""


@dataclass(frozen=True, eq=False)
class OnPlane:
    """One body on the only plane there is."""

    number: int
    start: FloatArray
    """(2,) m"""
    point: FloatArray
    """(2,) m, the middle of where it touches at time 0"""
    along: FloatArray
    """(2,) of length 1, along the plane"""
    normal: FloatArray
    """(2,) of length 1, out of it"""
    press: float
    """gravity into the plane, m/s²"""
    mass: float
    """kg"""
    angle: float
    """at time 0, rad"""
    phases: tuple[Phase, ...]

    @property
    def name(self) -> str:
        """What it does, in a word or two."""
        last = self.phases[-1]
        if len(self.phases) == 1 and not last.slips and last.speed == last.pull == 0.0:
            return "rest on a plane"
        rolls = any(phase.spin or phase.turning for phase in self.phases)
        return "rolling on a plane" if rolls else "sliding on a plane"

    def at(self, time: FloatArray) -> Motion:
        """Return its motion at T times."""
        which = np.searchsorted([phase.begin for phase in self.phases], time, side="right") - 1
        begin, way, speed, pull, turned, spin, turning, _, _ = np.asarray(self.phases, dtype=np.float64)[which].T
        t = time - begin
        way, speed = way + t * (speed + 0.5 * pull * t), speed + pull * t
        angle, spin = self.angle + turned + t * (spin + 0.5 * turning * t), spin + turning * t
        return Motion(self.start + way[:, None] * self.along, speed[:, None] * self.along, angle, spin)

    def contacts(self, until: float, _shortest: float) -> list[ContactEvent]:
        """Return the one contact, which lasts."""
        rubbed = 0.0
        for phase, end in zip(self.phases, (*(p.begin for p in self.phases[1:]), until), strict=True):
            rubbed += phase.rub * max(min(end, until) - phase.begin, 0.0)
        given = -self.mass * (self.press * until * self.normal + rubbed * self.along)
        return [
            ContactEvent(
                0.0,
                (self.number, PLANE),
                (float(self.point[0]), float(self.point[1])),
                (-float(self.normal[0]), -float(self.normal[1])),
                (float(given[0]), float(given[1])),
            )
        ]


def on_plane(given: Given, number: int) -> OnPlane | None:
    """Return what a body does that lies on the one fixed thing there is, a plane into which gravity presses it.

    Nothing holds, draws or drives it, and there is no drag. It starts in touch, moving along the plane or not at all.
    A ball may spin. Any other body lies flat, does not turn, and stays clear of tipping over by what rubs it.
    """
    bodies, plane = given.bodies, given.only_plane()
    if plane is None or not given.meet.touches[number] or given.meet.held[number] or given.thrust[number]:
        return None
    if bodies.fixed[number] or given.scene.attractions or not given.airless:
        return None
    normal = normal_of(plane)
    along, point = across(normal), np.asarray(plane.point)
    start, velocity = bodies.position[number], bodies.velocity[number]
    pull, press = float(given.gravity @ along), -float(given.gravity @ normal)
    speed, spin = float(velocity @ along), float(bodies.angular_velocity[number])
    if press <= 0.0 or abs(float(velocity @ normal)) > SQUARE * math.hypot(*velocity):
        return None
    if abs(pull) <= SQUARE * press:
        pull = 0.0
    friction = _friction(given, number)
    if friction is None:
        return None
    height = float((start - point) @ normal)
    if bodies.round[number]:
        radius, foot = float(bodies.radius[number]), None
        if abs(height - radius) > TOUCH:
            return None
        inertia = float(bodies.mass[number]) * radius / float(bodies.moment[number])
    else:
        radius, inertia, foot = 0.0, 0.0, _foot(given, number, point, normal)
        if foot is None or spin != 0.0:
            return None
    phases = phases_of(pull, press, friction, speed, spin, radius, inertia)
    if phases is None or (foot is not None and not all(_stands(foot, phase.rub / press) for phase in phases)):
        return None
    middle = start - height * normal + (0.0 if foot is None else 0.5 * (foot.left + foot.right)) * along
    mass, angle = float(bodies.mass[number]), float(bodies.angle[number])
    return OnPlane(number, start, middle, along, normal, press, mass, angle, phases)


def phases_of(
    pull: float, press: float, friction: float, speed: float, spin: float, radius: float, inertia: float
) -> tuple[Phase, ...] | None:
    """Return the phases of a motion along a plane; None where friction is on the edge of what is needed to stick.

    Args:
        pull: gravity along the plane, m/s².
        press: gravity into it, m/s².
        friction: μ.
        speed: along it, m/s.
        spin: rad/s.
        radius: of a ball; 0 of what does not turn, m.
        inertia: m r/I of a ball; 0 of what does not turn, 1/m.
    """
    both, most = 1.0 + inertia * radius, friction * press
    time = way = turned = 0.0
    slip = speed + radius * spin
    if abs(slip) <= SQUARE * (abs(speed) + abs(radius * spin)):
        slip = 0.0
    phases: list[Phase] = []
    while True:
        need = abs(pull) / both
        if slip == 0.0 and need != 0.0 and abs(need - most) <= EDGE * need:
            return None
        slips = slip != 0.0 or need > most
        rub = -math.copysign(most, slip if slip != 0.0 else pull) if slips else -pull / both
        a, turning = pull + rub, inertia * rub
        phases.append(Phase(time, way, speed, a, turned, spin, turning, rub, slips))
        change = pull + rub * both
        if slip == 0.0 or slip * change >= 0.0:
            return tuple(phases)
        t = -slip / change
        time += t
        way, turned = way + t * (speed + 0.5 * a * t), turned + t * (spin + 0.5 * turning * t)
        # Exactly no slip: a ball then rolls, anything else stands.
        speed, spin = (speed + a * t, -(speed + a * t) / radius) if radius > 0.0 else (0.0, 0.0)
        slip = 0.0


def _friction(given: Given, number: int) -> float | None:
    """Return μ between a body and the plane; None where its pieces differ."""
    surfaces = given.meet.surfaces
    own = surfaces.of_body[number]
    if not given.bodies.round[number]:
        begin, end = np.searchsorted(given.bodies.shapes.body, (number, number + 1)).tolist()
        if (surfaces.of_shape[begin:end] != own).any():
            return None
    return float(surfaces.friction[own, surfaces.of_fixed[0]])


def _foot(given: Given, number: int, point: FloatArray, normal: FloatArray) -> Foot | None:
    """Return what a body stands on; None where it does not touch the plane or sinks into it."""
    bodies = given.bodies
    centre = bodies.position[number]
    heights, places = [], []
    for corners, radius in pieces_over_time(bodies, number, centre[None], bodies.angle[[number]]):
        heights.append((corners[0] - point) @ normal - radius)
        places.append((corners[0] - centre) @ across(normal))
    height, place = np.concatenate(heights), np.concatenate(places)
    if abs(height.min()) > TOUCH:
        return None
    touching = place[height <= height.min() + TOUCH]
    return Foot(float(touching.min()), float(touching.max()), float((centre - point) @ normal))


def _stands(foot: Foot, slope: float) -> bool:
    """Tell whether the force through the centre of mass that friction over pressure tilts passes inside the foot."""
    through, spare = -foot.depth * slope, EDGE * (foot.right - foot.left)
    return foot.left + spare < through < foot.right - spare
