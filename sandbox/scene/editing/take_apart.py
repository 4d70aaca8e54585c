"""Taking generators apart: a grid, scatter, emitter or stack is replaced by its bodies, as elements of their own."""

from collections.abc import Collection
from typing import Any

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySource, Part
from sandbox.scene.description.discs import Ball, Disc
from sandbox.scene.description.generators import Stack
from sandbox.scene.editing.elements import ElementKey, bodies_of, element_at, table_values
from sandbox.scene.files.toml_changes import AddElement, Change, RemoveElement

MAX_TAKEN_APART = 1_000
"""Bodies that are written as elements of their own"""


class TakeApartError(ValueError):
    """Elements cannot be taken apart; `str()` has the reason."""


def taking_apart(scene: Scene, keys: Collection[ElementKey]) -> list[Change]:
    """Return the changes that replace generators by their bodies, which keep their names.

    Args:
        scene: the scene.
        keys: the generators.

    Raises:
        TakeApartError: an element is no generator of balls or boxes, or there are too many bodies.
    """
    changes: list[Change] = []
    for key in keys:
        element = element_at(scene, key)
        is_discs = isinstance(element, Disc) and not isinstance(element, Ball)
        if not (is_discs or isinstance(element, Stack)):
            raise TakeApartError(f"a {key.table} cannot be taken apart; grids, scatters, emitters and stacks can")
        if getattr(element, "lifetime", None) is not None:
            raise TakeApartError("an emitter with a lifetime cannot be taken apart: single balls have none")
        count = len(bodies_of(scene, key))
        if count > MAX_TAKEN_APART:
            raise TakeApartError(f"{count:,} bodies are too many; the limit is {MAX_TAKEN_APART:,}")
        changes.append(RemoveElement(key.table, key.index))
        table = "ball" if is_discs else "box"
        changes += [AddElement(table, values) for values in _body_tables(scene, key, element)]
    return changes


def _body_tables(scene: Scene, key: ElementKey, element: Part) -> list[dict[str, Any]]:
    """Return the tables of the bodies of a generator."""
    common = {name for name in BodySource.model_fields if name not in ("name", "angle", "angular_velocity")}
    shared = {name: value for name, value in table_values(element).items() if name in common}
    shape = {"size": list(element.size)} if isinstance(element, Stack) else {"radius": getattr(element, "radius", 0.0)}
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
