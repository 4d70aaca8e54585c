"""Board: all that the kernels of rolling balls read and write, as one tuple of arrays.

A ball's row is written at its own events only; between them it moves by x₀ + v τ + a τ²/2, τ counted from the last.
When which two meet, and when each meets what is fixed, is kept, and sought anew only for those whom an event touches.
"""

from typing import NamedTuple

import numpy as np

from sandbox.engines.exact.arena import BY_PHANTOM, HALF, arena_of
from sandbox.engines.floor.collide import BALL_BALL, CUSHION
from sandbox.engines.floor.phase import RESTING, Figures, figures_of
from sandbox.engines.roster import Roster
from sandbox.scene.model import Post, Scene, Wall
from sandbox.trajectory import FloatArray, IntArray

T, X, Y, VX, VY, AX, AY, WX, WY, WZ, BX, BY, FALL, END, ANGLE, RADIUS, MASS, LIGHTNESS, BOOKED, WIDTH = range(20)
"""Columns of `state`: a ball's own time, s; place, velocity, acceleration; spin about three axes, the rates of the
first two, and that at which the third falls; when its phase ends; angle; radius, m; mass; 1/mass, 0 for what never
moves; up to when the floor's work is in the account."""

PHASE, MEETS, SURFACE, TAGS = range(4)
"""Columns of `tags`: phase; what it meets, as in the roster; its surface."""

PX, PY, NX, NY, UX, UY, LENGTH, NOSE = range(8)
"""Columns of `lines`: a point of the surface, the normal out of it, the direction along it, how far it goes from the
point, and the height of its nose, m."""

KX, KY, REACH, HIGH = range(4)
"""Columns of `knobs`: centre and radius, height of the nose, m."""

THING, COAT = range(2)
"""Columns of `line_tags` and `knob_tags`: fixed thing, surface."""

NONE, PHASE_ENDS, LINE, KNOB, POCKET, BALL = range(6)
"""Kinds of event, in the order in which those of one ball at one instant happen."""

RECORDING, ROWS, TRACING, STEPS, EVENTS, PREDICTIONS, PAIR_TESTS, AWAKE = range(8)
WHO, WHAT, WITH, LIMIT, BALLS_AS, CUSHIONS_AS, SOLID, ACCOUNTING = range(8, 16)
"""Places of `counts`: whether events are logged, and how many rows there are; whether motions are, and how many; events
so far; how often balls looked ahead, and at how much; how many move or turn; the last event's ball, kind and partner;
how many events there may be; the models of contacts."""

NOW, BY_FLOOR, BY_HOPS, BY_CAPTURE = range(4)
"""Places of `world`: time of the last event, s; energy, J, that the floor took, that hops gave, that fell into
pockets; then, where `engines.exact.booking` has them, what hits took along normals and by rubbing, and gave."""

EVENT_TIME, AT_X, AT_Y, ALONG_X, ALONG_Y, GAVE_X, GAVE_Y, EVENT_WIDTH = range(8)
"""Columns of `log`: time, place, normal, impulse given by the first to the second."""


WITHIN = 1e-12
"""m: a wall that ends where a post begins ends on its rim, but for rounding."""


class Board(NamedTuple):
    """N balls, L lines (planes, and each wall segment's two sides), K knobs (posts, segments' ends), P pockets."""

    state: FloatArray
    """(N, 19)"""
    tags: IntArray
    """(N, 3)"""
    alone_time: FloatArray
    """(N,) when each has its next event without another ball, s"""
    alone_what: IntArray
    """(N, 2) kind and partner of it"""
    pair_time: FloatArray
    """(N, N) when each two meet, s; symmetric"""
    pair_best: FloatArray
    """(N,) the earliest of each row"""
    pair_who: IntArray
    """(N,) with whom"""
    coefficients: FloatArray
    """(2, S, S) restitution and friction"""
    lines: FloatArray
    """(L, 8)"""
    line_tags: IntArray
    """(L, 2)"""
    knobs: FloatArray
    """(K, 4)"""
    knob_tags: IntArray
    """(K, 2)"""
    pockets: FloatArray
    """(P, 3) centre and radius, m"""
    figures: Figures
    world: FloatArray
    """(10,)"""
    counts: IntArray
    """(16,)"""
    log: FloatArray
    """(C, 7)"""
    log_what: IntArray
    """(C, 3) kind, the two concerned: of a phase that ends, the ball and its next phase; else as in `Contacts`"""
    path: FloatArray
    """(M, 12) of each motion that begins: its columns of `state`"""
    path_what: IntArray
    """(M, 2) ball and phase"""


