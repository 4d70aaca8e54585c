"""Acting: what each action does to the bodies of a running scene. Everything is checked before anything changes."""

import math
from dataclasses import replace
from typing import Protocol

import numpy as np

from sandbox.action import (
    SETTABLE,
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
    is_settable,
    speed_limit,
)
from sandbox.scene.address import AddressError, assign
from sandbox.scene.bodies import Bodies
from sandbox.scene.crosscheck import MAX_SURFACES, course, crosscheck
from sandbox.scene.cue import MISCUE, miscues, struck
from sandbox.scene.demands import on_floor
from sandbox.scene.document import to_document
from sandbox.scene.driven import names_of
from sandbox.scene.faults import SceneError
from sandbox.scene.file import from_document
from sandbox.scene.meetings import Meetings, meetings
from sandbox.scene.model import Ball, Box, Capsule, Collides, Compound, Polygon, Post, Scene, Single, Wall, default_name
from sandbox.scene.part import BACKING, MAX_BODIES
from sandbox.trajectory import BoolArray, FloatArray


class Cast(Protocol):
    """The bodies of a running scene, as an engine keeps them."""

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""

    @property
    def bodies(self) -> Bodies:
        """The bodies by number; spawned ones at the end."""

    @property
    def h(self) -> float:
        """The substep, s."""

    @property
    def present(self) -> BoolArray:
        """(N,) which bodies are there."""

    def motion(self, number: int) -> tuple[FloatArray, float]:
        """Return a body's velocity (2,), m/s, and angular velocity, rad/s."""

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s."""

    def set_spin(self, number: int, spin: float) -> None:
        """Give a body an angular velocity, rad/s."""

    def set_roll(self, number: int, roll: tuple[float, float]) -> None:
        """Give a sphere on a floor an angular velocity about x and y, rad/s."""

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a steady force, N, and torque, N·m, act on a body from now on.

        Raises:
            ActionError: the engine models no such force.
        """

    def put(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""

    def check_place(self, position: tuple[float, float], radius: float, collides: Collides) -> None:
        """Refuse a place that this engine cannot start from, though others may.

        Raises:
            ActionError: it is one.
        """

    def change(self, scene: Scene) -> None:
        """Go on with a scene that differs alone in air, gravity, coefficients, courses of walls, or in what is solid.

        Raises:
            ActionError: it asks for what the settings or the engine cannot go on with.
        """

    def throttle(self, number: int, level: float) -> None:
        """Open the scene's thrust of that number to a share of its force.

        Raises:
            ActionError: the engine models no thrust.
        """

    def drive(self, number: int, level: float) -> None:
        """Ask the scene's drive of that number for a level.

        Raises:
            ActionError: the engine models no drives.
        """

    def add(self, single: Single, name: str) -> int:
        """Add a body that was checked, and return its number.

        Raises:
            ActionError: the engine cannot.
        """


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
            _set(action, cast)
        case Throttle():
            cast.throttle(_thrust_number(action.thrust, cast.scene), action.level)
        case Reshape():
            _reshape(action, cast)
        case Drive():
            cast.drive(_drive_number(action.drive, cast.scene), action.level)
        case Toggle():
            _toggle(action, cast)
        case Strike():
            _strike(action, cast)
        case Pull() | Launch() | Switch():
            raise ActionError(f"{action!r} is nothing that an engine does by itself; sandbox.start gives one that can")
        case _:
            raise ActionError(f"{action!r} is no action")
    return None


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


def _toggle(action: Toggle, cast: Cast) -> None:
    scene = cast.scene
    begin = len(scene.planes)
    names = scene.fixed_names[begin : len(scene.fixed)]
    if action.thing not in names:
        raise ActionError(f"no wall or post is named {action.thing!r}; there are {', '.join(names) or 'none'}")
    if scene.surface is not None or scene.pockets:
        raise ActionError("cushions of a table on a floor are solid; none can be toggled")
    number = names.index(action.thing)
    things: list[Wall | Post] = [*scene.walls, *scene.posts]
    if things[number].solid == action.solid:
        return
    things[number] = things[number].model_copy(update={"solid": action.solid})
    walls, posts = tuple(things[: len(scene.walls)]), tuple(things[len(scene.walls) :])
    cast.change(_going_on(scene.model_copy(update={"walls": walls, "posts": posts}), scene))


def _thrust_number(name: str, scene: Scene) -> int:
    names = [thrust.name or default_name("thrust", k) for k, thrust in enumerate(scene.thrusts)]
    if name not in names:
        raise ActionError(f"no thrust is named {name!r}; there are {', '.join(names) or 'none'}")
    return names.index(name)


def _reshape(action: Reshape, cast: Cast) -> None:
    scene = cast.scene
    names = scene.fixed_names[len(scene.planes) : len(scene.planes) + len(scene.walls)]
    if action.thing not in names:
        raise ActionError(f"no wall is named {action.thing!r}; there are {', '.join(map(repr, names)) or 'none'}")
    if on_floor(scene):
        raise ActionError(f"{action.thing!r} is a cushion; what stands on a [surface] keeps its course")
    number = names.index(action.thing)
    wall = scene.walls[number].model_copy(update={"points": action.points})
    faults = [f"{'.'.join(map(str, where))} {message}" for where, message in course(wall)]
    if faults:
        raise ActionError(f"the wall {action.thing!r}: {'; '.join(faults)}")
    walls = (*scene.walls[:number], wall, *scene.walls[number + 1 :])
    cast.change(_going_on(scene.model_copy(update={"walls": walls}), scene))


def _drive_number(name: str, scene: Scene) -> int:
    names = names_of(scene)
    if name not in names:
        raise ActionError(f"no drive is named {name!r}; there are {', '.join(names) or 'none'}")
    return names.index(name)


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


def _going_on(scene: Scene, running: Scene) -> Scene:
    """Return a scene, changed as `Cast.change` allows, with the bodies and joints of the running one.

    Laid out anew they would be those of the file: with who is gone, with what is broken, and hanging along the new
    gravity.
    """
    joined = running.bodies.elements[len(running.elements) :]  # spawned before the present engine took over
    bodies = replace(running.bodies, elements=(*scene.elements, *joined))
    return scene.holding(bodies, running.links, running.began)


def _set(action: SetParameter, cast: Cast) -> None:
    if not is_settable(action.path):
        raise ActionError(f"{action.path!r} cannot be changed while a scene runs; what can: {SETTABLE}")
    try:
        document, _ = assign(to_document(cast.scene), action.path, action.value)
        world = cast.scene.world
        if world.duration == 0.0:  # of a session that has only just begun, as no scene's is
            document["world"]["duration"] = cast.scene.solver.dt
        scene = from_document(document)
        if world.duration == 0.0:
            scene = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": 0.0})})
    except AddressError as error:
        raise ActionError(str(error)) from None
    except SceneError as error:
        raise ActionError("; ".join(f"{f.path}: {f.message}" for f in error.faults)) from None
    if on_floor(scene) != on_floor(cast.scene):
        raise ActionError(f"{action.path}: a floor cannot begin to rub, nor cease to, while a scene runs")
    cast.change(_going_on(scene, cast.scene))
