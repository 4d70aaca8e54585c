"""Horizon: until when a run can be predicted, measured by a second run whose start differs by 1e-12 m in every body."""

import math
from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.measure.compare.errors import errors
from sandbox.measure.compare.gaps import Pair, close_pairs, gap
from sandbox.measure.joint_error import HOLDING
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.setup import Setup
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

NUDGE = 1e-12
"""m"""
ULPS = 4.0
"""Where a coordinate is so large that 1e-12 m vanishes beside it, it is moved by so many of its last digits."""
TOUCH = 1e-9
"""m: gaps and overlaps no larger than this count as touching; larger ones stay what they are if moved by 1e-12 m."""
PARALLEL = 1e-6
"""Sine of the angle up to which two contact normals count as parallel: their numerical derivative has seven digits."""


def perturb(start: Scene | Setup, amount: float = NUDGE, seed: int = 0) -> Setup | None:
    """Return the scene with every body that can meet, or is drawn by, something moved by `amount`.

    Each body moves in a direction of its own, which follows from its state and the seed and not from its number: a
    further body elsewhere changes nothing for the others. No contact is made or broken: what touches in one direction
    alone moves square to it, as a box does in a stack. What is wedged, as a ball in a rack, or held by joints moves as
    one with all that it is connected with. What cannot move like that either has its velocity changed by `amount` in
    m/s. Polygons that touch nothing also turn, by `amount` over their radius. Fixed and driven bodies stay.

    Args:
        start: scene or setup to be perturbed; it stays as it was.
        amount: m.
        seed: of the directions.

    Returns:
        None where there is no such body: no difference can grow then.
    """
    setup = Setup.of(start)
    scene, bodies, meet = setup.scene, setup.bodies, contact_matrix(setup)
    still = bodies.fixed | is_driven(scene, bodies)
    able = ~still & (~meet.free | bool(scene.attractions))
    if not able.any():
        return None
    touching = touching_pairs(setup, max(TOUCH, 2.0 * amount))
    links = setup.links.of(*HOLDING)
    joined = [edge for edge in zip(links.a.tolist(), links.b.tolist(), strict=True) if edge[0] >= 0]
    normals: dict[int, list[FloatArray]] = {}
    for edge, normal in touching:
        for number in edge:
            if number >= 0 and not still[number]:
                normals.setdefault(number, []).append(normal)
    bound = np.isin(np.arange(len(bodies)), joined) & ~still
    for number, own in normals.items():
        bound[number] |= _square_to(own) is None
    connected = [edge for edge in (*joined, *(edge for edge, _ in touching)) if min(edge) >= 0 and bound[[*edge]].all()]
    group = _groups(len(bodies), connected)
    outward: dict[int, list[FloatArray]] = {}
    for edge, normal in touching:
        labels = {int(group[number]) if number >= 0 else number for number in edge}
        for label in labels if len(labels) > 1 else ():
            outward.setdefault(label, []).append(normal)

    position, velocity, angle = bodies.position.copy(), bodies.velocity.copy(), bodies.angle.copy()
    mixed = _mixed(np.column_stack((bodies.position, bodies.velocity, bodies.radius)), seed)
    order = np.argsort(group, kind="stable")
    for members in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        if not able[members].any():
            continue
        chosen, label = int(mixed[members].min()), int(group[members[0]])
        direction = _free_direction(chosen)
        if label in outward:
            along = _square_to(outward[label])
            if along is None:
                velocity[members] += amount * direction
                continue
            direction = along if chosen % 2 else -along
        elif len(members) == 1 and not bodies.round[label]:
            angle[label] += math.copysign(amount, direction[0]) / bodies.radius[label]
        position[members] += _shift(position[members], amount * direction)
    return replace(setup, bodies=replace(bodies, position=position, velocity=velocity, angle=angle))


def touching_pairs(start: Scene | Setup, touch: float = TOUCH) -> list[tuple[Pair, FloatArray]]:
    """Return which pairs touch at the start of a scene, and a normal of each, (2,).

    Args:
        start: scene or setup with bodies and static objects; numbered as in `Contacts`. Of a pair, one can move.
        touch: m; a gap or an overlap of no more is a touch.
    """
    setup = Setup.of(start)
    still = setup.bodies.fixed | is_driven(setup.scene, setup.bodies)
    pairs = [pair for pair, clear in close_pairs(setup, touch) if clear >= -touch]
    return [((i, j), _normal(setup, j if still[i] else i, (i, j))) for i, j in pairs]


