"""Motion of balls on a surface between events, collision response, and energy accounting.

An impulse J changes the kinetic energy by J times the mean of the velocities before and after it, taken at the point
where it acts. The accounting does not affect the motion.
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.exact.common.record import account_contact
from sandbox.engines.exact.common.roots import CREEP_ACCELERATION
from sandbox.engines.exact.tabletop import state as c
from sandbox.engines.exact.tabletop.state import TabletopState
from sandbox.engines.tabletop.collisions import STILL, Five, collide_balls, collide_cushion, collide_pucks
from sandbox.engines.tabletop.motion import (
    CAPTURED,
    GLIDING,
    RESTING,
    ROLLING,
    SLIDING,
    SPINNING,
    decayed_spin,
    phase_of,
    rates,
)


@kernel
def angle_at(state: FloatArray, i: int, t: float) -> float:
    """Return the angle of a ball about z at a time, rad; its spin falls at a constant rate until it is zero."""
    wz, fall = state[i, c.WZ], state[i, c.SPIN_DECAY]
    dt = t - state[i, c.T]
    if fall > 0.0:
        dt = min(dt, abs(wz) / fall)
    return float(state[i, c.ANGLE] + (wz - math.copysign(0.5 * fall * dt, wz)) * dt)


@kernel
def move_to(state: FloatArray, i: int, t: float) -> None:
    """Advance the row of a ball to a time within its phase."""
    dt = t - state[i, c.T]
    state[i, c.ANGLE] = angle_at(state, i, t)
    ax, ay = state[i, c.AX], state[i, c.AY]
    state[i, c.X] += (state[i, c.VX] + 0.5 * ax * dt) * dt
    state[i, c.Y] += (state[i, c.VY] + 0.5 * ay * dt) * dt
    state[i, c.VX] += ax * dt
    state[i, c.VY] += ay * dt
    state[i, c.WX] += state[i, c.ROLL_RATE_X] * dt
    state[i, c.WY] += state[i, c.ROLL_RATE_Y] * dt
    state[i, c.WZ] = decayed_spin(state[i, c.WZ], state[i, c.SPIN_DECAY] * dt)
    state[i, c.T] = t


@kernel
def set_motion(state: FloatArray, i: int, motion: Five) -> None:
    """Set velocity and spin of a ball."""
    state[i, c.VX], state[i, c.VY], state[i, c.WX], state[i, c.WY], state[i, c.WZ] = motion


@kernel
def motion_of(state: FloatArray, i: int) -> Five:
    """Return velocity and spin of a ball at the time of its row."""
    return state[i, c.VX], state[i, c.VY], state[i, c.WX], state[i, c.WY], state[i, c.WZ]


@kernel
def set_phase(data: TabletopState, i: int, phase: int) -> None:
    """Continue a ball in a phase from the time of its row on."""
    state, tags, counts = data.state, data.tags, data.counts
    vx, vy, wx, wy, wz = motion_of(state, i)
    ax, ay, bx, by, duration = rates(phase, vx, vy, wx, wy, wz, state[i, c.RADIUS], data.floor)
    state[i, c.AX], state[i, c.AY], state[i, c.ROLL_RATE_X], state[i, c.ROLL_RATE_Y] = ax, ay, bx, by
    state[i, c.PHASE_END] = state[i, c.T] + duration
    old_phase, new_phase = tags[i, c.PHASE], phase
    # int, because uncompiled these are numpy bools, which cannot be subtracted.
    counts[c.MOVING] += int(new_phase not in (RESTING, CAPTURED)) - int(old_phase not in (RESTING, CAPTURED))
    tags[i, c.PHASE] = phase


@kernel
def record_path(data: TabletopState, i: int) -> None:
    """Record the start of a new path segment of a ball."""
    row = data.counts[c.PATH_ROWS]
    for column in range(c.T, c.PATH_WIDTH):
        data.path[row, column] = data.state[i, column]
    data.path_tags[row, 0], data.path_tags[row, 1] = i, data.tags[i, c.PHASE]
    data.counts[c.PATH_ROWS] += 1


@kernel
def start_phase(data: TabletopState, i: int) -> None:
    """Continue a ball in the phase that its velocity and spin determine."""
    state = data.state
    if state[i, c.INVERSE_MASS] > 0.0:
        vx, vy, wx, wy, wz = motion_of(state, i)
        set_phase(data, i, phase_of(vx, vy, wx, wy, wz, state[i, c.RADIUS], data.floor.pucks))


@kernel
def end_phase(data: TabletopState, i: int) -> None:
    """Continue a ball at the end of its phase in the next one, with the quantity that has ended set to exactly zero."""
    state, phase = data.state, data.tags[i, c.PHASE]
    if phase == SLIDING:
        state[i, c.WX], state[i, c.WY] = -state[i, c.VY] / state[i, c.RADIUS], state[i, c.VX] / state[i, c.RADIUS]
        if state[i, c.VX] != 0.0 or state[i, c.VY] != 0.0:
            set_phase(data, i, ROLLING)
            return
    elif phase in (ROLLING, GLIDING):
        state[i, c.VX], state[i, c.VY], state[i, c.WX], state[i, c.WY] = 0.0, 0.0, 0.0, 0.0
    else:
        state[i, c.WZ] = 0.0
    set_phase(data, i, SPINNING if state[i, c.WZ] != 0.0 else RESTING)


@kernel
def evaluate(
    data: TabletopState,
    t: float,
    position: FloatArray,
    velocity: FloatArray,
    roll: FloatArray,
    angle: FloatArray,
    spin: FloatArray,
) -> None:
    """Write the motion of every ball at a time into the given arrays; the state is not changed."""
    state = data.state
    for i in range(len(state)):
        if state[i, c.INVERSE_MASS] == 0.0:
            continue
        dt = t - state[i, c.T]
        ax, ay = state[i, c.AX], state[i, c.AY]
        position[i, 0] = state[i, c.X] + (state[i, c.VX] + 0.5 * ax * dt) * dt
        position[i, 1] = state[i, c.Y] + (state[i, c.VY] + 0.5 * ay * dt) * dt
        velocity[i, 0], velocity[i, 1] = state[i, c.VX] + ax * dt, state[i, c.VY] + ay * dt
        roll[i, 0], roll[i, 1] = (
            state[i, c.WX] + state[i, c.ROLL_RATE_X] * dt,
            state[i, c.WY] + state[i, c.ROLL_RATE_Y] * dt,
        )
        angle[i], spin[i] = angle_at(state, i, t), decayed_spin(state[i, c.WZ], state[i, c.SPIN_DECAY] * dt)


@kernel
def energy_change(data: TabletopState, i: int, before: Five, nx: float, ny: float) -> tuple[float, float]:
    """Return the energy change of a ball by a collision, along its normal and its tangent, J."""
    state = data.state
    if state[i, c.INVERSE_MASS] == 0.0:
        return 0.0, 0.0
    vx, vy, wx, wy, wz = before
    mass, inertia = state[i, c.MASS], data.floor.inertia * state[i, c.MASS] * state[i, c.RADIUS] ** 2
    normal_after, normal_before = state[i, c.VX] * nx + state[i, c.VY] * ny, vx * nx + vy * ny
    tangential_after, tangential_before = state[i, c.VY] * nx - state[i, c.VX] * ny, vy * nx - vx * ny
    spin_squares = (
        (state[i, c.WX] - wx) * (state[i, c.WX] + wx)
        + (state[i, c.WY] - wy) * (state[i, c.WY] + wy)
        + (state[i, c.WZ] - wz) * (state[i, c.WZ] + wz)
    )
    return 0.5 * mass * (normal_after - normal_before) * (normal_after + normal_before), 0.5 * mass * (
        tangential_after - tangential_before
    ) * (tangential_after + tangential_before) + 0.5 * inertia * spin_squares


@kernel
def account_hit(data: TabletopState, i: int, before: Five, k: int, other_before: Five, nx: float, ny: float) -> None:
    """Add the energy change of a collision to the ledger.

    Args:
        data: state arrays after the collision.
        i: ball.
        before: its motion before.
        k: other ball, −1 for a static collider.
        other_before: motion of the other ball before.
        nx: normal.
        ny: likewise.
    """
    if data.counts[c.ACCOUNTING] == 0:
        return
    along, across = energy_change(data, i, before, nx, ny)
    if k >= 0:
        other_along, other_across = energy_change(data, k, other_before, nx, ny)
        along, across = along + other_along, across + other_across
    account_contact(data.world, along, across)


@kernel
def account_micro_bounce(data: TabletopState, impulse: float, separation: float, micro_bounce: float) -> None:
    """Add the energy of a micro-bounce to the ledger: impulse, N·s, and speeds of separation before and after."""
    if data.counts[c.ACCOUNTING] != 0:
        data.world[c.BY_MICRO_BOUNCES] += 0.5 * impulse * (separation + micro_bounce)


@kernel
def floor_work(data: TabletopState, i: int, t: float) -> float:
    """Return the work of the surface on a ball since `ENERGY_UNTIL` up to a time within its phase, J.

    Closed form: sliding friction times slip distance; rolling resistance decelerates velocity and rolling spin
    together.
    """
    state, floor = data.state, data.floor
    begin, end = state[i, c.ENERGY_UNTIL] - state[i, c.T], t - state[i, c.T]
    middle, span = 0.5 * (begin + end), end - begin
    mass, radius = state[i, c.MASS], state[i, c.RADIUS]
    loss = 0.0
    phase = data.tags[i, c.PHASE]
    if phase == SLIDING:
        ux, uy = state[i, c.VX] - radius * state[i, c.WY], state[i, c.VY] + radius * state[i, c.WX]
        loss = mass * floor.sliding * ((ux * ux + uy * uy) ** 0.5 - 3.5 * floor.sliding * middle) * span
    elif phase == ROLLING:
        speed = (state[i, c.VX] ** 2 + state[i, c.VY] ** 2) ** 0.5
        loss = 1.4 * mass * floor.rolling * (speed - floor.rolling * middle) * span
    elif phase == GLIDING:
        speed = (state[i, c.VX] ** 2 + state[i, c.VY] ** 2) ** 0.5
        loss = mass * floor.sliding * (speed - floor.sliding * middle) * span
    fall = floor.spinning / radius
    first, last = decayed_spin(state[i, c.WZ], fall * begin), decayed_spin(state[i, c.WZ], fall * end)
    return float(-loss - 0.5 * floor.inertia * mass * radius * radius * (first - last) * (first + last))


@kernel
def advance_to(data: TabletopState, i: int, t: float) -> None:
    """Advance a ball to a time, and add the work of the surface until then to the ledger."""
    if data.counts[c.ACCOUNTING] != 0:
        if data.state[i, c.INVERSE_MASS] > 0.0:
            data.world[c.BY_FLOOR] += floor_work(data, i, t)
        data.state[i, c.ENERGY_UNTIL] = t
    move_to(data.state, i, t)


@kernel
def advance_all_to(data: TabletopState, t: float) -> None:
    """Advance all balls to a time as `advance_to`; none may have an event before that time."""
    for i in range(len(data.state)):
        advance_to(data, i, t)


@kernel
def account_floor(data: TabletopState, t: float) -> None:
    """Add the work of the surface on all balls up to a time to the ledger."""
    for i in range(len(data.state)):
        if data.state[i, c.INVERSE_MASS] > 0.0:
            data.world[c.BY_FLOOR] += floor_work(data, i, t)
        data.state[i, c.ENERGY_UNTIL] = t


ELASTIC_SPEED = 1e-3
"""m/s: slower collisions are elastic, so that cascades in clusters end."""

STOP_SPEED = 1e-4
"""m/s: a ball whose centre and rim are both slower than this after such a slow collision is stopped. Otherwise it would
roll 5e-8 m."""

MICRO_BOUNCE_SPEED = 1e-3
"""m/s: smallest speed of separation of balls that spin presses together, which prevents an endless series of collisions
(Zeno behaviour). Between two balls it adds up to m·MICRO_BOUNCE²/4 each time, some 4e-8 J, and a distance of 3e-7 m."""


@kernel
def log_event(
    data: TabletopState, kind: int, a: int, b: int, x: float, y: float, nx: float, ny: float, jx: float, jy: float
) -> None:
    """Add an event to the log."""
    row = data.counts[c.LOG_ROWS]
    line, tags = data.log[row], data.log_tags[row]
    line[c.POINT_X], line[c.POINT_Y], line[c.NORMAL_X], line[c.NORMAL_Y], line[c.IMPULSE_X], line[c.IMPULSE_Y] = (
        x,
        y,
        nx,
        ny,
        jx,
        jy,
    )
    tags[0], tags[1], tags[2] = kind, a, b
    data.counts[c.LOG_ROWS] += 1


@kernel
def speed_gain_until_rolling(data: TabletopState, i: int, nx: float, ny: float) -> float:
    """Return the speed along n that a sliding ball gains until it rolls, m/s: −2/7 of its slip."""
    state = data.state
    if data.tags[i, c.PHASE] != SLIDING or data.floor.sliding == 0.0:
        return 0.0
    radius = state[i, c.RADIUS]
    ux, uy = state[i, c.VX] - radius * state[i, c.WY], state[i, c.VY] + radius * state[i, c.WX]
    return float(-2.0 / 7.0 * (ux * nx + uy * ny))


@kernel
def stop_if_slow(data: TabletopState, i: int, closing: float) -> None:
    """Stop a ball that a slow collision has left nearly at rest; it may keep spinning.

    Its energy is accounted to the surface.
    """
    state = data.state
    deceleration = data.floor.sliding if data.floor.pucks else data.floor.rolling
    if closing > ELASTIC_SPEED or state[i, c.INVERSE_MASS] == 0.0 or deceleration == 0.0:
        return
    speed_squared = state[i, c.VX] ** 2 + state[i, c.VY] ** 2
    rim_speed_squared = (state[i, c.WX] ** 2 + state[i, c.WY] ** 2) * state[i, c.RADIUS] ** 2
    if speed_squared < STOP_SPEED * STOP_SPEED and rim_speed_squared < STOP_SPEED * STOP_SPEED:
        data.world[c.BY_FLOOR] -= 0.5 * state[i, c.MASS] * (speed_squared + 0.4 * rim_speed_squared)
        state[i, c.VX], state[i, c.VY], state[i, c.WX], state[i, c.WY] = 0.0, 0.0, 0.0, 0.0


@kernel
def needs_micro_bounce(separation: float, reduction: float, reduction_rate: float, duration: float) -> bool:
    """Return whether a separating pair needs a micro-bounce, because it would collide again at once, repeatedly.

    That is so if the surface, by turning sliding into rolling, reduces the speed of separation by more than its value.
    A collision alone does not cause it: of the slip that it creates, less comes back than it separates the two by.

    Args:
        separation: speed of separation, m/s.
        reduction: reduction of that speed until both roll, m/s.
        reduction_rate: present rate of reduction, m/s².
        duration: duration of that rate, s.
    """
    if separation >= MICRO_BOUNCE_SPEED or reduction_rate <= 2.0 * CREEP_ACCELERATION:
        return False
    return reduction >= separation or reduction_rate * duration > separation


@kernel
def hit_ball(data: TabletopState, i: int, k: int) -> None:
    """Collide two balls, whose rows are at one time."""
    state, tags = data.state, data.tags
    dx, dy = state[k, c.X] - state[i, c.X], state[k, c.Y] - state[i, c.Y]
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    inverse_mass_i, inverse_mass_k = state[i, c.INVERSE_MASS], state[k, c.INVERSE_MASS]
    before, other_before = motion_of(state, i), motion_of(state, k)
    closing = (state[i, c.VX] - state[k, c.VX]) * nx + (state[i, c.VY] - state[k, c.VY]) * ny
    if closing > 0.0:
        restitution = data.coefficients[0, tags[i, c.SURFACE], tags[k, c.SURFACE]] if closing > ELASTIC_SPEED else 1.0
        if data.floor.pucks:
            friction = data.coefficients[1, tags[i, c.SURFACE], tags[k, c.SURFACE]]
            radii = state[i, c.RADIUS], state[k, c.RADIUS]
            after, other_after = collide_pucks(
                restitution, friction, before, other_before, (inverse_mass_i, inverse_mass_k), radii, nx, ny
            )
        else:
            after, other_after = collide_balls(
                data.counts[c.BALL_MODEL],
                restitution,
                before,
                other_before,
                (inverse_mass_i, inverse_mass_k),
                state[i, c.RADIUS],
                nx,
                ny,
            )
        set_motion(state, i, after)
        set_motion(state, k, other_after)
        account_hit(data, i, before, k, other_before, nx, ny)
        stop_if_slow(data, i, closing)
        stop_if_slow(data, k, closing)
    start_phase(data, i)
    start_phase(data, k)
    separation = (state[k, c.VX] - state[i, c.VX]) * nx + (state[k, c.VY] - state[i, c.VY]) * ny
    reduction_rate = (state[i, c.AX] - state[k, c.AX]) * nx + (state[i, c.AY] - state[k, c.AY]) * ny
    reduction = speed_gain_until_rolling(data, i, nx, ny) - speed_gain_until_rolling(data, k, nx, ny)
    if needs_micro_bounce(
        separation, reduction, reduction_rate, min(state[i, c.PHASE_END], state[k, c.PHASE_END]) - state[i, c.T]
    ):
        impulse = (MICRO_BOUNCE_SPEED - separation) / (inverse_mass_i + inverse_mass_k)
        account_micro_bounce(data, impulse, separation, MICRO_BOUNCE_SPEED)
        state[i, c.VX] -= impulse * inverse_mass_i * nx
        state[i, c.VY] -= impulse * inverse_mass_i * ny
        state[k, c.VX] += impulse * inverse_mass_k * nx
        state[k, c.VY] += impulse * inverse_mass_k * ny
        start_phase(data, i)
        start_phase(data, k)
    if data.counts[c.RECORDING] != 0:
        jx, jy = state[i, c.MASS] * (before[0] - state[i, c.VX]), state[i, c.MASS] * (before[1] - state[i, c.VY])
        if inverse_mass_i == 0.0:  # a fixed ball has no change of velocity
            jx, jy = (
                state[k, c.MASS] * (state[k, c.VX] - other_before[0]),
                state[k, c.MASS] * (state[k, c.VY] - other_before[1]),
            )
        radius = state[i, c.RADIUS]
        x, y = state[i, c.X] + radius * nx, state[i, c.Y] + radius * ny
        if i < k:
            log_event(data, c.BALL, i, k, x, y, nx, ny, jx, jy)
        else:
            log_event(data, c.BALL, k, i, x, y, -nx, -ny, -jx, -jy)


@kernel
def hit_line(data: TabletopState, i: int, k: int) -> None:
    """Collide a ball with a plane or the side of a wall."""
    line = data.lines[k]
    hit_cushion(
        data,
        i,
        c.LINE,
        data.line_tags[k, c.COLLIDER],
        data.line_tags[k, c.COLLIDER_SURFACE],
        -line[c.NX],
        -line[c.NY],
        line[c.LINE_NOSE],
    )


@kernel
def hit_vertex(data: TabletopState, i: int, k: int) -> None:
    """Collide a ball with a post or the end of a wall."""
    vertex = data.vertices[k]
    dx, dy = vertex[c.CENTRE_X] - data.state[i, c.X], vertex[c.CENTRE_Y] - data.state[i, c.Y]
    distance = math.sqrt(dx * dx + dy * dy)
    hit_cushion(
        data,
        i,
        c.VERTEX,
        data.vertex_tags[k, c.COLLIDER],
        data.vertex_tags[k, c.COLLIDER_SURFACE],
        dx / distance,
        dy / distance,
        vertex[c.VERTEX_NOSE],
    )


@kernel
def hit_cushion(
    data: TabletopState, i: int, kind: int, collider: int, collider_surface: int, nx: float, ny: float, nose: float
) -> None:
    """Collide a ball with a static collider; n points into it. Without a nose it is hit at the height of the centre."""
    state, surface = data.state, data.tags[i, c.SURFACE]
    before_x, before_y, radius = state[i, c.VX], state[i, c.VY], state[i, c.RADIUS]
    height = nose if nose > 0.0 else radius
    closing = before_x * nx + before_y * ny
    if closing > 0.0:
        restitution = data.coefficients[0, surface, collider_surface] if closing > ELASTIC_SPEED else 1.0
        friction = data.coefficients[1, surface, collider_surface]
        before = motion_of(state, i)
        model, grip = data.counts[c.CUSHION_MODEL], data.floor.grip
        if data.floor.pucks:
            after, _ = collide_pucks(
                restitution, friction, before, STILL, (state[i, c.INVERSE_MASS], 0.0), (radius, 0.0), nx, ny
            )
        else:
            after = collide_cushion(model, restitution, friction, grip, before, radius, height, nx, ny)
        set_motion(state, i, after)
        account_hit(data, i, before, -1, before, nx, ny)
        stop_if_slow(data, i, closing)
    start_phase(data, i)
    separation = -(state[i, c.VX] * nx + state[i, c.VY] * ny)
    reduction_rate = state[i, c.AX] * nx + state[i, c.AY] * ny
    if needs_micro_bounce(
        separation, speed_gain_until_rolling(data, i, nx, ny), reduction_rate, state[i, c.PHASE_END] - state[i, c.T]
    ):
        account_micro_bounce(data, (MICRO_BOUNCE_SPEED - separation) * state[i, c.MASS], separation, MICRO_BOUNCE_SPEED)
        state[i, c.VX] -= (MICRO_BOUNCE_SPEED - separation) * nx
        state[i, c.VY] -= (MICRO_BOUNCE_SPEED - separation) * ny
        start_phase(data, i)
    if data.counts[c.RECORDING] != 0:
        mass = state[i, c.MASS]
        jx, jy = mass * (before_x - state[i, c.VX]), mass * (before_y - state[i, c.VY])
        log_event(
            data, kind, i, -1 - collider, state[i, c.X] + radius * nx, state[i, c.Y] + radius * ny, nx, ny, jx, jy
        )


@kernel
def capture(data: TabletopState, i: int, k: int, collider_count: int) -> None:
    """Capture a ball in pocket k: from then on it lies at the centre. `collider_count`: number of static colliders."""
    state, pocket = data.state, data.pockets[k]
    x, y, vx, vy, mass = state[i, c.X], state[i, c.Y], state[i, c.VX], state[i, c.VY], state[i, c.MASS]
    state[i, c.X], state[i, c.Y] = pocket[c.CENTRE_X], pocket[c.CENTRE_Y]
    before = motion_of(state, i)
    set_motion(state, i, (0.0, 0.0, 0.0, 0.0, 0.0))
    along, across = energy_change(data, i, before, 1.0, 0.0)
    data.world[c.BY_CAPTURE] += along + across
    set_phase(data, i, CAPTURED)
    if data.counts[c.RECORDING] != 0:
        nx, ny = (pocket[c.CENTRE_X] - x) / pocket[c.CIRCLE_RADIUS], (pocket[c.CENTRE_Y] - y) / pocket[c.CIRCLE_RADIUS]
        log_event(data, c.POCKET, i, -1 - collider_count - k, x, y, nx, ny, mass * vx, mass * vy)
