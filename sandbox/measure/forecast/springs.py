"""Springs: whether the step is short enough for the fastest swing that they can make of the bodies they hold."""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.measure.forecast.modes import extremes, groups
from sandbox.measure.forecast.warning import ROUNDING, Figures, Warning, at_most
from sandbox.scene.links import LinkKind, Links
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import FloatArray, IntArray

LIMITS = {"semi_implicit_euler": 2.0, "velocity_verlet": 2.0, "leapfrog": 2.0, "rk4": 2.0 * math.sqrt(2.0)}
"""ω·h from which on a scheme makes a swing grow. Explicit Euler does at any."""
NEAR = 0.75
"""The share of the limit from which on is warned: at ω·h = 1.5 the energy of a swing comes and goes by 4 to 1."""


def spring_warnings(scene: Scene, settings: Settings) -> Iterator[Warning]:
    """Yield a warning for each group of connected springs whose fastest mode is too fast for the step.

    Where no integrator is stated, and in pymunk whatever is stated, springs act symplectically: the limit is 2.
    Explicit Euler, as the reference does it, gains at any ω·h unless damped: then is told how much. Joints held by
    XPBD have no limit, as springs are then implicit.
    """
    if settings.joints == "xpbd":
        return
    for omega, zeta, name, count in fastest(scene):
        z = omega * settings.h
        figures: Figures = {"joint": name, "omega": omega, "omega_h": z}
        these = f"the spring {name!r} swings"
        if count > 1:
            these = f"the {count:,} springs that hang together with {name!r} swing"
        if settings.integrator == "explicit_euler":
            # |R|² of the damped oscillator, per step.
            gain = (1.0 - 2.0 * zeta * z + z * z) ** (0.5 / settings.h) if z > 2.0 * zeta * (1.0 + ROUNDING) else 1.0
            if gain > 1.0 + ROUNDING:
                message = (
                    f"{these} at up to ω = {omega:.4g} rad/s, and explicit_euler makes that grow at any step, "
                    f"here {gain:.3g} times a second in amplitude on the reference; leave solver.integrator out, or "
                    "use semi_implicit_euler"
                )
                yield Warning("spring", message, {**figures, "growth": min(gain, 1e300)})
            continue
        limit = LIMITS[settings.integrator or "semi_implicit_euler"]
        if z < NEAR * limit:
            continue
        safe = NEAR * limit / omega * settings.substeps
        what = "grows without bound" if z >= limit * (1.0 - ROUNDING) else "is close to growing"
        message = (
            f"{these} at up to ω = {omega:.4g} rad/s: ω·h = {z:.3g} {what}, the limit is {limit:.3g}; "
            f"dt <= {at_most(safe)} s would be right"
        )
        yield Warning("spring", message, {**figures, "limit": limit, "safe_dt": safe})


def fastest(scene: Scene) -> list[tuple[float, float, str, int]]:
    """Return for each group of connected springs the fastest mode, with its lever arms, as the scene starts.

    ω² is the largest eigenvalue of M⁻¹K: for one spring k·(1/m_a + 1/m_b + arms²/I), in a chain or a cloth up to
    four times that. Across its line a stretched spring is k·(1 − l₀/l) stiff. Other joints are left out: they only
    make bodies heavier, so that modes across them are slower than told.

    Returns:
        ω, rad/s, the share of critical damping that its dampers give such a mode, the group's first joint, and how
        many springs it has.
    """
    bodies = scene.bodies
    links = scene.links.of(LinkKind.SPRING, LinkKind.ROTARY_SPRING)
    if not len(links):
        return []
    free = np.where(bodies.fixed, -1, np.arange(len(bodies)))
    a, b = np.where(links.a >= 0, free[links.a], -1), free[links.b]
    label = groups(a, b, len(bodies))
    home = label[np.where(b >= 0, b, a)]
    inverse = np.where(bodies.fixed, 0.0, 1.0) / np.column_stack((bodies.mass, bodies.mass, bodies.moment)).T
    found = []
    for group in np.unique(home).tolist():
        mine = np.flatnonzero(home == group)
        omega, damping = _fastest_of(links.some(mine), bodies.position, bodies.angle, np.sqrt(inverse.T))
        found.append((omega, damping, links.names[int(mine[0])], len(mine)))
    return found


def _fastest_of(links: Links, position: FloatArray, angle: FloatArray, root: FloatArray) -> tuple[float, float]:
    """Return ω and the damping ratio of one group; `root` (N, 3) is M^−½."""
    rows, stiff = _rows(links, position, angle)
    known, place = np.unique(np.concatenate((np.where(links.a >= 0, links.a, links.b), links.b)), return_inverse=True)
    place = place.reshape(-1)
    first, second = np.tile(place[: len(links)], 3), np.tile(place[len(links) :], 3)
    there = np.tile(links.a >= 0, 3)[:, None]
    # Each row's gradient in coordinates in which all masses are 1.
    on_a, on_b = rows[:, :3] * root[known[first]] * there, rows[:, 3:] * root[known[second]]
    size = 3 * len(known)

    def product(vector: FloatArray) -> FloatArray:
        each = vector.reshape(-1, 3)
        pull = stiff * ((on_a * each[first]).sum(axis=1) + (on_b * each[second]).sum(axis=1))
        return _gathered(first, pull[:, None] * on_a, second, pull[:, None] * on_b, len(known))

    _, largest = extremes(product, size)
    omega = math.sqrt(max(largest, 0.0))
    # Of springs of one material damping is as stiffness in every mode; of several, the least damped is taken.
    return omega, 0.5 * omega * float(np.min(links.figures[:, 2] / links.figures[:, 1]))


def _gathered(first: IntArray, on_a: FloatArray, second: IntArray, on_b: FloatArray, count: int) -> FloatArray:
    total = np.empty((count, 3))
    for axis in range(3):
        total[:, axis] = np.bincount(first, on_a[:, axis], count) + np.bincount(second, on_b[:, axis], count)
    return total.reshape(-1)


def _rows(links: Links, position: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return along, across and about each spring how x, y and angle of both bodies strain it, (3J, 6), and k, (3J,)."""
    first, second = links.ends(position, angle)
    arm_a = np.where((links.a >= 0)[:, None], first - position[links.a], 0.0)
    arm_b = second - position[links.b]
    line = second - first
    length = np.hypot(*line.T)
    unit = np.where(length[:, None] > 0.0, line / np.where(length > 0.0, length, 1.0)[:, None], (1.0, 0.0))
    across = np.column_stack((-unit[:, 1], unit[:, 0]))
    straight = links.kind == LinkKind.SPRING
    rest, stiffness, _ = links.figures.T
    taut = np.clip(1.0 - rest / np.where(length > 0.0, length, np.inf), 0.0, 1.0)
    taut = np.where((length == 0.0) & (rest == 0.0), 1.0, taut)  # a spring of no length pulls alike every way
    rows = [np.column_stack((-n, -_cross(arm_a, n), n, _cross(arm_b, n))) * straight[:, None] for n in (unit, across)]
    rows.append(np.tile((0.0, 0.0, -1.0, 0.0, 0.0, 1.0), (len(links), 1)) * ~straight[:, None])
    stiff = np.concatenate((stiffness * straight, stiffness * taut * straight, stiffness * ~straight))
    return np.concatenate(rows), stiff


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
