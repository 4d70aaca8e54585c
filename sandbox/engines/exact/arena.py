"""Arena: all that the kernels read and write, as one tuple of arrays.

A ball moves by x₀ + v τ + a τ²/2 and turns likewise, τ counted from its own last event. Its row is written at its own
events only, so nothing accumulates from frame to frame.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from sandbox.engines.fixtures import Fixtures, fixtures_of, straightened
from sandbox.engines.rebound import kicked, stretches
from sandbox.engines.roster import ALL, NOTHING, Roster
from sandbox.scene.model import Plane, Scene, Wall
from sandbox.trajectory import FloatArray, IntArray

T, X, Y, VX, VY, AX, AY, RADIUS, LATE, ANGLE, SPIN, ALPHA, SLIDES, SINCE = range(14)
LAST_TIME, NEXT_LATE, LIGHTNESS, READINESS, FORCE = range(14, 19)
BOOKED, BOOKED_LATE = 22, 23
"""Columns of `state`: the ball's own time, s; place, velocity, acceleration; radius, m; what rounding has cut off its
own time; angle, spin and its rate; when its sliding or spinning on a support ends; from when on its supports' impulses
are not logged yet; when it last hit something; what rounding has cut off its next event's time; 1/mass, 0 for what
never moves; 1/moment, 0 for what cannot turn; force of each of two supports on it, N, four columns; up to when what its
sliding took is in the account, and what rounding has cut off that."""

WIDTH = 24
"""Columns of `state`: what prediction reads stands first."""

MEETS, SURFACE, SUPPORT, ROW = 0, 1, 2, 4
LAST_KIND, LAST_WHO, NEXT_KIND, NEXT_WHO, NEXT_STAMP, STAMP, TAGS = range(6, 13)
"""Columns of `tags`: what it meets, as in the roster; its surface; the two flats it rests on, −1 for none, the first
filled first; the log's rows of the two, −1 for none; kind and partner of its last impact; kind and partner of its next
event, and the partner's stamp when that was predicted; its own stamp: how often its motion has changed."""

PX, PY, NX, NY, UX, UY, LENGTH, HALF, WHOLE, KICK, THRESHOLD, MIDDLE, BEGIN, SPAN, TO_APPROACH = range(15)
"""Columns of `flats`: a point of the surface, the normal out of it, the direction along it and how far it goes from
the point, below 0 while it is not solid, so that nothing can be along it; half the thickness of what it is a side of;
how far it goes when it is solid; the kick, m/s, its threshold, whether that is most in the middle, at which share of
the whole wall it begins, and how much of it it is; whether the kick adds to the approach."""

SOLID, KICKS, ABOVE, KNOB_TO_APPROACH = range(3, 7)
"""Columns of `knobs` behind centre and radius: whether it is solid; the speed of its kick, m/s, and the threshold;
whether the kick adds to the approach."""

THING, COAT, ENDS = range(3)
"""Columns of `flat_tags` and `knob_tags`: fixed thing, surface, and of flats the two knobs at the ends, −1 for none."""

RESTITUTION, FRICTION, FALLOFF = range(3)
"""Places of `surfaces`."""

GX, GY, HOP, NOW, NOW_LATE, SECOND, INSTANT = range(7)
BY_NORMAL, BY_RUBBING, BY_PHANTOM, BY_KICKS = range(7, 11)
BATCH, BATCH_BEFORE = range(11, 13)
"""Places of `world`: gravity, m/s²; the speed of a hop, m/s; the time of the last event, s, and what rounding has cut
off it; the starts of the second and of the instant in which events are being counted; energy that impulses along
normals and along surfaces took, J, negative, that either gave, and that kicks brought; when the present batch of
events and the one before it began, s."""

NONE, SLIP_ENDS, EDGE, FLAT, KNOB, BALL = range(6)
"""Kinds of event, in the order in which those of one ball at one instant happen."""

RECORDING, ROWS, EVENTS, IN_SECOND, AT_INSTANT, WHO, WHAT, WITH, BUDGET, PREDICTIONS, PAIR_TESTS, ACCOUNTING = range(12)
IN_BATCH = 12
"""Places of `count`: whether contacts are logged, how many rows there are; events so far, in the present second and
instant; the last event's ball, kind and partner; how many events a second may have; how often a ball looked ahead,
and at how many others, flats and knobs; whether energy is accounted for; events in the present batch."""

