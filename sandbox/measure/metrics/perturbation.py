"""Perturbation of the start of a scene by 1e-12 m in every body, which measures how long a run is predictable."""

import math
from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.measure.metrics.clearance import IndexPair, clearance, close_pairs
from sandbox.measure.metrics.invariants import CONSTRAINT_KINDS
from sandbox.measure.metrics.trajectory_error import errors
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.trajectory import Trajectory

PERTURBATION = 1e-12
"""m, default displacement of each body"""
ULPS = 4.0
"""A coordinate so large that 1e-12 m is below its rounding is changed by this many units in the last place."""
TOUCH_TOLERANCE = 1e-9
"""m: clearances and overlaps up to this count as contact; larger ones do not change by a displacement of 1e-12 m."""
TouchingPair = tuple[IndexPair, FloatArray]
"""Pair in contact with the indices of `Contacts`, and a normal of the contact, (2,)."""
MIN_STRETCH = 0.1
"""Smallest random factor of the distances in a group of touching discs, of which the mean is 1; above 0, so that no
contact closes.
"""
PARALLEL_SINE = 1e-6
"""Sine of the angle up to which two contact normals count as parallel: their numerical derivative has seven digits."""


def perturb(
    start: Scene | Setup,
    amount: float = PERTURBATION,
    seed: int = 0,
    reverse: bool = False,
    touching: list[TouchingPair] | None = None,
) -> Setup | None:
    """Return the scene with a displacement of every body that can collide or is attracted.

    The direction of each displacement follows from the state of the body and the seed, not from its index, so that an
    additional body does not change those of the others. No overlap is made: a body with contacts in one direction only,
    such as a box in a stack, moves perpendicular to it. Bodies that are wedged or joined move together with all bodies
    that they are connected with; discs without joints also part, by some `amount` at each contact, as the balls of a
    rack, so that impacts that reach several of them at once come in an order. If that is not possible either, the
    velocity changes by `amount` in m/s. Polygons without contacts are also rotated, by `amount` over their radius.
    Static and driven bodies are not displaced.

    Args:
        start: scene or setup; it stays unchanged.
        amount: displacement, m.
        seed: seed of the directions.
        reverse: take the opposite directions. Of a scene and its reverse, one has impacts that are simultaneous in the
            original in one order and the other in the opposite order.
        touching: `touching_pairs` up to the tolerance or twice the amount, whichever is more, if they are known.

    Returns:
        The perturbed setup; None if there is no such body, so that no difference can grow.
    """
    setup = Setup.of(start)
    scene, bodies, matrix = setup.scene, setup.bodies, contact_matrix(setup)
    immovable = bodies.fixed | is_driven(scene, bodies)
    able = ~immovable & (~matrix.free | bool(scene.attractions or scene.liquids))
    if not able.any():
        return None
    touching = touching_pairs(setup, max(TOUCH_TOLERANCE, 2.0 * amount)) if touching is None else touching
    joints = setup.joints.of(*CONSTRAINT_KINDS)
    joined = [edge for edge in zip(joints.a.tolist(), joints.b.tolist(), strict=True) if edge[0] >= 0]
    normals: dict[int, list[FloatArray]] = {}
    for edge, normal in touching:
        for number in edge:
            if number >= 0 and not immovable[number]:
                normals.setdefault(number, []).append(normal)
    bound = np.isin(np.arange(len(bodies)), joined) & ~immovable
    for number, normals_of_body in normals.items():
        bound[number] |= _perpendicular(normals_of_body) is None
    connected = [edge for edge in (*joined, *(edge for edge, _ in touching)) if min(edge) >= 0 and bound[[*edge]].all()]
    group = connected_groups(len(bodies), connected)
    outward: dict[int, list[FloatArray]] = {}
    for edge, normal in touching:
        labels = {int(group[number]) if number >= 0 else number for number in edge}
        for label in labels if len(labels) > 1 else ():
            outward.setdefault(label, []).append(normal)

    is_joined = np.isin(np.arange(len(bodies)), joined)
    reversal = -1.0 if reverse else 1.0
    position, velocity, angle = bodies.position.copy(), bodies.velocity.copy(), bodies.angle.copy()
    mixed = _hash_rows(np.column_stack((bodies.position, bodies.velocity, bodies.radius)), seed)
    order = np.argsort(group, kind="stable")
    for members in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        if not able[members].any():
            continue
        chosen, label = int(mixed[members].min()), int(group[members[0]])
        direction, along = reversal * _free_direction(chosen), None
        if label in outward:
            along = _perpendicular(outward[label])
            if along is None:
                velocity[members] += amount * direction
                continue
            direction = reversal * (along if chosen % 2 else -along)
        elif len(members) == 1 and not bodies.round[label]:
            angle[label] += math.copysign(amount, direction[0]) / bodies.radius[label]
        shift = _shift(position[members], amount * direction)
        if len(members) > 1 and bodies.round[members].all() and not is_joined[members].any():
            random = 0.5 + reversal * (mixed[members] % 1000 / 1000.0 - 0.5)
            axes = np.stack((direction, [-direction[1], direction[0]])) if along is None else along[None]
            shift = shift + _parting(position[members], bodies.radius[members], amount, random, axes)
        position[members] += shift
    return replace(setup, bodies=replace(bodies, position=position, velocity=velocity, angle=angle))


