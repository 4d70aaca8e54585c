"""Checks of relations between the elements of a scene."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from sandbox.scene.compile.bodies import MOTION, Bodies, elements_of
from sandbox.scene.compile.contacts import index_surfaces, surface_parts
from sandbox.scene.compile.generators import GeneratorError
from sandbox.scene.compile.paths import path_faults
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import MAX_POSITION, MAX_SPEED, MAX_STEPS, BodySource, BodySpec, HasMaterial, Vector
from sandbox.scene.description.bodies import Compound
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.generators import Stack
from sandbox.scene.description.world import Material, Pair
from sandbox.scene.errors import LocatedMessage, Location
from sandbox.scene.geometry.shapes import geometry_of
from sandbox.scene.validate.bodies import (
    check_generators,
    check_rope_ties,
    check_start_positions,
    distinct,
    has_direction,
)
from sandbox.scene.validate.geometry import (
    MAX_REPEATS,
    check_categories,
    check_layers,
    check_outlines,
    check_repeats,
    check_sensors,
    check_zones,
    with_placeholder_shapes,
    without_paths,
)
from sandbox.scene.validate.references import check_attachments, check_events, check_play, check_surface

MAX_SURFACES = 256
MAX_NAMES = 10
"""Largest number of materials listed in a message."""
SHORTEST = 1e-9
"""m, smallest length of a wall's segment"""


def crosscheck(scene: Scene) -> list[LocatedMessage]:
    """Return every fault across the elements of a scene; an empty list means that it can be run.

    Checks of tables that the scene does not have are left out.
    """
    materials, shapeless = list(_check_materials(scene)), list(check_generators(scene))
    if scene.polygons or scene.compounds:
        shapeless += check_outlines(scene)
    found = [*materials, *_check_planes_and_walls(scene)]
    if with_path := [each for each in _elements(scene) if isinstance(each[1], BodySpec) and each[1].path is not None]:
        faults = list(_check_paths(with_path))
        scene = without_paths(scene) if faults else scene  # the other checks need the bodies
        found += faults
    if scene.zones:
        found += check_zones(scene)
    if scene.sensors:
        found += check_sensors(scene)
    if len(scene.layers) > 1:
        found += check_layers(scene)
    if scene.categories:
        found += check_categories(scene)
    found += [*shapeless, *_check_world(scene)]
    if shapeless:  # the other checks need the bodies
        return [*found, *_check_names_only(scene, {location[:2] for location, _ in shapeless})]
    if _may_repeat(scene):
        found += check_repeats(scene)
    found += _check_masses(scene)
    try:
        bodies = scene.bodies
    except GeneratorError as error:
        return [*found, (error.location, str(error))]
    found += [
        *_check_names(scene, bodies),
        *_check_initial_state(scene, bodies),
        *check_start_positions(scene, bodies, _elements(scene), _prototypes(scene)),
    ]
    if scene.play.model_fields_set:
        found += check_play(scene, bodies)
    if _has_surface_keys(scene):
        found += check_surface(scene, bodies)
    if scene.joints or scene.thrusts or scene.tyres or scene.attractions or scene.drives or scene.sensors:
        found += check_attachments(scene, bodies)
    if scene.ropes:
        found += check_rope_ties(scene, bodies)
    if scene.events:
        found += check_events(scene, bodies, are_others_valid=not found)
    return found if materials else [*found, *_check_surface_count(scene, bodies)]


def _may_repeat(scene: Scene) -> bool:
    """Return whether a scene may have more than `MAX_REPEATS` identical static colliders, by their number."""
    segments, singles = sum(len(wall.points) for wall in scene.walls), (scene.balls, scene.boxes, scene.capsules)
    count = len(scene.planes) + segments + len(scene.posts) + sum(map(len, singles))
    return count > MAX_REPEATS or bool(scene.polygons or scene.compounds)  # these may have many pieces


def _has_surface_keys(scene: Scene) -> bool:
    """Return whether a scene has a `[surface]`, or keys that need one."""
    cushions: tuple[Wall | Post, ...] = (*scene.walls, *scene.posts)
    return (
        scene.surface is not None
        or bool(scene.contact_models.model_fields_set or scene.shots)
        or any(ball.spin is not None for ball in scene.balls)
        or any(cushion.height is not None for cushion in cushions)
    )


