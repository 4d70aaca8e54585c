"""Random actions that refer to names of a scene document."""

import copy
import random
from typing import Any

from sandbox.action import SPAWNED
from sandbox.engines.registry import ENGINES
from tools.fuzzing.scene_changes import NUMBERS, OTHERS, TEXTS, shift
from tools.fuzzing.schema_values import (
    SINGLES,
    Document,
    action_schema,
    bodies_of,
    names_for,
    names_of,
    resolved,
    scene_schema,
    table_of,
    tables,
    value_of,
)

FREQUENT = ("remove", "remove", "switch", "switch", "launch", "spawn", "strike", "strike", "throttle", "drive", "drive")
"""Actions that are drawn more often: those that restart an engine, and those that apply to few scenes."""


def actions(document: Document, draw: random.Random) -> list[Any]:
    """Draw up to six actions that refer to names of a document, at increasing times."""
    dt = document.get("solver", {})
    dt = dt.get("dt", 0.01) if isinstance(dt, dict) else 0.01
    dt = dt if isinstance(dt, float) and 1e-9 <= dt <= 10 else 0.01
    drawn, step = [], 0
    for _ in range(draw.choice((1, 2, 3, 4, 6))):
        step += draw.choice((0, 0, 1, 2, 4))
        drawn.append(_action(document, step * dt * draw.choice((1.0, 1.0, 1.5)), draw))
    return drawn


def _action(document: Document, time: float, draw: random.Random) -> Any:
    root = action_schema()
    kinds = sorted(root["discriminator"]["mapping"])
    usable = [kind for kind in [*kinds, *FREQUENT] if _has_subject(kind, document)]
    kind = draw.choice(usable if draw.random() < 0.95 else kinds)
    node = resolved({"$ref": root["discriminator"]["mapping"][kind]}, None, root)
    action: Document = table_of(node, document, draw, root) | {"kind": kind, "time": time}
    match kind:
        case "remove" if draw.random() < 0.5:
            action["body"] = draw.choice(_referenced(document) or bodies_of(document) or ["missing"])
        case "spawn":
            action = {"kind": kind, "time": time, **_spawned(document, draw)}
        case "set":
            action |= _setting(document, draw)
        case "switch":
            action["engine"] = draw.choice(list(ENGINES))
            action["settings"] = _changed_settings(document, draw) if draw.random() < 0.3 else {}
        case "move" if draw.random() < 0.5:
            action["position"] = [draw.uniform(-3.0, 3.0), draw.uniform(-1.0, 5.0)]
    if draw.random() < 0.05:
        key = draw.choice(sorted(action))
        action[key] = copy.deepcopy(draw.choice((*NUMBERS[:-4], *OTHERS, *TEXTS)))
    return action


def _referenced(document: Document) -> list[str]:
    """Return the bodies that joints, attractions, thrusts and drives of a document refer to."""
    found: list[str] = []
    for kind in ("joint", "attraction", "thrust", "drive"):
        for _, each in tables(document, kind):
            between = each.get("between", [])
            found += between if isinstance(between, list) else []
            found += [each[key] for key in ("toward", "body") if key in each]
    return [name for name in found if isinstance(name, str)]


def _has_subject(kind: str, document: Document) -> bool:
    needed = {"launch": "generator", "throttle": "thrust", "drive": "drive", "toggle": "thing", "reshape": "thing"}
    if kind == "strike":
        return "surface" in document or "billiards" in document
    return kind not in needed or bool(names_for(needed[kind], document))


def _spawned(document: Document, draw: random.Random) -> Document:
    """Draw a shape; often a shifted copy of one in the scene."""
    root = scene_schema()
    existing = [(kind, each) for kind in SPAWNED for _, each in tables(document, kind)]
    if existing and draw.random() < 0.6:
        kind, shape = copy.deepcopy(draw.choice(existing))
        shape["name"] = f"spawned-{draw.randrange(100)}"
        if draw.random() < 0.8:
            shift(shape, draw.uniform(-5.0, 5.0))
        return {kind: shape}
    kind = draw.choice(SPAWNED)
    return {kind: value_of(root["properties"][kind]["items"], kind, document, draw, root)}


def _setting(document: Document, draw: random.Random) -> Document:
    """Draw a path that may be set in a running scene, and a value."""
    if draw.random() < 0.6:
        path = draw.choice(("world.gravity", "world.wind", "world.linear_drag", "world.quadratic_drag", "world.damping",
                            "surface.sliding_friction", "surface.curl"))  # fmt: skip
    else:
        kind = draw.choice((*SINGLES, "wall", "plane", "grid", "material", "nothing"))
        name = draw.choice([*names_of(document, kind), "*", "0"])
        path = f"{kind}.{name}.{draw.choice(('friction', 'restitution', 'mass'))}"
    value: Any = draw.choice((0.0, 0.5, 1, 1.0, 1000.0, -1.0))
    if path in ("world.gravity", "world.wind"):
        value = [draw.choice((0.0, -9.81, 1e9, 5.0)), draw.choice((0.0, -9.81, 1e3))]
    return {"path": path, "value": value}


def _changed_settings(document: Document, draw: random.Random) -> Document:
    root = scene_schema()
    settings = root["$defs"]["Settings"]["properties"]
    chosen = draw.sample(sorted(settings), draw.choice((1, 2)))
    return {key: value_of(settings[key], key, document, draw, root) for key in chosen}
