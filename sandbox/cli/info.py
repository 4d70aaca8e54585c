"""Commands `scenes`, `engines` and `schema`."""

import difflib
import json
import tomllib
from pathlib import Path
from typing import Any

import click

from sandbox.cli.options import json_option
from sandbox.cli.streams import print_json
from sandbox.cli.tables import new_table, print_descriptions, print_folded_table, print_item, print_line, terminal_width
from sandbox.echo import MAX_NAMED, short_repr, shorten
from sandbox.scene.files.shipped_scenes import SCHEMA, shipped


@click.command(name="engines")
@json_option
def engines_command(as_json: bool) -> int:
    """List the engines and the physics that each models."""
    from sandbox.engines.registry import ENGINES  # imports numpy, which `scenes` does not need

    rows = [{"name": e.name, "about": e.about, "models": sorted(map(str, e.capabilities))} for e in ENGINES.values()]
    if as_json:
        print_json({"engines": rows})
        return 0
    print_descriptions({e.name: f"{e.about}; models {', '.join(sorted(e.capabilities))}" for e in ENGINES.values()})
    return 0


@click.command(name="scenes")
@json_option
def scenes_command(as_json: bool) -> int:
    """List the shipped scenes: name, title, and what to observe."""
    rows = []
    for scene in shipped():
        document = tomllib.loads(scene.path.read_text(encoding="utf-8"))
        rows.append({"name": scene.name, "title": document["title"], "about": document["about"]})
    if as_json:
        print_json({"scenes": rows})
        return 0
    print_descriptions({row["name"]: f"{row['title']}. {row['about']}" for row in rows})
    return 0


Node = dict[str, Any]
"""A JSON Schema."""


@click.command(name="schema")
@click.argument("table", required=False)
@click.option(
    "--json", "as_json", is_flag=True, help="print TABLE as JSON Schema too; without TABLE the output is always JSON"
)
@click.option(
    "--install",
    "place",
    metavar="PATH",
    help="write the JSON Schema into a folder, or beside a scene file, and print the line that lets editors find it",
)
def schema_command(table: str | None, as_json: bool, place: str | None) -> int:
    """Print the keys of a table of the scene file, or the JSON Schema of the whole file.

    TABLE is the name of a table, such as ball, solver, joint, body.box or pinball.bumper. Without it, the JSON Schema
    is printed, for editors and other programs.
    """
    from sandbox.scene.files.json_schema import dumps, schema  # imports the whole scene

    if place is not None:
        if table is not None or as_json:
            raise click.UsageError("--install writes the schema of the whole file; use it without TABLE and --json")
        if not place:  # an empty path would be the working folder
            raise click.BadParameter("names no folder or scene file", param_hint="--install")
        return _install(dumps(), Path(place))
    if table is None:
        click.echo(dumps(), nl=False)
        return 0
    root = schema()
    found = _find(root, table.strip("[]"))
    if as_json:
        one = found[0] if len(found) == 1 else {"oneOf": found}
        print_json({"$schema": root["$schema"], **one, "$defs": root["$defs"]})
        return 0
    for node in found:
        _print_table(root, table, node)
    return 0


def _install(text: str, place: Path) -> int:
    """Write the schema into a folder, or beside a scene file, and print the first line that a scene there needs."""
    from sandbox.atomic_write import atomic_write
    from sandbox.cli.common import reasons_not_writable  # imports numpy, which `scenes` does not need

    try:
        folder = place if place.is_dir() else place.parent
        is_missing = folder is not place and not place.is_file()
    except (OSError, ValueError) as error:  # a name that is too long, or with a null character
        reason = error.strerror if isinstance(error, OSError) else str(error)
        click.echo(f"--install: {shorten(str(place), MAX_NAMED)}: {reason}", err=True)
        return 2
    target = folder / SCHEMA
    reasons = ["there is no such folder or scene file"] if is_missing else reasons_not_writable(target)
    if not reasons:
        try:
            with atomic_write(target) as temporary:
                temporary.write_text(text, encoding="utf-8", newline="\n")
        except OSError as error:
            reasons = [error.strerror or str(error)]
    if reasons:
        click.echo(f"--install: {shorten(str(place), MAX_NAMED)}: {reasons[0]}", err=True)
        return 2
    line = f"#:schema {SCHEMA}"
    click.echo(f"written: {target}")
    if place.is_file() and place.read_bytes().startswith(line.encode()):
        click.echo(f"{place.name} begins with `{line}` already")
    else:
        click.echo(f"first line of {'the scene files there' if place.is_dir() else place.name}: {line}")
    return 0