HOP_TIME, HOP_MOST = 5e-5, 5e-4
"""s and m/s: what would rest on a ball or on anything round hops instead, with g·HOP_TIME or HOP_MOST if that is less:
hops of 1e-4 s, and with earthly gravity of 1.2e-8 m."""


class Arena(NamedTuple):
    """N bodies, F flats (planes, and each wall segment's two sides), K knobs (posts and segments' ends), S surfaces.

    Few arrays of many columns: each array of a kernel's arguments costs compile time in every kernel.
    """

    state: FloatArray
    """(N, 24)"""
    tags: IntArray
    """(N, 12)"""
    next_time: FloatArray
    """(N,) a ball's earliest event, s; where the partner has moved otherwise since, a bound from below"""
    movers: IntArray
    """those that can have events"""
    others: IntArray
    """those that a ball can hit"""
    surfaces: FloatArray
    """(3, S, S) restitution, friction and falloff, s/m"""
    flats: FloatArray
    """(F, 15)"""
    flat_tags: IntArray
    """(F, 4)"""
    knobs: FloatArray
    """(K, 6) centre and radius, m, and more"""
    knob_tags: IntArray
    """(K, 2)"""
    world: FloatArray
    """(13,)"""
    counts: IntArray
    """(13,)"""
    log: FloatArray
    """(C, 7) time, point, normal, impulse"""
    log_pair: IntArray
    """(C, 2) as in `Contacts`"""


def arena_of(roster: Roster) -> Arena:
    """Lay out a roster as it stands at time 0, every ball in free flight."""
    number = len(roster.bodies)
    state = np.zeros((number, WIDTH))
    state[:, X : Y + 1], state[:, VX : VY + 1] = roster.position, roster.velocity
    state[:, ANGLE], state[:, SPIN] = roster.angle, roster.angular_velocity
    state[:, SLIDES], state[:, LAST_TIME] = np.inf, -np.inf
    tags = np.full((number, TAGS), -1, np.int64)
    tags[:, STAMP] = 0
    arena = Arena(
        state=state,
        tags=tags,
        next_time=np.full(number, np.inf),
        movers=np.empty(0, np.int64),
        others=np.empty(0, np.int64),
        surfaces=np.empty((3, 0, 0)),
        **_laid(roster.scene),
        world=np.zeros(13),
        counts=np.zeros(13, np.int64),
        log=np.empty((0, 7)),
        log_pair=np.empty((0, 2), np.int64),
    )
    arena.world[BATCH_BEFORE] = -np.inf  # there is none before the first
    return renewed(arena, roster)


def _laid(scene: Scene) -> dict[str, Any]:
    """Return the arrays of an arena that say where what is fixed stands, solid or not."""
    fixtures = fixtures_of(scene, everything=True)
    knobs, knob_thing, ends = _knobs(fixtures)
    flats, flat_thing, flat_knobs = _flats(fixtures, ends)
    return {
        "flats": flats,
        "flat_tags": np.column_stack((flat_thing, flat_thing, flat_knobs)),
        "knobs": knobs,
        "knob_tags": np.column_stack((knob_thing, knob_thing)),
    }


def reshaped(arena: Arena, roster: Roster) -> Arena:
    """Return the arena with the walls that a roster now has. No ball may rest on anything: what flats mean changes."""
    arena.tags[:, LAST_KIND] = NONE  # whom each met last was one of those that were
    return arena._replace(**_laid(roster.scene))


def renewed(arena: Arena, roster: Roster) -> Arena:
    """Return the arena with what may have changed in a roster: who there is, what of, and gravity."""
    more = len(roster.bodies) - len(arena.state)
    if more:
        fresh = arena_of(roster)
        names = ("state", "tags", "next_time")
        grown = {name: np.concatenate((getattr(arena, name), getattr(fresh, name)[-more:])) for name in names}
        arena = arena._replace(**grown)
    state, tags, world = arena.state, arena.tags, arena.world
    state[:, RADIUS] = roster.radius
    state[:, LIGHTNESS], state[:, READINESS] = roster.inverse_mass, roster.inverse_moment
    tags[:, MEETS], tags[:, SURFACE] = roster.meets, roster.surface
    for things in (arena.flat_tags, arena.knob_tags):
        things[:, COAT] = roster.fixed_surface[things[:, THING]]
    _bear(arena, roster.scene)
    gravity = roster.scene.world.gravity
    world[GX], world[GY] = gravity
    world[HOP] = min(math.hypot(*gravity) * HOP_TIME, HOP_MOST)
    return arena._replace(
        movers=np.flatnonzero((roster.inverse_mass > 0) & (roster.meets != NOTHING)),
        others=np.flatnonzero(roster.meets == ALL),
        surfaces=np.stack((roster.restitution, roster.friction, roster.falloff)),
    )


