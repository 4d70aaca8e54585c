"""Addresses: any value of a scene by its path, as `--set` and sweeps name it.

`solver.dt` · `world.gravity` · `ball.cue.velocity` · `ball.0.radius` · `ball."8 ball".mass` · `ball.*.restitution` ·
`pinball.bumper.*.speed`.
An element of a list is named by its `name`, by its number from 0, or, without a name, by what messages and tables call
it: `joint.joint-1.stiffness` is of the first joint. `*` means every one, where none is called so.
Numbers may stand in brackets, as faults write them: `drive[0].rate`, `ball.cue.velocity[1]`. A name that ends so itself
is quoted.
"""

import copy
import difflib
import re
import tomllib
from typing import Any

from sandbox.scene.faults import Location, quoted
from sandbox.scene.model import default_name

EVERY = "*"

_NUMBERED = re.compile(r"(.*?)((?:\[[0-9]+\])+)", re.DOTALL)


class AddressError(ValueError):
    """A path or value of an override that cannot be used; `str()` says what would be right."""


def parse_assignment(text: str) -> tuple[str, Any]:
    """Split `KEY=VALUE`; the value is TOML, a bare word a string.

    Raises:
        AddressError: there is no `=`, or no key before it.
    """
    key, equals, value = split_assignment(text)
    if not equals or not key.strip():
        raise AddressError(f"{text!r} is not KEY=VALUE, such as solver.dt=0.001 or ball.cue.velocity=[1,0]")
    return key.strip(), parse_value(value.strip())


def split_assignment(text: str) -> tuple[str, str, str]:
    """Split `KEY=VALUE` at the first `=` outside quotes into key, `=` and value."""
    quote = ""
    for k, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'" and text[:k].strip()[-1:] in ("", "."):  # as in paths: only where a part begins
            quote = letter
        elif letter == "=":
            return text[:k], "=", text[k + 1 :]
    return text, "", ""


def parse_value(text: str) -> Any:
    """Read a TOML value; what is no TOML value is a string."""
    try:
        document = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):  # also an integer of thousands of digits
        return text
    return document["value"] if set(document) == {"value"} else text


def parse_path(path: str) -> tuple[str, ...]:
    """Split a dotted path; quotes hold names together, as in TOML, and a number in brackets is a part of its own.

    Raises:
        AddressError: the path is malformed.
    """
    parts: list[str] = []
    rest = path
    while True:
        if rest[:1] in ('"', "'"):
            end = rest.find(rest[0], 1)
            if end < 0:
                raise AddressError(f"{path!r}: a quote is not closed")
            part, numbers, rest = rest[1:end], "", rest[end + 1 :]
        else:
            part, dot, after = rest.partition(".")
            numbered = _NUMBERED.fullmatch(part)
            part, numbers = numbered.groups() if numbered else (part, "")
            rest = dot + after
        if not part:
            raise AddressError(f"{path!r} is not a path, such as solver.dt or ball.cue.velocity")
        parts += [part, *numbers[1:-1].split("][")] if numbers else [part]
        if not rest:
            return tuple(parts)
        if rest[0] != ".":
            raise AddressError(f"{path!r}: a dot is missing after {part!r}")
        rest = rest[1:]


def assign(document: dict[str, Any], path: str, value: Any) -> tuple[dict[str, Any], Location]:
    """Return a copy of a scene document with one value set, and the location that was set.

    Of `*` the location is that of the list.

    Raises:
        AddressError: the path leads nowhere.
    """
    parts = parse_path(path)
    try:
        result = copy.deepcopy(document)
    except RecursionError:
        raise AddressError(f"{path}: the scene's values are nested too deeply") from None
    return result, assign_all(result, parts, path, value)


def assign_all(result: Any, parts: tuple[str, ...], path: str, value: Any) -> Location:
    """Set a value in place wherever a path leads, and return the location."""
    if EVERY not in parts[1:-1]:
        return _assign(result, parts, path, value)
    place = parts.index(EVERY, 1)
    elements, location = _followed(result, parts[:place])
    if not isinstance(elements, list) or EVERY in _names(elements):
        return _assign(result, parts, path, value)
    if not elements:
        raise AddressError(f"{path}: the scene has no [[{'.'.join(parts[:place])}]]")
    for element in elements:
        assign_all(element, parts[place + 1 :], path, value)
    return location


def _followed(here: Any, parts: tuple[str, ...]) -> tuple[Any, Location]:
    """Return what a path leads to, with its location; None where it leads nowhere."""
    location: Location = ()
    for part in parts:
        key: str | int = part
        if isinstance(here, list):
            try:
                key = index_of(here, parts[: len(location) + 1], "")
            except AddressError:
                return None, ()
        elif not isinstance(here, dict) or part not in here:
            return None, ()
        here, location = here[key], (*location, key)
    return here, location


