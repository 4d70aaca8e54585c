"""Demands: the physics that a scene needs, derived from the scene alone.

An engine assembles only the demanded parts, and refuses a scene with a demand that it does not support.
"""

from collections.abc import Iterator
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.joint_arrays import MOTORS, JointArrays, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySpec
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.description.world import World


class Demand(StrEnum):
    """One kind of physics that a scene can need and an engine can model."""

    TRANSLATION = "translation"
    ROTATION = "rotation"
    GRAVITY = "gravity"
    DRAG = "drag"
    LIFT = "lift"
    DAMPING = "damping"
    BODY_DAMPING = "damping of bodies"
    GRAVITY_SCALE = "gravity_scale"
    SPEED_LIMITS = "speed limits"
    BALL_BALL = "ball-ball"
    BALL_PLANE = "ball-plane"
    BALL_SEGMENT = "ball-segment"
    BALL_POST = "ball-post"
    POLYGONS = "polygons"
    RESTITUTION = "restitution"
    FRICTION = "friction"
    ROLLING = "rolling resistance"
    FALLOFF = "falloff"
    KICKS = "kicks"
    SURFACE_SPEED = "surface speed"
    SURFACE_VELOCITY = "surface velocity"
    ONE_WAY = "one-way walls"
    PASSABLE = "openings"
    RODS = "rods"
    PIVOTS = "pivots"
    SLIDES = "slides"
    GROOVES = "grooves"
    ROTARY_LIMITS = "rotary limits"
    MOTORS = "motors"
    GEARS = "gears"
    SPRINGS = "springs"
    ROTARY_SPRINGS = "rotary springs"
    PULLEYS = "pulleys"
    RATCHETS = "ratchets"
    BANDS = "springs that only pull"
    WELDS = "welds"
    PRISMATICS = "prismatic joints"
    WHEELS = "wheels"
    MAX_FORCE = "max_force of joints"
    MAX_BIAS = "max_bias of joints"
    JOINT_BIAS = "bias of joints"
    ATTRACTION = "attraction"
    THRUST = "thrust"
    TYRES = "tyres"
    BUOYANCY = "buoyancy"
    DRIVES = "drives"
    BOUNDS = "bounds"
    LIFETIMES = "lifetimes"
    SURFACE = "surface"
    SPIN = "spin"
    POCKETS = "pockets"
    PUCKS = "pucks"
    CURL = "curl"
    LAYERS = "layers"
    CATEGORIES = "categories"
    GROUPS = "groups"
    ZONES = "zones"
    KINEMATIC = "kinematic bodies"
    EVENTS = "events"
    SENSORS = "sensors"
    PATHS = "paths"
    ONE_WAY_BODIES = "one-way bodies"


BALLS = frozenset(
    {
        Demand.SENSORS,  # detected by `sandbox.engines.sensors` on every engine
        Demand.TRANSLATION,
        Demand.ROTATION,
        Demand.GRAVITY,
        Demand.DRAG,
        Demand.BALL_BALL,
        Demand.BALL_PLANE,
        Demand.BALL_SEGMENT,
        Demand.BALL_POST,
        Demand.RESTITUTION,
        Demand.FRICTION,
        Demand.BOUNDS,
        Demand.LIFETIMES,
        Demand.EVENTS,
    }
)
"""Demands of scenes of balls and static colliders. Engines list their capabilities; a new demand is supported by
none."""

AIR = frozenset({Demand.DRAG, Demand.LIFT, Demand.DAMPING, Demand.BODY_DAMPING})
"""Demands of forces that depend on velocity."""

OWN_MOTION = frozenset({Demand.BODY_DAMPING, Demand.GRAVITY_SCALE, Demand.SPEED_LIMITS})
"""Demands of the keys of how a single body moves."""

SURFACES = frozenset(
    {
        Demand.FALLOFF,
        Demand.KICKS,
        Demand.SURFACE_SPEED,
        Demand.SURFACE_VELOCITY,
        Demand.ONE_WAY,
        Demand.PASSABLE,
    }
)
"""Properties of surfaces beyond restitution and friction."""