def touching_pairs(start: Scene | Setup, touch: float = TOUCH_TOLERANCE) -> list[TouchingPair]:
    """Return the pairs in contact at the start of a scene, and a normal of each, (2,).

    Args:
        start: scene or setup, with the indices of `Contacts`; one body of each pair can move.
        touch: largest clearance or overlap of a contact, m.
    """
    setup = Setup.of(start)
    immovable = setup.bodies.fixed | is_driven(setup.scene, setup.bodies)
    pairs = [pair for pair, clear in close_pairs(setup, touch) if clear >= -touch]
    return [((i, j), _normal(setup, j if immovable[i] else i, (i, j))) for i, j in pairs]


def _normal(setup: Setup, number: int, pair: IndexPair) -> FloatArray:
    """Return the direction in which the clearance of a pair grows as one of its bodies moves, a unit vector (2,)."""
    bodies = setup.bodies
    start = bodies.position[number]
    if min(pair) >= 0 and bodies.round[[*pair]].all():
        apart = bodies.position[pair[1]] - bodies.position[pair[0]]
        return np.asarray(apart / (math.hypot(*apart) or 1.0))
    step = max(1e-7 * float(bodies.radius[number]), 1e5 * float(np.spacing(np.abs(start)).max()))
    position = np.repeat(bodies.position[None], 4, axis=0)
    position[:, number] += step * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    gaps = clearance(setup.scene, bodies, position, np.repeat(bodies.angle[None], 4, axis=0), pair)
    slope = np.array([gaps[0] - gaps[1], gaps[2] - gaps[3]])
    length = math.hypot(*slope)
    return slope / length if length > 0.0 else np.zeros(2)


def connected_groups(count: int, edges: list[IndexPair]) -> IntArray:
    """Return for each body the lowest index of the bodies that it is connected with, (count,)."""
    parent = list(range(count))

    def root(number: int) -> int:
        while parent[number] != number:
            parent[number] = number = parent[parent[number]]
        return number

    for i, j in edges:
        low, high = sorted((root(i), root(j)))
        parent[high] = low
    return np.array([root(number) for number in range(count)], dtype=np.int64)


def _hash_rows(figures: FloatArray, seed: int) -> IntArray:
    """Return a pseudo-random number for each row, (N,), by the mixing function of SplitMix64."""
    mixed = np.full(len(figures), seed, dtype=np.uint64)
    with np.errstate(over="ignore"):
        for column in (figures + 0.0).T:  # −0 becomes 0
            mixed = mixed + column.copy().view(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
            mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            mixed = mixed ^ (mixed >> np.uint64(31))
    return np.asarray(mixed >> np.uint64(1), dtype=np.int64)


def _free_direction(chosen: int) -> FloatArray:
    """Return the direction of a random number; each coordinate has at least a third of its length."""
    quarter, fraction = chosen % 4, (chosen >> 2) % 1000 / 1000.0
    turn = math.radians(90.0 * quarter + 20.0 + 50.0 * fraction)
    return np.array([math.cos(turn), math.sin(turn)])


def _perpendicular(normals: list[FloatArray]) -> FloatArray | None:
    """Return a unit vector perpendicular to all normals, (2,); None if there is none."""
    first = normals[0]
    if (
        any(abs(float(first[0] * other[1] - first[1] * other[0])) > PARALLEL_SINE for other in normals)
        or not first.any()
    ):
        return None
    along = np.array([-first[1], first[0]])
    return np.where(np.abs(along) < PARALLEL_SINE, 0.0, along)


def _shift(positions: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return the displacement nearest to a wanted one that is the same for all positions (K, 2), (2,) m.

    It is a multiple of two units in the last place of the largest coordinate, which is added without rounding, so that
    clearances do not change.
    """
    digit = 2.0 * float(np.spacing(max(np.abs(positions).max(), np.abs(wanted).max())))
    smallest = np.sign(wanted) * 0.5 * ULPS * digit
    rounded = np.round(wanted / digit) * digit
    return np.where(np.abs(rounded) < np.abs(smallest), smallest, rounded)


def _parting(
    position: FloatArray, radius: FloatArray, amount: float, random: FloatArray, axes: FloatArray
) -> FloatArray:
    """Return displacements that part M discs in contact, (M, 2) m: stretches along axes, by random factors.

    No two discs approach each other: on each axis, the order of the displacements is that of the positions. Impacts can
    be passed on faster through two of the gaps than through one: each interval of an axis has its own factor.

    Args:
        position: centres, (M, 2) m.
        radius: (M,) m.
        amount: m, mean gap between two of the smallest discs.
        random: numbers from 0 to 1, (M,).
        axes: unit vectors at right angles, (A, 2).
    """
    rounding = 16.0 * float(np.spacing(np.abs(position).max()))  # which must not close a gap
    stretch = max(amount, rounding) / (2.0 * float(radius.min()))
    found = np.zeros_like(position)
    for axis in axes:
        along = position @ axis
        order = np.argsort(along, kind="stable")
        factor = MIN_STRETCH + 2.0 * (1.0 - MIN_STRETCH) * random[order[1:]]
        shift = np.empty(len(along))
        shift[order] = stretch * np.concatenate(([0.0], np.cumsum(factor * np.diff(along[order]))))
        found += np.outer(shift - shift.mean(), axis)
    return found


def agreement_time(a: Trajectory, b: Trajectory, scene: Scene, tolerance: float) -> float:
    """Return the last time up to which two runs agree in every position, s.

    It is the duration of the scene if they always agree. If a run ended early, they agree at most up to its last frame.
    """
    found = errors(a, b, ~scene.bodies.fixed)
    apart = np.flatnonzero(found.position > tolerance)
    if len(apart):
        return float(found.time[apart[0] - 1]) if apart[0] else 0.0
    if a.status == b.status == "ok":
        return scene.world.duration
    return float(found.time[-1]) if len(found.time) else 0.0
