"""Random values from the JSON Schema of scenes and actions, and the names that a document can refer to."""

import random
from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic import TypeAdapter

from sandbox.action import Action
from sandbox.engines.registry import ENGINES
from sandbox.scene.files.json_schema import schema

Document = dict[str, Any]
Path = tuple[str | int, ...]

SINGLES = ("ball", "box", "capsule", "polygon", "body")
GENERATORS = ("grid", "scatter", "emitter", "stack", "rope", "cloth", "ragdoll")
BODY_KEYS = frozenset({"body", "between", "ball", "toward", "start", "end", "arrows"})


@cache
def scene_schema() -> Document:
    """Return the JSON Schema of scenes."""
    return schema()


@cache
def action_schema() -> Document:
    """Return the JSON Schema of an action."""
    adapter: TypeAdapter[Any] = TypeAdapter(Action)
    return adapter.json_schema()


def resolved(node: Document, value: Any, root: Document) -> Document:
    """Follow references, and choose alternatives by the discriminator or the type of a value."""
    while True:
        if "$ref" in node:
            node = root["$defs"][node["$ref"].rpartition("/")[2]]
        elif "discriminator" in node:
            discriminator = node["discriminator"]
            kind = value.get(discriminator["propertyName"]) if isinstance(value, dict) else None
            options = sorted(discriminator["mapping"].items())
            node = {"$ref": discriminator["mapping"].get(kind if isinstance(kind, str) else None, options[0][1])}
        elif "anyOf" in node:
            fitting = [each for each in node["anyOf"] if _fits(each, value, root)]
            node = (fitting or node["anyOf"])[0]
        else:
            return node


def _fits(node: Document, value: Any, root: Document) -> bool:
    kinds: dict[Any, tuple[type, ...]] = {
        "number": (int, float), "integer": (int,), "string": (str,), "boolean": (bool,), "array": (list,),
        "object": (dict,), "null": (type(None),),
    }  # fmt: skip
    return isinstance(value, kinds.get(resolved(node, value, root).get("type"), (object,)))


def locations(document: Document) -> list[tuple[Path, Any, Document]]:
    """Return every location in a document that is in the schema: its path, value and schema."""
    root = scene_schema()
    found: list[tuple[Path, Any, Document]] = []

    def walk(path: Path, value: Any, node: Document) -> None:
        node = resolved(node, value, root)
        found.append((path, value, node))
        if isinstance(value, dict):
            for key, child in value.items():
                if key in node.get("properties", {}):
                    walk((*path, key), child, node["properties"][key])
        elif isinstance(value, list):
            prefix = node.get("prefixItems", [])
            for k, child in enumerate(value[:50]):
                inner = prefix[k] if k < len(prefix) else node.get("items")
                if isinstance(inner, dict):
                    walk((*path, k), child, inner)

    walk((), document, root)
    return found[1:]


def value_of(node: Document, key: str, document: Document, draw: random.Random, root: Document) -> Any:
    """Draw a value that a schema node allows."""
    if "discriminator" in node:
        kind, reference = draw.choice(sorted(node["discriminator"]["mapping"].items()))
        table = value_of({"$ref": reference}, key, document, draw, root)
        return {**table, node["discriminator"]["propertyName"]: kind}
    if "anyOf" in node:
        options = [each for each in node["anyOf"] if each.get("type") != "null"]
        return value_of(draw.choice(options), key, document, draw, root)
    node = resolved(node, None, root)
    if "const" in node:
        return node["const"]
    if "enum" in node:
        return draw.choice(node["enum"])
    match node.get("type"):
        case "boolean":
            return draw.random() < 0.5
        case "integer":
            return _whole(node, draw)
        case "number":
            return _number(node, draw)
        case "string":
            return _text(node, key, document, draw)
        case "array":
            return _array(node, key, document, draw, root)
        case "object":
            return table_of(node, document, draw, root)
    return draw.choice((0.5, 1, True, "text", [0.0, 1.0]))


def bounds_of(node: Document) -> tuple[float, float]:
    """Return the smallest and largest value that the schema of a number allows."""
    low, high = node.get("minimum", -1e12), node.get("maximum", 1e12)
    if "exclusiveMinimum" in node:
        low = node["exclusiveMinimum"] + (1 if node.get("type") == "integer" else 1e-6)
    if "exclusiveMaximum" in node:
        high = node["exclusiveMaximum"] - 1
    return low, high