FLOOR = frozenset({Demand.SURFACE, Demand.SPIN, Demand.POCKETS, Demand.PUCKS})
"""Demands of spheres and pucks on a `[surface]`; curl of pucks is a demand of its own."""

DEMAND_OF_JOINT = {
    JointKind.ROD: Demand.RODS,
    JointKind.PIVOT: Demand.PIVOTS,
    JointKind.SLIDE: Demand.SLIDES,
    JointKind.GROOVE: Demand.GROOVES,
    JointKind.ROTARY_LIMIT: Demand.ROTARY_LIMITS,
    JointKind.MOTOR: Demand.MOTORS,
    JointKind.GEAR: Demand.GEARS,
    JointKind.SPRING: Demand.SPRINGS,
    JointKind.ROTARY_SPRING: Demand.ROTARY_SPRINGS,
    JointKind.PULLEY: Demand.PULLEYS,
    JointKind.RATCHET: Demand.RATCHETS,
}
"""Demands of each kind of joint."""

DEMAND_OF_COMPOUND = {
    (JointKind.PIVOT, JointKind.GEAR): Demand.WELDS,
    (JointKind.GROOVE, JointKind.GEAR): Demand.PRISMATICS,
    (JointKind.GROOVE, JointKind.SPRING): Demand.WHEELS,
}
"""Demands of joints of several rows, by the kinds of the first two"""

JOINTS = frozenset({*DEMAND_OF_JOINT.values(), *DEMAND_OF_COMPOUND.values(), Demand.BANDS})

JOINT_LIMITS = frozenset({Demand.MAX_FORCE, Demand.MAX_BIAS, Demand.JOINT_BIAS})
"""Demands of the keys of joints that limit or change how they hold"""


class Item(NamedTuple):
    """One demand, whether the scene has it, and the reason."""

    demand: Demand
    on: bool
    why: str


@derived_once
def demands(setup: Setup) -> frozenset[Demand]:
    """Return the demands of a scene or setup: the physics that an engine must model to run it.

    Example:
        >>> sorted(map(str, sandbox.demands(sandbox.load("spring"))))
        ['springs', 'translation']
    """
    return frozenset(demand for demand, on, _ in _items(setup) if on)


def bill(start: Scene | Setup) -> tuple[Item, ...]:
    """Return every demand, with the reason why the scene or setup has it or not."""
    return tuple(Item(demand, on, why) for demand, on, why in _items(Setup.of(start)))


