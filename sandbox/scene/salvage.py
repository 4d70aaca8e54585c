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
from sandbox.scene.presets import written_out

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
    "rows": 1,
    "base": [0.0, 0.0],
    "corner": [0.0, 0.0],
    "start": [0.0, 0.0],
    "end": [1.0, 0.0],
    "links": 1,
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
    "pocket": {"position": [1e16, 1e16], "radius": 1e-9},
    **{kind: {"collides": "none"} for kind in Scene().kinds},
}
"""What else a table with a fault is given, so that it makes nothing around it look wrong."""

_TABLES = {field.alias or name for name, field in Scene.model_fields.items()} - {"title", "about"}


REFERRING = {("joint",), ("attraction",), ("thrust",), ("drive",), ("shot",)}
"""Tables that speak of bodies, of which nobody speaks: one that is faulty is left out."""

PARTS = ("ball", "box", "capsule", "polygon")
"""Tables of a body's parts, of which it needs one."""

OF_THEIR_OWN = {("material",), ("name",), ("between",)}
"""Keys that no stand-in touches: what the cross-check says of them holds for an element with other faults too."""


def crosscheck_the_rest(document: dict[str, Any], wrong: Iterable[Location]) -> list[Found]:
    """Cross-check a document whose values at `wrong` are faulty.

    Those are left out, or given a harmless value where one must be there. What the cross-check then says of the
    elements they belong to does not count, but for keys of their own. Nothing is found where too much is wrong to tell.
    """
    document = copy.deepcopy(document)
    touched: set[Location] = set()
    wrong = list(wrong)
    if () in wrong or any(location[:1] == ("billiards",) for location in wrong):
        return []  # the document as a whole cannot be read, or what stands for most of it
    kept = _without_faulty(document, wrong)
    for location in wrong:
        if location[:1] in REFERRING:
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
        if location[0] == "body" and not any(holder.get(part) for part in PARTS):
            holder["ball"] = [{"radius": 1.0}]
        for name, field in model_at(location[:depth]).model_fields.items():
            if field.is_required() and name not in holder and name in HARMLESS:
                holder[name] = HARMLESS[name]
    if "billiards" in document:
        document = written_out(document) or {}
    try:
        scene = read_model(document)
    except ValueError:
        return []
    found = [f for f in crosscheck(scene) if touched.isdisjoint((f[0][:1], f[0][:2])) or f[0][2:3] in OF_THEIR_OWN]
    return [(_numbered(location, kept), message) for location, message in found]


def _without_faulty(document: dict[str, Any], wrong: list[Location]) -> dict[str, list[int]]:
    """Take the faulty joints and the like out of a document; return which of each kind are still there.

    None of them are where a fault may be that of a body's name, which they would seem to miss.
    """
    nameless = any(_hides_a_name(location) for location in wrong)
    kept: dict[str, list[int]] = {}
    for (key,) in REFERRING:
        those = document.get(key)
        faulty = [location for location in wrong if location[0] == key]
        if nameless or not isinstance(those, list) or any(len(location) < 2 for location in faulty):
            document.pop(key, None)
            continue
        out = {location[1] for location in faulty}
        kept[key] = [k for k in range(len(those)) if k not in out]
        document[key] = [those[k] for k in kept[key]]
    return kept


def _hides_a_name(location: Location) -> bool:
    """Tell whether a fault may be why a body is not found by its name."""
    if len(location) < 2:
        return location not in (("title",), ("about",), *REFERRING)
    key = str(location[2]) if len(location) == 3 else ""
    return location[0] in Scene().kinds and bool(difflib.get_close_matches("name", [key]))


def _numbered(location: Location, kept: dict[str, list[int]]) -> Location:
    """Return a location with the number that its joint, or the like, has in the whole document."""
    if location[:1] in REFERRING and len(location) > 1:
        return (location[0], kept[str(location[0])][int(location[1])], *location[2:])
    return location