def _check_names_only(scene: Scene, wrong: set[Location]) -> list[LocatedMessage]:
    """Return the faults of names and references in a scene with invalid outlines, using placeholder shapes."""
    substitute = with_placeholder_shapes(scene)
    if any(check_generators(substitute)):
        return []
    try:
        bodies = substitute.bodies
    except GeneratorError as error:
        return [(error.location, str(error))]
    found = [*_check_names(substitute, bodies), *check_attachments(substitute, bodies)]
    by_mass = ("drive", "moment")  # placeholder shapes have other masses
    return [each for each in found if each[0][:2] not in wrong and (each[0][0], each[0][-1]) != by_mass]


def _elements(scene: Scene) -> list[tuple[Location, BodySource]]:
    """Return the elements that have bodies with their locations, in scene order."""
    return [((kind, k), element) for kind, elements in scene.kinds.items() for k, element in enumerate(elements)]


def _prototypes(scene: Scene) -> list[tuple[Location, BodySource]]:
    """Return `Bodies.elements`, each with the location of its element."""
    return [(location, each) for location, source in _elements(scene) for each in elements_of(source)]


def _static_colliders(scene: Scene) -> list[tuple[Location, HasMaterial]]:
    """Return the static colliders with their locations, in the order of their indices."""
    kinds: dict[str, tuple[HasMaterial, ...]] = {"plane": scene.planes, "wall": scene.walls, "post": scene.posts}
    return [((kind, k), collider) for kind, colliders in kinds.items() for k, collider in enumerate(colliders)]


def _parts(scene: Scene) -> Iterator[tuple[Location, HasMaterial]]:
    """Yield the parts of bodies with their locations."""
    for k, compound in enumerate(scene.compounds):
        kinds = {"ball": compound.balls, "box": compound.boxes, "capsule": compound.capsules}
        for kind, parts in (*kinds.items(), ("polygon", compound.polygons)):
            for n, part in enumerate(parts):
                yield ("body", k, kind, n), part


def _check_materials(scene: Scene) -> Iterator[LocatedMessage]:
    declared: set[str] = set()
    for k, material in enumerate(scene.materials):
        if material.name in declared:
            yield ("material", k, "name"), f"another material is also named {material.name!r}; names must be unique"
        declared.add(material.name)

    known = "the scene has no [[material]]"
    if declared:
        more = " …" if len(declared) > MAX_NAMES else ""
        known = f"materials: {', '.join(sorted(declared)[:MAX_NAMES])}{more}"
    stated: set[frozenset[str]] = set()
    for k, pair in enumerate(scene.pairs):
        for side, name in enumerate(pair.between):
            if name not in declared:
                yield ("pair", k, "between", side), f"no material is named {name!r}; {known}"
        if frozenset(pair.between) in stated:
            yield ("pair", k, "between"), "this pair is stated twice; remove one"
        stated.add(frozenset(pair.between))

    for location, collider in (*_static_colliders(scene), *_elements(scene), *_parts(scene)):
        if collider.material is not None and collider.material not in declared:
            yield (*location, "material"), f"no material is named {collider.material!r}; {known}"


def _check_masses(scene: Scene) -> Iterator[LocatedMessage]:
    for location, element in _prototypes(scene):
        if element.mass is not None and element.density is not None:
            yield (*location, "density"), "cannot be combined with `mass`; remove one of the two"
            continue
        mass, moment = geometry_of(element)[1:3]
        if not 1e-15 <= mass <= 1e30:
            key = "density" if element.density is not None else "mass"
            yield (*location, key), f"gives a mass of {mass:g} kg; a mass must be 1e-15 to 1e30 kg"
        elif not (1e-200 <= moment <= 1e200):
            yield location, f"has a moment of inertia of {moment:g} kg·m²; it must be 1e-200 to 1e200 kg·m²"
    for location, element in _elements(scene):
        if isinstance(element, BodySpec):
            yield from (((*location, key), message) for key, message in _check_immovable(element))
        elif isinstance(element, Stack):
            yield from (((*location, key), message) for key, message in _check_at_rest(element))


