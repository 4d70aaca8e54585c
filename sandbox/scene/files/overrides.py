"""Overrides: any value of a scene by its path, as in `--set` and sweeps.

`solver.dt` · `world.gravity` · `ball.cue.velocity` · `ball.0.radius` · `ball."8 ball".mass` · `ball.*.restitution` ·
`pinball.bumper.*.speed`. An element of a list is addressed by its `name`, by its index from 0 or, without a name, by
the default name that messages and tables use: `joint.joint-1.stiffness` is of the first joint. `*` addresses all
elements, unless one is named so. Indices may be in brackets, as in faults: `drive[0].rate`, `ball.cue.velocity[1]`. A
name that itself ends in brackets must be quoted.
"""

import copy
import difflib
import math
import re
import tomllib
from collections.abc import Sequence
from itertools import product
from typing import Any

from pydantic import BaseModel

from sandbox.echo import MAX_NAMED, short_count, short_repr, shorten
from sandbox.resource_limits import RUNS
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.scene import default_name
from sandbox.scene.errors import Location, quoted
from sandbox.scene.files.document import MAX_DEPTH, TAGGED, check_text, keys_of, list_tables, model_at, to_json

EVERY = "*"

MAX_PATH = 1000
"""Largest number of characters of a path: several times that of the longest names."""

_NUMBERED = re.compile(r"(.*?)((?:\[[0-9]+\])+)", re.DOTALL)


class AddressError(ValueError):
    """A path or value of an override is invalid; `str()` gives the reason and a remedy."""


def parse_assignment(text: str) -> tuple[str, Any]:
    """Split `KEY=VALUE`; the value is TOML, and any other text is a string.

    Raises:
        AddressError: there is no `=`, or no key before it.
    """
    key, equals, value = split_assignment(text)
    if not equals or not key.strip():
        raise AddressError(f"{short_repr(text)} is not KEY=VALUE, such as solver.dt=0.001 or ball.cue.velocity=[1,0]")
    return key.strip(), parse_value(value.strip())


def split_assignment(text: str) -> tuple[str, str, str]:
    """Split `KEY=VALUE` at the first `=` outside quotes into key, `=` and value."""
    quote = before = ""
    for k, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'" and before in ("", "."):  # as in paths: only at the start of a part
            quote = letter
        elif letter == "=":
            return text[:k], "=", text[k + 1 :]
        before = before if letter.isspace() else letter
    return text, "", ""


def parse_value(text: str) -> Any:
    """Read a TOML value; any other text, or one nested too deeply, is a string."""
    try:
        check_text(text)
        document = tomllib.loads(f"value = {text}")
    except ValueError:  # also an integer of thousands of digits
        return text
    return document["value"] if set(document) == {"value"} else text


def parse_path(path: str) -> tuple[str, ...]:
    """Split a dotted path; quotes group characters as in TOML, and an index in brackets is a part of its own.

    Raises:
        AddressError: the path is malformed.
    """
    if len(path) > MAX_PATH:  # the parser takes quadratic time
        raise AddressError(
            f"{short_repr(path)} is too long for a path: {len(path):,} characters, the limit is {MAX_PATH:,}"
        )
    parts: list[str] = []
    rest = path
    while True:
        if rest[:1] in ('"', "'"):
            end = rest.find(rest[0], 1)
            if end < 0:
                raise AddressError(f"{short_repr(path)}: a quote is not closed")
            part, numbers, rest = rest[1:end], "", rest[end + 1 :]
        else:
            part, dot, after = rest.partition(".")
            numbered = _NUMBERED.fullmatch(part)
            part, numbers = numbered.groups() if numbered else (part, "")
            rest = dot + after
        if not part:
            raise AddressError(f"{short_repr(path)} is not a path, such as solver.dt or ball.cue.velocity")
        parts += [part, *numbers[1:-1].split("][")] if numbers else [part]
        if len(parts) > MAX_DEPTH:
            raise AddressError(f"{short_repr(path)} is not a path: it has more than {MAX_DEPTH} parts")
        if not rest:
            return tuple(parts)
        if rest[0] != ".":
            raise AddressError(f"{short_repr(path)}: a dot is missing after {short_repr(part)}")
        rest = rest[1:]


def assign(document: dict[str, Any], path: str, value: Any) -> tuple[dict[str, Any], Location]:
    """Return a copy of a scene document with one value set, and the location that was set.

    For `*` the location is that of the list.

    Raises:
        AddressError: the path does not exist.
    """
    parts = parse_path(path)
    result = copy.deepcopy(document)
    return result, assign_all(result, parts, shorten(path, MAX_NAMED), value)


