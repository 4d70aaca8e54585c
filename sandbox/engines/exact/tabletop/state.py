"""State arrays of balls or pucks on a surface, and the names of their columns.

`TabletopState` holds everything that the kernels read and write. Other modules import this one as `c` and write
`state[i, c.VX]`.

Only an event of a ball rewrites its row; between events it moves by x₀ + v τ + a τ²/2, where τ is the time since its
last. The times of impact of all pairs are kept, and computed again only for the balls of an event.
"""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.exact.common import state as discs
from sandbox.engines.tabletop.collisions import BALL_BALL, CUSHION
from sandbox.engines.tabletop.motion import RESTING, SurfaceFriction, figures_of
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Post, Wall
from sandbox.trajectory import Contacts

T, X, Y, VX, VY, AX, AY, WX, WY, WZ, ROLL_RATE_X, ROLL_RATE_Y, PATH_WIDTH = range(13)
SPIN_DECAY, PHASE_END, ANGLE, RADIUS, MASS, INVERSE_MASS, ENERGY_UNTIL, STATE_COLUMNS = range(12, 20)
"""Columns of `state`; the first PATH_WIDTH describe a segment of a path:

- T: time of the row, s: the ball's own last event. X … AY: position, velocity, acceleration.
- WX, WY, WZ: angular velocity, rad/s. ROLL_RATE_X, ROLL_RATE_Y: rates of WX and WY, rad/s².
- SPIN_DECAY: rate at which |WZ| falls, rad/s². PHASE_END: end of the phase, s. ANGLE: about z, rad.
- RADIUS, m. MASS, kg. INVERSE_MASS, 1/kg: 0 for fixed bodies.
- ENERGY_UNTIL: time up to which the work of the surface is in the energy ledger, s.
"""

PHASE, COLLISION_MASK, SURFACE, TAG_COLUMNS = range(4)
"""Columns of `tags`: phase of the motion; collision mask as in `BodyStore.collision_mask`; row of the material in
`coefficients`."""

PX, PY, NX, NY, UX, UY, LENGTH, LINE_NOSE, LEFT, BOTTOM, RIGHT, TOP = range(12)
"""Columns of `lines`: a point of the surface, m; outward normal; direction along the line; extent from the point, m;
height of the cushion's nose, m, nan for none; bounds, m, infinite for half-planes."""

CENTRE_X, CENTRE_Y, CIRCLE_RADIUS, VERTEX_NOSE = range(4)
"""Columns of `vertices`: centre and radius, m; height of the nose, m, nan for none. The first three are those of
`pockets` too."""

COLLIDER, COLLIDER_SURFACE = discs.COLLIDER, discs.COLLIDER_SURFACE
"""Columns of `line_tags` and `vertex_tags`: index of the static collider; its row in `coefficients`."""

NONE, PHASE_CHANGE, LINE, VERTEX, POCKET, BALL = range(6)
"""Kinds of event, in the order in which simultaneous events of one ball are processed."""

RECORDING, LOG_ROWS, EVENTS, PREDICTIONS = discs.RECORDING, discs.LOG_ROWS, discs.EVENTS, discs.PREDICTIONS
PAIR_TESTS, MAX_EVENTS, ACCOUNTING = discs.PAIR_TESTS, discs.MAX_EVENTS, discs.ACCOUNTING
EVENT_BODY, EVENT_KIND, EVENT_PARTNER = discs.EVENT_BODY, discs.EVENT_KIND, discs.EVENT_PARTNER
RECORDING_PATHS, PATH_ROWS, MOVING, BALL_MODEL, CUSHION_MODEL, COLLIDERS = range(10, 16)
"""Indices of `counts`. Those of `exact.common.state` have the same meaning, but PAIR_TESTS counts pockets too, and
MAX_EVENTS holds for the whole run. RECORDING_PATHS: 1 while paths are recorded. PATH_ROWS: their segments so far.
MOVING: balls that move or spin. BALL_MODEL, CUSHION_MODEL: models of contacts. COLLIDERS: number of static colliders;
in contacts, pocket k is collider COLLIDERS + k."""

BY_FLOOR, BY_MICRO_BOUNCES, BY_CAPTURE = range(3)
NOW, BY_NORMAL, BY_FRICTION, BY_PHANTOM = discs.NOW, discs.BY_NORMAL, discs.BY_FRICTION, discs.BY_PHANTOM
"""Indices of `world`: energy, J, of friction on the surface, of micro-bounces, and lost by capture; the others as in
`exact.common.state`."""

