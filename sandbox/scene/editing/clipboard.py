"""Copies of elements: what is copied with them, and the changes that add the copies with names of their own."""

import copy
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part, Point
from sandbox.scene.editing.elements import (
    ElementKey,
    all_elements,
    all_names,
    bodies_of,
    bodies_referred_to,
    body_names,
    body_references,
    element_at,
    elements_of_table,
    name_of,
    table_values,
    unique_name,
)
from sandbox.scene.editing.transforms import Similarity, plain_value, transform_element
from sandbox.scene.files.toml_changes import AddElement, Change


@dataclass(frozen=True)
class CopiedElement:
    """An element that was copied."""

    table: str
    element: Part
    name: str
    """its name, or its default name"""
    bodies: tuple[str, ...]
    """names of its bodies"""


def copy_elements(scene: Scene, keys: Collection[ElementKey]) -> tuple[CopiedElement, ...]:
    """Return copies of elements, and of the joints, thrusts, tyres, drives and sensors of their bodies only."""
    names = {name for key in keys for name in body_names(scene, key)}
    chosen = dict.fromkeys(sorted(keys))
    for key, element in all_elements(scene):
        referred = bodies_referred_to(element)
        if key.table in ("joint", "thrust", "tyre", "drive", "sensor") and referred and set(referred) <= names:
            chosen[key] = None
    return tuple(
        CopiedElement(
            key.table,
            element_at(scene, key),
            name_of(scene, key),
            tuple(scene.bodies.names[k] for k in bodies_of(scene, key)),
        )
        for key in chosen
    )


def paste_elements(
    scene: Scene, elements: Sequence[CopiedElement], by: Similarity
) -> tuple[list[Change], list[ElementKey]]:
    """Return the changes that add copies, transformed, and the addresses that these will have.

    Elements that refer to bodies that the scene does not have are left out.
    """
    taken, new_names = all_names(scene), dict[str, str]()
    counts = {each.table: len(elements_of_table(scene, each.table)) for each in elements}
    changes: list[Change] = []
    keys: list[ElementKey] = []
    own_names = []
    for each in elements:
        own_names.append(unique_name(each.name, taken))
        taken.add(own_names[-1])
        for body in each.bodies:  # those of a generator have its name and a number
            new_names[body] = own_names[-1] + body.removeprefix(each.name)
    for each, name in zip(elements, own_names, strict=True):
        if any(
            body not in new_names and body not in scene.bodies.number_of for body in bodies_referred_to(each.element)
        ):
            continue
        values = {"name": name} | table_values(each.element) | {"name": name}
        values |= {key: plain_value(value) for key, value in _world_values(each.element, by).items()}
        changes.append(AddElement(each.table, _renamed(values, each.element, new_names)))
        keys.append(ElementKey(each.table, counts[each.table]))
        counts[each.table] += 1
    return changes, keys


def _world_values(element: Part, by: Similarity) -> dict[str, Any]:
    """Return the values of a copy that a similarity changes; also the points of joints in the world."""
    values = transform_element(element, by)
    between = getattr(element, "between", None)
    anchors = getattr(element, "anchors", None)
    if between is not None and len(between) == 1 and anchors is not None:
        values["anchors"] = (anchors[0], by.point(anchors[1]))
    for key in ("wheels", "groove"):
        points = getattr(element, key, None)
        if points is not None and (key == "wheels" or len(between or ()) == 1):
            values[key] = tuple(by.point(point) for point in points)
    return values


def _renamed(values: dict[str, Any], element: Part, names: dict[str, str]) -> dict[str, Any]:
    """Return values whose references to copied bodies are those to their copies."""
    found = copy.deepcopy(values)
    for path, name in body_references(element):
        holder: Any = found
        for key in path[:-1]:
            holder = holder[key]
        holder[path[-1]] = names.get(name, name)
    return found


def paste_shift(step: float, times: int) -> Point:
    """Return the way by which the n-th paste of the same copy is moved, so that it does not hide the others, m."""
    return 2.0 * step * times, -2.0 * step * times
