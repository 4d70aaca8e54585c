"""Stability limits of the substep: springs, rotary springs, lift, drag of liquids and close orbits.

The orbit of each body about each centre alone is considered (Kepler's, without softening), at its closest distance:
there the attraction a rotates the velocity v by a·h/v in a substep. If a body flies straight through a softened centre,
the direction of the force is reversed within one substep, and energy has an error of about that fraction of v² each
time.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.measure.preflight.diagnostic import ROUNDING, Details, Diagnostic, floor_3_digits
from sandbox.measure.preflight.speed_bound import SpeedBounds
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.joint_arrays import JointArrays, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.geometry.shapes import area_of

MAX_DENSE = 400
"""Largest number of rows of a matrix that is solved directly."""
LANCZOS_STEPS = 160
"""Lanczos iterations for larger matrices: both ends of the spectrum converge first."""

Product = Callable[[FloatArray], FloatArray]


def extreme_eigenvalues(product: Product, size: int, null: FloatArray | None = None) -> tuple[float, float]:
    """Return the smallest and the largest eigenvalue of a symmetric matrix, given by its product with a vector.

    They are exact to rounding up to `MAX_DENSE` rows. Above, by C. Lanczos 1950 with full orthogonalisation, the
    smallest can be too large and the largest too small.

    Args:
        product: product of the matrix with a vector (size,).
        size: number of rows.
        null: unit eigenvector of the eigenvalue 0 that does not count, (size,).
    """
    if size <= MAX_DENSE:
        matrix = np.column_stack([product(column) for column in np.eye(size)])
        values = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
        return float(values[0 if null is None else min(1, size - 1)]), float(values[-1])
    vector = np.random.default_rng(1).normal(size=size)  # the start vector is arbitrary but fixed
    basis = np.empty((LANCZOS_STEPS + 1, size))
    begin = known = 0
    if null is not None:
        basis[0] = null
        begin = known = 1
    diagonal: list[float] = []
    off_diagonal: list[float] = []
    while known < len(basis):
        for _ in range(2):  # a second time because of rounding
            vector = vector - basis[:known].T @ (basis[:known] @ vector)
        length = float(np.linalg.norm(vector))
        if length < 1e-12:  # the Krylov space is exhausted
            break
        if known > begin:
            off_diagonal.append(length)
        basis[known] = vector / length
        vector = product(basis[known])
        diagonal.append(float(vector @ basis[known]))
        known += 1
    values = np.linalg.eigvalsh(np.diag(diagonal) + np.diag(off_diagonal, 1) + np.diag(off_diagonal, -1))
    return float(values[0]), float(values[-1])


def connected_groups(first: IntArray, second: IntArray, count: int) -> IntArray:
    """Return the lowest index of the group of connected bodies of each body, (count,).

    Args:
        first: (J,) index of one body of each joint; negative for none.
        second: (J,) index of the other.
        count: number of bodies.
    """
    label = np.arange(count)
    both = (first >= 0) & (second >= 0)
    a, b = first[both], second[both]
    while len(a):
        lower = np.minimum(label[a], label[b])
        before = label.copy()
        np.minimum.at(label, a, lower)
        np.minimum.at(label, b, lower)
        label = label[label]  # pointer jumping: long chains take a logarithm of their length
        if np.array_equal(label, before):
            break
    return label


LIMITS = {"semi_implicit_euler": 2.0, "velocity_verlet": 2.0, "leapfrog": 2.0, "rk4": 2.0 * math.sqrt(2.0)}
"""ω·h above which an integrator amplifies an oscillation; explicit Euler always does."""
WARNING_FRACTION = 0.75
"""Fraction of the limit from which on there is a diagnostic: at ω·h = 1.5 the energy of an oscillation varies by 4 to
1.
"""
DAMPER_LIMITS = {"rk4": 2.785}
"""c·h/m above which an explicit damper increases the speed: 2, and for RK4 where |R(−z)| = 1."""
DAMPER_LIMIT = 2.0
MAX_GROWTH = 1e300
"""Value that is reported for a growth beyond the range of a float."""


def spring_warnings(scene: Scene, settings: Settings) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each group of connected springs whose fastest mode is too fast for the step.

    Springs are symplectic on pymunk, and on reference with the default integrator: the limit is 2. Explicit Euler on
    reference gains energy at any ω·h without damping; the diagnostic states how much. With XPBD there is no limit,
    because springs are implicit.
    """
    if settings.joints == "xpbd":
        return
    for mode in fastest_modes(scene):
        z = mode.omega * settings.h
        details: Details = {"joint": mode.joint, "omega": mode.omega, "omega_h": z}
        if settings.integrator == "explicit_euler":
            # log |R|² of the damped oscillator, a step; below the critical damping
            excess = z * (z - 2.0 * mode.zeta)
            if excess > 2.0 * mode.zeta * z * ROUNDING and (rate := 0.5 * math.log1p(excess) / settings.h) > ROUNDING:
                growth = math.exp(rate) if rate < math.log(MAX_GROWTH) else MAX_GROWTH
                growth_text = f"{growth:.3g}" if growth < MAX_GROWTH else f"more than {MAX_GROWTH:g}"
                message = (
                    f"{mode.swings} at up to ω = {mode.omega:.4g} rad/s, and explicit_euler amplifies that at any "
                    f"step, here by a factor of {growth_text} a second on reference; remove solver.integrator or "
                    "set it to semi_implicit_euler"
                )
                yield Diagnostic("spring", message, {**details, "growth": growth})
            continue
        limit = LIMITS[settings.integrator or "semi_implicit_euler"]
        if z < WARNING_FRACTION * limit:
            continue
        safe = WARNING_FRACTION * limit / mode.omega * settings.substeps
        verdict = "is unstable" if z >= limit * (1.0 - ROUNDING) else "is almost unstable"
        message = f"{mode.swings} at up to ω = {mode.omega:.4g} rad/s: ω·h = {z:.3g} {verdict} (limit {limit:.3g})"
        remedy = f"dt <= {floor_3_digits(safe)} s is stable"
        yield Diagnostic("spring", message, {**details, "limit": limit, "safe_dt": safe}, remedy)


