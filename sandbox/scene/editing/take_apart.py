"""Taking elements apart: a generator is replaced by its bodies, a wall by one for each of its sides."""

from collections.abc import Collection
from typing import Any

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySource, Part
from sandbox.scene.description.discs import Ball, Disc
from sandbox.scene.description.fixed import Wall
from sandbox.scene.description.generators import Stack
from sandbox.scene.editing.elements import ElementKey, all_names, bodies_of, element_at, table_values, unique_name
from sandbox.scene.files.toml_changes import AddElement, Change, RemoveElement, RemoveValue, SetValue

MAX_TAKEN_APART = 1_000
"""Bodies, or sides of a wall, that are written as elements of their own"""


class TakeApartError(ValueError):
    """Elements cannot be taken apart; `str()` has the reason."""


def take_apart_changes(scene: Scene, keys: Collection[ElementKey]) -> list[Change]:
    """Return the changes that replace generators by their bodies, which keep their names, and divide walls.

    Args:
        scene: the scene.
        keys: the generators and walls.

    Raises:
        TakeApartError: an element is no wall and no generator of balls or boxes, or it has too few or too many parts.
    """
    changes: list[Change] = []
    taken = all_names(scene)
    for key in keys:
        element = element_at(scene, key)
        if isinstance(element, Wall):
            changes += _division(key, element, taken)
            continue
        is_discs = isinstance(element, Disc) and not isinstance(element, Ball)
        if not (is_discs or isinstance(element, Stack)):
            raise TakeApartError(
                f"a {key.table} cannot be taken apart; walls, grids, scatters, emitters and stacks can"
            )
        if getattr(element, "lifetime", None) is not None:
            raise TakeApartError("an emitter with a lifetime cannot be taken apart: single balls have none")
        count = len(bodies_of(scene, key))
        if count > MAX_TAKEN_APART:
            raise TakeApartError(f"{count:,} bodies are too many; the limit is {MAX_TAKEN_APART:,}")
        changes.append(RemoveElement(key.table, key.index))
        table = "ball" if is_discs else "box"
        changes += [AddElement(table, values) for values in _body_tables(scene, key, element)]
    return changes


def _division(key: ElementKey, wall: Wall, taken: set[str]) -> list[Change]:
    """Return the changes that leave a wall its first side and add walls for the others, whose names `taken` gets."""
    count = len(wall.points) - (not wall.closed)
    if count < 2:
        raise TakeApartError("a wall of two points has one side, and cannot be divided")
    if count > MAX_TAKEN_APART:
        raise TakeApartError(f"{count:,} sides are too many; the limit is {MAX_TAKEN_APART:,}")
    corners = [list(point) for point in (*wall.points, wall.points[0])]
    common = {name: value for name, value in table_values(wall).items() if name not in ("name", "points", "closed")}
    changes: list[Change] = [SetValue((key.table, key.index, "points"), corners[:2])]
    changes += [RemoveValue((key.table, key.index, "closed"))] if wall.closed else []
    for k in range(1, count):
        name = unique_name(wall.name or "wall", taken)
        taken.add(name)
        changes.append(AddElement("wall", {"name": name, "points": corners[k : k + 2], **common}))
    return changes


def _body_tables(scene: Scene, key: ElementKey, element: Part) -> list[dict[str, Any]]:
    """Return the tables of the bodies of a generator."""
    common = {name for name in BodySource.model_fields if name not in ("name", "angle", "angular_velocity")}
    shared = {name: value for name, value in table_values(element).items() if name in common}
    if isinstance(element, Stack):
        shape: dict[str, Any] = {"size": list(element.size), **({"fixed": True} if element.fixed else {})}
    else:
        shape = {"radius": getattr(element, "radius", 0.0)}
    bodies, tables = scene.bodies, []
    for k in bodies_of(scene, key):
        values: dict[str, Any] = {"name": bodies.names[k], "position": bodies.position[k].tolist(), **shape}
        if bodies.velocity[k].any():
            values["velocity"] = bodies.velocity[k].tolist()
        if bodies.angle[k]:
            values["angle"] = float(bodies.angle[k])
        if bodies.angular_velocity[k]:
            values["angular_velocity"] = float(bodies.angular_velocity[k])
        tables.append(values | shared)
    return tables
