"""State arrays of the event-driven simulation, and the names of their columns.

`EventState` holds everything that the kernels read and write: one row of columns for each body and each static
collider. Other modules import this one as `c` and write `state[i, c.VX]`.

Between events a ball moves by x₀ + v τ + a τ²/2, and its angle likewise, where τ is the time since its own last event.
Only an event of the ball rewrites its row, so no error accumulates from frame to frame.

Times are stored as a sum t + residual of two doubles (compensated arithmetic, Knuth's two-sum): the residual is the
part that rounding has cut off t.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.body_store import ALL, NOTHING, BodyStore
from sandbox.engines.common.colliders import StaticColliders, static_colliders, straightened
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.common.restitution import kicked, segment_fractions
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Plane, Wall

T, X, Y, VX, VY, AX, AY, RADIUS, TIME_RESIDUAL, ANGLE, SPIN, ALPHA, SLIP_END_TIME, LOGGED_UNTIL = range(14)
LAST_TIME, NEXT_RESIDUAL, INVERSE_MASS, INVERSE_INERTIA, SUPPORT_FORCE = range(14, 19)
ENERGY_UNTIL, ENERGY_RESIDUAL = 22, 23
"""Columns of `state`; those that prediction reads come first:

- T, TIME_RESIDUAL: time of the row, s: the ball's own last event.
- X … AY: position, velocity, acceleration. RADIUS, m. ANGLE, SPIN, ALPHA: rad, rad/s, rad/s².
- SLIP_END_TIME: time at which slip (in a corner: spin) on the supports ends, s; infinity if it does not.
- LOGGED_UNTIL: time up to which the impulses of the supports are in the contact log, s.
- LAST_TIME: time of the last collision, s; −infinity before the first.
- NEXT_RESIDUAL: residual of the predicted time in `EventState.next_time`, s.
- INVERSE_MASS, 1/kg: 0 for fixed bodies. INVERSE_INERTIA, 1/(kg m²): 0 for bodies that cannot rotate.
- SUPPORT_FORCE, four columns: force x, y of the first and of the second support on the ball, N.
- ENERGY_UNTIL, ENERGY_RESIDUAL: time up to which the work of sliding friction is in the energy ledger, s.
"""

STATE_COLUMNS = 24
"""Number of columns of `state`."""

COLLISION_MASK, SURFACE, SUPPORT, LOG_ROW = 0, 1, 2, 4
LAST_KIND, LAST_PARTNER, NEXT_KIND, NEXT_PARTNER, PARTNER_VERSION, VERSION, TAG_COLUMNS = range(6, 13)
"""Columns of `tags`, integers:

- COLLISION_MASK: as in `BodyStore.collision_mask`. SURFACE: index of the material's row in `surfaces`.
- SUPPORT, two columns: lines that the ball rests on. −1 means none; the first column is filled first, so −1 there means
  free flight and −1 in the second alone means one support. Test with `is_supported` and `is_in_corner`.
- LOG_ROW, two columns: rows of the contact log of the two supports, −1 for none.
- LAST_KIND, LAST_PARTNER: kind and partner of the last event.
- NEXT_KIND, NEXT_PARTNER: kind and partner of the predicted event.
- PARTNER_VERSION: VERSION of the partner ball when the event was predicted; another value now makes it stale.
- VERSION: number of times that the motion of the ball has changed.
"""

PX, PY, NX, NY, UX, UY, LENGTH, HALF_THICKNESS = range(8)
SOLID_LENGTH, KICK_SPEED, KICK_THRESHOLD, KICK_PROFILE, WALL_BEGIN, WALL_SPAN, KICK_TO_APPROACH = range(8, 15)
"""Columns of `lines`:

- PX, PY: a point of the surface, m. NX, NY: outward normal. UX, UY: direction along the line.
- LENGTH: extent along the direction from the point, m; infinity for planes. −1 while the collider is not solid: no
  position along the line lies in [0, −1], so it is never hit. Test with `is_solid`.
