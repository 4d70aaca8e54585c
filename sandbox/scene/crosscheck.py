"""Cross-checks: what a scene's parts say about each other, which no single part can see."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from sandbox.scene.attachments import attachments
from sandbox.scene.bodies import Bodies
from sandbox.scene.claimed import claimed
from sandbox.scene.elements import elements_of
from sandbox.scene.faults import Location
from sandbox.scene.floored import floored
from sandbox.scene.generated import generated, tied
from sandbox.scene.generators import GeneratorError
from sandbox.scene.model import Material, Mover, Pair, Scene, Single, Surfaced, Wall
from sandbox.scene.outlines import outlines, sound
from sandbox.scene.part import MAX_POSITION, MAX_SPEED, MAX_STEPS
from sandbox.scene.repeats import repeats
from sandbox.scene.shapes import form_of
from sandbox.scene.starts import each_of, has_direction, starts
from sandbox.scene.surfaces import bearers_of, numbered
from sandbox.scene.zoned import layered, zoned

Found = tuple[Location, str]

MAX_SURFACES = 256
SHORTEST = 1e-9
"""m, the least length of a wall's segment"""


def crosscheck(scene: Scene) -> list[Found]:
    """Return every fault that lies between the parts of a scene; none means that it can be run."""
    materials, shapeless = list(_materials(scene)), [*generated(scene), *outlines(scene)]
    found = [*materials, *_fixed(scene), *zoned(scene), *layered(scene), *shapeless, *_world(scene)]
    if shapeless:  # what follows counts on being able to lay the bodies out
        return [*found, *_of_names(scene, {location[:2] for location, _ in shapeless})]
    found += [*repeats(scene), *_masses(scene)]
    try:
        bodies = scene.bodies
    except GeneratorError as error:
        return [*found, (error.location, str(error))]
    found += [
        *_names(scene, bodies),
        *_states(scene, bodies),
        *starts(scene, bodies, _elements(scene), _owners(scene)),
        *claimed(scene, bodies),
        *floored(scene, bodies),
    ]
    found += [*attachments(scene, bodies), *tied(scene, bodies)]
    return found if materials else [*found, *_surfaces(scene, bodies)]


def _of_names(scene: Scene, wrong: set[Location]) -> list[Found]:
    """Return what can be told of a scene of which some outlines are wrong: whom its parts speak of."""
    mended = sound(scene)
    if any(generated(mended)):
        return []
    try:
        bodies = mended.bodies
    except GeneratorError as error:
        return [(error.location, str(error))]
    found = [*_names(mended, bodies), *attachments(mended, bodies)]
    return [each for each in found if each[0][:2] not in wrong]


def _elements(scene: Scene) -> list[tuple[Location, Mover]]:
    """Return the elements that have bodies with their locations, in scene order."""
    return [((kind, k), element) for kind, elements in scene.kinds.items() for k, element in enumerate(elements)]


def _owners(scene: Scene) -> list[tuple[Location, Mover]]:
    """Return what `Bodies.elements` lists, each with the location of what stands for it."""
    return [(location, each) for location, mover in _elements(scene) for each in elements_of(mover)]


def _things(scene: Scene) -> list[tuple[Location, Surfaced]]:
    """Return the fixed things with their locations, in the order of their numbers."""
    kinds: dict[str, tuple[Surfaced, ...]] = {"plane": scene.planes, "wall": scene.walls, "post": scene.posts}
    return [((kind, k), thing) for kind, things in kinds.items() for k, thing in enumerate(things)]


def _parts(scene: Scene) -> Iterator[tuple[Location, Surfaced]]:
    """Yield the parts of bodies with their locations."""
    for k, compound in enumerate(scene.compounds):
        kinds = {"ball": compound.balls, "box": compound.boxes, "capsule": compound.capsules}
        for kind, parts in (*kinds.items(), ("polygon", compound.polygons)):
            for n, part in enumerate(parts):
                yield ("body", k, kind, n), part


def _materials(scene: Scene) -> Iterator[Found]:
    declared: set[str] = set()
    for k, material in enumerate(scene.materials):
        if material.name in declared:
            yield ("material", k, "name"), f"a second material named {material.name!r}; names are unique"
        declared.add(material.name)

    known = f"declared are: {', '.join(sorted(declared))}" if declared else "the scene has no [[material]]"
    stated: set[frozenset[str]] = set()
    for k, pair in enumerate(scene.pairs):
        for side, name in enumerate(pair.between):
            if name not in declared:
                yield ("pair", k, "between", side), f"no material is named {name!r}; {known}"
        if frozenset(pair.between) in stated:
            yield ("pair", k, "between"), "this pair is stated a second time; state it once"
        stated.add(frozenset(pair.between))

    for location, thing in (*_things(scene), *_elements(scene), *_parts(scene)):
        if thing.material is not None and thing.material not in declared:
            yield (*location, "material"), f"no material is named {thing.material!r}; {known}"