EVENT_TIME, POINT_X, POINT_Y, NORMAL_X, NORMAL_Y, IMPULSE_X, IMPULSE_Y, EVENT_WIDTH = range(8)
"""Columns of `log`: time, s; position, m; normal; impulse of the first body on the second, N·s."""


INSIDE_TOLERANCE = 1e-12
"""m: tolerance for a vertex inside a larger one; the end of a wall at a post lies on the post's rim up to rounding."""


class TabletopState(NamedTuple):
    """State of N balls, L lines, K vertices and P pockets.

    Lines are planes and both sides of wall segments; vertices are posts and the ends of segments.
    """

    state: FloatArray
    """(N, 19)"""
    tags: IntArray
    """(N, 3)"""
    own_time: FloatArray
    """(N,) time of the next event of each ball without another ball, s"""
    own_event: IntArray
    """(N, 2) its kind and partner"""
    pair_time: FloatArray
    """(N, N) time of impact of each pair, s; symmetric"""
    pair_best: FloatArray
    """(N,) earliest of each row, s"""
    pair_partner: IntArray
    """(N,) the other ball of it"""
    coefficients: FloatArray
    """(2, S, S) restitution and friction of each pair of surfaces"""
    lines: FloatArray
    """(L, 12)"""
    line_tags: IntArray
    """(L, 2)"""
    vertices: FloatArray
    """(K, 4)"""
    vertex_tags: IntArray
    """(K, 2)"""
    pockets: FloatArray
    """(P, 3) centre and radius, m"""
    floor: SurfaceFriction
    world: FloatArray
    """(10,)"""
    counts: IntArray
    """(16,)"""
    log: FloatArray
    """(C, 7)"""
    log_tags: IntArray
    """(C, 3) kind and the pair of each event, as in `Contacts`; for a change of phase, the ball and its new phase"""
    path: FloatArray
    """(M, 12) first columns of `state` at the start of each path segment"""
    path_tags: IntArray
    """(M, 2) ball and phase of each segment"""


def make_tabletop_state(store: BodyStore) -> TabletopState:
    """Return the state arrays of a body store at time 0, with nothing predicted."""
    count, scene = len(store.bodies), store.scene
    plain = discs.make_state(store)
    heights = _nose_heights(scene)
    vertices = _with_heights(plain, heights)
    exposed = _exposed_of(scene)
    lines = np.empty((len(plain.lines), TOP + 1))
    lines[:, :LINE_NOSE] = plain.lines[:, :LINE_NOSE]
    lines[:, LINE_NOSE] = heights[plain.line_tags[:, 0]]
    lines[:, LEFT:] = _line_boxes(lines)
    state = np.zeros((count, STATE_COLUMNS))
    state[:, X : Y + 1], state[:, VX : VY + 1] = store.position, store.velocity
    state[:, WX : WY + 1], state[:, WZ], state[:, ANGLE] = store.roll, store.angular_velocity, store.angle
    state[:, PHASE_END] = np.inf
    tags = np.zeros((count, TAG_COLUMNS), np.int64)
    tags[:, PHASE] = RESTING
    models = scene.contact_models
    counts = np.zeros(16, np.int64)
    counts[BALL_MODEL] = BALL_BALL[models.ball_ball]
    counts[CUSHION_MODEL] = CUSHION[models.cushion]
    counts[COLLIDERS] = len(scene.fixed)
    data = TabletopState(
        state=state,
        tags=tags,
        own_time=np.full(count, np.inf),
        own_event=np.zeros((count, 2), np.int64),
        pair_time=np.full((count, count), np.inf),
        pair_best=np.full(count, np.inf),
        pair_partner=np.zeros(count, np.int64),
        coefficients=np.empty((2, 0, 0)),
        lines=lines,
        line_tags=plain.line_tags[:, :2].copy(),
        vertices=np.ascontiguousarray(vertices[exposed]),
        vertex_tags=plain.vertex_tags[exposed],
        pockets=np.asarray([[*p.position, p.radius] for p in scene.pockets], dtype=np.float64).reshape(-1, 3),
        floor=figures_of(scene.surface),
        world=np.zeros(BY_PHANTOM + 1),
        counts=counts,
        log=np.empty((0, EVENT_WIDTH)),
        log_tags=np.empty((0, 3), np.int64),
        path=np.empty((0, PATH_WIDTH)),
        path_tags=np.empty((0, 2), np.int64),
    )
    return rebuild(data, store)