- HALF_THICKNESS: of the wall, m. SOLID_LENGTH: LENGTH while the collider is solid, m.
- KICK_SPEED, KICK_THRESHOLD: m/s, of a kick; speed 0 for none. KICK_PROFILE: 1 for the profile `middle`, else 0.
- WALL_BEGIN, WALL_SPAN: start of the line and its length as fractions of the whole wall.
- KICK_TO_APPROACH: 1 if the kick is added to the approach instead of the rebound.
"""

CENTRE_X, CENTRE_Y, CIRCLE_RADIUS, SOLID, VERTEX_KICK, VERTEX_THRESHOLD, VERTEX_TO_APPROACH = range(7)
"""Columns of `vertices`: centre and radius, m; 1 if solid, else 0; kick speed and threshold, m/s; 1 if the kick is
added to the approach."""

COLLIDER, COLLIDER_SURFACE, ENDS = range(3)
"""Columns of `line_tags` and `vertex_tags`: index of the static collider; its row in `surfaces`; of lines the two
vertices at the ends, −1 for none."""

RESTITUTION, FRICTION, FALLOFF, SLIP_TARGET = range(4)
"""First index of `surfaces`."""

GX, GY, MICRO_BOUNCE, NOW, NOW_RESIDUAL, SECOND_START, INSTANT_START = range(7)
BY_NORMAL, BY_FRICTION, BY_PHANTOM, BY_KICKS, BY_SURFACES = range(7, 12)
BATCH_START, PREVIOUS_BATCH = range(12, 14)
"""Indices of `world`:

- GX, GY: gravity, m/s². MICRO_BOUNCE: smallest speed of separation of balls that gravity presses together, m/s.
- NOW, NOW_RESIDUAL: time of the last event, s.
- SECOND_START, INSTANT_START: start of the second and of the instant in which events are counted, s.
- BY_NORMAL, BY_FRICTION: energy change by normal and by friction impulses, J, never positive. BY_PHANTOM: energy that
  either of them created, J. BY_KICKS: energy from kicks, J. BY_SURFACES: work of moving surfaces, J.
- BATCH_START, PREVIOUS_BATCH: start of the present batch of events and of the one before, s.
"""

NONE, SLIP_END, LINE_END, LINE, VERTEX, BALL = range(6)
"""Kinds of event, in the order in which simultaneous events of one ball are processed: end of slip, arrival at the end
of the supporting line, collision with a line, with a vertex, with a ball."""

RECORDING, LOG_ROWS, EVENTS, PREDICTIONS, PAIR_TESTS, MAX_EVENTS, ACCOUNTING = range(7)
EVENT_BODY, EVENT_KIND, EVENT_PARTNER, IN_SECOND, IN_INSTANT, IN_BATCH, IN_MOVING_CORNER = range(7, 14)
"""Indices of `counts`:

- RECORDING: 1 while contacts are recorded. LOG_ROWS: rows of the contact log.
- EVENTS, PREDICTIONS: so far. PAIR_TESTS: balls, lines and vertices tested in predictions so far.
- MAX_EVENTS: largest number of events in one second. ACCOUNTING: 1 while energy is accounted.
- EVENT_BODY, EVENT_KIND, EVENT_PARTNER: body, kind and partner of the last event.
- IN_SECOND, IN_INSTANT, IN_BATCH: events in the present second, instant and batch.
- IN_MOVING_CORNER: 1 once a ball is in a corner with a moving surface, which is not modelled.
"""

BEYOND = -1
"""Return code of `advance_frames`: a ball is not finite or out of bounds."""

DONE, PAUSED, FULL, TOO_MANY = range(4)
"""Return codes of the event loops: reached the time; returned so that Python can handle signals; a log is full; more
events than `MAX_EVENTS`. Any further code is another limit on the number of events."""

MICRO_BOUNCE_TIME, MAX_MICRO_BOUNCE = 5e-5, 5e-4
"""s and m/s: the speed of a micro-bounce is g·MICRO_BOUNCE_TIME, at most MAX_MICRO_BOUNCE. Balls do not rest on balls
or on vertices: they bounce for 1e-4 s, under earth's gravity 1.2e-8 m high."""


class EventState(NamedTuple):
    """State of N bodies, F lines, K vertices and S surfaces.

    Lines are planes and both sides of wall segments; vertices are posts and the ends of segments. The arrays are few
    and have many columns, because each array argument adds compile time to every kernel.
    """

    state: FloatArray
    """(N, 24)"""
    tags: IntArray
    """(N, 12)"""
    next_time: FloatArray
    """(N,) time of the earliest event of each ball, s; a lower bound if its partner's motion has changed since"""
    moving_balls: IntArray
    """indices of the balls that can have events"""
    targets: IntArray
    """indices of the balls that other balls can collide with"""
    surfaces: FloatArray
    """(4, S, S) restitution, friction, restitution falloff, s/m, and slip target, m/s, of each pair of surfaces"""
    lines: FloatArray
    """(F, 15)"""
    line_tags: IntArray
    """(F, 4)"""
    vertices: FloatArray
    """(K, 7)"""
    vertex_tags: IntArray
    """(K, 2)"""
    world: FloatArray
    """(13,)"""
    counts: IntArray
    """(13,)"""
    log: FloatArray
    """(C, 7) time, s; point, m; normal; impulse, N·s"""
    log_pair: IntArray
    """(C, 2) the pair, as in `Contacts`"""


