"""Impacts: balls that fly straight, meet without rubbing, and fly on; two of them, or any few in one line.

Under one uniform gravity all fall alike, so that relative motion is straight: the time of an impact is the root of a
quadratic. What each takes from it is (1 + e) times the closing speed, by the share of the other's mass.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.closed_form.form import Motion
from sandbox.measure.closed_form.given import SQUARE, TOUCH, Given, cross, direction, parallel
from sandbox.trajectory import ContactEvent

MOST_BALLS = 16
MOST_IMPACTS = 1000
"""More are a collapse: balls that lose energy and come to rest between others bounce without end."""
AT_ONCE = 1e-9
"""s: impacts of one ball with two others no farther apart are one impact of three, which has no law; equal elastic
balls in line pass it on in whatever order."""


class Leg(NamedTuple):
    """A straight flight of all N balls, in the frame that falls with them."""

    begin: float
    """s"""
    position: FloatArray
    """(N, 2) m"""
    velocity: FloatArray
    """(N, 2) m/s"""


class Impact(NamedTuple):
    """When and how two balls meet."""

    time: float
    """s"""
    pair: tuple[int, int]
    normal: FloatArray
    """(2,) from the first to the second"""
    closing: float
    """m/s"""


@dataclass(frozen=True, eq=False)
class Impacts:
    """All balls of a scene."""

    given: Given
    legs: tuple[Leg, ...]
    impacts: tuple[ContactEvent, ...]
    """in the frame that falls"""
    name: str = "balls that meet"

    def at(self, time: FloatArray) -> Motion:
        """Return the motion of all N bodies at T times."""
        which = np.searchsorted([leg.begin for leg in self.legs], time, side="right") - 1
        begin = np.asarray([leg.begin for leg in self.legs])[which]
        position = np.stack([leg.position for leg in self.legs])[which]
        velocity = np.stack([leg.velocity for leg in self.legs])[which]
        pull, bodies = self.given.gravity, self.given.bodies
        fallen = 0.5 * time[:, None] ** 2 * pull
        position = position + velocity * (time - begin)[:, None, None] + fallen[:, None]
        velocity = velocity + (time[:, None] * pull)[:, None]
        spin = np.broadcast_to(bodies.angular_velocity, (len(time), len(bodies)))
        return Motion(position, velocity, bodies.angle + time[:, None] * spin, spin)

    def contacts(self, until: float) -> list[ContactEvent]:
        """Return the impacts up to a time."""
        x, y = self.given.gravity.tolist()
        found = []
        for each in self.impacts:
            if each.time <= until:
                half = 0.5 * each.time**2
                found.append(each._replace(point=(each.point[0] + half * x, each.point[1] + half * y)))
        return found


def impacts(given: Given) -> Impacts | None:
    """Return what balls do that nothing but each other touches; two, or a few whose motion is all in one line.

    There is no drag, nothing fixed, and nothing that holds, draws or drives. None rubs another: friction is 0, or they
    meet head on and do not spin. Nor do three meet at once, but for equal elastic ones in line.
    """
    scene, bodies = given.scene, given.bodies
    if not 2 <= len(bodies) <= MOST_BALLS or not bodies.round.all() or bodies.fixed.any() or scene.fixed:
        return None
    if len(given.links) or scene.attractions or scene.thrusts or scene.drives:
        return None
    if not given.airless or scene.world.bounds is not None:
        return None
    if np.isfinite(bodies.lifetime).any() or any(element.collides != "all" for element in bodies.elements):
        return None
    if len(bodies) > 2 and not _in_line(bodies.position, bodies.velocity):
        return None
    return _followed(given)


def _in_line(position: FloatArray, velocity: FloatArray) -> bool:
    """Tell whether all is in one line."""
    away = position - position[0]
    far = away[int(np.hypot(*away.T).argmax())]
    if not far.any():
        return False
    line, size = direction(far), float(np.abs(position).max())
    straight = all(abs(cross(each, line)) <= SQUARE * size for each in away)
    return straight and all(parallel(each, line) for each in velocity)


def _followed(given: Given) -> Impacts | None:
    """Follow the balls from impact to impact to the end; None where one of them has no certain outcome."""
    bodies, duration = given.bodies, given.world.duration
    surfaces = given.meet.surfaces
    numbers = surfaces.of_body
    restitution, friction = (each[np.ix_(numbers, numbers)] for each in (surfaces.restitution, surfaces.friction))
    mass, reach = bodies.mass, bodies.radius[:, None] + bodies.radius
    apart = np.triu(np.ones((len(bodies), len(bodies)), np.bool_), 1)
    if not surfaces.fixed_coefficients[np.ix_(numbers, numbers)][apart].all():
        return None  # restitution falls with speed
    passes_on = bool((mass == mass[0]).all() and (restitution[apart] == 1.0).all())

    away = np.hypot(*np.moveaxis(bodies.position[:, None] - bodies.position, 2, 0))
    if (away < reach - TOUCH)[apart].any():
        return None
    leg = Leg(0.0, bodies.position, bodies.velocity)
    legs: list[Leg] = [leg]
    rows: list[ContactEvent] = []
    while True:
        found = _next(leg, reach, apart)
        if found is None or found.time > duration:
            return Impacts(given, tuple(legs), tuple(rows))
        if len(rows) == MOST_IMPACTS:
            return None
        together = [row for row in rows if found.time - row.time <= AT_ONCE and {*row.pair} & {*found.pair}]
        if together and not passes_on:
            return None
        i, j = found.pair
        if friction[i, j] > 0.0 and _slips(leg, bodies.angular_velocity, found):
            return None
        leg, row = _parted(leg, found, mass, float(restitution[i, j]), bodies.radius)
        legs.append(leg)
        rows.append(row)


def _next(leg: Leg, reach: FloatArray, apart: BoolArray) -> Impact | None:
    """Return the first impact of a leg. Source of the root without cancellation: D = A R² − cross², not B² − A C."""
    offset = leg.position[None] - leg.position[:, None]
    moving = leg.velocity[None] - leg.velocity[:, None]
    a, b = (moving**2).sum(axis=2), (offset * moving).sum(axis=2)
    sideways = offset[..., 0] * moving[..., 1] - offset[..., 1] * moving[..., 0]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    c = (distance - reach) * (distance + reach)
    d = a * reach**2 - sideways**2
    speed = float(np.abs(leg.velocity).max())
    meets = apart & (b < -SQUARE * speed * distance) & (d > 0.0)
    if not meets.any():
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        wait = np.where(meets, np.maximum(c, 0.0) / (np.sqrt(np.maximum(d, 0.0)) - b), np.inf)
    i, j = (int(k) for k in np.unravel_index(int(wait.argmin()), wait.shape))
    normal = direction(offset[i, j] + wait[i, j] * moving[i, j])
    return Impact(leg.begin + float(wait[i, j]), (i, j), normal, -float(moving[i, j] @ normal))


def _slips(leg: Leg, spin: FloatArray, impact: Impact) -> bool:
    """Tell whether two balls that meet rub: they spin, or do not meet head on."""
    i, j = impact.pair
    relative = leg.velocity[j] - leg.velocity[i]
    return bool(spin[i] or spin[j] or not parallel(relative, impact.normal))


def _parted(
    leg: Leg, impact: Impact, mass: FloatArray, restitution: float, radius: FloatArray
) -> tuple[Leg, ContactEvent]:
    """Return the leg after an impact, and the impact as a contact."""
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
    return Leg(impact.time, position, velocity), row