def _check_paths(elements: list[tuple[Location, BodySource]]) -> Iterator[LocatedMessage]:
    """Yield the faults of paths."""
    for location, single in elements:
        assert isinstance(single, BodySpec)
        yield from (((*location, *key), message) for key, message in path_faults(single))


def _check_immovable(single: BodySpec) -> Iterator[tuple[str, str]]:
    """Yield the keys that a fixed or kinematic body cannot have, with the reasons."""
    yield from _check_at_rest(single)
    if single.fixed and single.kinematic:
        yield "kinematic", "cannot be combined with `fixed`; remove one of the two"
    if single.kinematic and single.fixed_rotation:
        yield "fixed_rotation", "has no effect on a kinematic body, which nothing turns; remove it"
    if single.one_way is not None:
        yield from _check_one_way(single, single.one_way)
    if single.lift and (single.fixed or single.kinematic):
        yield "lift", f"has no effect on a {'fixed' if single.fixed else 'kinematic'} body; remove it"
    if single.kinematic:
        yield from _motion_keys(single, "a kinematic body")


def _check_one_way(single: BodySpec, direction: Vector) -> Iterator[tuple[str, str]]:
    """Yield the faults of a one-way body."""
    if not (single.fixed or single.kinematic):
        yield "one_way", "needs `fixed = true` or `kinematic = true`: a body that others push is solid on all sides"
    if isinstance(single, Compound):
        yield "one_way", "is not supported for a [[body]] of several shapes; use a box, capsule, polygon or ball"
    if not any(direction):
        yield "one_way", f"{list(direction)} has no direction; use a vector such as [0, 1], solid from above"


def _check_at_rest(source: BodySpec | Stack) -> Iterator[tuple[str, str]]:
    """Yield the keys of motion that a fixed body or stack cannot have, with the reasons."""
    if source.fixed:
        yield from _motion_keys(source, "a fixed body")
    if source.fixed and (any(source.velocity) or source.angular_velocity):
        key = "velocity" if any(source.velocity) else "angular_velocity"
        yield key, "a fixed body cannot move; remove this key, or `fixed`"


def _motion_keys(source: BodySource, owner: str) -> Iterator[tuple[str, str]]:
    """Yield the keys of how a body moves that an element states, as those that have no effect on its owner."""
    for key in MOTION:
        if getattr(source, key) != BodySource.model_fields[key].default:
            yield key, f"has no effect on {owner}; remove it"


def _check_planes_and_walls(scene: Scene) -> Iterator[LocatedMessage]:
    for k, plane in enumerate(scene.planes):
        if not has_direction(plane):
            yield (
                ("plane", k, "normal"),
                f"{list(plane.normal)} has no direction; use a vector such as [0, 1] for a floor",
            )
    for k, wall in enumerate(scene.walls):
        for key_path, message in check_wall_points(wall):
            yield ("wall", k, *key_path), message
    yield from _check_wall_options(scene)


def _check_wall_options(scene: Scene) -> Iterator[LocatedMessage]:
    """Check kicks, one-way and non-solid walls: some need the length of a wall, none works with a `[surface]`."""
    for k, post in enumerate(scene.posts):
        if post.kick is not None and post.kick.profile != "even":
            yield (
                ("post", k, "kick", "profile"),
                "must be 'even' for a post; other profiles vary along the length of a wall",
            )
    if scene.surface is None and not scene.pockets:
        return
    for location, collider in _static_colliders(scene):
        keys = ("restitution_falloff", None), ("rolling_resistance", None)
        for key, usual in (("kick", None), ("one_way", False), ("solid", True), *keys):
            if getattr(collider, key, usual) != usual:
                yield (*location, key), "is not supported in a scene with a [surface] or pockets; remove it"
    for location, element in _elements(scene):
        if isinstance(element, BodySpec) and element.one_way is not None:
            yield (*location, "one_way"), "is not supported in a scene with a [surface] or pockets; remove it"
    tables: dict[str, Sequence[Material | Pair | BodySource]] = {
        "material": scene.materials,
        "pair": scene.pairs,
        **scene.kinds,
    }
    for kind, elements in tables.items():
        for k, each in enumerate(elements):
            if each.restitution_falloff:
                yield (
                    (kind, k, "restitution_falloff"),
                    "is not supported in a scene with a [surface] or pockets, where restitution does not "
                    "depend on speed; remove it",
                )
            if each.rolling_resistance:
                yield (
                    (kind, k, "rolling_resistance"),
                    "is not supported in a scene with a [surface] or pockets, where balls roll by "
                    "surface.rolling_friction; remove it",
                )


