"""Ballistic collisions of balls without friction: two balls, or a few in one line.

All balls have the same acceleration under uniform gravity, so that relative motion is straight and the time of an
impact is the root of a quadratic equation. An impact changes the velocity of each ball by (1 + e) times the
closing speed, times the mass fraction of the other ball.
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
equal elastic balls in line are an exception: the order of the impacts does not matter.
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
    segments: tuple[BallisticSegment, ...]
    impacts: tuple[ContactEvent, ...]
    """impacts in the falling frame"""
    name: str = "colliding balls"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return the motion of all N bodies at T times."""
        which = np.searchsorted([segment.begin for segment in self.segments], time, side="right") - 1
        begin = np.asarray([segment.begin for segment in self.segments])[which]
        position = np.stack([segment.position for segment in self.segments])[which]
        velocity = np.stack([segment.velocity for segment in self.segments])[which]
        acceleration, bodies = self.facts.gravity, self.facts.bodies
        fall = 0.5 * time[:, None] ** 2 * acceleration
        position = position + velocity * (time - begin)[:, None, None] + fall[:, None]
        velocity = velocity + (time[:, None] * acceleration)[:, None]
        spin = np.broadcast_to(bodies.angular_velocity, (len(time), len(bodies)))
        return BodyMotion(position, velocity, bodies.angle + time[:, None] * spin, spin)

    def contacts(self, until: float) -> list[ContactEvent]:
        """Return the impacts up to a time."""
        x, y = self.facts.gravity.tolist()
        events = []
        for event in self.impacts:
            if event.time <= until:
                half_square = 0.5 * event.time**2
                events.append(
                    event._replace(point=(event.point[0] + half_square * x, event.point[1] + half_square * y))
                )
        return events


def ballistic_collisions(facts: SceneFacts) -> BallisticCollisions | None:
    """Return the motion of balls that collide only with each other: two balls, or a few that move in one line.

    There are no drag, static objects, joints, attraction, thrusts, tyres or drives. Contacts are without friction: its
    coefficient is 0, or the balls collide head on without spin. Three balls do not collide at once, except for equal
    elastic ones in line.
    """
    scene, bodies = facts.scene, facts.bodies
    if not 2 <= len(bodies) <= MAX_BALLS or not bodies.round.all() or bodies.fixed.any() or scene.fixed:
        return None
    has_forces = scene.attractions or scene.thrusts or scene.tyres or scene.drives
    if len(facts.joints) or has_forces or facts.matrix.moving_surfaces:
        return None
    if not facts.has_no_air or scene.world.bounds is not None:
        return None
    if np.isfinite(bodies.lifetime).any() or any(element.collides != "all" for element in bodies.elements):
        return None
    if len(bodies) > 2 and not _in_line(bodies.position, bodies.velocity):
        return None
    return _follow(facts)


def _in_line(position: FloatArray, velocity: FloatArray) -> bool:
    """Return whether all positions and velocities are in one line."""
    away = position - position[0]
    farthest = away[int(np.hypot(*away.T).argmax())]
    if not farthest.any():
        return False
    line, size = direction(farthest), float(np.abs(position).max())
    straight = all(abs(cross(each, line)) <= PARALLEL_SINE * size for each in away)
    return straight and all(parallel(each, line) for each in velocity)


def _follow(facts: SceneFacts) -> BallisticCollisions | None:
    """Return the motion from impact to impact to the end; None if an impact has no unique outcome."""
    bodies, duration = facts.bodies, facts.world.duration
    surfaces = facts.matrix.surfaces
    surface_of = surfaces.of_body
    restitution, friction = (
        table[np.ix_(surface_of, surface_of)] for table in (surfaces.restitution, surfaces.friction)
    )
    mass, reach = bodies.mass, bodies.radius[:, None] + bodies.radius
    apart = np.triu(np.ones((len(bodies), len(bodies)), np.bool_), 1)
    if not surfaces.fixed_coefficients[np.ix_(surface_of, surface_of)][apart].all():
        return None  # restitution falls with speed
    is_elastic_chain = bool((mass == mass[0]).all() and (restitution[apart] == 1.0).all())

    distance = np.hypot(*np.moveaxis(bodies.position[:, None] - bodies.position, 2, 0))
    if (distance < reach - TOUCH_TOLERANCE)[apart].any():
        return None
    segment = BallisticSegment(0.0, bodies.position, bodies.velocity)
    segments: list[BallisticSegment] = [segment]
    rows: list[ContactEvent] = []
    while True:
        impact = _next_impact(segment, reach, apart)
        if impact is None or impact.time > duration:
            return BallisticCollisions(facts, tuple(segments), tuple(rows))
        if len(rows) == MAX_IMPACTS:
            return None
        simultaneous = [row for row in rows if impact.time - row.time <= SIMULTANEOUS and {*row.pair} & {*impact.pair}]
        if simultaneous and not is_elastic_chain:
            return None
        i, j = impact.pair
        if friction[i, j] > 0.0 and _slips(segment, bodies.angular_velocity, impact):
            return None
        segment, row = _apply_impact(segment, impact, mass, float(restitution[i, j]), bodies.radius)
        segments.append(segment)
        rows.append(row)


def _next_impact(segment: BallisticSegment, reach: FloatArray, apart: BoolArray) -> PairImpact | None:
    """Return the first impact of a segment. Its root D = A R² − cross² is free of the cancellation of B² − A C."""
    offset = segment.position[None] - segment.position[:, None]
    moving = segment.velocity[None] - segment.velocity[:, None]
    a, b = (moving**2).sum(axis=2), (offset * moving).sum(axis=2)
    sideways = offset[..., 0] * moving[..., 1] - offset[..., 1] * moving[..., 0]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    c = (distance - reach) * (distance + reach)
    d = a * reach**2 - sideways**2
    speed = float(np.abs(segment.velocity).max())
    collides = apart & (b < -PARALLEL_SINE * speed * distance) & (d > 0.0)
    if not collides.any():
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        delay = np.where(collides, np.maximum(c, 0.0) / (np.sqrt(np.maximum(d, 0.0)) - b), np.inf)
    i, j = (int(k) for k in np.unravel_index(int(delay.argmin()), delay.shape))
    normal = direction(offset[i, j] + delay[i, j] * moving[i, j])
    return PairImpact(segment.begin + float(delay[i, j]), (i, j), normal, -float(moving[i, j] @ normal))


def _slips(segment: BallisticSegment, spin: FloatArray, impact: PairImpact) -> bool:
    """Return whether two colliding balls slip: they spin, or do not collide head on."""
    i, j = impact.pair
    relative = segment.velocity[j] - segment.velocity[i]
    return bool(spin[i] or spin[j] or not parallel(relative, impact.normal))


def _apply_impact(
    segment: BallisticSegment, impact: PairImpact, mass: FloatArray, restitution: float, radius: FloatArray
) -> tuple[BallisticSegment, ContactEvent]:
    """Return the segment after an impact, and the impact as a contact."""
    (i, j), normal = impact.pair, impact.normal
    position = segment.position + segment.velocity * (impact.time - segment.begin)
    velocity = segment.velocity.copy()
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