def board_of(roster: Roster) -> Board:
    """Lay out a roster as it stands at time 0; nothing is predicted yet."""
    number, scene = len(roster.bodies), roster.scene
    plain = arena_of(roster)
    heights = _heights(scene)
    knobs = np.column_stack(
        (plain.knobs[:, :3], heights[plain.knob_tags[:, 0]] if len(plain.knobs) else np.empty((0,)))
    )
    bare = exposed(knobs)
    lines = plain.flats[:, : HALF + 1].copy()
    lines[:, NOSE] = heights[plain.flat_tags[:, 0]]
    state = np.zeros((number, WIDTH))
    state[:, X : Y + 1], state[:, VX : VY + 1] = roster.position, roster.velocity
    state[:, WX : WY + 1], state[:, WZ], state[:, ANGLE] = roster.roll, roster.angular_velocity, roster.angle
    state[:, END] = np.inf
    tags = np.zeros((number, TAGS), np.int64)
    tags[:, PHASE] = RESTING
    models = scene.contact_models
    counts = np.zeros(16, np.int64)
    counts[BALLS_AS] = BALL_BALL[models.ball_ball]
    counts[CUSHIONS_AS] = CUSHION[models.cushion]
    counts[SOLID] = len(scene.fixed)
    board = Board(
        state=state,
        tags=tags,
        alone_time=np.full(number, np.inf),
        alone_what=np.zeros((number, 2), np.int64),
        pair_time=np.full((number, number), np.inf),
        pair_best=np.full(number, np.inf),
        pair_who=np.zeros(number, np.int64),
        coefficients=np.empty((2, 0, 0)),
        lines=lines,
        line_tags=plain.flat_tags[:, :2].copy(),
        knobs=np.ascontiguousarray(knobs[bare]),
        knob_tags=plain.knob_tags[bare],
        pockets=np.asarray([[*p.position, p.radius] for p in scene.pockets], dtype=np.float64).reshape(-1, 3),
        figures=figures_of(scene.surface),
        world=np.zeros(BY_PHANTOM + 1),
        counts=counts,
        log=np.empty((0, EVENT_WIDTH)),
        log_what=np.empty((0, 3), np.int64),
        path=np.empty((0, BY + 1)),
        path_what=np.empty((0, 2), np.int64),
    )
    return renewed(board, roster)


def renewed(board: Board, roster: Roster) -> Board:
    """Return the board with what may have changed in a roster: who there is, and what of."""
    more = len(roster.bodies) - len(board.state)
    if more:
        fresh = board_of(roster)
        grown = {
            name: getattr(fresh, name) for name in ("alone_time", "alone_what", "pair_time", "pair_best", "pair_who")
        }
        for name in ("state", "tags"):
            grown[name] = np.concatenate((getattr(board, name), getattr(fresh, name)[-more:]))
        board = board._replace(**grown)
    state, tags = board.state, board.tags
    state[:, RADIUS], state[:, MASS], state[:, LIGHTNESS] = roster.radius, roster.bodies.mass, roster.inverse_mass
    state[:, FALL] = board.figures.spinning / state[:, RADIUS]
    tags[:, MEETS], tags[:, SURFACE] = roster.meets, roster.surface
    for things in (board.line_tags, board.knob_tags):
        things[:, COAT] = roster.fixed_surface[things[:, THING]]
    return board._replace(coefficients=np.stack((roster.restitution, roster.friction)))


def exposed(knobs: FloatArray) -> IntArray:
    """Return which of K knobs (K, 4) can be touched at all: none that lies within another, and one of those alike."""
    kept: list[int] = []
    for k in np.argsort(-knobs[:, REACH], kind="stable").tolist():
        apart = np.hypot(*(knobs[kept, :2] - knobs[k, :2]).T)
        if not (apart + knobs[k, REACH] <= knobs[kept, REACH] + WITHIN).any():
            kept.append(k)
    return np.sort(np.asarray(kept, dtype=np.int64))


def _heights(scene: Scene) -> FloatArray:
    """Return the height of each fixed thing's nose, m; of what has none, nan."""
    heights = [thing.height if isinstance(thing, Wall | Post) else None for thing in scene.fixed]
    return np.asarray([np.nan if height is None else height for height in heights], dtype=np.float64)
