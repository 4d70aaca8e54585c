"""External ballistics: the exact trajectory of a shell, and its point of impact.

Without quadratic drag a trajectory has a closed form. With it, the trajectory is integrated by the classic Runge–Kutta
method in steps of `INTEGRATION_STEP`; a last, shorter step reaches times in between, so nothing is interpolated.

An impact is searched on the chord of each step first, and then refined on the trajectory by the Illinois variant of
regula falsi. Source: Dowell, Jarratt, BIT 11 (1971) 168. Terrain and discs are in m, times in s.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.forces.air import Air, air_law
from sandbox.engines.reference.integrators import Inputs
from sandbox.games.artillery.scene import Edges
from sandbox.games.artillery.terrain import Ground
from sandbox.scene.compile.ballistics import free_flight
from sandbox.scene.description.world import World

MAX_ITERATIONS = 200


def bracketed_root(f: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Return the argument at which a function changes sign, to within `width`.

    A jump is found as well as a root. The order of convergence is 1.44 for smooth functions; every third iteration
    bisects the bracket, which bounds the number of iterations at a jump.

    Raises:
        ValueError: the function has the same sign at `low` and `high`.
    """
    at_low, at_high = f(low), f(high)
    if at_low == 0.0 or at_high == 0.0:
        return low if at_low == 0.0 else high
    if (at_low > 0.0) == (at_high > 0.0):
        raise ValueError(f"no change of sign between {low:g} and {high:g}")
    weight_low, weight_high = at_low, at_high
    for count in range(MAX_ITERATIONS):
        if abs(high - low) <= width:
            break
        x = (low * weight_high - high * weight_low) / (weight_high - weight_low)
        if count % 3 == 2 or not min(low, high) < x < max(low, high):
            x = 0.5 * (low + high)
        value = f(x)
        if value == 0.0:
            return x
        if (value > 0.0) == (at_low > 0.0):
            low, weight_low, weight_high = x, value, 0.5 * weight_high
        else:
            high, weight_high, weight_low = x, value, 0.5 * weight_low
    return 0.5 * (low + high)


INTEGRATION_STEP = 1.0 / 128.0
"""s, step of the integration: half of it changes the impact of a shell of up to 100 m/s, with a quadratic drag of up to
0.02, by at most 1e-9 m"""

MAX_FLIGHT = 120.0
"""s, limit of the time of flight"""

Knot = tuple[float, float, float, float]
"""Position, m, and velocity, m/s: x, y, vx, vy."""

IMPACT_TIME_TOLERANCE = 1e-13
"""s, tolerance of the time of impact: 1e-11 m at 100 m/s"""


def inputs_of(world: World, count: int) -> Inputs:
    """Return the accelerations, drag coefficients and damping rate for a number of shells."""
    gravity = np.tile(world.gravity, (count, 1))
    return Inputs(gravity, Air.of(world))


def plain_air(world: World) -> Air:
    """Return the air for `rk4`, with no number of numpy, which would make it four times as slow."""
    return Air.of(world)._replace(lift=(0.0,))  # type: ignore[arg-type]  # one body, by its index


def rk4(world: World, air: Air, knot: Knot, h: float) -> Knot:
    """Advance position and velocity of one shell by a step h, s, by the classic Runge–Kutta method.

    Same method as `rk4` of the engine `reference`, but in plain floats, which is about ten times as fast for one shell.
    """
    gx, gy = world.gravity
    x, y, vx, vy = knot
    sum_x = sum_y = sum_vx = sum_vy = ax = ay = 0.0
    for weight, fraction in ((1.0, 0.0), (2.0, 0.5), (2.0, 0.5), (1.0, 1.0)):
        stage_vx, stage_vy = vx + fraction * h * ax, vy + fraction * h * ay
        wx, wy = stage_vx - air.wind_x, stage_vy - air.wind_y
        ax, ay, _ = air_law(air, 0, wx, wy, math.sqrt(wx * wx + wy * wy), stage_vx, stage_vy, 0.0)
        ax, ay = gx + ax, gy + ay
        sum_x, sum_y = sum_x + weight * stage_vx, sum_y + weight * stage_vy
        sum_vx, sum_vy = sum_vx + weight * ax, sum_vy + weight * ay
    sixth = h / 6.0
    return x + sixth * sum_x, y + sixth * sum_y, vx + sixth * sum_vx, vy + sixth * sum_vy


