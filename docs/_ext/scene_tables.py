"""Tables of the keys of a scene file, from its JSON Schema."""

import re
from collections.abc import Iterator
from typing import Any

from sandbox.scene.files.json_schema import schema

Node = dict[str, Any]
"""A JSON Schema."""

UNITS = (
    "m", "m/s", "m/s²", "s", "s/m", "1/s", "1/m", "Hz", "rad", "rad/s", "rad/s²", "kg", "kg/m²", "kg·m²", "N", "N·m",
    "N·s", "N·m/rad", "N·m·s/rad", "N/m", "N·s/m", "N·m·s", "N/rad", "m³/s²", "degrees", "°",
)  # fmt: skip
"""Units that descriptions state, as a clause of their own or at the beginning of one."""

COORDINATE = "−1e16 … 1e16"
"""The range of coordinates, which are in m; nothing else has it."""

HEADING = {1: "###", 2: "####"}
"""by the number of names in a table's path"""


def scene_tables(*names: str) -> str:
    """Return headings, descriptions and key tables of some tables, each followed by those within it."""
    whole = schema()
    done: set[str] = set()
    parts: list[str] = []
    for name in names:
        parts += _table(whole, (name,), whole["properties"][name], done)
    return "\n\n".join(parts)


def scene_overview() -> str:
    """Return one line for each table at the top level of a scene file."""
    whole = schema()
    rows = ["| table | holds |", "|---|---|"]
    for name, node in whole["properties"].items():
        found = tables_of(whole, node)
        if found:
            about = (found[0] if len(found) == 1 else node).get("description", "").partition("\n\n")[0]
            rows.append(f"| [`{_brackets((name,), node)}`](#scene-{slug((name,))}) | {cell(about)} |")
    return "\n".join(rows)


def top_keys() -> str:
    """Return the keys of a scene file that stand in no table."""
    whole = schema()
    plain = {key: node for key, node in whole["properties"].items() if not tables_of(whole, node)}
    return keys_table(whole, (), {"properties": plain})


def tables_of(whole: Node, node: Node) -> list[Node]:
    """Return the tables that a value may be, or consists of."""
    node = _resolved(whole, node)
    if "properties" in node:
        return [node]
    inner = [*node.get("anyOf", ()), *node.get("oneOf", ()), *([node["items"]] if "items" in node else ())]
    return [table for each in inner for table in tables_of(whole, each)]


def slug(path: tuple[str, ...], kind: str = "") -> str:
    """Return the anchor of a table."""
    return "-".join([*path, *([kind] if kind else [])]).replace("_", "-")


def _table(whole: Node, path: tuple[str, ...], node: Node, done: set[str]) -> Iterator[str]:
    """Yield the parts of a page about a table: one heading for each kind, and those of the tables within it."""
    found = tables_of(whole, node)
    if len(found) > 1:
        yield _heading(path, _brackets(path, node), slug(path))
        yield _prose(node.get("description", ""))
    for table in found:
        kind = _kinds(table)
        if len(found) > 1:
            kinds = " or ".join(f"`{each}`" for each in kind)
            yield f"(scene-{slug(path, kind[0])})=\n#### `{_brackets(path, node)}` kind {kinds}"
        else:
            yield _heading(path, _brackets(path, node), slug(path))
        yield _prose(table.get("description", ""))
        anchor = (*path, kind[0]) if len(found) > 1 else path
        yield keys_table(whole, anchor, table)
        for key, each in table["properties"].items():
            inner = tables_of(whole, each)
            title = inner[0].get("title", key) if inner else ""
            if inner and title not in done:
                done.add(title)
                yield from _table(whole, (*path, key), each, done)


def _heading(path: tuple[str, ...], brackets: str, anchor: str) -> str:
    return f"(scene-{anchor})=\n{HEADING[min(len(path), 2)]} `{brackets}`"


def _brackets(path: tuple[str, ...], node: Node) -> str:
    name = ".".join(path)
    return f"[[{name}]]" if node.get("type") == "array" else f"[{name}]"


def _kinds(table: Node) -> list[str]:
    kind = table["properties"].get("kind", {})
    return list(kind.get("enum", [kind["const"]] if "const" in kind else []))


def keys_table(whole: Node, path: tuple[str, ...], table: Node) -> str:
    """Return a table of the keys of a table of the schema, with an anchor each."""
    rows = ["| key | value | unit | default | description |", "|---|---|---|---|---|"]
    for key, node in table["properties"].items():
        rows.append(f"| {' | '.join(_row(whole, path, key, node, key in table.get('required', ())))} |")
    return "\n".join(rows)


