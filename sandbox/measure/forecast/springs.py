"""Springs: whether the step is short enough for the fastest swing that they can make of the bodies they hold."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.measure.forecast.modes import extremes, groups
from sandbox.measure.forecast.warning import ROUNDING, Figures, Warning, at_most
from sandbox.scene.compile.joint_arrays import JointArrays, LinkKind
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

LIMITS = {"semi_implicit_euler": 2.0, "velocity_verlet": 2.0, "leapfrog": 2.0, "rk4": 2.0 * math.sqrt(2.0)}
"""ω·h from which on a scheme makes a swing grow. Explicit Euler does at any."""
NEAR = 0.75
"""The share of the limit from which on is warned: at ω·h = 1.5 the energy of a swing comes and goes by 4 to 1."""
DAMPER_LIMITS = {"rk4": 2.785}
"""c·h/m from which on an explicit damper turns a velocity round to a larger one: 2, and for RK4 where |R(−z)| = 1."""
DAMPER_LIMIT = 2.0
MOST_GROWTH = 1e300
"""Figure that is given for a growth beyond the range of a float."""


def spring_warnings(scene: Scene, settings: Settings) -> Iterator[Warning]:
    """Yield a warning for each group of connected springs whose fastest mode is too fast for the step.

    Where no integrator is stated, and in pymunk whatever is stated, springs act symplectically: the limit is 2.
    Explicit Euler, as the reference does it, gains energy at any ω·h unless damped; the warning says how much. Joints
    held by XPBD have no limit, as springs are then implicit.
    """
    if settings.joints == "xpbd":
        return
    for mode in fastest(scene):
        z = mode.omega * settings.h
        figures: Figures = {"joint": mode.joint, "omega": mode.omega, "omega_h": z}
        if settings.integrator == "explicit_euler":
            # log |R|² of the damped oscillator, a step; below the critical damping
            excess = z * (z - 2.0 * mode.zeta)
            if excess > 2.0 * mode.zeta * z * ROUNDING and (rate := 0.5 * math.log1p(excess) / settings.h) > ROUNDING:
                growth = math.exp(rate) if rate < math.log(MOST_GROWTH) else MOST_GROWTH
                more = f"{growth:.3g}" if growth < MOST_GROWTH else f"more than {MOST_GROWTH:g}"
                message = (
                    f"{mode.swings} at up to ω = {mode.omega:.4g} rad/s, and explicit_euler amplifies that at any "
                    f"step, here by a factor of {more} a second on reference; remove solver.integrator or set it to "
                    "semi_implicit_euler"
                )
                yield Warning("spring", message, {**figures, "growth": growth})
            continue
        limit = LIMITS[settings.integrator or "semi_implicit_euler"]
        if z < NEAR * limit:
            continue
        safe = NEAR * limit / mode.omega * settings.substeps
        what = "is unstable" if z >= limit * (1.0 - ROUNDING) else "is almost unstable"
        message = (
            f"{mode.swings} at up to ω = {mode.omega:.4g} rad/s: ω·h = {z:.3g} {what} (limit {limit:.3g}); "
            f"dt <= {at_most(safe)} s is stable"
        )
        yield Warning("spring", message, {**figures, "limit": limit, "safe_dt": safe})


def damper_warnings(scene: Scene, settings: Settings) -> Iterator[Warning]:
    """Yield a warning for each group of springs whose dampers make the reference diverge.

    The reference takes a damper's force at the start of the step: v becomes v·(1 − c·h/m), which grows in size once
    c·h/m exceeds 2. A stiff spring lowers that: semi-implicit Euler needs (ω·h)² + 2·c·h/m < 4. pymunk applies dampers
    exponentially, and XPBD implicitly: those have no limit.

    Measured on the reference with one ball on a spring, ω·h = 0.05 and 1, c·h/m from 0.5 to 50, every integrator: it
    diverges where this says so and nowhere else.
    """
    if settings.joints == "xpbd":
        return
    for mode in fastest(scene):
        damped, z = mode.damping_rate * settings.h, mode.omega * settings.h
        limit = DAMPER_LIMITS.get(settings.integrator or "", DAMPER_LIMIT)
        if settings.integrator in (None, "semi_implicit_euler"):
            limit = max(0.0, 0.5 * (4.0 - z * z))
        if damped == 0.0 or damped < limit * (1.0 - ROUNDING) or limit == 0.0:  # the last: a matter of the spring
            continue
        safe = settings.dt * limit / damped
        message = (
            f"the damping of {mode.group} is too strong for the step on reference: c·h/m = {damped:.3g} is "
            f"unstable (limit {limit:.3g}); use dt <= {at_most(safe)} s or the engine pymunk"
        )
        figures: Figures = {"joint": mode.joint, "damping_h": damped, "limit": limit, "safe_dt": safe}
        yield Warning("spring", message, figures)


class Mode(NamedTuple):
    """The fastest mode of a group of connected springs."""

    omega: float
    """rad/s, without damping"""
    zeta: float
    """the share of critical damping that its dampers give such a mode"""
    damping_rate: float
    """1/s: the largest c/m of any motion of the group"""
    joint: str
    """the group's first spring"""
    springs: int
    """in the group"""

    @property
    def group(self) -> str:
        """The group, in words."""
        return (
            f"the {self.springs:,} springs connected with {self.joint!r}"
            if self.springs > 1
            else f"the spring {self.joint!r}"
        )

    @property
    def swings(self) -> str:
        """The group and its verb."""
        if self.springs > 1:
            return f"the {self.springs:,} springs connected with {self.joint!r} oscillate"
        return f"the spring {self.joint!r} oscillates"


