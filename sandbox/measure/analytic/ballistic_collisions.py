"""Ballistic collisions of balls without friction: two balls, or a few in one line.

All balls fall alike under uniform gravity, so that relative motion is straight and the time of an impact is the root of
a quadratic equation. Each ball takes (1 + e) times the closing speed, by the mass fraction of the other.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.analytic.model import (
    PARALLEL_SINE,
    TOUCH_TOLERANCE,
    BodyMotion,
    SceneFacts,
    cross,
    direction,
    parallel,
)
from sandbox.trajectory import ContactEvent

MAX_BALLS = 16
MAX_IMPACTS = 1000
"""More impacts are an inelastic collapse: balls that come to rest between others bounce without end."""
SIMULTANEOUS = 1e-9
"""s: impacts of one ball with two others within this time are one impact of three balls, which has no unique outcome;
equal elastic balls in line pass it on in any order.
"""


class BallisticSegment(NamedTuple):
    """Straight flight of all N balls, in the falling frame."""

    begin: float
    """s"""
    position: FloatArray
    """(N, 2) m"""
    velocity: FloatArray
    """(N, 2) m/s"""


class PairImpact(NamedTuple):
    """Impact of two balls."""

    time: float
    """s"""
    pair: tuple[int, int]
    normal: FloatArray
    """(2,) from the first to the second"""
    closing: float
    """m/s"""


@dataclass(frozen=True, eq=False)
class BallisticCollisions:
    """Motion of all balls of a scene."""

    facts: SceneFacts
    legs: tuple[BallisticSegment, ...]
    impacts: tuple[ContactEvent, ...]
    """impacts in the falling frame"""
    name: str = "balls that meet"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return the motion of all N bodies at T times."""
        which = np.searchsorted([leg.begin for leg in self.legs], time, side="right") - 1
        begin = np.asarray([leg.begin for leg in self.legs])[which]
        position = np.stack([leg.position for leg in self.legs])[which]
        velocity = np.stack([leg.velocity for leg in self.legs])[which]
        pull, bodies = self.facts.gravity, self.facts.bodies
        fallen = 0.5 * time[:, None] ** 2 * pull
        position = position + velocity * (time - begin)[:, None, None] + fallen[:, None]
        velocity = velocity + (time[:, None] * pull)[:, None]
        spin = np.broadcast_to(bodies.angular_velocity, (len(time), len(bodies)))
        return BodyMotion(position, velocity, bodies.angle + time[:, None] * spin, spin)

    def contacts(self, until: float) -> list[ContactEvent]:
        """Return the impacts up to a time."""
        x, y = self.facts.gravity.tolist()
        found = []
        for each in self.impacts:
            if each.time <= until:
                half = 0.5 * each.time**2
                found.append(each._replace(point=(each.point[0] + half * x, each.point[1] + half * y)))
        return found


def ballistic_collisions(facts: SceneFacts) -> BallisticCollisions | None:
    """Return the motion of balls that collide only with each other: two balls, or a few that move in one line.

    There are no drag, static objects, joints, attraction, thrusts or drives. Contacts are without friction: its
    coefficient is 0, or the balls collide head on without spin. Three balls do not collide at once, except for equal
    elastic ones in line.
    """
    scene, bodies = facts.scene, facts.bodies
    if not 2 <= len(bodies) <= MAX_BALLS or not bodies.round.all() or bodies.fixed.any() or scene.fixed:
        return None
    if len(facts.links) or scene.attractions or scene.thrusts or scene.drives:
        return None
    if not facts.has_no_drag or scene.world.bounds is not None:
        return None
    if np.isfinite(bodies.lifetime).any() or any(element.collides != "all" for element in bodies.elements):
        return None
    if len(bodies) > 2 and not _in_line(bodies.position, bodies.velocity):
        return None
    return _follow(facts)


def _in_line(position: FloatArray, velocity: FloatArray) -> bool:
    """Return whether all positions and velocities are in one line."""
    away = position - position[0]
    far = away[int(np.hypot(*away.T).argmax())]
    if not far.any():
        return False
    line, size = direction(far), float(np.abs(position).max())
    straight = all(abs(cross(each, line)) <= PARALLEL_SINE * size for each in away)
    return straight and all(parallel(each, line) for each in velocity)


