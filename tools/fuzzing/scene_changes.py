"""Changes of a scene document: valid ones, and ones that break types, ranges or references."""

import copy
import math
import random
import tomllib
from collections.abc import Callable
from functools import cache
from typing import Any

from sandbox.scene.files.shipped_scenes import shipped
from tools.fuzzing.schema_values import (
    GENERATORS,
    SINGLES,
    Document,
    Path,
    bodies_of,
    bounds_of,
    can_be_added,
    locations,
    names_for,
    scene_schema,
    tables,
    value_of,
)

HEAVY = frozenset({"fireworks_100k", "pile"})
"""Shipped scenes with so many bodies that one run takes seconds; few mutants are made of them."""
COUNTS = ("count", "columns", "rows", "links")
TEXTS = ("", " ", "ball", "é", "𝔘nicode", "名前", "a.b", 'a"b', "a'b", "*", "-1", "0", "\u0000", "\u001b[31m", "\u2028",
         "\u202e", "x" * 200, "x" * 201, "x" * 100_000, "\n", "[0]", "fixed", "world", "=", "#", "\ufffe")  # fmt: skip
NUMBERS = (0, -0.0, 1, -1, 2, 0.5, 1e-9, -1e-9, 1e-300, 5e-324, 1e9, -1e9, 1e12, 1e16, -1e16, 1e17, 1e30, 1e42, 1e100,
           1e154, 1.7e308, 2**31, 2**53 + 1, 2**63 - 1, 2**63, -(2**63), 10**30, 10**400,
           math.nan, math.inf, -math.inf)  # fmt: skip
OTHERS: tuple[Any, ...] = (
    True,
    False,
    "text",
    "",
    [],
    {},
    [[]],
    [0],
    [1.0, 2.0, 3.0],
    {"a": 1},
    [[1, 2], [3, 4]],
    [None],
    "nan",
    "1",
)


@cache
def bases() -> dict[str, Document]:
    """Return the documents of the shipped scenes, by name."""
    found = {scene.path.stem: tomllib.loads(scene.path.read_text(encoding="utf-8")) for scene in shipped()}
    return dict(sorted(found.items()))


def base_scene(draw: random.Random) -> Document:
    """Draw one of the shipped scenes."""
    names = list(bases())
    name = draw.choice(names)
    if name in HEAVY and draw.random() < 0.9:
        name = draw.choice([each for each in names if each not in HEAVY])
    return bases()[name]


def put(document: Document, path: Path, value: Any) -> None:
    """Set a value at a path that exists except for its last key."""
    node: Any = document
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value


def _pick(document: Document, draw: random.Random, is_candidate: Callable[[Path, Any, Document], bool]) -> Any:
    candidates = [each for each in locations(document) if is_candidate(*each)]
    if not candidates:
        return None
    kinds = sorted({str(path[0]) for path, _, _ in candidates})  # tables with many elements are not more likely
    kind = draw.choice(kinds)
    return draw.choice([each for each in candidates if str(each[0][0]) == kind])


def redraw(document: Document, draw: random.Random) -> None:
    """Draw another value at a location, from its whole range."""
    found = _pick(document, draw, lambda _, value, __: not isinstance(value, (dict, list)))
    if found is not None:
        path, _, node = found
        put(document, path, value_of(node, _key(path), document, draw, scene_schema()))


def scale(document: Document, draw: random.Random) -> None:
    """Multiply a number, within its range."""
    found = _pick(document, draw, lambda _, value, __: isinstance(value, float) and math.isfinite(value))
    if found is not None:
        path, value, node = found
        low, high = bounds_of(node)
        factor = draw.choice((-1.0, 0.0, 0.5, 2.0, 0.1, 10.0, 1e3, 1e-3, 1e6, 1e-6, 1.0 + 1e-15))
        put(document, path, float(min(max(value * factor, low), high)))


def add_key(document: Document, draw: random.Random) -> None:
    """Add an optional key to a table."""
    found = _pick(document, draw, lambda _, value, node: isinstance(value, dict) and "properties" in node)
    table, node = (document, scene_schema()) if found is None or draw.random() < 0.1 else found[1:]
    absent = [key for key in node["properties"] if key not in table and can_be_added(key, document)]
    if absent:
        key = draw.choice(absent)
        table[key] = value_of(node["properties"][key], key, document, draw, scene_schema())


def drop_key(document: Document, draw: random.Random) -> None:
    """Remove an optional key of a table."""
    found = _pick(document, draw, lambda _, value, node: bool(_optional(value, node)))
    if found is not None:
        _, table, node = found
        del table[draw.choice(_optional(table, node))]