def check_wall_points(wall: Wall) -> Iterator[LocatedMessage]:
    """Yield the faults of a wall's points, located within the wall."""
    if wall.closed and len(wall.points) < 3:
        yield ("closed",), "a closed wall needs at least three points"
    ends = (*wall.points[1:], wall.points[0]) if wall.closed else wall.points[1:]
    for n, (a, b) in enumerate(zip(wall.points, ends, strict=False)):
        if math.dist(a, b) < SHORTEST:
            yield ("points", n), f"is at the same place as the next point; they must be at least {SHORTEST:g} m apart"


def _check_world(scene: Scene) -> Iterator[LocatedMessage]:
    if scene.world.bounds is not None:
        lower, upper = scene.world.bounds
        if not all(low < high for low, high in zip(lower, upper, strict=True)):
            yield ("world", "bounds"), "must be the lower left and then the upper right corner"
    steps = scene.world.duration / scene.solver.h
    if steps > MAX_STEPS:
        shortest = scene.world.duration * scene.solver.substeps / MAX_STEPS
        message = (
            f"gives {steps:.3g} steps per run, the limit is {MAX_STEPS:g}; for this duration dt must be "
            f"at least {shortest:g} s"
        )
        yield ("solver", "dt"), message


def _check_names(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    seen: set[str] = set()
    prototypes, twice = _prototypes(scene), set[Location]()
    for name, element in zip(bodies.names, bodies.element.tolist(), strict=True):
        if name in seen and prototypes[element][0] not in twice:
            twice.add(prototypes[element][0])
            yield (*prototypes[element][0], "name"), _name_taken(name)
        seen.add(name)
    pockets = [("pocket", k) for k in range(len(scene.pockets))]
    zones = [("zone", k) for k in range(len(scene.zones))]
    sensors = [("sensor", k) for k in range(len(scene.sensors))]
    locations = [*(location for location, _ in _static_colliders(scene)), *pockets, *zones, *sensors]
    for name, location in zip(scene.fixed_names, locations, strict=True):
        if name in seen:
            yield (*location, "name"), _name_taken(name)
        seen.add(name)


def _name_taken(name: str) -> str:
    return f"another body or fixed object is also named {name!r}; names must be unique"


def _check_surface_count(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    parts = sum(len(compound.parts) for compound in scene.compounds)
    if len(bodies.elements) + parts + len(scene.fixed) <= MAX_SURFACES:
        return
    if len(index_surfaces(scene, (*surface_parts(bodies.elements), *scene.fixed))[0]) > MAX_SURFACES:
        yield (), f"more than {MAX_SURFACES} different surfaces; share materials between bodies"


def _check_initial_state(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    """Check positions and speeds, which a generator may have put out of range."""
    prototypes = _prototypes(scene)
    for wrong, message in (
        (
            np.abs(bodies.position).max(axis=1, initial=0) > MAX_POSITION,
            f"a body is more than {MAX_POSITION:g} m from the origin",
        ),
        (np.hypot(*bodies.velocity.T) > MAX_SPEED, f"a body is faster than {MAX_SPEED:g} m/s"),
    ):
        for element in distinct(bodies.element[wrong]):
            yield prototypes[element][0], message
    for index, motion in bodies.paths.items():
        location = *prototypes[int(bodies.element[index])][0], "path"
        if motion.max_speed > MAX_SPEED:
            yield location, f"moves the body at up to {motion.max_speed:g} m/s; the limit is {MAX_SPEED:g} m/s"
        if np.abs(motion.stops()).max() > MAX_POSITION:
            yield location, f"leads more than {MAX_POSITION:g} m from the origin"
    if scene.world.bounds is not None:
        lower, upper = np.asarray(scene.world.bounds)
        outside = ((bodies.position < lower) | (bodies.position > upper)).any(axis=1)
        for element in distinct(bodies.element[outside]):
            yield prototypes[element][0], "starts outside world.bounds, where bodies are removed"