def assign_all(result: Any, parts: tuple[str, ...], path: str, value: Any) -> Location:
    """Set a value in place at every element that a path addresses, and return the location."""
    if EVERY not in parts[1:-1]:
        return _assign(result, parts, path, value)
    k = parts.index(EVERY, 1)
    elements, location = _value_at(result, parts[:k])
    if not isinstance(elements, list) or EVERY in _names(elements):
        return _assign(result, parts, path, value)
    if not elements:
        raise AddressError(f"{path}: the scene has no [[{'.'.join(parts[:k])}]]")
    for element in elements:
        assign_all(element, parts[k + 1 :], path, value)
    return location


def _value_at(value: Any, parts: tuple[str, ...]) -> tuple[Any, Location]:
    """Return the value at a path and its location; None if the path does not exist."""
    location: Location = ()
    for part in parts:
        key: str | int = part
        if isinstance(value, list):
            try:
                key = index_of(value, parts[: len(location) + 1], "")
            except AddressError:
                return None, ()
        elif not isinstance(value, dict) or part not in value:
            return None, ()
        value, location = value[key], (*location, key)
    return value, location


def _assign(result: Any, parts: tuple[str, ...], path: str, value: Any) -> Location:
    """Set a value in place and return its location."""
    container: Any = result
    location: Location = ()
    for k, part in enumerate(parts):
        last = k == len(parts) - 1
        if isinstance(container, dict):
            if not last and part not in container:
                if k == 0 and _is_list(part):
                    raise AddressError(f"{path}: the scene has no [[{part}]]")
                hint = _hint(container, parts[k:])
                if k > 0 and k == len(parts) - 2 and parts[-1].isdecimal() and part in _keys(location):
                    array = ".".join(parts[: k + 1])
                    raise AddressError(f"{path}: the scene has no {array}; set all of it, {array}=…")
                if k > 0 or len(parts) != 2 or "an element" in hint:
                    raise AddressError(f"{path}: the scene has no {'.'.join(parts[: k + 1])}{hint}")
                container[part] = {}
            location += (part,)
            if last:
                container[part] = value
            else:
                container = container[part]
        elif isinstance(container, list):
            index = index_of(container, parts[: k + 1], path)
            location += (index,)
            if last:
                container[index] = value
            else:
                container = container[index]
        else:
            raise AddressError(f"{path}: {'.'.join(parts[:k])} is a single value without a {short_repr(part)}")
    return location


def index_of(elements: list[Any], parts: tuple[str, ...], path: str) -> int:
    """Return the index of the list element that the last part of a path names or numbers."""
    part, kind = parts[-1], next((each for each in reversed(parts[:-1]) if not each.isdecimal()), "")
    names = element_names(elements, kind)
    if part in names:
        return names.index(part)
    if part.isdecimal() and len(part) < 10 and int(part) < len(elements):
        return int(part)
    before = ".".join(parts[:-1])
    if any(isinstance(e, dict) and part in e for e in elements) or part in _keys(parts[:-1]):
        remainder = path[len(before) :].lstrip(".")
        named = f", such as {before}.{quoted(names[0] or '0')}.{remainder}," if elements else ""
        raise AddressError(f"{path}: {before} is a list; name an element{named} or use {before}.*.{remainder} for all")
    known_names = [name for name in names if name is not None]
    generator = next((name for name in known_names if part.startswith(f"{name}-")), None)
    if generator is not None:
        raise AddressError(
            f"{path}: {short_repr(part)} is made by the generator {before}.{quoted(generator)}; set a key of that"
        )
    close = difflib.get_close_matches(part, known_names, n=1)
    if close:
        raise AddressError(f"{path}: no element {short_repr(part)}; did you mean {short_repr(close[0])}?")
    known = f"names: {', '.join(known_names[:10])}; " if known_names else ""
    numbers = "none" if not elements else "0" if len(elements) == 1 else f"0 to {len(elements) - 1}"
    raise AddressError(f"{path}: no element {short_repr(part)}; {known}numbers: {numbers}")


def element_names(elements: list[Any], kind: str) -> list[str | None]:
    """Return the name of each element of a list, by default its kind and number; None if it has none.

    Of two elements of one name only the first has it.
    """
    names: list[str | None] = []
    stated = {e["name"] for e in elements if isinstance(e, dict) and isinstance(e.get("name"), str)}
    for k, element in enumerate(elements):
        name = element.get("name", default_name(kind, k)) if isinstance(element, dict) else None
        is_free = isinstance(name, str) and name not in names and ("name" in element or name not in stated)
        names.append(name if is_free else None)
    return names


def _keys(location: Location) -> list[str]:
    """Return the keys of the table at a location; empty if there is no such table."""
    if len(location) == 1 and location[0] in TAGGED:  # tables with a `kind`
        return [key for model in TAGGED[str(location[-1])][0].values() for key in keys_of(model)]
    try:
        return keys_of(model_at(location))
    except (KeyError, StopIteration):
        return []


def _is_list(table: str) -> bool:
    """Return whether a table may occur several times."""
    return table in list_tables()


