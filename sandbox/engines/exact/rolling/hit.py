"""Hit: what happens when a rolling ball meets another, a cushion, a jaw or a pocket."""

import math

from sandbox.engines.exact.rolling.approach import PRESS
from sandbox.engines.exact.rolling.board import (
    ALONG_X,
    ALONG_Y,
    AT_X,
    AT_Y,
    AX,
    AY,
    BALL,
    BALLS_AS,
    BY_CAPTURE,
    BY_FLOOR,
    COAT,
    CUSHIONS_AS,
    END,
    GAVE_X,
    GAVE_Y,
    HIGH,
    KNOB,
    KX,
    KY,
    LIGHTNESS,
    LINE,
    MASS,
    NOSE,
    NX,
    NY,
    PHASE,
    POCKET,
    RADIUS,
    REACH,
    RECORDING,
    ROWS,
    SURFACE,
    THING,
    VX,
    VY,
    WX,
    WY,
    Board,
    T,
    X,
    Y,
)
from sandbox.engines.exact.rolling.book import book_hit, book_hop, changed
from sandbox.engines.exact.rolling.motion import give, go_on, motion_of, set_off
from sandbox.engines.floor.collide import STILL, meet, rebound
from sandbox.engines.floor.knock import knock
from sandbox.engines.floor.phase import CAPTURED, SLIDING
from sandbox.engines.kernel import bare_kernel as kernel

CUT = 1e-3
"""m/s: hits that are slower lose nothing, so that cascades in clusters end."""

REST = 1e-4
"""m/s: whose centre and whose rim are slower after such a slow hit stays where it is. Let go, it would roll 5e-8 m."""

HOP = 1e-3
"""m/s, with which what presses on is sent off at least: so it hops instead of hitting ever faster. Between balls that
brings up to m·HOP²/4 each time, some 4e-8 J, and a way of 3e-7 m."""


@kernel
def log(
    board: Board, kind: int, a: int, b: int, x: float, y: float, nx: float, ny: float, jx: float, jy: float
) -> None:
    """Write an event down."""
    row = board.counts[ROWS]
    line, what = board.log[row], board.log_what[row]
    line[AT_X], line[AT_Y], line[ALONG_X], line[ALONG_Y], line[GAVE_X], line[GAVE_Y] = x, y, nx, ny, jx, jy
    what[0], what[1], what[2] = kind, a, b
    board.counts[ROWS] += 1


@kernel
def drive(board: Board, i: int, nx: float, ny: float) -> float:
    """Return how much faster along n a ball will be once it rolls, m/s: two sevenths of its slip are its to gain."""
    state = board.state
    if board.tags[i, PHASE] != SLIDING or board.figures.sliding == 0.0:
        return 0.0
    radius = state[i, RADIUS]
    ux, uy = state[i, VX] - radius * state[i, WY], state[i, VY] + radius * state[i, WX]
    return float(-2.0 / 7.0 * (ux * nx + uy * ny))


@kernel
def calm(board: Board, i: int, closing: float) -> None:
    """Lay a ball to rest where a slow hit has left it next to nothing; the floor takes that. It may spin on."""
    state = board.state
    slows = board.figures.sliding if board.figures.pucks else board.figures.rolling
    if closing > CUT or state[i, LIGHTNESS] == 0.0 or slows == 0.0:
        return
    moving = state[i, VX] ** 2 + state[i, VY] ** 2
    rolling = (state[i, WX] ** 2 + state[i, WY] ** 2) * state[i, RADIUS] ** 2
    if moving < REST * REST and rolling < REST * REST:
        board.world[BY_FLOOR] -= 0.5 * state[i, MASS] * (moving + 0.4 * rolling)
        state[i, VX], state[i, VY], state[i, WX], state[i, WY] = 0.0, 0.0, 0.0, 0.0


@kernel
def returns(parting: float, driven: float, pressed: float, lasts: float) -> bool:
    """Tell whether what has just touched and parts would be back at once, again and again, and has to hop.

    It is where the floor, which makes sliding balls roll, drives the two together by more than they part. A hit alone
    does not: of the slip that it makes, less comes back than it parted them by.

    Args:
        parting: m/s.
        driven: how much of that will be lost once both roll, m/s.
        pressed: how fast it is lost now, m/s².
        lasts: for how long at that rate, s.
    """
    if parting >= HOP or pressed <= 2.0 * PRESS:
        return False
    return driven >= parting or pressed * lasts > parting