def damper_warnings(scene: Scene, settings: Settings) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each group of springs whose dampers make the reference engine diverge.

    The reference engine takes a damper's force at the start of the step: v becomes v·(1 − c·h/m), which grows once
    c·h/m exceeds 2. A stiff spring lowers that: semi-implicit Euler needs (ω·h)² + 2·c·h/m < 4. pymunk applies dampers
    exponentially and XPBD implicitly, without a limit.

    Measured on the reference with one ball on a spring, ω·h = 0.05 and 1, c·h/m from 0.5 to 50, every integrator: it
    diverges exactly where this predicts it.
    """
    if settings.joints == "xpbd":
        return
    for mode in fastest_modes(scene):
        damped, z = mode.damping_rate * settings.h, mode.omega * settings.h
        limit = DAMPER_LIMITS.get(settings.integrator or "", DAMPER_LIMIT)
        if settings.integrator in (None, "semi_implicit_euler"):
            limit = max(0.0, 0.5 * (4.0 - z * z))
        if damped == 0.0 or damped < limit * (1.0 - ROUNDING) or limit == 0.0:  # limit 0: unstable springs
            continue
        safe = settings.dt * limit / damped
        message = (
            f"the damping of {mode.group} is too strong for the step on reference: c·h/m = {damped:.3g} is "
            f"unstable (limit {limit:.3g})"
        )
        details: Details = {"joint": mode.joint, "damping_h": damped, "limit": limit, "safe_dt": safe}
        yield Diagnostic("spring", message, details, f"use dt <= {floor_3_digits(safe)} s or the engine pymunk")


MAX_SPEED_CHANGE = 0.1
"""Largest relative change of a speed by the scheme over a run that is not worth a warning."""

LIFT_GROWTH: dict[str, Callable[[complex], complex]] = {
    "explicit_euler": lambda z: 1.0 + z,
    "semi_implicit_euler": lambda z: 1.0 + z,
    "velocity_verlet": lambda z: 1.0 + z + z**2 / 2.0,
    "leapfrog": lambda z: 1.0 + z + z**2 / 2.0,
    "rk4": lambda z: 1.0 + z + z**2 / 2.0 + z**3 / 6.0 + z**4 / 24.0,
}
"""Factor of the velocity in a substep under lift alone, by z = i·s·ω·h: lift itself turns it by e^z."""


def lift_warnings(scene: Scene, settings: Settings) -> Iterator[Diagnostic]:
    """Yield a diagnostic if the reference engine's scheme changes the speed of a body with lift noticeably.

    pymunk and box2d turn velocities exactly. Drag limits the growth, so that scenes with drag get none.
    """
    bodies = scene.bodies
    turning = np.where(bodies.immovable, 0.0, np.abs(bodies.lift * bodies.angular_velocity))
    if not turning.any() or scene.world.has_drag:
        return
    name, fastest = bodies.names[int(turning.argmax())], float(turning.max())
    growth = LIFT_GROWTH[settings.integrator or "explicit_euler"]

    def change(h: float) -> float:
        """Return the natural logarithm of the factor by which the speed changes over the run."""
        return abs(math.log(abs(growth(1j * fastest * h)))) * scene.world.duration / h

    if change(settings.h) <= math.log1p(MAX_SPEED_CHANGE):
        return
    safe = settings.h
    while change(safe) > math.log1p(MAX_SPEED_CHANGE):
        safe *= 0.99
    message = (
        f"lift turns the velocity of {name!r} by {fastest * settings.h:.3g} rad in a substep, whose length the scheme "
        f"changes: by a factor of {math.exp(min(change(settings.h), 700.0)):.3g} over the run; "
        f"dt <= {floor_3_digits(safe * settings.substeps)} s keeps it within {100.0 * MAX_SPEED_CHANGE:g} %"
    )
    yield Diagnostic("lift", message, {"body": name, "turn": fastest * settings.h})


def liquid_warnings(scene: Scene, settings: Settings) -> Iterator[Diagnostic]:
    """Yield a diagnostic for the body and liquid whose drag makes the reference engine diverge, if there is one.

    It evaluates the drag as a force: v becomes v·(1 − κ A h/m), as with dampers. The area is that of the whole body,
    and κ that at its start velocity through the liquid. pymunk and box2d take the drag implicitly, without a limit.
    """
    bodies, worst, found = scene.bodies, 0.0, None
    if not scene.liquids:
        return
    area = np.asarray([area_of(element) for element in bodies.elements])[bodies.element]
    limit = DAMPER_LIMITS.get(settings.integrator or "", DAMPER_LIMIT)
    for zone in scene.liquids:
        assert zone.liquid is not None
        speed = np.hypot(*(bodies.velocity - np.asarray(zone.liquid.current)).T)
        kappa = zone.liquid.linear_drag + zone.liquid.quadratic_drag * speed
        slowed = np.where(bodies.immovable, 0.0, kappa * area / bodies.mass * settings.h)
        if len(slowed) and float(slowed.max()) > worst:
            worst, found = float(slowed.max()), bodies.names[int(slowed.argmax())]
    if found is None or worst < limit * (1.0 - ROUNDING):
        return
    safe = settings.dt * limit / worst
    message = (
        f"the drag of the liquid on {found!r} is too strong for the step on reference: κ·A·h/m = {worst:.3g} is "
        f"unstable (limit {limit:.3g})"
    )
    details: Details = {"body": found, "damping_h": worst, "limit": limit, "safe_dt": safe}
    yield Diagnostic("liquid", message, details, f"use dt <= {floor_3_digits(safe)} s or the engine pymunk")


class SpringMode(NamedTuple):
    """Fastest mode of a group of connected springs."""

    omega: float
    """rad/s, without damping"""
    zeta: float
    """damping ratio of such a mode"""
    damping_rate: float
    """1/s: largest c/m of any motion of the group"""
    joint: str
    """name of the first spring of the group"""
    springs: int
    """number of springs of the group"""

    @property
    def group(self) -> str:
        """Description of the group."""
        return (
            f"the {self.springs:,} springs connected with {self.joint!r}"
            if self.springs > 1
            else f"the spring {self.joint!r}"
        )

    @property
    def swings(self) -> str:
        """Description of the group with a verb."""
        if self.springs > 1:
            return f"the {self.springs:,} springs connected with {self.joint!r} oscillate"
        return f"the spring {self.joint!r} oscillates"


@derived_once
def fastest_modes(setup: Setup) -> tuple[SpringMode, ...]:
    """Return the fastest mode of each group of connected springs at the start of a scene.

    ω² is the largest eigenvalue of M⁻¹K, with the lever arms of the anchors: for one spring k·(1/m_a + 1/m_b +
    arms²/I), in a chain or a cloth up to four times that. Across its line the stiffness of a stretched spring is k·(1 −
    l₀/l). Other joints are left out: they only add mass, so that the modes are slower than stated.
    """
    bodies = setup.scene.bodies
    joints = setup.scene.joint_arrays.of(JointKind.SPRING, JointKind.ROTARY_SPRING)
    if not len(joints):
        return ()
    free = np.where(bodies.immovable, -1, np.arange(len(bodies)))
    a, b = np.where(joints.a >= 0, free[joints.a], -1), free[joints.b]
    label = connected_groups(a, b, len(bodies))
    group_of = label[np.where(b >= 0, b, a)]
    inverse = np.where(bodies.immovable, 0.0, 1.0) / np.column_stack((bodies.mass, bodies.mass, bodies.moment)).T
    root = np.sqrt(inverse.T)
    found = []
    for group in np.unique(group_of).tolist():
        members = joints.some(np.flatnonzero(group_of == group))
        rows, stiff, damping = _rows(members, bodies.position, bodies.angle)
        omega = math.sqrt(_largest(members, rows, stiff, root))
        rate = _largest(members, rows, damping, root) if damping.any() else 0.0
        # With one material, damping is proportional to stiffness in all modes; with several, the least is taken.
        with np.errstate(over="ignore"):
            zeta = 0.5 * omega * float(np.min(members.figures[:, 2] / members.figures[:, 1]))
        found.append(SpringMode(omega, zeta, rate, members.names[0], len(members)))
    return tuple(found)


def _largest(joints: JointArrays, rows: FloatArray, weight: FloatArray, root: FloatArray) -> float:
    """Return the largest eigenvalue of M⁻¹·Jᵀ·W·J of one group; `root` (N, 3) is M^−½."""
    known, index = np.unique(
        np.concatenate((np.where(joints.a >= 0, joints.a, joints.b), joints.b)), return_inverse=True
    )
    index = index.reshape(-1)
    first, second = np.tile(index[: len(joints)], 3), np.tile(index[len(joints) :], 3)
    has_a = np.tile(joints.a >= 0, 3)[:, None]
    # Each row's gradient in coordinates in which all masses are 1.
    on_a, on_b = rows[:, :3] * root[known[first]] * has_a, rows[:, 3:] * root[known[second]]
    size = 3 * len(known)

    def product(vector: FloatArray) -> FloatArray:
        each = vector.reshape(-1, 3)
        force = weight * ((on_a * each[first]).sum(axis=1) + (on_b * each[second]).sum(axis=1))
        return _gathered(first, force[:, None] * on_a, second, force[:, None] * on_b, len(known))

    _, largest = extreme_eigenvalues(product, size)
    return max(largest, 0.0)


def _gathered(first: IntArray, on_a: FloatArray, second: IntArray, on_b: FloatArray, count: int) -> FloatArray:
    total = np.empty((count, 3))
    for axis in range(3):
        total[:, axis] = np.bincount(first, on_a[:, axis], count) + np.bincount(second, on_b[:, axis], count)
    return total.reshape(-1)


def _rows(joints: JointArrays, position: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the strains of each spring by the coordinates of both bodies, (3J, 6), and k and c, (3J,).

    The strains are along the spring, across it and about it; the coordinates are x, y and angle.
    """
    first, second = joints.ends(position, angle)
    arm_a = np.where((joints.a >= 0)[:, None], first - position[joints.a], 0.0)
    arm_b = second - position[joints.b]
    line = second - first
    length = np.hypot(*line.T)
    unit = np.where(length[:, None] > 0.0, line / np.where(length > 0.0, length, 1.0)[:, None], (1.0, 0.0))
    across = np.column_stack((-unit[:, 1], unit[:, 0]))
    straight = joints.kind == JointKind.SPRING
    rest, stiffness, damping = joints.figures.T
    taut = np.clip(1.0 - rest / np.where(length > 0.0, length, np.inf), 0.0, 1.0)
    taut = np.where((length == 0.0) & (rest == 0.0), 1.0, taut)  # a spring of length 0 is isotropic
    rows = [np.column_stack((-n, -_cross(arm_a, n), n, _cross(arm_b, n))) * straight[:, None] for n in (unit, across)]
    rows.append(np.tile((0.0, 0.0, -1.0, 0.0, 0.0, 1.0), (len(joints), 1)) * ~straight[:, None])
    stiff = np.concatenate((stiffness * straight, stiffness * taut * straight, stiffness * ~straight))
    damped = np.concatenate((damping * straight, np.zeros(len(joints)), damping * ~straight))
    return np.concatenate(rows), stiff, damped


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


