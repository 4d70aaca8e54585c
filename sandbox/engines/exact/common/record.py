"""Contact log and energy accounting of the event-driven simulation.

An impulse J changes the kinetic energy by J times the mean of the velocities before and after it, taken at the point
where it acts. The mean is the velocity after it minus half of the change. The kernels of the accounting run after a
collision and never write to `state`, except for the two columns `ENERGY_UNTIL` and `ENERGY_RESIDUAL`.
"""

from typing import TypeVar

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.exact.common import state as c
from sandbox.engines.exact.common.state import EventState
from sandbox.trajectory import Contacts

Rows = TypeVar("Rows", FloatArray, IntArray)

ROWS_PER_EVENT = 16
"""Upper bound of the log rows that one event adds."""


@kernel
def add_row(data: EventState, first: int, second: int, px: float, py: float, nx: float, ny: float) -> int:
    """Add a contact with zero impulse to the log and return its row, or −1 if contacts are not recorded.

    Args:
        data: state arrays.
        first: index of the first body; of two balls the lower.
        second: index of the other ball, or −1 − k for static collider k.
        px: contact point, m.
        py: likewise.
        nx: normal from the first to the second.
        ny: likewise.
    """
    if data.counts[c.RECORDING] == 0:
        return -1
    row: int = data.counts[c.LOG_ROWS]
    log, pair = data.log, data.log_pair
    log[row, 0], log[row, 1], log[row, 2], log[row, 3], log[row, 4] = data.world[c.NOW], px, py, nx, ny
    log[row, 5], log[row, 6] = 0.0, 0.0
    pair[row, 0], pair[row, 1] = first, second
    data.counts[c.LOG_ROWS] = row + 1
    return row


@kernel
def open_support_row(data: EventState, i: int, slot: int) -> None:
    """Add a log row for the support in a slot; two supports that are sides of one collider share a row."""
    f = data.tags[i, c.SUPPORT + slot]
    other = data.tags[i, c.SUPPORT + 1 - slot]
    if other >= 0 and data.line_tags[other, c.COLLIDER] == data.line_tags[f, c.COLLIDER]:
        data.tags[i, c.LOG_ROW + slot] = data.tags[i, c.LOG_ROW + 1 - slot]
        return
    nx, ny, r = data.lines[f, c.NX], data.lines[f, c.NY], data.state[i, c.RADIUS]
    x, y = data.state[i, c.X], data.state[i, c.Y]
    data.tags[i, c.LOG_ROW + slot] = add_row(
        data, i, -1 - data.line_tags[f, c.COLLIDER], x - r * nx, y - r * ny, -nx, -ny
    )


@kernel
def add_impulse(data: EventState, row: int, jx: float, jy: float) -> None:
    """Add an impulse, N·s, of the first body on the second to a log row; row −1 is ignored."""
    if row >= 0:
        data.log[row, 5] += jx
        data.log[row, 6] += jy


@kernel
def log_support(state: FloatArray, tags: IntArray, log: FloatArray, i: int, t: float) -> None:
    """Add the impulses of a ball on its supports since `LOGGED_UNTIL` to the log, up to a time, s."""
    span = t - state[i, c.LOGGED_UNTIL]
    state[i, c.LOGGED_UNTIL] = t
    for slot in range(2):
        row = tags[i, c.LOG_ROW + slot]
        if row >= 0 and span > 0.0:
            log[row, 5] -= state[i, c.SUPPORT_FORCE + 2 * slot] * span
            log[row, 6] -= state[i, c.SUPPORT_FORCE + 2 * slot + 1] * span


@kernel
def log_supports(data: EventState, t: float) -> None:
    """Add the impulses of all balls on their supports to the log, up to a time, s."""
    for k in range(len(data.moving_balls)):
        log_support(data.state, data.tags, data.log, data.moving_balls[k], t)


def resize_rows(array: Rows, used: int, rows: int) -> Rows:
    """Return an array with another number of rows and the same first `used` rows; the other rows are not set."""
    resized: Rows = np.empty((rows, *array.shape[1:]), array.dtype)
    resized[:used] = array[:used]
    return resized


