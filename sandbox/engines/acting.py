"""Acting: what each action does to the bodies of a running scene. Everything is checked before anything changes."""

import math

import numpy as np

from sandbox.action import (
    Action,
    ActionError,
    Drive,
    Force,
    Impulse,
    Launch,
    Move,
    Pull,
    Remove,
    Reshape,
    SetParameter,
    Spawn,
    Strike,
    Switch,
    Throttle,
    Toggle,
    number_among,
    speed_limit,
)
from sandbox.engines.cast import Cast
from sandbox.engines.surroundings import reshape, set_parameter, toggle
from sandbox.scene.bodies import Bodies
from sandbox.scene.crosscheck import MAX_SURFACES, crosscheck
from sandbox.scene.cue import MISCUE, miscues, struck
from sandbox.scene.driven import names_of
from sandbox.scene.meetings import Meetings, meetings
from sandbox.scene.model import Ball, Box, Capsule, Collides, Compound, Polygon, Post, Scene, Single, Wall, default_name
from sandbox.scene.part import BACKING, MAX_BODIES

AROUND = {"world", "surface"}
"""The fields of a scene that say nothing about bodies and fixed things."""


def perform(action: Action, cast: Cast) -> int | None:
    """Do what an action says; return the number of a body that is to be taken out, if any.

    Raises:
        ActionError: it cannot be done. Nothing has changed then.
    """
    match action:
        case Impulse():
            _kick(action, cast)
        case Force():
            _push(action, cast)
        case Move():
            _move(action, cast)
        case Spawn():
            _spawn(action, cast)
        case Remove():
            return _number(action.body, cast)
        case SetParameter():
            set_parameter(action, cast)
        case Throttle():
            thrusts = [thrust.name or default_name("thrust", k) for k, thrust in enumerate(cast.scene.thrusts)]
            cast.throttle(number_among(thrusts, action.thrust, "thrust"), action.level)
        case Reshape():
            reshape(action, cast)
        case Drive():
            cast.drive(number_among(names_of(cast.scene), action.drive, "drive"), action.level)
        case Toggle():
            toggle(action, cast)
        case Strike():
            _strike(action, cast)
        case Pull() | Launch() | Switch():
            raise ActionError(f"{action!r} is nothing that an engine does by itself; sandbox.start gives one that can")
        case _:
            raise ActionError(f"{action!r} is no action")
    return None


def is_matter_same(scene: Scene, running: Scene) -> bool:
    """Tell whether two scenes differ in their world and floor alone, so that what can meet what is the same.

    Parts that are equal but not the same objects count as different.
    """
    return all(getattr(scene, key) is getattr(running, key) for key in Scene.model_fields if key not in AROUND)


def derived(scene: Scene, bodies: Bodies) -> Meetings:
    """Derive what can meet what once an action has changed a scene or its bodies.

    Raises:
        ActionError: there are more different surfaces than a scene may have.
    """
    meet = meetings(scene, bodies)
    if len(meet.surfaces.surfaces) > MAX_SURFACES:
        raise ActionError(f"more than {MAX_SURFACES} different surfaces; share materials between balls")
    return meet


def _number(name: str, cast: Cast) -> int:
    """Return the number of a body that is there."""
    try:
        number = cast.bodies.names.index(name)
    except ValueError:
        raise ActionError(f"no body is named {name!r}") from None
    if not cast.present[number]:
        raise ActionError(f"{name!r} is no longer there")
    return number


def _check_place(position: tuple[float, float], radius: float, collides: Collides, cast: Cast) -> None:
    """Refuse a place deep behind a plane, or one that the engine cannot start from."""
    if collides == "none":
        return
    scene = cast.scene
    for plane, name in zip(scene.planes, scene.fixed_names, strict=False):  # planes come first among the names
        normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
        depth = float((np.asarray(plane.point) - np.asarray(position)) @ normal)
        if depth > BACKING:
            raise ActionError(f"{depth:g} m behind the plane {name!r}; at most {BACKING:g}")
    cast.check_place(position, radius, collides)


def _mover(name: str, cast: Cast) -> int:
    number = _number(name, cast)
    if cast.bodies.fixed[number]:
        raise ActionError(f"{name!r} is fixed; nothing can move it")
    _refuse_driven(name, cast.scene)
    return number


def _refuse_driven(name: str, scene: Scene) -> None:
    for drive, own in zip(scene.drives, names_of(scene), strict=True):
        if drive.body == name:
            raise ActionError(f"{name!r} is held by its drive; only that moves it: a `drive` action on {own!r}")