def _items(setup: Setup) -> Iterator[tuple[Demand, bool, str]]:
    scene, bodies, matrix = setup.scene, setup.bodies, contact_matrix(setup)
    world = scene.world
    moving = int((~bodies.fixed).sum())
    yield Demand.TRANSLATION, moving > 0, _count(moving, "body moves", "bodies move", "nothing moves")

    spinning = int(np.count_nonzero(bodies.angular_velocity))
    turned = int(matrix.turnable.sum())
    if spinning:
        why = _count(spinning, "body starts with a spin", "bodies start with a spin", "")
    else:
        why = _count(turned, "body can be turned", "bodies can be turned", "no body can be turned")
    yield Demand.ROTATION, bool(spinning or turned), why

    gravity = world.gravity != (0.0, 0.0)
    yield Demand.GRAVITY, gravity, f"{list(world.gravity)} m/s²" if gravity else "world.gravity is zero"
    scaled = int(np.count_nonzero(bodies.gravity_scale != 1.0))
    none = "no body scales gravity"
    yield Demand.GRAVITY_SCALE, scaled > 0, _count(scaled, "body scales gravity", "bodies scale gravity", none)

    yield from _air(world, bodies)

    free = int((matrix.free & ~bodies.fixed).sum())
    free_text = f"; {free:,} of {moving:,} cannot collide with anything" if free else ""
    why = f"{'balls' if matrix.ball_ball else 'no two balls'} can collide{free_text}"
    yield Demand.BALL_BALL, matrix.ball_ball, why

    for demand, kind, colliders in (
        (Demand.BALL_PLANE, Plane, scene.planes),
        (Demand.BALL_SEGMENT, Wall, scene.walls),
        (Demand.BALL_POST, Post, scene.posts),
    ):
        word = kind.__name__.lower()
        why = "no moving body can touch one" if colliders else f"no {word}"
        count = _count(len(colliders), word, f"{word}s", "")
        yield demand, matrix.ball_fixed[kind], count if matrix.ball_fixed[kind] else why

    others = int((~bodies.round & matrix.touches & ~bodies.fixed).sum())
    why = _count(int((~bodies.round).sum()), "body is not a ball", "bodies are not balls", "all bodies are balls")
    yield Demand.POLYGONS, matrix.solids, f"{why}, {others:,} of them can move and collide" if matrix.solids else why

    can_collide = bool(matrix.touching.any())
    for demand, largest in ((Demand.RESTITUTION, matrix.restitution), (Demand.FRICTION, matrix.friction)):
        why = f"up to {largest:g}" if largest else "0 for every pair that can collide"
        yield demand, largest > 0, why if can_collide else "no collisions possible"

    rolls = bool((bodies.round & matrix.touches).any())
    why = f"up to {matrix.rolling:g}" if rolls and matrix.rolling else "0 for every contact of a ball"
    yield Demand.ROLLING, rolls and matrix.rolling > 0.0, why if can_collide else "no collisions possible"

    yield from _surfaces(scene, matrix)
    yield from _joints(setup)
    yield from _floor(setup)
    has_layers = len(scene.layers) > 1
    yield Demand.LAYERS, has_layers, ", ".join(scene.layers) if has_layers else "all bodies are in one layer"
    categories = scene.categories
    yield Demand.CATEGORIES, bool(categories), ", ".join(categories) if categories else "no object names a category"
    yield Demand.GROUPS, bool(bodies.groups), ", ".join(bodies.groups) if bodies.groups else "no body names a group"
    kinematic = int(bodies.kinematic.sum())
    yield (
        Demand.KINEMATIC,
        kinematic > 0,
        _count(kinematic, "body is kinematic", "bodies are kinematic", "no body is kinematic"),
    )
    yield Demand.EVENTS, bool(scene.events), f"{len(scene.events):,}" if scene.events else "none"
    on_path = len(bodies.paths)
    why = _count(on_path, "body moves along a path", "bodies move along paths", "no body has a path")
    yield Demand.PATHS, on_path > 0, why
    one_way = len(bodies.one_way)
    yield Demand.ONE_WAY_BODIES, one_way > 0, _count(one_way, "one-way body", "one-way bodies", "none")
    yield Demand.ZONES, bool(scene.zones), f"{len(scene.zones):,}" if scene.zones else "none"
    liquids = len(scene.liquids)
    yield (
        Demand.BUOYANCY,
        liquids > 0,
        _count(liquids, "zone has a liquid", "zones have a liquid", "no zone has a liquid"),
    )
    yield Demand.SENSORS, bool(scene.sensors), f"{len(scene.sensors):,}" if scene.sensors else "none"
    yield Demand.BOUNDS, world.bounds is not None, "world.bounds is given" if world.bounds else "no bounds"
    limited = int(np.isfinite(bodies.lifetime).sum())
    yield (
        Demand.LIFETIMES,
        limited > 0,
        _count(limited, "body has a lifetime", "bodies have a lifetime", "no body has a lifetime"),
    )


def _air(world: World, bodies: Bodies) -> Iterator[tuple[Demand, bool, str]]:
    why = f"linear {world.linear_drag:g} 1/s, quadratic {world.quadratic_drag:g} 1/m"
    yield Demand.DRAG, world.has_drag, why if world.has_drag else "no drag"
    why = f"{world.damping:g} of every velocity remains after 1 s" if world.has_damping else "no damping"
    yield Demand.DAMPING, world.has_damping, why
    lifted = int(np.count_nonzero(bodies.lift))
    yield Demand.LIFT, lifted > 0, _count(lifted, "body has lift", "bodies have lift", "no body has lift")
    damped = int(np.count_nonzero(bodies.linear_damping + bodies.angular_damping))
    none = "no body has damping of its own"
    why = _count(damped, "body has damping of its own", "bodies have damping of their own", none)
    yield Demand.BODY_DAMPING, damped > 0, why
    limited = int(np.count_nonzero(bodies.limited))
    why = _count(limited, "body has a speed limit", "bodies have a speed limit", "no body has a speed limit")
    yield Demand.SPEED_LIMITS, limited > 0, why


