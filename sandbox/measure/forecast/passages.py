"""Passages: how a body may get past what it should have met.

A discrete engine tests for overlap once a substep. A ball whose centre crosses a thin thing's middle within one
substep is not stopped: it tunnels. With a random phase the odds are 1 − reach/(v·h), where reach is the ball's
radius and half the thing's thickness, or for two balls both radii and their relative speed. Of any other body half its
width counts, where it is narrowest, for a radius: flying sideways it reaches no farther.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.measure.forecast.speeds import Speeds
from sandbox.measure.forecast.warning import ROUNDING
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.contacts import reach as reach_of
from sandbox.scene.description.base import BACKING
from sandbox.scene.description.fixed import Plane, Post, Wall, mask_of
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

ANOTHER = "another ball"
ANOTHER_BODY = "another body"


@dataclass(frozen=True)
class Passage:
    """A way to tunnel: which body through what, and from which substep on."""

    ball: str
    thing: str
    speed: float
    """m/s at which they close, at most"""
    reach: float
    """m, that one substep may cover"""
    others: int = 0
    """bodies that need about as short a substep"""
    struck: bool = False
    """The speed is one that the body may get by impacts of others; by itself it is slower."""

    @property
    def safe_h(self) -> float:
        """The longest substep in which this cannot happen, s."""
        return self.reach / self.speed if self.speed > 0 else math.inf

    def odds(self, h: float) -> float:
        """Return the chance of a miss at a substep h, for a random phase."""
        way = self.speed * h
        return 1.0 - self.reach / way if way > self.reach else 0.0


def largest_safe_dt(scene: Scene, settings: Settings | None = None) -> float | None:
    """Return the largest dt, s, at which nothing in the scene can tunnel, at its number of substeps.

    Infinite if nothing can at any; None where bodies can meet something, and something makes them faster by an amount
    that no formula bounds.
    """
    settings = scene.solver if settings is None else settings
    meet = contact_matrix(scene)
    found, times = passages(scene, meet), farther(settings)
    if found and math.isfinite(times) and Speeds(scene, meet).unknown:
        return None
    return min((p.safe_h for p in found), default=math.inf) * settings.substeps * times


def farther(settings: Settings) -> float:
    """Return how many times the way that plain looking allows a body may fly in a substep, by the detection: 1 or inf.

    `swept` looks along the whole way, and `shrink` cuts it into pieces that are short enough. `bisect` looks only
    where the substep ends, and there misses a body that is past the middle already. Measured with a bullet at a wall
    (`sandbox extremes --axes speed`): it passes from v·h of 1.00 times r + w/2 on, with `bisect` too; with the other
    two not at 100 times.
    """
    return math.inf if settings.detection in ("swept", "shrink") else 1.0


MOST_EACH = 5
"""Passages given for one thing: those that need the shortest substeps."""
ALIKE = 1.1
"""Ratio of the shortest substeps of two bodies up to which they are one passage."""


def passages(scene: Scene, meet: ContactMatrix | None = None) -> list[Passage]:
    """Return for each thing, and for bodies among themselves, which bodies can pass it, each at its own speed.

    Bodies about as fast for their size are one passage, which has the figures of the worst of them. Where impacts by
    others can make a body faster than any is by itself, the worst such passage is added.
    """
    meet = contact_matrix(scene) if meet is None else meet
    bodies = scene.bodies
    movers = np.flatnonzero(meet.touches & ~bodies.fixed)
    if not len(movers):
        return []
    speeds = Speeds(scene, meet)
    half, struck = bodies.thin[movers], speeds.struck[movers]
    found: list[Passage] = []

    def add(able: BoolArray, reach: FloatArray, speed: FloatArray, thing: str) -> None:
        rows = np.flatnonzero(able)
        if not len(rows):
            return
        own = _groups(bodies.names, movers[rows], reach[rows], speed[rows], thing)
        found.extend(own)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # at rest, or as good as: never
            worst = rows[int(np.argmin(reach[rows] / struck[rows]))]
        fastest = Passage(bodies.names[movers[worst]], thing, float(struck[worst]), float(reach[worst]), struck=True)
        if fastest.safe_h < own[0].safe_h * (1.0 - ROUNDING):
            found.append(fastest)

    layers = reach_of(scene, bodies)[movers]
    for thing, name in zip(scene.fixed, scene.fixed_names, strict=False):
        if isinstance(thing, Plane) or thing.solid:
            shares = layers & mask_of(thing.layers, scene.layers) != 0
            add(shares, half + _half_depth(thing), speeds.toward(thing)[movers], name)
    fixed = np.flatnonzero(bodies.fixed & meet.touches)
    if meet.mutual and len(fixed):
        thinnest = fixed[bodies.thin[fixed].argmin()]
        add(
            np.ones(len(movers), np.bool_),
            half + float(bodies.thin[thinnest]),
            speeds.own[movers],
            bodies.names[thinnest],
        )
    among = np.flatnonzero(meet_each_other(bodies)[movers])
    if meet.mutual and len(among) > 1:
        found.extend(_mutual(scene, speeds, movers[among]))
    return found


def _groups(
    names: tuple[str, ...], number: IntArray, reach: FloatArray, speed: FloatArray, thing: str
) -> list[Passage]:
    """Return a passage for bodies alike, the one that needs the shortest substep first, at most `MOST_EACH`."""
    with np.errstate(divide="ignore", over="ignore"):  # at rest, or as good as: never
        order = np.argsort(reach / speed, kind="stable")
    found: list[Passage] = []
    for k in order.tolist():
        each = Passage(names[number[k]], thing, float(speed[k]), float(reach[k]))
        if found and (each.safe_h <= ALIKE * found[-1].safe_h or not math.isfinite(each.safe_h)):
            found[-1] = replace(found[-1], others=found[-1].others + 1)
        elif len(found) == MOST_EACH:
            break
        else:
            found.append(each)
    return found


MOST_CLOSING = 200
"""Bodies of which every pair is looked at: the fastest and the thinnest."""


def _mutual(scene: Scene, speeds: Speeds, number: IntArray) -> list[Passage]:
    """Return the passages of bodies through each other: the worst for each body, of bodies alike once."""
    bodies = scene.bodies
    another = ANOTHER if bodies.round[number].all() else ANOTHER_BODY
    if len(number) > MOST_CLOSING:
        with np.errstate(divide="ignore", over="ignore"):
            order = np.argsort(bodies.thin[number] / speeds.own[number], kind="stable")
        number = number[order[:MOST_CLOSING]]
    half, own = bodies.thin[number], speeds.own[number]
    struck = np.maximum(own, speeds.struck[number])
    reach = half[:, None] + half
    two = len(number) == 2 and not scene.fixed and not bodies.fixed.any()
    closing = own[:, None] + own
    if two and not len(scene.links) and not (scene.attractions or scene.thrusts or scene.drives):
        velocity = bodies.velocity[number]
        closing = np.full((2, 2), float(np.hypot(*(velocity[0] - velocity[1]))))
    other, _ = _soonest(reach, closing)
    rows = np.arange(len(number))
    found = _groups(bodies.names, number, reach[rows, other], closing[rows, other], another)
    found = [replace(found[0], others=0)] if len(number) == 2 else found
    closing = struck[:, None] + struck
    other, safe = _soonest(reach, closing)
    k = int(safe.argmin())
    last = other[k]
    fastest = Passage(bodies.names[number[k]], another, float(closing[k, last]), float(reach[k, last]), struck=True)
    return [*found, fastest] if not two and fastest.safe_h < found[0].safe_h * (1.0 - ROUNDING) else found


def _soonest(reach: FloatArray, closing: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return with which other one each passes in the shortest substep, and that substep, (N,) s."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # at rest, or as good as: never
        safe = np.where(closing > 0.0, reach / closing, np.inf)
    safe[np.eye(len(safe), dtype=np.bool_)] = np.inf
    other = safe.argmin(axis=1)
    other = np.where(other == np.arange(len(safe)), (other + 1) % len(safe), other)  # where all are inf
    return other, safe.min(axis=1)


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