def _optional(value: Any, node: Document) -> list[str]:
    if not isinstance(value, dict):
        return []
    return [key for key in value if key in node.get("properties", {}) and key not in node.get("required", [])]


def set_solver(document: Document, draw: random.Random) -> None:
    """Draw settings of the solver."""
    root = scene_schema()
    solver = document.setdefault("solver", {})
    settings = root["$defs"]["Settings"]["properties"]
    for key in draw.sample(sorted(settings), draw.choice((1, 1, 2, 3))):
        if isinstance(solver, dict):
            solver[key] = value_of(settings[key], key, document, draw, root)


def set_world(document: Document, draw: random.Random) -> None:
    """Draw a value of the world."""
    root = scene_schema()
    world = document.setdefault("world", {})
    values = root["$defs"]["World"]["properties"]
    key = draw.choice(sorted(values))
    if isinstance(world, dict):
        world[key] = value_of(values[key], key, document, draw, root)


def duplicate(document: Document, draw: random.Random) -> None:
    """Add a copy of an element under another name, in place or shifted."""
    kinds = sorted(kind for kind, elements in document.items() if isinstance(elements, list) and elements)
    if kinds:
        elements = document[draw.choice(kinds)]
        copied = copy.deepcopy(draw.choice(elements))
        if isinstance(copied, dict):
            if "name" in copied:
                copied["name"] = f"{copied['name']}-twin"
            if draw.random() < 0.6:
                shift(copied, draw.choice((0.01, 1.0, 3.0, 1e3)))
        elements.append(copied)


def shift(table: Document, by: float) -> None:
    """Move an element by a distance along both axes, in place."""
    for key in ("position", "origin", "point", "at", "base", "center", "lower", "corner"):
        position = table.get(key)
        if (
            isinstance(position, list)
            and len(position) == 2
            and all(isinstance(each, (int, float)) for each in position)
        ):
            table[key] = [position[0] + by, position[1] + by]


def add_element(document: Document, draw: random.Random) -> None:
    """Add an element drawn from the schema."""
    root = scene_schema()
    lists = [
        key for key, node in root["properties"].items() if node.get("type") == "array" and can_be_added(key, document)
    ]
    kind = draw.choice(lists)
    element = value_of(root["properties"][kind]["items"], kind, document, draw, root)
    if isinstance(document.setdefault(kind, []), list):
        document[kind].append(element)


def add_joint(document: Document, draw: random.Random) -> None:
    """Add a joint between two bodies of the scene, or one body and the world."""
    root = scene_schema()
    bodies = bodies_of(document)
    joint = value_of(root["properties"]["joint"]["items"], "joint", document, draw, root)
    if bodies:
        joint["between"] = draw.sample(bodies, min(len(bodies), draw.choice((1, 2, 2, 2))))
    if "at" in joint and draw.random() < 0.9:
        joint.pop("anchors", None)
    if isinstance(document.setdefault("joint", []), list):
        document["joint"].append(joint)


def transplant(document: Document, draw: random.Random) -> None:
    """Copy a table of another scene, often with its references changed to bodies of this one."""
    other = base_scene(draw)
    kind = draw.choice(sorted(other))
    value = copy.deepcopy(other[kind])
    if isinstance(value, list):
        value = value[:20]
        if draw.random() < 0.7:
            _relink(value, document, draw)
        if draw.random() < 0.8 and isinstance(document.get(kind), list):
            value = [*document[kind], *value]
    document[kind] = value


def _relink(value: Any, document: Document, draw: random.Random) -> None:
    """Replace the references in a value by names of a document."""
    if isinstance(value, list):
        for each in value:
            _relink(each, document, draw)
    elif isinstance(value, dict):
        for key, inner in value.items():
            names = names_for(key, document)
            if names and isinstance(inner, str):
                value[key] = draw.choice(names)
            elif names and isinstance(inner, list) and inner and all(isinstance(each, str) for each in inner):
                value[key] = draw.sample(names, min(len(inner), len(names)))
            else:
                _relink(inner, document, draw)


def fix(document: Document, draw: random.Random) -> None:
    """Fix one body or all bodies, or make them movable."""
    bodies = [each for kind in SINGLES for _, each in tables(document, kind)]
    value = draw.random() < 0.8
    for each in bodies if draw.random() < 0.4 else bodies and [draw.choice(bodies)]:
        each["fixed"] = value
        if value:
            for key in ("velocity", "angular_velocity", "spin"):
                each.pop(key, None)


