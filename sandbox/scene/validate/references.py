"""Checks of references: joints, forces, drives, `[play]` and `[surface]`."""

import math
from collections.abc import Collection, Iterator, Sequence

from sandbox.scene.compile.bodies import MOTION, Bodies
from sandbox.scene.compile.drives import is_immovable, moment_of_mass, mount_of, single_bodies
from sandbox.scene.compile.joints import ends_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.actions import SETTABLE, Actuate, Join, SetParameter, Spawn, Unjoin, is_settable
from sandbox.scene.description.base import BodySource, BodySpec
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.forces import AnyDrive, Attraction, Driven, PlungerDrive, Thrust, TorqueDrive, Tyre
from sandbox.scene.description.joints import (
    Gear,
    Groove,
    Joint,
    OnAxis,
    Pivot,
    Pulley,
    Ratchet,
    Rod,
    RotaryLimit,
    Slide,
)
from sandbox.scene.description.play import marking_fault
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.description.surface import MISCUE, Floor, Shot, miscues
from sandbox.scene.errors import LocatedMessage

ANGLE_ROUNDING = 1e-9
"""rad, tolerance of the start angle beyond the stops of a drive, for rounding in a file"""

SHORTEST = 1e-9
"""m, smallest length of rods and grooves"""

MIN_RATIO = 1e-6
"""Smallest magnitude of a gear ratio; engines divide by it."""

SMALLEST_CLICK = 1e-6
"""rad, smallest magnitude of the angle between two clicks of a ratchet; the engine divides by it."""


ONE_BODY_TWICE = "names one body twice; name two bodies, or one to attach it to the world"


def check_attachments(scene: Scene, bodies: Bodies) -> list[LocatedMessage]:
    """Return the faults of joints, thrusts, tyres, attractions and drives, and of the bodies of sensors."""
    return [
        *_check_joints(scene, bodies),
        *_check_pushed("thrust", scene.thrusts, bodies),
        *_check_pushed("tyre", scene.tyres, bodies),
        *_check_attractions(scene, bodies),
        *_check_drives(scene, bodies),
        *_check_sensor_bodies(scene, bodies),
    ]