@kernel
def hit_ball(board: Board, i: int, k: int) -> None:
    """Let two balls, brought to one time, hit each other."""
    state, tags = board.state, board.tags
    dx, dy = state[k, X] - state[i, X], state[k, Y] - state[i, Y]
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    li, lk = state[i, LIGHTNESS], state[k, LIGHTNESS]
    mine, theirs = motion_of(state, i), motion_of(state, k)
    closing = (state[i, VX] - state[k, VX]) * nx + (state[i, VY] - state[k, VY]) * ny
    if closing > 0.0:
        restitution = board.coefficients[0, tags[i, SURFACE], tags[k, SURFACE]] if closing > CUT else 1.0
        if board.figures.pucks:
            friction = board.coefficients[1, tags[i, SURFACE], tags[k, SURFACE]]
            radii = state[i, RADIUS], state[k, RADIUS]
            a, b = knock(restitution, friction, mine, theirs, (li, lk), radii, nx, ny)
        else:
            a, b = meet(board.counts[BALLS_AS], restitution, mine, theirs, (li, lk), state[i, RADIUS], nx, ny)
        give(state, i, a)
        give(state, k, b)
        book_hit(board, i, mine, k, theirs, nx, ny)
        calm(board, i, closing)
        calm(board, k, closing)
    set_off(board, i)
    set_off(board, k)
    parting = (state[k, VX] - state[i, VX]) * nx + (state[k, VY] - state[i, VY]) * ny
    pressed = (state[i, AX] - state[k, AX]) * nx + (state[i, AY] - state[k, AY]) * ny
    driven = drive(board, i, nx, ny) - drive(board, k, nx, ny)
    if returns(parting, driven, pressed, min(state[i, END], state[k, END]) - state[i, T]):
        push = (HOP - parting) / (li + lk)
        book_hop(board, push, parting, HOP)
        state[i, VX] -= push * li * nx
        state[i, VY] -= push * li * ny
        state[k, VX] += push * lk * nx
        state[k, VY] += push * lk * ny
        set_off(board, i)
        set_off(board, k)
    if board.counts[RECORDING] != 0:
        jx, jy = state[i, MASS] * (mine[0] - state[i, VX]), state[i, MASS] * (mine[1] - state[i, VY])
        if li == 0.0:  # what never moves shows nothing
            jx, jy = state[k, MASS] * (state[k, VX] - theirs[0]), state[k, MASS] * (state[k, VY] - theirs[1])
        reach = state[i, RADIUS]
        x, y = state[i, X] + reach * nx, state[i, Y] + reach * ny
        if i < k:
            log(board, BALL, i, k, x, y, nx, ny, jx, jy)
        else:
            log(board, BALL, k, i, x, y, -nx, -ny, -jx, -jy)


@kernel
def hit_line(board: Board, i: int, k: int) -> None:
    """Let a ball hit a plane or the side of a wall."""
    line = board.lines[k]
    hit_cushion(board, i, LINE, board.line_tags[k, THING], board.line_tags[k, COAT], -line[NX], -line[NY], line[NOSE])


@kernel
def hit_knob(board: Board, i: int, k: int) -> None:
    """Let a ball hit a post or the end of a wall."""
    knob = board.knobs[k]
    dx, dy = knob[KX] - board.state[i, X], knob[KY] - board.state[i, Y]
    distance = math.sqrt(dx * dx + dy * dy)
    hit_cushion(
        board, i, KNOB, board.knob_tags[k, THING], board.knob_tags[k, COAT], dx / distance, dy / distance, knob[HIGH]
    )


@kernel
def hit_cushion(board: Board, i: int, kind: int, thing: int, coat: int, nx: float, ny: float, nose: float) -> None:
    """Let a ball hit what is fixed; n points into it. What has no nose is hit at the ball's centre."""
    state, surface = board.state, board.tags[i, SURFACE]
    before_x, before_y, radius = state[i, VX], state[i, VY], state[i, RADIUS]
    height = nose if nose > 0.0 else radius
    closing = before_x * nx + before_y * ny
    if closing > 0.0:
        restitution = board.coefficients[0, surface, coat] if closing > CUT else 1.0
        friction = board.coefficients[1, surface, coat]
        before = motion_of(state, i)
        model, grip = board.counts[CUSHIONS_AS], board.figures.grip
        if board.figures.pucks:
            after, _ = knock(restitution, friction, before, STILL, (state[i, LIGHTNESS], 0.0), (radius, 0.0), nx, ny)
        else:
            after = rebound(model, restitution, friction, grip, before, radius, height, nx, ny)
        give(state, i, after)
        book_hit(board, i, before, -1, before, nx, ny)
        calm(board, i, closing)
    set_off(board, i)
    parting = -(state[i, VX] * nx + state[i, VY] * ny)
    pressed = state[i, AX] * nx + state[i, AY] * ny
    if returns(parting, drive(board, i, nx, ny), pressed, state[i, END] - state[i, T]):
        book_hop(board, (HOP - parting) * state[i, MASS], parting, HOP)
        state[i, VX] -= (HOP - parting) * nx
        state[i, VY] -= (HOP - parting) * ny
        set_off(board, i)
    if board.counts[RECORDING] != 0:
        mass = state[i, MASS]
        jx, jy = mass * (before_x - state[i, VX]), mass * (before_y - state[i, VY])
        log(board, kind, i, -1 - thing, state[i, X] + radius * nx, state[i, Y] + radius * ny, nx, ny, jx, jy)


@kernel
def capture(board: Board, i: int, k: int, solid: int) -> None:
    """Let a ball fall into a pocket, at whose centre it then lies; `solid` is how many fixed things are none."""
    state, hole = board.state, board.pockets[k]
    x, y, vx, vy, mass = state[i, X], state[i, Y], state[i, VX], state[i, VY], state[i, MASS]
    state[i, X], state[i, Y] = hole[KX], hole[KY]
    before = motion_of(state, i)
    give(state, i, (0.0, 0.0, 0.0, 0.0, 0.0))
    along, across = changed(board, i, before, 1.0, 0.0)
    board.world[BY_CAPTURE] += along + across
    go_on(board, i, CAPTURED)
    if board.counts[RECORDING] != 0:
        nx, ny = (hole[KX] - x) / hole[REACH], (hole[KY] - y) / hole[REACH]
        log(board, POCKET, i, -1 - solid - k, x, y, nx, ny, mass * vx, mass * vy)