def _masses(scene: Scene) -> Iterator[Found]:
    for location, element in _owners(scene):
        if element.mass is not None and element.density is not None:
            yield (*location, "density"), "mass and density are both stated; state one of them"
            continue
        mass, moment = form_of(element)[1:3]
        if not 1e-15 <= mass <= 1e30:
            key = "density" if element.density is not None else "mass"
            yield (*location, key), f"gives a mass of {mass:g} kg; masses are 1e-15 to 1e30 kg"
        elif not (1e-200 <= moment <= 1e200):
            yield location, f"gives a moment of inertia of {moment:g} kg·m²; 1e-200 to 1e200 kg·m² are possible"
    for location, element in _elements(scene):
        if isinstance(element, Single) and element.fixed and (any(element.velocity) or element.angular_velocity):
            key = "velocity" if any(element.velocity) else "angular_velocity"
            yield (*location, key), "a fixed body never moves; leave this out, or fixed"


def _fixed(scene: Scene) -> Iterator[Found]:
    for k, plane in enumerate(scene.planes):
        if not has_direction(plane):
            yield ("plane", k, "normal"), f"{list(plane.normal)} has no direction; such as [0, 1] for a floor"
    for k, wall in enumerate(scene.walls):
        for where, message in course(wall):
            yield ("wall", k, *where), message
    yield from _gates(scene)


def _gates(scene: Scene) -> Iterator[Found]:
    """Check what kicks, lets pass, or is not solid: a post has no length, and the cushions of a table do none of it."""
    for k, post in enumerate(scene.posts):
        if post.kick is not None and post.kick.profile != "even":
            yield ("post", k, "kick", "profile"), "is of a wall's length, which a post has not; 'even' is right here"
    if scene.surface is None and not scene.pockets:
        return
    for location, thing in _things(scene):
        for key, usual in (("kick", None), ("one_way", False), ("solid", True), ("restitution_falloff", None)):
            if getattr(thing, key, usual) != usual:
                yield (*location, key), "is not of a cushion: balls on a [surface] meet what is solid and does not kick"
    some: dict[str, Sequence[Material | Pair | Mover]] = {
        "material": scene.materials,
        "pair": scene.pairs,
        **scene.kinds,
    }
    for kind, those in some.items():
        for k, each in enumerate(those):
            if each.restitution_falloff:
                yield (
                    (kind, k, "restitution_falloff"),
                    "is not of balls on a [surface], which rebound alike at any speed",
                )


def course(wall: Wall) -> Iterator[Found]:
    """Yield the faults of a wall's course, by their places in the wall."""
    if wall.closed and len(wall.points) < 3:
        yield ("closed",), "two points enclose nothing; a closed wall has three or more"
    ends = (*wall.points[1:], wall.points[0]) if wall.closed else wall.points[1:]
    for n, (a, b) in enumerate(zip(wall.points, ends, strict=False)):
        if math.dist(a, b) < SHORTEST:
            yield ("points", n), f"lies on the point after it; neighbours are at least {SHORTEST:g} m apart"


def _world(scene: Scene) -> Iterator[Found]:
    if scene.world.bounds is not None:
        lower, upper = scene.world.bounds
        if not all(low < high for low, high in zip(lower, upper, strict=True)):
            yield ("world", "bounds"), "encloses nothing; give the lower left and then the upper right corner"
    steps = scene.world.duration / scene.solver.h
    if steps > MAX_STEPS:
        shortest = scene.world.duration * scene.solver.substeps / MAX_STEPS
        message = f"{steps:.3g} steps a run; at most {MAX_STEPS:g}, so at least {shortest:g} s for this duration"
        yield ("solver", "dt"), message


def _names(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    seen: set[str] = set()
    owners, twice = _owners(scene), set[Location]()
    for name, element in zip(bodies.names, bodies.element.tolist(), strict=True):
        if name in seen and owners[element][0] not in twice:
            twice.add(owners[element][0])
            yield (*owners[element][0], "name"), _taken(name)
        seen.add(name)
    pockets = [("pocket", k) for k in range(len(scene.pockets))]
    zones = [("zone", k) for k in range(len(scene.zones))]
    for name, location in zip(scene.fixed_names, [*(w for w, _ in _things(scene)), *pockets, *zones], strict=True):
        if name in seen:
            yield (*location, "name"), _taken(name)
        seen.add(name)


def _taken(name: str) -> str:
    return f"a second body or fixed thing is called {name!r}; names are unique"


def _surfaces(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    if len(numbered(scene, (*bearers_of(bodies.elements), *scene.fixed))[0]) > MAX_SURFACES:
        yield (), f"more than {MAX_SURFACES} different surfaces; share materials between bodies"


def _states(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    """Check places and speeds that a generator may have carried out of range."""
    owners = _owners(scene)
    for wrong, message in (
        (np.abs(bodies.position).max(axis=1, initial=0) > MAX_POSITION, f"a body lies beyond ±{MAX_POSITION:g} m"),
        (np.hypot(*bodies.velocity.T) > MAX_SPEED, f"a body is faster than {MAX_SPEED:g} m/s"),
    ):
        for element in each_of(bodies.element[wrong]):
            yield owners[element][0], message
    if scene.world.bounds is not None:
        lower, upper = np.asarray(scene.world.bounds)
        outside = ((bodies.position < lower) | (bodies.position > upper)).any(axis=1)
        for element in each_of(bodies.element[outside]):
            yield owners[element][0], "starts outside world.bounds, where bodies are retired"
