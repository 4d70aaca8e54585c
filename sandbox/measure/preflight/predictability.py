"""Limits of predictability: order-dependent breaks, event rates, and the Lyapunov time of a gas.

pymunk detects contacts at the end of each substep. Its adapter then moves collisions back to their time, finds grazes
in between up to `MAX_GRAZE_RADII`, and collisions that follow from others in the same substep, so that the step matters
little. A rack whose balls touch is different: its collisions occur at one instant, and rounding decides their order.

Measured by `tools/calibration/breaks.py`, 16 balls broken at 6 m/s, 5 seeds, 60 to 960 Hz: with gaps of 1e-8 m to 1 mm
in the rack no ball was 1 mm from its position with a sixteenth of the step within 2 s; without gaps, some were 0.02 s
after the first collision.

On the exact engine, a ball that would rest on another round body bounces at g·5e-5 s or 5e-4 m/s, whichever is less,
and each bounce affects all bodies in contact. Measured, balls of 5 cm, g = 1 to 100 m/s², two layers of 3 to 20 and
single ones: a ball upright on another costs 30,000 events a second, one between two others 56,000 to 77,000 without
friction; with friction, the three collide more and more often, 1.4 million times a second before they exceed the bound.
Above 10 m/s² it is proportional to g.

Each impact of two discs multiplies the angle between two nearby paths by about 4λ/d, with λ the mean free path and d
the diameter (N. S. Krylov, Works on the Foundations of Statistical Physics, 1979), so that 1e-12 m grow at the rate
ν·ln(1 + 4λ/d). A disc has ν = 2·n·d·√π·σ·χ impacts a second, with n discs per square metre, σ² the mean square of one
component of their velocities, and χ = (1 − 7φ/16)/(1 − φ)² for the covered fraction φ (D. Henderson 1975).

That is the mean over the balls. The horizon is that of the ball whose error grows fastest, `FASTEST_GROWTH` times as
fast. Measured against `exact`, gases of 16 to 625 balls that cover 3 to 50 % of their box, three seeds each, all balls
perturbed (`metrics.perturbation.perturb`): the rate is 0.75 to 1.45 times that, and increases with the number of balls.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.arrays import IntArray
from sandbox.measure.metrics.perturbation import PERTURBATION
from sandbox.measure.preflight.diagnostic import Details, Diagnostic, floor_3_digits
from sandbox.measure.preflight.speed_bound import top_speeds
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.demands import AIR, FLOOR, OWN_MOTION, Demand, demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.geometry.neighbours import near_pairs

MIN_RACK_BALLS = 3
"""Smallest number of balls of a break."""

MAX_GRAZE_RADII = 1.28
"""Radii that a ball may move in a substep, relative to another, so that a graze is found: a chord through the skin of
1/20 of a radius that pymunk's discs have here.
"""

TOUCH_TOLERANCE = 1e-9
"""m, largest clearance of balls in contact."""


def break_notes(scene: Scene) -> Iterator[Diagnostic]:
    """Yield notes on balls on a `[surface]` that can collide: on racks in contact, and on steps that hide grazes."""
    bodies = scene.bodies
    if scene.surface is None or not demands(scene) & FLOOR or not bodies.round.all():
        return
    matrix = contact_matrix(scene)
    collides_with_all = np.asarray([element.collides == "all" for element in bodies.elements], np.bool_)[bodies.element]
    balls = np.flatnonzero(collides_with_all & ~bodies.immovable)
    if len(balls) < MIN_RACK_BALLS:
        return
    radius = float(bodies.radius[balls].max())
    touching = _touching(scene, balls)
    if touching >= MIN_RACK_BALLS - 1:
        message = (
            f"{touching:,} pairs of balls touch: they collide at one instant, and rounding decides in which order; "
            "later positions can depend on dt and engine; gaps of 1e-8 m or more define the order"
        )
        yield Diagnostic("rack", message, {"pairs": touching})
    speed = float(top_speeds(scene, matrix)[balls].max())
    travel = speed * scene.solver.h / radius
    if travel > MAX_GRAZE_RADII:
        safe = MAX_GRAZE_RADII * radius * scene.solver.substeps / speed
        message = (
            f"balls move up to {travel:.3g} radii per substep ({speed:.3g} m/s), and pymunk may miss grazing contacts: "
            f"positions are reliable until about the first one; dt <= {floor_3_digits(safe)} s detects all"
        )
        details: Details = {"speed": speed, "radii": travel, "safe_dt": safe}
        yield Diagnostic("graze", message, details)


def _touching(scene: Scene, balls: IntArray) -> int:
    """Return the number of pairs of balls in contact at the start of a scene."""
    bodies, pairs = scene.bodies, 0
    position, radius = bodies.position[balls], bodies.radius[balls]
    for i, j in near_pairs(position, 2.0 * float(radius.max()) + 2.0 * TOUCH_TOLERANCE):
        away = np.hypot(*(position[i] - position[j]).T) - radius[i] - radius[j]
        pairs += int((away <= TOUCH_TOLERANCE).sum())
    return pairs


ALLOWED_EVENTS, ALLOWED_EVENTS_PER_BALL = 1_000_000, 1_000
"""Events per simulated second that `exact` allows: the first number, or the second for each ball if that is more."""
UPRIGHT_RATE, SMOOTH_RATE, ROUGH_RATE = 3.0e4, 6.4e4, 1.4e6
"""Events per second of a ball on one other ball, and of one between others without friction and with it."""
STEADY_GRAVITY = 10.0
"""m/s², gravity up to which these rates hold."""


def event_rate(scene: Scene, matrix: ContactMatrix) -> float:
    """Return an upper estimate of the events per second of `exact` once all balls lie on each other.

    It counts the balls that start above others, although they may come to rest beside them. 0 if nothing can come to
    rest on another body: without gravity or static objects, or with elastic contacts.
    """
    bodies, pull = scene.bodies, math.hypot(*scene.world.gravity)
    movers = matrix.touches & ~bodies.immovable
    count = int(movers.sum())
    if pull == 0.0 or count == 0 or not matrix.mutual or not bodies.round.all() or not scene.fixed:
        return 0.0
    if matrix.restitution >= 1.0:
        return 0.0
    columns = _columns(scene)
    each = UPRIGHT_RATE if columns == 1 else ROUGH_RATE if matrix.friction > 0.0 else SMOOTH_RATE
    return (count - columns) * each * max(1.0, pull / STEADY_GRAVITY)


def _columns(scene: Scene) -> int:
    """Return the number of balls that have no ball below them at the start: these come to rest on the ground."""
    bodies = scene.bodies
    down = np.asarray(scene.world.gravity) / math.hypot(*scene.world.gravity)
    across = bodies.position[~bodies.immovable] @ np.asarray([-down[1], down[0]])
    width = 2.0 * float(bodies.radius.min())
    last, columns = -math.inf, 0
    for place in np.sort(across).tolist():
        if place - last >= width:
            last, columns = place, columns + 1
    return columns


def event_warnings(scene: Scene, matrix: ContactMatrix) -> Iterator[Diagnostic]:
    """Yield a diagnostic if `exact` would stop because of too many events."""
    warning = event_warning(event_rate(scene, matrix), len(scene.bodies))
    if warning is not None:
        yield warning


def event_warning(rate: float, bodies: int) -> Diagnostic | None:
    """Return a diagnostic if a rate of events, 1/s, exceeds the limit of `exact` for a number of bodies."""
    allowed = max(ALLOWED_EVENTS, ALLOWED_EVENTS_PER_BALL * bodies)
    if rate <= allowed:
        return None
    frequency = f"{rate:.2g} times a second" if math.isfinite(rate) else "without bound"
    message = (
        f"balls that come to rest on each other collide {frequency} on `exact`, which allows {allowed:,} events a "
        "simulated second and stops with an error beyond; pymunk and reference let them rest"
    )
    details: Details = {"rate": min(rate, MAX_RATE), "allowed": allowed}
    return Diagnostic("event_rate", message, details)


MAX_RATE = 1e12
"""Value that is reported for an unbounded rate, 1/s."""


TOLERANCE = 0.01
"""Tolerance as a fraction of the smallest radius, as in a comparison of engines."""
FASTEST_GROWTH = 1.25
"""Growth rate of the first error relative to the mean: the geometric mean of the measurements."""
MIN_GAS_BALLS = 10
"""Smallest number of balls of a gas."""
MAX_COVERED = 0.85
"""Largest covered fraction of a gas."""


def lyapunov_time(scene: Scene) -> float | None:
    """Return the time in which a perturbation of 1e-12 m grows to a hundredth of a radius, s; None if there is no gas.

    A gas consists of balls that collide with each other in a box of level and upright planes, without gravity, joints,
    drag, lift, damping or speed limits.
    """
    bodies, world, matrix = scene.bodies, scene.world, contact_matrix(scene)
    movers = matrix.touches & ~bodies.immovable
    count = int(movers.sum())
    if (
        not matrix.mutual
        or count < MIN_GAS_BALLS
        or not bodies.round.all()
        or len(scene.joint_arrays)
        or scene.attractions
    ):
        return None
    forces = AIR | OWN_MOTION | {Demand.BUOYANCY, Demand.TYRES}
    if any(world.gravity) or demands(scene) & forces or bodies.kinematic.any():
        return None
    area = _area(scene)
    if area is None:
        return None
    radius = float(bodies.radius[movers].mean())
    spread = math.sqrt(0.5 * float((bodies.velocity[movers] ** 2).sum(axis=1).mean()))
    covered = math.pi * float((bodies.radius[movers] ** 2).sum()) / area
    if not 0.0 < covered < MAX_COVERED or spread == 0.0:
        return None
    crowding = (1.0 - 7.0 * covered / 16.0) / (1.0 - covered) ** 2
    impacts = 4.0 * radius * count / area * math.sqrt(math.pi) * spread * crowding
    free_path = math.sqrt(0.5 * math.pi) * spread / impacts
    rate = FASTEST_GROWTH * impacts * math.log1p(2.0 * free_path / radius)
    return math.log(TOLERANCE * float(bodies.radius[movers].min()) / PERTURBATION) / rate


def _area(scene: Scene) -> float | None:
    """Return the area of the box of the planes, m²; None if a side is open or slanted."""
    sides: dict[tuple[int, int], float] = {}
    for plane in scene.planes:
        normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
        axis = int(np.abs(normal).argmax())
        if abs(normal[1 - axis]) > 0.0:
            return None
        sides[axis, int(np.sign(normal[axis]))] = plane.point[axis]
    if len(sides) < 4:
        return None
    width, height = (sides[axis, -1] - sides[axis, 1] for axis in (0, 1))
    return width * height if width > 0.0 and height > 0.0 else None


def horizon_notes(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if positions are not predictable to the end of the run."""
    until = lyapunov_time(scene)
    if until is not None and until < scene.world.duration:
        message = (
            f"positions are chaotic: an error of 1e-12 m grows to 1 % of a radius in about {until:.2g} s of "
            f"{scene.world.duration:g} s; after that, compare only energy, momentum and speeds"
        )
        details: Details = {"until": until}
        yield Diagnostic("horizon", message, details)