class Flight:
    """Trajectory of one shell in the air of a world, from an initial position, m, and velocity, m/s."""

    def __init__(self, world: World, position: FloatArray, velocity: FloatArray) -> None:
        self._world, self._air = world, plain_air(world)
        self._start = np.asarray(position, dtype=np.float64), np.asarray(velocity, dtype=np.float64)
        x, y, vx, vy = (float(each) for part in self._start for each in part)
        self._knots: list[Knot] = [(x, y, vx, vy)]

    def at(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return position, m, and velocity, m/s, (2,) each, at a time ≥ 0, s."""
        if not self._world.quadratic_drag:
            position, velocity = free_flight(np.array([time]), *self._start, self._world)
            return position[0], velocity[0]
        count = int(time / INTEGRATION_STEP)
        while len(self._knots) <= count:
            self._knots.append(rk4(self._world, self._air, self._knots[-1], INTEGRATION_STEP))
        knot = self._knots[count]
        rest = time - count * INTEGRATION_STEP
        if rest > 0.0:
            knot = rk4(self._world, self._air, knot, rest)
        return np.array(knot[:2]), np.array(knot[2:])

    def positions(self, first: int, count: int) -> FloatArray:
        """Return the positions (count, 2), m, at the times k·`INTEGRATION_STEP` from k = `first` on."""
        if not self._world.quadratic_drag:
            times = np.arange(first, first + count, dtype=np.float64) * INTEGRATION_STEP
            return free_flight(times, *self._start, self._world)[0]
        self.at(INTEGRATION_STEP * (first + count - 1))
        self.at(INTEGRATION_STEP * (first + count))  # a rounded time may fall short of the last knot
        return np.array([knot[:2] for knot in self._knots[first : first + count]])


class ShellImpact(NamedTuple):
    """Impact of a shell."""

    time: float
    """s, time of flight"""
    position: tuple[float, float]
    """m"""


NO_DISCS: FloatArray = np.empty((0, 3))


def landing(
    world: World,
    position: FloatArray,
    velocity: FloatArray,
    ground: Ground,
    edges: Edges = "open",
    discs: FloatArray = NO_DISCS,
) -> ShellImpact | None:
    """Return the impact of a shell on the terrain or on a disc; None if it leaves the terrain or flies too long.

    Args:
        world: gravity, drag and wind.
        position: (2,) m, of the muzzle.
        velocity: (2,) m/s, at the muzzle.
        ground: terrain.
        edges: behaviour at the left and right end of the terrain.
        discs: (M, 3) m, centres and radii of other targets.
    """
    began, position, speed = 0.0, position, velocity
    while began < MAX_FLIGHT:
        flight = Flight(world, position, speed)
        crossed = _first_event(flight, ground, edges, discs, MAX_FLIGHT - began)
        if crossed is None:
            return None
        time, side = crossed
        position, speed = flight.at(time)
        began += time
        if side == 0:
            return ShellImpact(began, (float(position[0]), float(position[1])))
        position, speed = state_past_edge(position, speed, side, ground.width, edges)
    return None


def state_past_edge(
    position: FloatArray, velocity: FloatArray, side: int, width: float, edges: Edges
) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity of a shell after it has reached or passed the left (−1) or right (1) end."""
    wall = width if side > 0 else 0.0
    if edges == "wrap":
        return np.array([position[0] - side * width, position[1]]), velocity
    return np.array([2.0 * wall - position[0], position[1]]), np.array([-velocity[0], velocity[1]])


def _first_event(
    flight: Flight, ground: Ground, edges: Edges, discs: FloatArray, max_time: float
) -> tuple[float, int] | None:
    """Return time, s, and kind of the first event: impact (0), left end (−1) or right end (1); None without one."""
    count, top = 64, max(float(ground.heights.max()), float((discs[:, 1] + discs[:, 2]).max(initial=0.0)))
    for first in range(0, int(max_time / INTEGRATION_STEP), count):
        positions = flight.positions(first, count + 1)
        low = np.minimum(positions[:-1, 1], positions[1:, 1]) <= top
        beside = (positions[1:, 0] < 0.0) | (positions[1:, 0] > ground.width)
        for k in np.flatnonzero(low | beside).tolist():  # other steps are above all obstacles
            a, b = positions[k], positions[k + 1]
            begin, end = (first + k) * INTEGRATION_STEP, (first + k + 1) * INTEGRATION_STEP
            side = 0 if edges == "open" else int(b[0] > ground.width) - int(b[0] < 0.0)
            if side:
                end = _edge_crossing_time(flight, side, ground.width, begin)
                b = flight.at(end)[0]
            if min(a[1], b[1]) <= top:
                found, struck = crossing(ground, a, b), first_strike(discs, a, b)
                if struck is not None and (found is None or struck[0] < found.here):
                    return _disc_impact_time(flight, discs[struck[1]], begin, end, struck[0]), 0
                if found is not None:
                    return _ground_impact_time(flight, ground, begin, end, found), 0
                if b[1] < 0.0 and not 0.0 <= b[0] <= ground.width:
                    return None  # beside the terrain and below its base
            if side:
                return end, side
    return None


def _edge_crossing_time(flight: Flight, side: int, width: float, begin: float) -> float:
    """Return the time, s, at which a shell passes an end, within the step that begins at `begin`, s."""
    wall = width if side > 0 else 0.0

    def beyond(time: float) -> float:
        return side * (float(flight.at(time)[0][0]) - wall)

    # A shell that has just returned is on the boundary; if wind blows it out again within the step, use the whole step.
    return (
        begin + INTEGRATION_STEP
        if beyond(begin) >= 0.0
        else bracketed_root(beyond, begin, begin + INTEGRATION_STEP, IMPACT_TIME_TOLERANCE)
    )


class Crossing(NamedTuple):
    """Fractions of a segment that enters the terrain: above it at `before`, on it at `here`, below it at `after`."""

    before: float
    here: float
    after: float


def crossing(ground: Ground, a: FloatArray, b: FloatArray) -> Crossing | None:
    """Return where the segment from a to b, (2,) m each, enters the terrain; None if it does not."""
    low, high = min(a[0], b[0]), max(a[0], b[0])
    kinks = ground.kinks[np.searchsorted(ground.kinks, low, "right") : np.searchsorted(ground.kinks, high, "left")]
    fractions = np.array([0.0, 1.0])
    if len(kinks):
        fractions = np.sort(np.concatenate((fractions, (kinks - a[0]) / (b[0] - a[0]))))
    x, y = a[0] + fractions * (b[0] - a[0]), a[1] + fractions * (b[1] - a[1])
    gap = y - ground.surface(x)
    below = np.flatnonzero((gap < 0.0) | ((gap == 0.0) & (fractions > 0.0)))  # a shell may start on the surface
    if not len(below):
        return None
    k = int(below[0])
    if k == 0:
        return Crossing(0.0, 0.0, 0.0)
    before, after = float(fractions[k - 1]), float(fractions[k])
    if math.isinf(gap[k - 1]):  # through a side of the terrain
        return Crossing(after, after, after)
    return Crossing(before, before + (after - before) * float(gap[k - 1] / (gap[k - 1] - gap[k])), after)


def _ground_impact_time(flight: Flight, ground: Ground, begin: float, end: float, found: Crossing) -> float:
    """Return the time, s, at which a trajectory enters the terrain, given the crossing of the chord of the step."""

    def gap(time: float) -> float:
        position = flight.at(time)[0]
        return float(position[1] - ground.surface(position[0]))

    for low, high in ((found.before, found.after), (0.0, 1.0)):
        since, until = begin + low * (end - begin), begin + high * (end - begin)
        if since < until and gap(since) > 0.0 >= gap(until):
            return bracketed_root(gap, since, until, IMPACT_TIME_TOLERANCE)
    return begin + found.here * (end - begin)  # grazing: the chord crosses the terrain, the trajectory does not


def first_strike(discs: FloatArray, a: FloatArray, b: FloatArray) -> tuple[float, int] | None:
    """Return where the segment from a to b first enters a disc, as a fraction of it, and the disc's index; else None.

    A segment that starts inside a disc does not enter it.
    """
    if not len(discs):
        return None
    segment, offset = b - a, a - discs[:, :2]
    along, square = offset @ segment, float(segment @ segment)
    outside = (offset**2).sum(axis=1) - discs[:, 2] ** 2
    root = along**2 - square * outside
    entering = np.flatnonzero((root > 0.0) & (along < 0.0) & (outside > 0.0) & (square > 0.0))
    if not len(entering):
        return None
    fraction = (-along[entering] - np.sqrt(root[entering])) / square
    k = int(np.argmin(fraction))
    return (float(fraction[k]), int(entering[k])) if fraction[k] <= 1.0 else None


def _disc_impact_time(flight: Flight, disc: FloatArray, begin: float, end: float, fraction: float) -> float:
    """Return the time, s, at which a trajectory enters a disc, given the fraction at which the chord does."""

    def distance_to_disc(time: float) -> float:
        return math.dist(flight.at(time)[0], disc[:2]) - float(disc[2])

    here = begin + fraction * (end - begin)
    inside = min(here + 0.1 * float(disc[2]) / max(float(np.hypot(*flight.at(here)[1])), 1e-9), end)
    if distance_to_disc(begin) > 0.0 >= distance_to_disc(inside):
        return bracketed_root(distance_to_disc, begin, inside, IMPACT_TIME_TOLERANCE)
    return here
