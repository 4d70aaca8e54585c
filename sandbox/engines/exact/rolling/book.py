"""Book: what each hit, and the floor, took of the energy, or gave.

An impulse J changes the energy by J times the mean of the velocities before and after it where it acts. Nothing here
touches how anything moves.
"""

from sandbox.engines.exact.booking import touch
from sandbox.engines.exact.rolling.board import (
    ACCOUNTING,
    BOOKED,
    BY_FLOOR,
    BY_HOPS,
    LIGHTNESS,
    MASS,
    PHASE,
    RADIUS,
    VX,
    VY,
    WX,
    WY,
    WZ,
    Board,
    T,
)
from sandbox.engines.exact.rolling.motion import bring
from sandbox.engines.floor.collide import Five
from sandbox.engines.floor.phase import GLIDING, ROLLING, SLIDING, fallen
from sandbox.engines.kernel import bare_kernel as kernel


@kernel
def changed(board: Board, i: int, before: Five, nx: float, ny: float) -> tuple[float, float]:
    """Return the energy that a hit brought one ball, along its normal and by rubbing, J."""
    state = board.state
    if state[i, LIGHTNESS] == 0.0:
        return 0.0, 0.0
    vx, vy, wx, wy, wz = before
    mass, inertia = state[i, MASS], board.figures.inertia * state[i, MASS] * state[i, RADIUS] ** 2
    out, was = state[i, VX] * nx + state[i, VY] * ny, vx * nx + vy * ny
    left, had = state[i, VY] * nx - state[i, VX] * ny, vy * nx - vx * ny
    turning = (
        (state[i, WX] - wx) * (state[i, WX] + wx)
        + (state[i, WY] - wy) * (state[i, WY] + wy)
        + (state[i, WZ] - wz) * (state[i, WZ] + wz)
    )
    return 0.5 * mass * (out - was) * (out + was), 0.5 * mass * (left - had) * (left + had) + 0.5 * inertia * turning


@kernel
def book_hit(board: Board, i: int, mine: Five, k: int, theirs: Five, nx: float, ny: float) -> None:
    """Book a hit between two balls, of which it is known how they moved before; k is −1 where there is but one."""
    if board.counts[ACCOUNTING] == 0:
        return
    along, across = changed(board, i, mine, nx, ny)
    if k >= 0:
        more, rubbed = changed(board, k, theirs, nx, ny)
        along, across = along + more, across + rubbed
    touch(board.world, along, across)


@kernel
def book_hop(board: Board, push: float, parting: float, hop: float) -> None:
    """Book a push, N·s, along a normal that made two part faster."""
    if board.counts[ACCOUNTING] != 0:
        board.world[BY_HOPS] += 0.5 * push * (parting + hop)


@kernel
def floor_work(board: Board, i: int, t: float) -> float:
    """Return what the floor brought a ball from when it was booked up to a time within its phase, J.

    Friction times the way slipped, in closed form; rolling resistance slows a ball and its turning alike.
    """
    state, floor = board.state, board.figures
    begin, end = state[i, BOOKED] - state[i, T], t - state[i, T]
    middle, span = 0.5 * (begin + end), end - begin
    mass, radius = state[i, MASS], state[i, RADIUS]
    took = 0.0
    phase = board.tags[i, PHASE]
    if phase == SLIDING:
        ux, uy = state[i, VX] - radius * state[i, WY], state[i, VY] + radius * state[i, WX]
        took = mass * floor.sliding * ((ux * ux + uy * uy) ** 0.5 - 3.5 * floor.sliding * middle) * span
    elif phase == ROLLING:
        speed = (state[i, VX] ** 2 + state[i, VY] ** 2) ** 0.5
        took = 1.4 * mass * floor.rolling * (speed - floor.rolling * middle) * span
    elif phase == GLIDING:
        speed = (state[i, VX] ** 2 + state[i, VY] ** 2) ** 0.5
        took = mass * floor.sliding * (speed - floor.sliding * middle) * span
    fall = floor.spinning / radius
    first, last = fallen(state[i, WZ], fall * begin), fallen(state[i, WZ], fall * end)
    return float(-took - 0.5 * floor.inertia * mass * radius * radius * (first - last) * (first + last))


@kernel
def arrive(board: Board, i: int, t: float) -> None:
    """Bring a ball to a time, and book what the floor took until then."""
    if board.counts[ACCOUNTING] != 0:
        if board.state[i, LIGHTNESS] > 0.0:
            board.world[BY_FLOOR] += floor_work(board, i, t)
        board.state[i, BOOKED] = t
    bring(board.state, i, t)


@kernel
def arrive_all(board: Board, t: float) -> None:
    """Do so for every ball; none has an event left before."""
    for i in range(len(board.state)):
        arrive(board, i, t)


@kernel
def book_floor(board: Board, t: float) -> None:
    """Book what the floor took of every ball up to a time."""
    for i in range(len(board.state)):
        if board.state[i, LIGHTNESS] > 0.0:
            board.world[BY_FLOOR] += floor_work(board, i, t)
        board.state[i, BOOKED] = t
