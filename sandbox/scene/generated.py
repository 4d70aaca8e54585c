"""Checks of generators: whether what they stand for can be laid out at all."""

import math
from collections.abc import Iterator

from sandbox.scene.bodies import Bodies
from sandbox.scene.elements import pitch
from sandbox.scene.faults import Location
from sandbox.scene.layouts import count_of
from sandbox.scene.model import Cloth, Emitter, Rope, Scene
from sandbox.scene.part import MAX_BODIES
from sandbox.scene.weaves import ENDS

Found = tuple[Location, str]

SHORTEST, LONGEST = 1e-9, 1e9
"""m, of a link"""


def generated(scene: Scene) -> Iterator[Found]:
    """Yield the faults of a scene's generators."""
    for k, scatter in enumerate(scene.scatters):
        if any(low > high for low, high in zip(scatter.lower, scatter.upper, strict=True)):
            yield ("scatter", k, "upper"), "lies below or left of `lower`; it is the upper right corner"
    for k, emitter in enumerate(scene.emitters):
        if any(low > high for low, high in zip(emitter.velocity_min, emitter.velocity_max, strict=True)):
            yield ("emitter", k, "velocity_max"), "is smaller than `velocity_min` in a component"
        for key, message in _lives(emitter):
            yield ("emitter", k, key), message
    for k, stack in enumerate(scene.stacks):
        if stack.rows > stack.most_rows:
            most = stack.most_rows
            message = (
                f"row {most + 1} would hold no box: {stack.columns} columns, {stack.fewer} fewer each; at most {most}"
            )
            yield ("stack", k, "rows"), message
    for k, rope in enumerate(scene.ropes):
        for key, message in (*_lengths(rope), *_springs(rope, rope.kind == "springs"), *_ends(rope)):
            yield ("rope", k, key), message
    for k, cloth in enumerate(scene.cloths):
        wanted = cloth.kind == "springs"
        for where, message in (*_springs(cloth, wanted), *_pins(cloth)):
            yield ("cloth", k, *((where,) if isinstance(where, str) else where)), message
    for k, ragdoll in enumerate(scene.ragdolls):
        if ragdoll.density is not None:
            yield (
                ("ragdoll", k, "density"),
                "is not a ragdoll's: its segments share its mass as people's do; state that",
            )
    yield from _population(scene)


def _population(scene: Scene) -> Iterator[Found]:
    total, last = 0, ("", 0)
    for kind, movers in scene.kinds.items():
        for k, mover in enumerate(movers):
            total, last = total + max(count_of(mover), 0), (kind, k)
    if total > MAX_BODIES:
        yield last, f"the scene would hold {total:,} bodies; at most {MAX_BODIES:,}"


def _lives(emitter: Emitter) -> Iterator[tuple[str, str]]:
    """Check what is said of the lives of particles."""
    if emitter.lifetime is None:
        if emitter.lifetime_jitter:
            yield "lifetime_jitter", "is of a `lifetime`, s; state one"
        if emitter.colours is not None:
            yield "colours", "fade over a `lifetime`, s; state one, or a single `colour`"
    elif emitter.lifetime_jitter >= emitter.lifetime:
        yield "lifetime_jitter", f"would end lives before they begin; less than `lifetime`, {emitter.lifetime!r} s"
    if emitter.colours is not None and emitter.colour is not None:
        yield "colours", "stand instead of `colour`; leave one of the two out"


def _lengths(rope: Rope) -> Iterator[tuple[str, str]]:
    """Check the lengths of a rope and of its links."""
    distance, each = math.dist(rope.start, rope.end), pitch(rope)
    key = "end" if rope.length is None else "length"
    if not SHORTEST <= each <= LONGEST:
        yield key, f"makes each link {each:g} m long; {SHORTEST:g} to {LONGEST:g} m are possible"
        return
    if rope.length is not None and rope.length < distance and rope.kind != "springs":
        yield key, f"is shorter than from start to end, {distance!r} m, and {rope.kind} do not stretch"
    if rope.length is not None and rope.length > distance and rope.links == 1:
        yield "links", f"one link cannot be longer than from start to end, {distance!r} m; it takes two or more to hang"
    # Next neighbours are not joined: of planks they are a plank apart, of nodes two links.
    room = each if rope.kind == "planks" else 2.0 * each
    if rope.collides == "all" and rope.links > 2 and 2.0 * rope.radius >= room:
        yield "radius", f'makes neighbours but one overlap; less than {0.5 * room:g} m, or collides = "fixed"'
    if rope.kind == "planks":
        for which in ("angle", "angular_velocity"):
            if getattr(rope, which):
                yield which, "planks lie along the rope, at rest; leave this out"


def _springs(woven: Rope | Cloth, needed: bool) -> Iterator[tuple[str, str]]:
    """Check that springs have figures, and nothing else has."""
    if needed and woven.stiffness is None:
        yield "stiffness", "is missing; springs need one, N/m"
    if not needed and woven.stiffness is not None:
        yield "stiffness", f"is of springs; kind is {woven.kind!r}"
    if not needed and woven.damping and not (isinstance(woven, Cloth) and (woven.shear or woven.bend)):
        yield "damping", f"is of springs; kind is {woven.kind!r}"


def _ends(rope: Rope) -> Iterator[tuple[str, str]]:
    """Check what holds the ends of a rope."""
    for end in ENDS:
        if rope.fix is not None and end in rope.fix and rope.tied(end) is not None:
            yield "fix", f"the {end} is tied to {rope.tied(end)!r}; fix it or tie it, not both"
    if rope.links == 1 and rope.tie.start is not None and rope.tie.start == rope.tie.end:
        yield "tie", "one link joins two bodies; these are one and the same"


def _pins(cloth: Cloth) -> Iterator[tuple[str | tuple[str | int, ...], str]]:
    """Check that pins are of nodes, and that nodes have room."""
    if not isinstance(cloth.pins, str):
        for n, (column, row) in enumerate(cloth.pins):
            if column >= cloth.columns or row >= cloth.rows:
                most = f"[{cloth.columns - 1}, {cloth.rows - 1}]"
                yield ("pins", n), f"[{column}, {row}] is outside the cloth; its last node is {most}"
    if cloth.collides == "all" and cloth.columns * cloth.rows > 1 and 2.0 * cloth.radius > min(cloth.spacing):
        yield "radius", f'makes neighbours overlap; {0.5 * min(cloth.spacing):g} m at most, or collides = "fixed"'


def tied(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    """Yield the faults of what ropes are tied to."""
    first = len(bodies) - sum(map(count_of, (*scene.ropes, *scene.cloths, *scene.ragdolls)))
    for k, rope in enumerate(scene.ropes):
        count = count_of(rope)
        for end in ENDS:
            name = rope.tied(end)
            if name is not None and name not in bodies.names:
                known = ", ".join(map(repr, bodies.names[:5])) + (" …" if len(bodies) > 5 else "")
                yield ("rope", k, "tie", end), f"no body is named {name!r}; there are {known or 'none'}"
            elif name is not None and first <= bodies.names.index(name) < first + count:
                yield ("rope", k, "tie", end), f"{name!r} is of the rope itself; name another body"
        first += count