def _find(root: Node, path: str) -> list[Node]:
    """Return the tables at a path: one, or several kinds of joints or drives.

    Raises:
        click.UsageError: there is no table at the path.
    """
    tables = [root]
    for part in path.split("."):
        nested = _nested(root, part) if tables == [root] and part not in root["properties"] else []
        if nested:
            tables = nested
            continue
        known = dict.fromkeys(key for node in tables for key in node.get("properties", {}))
        if part not in known:
            close = difflib.get_close_matches(part, known, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"known keys: {', '.join(known)}"
            raise click.UsageError(f"{short_repr(path)}: no key {short_repr(part)}; {hint}")
        inner = (node["properties"][part] for node in tables if part in node.get("properties", {}))
        tables = list({node.get("title", ""): node for each in inner for node in _tables(root, each)}.values())
        if not tables:
            raise click.UsageError(f"{short_repr(path)}: {short_repr(part)} is a value, not a table")
    return tables


def _nested(root: Node, name: str) -> list[Node]:
    """Return the distinct tables of a name that are keys of other tables, such as kick."""
    within = (node["properties"][name] for node in root["$defs"].values() if name in node.get("properties", {}))
    return list({node.get("title", ""): node for each in within for node in _tables(root, each)}.values())


def _tables(root: Node, node: Node) -> list[Node]:
    """Return the tables that a value may be, or that its elements may be."""
    if "$ref" in node:
        node = root["$defs"][node["$ref"].rpartition("/")[2]]
    if "properties" in node:
        return [node]
    inner = [*node.get("anyOf", ()), *node.get("oneOf", ()), *([node["items"]] if "items" in node else ())]
    return [table for each in inner for table in _tables(root, each)]


def _print_table(root: Node, name: str, node: Node) -> None:
    """Print the keys of a table, one per line: type and range, default, description."""
    from rich.text import Text

    kinds = _kinds(node)
    about = _line(node.get("description", "").partition("\n\n")[0])
    print_line(f"{name}{f', kind {kinds}' if kinds else ''}: {about}".rstrip(": "))
    table = new_table()
    rows = []
    for key, each in node["properties"].items():
        needed = "required" if key in node.get("required", ()) else json.dumps(each.get("default"))
        default = "–" if needed == "null" else needed
        rows.append((key, _value(root, each), default, _line(each.get("description", ""))))
    if (terminal_width() or WIDE) < WIDE:
        for key, value, default, description in rows:
            print_line(f"{key}: {value}" + ("" if default == "–" else f"; {default}"))
            print_item(description, "    ")
        return
    for k, head in enumerate(("key", "value", "default", "")):
        longest = max((len(word) for row in rows for word in row[k].split()), default=0)
        table.add_column(head, no_wrap=head == "key", min_width=longest)
    for row in rows:
        table.add_row(*map(Text, row))
    print_folded_table(table)


WIDE = 100
"""Columns of a terminal that has room for a table of keys; on a narrower one each key is a paragraph"""
LARGE = 1e5
"""Bounds beyond this, or below its reciprocal, only protect the engines from extreme values, and are not printed."""


def _line(text: str) -> str:
    return " ".join(text.split())


def _kinds(node: Node) -> str:
    kind = node["properties"].get("kind", {})
    return " or ".join(kind.get("enum", [kind["const"]] if "const" in kind else []))


def _value(root: Node, node: Node) -> str:
    """Return the type and range of a value in words."""
    if "$ref" in node:
        node = root["$defs"][node["$ref"].rpartition("/")[2]]
    if "properties" in node:
        return "table"
    if "enum" in node or "const" in node:
        return " · ".join(map(str, node.get("enum", [node.get("const")])))
    forms = [*node.get("anyOf", ()), *node.get("oneOf", ())]
    if forms:
        return " or ".join(dict.fromkeys(_value(root, each) for each in forms))
    if node.get("type") == "array":
        if "prefixItems" in node:
            return f"[{', '.join(_value(root, each) for each in node['prefixItems'])}]"
        element = _value(root, node["items"])
        return "tables" if "table" in element else f"array of {element}"
    low, high = (node.get(f"{end}imum", node.get(f"exclusive{end.capitalize()}imum")) for end in ("min", "max"))
    words = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false"}
    word = words.get(str(node.get("type")), str(node.get("type", "value")))
    low, high = (None if bound is None or abs(bound) >= LARGE else bound for bound in (low, high))
    if low is not None and 0 < low < 1 / LARGE:
        low, word = None, f"{word} > 0"
    if low is not None:
        return f"{word} ≥ {low:g}" if high is None else f"{word} {low:g} … {high:g}"
    return word if high is None else f"{word} ≤ {high:g}"
