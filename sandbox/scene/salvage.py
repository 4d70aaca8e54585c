"""Salvage: the sound remainder of a scene document with faults, so that it too can be cross-checked."""

import copy
import difflib
from collections.abc import Iterable
from typing import Any

from sandbox.scene.crosscheck import Found, crosscheck
from sandbox.scene.document import read_model
from sandbox.scene.explain import model_at
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene

HARMLESS: dict[str, Any] = {
    "position": [0.0, 0.0],
    "point": [0.0, 0.0],
    "normal": [0.0, 1.0],
    "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
    "radius": 1.0,
    "size": [1.0, 1.0],
    "length": 1.0,
    "origin": [0.0, 0.0],
    "spacing": [10.0, 10.0],
    "columns": 1,
    "count": 1,
    "lower": [0.0, 0.0],
    "upper": [1.0, 1.0],
    "velocity_min": [0.0, 0.0],
    "velocity_max": [0.0, 0.0],
}
"""A value for each key that must be there, standing in for a faulty one."""

ALOOF: dict[str, dict[str, Any]] = {
    "plane": {"point": [0.0, -1e16], "normal": [0.0, 1.0]},
    "world": {"duration": 1e-6},
    **{kind: {"collides": "none"} for kind in Scene().kinds},
}
"""What else a table with a fault is given, so that it makes nothing around it look wrong."""

_TABLES = {field.alias or name for name, field in Scene.model_fields.items()} - {"title", "about"}


REFERRING = {("joint",), ("attraction",), ("thrust",)}
"""Tables that speak of bodies: one that is faulty is left out, with its like."""

OF_THEIR_OWN = {("material",), ("name",), ("between",)}
"""Keys that no stand-in touches: what the cross-check says of them holds for an element with other faults too."""


def crosscheck_the_rest(document: dict[str, Any], wrong: Iterable[Location]) -> list[Found]:
    """Cross-check a document whose values at `wrong` are faulty.

    Those are left out, or given a harmless value where one must be there; what the cross-check then says of the
    elements they belong to does not count, but for keys of their own. Nothing is found where too much is wrong to tell.
    """
    document = copy.deepcopy(document)
    touched: set[Location] = set()
    for location in wrong:
        if location[:1] in REFERRING:
            document.pop(str(location[0]), None)  # nothing rests on them
            continue
        if len(location) == 1 and location[0] in document and location[0] not in _TABLES:
            if difflib.get_close_matches(str(location[0]), _TABLES, n=1) == ["material"]:
                return []  # many a name would seem to point at nothing
            del document[location[0]]  # an unknown key, a title: nothing else rests on it
            continue
        depth = 2 if len(location) > 1 and isinstance(location[1], int) else 1
        holder: Any = document
        for key in location[:depth]:
            holder = holder[key]
        if len(location) <= depth or not isinstance(holder, dict):
            return []
        holder.pop(location[depth], None)
        if "duration" not in holder:
            holder.update(ALOOF.get(str(location[0]), {}))
        touched.add(location[:depth])
        for name, field in model_at(location[:depth]).model_fields.items():
            if field.is_required() and name not in holder and name in HARMLESS:
                holder[name] = HARMLESS[name]
    try:
        scene = read_model(document)
    except ValueError:
        return []
    return [f for f in crosscheck(scene) if touched.isdisjoint((f[0][:1], f[0][:2])) or f[0][2:3] in OF_THEIR_OWN]
