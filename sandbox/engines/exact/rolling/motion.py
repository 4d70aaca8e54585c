"""Motion: where a rolling ball is, and how it goes on."""

import math

from sandbox.engines.exact.rolling.board import (
    ANGLE,
    AWAKE,
    AX,
    AY,
    BX,
    BY,
    END,
    FALL,
    LIGHTNESS,
    PHASE,
    RADIUS,
    STEPS,
    VX,
    VY,
    WX,
    WY,
    WZ,
    Board,
    T,
    X,
    Y,
)
from sandbox.engines.floor.collide import Five
from sandbox.engines.floor.phase import CAPTURED, GLIDING, RESTING, ROLLING, SLIDING, SPINNING, fallen, phase_of, rates
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import FloatArray


@kernel
def turned(state: FloatArray, i: int, t: float) -> float:
    """Return a ball's angle about z at a time, rad: its spin falls, and stops at nothing."""
    wz, fall = state[i, WZ], state[i, FALL]
    dt = t - state[i, T]
    if fall > 0.0:
        dt = min(dt, abs(wz) / fall)
    return float(state[i, ANGLE] + (wz - math.copysign(0.5 * fall * dt, wz)) * dt)


@kernel
def bring(state: FloatArray, i: int, t: float) -> None:
    """Bring a ball's row to a time within its phase."""
    dt = t - state[i, T]
    state[i, ANGLE] = turned(state, i, t)
    ax, ay = state[i, AX], state[i, AY]
    state[i, X] += (state[i, VX] + 0.5 * ax * dt) * dt
    state[i, Y] += (state[i, VY] + 0.5 * ay * dt) * dt
    state[i, VX] += ax * dt
    state[i, VY] += ay * dt
    state[i, WX] += state[i, BX] * dt
    state[i, WY] += state[i, BY] * dt
    state[i, WZ] = fallen(state[i, WZ], state[i, FALL] * dt)
    state[i, T] = t


@kernel
def give(state: FloatArray, i: int, motion: Five) -> None:
    """Give a ball a velocity and a spin."""
    state[i, VX], state[i, VY], state[i, WX], state[i, WY], state[i, WZ] = motion


@kernel
def motion_of(state: FloatArray, i: int) -> Five:
    """Return a ball's velocity and spin at its own time."""
    return state[i, VX], state[i, VY], state[i, WX], state[i, WY], state[i, WZ]


@kernel
def go_on(board: Board, i: int, phase: int) -> None:
    """Let a ball go on from its own time in a phase."""
    state, tags, counts = board.state, board.tags, board.counts
    vx, vy, wx, wy, wz = motion_of(state, i)
    ax, ay, bx, by, lasts = rates(phase, vx, vy, wx, wy, wz, state[i, RADIUS], board.figures)
    state[i, AX], state[i, AY], state[i, BX], state[i, BY] = ax, ay, bx, by
    state[i, END] = state[i, T] + lasts
    was, now = tags[i, PHASE], phase
    # As whole numbers: numpy's truths, which these are where nothing is compiled, cannot be subtracted.
    counts[AWAKE] += int(now not in (RESTING, CAPTURED)) - int(was not in (RESTING, CAPTURED))
    tags[i, PHASE] = phase


@kernel
def trace(board: Board, i: int) -> None:
    """Write down how a ball goes on from its own time."""
    row = board.counts[STEPS]
    for column in range(T, BY + 1):
        board.path[row, column] = board.state[i, column]
    board.path_what[row, 0], board.path_what[row, 1] = i, board.tags[i, PHASE]
    board.counts[STEPS] += 1


@kernel
def set_off(board: Board, i: int) -> None:
    """Let a ball go on as its velocity and spin say."""
    state = board.state
    if state[i, LIGHTNESS] > 0.0:
        vx, vy, wx, wy, wz = motion_of(state, i)
        go_on(board, i, phase_of(vx, vy, wx, wy, wz, state[i, RADIUS], board.figures.pucks))


@kernel
def end_phase(board: Board, i: int) -> None:
    """Let a ball, brought to the end of its phase, go on in the next, with what is over at exactly nothing."""
    state, phase = board.state, board.tags[i, PHASE]
    if phase == SLIDING:
        state[i, WX], state[i, WY] = -state[i, VY] / state[i, RADIUS], state[i, VX] / state[i, RADIUS]
        if state[i, VX] != 0.0 or state[i, VY] != 0.0:
            go_on(board, i, ROLLING)
            return
    elif phase in (ROLLING, GLIDING):
        state[i, VX], state[i, VY], state[i, WX], state[i, WY] = 0.0, 0.0, 0.0, 0.0
    else:
        state[i, WZ] = 0.0
    go_on(board, i, SPINNING if state[i, WZ] != 0.0 else RESTING)


@kernel
def evaluate(
    board: Board,
    t: float,
    position: FloatArray,
    velocity: FloatArray,
    roll: FloatArray,
    angle: FloatArray,
    spin: FloatArray,
) -> None:
    """Write down how every ball moves at a time; their rows stay as they are."""
    state = board.state
    for i in range(len(state)):
        if state[i, LIGHTNESS] == 0.0:
            continue
        dt = t - state[i, T]
        ax, ay = state[i, AX], state[i, AY]
        position[i, 0] = state[i, X] + (state[i, VX] + 0.5 * ax * dt) * dt
        position[i, 1] = state[i, Y] + (state[i, VY] + 0.5 * ay * dt) * dt
        velocity[i, 0], velocity[i, 1] = state[i, VX] + ax * dt, state[i, VY] + ay * dt
        roll[i, 0], roll[i, 1] = state[i, WX] + state[i, BX] * dt, state[i, WY] + state[i, BY] * dt
        angle[i], spin[i] = turned(state, i, t), fallen(state[i, WZ], state[i, FALL] * dt)