def _assign(result: Any, parts: tuple[str, ...], path: str, value: Any) -> Location:
    """Set a value in place and return its location."""
    here: Any = result
    location: Location = ()
    for k, part in enumerate(parts):
        last = k == len(parts) - 1
        if isinstance(here, dict):
            if not last and part not in here:
                if k == 0 and _is_list(part):
                    raise AddressError(f"{path}: the scene has no [[{part}]]")
                meant = _meant(here, parts[k:])
                if k > 0 and k == len(parts) - 2 and parts[-1].isdecimal() and part in _keys(location):
                    whole = ".".join(parts[: k + 1])
                    raise AddressError(f"{path}: the scene does not state {whole}; set it as a whole, {whole}=…")
                if k > 0 or len(parts) != 2 or "an element" in meant:
                    raise AddressError(f"{path}: the scene has no {'.'.join(parts[: k + 1])}{meant}")
                here[part] = {}
            location += (part,)
            if last:
                here[part] = value
            else:
                here = here[part]
        elif isinstance(here, list):
            index = index_of(here, parts[: k + 1], path)
            location += (index,)
            if last:
                here[index] = value
            else:
                here = here[index]
        else:
            raise AddressError(f"{path}: {'.'.join(parts[:k])} is a single value, it has no {part!r}")
    return location


def index_of(elements: list[Any], parts: tuple[str, ...], path: str) -> int:
    """Return the index of a list's element, which the last part of a path names, or numbers."""
    part, kind = parts[-1], next((each for each in reversed(parts[:-1]) if not each.isdecimal()), "")
    names = element_names(elements, kind)
    if part in names:
        return names.index(part)
    if part.isdecimal() and len(part) < 10 and int(part) < len(elements):
        return int(part)
    before = ".".join(parts[:-1])
    if any(isinstance(e, dict) and part in e for e in elements) or part in _keys(parts[:-1]):
        rest = path[len(before) :].lstrip(".")
        named = f"{before}.{quoted(names[0] or '0')}.{rest}, or " if elements else ""
        raise AddressError(f"{path}: {before} is a list; name an element, such as {named}all by {before}.*.{rest}")
    some = [name for name in names if name is not None]
    maker = next((name for name in some if part.startswith(f"{name}-")), None)
    if maker is not None:
        raise AddressError(
            f"{path}: {part!r} is laid out by {before}.{quoted(maker)}, which has the keys for all of it"
        )
    close = difflib.get_close_matches(part, some, n=1)
    if close:
        raise AddressError(f"{path}: no element {part!r}; did you mean {close[0]!r}?")
    known = f"names: {', '.join(some[:10])}; " if some else ""
    numbers = "none" if not elements else "0" if len(elements) == 1 else f"0 to {len(elements) - 1}"
    raise AddressError(f"{path}: no element {part!r}; {known}numbers: {numbers}")


def element_names(elements: list[Any], kind: str) -> list[str | None]:
    """Return what each element of a list is called: its name or, without, its kind and place; None of what has none.

    Of two of one name only the first is called so.
    """
    names: list[str | None] = []
    stated = {e["name"] for e in elements if isinstance(e, dict) and isinstance(e.get("name"), str)}
    for k, element in enumerate(elements):
        name = element.get("name", default_name(kind, k)) if isinstance(element, dict) else None
        is_free = isinstance(name, str) and name not in names and ("name" in element or name not in stated)
        names.append(name if is_free else None)
    return names


def _keys(location: Location) -> list[str]:
    """Return the keys of a table by where it is; none where there is no such table."""
    from sandbox.scene.explain import TAGGED, keys_of, model_at  # only what cannot be followed needs these

    if location[:-1] == () and location[-1] in TAGGED:  # of several kinds
        return [key for model in TAGGED[str(location[-1])][0].values() for key in keys_of(model)]
    try:
        return keys_of(model_at(location))
    except (KeyError, StopIteration):
        return []


def _is_list(table: str) -> bool:
    """Tell whether a scene has many of a table."""
    from sandbox.scene.explain import list_tables  # as above

    return table in list_tables()


def _meant(document: Any, parts: tuple[str, ...]) -> str:
    """Return a hint for a path whose first part is no table of the scene: an element's name, or nearly a table's."""
    if not isinstance(document, dict):
        return ""
    for kind, elements in document.items():
        for name in element_names(elements, kind) if isinstance(elements, list) else ():
            if name is not None and (parts[0] == name or parts[0].startswith(f"{name}-")):
                part = "" if parts[0] == name else "part of "
                return f"; that is {part}an element: {'.'.join((kind, quoted(name), *parts[1:]))}"
    close = difflib.get_close_matches(parts[0], document, n=1)
    return f"; did you mean {'.'.join((*close, *parts[1:]))}?" if close else ""


def _names(elements: list[Any]) -> list[Any]:
    return [e.get("name") for e in elements if isinstance(e, dict)]