def air_demands(world: World, bodies: Bodies, among: BoolArray | slice = slice(None)) -> frozenset[Demand]:
    """Return the demands of forces that depend on velocity, without those of the rest of a scene, which take longer.

    Args:
        world: drag and damping.
        bodies: all.
        among: bodies that are present.
    """
    damps = bool(bodies.linear_damping[among].any() or bodies.angular_damping[among].any())
    acts = (
        (Demand.DRAG, world.has_drag),
        (Demand.DAMPING, world.has_damping),
        (Demand.LIFT, bool(bodies.lift[among].any())),
        (Demand.BODY_DAMPING, damps),
    )
    return frozenset(demand for demand, on in acts if on)


def _surfaces(scene: Scene, matrix: ContactMatrix) -> Iterator[tuple[Demand, bool, str]]:
    surfaces = matrix.surfaces
    largest = float(np.max(surfaces.falloff[matrix.touching & (surfaces.restitution > 0.0)], initial=0.0))
    why = f"up to {largest:g} s/m" if largest else "restitution does not depend on speed"
    yield Demand.FALLOFF, largest > 0.0, why
    none = "no surface with friction moves"
    count = matrix.surfaces_with_speed
    yield Demand.SURFACE_SPEED, count > 0, _count(count, "surface moves", "surfaces move", none)
    count = matrix.surfaces_with_velocity
    why = _count(count, "surface moves along a vector", "surfaces move along a vector", none)
    yield Demand.SURFACE_VELOCITY, count > 0, why
    touched = np.asarray(matrix.touching.any(axis=1))
    of_fixed = touched[surfaces.of_fixed]
    for demand, has_property, one, many, none in (
        (Demand.KICKS, surfaces.kicks, "wall or post kicks", "walls and posts kick", "no wall or post kicks"),
        (Demand.ONE_WAY, surfaces.one_way, "one-way wall", "one-way walls", "none"),
    ):
        count = int(np.count_nonzero(has_property[surfaces.of_fixed] & of_fixed)) if len(has_property) else 0
        yield demand, count > 0, _count(count, one, many, none)
    colliders: tuple[Wall | Post, ...] = (*scene.walls, *scene.posts)
    open_ = sum(not collider.solid for collider in colliders)
    yield Demand.PASSABLE, open_ > 0, _count(open_, "wall or post", "walls and posts", "all walls and posts are solid")


def _joints(setup: Setup) -> Iterator[tuple[Demand, bool, str]]:
    scene, joints = setup.scene, setup.joints
    has_limit = np.isfinite(joints.max_force) & ~np.isin(joints.kind, MOTORS)  # that of a motor is part of motors
    simple = ~joints.is_compound
    compounds = [] if simple.all() else _compound_kinds(joints)
    for demand, applies in (
        *((demand, (joints.kind == kind) & simple) for kind, demand in DEMAND_OF_JOINT.items()),
        *((demand, [each == kinds for each in compounds]) for kinds, demand in DEMAND_OF_COMPOUND.items()),
        (Demand.BANDS, joints.pulls_only),
        (Demand.MAX_FORCE, has_limit),
        (Demand.MAX_BIAS, np.isfinite(joints.max_bias)),
        (Demand.JOINT_BIAS, np.isfinite(joints.bias)),
    ):
        count = int(np.count_nonzero(applies))
        yield demand, count > 0, f"{count:,}" if count else "none"
    for demand, elements in (
        (Demand.ATTRACTION, scene.attractions),
        (Demand.THRUST, scene.thrusts),
        (Demand.TYRES, scene.tyres),
        (Demand.DRIVES, scene.drives),
    ):
        yield demand, bool(elements), f"{len(elements):,}" if elements else "none"