def _bear(arena: Arena, scene: Scene) -> None:
    """Enter what kicks, and what is not solid; of planes there is none."""
    things, number, flats, knobs = scene.fixed, len(scene.planes), arena.flats, arena.knobs
    solid = np.asarray([isinstance(thing, Plane) or thing.solid for thing in things], dtype=np.bool_)
    flats[:, LENGTH] = np.where(solid[arena.flat_tags[:, THING]], flats[:, WHOLE], -1.0)
    knobs[:, SOLID] = solid[arena.knob_tags[:, THING]]
    for k, thing in enumerate(things[number:], number):
        if isinstance(thing, Plane) or thing.kick is None:
            continue
        middle, mine = thing.kick.profile == "middle", arena.flat_tags[:, THING] == k
        if isinstance(thing, Wall):
            parts = np.repeat(stretches(straightened(thing)), 2, axis=0)  # each segment has two sides
            flats[mine, BEGIN], flats[mine, SPAN] = parts[:, 0], parts[:, 1] - parts[:, 0]
        flats[mine, KICK], flats[mine, THRESHOLD], flats[mine, MIDDLE] = thing.kick.speed, thing.kick.threshold, middle
        flats[mine, TO_APPROACH] = to_approach = thing.kick.adds_to == "approach"
        for each in np.flatnonzero(arena.knob_tags[:, THING] == k).tolist():
            share = 0.5
            if middle:
                ends = np.flatnonzero(mine & (arena.flat_tags[:, ENDS : ENDS + 2] == each).any(axis=1))
                first = arena.flat_tags[ends[0], ENDS] == each
                share = float(flats[ends[0], BEGIN] + (0.0 if first else flats[ends[0], SPAN]))
            knobs[each, KICKS] = kicked(thing.kick.speed, 0.0, middle, share, 1.0)
            knobs[each, ABOVE], knobs[each, KNOB_TO_APPROACH] = thing.kick.threshold, to_approach


def _knobs(fixtures: Fixtures) -> tuple[FloatArray, IntArray, dict[tuple[float, float, float, int], int]]:
    """Lay out every post and segment end once, and say which is where."""
    place: dict[tuple[float, float, float, int], int] = {}
    for (ax, ay, bx, by, half), thing in zip(fixtures.segments.tolist(), fixtures.segment_thing.tolist(), strict=True):
        place.setdefault((ax, ay, half, thing), len(place))
        place.setdefault((bx, by, half, thing), len(place))
    rows = np.asarray(list(place), dtype=np.float64).reshape(-1, 4)
    knobs = np.zeros((len(rows), 7))
    knobs[:, :3], knobs[:, SOLID] = rows[:, :3], 1.0
    return knobs, rows[:, 3].astype(np.int64), place


def _flats(
    fixtures: Fixtures, ends: dict[tuple[float, float, float, int], int]
) -> tuple[FloatArray, IntArray, IntArray]:
    """Lay out planes and both sides of every segment that has a length."""
    rows: list[tuple[float, ...]] = []
    things: list[int] = []
    knobs: list[tuple[int, int]] = []
    for (px, py, nx, ny), thing in zip(fixtures.planes.tolist(), fixtures.plane_thing.tolist(), strict=True):
        rows.append((px, py, nx, ny, ny, -nx, np.inf, 0.0))
        things.append(thing)
        knobs.append((-1, -1))
    for (ax, ay, bx, by, half), thing in zip(fixtures.segments.tolist(), fixtures.segment_thing.tolist(), strict=True):
        dx, dy = bx - ax, by - ay
        length = float(np.hypot(dx, dy))
        if length == 0.0:
            continue
        ux, uy = dx / length, dy / length
        pair = (ends[ax, ay, half, thing], ends[bx, by, half, thing])
        for nx, ny in ((-uy, ux), (uy, -ux)):
            rows.append((ax + half * nx, ay + half * ny, nx, ny, ux, uy, length, half))
            things.append(thing)
            knobs.append(pair)
    plain = np.asarray(rows, dtype=np.float64).reshape(-1, 8)
    return (
        np.column_stack((plain, plain[:, LENGTH], np.zeros((len(plain), 6)))),
        np.asarray(things, dtype=np.int64),
        np.asarray(knobs, dtype=np.int64).reshape(-1, 2),
    )
