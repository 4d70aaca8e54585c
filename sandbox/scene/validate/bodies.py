"""Checks of start positions, overlaps and generators."""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.resource_limits import MEMORY, OVERLAPS
from sandbox.scene.compile.bodies import Bodies, link_length
from sandbox.scene.compile.generators import count_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BACKING, MAX_BODIES, BodySource, BodySpec
from sandbox.scene.description.discs import Emitter
from sandbox.scene.description.fixed import Plane
from sandbox.scene.description.generators import ENDS, Cloth, Rope
from sandbox.scene.errors import LocatedMessage, Location
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.geometry.vectors import rotate

LocatedElement = tuple[Location, BodySource]

MAX_OVERLAPS, MAX_OVERLAPS_EACH = 10_000, 10
"""Largest number of overlapping pairs at the start: a constant, and an amount for each body."""
OVERLAP_BUDGET = 50_000_000
"""Candidate pairs after which the search for overlaps is abandoned; a few seconds."""
POSITION_KEYS = {"grid": "origin", "scatter": "lower", "stack": "base", "rope": "start", "cloth": "corner"}
"""Keys that give the position of a generator; for other elements it is `position`."""


def check_start_positions(
    scene: Scene, bodies: Bodies, elements: list[LocatedElement], prototypes: list[LocatedElement]
) -> Iterator[LocatedMessage]:
    """Yield the faults of start positions.

    Args:
        scene: the scene.
        bodies: its bodies.
        elements: elements that have bodies, each with its location.
        prototypes: `bodies.elements`, each with the location of its element.
    """
    touches = np.asarray([e.collides != "none" for e in bodies.elements], dtype=bool)[bodies.element]
    for plane, name in zip(scene.planes, scene.fixed_names, strict=False):
        if not has_direction(plane):
            continue
        depth = -height_above(plane, bodies.position)
        for element in distinct(bodies.element[touches & (depth > BACKING)]):
            deepest = float(depth[(bodies.element == element) & touches].max())
            message = (
                f"a centre starts {deepest:g} m behind the plane {name!r}; the limit is {BACKING:g} m, "
                "beyond which it could leave on the wrong side"
            )
            location = prototypes[element][0]
            key = POSITION_KEYS.get(str(location[0]), "position")
            yield (*location, key), message

    movable = np.asarray([e.collides == "all" for e in bodies.elements], dtype=bool)[bodies.element] & ~bodies.fixed
    max_overlaps = MAX_OVERLAPS + MAX_OVERLAPS_EACH * int(movable.sum())
    overlaps, pairs = 0, int(movable.sum()) * (int(movable.sum()) - 1) // 2
    if pairs > max_overlaps:  # few bodies cannot overlap so often, and need no search
        overlaps = count_overlaps(bodies.position[movable], bodies.core[movable], max_overlaps)
    if overlaps > max_overlaps:
        message = (
            f"the scene starts with {overlaps:,} or more overlapping pairs of bodies; the limit is {max_overlaps:,}. "
            'Spread them, or let them pass through each other with collides = "none" or "fixed"'
        )
        yield _largest(elements), message
        return
    if _is_crowded(bodies, movable):
        message = (
            f"the scene starts with more than {OVERLAPS.value:,} pairs of pieces so close that an engine must test "
            "them at every step. Spread the bodies, or use fewer pieces; "
            f"{OVERLAPS.remedy(2 * OVERLAPS.value)}"
        )
        yield _largest(elements), message
    passing = touches & ~bodies.fixed
    max_overlaps = max(max_overlaps, OVERLAPS.value)
    if (
        passing.sum() > movable.sum()
        and count_overlaps(bodies.position[passing], bodies.core[passing], max_overlaps) > max_overlaps
    ):
        message = (
            f"the scene starts with more than {max_overlaps:,} overlapping pairs of bodies that pass through each "
            "other, which must be tested at every step. Spread them, use fewer, or switch off all their collisions "
            f'with collides = "none"; {OVERLAPS.remedy(2 * OVERLAPS.value)}'
        )
        yield _largest(elements), message
    inside = _count_bodies_in_zones(scene, bodies.position[touches & ~bodies.fixed])
    refusal = OVERLAPS.refusal("the scene starts with bodies inside zones; the number of such pairs is", inside)
    if refusal is not None:
        yield ("zone", 0), refusal