def put_together(document: Document, draw: random.Random) -> None:
    """Move one body to the position of another."""
    bodies = [each for kind in SINGLES for _, each in tables(document, kind) if "position" in each]
    if len(bodies) > 1:
        first, second = draw.sample(bodies, 2)
        first["position"] = copy.deepcopy(second["position"])


def set_count(document: Document, draw: random.Random) -> None:
    """Change a count."""
    found = _pick(document, draw, lambda path, _, __: path[-1] in COUNTS)
    if found is None:
        _add_generator(document, draw)
        return
    counts = (1, 2, 3, 7, 30) if draw.random() < 0.8 else (100, 300, 1000, 100_000, 1_000_000)
    put(document, found[0], draw.choice(counts))


def _add_generator(document: Document, draw: random.Random) -> None:
    root = scene_schema()
    kind = draw.choice(GENERATORS)
    if isinstance(document.setdefault(kind, []), list):
        document[kind].append(value_of(root["properties"][kind]["items"], kind, document, draw, root))


def drop_element(document: Document, draw: random.Random) -> None:
    """Remove an element, or all elements of a kind."""
    kind = draw.choice(sorted(document)) if document else None
    if kind is None:
        return
    elements = document[kind]
    if isinstance(elements, list) and len(elements) > 1 and draw.random() < 0.7:
        del elements[draw.randrange(len(elements))]
    elif len(document) > 1:
        del document[kind]


def refer(document: Document, draw: random.Random) -> None:
    """Replace a reference by another name of the scene."""
    found = _pick(
        document, draw, lambda path, value, _: isinstance(value, str) and bool(names_for(_key(path), document))
    )
    if found is not None:
        put(document, found[0], draw.choice(names_for(_key(found[0]), document)))


def _key(path: Path) -> str:
    return next((each for each in reversed(path) if isinstance(each, str)), "")


def break_value(document: Document, draw: random.Random) -> None:
    """Put a value of another type, or a number of any size, at a location."""
    found = _pick(document, draw, lambda *_: True)
    if found is not None:
        put(document, found[0], copy.deepcopy(draw.choice(NUMBERS if draw.random() < 0.6 else OTHERS)))


def break_bound(document: Document, draw: random.Random) -> None:
    """Put a number at, or just beyond, a bound of its range."""
    found = _pick(document, draw, lambda _, value, __: isinstance(value, (int, float)) and not isinstance(value, bool))
    if found is not None:
        path, _, node = found
        bound = float(draw.choice(bounds_of(node)))
        beyond = draw.choice((bound, math.nextafter(bound, math.inf), math.nextafter(bound, -math.inf), 2 * bound))
        put(document, path, beyond if node.get("type") == "number" else int(beyond))


def break_key(document: Document, draw: random.Random) -> None:
    """Misspell a key, add an unknown one, or remove one."""
    found = _pick(document, draw, lambda _, value, __: isinstance(value, dict) and bool(value))
    table = document if found is None else found[1]
    key = draw.choice(sorted(table))
    match draw.randrange(3):
        case 0:
            table[key[:-1] or "x"] = table.pop(key)
        case 1:
            table[draw.choice(TEXTS)] = 1
        case _:
            del table[key]


def break_text(document: Document, draw: random.Random) -> None:
    """Replace a text by an unusual one."""
    found = _pick(document, draw, lambda _, value, __: isinstance(value, str))
    if found is not None:
        put(document, found[0], draw.choice(TEXTS))
    else:
        document["title"] = draw.choice(TEXTS)


def break_list(document: Document, draw: random.Random) -> None:
    """Empty a list, repeat its elements, or drop one."""
    found = _pick(document, draw, lambda _, value, __: isinstance(value, list))
    if found is not None:
        value = found[1]
        put(document, found[0], draw.choice(([], value * 2, value[:-1], value * 40, [value])))


def nest(document: Document, draw: random.Random) -> None:
    """Put a deeply nested value at a location."""
    found = _pick(document, draw, lambda *_: True)
    if found is not None:
        value: Any = 1
        for _ in range(draw.choice((3, 30, 60))):
            value = [value] if draw.random() < 0.5 else {"a": value}
        put(document, found[0], value)


VALID_CHANGES = (
    redraw, redraw, scale, scale, scale, add_key, add_key, add_key, drop_key, set_solver, set_solver, set_world,
    duplicate, duplicate, add_element, add_element, add_joint, add_joint, transplant, transplant, fix, fix,
    put_together, set_count, drop_element, refer,
)  # fmt: skip
INVALID_CHANGES = (break_value, break_value, break_bound, break_bound, break_key, break_text, break_list, nest)