def rebuild(data: TabletopState, store: BodyStore) -> TabletopState:
    """Return the state with the bodies, masses and surfaces that the store now has.

    New bodies are appended.
    """
    added = len(store.bodies) - len(data.state)
    if added:
        fresh = make_tabletop_state(store)
        grown = {
            name: getattr(fresh, name) for name in ("own_time", "own_event", "pair_time", "pair_best", "pair_partner")
        }
        for name in ("state", "tags"):
            grown[name] = np.concatenate((getattr(data, name), getattr(fresh, name)[-added:]))
        data = data._replace(**grown)
    state, tags = data.state, data.tags
    state[:, RADIUS], state[:, MASS], state[:, INVERSE_MASS] = store.radius, store.bodies.mass, store.inverse_mass
    floor = figures_of(store.scene.surface)
    state[:, SPIN_DECAY] = floor.spinning / state[:, RADIUS]
    tags[:, COLLISION_MASK], tags[:, SURFACE] = store.collision_mask, store.surface
    for collider_tags in (data.line_tags, data.vertex_tags):
        collider_tags[:, COLLIDER_SURFACE] = store.fixed_surface[collider_tags[:, COLLIDER]]
    coefficients = np.stack((store.restitution, store.friction))
    return data._replace(coefficients=coefficients, floor=floor)


def contacts_of(log: FloatArray, tags: IntArray) -> Contacts:
    """Return the contacts among logged events; changes of phase are left out.

    Args:
        log: (C, 7) as `TabletopState.log`.
        tags: (C, 3) as `TabletopState.log_tags`.
    """
    touched = np.flatnonzero(tags[:, 0] > PHASE_CHANGE)
    log = log[touched]
    return Contacts(
        log[:, EVENT_TIME].copy(),
        tags[touched, 1:].copy(),
        log[:, POINT_X : POINT_X + 2].copy(),
        log[:, NORMAL_X : NORMAL_X + 2].copy(),
        log[:, IMPULSE_X : IMPULSE_X + 2].copy(),
    )


def _line_boxes(lines: FloatArray) -> FloatArray:
    """Return the left, bottom, right and top bounds of lines (L, 4), m; infinite for half-planes."""
    begin, extent = lines[:, PX : PY + 1], lines[:, LENGTH, None]
    with np.errstate(invalid="ignore"):  # 0 · ∞
        end = begin + lines[:, UX : UY + 1] * extent
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    is_infinite = np.isinf(extent)
    return np.column_stack((np.where(is_infinite, -np.inf, low), np.where(is_infinite, np.inf, high)))


def exposed_vertices(vertices: FloatArray) -> IntArray:
    """Return the indices of the vertices (K, 4) that can be touched: not inside another, and one of equal ones."""
    exposed: list[int] = []
    for k in np.argsort(-vertices[:, CIRCLE_RADIUS], kind="stable").tolist():
        distance = np.hypot(*(vertices[exposed, :2] - vertices[k, :2]).T)
        if not (distance + vertices[k, CIRCLE_RADIUS] <= vertices[exposed, CIRCLE_RADIUS] + INSIDE_TOLERANCE).any():
            exposed.append(k)
    return np.sort(np.asarray(exposed, dtype=np.int64))


@derived_once
def _exposed_of(setup: Setup) -> IntArray:
    """Return the exposed vertices of a scene."""
    return exposed_vertices(discs.vertices_of(setup.scene))


def _with_heights(plain: discs.EventState, heights: FloatArray) -> FloatArray:
    """Return the vertices (K, 4) with the heights of their colliders (F,), m."""
    return np.column_stack((plain.vertices[:, :3], heights[plain.vertex_tags[:, 0]] if len(plain.vertices) else []))


def _nose_heights(scene: Scene) -> FloatArray:
    """Return the height of each static collider's nose, m, nan for none."""
    heights = [each.height if isinstance(each, Wall | Post) else None for each in scene.fixed]
    return np.asarray([np.nan if height is None else height for height in heights], dtype=np.float64)