def _largest(elements: list[LocatedElement]) -> Location:
    """Return the location of the element with the most bodies."""
    return max(elements, key=lambda each: count_of(each[1]))[0] if elements else ()


def _is_crowded(bodies: Bodies, movable: BoolArray) -> bool:
    """Return whether pieces of bodies other than balls have too many close pairs."""
    not_round = movable & ~bodies.round
    if not not_round.any():
        return False
    shapes = bodies.shapes
    chosen = not_round[shapes.body]
    body = shapes.body[chosen]
    x, y = shapes.middle[chosen].T
    offset = rotate(x, y, np.cos(bodies.angle[body]), np.sin(bodies.angle[body]))
    centre = bodies.position[body] + np.column_stack(offset)
    return count_overlaps(centre, shapes.bounding_radius[chosen], OVERLAPS.value, body) > OVERLAPS.value


def _count_bodies_in_zones(scene: Scene, position: FloatArray) -> int:
    """Return the number of pairs of a position (N, 2), m, and a zone whose bounding box contains it."""
    count = 0
    for zone in scene.zones:
        points = np.asarray(zone.points if zone.points is not None else [zone.position], np.float64)
        margin = zone.radius or zone.thickness or 0.0
        low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
        count += int(((position >= low) & (position <= high)).all(axis=1).sum())
    return count


def distinct(elements: IntArray) -> list[int]:
    """Return the distinct element indices, ascending."""
    return sorted(set(elements.tolist()))


def has_direction(plane: Plane) -> bool:
    """Return whether the normal of a plane can be normalised."""
    return 1e-100 <= math.hypot(*plane.normal) <= 1e100


def height_above(plane: Plane, position: FloatArray) -> FloatArray:
    """Return the signed distances (N,) of points (N, 2) from a plane's surface, m."""
    normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
    return np.asarray((position - np.asarray(plane.point)) @ normal)


def count_overlaps(
    position: FloatArray, radius: FloatArray, max_count: float = math.inf, owner: IntArray | None = None
) -> int:
    """Count overlapping pairs of discs, stopping early beyond `max_count` or when the budget is spent.

    If radii differ much, one large ball has all small ones as candidates, and the budget may be spent before a crowd of
    small ones is found. So each octave of radii is first counted by itself: of K octaves at one position, the number of
    all pairs is at most K times the number within octaves.

    Args:
        position: (N, 2) m.
        radius: (N,) m.
        max_count: counting stops beyond this number.
        owner: (N,) index of the body of each disc; two discs of one body are no pair.
    """
    owner = np.arange(len(radius)) if owner is None else owner
    position, radius, owner = position[radius > 0.0], radius[radius > 0.0], owner[radius > 0.0]
    octave = np.floor(np.log2(radius))
    present = sorted(set(octave.tolist()))
    within_octaves = 0
    for each in present if len(present) > 1 else ():
        in_octave = octave == each
        within_octaves += _overlaps(
            position[in_octave], radius[in_octave], owner[in_octave], max_count - within_octaves
        )
        if within_octaves > max_count:
            return within_octaves
    return max(within_octaves, _overlaps(position, radius, owner, max_count))


def _overlaps(position: FloatArray, radius: FloatArray, owner: IntArray, max_count: float) -> int:
    if len(radius) < 2:
        return 0
    overlaps = tested = 0
    for i, j in near_pairs(position, 2.0 * float(radius.max())):
        overlapping = (np.hypot(*(position[i] - position[j]).T) < radius[i] + radius[j]) & (owner[i] != owner[j])
        overlaps += int(overlapping.sum())
        tested += len(i)
        if overlaps > max_count or tested > OVERLAP_BUDGET:
            break
    return overlaps


