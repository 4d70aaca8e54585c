"""Paths of kinematic bodies: their pose as a function of time.

A path is a sequence of legs, from one point to the next, and of pauses between them. At a time t of a leg of duration T
the fraction s(t / T) of the way and of the turn has been made, with

- s(u) = u for `linear`: constant speed, which jumps at the ends of the leg;
- s(u) = 6 u⁵ − 15 u⁴ + 10 u³ for `smooth`: at rest and without acceleration at both ends. It is the motion of minimum
  jerk (Flash and Hogan 1985, J. Neurosci. 5, 1688) and Perlin's interpolant of 2002 ("smootherstep"). Its largest speed
  is 15/8 of the mean, its largest acceleration 10/√3 · L / T² for a leg of length L.

The pose depends on the time only, so that it has no error that grows with the number of steps.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import NamedTuple

from sandbox.scene.description.base import BodyPath, BodySpec, Point
from sandbox.scene.geometry.shapes import geometry_of
from sandbox.scene.geometry.vectors import rotate

PEAK_SPEED = {"linear": 1.0, "smooth": 15.0 / 8.0}
"""Largest speed on a leg, relative to its mean, for each easing"""

PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
"""Largest acceleration on a smooth leg, in units of its length / duration²"""


ARC_PIECES = 16
"""Straight pieces of the course of a leg on which the body turns"""


def smooth(u: float) -> float:
    """Return the fraction of a smooth leg that is done after a fraction u of its duration."""
    return u * u * u * (u * (u * 6.0 - 15.0) + 10.0)


class PathPose(NamedTuple):
    """Position and angle of a body."""

    x: float
    """m, of the centre of mass, as y"""
    y: float
    angle: float
    """rad"""


class Stop(NamedTuple):
    """Point of a path, from the start of the body."""

    x: float
    """m, as y"""
    y: float
    angle: float
    """rad"""

    def is_at(self, other: "Stop") -> bool:
        """Return whether another stop has the same position."""
        return self[:2] == other[:2]


def stops_of(path: BodyPath) -> list[Stop]:
    """Return the points of a path with their angles."""
    points, angles = path.points or ((0.0, 0.0),) * len(path.angles), path.angles or (0.0,) * len(path.points)
    return [Stop(*point, angle) for point, angle in zip(points, angles, strict=False)]


def cycle_of(path: BodyPath) -> list[Stop]:
    """Return the stops of a cycle in order, with the first one again at its end unless the path is made once."""
    stops = stops_of(path)
    match path.repeat:
        case "there_and_back":
            return [*stops, *stops[-2::-1]]
        case "loop":
            return [*stops, *stops[:1]]
    return stops


class _Leg(NamedTuple):
    """Way between two stops."""

    duration: float
    """s"""
    tail: Stop
    head: Stop


class PathMotion:
    """Motion of a body along its path: pose by time, and bounds of speed."""

    def __init__(self, single: BodySpec) -> None:
        assert single.path is not None
        self.path = path = single.path
        self._position, self._angle = single.position, single.angle
        self._centre = geometry_of(single).centre
        self._ease: Callable[[float], float] | None = smooth if path.easing == "smooth" else None
        self._legs = _legs(path)
        self._begins, self.cycle = self._schedule()
        """s, times since `path.start` at which legs begin, and at which the cycle ends"""

    def _schedule(self) -> tuple[list[float], float]:
        begins, time = [], 0.0
        for leg in self._legs:
            begins.append(time)
            time += leg.duration + self.path.pause
        if self.path.period is not None and self.path.repeat != "once":
            time = self.path.period  # which the sum is up to rounding
        return begins, time

    def pose(self, time: float) -> PathPose:
        """Return the pose at a time of the scene, s."""
        return self._pose_at(*self._place(time))

    def _place(self, time: float) -> tuple[float, float, float]:
        """Return the displacement, m, and the turn, rad, at a time, s."""
        elapsed = time - self.path.start
        if elapsed <= 0.0:
            return self._legs[0].tail
        if self.path.repeat != "once":
            elapsed = math.fmod(elapsed, self.cycle)
        k = bisect_right(self._begins, elapsed) - 1
        duration, tail, head = self._legs[k]
        passed = elapsed - self._begins[k]
        if passed >= duration:
            return head
        s = passed / duration
        if self._ease is not None:
            s = self._ease(s)
        rest = 1.0 - s
        return rest * tail[0] + s * head[0], rest * tail[1] + s * head[1], rest * tail[2] + s * head[2]

    def _pose_at(self, x: float, y: float, turn: float) -> PathPose:
        """Return the pose at a displacement, m, and a turn, rad."""
        (px, py), (cx, cy), pivot, angle = self._position, self._centre, self.path.pivot, self._angle
        if not turn:
            if cx or cy:
                cx, cy = rotate(cx, cy, math.cos(angle), math.sin(angle))
            return PathPose(px + cx + x, py + cy + y, angle)
        qx, qy = rotate(*pivot, math.cos(angle), math.sin(angle))
        lx, ly = rotate(cx - pivot[0], cy - pivot[1], math.cos(angle + turn), math.sin(angle + turn))
        return PathPose(px + qx + x + lx, py + qy + y + ly, angle + turn)

    def stops(self) -> list[Point]:
        """Return the positions of the centre of mass at the points of the path, m."""
        return [self._pose_at(*stop)[:2] for stop in stops_of(self.path)]

    def course(self) -> list[Point]:
        """Return the course of the centre of mass through all points, m: a polyline, with arcs where the body turns."""
        stops = stops_of(self.path)
        if self.path.repeat == "loop":
            stops.append(stops[0])
        found = [self._pose_at(*stops[0])[:2]]
        for tail, head in pairwise(stops):
            count = ARC_PIECES if head.angle != tail.angle else 1
            for k in range(1, count + 1):
                s = k / count
                found.append(self._pose_at(*((1.0 - s) * a + s * b for a, b in zip(tail, head, strict=True)))[:2])
        return found

    @property
    def max_speed(self) -> float:
        """Bound of the speed of the centre of mass, m/s."""
        lever = math.dist(self._centre, self.path.pivot)
        peak = PEAK_SPEED[self.path.easing]
        return max(
            peak * (math.dist(leg.tail[:2], leg.head[:2]) + lever * abs(leg.head.angle - leg.tail.angle)) / leg.duration
            for leg in self._legs
        )

    @property
    def max_spin(self) -> float:
        """Largest angular velocity, rad/s."""
        peak = PEAK_SPEED[self.path.easing]
        return max(peak * abs(leg.head.angle - leg.tail.angle) / leg.duration for leg in self._legs)


def _legs(path: BodyPath) -> list[_Leg]:
    """Return the legs of a cycle of a valid path, without those between equal stops."""
    pairs = [(tail, head) for tail, head in pairwise(cycle_of(path)) if tail != head]
    lengths = [math.dist(tail[:2], head[:2]) for tail, head in pairs]
    if path.speed is not None:
        return [_Leg(length / path.speed, *pair) for length, pair in zip(lengths, pairs, strict=True)]
    assert path.period is not None
    if not any(lengths):
        lengths = [abs(head.angle - tail.angle) for tail, head in pairs]
    moving = path.period - path.pause * (len(pairs) - (path.repeat == "once"))
    unit = moving / sum(lengths)
    return [_Leg(length * unit, *pair) for length, pair in zip(lengths, pairs, strict=True)]


def path_faults(single: BodySpec) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the faults of a body with a path: the key, within the body, and a message."""
    path = single.path
    assert path is not None
    if not single.kinematic:
        yield ("path",), "needs `kinematic = true`: collisions do not change the motion of a body on a path"
    for key in ("velocity", "angular_velocity"):
        if getattr(single, key) not in (0.0, (0.0, 0.0)):
            yield (key,), "follows from the `path` of the body; remove it"
    stops = max(len(path.points), len(path.angles))
    if stops < 2:
        key = "angles" if path.angles and not path.points else "points"
        yield ("path", key), f"must be at least 2, from the body's `position` on, such as [[0, 0], [4, 0]]; has {stops}"
        return
    if path.points and path.angles and len(path.points) != len(path.angles):
        yield ("path", "angles"), f"must be {len(path.points)} angles, one for each point; has {len(path.angles)}"
        return
    if any(path.pivot) and not path.angles:
        yield ("path", "pivot"), "has no effect without `angles`; remove it"
    yield from _time_faults(path)


def _time_faults(path: BodyPath) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the faults of the duration of a path with as many points as angles."""
    if (path.speed is None) == (path.period is None):
        given = "cannot be combined with `period`; remove one of the two" if path.speed else "needs `speed` or `period`"
        yield ("path", "speed") if path.speed else ("path",), given
        return
    pairs = [(tail, head) for tail, head in pairwise(cycle_of(path)) if tail != head]
    if not pairs:
        yield ("path", "points"), "are all at one place, so that the body never moves; remove the path"
        return
    standing = [tail.is_at(head) for tail, head in pairs]
    if all(standing) and path.speed is not None:
        yield ("path", "speed"), "has no meaning for a path that only turns; use `period`"
        return
    if any(standing) and not all(standing):
        yield (
            ("path", "angles"),
            "must not change between two points at one place, which takes no time; move the points apart",
        )
        return
    waiting = path.pause * (len(pairs) - (path.repeat == "once"))
    if path.period is not None and not path.period > waiting:
        yield ("path", "period"), f"must be longer than the pauses of a cycle, which take {waiting:g} s"