def _hint(document: Any, parts: tuple[str, ...]) -> str:
    """Return a hint for a path whose first part is no table: the element of that name, or a similar table."""
    if not isinstance(document, dict):
        return ""
    for kind, elements in document.items():
        for name in element_names(elements, kind) if isinstance(elements, list) else ():
            if name is not None and (parts[0] == name or parts[0].startswith(f"{name}-")):
                part = "" if parts[0] == name else "part of "
                return f"; that is {part}an element: {'.'.join((kind, quoted(name), *parts[1:]))}"
    close = [] if parts[0] in _keys(()) else difflib.get_close_matches(parts[0], document, n=1)
    return f"; did you mean {'.'.join((*close, *parts[1:]))}?" if close else ""


def elements_hint(document: dict[str, Any], parts: tuple[str, ...]) -> str:
    """Return a hint for a path into a preset: elements of the expanded document that it may mean.

    These have the key of the path, and the most matches of their names with parts of the path, exact or similar;
    without a match, some elements that have the key.
    """
    words = [part for part in parts[1:-1] if not part.isdecimal() and part != EVERY]
    named = [
        (name, f"{kind}.{quoted(name)}.{parts[-1]}")
        for kind, elements in document.items()
        if isinstance(elements, list) and parts[-1] in _keys((kind, 0))
        for name in element_names(elements, kind)
        if name is not None
    ]
    similar = {part: difflib.get_close_matches(part, [name for name, _ in named]) for part in words}
    shared = [sum(part in name or name in similar[part] for part in words) for name, _ in named]
    found = [path for (_, path), count in zip(named, shared, strict=True) if 0 < count == max(shared)]
    if found:
        return f"; did you mean {' or '.join(found[:5])}?"
    return f"; examples: {', '.join(path for _, path in named[:5])}" if named else ""


def _names(elements: list[Any]) -> list[Any]:
    return [e.get("name") for e in elements if isinstance(e, dict)]


def combinations(axes: Sequence[tuple[str, Sequence[Any]]], seeds: int = 1) -> list[tuple[tuple[str, Any], ...]]:
    """Return the assignments of each combination of swept values; the last key varies fastest.

    Args:
        axes: keys and their values; without any there is one empty combination.
        seeds: number of seeds of each combination; they count towards the limit.

    Raises:
        AddressError: there are more runs than the limit.
    """
    count = math.prod(len(values) for _, values in axes) * seeds
    if count > RUNS.value:
        factors = "sweeps and seeds multiply" if seeds > 1 else "sweeps multiply"
        raise AddressError(f"{factors} to {short_count(count)} runs; {RUNS.remedy(count)}")
    keys = [key for key, _ in axes]
    return [tuple(zip(keys, values, strict=True)) for values in product(*(values for _, values in axes))]


_FIELDS = {field.alias or name: name for name, field in Scene.model_fields.items()}
"""Field name of a scene by the heading of its table."""


def change_value(scene: Scene, path: str, value: Any) -> Scene:
    """Return a scene with one value changed; only the part that holds the value is validated.

    The time needed does not grow with the scene. Unchanged parts and the bodies are the same objects as before: the
    caller updates the bodies and checks references between parts (`crosscheck`). Raises pydantic's own errors;
    `from_document` gives the full messages.

    Args:
        scene: not modified.
        path: such as `world.gravity` or `ball.*.friction`.
        value: as in TOML or JSON.

    Raises:
        ValueError: the path does not exist, or the value is invalid.
    """
    heading, *rest = parse_path(path)
    part = getattr(scene, _FIELDS.get(heading, ""), None)
    if isinstance(part, BaseModel) and rest:
        changed: Any = _with(part, rest, path, value)
    elif isinstance(part, tuple) and part and len(rest) > 1:
        names = [{} if each.name is None else {"name": each.name} for each in part if hasattr(each, "name")]
        names = names or [{} for _ in part]
        every = rest[0] == EVERY and {"name": EVERY} not in names
        indices = range(len(part)) if every else [index_of(names, (heading, rest[0]), path)]
        elements = list(part)
        for k in indices:
            elements[k] = _with(elements[k], rest[1:], path, value)
        changed = tuple(elements)
    else:
        raise AddressError(f"{path}: the scene has no such value")
    return scene.model_copy(update={_FIELDS[heading]: changed})


def _with(part: BaseModel, rest: list[str], path: str, value: Any) -> BaseModel:
    """Return a part of a scene with the value at the rest of a path changed."""
    document = part.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    assign_all(document, tuple(rest), path, value)
    if len(rest) > 1:
        return type(part).model_validate_json(to_json(document), by_alias=True, by_name=False)
    # Only the one value is copied: a session without steps has the duration 0, which a file may not have.
    if "duration" in document:
        document["duration"] = 1.0
    read = type(part).model_validate_json(to_json(document), by_alias=True, by_name=False)
    name = next(name for name, field in type(part).model_fields.items() if (field.alias or name) == rest[0])
    return part.model_copy(update={name: getattr(read, name)})
