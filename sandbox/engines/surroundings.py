"""Surroundings: what actions change of a running scene besides its bodies: its air, its figures, its walls.

Everything is checked before anything changes.
"""

from dataclasses import replace

from pydantic import ValidationError

from sandbox.action import (
    SETTABLE,
    ActionError,
    Reshape,
    SetParameter,
    Toggle,
    heading_of,
    is_settable,
    number_among,
)
from sandbox.engines.cast import Cast
from sandbox.scene.address import AddressError, assign, parse_path
from sandbox.scene.crosscheck import course
from sandbox.scene.demands import on_floor
from sandbox.scene.document import change_value, to_document
from sandbox.scene.faults import SceneError
from sandbox.scene.file import from_document
from sandbox.scene.floored import floored
from sandbox.scene.model import Post, Scene, Wall
from sandbox.scene.surfaced import Mover


def set_parameter(action: SetParameter, cast: Cast) -> None:
    """Change a value of the scene.

    Raises:
        ActionError: it cannot be changed, or not to this.
    """
    if not is_settable(action.path):
        raise ActionError(f"{action.path!r} cannot be changed while a scene runs; what can: {SETTABLE}")
    spawned = _with_coefficient(action, cast)
    if spawned is not None:
        cast.change(cast.scene, spawned)
        return
    try:
        scene = change_value(cast.scene, action.path, action.value)
        wrong = action.path.startswith("surface.") and any(floored(scene, scene.bodies))
    except (ValueError, RecursionError):
        wrong = True
    if wrong:  # the whole scene is read again, to report every fault as for a file
        scene = _read_again(action, cast.scene)
    if on_floor(scene) != on_floor(cast.scene):
        raise ActionError(f"{action.path}: a floor cannot begin to rub, nor cease to, while a scene runs")
    cast.change(_going_on(scene, cast.scene))


def _read_again(action: SetParameter, scene: Scene) -> Scene:
    """Return a scene with a value changed, as a file would be read that says so.

    Raises:
        ActionError: with all that is wrong then.
    """
    try:
        document, _ = assign(to_document(scene), action.path, action.value)
        begun = scene.world.duration > 0.0  # a session that has only just begun has a duration that no scene has
        if not begun:
            document["world"]["duration"] = scene.solver.dt
        read = from_document(document)
    except AddressError as error:
        raise ActionError(str(error)) from None
    except SceneError as error:
        raise ActionError("; ".join(f"{f.path}: {f.message}" for f in error.faults)) from None
    return read if begun else read.model_copy(update={"world": read.world.model_copy(update={"duration": 0.0})})


def _with_coefficient(action: SetParameter, cast: Cast) -> tuple[Mover, ...] | None:
    """Return the elements that joined the scene, one with another restitution or friction; None if that is of none.

    They are addressed by name, `ball.spawned-1.restitution`; `*` and numbers mean the elements of the file.

    Raises:
        ActionError: the value is out of range.
    """
    try:
        parts = parse_path(action.path)
    except AddressError as error:
        raise ActionError(str(error)) from None
    if len(parts) != 3 or parts[1] not in cast.bodies.names:
        return None
    first = len(cast.scene.elements)
    place = int(cast.bodies.element[cast.bodies.names.index(parts[1])]) - first
    if place < 0:
        return None
    spawned = list(cast.bodies.elements[first:])
    element = spawned[place]
    if parts[0] != heading_of(element):
        raise ActionError(f"{action.path}: {parts[1]!r} is of `{heading_of(element)}`")
    try:
        stated = element.model_dump(by_alias=True, exclude_unset=True)
        spawned[place] = type(element).model_validate({**stated, parts[2]: action.value})
    except ValidationError as error:
        raise ActionError("; ".join(f"{action.path}: {each['msg']}" for each in error.errors())) from None
    return tuple(spawned)


def toggle(action: Toggle, cast: Cast) -> None:
    """Make a wall or post solid, or no longer.

    Raises:
        ActionError: there is no such thing, or it stands on a floor.
    """
    scene = cast.scene
    begin = len(scene.planes)
    names = scene.fixed_names[begin : len(scene.fixed)]
    number = number_among(names, action.thing, "wall or post")
    if scene.surface is not None or scene.pockets:
        raise ActionError("cushions of a table on a floor are solid; none can be toggled")
    things: list[Wall | Post] = [*scene.walls, *scene.posts]
    if things[number].solid == action.solid:
        return
    things[number] = things[number].model_copy(update={"solid": action.solid})
    walls, posts = tuple(things[: len(scene.walls)]), tuple(things[len(scene.walls) :])
    cast.change(_going_on(scene.model_copy(update={"walls": walls, "posts": posts}), scene))


def reshape(action: Reshape, cast: Cast) -> None:
    """Give a wall another course.

    Raises:
        ActionError: there is no such wall, it stands on a floor, or that is no course.
    """
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


def _going_on(scene: Scene, running: Scene) -> Scene:
    """Return a scene, changed as `Cast.change` allows, with the bodies and joints of the running one.

    Laid out anew they would be those of the file: with who is gone, with what is broken, and hanging along the new
    gravity.
    """
    joined = running.bodies.elements[len(running.elements) :]  # spawned before the present engine took over
    bodies = replace(running.bodies, elements=(*scene.elements, *joined))
    return scene.holding(bodies, running.links, running.began)