def with_log_rows(data: EventState, rows: int) -> EventState:
    """Return the state with room for the given number of log rows."""
    used = int(data.counts[c.LOG_ROWS])
    return data._replace(log=resize_rows(data.log, used, rows), log_pair=resize_rows(data.log_pair, used, rows))


def drain_log(data: EventState) -> Contacts:
    """Return all logged contacts and clear the log; rows of active supports stay, with zero impulse."""
    rows = int(data.counts[c.LOG_ROWS])
    log, pair = data.log[:rows].copy(), data.log_pair[:rows].copy()
    support_rows = data.tags[:, c.LOG_ROW : c.LOG_ROW + 2]
    still_open = np.unique(support_rows[support_rows >= 0])
    support_rows[support_rows >= 0] = np.searchsorted(still_open, support_rows[support_rows >= 0])
    open_count = len(still_open)
    data.log[:open_count], data.log_pair[:open_count] = log[still_open], pair[still_open]
    data.log[:open_count, 5:] = 0.0
    data.counts[c.LOG_ROWS] = open_count
    return Contacts(log[:, 0].copy(), pair, log[:, 1:3].copy(), log[:, 3:5].copy(), log[:, 5:7].copy())


@kernel
def account_energy(world: FloatArray, column: int, energy: float) -> None:
    """Add an energy change, J, to a cause of `world`; a positive change is phantom energy."""
    if energy > 0.0:
        world[c.BY_PHANTOM] += energy
    else:
        world[column] += energy


@kernel
def account_contact(world: FloatArray, along: float, across: float) -> None:
    """Add the energy changes of a collision along its normal and tangent, J, as `EnergyLedger.add_contacts` does."""
    both = along + across
    if both > 0.0:
        world[c.BY_PHANTOM] += both
    elif along > 0.0:
        world[c.BY_FRICTION] += both
    elif across > 0.0:
        world[c.BY_NORMAL] += both
    else:
        world[c.BY_NORMAL] += along
        world[c.BY_FRICTION] += across


@kernel
def rim_speed(state: FloatArray, i: int) -> float:
    """Return the speed of a ball's rim due to its spin, m/s; 0 for a ball that cannot rotate."""
    if state[i, c.INVERSE_INERTIA] > 0.0:
        return float(state[i, c.SPIN] * state[i, c.RADIUS])
    return 0.0


@kernel
def inverse_mass_at_rim(state: FloatArray, i: int) -> float:
    """Return the inverse effective mass of a ball for tangential impulses at its rim, 1/kg: 1/m + r²/I."""
    return float(state[i, c.INVERSE_MASS] + state[i, c.RADIUS] * state[i, c.RADIUS] * state[i, c.INVERSE_INERTIA])


@kernel
def account_hit(data: EventState, i: int, j: int, jx: float, jy: float, nx: float, ny: float) -> None:
    """Add the energy change of a collision of two balls to the ledger.

    Args:
        data: state arrays after the collision.
        i: ball.
        j: ball.
        jx: impulse of i on j, N·s.
        jy: likewise.
        nx: normal from i to j.
        ny: likewise.
    """
    state, world = data.state, data.world
    normal, tangential = jx * nx + jy * ny, jy * nx - jx * ny
    vx, vy = state[j, c.VX] - state[i, c.VX], state[j, c.VY] - state[i, c.VY]
    separation = vx * nx + vy * ny
    along = normal * (separation - 0.5 * normal * (state[i, c.INVERSE_MASS] + state[j, c.INVERSE_MASS]))
    across = 0.0  # without friction `tangential` is rounding error
    if data.surfaces[c.FRICTION, data.tags[i, c.SURFACE], data.tags[j, c.SURFACE]] > 0.0:
        slip = vy * nx - vx * ny - (rim_speed(state, i) + rim_speed(state, j))
        slip_target = data.surfaces[c.SLIP_TARGET, data.tags[i, c.SURFACE], data.tags[j, c.SURFACE]]
        across = tangential * (
            slip - slip_target - 0.5 * tangential * (inverse_mass_at_rim(state, i) + inverse_mass_at_rim(state, j))
        )
        world[c.BY_SURFACES] += tangential * slip_target
    account_contact(world, along, across)


