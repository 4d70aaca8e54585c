"""Chains of joints: convergence of the solver, stretch, and joints that start with an error.

An iterative solver propagates information from joint to joint, once an iteration. Since impulses are kept, it can
converge over several substeps, but only if it converges faster than the position correction acts; otherwise the joints
come apart. The impulses of the slowest mode converge at 2λ per iteration, with λ the smallest eigenvalue of the joint
matrix J·M⁻¹·Jᵀ with its diagonal scaled to 1. The rate of the correction is r = (1 − bias^h)/h, with pymunk's default
bias 6.3 per second. So iterations/h has to be r/(2λ).

Measured on pymunk 7.3.1, chains of n equal balls on rods, and of boxes on pivots, fixed at one end, links of 0.025 to
1.6 m, 60 to 480 Hz, 4 s: they hold from iterations/h = 2.4 n² on, which is 60 for 5 links, 240 for 10, 960 for 20, 3840
for 40, and come apart (joint error 0.2 to 20 of a link) below 0.75 of it; r/(2λ) is 2.56 n². With n = 2 and a load of
100 times a link's mass at the end it takes between 480 and 960 (r/(2λ): 637), of 1000 times 4800 to 7680 (6325); with n
= 10 and 100 times 3840 to 7680 (5862). With another bias, 1e-6, 2.2 times r, it takes 2.2 times as much. Not covered:
the stretch of a swinging chain, which decreases with h alone (20 links from the horizontal at 480 Hz: by 40 % of a
link), and pivots of links so short that g·h²·n is more than half of one.

Relaxation, XPBD and RATTLE correct each joint in turn, and each pass propagates only part of the fall in the substep,
g·h². Measured on the reference, chains of 10 to 100 rods of 0.1 m that hang at rest, 60 and 240 Hz, 2 to 50 iterations:
the uppermost joint stretches by c·n·g·h²/iterations, c = 0.8 to 1.8, which grows with n/iterations.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.solver_settings import BIAS
from sandbox.formatting import format_plural
from sandbox.measure.metrics.invariants import ANGLE_KINDS, joint_scales, starting_errors
from sandbox.measure.preflight.diagnostic import ROUNDING, Details, Diagnostic, floor_3_digits, required_iterations
from sandbox.measure.preflight.stiffness import Product, connected_groups, extreme_eigenvalues
from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

MEASURED_FRACTION = 0.93
"""Fraction of r/(2λ) from which on chains hold, as measured."""
IMPULSE_KINDS = (JointKind.ROD, JointKind.PIVOT, JointKind.SLIDE, JointKind.GROOVE, JointKind.PULLEY)
MIN_MASS_RATIO = 10.0
"""A joint between masses whose ratio exceeds this is named."""


def chain_warnings(scene: Scene, settings: Settings) -> Iterator[Diagnostic]:
    """Yield a diagnostic for each group of joints that need more iterations.

    Its kind is `mass_ratio` if equal masses would suffice, otherwise `chain`. Only joints solved by impulses count;
    springs and motors are no constraints, and joints that may give way come apart as intended.
    """
    if settings.joints not in (None, "impulses"):
        return
    joints = scene.joint_arrays.some(~scene.joint_arrays.is_limited).of(*IMPULSE_KINDS)
    if len(joints) < 2:
        return
    bodies, available = scene.bodies, settings.iterations / settings.h
    solver_bias = BIAS if settings.bias is None else settings.bias
    free = np.where(bodies.immovable, -1, np.arange(len(bodies)))
    a, b = np.where(joints.a >= 0, free[joints.a], -1), free[joints.b]
    group_of = connected_groups(a, b, len(bodies))[np.where(b >= 0, b, a)]
    for group in np.unique(group_of).tolist():
        members = np.flatnonzero(group_of == group)
        some = joints.some(members)
        bias = float(np.where(np.isnan(some.bias), solver_bias, some.bias).min())  # of the fastest correction
        rate = (1.0 - bias**settings.h) / settings.h
        inverse = np.where(bodies.immovable, 0.0, 1.0 / bodies.mass)
        needed = MEASURED_FRACTION * 0.5 * rate / least_eigenvalue(some, inverse)
        if needed <= available * (1.0 + ROUNDING):
            continue
        needed_if_equal = MEASURED_FRACTION * 0.5 * rate / least_eigenvalue(some, (inverse > 0.0).astype(np.float64))
        iterations, _ = required_iterations(needed, settings)
        dt = settings.substeps * _safe_substep(needed, settings, bias)
        details: Details = {
            "joints": len(some),
            "joint": some.names[0],
            "needed": needed,
            "has": available,
            "iterations": iterations,
            "safe_dt": dt,
        }
        shorter = f" or dt <= {floor_3_digits(dt)} s" if dt > 0.0 else ""
        remedy = f"use solver.iterations >= {iterations:,}{shorter} ({needed:.3g} a second)"
        count = format_plural(settings.iterations, "iteration")
        budget = f"with {count} every {settings.h:.3g} s ({available:.3g} a second)"
        k, ratio = _most_unequal(some, inverse)
        if needed_if_equal <= available * (1.0 + ROUNDING) and ratio >= MIN_MASS_RATIO:
            first, second = bodies.names[int(some.a[k])], bodies.names[int(some.b[k])]
            message = (
                f"the joint {some.names[k]!r} connects {first!r} and {second!r}, one of which is {ratio:.3g} times as "
                f"heavy; {budget} it would come apart"
            )
            yield Diagnostic("mass_ratio", message, {**details, "joint": some.names[k], "ratio": ratio}, remedy)
        else:
            name = f"the joint {some.names[0]!r} is heavily loaded"
            if len(some) > 1:
                name = f"{len(some):,} joints, {some.names[0]!r} among them, are connected"
            message = f"{name}; {budget} {'it' if len(some) == 1 else 'they'} would come apart"
            yield Diagnostic("chain", message, details, remedy)


def _safe_substep(needed: float, settings: Settings, bias: float) -> float:
    """Return the largest substep, s, at which the present number of iterations is enough.

    The required iterations per second grow as the substep h shrinks, as (1 − bias^h)/h, so that the condition is
    iterations >= K (1 − bias^h).

    Args:
        needed: required iterations per second with the present substep.
        settings: the present settings.
        bias: fraction of an error that remains after one second of correction.
    """
    most = needed * settings.h / (1.0 - bias**settings.h)  # K: needed if the whole error is corrected at once
    if bias == 0.0 or settings.iterations >= most:
        return 0.0 if bias == 0.0 else settings.h
    return math.log1p(-settings.iterations / most) / math.log(bias)


def least_eigenvalue(joints: JointArrays, inverse_mass: FloatArray) -> float:
    """Return λ, the smallest eigenvalue but 0 of the matrix of connected joints, its diagonal scaled to 1.

    The joints are assumed to lie in one line, the critical case: one joint is then one row, with 1/m at its bodies and
    −1/m towards the adjacent joints. M^−½ Jᵀ D⁻¹ J M^−½ has the same eigenvalues, and allows redundant joints.

    Args:
        joints: those of one group.
        inverse_mass: (N,) 1/kg; 0 for static bodies.
    """
    known, index = np.unique(
        np.concatenate((np.where(joints.a >= 0, joints.a, joints.b), joints.b)), return_inverse=True
    )
    index = index.reshape(-1)
    first, second = index[: len(joints)], index[len(joints) :]
    root = np.sqrt(inverse_mass[known])
    on_a, on_b = -root[first] * (joints.a >= 0), root[second]
    diagonal = on_a**2 + on_b**2

    def product(vector: FloatArray) -> FloatArray:
        impulse = (on_a * vector[first] + on_b * vector[second]) / diagonal
        total = np.bincount(first, impulse * on_a, len(known)) + np.bincount(second, impulse * on_b, len(known))
        return total.astype(np.float64)

    moving = np.flatnonzero(root > 0.0)
    anchored = bool(((on_a == 0.0) | (on_b == 0.0)).any())
    null = None
    if not anchored:  # a common translation is possible
        null = np.zeros(len(known))
        null[moving] = 1.0 / root[moving]
        null /= np.linalg.norm(null)
    smallest, _ = extreme_eigenvalues(
        _restricted(product, moving, len(known)), len(moving), null if null is None else null[moving]
    )
    return max(smallest, 1e-12)


def _restricted(product: Product, moving: IntArray, count: int) -> Product:
    """Return the product with the rows and columns of the moving bodies."""

    def inner(vector: FloatArray) -> FloatArray:
        full = np.zeros(count)
        full[moving] = vector
        return np.asarray(product(full)[moving])

    return inner


def _most_unequal(joints: JointArrays, inverse_mass: FloatArray) -> tuple[int, float]:
    """Return the index of the joint between the most unequal moving masses, and their ratio."""
    first = np.where(joints.a >= 0, inverse_mass[joints.a], 0.0)
    second = inverse_mass[joints.b]
    both = (first > 0.0) & (second > 0.0)
    ratio = np.where(both, np.maximum(first, second) / np.where(both, np.minimum(first, second), 1.0), 1.0)
    k = int(ratio.argmax())
    return k, float(ratio[k]) if math.isfinite(ratio[k]) else 1.0


STRETCH_COEFFICIENT = 1.6
"""c, see above."""
MAX_STRETCH = 0.01
"""Largest error of a joint as a fraction of its length."""


def stretch_warnings(scene: Scene, settings: Settings) -> Iterator[Diagnostic]:
    """Yield a diagnostic if the rods of a hanging chain stretch by more than `MAX_STRETCH`.

    Only rods solved by position corrections count.
    """
    pull = math.hypot(*scene.world.gravity) * scene.bodies.largest_gravity_scale
    if settings.joints not in ("relaxation", "xpbd", "rattle") or pull == 0.0:
        return
    joints, depth = scene.joint_arrays.of(JointKind.ROD), 0
    if not len(joints):
        return
    is_static = np.append(scene.bodies.immovable, True)  # the world is −1, the last
    reached = is_static.copy()
    while True:  # one joint farther from the static bodies each time
        next_joints = reached[joints.a] ^ reached[joints.b]
        if not next_joints.any():
            break
        depth += 1
        reached[joints.a[next_joints]] = reached[joints.b[next_joints]] = True
    length = float(joints.figures[:, 0].min())
    fraction = (
        STRETCH_COEFFICIENT * depth * pull * settings.h**2 / settings.iterations / length if length > 0.0 else 0.0
    )
    if fraction > MAX_STRETCH:
        excess = fraction / MAX_STRETCH
        iterations, dt = math.ceil(settings.iterations * excess), settings.dt / math.sqrt(excess)
        message = (
            f"a chain with {joints.names[0]!r} hangs {depth:,} joints deep; {settings.joints} with "
            f"{settings.iterations} iterations every {settings.h:.3g} s stretches it by {fraction:.2g} of a joint's "
            "length"
        )
        remedy = f"solver.iterations >= {iterations:,} or dt <= {floor_3_digits(dt)} s keeps that to {MAX_STRETCH:g}"
        details: Details = {"joints": depth, "joint": joints.names[0], "share": fraction, "safe_dt": dt}
        yield Diagnostic("chain", message, details, remedy)


MAX_START_ERROR = 0.01
"""An error below this fraction of a joint's length is rounding of the numbers in a file, which have two or three
digits.
"""

FAR_ANCHOR_RADII = 2.0
"""An anchor farther from the centre of its body than this many radii is a lever without mass, or a mistake."""

ANCHORED_KINDS = (JointKind.ROD, JointKind.PIVOT, JointKind.SLIDE, JointKind.SPRING)

ANCHOR_ORDER = (
    "in a joint with one body, the first of `anchors` is in the frame of the body, the second in world coordinates"
)


def joint_start_warnings(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a diagnostic for the largest initial joint error, and one for the first joint with swapped anchors.

    Anchors count as swapped if a joint with one body holds it at a point far outside of it while the other anchor would
    be within the body; not so for a pivot that starts satisfied, since the other order would violate it.
    """
    joints = scene.joint_arrays
    if not len(joints):
        return
    errors = starting_errors(scene)
    fractions = np.nan_to_num(errors / joint_scales(joints, scene.bodies))
    swapped = _swapped(scene, joints) & ~((joints.kind == JointKind.PIVOT) & (fractions <= MAX_START_ERROR))
    violated = (fractions > MAX_START_ERROR) & ~swapped
    if violated.any():
        worst = int(np.argmax(np.where(violated, fractions, 0.0)))
        yield _start_warning(joints, worst, float(errors[worst]), int(violated.sum()) - 1)
    if swapped.any():
        k, others = int(np.argmax(swapped)), int(swapped.sum()) - 1
        name, body = joints.names[k], scene.bodies.names[int(joints.b[k])]
        x, y = joints.anchor_b[k].tolist()
        message = (
            f"the joint {name!r} is attached to {body!r} at ({x:g}, {y:g}), outside the body and "
            f"{np.hypot(x, y):.3g} m from its centre: {ANCHOR_ORDER}; swapped, they would fit{_and_others(others)}"
        )
        yield Diagnostic("anchors", message, {"joint": name, "body": body, "others": others})


def _start_warning(joints: JointArrays, k: int, error: float, others: int) -> Diagnostic:
    """Return the diagnostic of a joint that starts with an error, m or rad."""
    unit, name = "rad" if joints.kind[k] in ANGLE_KINDS else "m", joints.names[k]
    message = (
        f"the joint {name!r} starts with an error of {error:.3g} {unit}{_and_others(others)}; "
        "the first steps correct it, which adds energy"
    )
    details: Details = {"joint": name, "error": error, "others": others}
    return Diagnostic("joint_start", message, details)


def _and_others(count: int) -> str:
    return f" (and {count:,} other{'s' if count > 1 else ''})" if count else ""


def _swapped(scene: Scene, joints: JointArrays) -> BoolArray:
    """Return which joints of one body with the world have anchors that would fit in the other order, (J,)."""
    radius = scene.bodies.radius[joints.b]
    own_distance, other_distance = np.hypot(*joints.anchor_b.T), np.hypot(*joints.anchor_a.T)
    stated = np.arange(len(joints)) < len(scene.joints)
    applies = stated & (joints.a == WORLD) & np.isin(joints.kind, ANCHORED_KINDS)
    return np.asarray(applies & (own_distance > FAR_ANCHOR_RADII * radius) & (other_distance <= radius))