def _row(whole: Node, path: tuple[str, ...], key: str, node: Node, required: bool) -> tuple[str, ...]:
    anchor = "-".join(("key", *path, key))
    description = node.get("description") or next((t.get("description", "") for t in tables_of(whole, node)), "")
    default = "required" if required else _default(node.get("default"))
    value = _escaped(_value(whole, node))
    unit = _unit(description) or ("m" if COORDINATE in value else "")
    return f"`{key}`{{#{anchor}}}", value, unit, default, cell(description.partition("\n\n")[0])


def _default(value: object) -> str:
    if value is None:
        return "–"
    if isinstance(value, list):
        return f"`[{', '.join(str(_plain(each)) for each in value)}]`"
    return f"`{_plain(value)}`"


def _plain(value: object) -> object:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    return f"{value:g}" if isinstance(value, float) else value


def _unit(description: str) -> str:
    """Return the unit that a description states: a clause of its own, or the first word of one."""
    clauses = [clause.strip(" .") for clause in re.split(r"[,;:(]|\. ", description.split("\n\n")[0])]
    for clause in clauses:
        if clause in UNITS:
            return clause
    for clause in clauses:
        word = clause.partition(" ")[0]
        if word in UNITS:
            return word
    last = next((clause.rpartition(" ")[2] for clause in clauses if clause.rpartition(" ")[2] in UNITS), "")
    return last if last not in {"m", "s", "N", "kg"} else ""


def _value(whole: Node, node: Node) -> str:
    """Return in words what a value may be, with its range."""
    node = _resolved(whole, node)
    if "properties" in node:
        return "table"
    if "enum" in node or "const" in node:
        return " · ".join(f"`{_plain(each)}`" for each in node.get("enum", [node.get("const")]))
    forms = [*node.get("anyOf", ()), *node.get("oneOf", ())]
    if forms:
        return " or ".join(dict.fromkeys(_value(whole, each) for each in forms))
    if node.get("type") == "array":
        return _array(whole, node)
    if node.get("type") == "object":
        return "table of names and values"
    if node.get("type") == "string":
        return _text(node)
    word = {"number": "number", "integer": "integer", "boolean": "`true` · `false`"}.get(str(node.get("type")), "value")
    return f"{word}{_range(node)}"


def _array(whole: Node, node: Node) -> str:
    if "prefixItems" in node:
        items = [_value(whole, each) for each in node["prefixItems"]]
        first, comma, bounds = items[0].partition(", ")
        if comma and len(set(items)) == 1 and not first.startswith("["):
            return f"[{', '.join([first] * len(items))}], each {bounds}"
        return f"[{', '.join(items)}]"
    of = _value(whole, node["items"])
    if of == "table":
        return "tables"
    low, high = node.get("minItems", 0), node.get("maxItems")
    count = f"{low:,}" if low == high else f"{low:,} or more" if high is None else f"{low:,} … {high:,}"
    return f"array of {count} × {of}" if low or high else f"array of {of}"


def _text(node: Node) -> str:
    pattern = node.get("pattern", "")
    if "#[0-9a-fA-F]" in pattern:
        return 'text `"#rrggbb"`'
    low, high = node.get("minLength"), node.get("maxLength")
    return "text" if high is None else f"text, {low or 0:,} … {high:,} characters"


def _range(node: Node) -> str:
    low, high = node.get("minimum"), node.get("maximum")
    above, below = node.get("exclusiveMinimum"), node.get("exclusiveMaximum")
    if low is not None and high is not None:
        return f", {_number(low)} … {_number(high)}"
    bounds = [(low, "≥"), (above, ">"), (high, "≤"), (below, "<")]
    stated = [f"{sign} {_number(bound)}" for bound, sign in bounds if bound is not None]
    return f", {', '.join(stated)}" if stated else ""


def _number(value: float) -> str:
    if value == 2**63:
        return "2⁶³"
    text = f"{value:,}" if isinstance(value, int) and abs(value) < 1e9 else f"{value:g}"
    return re.sub(r"e([+-])0*", lambda sign: f"e{sign[1].strip('+')}", text).replace("-", "−")


def _resolved(whole: Node, node: Node) -> Node:
    return whole["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node


def _escaped(text: str) -> str:
    return re.sub(r"\[(?=number|integer|text|\[)", r"\\[", text)


def cell(text: str) -> str:
    """Return a description as a cell of a Markdown table: brackets outside code would be links."""
    text = " ".join(text.split()).replace("|", "\\|")
    return "".join(part if part.startswith("`") else part.replace("[", "\\[") for part in re.split(r"(`[^`]*`)", text))


def _prose(text: str) -> str:
    """Return a description as paragraphs."""
    return "\n\n".join(cell(paragraph).replace("\\|", "|") for paragraph in text.split("\n\n"))