@kernel
def account_fixed_hit(
    data: EventState,
    i: int,
    nx: float,
    ny: float,
    normal: float,
    across: float,
    kick: float,
    slip_target: float,
) -> None:
    """Add the energy change of a collision with a static collider to the ledger.

    Args:
        data: state arrays after the collision.
        i: ball.
        nx: normal out of the collider.
        ny: likewise.
        normal: normal impulse on the ball, N·s.
        across: tangential impulse on the ball, N·s, positive to the left of the normal.
        kick: energy from the kick, J.
        slip_target: velocity of the ball's rim along the surface without slip, m/s.
    """
    state, world = data.state, data.world
    normal_velocity = state[i, c.VX] * nx + state[i, c.VY] * ny
    slip = state[i, c.VY] * nx - state[i, c.VX] * ny - rim_speed(state, i) - slip_target
    tangential_work = across * (slip - 0.5 * across * inverse_mass_at_rim(state, i))
    account_contact(world, normal * (normal_velocity - 0.5 * normal * state[i, c.INVERSE_MASS]) - kick, tangential_work)
    world[c.BY_KICKS] += kick
    world[c.BY_SURFACES] += across * slip_target


@kernel
def account_velocity(data: EventState, i: int, vx: float, vy: float) -> None:
    """Add the energy change of setting a supported ball's velocity, m/s; call it before the change."""
    if data.counts[c.ACCOUNTING] != 0:
        state = data.state
        dx, dy = vx - state[i, c.VX], vy - state[i, c.VY]
        mean = dx * (vx + state[i, c.VX]) + dy * (vy + state[i, c.VY])
        account_energy(data.world, c.BY_NORMAL, 0.5 * mean / state[i, c.INVERSE_MASS])


@kernel
def account_spin(data: EventState, i: int, spin: float) -> None:
    """Add the energy change of setting a ball's spin by friction, rad/s; call it before the change."""
    if data.counts[c.ACCOUNTING] != 0 and data.state[i, c.INVERSE_INERTIA] > 0.0:
        before = data.state[i, c.SPIN]
        account_energy(
            data.world, c.BY_FRICTION, 0.5 * (spin - before) * (spin + before) / data.state[i, c.INVERSE_INERTIA]
        )


@kernel
def account_slip(data: EventState, i: int, t: float, residual: float) -> None:
    """Add the work of friction on a supported ball, and of the moving surface, up to time t + residual to the ledger.

    Closed form: the force is constant and the slip velocity changes linearly, so the work is force times slip distance.
    """
    state = data.state
    begin = (state[i, c.ENERGY_UNTIL] - state[i, c.T]) + (state[i, c.ENERGY_RESIDUAL] - state[i, c.TIME_RESIDUAL])
    end = (t - state[i, c.T]) + (residual - state[i, c.TIME_RESIDUAL])
    state[i, c.ENERGY_UNTIL], state[i, c.ENERGY_RESIDUAL] = t, residual
    span = end - begin
    if span <= 0.0:
        return
    middle = begin + 0.5 * span
    for slot in range(2):
        f = data.tags[i, c.SUPPORT + slot]
        if f < 0:
            continue
        tx, ty = -data.lines[f, c.NY], data.lines[f, c.NX]
        force = state[i, c.SUPPORT_FORCE + 2 * slot] * tx + state[i, c.SUPPORT_FORCE + 2 * slot + 1] * ty
        vx, vy = state[i, c.VX] + state[i, c.AX] * middle, state[i, c.VY] + state[i, c.AY] * middle
        rotation_speed = 0.0
        if state[i, c.INVERSE_INERTIA] > 0.0:
            rotation_speed = (state[i, c.SPIN] + state[i, c.ALPHA] * middle) * state[i, c.RADIUS]
        surface, other_surface = data.tags[i, c.SURFACE], data.line_tags[f, c.COLLIDER_SURFACE]
        slip_target = data.surfaces[c.SLIP_TARGET, surface, other_surface]
        slip = vx * tx + vy * ty - rotation_speed - slip_target
        account_energy(data.world, c.BY_FRICTION, force * slip * span)
        data.world[c.BY_SURFACES] += force * slip_target * span


@kernel
def account_slips(data: EventState, t: float, residual: float) -> None:
    """Add the work of sliding friction on all balls up to time t + residual to the ledger."""
    for k in range(len(data.moving_balls)):
        account_slip(data, data.moving_balls[k], t, residual)