SAFE_TURN = 0.2
"""rad: below it, symplectic integrators conserve the energy of an orbit to some per cent."""


def orbit_warnings(scene: Scene, settings: Settings, contacts: ContactMatrix) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each attraction that rotates a body's velocity by more than `SAFE_TURN` in a substep."""
    bodies, speeds = scene.bodies, SpeedBounds(scene, contacts)
    for number, each in enumerate(scene.attractions):
        if each.strength <= 0.0:
            continue
        centre = bodies.number_of[each.toward] if isinstance(each.toward, str) else None
        place = bodies.position[centre] if centre is not None else np.asarray(each.toward)
        away, velocity = bodies.position - place, bodies.velocity
        distance, speed = np.hypot(*away.T), np.hypot(*velocity.T)
        able = ~bodies.immovable & (distance > 0.0)
        if centre is not None:
            able[centre] = False
        if not able.any():
            continue
        solid = speeds.core(each)
        momentum = np.abs(away[:, 0] * velocity[:, 1] - away[:, 1] * velocity[:, 0])
        nearest = _periapsis(each.strength, distance, speed, momentum)
        able &= (nearest > solid) | (solid == 0.0)  # a body that hits the centre is not deflected there
        if not able.any():
            continue
        closest = np.maximum(nearest, np.maximum(each.softening, np.finfo(float).tiny))
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            drop = np.where(
                each.softening > 0.0,
                (np.arctan(distance / max(each.softening, 1e-300)) - np.arctan(nearest / max(each.softening, 1e-300)))
                / max(each.softening, 1e-300),
                1.0 / closest - 1.0 / distance,
            )
            closest_speed = np.sqrt(np.square(speed) + 2.0 * each.strength * np.maximum(drop, 0.0))
            turn = (
                each.strength
                / (np.square(nearest) + each.softening**2 + np.finfo(float).tiny)
                / closest_speed
                * settings.h
            )
        turn = np.where(able & np.isfinite(turn), turn, np.where(able & ~np.isfinite(turn), MAX_TURN, 0.0))
        k = int(turn.argmax())
        if turn[k] <= SAFE_TURN:
            continue
        name = each.name or f"attraction {number + 1}"
        safe = settings.dt * SAFE_TURN / float(turn[k])
        message = (
            f"{name!r} turns the velocity of {bodies.names[k]!r} by {min(float(turn[k]), MAX_TURN):.3g} rad in one "
            f"substep at its closest distance, {nearest[k]:.3g} m, so energy is not conserved"
        )
        remedy = f"dt <= {floor_3_digits(safe)} s is safe" if safe > 0.0 else "add softening"
        details: Details = {"body": bodies.names[k], "turn": min(float(turn[k]), MAX_TURN), "safe_dt": safe}
        yield Diagnostic("orbit", message, details, remedy)


MAX_TURN = 1e12
"""Value that is reported for an unbounded rotation, rad."""


def _periapsis(
    strength: float,
    distance: FloatArray,
    speed: FloatArray,
    momentum: FloatArray,
) -> FloatArray:
    """Return the smallest distance of each body from a centre, (N,) m; with softening an upper estimate.

    Kepler: r = L²/(GM·(1 + e)), e² = 1 + 2·E·L²/GM².
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        scaled = momentum / math.sqrt(strength)
        energy = 0.5 * np.square(speed) / strength - 1.0 / distance
        eccentricity = np.sqrt(np.maximum(1.0 + 2.0 * energy * np.square(scaled), 0.0))
        nearest = np.square(scaled) / (1.0 + eccentricity)
    return np.where(np.isfinite(nearest), np.minimum(nearest, distance), distance)