BYTES_PER_VISIT = 4 * 8
"""Bytes for a body and a zone: the scene, the engine and two frames hold the state of every such pair."""

SHORTEST, LONGEST = 1e-9, 1e9
"""m, smallest and largest length of a link"""


def check_generators(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the faults of generators."""
    for k, scatter in enumerate(scene.scatters):
        if any(low > high for low, high in zip(scatter.lower, scatter.upper, strict=True)):
            yield ("scatter", k, "upper"), "must be the upper right corner, so not below or to the left of `lower`"
    for k, emitter in enumerate(scene.emitters):
        if any(low > high for low, high in zip(emitter.velocity_min, emitter.velocity_max, strict=True)):
            yield ("emitter", k, "velocity_max"), "must not be smaller than `velocity_min` in any component"
        for key, message in _check_lifetimes(emitter):
            yield ("emitter", k, key), message
    for k, stack in enumerate(scene.stacks):
        if stack.rows > stack.max_rows:
            limit = stack.max_rows
            message = (
                f"must be at most {limit}: with {stack.columns} columns and {stack.fewer} fewer in each "
                f"row, row {limit + 1} is empty"
            )
            yield ("stack", k, "rows"), message
    for k, rope in enumerate(scene.ropes):
        for key, message in (*_check_lengths(rope), *_check_springs(rope, rope.kind == "springs"), *_check_ends(rope)):
            yield ("rope", k, key), message
    for k, cloth in enumerate(scene.cloths):
        has_springs = cloth.kind == "springs"
        for key_path, message in (*_check_springs(cloth, has_springs), *_check_pins(cloth)):
            yield ("cloth", k, *((key_path,) if isinstance(key_path, str) else key_path)), message
    for k, ragdoll in enumerate(scene.ragdolls):
        if ragdoll.density is not None:
            yield (
                ("ragdoll", k, "density"),
                "does not apply to a ragdoll, whose segments divide its mass as in a human body; use `mass`",
            )
    yield from _check_counts(scene)


def _check_counts(scene: Scene) -> Iterator[LocatedMessage]:
    total, last = 0, ("", 0)
    for kind, sources in scene.kinds.items():
        for k, source in enumerate(sources):
            count = 1 if isinstance(source, BodySpec) else count_of(source)
            total, last = total + max(count, 0), (kind, k)
    if total > MAX_BODIES:
        yield last, f"the scene would have {total:,} bodies; the limit is {MAX_BODIES:,}"
    taken = total * len(scene.zones) * BYTES_PER_VISIT
    refusal = MEMORY.refusal(f"the table of {total:,} bodies in {len(scene.zones):,} zones takes", taken)
    if refusal is not None:
        yield ("zone", len(scene.zones) - 1), refusal


def _check_lifetimes(emitter: Emitter) -> Iterator[tuple[str, str]]:
    """Check lifetimes and colours of an emitter's particles."""
    if emitter.lifetime is None:
        if emitter.lifetime_jitter:
            yield "lifetime_jitter", "needs a `lifetime`, s"
        if emitter.colours is not None:
            yield "colours", "need a `lifetime`, s, over which they fade; add one, or use a single `colour`"
    elif emitter.lifetime_jitter >= emitter.lifetime:
        yield "lifetime_jitter", f"must be less than `lifetime`, which is {emitter.lifetime!r} s"
    if emitter.colours is not None and emitter.colour is not None:
        yield "colours", "cannot be combined with `colour`; remove one of the two"


def _check_lengths(rope: Rope) -> Iterator[tuple[str, str]]:
    """Check the length of a rope and of its links."""
    distance, each = math.dist(rope.start, rope.end), link_length(rope)
    key = "end" if rope.length is None else "length"
    if not SHORTEST <= each <= LONGEST:
        yield key, f"makes each link {each:g} m long; a link must be {SHORTEST:g} to {LONGEST:g} m long"
        return
    if rope.length is not None and rope.length < distance and rope.kind != "springs":
        yield (
            key,
            f"must be at least the distance from start to end, {distance!r} m, because {rope.kind} do not stretch",
        )
    if rope.length is not None and rope.length > distance and rope.links == 1:
        yield (
            "links",
            f"must be 2 or more for a rope that is longer than the distance from start to end, {distance!r} m",
        )
    # Next-but-one neighbours collide: planks are one plank apart, nodes two links.
    spacing = each if rope.kind == "planks" else 2.0 * each
    if rope.collides == "all" and rope.links > 2 and 2.0 * rope.radius >= spacing:
        yield (
            "radius",
            f'makes next-but-one neighbours overlap; use less than {0.5 * spacing:g} m, or collides = "fixed"',
        )
    if rope.kind == "planks":
        for which in ("angle", "angular_velocity"):
            if getattr(rope, which):
                yield which, "has no effect, because planks start at rest along the rope; remove it"


def _check_springs(body: Rope | Cloth, needed: bool) -> Iterator[tuple[str, str]]:
    """Check that springs have a stiffness, and that other joints have none."""
    if needed and body.stiffness is None:
        yield "stiffness", "is missing; springs need a stiffness, N/m"
    if not needed and body.stiffness is not None:
        yield "stiffness", f"applies to springs only, and `kind` is {body.kind!r}; remove it"
    if not needed and body.damping and not (isinstance(body, Cloth) and (body.shear or body.bend)):
        yield "damping", f"applies to springs only, and `kind` is {body.kind!r}; remove it"


def _check_ends(rope: Rope) -> Iterator[tuple[str, str]]:
    """Check how the ends of a rope are fixed or tied."""
    for end in ENDS:
        if rope.fix is not None and end in rope.fix and rope.tied(end) is not None:
            yield "fix", f"the {end} is also tied to {rope.tied(end)!r}; fix it or tie it, not both"
    if rope.links == 1 and rope.tie.start is not None and rope.tie.start == rope.tie.end:
        yield "tie", "names one body twice; a single link joins two different bodies"


def _check_pins(cloth: Cloth) -> Iterator[tuple[str | tuple[str | int, ...], str]]:
    """Check that pinned nodes exist, and that nodes do not overlap."""
    if not isinstance(cloth.pins, str):
        for n, (column, row) in enumerate(cloth.pins):
            if column >= cloth.columns or row >= cloth.rows:
                last = f"[{cloth.columns - 1}, {cloth.rows - 1}]"
                yield ("pins", n), f"[{column}, {row}] is outside the cloth, whose last node is {last}"
    if cloth.collides == "all" and cloth.columns * cloth.rows > 1 and 2.0 * cloth.radius > min(cloth.spacing):
        yield "radius", f'makes neighbours overlap; use at most {0.5 * min(cloth.spacing):g} m, or collides = "fixed"'


def check_rope_ties(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    """Yield the faults of the bodies that ropes are tied to."""
    first = len(bodies) - sum(map(count_of, (*scene.ropes, *scene.cloths, *scene.ragdolls)))
    for k, rope in enumerate(scene.ropes):
        count = count_of(rope)
        for end in ENDS:
            name = rope.tied(end)
            if name is not None and name not in bodies.number_of:
                known = ", ".join(map(repr, bodies.names[:5])) + (" …" if len(bodies) > 5 else "")
                yield ("rope", k, "tie", end), f"no body is named {name!r}; bodies: {known or 'none'}"
            elif name is not None and first <= bodies.number_of[name] < first + count:
                yield ("rope", k, "tie", end), f"{name!r} is part of the rope itself; name another body"
        first += count