def _number(node: Document, draw: random.Random) -> float:
    low, high = bounds_of(node)
    if draw.random() < 0.08:
        bound = draw.choice((low, high))
        return float(bound)
    size = 10.0 ** draw.uniform(-2.0, 1.5) if draw.random() < 0.85 else 10.0 ** draw.uniform(-12.0, 15.0)
    value = size if low >= 0 or draw.random() < 0.5 else -size
    if draw.random() < 0.1:
        value = 0.0
    return float(min(max(value, low), high))


def _whole(node: Document, draw: random.Random) -> int:
    low, high = (int(each) for each in bounds_of(node))
    value = draw.choice((0, 1, 2, 3, 5, 8, 10, 20))
    if draw.random() < 0.04:
        value = draw.choice((1000, 100_000, 1_000_000, high, low))
    return min(max(value, low), high)


def _text(node: Document, key: str, document: Document, draw: random.Random) -> str:
    if node.get("pattern", "").startswith("^#"):
        return draw.choice(("#000000", "#ffffff", "#12abEF"))
    names = names_for(key, document)
    if names and draw.random() < 0.95:
        return draw.choice(names)
    return draw.choice(("new", "new name", "ü", "missing"))


def _array(node: Document, key: str, document: Document, draw: random.Random, root: Document) -> list[Any]:
    if key == "bounds":
        size = draw.choice((0.5, 5.0, 50.0, 1e6))
        return [[-size, -size], [size, 2.0 * size]]
    if "prefixItems" in node:
        return [value_of(each, key, document, draw, root) for each in node["prefixItems"]]
    low, high = node.get("minItems", 0), node.get("maxItems", 10**6)
    count = min(max(draw.choice((0, 1, 2, 2, 3, 4)), low), high)
    return [value_of(node.get("items", {}), key, document, draw, root) for _ in range(count)]


def table_of(node: Document, document: Document, draw: random.Random, root: Document) -> Document:
    """Draw a table: all required keys and a few optional ones."""
    table: Document = {}
    properties = node.get("properties", {})
    optional = [key for key in properties if key not in node.get("required", []) and can_be_added(key, document)]
    chosen = set(draw.sample(optional, min(len(optional), draw.choice((0, 1, 1, 2, 3)))))
    for key, inner in properties.items():
        if key == "name":
            if draw.random() < 0.5:
                table[key] = f"new-{draw.randrange(1000)}"
        elif key in node.get("required", []) or key in chosen:
            table[key] = value_of(inner, key, document, draw, root)
    return table


def can_be_added(key: str, document: Document) -> bool:
    """Return whether a document has names that a key can refer to."""
    return key not in ("material", "pair") or bool(names_of(document, "material"))


def bodies_of(document: Document) -> list[str]:
    """Return the names of the bodies of a document, for generators only the first few."""
    names = []
    for kind in SINGLES:
        names += [each.get("name", f"{kind}-{k + 1}") for k, each in tables(document, kind)]
    for kind in GENERATORS:
        stems = [each.get("name", f"{kind}-{k + 1}") for k, each in tables(document, kind)]
        names += [f"{stem}-{n}" for stem in stems for n in (1, 2, 3)]
    if "pinball" in document:
        names += ["ball", "ball-1"]
    if "billiards" in document:
        names += ["cue", "1", "9", "object"]
    return [name for name in names if isinstance(name, str)]


def names_of(document: Document, *kinds: str) -> list[str]:
    """Return the names of the elements of these kinds in a document."""
    names = [each.get("name", f"{kind}-{k + 1}") for kind in kinds for k, each in tables(document, kind)]
    return [name for name in names if isinstance(name, str)]


def names_for(key: str, document: Document) -> list[str]:
    """Return the names that are valid values of a key."""
    if key in BODY_KEYS:
        return bodies_of(document)
    if key == "material":
        return names_of(document, "material")
    if key in ("layer", "layers", "to_layer"):
        return ["ground", "ramp", "upper"]
    if key in ("generator", "relaunch"):
        return names_of(document, *GENERATORS)
    if key == "thing":
        return names_of(document, "wall", "post", "plane", "zone", "sensor")
    if key in ("thrust", "drive"):
        return names_of(document, key)
    if key == "engine":
        return list(ENGINES)
    return ["start", "end"] if key == "fix" else []


def tables(document: Document, kind: str) -> Iterator[tuple[int, Document]]:
    """Yield the elements of one kind that are tables, with their indices."""
    elements = document.get(kind)
    if isinstance(elements, list):
        yield from ((k, each) for k, each in enumerate(elements) if isinstance(each, dict))