def _follow(facts: SceneFacts) -> BallisticCollisions | None:
    """Return the motion from impact to impact to the end; None if an impact has no unique outcome."""
    bodies, duration = facts.bodies, facts.world.duration
    surfaces = facts.meet.surfaces
    numbers = surfaces.of_body
    restitution, friction = (each[np.ix_(numbers, numbers)] for each in (surfaces.restitution, surfaces.friction))
    mass, reach = bodies.mass, bodies.radius[:, None] + bodies.radius
    apart = np.triu(np.ones((len(bodies), len(bodies)), np.bool_), 1)
    if not surfaces.fixed_coefficients[np.ix_(numbers, numbers)][apart].all():
        return None  # restitution falls with speed
    passes_on = bool((mass == mass[0]).all() and (restitution[apart] == 1.0).all())

    away = np.hypot(*np.moveaxis(bodies.position[:, None] - bodies.position, 2, 0))
    if (away < reach - TOUCH_TOLERANCE)[apart].any():
        return None
    leg = BallisticSegment(0.0, bodies.position, bodies.velocity)
    legs: list[BallisticSegment] = [leg]
    rows: list[ContactEvent] = []
    while True:
        found = _next_impact(leg, reach, apart)
        if found is None or found.time > duration:
            return BallisticCollisions(facts, tuple(legs), tuple(rows))
        if len(rows) == MAX_IMPACTS:
            return None
        together = [row for row in rows if found.time - row.time <= SIMULTANEOUS and {*row.pair} & {*found.pair}]
        if together and not passes_on:
            return None
        i, j = found.pair
        if friction[i, j] > 0.0 and _slips(leg, bodies.angular_velocity, found):
            return None
        leg, row = _apply_impact(leg, found, mass, float(restitution[i, j]), bodies.radius)
        legs.append(leg)
        rows.append(row)


def _next_impact(leg: BallisticSegment, reach: FloatArray, apart: BoolArray) -> PairImpact | None:
    """Return the first impact of a segment. Its root D = A R² − cross² is free of the cancellation of B² − A C."""
    offset = leg.position[None] - leg.position[:, None]
    moving = leg.velocity[None] - leg.velocity[:, None]
    a, b = (moving**2).sum(axis=2), (offset * moving).sum(axis=2)
    sideways = offset[..., 0] * moving[..., 1] - offset[..., 1] * moving[..., 0]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    c = (distance - reach) * (distance + reach)
    d = a * reach**2 - sideways**2
    speed = float(np.abs(leg.velocity).max())
    meets = apart & (b < -PARALLEL_SINE * speed * distance) & (d > 0.0)
    if not meets.any():
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        wait = np.where(meets, np.maximum(c, 0.0) / (np.sqrt(np.maximum(d, 0.0)) - b), np.inf)
    i, j = (int(k) for k in np.unravel_index(int(wait.argmin()), wait.shape))
    normal = direction(offset[i, j] + wait[i, j] * moving[i, j])
    return PairImpact(leg.begin + float(wait[i, j]), (i, j), normal, -float(moving[i, j] @ normal))


def _slips(leg: BallisticSegment, spin: FloatArray, impact: PairImpact) -> bool:
    """Return whether two colliding balls slip: they spin, or do not collide head on."""
    i, j = impact.pair
    relative = leg.velocity[j] - leg.velocity[i]
    return bool(spin[i] or spin[j] or not parallel(relative, impact.normal))


def _apply_impact(
    leg: BallisticSegment, impact: PairImpact, mass: FloatArray, restitution: float, radius: FloatArray
) -> tuple[BallisticSegment, ContactEvent]:
    """Return the segment after an impact, and the impact as a contact."""
    (i, j), normal = impact.pair, impact.normal
    position = leg.position + leg.velocity * (impact.time - leg.begin)
    velocity = leg.velocity.copy()
    gained = (1.0 + restitution) * impact.closing
    total = mass[i] + mass[j]
    velocity[i] -= mass[j] / total * gained * normal
    velocity[j] += mass[i] / total * gained * normal
    x, y = (position[i] + radius[i] * normal).tolist()
    push = (mass[i] / total) * mass[j] * gained * normal
    row = ContactEvent(
        impact.time,
        impact.pair,
        (x, y),
        (float(normal[0]), float(normal[1])),
        (float(push[0]), float(push[1])),
    )
    return BallisticSegment(impact.time, position, velocity), row