def _compound_kinds(joints: JointArrays) -> list[tuple[JointKind, JointKind]]:
    """Return the kinds of the first two rows of each joint of several rows."""
    first, second = np.unique(joints.part_of[joints.part_of != joints.number], return_index=True)
    parts = np.flatnonzero(joints.part_of != joints.number)[second]
    heads = np.searchsorted(joints.number, first)
    pairs = zip(joints.kind[heads].tolist(), joints.kind[parts].tolist(), strict=True)
    return [(JointKind(head), JointKind(part)) for head, part in pairs]


def _floor(setup: Setup) -> Iterator[tuple[Demand, bool, str]]:
    scene = setup.scene
    floor, models = scene.surface, scene.contact_models
    has_friction = floor is not None and floor.has_friction
    why = "no [surface]" if floor is None else "the surface has no friction"
    if floor is not None and has_friction:
        figures = (floor.sliding_friction, floor.rolling_friction, floor.spinning_friction)
        why = "friction: sliding {:g}, rolling {:g}, spinning {:g}".format(*figures)
    yield Demand.SURFACE, has_friction, why
    pucks = floor is not None and floor.bodies == "pucks"
    slides = floor is not None and floor.sliding_friction > 0
    rolls = floor is not None and not pucks and (slides or models.depends_on_spin or bool(setup.bodies.roll.any()))
    yield Demand.SPIN, rolls, "spheres turn about three axes" if rolls else "bodies turn about z only"
    yield Demand.POCKETS, bool(scene.pockets), f"{len(scene.pockets):,}" if scene.pockets else "none"
    flat = "flat discs slide and do not roll" if has_friction else "without friction pucks are ordinary discs"
    yield Demand.PUCKS, pucks and has_friction, flat if pucks else "no pucks"
    curl = floor.curl if floor is not None and slides and pucks else 0.0
    yield Demand.CURL, curl != 0.0, f"κ = {curl:g}: rotating pucks curl" if curl else "no puck curls"


def _count(n: int, one: str, many: str, none: str) -> str:
    return none if n == 0 else f"{n:,} {one if n == 1 else many}"


@derived_once
def on_floor(setup: Setup) -> bool:
    """Return whether a scene has a demand of `FLOOR`."""
    return any(on and demand in FLOOR for demand, on, _ in _floor(setup))


@derived_once
def curls(setup: Setup) -> bool:
    """Return whether a scene has a surface on which pucks curl."""
    return any(on and demand is Demand.CURL for demand, on, _ in _floor(setup))


def may_resist_rolling(single: BodySpec, scene: Scene) -> bool:
    """Return whether a body can have contacts with rolling resistance by its own value, its material or a pair."""
    stated = [single.rolling_resistance]
    stated += [each.rolling_resistance for each in scene.materials if each.name == single.material]
    stated += [each.rolling_resistance for each in scene.pairs if single.material in each.between]
    return any(stated)


def demands_of_body(single: BodySpec, scene: Scene) -> frozenset[Demand]:
    """Return the demands that a body adds to those of a scene, by itself."""
    stated = (
        (Demand.GROUPS, single.group is not None),
        (Demand.KINEMATIC, single.kinematic),
        (Demand.PATHS, single.path is not None),
        (Demand.ONE_WAY_BODIES, single.one_way is not None),
        (Demand.LIFT, single.lift != 0.0),
        (Demand.GRAVITY_SCALE, single.gravity_scale != 1.0),
        (Demand.BODY_DAMPING, single.linear_damping > 0.0 or single.angular_damping > 0.0),
        (Demand.SPEED_LIMITS, single.max_speed is not None or single.max_angular_velocity is not None),
        (Demand.ROLLING, may_resist_rolling(single, scene)),
    )
    return frozenset(demand for demand, is_stated in stated if is_stated)


def unmodelled(start: Scene | Setup, capabilities: frozenset[Demand]) -> list[str]:
    """Return the demands of a scene that exceed the capabilities of an engine, as one message; empty without any."""
    *others, last = "", *sorted(map(str, demands(start) - capabilities))
    listed = ", ".join(others[1:])
    if listed:
        last = f"{listed} or {last}"
    return [f"it does not model {last}"] if last else []