@kernel
def is_supported(tags: IntArray, i: int) -> bool:
    """Return whether a ball rests on a line or in a corner."""
    return bool(tags[i, SUPPORT] >= 0)


@kernel
def is_in_corner(tags: IntArray, i: int) -> bool:
    """Return whether a ball rests on two lines."""
    return bool(tags[i, SUPPORT + 1] >= 0)


@kernel
def is_solid(lines: FloatArray, f: int) -> bool:
    """Return whether a line can be hit."""
    return bool(lines[f, LENGTH] >= 0.0)


def make_state(store: BodyStore) -> EventState:
    """Return the state arrays of a body store at time 0, with every ball in free flight and nothing predicted."""
    count = len(store.bodies)
    state = np.zeros((count, STATE_COLUMNS))
    state[:, X : Y + 1], state[:, VX : VY + 1] = store.position, store.velocity
    state[:, ANGLE], state[:, SPIN] = store.angle, store.angular_velocity
    state[:, SLIP_END_TIME], state[:, LAST_TIME] = np.inf, -np.inf
    tags = np.full((count, TAG_COLUMNS), -1, np.int64)
    tags[:, VERSION] = 0
    data = EventState(
        state=state,
        tags=tags,
        next_time=np.full(count, np.inf),
        moving_balls=np.empty(0, np.int64),
        targets=np.empty(0, np.int64),
        surfaces=np.empty((4, 0, 0)),
        **_collider_arrays(store.scene),
        world=np.zeros(PREVIOUS_BATCH + 1),
        counts=np.zeros(IN_MOVING_CORNER + 1, np.int64),
        log=np.empty((0, 7)),
        log_pair=np.empty((0, 2), np.int64),
    )
    data.world[PREVIOUS_BATCH] = -np.inf  # no batch before the first
    return rebuild(data, store)


def _collider_arrays(scene: Scene) -> dict[str, Any]:
    """Return new arrays of all static colliders, solid or not."""
    return {name: array.copy() for name, array in _derived_collider_arrays(scene).items()}


def vertices_of(scene: Scene) -> FloatArray:
    """Return the vertices (K, 7) of all static colliders, as in `EventState`; the array must not be changed."""
    vertices: FloatArray = _derived_collider_arrays(scene)["vertices"]
    return vertices


@derived_once
def _derived_collider_arrays(setup: Setup) -> dict[str, Any]:
    scene = setup.scene
    static = static_colliders(scene, everything=True)
    vertices, vertex_collider, ends = _vertices(static)
    lines, line_collider, line_vertices = _lines(static, ends)
    return {
        "lines": lines,
        "line_tags": np.column_stack((line_collider, line_collider, line_vertices)),
        "vertices": vertices,
        "vertex_tags": np.column_stack((vertex_collider, vertex_collider)),
    }


def with_new_walls(data: EventState, store: BodyStore) -> EventState:
    """Return the state with the walls of the store's present scene.

    No ball may have a support: the indices of lines change.
    """
    data.tags[:, LAST_KIND] = NONE  # its partner may be a line that no longer exists
    return data._replace(**_collider_arrays(store.scene))


def rebuild(data: EventState, store: BodyStore) -> EventState:
    """Return the state with the bodies, masses, surfaces and gravity that the store now has.

    New bodies are appended.
    """
    added = len(store.bodies) - len(data.state)
    if added:
        fresh = make_state(store)
        names = ("state", "tags", "next_time")
        grown = {name: np.concatenate((getattr(data, name), getattr(fresh, name)[-added:])) for name in names}
        data = data._replace(**grown)
    state, tags, world = data.state, data.tags, data.world
    state[:, RADIUS] = store.radius
    state[:, INVERSE_MASS], state[:, INVERSE_INERTIA] = store.inverse_mass, store.inverse_moment
    tags[:, COLLISION_MASK], tags[:, SURFACE] = store.collision_mask, store.surface
    for collider_tags in (data.line_tags, data.vertex_tags):
        collider_tags[:, COLLIDER_SURFACE] = store.fixed_surface[collider_tags[:, COLLIDER]]
    _set_solid_and_kicks(data, store.scene)
    gravity = store.scene.world.gravity
    world[GX], world[GY] = gravity
    world[MICRO_BOUNCE] = min(math.hypot(*gravity) * MICRO_BOUNCE_TIME, MAX_MICRO_BOUNCE)
    return data._replace(
        moving_balls=np.flatnonzero((store.inverse_mass > 0) & (store.collision_mask != NOTHING)),
        targets=np.flatnonzero(store.collision_mask == ALL),
        surfaces=np.stack((store.restitution, store.friction, store.falloff, store.tangential[:, :, 1])),
    )


