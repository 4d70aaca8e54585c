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
from collections.abc import Iterator
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


class Leg(NamedTuple):
    """Way between two stops."""

    begin: float
    """s, since `path.start`"""
    duration: float
    """s"""
    tail: Stop
    head: Stop


class PathMotion:
    """Motion of a body along its path: pose by time, and bounds of speed.

    Example:
        >>> bodies = sandbox.load("games/moving_platforms").bodies
        >>> bodies.paths[bodies.number_of["lift"]].pose(2.0)
        PathPose(x=-5.2, y=2.1, angle=0.0)
    """

    def __init__(self, single: BodySpec) -> None:
        assert single.path is not None
        self.path = path = single.path
        (px, py), (cx, cy), (qx, qy) = single.position, geometry_of(single).centre, path.pivot
        self.angle = angle = single.angle
        """rad, without a turn"""
        cos, sin = math.cos(angle), math.sin(angle)
        dx, dy = rotate(cx, cy, cos, sin) if cx or cy else (0.0, 0.0)
        self.centre: Point = (px + dx, py + dy)
        """position of the centre of mass without displacement and turn, m"""
        dx, dy = rotate(qx, qy, cos, sin)
        self.pivot: Point = (px + dx, py + dy)
        """position of the pivot without displacement, m"""
        self.lever: Point = (cx - qx, cy - qy)
        """the centre of mass from the pivot, in the frame of the body, m"""
        self.is_smooth = path.easing == "smooth"
        self.legs, self.cycle = _schedule(path)
        """s, duration of a cycle"""
        self._begins = [leg.begin for leg in self.legs]

    def pose(self, time: float) -> PathPose:
        """Return the pose at a time of the scene, s."""
        return self._pose_at(*self._place(time))

    def _place(self, time: float) -> tuple[float, float, float]:
        """Return the displacement, m, and the turn, rad, at a time, s."""
        elapsed = time - self.path.start
        if elapsed <= 0.0:
            return self.legs[0].tail
        if self.path.repeat != "once":
            elapsed = math.fmod(elapsed, self.cycle)
        begin, duration, tail, head = self.legs[bisect_right(self._begins, elapsed) - 1]
        passed = elapsed - begin
        if passed >= duration:
            return head
        s = smooth(passed / duration) if self.is_smooth else passed / duration
        rest = 1.0 - s
        return rest * tail[0] + s * head[0], rest * tail[1] + s * head[1], rest * tail[2] + s * head[2]

    def _pose_at(self, x: float, y: float, turn: float) -> PathPose:
        """Return the pose at a displacement, m, and a turn, rad."""
        if not turn:
            return PathPose(self.centre[0] + x, self.centre[1] + y, self.angle)
        angle = self.angle + turn
        dx, dy = rotate(*self.lever, math.cos(angle), math.sin(angle))
        return PathPose(self.pivot[0] + x + dx, self.pivot[1] + y + dy, angle)

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
        radius = math.hypot(*self.lever)
        speeds = [
            (math.dist(leg.tail[:2], leg.head[:2]) + radius * abs(leg.head.angle - leg.tail.angle)) / leg.duration
            for leg in self.legs
        ]
        return PEAK_SPEED[self.path.easing] * max(speeds)

    @property
    def max_spin(self) -> float:
        """Largest angular velocity, rad/s."""
        peak = PEAK_SPEED[self.path.easing]
        return max(peak * abs(leg.head.angle - leg.tail.angle) / leg.duration for leg in self.legs)


def _schedule(path: BodyPath) -> tuple[list[Leg], float]:
    """Return the legs of a cycle of a valid path, without those between equal stops, and the duration of the cycle."""
    pairs = [(tail, head) for tail, head in pairwise(cycle_of(path)) if tail != head]
    lengths = [math.dist(tail[:2], head[:2]) for tail, head in pairs]
    if not any(lengths):
        lengths = [abs(head.angle - tail.angle) for tail, head in pairs]
    if path.period is None:
        durations = [length / (1.0 if path.speed is None else path.speed) for length in lengths]
    else:
        unit = (path.period - _waiting(path, len(pairs))) / sum(lengths)
        durations = [length * unit for length in lengths]
    legs, time = list[Leg](), 0.0
    for duration, (tail, head) in zip(durations, pairs, strict=True):
        legs.append(Leg(time, duration, tail, head))
        time += duration + path.pause
    if path.period is not None:
        time = path.period  # which the sum is up to rounding
    return legs, time


def _waiting(path: BodyPath, legs: int) -> float:
    """Return the duration of the pauses of a cycle with a number of legs, s: a path made once does not end with one."""
    return path.pause * (legs - (path.repeat == "once"))


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
    if path.speed is not None and path.period is not None:
        yield ("path", "speed"), "cannot be combined with `period`; remove one of the two"
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
    waiting = _waiting(path, len(pairs))
    if path.period is not None and not path.period > waiting:
        yield ("path", "period"), f"must be longer than the pauses of a cycle, which take {waiting:g} s"