def _check_joints(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    yield from _check_names("joint", scene.joints)
    yield from check_joints(scene.joints, scene, bodies)


def check_events(scene: Scene, bodies: Bodies, are_others_valid: bool) -> Iterator[LocatedMessage]:
    """Yield the faults of events: names that nothing has, and values that cannot change during a run.

    Args:
        scene: the scene.
        bodies: of the scene.
        are_others_valid: whether the rest of the scene is valid, so that its joints are known.
    """
    spawned = {event.single.name for event in scene.events if isinstance(event, Spawn) and event.single.name}
    yield from _check_spawned(scene, bodies)
    known = {
        "body": {*bodies.names, *spawned},
        "thing": set(scene.fixed_names),
        "thrust": {thrust.name or default_name("thrust", k) for k, thrust in enumerate(scene.thrusts)},
        "tyre": {tyre.name or default_name("tyre", k) for k, tyre in enumerate(scene.tyres)},
        "drive": {drive.name or default_name("drive", k) for k, drive in enumerate(scene.drives)},
        "generator": {name for name, _, _ in generators(scene)},
    }
    joins = [event.joint for event in scene.events if isinstance(event, Join)]
    own = scene.joint_arrays.names if are_others_valid else ()
    joints = {*own, *(joint.name for joint in joins if joint.name)}
    joined_motors = {joint.name for joint in joins if joint.name and getattr(joint, "rate", None) is not None}
    motors = joined_motors | (scene.joint_arrays.motor_rows.keys() if are_others_valid else set())
    for k, event in enumerate(scene.events):
        for key, names in known.items():
            name = getattr(event, key, None)
            if name is not None and name not in names:
                yield ("event", k, key), f"no {key} is named {name!r}; {listed_names(names)}"
        if are_others_valid and isinstance(event, Unjoin) and event.joint not in joints:
            yield ("event", k, "joint"), f"no joint is named {event.joint!r}; {listed_names(joints)}"
        if are_others_valid and isinstance(event, Actuate):
            for name in sorted(event.levels.keys() - motors):
                fault = f"the joint {name!r} has no motor" if name in joints else f"no motor is named {name!r}"
                yield ("event", k, "levels", name), f"{fault}; {listed_names(motors)}"
        if isinstance(event, Join):
            for side, name in enumerate(event.joint.between):
                if name not in known["body"]:
                    yield (
                        ("event", k, "joint", "between", side),
                        f"no body is named {name!r}; {listed_names(known['body'])}",
                    )
            if len(set(event.joint.between)) < len(event.joint.between):
                yield ("event", k, "joint", "between"), ONE_BODY_TWICE
            for key, message in _check_joint(event.joint):
                yield ("event", k, "joint", key), message
        if isinstance(event, SetParameter) and not is_settable(event.path):
            yield ("event", k, "path"), f"{event.path!r} cannot be changed during a run; these can: {SETTABLE}"


def _check_spawned(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    seen = {*bodies.names, *scene.fixed_names}
    for k, event in enumerate(scene.events):
        if isinstance(event, Spawn) and event.single.name:
            if event.single.name in seen:
                yield ("event", k), f"a body or fixed object is already named {event.single.name!r}"
            seen.add(event.single.name)
        if isinstance(event, Spawn):
            if event.single.layer not in scene.layers:
                yield ("event", k), f"no layer is named {event.single.layer!r}; {listed_names(scene.layers)}"
            if event.single.path is not None or event.single.one_way is not None:
                yield ("event", k), "a body with a path, or a one-way body, cannot be added during a run"


def listed_names(names: Collection[str]) -> str:
    """Return known names as text for a message."""
    shown = ", ".join(map(repr, sorted(names)[:MAX_NAMED]))
    return f"known names: {shown}{', …' if len(names) > MAX_NAMED else ''}" if shown else "there is none"


MAX_NAMED = 10
"""Names that a message lists"""


def check_joints(joints: Sequence[Joint], scene: SceneDescription, bodies: Bodies) -> Iterator[LocatedMessage]:
    """Yield the faults of joints between bodies, apart from their names."""
    index, is_driven = {name: k for k, name in enumerate(bodies.names)}, is_immovable(scene, bodies)
    for k, joint in enumerate(joints):
        for side, name in enumerate(joint.between):
            if name not in index:
                yield ("joint", k, "between", side), f"no body is named {name!r}; {_known(bodies)}"
        if len(set(joint.between)) < len(joint.between):
            yield ("joint", k, "between"), ONE_BODY_TWICE
        elif all(name in index and bodies.fixed[index[name]] for name in joint.between):
            yield ("joint", k, "between"), "all its bodies are fixed; at least one must be able to move"
        elif all(name in index and is_driven[index[name]] for name in joint.between):
            driven = next(name for name in joint.between if not bodies.fixed[index[name]])
            is_kinematic = bodies.kinematic[index[driven]]
            why = f"{driven!r} is kinematic" if is_kinematic else f"the drive of {driven!r} prescribes its motion"
            yield ("joint", k, "between"), f"no joint can move these bodies: {why}"
        else:
            yield from _check_rod(k, joint, bodies, index)
            yield from _check_pulley(k, joint, bodies, index)
        for key, message in _check_joint(joint):
            yield ("joint", k, key), message


def _check_names(
    kind: str, elements: Sequence[Joint | Thrust | Tyre | Attraction | Driven]
) -> Iterator[LocatedMessage]:
    """Yield the elements whose name, stated or by default, is used twice within their kind."""
    seen: set[str] = set()
    for k, each in enumerate(elements):
        name = each.name or default_name(kind, k)
        if name in seen:
            yield (kind, k, "name"), f"another {kind} is also named {name!r}; names must be unique"
        seen.add(name)


def _check_rod(k: int, joint: Joint, bodies: Bodies, index: dict[str, int]) -> Iterator[LocatedMessage]:
    """Yield a rod whose ends start at one point, where it has no direction."""
    if not isinstance(joint, Rod) or any(name not in index for name in joint.between) or joint.length == 0.0:
        return
    start, end = ends_of(joint, bodies, index)
    if math.dist(start, end) < SHORTEST:
        message = (
            f"both points start at ({start[0]:g}, {start[1]:g}) m, so the rod has no direction; "
            "separate them with `anchors`, or use a pivot"
        )
        yield ("joint", k, "anchors" if "anchors" in joint.model_fields_set else "between"), message


def _check_pulley(k: int, joint: Joint, bodies: Bodies, index: dict[str, int]) -> Iterator[LocatedMessage]:
    """Yield a pulley with an end that starts at its wheel, where the rope has no direction."""
    if not isinstance(joint, Pulley) or any(name not in index for name in joint.between):
        return
    for side, (end, wheel) in enumerate(zip(ends_of(joint, bodies, index), joint.wheels, strict=True)):
        if math.dist(end, wheel) < SHORTEST:
            message = f"{joint.between[side]!r} starts at this wheel, where the rope has no direction"
            yield ("joint", k, "wheels", side), message


def _check_joint(joint: Joint) -> Iterator[tuple[str, str]]:
    """Yield the keys of a joint that are invalid by themselves, with the reasons."""
    match joint:
        case Pivot():
            if (joint.at is None) == (joint.anchors is None):
                yield (
                    "at",
                    "must have either `at`, a point in the world, or `anchors`, one point in the frame of each body",
                )
        case Rod():
            if joint.length is not None and 0.0 < joint.length < SHORTEST:
                yield "length", f"must be at least {SHORTEST:g} m, or 0 to hold two points together"
        case Gear():
            if abs(joint.ratio) < MIN_RATIO:
                yield "ratio", f"must be at least {MIN_RATIO:g} in magnitude"
        case Ratchet():
            if abs(joint.ratchet) < SMALLEST_CLICK:
                yield "ratchet", f"must be at least {SMALLEST_CLICK:g} rad in magnitude"
        case Slide() | RotaryLimit():
            if joint.least > joint.most:
                yield "most", "must not be smaller than `least`"
        case Groove():
            if math.dist(*joint.groove) < SHORTEST:
                yield "groove", f"is too short; its ends must be at least {SHORTEST:g} m apart"
        case OnAxis():
            least, most = joint.travel
            if math.hypot(*joint.axis) < SHORTEST:
                yield "axis", "has no direction; give one of any length, such as [0.0, 1.0]"
            if not least <= 0.0 <= most or most - least < SHORTEST:
                yield "travel", "must contain 0, the displacement at the start, as [-0.5, 0.5] does"
        case _:
            pass


def _check_pushed(table: str, elements: Sequence[Thrust | Tyre], bodies: Bodies) -> Iterator[LocatedMessage]:
    """Yield the faults of thrusts or tyres: their names, bodies that no force moves, and times."""
    yield from _check_names(table, elements)
    for k, each in enumerate(elements):
        if each.body not in bodies.number_of:
            yield (table, k, "body"), f"no body is named {each.body!r}; {_known(bodies)}"
        elif bodies.fixed[bodies.number_of[each.body]]:
            yield (table, k, "body"), f"{each.body!r} is fixed and cannot move"
        elif bodies.kinematic[bodies.number_of[each.body]]:
            yield (table, k, "body"), f"{each.body!r} is kinematic; no force changes its motion"
        if isinstance(each, Thrust) and each.end is not None and each.end <= each.begin:
            yield (table, k, "end"), "must be later than `begin`"


def _check_attractions(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    yield from _check_names("attraction", scene.attractions)
    for k, attraction in enumerate(scene.attractions):
        toward = attraction.toward
        if isinstance(toward, str) and toward not in bodies.number_of:
            yield ("attraction", k, "toward"), f"no body is named {toward!r}; {_known(bodies)}"


def _check_sensor_bodies(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    for k, sensor in enumerate(scene.sensors):
        if sensor.body is not None and sensor.body not in bodies.number_of:
            yield ("sensor", k, "body"), f"no body is named {sensor.body!r}; {_known(bodies)}"


def _check_drives(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    yield from _check_names("drive", scene.drives)
    singles, seen = single_bodies(scene), set[str]()
    for k, drive in enumerate(scene.drives):
        if drive.body not in bodies.number_of:
            known = ", ".join(map(repr, [*singles][:5])) or "none"
            yield ("drive", k, "body"), f"no body is named {drive.body!r}; bodies with a table of their own: {known}"
        elif drive.body not in singles:
            yield (
                ("drive", k, "body"),
                f"{drive.body!r} is made by a generator; a drive needs a body with a table of its own",
            )
        else:
            single = singles[drive.body]
            faults = (
                *_check_driven_body(drive, single, scene, drive.body in seen),
                *_check_drive_values(drive, single, bodies),
            )
            yield from ((("drive", k, key), why) for key, why in faults)
            seen.add(drive.body)


def _check_driven_body(drive: Driven, single: BodySpec, scene: Scene, twice: bool) -> Iterator[tuple[str, str]]:
    if twice:
        yield "body", f"{drive.body!r} already has a drive; a body can have one drive only"
    if single.fixed:
        yield "body", f"{drive.body!r} is fixed; remove `fixed`, because the drive holds the body"
    if single.kinematic:
        yield "body", f"{drive.body!r} is kinematic; remove `kinematic`, because the drive moves the body"
    if single.fixed_rotation and not isinstance(drive, PlungerDrive):
        yield "body", f"{drive.body!r} has a fixed rotation; remove `fixed_rotation`, because the drive turns the body"
    if any(single.velocity) or single.angular_velocity:
        yield "body", f"{drive.body!r} has an initial velocity; a driven body must start at rest"
    if single.lift:
        yield "body", f"{drive.body!r} has lift, which has no effect on a driven body; remove `lift`"
    for key in MOTION:
        if getattr(single, key) != BodySource.model_fields[key].default:
            yield "body", f"{drive.body!r} has `{key}`, which has no effect on a driven body; remove it"
    if any(thrust.body == drive.body for thrust in scene.thrusts):
        yield "body", f"{drive.body!r} has a thrust; only its drive can move a driven body"
    if any(tyre.body == drive.body for tyre in scene.tyres):
        yield "body", f"{drive.body!r} has a tyre; only its drive can move a driven body"


def _check_drive_values(drive: AnyDrive, single: BodySpec, bodies: Bodies) -> Iterator[tuple[str, str]]:
    if isinstance(drive, PlungerDrive):
        if not math.hypot(*drive.direction) > 0.0:
            yield "direction", f"{list(drive.direction)} has no direction; use a vector such as [0, 1] for upwards"
        return
    low, high = sorted(drive.stops)
    if low == high:
        yield "stops", "must be two different angles: the rest angle and the driven angle"
    elif not low - ANGLE_ROUNDING <= single.angle <= high + ANGLE_ROUNDING:
        yield (
            "stops",
            f"{drive.body!r} starts at {single.angle:g} rad; the angle must be between {low:g} and {high:g} rad",
        )
    if isinstance(drive, TorqueDrive) and drive.moment is not None:
        lowest = moment_of_mass(mount_of(0, drive, single), float(bodies.mass[bodies.number_of[drive.body]]))
        if drive.moment <= lowest:
            yield "moment", f"must be greater than {lowest:.3g} kg·m², the moment of the body's mass about this pivot"


def _known(bodies: Bodies) -> str:
    names = bodies.names
    return (
        f"bodies: {', '.join(map(repr, names[:5]))}{' …' if len(names) > 5 else ''}"
        if names
        else "the scene has no bodies"
    )


def check_play(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    """Yield the faults of `[play]`."""
    arrows, relaunch = scene.play.arrows, scene.play.relaunch
    if arrows is not None and arrows not in bodies.names:
        yield ("play", "arrows"), f"no body is named {arrows!r}; known names: {_some(bodies.names)}"
    names = generator_names(scene)
    if relaunch is not None and relaunch not in names:
        yield ("play", "relaunch"), f"no generator is named {relaunch!r}; known names: {_some(names)}"
    spots = [spot.name for spot in scene.play.spots]
    for key, box in (("area", scene.play.area), ("view", scene.play.view), ("inset", scene.play.inset)):
        if box is not None and not all(low < high for low, high in zip(*box, strict=True)):
            yield ("play", key), "must be the lower left and then the upper right corner"
    for k, marking in enumerate(scene.play.markings):
        why = marking_fault(marking)
        if why is not None:
            yield ("play", "marking", k), why
    for k, name in enumerate(spots):
        if name in spots[:k]:
            yield ("play", "spot", k, "name"), f"another spot is also named {name!r}; names must be unique"
    yield from _check_parts(scene, bodies)


def _check_parts(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    """Check that each part names an existing body, collider, zone or sensor, and that no name occurs twice."""
    known, seen = {*bodies.names, *scene.fixed_names}, set[str]()
    for k, part in enumerate(scene.play.parts):
        if part.name not in known:
            yield ("play", "part", k, "name"), f"no body, fixed object, zone or sensor is named {part.name!r}"
        if part.name in seen:
            yield ("play", "part", k, "name"), f"{part.name!r} already has a part; remove one of the two"
        seen.add(part.name)


def generator_names(scene: Scene) -> tuple[str, ...]:
    """Return the name of each generator, in scene order."""
    return tuple(name for name, _, _ in generators(scene))


def generators(scene: Scene) -> Iterator[tuple[str, int, BodySource]]:
    """Yield name, index within its kind, and specification of each generator, in scene order."""
    for kind, sources in scene.kinds.items():
        for k, source in enumerate(sources):
            if not isinstance(source, BodySpec):
                yield source.name or default_name(kind, k), k, source


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(map(repr, names[:5])) + (" …" if len(names) > 5 else "") if names else "none"


OR_SPHERES = 'Remove it, or set bodies = "spheres" in the [surface]'
"""Remedy for settings of spheres on a `[surface]` with pucks."""

NEEDS_FLOOR = "applies to balls on a floor only; add a [surface]"


def check_surface(scene: Scene, bodies: Bodies) -> Iterator[LocatedMessage]:
    """Yield the faults of settings that need a `[surface]`."""
    if scene.surface is not None:
        yield from _check_body_kind(scene, scene.surface)
    for table, sources in scene.kinds.items():
        for k, source in enumerate(sources):
            if isinstance(source, BodySpec) and source.fixed_rotation:
                if source.moment is not None:
                    yield (table, k, "moment"), "has no effect with `fixed_rotation`; remove one of them"
                if source.angular_velocity:
                    yield (table, k, "angular_velocity"), "is not 0, but the body has a `fixed_rotation`"
    for k, ball in enumerate(scene.balls):
        if ball.moment is not None and scene.surface is not None:
            yield ("ball", k, "moment"), "follows from the radius and the mass on a [surface]; remove it"
        if ball.spin is None:
            continue
        if scene.surface is None:
            yield ("ball", k, "spin"), f"{NEEDS_FLOOR}, or use `angular_velocity`"
        if ball.angular_velocity:
            yield (
                ("ball", k, "angular_velocity"),
                "cannot be combined with `spin`, whose third component is the same quantity",
            )
        if ball.fixed and any(ball.spin):
            yield ("ball", k, "spin"), "a fixed body cannot move; remove this key, or `fixed`"
    if scene.surface is None:
        for key in sorted(scene.contact_models.model_fields_set):
            yield ("contact_models", key), NEEDS_FLOOR
    yield from _check_nose_heights(scene)
    names: set[str] = set()
    for k, shot in enumerate(scene.shots):
        name = shot.name or default_name("shot", k)
        if name in names:
            yield ("shot", k, "name"), f"another shot is also named {name!r}; names must be unique"
        names.add(name)
        yield from _check_shot(scene, bodies, k, shot)


def _check_body_kind(scene: Scene, floor: Floor) -> Iterator[LocatedMessage]:
    """Check that spheres have no settings of pucks, and the reverse."""
    if floor.bodies == "spheres":
        if floor.curl:
            yield ("surface", "curl"), 'applies to pucks only; set bodies = "pucks", or remove it'
        return
    if floor.rolling_friction:
        yield ("surface", "rolling_friction"), "pucks do not roll; remove it"
    for key in sorted(scene.contact_models.model_fields_set):
        yield (
            ("contact_models", key),
            f"applies to spheres only; pucks collide by restitution and friction. {OR_SPHERES}",
        )
    for k, ball in enumerate(scene.balls):
        if ball.spin is not None:
            yield ("ball", k, "spin"), "applies to spheres only; a puck turns about z, use `angular_velocity`"
    noses: dict[str, Sequence[Wall | Post]] = {"wall": scene.walls, "post": scene.posts}
    for kind, colliders in noses.items():
        for k, collider in enumerate(colliders):
            if collider.height is not None:
                yield (
                    (kind, k, "height"),
                    f"applies to the cushions of spheres only; pucks have upright sides. {OR_SPHERES}",
                )
    for k in range(len(scene.shots)):
        yield ("shot", k), f"a cue can strike spheres only; give the puck a velocity. {OR_SPHERES}"


def _check_nose_heights(scene: Scene) -> Iterator[LocatedMessage]:
    """Check the heights of cushions: a nose must touch the balls, and some cushion models need it."""
    model = scene.contact_models.cushion
    radii = sorted({ball.radius for ball in scene.balls if not ball.fixed and ball.collides != "none"})
    noses: dict[str, Sequence[Wall | Post]] = {"wall": scene.walls, "post": scene.posts}
    for kind, colliders in noses.items():
        for k, collider in enumerate(colliders):
            if collider.height is None:
                if model != "simple" and scene.surface is not None:
                    message = f"the cushion model {model!r} needs the height of the nose; add `height`, m"
                    yield (kind, k), message
            elif scene.surface is None:
                yield (kind, k, "height"), "applies to a cushion above a floor only; add a [surface]"
            elif radii and not collider.height < 2.0 * radii[0]:
                message = (
                    f"must be less than {2.0 * radii[0]:g} m, or the nose does not touch a ball of "
                    f"radius {radii[0]:g} m"
                )
                yield (kind, k, "height"), message


def _check_shot(scene: Scene, bodies: Bodies, k: int, shot: Shot) -> Iterator[LocatedMessage]:
    if miscues(shot):
        offset = math.hypot(shot.side, shot.height)
        yield (
            ("shot", k, "side"),
            f"with `height`, the tip is {offset:g} of the radius off centre; beyond {MISCUE:g} it slips",
        )
    if scene.surface is None:
        yield ("shot", k), "a shot needs a floor; add a [surface]"
    if shot.ball not in bodies.number_of:
        yield ("shot", k, "ball"), f"no body is named {shot.ball!r}"
        return
    number = bodies.number_of[shot.ball]
    if not isinstance(bodies.elements[bodies.element[number]], Ball):
        yield ("shot", k, "ball"), f"{shot.ball!r} is not a single ball"
    elif bodies.fixed[number]:
        yield ("shot", k, "ball"), f"{shot.ball!r} is fixed and cannot move"
    elif bodies.kinematic[number]:
        yield ("shot", k, "ball"), f"{shot.ball!r} is kinematic and cannot be struck"
    elif any(math.dist(bodies.position[number], pocket.position) < pocket.radius for pocket in scene.pockets):
        yield ("shot", k, "ball"), f"{shot.ball!r} is in a pocket, where it cannot be struck"
    if any(each.ball == shot.ball for each in scene.shots[:k]):
        yield ("shot", k, "ball"), f"another shot already strikes {shot.ball!r}; each ball can have one shot"
