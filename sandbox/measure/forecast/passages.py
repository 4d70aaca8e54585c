"""Passages: how a body may get past what it should have met.

A discrete engine tests for overlap once a substep. A ball whose centre crosses a thin thing's middle within one
substep is not stopped: it tunnels. With a random phase the odds are 1 − reach/(v·h), where reach is the ball's
radius and half the thing's thickness, or for two balls both radii and their relative speed. Of any other body half its
width counts, where it is narrowest, for a radius: flying sideways it reaches no farther.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.measure.forecast.held import farthest_fall
from sandbox.scene.bodies import Bodies
from sandbox.scene.meetings import Meetings, meetings
from sandbox.scene.meetings import reach as reach_of
from sandbox.scene.model import Plane, Post, Scene, Wall
from sandbox.scene.near import BoolArray, FloatArray
from sandbox.scene.part import BACKING
from sandbox.scene.settings import Settings
from sandbox.scene.starts import height_above
from sandbox.scene.zone import mask_of

ANOTHER = "another ball"
ANOTHER_BODY = "another body"


@dataclass(frozen=True)
class Passage:
    """The likeliest way to tunnel: who through what, and from which substep on."""

    ball: str
    thing: str
    speed: float
    """m/s at which they close, at most"""
    reach: float
    """m, that one substep may cover"""

    @property
    def safe_h(self) -> float:
        """The longest substep in which this cannot happen, s."""
        return self.reach / self.speed if self.speed > 0 else math.inf

    def odds(self, h: float) -> float:
        """Return the chance of a miss at a substep h, for a random phase."""
        way = self.speed * h
        return 1.0 - self.reach / way if way > self.reach else 0.0


def largest_safe_dt(scene: Scene, settings: Settings | None = None) -> float:
    """Return the largest dt, s, at which nothing in the scene can tunnel, at its number of substeps; inf if at any."""
    settings = scene.solver if settings is None else settings
    return min((p.safe_h for p in passages(scene)), default=math.inf) * settings.substeps * farther(settings)


def farther(settings: Settings) -> float:
    """Return how many times the way that plain looking allows a body may fly in a substep, by the detection: 1 or inf.

    `swept` looks along the whole way, and `shrink` cuts it into pieces that are short enough. `bisect` looks only
    where the substep ends, and there sees nobody who is past the middle already. Measured with a bullet at a wall
    (`sandbox extremes --axes speed`): it passes from v·h of 1.00 times r + w/2 on, with `bisect` too; with the other
    two not at 100 times.
    """
    return math.inf if settings.detection in ("swept", "shrink") else 1.0


def passages(scene: Scene, meet: Meetings | None = None) -> list[Passage]:
    """Return for each thing, and for bodies among themselves, the passage that needs the shortest substep."""
    meet = meetings(scene) if meet is None else meet
    bodies = scene.bodies
    movers = np.flatnonzero(meet.touches & ~bodies.fixed)
    if not len(movers):
        return []
    speed, half = top_speeds(scene, meet)[movers], bodies.thin[movers]
    found = []

    def worst(reach: FloatArray, speeds: FloatArray, thing: str) -> None:
        if not np.isfinite(reach).any():
            return
        with np.errstate(divide="ignore", over="ignore"):  # at rest, or as good as: never
            k = int(np.argmin(reach / speeds))
        found.append(Passage(bodies.names[movers[k]], thing, float(speeds[k]), float(reach[k])))

    layers = reach_of(scene, bodies)[movers]
    for thing, name in zip(scene.fixed, scene.fixed_names, strict=False):
        if not isinstance(thing, Plane) and not thing.solid:
            continue
        shares = layers & mask_of(thing.layers, scene.layers) != 0
        worst(np.where(shares, half + _half_depth(thing), np.inf), speed, name)
    among = meet_each_other(bodies)[movers]
    fixed = np.flatnonzero(bodies.fixed & meet.touches)
    if meet.mutual and len(fixed):
        worst(half + float(bodies.thin[fixed].min()), speed, bodies.names[fixed[bodies.thin[fixed].argmin()]])
    if meet.mutual and int(among.sum()) > 1:
        another = ANOTHER if bodies.round[movers].all() else ANOTHER_BODY
        worst(half[among] + float(half[among].min()), speed[among] + float(speed[among].max()), another)
    return found


def meet_each_other(bodies: Bodies) -> BoolArray:
    """Return which bodies can meet their like, (N,)."""
    return np.asarray([e.collides == "all" for e in bodies.elements], dtype=np.bool_)[bodies.element]


def _half_depth(thing: Plane | Wall | Post) -> float:
    """Return how deep behind its face a thing still pushes a centre back the way it came, m."""
    match thing:
        case Plane():
            return BACKING
        case Wall():
            return thing.thickness / 2.0
        case Post():
            return thing.radius


def top_speeds(scene: Scene, meet: Meetings) -> FloatArray:
    """Return about how fast each body can get, (N,) m/s.

    By its own fall: from rest on the speed it starts with, until a level floor below it or the end of the run; in
    scenes with other bodies than balls, or joints, also the end of what it hangs on, or past all that could stop it.
    Where balls can meet, any may be hit by the fastest: an equal one takes over its speed, a lighter one gets up to
    twice it. Who is kicked gets up to the speed at which each hit takes as much as it brings. What springs, motors,
    attraction, thrusts and drives add is left out.
    """
    bodies, world = scene.bodies, scene.world
    start = np.hypot(*bodies.velocity.T)
    gravity = math.hypot(*world.gravity)
    speed = start + gravity * world.duration
    if gravity > 0:
        down = np.asarray(world.gravity) / gravity
        for plane in scene.planes:
            normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
            if float(normal @ down) < -1.0 + 1e-12:  # level to rounding: anything else can be slid down for ever
                drop = np.maximum(height_above(plane, bodies.position) - bodies.core, 0.0)
                speed = np.where(~meet.touches, speed, np.minimum(speed, np.sqrt(start**2 + 2.0 * gravity * drop)))
        if len(scene.links) or not bodies.round.all():
            drop = np.maximum(_fall(scene, down), 0.0)
            speed = np.minimum(speed, np.sqrt(start**2 + 2.0 * gravity * drop))
    speed = np.where(bodies.fixed, 0.0, speed)
    if world.linear_drag or world.quadratic_drag:
        speed += math.hypot(*world.wind)
    speed = np.where(meet.touches & ~bodies.fixed, np.maximum(speed, _kicked(meet)), speed)
    if meet.mutual:
        movers = ~bodies.fixed & meet.touches
        heaviest, fastest = float(bodies.mass[movers].max()), float(speed[movers].max())
        gained = fastest * 2.0 * heaviest / (heaviest + bodies.mass)
        speed = np.where(movers, np.maximum(speed, gained), speed)
    return np.asarray(speed)


def _kicked(meet: Meetings) -> float:
    """Return how fast kicks make a body, m/s, that always comes back; by one kick where there is no end."""
    surfaces, fastest = meet.surfaces, 0.0
    for b in np.flatnonzero(surfaces.kicks).tolist():
        kick = surfaces.surfaces[b].kick
        assert kick is not None
        for a in np.flatnonzero(meet.touching[b]).tolist():
            e, f = float(surfaces.restitution[a, b]), float(surfaces.falloff[a, b])
            # v = e v/(1 + f v) + k, that is f v² + (1 − e − k f) v − k = 0
            half = 0.5 * (1.0 - e - kick.speed * f)
            root = half + math.sqrt(half * half + f * kick.speed)
            # and, where k adds to the approach, v = e (v + k)/(1 + f (v + k)): the same equation for v + k
            met = kick.speed / root if root > 0.0 else (1.0 + (kick.adds_to == "approach")) * kick.speed
            fastest = max(fastest, met - kick.speed if kick.adds_to == "approach" else met)
    return fastest


def _fall(scene: Scene, down: FloatArray) -> FloatArray:
    """Return how far each body can fall, (N,) m, until what holds it is taut or nothing is left that it could meet."""
    bodies = scene.bodies
    held = farthest_fall(scene, down)
    if scene.planes:  # what is no level floor goes down for ever
        return held
    depth = bodies.position @ down
    stays = np.where(bodies.fixed, 0.0, held)
    lowest = float(np.max((depth + stays + bodies.radius)[np.isfinite(stays)], initial=-np.inf))
    for wall in scene.walls:
        lowest = max(lowest, float((np.asarray(wall.points) @ down).max()) + wall.thickness / 2.0)
    for post in scene.posts:
        lowest = max(lowest, float(np.asarray(post.position) @ down) + post.radius)
    return np.minimum(held, lowest - depth + bodies.radius) if math.isfinite(lowest) else held