def _normal(setup: Setup, number: int, pair: Pair) -> FloatArray:
    """Return the direction in which the gap of a pair grows as one of its bodies moves, (2,), of length 1."""
    bodies = setup.bodies
    place = bodies.position[number]
    if min(pair) >= 0 and bodies.round[[*pair]].all():
        apart = bodies.position[pair[1]] - bodies.position[pair[0]]
        return np.asarray(apart / (math.hypot(*apart) or 1.0))
    step = max(1e-7 * float(bodies.radius[number]), 1e5 * float(np.spacing(np.abs(place)).max()))
    position = np.repeat(bodies.position[None], 4, axis=0)
    position[:, number] += step * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    gaps = gap(setup.scene, bodies, position, np.repeat(bodies.angle[None], 4, axis=0), pair)
    slope = np.array([gaps[0] - gaps[1], gaps[2] - gaps[3]])
    length = math.hypot(*slope)
    return slope / length if length > 0.0 else np.zeros(2)


def _groups(count: int, edges: list[Pair]) -> IntArray:
    """Return for each of `count` bodies the lowest number among those it is connected with."""
    parent = list(range(count))

    def root(number: int) -> int:
        while parent[number] != number:
            parent[number] = number = parent[parent[number]]
        return number

    for i, j in edges:
        low, high = sorted((root(i), root(j)))
        parent[high] = low
    return np.array([root(number) for number in range(count)], dtype=np.int64)


def _mixed(figures: FloatArray, seed: int) -> IntArray:
    """Return a number that is as good as random for each row, (N,), by the mixing function of SplitMix64."""
    mixed = np.full(len(figures), seed, dtype=np.uint64)
    with np.errstate(over="ignore"):
        for column in (figures + 0.0).T:  # which makes −0 a 0
            mixed = mixed + column.copy().view(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
            mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            mixed = mixed ^ (mixed >> np.uint64(31))
    return np.asarray(mixed >> np.uint64(1), dtype=np.int64)


def _free_direction(chosen: int) -> FloatArray:
    """Return the direction that belongs to a random number: of each coordinate, at least a third of its length."""
    quarter, fraction = chosen % 4, (chosen >> 2) % 1000 / 1000.0
    turn = math.radians(90.0 * quarter + 20.0 + 50.0 * fraction)
    return np.array([math.cos(turn), math.sin(turn)])


def _square_to(normals: list[FloatArray]) -> FloatArray | None:
    """Return a direction that is square to all normals, (2,) of length 1; None where there is none."""
    first = normals[0]
    if any(abs(float(first[0] * other[1] - first[1] * other[0])) > PARALLEL for other in normals) or not first.any():
        return None
    along = np.array([-first[1], first[0]])
    return np.where(np.abs(along) < PARALLEL, 0.0, along)


def _shift(places: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return the displacement next to the wanted one that moves all places (K, 2) by exactly as much, (2,).

    A multiple of two last digits of the largest coordinate is added without rounding, so that gaps stay as they are.
    """
    digit = 2.0 * float(np.spacing(max(np.abs(places).max(), np.abs(wanted).max())))
    least = np.sign(wanted) * 0.5 * ULPS * digit
    rounded = np.round(wanted / digit) * digit
    return np.where(np.abs(rounded) < np.abs(least), least, rounded)


def agree_until(a: Trajectory, b: Trajectory, scene: Scene, tolerance: float) -> float:
    """Return the last time up to which two runs of a scene agree in every position; its duration, if throughout.

    Where a run ended early, they agree no longer than to its last frame.
    """
    found = errors(a, b, ~scene.bodies.fixed)
    apart = np.flatnonzero(found.position > tolerance)
    if len(apart):
        return float(found.time[apart[0] - 1]) if apart[0] else 0.0
    if a.status == b.status == "ok":
        return scene.world.duration
    return float(found.time[-1]) if len(found.time) else 0.0
