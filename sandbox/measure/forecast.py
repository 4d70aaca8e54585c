"""Forecast: what would go wrong in a fixed-step run of a scene, told before running it.

A discrete engine tests for overlap once a substep. A ball whose centre crosses a thin thing's middle within one
substep is not stopped: it tunnels. With a random phase the odds are 1 − reach/(v·h), where reach is the ball's
radius and half the thing's thickness, or for two balls both radii and their relative speed.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.crosscheck import MAX_OVERLAPS, MAX_OVERLAPS_EACH, count_overlaps, height_above
from sandbox.scene.meetings import Meetings, meetings
from sandbox.scene.model import Plane, Post, Scene, Wall
from sandbox.scene.near import BoolArray, FloatArray
from sandbox.scene.part import BACKING
from sandbox.scene.settings import Settings

ENOUGH_ITERATIONS = 5
"""With fewer, bouncing groups gain energy: measured on a break shot, 2.4 times after one iteration."""

ANOTHER = "another ball"

COARSE = 1e-3
"""Share of a radius that the rounding of positions may take."""


ROUNDING = 1e-9
"""Relative: a limit exceeded by less counts as kept."""


@dataclass(frozen=True)
class Warning:
    """Something that will, or may, go wrong."""

    kind: str
    message: str
    figures: dict[str, float | int | str] = field(default_factory=dict)


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


def warnings(scene: Scene, settings: Settings | None = None) -> list[Warning]:
    """Return what would go wrong with a scene at its own settings, or at others."""
    settings = scene.solver if settings is None else settings
    return list(_warnings(scene, settings))


def largest_safe_dt(scene: Scene, settings: Settings | None = None) -> float:
    """Return the largest dt, s, at which nothing in the scene can tunnel, at its number of substeps; inf if at any."""
    settings = scene.solver if settings is None else settings
    return min((p.safe_h for p in passages(scene)), default=math.inf) * settings.substeps


def at_most(limit: float) -> str:
    """Write a limit with three digits, rounded down: what is typed from it must stay within, but for rounding."""
    from decimal import ROUND_FLOOR, Context  # at 5 ms, for those alone who are warned

    return f"{float(Context(prec=3, rounding=ROUND_FLOOR).create_decimal(limit * (1.0 + ROUNDING))):g}"


def _warnings(scene: Scene, settings: Settings) -> Iterator[Warning]:
    meet = meetings(scene)
    if settings.dt > scene.world.duration * (1.0 + ROUNDING):
        message = (
            f"dt, {settings.dt:g} s, is longer than the run, {scene.world.duration:g} s: its end is a part of one "
            "step, in which no contact is found"
        )
        yield Warning("duration", message, {"dt": settings.dt, "duration": scene.world.duration})
    for passage in passages(scene, meet):
        odds = passage.odds(settings.h)
        if odds > ROUNDING:
            safe = passage.safe_h * settings.substeps
            way = passage.speed * settings.h
            thing = passage.thing if passage.thing == ANOTHER else repr(passage.thing)
            message = (
                f"{passage.ball!r} can close on {thing} at up to {passage.speed:.4g} m/s, {way:.3g} m a substep, "
                f"and pass through unseen: odds up to {100 * odds:.3g} %; dt <= {at_most(safe)} s would be safe"
            )
            figures: dict[str, float | int | str] = {
                "ball": passage.ball,
                "thing": passage.thing,
                "speed": passage.speed,
                "odds": odds,
                "safe_dt": safe,
            }
            yield Warning("tunnelling", message, figures)

    bodies = scene.bodies
    colliders = ~meet.free & ~bodies.fixed
    if meet.ball_ball:
        among = _meet_each_other(bodies) & colliders
        most = MAX_OVERLAPS + MAX_OVERLAPS_EACH * int(among.sum())  # a scene with more is refused
        overlaps = count_overlaps(bodies.position[among], bodies.radius[among], most)
        if overlaps:
            message = f"{overlaps:,} pair(s) of balls overlap at the start; the engine will push them apart"
            yield Warning("overlap", message, {"pairs": overlaps})
        if settings.iterations < ENOUGH_ITERATIONS and meet.restitution > 0:
            message = (
                f"{settings.iterations} iteration(s) with bouncing balls: groups can gain energy; "
                f"iterations >= {ENOUGH_ITERATIONS} is sound"
            )
            yield Warning("iterations", message, {"iterations": settings.iterations})

    if colliders.any():
        spacing = np.spacing(np.abs(bodies.position[colliders]).max(axis=1)) / bodies.radius[colliders]
        worst = float(spacing.max())
        if worst > COARSE:
            name = bodies.names[int(np.flatnonzero(colliders)[np.argmax(spacing)])]
            message = (
                f"{name!r} is so far from the origin that its position is rounded to {worst:.2g} of its radius; "
                "move the scene closer"
            )
            yield Warning("rounding", message, {"ball": name, "share": worst})


def passages(scene: Scene, meet: Meetings | None = None) -> list[Passage]:
    """Return for each thing, and for balls among themselves, the passage that needs the shortest substep."""
    meet = meetings(scene) if meet is None else meet
    bodies = scene.bodies
    movers = np.flatnonzero(~meet.free & ~bodies.fixed)
    if not len(movers):
        return []
    speed, radius = top_speeds(scene, meet)[movers], bodies.radius[movers]
    found = []

    def worst(reach: FloatArray, speeds: FloatArray, thing: str) -> None:
        with np.errstate(divide="ignore", over="ignore"):  # at rest, or as good as: never
            k = int(np.argmin(reach / speeds))
        found.append(Passage(bodies.names[movers[k]], thing, float(speeds[k]), float(reach[k])))

    for thing, name in zip(scene.fixed, scene.fixed_names, strict=True):
        worst(radius + _half_depth(thing), speed, name)
    among = _meet_each_other(bodies)[movers]
    fixed = np.flatnonzero(bodies.fixed & ~meet.free)
    if meet.ball_ball and len(fixed):
        worst(radius + float(bodies.radius[fixed].min()), speed, bodies.names[fixed[bodies.radius[fixed].argmin()]])
    if meet.ball_ball and int(among.sum()) > 1:
        worst(radius[among] + float(radius[among].min()), speed[among] + float(speed[among].max()), ANOTHER)
    return found


def _meet_each_other(bodies: Bodies) -> BoolArray:
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

    By its own fall: from rest on the speed it starts with, until a level floor below it or the end. Where balls
    can meet, any may be hit by the fastest: an equal one takes over its speed, a lighter one gets up to twice it.
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
                drop = np.maximum(height_above(plane, bodies.position) - bodies.radius, 0.0)
                speed = np.where(meet.free, speed, np.minimum(speed, np.sqrt(start**2 + 2.0 * gravity * drop)))
    speed = np.where(bodies.fixed, 0.0, speed)
    if world.linear_drag or world.quadratic_drag:
        speed += math.hypot(*world.wind)
    if meet.ball_ball:
        movers = ~bodies.fixed & ~meet.free
        heaviest, fastest = float(bodies.mass[movers].max()), float(speed[movers].max())
        gained = fastest * 2.0 * heaviest / (heaviest + bodies.mass)
        speed = np.where(movers, np.maximum(speed, gained), speed)
    return np.asarray(speed)