def _kick(action: Impulse, cast: Cast) -> None:
    number = _mover(action.body, cast)
    velocity, spin = cast.motion(number)
    velocity = velocity + np.asarray(action.impulse) / cast.bodies.mass[number]
    spin += float(action.angular / cast.bodies.moment[number])
    speed_limit(float(np.hypot(*velocity)), f"the impulse on {action.body!r}")
    speed_limit(abs(spin), f"the angular impulse on {action.body!r}")
    cast.set_velocity(number, velocity)
    if action.angular:
        cast.set_spin(number, spin)


def _push(action: Force, cast: Cast) -> None:
    number = _mover(action.body, cast)
    mass, moment = float(cast.bodies.mass[number]), float(cast.bodies.moment[number])
    speed_limit(math.hypot(*action.force) / mass * cast.h, f"one step under the force on {action.body!r}")
    speed_limit(abs(action.torque) / moment * cast.h, f"one step under the torque on {action.body!r}")
    cast.push(number, np.asarray(action.force), action.torque)


def _move(action: Move, cast: Cast) -> None:
    number = _number(action.body, cast)
    _refuse_driven(action.body, cast.scene)
    fixed = bool(cast.bodies.fixed[number])
    if fixed and action.velocity not in (None, (0.0, 0.0)):
        raise ActionError(f"{action.body!r} is fixed; it can be put elsewhere, but has no velocity")
    collides = cast.bodies.elements[cast.bodies.element[number]].collides
    _check_place(action.position, float(cast.bodies.radius[number]), collides, cast)
    cast.put(number, np.asarray(action.position))
    if action.velocity is not None and not fixed:
        cast.set_velocity(number, np.asarray(action.velocity))


def _strike(action: Strike, cast: Cast) -> None:
    number = _mover(action.ball, cast)
    if cast.scene.surface is None or not cast.bodies.round[number]:
        raise ActionError(f"{action.ball!r} cannot be struck; a cue strikes balls on a [surface]")
    if cast.scene.surface.bodies == "pucks":
        raise ActionError(f"{action.ball!r} cannot be struck; it is a puck, which an impulse sends off")
    if miscues(action):
        raise ActionError(f"the tip slips: side and height are together at most {MISCUE:g} of the radius off")
    velocity, spin = struck(action, float(cast.bodies.mass[number]), float(cast.bodies.radius[number]))
    cast.set_velocity(number, np.asarray(velocity))
    cast.set_spin(number, spin[2])
    cast.set_roll(number, spin[:2])


def _spawn(action: Spawn, cast: Cast) -> None:
    scene, single = cast.scene, action.single
    name = single.name or default_name("spawned", len(cast.bodies))
    if name in cast.bodies.names or name in scene.fixed_names:
        raise ActionError(f"a body or fixed thing is called {name!r} already")
    if single.layer not in scene.layers:
        raise ActionError(f"no layer is named {single.layer!r}; the scene speaks of {', '.join(scene.layers)}")
    if len(cast.bodies) >= MAX_BODIES:
        raise ActionError(f"the scene holds {MAX_BODIES:,} bodies already")
    alone = alone_in(scene, single)
    faults = crosscheck(alone)
    if faults:
        raise ActionError("; ".join(message for _, message in faults))
    x, y = alone.bodies.position[0].tolist()  # of its centre: an outline may be drawn far from its own position
    _check_place((x, y), float(alone.bodies.radius[0]), single.collides, cast)
    if isinstance(single, Ball) and not single.fixed and single.collides != "none":
        _check_noses(single.radius, scene)
    cast.add(single, name)


def _check_noses(radius: float, scene: Scene) -> None:
    """Refuse a ball, m, over which the nose of a cushion passes, as a scene's own are."""
    for thing, name in zip(scene.fixed, scene.fixed_names, strict=False):  # pockets come last among the names
        height = thing.height if isinstance(thing, Wall | Post) else None
        if height is not None and height >= 2.0 * radius:
            raise ActionError(f"the nose of {name!r}, {height:g} m high, passes over a ball of radius {radius:g} m")


def alone_in(scene: Scene, single: Single) -> Scene:
    """Return a scene of one body in the surroundings of another."""
    kinds = {Ball: "balls", Box: "boxes", Capsule: "capsules", Polygon: "polygons", Compound: "compounds"}
    keys = ("world", "surface", "contact_models", "materials", "pairs")
    surroundings = {key: getattr(scene, key) for key in keys}
    return Scene.model_validate(surroundings).model_copy(update={kinds[type(single)]: (single,)})