def _set_solid_and_kicks(data: EventState, scene: Scene) -> None:
    """Write which colliders are solid, and the kicks. Planes are always solid and have no kick."""
    colliders, planes, lines, vertices = scene.fixed, len(scene.planes), data.lines, data.vertices
    solid = np.asarray([isinstance(collider, Plane) or collider.solid for collider in colliders], dtype=np.bool_)
    lines[:, LENGTH] = np.where(solid[data.line_tags[:, COLLIDER]], lines[:, SOLID_LENGTH], -1.0)
    vertices[:, SOLID] = solid[data.vertex_tags[:, COLLIDER]]
    for k, collider in enumerate(colliders[planes:], planes):
        if isinstance(collider, Plane) or collider.kick is None:
            continue
        middle, own_lines = collider.kick.profile == "middle", data.line_tags[:, COLLIDER] == k
        if isinstance(collider, Wall):
            fractions = np.repeat(segment_fractions(straightened(collider)), 2, axis=0)  # each segment has two sides
            lines[own_lines, WALL_BEGIN], lines[own_lines, WALL_SPAN] = (
                fractions[:, 0],
                fractions[:, 1] - fractions[:, 0],
            )
        lines[own_lines, KICK_SPEED], lines[own_lines, KICK_THRESHOLD] = collider.kick.speed, collider.kick.threshold
        lines[own_lines, KICK_PROFILE] = middle
        lines[own_lines, KICK_TO_APPROACH] = to_approach = collider.kick.adds_to == "approach"
        for vertex in np.flatnonzero(data.vertex_tags[:, COLLIDER] == k).tolist():
            fraction = 0.5
            if middle:
                ends = np.flatnonzero(own_lines & (data.line_tags[:, ENDS : ENDS + 2] == vertex).any(axis=1))
                first = data.line_tags[ends[0], ENDS] == vertex
                fraction = float(lines[ends[0], WALL_BEGIN] + (0.0 if first else lines[ends[0], WALL_SPAN]))
            vertices[vertex, VERTEX_KICK] = kicked(collider.kick.speed, 0.0, middle, fraction, 1.0)
            vertices[vertex, VERTEX_THRESHOLD], vertices[vertex, VERTEX_TO_APPROACH] = (
                collider.kick.threshold,
                to_approach,
            )


def _vertices(static: StaticColliders) -> tuple[FloatArray, IntArray, dict[tuple[float, float, float, int], int]]:
    """Return the vertices: each post and segment end once.

    Returns:
        (K, 7) rows, (K,) collider of each, and the row of each vertex by (x, y, radius, collider).
    """
    index: dict[tuple[float, float, float, int], int] = {}
    for (ax, ay, bx, by, half), collider in zip(
        static.segments.tolist(), static.segment_collider.tolist(), strict=True
    ):
        index.setdefault((ax, ay, half, collider), len(index))
        index.setdefault((bx, by, half, collider), len(index))
    rows = np.asarray(list(index), dtype=np.float64).reshape(-1, 4)
    vertices = np.zeros((len(rows), 7))
    vertices[:, :3], vertices[:, SOLID] = rows[:, :3], 1.0
    return vertices, rows[:, 3].astype(np.int64), index


def _lines(
    static: StaticColliders, ends: dict[tuple[float, float, float, int], int]
) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the lines: planes, and both sides of every segment of non-zero length.

    Returns:
        (F, 15) rows, (F,) collider of each, (F, 2) vertices at its ends, −1 for none.
    """
    rows: list[tuple[float, ...]] = []
    colliders: list[int] = []
    vertices: list[tuple[int, int]] = []
    for (px, py, nx, ny), collider in zip(static.planes.tolist(), static.plane_collider.tolist(), strict=True):
        rows.append((px, py, nx, ny, ny, -nx, np.inf, 0.0))
        colliders.append(collider)
        vertices.append((-1, -1))
    for (ax, ay, bx, by, half), collider in zip(
        static.segments.tolist(), static.segment_collider.tolist(), strict=True
    ):
        dx, dy = bx - ax, by - ay
        length = float(np.hypot(dx, dy))
        if length == 0.0:
            continue
        ux, uy = dx / length, dy / length
        pair = (ends[ax, ay, half, collider], ends[bx, by, half, collider])
        for nx, ny in ((-uy, ux), (uy, -ux)):
            rows.append((ax + half * nx, ay + half * ny, nx, ny, ux, uy, length, half))
            colliders.append(collider)
            vertices.append(pair)
    plain = np.asarray(rows, dtype=np.float64).reshape(-1, 8)
    return (
        np.column_stack((plain, plain[:, LENGTH], np.zeros((len(plain), 6)))),
        np.asarray(colliders, dtype=np.int64),
        np.asarray(vertices, dtype=np.int64).reshape(-1, 2),
    )