def fastest(scene: Scene) -> list[Mode]:
    """Return for each group of connected springs the fastest mode, with its lever arms, as the scene starts.

    ω² is the largest eigenvalue of M⁻¹K: for one spring k·(1/m_a + 1/m_b + arms²/I), in a chain or a cloth up to
    four times that. Across its line a stretched spring is k·(1 − l₀/l) stiff. Other joints are left out: they only
    make bodies heavier, so that the modes across them are slower than stated.
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
    root = np.sqrt(inverse.T)
    found = []
    for group in np.unique(home).tolist():
        mine = links.some(np.flatnonzero(home == group))
        rows, stiff, damping = _rows(mine, bodies.position, bodies.angle)
        omega = math.sqrt(_largest(mine, rows, stiff, root))
        rate = _largest(mine, rows, damping, root) if damping.any() else 0.0
        # Of springs of one material damping is as stiffness in every mode; of several, the least damped is taken.
        with np.errstate(over="ignore"):
            zeta = 0.5 * omega * float(np.min(mine.figures[:, 2] / mine.figures[:, 1]))
        found.append(Mode(omega, zeta, rate, mine.names[0], len(mine)))
    return found


def _largest(links: JointArrays, rows: FloatArray, weight: FloatArray, root: FloatArray) -> float:
    """Return the largest eigenvalue of M⁻¹·Jᵀ·W·J of one group; `root` (N, 3) is M^−½."""
    known, place = np.unique(np.concatenate((np.where(links.a >= 0, links.a, links.b), links.b)), return_inverse=True)
    place = place.reshape(-1)
    first, second = np.tile(place[: len(links)], 3), np.tile(place[len(links) :], 3)
    there = np.tile(links.a >= 0, 3)[:, None]
    # Each row's gradient in coordinates in which all masses are 1.
    on_a, on_b = rows[:, :3] * root[known[first]] * there, rows[:, 3:] * root[known[second]]
    size = 3 * len(known)

    def product(vector: FloatArray) -> FloatArray:
        each = vector.reshape(-1, 3)
        pull = weight * ((on_a * each[first]).sum(axis=1) + (on_b * each[second]).sum(axis=1))
        return _gathered(first, pull[:, None] * on_a, second, pull[:, None] * on_b, len(known))

    _, largest = extremes(product, size)
    return max(largest, 0.0)


def _gathered(first: IntArray, on_a: FloatArray, second: IntArray, on_b: FloatArray, count: int) -> FloatArray:
    total = np.empty((count, 3))
    for axis in range(3):
        total[:, axis] = np.bincount(first, on_a[:, axis], count) + np.bincount(second, on_b[:, axis], count)
    return total.reshape(-1)


def _rows(links: JointArrays, position: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how x, y, angle of both bodies strain each spring along, across, about it, (3J, 6), and k, c, (3J,)."""
    first, second = links.ends(position, angle)
    arm_a = np.where((links.a >= 0)[:, None], first - position[links.a], 0.0)
    arm_b = second - position[links.b]
    line = second - first
    length = np.hypot(*line.T)
    unit = np.where(length[:, None] > 0.0, line / np.where(length > 0.0, length, 1.0)[:, None], (1.0, 0.0))
    across = np.column_stack((-unit[:, 1], unit[:, 0]))
    straight = links.kind == LinkKind.SPRING
    rest, stiffness, damping = links.figures.T
    taut = np.clip(1.0 - rest / np.where(length > 0.0, length, np.inf), 0.0, 1.0)
    taut = np.where((length == 0.0) & (rest == 0.0), 1.0, taut)  # a spring of no length pulls alike every way
    rows = [np.column_stack((-n, -_cross(arm_a, n), n, _cross(arm_b, n))) * straight[:, None] for n in (unit, across)]
    rows.append(np.tile((0.0, 0.0, -1.0, 0.0, 0.0, 1.0), (len(links), 1)) * ~straight[:, None])
    stiff = np.concatenate((stiffness * straight, stiffness * taut * straight, stiffness * ~straight))
    damped = np.concatenate((damping * straight, np.zeros(len(links)), damping * ~straight))
    return np.concatenate(rows), stiff, damped


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
