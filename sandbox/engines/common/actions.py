"""Actions: apply impulses, forces, changed parameters and new bodies to a running simulation.

An action is checked completely before anything changes: an invalid action raises `ActionError` and leaves the
simulation as it was.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from pydantic import ValidationError

from sandbox.action import (
    SETTABLE,
    Action,
    ActionError,
    Actuate,
    Drive,
    Explosion,
    Force,
    Impulse,
    Join,
    Launch,
    Move,
    Pull,
    Remove,
    Reshape,
    SetParameter,
    Spawn,
    Steer,
    Strike,
    Switch,
    Throttle,
    Toggle,
    Unjoin,
    check_speed,
    heading_of,
    index_of_name,
    is_settable,
)
from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.demands import on_floor
from sandbox.scene.compile.drives import names_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BACKING, MAX_BODIES, BodySource, BodySpec, Collides
from sandbox.scene.description.bodies import Box, Capsule, Compound, Polygon
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.game_tables import PRESETS
from sandbox.scene.description.joints import Motor, Prismatic, Wheel
from sandbox.scene.description.scene import default_name
from sandbox.scene.description.surface import MISCUE, miscues, struck
from sandbox.scene.errors import SceneError, quoted
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_session
from sandbox.scene.files.overrides import AddressError, assign, change_value, elements_hint, parse_path
from sandbox.scene.validate.references import check_surface
from sandbox.scene.validate.scene import MAX_SURFACES, check_wall_points, crosscheck


class ActionTarget(Protocol):
    """Bodies of a running scene, as actions read and change them. Bodies are addressed by their index."""

    @property
    def scene(self) -> Scene:
        """The scene, with all changes that actions have made."""

    @property
    def setup(self) -> Setup:
        """The state from which the simulation started, with that scene."""

    @property
    def bodies(self) -> Bodies:
        """Bodies by index; spawned bodies are at the end."""

    @property
    def h(self) -> float:
        """Substep, s."""

    @property
    def present(self) -> BoolArray:
        """(N,) whether each body is in the scene."""

    def motion(self, index: int) -> tuple[FloatArray, float]:
        """Return the velocity (2,), m/s, and the angular velocity, rad/s, of a body."""

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s."""

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s."""

    def set_roll(self, index: int, roll: tuple[float, float]) -> None:
        """Set the angular velocity of a sphere on a surface about x and y, rad/s."""

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a constant force, N, and torque, N·m, to a body from now on. They replace the previous ones.

        Raises:
            ActionError: the engine models no such force.
        """

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m."""

    def turn_body(self, index: int, angle: float) -> None:
        """Set the angle of a body, rad."""

    def check_place(self, position: tuple[float, float], radius: float, collides: Collides) -> None:
        """Check that the engine can place a body at a position.

        Raises:
            ActionError: this engine cannot, though other engines may.
        """

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Continue with a changed scene. Only air, gravity, coefficients, points of walls and solid flags may differ.

        Args:
            setup: with the changed scene (`Setup.with_scene`).
            spawned: the elements of bodies spawned since the start, with other coefficients; default: unchanged.

        Raises:
            ActionError: the settings or the engine do not support the change.
        """

    def throttle(self, index: int, level: float) -> None:
        """Set the level of a thrust, by its index in the scene: the fraction of its force that acts.

        Raises:
            ActionError: the engine models no thrust.
        """

    def steer(self, index: int, levels: tuple[float, float, float]) -> None:
        """Set the throttle, brake and steering of a tyre, by its index in the scene.

        Raises:
            ActionError: the engine models no tyres.
        """

    def drive(self, index: int, level: float) -> None:
        """Set the level of a drive, by its index in the scene.

        Raises:
            ActionError: the engine models no drives.
        """

    def actuate(self, levels: Mapping[int, float]) -> None:
        """Set the levels of motors, by the rows of the joints."""

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body that has been checked, and return its index.

        Raises:
            ActionError: the engine cannot add it.
        """


def set_parameter(action: SetParameter, target: ActionTarget) -> None:
    """Change a value of the scene.

    Raises:
        ActionError: the value cannot be changed during a run, or the new value is invalid.
    """
    if not is_settable(action.path):
        raise ActionError(f"{action.path!r} cannot be changed during a run; these can: {SETTABLE}")
    try:
        parts = parse_path(action.path)
    except AddressError as error:
        raise ActionError(str(error)) from None
    if parts[0] in PRESETS:  # its elements exist already: changing the preset would have no effect
        hint = elements_hint(to_document(target.scene), parts)
        raise ActionError(
            f"{action.path}: a running scene has no [{parts[0]}]; presets are expanded to primitives{hint}"
        )
    spawned = _with_coefficient(action, parts, target)
    if spawned is not None:
        target.change(target.setup, spawned)
        return
    try:
        scene = change_value(target.scene, action.path, action.value)
        is_invalid = action.path.startswith("surface.") and any(check_surface(scene, target.setup.bodies))
    except ValueError:
        is_invalid = True
    if is_invalid:  # validate the whole scene again, to report every fault as for a file
        try:
            scene = _validated_again(action, target.scene)
        except AddressError as error:
            raise ActionError(f"{error}{_spawned_hint(parts, target)}") from None
    _check_motors(action, target.scene, scene)
    setup = target.setup.with_scene(scene)
    if on_floor(setup) != on_floor(target.setup):
        raise ActionError(f"{action.path}: floor friction cannot be switched on or off during a run")
    target.change(setup)


def _check_motors(action: SetParameter, before: Scene, scene: Scene) -> None:
    """Check that a change of joints changes motors only, which exist before and after it.

    Raises:
        ActionError: it changes something else.
    """
    if scene.joints is before.joints:
        return
    for new, old in zip(scene.joints, before.joints, strict=True):
        if new == old or isinstance(new, Motor):
            continue
        if not isinstance(new, Prismatic | Wheel):
            raise ActionError(f"{action.path} is of a {new.kind}, which has no motor")
        if None in (new.rate, getattr(old, "rate", None)):
            raise ActionError(f"{action.path} has no motor; one that starts at rest has `rate = 0.0` in the scene")


def _validated_again(action: SetParameter, scene: Scene) -> Scene:
    """Return a scene with a value changed, validated as if it were read from a file.

    Raises:
        ActionError: the scene is then invalid; the message lists all faults.
        AddressError: the path does not exist.
    """
    try:
        document, _ = assign(to_document(scene), action.path, action.value)
        return from_session(document)
    except SceneError as error:
        raise ActionError("; ".join(f"{f.path}: {f.message}" for f in error.faults)) from None


def _with_coefficient(
    action: SetParameter, parts: tuple[str, ...], target: ActionTarget
) -> tuple[BodySource, ...] | None:
    """Return the spawned elements, one of them with another restitution or friction; None for any other path.

    Spawned elements are addressed by name, `ball.spawned-1.restitution`. `*` and indices select elements of the file
    only, so that the effect of an action does not depend on which bodies were spawned before.

    Raises:
        ActionError: the value is out of range.
    """
    first = len(target.scene.elements)
    if len(parts) != 3 or parts[1] not in target.bodies.names:
        return None
    index = int(target.bodies.element[target.bodies.names.index(parts[1])]) - first
    if index < 0:
        return None
    spawned = list(target.bodies.elements[first:])
    element = spawned[index]
    heading = heading_of(element)
    if parts[0] != heading:
        suggestion = ".".join((heading, quoted(parts[1]), parts[2]))
        raise ActionError(f"{action.path}: {parts[1]!r} is a {heading}; did you mean {suggestion}?")
    try:
        stated = element.model_dump(by_alias=True, exclude_unset=True)
        spawned[index] = type(element).model_validate({**stated, parts[2]: action.value})
    except ValidationError as error:
        from sandbox.scene.files.diagnosis import explained  # only faults need it

        messages = (message for _, message in explained(error, (heading, index)))
        raise ActionError(f"{action.path}: {'; '.join(messages)}") from None
    return tuple(spawned)


def _spawned_hint(parts: tuple[str, ...], target: ActionTarget) -> str:
    """Return a hint how spawned bodies are addressed, for a path into the list of their kind."""
    first = len(target.scene.elements)
    name_of_element = dict(zip(target.bodies.element.tolist(), target.bodies.names, strict=True))
    paths = [
        f"{parts[0]}.{quoted(name_of_element[first + k])}"
        for k, element in enumerate(target.bodies.elements[first:])
        if heading_of(element) == parts[0] and first + k in name_of_element
    ]
    listed = ", ".join(paths[:5])
    return f"; bodies added during the run are addressed by name: {listed}" if paths else ""


def toggle(action: Toggle, target: ActionTarget) -> None:
    """Make a wall or post solid or not solid.

    Raises:
        ActionError: there is no such wall or post, or the scene has a surface.
    """
    scene = target.scene
    begin = len(scene.planes)
    names = scene.fixed_names[begin : len(scene.fixed)]
    index = index_of_name(names, action.thing, "wall or post")
    if scene.surface is not None or scene.pockets:
        raise ActionError("the cushions of a billiard table cannot be switched off")
    colliders: list[Wall | Post] = [*scene.walls, *scene.posts]
    if colliders[index].solid == action.solid:
        return
    colliders[index] = colliders[index].model_copy(update={"solid": action.solid})
    walls, posts = tuple(colliders[: len(scene.walls)]), tuple(colliders[len(scene.walls) :])
    target.change(target.setup.with_scene(scene.model_copy(update={"walls": walls, "posts": posts})))


def reshape(action: Reshape, target: ActionTarget) -> None:
    """Change the points of a wall.

    Raises:
        ActionError: there is no such wall, it is a cushion, or the points are invalid.
    """
    scene = target.scene
    names = scene.fixed_names[len(scene.planes) : len(scene.planes) + len(scene.walls)]
    if action.thing not in names:
        raise ActionError(f"no wall is named {action.thing!r}; walls: {', '.join(map(repr, names)) or 'none'}")
    if on_floor(target.setup):
        raise ActionError(f"{action.thing!r} is a cushion; walls on a [surface] cannot be reshaped")
    index = names.index(action.thing)
    wall = scene.walls[index].model_copy(update={"points": action.points})
    faults = [f"{'.'.join(map(str, location))} {message}" for location, message in check_wall_points(wall)]
    if faults:
        raise ActionError(f"the wall {action.thing!r}: {'; '.join(faults)}")
    walls = (*scene.walls[:index], wall, *scene.walls[index + 1 :])
    target.change(target.setup.with_scene(scene.model_copy(update={"walls": walls})))


def sets_level(action: Action) -> bool:
    """Return whether an action sets a level only: the state of the bodies, and what can touch, stay as they are."""
    return type(action) in (Throttle, Steer, Drive, Actuate)


ENVIRONMENT_FIELDS = {"world", "surface"}
"""Fields of a scene that define neither bodies nor static colliders."""


def apply_action(action: Action, target: ActionTarget) -> int | None:
    """Apply an action. Return the index of the body that is to be removed, if any.

    Raises:
        ActionError: the action cannot be applied. Nothing has changed then.
    """
    if type(action) is Remove:
        return _body_index(action.body, target)
    apply = _ENGINE_ACTIONS.get(type(action))
    if apply is not None:
        apply(action, target)
        return None
    if isinstance(action, Pull | Launch | Switch | Join | Unjoin | Explosion):
        raise ActionError(
            f"{action!r} is not an action of an engine; the simulation that sandbox.start returns accepts it"
        )
    raise ActionError(f"{action!r} is not an action")


def has_same_bodies(scene: Scene, running: Scene) -> bool:
    """Return whether two scenes differ in their world and surface only, so that their contact matrices are equal.

    Parts are compared by identity: parts that are equal but not the same objects count as different.
    """
    return all(
        getattr(scene, key) is getattr(running, key) for key in Scene.model_fields if key not in ENVIRONMENT_FIELDS
    )


def derive_contacts(setup: Setup, bodies: Bodies) -> ContactMatrix:
    """Derive the contact matrix after an action has changed the scene or its bodies.

    Raises:
        ActionError: the scene would have more different surfaces than allowed.
    """
    matrix = contact_matrix(setup, bodies)
    if len(matrix.surfaces.surfaces) > MAX_SURFACES:
        raise ActionError(f"more than {MAX_SURFACES} different surfaces; share materials between balls")
    return matrix


def _body_index(name: str, target: ActionTarget) -> int:
    """Return the index of a body that is in the scene."""
    index = target.bodies.number_of.get(name)
    if index is None:
        raise ActionError(f"no body is named {name!r}")
    if not target.present[index]:
        raise ActionError(f"{name!r} has been removed")
    return index


def _check_place(position: tuple[float, float], radius: float, collides: Collides, target: ActionTarget) -> None:
    """Check a position: not deep behind a plane, and accepted by the engine."""
    if collides == "none":
        return
    scene = target.scene
    for plane, name in zip(scene.planes, scene.fixed_names, strict=False):  # planes come first among the names
        normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
        depth = float((np.asarray(plane.point) - np.asarray(position)) @ normal)
        if depth > BACKING:
            raise ActionError(f"{depth:g} m behind the plane {name!r}; the limit is {BACKING:g} m")
    target.check_place(position, radius, collides)


def _movable_body_index(name: str, target: ActionTarget) -> int:
    index, bodies = _body_index(name, target), target.bodies
    if bodies.fixed[index]:
        raise ActionError(f"{name!r} is fixed and cannot move")
    if index in bodies.paths:
        raise ActionError(f"{name!r} follows its path: no impulse or force changes its motion")
    if bodies.kinematic[index]:
        raise ActionError(f"{name!r} is kinematic: no impulse or force changes its motion; set it by a `move` action")
    _refuse_driven(name, target.scene)
    return index


def _refuse_driven(name: str, scene: Scene) -> None:
    for k, drive in enumerate(scene.drives):
        if drive.body == name:
            drive_name = names_of(scene)[k]
            raise ActionError(f"{name!r} is held by its drive; move it by a `drive` action on {drive_name!r}")


def _apply_impulse(action: Impulse, target: ActionTarget) -> None:
    index = _movable_body_index(action.body, target)
    velocity, spin = target.motion(index)
    mass, moment = float(target.bodies.mass[index]), float(target.bodies.moment[index])
    vx, vy = (v + impulse / mass for v, impulse in zip(velocity.tolist(), action.impulse, strict=True))
    spin += action.angular / moment
    check_speed(math.hypot(vx, vy), f"the impulse on {action.body!r}")
    check_speed(abs(spin), f"the angular impulse on {action.body!r}")
    target.set_velocity(index, np.asarray((vx, vy)))
    if action.angular:
        target.set_spin(index, spin)


def _throttle(action: Throttle, target: ActionTarget) -> None:
    thrusts = target.scene.thrusts
    names = [thrust.name or default_name("thrust", k) for k, thrust in enumerate(thrusts)]
    target.throttle(index_of_name(names, action.thrust, "thrust"), action.level)


def _steer(action: Steer, target: ActionTarget) -> None:
    tyres = [tyre.name or default_name("tyre", k) for k, tyre in enumerate(target.scene.tyres)]
    target.steer(index_of_name(tyres, action.tyre, "tyre"), (action.throttle, action.brake, action.steer))


def _drive(action: Drive, target: ActionTarget) -> None:
    target.drive(index_of_name(names_of(target.scene), action.drive, "drive"), action.level)


def _actuate(action: Actuate, target: ActionTarget) -> None:
    joints, levels = target.setup.joints, {}
    for name, level in action.levels.items():
        row = joints.motor_rows.get(name)
        if row is None:
            index_of_name(joints.names, name, "joint")  # raises, if there is no such joint
            raise ActionError(f"the joint {name!r} has no motor")
        levels[row] = level
    target.actuate(levels)


def _apply_force(action: Force, target: ActionTarget) -> None:
    index = _movable_body_index(action.body, target)
    mass, moment = float(target.bodies.mass[index]), float(target.bodies.moment[index])
    check_speed(math.hypot(*action.force) / mass * target.h, f"one step under the force on {action.body!r}")
    check_speed(abs(action.torque) / moment * target.h, f"one step under the torque on {action.body!r}")
    target.set_constant_force(index, np.asarray(action.force), action.torque)


def _move(action: Move, target: ActionTarget) -> None:
    index = _body_index(action.body, target)
    _refuse_driven(action.body, target.scene)
    if index in target.bodies.paths:
        raise ActionError(f"{action.body!r} follows its path, which depends on the time only; it cannot be moved")
    fixed = bool(target.bodies.fixed[index])
    if fixed and (action.velocity not in (None, (0.0, 0.0)) or action.angular_velocity):
        raise ActionError(f"{action.body!r} is fixed; its position can be changed, but it cannot have a velocity")
    collides = target.bodies.elements[target.bodies.element[index]].collides
    _check_place(action.position, float(target.bodies.radius[index]), collides, target)
    target.move_body(index, np.asarray(action.position))
    if action.angle is not None:
        target.turn_body(index, action.angle)
    if action.velocity is not None and not fixed:
        target.set_velocity(index, np.asarray(action.velocity))
    if action.angular_velocity is not None and not fixed:
        target.set_spin(index, action.angular_velocity)


def _strike(action: Strike, target: ActionTarget) -> None:
    index = _movable_body_index(action.ball, target)
    if target.scene.surface is None or not target.bodies.round[index]:
        raise ActionError(f"{action.ball!r} cannot be struck; a cue strikes balls on a [surface] only")
    if target.scene.surface.bodies == "pucks":
        raise ActionError(f"{action.ball!r} cannot be struck; use an impulse for a puck")
    if miscues(action):
        raise ActionError(f"the tip slips; side and height together must be at most {MISCUE:g} of the radius off")
    velocity, spin = struck(action, float(target.bodies.mass[index]), float(target.bodies.radius[index]))
    target.set_velocity(index, np.asarray(velocity))
    target.set_spin(index, spin[2])
    target.set_roll(index, spin[:2])


def _spawn(action: Spawn, target: ActionTarget) -> None:
    scene, single = target.scene, action.single
    name = single.name or default_name("spawned", len(target.bodies))
    if name in target.bodies.names or name in scene.fixed_names:
        raise ActionError(f"a body or fixed object is already named {name!r}")
    if single.layer not in scene.layers:
        raise ActionError(f"no layer is named {single.layer!r}; layers: {', '.join(scene.layers)}")
    if single.path is not None:
        raise ActionError(f"{name!r} has a path, which begins with the scene; it cannot be added during a run")
    if single.one_way is not None:
        raise ActionError(f"{name!r} is a one-way body, which cannot be added during a run")
    unknown = [name for name in (*(single.categories or ()), *(single.mask or ())) if name not in scene.categories]
    if unknown:
        known = ", ".join(scene.categories) or "none"
        raise ActionError(f"no category is named {unknown[0]!r}; categories of the scene: {known}")
    if len(target.bodies) >= MAX_BODIES:
        raise ActionError(f"the scene already has {MAX_BODIES:,} bodies, which is the limit")
    alone_scene = scene_of_one_body(scene, single)
    faults = crosscheck(alone_scene)
    if faults:
        raise ActionError("; ".join(message for _, message in faults))
    x, y = alone_scene.bodies.position[0].tolist()  # of the centre of mass, which may be far from `position`
    _check_place((x, y), float(alone_scene.bodies.radius[0]), single.collides, target)
    if isinstance(single, Ball) and not single.fixed and single.collides != "none":
        _check_cushion_heights(single.radius, scene)
    target.add(single, name)


def _check_cushion_heights(radius: float, scene: Scene) -> None:
    """Refuse a ball of a radius, m, if the nose of a cushion passes over it. Balls of a file have the same check."""
    for collider, name in zip(scene.fixed, scene.fixed_names, strict=False):  # pockets come last among the names
        height = collider.height if isinstance(collider, Wall | Post) else None
        if height is not None and height >= 2.0 * radius:
            raise ActionError(f"the nose of {name!r}, {height:g} m high, passes over a ball of radius {radius:g} m")


def scene_of_one_body(scene: Scene, single: BodySpec) -> Scene:
    """Return a scene with one body and the world, surface and materials of another scene."""
    kinds = {Ball: "balls", Box: "boxes", Capsule: "capsules", Polygon: "polygons", Compound: "compounds"}
    keys = ("world", "surface", "contact_models", "materials", "pairs")
    environment = {key: getattr(scene, key) for key in keys}
    return Scene.model_validate(environment).model_copy(update={kinds[type(single)]: (single,)})


_ENGINE_ACTIONS: Mapping[type, Callable[[Any, ActionTarget], None]] = {
    Impulse: _apply_impulse,
    Force: _apply_force,
    Move: _move,
    Spawn: _spawn,
    SetParameter: set_parameter,
    Throttle: _throttle,
    Steer: _steer,
    Reshape: reshape,
    Drive: _drive,
    Actuate: _actuate,
    Toggle: toggle,
    Strike: _strike,
}
"""Function that applies each action of an engine. `isinstance` of a model takes as long as an action."""
